#include "campaign_arguments.hpp"

#include <sstream>

#include "grapnel/campaign/campaign.hpp"
#include "grapnel/report/shell_word.hpp"
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

// An unset variable in a script must not mean something else than was meant.
std::string not_empty(const std::string& text) {
  return text.empty() ? "its value is empty, as of a variable that is not set" : "";
}

}  // namespace

void add_campaign_arguments(CLI::App& command, CampaignRunOptions& options) {
  command.add_option("study", options.study, "Campaign file (YAML)")->required();
  command
      .add_option(
          "-o,--output", options.output,
          "Result folder (default: out/ and the study file's name without .yaml; with --only NAME-case-N); what "
          "is there already of this campaign is kept")
      ->check(not_empty);
  command.add_option("--extend", options.extend, "Add so many cases to the campaign in the folder")
      ->check(CLI::Range(std::uint64_t{1}, kMostCases));
  command.add_flag("--no-report", options.no_report, "Write no report.html");
  command.add_flag("--no-csv", options.no_csv, "Write no table.csv");
  command.add_flag("--quiet", options.quiet, "Print errors and warnings only");
}

void add_machine_arguments(CLI::App& command, CampaignRunOptions& options) {
  command.add_option("-j,--jobs", options.threads, "Threads (default: one per processor)")->check(CLI::Range(1, 4096));
  auto* only = command
                   .add_option("--only", options.only,
                               "Simulate this case alone, as a complete run with time series and report.html")
                   ->check(CLI::Range(std::uint64_t{0}, kMostCases - 1))
                   ->excludes("--extend");
  command
      .add_option("--shard", options.shard,
                  "Only part i of N, as in 3/8; 'slurm' takes both from the job array (default where there is one)")
      ->check(not_empty)
      ->excludes(only);
}

}  // namespace grapnel::app
