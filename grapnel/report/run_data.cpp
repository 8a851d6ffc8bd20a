#include "grapnel/report/run_data.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <set>
#include <stdexcept>

#include "grapnel/report/base64.hpp"
#include "grapnel/report/series_table.hpp"
#include "grapnel/result/hdf5_reader.hpp"
#include "grapnel/result/json_document.hpp"
#include "grapnel/result/scene.hpp"

namespace grapnel {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::size_t kSeriesBytes = 1'500'000;  // in the report, if the bound allows it
constexpr std::size_t kMostPhases = 256;

// The capture that a file belongs to.
struct Origin {
  std::string name, sha256;
  bool operator==(const Origin&) const = default;
};

std::string described(const Origin& origin) {
  return fmt::format("scenario '{}' (sha256 {})", origin.name, origin.sha256.substr(0, 12));
}

// Files of a run other than its summary.
struct Parts {
  Json scene, series, source;  // null: there is none
  std::vector<std::string> notes;
};

void note_other_origin(const std::string& file, const Origin& of_file, const Origin& of_summary, Parts& parts) {
  if (of_file == of_summary) return;
  parts.notes.push_back(
      fmt::format("{} is of {}, summary.json of {}", file, described(of_file), described(of_summary)));
}

void add_scene(const fs::path& folder, const Origin& origin, Parts& parts) {
  const fs::path path = folder / "scene.json";
  if (!fs::exists(path)) {
    parts.notes.push_back("scene.json is missing: bodies cannot be drawn");
    return;
  }
  try {
    read_scene(path);  // checks the whole file
    parts.scene = read_json_document(path, "grapnel-scene/2");
    const Origin own{required_text(parts.scene, "/scenario/name", path),
                     required_text(parts.scene, "/scenario/sha256", path)};
    note_other_origin("scene.json", own, origin, parts);
  } catch (const std::exception& error) {
    parts.scene = nullptr;
    parts.notes.push_back("bodies cannot be drawn: " + without_folder(error.what(), folder));
  }
}

// Bodies of the scene without recorded motion.
void note_still_bodies(const Json& scene, const TimeSeries& series, Parts& parts) {
  std::set<std::string> paths;
  for (const Series& one : series.series) paths.insert(one.path);
  for (const Json& body : scene["bodies"]) {
    const std::string group = body["series"].get<std::string>();
    if (paths.contains(group + "/position") && paths.contains(group + "/quaternion_wxyz")) continue;
    parts.notes.push_back(fmt::format("timeseries.h5 has no motion of body '{}'", body["name"].get<std::string>()));
  }
}

void add_series(const fs::path& folder, const Origin& origin, Parts& parts) {
  const fs::path path = folder / "timeseries.h5";
  if (!fs::exists(path)) {
    parts.notes.push_back("timeseries.h5 is missing: motion and plots are not available");
    return;
  }
  try {
    const ReadTimeSeries read = read_timeseries(path, kShownBytes);
    const TimeSeries& series = read.series;
    const TimeSeriesMetadata& metadata = read.head.metadata;
    if (series.phases.size() > kMostPhases)
      throw std::runtime_error(
          fmt::format("{}: {} phases, more than {}", path.string(), series.phases.size(), kMostPhases));
    parts.series = packed_series(series);
    if (read.head.every > 1)
      parts.notes.push_back(
          fmt::format("timeseries.h5 has {} samples; the page uses every {}th of them and the ends of the phases, so "
                      "shorter peaks may be missing; the extremes in the summary include all samples",
                      read.head.samples, read.head.every));
    note_other_origin("timeseries.h5", {metadata.scenario_name, metadata.scenario_sha256}, origin, parts);
    if (!parts.scene.is_null()) note_still_bodies(parts.scene, series, parts);
  } catch (const std::exception& error) {
    parts.series = nullptr;
    parts.notes.push_back("motion and plots are not available: " + without_folder(error.what(), folder));
  }
}

// Results of earlier versions have no scenario.json; the page reports that the text is missing.
void add_source(const fs::path& folder, const Origin& origin, Parts& parts) {
  const fs::path path = folder / "scenario.json";
  if (!fs::exists(path)) return;
  try {
    Json texts = read_json_document(path, "grapnel-scenario-texts/1");
    const Origin own{required_text(texts, "/scenario/name", path), required_text(texts, "/scenario/sha256", path)};
    if (!(own == origin)) {
      note_other_origin("scenario.json", own, origin, parts);
      return;  // the text of another scenario would mislead
    }
    parts.source = {{"description", required_text(texts, "/description", path)},
                    {"settings", texts.value("settings", Json::array())},
                    {"files", texts.value("files", Json::array())}};
  } catch (const std::exception& error) {
    parts.notes.push_back("the scenario's text is not shown: " + without_folder(error.what(), folder));
  }
}

template <class To, class From>
std::vector<To> gathered(const std::vector<From>& values, const std::vector<std::size_t>& samples, std::size_t width) {
  std::vector<To> result;
  result.reserve(samples.size() * width);
  for (const std::size_t sample : samples) {
    for (std::size_t c = 0; c < width; ++c) result.push_back(static_cast<To>(values[sample * width + c]));
  }
  return result;
}

}  // namespace

