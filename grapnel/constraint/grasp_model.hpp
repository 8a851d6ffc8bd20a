#pragma once

/// @file
/// Kinds of grasp.

namespace grapnel {

/// rigid: 6 rows, the relative pose at contact is fixed. hinge: 5 rows, rotation about an axis of the end-effector is
/// free. point: 3 rows, rotation is free. orientation: 3 rows, translation is free; not in files, it is what remains of
/// a rigid grasp whose force slips.
enum class GraspModel { rigid, hinge, point, orientation };

}  // namespace grapnel
