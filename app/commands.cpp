#include "commands.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>

#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/result/atomic_file.hpp"
#include "grapnel/result/export_files.hpp"
#include "grapnel/result/hdf5_writer.hpp"
#include "grapnel/result/result_table.hpp"
#include "grapnel/result/summary.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "output_folder.hpp"
#include "progress.hpp"

namespace grapnel::app {
namespace {

namespace fs = std::filesystem;

// Reports all faults on stderr, one a line.
int bad_input(const ScenarioError& error) {
  for (const Fault& fault : error.faults()) fmt::print(stderr, "{}\n", fault.text());
  return kBadInput;
}
int bad_input(const fs::path& file, const std::exception& error) {
  std::string text = error.what();
  for (std::size_t at = 0; at <= text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    fmt::print(stderr, "{}: error: {}\n", file.string(), text.substr(at, end - at));
    at = end + 1;
  }
  return kBadInput;
}

std::vector<Override> parse_overrides(const std::vector<std::string>& arguments) {
  std::vector<Override> overrides;
  for (const std::string& a : arguments) overrides.push_back(parse_override(a));
  return overrides;
}

// Writes what there is, also of a run that failed: what was computed before the failure is not lost.
void write_results(const CaptureResult& result, const fs::path& folder) {
  if (result.series.time.empty()) {
    fs::remove(folder / "timeseries.h5");  // of an earlier run: it does not belong to this summary
  } else {
    write_timeseries_hdf5(result.series, {GRAPNEL_VERSION, result.scenario_name, result.scenario_sha256},
                          folder / "timeseries.h5");
  }
  write_file_atomically(folder / "summary.json", summary_json(result, GRAPNEL_VERSION));
}

}  // namespace

int run(const RunOptions& options) {
  CaptureProblem problem;
  try {
    problem = load_scenario(options.scenario, parse_overrides(options.overrides));
  } catch (const ScenarioError& error) {
    return bad_input(error);
  }
  const fs::path folder = options.output.empty() ? fs::path("out") / options.scenario.stem() : options.output;
  if (!options.quiet) {
    fmt::print("grapnel {}, scenario {} (sha256 {})\n\n", GRAPNEL_VERSION, options.scenario.string(),
               problem.sha256.substr(0, 12));
    std::fflush(stdout);
  }
  if (const std::string why = cannot_write_to(folder); !why.empty()) {
    fmt::print(stderr, "grapnel: error: cannot write results to '{}': {}\n", folder.string(), why);
    return kBadInput;
  }
  CaptureResult result;
  try {
    Progress progress(options.quiet);
    result = simulate_capture(
        problem, [&](const std::string& phase, double at, double end) { progress.report(phase, at, end); });
  } catch (const std::invalid_argument& error) {
    return bad_input(options.scenario, error);
  }
  try {
    write_results(result, folder);
  } catch (const std::exception& error) {
    fmt::print(stderr, "grapnel: error: {}\n", error.what());
    return kSimulationFailed;
  }
  if (!options.quiet) {
    fmt::print("{}\nresults in {}: summary.json{}\n", result_table(result), folder.string(),
               result.series.time.empty() ? "" : ", timeseries.h5");
  }
  for (const std::string& warning : result.warnings)
    fmt::print(stderr, "{}: warning: {}\n", options.scenario.string(), warning);
  for (const GripOutcome& grip : result.grips) {
    if (!grip.captured) {
      fmt::print(stderr, "{}: warning: {} does not capture {}: {}\n", options.scenario.string(), grip.end_effector,
                 grip.target, grip.reason);
    }
  }
  if (!result.ledger.feasible()) {
    fmt::print(stderr, "{}: warning: not feasible, see clearance and limits in summary.json\n",
               options.scenario.string());
  }
  if (!result.ledger.pass()) {
    fmt::print(stderr, "{}: warning: the ledger fails, see its rows in summary.json; a smaller tolerance may mend it\n",
               options.scenario.string());
  }
  if (result.status != CaptureStatus::completed) {
    fmt::print(stderr, "{}: error: the simulation failed: {}\n", options.scenario.string(), result.failure);
    return kSimulationFailed;
  }
  return kDone;
}

int check(const fs::path& scenario, const std::vector<std::string>& overrides) {
  try {
    const CaptureProblem problem = load_scenario(scenario, parse_overrides(overrides));
    fmt::print("{}: no faults ({}, sha256 {})\n", scenario.string(), problem.name, problem.sha256.substr(0, 12));
    return kDone;
  } catch (const ScenarioError& error) {
    return bad_input(error);
  }
}

int print_schema(const std::string& which) {
  const std::string text = which == "robot"          ? robot_schema()
                           : which == "study"        ? study_schema()
                           : which == "optimization" ? optimization_schema()
                                                     : scenario_schema();
  std::fputs(text.c_str(), stdout);
  return kDone;
}

int export_result(const fs::path& folder, bool csv, bool mat) {
  try {
    if (csv) fmt::print("{}\n", export_csv(folder).string());
    if (mat) fmt::print("{}\n", export_mat(folder).string());
    return kDone;
  } catch (const std::exception& error) {
    fmt::print(stderr, "grapnel: error: {}\n", error.what());
    return kBadInput;
  }
}

}  // namespace grapnel::app
