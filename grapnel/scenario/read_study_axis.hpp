#pragma once

/// @file
/// The axes of a study file.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "grapnel/scenario/scenario_files.hpp"
#include "grapnel/study/grid.hpp"
#include "grapnel/study/quantity.hpp"
#include "grapnel/text/yaml_tree.hpp"

namespace grapnel {

/// One value of an axis, as the scenario is to be changed for it.
struct ReadAxisValue {
  Mark mark;
  std::vector<Change> changes;  // of an axis by path, or of a labelled value
  std::string scenario;         // path as the study says it; empty: the study's
  Mark scenario_mark;
  double quantity = 0;  // SI; of an axis by quantity
};

struct ReadAxis {
  StudyAxis shown;
  Mark mark;
  std::string place;                  // "axes[0]", for messages
  std::optional<Quantity> quantity;   // of an axis by quantity
  Mark of_mark;                       // of the name in Quantity::of
  bool is_range = false;              // from ... to
  std::vector<ReadAxisValue> values;  // one per value shown
};

/// The changes of a mapping {path: value}.
std::vector<Change> read_changes(const Node& mapping);

/// An axis of a study whose structure has been checked.
ReadAxis read_study_axis(const Node& node, const std::string& place, FaultList& faults);

}  // namespace grapnel
