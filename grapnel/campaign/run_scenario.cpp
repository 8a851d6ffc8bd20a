#include "grapnel/campaign/run_scenario.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <set>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "grapnel/campaign/case_pool.hpp"
#include "grapnel/campaign/result_folder.hpp"
#include "grapnel/capture/recorder.hpp"
#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/control/plugin_ends.hpp"
#include "grapnel/linear/linearize.hpp"
#include "grapnel/result/atomic_file.hpp"
#include "grapnel/result/hdf5_writer.hpp"
#include "grapnel/result/result_documents.hpp"
#include "grapnel/result/result_table.hpp"
#include "grapnel/result/scene.hpp"
#include "grapnel/result/verdicts.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "grapnel/text/error_text.hpp"

namespace grapnel {
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
  constexpr std::size_t kMaxShown = 3;
  if (result.status != CaptureStatus::failed || !result.failure.starts_with("planning")) return;
  for (std::size_t i = 0; i < std::min(warnings.size(), kMaxShown); ++i)
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

// One error for each line of the message.
Ending bad_input(const fs::path& file, const std::exception& error, Listener& listener) {
  std::string text = error_text(error);
  for (std::size_t at = 0; at <= text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    listener.error(file.string(), text.substr(at, end - at));
    at = end + 1;
  }
  return Ending::bad_input;
}

// Warns that a long phase is slow, and why, even without progress. The first warning comes after 20 s, if the phase
// takes at least as long again. Further warnings follow whenever the elapsed time has doubled.
class SlowWarning {
 public:
  SlowWarning(const CaptureProblem& problem, const fs::path& file, Listener& listener)
      : problem_(problem), file_(file.string()), listener_(listener) {}
  void report(const std::string& phase, double at, double end);

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr double kSlow = 20;  // [s]
  const CaptureProblem& problem_;
  std::string file_;
  Listener& listener_;
  std::string phase_;
  double first_ = 0;
  Clock::time_point begin_ = Clock::now();
  double next_ = kSlow;  // [s]
};

void SlowWarning::report(const std::string& phase, double at, double end) {
  const Clock::time_point now = Clock::now();
  if (phase != phase_) {
    phase_ = phase;
    first_ = at;
    begin_ = now;
    next_ = kSlow;
  }
  const double elapsed = std::chrono::duration<double>(now - begin_).count();
  if (elapsed < next_) return;
  next_ = 2 * elapsed;
  const double rate = (at - first_) / elapsed, left = rate > 0 ? (end - at) / rate : HUGE_VAL;
  if (left < elapsed) return;
  if (phase == kPlanning && !(end > 0)) {
    listener_.warning(file_, fmt::format("slow: the targets' motion before the capture has taken {:.0f} s so far; {}",
                                         elapsed, causes_of_short_steps(problem_, phase)));
    return;
  }
  if (phase == kPlanning) {
    listener_.warning(
        file_,
        fmt::format("slow: planning has made {:.3g} evaluations in {:.0f} s and ends at most at {:.3g}, about {:.0f} s "
                    "from now; to shorten it, reduce the starts, knots and constraints of approach.plan",
                    at, elapsed, end, left));
    return;
  }
  const std::string time = left < 1e6 ? fmt::format("about {:.0f} s left", left) : "no estimate of the end";
  listener_.warning(
      file_, fmt::format("slow: {} is at t = {:.4g} of {:.4g} s after {:.0f} s, {:.2g} simulated s per s, {}; to "
                         "speed it up, most effective first: {}",
                         phase, at, end, elapsed, rate, time, causes_of_short_steps(problem_, phase)));
}

// Warns of long time series before the simulation begins.
void announce_series(const CaptureProblem& problem, const fs::path& file, const fs::path& folder, Listener& listener) {
  constexpr double kFew = 20'000, kLarge = 1e9;  // samples, bytes
  const double duration = (problem.approach ? problem.approach->duration : 0.0) + problem.post_impact.total_duration();
  if (!(problem.output_interval > 0) || duration / problem.output_interval < kFew) return;
  const ExpectedSeries expected = expected_series(problem);
  if (expected.bytes() < kLarge) return;
  std::error_code unknown;
  const fs::space_info space = fs::space(folder, unknown);
  const bool short_of_room = !unknown && static_cast<double>(space.available) < expected.bytes();
  listener.warning(
      file.string(),
      fmt::format(
          "output.interval = {:g} s makes about {:.3g} samples of {:g} numbers: {:.3g} GB in timeseries.h5 "
          "before compression{}; a longer interval makes fewer",
          problem.output_interval, expected.samples, expected.columns, 1e-9 * expected.bytes(),
          short_of_room ? fmt::format(", where {:.3g} GB are free", 1e-9 * static_cast<double>(space.available)) : ""));
}

// The table without the reason of a failure, which is an error of the listener.
std::string table_of(CaptureResult& result) {
  const bool unplanned = result.failure.starts_with("planning");
  const std::string failure =
      std::exchange(result.failure, unplanned ? "planning the approach (reason below)" : "reason below");
  std::string table = result_table(result);
  result.failure = failure;
  return table;
}

void warn(const CaptureProblem& problem, const CaptureResult& result, const std::string& file, Listener& listener) {
  for (const std::string& slow : slow_phases(problem, result)) listener.warning(file, slow);
  for (const std::string& warning : result.warnings) listener.warning(file, warning);
  for (const GraspOutcome& grasp : result.grasps) {
    if (grasp.captured || result.failure.find(grasp.reason) != std::string::npos) continue;  // already in the failure
    listener.warning(file, fmt::format("{} does not capture {}: {}", grasp.end_effector, grasp.target, grasp.reason));
  }
  if (result.capture_verdict() == Captured::assumed) listener.warning(file, capture_sentence(result));
  if (result.ledger.feasibility() != Verdict::yes) listener.warning(file, feasibility_sentence(result));
  if (const std::string ratings = ratings_sentence(result); !ratings.empty()) listener.warning(file, ratings);
}

// Tells why the conservation checks of a completed run failed, and the remedies.
void refuse_result(const Ledger& ledger, const std::string& file, Listener& listener) {
  for (const LedgerEntry& entry : ledger.entries) {
    if (entry.kind != LedgerEntry::Kind::conservation || entry.pass()) continue;
    listener.error(file, fmt::format("conservation check failed: {}{}{}", failure_text(entry),
                                     entry.advice.empty() ? "" : ": ", entry.advice));
  }
}

}  // namespace

