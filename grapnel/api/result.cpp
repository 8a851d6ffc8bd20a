#include "grapnel/api/result.hpp"

#include "grapnel/api/capture.hpp"
#include "grapnel/api/report.hpp"
#include "grapnel/api/version.hpp"
#include "grapnel/report/report_html.hpp"
#include "grapnel/result/atomic_file.hpp"
#include "grapnel/result/hdf5_writer.hpp"
#include "grapnel/result/result_documents.hpp"

namespace grapnel {

const char* version() { return GRAPNEL_VERSION; }

std::string summary_json(const CaptureResult& result) { return summary_json(result, version()); }

void save_results(const CaptureProblem& problem, const CaptureResult& result, const std::filesystem::path& folder) {
  const std::string &name = result.scenario_name, &sha256 = result.scenario_sha256;
  std::filesystem::create_directories(folder);
  write_file_atomically(folder / "summary.json", summary_json(result));
  write_file_atomically(folder / "scene.json", scene_json(result.scene, name, sha256, version()));
  if (problem.source)
    write_file_atomically(folder / "scenario.json", source_texts_json(*problem.source, name, sha256, version()));
  if (!result.series.time.empty())
    write_timeseries_hdf5(result.series, {version(), name, sha256}, folder / "timeseries.h5");
}

bool has_reports() { return !embedded_viewer().empty(); }

void save_report(const std::filesystem::path& folder) {
  write_report(report_data(folder, version()), folder / "report.html");
}

CaptureProgress until_stopped(std::stop_token stop, CaptureProgress progress) {
  return [stop = std::move(stop), progress = std::move(progress)](const std::string& phase, double time, double end) {
    if (stop.stop_requested()) throw std::runtime_error("stopped");
    if (progress) progress(phase, time, end);
  };
}

}  // namespace grapnel
