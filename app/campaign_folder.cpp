#include "campaign_folder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <future>
#include <numeric>
#include <set>
#include <sstream>

#include "commands.hpp"
#include "grapnel/campaign/campaign.hpp"
#include "grapnel/campaign/campaign_report.hpp"
#include "grapnel/campaign/campaign_table_writer.hpp"
#include "grapnel/plugin/plugin_ends.hpp"
#include "grapnel/result/atomic_file.hpp"
#include "grapnel/result/campaign_table.hpp"
#include "grapnel/study_files/study_files.hpp"
#include "grapnel/text/error_text.hpp"
#include "grapnel/text/faults.hpp"
#include "grapnel/text/message_text.hpp"
#include "output_folder.hpp"
#include "run_problem.hpp"
#include "terminal.hpp"

namespace grapnel::app {
namespace fs = std::filesystem;

namespace {

void print_lines(const std::string& text) { to_stderr("grapnel: error: {}\n", text); }

}  // namespace

std::optional<Campaign> campaign_from_file(const CampaignRunOptions& options, bool say) {
  try {
    std::vector<Fault> warnings;
    Campaign campaign = load_campaign(options.study, &warnings);
    if (say) print_errors(warnings);
    if (!options.map || !campaign.design.empty()) return campaign;
    if (say)
      to_stderr(
          "{}: error: grapnel map needs a 'design' of one or two axes; without one it is grapnel campaign "
          "that runs "
          "this file\n",
          options.study.string());
  } catch (const InputError& error) {
    if (!say) return std::nullopt;
    print_errors(error.faults());
  }
  return std::nullopt;
}

void print_campaign(const Campaign& campaign, const CampaignRunOptions& options) {
  if (options.quiet) return;
  to_stdout("grapnel {}, campaign {} (sha256 {})\n", GRAPNEL_VERSION, options.study.string(),
            campaign.sha256.substr(0, 12));
  flush_stdout();
}

void print_start(const ShardStore& store, const std::string& part) {
  if (!store.was_there()) {
    to_stdout("{} cases{}{}\n", store.total(), part.empty() ? "" : ", ", part);
  } else {
    StoreCounts there;
    store.missing(0, 1, &there);
    to_stdout("{} cases, {} of them complete{}{}\n", store.total(), there.rows, part.empty() ? "" : ", ", part);
  }
  flush_stdout();
}

void print_stopped(const fs::path& folder, std::uint64_t done, std::uint64_t total, const std::string& command) {
  to_stderr("grapnel: stopped: {} of {} cases are kept in {}; to resume: {}\n", done, total, folder.string(), command);
}

void take_total(Campaign& campaign, const ShardStore& store) {
  if (campaign.design.empty()) campaign.cases = store.total();
}

int with_store_errors(const fs::path& folder, const std::string& command, const std::function<int()>& work) {
  try {
    return work();
  } catch (const ForeignFolder& error) {
    print_lines(error_text(error));
    return kBadInput;
  } catch (const DamagedManifest& error) {
    print_lines(error_text(error));
    return kBadInput;
  } catch (const FolderInUse& error) {
    print_lines(error_text(error));
    return kSimulationFailed;
  } catch (const std::exception& error) {
    print_lines(error_text(error));
    to_stderr("grapnel: the files in {} remain valid; to resume: {}\n", folder.string(), command);
    return kSimulationFailed;
  }
}

namespace {

// The values of the column or input with this name; empty if there is none.
std::vector<double> numbers_named(const CampaignTable& table, const std::string& name) {
  for (const auto* heads : {&table.columns(), &table.inputs()})
    for (const CampaignTable::Head& head : *heads)
      if (head.name == name) return table.numbers(head);
  return {};
}

// The rows with the largest values; the first of equal ones.
std::vector<std::size_t> largest(const std::vector<double>& numbers, std::size_t count) {
  std::vector<std::size_t> rows;
  for (std::size_t row = 0; row < numbers.size(); ++row)
    if (!std::isnan(numbers[row])) rows.push_back(row);
  count = std::min(count, rows.size());
  std::partial_sort(
      rows.begin(), rows.begin() + static_cast<std::ptrdiff_t>(count), rows.end(),
      [&](std::size_t a, std::size_t b) { return numbers[a] != numbers[b] ? numbers[a] > numbers[b] : a < b; });
  rows.resize(count);
  return rows;
}

// The cases whose complete runs are kept: a function of the rows alone.
std::set<std::uint64_t> cases_to_keep(const Campaign& campaign, const CampaignTable& table) {
  const SeriesToKeep& keep = campaign.series;
  const std::vector<std::uint64_t> index = table.indices();
  std::set<std::uint64_t> cases;
  for (const std::uint64_t k : index)
    if (k < keep.sample) cases.insert(k);
  if (keep.failures > 0) {
    const std::vector<std::uint8_t> success = table.success();
    const std::vector<std::int32_t> reasons = table.reasons();
    const auto took_too_long = [&](std::size_t row) {
      return reasons[row] > 0 && table.reason_texts({reasons[row]})[0].starts_with(kTookTooLong);
    };
    std::uint64_t left = keep.failures;
    for (std::size_t row = 0; row < success.size() && left > 0; ++row) {
      // A case that exceeded its time limit would exceed it again, without a limit here.
      if (success[row] != 0 || took_too_long(row)) continue;
      cases.insert(index[row]);
      --left;
    }
  }
  if (keep.worst > 0)
    for (const std::size_t row : largest(numbers_named(table, keep.worst_by), keep.worst)) cases.insert(index[row]);
  return cases;
}

std::string folder_of(std::uint64_t k) { return fmt::format("case-{}", k); }

// Removes runs of cases that are not kept any more. Removes only files that Grapnel wrote.
void remove_others(const fs::path& series, const std::set<std::uint64_t>& cases) {
  std::set<std::string> wanted;
  for (const std::uint64_t k : cases) wanted.insert(folder_of(k));
  std::error_code none;
  for (const fs::directory_entry& entry : fs::directory_iterator(series, none)) {
    const std::string name = entry.path().filename().string();
    const fs::path scenario = entry.path() / "scenario.yaml";
    if (!name.starts_with("case-") || wanted.contains(name) || !fs::exists(scenario, none)) continue;
    if (may_replace(scenario)) fs::remove_all(entry.path(), none);
  }
  if (cases.empty()) fs::remove(series, none);  // if it is empty
}

enum class StoredRun { there, impossible, not_written };

// Writes the complete run of a case. Failed cases are kept too: their runs give the reason, unless no capture could be
// simulated.
StoredRun keep_run(const Campaign& campaign, std::uint64_t k, const fs::path& place, bool no_report,
                   const StopSignal& stop) {
  const fs::path summary = place / "summary.json";
  try {
    fs::create_directories(place);
    fs::remove(summary);
    const int code = run_case_completely(campaign, k, place,
                                         {.quiet = true, .no_report = no_report, .mute = true, .stop = stop.token()});
    std::error_code none;
    if (stop.poll()) fs::remove(summary, none);  // the same command writes it again
    if (fs::is_regular_file(summary, none)) return StoredRun::there;
    if (code == kBadInput) return StoredRun::impossible;
  } catch (const std::exception& error) {
    to_stderr("grapnel: warning: case {}: {}\n", k, error_text(error));
  }
  return StoredRun::not_written;
}

struct StoredSeries {
  std::size_t kept = 0;
  bool complete = true;  // all expected runs exist
  bool stopped = false;
};

// Writes the complete runs of the cases, each into series/case-K.
StoredSeries keep_series(const Campaign& campaign, const CampaignTable& table, const fs::path& folder,
                         const CampaignResults& what, StopSignal& stop) {
  StoredSeries result;
  const std::set<std::uint64_t> cases = cases_to_keep(campaign, table);
  const fs::path series = folder / "series";
  refuse_link(series);
  remove_others(series, cases);
  if (!cases.empty() && !campaign.scenario_text) {
    to_stderr("grapnel: warning: time series of {} cases are written by grapnel campaign {} -o {}\n", cases.size(),
              campaign.file, folder.string());
    return result;
  }
  for (const std::uint64_t k : cases) {
    if (stop.poll()) {
      result.stopped = true;
      return result;
    }
    const fs::path place = series / folder_of(k);
    switch (keep_run(campaign, k, place, what.no_report, stop)) {
      case StoredRun::there:
        ++result.kept;
        break;
      case StoredRun::not_written:
        to_stderr("grapnel: error: the complete run of case {} is not in {}\n", k, place.string());
        result.complete = false;
        break;
      case StoredRun::impossible:
        break;
    }
  }
  return result;
}

}  // namespace

int write_campaign_results(const Campaign& campaign, const fs::path& folder, const CampaignResults& what,
                           StopSignal& stop) {
  if (what.no_csv) fs::remove(folder / "table.csv");  // of an earlier run
  // Formatting numbers as text takes a quarter of the time after the last case, so a thread does it.
  std::future<void> csv;
  if (!what.no_csv) csv = std::async(std::launch::async, [&] { write_campaign_csv(folder, campaign); });
  write_campaign_table(folder, campaign, GRAPNEL_VERSION);
  const CampaignTable table(folder / "table.h5");
  const CampaignReport numbers = analyze_campaign(campaign, table, GRAPNEL_VERSION, what.threads);
  if (csv.valid()) csv.get();
  write_file_atomically(folder / "campaign.json", campaign_json(numbers));
  if (!campaign.design.empty())
    write_file_atomically(folder / "success_map.csv", success_map_csv(campaign, numbers.success_map));
  const StoredSeries series = keep_series(campaign, table, folder, what, stop);
  if (series.stopped || stop.poll()) return kInterrupted;
  const FolderReport report = write_folder_report(folder, ResultKind::campaign, what.no_report);
  if (!what.quiet) {
    to_stdout("{}\nresults in {}: table.h5, {}campaign.json{}{}\n{}", campaign_summary(campaign, numbers),
              folder.string(), what.no_csv ? "" : "table.csv, ", campaign.design.empty() ? "" : ", success_map.csv",
              series.kept > 0 ? fmt::format(", series of {} cases", series.kept) : "", report.line);
  }
  for (const std::string& warning : numbers.warnings) to_stderr("{}: warning: {}\n", campaign.file, warning);
  if (report.failed || !series.complete) return kSimulationFailed;
  const std::vector<std::uint8_t> status = table.status();
  const auto ok = std::count(status.begin(), status.end(), static_cast<std::uint8_t>(CaseStatus::ok));
  if (static_cast<std::size_t>(ok) == status.size()) return kDone;
  to_stderr("{}: warning: {} of {} cases are not ok, see status and reason in {}\n", campaign.file,
            status.size() - static_cast<std::size_t>(ok), status.size(), (folder / "table.h5").string());
  return kSomeFailed;
}

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
