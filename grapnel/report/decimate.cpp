#include "grapnel/report/decimate.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

namespace grapnel {
namespace {

constexpr double kFloatRounding = 0x1p-23;
constexpr double kDriftOfRounding = 1e-11;  // the ledger's bound for drifts, of scale
constexpr std::size_t kStretches = 64;      // for peaks, per run
// How far a line is looked for beyond the last one found, at least.
constexpr std::size_t kLookAhead = 16;

struct Extent {
  double range = 0, magnitude = 0;
};

Extent extent_of(const Series& series) {
  double least = std::numeric_limits<double>::infinity(), greatest = -least;
  for (const double x : series.data) {
    if (!std::isfinite(x)) continue;
    least = std::min(least, x);
    greatest = std::max(greatest, x);
  }
  if (!(least <= greatest)) return {};
  return {greatest - least, std::max(std::abs(least), std::abs(greatest))};
}

double norm_at(const Series& series, std::size_t sample) {
  const std::size_t width = static_cast<std::size_t>(series.width());
  double sum = 0;
  for (std::size_t c = 0; c < width; ++c) sum += series.data[sample * width + c] * series.data[sample * width + c];
  return std::sqrt(sum);
}

// Marks the sample of [first, last] where the series is largest; none where it is zero or no number.
void mark_peak(const Series& series, std::size_t first, std::size_t last, std::vector<bool>& marked) {
  double largest = 0;
  std::size_t at = first;
  for (std::size_t i = first; i <= last; ++i) {
    const double x = norm_at(series, i);
    if (!(x > largest)) continue;
    largest = x;
    at = i;
  }
  if (largest > 0) marked[at] = true;
}

bool is_grasp_load(const std::string& path) {
  return path.starts_with("grasps/") && (path.ends_with("/force") || path.ends_with("/moment"));
}

struct Stretch {
  std::size_t first, last;
};

std::vector<Stretch> phase_spans(const TimeSeries& series) {
  std::vector<Stretch> spans;
  for (std::size_t i = 0; i < series.time.size(); ++i) {
    if (i == 0 || series.phase[i] != series.phase[i - 1]) spans.push_back({i, i});
    spans.back().last = i;
  }
  return spans;
}

// Parts of the run that take equal times; those without samples are left out.
std::vector<Stretch> equal_stretches(const std::vector<double>& time) {
  const double begin = time.front(), whole = time.back() - begin;
  std::vector<Stretch> stretches;
  std::size_t before = kStretches;
  for (std::size_t i = 0; i < time.size(); ++i) {
    const double part = whole > 0 ? (time[i] - begin) / whole * kStretches : 0;
    const std::size_t number = part >= kStretches ? kStretches - 1 : part > 0 ? static_cast<std::size_t>(part) : 0;
    if (number != before) stretches.push_back({i, i});
    stretches.back().last = i;
    before = number;
  }
  return stretches;
}

// What stays whatever the bound.
std::vector<std::size_t> samples_that_matter(const TimeSeries& series) {
  const std::size_t n = series.time.size();
  std::vector<bool> marked(n, false);
  const std::vector<Stretch> spans = phase_spans(series), stretches = equal_stretches(series.time);
  for (const Stretch& span : spans) marked[span.first] = marked[span.last] = true;
  for (std::size_t i = 1; i < n; ++i) {
    if (!(series.time[i] > series.time[i - 1])) marked[i - 1] = marked[i] = true;
  }
  for (const Series& one : series.series) {
    const bool peaks = shows_peaks(one.path);
    if (!peaks && !is_grasp_load(one.path)) continue;
    for (const Stretch& span : spans) mark_peak(one, span.first, span.last, marked);
    if (!peaks) continue;
    for (const Stretch& stretch : stretches) mark_peak(one, stretch.first, stretch.last, marked);
  }
  std::vector<std::size_t> samples;
  for (std::size_t i = 0; i < n; ++i) {
    if (marked[i]) samples.push_back(i);
  }
  return samples;
}

// Lines from one sample that keep all samples passed so far within their allowances: per component an interval of
// slopes. Reaching a sample takes each component once, so that a whole run takes time in proportion to its size.
class Lines {
 public:
  Lines(const TimeSeries& series, const std::vector<double>& allowed) : series_(series) {
    for (std::size_t s = 0; s < series.series.size(); ++s) {
      if (std::isinf(allowed[s])) continue;
      const std::size_t width = static_cast<std::size_t>(series.series[s].width());
      parts_.push_back({series.series[s].data.data(), width, allowed[s]});
      channels_ += width;
    }
    steepest_.resize(channels_);
    flattest_.resize(channels_);
  }

