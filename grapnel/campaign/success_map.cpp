#include "grapnel/campaign/success_map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "grapnel/campaign/campaign_table_writer.hpp"
#include "grapnel/result/text_table.hpp"
#include "grapnel/study/column.hpp"

namespace grapnel {
namespace {

std::string shown(const StudyAxis& axis, std::size_t at) {
  return axis.is_numeric ? fmt::format("{:.6g}", axis.values[at].number) : axis.values[at].label;
}

std::string head_of(const StudyAxis& axis) {
  return axis.unit.empty() || axis.unit == "1" ? axis.name : axis.name + " [" + axis.unit + "]";
}

std::string cell(const SuccessMapPoint& point) {
  return point.success.trials == 0 ? "-" : percentage(point.success.estimate, point.success);
}

// The first axis downwards, the second to the right, in blocks of columns that fit.
std::string matrix(const Campaign& campaign, std::span<const SuccessMapPoint> points) {
  constexpr std::size_t kColumns = 9;
  const StudyAxis &down = campaign.design[0], &right = campaign.design[1];
  std::string text = "  " + head_of(down) + " downwards, " + head_of(right) + " to the right\n";
  for (std::size_t begin = 0; begin < right.values.size(); begin += kColumns) {
    const std::size_t end = std::min(begin + kColumns, right.values.size());
    TextTable table(0);
    std::vector<std::string> cells{""};
    for (std::size_t j = begin; j < end; ++j) cells.push_back(shown(right, j));
    table.row(cells);
    for (std::size_t i = 0; i < down.values.size(); ++i) {
      cells = {shown(down, i)};
      for (std::size_t j = begin; j < end; ++j) cells.push_back(cell(points[i * right.values.size() + j]));
      table.row(cells);
    }
    text += (begin > 0 ? "\n" : "") + table.text();
  }
  return text;
}

std::string lines(const Campaign& campaign, std::span<const SuccessMapPoint> points) {
  TextTable table(0);
  std::vector<std::string> cells;
  for (const StudyAxis& axis : campaign.design) cells.push_back(head_of(axis));
  cells.insert(cells.end(), {"success", "", ""});
  table.row(cells);
  for (std::size_t p = 0; p < points.size(); ++p) {
    const std::vector<std::size_t> position = campaign.position(p);
    cells.clear();
    for (std::size_t a = 0; a < position.size(); ++a) cells.push_back(shown(campaign.design[a], position[a]));
    const Proportion& success = points[p].success;
    cells.insert(cells.end(),
                 {cell(points[p]), percentage(success.lower, success), percentage(success.upper, success)});
    table.row(cells);
  }
  return table.text();
}

// The headline, and the decisive criteria.
std::string headline(const Campaign& campaign, std::span<const SuccessMapPoint> points) {
  std::string text =
      fmt::format("{} of {} points have a probability of success of 0.9 or more (lower end of its {:g} % interval)\n",
                  points_above(points, 0.9), points.size(), 100 * campaign.confidence);
  std::vector<std::size_t> decided(campaign.success.size() + 1);
  for (const SuccessMapPoint& point : points) {
    if (const auto deciding = point.deciding()) ++decided[*deciding];
  }
  std::string list;
  for (std::size_t c = 0; c < decided.size(); ++c) {
    if (decided[c] > 0)
      list +=
          fmt::format("{}{} at {}", list.empty() ? "" : ", ",
                      c < campaign.success.size() ? campaign.success[c].name() : "cases that are not ok", decided[c]);
  }
  return list.empty() ? text : text + paragraph("most frequent failures: " + list, "");
}

}  // namespace

std::optional<std::size_t> SuccessMapPoint::deciding() const {
  const std::uint64_t lost = success.trials - ok;
  const auto most = std::max_element(unmet.begin(), unmet.end());
  if (lost > 0 && (most == unmet.end() || lost > *most)) return unmet.size();
  if (most == unmet.end() || *most == 0) return std::nullopt;
  return static_cast<std::size_t>(most - unmet.begin());
}

std::size_t points_above(std::span<const SuccessMapPoint> points, double level) {
  return static_cast<std::size_t>(std::count_if(points.begin(), points.end(), [&](const SuccessMapPoint& point) {
    return point.success.trials > 0 && point.success.lower >= level;
  }));
}

std::string deciding_text(const Campaign& campaign, const SuccessMapPoint& point) {
  const auto deciding = point.deciding();
  if (!deciding) return "";
  return *deciding < campaign.success.size() ? campaign.success[*deciding].name() : "not ok";
}

std::string percentage(double probability, const Proportion& of) {
  if (!std::isfinite(probability)) return "-";
  const double width = 100 * (of.upper - of.lower);
  const int digits = width > 0 ? std::clamp(1 - static_cast<int>(std::floor(std::log10(width))), 0, 6) : 0;
  return fmt::format("{:.{}f} %", 100 * probability, digits);
}

std::vector<SuccessMapPoint> success_map_of(const Campaign& campaign, std::span<const std::uint64_t> indices,
                                            std::span<const std::uint8_t> status,
                                            std::span<const std::uint8_t> success) {
  if (campaign.design.empty()) return {};
  const std::uint64_t count = campaign.total() / std::max<std::uint64_t>(campaign.cases, 1);
  std::vector<SuccessMapPoint> points(count);
  std::vector<std::uint64_t> trials(count, 0), successes(count, 0);
  for (std::size_t row = 0; row < indices.size(); ++row) {
    const std::uint64_t point = campaign.cases == 0 ? count : indices[row] / campaign.cases;
    if (point >= count)
      throw std::runtime_error("case " + std::to_string(indices[row]) + " belongs to no point of the design");
    ++trials[point];
    successes[point] += success[row];
    points[point].ok += status[row] == static_cast<std::uint8_t>(CaseStatus::ok);
  }
  for (std::size_t p = 0; p < count; ++p) {
    points[p].success = wilson(successes[p], trials[p], campaign.confidence);
    points[p].unmet.assign(campaign.success.size(), 0);
  }
  return points;
}

std::string success_map_csv(const Campaign& campaign, std::span<const SuccessMapPoint> points) {
  std::string text = "point";
  for (const StudyAxis& axis : campaign.design)
    text += "," + csv_quoted(axis.unit.empty() ? axis.name : axis.name + " [" + axis.unit + "]");
  text += ",trials,ok,successes,estimate,lower,upper,deciding\n";
  for (std::size_t p = 0; p < points.size(); ++p) {
    text += std::to_string(p) + csv_of_design(campaign, p);
    const Proportion& success = points[p].success;
    text += fmt::format(",{},{},{}", success.trials, points[p].ok, success.successes);
    for (const double value : {success.estimate, success.lower, success.upper}) {
      text += ",";
      append_csv_number(value, text);
    }
    text += "," + csv_quoted(deciding_text(campaign, points[p])) + "\n";
  }
  return text;
}

std::string success_map_summary(const Campaign& campaign, std::span<const SuccessMapPoint> points) {
  if (points.empty()) return "";
  return (campaign.design.size() == 2 ? matrix(campaign, points) : lines(campaign, points)) + "\n" +
         headline(campaign, points);
}

}  // namespace grapnel
