#include "grapnel/result/verdicts.hpp"

#include <fmt/format.h>

#include <limits>

namespace grapnel {
namespace {

// The value over its bound; NaN exceeds every bound.
double factor(const LedgerEntry& entry) {
  if (!(entry.value <= std::numeric_limits<double>::max())) return std::numeric_limits<double>::infinity();
  return entry.bound > 0 ? entry.value / entry.bound : std::numeric_limits<double>::max();
}

}  // namespace

const LedgerEntry* Ledger::worst_failure() const {
  const LedgerEntry* worst = nullptr;
  for (const LedgerEntry& entry : entries) {
    if (entry.kind != LedgerEntry::Kind::conservation || entry.pass()) continue;
    if (!worst || factor(entry) > factor(*worst)) worst = &entry;
  }
  return worst;
}

std::string failure_text(const LedgerEntry& entry) {
  const std::string unit = entry.unit == "1" ? "" : " " + entry.unit;
  return fmt::format("{} is {:.3g}{}, bound {:.3g}{}", entry.name, entry.value, unit, entry.bound, unit);
}

}  // namespace grapnel
