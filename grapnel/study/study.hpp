#pragma once

/// @file
/// A study: many captures that differ in stated values, and what is kept of each. Plain data and one function that says
/// what a point of the study is; study_files/study_files.hpp makes it from a file. Thread safety: plain values; `point`
/// may be called from any thread.

#include <cmath>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/study/column.hpp"

namespace grapnel {

/// impact: planning, then the impact at the planned final configuration, nothing integrated in time. run: everything.
enum class StudyMode { impact, run };

/// One value of an axis as tables show it: a number, or a text where the axis is not of numbers.
struct AxisValue {
  double number = NAN;
  std::string label;
};

struct StudyAxis {
  std::string name;         // path, quantity, or what the study calls it
  std::string unit;         // of the numbers as shown; empty: unknown, or no numbers
  std::string description;  // what it changes
  bool is_numeric = false;
  std::vector<AxisValue> values;
};

struct Study {
  std::string name;
  std::string file;    // as the user named it
  std::string text;    // its bytes
  std::string sha256;  // of the study's bytes and of every scenario it names, with what those include and its settings
  StudyMode mode = StudyMode::run;
  std::vector<StudyAxis> axes;
  std::vector<Column> columns;  // what is kept of each point
  /// The problem at a position of the axes (grid_position()), a function of the position alone.
  /// @throws std::exception where there is none; it becomes the point's reason.
  std::function<StudyCase(std::span<const std::size_t>)> point;
  /// The same as a complete scenario file, for a place on disk. @throws as `point` does.
  std::function<std::string(std::span<const std::size_t>, const std::filesystem::path& place,
                            const std::string& comment)>
      scenario_text;

  std::vector<std::size_t> axis_sizes() const {
    std::vector<std::size_t> sizes;
    for (const StudyAxis& axis : axes) sizes.push_back(axis.values.size());
    return sizes;
  }
};

}  // namespace grapnel
