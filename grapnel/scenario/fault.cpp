#include "grapnel/scenario/fault.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <tuple>

#include "grapnel/result/printable.hpp"

namespace grapnel {
namespace {

std::string joined(const std::vector<Fault>& faults) {
  std::string text;
  for (const Fault& fault : faults) text += (text.empty() ? "" : "\n") + fault.text();
  return text;
}

}  // namespace

std::vector<Fault> sorted_faults(std::vector<Fault> faults) {
  const auto key = [](const Fault& f) { return std::tie(f.file, f.line, f.column); };
  std::stable_sort(faults.begin(), faults.end(), [&](const Fault& a, const Fault& b) { return key(a) < key(b); });
  // An alias repeats the faults of what it stands for, at the same place.
  faults.erase(std::unique(faults.begin(), faults.end()), faults.end());
  return faults;
}

std::string Fault::text() const {
  // One line whatever a file's name or an override holds.
  const char* kind = is_warning ? "warning" : "error";
  return printable_line(line > 0 ? fmt::format("{}:{}:{}: {}: {}", file, line, column, kind, message)
                                 : fmt::format("{}: {}: {}", file, kind, message));
}

ScenarioError::ScenarioError(std::vector<Fault> faults)
    : std::runtime_error(joined(sorted_faults(faults))), faults_(sorted_faults(std::move(faults))) {}

}  // namespace grapnel
