#pragma once

/// @file
/// Kinds of grasp.

namespace grapnel {

/// rigid: 6 rows, the relative pose at contact is fixed. hinge: 5 rows, rotation about an axis of the end-effector is
/// free. point: 3 rows, rotation is free. Not in files, but the remaining constraints of grasps whose force slips:
/// orientation, 3 rows, of a rigid grasp; axis, 2 rows, of a hinge. Translation is free.
enum class GraspModel { rigid, hinge, point, orientation, axis };

/// Whether rotation about one axis is free.
constexpr bool turns_about_axis(GraspModel model) { return model == GraspModel::hinge || model == GraspModel::axis; }

}  // namespace grapnel
