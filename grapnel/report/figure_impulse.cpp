#include "grapnel/report/figure.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "grapnel/report/figure_script.hpp"
#include "grapnel/report/series_table.hpp"

namespace grapnel {
namespace {

using Json = nlohmann::ordered_json;

struct Bar {
  std::string grasp;
  double impulse = 0, angular = 0;  // [N s], [N m s]
  double published = std::nan("");  // [N s]
};

double number_or_nan(const Json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_number() ? found->get<double>() : std::nan("");
}

double length_or_nan(const Json& object, const char* key) {
  const auto found = object.find(key);
  if (found == object.end() || !found->is_array()) return std::nan("");
  double sum = 0;
  for (const Json& part : *found) sum += part.is_number() ? part.get<double>() * part.get<double>() : std::nan("");
  return std::sqrt(sum);
}

std::string text_or(const Json& object, const char* key, const std::string& otherwise) {
  const auto found = object.find(key);
  return found != object.end() && found->is_string() ? found->get<std::string>() : otherwise;
}

void add_impact(const Json& impact, const std::string& when, std::vector<Bar>& bars) {
  if (!impact.is_object() || !impact.contains("grasps") || !impact["grasps"].is_array()) return;
  const bool shown = impact.value("show_as_published", Json(true)) != Json(false);  // of older results: always
  const Json published =
      shown ? impact.value(Json::json_pointer("/as_published/grasps"), Json::array()) : Json::array();
  std::size_t index = 0;
  for (const Json& grasp : impact["grasps"]) {
    if (!grasp.is_object()) continue;
    Bar bar;
    bar.grasp = text_or(grasp, "end_effector", "?") + when;
    bar.impulse = number_or_nan(grasp, "impulse_magnitude");
    bar.angular = length_or_nan(grasp, "angular_impulse");
    if (published.is_array() && index < published.size() && published[index].is_object())
      bar.published = number_or_nan(published[index], "impulse_magnitude");
    bars.push_back(bar);
    ++index;
  }
}

std::vector<Bar> bars_of(const RunSource& run) {
  std::vector<Bar> bars;
  if (!run.summary) return bars;
  if (run.summary->contains("impact")) add_impact((*run.summary)["impact"], "", bars);
  if (run.summary->contains("later_impacts") && (*run.summary)["later_impacts"].is_array()) {
    for (const Json& impact : (*run.summary)["later_impacts"])
      add_impact(impact, fmt::format(", {:.4g} s", impact.is_object() ? number_or_nan(impact, "time") : std::nan("")),
                 bars);
  }
  return bars;
}

FigurePanel panel_of(const std::vector<Bar>& bars, const std::string& y_label, double largest, bool names) {
  FigurePanel panel;
  panel.y_label = y_label;
  panel.x_range = {-0.7, static_cast<double>(bars.size()) - 0.3};
  panel.y_range = {0, largest > 0 ? 1.18 * largest : 1};
  std::string tics = "set xtics scale 0 noenhanced (";
  for (std::size_t i = 0; i < bars.size(); ++i)
    tics += fmt::format("{}{} {}", i > 0 ? ", " : "", names ? gnuplot_tic_label(bars[i].grasp) : "''", i);
  panel.settings = {tics + ")", "unset grid; set grid ytics back lc rgb '#e4e4e4' lw 0.5 dt solid"};
  return panel;
}

std::string bar_style(int column, double offset, double width, const char* color) {
  return fmt::format("using ($1+{:g}):{}:({:g}) with boxes fs solid noborder lc rgb '{}'", offset, column, width,
                     color);
}

LegendSample box_sample(const char* color) {
  return {LegendSample::Kind::box, fmt::format("fc rgb '{}' fs solid noborder", color)};
}

std::string value_style(int column, double offset) {
  return fmt::format(
      "using ($1+{0:g}):{1}:(sprintf('%.3g',${1})) with labels noenhanced offset 0,0.45 font ',6.5' textcolor rgb "
      "'{2}'",
      offset, column, kInk);
}

}  // namespace

bool has_impulses(const RunSource& run) { return !bars_of(run).empty(); }

Figure impulse_figure(const RunSource& run, const FigureRequest& request) {
  const std::vector<Bar> bars = bars_of(run);
  if (bars.empty()) throw std::runtime_error((run.folder / "summary.json").string() + ": the run has no impact");
  Figure figure;
  figure.what = request.what;
  figure.heads = figure_heads(run, request);
  figure.width = request.width > 0 ? request.width : 8.8;
  figure.height = request.height;
  figure.panel_height = 3.6;
  FigureBlock block;
  block.columns = {"grasp (see the lines above)", "impulse [N s]", "impulse as published [N s]",
                   "angular impulse [N m s]"};
  double largest = 0, largest_angular = 0;
  bool published = false;
  for (std::size_t i = 0; i < bars.size(); ++i) {
    figure.heads.push_back(fmt::format("grasp {}: {}", i, bars[i].grasp));
    block.rows.push_back({static_cast<double>(i), bars[i].impulse, bars[i].published, bars[i].angular});
    for (const double v : {bars[i].impulse, bars[i].published}) largest = std::max(largest, std::isfinite(v) ? v : 0);
    largest_angular = std::max(largest_angular, std::isfinite(bars[i].angular) ? bars[i].angular : 0);
    published = published || std::isfinite(bars[i].published);
  }
  figure.blocks.push_back(block);

  FigurePanel impulse = panel_of(bars, "impulse [N s]", largest, false);
  const double shift = published ? 0.19 : 0, width = published ? 0.34 : 0.5;
  impulse.legend = published;
  impulse.shares_x = true;
  impulse.items.push_back(
      {0, bar_style(2, -shift, width, series_color(0)), "conserving momentum", box_sample(series_color(0))});
  impulse.items.push_back({0, value_style(2, -shift), "", {}});
  if (published) {
    impulse.items.push_back({0, bar_style(3, shift, width, "#b5b5b5"), "as published", box_sample("#b5b5b5")});
    impulse.items.push_back({0, value_style(3, shift), "", {}});
  }
  FigurePanel angular = panel_of(bars, "ang. impulse [N m s]", largest_angular, true);
  angular.x_label = "end-effector";
  angular.items.push_back({0, bar_style(4, 0, 0.5, series_color(0)), "", {}});
  angular.items.push_back({0, value_style(4, 0), "", {}});
  figure.panels = {impulse, angular};
  return figure;
}

}  // namespace grapnel
