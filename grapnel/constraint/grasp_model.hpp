#pragma once

/// @file
/// Kinds of grasp.

namespace grapnel {

/// rigid: 6 rows, the relative pose found at contact is kept. hinge: 5 rows, free to turn about an axis of the
/// end-effector. point: 3 rows, free to turn.
enum class GraspModel { rigid, hinge, point };

/// Rows a grasp adds to the constraints.
constexpr int row_count(GraspModel model) {
  return model == GraspModel::rigid ? 6 : model == GraspModel::hinge ? 5 : 3;
}

}  // namespace grapnel