  /// The sample up to `end` where the next line from `from` ends; at least the next one.
  std::size_t reach(std::size_t from, std::size_t end) {
    std::fill(steepest_.begin(), steepest_.end(), std::numeric_limits<double>::infinity());
    std::fill(flattest_.begin(), flattest_.end(), -std::numeric_limits<double>::infinity());
    std::size_t reached = from + 1;
    for (std::size_t at = from + 1; at <= end; ++at) {
      if (at - reached > std::max(kLookAhead, reached - from)) break;
      const Step step = pass(from, at);
      if (step.fits) reached = at;
      if (step.shut) break;
    }
    return reached;
  }

 private:
  struct Part {
    const double* data;
    std::size_t width;
    double allowed;
  };
  struct Step {
    bool fits;  // a line may end here
    bool shut;  // and none goes on
  };

  Step pass(std::size_t from, std::size_t at) {
    const double elapsed = series_.time[at] - series_.time[from];
    if (!(elapsed > 0)) return {at == from + 1, true};
    bool fits = true, shut = false;
    std::size_t channel = 0;
    for (const Part& part : parts_) {
      const double *a = part.data + from * part.width, *b = part.data + at * part.width;
      const double opening = part.allowed / elapsed;
      for (std::size_t c = 0; c < part.width; ++c, ++channel) {
        if (!std::isfinite(a[c]) || !std::isfinite(b[c])) {
          const bool same = (std::isnan(a[c]) && std::isnan(b[c])) || a[c] == b[c];
          if (!same) return {at == from + 1, true};
          continue;
        }
        const double slope = (b[c] - a[c]) / elapsed;
        fits = fits && slope >= flattest_[channel] && slope <= steepest_[channel];
        flattest_[channel] = std::max(flattest_[channel], slope - opening);
        steepest_[channel] = std::min(steepest_[channel], slope + opening);
        shut = shut || flattest_[channel] > steepest_[channel];
      }
      if (shut && !fits) break;
    }
    return {fits, shut};
  }

  const TimeSeries& series_;
  std::vector<Part> parts_;
  std::size_t channels_ = 0;
  std::vector<double> steepest_, flattest_;  // per channel
};

}  // namespace

std::vector<double> deviations_allowed(const TimeSeries& series, double bound) {
  std::vector<Extent> extents;
  std::map<std::string, double> largest;  // by unit
  for (const Series& one : series.series) {
    extents.push_back(extent_of(one));
    if (one.path.ends_with("quaternion_wxyz")) extents.back().range = 1;
    double& most = largest[one.unit];
    most = std::max(most, extents.back().magnitude);
  }
  std::vector<double> allowed;
  for (std::size_t s = 0; s < extents.size(); ++s) {
    const Series& one = series.series[s];
    const double rounding = std::max(kFloatRounding * extents[s].magnitude, kDriftOfRounding * largest.at(one.unit));
    allowed.push_back(shows_peaks(one.path) ? std::numeric_limits<double>::infinity()
                                            : std::max(bound * extents[s].range, rounding));
  }
  return allowed;
}

bool shows_peaks(std::string_view path) { return path.starts_with("loops/") && path.ends_with("_defect"); }

std::optional<std::vector<std::size_t>> kept_samples(const TimeSeries& series, double bound, std::size_t at_most) {
  if (series.time.empty()) return std::vector<std::size_t>{};
  const std::vector<std::size_t> fixed = samples_that_matter(series);
  Lines lines(series, deviations_allowed(series, bound));
  std::vector<std::size_t> kept{fixed.front()};
  for (std::size_t k = 1; k < fixed.size(); ++k) {
    while (kept.back() < fixed[k]) {
      if (kept.size() >= at_most) return std::nullopt;
      kept.push_back(lines.reach(kept.back(), fixed[k]));
    }
  }
  return kept;
}

Decimation decimate(const TimeSeries& series, std::size_t at_most) {
  const auto finished = [&](std::vector<std::size_t> kept, double bound) {
    const bool complete = kept.size() == series.time.size();
    return Decimation{std::move(kept), complete ? 0 : bound};
  };
  for (double bound = kFinestBound; bound < kCoarsestBound; bound *= 2) {
    if (auto kept = kept_samples(series, bound, at_most)) return finished(std::move(*kept), bound);
  }
  return finished(*kept_samples(series, kCoarsestBound), kCoarsestBound);
}

}  // namespace grapnel
