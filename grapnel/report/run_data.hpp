#pragma once

/// @file
/// A run's result folder, for reports, figures and exports.

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "grapnel/result/scene.hpp"
#include "grapnel/result/time_series.hpp"

namespace grapnel {

/// RunData of web/src/data.ts. Problems of scene.json or timeseries.h5 become notes. @throws std::runtime_error naming
/// path and error without a valid summary.
nlohmann::ordered_json run_data(const std::filesystem::path& folder, const std::string& label);

/// Limit on the size of a time series for browsers.
inline constexpr std::size_t kMostSeriesBytes = 100'000'000;

/// PackedSeries of web/src/data.ts: as many samples as fit into about 1.5 MB, or more if decimate() cannot reduce them
/// further. @throws std::runtime_error above `most_bytes`.
nlohmann::ordered_json packed_series(const TimeSeries& series, std::size_t most_bytes = kMostSeriesBytes);

/// A message without the folder of its files: pages do not show the location of results.
std::string without_folder(std::string text, const std::filesystem::path& folder);

/// The last part of a folder's path, also where that ends with "/" or "..".
std::string folder_name(const std::filesystem::path& folder);

// A run's result folder for figures and exports.

struct RunSource {
  std::filesystem::path folder;
  TimeSeriesMetadata metadata;
  TimeSeries series;
  std::uint64_t every = 1;                        // `series` has every n-th sample of a file with too many samples
  std::optional<Scene> scene;                     // absent: no scene.json
  std::optional<nlohmann::ordered_json> summary;  // absent: no summary.json
};

/// Reads `folder`. Throws std::runtime_error naming file and error if timeseries.h5 is missing or any file is damaged.
RunSource read_run_source(const std::filesystem::path& folder);

/// The series, or null.
const Series* find_series(const TimeSeries& series, const std::string& path);

/// Names in GROUP of series "GROUP/NAME/QUANTITY", in the order of recording.
std::vector<std::string> names_in(const TimeSeries& series, const std::string& group, const std::string& quantity);

/// The pose of a body, end-effector, ... recorded below `path` at a sample.
/// @throws std::runtime_error naming the series that is missing.
class RecordedPose {
 public:
  RecordedPose(const TimeSeries& series, const std::string& path);
  Vector3d position(std::size_t sample) const;
  Quaterniond quaternion(std::size_t sample) const;  // of unit length, or NaN as recorded
  Posed operator()(std::size_t sample) const;

 private:
  const Series* position_;
  const Series* quaternion_;
};

/// Whether all motion stays in the plane z = 0.
bool is_planar(const RunSource& run);

/// The arm of a link: the index of its branch at the base, from 0, and the number of joints between the base and the
/// link.
struct ArmPlace {
  int arm = 0, joint = 0;
};

/// Of each joint in `names`. Without a scene all are of one arm.
std::vector<ArmPlace> joint_places(const RunSource& run, const std::vector<std::string>& names);

/// Of each body of the scene; the base's and targets' are {0, 0}.
std::vector<ArmPlace> body_places(const Scene& scene);

/// Readable name of a phase: "post_impact" becomes "after the impact".
std::string phase_title(const std::string& phase);

}  // namespace grapnel
