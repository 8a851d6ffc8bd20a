#pragma once

/// @file
/// How an optimization moves what has no single value in a scenario: the contact point on a patch, the posture of the
/// arms. Each is a function on a CaptureProblem.

#include <string>
#include <utility>
#include <vector>

#include "grapnel/problem/capture_problem.hpp"

namespace grapnel {

/// Where a grasp point may be: in a plane through it. On a spherical target whose surface it is on it is projected onto
/// the sphere, and its directions and frame turn along.
struct ContactPatch {
  std::string target;
  std::string point;
  Vector3d u{1, 0, 0}, v{0, 1, 0};  // unit, perpendicular, in the target's frame
  double half_width_u = 0;          // [m]
  double half_width_v = 0;          // [m]
  bool is_disc = false;             // of radius half_width_u = half_width_v
};

/// Displacements along u and v for a place in the box of the half widths. Of a disc the square around it is mapped onto
/// it smoothly, its sides onto the circle: a sqrt(1 - b^2/2), b sqrt(1 - a^2/2) with a, b in -1 ... 1.
std::pair<double, double> on_patch(const ContactPatch& patch, double along_u, double along_v);

/// Moves the grasp point to a place in the box of the half widths [m].
void move_on_patch(const ContactPatch& patch, double along_u, double along_v, CaptureProblem& problem);

/// A configuration, and the directions in which all joints together can leave it while every end-effector keeps its
/// place and what its grasp's orientation asks for, the base floating: an orthonormal basis.
struct PostureSpace {
  std::vector<double> configuration;            // per joint [rad or m]
  std::vector<std::vector<double>> directions;  // per joint; none if the robot is not redundant
};

/// About the planned final configuration: the null space of the end-effectors' generalized Jacobian (2.5), without the
/// rows that the orientations leave free. @throws std::runtime_error if no configuration is found,
/// std::invalid_argument without approach.plan.
PostureSpace posture_space(const CaptureProblem& problem);

/// The planner is to find the solution nearest to the configuration moved by `coordinates`, one per direction.
void set_posture(const PostureSpace& space, const std::vector<double>& coordinates, CaptureProblem& problem);

}  // namespace grapnel
