// grapnel impulses: impulses at grasps and momentum of the motion that a log measures.
#include <fmt/format.h>

#include <charconv>
#include <memory>
#include <optional>
#include <string_view>

#include "commands.hpp"
#include "grapnel/campaign/result_folder.hpp"
#include "grapnel/compare/impulse_page.hpp"
#include "grapnel/compare/measured_impulses.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/override.hpp"
#include "log_results.hpp"
#include "terminal.hpp"

namespace grapnel::app {
namespace {

namespace fs = std::filesystem;

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

int impulses(const ImpulsesOptions& options) {
  fs::path run = options.run;
  if (!run.has_filename()) run = run.parent_path();
  try {
    note_results(run);
    ImpulseOptions settings;
    settings.scenario = options.scenario;
    for (const std::string& text : options.overrides) settings.overrides.push_back(parse_override(text));
    settings.contacts = contact_times(options.at);
    settings.window = options.window;
    settings.false_alarms = options.false_alarms;
    const MeasuredImpulses impulses = measured_impulses(run, options.log, options.mapping, settings);
    const ImpulseReport& report = impulses.report;
    LogResults results{run, options.log, log_results_folder(options.output, run, options.log, "impulses"),
                       report.scenario};
    results.files = {{"impulses.json", impulse_report_json(report)},
                     {"impulses.csv", impulse_report_csv(report)},
                     {"momentum.csv", momentum_csv(impulses.momentum)}};
    results.page = "impulses.html", results.page_data = [&] { return impulse_page_data(impulses); };
    results.text = impulse_report_text(report), results.verdict = report.verdict;
    return write_log_results(results, options.quiet);
  } catch (const InputError& error) {
    print_errors(error.faults());
    return kBadInput;
  }
}

}  // namespace grapnel::app
