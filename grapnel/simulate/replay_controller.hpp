#pragma once

/// @file
/// A controller that replays a log of commands, row by row.

#include <memory>
#include <string>
#include <vector>

#include "grapnel/simulate/controller.hpp"

namespace grapnel {

/// Logged efforts, and commands of the base's actuators; each row is held until the time of the next.
struct EffortLog {
  std::vector<double> times;                 // [s], of the scenario; the first is 0, increasing
  std::vector<std::vector<double>> efforts;  // per joint of the robot, per time [N m or N]
  std::vector<Vector3d> base_torque;         // per time, on the base in its axes [N m]; empty: none
  /// Per actuator of the base, in the robot's order, per time, as in ActuatorCommands; empty: no commands of this kind.
  std::vector<std::vector<double>> wheel_torque = {}, gimbal_rate = {}, thruster = {};
  bool tells_actuators() const { return !wheel_torque.empty() || !gimbal_rate.empty() || !thruster.empty(); }
};

/// Returns the last row whose time has been reached, within a millionth of a period; after the end the last row. Thread
/// safety: as Controller.
class ReplayController final : public Controller {
 public:
  /// `joints`: names of the log's joints, in its order; `period`: between samples [s]. @throws std::invalid_argument if
  /// the log is empty, or has other joints or other numbers of rows, or commands both a torque on the base and its
  /// actuators.
  ReplayController(std::shared_ptr<const EffortLog> log, std::vector<std::string> joints, double period);
  /// @throws ControllerError if the model lacks a joint.
  void begin_piece(const Model& model, double time) override;
  void update(const ControlInput& input, ControlCommand& command) override;

 private:
  std::shared_ptr<const EffortLog> log_;
  std::vector<std::string> names_;
  double same_;                      // times that differ by less are equal [s]
  std::vector<std::size_t> joints_;  // positions in Model::joints()
};

/// Index in Model::joints() of the joint with this name. @throws ControllerError if there is none.
std::size_t joint_named(const Model& model, const std::string& name);

}  // namespace grapnel
