#include "grapnel/campaign/campaign_folder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <future>
#include <set>
#include <thread>

#include "grapnel/campaign/campaign_table_writer.hpp"
#include "grapnel/campaign/result_folder.hpp"
#include "grapnel/campaign/run_scenario.hpp"
#include "grapnel/campaign/study_files.hpp"
#include "grapnel/result/atomic_file.hpp"
#include "grapnel/result/campaign_table.hpp"
#include "grapnel/result/child_reader.hpp"
#include "grapnel/text/error_text.hpp"
#include "grapnel/text/faults.hpp"

namespace grapnel {
namespace fs = std::filesystem;

int threads_of(int requested) {
  return requested > 0 ? requested : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

bool can_run(const Campaign& campaign, bool map, Listener& listener) {
  if (!map || !campaign.design.empty()) return true;
  listener.error(campaign.file,
                 "grapnel map needs a 'design' of one or two axes; without one it is grapnel campaign that runs this "
                 "file");
  return false;
}

std::optional<Campaign> campaign_from_file(const fs::path& file, bool map, Listener& listener) {
  try {
    std::vector<Fault> warnings;
    Campaign campaign = load_campaign(file, &warnings);
    listener.faults(warnings);
    if (can_run(campaign, map, listener)) return campaign;
  } catch (const InputError& error) {
    listener.faults(error.faults());
  }
  return std::nullopt;
}

void note_start(const ShardStore& store, const std::string& part, Listener& listener) {
  const std::string of = part.empty() ? "" : ", " + part;
  if (!store.was_there()) return listener.note(fmt::format("{} cases{}\n", store.total(), of));
  StoreCounts there;
  store.missing(0, 1, &there);
  listener.note(fmt::format("{} cases, {} of them complete{}\n", store.total(), there.rows, of));
}

Ending tell_stopped(const fs::path& folder, std::uint64_t done, std::uint64_t total, const std::string& command,
                    Listener& listener) {
  listener.remark(fmt::format("grapnel: stopped: {} of {} cases are kept in {}; to resume: {}", done, total,
                              folder.string(), command));
  return Ending::interrupted;
}

void take_total(Campaign& campaign, const ShardStore& store) {
  if (campaign.design.empty()) campaign.cases = store.total();
}

Ending with_store_errors(const fs::path& folder, const std::string& command, Listener& listener,
                         const std::function<Ending()>& work) {
  const auto tell = [&](const std::exception& error, Ending ending) {
    listener.error("grapnel", error_text(error));
    return ending;
  };
  try {
    return work();
  } catch (const ForeignFolder& error) {
    return tell(error, Ending::bad_input);
  } catch (const DamagedManifest& error) {
    return tell(error, Ending::bad_input);
  } catch (const FolderInUse& error) {
    return tell(error, Ending::failed);
  } catch (const std::exception& error) {
    tell(error, Ending::failed);
    listener.remark(fmt::format("grapnel: the files in {} remain valid; to resume: {}", folder.string(), command));
    return Ending::failed;
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

// The cases whose complete runs are stored: a function of the rows alone.
std::set<std::uint64_t> cases_to_store(const Campaign& campaign, const CampaignTable& table) {
  const SeriesSelection& selection = campaign.series;
  const std::vector<std::uint64_t> index = table.indices();
  std::set<std::uint64_t> cases;
  for (const std::uint64_t k : index)
    if (k < selection.sample) cases.insert(k);
  if (selection.failures > 0) {
    const std::vector<std::uint8_t> success = table.success();
    const std::vector<std::int32_t> reasons = table.reasons();
    const auto took_too_long = [&](std::size_t row) {
      return reasons[row] > 0 && table.reason_texts({reasons[row]})[0].starts_with(kTookTooLong);
    };
    std::uint64_t left = selection.failures;
    for (std::size_t row = 0; row < success.size() && left > 0; ++row) {
      // A case that exceeded its time limit would exceed it again, without a limit here.
      if (success[row] != 0 || took_too_long(row)) continue;
      cases.insert(index[row]);
      --left;
    }
  }
  if (selection.worst > 0)
    for (const std::size_t row : largest(numbers_named(table, selection.worst_by), selection.worst))
      cases.insert(index[row]);
  return cases;
}

std::string folder_of(std::uint64_t k) { return fmt::format("case-{}", k); }

// Removes runs of cases that are no longer selected. Removes only files that Grapnel wrote.
void remove_others(const fs::path& series, const std::set<std::uint64_t>& cases, Listener& listener) {
  std::set<std::string> retained;
  for (const std::uint64_t k : cases) retained.insert(folder_of(k));
  std::error_code none;
  for (const fs::directory_entry& entry : fs::directory_iterator(series, none)) {
    const std::string name = entry.path().filename().string();
    const fs::path scenario = entry.path() / "scenario.yaml";
    if (!name.starts_with("case-") || retained.contains(name) || !fs::exists(scenario, none)) continue;
    if (may_replace(scenario, listener)) fs::remove_all(entry.path(), none);
  }
  if (cases.empty()) fs::remove(series, none);  // if it is empty
}

enum class StoredRun { there, impossible, not_written };

// Writes the complete run of a case. Failed cases are stored too: their runs give the reason, unless no capture could
// be simulated.
StoredRun store_run(const Campaign& campaign, std::uint64_t k, const fs::path& place, const FolderOptions& options,
                    Listener& listener) {
  const fs::path summary = place / "summary.json";
  try {
    fs::create_directories(place);
    fs::remove(summary);
    const Ending ending = run_case_completely(
        campaign, k, place,
        {.quiet = true, .no_report = options.no_report, .mute = true, .warnings = {}, .stop = options.stop}, listener);
    std::error_code none;
    if (options.stop.stop_requested()) fs::remove(summary, none);  // the same command writes it again
    if (fs::is_regular_file(summary, none)) return StoredRun::there;
    if (ending == Ending::bad_input) return StoredRun::impossible;
  } catch (const std::exception& error) {
    listener.warning("grapnel", fmt::format("case {}: {}", k, error_text(error)));
  }
  return StoredRun::not_written;
}

struct StoredSeries {
  std::size_t stored = 0;
  bool complete = true;  // all expected runs exist
  bool stopped = false;
};

// Writes the complete runs of the cases, each into series/case-K.
StoredSeries store_series(const Campaign& campaign, const CampaignTable& table, const fs::path& folder,
                          const FolderOptions& options, Listener& listener) {
  StoredSeries result;
  const std::set<std::uint64_t> cases = cases_to_store(campaign, table);
  const fs::path series = folder / "series";
  refuse_link(series);
  remove_others(series, cases, listener);
  if (!cases.empty() && !campaign.scenario_text) {
    listener.warning("grapnel", fmt::format("time series of {} cases are written by grapnel campaign {} -o {}",
                                            cases.size(), campaign.file, folder.string()));
    return result;
  }
  for (const std::uint64_t k : cases) {
    if (options.stop.stop_requested()) {
      result.stopped = true;
      return result;
    }
    const fs::path place = series / folder_of(k);
    switch (store_run(campaign, k, place, options, listener)) {
      case StoredRun::there:
        ++result.stored;
        break;
      case StoredRun::not_written:
        listener.error("grapnel", fmt::format("the complete run of case {} is not in {}", k, place.string()));
        result.complete = false;
        break;
      case StoredRun::impossible:
        break;
    }
  }
  return result;
}

}  // namespace

CampaignReport write_campaign_tables(const Campaign& campaign, const fs::path& folder, bool no_csv, int threads) {
  // Formatting numbers as text takes a quarter of the time after the last case, so a thread does it where it may.
  constexpr std::launch kWhen = kChildrenBesideThreads ? std::launch::async : std::launch::deferred;
  std::future<void> csv;
  if (!no_csv) csv = std::async(kWhen, [&] { write_campaign_csv(folder, campaign); });
  write_campaign_table(folder, campaign, GRAPNEL_VERSION);
  CampaignReport numbers = analyze_campaign(campaign, CampaignTable(folder / "table.h5"), GRAPNEL_VERSION, threads);
  if (csv.valid()) csv.get();
  write_file_atomically(folder / "campaign.json", campaign_json(numbers));
  if (!campaign.design.empty())
    write_file_atomically(folder / "success_map.csv", success_map_csv(campaign, numbers.success_map));
  return numbers;
}

Ending write_campaign_results(const Campaign& campaign, const fs::path& folder, const CampaignFolderOptions& options,
                              Listener& listener) {
  if (options.no_csv) fs::remove(folder / "table.csv");  // of an earlier run
  const CampaignReport numbers = write_campaign_tables(campaign, folder, options.no_csv, threads_of(options.threads));
  const CampaignTable table(folder / "table.h5");
  const StoredSeries series = store_series(campaign, table, folder, options, listener);
  if (series.stopped || options.stop.stop_requested()) return Ending::interrupted;
  const FolderReport report = write_folder_report(folder, ResultKind::campaign, options.no_report, listener);
  if (!options.quiet) {
    listener.note(fmt::format(
        "{}\nresults in {}: table.h5, {}campaign.json{}{}\n{}", campaign_summary(campaign, numbers), folder.string(),
        options.no_csv ? "" : "table.csv, ", campaign.design.empty() ? "" : ", success_map.csv",
        series.stored > 0 ? fmt::format(", series of {} cases", series.stored) : "", report.line));
  }
  for (const std::string& warning : numbers.warnings) listener.warning(campaign.file, warning);
  if (report.failed || !series.complete) return Ending::failed;
  const std::vector<std::uint8_t> status = table.status();
  const auto ok = std::count(status.begin(), status.end(), static_cast<std::uint8_t>(CaseStatus::ok));
  if (static_cast<std::size_t>(ok) == status.size()) return Ending::done;
  listener.warning(campaign.file, fmt::format("{} of {} cases are not ok, see status and reason in {}",
                                              status.size() - static_cast<std::size_t>(ok), status.size(),
                                              (folder / "table.h5").string()));
  return Ending::some_failed;
}

// --- The computation ---

std::string CampaignPart::text() const { return fmt::format("{}/{}", number + 1, count); }

namespace {

// Ends one task of a job array; the last task writes the results.
Ending part_is_done(const StoreCounts& all, const CaseProgress& own, const CampaignFolderOptions& options,
                    Listener& listener) {
  if (!options.quiet)
    listener.note(
        fmt::format("part {} is complete; {} of {} blocks are complete\nThe last part writes the results. If a part is "
                    "lost, rerun it, or compute all remaining cases by the command without --shard: {}\n",
                    options.part.text(), all.complete, all.blocks, options.resume));
  return own.not_ok > 0 ? Ending::some_failed : Ending::done;
}

// Tells the expected duration of a long campaign before it begins, and which computations dominate it. The cases
// computed for the estimate are discarded.
void tell_expected_duration(const Campaign& campaign, const ShardStore& store, const CampaignFolderOptions& options,
                            Listener& listener) {
  constexpr double kLong = 20;  // [s]
  const auto seconds = [] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
  };
  const std::vector<ShardStore::Missing> missing = store.missing(options.part.number, options.part.count);
  const auto estimate =
      estimate_campaign(block_work(campaign), missing, threads_of(options.threads), kLong, seconds, options.stop);
  if (!estimate || estimate->seconds < kLong) return;
  listener.remark("grapnel: " + estimate_text(*estimate));
  for (const std::string& line : slow_settings(campaign, missing.front().block.begin, options.stop))
    listener.remark("grapnel: most of the time is spent on: " + line);
}

CaseProgress compute(const Campaign& campaign, ShardStore& store, const CampaignFolderOptions& options,
                     Listener& listener) {
  CampaignOptions run;
  run.threads = threads_of(options.threads);
  run.shard = options.part.number;
  run.shards = options.part.count;
  run.stop = options.stop;
  if (!options.quiet) {
    listener.cases({});
    run.progress = [&](const CaseProgress& at) { listener.cases(at); };
  }
  return run_campaign(block_work(campaign), store, run);
}

// `command`: set to the one that resumes the campaign.
Ending run_and_write(Campaign& campaign, const fs::path& folder, const CampaignFolderOptions& options,
                     Listener& listener, std::string& command) {
  const CampaignPart& part = options.part;
  // The name of its lock file.
  const std::string writer = part.is_part() ? fmt::format("task-{}-of-{}", part.number + 1, part.count) : "";
  ShardStore store(folder, campaign, {.version = GRAPNEL_VERSION, .writer = writer, .extend = options.extend});
  take_total(campaign, store);
  command = options.resume;
  if (!options.quiet) {
    note_start(store, part.is_part() ? "part " + part.text() + " of it" : "", listener);
    tell_expected_duration(campaign, store, options, listener);
  }
  const CaseProgress done = compute(campaign, store, options, listener);
  if (done.stopped) return tell_stopped(folder, done.done, done.total, options.resume, listener);
  if (part.is_part()) {
    StoreCounts all;
    store.missing(0, 1, &all);
    if (all.complete < all.blocks) return part_is_done(all, done, options, listener);
  }
  const Ending ending = write_campaign_results(campaign, folder, options, listener);
  if (ending == Ending::interrupted) tell_stopped(folder, done.done, done.total, options.resume, listener);
  return ending;
}

}  // namespace

Ending run_campaign_folder(Campaign campaign, const fs::path& folder, const CampaignFolderOptions& options,
                           Listener& listener) {
  std::string command = options.command;
  return with_store_errors(folder, command, listener,
                           [&] { return run_and_write(campaign, folder, options, listener, command); });
}

}  // namespace grapnel
