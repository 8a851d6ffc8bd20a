#pragma once

/// @file
/// One capture, simulated, written and said: of a scenario, or a point of a sweep or a case of a campaign.

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

/// What simulate_capture() finds, in full; what it throws that is no fault of the input is why the result has failed. A
/// plan that cannot be found is blamed on what in the input is hardly meant (`warnings`). @throws CaptureProblemError,
/// ModelError, and what progress throws that is no std::exception.
CaptureResult simulate_run(const CaptureProblem& problem, const std::vector<std::string>& warnings,
                           const CaptureProgress& progress = {}, SeriesSink* sink = nullptr);

/// What was written of a result, and why the rest was not.
struct Written {
  std::set<std::string> files;
  std::vector<std::string> faults;
  std::string names() const;  // "summary.json, scene.json"
};

/// Writes summary.json, scene.json, scenario.json and timeseries.h5, also of a run that failed: what was computed
/// before the failure is not lost, and what does not fit costs nothing of what does. The summary comes first, the
/// series, which are large, last, by `write_series`. What of these is not written is removed: it would be of an earlier
/// run.
Written write_results(const CaptureProblem& problem, const CaptureResult& result, bool any_samples,
                      const std::function<void(const std::filesystem::path&)>& write_series,
                      const std::filesystem::path& folder);

struct RunSwitches {
  bool quiet = false;      // errors and warnings only
  bool no_report = false;  // no report.html
  bool mute = false;       // not even warnings and why a simulation failed: one of many runs
  /// What in the input is hardly meant: it has been said, and is kept with the result.
  std::vector<std::string> warnings = {};
  std::stop_token stop = {};  // asks to end with what there is by then
};

/// Simulates, writes summary.json, timeseries.h5, scene.json and report.html into `folder`, prints what came out, and
/// warns naming `file`. What cannot be written is said, and costs nothing of the rest. Returns the exit code.
int run_problem(const CaptureProblem& problem, const std::filesystem::path& file, const std::filesystem::path& folder,
                const RunSwitches& switches);

/// Writes case k as a complete scenario, FOLDER/scenario.yaml, and runs that as `grapnel run` does: what was written is
/// what is simulated. Returns the exit code.
int run_case_completely(const Campaign& campaign, std::uint64_t k, const std::filesystem::path& folder,
                        const RunSwitches& switches);

/// The same for --only: that there is such a case, and into which folder it goes; `asked`: by the user, if not empty.
int only_case(const Campaign& campaign, std::uint64_t k, const std::filesystem::path& asked,
              const RunSwitches& switches);

}  // namespace grapnel::app
