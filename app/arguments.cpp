#include "arguments.hpp"

#include <fmt/format.h>

#include <cmath>
#include <sstream>

#include "grapnel/campaign/campaign.hpp"
#include "grapnel/control/plugin_ends.hpp"
#include "grapnel/text/error_text.hpp"
#include "grapnel/text/message_text.hpp"
#include "terminal.hpp"

namespace grapnel::app {

std::string command_line(const char* program, int argc, char** argv) {
  std::string line = program;
  for (int i = 1; i < argc; ++i) line += " " + shell_word(argv[i]);
  return line;
}

std::string command_line_without(const char* program, int argc, char** argv, std::string_view left_out) {
  std::string line = program;
  for (int i = 1; i < argc; ++i) {
    const std::string_view word = argv[i];
    if (word == left_out) {
      ++i;
    } else if (!word.starts_with(std::string(left_out) + "=")) {
      line += " " + shell_word(argv[i]);
    }
  }
  return line;
}

int end_of_parsing(const CLI::App& app, const CLI::ParseError& error) {
  std::ostringstream out, err;
  const int failed = app.exit(error, out, err);
  write_stdout(out.str());
  write_stderr(err.str());
  return failed == 0 ? kDone : kBadInput;
}

namespace {

// Passes the text unchanged. Runs before the option's own checks, which NaN passes.
std::string finite(std::string text) {
  double value = 0;
  if (CLI::detail::lexical_cast(text, value) && !std::isfinite(value))
    throw CLI::ValidationError(fmt::format("'{}' is not a finite number", text));
  return text;  // CLI11 reports text that is not a number
}

}  // namespace

void require_finite_numbers(CLI::App& app) {
  for (CLI::Option* const option : app.get_options()) {
    if (option->get_type_name().find("FLOAT") != std::string::npos) option->transform(finite);
  }
  const auto all = [](CLI::App*) { return true; };
  for (CLI::App* const command : app.get_subcommands(all)) require_finite_numbers(*command);
}

int unexpected_error(const std::exception& error) {
  to_stderr("grapnel: error: {}\n", error_text(error));
  return kSimulationFailed;
}

bool print_plugin_errors() {
  const std::vector<std::string> faults = take_plugin_faults();
  for (const std::string& fault : faults) to_stderr("grapnel: error: {}\n", fault);
  return !faults.empty();
}

namespace {

// Rejects the empty value of an unset shell variable, which would select a default.
std::string not_empty(const std::string& text) {
  return text.empty() ? "its value is empty, as with an unset variable" : "";
}

}  // namespace

void add_campaign_arguments(CLI::App& command, CampaignRunOptions& options) {
  command.add_option("study", options.study, "Campaign file (YAML)")->required();
  command
      .add_option(
          "-o,--output", options.output,
          "Result folder (default: out/ and the study file's name without .yaml; with --only NAME-case-N); completed "
          "cases of this campaign in it are kept")
      ->check(not_empty);
  command.add_option("--extend", options.extend, "Number of cases to add to the campaign in the folder")
      ->check(CLI::Range(std::uint64_t{1}, kMostCases));
  command.add_flag("--no-report", options.no_report, "Write no report.html");
  command.add_flag("--no-csv", options.no_csv, "Write no table.csv");
  command.add_flag("--quiet", options.quiet, "Print errors and warnings only");
}

void add_watch_flag(CLI::App& command, bool& watch) {
  CLI::Option* flag =
      command.add_flag("--watch", watch, "Show the progress on a live page of this machine, whose address is printed");
  for (const char* other : {"--quiet", "--only"})
    if (CLI::Option* option = command.get_option_no_throw(other)) flag->excludes(option);
}

void add_machine_arguments(CLI::App& command, CampaignRunOptions& options) {
  command.add_option("-j,--jobs", options.threads, "Threads (default: one per processor)")->check(CLI::Range(1, 4096));
  auto* only = command
                   .add_option("--only", options.only,
                               "Simulate only this case, as a complete run with time series and report.html")
                   ->check(CLI::Range(std::uint64_t{0}, kMostCases - 1))
                   ->excludes("--extend");
  command
      .add_option("--shard", options.shard,
                  "Compute only part i of N, as in 3/8; 'slurm' reads both from the job array (default in a job array)")
      ->check(not_empty)
      ->excludes(only);
}

}  // namespace grapnel::app
