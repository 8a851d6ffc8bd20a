#pragma once

/// @file
/// One case of a study: a capture of which some numbers are kept.

#include <span>
#include <string>
#include <vector>

#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/result/capture_result.hpp"
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

// Which phase of a run took many steps, what in the scenario may be the cause, and which setting changes it. Counts
// steps, not seconds: the same on every machine.

/// Steps per second of motion beyond which something other than the motion itself makes them short: runs of the shipped
/// scenarios take 1 to 60 without, and up to 330 with noise, friction or stiff controllers.
inline constexpr double kManySteps = 1000;  // [1/s]
/// Fewer steps than these are done in about a second whatever they are of.
inline constexpr long kFewSteps = 20'000;

/// A line per phase (approach, what follows the impact) that takes more than both; empty for most runs.
std::vector<std::string> slow_phases(const CaptureProblem& problem, const CaptureResult& result);

}  // namespace grapnel
