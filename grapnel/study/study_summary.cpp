#include "grapnel/study/study_summary.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "grapnel/result/text_table.hpp"
#include "grapnel/study/column.hpp"
#include "grapnel/study/grid.hpp"

namespace grapnel {
namespace {

constexpr std::size_t kMostReasons = 5;

std::string shown(const StudyAxis& axis, std::size_t at) {
  if (!axis.is_numeric) return axis.values[at].label;
  return fmt::format("{:.6g}{}", axis.values[at].number, axis.unit.empty() || axis.unit == "1" ? "" : " " + axis.unit);
}

std::string axes_text(const StudyTable& table) {
  TextTable text(3);
  for (const StudyAxis& axis : table.axes) {
    const std::size_t last = axis.values.size() - 1;
    text.row({axis.name, fmt::format("{} values", axis.values.size()),
              last == 0 ? shown(axis, 0) : fmt::format("{} … {}", shown(axis, 0), shown(axis, last))});
  }
  return text.text();
}

// Least and greatest of a column, and at which points.
void extremes_row(const StudyTable& table, std::size_t column, TextTable& text) {
  const CaseRow *least = nullptr, *greatest = nullptr;
  for (const CaseRow& row : table.rows) {
    const double value = row.values[column];
    if (std::isnan(value)) continue;
    if (!least || value < least->values[column]) least = &row;
    if (!greatest || value > greatest->values[column]) greatest = &row;
  }
  if (!least) return;
  const StudyTable::Head& head = table.columns[column];
  text.row({fmt::format("{} [{}]", head.name, head.unit), fmt::format("{:.6g}", least->values[column]),
            fmt::format("{}", least->index), fmt::format("{:.6g}", greatest->values[column]),
            fmt::format("{}", greatest->index)});
}

std::string extremes_text(const StudyTable& table) {
  TextTable text;
  text.row({"", "least", "at point", "greatest", "at point"});
  bool any = false;
  for (std::size_t c = 0; c < table.columns.size(); ++c) {
    const std::string& name = table.columns[c].name;
    const bool wanted = column_matches("grasps/*/impulse_magnitude", name) || column_matches("margins", name) ||
                        column_matches("grasps/*/largest_speed", name);
    if (!wanted) continue;
    any = true;
    extremes_row(table, c, text);
  }
  return any ? "\n" + text.text() : "";
}

// Checks of conservation that fail by different values are one kind: "conservation check failed: energy_drift".
std::string kind_of(const std::string& reason) {
  return reason.starts_with(kNotConserved) ? reason.substr(0, reason.find(" is ")) : reason;
}

std::string reasons_text(const StudyTable& table) {
  std::map<std::string, std::size_t> counts;
  for (const CaseRow& row : table.rows) {
    if (row.status != CaseStatus::ok) ++counts[std::string(name_of(row.status)) + ": " + kind_of(row.reason)];
  }
  std::vector<std::pair<std::string, std::size_t>> sorted(counts.begin(), counts.end());
  std::stable_sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) { return a.second > b.second; });
  std::string text = sorted.empty() ? "" : "\nnot ok:\n";
  for (std::size_t i = 0; i < std::min(sorted.size(), kMostReasons); ++i)
    text += paragraph(fmt::format("{} × {}", sorted[i].second, sorted[i].first), "  ");
  if (sorted.size() > kMostReasons) text += fmt::format("  and {} more, see table.csv\n", sorted.size() - kMostReasons);
  return text;
}

// Of points that are ok: how many say yes, no, or neither. Columns that the study keeps.
std::string verdicts_text(const StudyTable& table) {
  const auto column = [&](const char* name) {
    std::size_t c = 0;
    while (c < table.columns.size() && table.columns[c].name != name) ++c;
    return c;
  };
  const std::size_t captured = column("captured"), judged = column("captured/judged");
  const std::size_t feasible = column("ledger/feasible"), none = table.columns.size();
  std::map<std::string, std::size_t> captures, feasibilities;
  for (const CaseRow& row : table.rows) {
    if (row.status != CaseStatus::ok) continue;
    if (captured < none && !std::isnan(row.values[captured])) {
      const bool assumed = judged < none && row.values[judged] == 0;
      ++captures[row.values[captured] == 0 ? "no" : assumed ? "assumed, no envelope judged it" : "yes"];
    }
    if (feasible < none)
      ++feasibilities[std::isnan(row.values[feasible]) ? "not checked" : row.values[feasible] != 0 ? "yes" : "no"];
  }
  std::string text;
  for (const auto& [what, counts] : {std::pair("captured", captures), std::pair("feasible", feasibilities)}) {
    std::string line;
    for (const auto& [answer, count] : counts) line += fmt::format("{}{} {}", line.empty() ? "" : "; ", count, answer);
    if (!line.empty()) text += fmt::format("{}: {}\n", what, line);
  }
  return text;
}

}  // namespace

std::string study_summary(const StudyTable& table) {
  std::string text =
      fmt::format("{}: {} points, {} ok", table.study_name, table.rows.size(), table.count(CaseStatus::ok));
  for (const CaseStatus status : {CaseStatus::failed, CaseStatus::unreachable}) {
    if (table.count(status) > 0) text += fmt::format(", {} {}", table.count(status), name_of(status));
  }
  text += "\n" + verdicts_text(table) + axes_text(table) + extremes_text(table) + reasons_text(table);
  return text;
}

}  // namespace grapnel
