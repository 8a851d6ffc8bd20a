#pragma once

/// @file
/// What a study keeps of one capture: named numbers with units, each with the function that takes it from a result.

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/result/capture_result.hpp"

namespace grapnel {

/// A capture to be simulated by a study.
struct StudyCase {
  CaptureProblem problem;
  std::vector<Vector3d> inward_normals;  // inward_normals(), per grasp, before quantities were applied
};

/// One number of a capture. NaN where it does not exist: the capture failed before, or has no such thing.
struct Column {
  std::string name;  // groups by '/': "grasps/tip-1/impulse/x"
  std::string unit;  // "1" for counts, ratios and yes (1) or no (0)
  std::string description;
  std::function<double(const StudyCase&, const CaptureResult&)> value;
  bool needs_loads = false;  // the loads of all phases, CaptureDetail::columns_and_loads
  bool by_default = true;    // kept unless others are asked for by name
};

/// The column that says whether momentum and energy were kept.
inline constexpr std::string_view kConservationColumn = "ledger/pass";

/// The least detail in which captures have all that the columns take.
CaptureDetail detail_of(std::span<const Column> columns);

/// The standard columns of a problem: what its grasps, joints and ratings ask for. `with_motion_afterwards`: those of
/// the whole run too.
std::vector<Column> standard_columns(const CaptureProblem& problem, bool with_motion_afterwards);

/// The same and those that are only kept where they are asked for (Column::by_default).
std::vector<Column> offered_columns(const CaptureProblem& problem, bool with_motion_afterwards);

/// Adds those whose names are not there yet.
void merge_columns(std::vector<Column>& columns, const std::vector<Column>& more);

/// Whether a pattern chooses a column: its parts between '/' are the first ones of the column's name, "*" being any.
bool column_matches(std::string_view pattern, std::string_view name);

}  // namespace grapnel
