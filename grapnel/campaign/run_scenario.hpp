#pragma once

/// @file
/// One capture, simulated and written to a folder: of a scenario, a point of a sweep or a case of a campaign. Thread
/// safety: one call per folder at a time.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <set>
#include <stop_token>
#include <string>
#include <vector>

#include "grapnel/campaign/campaign.hpp"
#include "grapnel/campaign/listener.hpp"
#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/result/capture_result.hpp"

namespace grapnel {

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
/// failure are retained. An error in one file does not prevent the others. The summary is written first; `write_series`
/// writes the series, which are large, last. Files that are not written are removed, since they would belong to an
/// earlier run.
Written write_results(const CaptureProblem& problem, const CaptureResult& result, bool any_samples,
                      const std::function<void(const std::filesystem::path&)>& write_series,
                      const std::filesystem::path& folder);

/// add_control_loops(), as `grapnel run --margins`: if there are none, or not all, a warning of the result states why.
void add_margins(const CaptureProblem& problem, const CaptureProgress& progress, CaptureResult& result);

struct RunSwitches {
  bool quiet = false;      // no notes and no progress
  bool no_report = false;  // no report.html
  bool margins = false;    // linear models of the control loops, too: add_control_loops()
  bool mute = false;       // neither warnings nor failures for the listener: one of many runs
  /// Warnings about implausible input: already known to the listener, and stored with the result.
  std::vector<std::string> warnings = {};
  std::stop_token stop = {};  // requests an early end with the results so far
};

/// Simulates and writes summary.json, timeseries.h5, scene.json, scenario.json and report.html into `folder`. The
/// listener gets the table of results, and warnings that name `file`. An output that cannot be written is an error; the
/// others are written. A failed or stopped simulation leaves the results so far.
Ending run_scenario(const CaptureProblem& problem, const std::filesystem::path& file,
                    const std::filesystem::path& folder, const RunSwitches& switches, Listener& listener);

/// Writes case k as a complete scenario, FOLDER/scenario.yaml, and runs that file like `grapnel run`, so that the
/// results belong to this file.
Ending run_case_completely(const Campaign& campaign, std::uint64_t k, const std::filesystem::path& folder,
                           const RunSwitches& switches, Listener& listener);

/// The same for --only: checks that the case exists, and chooses its folder; `requested`: the folder that the user
/// named, or empty.
Ending only_case(const Campaign& campaign, std::uint64_t k, const std::filesystem::path& requested,
                 const RunSwitches& switches, Listener& listener);

}  // namespace grapnel
