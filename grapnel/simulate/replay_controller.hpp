#pragma once

/// @file
/// A controller that replays a log: what was commanded, row by row.

#include <memory>
#include <string>
#include <vector>

#include "grapnel/simulate/controller.hpp"

namespace grapnel {

/// Efforts over time, and what the base's actuators are told, each row's held until the next one's time.
struct EffortLog {
  std::vector<double> times;                 // [s], of the scenario; the first is 0, increasing
  std::vector<std::vector<double>> efforts;  // per joint of the robot, per time [N m or N]
  std::vector<Vector3d> base_torque;         // per time, on the base in its axes [N m]; empty: none is said
  /// Per actuator of the base, in the robot's order, per time, as ActuatorCommands; empty: nothing of its kind is told
  /// anything.
  std::vector<std::vector<double>> wheel_torque = {}, gimbal_rate = {}, thruster = {};
  bool tells_actuators() const { return !wheel_torque.empty() || !gimbal_rate.empty() || !thruster.empty(); }
};

/// Says the last row whose time has come, within a millionth of a period; the last one to the end.
/// Thread safety: as Controller.
class ReplayController final : public Controller {
 public:
  /// `joints`: names of the log's joints, in its order; `period`: between samples [s]. @throws std::invalid_argument if
  /// the log is empty, or has other joints or other
  /// numbers of rows, or tells a torque on the base and its actuators too.
  ReplayController(std::shared_ptr<const EffortLog> log, std::vector<std::string> joints, double period);
  /// @throws ControllerError if the model lacks a joint.
  void begin_piece(const Model& model, double time) override;
  void update(const ControlInput& input, ControlCommand& command) override;

 private:
  std::shared_ptr<const EffortLog> log_;
  std::vector<std::string> names_;
  double same_;                      // times nearer than this are one [s]
  std::vector<std::size_t> joints_;  // positions in Model::joints()
};

/// Position in Model::joints() of the joint with this name. @throws ControllerError if there is none.
std::size_t joint_named(const Model& model, const std::string& name);

}  // namespace grapnel
