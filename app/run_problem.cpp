#include "run_problem.hpp"

#include <algorithm>
#include <stdexcept>

#include "commands.hpp"
#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/result/atomic_file.hpp"
#include "grapnel/result/hdf5_writer.hpp"
#include "grapnel/result/result_table.hpp"
#include "grapnel/result/scene.hpp"
#include "grapnel/result/source_texts.hpp"
#include "grapnel/result/summary.hpp"
#include "grapnel/result/verdicts.hpp"
#include "progress.hpp"
#include "report_file.hpp"
#include "terminal.hpp"

namespace grapnel::app {
namespace {

namespace fs = std::filesystem;

// One line of stderr for each line of the message.
int bad_input(const fs::path& file, const std::exception& error) {
  std::string text = error.what();
  for (std::size_t at = 0; at <= text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    to_stderr("{}: error: {}\n", file.string(), text.substr(at, end - at));
    at = end + 1;
  }
  return kBadInput;
}

// Writes what there is, also of a run that failed: what was computed before the failure is not lost.
void write_results(const CaptureProblem& problem, const CaptureResult& result, const fs::path& folder) {
  if (result.series.time.empty()) {
    fs::remove(folder / "timeseries.h5");  // of an earlier run: it does not belong to this summary
  } else {
    write_timeseries_hdf5(result.series, {GRAPNEL_VERSION, result.scenario_name, result.scenario_sha256},
                          folder / "timeseries.h5");
  }
  write_file_atomically(folder / "scene.json",
                        scene_json(result.scene, result.scenario_name, result.scenario_sha256, GRAPNEL_VERSION));
  if (problem.source) {
    write_file_atomically(folder / "scenario.json", source_texts_json(*problem.source, result.scenario_name,
                                                                      result.scenario_sha256, GRAPNEL_VERSION));
  } else {
    fs::remove(folder / "scenario.json");
  }
  write_file_atomically(folder / "summary.json", summary_json(result, GRAPNEL_VERSION));
}

void warn(const CaptureResult& result, const fs::path& file) {
  for (const std::string& warning : result.warnings) to_stderr("{}: warning: {}\n", file.string(), warning);
  for (const GripOutcome& grip : result.grips) {
    if (grip.captured) continue;
    to_stderr("{}: warning: {} does not capture {}: {}\n", file.string(), grip.end_effector, grip.target, grip.reason);
  }
  if (result.capture_verdict() == Captured::assumed)
    to_stderr("{}: warning: {}\n", file.string(), capture_sentence(result));
  if (result.ledger.feasibility() != Verdict::yes)
    to_stderr("{}: warning: {}\n", file.string(), feasibility_sentence(result));
}

// A completed run whose conservation checks fail: why, and what helps.
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
  CaptureResult result;
  try {
    Progress progress(switches.quiet);
    result = simulate_capture(
        problem, [&](const std::string& phase, double at, double end) { progress.report(phase, at, end); });
  } catch (const std::invalid_argument& error) {
    return bad_input(file, error);
  }
  try {
    write_results(problem, result, folder);
  } catch (const std::exception& error) {
    to_stderr("grapnel: error: {}\n", error.what());
    return kSimulationFailed;
  }
  const FolderReport report = write_folder_report(folder, ResultKind::run, switches.no_report);
  if (!switches.quiet) {
    to_stdout("{}\nresults in {}: summary.json{}, scene.json\n{}", result_table(result), folder.string(),
              result.series.time.empty() ? "" : ", timeseries.h5", report.line);
  }
  if (!switches.mute) warn(result, file);
  if (result.status == CaptureStatus::completed) {
    if (!switches.mute) refuse_result(result.ledger, file);
    return report.failed || !result.ledger.pass() ? kSimulationFailed : kDone;
  }
  if (!switches.mute) to_stderr("{}: error: the simulation failed: {}\n", file.string(), result.failure);
  return kSimulationFailed;
}

}  // namespace grapnel::app
