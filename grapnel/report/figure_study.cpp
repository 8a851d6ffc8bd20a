#include "grapnel/report/figure.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "grapnel/report/figure_script.hpp"
#include "grapnel/report/series_table.hpp"

namespace grapnel {
namespace {

constexpr std::size_t kMostLines = 12, kMostPanels = 6;
constexpr const char* kLogarithmicX = "set logscale x";
constexpr std::size_t kNone = static_cast<std::size_t>(-1);

std::vector<double> values_of(const StudyColumn& axis) {
  std::vector<double> values = axis.values;
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
  return values;
}

std::string names_of(const std::vector<StudyColumn>& columns) {
  std::string names;
  for (const StudyColumn& column : columns) names += (names.empty() ? "" : ", ") + column.name;
  return names;
}

std::string value_text(const StudyColumn& axis, double value) {
  if (!axis.labels.empty()) return axis.labels[static_cast<std::size_t>(value)];
  const std::string unit = axis.unit == "1" ? "" : axis.unit;
  return fmt::format("{:.4g}{}{}", value, unit.empty() ? "" : " ", unit);
}

// "grasps/tip-1/impulse_magnitude" -> "tip-1: impulse magnitude [N s]"
std::string y_label(const StudyColumn& column) {
  std::string name = column.name;
  if (name.compare(0, 7, "grasps/") == 0) {
    name = name.substr(7);
    const std::size_t slash = name.find('/');
    if (slash != std::string::npos) {
      std::string quantity = name.substr(slash + 1);
      std::replace(quantity.begin(), quantity.end(), '_', ' ');
      name = name.substr(0, slash) + ": " + quantity;
    }
  }
  return column_label({name, column.unit, "", {}, {}});
}

std::string x_label(const StudyColumn& axis) { return column_label(axis); }

std::vector<const StudyColumn*> columns_shown(const StudySource& study, const FigureRequest& request) {
  std::vector<const StudyColumn*> shown;
  for (const std::string& name : request.columns) {
    const auto found =
        std::find_if(study.columns.begin(), study.columns.end(), [&](const StudyColumn& c) { return c.name == name; });
    if (found == study.columns.end())
      throw std::runtime_error(fmt::format("the study has no column '{}'; it has: {}", name, names_of(study.columns)));
    shown.push_back(&*found);
  }
  if (!shown.empty()) return shown;
  for (const StudyColumn& column : study.columns) {
    const std::string tail = "/impulse_magnitude";
    if (shown.size() < kMostPanels && column.name.compare(0, 7, "grasps/") == 0 && column.name.size() > tail.size() &&
        column.name.find("/angular_") == std::string::npos &&
        column.name.compare(column.name.size() - tail.size(), tail.size(), tail) == 0)
      shown.push_back(&column);
  }
  if (shown.empty() && !study.columns.empty()) shown.push_back(&study.columns.front());
  if (shown.empty()) throw std::runtime_error("the study's table has no columns");
  return shown;
}

struct Choice {
  std::size_t x = kNone, lines = kNone;
  std::vector<bool> shown;  // per point: the other axes are at their first value
};

std::size_t named_axis(const StudySource& study, const std::string& name) {
  for (std::size_t a = 0; a < study.axes.size(); ++a) {
    if (study.axes[a].name == name) return a;
  }
  throw std::runtime_error(fmt::format("the study has no axis '{}'; it has: {}", name, names_of(study.axes)));
}

// The numeric axis with the most values is x; the first other axis with several values gives the lines.
Choice choose_axes(const StudySource& study, const FigureRequest& request, Figure& figure) {
  Choice choice;
  if (!request.x_axis.empty()) choice.x = named_axis(study, request.x_axis);
  if (!request.lines_axis.empty()) choice.lines = named_axis(study, request.lines_axis);
  if (choice.x == choice.lines && choice.x != kNone) throw std::invalid_argument("--x and --lines name the same axis");
  if (choice.x == kNone) {
    std::size_t most = 1;
    for (std::size_t a = 0; a < study.axes.size(); ++a) {
      const std::size_t count = study.axes[a].labels.empty() ? values_of(study.axes[a]).size() : 0;
      if (a != choice.lines && count > most) choice.x = a, most = count;
    }
    if (choice.x == kNone) choice.x = choice.lines == 0 && study.axes.size() > 1 ? 1 : 0;
  }
  for (std::size_t a = 0; a < study.axes.size(); ++a) {
    if (a != choice.x && choice.lines == kNone && values_of(study.axes[a]).size() > 1) choice.lines = a;
  }
  choice.shown.assign(study.points, true);
  for (std::size_t a = 0; a < study.axes.size(); ++a) {
    if (a == choice.x || a == choice.lines || study.axes[a].values.empty()) continue;
    const double first = study.axes[a].values.front();
    figure.heads.push_back(fmt::format("at {} = {}", study.axes[a].name, value_text(study.axes[a], first)));
    for (std::size_t i = 0; i < study.points; ++i)
      choice.shown[i] = choice.shown[i] && study.axes[a].values[i] == first;
  }
  return choice;
}

// Whether values are spread over decades rather than evenly.
bool is_logarithmic(const std::vector<double>& values) {
  if (values.size() < 4 || !(values.front() > 0) || values.back() < 100 * values.front()) return false;
  return values[values.size() / 2] < 0.2 * values.back();
}

std::vector<double> padded_range(const std::vector<double>& values) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const double v : values) {
    if (std::isfinite(v)) low = std::min(low, v), high = std::max(high, v);
  }
  if (!(low <= high)) return {0, 1};
  if (low == high) return {low - 0.5 * std::max(std::abs(low), 1e-12), high + 0.5 * std::max(std::abs(high), 1e-12)};
  // The range includes zero if it is near, so that sizes are comparable.
  if (low >= 0 && low < 0.5 * high) low = 0;
  return {low == 0 ? 0 : low - 0.06 * (high - low), high + 0.06 * (high - low)};
}

