#pragma once

/// @file
/// A sweep's result folder as reports and figures need it.

#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "grapnel/report/study_files.hpp"
#include "grapnel/result/time_series.hpp"

namespace grapnel {

struct StudySource {
  std::filesystem::path folder;
  nlohmann::ordered_json settings;  // study.json
  TimeSeriesMetadata metadata;      // the study's name and hash
  std::vector<StudyColumn> axes, columns;
  std::size_t points = 0;
  std::vector<std::string> status, reason;  // per point
};

/// Reads study.json and table.csv, which must be of one study. @throws std::runtime_error naming file and fault,
/// TooLarge before more than `most_numbers` would be read.
StudySource read_study_source(const std::filesystem::path& folder,
                              std::size_t most_numbers = std::numeric_limits<std::size_t>::max());

/// "name [unit]" for readers: without a unit where it is 1.
std::string column_label(const StudyColumn& column);

}  // namespace grapnel
