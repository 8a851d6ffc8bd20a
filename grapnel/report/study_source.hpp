#pragma once

/// @file
/// A sweep's result folder as figures need it. Thread safety: plain values; reading is reentrant.

#include <filesystem>
#include <string>
#include <vector>

#include "grapnel/result/time_series.hpp"

namespace grapnel {

/// A column of table.csv, or an axis of the study.
struct StudyColumn {
  std::string name, unit, description;
  std::vector<double> values;       // per point; NaN where there is nothing
  std::vector<std::string> labels;  // of an axis of labels: values count from 0 into them
};

struct StudySource {
  std::filesystem::path folder;
  TimeSeriesMetadata metadata;  // the study's name and hash
  std::vector<StudyColumn> axes, columns;
  std::size_t points = 0;
};

/// Reads study.json and table.csv. Throws std::runtime_error naming file and fault.
StudySource read_study_source(const std::filesystem::path& folder);

/// "name [unit]", without a unit where there is none.
std::string column_label(const StudyColumn& column);

}  // namespace grapnel