Json packed_series(const TimeSeries& series, std::size_t most_bytes) {
  std::size_t width = 0;
  for (const Series& one : series.series) width += static_cast<std::size_t>(one.width());
  const std::size_t sample_bytes = sizeof(double) + sizeof(std::uint8_t) + sizeof(float) * width;
  const Decimation d = decimate(series, kSeriesBytes * 3 / 4 / sample_bytes);
  if (d.kept.size() > most_bytes / sample_bytes)
    throw std::runtime_error(fmt::format(
        "{} samples of {} numbers exceed the limit of a page, and the tolerance admits no further reduction",
        d.kept.size(), width));
  const auto base64 = [](const auto& values) { return base64_of(std::span(values)); };

  Json list = Json::array();
  for (const Series& one : series.series) {
    const bool thinned = shows_peaks(one.path) && d.kept.size() < series.time.size();
    list.push_back({{"path", one.path},
                    {"unit", one.unit},
                    {"description", one.description + (thinned ? "; only the peaks are shown" : "")},
                    {"components", one.components},
                    {"data", base64(gathered<float>(one.data, d.kept, static_cast<std::size_t>(one.width())))}});
  }
  return {{"samples", d.kept.size()},
          {"of", series.time.size()},
          {"bound", d.bound},
          {"time", base64(gathered<double>(series.time, d.kept, 1))},
          {"phase", base64(gathered<std::uint8_t>(series.phase, d.kept, 1))},
          {"phases", series.phases},
          {"series", std::move(list)}};
}

Json run_data(const fs::path& folder, const std::string& label) {
  const fs::path path = folder / "summary.json";
  Json summary = read_json_document(path, "grapnel-summary/2", "grapnel-summary/1");
  const Origin origin{required_text(summary, "/scenario/name", path), required_text(summary, "/scenario/sha256", path)};
  Parts parts;
  add_scene(folder, origin, parts);
  add_series(folder, origin, parts);
  add_source(folder, origin, parts);
  Json data{{"label", label},
            {"summary", std::move(summary)},
            {"scene", std::move(parts.scene)},
            {"series", std::move(parts.series)},
            {"source", std::move(parts.source)},
            {"notes", std::move(parts.notes)}};
  if (!label.empty())
    data["folder"] = folder_name(folder);  // only for two runs: the page of one run does not depend on its location
  return data;
}

std::string without_folder(std::string text, const fs::path& folder) {
  const std::string path = (folder / "").string();
  if (path.empty()) return text;
  for (std::size_t at = 0; (at = text.find(path, at)) != std::string::npos;) text.erase(at, path.size());
  return text;
}

std::string folder_name(const fs::path& folder) {
  fs::path path = fs::absolute(folder).lexically_normal();
  if (!path.has_filename()) path = path.parent_path();  // "a/b/"
  return path.filename().string();
}

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
