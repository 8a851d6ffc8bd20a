#include <fmt/format.h>

#include <charconv>
#include <chrono>
#include <cstdlib>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string_view>

#include "campaign_folder.hpp"
#include "commands.hpp"
#include "grapnel/campaign/run_campaign.hpp"
#include "grapnel/text/error_text.hpp"
#include "output_folder.hpp"
#include "run_problem.hpp"
#include "terminal.hpp"

namespace grapnel::app {
namespace fs = std::filesystem;

namespace {

// --- The part of a campaign that this process computes ---

// Part `number`, counted from 0, of `count`.
struct JobShard {
  std::uint64_t number = 0, count = 1;
  bool by_slurm = false;  // from the environment variables of SLURM

  bool is_part() const { return count > 1; }
  // "3/8": the form that --shard accepts, counted from 1.
  std::string text() const { return fmt::format("{}/{}", number + 1, count); }
  // The name of its lock file: "task-3-of-8".
  std::string writer() const { return fmt::format("task-{}-of-{}", number + 1, count); }
};

// Reads an environment variable; null if it is not set.
using Environment = std::function<const char*(const char*)>;

std::optional<std::uint64_t> number_in(std::string_view text) {
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

JobShard stated(const std::string& argument) {
  const std::size_t slash = argument.find('/');
  const auto i = number_in(std::string_view(argument).substr(0, slash));
  const auto n = slash == std::string::npos ? std::nullopt : number_in(std::string_view(argument).substr(slash + 1));
  if (!i || !n || *i < 1 || *i > *n)
    throw std::invalid_argument(
        fmt::format("--shard: '{}' must be i/N with i from 1 to N, as in 3/8, or 'slurm'", argument));
  return {*i - 1, *n, false};
}

std::uint64_t variable(const char* name, const Environment& environment) {
  const char* text = environment(name);
  const auto number = text == nullptr ? std::nullopt : number_in(text);
  if (!number)
    throw std::invalid_argument(fmt::format("{} is {}, expected a number; use --shard i/N instead", name,
                                            text == nullptr ? "not set" : "'" + std::string(text) + "'"));
  return *number;
}

JobShard by_slurm(const Environment& environment) {
  const std::uint64_t id = variable("SLURM_ARRAY_TASK_ID", environment),
                      first = variable("SLURM_ARRAY_TASK_MIN", environment),
                      last = variable("SLURM_ARRAY_TASK_MAX", environment);
  const std::uint64_t step =
      environment("SLURM_ARRAY_TASK_STEP") == nullptr ? 1 : variable("SLURM_ARRAY_TASK_STEP", environment);
  if (step == 0 || id < first || id > last || (id - first) % step != 0)
    throw std::invalid_argument(
        fmt::format("task {} is not one of {} to {} by {}, from SLURM_ARRAY_TASK_MIN, _MAX and _STEP; use --shard i/N "
                    "instead",
                    id, first, last, step));
  const std::uint64_t count = (last - first) / step + 1;
  // With --array=1,3,7 no task would compute the parts of the missing numbers.
  if (environment("SLURM_ARRAY_TASK_COUNT") != nullptr && variable("SLURM_ARRAY_TASK_COUNT", environment) != count)
    throw std::invalid_argument(fmt::format(
        "the array has {} tasks where {} to {} by {} would be {}: number them without gaps, or use --shard i/N",
        variable("SLURM_ARRAY_TASK_COUNT", environment), first, last, step, count));
  return {(id - first) / step, count, true};
}

// "i/N" with 1 <= i <= N; "slurm": SLURM_ARRAY_TASK_ID among SLURM_ARRAY_TASK_MIN, _MAX, _STEP; empty: as "slurm" if
// these variables are set, otherwise the whole campaign. @throws std::invalid_argument with the error and the expected
// form
JobShard job_shard(const std::string& argument, const Environment& environment) {
  if (argument == "slurm") return by_slurm(environment);
  if (!argument.empty()) return stated(argument);
  return environment("SLURM_ARRAY_TASK_ID") == nullptr ? JobShard{} : by_slurm(environment);
}

// --- The command ---

// Ends one task of a job array; the last task writes the results.
int part_is_done(const JobShard& shard, const StoreCounts& all, const CaseProgress& own,
                 const CampaignRunOptions& options) {
  if (!options.quiet)
    to_stdout(
        "part {} is complete; {} of {} blocks are complete\nThe last part writes the results. If a part is "
        "lost, rerun it, or compute all remaining cases by the command without --shard: {}\n",
        shard.text(), all.complete, all.blocks, options.resume);
  return own.not_ok > 0 ? kSomeFailed : kDone;
}

// Prints the expected duration of a long campaign before it begins, and which computations dominate it. The cases
// computed for the estimate are discarded.
void say_how_long(const Campaign& campaign, const ShardStore& store, const JobShard& shard, int threads,
                  StopSignal& stop) {
  constexpr double kLong = 20;  // [s]
  const auto seconds = [] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
  };
  const std::vector<ShardStore::Missing> missing = store.missing(shard.number, shard.count);
  const auto estimate = estimate_campaign(block_work(campaign), missing, threads, kLong, seconds, stop.token());
  if (!estimate || estimate->seconds < kLong) return;
  to_stderr("grapnel: {}\n", estimate_text(*estimate));
  for (const std::string& line : slow_settings(campaign, missing.front().block.begin, stop.token()))
    to_stderr("grapnel: most of the time is spent on: {}\n", line);
}

CaseProgress compute(const Campaign& campaign, ShardStore& store, const JobShard& shard,
                     const CampaignRunOptions& options, StopSignal& stop) {
  Progress progress(options.quiet);
  CampaignOptions run;
  run.threads = threads_of(options.threads);
  run.shard = shard.number;
  run.shards = shard.count;
  run.stop = stop.token();
  run.progress = [&](const CaseProgress& at) {
    stop.poll();
    progress.report_campaign(at);
  };
  return run_campaign(block_work(campaign), store, run);
}

int run_and_write(Campaign& campaign, const fs::path& folder, const JobShard& shard, const CampaignRunOptions& options,
                  StopSignal& stop, std::string& command) {
  ShardStore store(
      folder, campaign,
      {.version = GRAPNEL_VERSION, .writer = shard.is_part() ? shard.writer() : "", .extend = options.extend});
  take_total(campaign, store);
  command = options.resume;
  if (!options.quiet) print_start(store, shard.is_part() ? "part " + shard.text() + " of it" : "");
  if (!options.quiet) say_how_long(campaign, store, shard, threads_of(options.threads), stop);
  const CaseProgress done = compute(campaign, store, shard, options, stop);
  if (done.stopped) {
    print_stopped(folder, done.done, done.total, options.resume);
    return kInterrupted;
  }
  if (shard.is_part()) {
    StoreCounts all;
    store.missing(0, 1, &all);
    if (all.complete < all.blocks) return part_is_done(shard, all, done, options);
  }
  const int code = write_campaign_results(
      campaign, folder, {options.quiet, options.no_report, options.no_csv, threads_of(options.threads)}, stop);
  if (code == kInterrupted) print_stopped(folder, done.done, done.total, options.resume);
  return code;
}

}  // namespace

int campaign(const CampaignRunOptions& options) {
  std::optional<Campaign> loaded = campaign_from_file(options);
  if (!loaded) return kBadInput;
  if (options.only) return only_case(*loaded, *options.only, options.output, {options.quiet, options.no_report});
  JobShard shard;
  try {
    shard = job_shard(options.shard, [](const char* name) { return std::getenv(name); });
  } catch (const std::invalid_argument& error) {
    to_stderr("grapnel: error: {}\n", error_text(error));
    return kBadInput;
  }
  const std::optional<fs::path> folder = results_folder(options.output, options.study, Outputs::campaign);
  if (!folder) return kBadInput;
  print_campaign(*loaded, options);
  if (shard.by_slurm && !options.quiet)
    to_stdout("part {} from SLURM_ARRAY_TASK_ID={}\n", shard.text(), std::getenv("SLURM_ARRAY_TASK_ID"));
  StopSignal stop(options.stop);
  std::string command = options.command;  // resumes the campaign
  return with_store_errors(*folder, command,
                           [&] { return run_and_write(*loaded, *folder, shard, options, stop, command); });
}

}  // namespace grapnel::app
