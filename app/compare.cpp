// grapnel compare and grapnel impulses: a log of measurements, and the run of its experiment.
#include <fmt/format.h>

#include <charconv>
#include <memory>
#include <optional>
#include <string_view>

#include "commands.hpp"
#include "grapnel/compare/log_folder.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/override.hpp"
#include "terminal.hpp"

namespace grapnel::app {
namespace {

std::optional<double> seconds_in(std::string_view text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

// "20" or "20:0.02": time and duration.
std::vector<ContactTime> contact_times(const std::vector<std::string>& texts) {
  std::vector<ContactTime> contacts;
  FaultList faults;
  for (const std::string& text : texts) {
    const std::size_t colon = text.find(':');
    const auto begin = seconds_in(std::string_view(text).substr(0, colon));
    const auto duration = colon == std::string::npos ? 0.0 : seconds_in(std::string_view(text).substr(colon + 1));
    if (begin && duration && *duration >= 0)
      contacts.push_back({*begin, *begin + *duration, 0});
    else
      faults.add({std::make_shared<const std::string>("--at"), 0, 0},
                 fmt::format("{} is no time [s], or time and duration such as 20.01:0.02", in_quotes(text)));
  }
  faults.throw_if_any();
  return contacts;
}

}  // namespace

int compare(const CompareOptions& options) {
  try {
    Terminal terminal;
    return code_of(run_comparison_folder(options.input, options, terminal));
  } catch (const InputError& error) {
    print_errors(error.faults());
    return kBadInput;
  }
}

int impulses(const ImpulsesOptions& options) {
  try {
    ImpulseOptions settings;
    settings.scenario = options.scenario;
    for (const std::string& text : options.overrides) settings.overrides.push_back(parse_override(text));
    settings.contacts = contact_times(options.at);
    settings.window = options.window;
    settings.false_alarms = options.false_alarms;
    Terminal terminal;
    return code_of(run_impulses_folder(options.input, settings, options, terminal));
  } catch (const InputError& error) {
    print_errors(error.faults());
    return kBadInput;
  }
}

}  // namespace grapnel::app
