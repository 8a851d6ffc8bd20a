#pragma once

/// @file
/// Which columns a file asks for. Thread safety: a free function.

#include <vector>

#include "grapnel/scenario/node.hpp"
#include "grapnel/study/column.hpp"

namespace grapnel {

/// Per column whether a pattern of the list chooses it; those kept by default where there is no list. A pattern that
/// chooses none is a fault.
std::vector<bool> chosen_columns(const Node& list, const std::vector<Column>& columns, FaultList& faults);

}  // namespace grapnel
