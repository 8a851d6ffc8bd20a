#pragma once

/// @file
/// Units of numbers in study, campaign and optimization files that have the unit of what they are values of: of a place
/// in the scenario, by its path, or of a quantity. All others have theirs by the file's own description.

#include <string>
#include <vector>

#include "grapnel/scenario/reader.hpp"
#include "grapnel/text/yaml_tree.hpp"

namespace grapnel {

/// Makes such numbers plain ones, before the structure is checked. A unit that does not fit is a fault.
void take_study_units(Node& root, FaultList& faults);

/// Reports numbers in a value, one or a list of one for each of `units`, whose unit, among those that are stated for
/// the place ("rad or m"), is not that of their joint. `name` is the value's, for messages.
void check_joint_units(const Node& value, const std::string& stated, const std::vector<std::string>& units,
                       const std::string& name, FaultList& faults);

}  // namespace grapnel
