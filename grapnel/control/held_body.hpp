#pragma once

/// @file
/// A held target in control laws: one rigid body, or a rigid body with panels in their present shape.

#include <span>

#include "grapnel/dynamics/kinematics.hpp"

namespace grapnel {

/// Bodies of a model treated as one rigid body, in their present shape. In W.
struct HeldBody {
  double mass = 0;                            // [kg]
  Vector3d com = Vector3d::zero();            // [m]
  Symmetric3d inertia = Symmetric3d::zero();  // about the centre of mass, W's axes [kg m^2]
  Twistd motion = Twistd::zero();             // of the first body, at the centre of mass
};
/// `bodies`: the target, followed by its panels, whose relative motion is neglected. At least one.
HeldBody held_body(const Model& model, const Kinematics& kinematics, std::span<const int> bodies);

/// Motion of the target.
struct TargetMotion3d {
  Vector3d angular_momentum;  // L_t, about its centre of mass, in W [N m s]
  Vector3d velocity;          // of its centre of mass, relative to that of its tree, in W [m/s]
};
TargetMotion3d target_motion(const Model& model, const Kinematics& kinematics, std::span<const int> bodies);

}  // namespace grapnel
