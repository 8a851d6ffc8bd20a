#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "grapnel/report/figure.hpp"
#include "grapnel/report/series_table.hpp"

namespace grapnel {
namespace {

using Json = nlohmann::ordered_json;

double value_in(const Json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_number() ? found->get<double>() : std::nan("");
}

// The window of a summary, or null.
const Json* window_of(const RunSource& run) {
  if (!run.summary) return nullptr;
  const Json* at = &*run.summary;
  for (const char* key : {"approach", "plan", "window"}) {
    if (!at->is_object() || !at->contains(key)) return nullptr;
    at = &(*at)[key];
  }
  const bool has_points = at->is_object() && at->contains("points") && (*at)["points"].is_array();
  return has_points && !(*at)["points"].empty() ? at : nullptr;
}

enum Column { kTime = 1, kShare, kSpeed, kAngle, kObjective, kReachable };

FigureBlock block_of(const Json& window) {
  FigureBlock block;
  block.about = "evaluated capture times";
  block.columns = {"time [s]",  "reach share [1]",   "speed of the grasp point [m/s]", "direction off [deg]",
                   "objective", "reachable (1: yes)"};
  for (const Json& point : window["points"]) {
    if (!point.is_object()) continue;
    const auto reachable = point.find("reachable");
    block.rows.push_back({value_in(point, "time"), value_in(point, "reach_share"), value_in(point, "speed"),
                          value_in(point, "direction_angle") * 180 / std::numbers::pi, value_in(point, "objective"),
                          reachable != point.end() && *reachable == Json(true) ? 1.0 : 0.0});
  }
  return block;
}

bool has_any(const FigureBlock& block, Column column) {
  return std::any_of(block.rows.begin(), block.rows.end(),
                     [&](const std::vector<double>& row) { return std::isfinite(row[column - 1]); });
}

// A value over time: a line, dots where there is a plan and crosses where there is none.
FigurePanel window_panel(const FigureBlock& block, Column column, const std::string& label, double chosen) {
  FigurePanel panel;
  panel.y_label = label;
  panel.x_range = {block.rows.front()[0], block.rows.back()[0]};
  panel.shares_x = true;
  panel.settings = {"unset arrow"};
  if (std::isfinite(chosen)) {
    panel.settings.push_back(fmt::format(
        "set arrow from first {0:.17g}, graph 0 to first {0:.17g}, graph 1 nohead lc rgb '{1}' lw 1 dt (4,3)", chosen,
        series_color(1)));
  }
  const auto marks = [&](int reachable, const char* style) {
    return fmt::format("using {0}:(${1} == {2} ? ${3} : NaN) with points {4}", int{kTime}, int{kReachable}, reachable,
                       int{column}, style);
  };
  const std::string dot = fmt::format("pt 7 ps 0.35 lc rgb '{}'", series_color(2));
  const std::string cross = fmt::format("pt 2 ps 0.35 lc rgb '{}'", kMuted);
  const bool first = column == kShare;
  panel.legend = first;
  panel.items.push_back(
      {0, fmt::format("using {}:{} with lines lc rgb '#b5b5b5' lw 0.8", int{kTime}, int{column}), "", {}});
  panel.items.push_back({0, marks(1, dot.c_str()), first ? "reachable" : "", {LegendSample::Kind::point, dot}});
  panel.items.push_back({0, marks(0, cross.c_str()), first ? "cannot" : "", {LegendSample::Kind::point, cross}});
  return panel;
}

// A limit beyond which no capture is possible.
void add_limit(FigurePanel& panel, double limit) {
  panel.settings.push_back(fmt::format(
      "set arrow from graph 0, first {0:.17g} to graph 1, first {0:.17g} nohead lc rgb '{1}' lw 0.8", limit, kInk));
}

}  // namespace

bool has_window(const RunSource& run) { return window_of(run) != nullptr; }

Figure window_figure(const RunSource& run, const FigureRequest& request) {
  const Json* window = window_of(run);
  if (!window) throw std::runtime_error((run.folder / "summary.json").string() + ": the run has no capture window");
  Figure figure;
  figure.what = request.what;
  figure.heads = figure_heads(run, request);
  figure.width = request.width > 0 ? request.width : 8.8;
  figure.height = request.height;
  figure.panel_height = 2.4;
  const FigureBlock block = block_of(*window);
  const double chosen = value_in(*window, "time"), earliest = value_in(*window, "not_before");
  if (std::isfinite(chosen)) figure.heads.push_back(fmt::format("selected: t = {:.9g} s", chosen));
  if (std::isfinite(earliest))
    figure.heads.push_back(fmt::format("by distance alone, none before t = {:.9g} s", earliest));
  figure.blocks.push_back(block);
  figure.panels.push_back(window_panel(block, kShare, "reach share", chosen));
  add_limit(figure.panels.back(), 1);
  if (has_any(block, kAngle)) {
    figure.panels.push_back(window_panel(block, kAngle, "direction [deg]", chosen));
    add_limit(figure.panels.back(), 90);
  }
  figure.panels.push_back(window_panel(block, kSpeed, "speed [m/s]", chosen));
  if (has_any(block, kObjective)) figure.panels.push_back(window_panel(block, kObjective, "objective", chosen));
  figure.panels.back().shares_x = false;
  figure.panels.back().x_label = "time of capture [s]";
  return figure;
}

}  // namespace grapnel
