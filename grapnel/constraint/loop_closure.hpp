#pragma once

/// @file
/// A grasp that closes a loop of a model's tree, or ties two trees: where it is on both bodies, and how far they are
/// off.

#include <span>
#include <string>

#include "grapnel/constraint/grasp.hpp"
#include "grapnel/dynamics/kinematics.hpp"

namespace grapnel {

/// Keeps frame C on body a and frame D on body b together in the directions of its kind (row_count). Bodies a and b
/// belong to one model: to one tree, whose own joints connect them otherwise, or to two.
struct LoopClosure {
  std::string name;  // for messages
  int body_a;        // carries the end-effector
  Posed X_AC;        // the grasp's frame on it
  int body_b;        // the target
  Posed X_BD;        // the grasp's frame on it: C and D coincide where the loop is closed
  GraspModel model = GraspModel::rigid;
  Vector3d hinge_C{0, 0, 1};  // unit axis of a hinge, in C, and in D
};

/// How far a closure is from being closed, in the directions that it forbids.
struct ClosureDefect {
  double position = 0;          // distance of C and D [m]
  double angle = 0;             // [rad]
  double velocity = 0;          // of D against C, at C [m/s]
  double angular_velocity = 0;  // [rad/s]

  /// Takes the larger of each; a NaN stays.
  void raise(const ClosureDefect& other);
};
/// From poses and twists of the bodies in W.
ClosureDefect closure_defect(const LoopClosure& closure, const Kinematics& kinematics);

/// Directions, in C, in which a closure forbids turning: its angular rows. How many: 3, 2 normals of a hinge, or none.
int forbidden_turns(const LoopClosure& closure, Vector3d (&axes)[3]);

/// The wrench on body a at C, in C's axes, of multipliers or impulses of one closure's rows.
Wrenchd closure_wrench(const LoopClosure& closure, std::span<const double> rows);

/// Rows of all closures.
int closure_rows(std::span<const LoopClosure> closures);

}  // namespace grapnel
