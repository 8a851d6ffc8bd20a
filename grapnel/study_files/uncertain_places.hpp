#pragma once

/// @file
/// Where uncertain values stand in a scenario.

#include <span>
#include <string>
#include <vector>

#include "grapnel/study_files/file_structures.hpp"
#include "grapnel/text/yaml_tree.hpp"

namespace grapnel {

/// An uncertain value as the file names it.
struct UncertainPaths {
  Mark mark;          // of the entry
  std::string place;  // "uncertain[0]", for messages
  std::vector<std::string> paths;
  std::vector<Mark> path_marks;
  bool is_orientation = false;  // the path is that of a mapping with an orientation
};

UncertainPaths uncertain_paths(const UncertainFile& file, const Node& entry, const std::string& place);

/// How one place of a scenario lies to another, whatever their paths call the items of lists on the way.
enum class Overlap { none, same, part, whole };  // part: within the other; whole: the other is within it
Overlap overlap(std::span<const PathStep> place, std::span<const PathStep> other);

/// Makes every place with an uncertain orientation say it by `quaternion_wxyz`, which a case can then replace. One that
/// has none is a fault.
void prepare_orientations(const std::vector<UncertainPaths>& uncertain, Node& scenario, FaultList& faults);

/// Reports keys on the way to a place that no scenario has, with what may have been meant; true if there are any.
bool report_unknown_keys(const UncertainPaths& where, const Node& scenario, FaultList& faults);

/// Adds to a scenario what `filled`, which is the same with the schema's defaults, has at the paths and it has not, so
/// that parts of it can be replaced.
void complete_places(const std::vector<UncertainPaths>& uncertain, const Node& filled, Node& scenario);

/// What stands in the scenario at the paths of an uncertain value.
struct UncertainForm {
  std::vector<Node> forms;      // per path
  std::vector<double> nominal;  // of all paths; zeros where nothing stands there
  bool is_absent = false;       // of some path: nothing stands there
};

/// `scenario` has the schema's defaults. A path that leads nowhere is a fault.
UncertainForm form_at(const UncertainPaths& where, const Node& scenario, FaultList& faults);

}  // namespace grapnel
