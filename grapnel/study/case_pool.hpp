#pragma once

/// @file
/// A case of a study, and independent jobs on several threads with one thread that takes their rows. Used by sweeps,
/// campaigns and searches.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/result/capture_result.hpp"
#include "grapnel/study/column.hpp"

namespace grapnel {

/// Progress of a study.
struct CaseProgress {
  std::uint64_t done = 0;        // completed cases, including those of earlier runs
  std::uint64_t begun_with = 0;  // completed cases at the start of this run
  std::uint64_t total = 0;       // cases of this run
  std::uint64_t successes = 0;   // of those done
  std::uint64_t not_ok = 0;      // of those done: status failed or unreachable
  bool stopped = false;          // on request, before all cases completed

  void count(std::span<const CaseRow> rows);
};

struct PoolOptions {
  int threads = 1;
  /// Called serially from the calling thread: several times a second, and after new rows.
  std::function<void(const CaseProgress&)> progress = {};
  std::stop_token stop = {};
};

/// Passes rows to the calling thread; waits while that is far behind.
using RowSink = std::function<void(std::vector<CaseRow>)>;
/// Runs a job. Called concurrently from several threads.
using JobWork = std::function<void(std::size_t job, const RowSink& hand_in, const std::stop_token& stop)>;
/// Takes rows of a job, in their order. Called only by the calling thread.
using TakeRows = std::function<void(std::size_t job, std::vector<CaseRow> rows)>;

/// Runs the jobs 0 to `jobs` - 1: each thread takes the next one. Adds the counts of all rows to `progress`. After a
/// stop request running jobs are asked to end, and no further job starts. Rethrows the first exception of `work` after
/// the submitted rows have been taken, and exceptions of `take` or `options.progress` immediately; no job starts after
/// that.
CaseProgress run_jobs(std::size_t jobs, const PoolOptions& options, CaseProgress progress, const JobWork& work,
                      const TakeRows& take = {});

// One case of a study: a capture with stored numbers.

/// Start of the reason of a case with failed conservation checks; row, value and bound follow.
inline const std::string kNotConserved = "conservation check failed: ";

/// The row of a result; the caller sets its index. If conservation checks fail, the row has only this verdict, because
/// other numbers are not valid.
CaseRow case_row(const StudyCase& point, const CaptureResult& result, std::span<const Column> columns);
/// The row of a case without a result, with the reason.
CaseRow failed_case(std::string reason, std::size_t columns);

/// Simulates a case with the detail that the columns need, and evaluates them. Errors of the case become the row's
/// reason and are not thrown. An exception of `progress` ends the case: a std::exception becomes its reason.
CaseRow run_case(const StudyCase& point, StudyMode mode, std::span<const Column> columns,
                 const CaptureProgress& progress = {});

// Phases with many steps, their likely causes in the scenario, and the settings that change them. Counts steps, not
// seconds: identical on every machine.

/// Steps per second of motion above which steps are limited by other causes than the motion: runs of the shipped
/// scenarios take 1 to 60 without, and up to 330 with noise, friction or stiff controllers.
inline constexpr double kManySteps = 1000;  // [1/s]
/// Number of steps that takes about a second in any scenario.
inline constexpr long kFewSteps = 20'000;

/// Likely causes of short steps in a phase, the most likely first, "a; b; c": for a run that is known to be slow.
/// `phase`: name in progress reports, "post_impact_2".
std::string causes_of_short_steps(const CaptureProblem& problem, const std::string& phase);

/// A line per phase (approach, motion after the impact) that exceeds both limits; empty for most runs.
std::vector<std::string> slow_phases(const CaptureProblem& problem, const CaptureResult& result);

}  // namespace grapnel
