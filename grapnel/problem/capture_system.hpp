#pragma once

/// @file
/// The mechanical system of a capture problem: servicer and targets in one model, and the indices of their parts.

#include <stdexcept>
#include <string>
#include <vector>

#include "grapnel/constraint/loop_closure.hpp"
#include "grapnel/dynamics/state.hpp"
#include "grapnel/problem/body_address.hpp"
#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/simulate/controller_source.hpp"
#include "grapnel/simulate/grasp_slip.hpp"

namespace grapnel {

/// Thrown if a problem contradicts itself (names, sizes, settings); what() lists all errors, one per line. Scenario
/// files are checked earlier; this is for programs.
class CaptureProblemError : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;
};

/// Names in the model: a robot's bodies keep theirs; a target's body and frame are called "target:NAME", since a target
/// may have the name of a link.
std::string target_body_name(const std::string& target);

/// The parts of the problem that a user-defined controller reads and commands. Base, joints, gravity and the frame of
/// the computation are not set.
ControlledRobot controlled_parts(const CaptureProblem& problem);

/// A closed grasp in a model: frame C on body a of the robot and frame D on body b, the target, are kept together.
struct HeldGrasp {
  std::size_t grasp = 0;  // in CaptureProblem::grasps
  LoopClosure frames;
  Posed X_BD_closing = Posed::identity();  // frames.X_BD when the grasp closed, in the target's own frame
  static constexpr int kInTree = -1, kRedundant = -2;
  /// Index in CaptureSystem::closures. kInTree: it carries the target, as a joint of the tree. kRedundant: its bodies
  /// are already one rigid body with the target, by another grasp.
  int closure = kInTree;
};

/// A grasp in a model that slips: friction between its frames, and a closure of the part that does not slip.
struct SlippingGrasp {
  std::size_t grasp = 0;  // in CaptureProblem::grasps
  GraspSlip slip;
  LoopClosure frames;  // of the closure: point if only the moment slips; orientation or axis if only the force does
  bool has_closure = false;
  /// Index in CaptureSystem::closures; kNone: it has no closure, or both bodies are on one link.
  static constexpr int kNone = -1;
  int closure = kNone;
};

/// Model and indices before the capture, and, rebuilt by join_targets(), after it.
struct CaptureSystem {
  Model model;
  int base;                                // body
  std::vector<int> end_effectors;          // frames, in the robot's order
  std::vector<int> target_frames;          // the targets' own frames, in the problem's order
  std::vector<int> robot_joints;           // positions in Model::joints() of the robot's driven ones
  std::vector<int> wheels = {};            // of its wheels, in the robot's order
  std::vector<HeldGrasp> grasps = {};      // closed grasps; none before the capture
  std::vector<LoopClosure> closures = {};  // of grasps beyond the first of a target, then of slipping grasps
  std::vector<SlippingGrasp> slips = {};   // grasps that slip
  /// Positions in Model::joints() of a control moment gyro.
  struct Gyro {
    int gimbal = -1, rotor = -1;
  };
  std::vector<Gyro> gyros = {};             // in the robot's order
  std::vector<int> elastic_joints = {};     // indices in Model::joints() of joints with springs, which are not driven
  std::vector<BodyAddress> addresses = {};  // per body of the model
};

/// The name of a body in the models of a problem. @throws std::out_of_range for an unknown target.
std::string name_in_model(const CaptureProblem& problem, const BodyName& body);
/// The name of a body in messages and results: without the prefix of a target.
std::string shown_name(const CaptureProblem& problem, const BodyName& body);
std::string shown_name(const CaptureSystem& system, int body);

/// The addresses of a model's bodies, from the wheels, gyros and targets of the problem and the bodies of `robot`.
std::vector<BodyAddress> body_addresses(const CaptureProblem& problem, const RobotSetup& robot, const Model& model,
                                        bool with_targets);
/// The body of that name, or -1: the system has none.
int body_named(const CaptureSystem& system, const BodyName& body);
/// The body with that address; -1: the system has none.
int body_at(const CaptureSystem& system, const BodyAddress& address);
/// The body of a target itself, without its panels. `target`: in CaptureProblem::targets.
int target_body_index(const CaptureSystem& system, std::size_t target);
/// The same, followed by the pieces of its panels.
std::vector<int> bodies_of_target(const CaptureSystem& system, std::size_t target);
bool belongs_to_target(const CaptureSystem& system, int body, std::size_t target);
/// Whether a body is a target or a part of one.
bool belongs_to_targets(const CaptureSystem& system, int body);
/// Whether a body is a wheel or a part of a gyro, which has no shape and no contacts.
bool is_inside_base(const CaptureSystem& system, int body);

/// A shape in the frame of a body of the model.
struct PlacedShape {
  int body;
  Geometry geometry;
};
/// All shapes of the robot, the targets and their panels, in a system of the problem.
std::vector<PlacedShape> shapes_in_model(const CaptureProblem& problem, const CaptureSystem& system);

/// Checks names, sizes and ranges and builds servicer and free targets. problem_conflicts() finds contradictions
/// between parts of the problem. @throws CaptureProblemError, ModelError.
CaptureSystem make_capture_system(const CaptureProblem& problem);

/// The name of a wheel's body and joint in the model; a wheel may have the name of a link.
std::string wheel_body_name(const std::string& wheel);
/// Likewise for a gyro's gimbal and its rotor.
std::string gimbal_body_name(const std::string& gyro);
std::string gyro_rotor_body_name(const std::string& gyro);

/// The servicer alone, for planning: wheels and gyros are fixed parts of the base, and flexible parts are at rest.
CaptureSystem make_servicer(const CaptureProblem& problem);
/// The same with moving wheels and gyros, and with springs.
CaptureSystem make_moving_servicer(const CaptureProblem& problem);
/// The state of such a servicer as one of make_servicer(): poses, velocities of base and driven joints.
State without_inner_motion(const CaptureSystem& with, const State& state, const CaptureSystem& without);

/// The error in the inertia of wheels and gyros relative to the base that carries them; empty: none.
std::string wheel_fault(const RobotSetup& robot);

/// The problem's initial base pose and twist (or momentum) and joint state, in a model of the servicer, with or without
/// targets; targets are at the origin at rest.
State initial_servicer_state(const CaptureProblem& problem, const CaptureSystem& system);

/// Pose of a body's own frame, as in the problem, in the model's body: for a target that hangs on an arm, the model
/// body's origin is the contact point. The identity for all bodies but targets.
Posed own_frame(const CaptureSystem& system, int body);

/// Body description of a free target.
BodyDescription target_body(const TargetSetup& target);

}  // namespace grapnel
