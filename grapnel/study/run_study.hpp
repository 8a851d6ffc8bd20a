#pragma once

/// @file
/// All points of a study.

#include <functional>
#include <stop_token>

#include "grapnel/study/run_case.hpp"
#include "grapnel/study/study_table.hpp"

namespace grapnel {

struct StudyProgress {
  std::size_t done = 0;
  std::size_t total = 0;
  std::size_t not_ok = 0;  // of those done
};

struct StudyOptions {
  int threads = 1;
  std::function<void(const StudyProgress&)> progress;  // after every point; one call at a time
  std::function<void(const CaseRow&)> row;             // rows in the study's order, as soon as they are complete
  std::stop_token stop;
};

/// Number of a study's points. @throws std::invalid_argument if an axis is empty or the number does not fit.
std::size_t point_count(const Study& study);

/// Runs them all. The table is the same, bit for bit, for any number of threads.
StudyTable run_study(const Study& study, const StudyOptions& options);

}  // namespace grapnel