void label_tics(FigurePanel& panel, const StudyColumn& axis, const char* which) {
  if (axis.labels.empty()) return;
  std::string tics = fmt::format("set {}tics noenhanced (", which);
  for (std::size_t i = 0; i < axis.labels.size(); ++i)
    tics += fmt::format("{}{} {}", i > 0 ? ", " : "", gnuplot_tic_label(axis.labels[i]), i);
  panel.settings.push_back(tics + ")");
}

// The points of one line, in the order of x.
std::vector<std::size_t> line_points(const StudySource& study, const Choice& choice, double at) {
  std::vector<std::size_t> points;
  for (std::size_t i = 0; i < study.points; ++i) {
    if (choice.shown[i] && (choice.lines == kNone || study.axes[choice.lines].values[i] == at)) points.push_back(i);
  }
  std::stable_sort(points.begin(), points.end(), [&](std::size_t a, std::size_t b) {
    return study.axes[choice.x].values[a] < study.axes[choice.x].values[b];
  });
  return points;
}

void line_panels(const StudySource& study, const Choice& choice, const std::vector<const StudyColumn*>& shown,
                 Figure& figure) {
  const StudyColumn& x = study.axes[choice.x];
  const std::vector<double> lines =
      choice.lines == kNone ? std::vector<double>{0} : values_of(study.axes[choice.lines]);
  for (std::size_t k = 0; k < lines.size(); ++k) {
    FigureBlock block;
    if (choice.lines != kNone)
      block.about =
          fmt::format("{} = {}", study.axes[choice.lines].name, value_text(study.axes[choice.lines], lines[k]));
    if (k == 0) {
      block.columns.push_back(column_label(x));
      for (const StudyColumn* column : shown) block.columns.push_back(column_label(*column));
    }
    for (const std::size_t i : line_points(study, choice, lines[k])) {
      std::vector<double> row{x.values[i]};
      for (const StudyColumn* column : shown) row.push_back(column->values[i]);
      block.rows.push_back(std::move(row));
    }
    figure.blocks.push_back(std::move(block));
  }
  for (std::size_t c = 0; c < shown.size(); ++c) {
    FigurePanel panel;
    panel.x_label = x_label(x);
    panel.y_label = y_label(*shown[c]);
    std::vector<double> values;
    for (std::size_t i = 0; i < study.points; ++i) {
      if (choice.shown[i]) values.push_back(shown[c]->values[i]);
    }
    const std::vector<double> range = padded_range(values);
    panel.y_range = {range[0], range[1]};
    const std::vector<double> xs = values_of(x);
    if (xs.size() > 1 && x.labels.empty()) panel.x_range = {xs.front(), xs.back()};
    if (!x.labels.empty()) panel.x_range = {-0.4, static_cast<double>(x.labels.size()) - 0.6};
    if (x.labels.empty() && is_logarithmic(xs))
      panel.settings.push_back(std::string(kLogarithmicX) + (c + 1 < shown.size() ? "" : "; set format x '10^{%L}'"));
    label_tics(panel, x, "x");
    panel.legend = c == 0 && choice.lines != kNone;
    panel.shares_x = c + 1 < shown.size();
    const bool few = xs.size() <= 25;
    for (std::size_t k = 0; k < lines.size(); ++k) {
      const int index = static_cast<int>(k);
      panel.items.push_back(
          {index,
           fmt::format(
               "using 1:{} with {} {}{}", c + 2, few ? "linespoints" : "lines",
               line_style(series_color(index), index / 8),
               few ? fmt::format(" pt {} ps 0.35", std::vector<int>{7, 5, 9, 11, 13, 6, 4, 8}[k % 8]) : std::string()),
           panel.legend ? value_text(study.axes[choice.lines], lines[k]) : "",
           {LegendSample::Kind::line, line_style(series_color(index), index / 8)}});
    }
    if (panel.legend) panel.title = x_label(study.axes[choice.lines]) + ":";
    figure.panels.push_back(std::move(panel));
  }
  figure.panel_height = shown.size() == 1 ? 5.2 : 4.0;
}

