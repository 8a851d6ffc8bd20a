#include "grapnel/result/time_series.hpp"

#include <set>
#include <stdexcept>

namespace grapnel {
namespace {

[[noreturn]] void reject(const std::string& fault) { throw std::invalid_argument("time series: " + fault); }

/// The groups above a dataset: "a" and "a/b" of "a/b/c". Throws if a segment is empty, "." or "..".
std::vector<std::string> groups_of(const std::string& path) {
  std::vector<std::string> groups;
  std::size_t begin = 0;
  while (true) {
    const std::size_t end = path.find('/', begin);
    const std::string segment = path.substr(begin, end == std::string::npos ? end : end - begin);
    if (segment.empty() || segment == "." || segment == "..") reject("'" + path + "' is not a path like base/position");
    if (end == std::string::npos) return groups;
    groups.push_back(path.substr(0, end));
    begin = end + 1;
  }
}

}  // namespace

void check_samples(const TimeSeries& series) {
  const std::size_t samples = series.time.size();
  if (series.phase.size() != samples) {
    reject(std::to_string(series.phase.size()) + " phase numbers for " + std::to_string(samples) + " times");
  }
  for (const int phase : series.phase) {
    if (phase < 0 || phase >= static_cast<int>(series.phases.size())) {
      reject("phase " + std::to_string(phase) + " is not one of " + std::to_string(series.phases.size()));
    }
  }
  for (const Series& s : series.series) {
    if (s.data.size() != samples * s.components.size()) {
      reject("'" + s.path + "' has " + std::to_string(s.data.size()) + " numbers, not " + std::to_string(samples) +
             " x " + std::to_string(s.width()));
    }
  }
}

void append_samples(const TimeSeries& block, TimeSeries& series) {
  series.time.insert(series.time.end(), block.time.begin(), block.time.end());
  series.phase.insert(series.phase.end(), block.phase.begin(), block.phase.end());
  for (std::size_t i = 0; i < series.series.size(); ++i) {
    const std::vector<double>& more = block.series[i].data;
    series.series[i].data.insert(series.series[i].data.end(), more.begin(), more.end());
  }
}

void drop_samples(TimeSeries& block) {
  block.time.clear();
  block.phase.clear();
  for (Series& s : block.series) s.data.clear();
}

void check_time_series(const TimeSeries& series) {
  check_samples(series);
  std::set<std::string> datasets{"time", "phase"};
  std::set<std::string> groups;
  for (const Series& s : series.series) {
    for (std::string& group : groups_of(s.path)) groups.insert(std::move(group));
    if (!datasets.insert(s.path).second) reject("'" + s.path + "' appears twice");
  }
  for (const std::string& group : groups) {
    if (datasets.contains(group)) reject("'" + group + "' is both a series and a group of others");
  }
}

}  // namespace grapnel
