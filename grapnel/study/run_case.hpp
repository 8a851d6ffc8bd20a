#pragma once

/// @file
/// One case of a study: a capture of which some numbers are kept.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/study/column.hpp"

namespace grapnel {

/// impact: planning, then the impact at the planned final configuration, nothing integrated in time. run: everything.
enum class StudyMode { impact, run };

/// "impact", "run".
const char* name_of(StudyMode mode);

/// How a case ended. unreachable: no configuration within the joints' limits puts the end-effectors where it asks.
/// failed: anything else that went wrong. A run whose conservation checks fail has failed: what it computed is no
/// result.
enum class CaseStatus { ok, failed, unreachable };

/// "ok", "failed", "unreachable".
const char* name_of(CaseStatus status);

/// What is kept of one case: a row of the table.
struct CaseRow {
  std::uint64_t index = 0;  // of the case, in the study's order
  CaseStatus status = CaseStatus::failed;
  std::string reason = {};          // one line; empty if ok
  std::vector<double> values = {};  // per column; NaN where there is nothing
  bool success = false;             // ok, and all criteria of the study hold
  std::vector<double> inputs = {};  // as drawn
};

/// How the reason begins of a case whose conservation checks fail; its row, value and bound follow.
inline const std::string kNotConserved = "conservation check failed: ";

/// The row of a result; its index is left to the caller. Where conservation checks fail it has no numbers but that they
/// do, so that nothing is concluded from them.
CaseRow case_row(const StudyCase& point, const CaptureResult& result, std::span<const Column> columns);
/// The row of a case that came to nothing, and why.
CaseRow failed_case(std::string reason, std::size_t columns);

/// Simulates a case in as much detail as columns need, and takes them. Never throws for what is wrong with the case:
/// that is the row's reason. What `progress` throws ends the case: a std::exception as its reason.
CaseRow run_case(const StudyCase& point, StudyMode mode, std::span<const Column> columns,
                 const CaptureProgress& progress = {});

}  // namespace grapnel
