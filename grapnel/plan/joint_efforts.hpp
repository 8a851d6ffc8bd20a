#pragma once

/// @file
/// Efforts that joints need to follow a motion exactly while the base floats.
///
/// Inverse dynamics with the base not accelerated, vdot = [0; theta_ddot], gives tau_0 and the wrench F_0 that the base
/// would need. It gets none, so it accelerates by -I_c^-1 F_0, and the joints need
///   tau = tau_0 - I_bm^T I_c^-1 F_0                                                                               (1)
/// which is (2.8) without a mass matrix.
///
/// A weighted sum s = sum_j lambda_j tau_j is the power of the links' forces F_i = I_i A_i + V_i x* I_i V_i at virtual
/// twists U_i: those of joint rates lambda and of the base that has no momentum with them, U_0 = I_c^-1 . (-sum_j I^c_j
/// S_j lambda_j). With a_j the inertia of joint j's rotor,
///   s = sum_i U_i . F_i + sum_j a_j lambda_j theta_ddot_j                                                         (2)
/// Its derivatives in all joints take two sweeps, as s does (reverse differentiation). Everything is seen from B about
/// its origin. From the tips to the root, a link's wrenches per change of A, U and V add up, those of its own being
///   A*_i = I_i U_i,   U*_i = F_i,   V*_i = I_i (U_i x V_i) - U_i x* (I_i V_i) + theta_dot_i S_i x* A*_i           (3)
/// with A*_i that of all that joint i carries in the last term, which comes from A_i = A_p + S_i theta_ddot_i + V_i x
/// S_i theta_dot_i. The joint then contributes, p its parent and for a joint that turns all it carries,
///   ds/dtheta_ddot_i = A*_i . S_i + a_i lambda_i,   ds/dtheta_dot_i = V*_i . S_i + A*_i . (V_i x S_i)
///   ds/dtheta_i = V*_i . (V_p x S_i) + U*_i . (U_p x S_i) + A*_i . (A_p x S_i)                                    (4)
/// the last since s does not change when V_p, U_p and A_p turn with all that the joint carries. At the root, where V_0
/// and U_0 depend on the joints by (3) of floating_base.hpp, V*_0 and U*_0 bring the rest.

#include <span>
#include <vector>

#include "grapnel/dynamics/forward_dynamics.hpp"
#include "grapnel/plan/floating_base.hpp"

namespace grapnel {

class JointEfforts {
 public:
  /// `base` is shared scratch and must outlive the object. `gravity` in W [m/s^2] matters where the base does not
  /// float.
  JointEfforts(FloatingBase& base, const Vector3d& gravity);

  /// Per joint [N m or N], without friction. `h_B`: momentum about B's origin in B, not read where the base does not
  /// float.
  void evaluate(std::span<const double> position, std::span<const double> rate, std::span<const double> acceleration,
                const Posed& X_WB, const Momentumd& h_B, std::span<double> effort);

  /// How a weighted sum of efforts changes with a motion.
  struct Gradient {
    std::vector<double> position, rate, acceleration;  // per joint
    double turn[3] = {0, 0, 0};                        // of the base, about the axes of W
  };
  /// Of a robot whose joints' rotors have no axes of their own; `weights` per joint, the rest as above. By (4), with
  /// h_B as it is while joints change, and in W while the base turns.
  /// @throws std::invalid_argument if some have.
  void differentiate(std::span<const double> position, std::span<const double> rate,
                     std::span<const double> acceleration, const Posed& X_WB, const Momentumd& h_B,
                     std::span<const double> weights, Gradient& gradient);

 private:
  // Of a link, for differentiate(), in B about B's origin.
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
