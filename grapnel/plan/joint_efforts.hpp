#pragma once

/// @file
/// Efforts that joints need to follow a motion exactly while the base floats.
///
/// Inverse dynamics with the base not accelerated, vdot = [0; theta_ddot], gives tau_0 and the wrench F_0 that the base
/// would need. It gets none, so it accelerates by -I_c^-1 F_0, and the joints need
///   tau = tau_0 - I_bm^T I_c^-1 F_0                                                                               (1)
/// which is (2.8) without a mass matrix.

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

 private:
  FloatingBase& base_;
  Workspace workspace_;
  State state_;
  Forces forces_;
  std::vector<double> vdot_, tau_;
};

}  // namespace grapnel
