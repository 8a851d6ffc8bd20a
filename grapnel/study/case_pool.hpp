#pragma once

/// @file
/// A case of a study, and independent jobs on several threads, whose rows one thread takes. Sweeps, campaigns and
/// searches run on it.

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

/// How far a study is.
struct CaseProgress {
  std::uint64_t done = 0;        // cases there are, those of earlier runs included
  std::uint64_t begun_with = 0;  // of them there when this run began
  std::uint64_t total = 0;       // that this run is about
  std::uint64_t successes = 0;   // of those done
  std::uint64_t not_ok = 0;      // of those done: status failed or unreachable
  bool stopped = false;          // on request, before all were done

  void count(std::span<const CaseRow> rows);
};

struct PoolOptions {
  int threads = 1;
  /// One call at a time, from the calling thread: several times a second, done or not, and whenever rows have come.
  std::function<void(const CaseProgress&)> progress = {};
  std::stop_token stop = {};
};

/// Gives rows to the calling thread; waits while that is far behind.
using HandIn = std::function<void(std::vector<CaseRow>)>;
/// Does a job. Called from several threads at once.
using JobWork = std::function<void(std::size_t job, const HandIn& hand_in, const std::stop_token& stop)>;
/// Takes rows of a job, in the order in which that handed them in. Called by the calling thread alone.
using TakeRows = std::function<void(std::size_t job, std::vector<CaseRow> rows)>;

/// Does the jobs 0 to `jobs` - 1: threads take the next one each. Counts all rows on top of `progress`. After a stop
/// request jobs under way are asked to end, and no other is begun. Rethrows what `work` throws first, once what was
/// handed in has been taken, and at once what `take` or `options.progress` throw; no job is begun after that.
CaseProgress run_jobs(std::size_t jobs, const PoolOptions& options, CaseProgress progress, const JobWork& work,
                      const TakeRows& take = {});

// One case of a study: a capture of which some numbers are kept.

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

/// What shortens the steps of a phase, most likely first, "a; b; c": for a run that is slow already. `phase`: as
/// progress names it, "post_impact_2".
std::string causes_of_short_steps(const CaptureProblem& problem, const std::string& phase);

/// A line per phase (approach, what follows the impact) that takes more than both; empty for most runs.
std::vector<std::string> slow_phases(const CaptureProblem& problem, const CaptureResult& result);

}  // namespace grapnel
