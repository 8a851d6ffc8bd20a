#pragma once

/// @file
/// Synthetic result folders for the report's tests.

#include <filesystem>
#include <string>
#include <vector>

#include "grapnel/result/scene.hpp"
#include "grapnel/result/time_series.hpp"

namespace grapnel::test {

/// A sliding base and one target, over two phases with an impact between: `samples` of them in each.
TimeSeries sliding_series(std::size_t samples);
/// The bodies of this series.
Scene sliding_scene();

/// summary.json (sample_result() with this name), timeseries.h5 and scene.json.
void write_run(const std::filesystem::path& folder, const std::string& name = "sample",
               const std::string& sha256 = "0123456789abcdef", const TimeSeries& series = sliding_series(50));

/// Decodes base64.
std::string from_base64(const std::string& text);
template <class T>
std::vector<T> numbers_from_base64(const std::string& text) {
  const std::string bytes = from_base64(text);
  std::vector<T> values(bytes.size() / sizeof(T));
  std::copy(bytes.begin(), bytes.end(), reinterpret_cast<char*>(values.data()));
  return values;
}

}  // namespace grapnel::test
