#include <fmt/format.h>

#include <charconv>
#include <cstdlib>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string_view>

#include "commands.hpp"
#include "grapnel/campaign/campaign_folder.hpp"
#include "grapnel/campaign/result_folder.hpp"
#include "grapnel/campaign/run_scenario.hpp"
#include "grapnel/campaign/study_files.hpp"
#include "grapnel/text/error_text.hpp"
#include "terminal.hpp"
#include "watch.hpp"

namespace grapnel::app {
namespace fs = std::filesystem;

namespace {

// --- The part of a campaign that this process computes ---

struct JobShard : CampaignPart {
  bool by_slurm = false;  // from the environment variables of SLURM
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
  return {{*i - 1, *n}, false};
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
  return {{(id - first) / step, count}, true};
}

// "i/N" with 1 <= i <= N; "slurm": SLURM_ARRAY_TASK_ID among SLURM_ARRAY_TASK_MIN, _MAX, _STEP; empty: as "slurm" if
// these variables are set, otherwise the whole campaign. @throws std::invalid_argument with the error and the expected
// form
JobShard job_shard(const std::string& argument, const Environment& environment) {
  if (argument == "slurm") return by_slurm(environment);
  if (!argument.empty()) return stated(argument);
  return environment("SLURM_ARRAY_TASK_ID") == nullptr ? JobShard{} : by_slurm(environment);
}

// --- The commands ---

void print_start(const StudyOptions& options, const char* kind, const std::string& sha256) {
  if (options.quiet) return;
  to_stdout("grapnel {}, {} {} (sha256 {})\n\n", GRAPNEL_VERSION, kind, options.study.string(), sha256.substr(0, 12));
  flush_stdout();
}

// What load() reads, after its warnings have been printed; empty if the file has errors, which are printed.
template <class Read>
auto loaded(const fs::path& file, Read (*load)(const fs::path&, std::vector<Fault>*)) -> std::optional<Read> {
  try {
    std::vector<Fault> warnings;
    Read read = load(file, &warnings);
    print_errors(warnings);
    return read;
  } catch (const InputError& error) {
    print_errors(error.faults());
    return std::nullopt;
  }
}

// --only: one point or case as a complete run.
template <class Options>
int run_only(const Campaign& campaign, const Options& options) {
  const StopSignal stop;
  Terminal terminal;
  return code_of(only_case(
      campaign, *options.only, options.output,
      {.quiet = options.quiet, .no_report = options.no_report, .warnings = {}, .stop = stop.token()}, terminal));
}

}  // namespace

int sweep(StudyOptions options) {
  const std::optional<Campaign> study = loaded(options.study, load_study);
  if (!study) return kBadInput;
  if (options.only) return run_only(*study, options);
  Terminal terminal;
  const std::optional<fs::path> folder = results_folder(options.output, options.study, Outputs::sweep, terminal);
  if (!folder) return kBadInput;
  print_start(options, "study", study->sha256);
  const StopSignal stop;
  options.stop = stop.token();
  return code_of(watched(options.watch, {"sweep", study->name, *folder, stop.source()}, terminal,
                         [&](Listener& listener) { return run_sweep_folder(*study, *folder, options, listener); }));
}

int optimize(StudyOptions options) {
  const std::optional<Optimization> optimization = loaded(options.study, load_optimization);
  if (!optimization) return kBadInput;
  Terminal terminal;
  const std::optional<fs::path> folder = results_folder(options.output, options.study, Outputs::optimization, terminal);
  if (!folder || !may_replace(*folder / "best.yaml", terminal)) return kBadInput;
  print_start(options, "optimization", optimization->sha256);
  const StopSignal stop;
  options.stop = stop.token();
  return code_of(
      watched(options.watch, {"optimize", optimization->name, *folder, stop.source()}, terminal,
              [&](Listener& listener) { return run_optimization_folder(*optimization, *folder, options, listener); }));
}

void print_campaign(const Campaign& campaign, const CampaignRunOptions& options) {
  if (options.quiet) return;
  to_stdout("grapnel {}, campaign {} (sha256 {})\n", GRAPNEL_VERSION, options.study.string(),
            campaign.sha256.substr(0, 12));
  flush_stdout();
}

int campaign(CampaignRunOptions options) {
  Terminal terminal;
  std::optional<Campaign> campaign = campaign_from_file(options.study, options.map, terminal);
  if (!campaign) return kBadInput;
  if (options.only) return run_only(*campaign, options);
  JobShard shard;
  try {
    shard = job_shard(options.shard, [](const char* name) { return std::getenv(name); });
  } catch (const std::invalid_argument& error) {
    to_stderr("grapnel: error: {}\n", error_text(error));
    return kBadInput;
  }
  const std::optional<fs::path> folder = results_folder(options.output, options.study, Outputs::campaign, terminal);
  if (!folder) return kBadInput;
  print_campaign(*campaign, options);
  if (shard.by_slurm && !options.quiet)
    to_stdout("part {} from SLURM_ARRAY_TASK_ID={}\n", shard.text(), std::getenv("SLURM_ARRAY_TASK_ID"));
  const StopSignal stop;
  options.stop = stop.token();
  options.part = shard;
  const std::string name = campaign->name;
  return code_of(watched(
      options.watch, {options.map ? "map" : "campaign", name, *folder, stop.source()}, terminal,
      [&](Listener& listener) { return run_campaign_folder(std::move(*campaign), *folder, options, listener); }));
}

int merge(MergeOptions options) {
  options.command = "grapnel merge";
  for (const fs::path& folder : options.folders) options.command += " " + folder.string();
  options.command += " -o " + options.output.string();
  const StopSignal stop;
  options.stop = stop.token();
  Terminal terminal;
  return code_of(merge_folders(options.folders, options.output, options, terminal));
}

}  // namespace grapnel::app
