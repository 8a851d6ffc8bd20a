#include "report/report_folder.hpp"

#include <cmath>

#include "grapnel/result/hdf5_writer.hpp"
#include "grapnel/result/result_documents.hpp"
#include "result/sample_result.hpp"

namespace grapnel::test {

TimeSeries sliding_series(std::size_t samples) {
  TimeSeries s;
  s.phases = {"approach", "post_impact"};
  for (const char* body : {"base", "targets/debris"}) {
    s.series.push_back({std::string(body) + "/position", "m", "position in W", {"x", "y", "z"}, {}});
    s.series.push_back({std::string(body) + "/quaternion_wxyz", "1", "orientation in W", {"w", "x", "y", "z"}, {}});
  }
  s.series.push_back({"kinetic_energy", "J", "½ νᵀ M ν", {""}, {}});
  for (std::size_t i = 0; i < 2 * samples; ++i) {
    const bool after = i >= samples;
    const double t = static_cast<double>(after ? i - 1 : i) / static_cast<double>(samples - 1);
    s.time.push_back(t);
    s.phase.push_back(after ? 1 : 0);
    for (std::size_t b = 0; b < 2; ++b) {
      const double x = std::sin(t + static_cast<double>(b)), angle = 0.1 * t;
      s.series[2 * b].data.insert(s.series[2 * b].data.end(), {x, t * t, 0.25});
      s.series[2 * b + 1].data.insert(s.series[2 * b + 1].data.end(), {std::cos(angle), 0, 0, std::sin(angle)});
    }
    s.series[4].data.push_back(after ? 1 : 2);
  }
  return s;
}

Scene sliding_scene() {
  Scene scene;
  SceneBody base, target;
  base.name = "base", base.kind = "base", base.series = "base", base.mass = 100;
  target.name = "debris", target.kind = "target", target.series = "targets/debris", target.mass = 10;
  scene.bodies = {base, target};
  return scene;
}

void write_run(const std::filesystem::path& folder, const std::string& name, const std::string& sha256,
               const TimeSeries& series) {
  std::filesystem::create_directories(folder);
  CaptureResult result = sample_result();
  result.scenario_name = name;
  result.scenario_sha256 = sha256;
  put_bytes(folder / "summary.json", summary_json(result, "0.1.0"));
  put_bytes(folder / "scene.json", scene_json(sliding_scene(), name, sha256, "0.1.0"));
  write_timeseries_hdf5(series, {"0.1.0", name, sha256}, folder / "timeseries.h5");
}

std::string from_base64(const std::string& text) {
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  unsigned bits = 0, held = 0;
  for (const char c : text) {
    const std::size_t digit = digits.find(c);
    if (digit == std::string::npos) break;
    bits = bits << 6 | static_cast<unsigned>(digit);
    held += 6;
    if (held < 8) continue;
    held -= 8;
    bytes += static_cast<char>(bits >> held & 255);
  }
  return bytes;
}

}  // namespace grapnel::test
