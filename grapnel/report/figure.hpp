#pragma once

/// @file
/// The figures there are, and a figure as plain data: tables of numbers, and panels that plot them. figure_script.hpp
/// makes gnuplot's files of it.
/// Two kinds of text are kept apart: what Grapnel wrote itself (`style`, `settings`) goes into the script as it is;
/// names and labels are escaped there.

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "grapnel/report/run_data.hpp"
#include "grapnel/report/study_data.hpp"

namespace grapnel {

/// Numbers with named columns; an empty row interrupts lines and ends polygons.
struct FigureBlock {
  std::string about;                 // what it is, for the reader of the data file; may be empty
  std::vector<std::string> columns;  // "time [s]"; empty: those of the block before
  std::vector<std::vector<double>> rows;
};

/// What stands beside a text of the legend. `style` is gnuplot's of a line, a filled rectangle or a point.
struct LegendSample {
  enum class Kind { line, box, point } kind = Kind::line;
  std::string style = {};  // "lc rgb '#0072b2' lw 2"; never has names
};

/// Something drawn in a panel.
struct FigureItem {
  int block = -1;     // of Figure::blocks; -1: nothing but an entry of the legend
  std::string style;  // gnuplot: "using 1:2 with lines lw 2"; never has names
  std::string title;  // in the legend; empty: not there
  LegendSample sample = {};
};

/// A text in a panel.
struct FigureLabel {
  std::string text;
  std::string place;  // gnuplot: "at first 10, graph 1.02 center"; never has names
};

struct FigurePanel {
  std::string title;  // above it; may be empty
  std::string x_label, y_label;
  std::pair<double, double> x_range{0, 0}, y_range{0, 0};  // equal: gnuplot's choice
  std::vector<std::string> settings;                       // gnuplot commands; names in them only by gnuplot_quoted()
  std::vector<FigureLabel> labels;
  std::vector<FigureItem> items;
  bool marked_up = false;  // y_label is Grapnel's own, with gnuplot's mark-up: "v_x [m/s]"
  bool legend = false;     // above it
  bool strip = false;      // labels stand on a line above its axes
  bool shares_x = false;   // with the panel below: numbers and label stand there only
  bool bare = false;       // without axes: the projection has none
  double right = 0;        // [cm] kept free at its right, for a colour scale
};

/// Panels row by row. All rows have equal height, all columns equal width, but for what labels need.
struct Figure {
  std::string what;                // "momentum"
  std::vector<std::string> heads;  // lines above the data: scenario, version, hash, command, what was left out
  std::vector<FigureBlock> blocks;
  std::vector<FigurePanel> panels;
  int columns = 1;
  double width = 8.8;         // [cm]
  double height = 0;          // [cm]; 0: by panel_height or aspect
  double panel_height = 3.2;  // [cm] of a panel's axes
  double aspect = 0;          // height over width of every panel's axes; 0: by panel_height
  bool equal_axes = false;    // a metre is as long in x as in y: ranges are widened
};

/// What a figure is to show and how. Values of 0 and empty ones mean the default.
struct FigureRequest {
  std::filesystem::path folder;
  std::string what;
  double width = 0, height = 0;  // [cm]
  std::vector<std::string> phases;
  double from = -1e300, to = 1e300;  // [s]
  int instants = 0;                  // of strobe
  std::vector<double> times;         // of strobe [s]
  std::string view = "iso";          // of strobe, unless everything is in the plane
  std::vector<std::string> columns;  // of impulse-map
  std::string x_axis, lines_axis;    // of impulse-map
  bool heat_map = false;             // of impulse-map
  std::string command;               // that makes the figure, for the data's head
};

// Colours and dashes of figures.

/// Colours that colour-blind readers can tell apart (after Okabe and Ito), "#0072b2".
const char* series_color(int index);

/// gnuplot's dash type of the index-th kind of line: solid, dashed, dotted, ...
const char* series_dash(int index);

/// A line's style: "lc rgb '#0072b2' dt solid lw 1.3".
std::string line_style(const std::string& color, int dash, double width = 1.3);

/// The colour mixed with white: 1 the colour itself, 0 white.
std::string lightened(const std::string& color, double share);

/// The colour with an opacity in gnuplot's way, "#AARRGGBB" (AA = 00 is opaque).
std::string translucent(const std::string& color, double opacity);

inline constexpr const char* kInk = "#222222";
inline constexpr const char* kMuted = "#666666";
inline constexpr const char* kBaseColor = "#5c6670";
inline constexpr const char* kTargetColor = "#b8770b";

// The figures there are: impulses as bars, times of capture, quantities over time, sweeps, superposed configurations. A
// new one is declared here, and offered and made in figure.cpp.

// ---- Impulses of a capture as bars ----

/// Whether the run's summary.json has impulses.
bool has_impulses(const RunSource& run);

/// A pair of bars per grasp and impact: impulse and angular impulse, those as published beside them where there are
/// any. Throws std::runtime_error if there was no impact.
Figure impulse_figure(const RunSource& run, const FigureRequest& request);

// ---- Times of capture ----

/// Whether the run's summary.json has a window of capture times.
bool has_window(const RunSource& run);

/// Over the time of capture: how far the grasp points are against the arms' reach, how far off their approach
/// directions, their speed and the plan's objective, and whether there is a plan. Throws std::runtime_error without a
/// window.
Figure window_figure(const RunSource& run, const FigureRequest& request);

// ---- Quantities over time ----

/// What a folder offers to `--what`.
struct FigureOffer {
  std::string what, about;
};

/// Those of quantities over time that this run has recorded.
std::vector<FigureOffer> series_offers(const RunSource& run);

/// One of them. Throws std::runtime_error if the run has not recorded it, or no sample lies in the range asked for.
Figure series_figure(const RunSource& run, const FigureRequest& request);

// ---- Sweeps: a quantity against one axis, a line per value of another, or a heat map over two ----

/// impulse-map. Without request.columns: every grasp's impulse_magnitude, else the first column. Axes beyond the second
/// are shown at their first value, and the data file's head says so. Two numeric axes make a heat map if asked for, or
/// if the second has more values than lines can be told apart (12). Throws std::runtime_error naming what there is
/// where the request names an axis or a column that the study lacks.
Figure study_figure(const StudySource& study, const FigureRequest& request);

// ---- Campaigns and maps ----

bool is_campaign_folder(const std::filesystem::path& folder);

/// Of a campaign's folder. Throws std::runtime_error naming what is missing or damaged.
std::vector<FigureOffer> campaign_offers(const std::filesystem::path& folder);

/// criteria: the share of cases that meets each criterion, with its interval. distribution: cumulative distributions of
/// request.columns, else of the numbers that criteria limit. success-map: as study_figure(), over the design; a heat
/// map where both axes are numbers and no lines are asked for. Throws std::runtime_error likewise.
Figure campaign_figure(const FigureRequest& request);

// Superposed configurations of the whole system.

/// All bodies at some instants, early ones light and late ones dark, with the paths of end-effectors and targets up to
/// the last instant. A panel per phase: those asked for, else those that last. Bodies in the plane are seen along z,
/// others along request.view. Throws std::runtime_error naming what is missing.
Figure strobe_figure(const RunSource& run, const FigureRequest& request);

// Figures of a result folder, with their files.

/// What a folder offers: that of a run, a sweep, a campaign or a map. Throws std::runtime_error naming what is missing
/// or damaged.
std::vector<FigureOffer> figure_offers(const std::filesystem::path& folder);

/// The figure. Throws std::runtime_error, saying what the folder offers if it does not offer this, or naming the fault
/// of a file; std::invalid_argument for a request that makes no sense.
Figure make_figure(const FigureRequest& request);

/// Where the files of a figure are.
struct FigureFiles {
  std::filesystem::path image, data, script;
  bool drawn = false;  // false: there is no gnuplot, data and script are there
};

/// The files that write_figure() makes for an image; `drawn` is false.
FigureFiles figure_files(const std::filesystem::path& image);

/// Writes data and script beside `image` (.pdf, .svg or .png) and lets gnuplot draw it. Throws std::runtime_error if
/// gnuplot fails, with what it says.
FigureFiles write_figure(const Figure& figure, const std::filesystem::path& image);

}  // namespace grapnel
