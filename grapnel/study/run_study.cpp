#include "grapnel/study/run_study.hpp"

#include <stdexcept>

#include "grapnel/study/case_pool.hpp"
#include "grapnel/study/grid.hpp"

namespace grapnel {

std::size_t point_count(const Study& study) {
  const auto size = grid_size(study.axis_sizes());
  if (!size) throw std::invalid_argument("the study has more points than can be counted");
  if (*size == 0) throw std::invalid_argument("an axis of the study has no values");
  return *size;
}

StudyTable run_study(const Study& study, const StudyOptions& options) {
  StudyTable table = empty_table(study);
  StudyProgress progress;
  progress.total = point_count(study);
  table.rows.reserve(progress.total);
  const auto work = [&](std::size_t index) { return run_point(study, index); };
  const auto sink = [&](CaseRow&& row) {
    if (options.row) options.row(row);
    table.rows.push_back(std::move(row));
  };
  const auto finished = [&](const CaseRow& row) {
    ++progress.done;
    if (row.status != CaseStatus::ok) ++progress.not_ok;
    if (options.progress) options.progress(progress);
  };
  run_cases(0, progress.total, options.threads, work, sink, finished, options.stop);
  return table;
}

}  // namespace grapnel
