#include "grapnel/simulate/replay_controller.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace grapnel {

std::size_t joint_named(const Model& model, const std::string& name) {
  for (std::size_t j = 0; j < model.joints().size(); ++j) {
    if (model.joint_body(j).description.joint.name == name) return j;
  }
  throw ControllerError(fmt::format("the model has no joint '{}' to drive", name));
}

ReplayController::ReplayController(std::shared_ptr<const EffortLog> log, std::vector<std::string> joints, double period)
    : log_(std::move(log)), names_(std::move(joints)), same_(1e-6 * period) {
  const std::size_t rows = log_->times.size();
  const auto has_other_rows = [&](const std::vector<std::vector<double>>& columns) {
    return std::any_of(columns.begin(), columns.end(),
                       [&](const std::vector<double>& column) { return column.size() != rows; });
  };
  if (rows == 0 || log_->efforts.size() != names_.size() || has_other_rows(log_->efforts) ||
      has_other_rows(log_->wheel_torque) || has_other_rows(log_->gimbal_rate) || has_other_rows(log_->thruster) ||
      (log_->commands_actuators() && !log_->base_torque.empty()) ||
      (!log_->base_torque.empty() && log_->base_torque.size() != rows))
    throw std::invalid_argument("ReplayController: the log needs a column of each joint and a number in every row");
}

void ReplayController::begin_segment(const Model& model, double) {
  joints_.clear();
  for (const std::string& name : names_) joints_.push_back(joint_named(model, name));
}

// Sample time => command of the last log row not later than it: joint efforts, base torque and actuator commands.
// Before the first row the command does not change.
void ReplayController::update(const ControlInput& input, ControlCommand& command) {
  const std::vector<double>& times = log_->times;
  // Samples and rows are multiples of a period with different rounding.
  const auto next = std::upper_bound(times.begin(), times.end(), input.time + same_);
  if (next == times.begin()) return;
  const auto row = static_cast<std::size_t>(next - times.begin() - 1);
  for (std::size_t j = 0; j < joints_.size(); ++j) command.effort[joints_[j]] = log_->efforts[j][row];
  if (!log_->base_torque.empty()) command.base_torque = log_->base_torque[row];
  const auto copy_row = [&](const std::vector<std::vector<double>>& columns, std::vector<double>& values) {
    values.clear();
    for (const std::vector<double>& column : columns) values.push_back(column[row]);
  };
  copy_row(log_->wheel_torque, command.actuators.wheel_torque);
  copy_row(log_->gimbal_rate, command.actuators.gimbal_rate);
  copy_row(log_->thruster, command.actuators.thruster);
}

}  // namespace grapnel
