#pragma once

/// @file
/// Places of uncertain values in a scenario.

#include <span>
#include <string>
#include <vector>

#include "grapnel/study_files/file_structures.hpp"
#include "grapnel/text/yaml_tree.hpp"

namespace grapnel {

/// The paths of an uncertain value in the file.
struct UncertainPaths {
  Mark mark;          // of the entry
  std::string place;  // "uncertain[0]", for messages
  std::vector<std::string> paths;
  std::vector<Mark> path_marks;
  bool is_orientation = false;  // the path is that of a mapping with an orientation
};

UncertainPaths uncertain_paths(const UncertainFile& file, const Node& entry, const std::string& place);

/// Relation of one place of a scenario to another, for any form of list items in their paths.
enum class Overlap { none, same, part, whole };  // part: within the other; whole: the other is within it
Overlap overlap(std::span<const PathStep> place, std::span<const PathStep> other);

/// Converts every uncertain orientation to `quaternion_wxyz`, which a case can replace. A place without an orientation
/// is an error.
void prepare_orientations(const std::vector<UncertainPaths>& uncertain, Node& scenario, FaultList& faults);

/// Reports unknown keys in the path of a place, with suggestions; true if there are any.
bool report_unknown_keys(const UncertainPaths& where, const Node& scenario, FaultList& faults);

/// Copies values at the paths that the scenario lacks from `filled`, the same scenario with the schema's defaults, so
/// that parts of them can be replaced.
void complete_places(const std::vector<UncertainPaths>& uncertain, const Node& filled, Node& scenario);

/// Values of the scenario at the paths of an uncertain value.
struct UncertainForm {
  std::vector<Node> forms;      // per path
  std::vector<double> nominal;  // of all paths; zeros if a value is absent
  bool is_absent = false;       // the value at a path is absent
};

/// `scenario` has the schema's defaults. An invalid path is an error.
UncertainForm form_at(const UncertainPaths& where, const Node& scenario, FaultList& faults);

}  // namespace grapnel