void add_margins(const CaptureProblem& problem, const CaptureProgress& progress, CaptureResult& result) {
  try {
    add_control_loops(problem, result, progress);
    if (result.control_loops.empty())
      result.warnings.emplace_back("no margins: no law acts whose state is accessible, see grapnel linearize");
  } catch (const std::exception& error) {
    result.warnings.push_back(std::string("not all margins are computed: ") + error_text(error));
  }
}

namespace {

// The file of a run's series; the listener sees its samples before they are written.
class ShownSeries : public SeriesSink {
 public:
  ShownSeries(TimeSeriesFile& file, Listener& listener) : file_(file), listener_(listener) {}
  void take(TimeSeries& block) override { file_.take(block); }
  void sampled(const TimeSeries& block) override { listener_.samples(block); }

 private:
  TimeSeriesFile& file_;
  Listener& listener_;
};

}  // namespace

Ending run_scenario(const CaptureProblem& problem, const fs::path& file, const fs::path& folder,
                    const RunSwitches& switches, Listener& listener) {
  remove_leftovers(folder, kAbandoned);
  LatePluginEnds ends;  // writes a plugin's results before its destroy() can end the program
  CaptureResult result;
  TimeSeriesFile series(folder / "timeseries.h5", {GRAPNEL_VERSION, problem.name, problem.sha256});
  try {
    if (!switches.mute) announce_series(problem, file, folder, listener);
    SlowWarning slow(problem, file, listener);
    const auto follow = [&](const std::string& phase, double at, double end) {
      if (switches.stop.stop_requested()) throw std::runtime_error("stopped");
      if (!switches.quiet) listener.phase(phase, at, end);
      if (!switches.mute) slow.report(phase, at, end);
    };
    ShownSeries shown(series, listener);
    result = simulate_run(problem, switches.warnings, follow, &shown);
    if (switches.margins) add_margins(problem, follow, result);
  } catch (const CaptureProblemError& error) {
    return bad_input(file, error, listener);
  } catch (const ModelError& error) {
    return bad_input(file, error, listener);
  }
  const std::string table = switches.quiet ? std::string() : table_of(result);
  const std::vector<std::string> warnings = result.warnings;
  result.warnings.insert(result.warnings.begin(), switches.warnings.begin(), switches.warnings.end());
  const bool any_samples = series.samples() + result.series.time.size() > 0;
  const Written written = write_results(
      problem, result, any_samples, [&](const fs::path&) { series.finish(result.series); }, folder);
  result.warnings = warnings;  // the listener knows the warnings about the input
  const bool complete = written.faults.empty();
  const FolderReport report = write_folder_report(folder, ResultKind::run, switches.no_report || !complete, listener);
  if (!switches.quiet)
    listener.note(fmt::format("{}\nresults in {}: {}\n{}", table, folder.string(), written.names(), report.line));
  if (!switches.mute) warn(problem, result, file.string(), listener);
  for (const std::string& fault : written.faults) listener.error("grapnel", fault);
  ends.finish();
  const bool stopped =
      switches.stop.stop_requested() && (switches.margins || result.status != CaptureStatus::completed);
  if (!stopped && result.status == CaptureStatus::completed) {
    if (!switches.mute) refuse_result(result.ledger, file.string(), listener);
    return report.failed || !complete || !result.ledger.pass() ? Ending::failed : Ending::done;
  }
  if (stopped) {
    if (!switches.mute)
      listener.remark(fmt::format("{}: stopped; the results so far are in {}", file.string(), folder.string()));
    return Ending::interrupted;
  }
  if (!switches.mute) listener.error(file.string(), "the simulation failed: " + result.failure);
  return Ending::failed;
}

