#pragma once

/// @file
/// Efforts that joints need to follow a given motion exactly with a floating base.
///
/// Inverse dynamics with zero base acceleration, vdot = [0; theta_ddot], gives tau_0 and the wrench F_0 required at the
/// base. No such wrench acts, so the base accelerates by -I_c^-1 F_0, and the joints need
///   tau = tau_0 - I_bm^T I_c^-1 F_0                                                                               (1)
/// which is (2.8) without a mass matrix.
///
/// A weighted sum s = sum_j lambda_j tau_j is the power of the links' forces F_i = I_i A_i + V_i x* I_i V_i at virtual
/// twists U_i. These are the twists of joint rates lambda and of the base with zero momentum, U_0 = I_c^-1 . (-sum_j
/// I^c_j S_j lambda_j). With a_j the inertia of joint j's rotor,
///   s = sum_i U_i . F_i + sum_j a_j lambda_j theta_ddot_j                                                         (2)
/// Its derivatives with respect to all joints take two sweeps, as s does (reverse differentiation). All quantities are
/// expressed in B about its origin. From the tips to the root, a link's derivatives with respect to A, U and V
/// accumulate; the contributions of the link itself are
///   A*_i = I_i U_i,   U*_i = F_i,   V*_i = I_i (U_i x V_i) - U_i x* (I_i V_i) + theta_dot_i S_i x* A*_i           (3)
/// The last term uses A*_i of all links that joint i carries and results from A_i = A_p + S_i theta_ddot_i + V_i x S_i
/// theta_dot_i. With p the parent and, for a revolute joint, all links that it carries, the joint's derivatives are
///   ds/dtheta_ddot_i = A*_i . S_i + a_i lambda_i,   ds/dtheta_dot_i = V*_i . S_i + A*_i . (V_i x S_i)
///   ds/dtheta_i = V*_i . (V_p x S_i) + U*_i . (U_p x S_i) + A*_i . (A_p x S_i)                                    (4)
/// The last line holds since s is invariant if V_p, U_p and A_p rotate with all links that the joint carries. At the
/// root, V_0 and U_0 depend on the joints by (3) of floating_base.hpp; V*_0 and U*_0 give the corresponding
/// contributions.

#include <span>
#include <vector>

#include "grapnel/dynamics/forward_dynamics.hpp"
#include "grapnel/plan/floating_base.hpp"

namespace grapnel {

class JointEfforts {
 public:
  /// `base` is shared scratch and must outlive the object. `gravity` in W [m/s^2] is used only if the base does not
  /// float.
  JointEfforts(FloatingBase& base, const Vector3d& gravity);

  /// Efforts per joint [N m or N], without friction. `h_B`: momentum about B's origin in B, not read if the base does
  /// not float.
  void evaluate(std::span<const double> position, std::span<const double> rate, std::span<const double> acceleration,
                const Posed& X_WB, const Momentumd& h_B, std::span<double> effort);

  /// Derivatives of a weighted sum of efforts.
  struct Gradient {
    std::vector<double> position, rate, acceleration;  // per joint
    double turn[3] = {0, 0, 0};                        // rotation of the base, about the axes of W
  };
  /// Derivatives by (4) for a robot whose rotors have no stated axes; `weights` per joint, other arguments as above.
  /// h_B is constant for changes of joint values, and constant in W for rotations of the base. @throws
  /// std::invalid_argument if a rotor has a stated axis.
  void differentiate(std::span<const double> position, std::span<const double> rate,
                     std::span<const double> acceleration, const Posed& X_WB, const Momentumd& h_B,
                     std::span<const double> weights, Gradient& gradient);

 private:
  // Quantities of one link for differentiate(), in B about B's origin.
  struct Sweep {
    Twistd V, U;
    SpatialAccelerationd A;
    Wrenchd per_A, per_U, per_V;
  };

  FloatingBase& base_;
  std::vector<Sweep> sweep_;
  Workspace workspace_;
  State state_;
  Forces forces_;
  std::vector<double> vdot_, tau_;
};

}  // namespace grapnel
