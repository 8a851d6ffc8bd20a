#include "grapnel/study/run_case.hpp"

#include <algorithm>
#include <stdexcept>

#include "grapnel/capture/simulate_capture.hpp"

namespace grapnel {
namespace {

// Tables have one line a case.
std::string one_line(std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  for (std::size_t at = 0; (at = text.find('\n', at)) != std::string::npos;) text.replace(at, 1, "; ");
  std::replace(text.begin(), text.end(), '\r', ' ');
  return text;
}

}  // namespace

const char* name_of(StudyMode mode) { return mode == StudyMode::impact ? "impact" : "run"; }

const char* name_of(CaseStatus status) {
  switch (status) {
    case CaseStatus::ok:
      return "ok";
    case CaseStatus::failed:
      return "failed";
    case CaseStatus::unreachable:
      break;
  }
  return "unreachable";
}

CaseRow failed_case(std::string reason, std::size_t columns) {
  return {0, CaseStatus::failed, one_line(std::move(reason)), std::vector<double>(columns, NAN)};
}

CaseRow case_row(const StudyCase& point, const CaptureResult& result, std::span<const Column> columns) {
  CaseRow row;
  if (const LedgerEntry* wrong = result.ledger.worst_failure(); wrong && result.status == CaptureStatus::completed) {
    row = failed_case(kNotConserved + failure_text(*wrong), columns.size());
    for (std::size_t c = 0; c < columns.size(); ++c) {
      if (columns[c].name == kConservationColumn) row.values[c] = 0;
    }
    return row;
  }
  if (result.status == CaptureStatus::completed) {
    row.status = CaseStatus::ok;
  } else {
    const bool unplanned = result.plan && result.plan->searched && !result.plan->found;
    row.status = unplanned ? CaseStatus::unreachable : CaseStatus::failed;
    row.reason = one_line(result.failure);
  }
  row.values.reserve(columns.size());
  for (const Column& column : columns) row.values.push_back(column.value(point, result));
  return row;
}

CaseRow run_case(const StudyCase& point, StudyMode mode, std::span<const Column> columns,
                 const CaptureProgress& progress) {
  try {
    const CaptureDetail detail = detail_of(columns);
    const CaptureResult result = mode == StudyMode::impact ? simulate_impact_only(point.problem, detail, progress)
                                                           : simulate_capture(point.problem, progress, detail);
    return case_row(point, result, columns);
  } catch (const std::exception& error) {
    return failed_case(error.what(), columns.size());
  }
}

}  // namespace grapnel