namespace {

// With more inputs than this, only the file lists the drawn values.
constexpr std::size_t kMaxListed = 40;

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
  for (std::size_t i = 0; i < std::min(drawn.size(), kMaxListed); ++i) {
    const CampaignInput& input = campaign.inputs[i];
    text += fmt::format("  {}: {}{}\n", input.name, drawn[i],
                        input.unit.empty() || input.unit == "1" ? "" : " " + input.unit);
  }
  return text;
}

}  // namespace

Ending run_case_completely(const Campaign& campaign, std::uint64_t k, const fs::path& folder,
                           const RunSwitches& switches, Listener& listener) {
  const fs::path file = folder / "scenario.yaml";
  if (!may_replace(file, listener)) return Ending::bad_input;
  CaptureProblem problem;
  try {
    write_file_atomically(file, campaign.scenario_text(k, {}, comment_of(campaign, k)));
    problem = load_scenario(file);
  } catch (const InputError& error) {
    listener.faults(error.faults());
    return Ending::bad_input;
  } catch (const std::exception& error) {
    listener.error(campaign.file, fmt::format("{} {}: {}", word_of(campaign), k, error_text(error)));
    return Ending::bad_input;
  }
  if (!switches.quiet) {
    listener.note(fmt::format("grapnel {}, {} {} of {} {} as scenario {} (sha256 {})\n\n", GRAPNEL_VERSION,
                              word_of(campaign), k, campaign.kind == CampaignKind::sweep ? "study" : "campaign",
                              campaign.file, file.string(), problem.sha256.substr(0, 12)));
  }
  return run_scenario(problem, file, folder, switches, listener);
}

Ending only_case(const Campaign& campaign, std::uint64_t k, const fs::path& requested, const RunSwitches& switches,
                 Listener& listener) {
  // Cases beyond the campaign's own are those of --extend; a design has none.
  if (!campaign.design.empty() && k >= campaign.total()) {
    listener.error(campaign.file,
                   fmt::format("there is no {0} {1}: the {2} has {0}s 0 to {3}", word_of(campaign), k,
                               campaign.kind == CampaignKind::sweep ? "study" : "campaign", campaign.total() - 1));
    return Ending::bad_input;
  }
  const fs::path file = campaign.file;
  const std::optional<fs::path> folder = results_folder(
      requested.empty() ? fs::path("out") / fmt::format("{}-{}-{}", file.stem().string(), word_of(campaign), k)
                        : requested,
      file, Outputs::case_run, listener);
  return folder ? run_case_completely(campaign, k, *folder, switches, listener) : Ending::bad_input;
}

}  // namespace grapnel
