#pragma once

/// @file
/// Which columns a file asks for.

#include <vector>

#include "grapnel/study/column.hpp"
#include "grapnel/text/yaml_tree.hpp"

namespace grapnel {

/// Per column whether a pattern of the list chooses it; those kept by default where there is no list. A pattern that
/// chooses none is a fault.
std::vector<bool> chosen_columns(const Node& list, const std::vector<Column>& columns, FaultList& faults);

}  // namespace grapnel
