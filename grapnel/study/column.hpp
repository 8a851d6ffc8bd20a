#pragma once

/// @file
/// What a study keeps of one capture: a row of named numbers with units, each with the function that takes it from a
/// result.

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "grapnel/describe/type.hpp"
#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/result/capture_result.hpp"

namespace grapnel {

/// impact: planning, then the impact at the planned final configuration, nothing integrated in time. run: everything.
enum class StudyMode { impact, run };
template <>
struct Described<StudyMode> : Enumeration<StudyMode, "StudyMode", "impact", "run"> {};

/// How a case ended. unreachable: no configuration within the joints' limits puts the end-effectors where it asks.
/// failed: anything else that went wrong. A run whose conservation checks fail has failed: what it computed is no
/// result.
enum class CaseStatus { ok, failed, unreachable };
template <>
struct Described<CaseStatus> : Enumeration<CaseStatus, "CaseStatus", "ok", "failed", "unreachable"> {};

/// What is kept of one case: a row of the table.
struct CaseRow {
  std::uint64_t index = 0;  // of the case, in the study's order
  CaseStatus status = CaseStatus::failed;
  std::string reason = {};          // one line; empty if ok
  std::vector<double> values = {};  // per column; NaN where there is nothing
  bool success = false;             // ok, and all criteria of the study hold
  std::vector<double> inputs = {};  // as drawn
};

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
template <>
const Type& type_of<Column>();

/// The column that says whether momentum and energy were kept.
inline constexpr std::string_view kConservationColumn = "ledger/pass";

/// The least detail in which captures have all that the columns take.
CaptureDetail detail_of(std::span<const Column> columns);

/// The standard columns of a problem: what its grasps, joints and ratings ask for. `with_motion_afterwards`: those of
/// the whole run too.
std::vector<Column> standard_columns(const CaptureProblem& problem, bool with_motion_afterwards);

/// The same and those that are only kept where they are asked for (Column::by_default).
std::vector<Column> offered_columns(const CaptureProblem& problem, bool with_motion_afterwards);

/// Whether the robot has any rating.
bool is_rated(const CaptureProblem& problem);

/// `margins/OF/QUANTITY`, of everything that has a rating, and `worst_margin` where anything has; `with_motion`: over
/// all phases, and beside them `loads/OF/QUANTITY` and `load_times/OF/QUANTITY`, which are kept only where they are
/// asked for, since cases take longer with them. Without motion margins are those of impacts.
std::vector<Column> load_columns(const CaptureProblem& problem, bool with_motion);

/// Adds those whose names are not there yet.
void merge_columns(std::vector<Column>& columns, const std::vector<Column>& more);

/// Whether a pattern chooses a column: its parts between '/' are the first ones of the column's name, "*" being any.
bool column_matches(std::string_view pattern, std::string_view name);

}  // namespace grapnel
