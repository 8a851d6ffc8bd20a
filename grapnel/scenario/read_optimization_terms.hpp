#pragma once

/// @file
/// Objective and limits of an optimization file: which columns they mean.

#include <string>
#include <vector>

#include "grapnel/study/optimization.hpp"
#include "grapnel/text/yaml_tree.hpp"

namespace grapnel {

/// The columns that a text or a mapping with 'column' and 'combine' means. `large_is_bad` says which of several is the
/// worst.
Measured read_measured(const Node& node, const std::string& place, bool large_is_bad,
                       const std::vector<Column>& columns, FaultList& faults);

/// minimize or maximize.
std::vector<ObjectiveTerm> read_objective(const Node& node, const std::string& place, bool maximize,
                                          const std::vector<Column>& columns, FaultList& faults);

std::vector<OptimizationLimit> read_limits(const Node& list, const std::vector<Column>& columns, FaultList& faults);

}  // namespace grapnel
