#pragma once

/// @file
/// One case of a study: a capture of which some numbers are kept.

#include <span>
#include <string>
#include <vector>

#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/study/column.hpp"

namespace grapnel {

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
