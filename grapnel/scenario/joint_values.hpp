#pragma once

/// @file
/// Values per joint: a mapping by joint name, a list in joint order, or one number for all. Their forms are in
/// joint_value_forms() (forms.hpp).

#include "grapnel/scenario/forms.hpp"
#include "grapnel/scenario/sections.hpp"

namespace grapnel {

/// Whether a joint may have the value, or the rate.
bool is_within(const JointLimits& limits, double value, bool is_rate);

/// Checks the unit of a value at a place whose units are `stated`, first for revolute joints, then for prismatic
/// joints: an error if it does not fit the joint. `name` is the value's name in messages.
void check_unit(const Node& value, std::string_view stated, const JointDescription& joint, const std::string& name,
                FaultList& faults);
/// The same for values per joint, or for one value for all joints.
void check_units(const Node& values, std::string_view stated, const std::string& path, const ReadRobot& robot,
                 FaultList& faults);

/// The node of each joint, in joint order. Empty if errors make the order uncertain.
std::vector<const Node*> joint_nodes(const Node& node, const ReadRobot& robot);

/// Values that another part of the file states.
struct ExpectedValues {
  std::span<const double> values;  // in joint order
  double tolerance;
  std::string source;  // names their origin: "the trajectory starts at"
};
/// Reports values that differ from the expected ones by more than the tolerance.
void check_agreement(const Node& node, const std::string& path, const ReadRobot& robot, const ExpectedValues& expected,
                     FaultList& faults);

}  // namespace grapnel
