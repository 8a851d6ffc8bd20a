#include "grapnel/report/run_data.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <set>
#include <stdexcept>

#include "grapnel/report/base64.hpp"
#include "grapnel/report/decimate.hpp"
#include "grapnel/result/hdf5_reader.hpp"
#include "grapnel/result/json_document.hpp"
#include "grapnel/result/scene.hpp"

namespace grapnel {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::size_t kSeriesBytes = 1'500'000;  // in the report, where the bound allows it
constexpr std::size_t kMostPhases = 256;

// The capture that a file belongs to.
struct Origin {
  std::string name, sha256;
  bool operator==(const Origin&) const = default;
};

std::string described(const Origin& origin) {
  return fmt::format("scenario '{}' (sha256 {})", origin.name, origin.sha256.substr(0, 12));
}

// What a run has besides its summary.
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
    read_scene(path);  // which checks all of it
    parts.scene = read_json_document(path, "grapnel-scene/1");
    const Origin own{required_text(parts.scene, "/scenario/name", path),
                     required_text(parts.scene, "/scenario/sha256", path)};
    note_other_origin("scene.json", own, origin, parts);
  } catch (const std::exception& error) {
    parts.scene = nullptr;
    parts.notes.push_back("bodies cannot be drawn: " + without_folder(error.what(), folder));
  }
}

// Bodies of the scene whose motion is nowhere.
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
    parts.notes.push_back("timeseries.h5 is missing: there is no motion and there are no plots");
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
          fmt::format("timeseries.h5 has {} samples; what is shown is made from every {}th of them and the ends of the "
                      "phases, so that shorter peaks may be missing; the extremes in the summary have seen all",
                      read.head.samples, read.head.every));
    note_other_origin("timeseries.h5", {metadata.scenario_name, metadata.scenario_sha256}, origin, parts);
    if (!parts.scene.is_null()) note_still_bodies(parts.scene, series, parts);
  } catch (const std::exception& error) {
    parts.series = nullptr;
    parts.notes.push_back("there is no motion and there are no plots: " + without_folder(error.what(), folder));
  }
}

// Results of earlier versions have no scenario.json; the page says that the text is not there.
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
        "{} samples of {} numbers are too much for a page, and more cannot be left out", d.kept.size(), width));
  const auto base64 = [](const auto& values) { return base64_of(std::span(values)); };

  Json list = Json::array();
  for (const Series& one : series.series) {
    const bool thinned = shows_peaks(one.path) && d.kept.size() < series.time.size();
    list.push_back({{"path", one.path},
                    {"unit", one.unit},
                    {"description", one.description + (thinned ? "; here the peaks alone" : "")},
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
  if (!label.empty()) data["folder"] = folder_name(folder);  // of two runs: the page of one is the same in every place
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

}  // namespace grapnel
