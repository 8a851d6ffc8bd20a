#pragma once

/// @file
/// A run's result folder, as a report holds it and as figures and exports need it.

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "grapnel/result/scene.hpp"
#include "grapnel/result/time_series.hpp"

namespace grapnel {

/// RunData of web/src/data.ts. What is odd about scene.json or timeseries.h5 becomes a note. @throws std::runtime_error
/// naming path and fault where there is no summary to go by.
nlohmann::ordered_json run_data(const std::filesystem::path& folder, const std::string& label);

/// What a browser still opens of a time series.
inline constexpr std::size_t kMostSeriesBytes = 100'000'000;

/// PackedSeries of web/src/data.ts: as many samples as fit into about 1.5 MB, or more where decimate() leaves out no
/// more. @throws std::runtime_error where that are more than `most_bytes`.
nlohmann::ordered_json packed_series(const TimeSeries& series, std::size_t most_bytes = kMostSeriesBytes);

/// A message without the folder before its files' names: pages do not say where results lie.
std::string without_folder(std::string text, const std::filesystem::path& folder);

/// The last part of a folder's path, also where that ends with "/" or "..".
std::string folder_name(const std::filesystem::path& folder);

// A run's result folder as figures and exports need it.

struct RunSource {
  std::filesystem::path folder;
  TimeSeriesMetadata metadata;
  TimeSeries series;
  std::uint64_t every = 1;     // of the file's samples every n-th is in `series`, where it has more than can be shown
  std::optional<Scene> scene;  // absent: no scene.json
  std::optional<nlohmann::ordered_json> summary;  // absent: no summary.json
};

/// Reads `folder`. Throws std::runtime_error naming file and fault if timeseries.h5 is missing or any file is damaged.
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

/// Whether nothing leaves the plane z = 0.
bool is_planar(const RunSource& run);

/// Which arm of the robot a link belongs to: the branch of the base that it hangs on, counted from 0, and how many
/// joints it is away from the base.
struct ArmPlace {
  int arm = 0, joint = 0;
};

/// Of each joint in `names`. Without a scene all are of one arm.
std::vector<ArmPlace> joint_places(const RunSource& run, const std::vector<std::string>& names);

/// Of each body of the scene; the base's and targets' are {0, 0}.
std::vector<ArmPlace> body_places(const Scene& scene);

/// "post_impact" as a reader wants it: "after the impact".
std::string phase_title(const std::string& phase);

}  // namespace grapnel
