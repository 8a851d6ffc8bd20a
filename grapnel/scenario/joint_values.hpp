#pragma once

/// @file
/// Values per joint: a mapping by joint name, a list in joint order, or one number for all. Their forms are in
/// joint_value_forms() (forms.hpp).

#include "grapnel/scenario/forms.hpp"
#include "grapnel/scenario/sections.hpp"

namespace grapnel {

/// Whether a joint may have the value, or the rate.
bool is_within(const JointLimits& limits, double value, bool is_rate);

/// What stands for each joint, in joint order. Empty where faults leave the order in doubt.
std::vector<const Node*> joint_nodes(const Node& node, const ReadRobot& robot);

/// Reports values that are not those of `expected`, in joint order, within the tolerance. `source` says whose these
/// are: "the trajectory starts at".
void check_agreement(const Node& node, const std::string& path, const ReadRobot& robot,
                     std::span<const double> expected, double tolerance, std::string_view source, FaultList& faults);

}  // namespace grapnel
