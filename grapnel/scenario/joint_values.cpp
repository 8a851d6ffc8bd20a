#include "grapnel/scenario/joint_values.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "grapnel/scenario/plausibility.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {
namespace {

std::string names_of(const std::vector<JointDescription>& joints) {
  std::vector<std::string> names;
  for (const JointDescription& joint : joints) names.push_back(joint.name);
  return some_of(names);
}

// Calls visit(joint index, value, place, path) for every number that belongs to a joint.
template <class Visit>
void for_each_value(const Node& node, const std::string& path, const ReadRobot& robot, Visit visit) {
  if (node.is_sequence() && robot.order_known && node.items.size() == robot.joints.size()) {
    for (std::size_t i = 0; i < node.items.size(); ++i) {
      if (const auto value = number_of(node.items[i])) {
        visit(i, *value, node.items[i].mark,
              fmt::format("{} (joint {})", item(path, i), in_quotes(robot.joints[i].name)));
      }
    }
  }
  for (const NodeEntry& entry : node.entries) {
    const auto it = robot.joint_index.find(entry.key);
    const auto value = number_of(entry.value);
    if (it != robot.joint_index.end() && value)
      visit(it->second, *value, entry.value.mark, below(path, shortened(entry.key)));
  }
}

// "; 30 degrees are 0.523598776" where an angle is larger than a turn and would be within the limits as degrees.
std::string degrees_advice(const JointDescription& joint, double value) {
  const double as_degrees = value * std::numbers::pi / 180;
  const bool fits = as_degrees >= joint.limits.lower && as_degrees <= joint.limits.upper;
  if (!turns_about_axis(joint.type) || !fits || std::abs(value) <= 2 * std::numbers::pi || std::abs(value) > 720)
    return {};
  return fmt::format("; it is in rad, {} degrees are {:.9g}", value, as_degrees);
}

void check_names(const Node& node, const std::string& path, const ReadRobot& robot, bool all, FaultList& faults) {
  for (const NodeEntry& entry : node.entries) {
    if (robot.fixed_joints.contains(entry.key)) {
      faults.add(entry.mark, fmt::format("joint {} in {} is fixed and has no value", in_quotes(entry.key), path));
    } else {
      robot.joint_names.expect(entry.key, entry.mark, path, faults);
    }
  }
  if (!all || !robot.count_known()) return;
  std::vector<JointDescription> missing;
  std::set<std::string, std::less<>> given;
  for (const NodeEntry& entry : node.entries) {
    given.insert(entry.key);
    // A misspelt name has been reported with what was meant.
    if (!robot.joint_names.contains(entry.key)) given.insert(nearest(entry.key, robot.joint_names.names()));
  }
  for (const JointDescription& joint : robot.joints) {
    if (!given.contains(joint.name)) missing.push_back(joint);
  }
  if (!missing.empty()) faults.add(node.mark, fmt::format("{} lacks joints: {}", path, names_of(missing)));
}

// Names of a mapping, the length of a list.
void check_joints(const Node& node, const std::string& path, const ReadRobot& robot, bool all, FaultList& faults) {
  const std::size_t count = robot.joints.size();
  if (node.is_mapping()) check_names(node, path, robot, all, faults);
  if (node.is_sequence() && robot.count_known() && node.items.size() != count) {
    faults.add(node.mark,
               fmt::format("{} has {}, must have {}, one for each moving joint{}", path,
                           counted(node.items.size(), "item"), count, count > 0 ? ": " + names_of(robot.joints) : ""));
  }
}

}  // namespace

std::vector<const Node*> joint_nodes(const Node& node, const std::string& path, const ReadRobot& robot,
                                     FaultList& faults) {
  check_joints(node, path, robot, true, faults);
  if (!robot.order_known) return {};
  std::vector<const Node*> nodes(robot.joints.size());
  for (std::size_t i = 0; i < node.items.size() && i < nodes.size(); ++i) nodes[i] = &node.items[i];
  for (const NodeEntry& entry : node.entries) {
    const auto it = robot.joint_index.find(entry.key);
    if (it != robot.joint_index.end()) nodes[it->second] = &entry.value;
  }
  if (std::find(nodes.begin(), nodes.end(), nullptr) != nodes.end()) return {};
  return nodes;
}

std::optional<std::vector<double>> joint_values(const Node& node, const std::string& path, const ReadRobot& robot,
                                                std::optional<double> absent, FaultList& faults) {
  const std::size_t count = robot.joints.size();
  if (const auto one = number_of(node)) return std::vector<double>(count, *one);
  check_joints(node, path, robot, !absent, faults);
  if (!robot.order_known || (!node.is_mapping() && !node.is_sequence())) return {};
  std::vector<double> values(count, absent.value_or(0));
  for_each_value(node, path, robot,
                 [&](std::size_t i, double value, const Mark&, const std::string&) { values[i] = value; });
  return values;
}

void check_position_limits(const Node& node, const std::string& path, const ReadRobot& robot, FaultList& faults) {
  for_each_value(node, path, robot, [&](std::size_t i, double value, const Mark& mark, const std::string& name) {
    const JointLimits& limits = robot.joints[i].limits;
    if (value >= limits.lower && value <= limits.upper) {
      if (turns_about_axis(robot.joints[i].type)) doubt_angle(value, mark, name, faults);
      return;
    }
    faults.add(mark, fmt::format("{} is {}, beyond the joint's limits {} to {}{}", name, value, limits.lower,
                                 limits.upper, degrees_advice(robot.joints[i], value)));
  });
}

void check_agreement(const Node& node, const std::string& path, const ReadRobot& robot,
                     std::span<const double> expected, double tolerance, std::string_view source, FaultList& faults) {
  for_each_value(node, path, robot, [&](std::size_t i, double value, const Mark& mark, const std::string& name) {
    if (std::abs(value - expected[i]) <= tolerance) return;
    faults.add(mark, fmt::format("{} is {}, but {} {}; make them agree within {} or leave out {}", name, value, source,
                                 expected[i], tolerance, path));
  });
}

void check_rate_limits(const Node& node, const std::string& path, const ReadRobot& robot, FaultList& faults) {
  for_each_value(node, path, robot, [&](std::size_t i, double value, const Mark& mark, const std::string& name) {
    if (std::abs(value) <= robot.joints[i].limits.rate) {
      if (turns_about_axis(robot.joints[i].type)) doubt_angular_rate(value, mark, name, faults);
      return;
    }
    faults.add(mark,
               fmt::format("{} is {}, beyond the joint's rate limit {}", name, value, robot.joints[i].limits.rate));
  });
}

}  // namespace grapnel
