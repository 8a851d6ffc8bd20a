#include "grapnel/text/faults.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <tuple>

#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

std::string joined(const std::vector<Fault>& faults) {
  std::string text;
  for (const Fault& fault : faults) text += (text.empty() ? "" : "\n") + fault.text();
  return text;
}

// The message, truncated at a character boundary.
Fault cut(Fault fault) {
  if (fault.message.size() <= FaultList::kLongestMessage) return fault;
  std::size_t end = FaultList::kLongestMessage;
  while (end > 0 && (static_cast<unsigned char>(fault.message[end]) & 0xc0) == 0x80) --end;
  fault.message = fault.message.substr(0, end) + "…";
  return fault;
}

}  // namespace

std::vector<Fault> sorted_faults(std::vector<Fault> faults) {
  const auto key = [](const Fault& f) { return std::tie(f.file, f.line, f.column); };
  std::stable_sort(faults.begin(), faults.end(), [&](const Fault& a, const Fault& b) { return key(a) < key(b); });
  // An alias repeats the errors of its anchor at the same place.
  faults.erase(std::unique(faults.begin(), faults.end()), faults.end());
  return faults;
}

std::string Fault::text() const {
  // One line for any file name or override.
  const char* kind = is_warning ? "warning" : "error";
  return printable_line(line > 0 ? fmt::format("{}:{}:{}: {}: {}", file, line, column, kind, message)
                                 : fmt::format("{}: {}: {}", file, kind, message));
}

InputError::InputError(std::vector<Fault> faults)
    : std::runtime_error(joined(sorted_faults(faults))), faults_(sorted_faults(std::move(faults))) {}

void FaultList::add(Fault fault) {
  if (faults_.size() > kMost) return;
  if (faults_.size() == kMost) fault.message = "too many errors; further errors are not listed";
  faults_.push_back(cut(std::move(fault)));
}

void FaultList::warn(Fault warning) {
  warning.is_warning = true;
  if (warnings_.size() < kMost) warnings_.push_back(cut(std::move(warning)));
}

}  // namespace grapnel
