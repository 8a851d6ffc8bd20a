#pragma once

/// @file
/// A grasp that slips: its wrench lies on its limit surface and opposes the relative motion of gripper and target
/// (docs/theory, section 8.7).

#include "grapnel/constraint/grasp_model.hpp"
#include "grapnel/dynamics/kinematics.hpp"

namespace grapnel {

/// Parts of the wrench of a grasp.
struct SlipParts {
  bool force = false, moment = false;

  bool any() const { return force || moment; }
  SlipParts& operator|=(const SlipParts& more) {
    force = force || more.force, moment = moment || more.moment;
    return *this;
  }
};

/// Friction of a grasp between frame C on body a (the end-effector) and body b (the target). A part whose limit is zero
/// does not slip; a closure holds it.
struct GraspSlip {
  int body_a;
  Posed X_AC;
  int body_b;
  Posed X_BD;             // frame on body b that coincided with C when the grasp closed
  double force = 0;       // limit while the force slips [N]
  double moment = 0;      // limit while the moment slips, about C [N m]
  bool separate = false;  // force and moment have separate limit surfaces (8.16a), not a common one (8.16)
  GraspModel model = GraspModel::rigid;  // of the grasp: rigid, hinge or point
  Vector3d hinge_C{0, 0, 1};             // unit axis of a hinge, about which it has no friction
  /// U_0 of (8.17), in C's axes: selects the direction of the wrench while the relative twist is zero.
  Twistd offset_C = Twistd::zero();

  SlipParts parts() const { return {force > 0, moment > 0}; }
};

/// Speed of one part of a slip over the slip resolution, in the power norm of its limit surface. With a common surface
/// both parts have the same.
struct SlipSpeed {
  double relative = 0;  // |V|
  double driven = 0;    // |V + U_0|; below 1 the wrench is inside the limit surface
};

/// Friction of a slipping grasp at an instant.
struct SlipState {
  Vector3d p_WC = Vector3d::zero();
  Wrenchd F_WC = Wrenchd::zero();  // on body a at C, in W
  Twistd V_C = Twistd::zero();     // of body a less body b at C, in C's axes; zero in directions that do not slip
  SlipSpeed force, moment;         // of the parts that slip
  double friction_power = 0;       // dissipated [W]
};

/// Speeds below which the wrench of a slipping grasp is proportional to them: of the force, and of the moment if only
/// this slips, or separately.
inline constexpr double kSlipResolution = 1e-6;  // [m/s], [rad/s]

/// U_0 for a grasp that holds the wrench F_C, on body a in C's axes, at the onset of slip. Reads the limits of `slip`.
Twistd slip_offset(const GraspSlip& slip, const Wrenchd& F_C);

/// Wrench (8.17) and relative motion. `kinematics` of the bodies' model.
SlipState slip_state(const GraspSlip& slip, const Kinematics& kinematics);

/// The closure of the parts that do not slip while `slipping` do.
struct HeldPart {
  bool any = false;                      // otherwise all parts slip that the grasp holds
  GraspModel model = GraspModel::rigid;  // of the closure
};
HeldPart held_part(GraspModel grasp, SlipParts slipping);

}  // namespace grapnel
