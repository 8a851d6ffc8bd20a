#pragma once

/// @file
/// A grasp: the components of the relative motion of an end-effector and a target that it constrains.

#include <Eigen/Core>
#include <span>

#include "grapnel/constraint/grasp_model.hpp"
#include "grapnel/dynamics/kinematics.hpp"

namespace grapnel {

/// Rows a grasp adds to the constraints.
constexpr int row_count(GraspModel model) {
  switch (model) {
    case GraspModel::rigid:
      return 6;
    case GraspModel::hinge:
      return 5;
    case GraspModel::axis:
      return 2;
    case GraspModel::point:
    case GraspModel::orientation:
      break;
  }
  return 3;
}
/// Those of them that constrain translations; they follow the angular ones.
constexpr int linear_row_count(GraspModel model) {
  return model == GraspModel::orientation || model == GraspModel::axis ? 0 : 3;
}

/// A grasp between two bodies at one common point.
struct Grasp {
  int robot_body;  // carries the end-effector
  int target_body;
  GraspModel model;
  Vector3d p_WC;     // the common point in W: action and reaction are taken there
  Vector3d hinge_W;  // unit axis in W; read for a hinge or an axis
};

/// Selects the constrained components of a relative twist [angular; linear] in W: rows x 6, orthonormal rows.
Eigen::MatrixXd constrained_directions(const Grasp& grasp);

/// Relative Jacobian of all grasps, stacked in order: rows x velocities. u = J v is the end-effector's twist at the
/// contact point minus the target's, in the constrained directions. Over robot and targets together, J M^-1 J^T is W of
/// docs/theory, equation (7.3), including the cross terms of a shared target.
Eigen::MatrixXd grasp_jacobian(const Model& model, const Kinematics& kinematics, std::span<const Grasp> grasps);

/// The target's part of the contact-space inertia, J_t M_t^-1 J_t^T of one grasp in its constrained directions:
/// velocity change of the free target per unit impulse of this grasp alone. rows x rows.
Eigen::MatrixXd target_mobility(const Model& model, const Kinematics& kinematics, const Grasp& grasp);

}  // namespace grapnel
