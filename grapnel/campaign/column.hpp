#pragma once

/// @file
/// Stored values of one capture of a study: a row of named numbers with units, each with the function that evaluates it
/// from a result.

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

/// impact: planning, then the impact at the planned final configuration, without integration in time. run: the whole
/// capture.
enum class StudyMode { impact, run };
template <>
struct Described<StudyMode> : Enumeration<StudyMode, "StudyMode", "impact", "run"> {};

/// How a case ended. unreachable: no configuration within the joint limits brings the end-effectors to their goals.
/// failed: any other error. A run with failed conservation checks has failed, because its results are not valid.
enum class CaseStatus { ok, failed, unreachable };
template <>
struct Described<CaseStatus> : Enumeration<CaseStatus, "CaseStatus", "ok", "failed", "unreachable"> {};

/// Stored values of one case: a row of the table.
struct CaseRow {
  std::uint64_t index = 0;  // of the case, in the study's order
  CaseStatus status = CaseStatus::failed;
  std::string reason = {};          // one line; empty if ok
  std::vector<double> values = {};  // per column; NaN if the value does not exist
  bool success = false;             // ok, and all criteria of the study hold
  std::vector<double> inputs = {};  // as drawn
};

/// A capture that a study simulates.
struct StudyCase {
  CaptureProblem problem;
  std::vector<Vector3d> inward_normals;  // inward_normals(), per grasp, before quantities were applied
};

/// One number of a capture. NaN if it does not exist: the capture failed before, or has no such quantity.
struct Column {
  std::string name;  // groups by '/': "grasps/tip-1/impulse/x"
  std::string unit;  // "1" for counts, ratios and yes (1) or no (0)
  std::string description;
  std::function<double(const StudyCase&, const CaptureResult&)> value;
  bool needs_loads = false;  // the loads of all phases, CaptureDetail::columns_and_loads
  bool by_default = true;    // stored unless columns are selected by name
};
template <>
const Type& type_of<Column>();

/// The column of the conservation checks.
inline constexpr std::string_view kConservationColumn = "ledger/pass";

/// The minimum detail with all values that the columns need.
CaptureDetail detail_of(std::span<const Column> columns);

/// The standard columns of a problem, by its grasps, joints and ratings. `with_motion_afterwards`: also those of the
/// whole run.
std::vector<Column> standard_columns(const CaptureProblem& problem, bool with_motion_afterwards);

/// The same with columns that are stored only on request (Column::by_default).
std::vector<Column> offered_columns(const CaptureProblem& problem, bool with_motion_afterwards);

/// Whether the robot has any rating.
bool is_rated(const CaptureProblem& problem);

/// `margins/OF/QUANTITY` for all ratings, and `worst_margin` if there are any; `with_motion`: over all phases, with
/// `loads/OF/QUANTITY` and `load_times/OF/QUANTITY`, which are stored only on request, because they make cases slower.
/// Without motion, margins are those of impacts.
std::vector<Column> load_columns(const CaptureProblem& problem, bool with_motion);

/// `contacts/A/B/KEY` of every pair of bodies that may touch, by default of at most ten pairs, and totals of all pairs.
std::vector<Column> contact_columns(const CaptureProblem& problem);

/// `stages/TARGET/KEY`: which stages of a capture by contacts were reached, how it failed, and times.
std::vector<Column> stage_columns(const CaptureProblem& problem);

/// The number or boolean of a described field of `owner`, or a component of its vector; NaN if it is absent.
double number_in(const Field& field, const void* owner, std::size_t component);

/// Adds columns with new names.
void merge_columns(std::vector<Column>& columns, const std::vector<Column>& more);

/// Whether a pattern selects a column: its parts between '/' match the first parts of the column's name; "*" matches
/// any part.
bool column_matches(std::string_view pattern, std::string_view name);

}  // namespace grapnel
