#include "grapnel/report/run_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>

#include "grapnel/result/hdf5_reader.hpp"
#include "grapnel/result/json_document.hpp"

namespace grapnel {
namespace {

std::size_t at(std::size_t sample, const Series& series) { return sample * series.components.size(); }

const Series& wanted(const TimeSeries& series, const std::string& path, int width) {
  const Series* found = find_series(series, path);
  if (found == nullptr) throw std::runtime_error("the time series lack '" + path + "'");
  if (found->width() != width)
    throw std::runtime_error(
        fmt::format("the time series '{}' have {} components, not {}", path, found->width(), width));
  return *found;
}

}  // namespace

RunSource read_run_source(const std::filesystem::path& folder) {
  RunSource run;
  run.folder = folder;
  ReadTimeSeries read = read_timeseries(folder / "timeseries.h5", kShownBytes);
  run.series = std::move(read.series);
  run.metadata = std::move(read.head.metadata);
  run.every = read.head.every;
  if (run.series.time.empty()) throw std::runtime_error((folder / "timeseries.h5").string() + ": no samples");
  if (std::filesystem::exists(folder / "scene.json")) run.scene = read_scene(folder / "scene.json");
  const std::filesystem::path summary = folder / "summary.json";
  if (std::filesystem::exists(summary))
    run.summary = read_json_document(summary, "grapnel-summary/2", "grapnel-summary/1");
  return run;
}

const Series* find_series(const TimeSeries& series, const std::string& path) {
  const auto found =
      std::find_if(series.series.begin(), series.series.end(), [&](const Series& s) { return s.path == path; });
  return found == series.series.end() ? nullptr : &*found;
}

std::vector<std::string> names_in(const TimeSeries& series, const std::string& group, const std::string& quantity) {
  std::vector<std::string> names;
  const std::string head = group + "/", tail = "/" + quantity;
  for (const Series& s : series.series) {
    if (s.path.size() > head.size() + tail.size() && s.path.compare(0, head.size(), head) == 0 &&
        s.path.compare(s.path.size() - tail.size(), tail.size(), tail) == 0)
      names.push_back(s.path.substr(head.size(), s.path.size() - head.size() - tail.size()));
  }
  return names;
}

RecordedPose::RecordedPose(const TimeSeries& series, const std::string& path)
    : position_(&wanted(series, path + "/position", 3)), quaternion_(&wanted(series, path + "/quaternion_wxyz", 4)) {}

Vector3d RecordedPose::position(std::size_t sample) const {
  const double* p = &position_->data[at(sample, *position_)];
  return {p[0], p[1], p[2]};
}

Quaterniond RecordedPose::quaternion(std::size_t sample) const {
  const double* q = &quaternion_->data[at(sample, *quaternion_)];
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (length <= 1e-6) return Quaterniond::identity();
  return {q[0] / length, q[1] / length, q[2] / length, q[3] / length};
}

Posed RecordedPose::operator()(std::size_t sample) const {
  return {rotation_matrix(quaternion(sample)), position(sample)};
}

bool is_planar(const RunSource& run) {
  if (run.scene) return run.scene->planar;
  for (const Series& s : run.series.series) {
    if (s.width() != 3 || s.path.size() < 9 || s.path.compare(s.path.size() - 9, 9, "/position") != 0) continue;
    for (std::size_t i = 2; i < s.data.size(); i += 3) {
      if (std::abs(s.data[i]) > 1e-9) return false;
    }
  }
  return true;
}

std::vector<ArmPlace> body_places(const Scene& scene) {
  std::vector<ArmPlace> places(scene.bodies.size());
  std::map<std::string, std::size_t> links;
  int arms = 0;
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    const SceneBody& body = scene.bodies[i];
    if (body.kind != "link") continue;
    const auto parent = links.find(body.parent);
    const bool moves = body.joint && body.joint->type != "fixed";
    if (parent == links.end()) {
      places[i] = {arms++, moves ? 0 : -1};
    } else {
      places[i] = {places[parent->second].arm, places[parent->second].joint + (moves ? 1 : 0)};
    }
    links[body.name] = i;
  }
  return places;
}

std::vector<ArmPlace> joint_places(const RunSource& run, const std::vector<std::string>& names) {
  std::map<std::string, ArmPlace> known;
  if (run.scene) {
    const std::vector<ArmPlace> bodies = body_places(*run.scene);
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      if (run.scene->bodies[i].joint) known[run.scene->bodies[i].joint->name] = bodies[i];
    }
  }
  std::vector<ArmPlace> places;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto found = known.find(names[i]);
    places.push_back(found != known.end() ? found->second : ArmPlace{0, static_cast<int>(i)});
  }
  return places;
}

std::string phase_title(const std::string& phase) {
  if (phase == "post_impact") return "after the impact";
  if (phase.compare(0, 7, "contact") == 0) return "impact";
  std::string title = phase;
  std::replace(title.begin(), title.end(), '_', ' ');
  return title;
}

}  // namespace grapnel
