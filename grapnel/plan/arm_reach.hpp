#pragma once

/// @file
/// How far an arm reaches.

#include "grapnel/model/model.hpp"

namespace grapnel {

/// The longest way from the first joint of a frame's chain to the frame, prismatic joints at their limits, and that
/// joint's body. A chain without joints: body -1, and the way from the base's origin. Infinite with a prismatic joint
/// without limits.
struct ArmReach {
  int first_body = -1;
  double length = 0;  // [m]
};
ArmReach arm_reach(const Model& model, int frame);

}  // namespace grapnel
