#pragma once

/// @file
/// Units of numbers in study, campaign and optimization files whose unit depends on a place in the scenario, by its
/// path, or on a quantity. All other units are in the file's description.

#include <string>
#include <vector>

#include "grapnel/scenario/reader.hpp"
#include "grapnel/text/yaml_tree.hpp"

namespace grapnel {

/// Converts such numbers to plain numbers, before the structure is checked. An unsuitable unit is an error.
void take_study_units(Node& root, FaultList& faults);

/// Reports numbers in a value, one or a list of one for each of `units`, whose unit, among those that are stated for
/// the place ("rad or m"), is not that of their joint. `name` is the value's, for messages.
void check_joint_units(const Node& value, const std::string& stated, const std::vector<std::string>& units,
                       const std::string& name, FaultList& faults);

}  // namespace grapnel
