#pragma once

/// @file
/// The samples of a run that a figure shows, as a table, and what all panels over time have in common.

#include <string>
#include <vector>

#include "grapnel/report/figure.hpp"
#include "grapnel/report/run_source.hpp"

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
  std::string group;     // panels of one group are compared: noise beside large values is drawn as the zero it is
  std::vector<SeriesCurve> curves;
  bool logarithmic = false;
  double bound = 0;  // of a logarithmic panel: a line at this value; 0: none
  bool legend = true;
};

/// Numbers of the samples in the request's phases and times. Throws std::runtime_error, naming the phases, if none are.
std::vector<std::size_t> samples_shown(const TimeSeries& series, const FigureRequest& request);

/// Lines above a figure's data: scenario, version, hash, command.
std::vector<std::string> figure_heads(const TimeSeriesMetadata& metadata, const FigureRequest& request);
/// And that samples are left out, where they are.
std::vector<std::string> figure_heads(const RunSource& run, const FigureRequest& request);

/// The figure of these panels, `columns` of them side by side. Samples of equal time stay apart by phase: lines jump at
/// an impact. Times of less than 2 s are in milliseconds.
Figure assemble(const RunSource& run, const FigureRequest& request, const std::vector<SeriesPanel>& panels,
                int columns);

}  // namespace grapnel
