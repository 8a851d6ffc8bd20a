#pragma once

/// @file
/// The axes of study files and of campaigns' designs.

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "grapnel/study/grid.hpp"
#include "grapnel/study/quantity.hpp"
#include "grapnel/study_files/file_structures.hpp"
#include "grapnel/text/yaml_tree.hpp"

namespace grapnel {

/// Number of values of a long list that are checked before the run; the others are checked when their points are run.
inline constexpr std::size_t kMostChecked = 1000;

/// One value of an axis, with its changes of the scenario.
struct ReadAxisValue {
  Mark mark;
  std::vector<Change> changes;  // for an axis by path, or a labelled value
  std::string scenario;         // path in the study file; empty: the scenario of the study
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

/// A quantity at a node of a file: its kind, its name and unit in tables, and the location of the name of the grasp or
/// target.
struct ReadQuantity {
  Quantity quantity;
  std::string name, unit;
  Mark of_mark;
  bool in_degrees = false;
};
ReadQuantity read_quantity(const QuantityFile& file, const Node& node, const std::string& place, FaultList& faults);

/// The axes of the list at `key` of a file. Two axes that vary the same value are an error.
std::vector<ReadAxis> read_axes(const std::vector<AxisFile>& files, const Node& list, const std::string& key,
                                FaultList& faults);

/// Changes of the scenario for the values at a position of the axes, after `set`; and the quantities to apply to the
/// problem that is then read.
std::vector<Change> changes_at(const std::vector<Change>& set, const std::vector<ReadAxis>& axes,
                               std::span<const std::size_t> at);
std::vector<QuantityValue> quantities_at(const std::vector<ReadAxis>& axes, std::span<const std::size_t> at);

}  // namespace grapnel
