#pragma once

/// @file
/// One point of a study. Thread safety: pure functions.

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "grapnel/study/study.hpp"

namespace grapnel {

/// How a point ended. unreachable: no configuration within the joints' limits puts the end-effectors where it asks.
/// failed: anything else that went wrong.
enum class CaseStatus { ok, failed, unreachable };

/// "ok", "failed", "unreachable".
const char* name_of(CaseStatus status);

/// What is kept of one point: a row of the table.
struct CaseRow {
  std::size_t index = 0;  // of the point, in the study's order
  CaseStatus status = CaseStatus::failed;
  std::string reason;          // one line; empty if ok
  std::vector<double> values;  // per column; NaN where there is nothing
};

/// Simulates a case and takes its columns. Never throws for what is wrong with the case: that is the row's reason.
CaseRow run_case(const StudyCase& point, StudyMode mode, std::span<const Column> columns);

/// The same of a study's point; a point without a problem is a failed row too.
CaseRow run_point(const Study& study, std::size_t index);

}  // namespace grapnel
