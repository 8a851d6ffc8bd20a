#include "run_problem.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <set>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "commands.hpp"
#include "grapnel/capture/recorder.hpp"
#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/plugin/plugin_ends.hpp"
#include "grapnel/result/atomic_file.hpp"
#include "grapnel/result/hdf5_writer.hpp"
#include "grapnel/result/result_documents.hpp"
#include "grapnel/result/result_table.hpp"
#include "grapnel/result/scene.hpp"
#include "grapnel/result/verdicts.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "grapnel/study/case_pool.hpp"
#include "grapnel/text/error_text.hpp"
#include "output_folder.hpp"
#include "terminal.hpp"

namespace grapnel::app {
namespace fs = std::filesystem;

namespace {

// The result of a computation that ended without one.
CaptureResult failed(const CaptureProblem& problem, const std::string& why) {
  CaptureResult result;
  result.scenario_name = problem.name, result.scenario_sha256 = problem.sha256;
  result.status = CaptureStatus::failed;
  result.failure = why;
  return result;
}

// Adds the warnings about the input to the error of a failed plan: implausible input is the most likely cause.
void name_suspects(CaptureResult& result, const std::vector<std::string>& warnings) {
  constexpr std::size_t kMost = 3;
  if (result.status != CaptureStatus::failed || !result.failure.starts_with("planning")) return;
  for (std::size_t i = 0; i < std::min(warnings.size(), kMost); ++i)
    result.failure += (i == 0 ? ". Check first: " : "; and: ") + warnings[i];
}

}  // namespace

CaptureResult simulate_run(const CaptureProblem& problem, const std::vector<std::string>& warnings,
                           const CaptureProgress& progress, SeriesSink* sink) {
  CaptureResult result;
  try {
    result = simulate_capture(problem, progress, CaptureDetail::full, sink);
  } catch (const CaptureProblemError&) {
    throw;
  } catch (const ModelError&) {
    throw;
  } catch (const std::exception& error) {
    result = failed(problem, error_text(error));
  }
  name_suspects(result, warnings);
  return result;
}

std::string Written::names() const {
  std::string list;
  for (const char* name : {"summary.json", "timeseries.h5", "scene.json"})
    if (files.contains(name)) list += (list.empty() ? "" : ", ") + std::string(name);
  return list;
}

Written write_results(const CaptureProblem& problem, const CaptureResult& result, bool any_samples,
                      const std::function<void(const fs::path&)>& write_series, const fs::path& folder) {
  Written written;
  // Removes a file of an earlier run, which does not belong to this one.
  const auto remove = [&](const char* name) {
    std::error_code ignored;
    fs::remove(folder / name, ignored);
  };
  const auto write = [&](const char* name, const auto& writer) {
    try {
      writer(folder / name);
      written.files.insert(name);
    } catch (const std::exception& error) {
      remove(name);
      written.faults.emplace_back(error_text(error));
    }
  };
  write("summary.json",
        [&](const fs::path& file) { write_file_atomically(file, summary_json(result, GRAPNEL_VERSION)); });
  write("scene.json", [&](const fs::path& file) {
    write_file_atomically(file,
                          scene_json(result.scene, result.scenario_name, result.scenario_sha256, GRAPNEL_VERSION));
  });
  if (problem.source) {
    write("scenario.json", [&](const fs::path& file) {
      write_file_atomically(
          file, source_texts_json(*problem.source, result.scenario_name, result.scenario_sha256, GRAPNEL_VERSION));
    });
  } else {
    remove("scenario.json");
  }
  if (any_samples) {
    write("timeseries.h5", write_series);
  } else {
    remove("timeseries.h5");
  }
  return written;
}

namespace {

// Age from which temporary files of killed runs are removed [s].
constexpr double kAbandoned = 3600;

// Prints one line on stderr for each line of the message.
int bad_input(const fs::path& file, const std::exception& error) {
  std::string text = error_text(error);
  for (std::size_t at = 0; at <= text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    to_stderr("{}: error: {}\n", file.string(), text.substr(at, end - at));
    at = end + 1;
  }
  return kBadInput;
}

// Warns of long time series before the simulation begins.
void announce_series(const CaptureProblem& problem, const fs::path& file, const fs::path& folder) {
  constexpr double kFew = 20'000, kLarge = 1e9;  // samples, bytes
  const double duration = (problem.approach ? problem.approach->duration : 0.0) + problem.post_impact.total_duration();
  if (!(problem.output_interval > 0) || duration / problem.output_interval < kFew) return;
  const ExpectedSeries expected = expected_series(problem);
  if (expected.bytes() < kLarge) return;
  std::error_code unknown;
  const fs::space_info space = fs::space(folder, unknown);
  const bool short_of_room = !unknown && static_cast<double>(space.available) < expected.bytes();
  to_stderr(
      "{}: warning: output.interval = {:g} s makes about {:.3g} samples of {:g} numbers: {:.3g} GB in timeseries.h5 "
      "before compression{}; a longer interval makes fewer\n",
      file.string(), problem.output_interval, expected.samples, expected.columns, 1e-9 * expected.bytes(),
      short_of_room ? fmt::format(", where {:.3g} GB are free", 1e-9 * static_cast<double>(space.available)) : "");
}

// The table without the reason of a failure, which is printed once, on stderr.
std::string table_of(CaptureResult& result) {
  const bool unplanned = result.failure.starts_with("planning");
  const std::string failure =
      std::exchange(result.failure, unplanned ? "planning the approach (reason below)" : "reason below");
  std::string table = result_table(result);
  result.failure = failure;
  return table;
}

void warn(const CaptureProblem& problem, const CaptureResult& result, const fs::path& file) {
  for (const std::string& slow : slow_phases(problem, result)) to_stderr("{}: warning: {}\n", file.string(), slow);
  for (const std::string& warning : result.warnings) to_stderr("{}: warning: {}\n", file.string(), warning);
  for (const GraspOutcome& grasp : result.grasps) {
    if (grasp.captured || result.failure.find(grasp.reason) != std::string::npos) continue;  // already in the failure
    to_stderr("{}: warning: {} does not capture {}: {}\n", file.string(), grasp.end_effector, grasp.target,
              grasp.reason);
  }
  if (result.capture_verdict() == Captured::assumed)
    to_stderr("{}: warning: {}\n", file.string(), capture_sentence(result));
  if (result.ledger.feasibility() != Verdict::yes)
    to_stderr("{}: warning: {}\n", file.string(), feasibility_sentence(result));
  if (const std::string ratings = ratings_sentence(result); !ratings.empty())
    to_stderr("{}: warning: {}\n", file.string(), ratings);
}

// Prints why the conservation checks of a completed run failed, and the remedies.
void refuse_result(const Ledger& ledger, const fs::path& file) {
  for (const LedgerEntry& entry : ledger.entries) {
    if (entry.kind != LedgerEntry::Kind::conservation || entry.pass()) continue;
    to_stderr("{}: error: conservation check failed: {}{}{}\n", file.string(), failure_text(entry),
              entry.advice.empty() ? "" : ": ", entry.advice);
  }
}

}  // namespace

int run_problem(const CaptureProblem& problem, const fs::path& file, const fs::path& folder,
                const RunSwitches& switches) {
  remove_leftovers(folder, kAbandoned);
  LatePluginEnds ends;  // writes a plugin's results before its destroy() can end the program
  CaptureResult result;
  TimeSeriesFile series(folder / "timeseries.h5", {GRAPNEL_VERSION, problem.name, problem.sha256});
  try {
    if (!switches.mute) announce_series(problem, file, folder);
    Progress progress(switches.quiet);
    SlowWarning slow(file.string(), [&](const std::string& phase) { return causes_of_short_steps(problem, phase); });
    const auto follow = [&](const std::string& phase, double at, double end) {
      if (switches.stop.stop_requested()) throw std::runtime_error("stopped");
      progress.report(phase, at, end);
      if (!switches.mute) slow.report(phase, at, end);
    };
    result = simulate_run(problem, switches.warnings, follow, &series);
  } catch (const CaptureProblemError& error) {
    return bad_input(file, error);
  } catch (const ModelError& error) {
    return bad_input(file, error);
  }
  const std::string table = switches.quiet ? std::string() : table_of(result);
  const std::vector<std::string> warnings = result.warnings;
  result.warnings.insert(result.warnings.begin(), switches.warnings.begin(), switches.warnings.end());
  const bool any_samples = series.samples() + result.series.time.size() > 0;
  const Written written = write_results(
      problem, result, any_samples, [&](const fs::path&) { series.finish(result.series); }, folder);
  result.warnings = warnings;  // the warnings about the input have been printed
  const bool complete = written.faults.empty();
  const FolderReport report = write_folder_report(folder, ResultKind::run, switches.no_report || !complete);
  if (!switches.quiet) to_stdout("{}\nresults in {}: {}\n{}", table, folder.string(), written.names(), report.line);
  if (!switches.mute) warn(problem, result, file);
  for (const std::string& fault : written.faults) to_stderr("grapnel: error: {}\n", fault);
  flush_stdout();
  ends.finish();
  if (result.status == CaptureStatus::completed) {
    if (!switches.mute) refuse_result(result.ledger, file);
    return report.failed || !complete || !result.ledger.pass() ? kSimulationFailed : kDone;
  }
  if (switches.stop.stop_requested()) {
    if (!switches.mute) to_stderr("{}: stopped; the results so far are in {}\n", file.string(), folder.string());
    return kInterrupted;
  }
  if (!switches.mute) to_stderr("{}: error: the simulation failed: {}\n", file.string(), result.failure);
  return kSimulationFailed;
}

namespace {

// With more inputs than this, only the file lists the drawn values.
constexpr std::size_t kMostListed = 40;

// The campaign files' word for a case.
const char* word_of(const Campaign& campaign) { return campaign.kind == CampaignKind::sweep ? "point" : "case"; }

std::string comment_of(const Campaign& campaign, std::uint64_t k) {
  const bool sweep = campaign.kind == CampaignKind::sweep;
  std::string text =
      fmt::format("Made by grapnel {} {} from {} (sha256 {}): {} {}", GRAPNEL_VERSION, sweep ? "sweep" : "campaign",
                  fs::path(campaign.file).filename().string(), campaign.sha256.substr(0, 12), word_of(campaign), k);
  if (sweep) {
    text += fmt::format(" of {}.\n", campaign.total());
    const std::vector<std::size_t> position = campaign.position(k);
    for (std::size_t a = 0; a < position.size(); ++a) {
      const StudyAxis& axis = campaign.design[a];
      const AxisValue& value = axis.values[position[a]];
      text += axis.is_numeric
                  ? fmt::format("  {}: {}{}\n", axis.name, value.number, axis.unit.empty() ? "" : " " + axis.unit)
                  : fmt::format("  {}: {}\n", axis.name, value.label);
    }
    return text;
  }
  text += fmt::format(", seed {}.\n", campaign.seed);
  const std::vector<double> drawn = campaign.draw(k);
  for (std::size_t i = 0; i < std::min(drawn.size(), kMostListed); ++i) {
    const CampaignInput& input = campaign.inputs[i];
    text += fmt::format("  {}: {}{}\n", input.name, drawn[i],
                        input.unit.empty() || input.unit == "1" ? "" : " " + input.unit);
  }
  return text;
}

}  // namespace

int run_case_completely(const Campaign& campaign, std::uint64_t k, const fs::path& folder,
                        const RunSwitches& switches) {
  const fs::path file = folder / "scenario.yaml";
  if (!may_replace(file)) return kBadInput;
  CaptureProblem problem;
  try {
    write_file_atomically(file, campaign.scenario_text(k, {}, comment_of(campaign, k)));
    problem = load_scenario(file);
  } catch (const InputError& error) {
    print_errors(error.faults());
    return kBadInput;
  } catch (const std::exception& error) {
    to_stderr("{}: error: {} {}: {}\n", campaign.file, word_of(campaign), k, error_text(error));
    return kBadInput;
  }
  if (!switches.quiet) {
    to_stdout("grapnel {}, {} {} of {} {} as scenario {} (sha256 {})\n\n", GRAPNEL_VERSION, word_of(campaign), k,
              campaign.kind == CampaignKind::sweep ? "study" : "campaign", campaign.file, file.string(),
              problem.sha256.substr(0, 12));
    flush_stdout();
  }
  return run_problem(problem, file, folder, switches);
}

int only_case(const Campaign& campaign, std::uint64_t k, const fs::path& asked, const RunSwitches& switches) {
  // Cases beyond the campaign's own are those of --extend; a design has none.
  if (!campaign.design.empty() && k >= campaign.total()) {
    to_stderr("{0}: error: there is no {1} {2}: the {3} has {1}s 0 to {4}\n", campaign.file, word_of(campaign), k,
              campaign.kind == CampaignKind::sweep ? "study" : "campaign", campaign.total() - 1);
    return kBadInput;
  }
  const fs::path file = campaign.file;
  const std::optional<fs::path> folder = results_folder(
      asked.empty() ? fs::path("out") / fmt::format("{}-{}-{}", file.stem().string(), word_of(campaign), k) : asked,
      file, Outputs::case_run);
  if (!folder) return kBadInput;
  const StopSignal stop;
  RunSwitches stoppable = switches;
  stoppable.stop = stop.token();
  return run_case_completely(campaign, k, *folder, stoppable);
}

}  // namespace grapnel::app
