#pragma once

/// @file
/// Independent jobs on several threads, whose rows one thread takes. Sweeps, campaigns and searches run on it.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <stop_token>
#include <vector>

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

}  // namespace grapnel
