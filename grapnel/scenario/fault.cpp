#include "grapnel/scenario/fault.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <tuple>

#include "grapnel/result/printable.hpp"

namespace grapnel {
namespace {

std::vector<Fault> sorted(std::vector<Fault> faults) {
  const auto key = [](const Fault& f) { return std::tie(f.file, f.line, f.column); };
  std::stable_sort(faults.begin(), faults.end(), [&](const Fault& a, const Fault& b) { return key(a) < key(b); });
  // An alias repeats the faults of what it stands for, at the same place.
  faults.erase(std::unique(faults.begin(), faults.end()), faults.end());
  return faults;
}

std::string joined(const std::vector<Fault>& faults) {
  std::string text;
  for (const Fault& fault : faults) text += (text.empty() ? "" : "\n") + fault.text();
  return text;
}

}  // namespace

std::string Fault::text() const {
  // One line whatever a file's name or an override holds.
  return printable_line(line > 0 ? fmt::format("{}:{}:{}: error: {}", file, line, column, message)
                                 : fmt::format("{}: error: {}", file, message));
}

ScenarioError::ScenarioError(std::vector<Fault> faults)
    : std::runtime_error(joined(sorted(faults))), faults_(sorted(std::move(faults))) {}

}  // namespace grapnel