// Cell edges half-way to the neighbours.
std::pair<double, double> cell(const std::vector<double>& values, double at) {
  const auto here = std::lower_bound(values.begin(), values.end(), at);
  const std::size_t i = static_cast<std::size_t>(here - values.begin());
  const double before = i > 0 ? at - values[i - 1] : i + 1 < values.size() ? values[i + 1] - at : 1;
  const double after = i + 1 < values.size() ? values[i + 1] - at : before;
  return {at - before / 2, at + after / 2};
}

void heat_panels(const StudySource& study, const Choice& choice, const std::vector<const StudyColumn*>& shown,
                 Figure& figure) {
  const StudyColumn &x = study.axes[choice.x], &y = study.axes[choice.lines];
  const std::vector<double> xs = values_of(x), ys = values_of(y);
  FigureBlock block;
  block.columns = {column_label(x), column_label(y), "cell: x from", "x to", "y from", "y to"};
  for (const StudyColumn* column : shown) block.columns.push_back(column_label(*column));
  for (std::size_t i = 0; i < study.points; ++i) {
    if (!choice.shown[i]) continue;
    const auto [x0, x1] = cell(xs, x.values[i]);
    const auto [y0, y1] = cell(ys, y.values[i]);
    std::vector<double> row{x.values[i], y.values[i], x0, x1, y0, y1};
    for (const StudyColumn* column : shown) row.push_back(column->values[i]);
    block.rows.push_back(std::move(row));
  }
  figure.blocks.push_back(std::move(block));
  for (std::size_t c = 0; c < shown.size(); ++c) {
    FigurePanel panel;
    panel.title = y_label(*shown[c]);
    panel.x_label = x_label(x), panel.y_label = x_label(y);
    panel.x_range = {cell(xs, xs.front()).first, cell(xs, xs.back()).second};
    panel.y_range = {cell(ys, ys.front()).first, cell(ys, ys.back()).second};
    panel.right = 1.3;
    label_tics(panel, x, "x");
    label_tics(panel, y, "y");
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (std::size_t i = 0; i < study.points; ++i) {
      const double v = shown[c]->values[i];
      if (choice.shown[i] && std::isfinite(v)) low = std::min(low, v), high = std::max(high, v);
    }
    if (!(low <= high)) low = 0, high = 1;
    if (low == high) high = low + std::max(std::abs(low) * 0.01, 1e-12);
    // Equally spaced in lightness, also for colour-blind readers.
    panel.settings.push_back(
        "set palette defined (0 '#440154', 1 '#414487', 2 '#2a788e', 3 '#22a884', 4 '#7ad151', 5 '#fde725')");
    panel.settings.push_back(
        fmt::format("set cbrange [{:.10g}:{:.10g}]; set cbtics scale 0.4 offset -0.6,0; unset grid", low, high));
    panel.items.push_back(
        {0, fmt::format("using 1:2:3:4:5:6:{} with boxxyerror fc palette fs solid noborder", c + 7), ""});
    figure.panels.push_back(std::move(panel));
  }
  figure.panel_height = 4.8;
}

}  // namespace

Figure study_figure(const StudySource& study, const FigureRequest& request) {
  if (study.points == 0 || study.axes.empty())
    throw std::runtime_error(study.folder.string() + ": the study has no points");
  for (const StudyColumn& axis : study.axes) {
    if (!std::all_of(axis.values.begin(), axis.values.end(), [](double v) { return std::isfinite(v); }))
      throw std::runtime_error(fmt::format("{}: axis '{}' has a value that is not finite",
                                           (study.folder / "table.csv").string(), axis.name));
  }
  Figure figure;
  figure.what = request.what;
  figure.heads = figure_heads(study.metadata, request);
  figure.width = request.width > 0 ? request.width : 8.8;
  figure.height = request.height;
  const std::vector<const StudyColumn*> shown = columns_shown(study, request);
  const Choice choice = choose_axes(study, request, figure);
  const bool two_numeric =
      choice.lines != kNone && study.axes[choice.x].labels.empty() && study.axes[choice.lines].labels.empty();
  if (request.heat_map && !two_numeric)
    throw std::runtime_error("a heat map needs two axes of numbers with several values each");
  const std::size_t lines = choice.lines == kNone ? 1 : values_of(study.axes[choice.lines]).size();
  if (request.heat_map || (two_numeric && lines > kMostLines)) {
    heat_panels(study, choice, shown, figure);
  } else {
    line_panels(study, choice, shown, figure);
  }
  return figure;
}

}  // namespace grapnel
