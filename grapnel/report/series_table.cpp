#include "grapnel/report/series_table.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>

#include "grapnel/report/figure.hpp"

namespace grapnel {
namespace {

constexpr double kMilliseconds = 2;        // [s] shorter spans are shown in milliseconds
constexpr double kSmallestDefect = 1e-18;  // of a logarithmic axis: smaller values are rounding errors
constexpr double kNoise = 1e-7;            // relative to the largest range of a group: smaller ranges are drawn as zero

// The axis of times.
struct Clock {
  double begin = 0, end = 0;  // [s]
  double factor = 1, origin = 0;
  std::string label = "time [s]", column = "time [s]";
  double operator()(double time) const { return (time - origin) * factor; }
};

Clock clock_of(const TimeSeries& series, const std::vector<std::size_t>& samples) {
  Clock clock;
  clock.begin = series.time[samples.front()], clock.end = series.time[samples.back()];
  if (clock.end - clock.begin < kMilliseconds) {
    clock.factor = 1000, clock.origin = clock.begin;
    clock.label = fmt::format("time after {:.7g} s [ms]", clock.begin);
    clock.column = clock.label;
  }
  return clock;
}

struct Span {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  void add(double v) {
    if (std::isfinite(v)) low = std::min(low, v), high = std::max(high, v);
  }
  bool empty() const { return !(low <= high); }
  double size() const { return empty() ? 0 : high - low; }
  double magnitude() const { return empty() ? 0 : std::max(std::abs(low), std::abs(high)); }
};

Span span_of(const SeriesPanel& panel, const std::vector<std::size_t>& samples) {
  Span span;
  for (const SeriesCurve& curve : panel.curves) {
    for (const std::size_t i : samples) {
      if (!panel.logarithmic || curve.values[i] > 0) span.add(curve.values[i]);
    }
  }
  return span;
}

// Of a panel on a linear axis; `group`: the largest magnitude among the panels that it is compared with.
std::pair<double, double> linear_range(const Span& span, double group) {
  if (span.empty()) return {-1, 1};
  const double least = std::max(kNoise * std::max(group, span.magnitude()), 1e-300);
  if (span.size() <= least) {
    const double half = std::max(0.05 * group, std::abs(span.low) * 0.05);
    const double middle = std::abs(span.low) <= least ? 0 : span.low;
    return half > 0 ? std::pair(middle - half, middle + half) : std::pair(-1.0, 1.0);
  }
  const double margin = 0.06 * span.size();
  return {span.low - margin, span.high + margin};
}

void decimal_range(FigurePanel& out, const SeriesPanel& panel, Span span) {
  if (panel.bound > 0) span.add(panel.bound);
  if (span.empty()) span = {1e-16, 1};
  span.low = std::min(std::max(span.low, kSmallestDefect), span.high);
  out.y_range = {std::pow(10, std::floor(std::log10(span.low) - 0.2)),
                 std::pow(10, std::ceil(std::log10(span.high) + 0.2))};
  out.settings.push_back("set logscale y; set format y '10^{%L}'");
  if (panel.bound > 0) {
    out.settings.push_back(
        fmt::format("set arrow from graph 0, first {0:g} to graph 1, first {0:g} nohead lc rgb '{1}' dt (6,4) lw 0.8",
                    panel.bound, kMuted));
    out.labels.push_back({"bound of the ledger",
                          fmt::format("at graph 0.985, first {:g} right offset 0,-0.55 font ',6' textcolor rgb '{}'",
                                      panel.bound, kMuted)});
  }
}

// The impact's instant or span, and the motion after it on a tinted background; names above the first row.
void mark_phases(FigurePanel& panel, const TimeSeries& series, const std::vector<std::size_t>& samples,
                 const Clock& clock, bool names, double letters) {
  for (std::size_t k = 0; k < samples.size();) {
    const int phase = series.phase[samples[k]];
    std::size_t last = k;
    while (last + 1 < samples.size() && series.phase[samples[last + 1]] == phase) ++last;
    const double begin = clock(series.time[samples[k]]), end = clock(series.time[samples[last]]);
    const double whole = clock(clock.end) - clock(clock.begin);
    const std::string& name = series.phases[static_cast<std::size_t>(phase)];
    const bool contact = name.compare(0, 7, "contact") == 0;
    if (contact && end - begin < 0.004 * whole) {
      panel.settings.push_back(
          fmt::format("set arrow from first {0:.10g}, graph 0 to first {0:.10g}, graph 1 nohead back lc rgb '#d55e00' "
                      "dt (4,3) lw 0.7",
                      begin));
    } else if (contact || name != series.phases.front()) {
      panel.settings.push_back(
          fmt::format("set object rectangle from first {:.10g}, graph 0 to first {:.10g}, graph 1 behind fc rgb '{}' "
                      "fs solid noborder",
                      begin, end, contact ? "#fbeadf" : "#f3f5f7"));
    }
    const std::string title = phase_title(name);
    const double room = (end - begin) / std::max(whole, 1e-300) * letters;
    if (names && whole > 0 && room > static_cast<double>(title.size())) {
      const double middle = std::clamp((begin + end) / 2, clock(clock.begin), clock(clock.end));
      panel.labels.push_back(
          {title,
           fmt::format("at first {:.10g}, graph 1 center offset 0,0.55 font ',6' textcolor rgb '{}'", middle, kMuted)});
    }
    k = last + 1;
  }
}

// The axes of the panel `index`, without its curves.
FigurePanel axes_of(const std::vector<SeriesPanel>& panels, std::size_t index, int columns,
                    const std::vector<std::size_t>& samples, const Clock& clock) {
  const SeriesPanel& panel = panels[index];
  double group = 0;
  for (const SeriesPanel& other : panels) {
    if (other.group == panel.group && !panel.group.empty())
      group = std::max(group, span_of(other, samples).magnitude());
  }
  FigurePanel out;
  out.marked_up = !panel.symbol.empty();
  out.y_label = fmt::format("{} [{}]", out.marked_up ? panel.symbol : panel.quantity, panel.unit);
  out.x_label = clock.label;
  if (clock(clock.end) > clock(clock.begin)) out.x_range = {clock(clock.begin), clock(clock.end)};
  out.legend = panel.legend;
  out.shares_x = index + static_cast<std::size_t>(columns) < panels.size();
  out.strip = index < static_cast<std::size_t>(columns);
  const Span span = span_of(panel, samples);
  if (panel.logarithmic) {
    decimal_range(out, panel, span);
  } else {
    out.y_range = linear_range(span, group);
  }
  return out;
}

std::string column_name(const SeriesPanel& panel, const SeriesCurve& curve) {
  return fmt::format("{}, {} [{}]", panel.quantity, curve.title, panel.unit);
}

}  // namespace

std::vector<std::size_t> samples_shown(const TimeSeries& series, const FigureRequest& request) {
  std::vector<bool> wanted(series.phases.size(), request.phases.empty());
  for (const std::string& name : request.phases) {
    const auto found = std::find(series.phases.begin(), series.phases.end(), name);
    if (found == series.phases.end())
      throw std::runtime_error(
          fmt::format("there is no phase '{}'; there are: {}", name, fmt::join(series.phases, ", ")));
    wanted[static_cast<std::size_t>(found - series.phases.begin())] = true;
  }
  std::vector<std::size_t> samples;
  for (std::size_t i = 0; i < series.time.size(); ++i) {
    if (wanted[static_cast<std::size_t>(series.phase[i])] && series.time[i] >= request.from &&
        series.time[i] <= request.to)
      samples.push_back(i);
  }
  if (samples.empty())
    throw std::runtime_error(fmt::format("no sample is in the requested range; the run spans {:g} to {:g} s",
                                         series.time.front(), series.time.back()));
  return samples;
}

std::vector<std::string> figure_heads(const TimeSeriesMetadata& metadata, const FigureRequest& request) {
  return {fmt::format("{} of scenario {}", request.what, metadata.scenario_name),
          fmt::format("Grapnel {}, sha256 of the scenario {}", metadata.version, metadata.scenario_sha256),
          "made by: " + request.command};
}

std::vector<std::string> figure_heads(const RunSource& run, const FigureRequest& request) {
  std::vector<std::string> heads = figure_heads(run.metadata, request);
  if (run.every > 1)
    heads.push_back(fmt::format("made from every {}th sample of timeseries.h5 and the ends of the phases", run.every));
  return heads;
}

Figure assemble(const RunSource& run, const FigureRequest& request, const std::vector<SeriesPanel>& panels,
                int columns) {
  const TimeSeries& series = run.series;
  const std::vector<std::size_t> samples = samples_shown(series, request);
  const Clock clock = clock_of(series, samples);
  Figure figure;
  figure.what = request.what;
  figure.heads = figure_heads(run, request);
  figure.width = request.width > 0 ? request.width : columns > 1 ? 17.8 : 8.8;
  figure.height = request.height;
  figure.columns = figure.width < 6.0 * columns ? 1 : columns;
  const int rows = (static_cast<int>(panels.size()) + figure.columns - 1) / figure.columns;
  figure.panel_height = rows == 1 ? 5.2 : rows == 2 ? 3.7 : 2.7;
  const double letters = (figure.width / figure.columns - 2) / 0.14;  // of 6.5 pt across a panel

  FigureBlock block;
  block.columns = {clock.column, "phase (" + fmt::format("{}", fmt::join(series.phases, ", ")) + "; from 0)"};
  for (std::size_t p = 0; p < panels.size(); ++p) {
    const SeriesPanel& panel = panels[p];
    FigurePanel out = axes_of(panels, p, figure.columns, samples, clock);
    mark_phases(out, series, samples, clock, out.strip, letters);
    for (const SeriesCurve& curve : panel.curves) {
      block.columns.push_back(column_name(panel, curve));
      FigureItem item;
      item.block = 0;
      item.style = fmt::format("using 1:{} with lines {}", block.columns.size(),
                               line_style(curve.color, curve.dash, curve.width));
      item.title = panel.legend ? curve.title : "";
      item.sample.style = line_style(curve.color, curve.dash, curve.width);
      out.items.push_back(item);
    }
    figure.panels.push_back(std::move(out));
  }
  for (std::size_t k = 0; k < samples.size(); ++k) {
    const std::size_t i = samples[k];
    if (k > 0 && series.phase[i] != series.phase[samples[k - 1]]) block.rows.emplace_back();
    std::vector<double> row{clock(series.time[i]), static_cast<double>(series.phase[i])};
    for (const SeriesPanel& panel : panels) {
      for (const SeriesCurve& curve : panel.curves)
        row.push_back(panel.logarithmic && curve.values[i] <= 0 ? std::nan("") : curve.values[i]);
    }
    block.rows.push_back(std::move(row));
  }
  figure.blocks.push_back(std::move(block));
  return figure;
}

namespace {

constexpr double kFloatRounding = 0x1p-23;
constexpr double kDriftOfRounding = 1e-11;  // the ledger's bound for drifts, of scale
constexpr std::size_t kStretches = 64;      // for peaks, per run
// Minimum search length for a line beyond the last one.
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

// Of grasps, and of contacts between shapes.
bool is_contact_load(const std::string& path) {
  if (path.starts_with("contacts/")) return path.ends_with("/force") || path.ends_with("/normal_force");
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

// Samples that are always retained.
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
    if (!peaks && !is_contact_load(one.path)) continue;
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
    bool shut;  // and no line continues
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

std::optional<std::vector<std::size_t>> retained_samples(const TimeSeries& series, double bound,
                                                         std::size_t max_samples) {
  if (series.time.empty()) return std::vector<std::size_t>{};
  const std::vector<std::size_t> fixed = samples_that_matter(series);
  Lines lines(series, deviations_allowed(series, bound));
  std::vector<std::size_t> retained{fixed.front()};
  for (std::size_t k = 1; k < fixed.size(); ++k) {
    while (retained.back() < fixed[k]) {
      if (retained.size() >= max_samples) return std::nullopt;
      retained.push_back(lines.reach(retained.back(), fixed[k]));
    }
  }
  return retained;
}

Decimation decimate(const TimeSeries& series, std::size_t max_samples) {
  const auto finished = [&](std::vector<std::size_t> retained, double bound) {
    const bool complete = retained.size() == series.time.size();
    return Decimation{std::move(retained), complete ? 0 : bound};
  };
  for (double bound = kFinestBound; bound < kCoarsestBound; bound *= 2) {
    if (auto retained = retained_samples(series, bound, max_samples)) return finished(std::move(*retained), bound);
  }
  return finished(*retained_samples(series, kCoarsestBound), kCoarsestBound);
}

}  // namespace grapnel
