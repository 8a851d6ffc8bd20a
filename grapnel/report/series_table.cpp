#include "grapnel/report/series_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "grapnel/report/figure.hpp"

namespace grapnel {
namespace {

constexpr double kMilliseconds = 2;     // [s] what is shorter is shown in milliseconds
constexpr double kLeastDefect = 1e-18;  // of a logarithmic axis: less is rounding of zero
constexpr double kNoise = 1e-7;         // of the largest range of a group: less is drawn as zero

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
  span.low = std::min(std::max(span.low, kLeastDefect), span.high);
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

// The impact's instant or span, and what follows it on a tinted ground; names above the first row.
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

// The axes of the panel `index`; what is drawn in them comes later.
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
    throw std::runtime_error(fmt::format("no sample is in the range asked for; the run goes from {:g} to {:g} s",
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

}  // namespace grapnel
