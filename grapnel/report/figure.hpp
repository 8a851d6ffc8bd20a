#pragma once

/// @file
/// A figure as plain data: tables of numbers, and panels that plot them. figure_script.hpp makes gnuplot's files of it.
/// Two kinds of text are kept apart: what Grapnel wrote itself (`style`, `settings`) goes into the script as it is;
/// names and labels are escaped there.

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

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

}  // namespace grapnel
