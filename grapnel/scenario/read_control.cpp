#include "grapnel/scenario/read_control.hpp"

#include <fmt/format.h>

#include "grapnel/scenario/joint_values.hpp"

namespace grapnel {
namespace {

// One number for all axes, or one for each.
Vector3d per_axis(const Node& node, std::string_view key, const Vector3d& absent) {
  if (const auto one = number_at(node, key)) return {*one, *one, *one};
  return vector_at(node, key).value_or(absent);
}

}  // namespace

void read_gains(const Node& node, const std::string& path, Reading& reading, std::vector<double>& kp,
                std::vector<double>& kd) {
  const auto gains = [&](const char* key) {
    return joint_values(part(node, key), below(path, key), reading.robot, {}, reading.faults)
        .value_or(std::vector<double>{});
  };
  kp = gains("kp");
  kd = gains("kd");
}

std::optional<BaseControlSetup> base_control_at(const Node& phase, const std::string& path, bool is_free,
                                                Reading& reading) {
  const NodeEntry* entry = phase.entry("base_control");
  if (!entry) return {};
  const std::string here = below(path, "base_control");
  if (!is_free) {
    const bool fixed = reading.robot.setup.base_mode == RobotSetup::Base::fixed;
    reading.faults.add(entry->mark, fmt::format("{}: the robot's base is {}, so its attitude needs no control", here,
                                                fixed ? "fixed" : "held"));
  }
  const Node& node = entry->value;
  BaseControlSetup control;
  control.kp = per_axis(node, "kp", control.kp);
  control.kd = per_axis(node, "kd", control.kd);
  control.limit = per_axis(node, "limit", control.limit);
  if (node.find("quaternion_wxyz") || node.find("rpy")) control.R_WD = pose_of(node, here, reading.faults).R;
  return control;
}

}  // namespace grapnel
