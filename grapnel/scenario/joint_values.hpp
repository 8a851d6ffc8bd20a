#pragma once

/// @file
/// Values per joint: a mapping by joint name, a list in joint order, or one number for all.

#include <span>

#include "grapnel/scenario/read_robot.hpp"

namespace grapnel {

/// Values in joint order. A joint that a mapping leaves out gets `absent`, or is a fault if there is no such value.
/// Empty where faults leave values or order in doubt; names and lengths are checked even then.
std::optional<std::vector<double>> joint_values(const Node& node, const std::string& path, const ReadRobot& robot,
                                                std::optional<double> absent, FaultList& faults);

/// What stands for each joint, in joint order. Empty where faults leave the order in doubt.
std::vector<const Node*> joint_nodes(const Node& node, const std::string& path, const ReadRobot& robot,
                                     FaultList& faults);

/// Reports values beyond the joints' position limits.
void check_position_limits(const Node& node, const std::string& path, const ReadRobot& robot, FaultList& faults);
/// Reports values that are not those of `expected`, in joint order, within the tolerance. `source` says whose these
/// are: "the trajectory starts at".
void check_agreement(const Node& node, const std::string& path, const ReadRobot& robot,
                     std::span<const double> expected, double tolerance, std::string_view source, FaultList& faults);
/// Reports values beyond the joints' rate limits.
void check_rate_limits(const Node& node, const std::string& path, const ReadRobot& robot, FaultList& faults);

}  // namespace grapnel
