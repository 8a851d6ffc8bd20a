#include "grapnel/study/optimization.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace grapnel {
namespace {

// What a limit on a number that does not exist counts as.
constexpr double kNoNumber = 1e6;

double beyond(double excess, double scale) {
  if (std::isnan(excess)) return kNoNumber;
  return excess > 0 ? excess / (scale > 0 ? scale : 1) : 0;
}

}  // namespace

const char* name_of(Combine combine) {
  switch (combine) {
    case Combine::largest:
      return "largest";
    case Combine::least:
      return "least";
    case Combine::largest_magnitude:
      return "largest_magnitude";
    case Combine::sum:
      return "sum";
    case Combine::norm:
      break;
  }
  return "norm";
}

std::string OptimizationLimit::text() const {
  return fmt::format("{} {} {}", measured.name, at_most ? "at most" : "at least", bound);
}

Column feasibility_column() {
  return {"ledger/excess", "1", "by how much the ledger's rows of feasibility pass their bounds, added up",
          [](const StudyCase&, const CaptureResult& result) {
            if (result.status != CaptureStatus::completed) return double(NAN);
            double excess = 0;
            for (const LedgerEntry& entry : result.ledger.entries) {
              if (entry.kind == LedgerEntry::Kind::feasibility && !entry.pass()) excess += entry.value - entry.bound;
            }
            return excess;
          }};
}

double value_of(const Measured& measured, std::span<const double> row) {
  double value = NAN;
  for (const std::size_t column : measured.columns) {
    const double one = row[column];
    if (std::isnan(one)) return NAN;
    const bool first = std::isnan(value);
    switch (measured.combine) {
      case Combine::largest:
        value = first ? one : std::max(value, one);
        break;
      case Combine::least:
        value = first ? one : std::min(value, one);
        break;
      case Combine::largest_magnitude:
        value = first ? std::abs(one) : std::max(value, std::abs(one));
        break;
      case Combine::sum:
        value = first ? one : value + one;
        break;
      case Combine::norm:
        value = first ? std::abs(one) : std::hypot(value, one);
        break;
    }
  }
  return value;
}

Score score_of(const Optimization& optimization, const CaseRow& row) {
  Score score;
  score.reached = row.status == CaseStatus::ok;
  double largest = 0;
  const auto add = [&](double violation, std::size_t which) {
    score.violation += violation;
    if (violation > largest) largest = violation, score.worst_limit = which;
  };
  for (const ObjectiveTerm& term : optimization.objective)
    score.objective += term.weight * value_of(term.measured, row.values);
  const std::size_t count = optimization.limits.size();
  for (std::size_t i = 0; i < count; ++i) {
    const OptimizationLimit& limit = optimization.limits[i];
    score.limits.push_back(value_of(limit.measured, row.values));
    const double excess = limit.at_most ? score.limits[i] - limit.bound : limit.bound - score.limits[i];
    add(beyond(excess, std::abs(limit.bound)), i);
  }
  if (optimization.feasible) add(beyond(row.values.back(), 1), count);
  if (std::isnan(score.objective)) add(kNoNumber, count + 1);
  return score;
}

bool comes_before(const Optimization& optimization, const Score& a, const Score& b) {
  if (a.reached != b.reached) return a.reached;
  if (!a.reached) return false;
  if (a.violation != b.violation) return a.violation < b.violation;
  if (a.violation > 0) return false;
  return optimization.maximize ? a.objective > b.objective : a.objective < b.objective;
}

}  // namespace grapnel
