#pragma once

/// @file
/// Selection of a run's samples for reports, samples of figures as a table, and common parts of all panels over time.

#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "grapnel/report/figure.hpp"
#include "grapnel/report/run_data.hpp"
#include "grapnel/result/time_series.hpp"

namespace grapnel {

/// One line of a panel: values of all samples of the run.
struct SeriesCurve {
  std::string title;
  std::vector<double> values;
  std::string color;
  int dash = 0;
  double width = 1.3;
};

struct SeriesPanel {
  std::string quantity;  // "joint rate"
  std::string unit;      // "rad/s"
  std::string symbol;    // for the axis in place of the quantity, with gnuplot's mark-up: "v_x"; may be empty
  std::string group;     // panels of one group share a scale: noise relative to large values is drawn as zero
  std::vector<SeriesCurve> curves;
  bool logarithmic = false;
  double bound = 0;  // of a logarithmic panel: a line at this value; 0: none
  bool legend = true;
};

/// Numbers of the samples in the request's phases and times. Throws std::runtime_error, naming the phases, if none are.
std::vector<std::size_t> samples_shown(const TimeSeries& series, const FigureRequest& request);

/// Lines above a figure's data: scenario, version, hash, command.
std::vector<std::string> figure_heads(const TimeSeriesMetadata& metadata, const FigureRequest& request);
/// The same with a line about omitted samples, if there are any.
std::vector<std::string> figure_heads(const RunSource& run, const FigureRequest& request);

/// The figure of these panels in `columns` columns. Samples of equal time remain separate by phase: lines jump at an
/// impact. Times of less than 2 s are in milliseconds.
Figure assemble(const RunSource& run, const FigureRequest& request, const std::vector<SeriesPanel>& panels,
                int columns);

// Selection of the samples in a report, which limits its size with a known error. docs/formats/report.md states the
// rule.

inline constexpr double kFinestBound = 1e-4;
inline constexpr double kCoarsestBound = 1e-2;

/// Per series: the largest deviation of omitted samples from straight lines between kept samples, per component, in the
/// series' unit. `bound` times its range (largest minus smallest value of all components over the run; of quaternions
/// 1), but at least the rounding error: one unit in the last place of a float of its largest magnitude, and 1e-11
/// (the ledger's bound for drifts) of the largest magnitude that any series of the same unit has. Infinite for series
/// of which peaks are kept instead, see shows_peaks().
std::vector<double> deviations_allowed(const TimeSeries& series, double bound);

/// Defects of closed loops: rounding noise shown on a logarithmic axis. No line between fewer samples follows it, so
/// the largest value of each of 64 equal stretches of the run, and of each phase, is kept.
bool shows_peaks(std::string_view path);

/// Indices of the kept samples, ascending: the first and the last of each phase, all of equal times, the largest
/// grasp forces and moments of each phase, the peaks of shows_peaks(), and as few others as a single pass finds, so
/// that deviations_allowed(series, bound) holds. Where a component changes to or from NaN or infinity both sides stay.
/// Empty if there would be more than `at_most`.
std::optional<std::vector<std::size_t>> kept_samples(const TimeSeries& series, double bound,
                                                     std::size_t at_most = std::numeric_limits<std::size_t>::max());

struct Decimation {
  std::vector<std::size_t> kept;
  double bound = 0;  // 0: no samples are omitted
};

/// With the finest bound of 1e-4, 2e-4, 4e-4, ... 1e-2 that keeps at most `at_most` samples; else with the coarsest.
Decimation decimate(const TimeSeries& series, std::size_t at_most);

}  // namespace grapnel
