#include "run_problem.hpp"

#include <algorithm>
#include <set>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "commands.hpp"
#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/result/atomic_file.hpp"
#include "grapnel/result/hdf5_writer.hpp"
#include "grapnel/result/result_table.hpp"
#include "grapnel/result/scene.hpp"
#include "grapnel/result/source_texts.hpp"
#include "grapnel/result/summary.hpp"
#include "grapnel/study/slow_run.hpp"
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

// Where a computation ended without a result of its own.
CaptureResult failed(const CaptureProblem& problem, const char* why) {
  CaptureResult result;
  result.scenario_name = problem.name, result.scenario_sha256 = problem.sha256;
  result.status = CaptureStatus::failed;
  result.failure = why;
  return result;
}

// What was written of a result, and why the rest was not.
struct Written {
  std::set<std::string> files;
  std::vector<std::string> faults;

  // "summary.json, scene.json"
  std::string names() const {
    std::string list;
    for (const char* name : {"summary.json", "timeseries.h5", "scene.json"})
      if (files.contains(name)) list += (list.empty() ? "" : ", ") + std::string(name);
    return list;
  }
};

// Writes what there is, also of a run that failed: what was computed before the failure is not lost, and what does not
// fit costs nothing of what does. The summary comes first, the series, which are large, last.
Written write_results(const CaptureProblem& problem, const CaptureResult& result, const fs::path& folder) {
  Written written;
  // Of an earlier run: it does not belong to this one.
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
      written.faults.emplace_back(error.what());
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
  if (result.series.time.empty()) {
    remove("timeseries.h5");
  } else {
    write("timeseries.h5", [&](const fs::path& file) {
      write_timeseries_hdf5(result.series, {GRAPNEL_VERSION, result.scenario_name, result.scenario_sha256}, file);
    });
  }
  return written;
}

// The table, which leaves why a simulation failed to stderr: it is said once.
std::string table_of(CaptureResult& result) {
  const std::string failure = std::exchange(result.failure, "why is said below");
  std::string table = result_table(result);
  result.failure = failure;
  return table;
}

// A plan that cannot be found has a cause, and what is hardly meant in the input is the likeliest.
void name_suspects(CaptureResult& result, const std::vector<std::string>& doubts) {
  constexpr std::size_t kMost = 3;
  if (result.status != CaptureStatus::failed || !result.failure.starts_with("planning")) return;
  for (std::size_t i = 0; i < std::min(doubts.size(), kMost); ++i)
    result.failure += (i == 0 ? ". Look first at this: " : "; and at this: ") + doubts[i];
}

void warn(const CaptureProblem& problem, const CaptureResult& result, const fs::path& file) {
  for (const std::string& slow : slow_phases(problem, result)) to_stderr("{}: warning: {}\n", file.string(), slow);
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
  } catch (const CaptureProblemError& error) {
    return bad_input(file, error);
  } catch (const ModelError& error) {
    return bad_input(file, error);
  } catch (const std::exception& error) {
    result = failed(problem, error.what());
  }
  name_suspects(result, switches.doubts);
  const std::string table = switches.quiet ? std::string() : table_of(result);
  const std::vector<std::string> warnings = result.warnings;
  result.warnings.insert(result.warnings.begin(), switches.doubts.begin(), switches.doubts.end());
  const Written written = write_results(problem, result, folder);
  result.warnings = warnings;  // what is doubtful has been said
  const bool complete = written.faults.empty();
  const FolderReport report = write_folder_report(folder, ResultKind::run, switches.no_report || !complete);
  if (!switches.quiet) to_stdout("{}\nresults in {}: {}\n{}", table, folder.string(), written.names(), report.line);
  if (!switches.mute) warn(problem, result, file);
  for (const std::string& fault : written.faults) to_stderr("grapnel: error: {}\n", fault);
  if (result.status == CaptureStatus::completed) {
    if (!switches.mute) refuse_result(result.ledger, file);
    return report.failed || !complete || !result.ledger.pass() ? kSimulationFailed : kDone;
  }
  if (!switches.mute) to_stderr("{}: error: the simulation failed: {}\n", file.string(), result.failure);
  return kSimulationFailed;
}

}  // namespace grapnel::app
