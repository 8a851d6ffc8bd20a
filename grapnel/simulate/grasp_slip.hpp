#pragma once

/// @file
/// A grasp that slips: its wrench lies on its limit surface and opposes the relative motion of gripper and target
/// (docs/theory, section 8.7).

#include "grapnel/dynamics/kinematics.hpp"

namespace grapnel {

/// Friction of a grasp between frame C on body a (the end-effector) and body b (the target). A part whose limit is zero
/// does not slip; a closure holds it.
struct GraspSlip {
  int body_a;
  Posed X_AC;
  int body_b;
  Posed X_BD;         // frame on body b that coincided with C when the grasp closed
  double force = 0;   // limit while the force slips [N]
  double moment = 0;  // limit while the moment slips, about C [N m]
  /// U_0 of (8.17), in C's axes: selects the direction of the wrench while the relative twist is zero.
  Twistd offset_C = Twistd::zero();
};

/// Friction of a slipping grasp at an instant.
struct SlipState {
  Vector3d p_WC = Vector3d::zero();
  Wrenchd F_WC = Wrenchd::zero();  // on body a at C, in W
  Twistd V_C = Twistd::zero();     // of body a less body b at C, in C's axes; zero in parts that do not slip
  double speed = 0;                // |V| over the slip resolution; both in the power norm of (8.16)
  double driven_speed = 0;         // |V + U_0| likewise; below 1 the wrench is inside the limit surface
  double friction_power = 0;       // dissipated [W]
};

/// Speeds below which the wrench of a slipping grasp is proportional to them: of the force, and of the moment if only
/// this slips.
inline constexpr double kSlipResolution = 1e-6;  // [m/s], [rad/s]

/// U_0 for a grasp that holds the wrench F_C, on body a in C's axes, at the onset of slip. Reads the limits of `slip`.
Twistd slip_offset(const GraspSlip& slip, const Wrenchd& F_C);

/// Wrench (8.17) and relative motion. `kinematics` of the bodies' model.
SlipState slip_state(const GraspSlip& slip, const Kinematics& kinematics);

}  // namespace grapnel
