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
#include "grapnel/report/report_html.hpp"
#include "grapnel/result/atomic_file.hpp"
#include "grapnel/text/error_text.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/override.hpp"
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
    if (options.window > 0) settings.window = options.window;
    settings.false_alarms = options.false_alarms;
    const fs::path folder = options.output.empty() ? run / ("impulses-" + options.log.stem().string()) : options.output;
    const fs::path json = folder / "impulses.json", csv = folder / "impulses.csv", momentum = folder / "momentum.csv",
                   page = folder / "impulses.html";
    const MeasuredImpulses result = measured_impulses(run, options.log, options.mapping, settings);
    Terminal terminal;
    if (!may_write({json, csv, momentum, page}, terminal)) return kBadInput;
    const std::string no_page = why_no_reports();
    try {
      fs::create_directories(folder);
      write_file_atomically(csv, impulse_report_csv(result.report));
      write_file_atomically(momentum, momentum_csv(result.momentum));
      write_file_atomically(json, impulse_report_json(result.report));
      if (no_page.empty()) write_report(impulse_page_data(result), page);
    } catch (const std::exception& error) {
      to_stderr("grapnel: error: {}\n", error_text(error));
      return kSimulationFailed;
    }
    if (!options.quiet) {
      to_stdout("grapnel {}, run {} (scenario {}), log {}\n\n", GRAPNEL_VERSION, run.string(), result.report.scenario,
                options.log.string());
      write_stdout(impulse_report_text(result.report));
      to_stdout("results in {}: impulses.json, impulses.csv, momentum.csv{}\n{}", folder.string(),
                no_page.empty() ? ", impulses.html" : "", no_page.empty() ? "" : fmt::format("no page: {}\n", no_page));
    }
    return result.report.verdict == Verdict::no ? kSimulationFailed : kDone;
  } catch (const InputError& error) {
    print_errors(error.faults());
    return kBadInput;
  }
}

}  // namespace grapnel::app
