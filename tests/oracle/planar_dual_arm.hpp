#pragma once

/// @file
/// The planar robot of the thesis's Fig. 2.3, derived by hand: a free base, two links on arm 1, one on arm 2.
/// Independent of Grapnel (includes none of it).
///
/// Derivation. Coordinates: base centre r0 = (x0, y0), base angle t0, joint angles t1, t2 (arm 1), t3 (arm 2). Absolute
/// angles of base and links:
///   f0 = t0,  f1 = t0 + t1,  f2 = t0 + t1 + t2,  f3 = t0 + t3. (1)
/// With e(f) = (cos f, sin f) and n(f) = e'(f) = (-sin f, cos f), the links' centres of mass are
///   r1 = r0 + b1 e(f0) + d1 e(f1),  r2 = r0 + b1 e(f0) + a1 e(f1) + d2 e(f2),  r3 = r0 + b2 e(f0) + d3 e(f3): (2)
/// b1, b2 are the mounts' positions along the base's x axis, d the centres' distances along the links, a1 link 1's
/// length. All may be negative: a link with negative lengths points along -x at zero angle. Velocities: differentiate
/// (2); every e(f) becomes f' n(f). The kinetic energy sum m |v|^2 / 2 + I f'^2 / 2 is then
///   T = m |v0|^2 / 2 + v0 . sum_j k_j f_j' n(f_j) + sum_jl K_jl f_j' f_l' cos(f_j - f_l) / 2 (3)
/// with m = m0 + m1 + m2 + m3 and
///   k0 = b1 (m1 + m2) + b2 m3,  k1 = m1 d1 + m2 a1,  k2 = m2 d2,  k3 = m3 d3, (4) K00 = I0 + b1^2 (m1 + m2) + b2^2 m3,
///   K11 = I1 + m1 d1^2 + m2 a1^2,  K22 = I2 + m2 d2^2,  K33 = I3 + m3 d3^2, K01 = b1 k1,  K02 = b1 k2,  K12 = a1 k2,
///   K03 = b2 k3,  K13 = K23 = 0.                                              (5)
/// Lagrange's equations in (r0, f): for r0 and for each f_j, with f and Q_j the forces on them,
///   m r0'' + sum_j k_j (f_j'' n(f_j) - f_j'^2 e(f_j)) = f, (6) k_j n(f_j) . r0'' + sum_l K_jl (f_l'' cos(f_j - f_l) +
///   f_l'^2 sin(f_j - f_l)) = Q_j.                                (7)
/// In (7) d/dt (dT/df_j') brings k_j f_j' v0 . n'(f_j), and -dT/df_j its negative: no product of v0 with a rate is
/// left. Joint angles: (1) is f = A t, so the joints' equations are A^T times (7): rows of links beyond a joint add up.
/// (8)

#include <Eigen/Core>

namespace grapnel::oracle {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

struct PlanarDualArm {
  double m0, m1, m2, m3;  // [kg]
  double I0, I1, I2, I3;  // about the centres of mass [kg m^2]
  double b1, b2;          // mounts on the base's x axis [m]
  double a1, a2, a3;      // lengths [m]
  double d1, d2, d3;      // centres of mass along the links [m]

  double mass() const { return m0 + m1 + m2 + m3; }
  Eigen::Vector4d k() const;  // (4)
  Eigen::Matrix4d K() const;  // (5)
};

/// (x0, y0, t0, t1, t2, t3) and its rates, the order of (B.9).
struct PlanarState {
  Vector6 q, rate;
};

/// [I_b I_bm; I_bm^T I_m] and [c_b; c_m] of (B.9), by (6)-(8), every entry written out.
Matrix6 mass_matrix(const PlanarDualArm& robot, const Vector6& q);
Vector6 bias(const PlanarDualArm& robot, const PlanarState& state);
/// T straight from (2), differentiated by hand, without (3)-(5).
double kinetic_energy(const PlanarDualArm& robot, const PlanarState& state);
/// (p_x, p_y, l) with the angular momentum l about the base's centre.
Eigen::Vector3d momentum(const PlanarDualArm& robot, const PlanarState& state);
/// The contribution of the joint rates to the linear momentum: p = m v0 + ... + J rates, 2 x 3 (the thesis's J_Tg).
Eigen::Matrix<double, 2, 3> joint_momentum(const PlanarDualArm& robot, const Vector6& q);
/// Position and angle of the tip of arm 1 or 2, and their Jacobian by (x0, y0, t0, t1, t2, t3) (A.1)-(A.3).
Eigen::Vector3d tip(const PlanarDualArm& robot, const Vector6& q, int arm);
Eigen::Matrix<double, 3, 6> tip_jacobian(const PlanarDualArm& robot, const Vector6& q, int arm);

}  // namespace grapnel::oracle
