#pragma once

/// @file
/// A grasp that closes a loop of a model's tree or connects two trees: its frames on both bodies, and its closure
/// defect.

#include <span>
#include <string>

#include "grapnel/constraint/grasp.hpp"
#include "grapnel/dynamics/kinematics.hpp"

namespace grapnel {

/// Constrains frame C on body a and frame D on body b to coincide in the directions of its kind (row_count). Bodies a
/// and b belong to one model: to one tree, where other joints connect them, or to two trees.
struct LoopClosure {
  std::string name;  // for messages
  int body_a;        // carries the end-effector
  Posed X_AC;        // the grasp's frame on it
  int body_b;        // the target
  Posed X_BD;        // frame of the grasp on body b; C and D coincide if the loop is closed
  GraspModel model = GraspModel::rigid;
  Vector3d hinge_C{0, 0, 1};  // unit axis of a hinge, in C, and in D
};

/// Defect of a closure in its constrained directions.
struct ClosureDefect {
  double position = 0;          // distance of C and D [m]
  double angle = 0;             // [rad]
  double velocity = 0;          // of D against C, at C [m/s]
  double angular_velocity = 0;  // [rad/s]

  /// Componentwise maximum; NaN is kept.
  void raise(const ClosureDefect& other);
};
/// Defect from poses and twists of the bodies in W.
ClosureDefect closure_defect(const LoopClosure& closure, const Kinematics& kinematics);

/// Defect of a model's couplings (Model::couplings()) in a state: position or angle by the dependent joint.
ClosureDefect coupling_defects(const Model& model, const State& state);

/// Constrained rotation axes, in C: the angular rows. Returns their number: 3, 2 normals of a hinge, or 0 for a point.
int forbidden_turns(const LoopClosure& closure, Vector3d (&axes)[3]);

/// The wrench on body a at C, in C's axes, due to multipliers or impulses of one closure's rows.
Wrenchd closure_wrench(const LoopClosure& closure, std::span<const double> rows);

/// Total number of rows of all closures.
int closure_rows(std::span<const LoopClosure> closures);

}  // namespace grapnel
