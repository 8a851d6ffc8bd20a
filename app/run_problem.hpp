#pragma once

/// @file
/// One capture, simulated, written and printed: of a scenario, a point of a sweep or a case of a campaign.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <set>
#include <stop_token>
#include <string>
#include <vector>

#include "grapnel/campaign/campaign.hpp"
#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/result/capture_result.hpp"

namespace grapnel::app {

/// Runs simulate_capture(). An exception that is not an input error becomes the failure of the result. If planning
/// failed, the failure also lists the warnings about the input (`warnings`). @throws CaptureProblemError, ModelError,
/// and exceptions of progress that do not derive from std::exception.
CaptureResult simulate_run(const CaptureProblem& problem, const std::vector<std::string>& warnings,
                           const CaptureProgress& progress = {}, SeriesSink* sink = nullptr);

/// The files that were written, and the errors of the others.
struct Written {
  std::set<std::string> files;
  std::vector<std::string> faults;
  std::string names() const;  // "summary.json, scene.json"
};

/// Writes summary.json, scene.json, scenario.json and timeseries.h5, also of a failed run, so that results before the
/// failure are kept. An error in one file does not prevent the others. The summary is written first and the series,
/// which are large, last, by `write_series`. Files that are not written are removed, since they would belong to an
/// earlier run.
Written write_results(const CaptureProblem& problem, const CaptureResult& result, bool any_samples,
                      const std::function<void(const std::filesystem::path&)>& write_series,
                      const std::filesystem::path& folder);

struct RunSwitches {
  bool quiet = false;      // prints errors and warnings only
  bool no_report = false;  // no report.html
  bool mute = false;       // prints neither warnings nor failures: one of many runs
  /// Warnings about implausible input: already printed, and stored with the result.
  std::vector<std::string> warnings = {};
  std::stop_token stop = {};  // requests an early end with the results so far
};

/// Simulates, writes summary.json, timeseries.h5, scene.json and report.html into `folder`, prints the results, and
/// prints warnings that name `file`. An output that cannot be written is an error; the others are written. Returns the
/// exit code.
int run_problem(const CaptureProblem& problem, const std::filesystem::path& file, const std::filesystem::path& folder,
                const RunSwitches& switches);

/// Writes case k as a complete scenario, FOLDER/scenario.yaml, and runs that file as `grapnel run` does, so that the
/// file is what is simulated. Returns the exit code.
int run_case_completely(const Campaign& campaign, std::uint64_t k, const std::filesystem::path& folder,
                        const RunSwitches& switches);

/// The same for --only: checks that the case exists, and chooses its folder; `asked`: the folder that the user named,
/// or empty.
int only_case(const Campaign& campaign, std::uint64_t k, const std::filesystem::path& asked,
              const RunSwitches& switches);

}  // namespace grapnel::app
