#pragma once

/// @file
/// Values per joint: a mapping by joint name, a list in joint order, or one number for all. Their forms are in
/// joint_value_forms() (forms.hpp).

#include "grapnel/scenario/forms.hpp"
#include "grapnel/scenario/sections.hpp"

namespace grapnel {

/// Whether a joint may have the value, or the rate.
bool is_within(const JointLimits& limits, double value, bool is_rate);

/// A value that was written with a unit, at a place whose unit is `stated`, first that of joints that turn, then that
/// of joints that slide: a fault if it is not that of its joint. `name` is the value's, for messages.
void check_unit(const Node& value, std::string_view stated, const JointDescription& joint, const std::string& name,
                FaultList& faults);
/// The same of values per joint, or of one for all of them.
void check_units(const Node& values, std::string_view stated, const std::string& path, const ReadRobot& robot,
                 FaultList& faults);

/// What stands for each joint, in joint order. Empty where faults leave the order in doubt.
std::vector<const Node*> joint_nodes(const Node& node, const ReadRobot& robot);

/// Reports values that are not those of `expected`, in joint order, within the tolerance. `source` says whose these
/// are: "the trajectory starts at".
void check_agreement(const Node& node, const std::string& path, const ReadRobot& robot,
                     std::span<const double> expected, double tolerance, std::string_view source, FaultList& faults);

}  // namespace grapnel
