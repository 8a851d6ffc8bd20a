#pragma once

/// @file
/// The model of a robot for the Python package, alone or with the free targets of a problem.

#include <Eigen/Core>
#include <filesystem>
#include <memory>
#include <string>

#include "arrays.hpp"
#include "grapnel/dynamics/forward_dynamics.hpp"
#include "grapnel/lanes/states.hpp"
#include "grapnel/problem/capture_system.hpp"
#include "problem.hpp"

namespace grapnel::python {

/// Immutable.
class Robot {
 public:
  /// From a robot file. @throws InputError
  explicit Robot(const std::filesystem::path& file);
  /// From a problem. @throws InputError
  Robot(const Scenario& scenario, bool targets);
  /// For a robot with targets: the robot with all grasps of the problem closed in the configuration q. Targets are
  /// attached to the arms that grasp them. @throws py::value_error without grasps that hold, or without targets.
  std::shared_ptr<Robot> holding(const py::object& q) const;

  const Model& model() const { return system_.model; }
  const CaptureSystem& system() const { return system_; }
  const CaptureProblem& problem() const { return *problem_; }
  bool has_problem() const { return has_problem_; }
  int root() const { return system_.base; }
  std::string name() const { return problem_->robot.name; }

  /// The body of a frame or body, and the pose of the frame on it. @throws py::value_error naming the available ones.
  struct Place {
    int body;
    Posed X_BE;
  };
  Place place(const std::string& name) const;
  /// Index of a body. @throws py::value_error
  int body(const std::string& name) const;

  /// An argument with rows of coordinates or velocities. @throws py::value_error, also for quaternions without unit
  /// norm
  Rows coordinates(const py::handle& q) const;
  Rows velocities(const py::handle& v, const char* name = "v") const;
  /// Joint efforts, or generalized forces on all velocities; None: zero.
  Rows forces(const py::object& tau) const;
  /// Expands forces() of case i to all velocities.
  void spread(const Rows& forces, std::int64_t i, double* generalized) const;
  /// @throws py::value_error naming a quaternion whose norm is not 1
  void check_quaternions(const Rows& q) const;
  /// Copies the coordinates of case i and normalizes quaternions with rounding errors.
  void put_coordinates(const Rows& q, std::int64_t i, double* to) const;
  /// Kinematics and dynamics in lanes.
  const lanes::States& states() const { return states_; }

 private:
  Robot(const Robot& free, CaptureSystem joined);

  std::shared_ptr<const CaptureProblem> problem_;
  bool has_problem_ = false;
  CaptureSystem system_;
  lanes::States states_;
};

/// Scratch memory for the cases of one worker.
struct Scratch {
  State state;
  Workspace workspace;
  Kinematics kinematics;
  Eigen::MatrixXd mass_matrix;
  std::vector<double> generalized, rates;
  // For a block of cases in lanes: coordinates, forces, motion of links, mass matrices.
  std::vector<double> block_q, block_forces, block_motion, block_masses;
  explicit Scratch(const Model& model)
      : state(zero_state(model)),
        workspace(model),
        kinematics(model),
        generalized(static_cast<std::size_t>(model.velocities())) {}
};

/// Calls block(scratch, begin, end) for all cases, several batches of lanes at a time, on all processors if there are
/// many cases, without the interpreter's lock.
void for_blocks(const Robot& robot, const Cases& cases,
                const std::function<void(Scratch&, std::int64_t begin, std::int64_t end)>& block);
/// Calls one(scratch, i) for every case in the same way.
void for_cases(const Robot& robot, const Cases& cases, const std::function<void(Scratch&, std::int64_t)>& one);

void bind_constraints(py::class_<Robot, std::shared_ptr<Robot>>& robot, py::module_& module);
void bind_identify(py::class_<Robot, std::shared_ptr<Robot>>& robot, py::module_& module);
void bind_rollout(py::module_& module);

}  // namespace grapnel::python
