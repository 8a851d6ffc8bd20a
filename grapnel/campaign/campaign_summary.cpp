#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

#include "grapnel/campaign/campaign_report.hpp"
#include "grapnel/result/text_table.hpp"
#include "grapnel/study/case_pool.hpp"

namespace grapnel {
namespace {

constexpr std::size_t kMostLines = 8;  // of any table
constexpr std::size_t kShownReasons = 6;
constexpr std::size_t kMostInputs = 3;  // of the most influential inputs, per number
constexpr double kMatters = 0.01;       // first-order index below which an input is not named
constexpr double kUnexplained = 0.05;   // share below which it is not shown

std::string number(double value) { return std::isfinite(value) ? fmt::format("{:.4g}", value) : "-"; }

std::string with_unit(const std::string& name, const std::string& unit) {
  return unit.empty() || unit == "1" ? name : name + " [" + unit + "]";
}

std::string and_more(std::size_t all, std::size_t shown, const char* what) {
  return all > shown ? fmt::format("  and {} more {}, see campaign.json\n", all - shown, what) : "";
}

std::string head(const Campaign& campaign, const CampaignReport& report) {
  std::string text = fmt::format("{}: {} cases, {} ok", campaign.name, report.rows, report.status[0]);
  for (const CaseStatus status : {CaseStatus::failed, CaseStatus::unreachable}) {
    const std::uint64_t count = report.status[static_cast<std::size_t>(status)];
    if (count > 0) text += fmt::format(", {} {}", count, name_of(status));
  }
  if (report.rows < campaign.total()) text += fmt::format(", {} not done", campaign.total() - report.rows);
  const Proportion success = report.success_rate();
  if (const std::uint64_t lost = report.rows - report.status[0]; lost > 0)
    text += fmt::format("\n{} without a result: not counted as a success", lost);
  std::string assumed;
  if (report.assumed > 0)
    assumed = fmt::format(", {} assumed to hold without an envelope",
                          report.assumed == report.success ? "all" : fmt::format("{} of them", report.assumed));
  return text + fmt::format("\nsuccess {} ({:g} % interval {} … {}): {} cases{}\n",
                            percentage(success.estimate, success), 100 * campaign.confidence,
                            percentage(success.lower, success), percentage(success.upper, success), report.success,
                            assumed);
}

std::string criteria_text(const CampaignReport& report) {
  if (report.criteria.empty()) return "";
  TextTable table;
  const bool unknown = std::any_of(report.criteria.begin(), report.criteria.end(),
                                   [](const CampaignReport::CriterionCount& c) { return c.not_checked > 0; });
  std::vector<std::string> cells{"criterion", "met", "from", "to", "fails alone"};
  if (unknown) cells.push_back("not checked");
  table.row(cells);
  for (const CampaignReport::CriterionCount& criterion : report.criteria) {
    const Proportion& met = criterion.share;
    cells = {criterion.name, percentage(met.estimate, met), percentage(met.lower, met), percentage(met.upper, met),
             std::to_string(criterion.only_this)};
    if (unknown) cells.push_back(std::to_string(criterion.not_checked));
    table.row(cells);
  }
  return "\n" + table.text();
}

// Grasps that miss, with the limiting tolerance.
std::string grasps_text(const CampaignReport& report) {
  std::string text;
  for (const CampaignReport::Grasp& grasp : report.grasps) {
    if (grasp.missed == 0) continue;
    std::string by;
    for (const CampaignReport::Grasp::Tolerance& t : grasp.tolerances)
      if (t.limiting > 0) by += fmt::format("{}{} {}", by.empty() ? ", most by " : ", ", t.name, t.limiting);
    text += paragraph(
        fmt::format("{}: {} of {} miss{}", grasp.end_effector, grasp.missed, grasp.captured + grasp.missed, by), "  ");
  }
  return text.empty() ? "" : "\ngrasps, and the tolerance missed by the largest factor:\n" + text;
}

bool differs_by_rounding(const CampaignReport& report, std::size_t column) {
  const auto& rounding = report.rounding;
  return std::find(rounding.begin(), rounding.end(), report.columns[column].head.name) != rounding.end();
}

// Columns that criteria read; the first ones without criteria. Columns that are constant to within rounding error are
// omitted.
std::vector<std::size_t> columns_to_show(const Campaign& campaign, const CampaignReport& report) {
  std::set<std::size_t> wanted;
  for (const Criterion& criterion : campaign.success)
    for (const std::size_t i : criterion.reads())
      if (i < report.columns.size()) wanted.insert(i);
  if (wanted.empty())
    for (std::size_t i = 0; i < report.columns.size(); ++i) wanted.insert(i);
  std::erase_if(wanted, [&](std::size_t i) {
    const Description& d = report.columns[i].description;
    return d.count == 0 || d.least == d.largest || differs_by_rounding(report, i);
  });
  return {wanted.begin(), wanted.end()};
}

std::string quantiles_text(const Campaign& campaign, const CampaignReport& report) {
  const std::vector<std::size_t> shown = columns_to_show(campaign, report);
  if (shown.empty()) return "";
  // At most five quantiles fit: the outer ones, the median, and those next to the outer ones.
  std::vector<std::size_t> at;
  const std::size_t all = campaign.quantiles.size();
  for (std::size_t q = 0; q < all; ++q)
    if (all <= 5 || q < 2 || q + 2 >= all || q == all / 2) at.push_back(q);
  TextTable table;
  std::vector<std::string> cells{"quantiles"};
  for (const std::size_t q : at)
    cells.push_back(campaign.quantiles[q] == 0.5 ? "median" : fmt::format("{:g} %", 100 * campaign.quantiles[q]));
  cells.insert(cells.begin() + 1, "least");
  cells.push_back("largest");
  table.row(cells);
  for (std::size_t i = 0; i < std::min(shown.size(), kMostLines); ++i) {
    const CampaignReport::Numbers& column = report.columns[shown[i]];
    cells = {with_unit(column.head.name, column.head.unit), number(column.description.least)};
    for (const std::size_t q : at) cells.push_back(number(column.description.quantiles[q].value));
    cells.push_back(number(column.description.largest));
    table.row(cells);
  }
  return "\n" + table.text() + and_more(shown.size(), kMostLines, "columns");
}

// The inputs, or groups of them, that explain most of a number's variance, and the unexplained share.
std::string influences(const CampaignReport& report, const CampaignReport::Measure& measure) {
  std::vector<std::size_t> order(measure.groups.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto index = [&](std::size_t i) {
    const double s = measure.groups[i].first_order;
    return std::isfinite(s) ? s : -1;
  };
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return index(a) > index(b); });
  std::string text;
  for (std::size_t j = 0; j < std::min(order.size(), kMostInputs); ++j) {
    const Sensitivity& s = measure.groups[order[j]];
    if (!(s.first_order > kMatters && s.first_order > 2 * s.error)) break;
    text += fmt::format("{}{} {:.0f} %", text.empty() ? "" : ", ", report.groups[order[j]].name, 100 * s.first_order);
  }
  if (text.empty()) text = "no input alone";
  return measure.unexplained > kUnexplained ? text + fmt::format("; unexplained {:.0f} %", 100 * measure.unexplained)
                                            : text;
}

std::string sensitivity_text(const Campaign& campaign, const CampaignReport& report) {
  if (report.inputs.empty() || report.rows < 4) return "";
  std::set<std::string> wanted{"success"};
  for (const std::size_t i : columns_to_show(campaign, report)) wanted.insert(report.columns[i].head.name);
  const bool grouped = std::any_of(report.groups.begin(), report.groups.end(),
                                   [](const CampaignReport::InputGroup& g) { return g.inputs.size() > 1; });
  std::string text = grouped ? "\nvariance explained by one input, or group of inputs, alone:\n"
                             : "\nvariance explained by one input alone:\n";
  std::size_t lines = 0;
  std::set<std::string> told;
  for (const CampaignReport::Measure& measure : report.measures) {
    const bool constant = measure.name == "success" && (report.success == 0 || report.success == report.rows);
    const bool asked = measure.of == CampaignReport::Measure::Of::criterion || wanted.contains(measure.name);
    const bool again = !told.insert(measure.name).second;  // a criterion that is a column
    if (constant || !asked || again || lines++ >= kMostLines) continue;
    text += paragraph(measure.name + ": " + influences(report, measure), "  ");
  }
  return lines == 0 ? "" : text;
}

std::string campaign_command(std::string file) {
  // For a shell: a name with other characters is quoted.
  const bool plain = std::all_of(file.begin(), file.end(), [](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return std::isalnum(byte) || byte >= 0x80 || std::string_view("/._-+,:@%=").find(c) != std::string_view::npos;
  });
  if (!plain || file.empty()) {
    for (std::size_t at = 0; (at = file.find('\'', at)) != std::string::npos; at += 4) file.replace(at, 1, "'\\''");
    file = "'" + file + "'";
  }
  return "grapnel campaign " + file;
}

std::string worst_text(const Campaign& campaign, const CampaignReport& report) {
  TextTable table(2);
  std::size_t lines = 0;
  for (const CampaignReport::Worst& worst : report.worst) {
    if (worst.cases.empty() || differs_by_rounding(report, worst.number) || lines++ >= kMostLines) continue;
    const CampaignReport::Case& found = worst.cases.front();
    table.row({with_unit(worst.name, worst.unit), number(found.value), fmt::format("--only {}", found.index)});
  }
  if (lines == 0) return "";
  return fmt::format("\nworst cases; to run one: {} --only K\n", campaign_command(campaign.file)) + table.text() +
         and_more(lines, kMostLines, "numbers");
}

std::string failures_text(const CampaignReport& report) {
  if (report.failures.empty()) return "";
  std::string text = "\nreasons for cases that are not a success:\n";
  for (std::size_t i = 0; i < std::min(report.failures.size(), kShownReasons); ++i) {
    const CampaignReport::Reason& reason = report.failures[i];
    const std::string status = reason.status == CaseStatus::ok ? "" : std::string(name_of(reason.status)) + ": ";
    text += paragraph(
        fmt::format("{} × {}{} (case {})", reason.count, status, reason.text, reason.examples.front().index), "  ");
  }
  return text + and_more(report.failures.size(), kShownReasons, "reasons");
}

}  // namespace

std::string replay_command(const Campaign& campaign, std::uint64_t k) {
  // A name without a folder: the same campaign gives the same results wherever its file is.
  return fmt::format("{} --only {}", campaign_command(std::filesystem::path(campaign.file).filename().string()), k);
}

std::string campaign_summary(const Campaign& campaign, const CampaignReport& report) {
  std::string text = head(campaign, report) + criteria_text(report) + failures_text(report) + grasps_text(report) +
                     quantiles_text(campaign, report) + sensitivity_text(campaign, report) +
                     worst_text(campaign, report);
  if (!report.success_map.empty())
    text += "\nprobability of success\n" + success_map_summary(campaign, report.success_map);
  return text;
}

// --- Sweeps ---

namespace {

constexpr std::size_t kShownKinds = 5;  // of reasons

std::string with_unit(const StudyAxis& axis, std::size_t at) {
  if (!axis.is_numeric) return axis.values[at].label;
  return fmt::format("{:.6g}{}", axis.values[at].number, axis.unit.empty() || axis.unit == "1" ? "" : " " + axis.unit);
}

std::string axes_text(const Campaign& sweep) {
  TextTable text(3);
  for (const StudyAxis& axis : sweep.design) {
    const std::size_t last = axis.values.size() - 1;
    text.row({axis.name, fmt::format("{} values", axis.values.size()),
              last == 0 ? with_unit(axis, 0) : fmt::format("{} … {}", with_unit(axis, 0), with_unit(axis, last))});
  }
  return text.text();
}

// Minimum and maximum of a column, with their points.
void extremes_row(const Campaign& sweep, std::span<const CaseRow> rows, std::size_t column, TextTable& text) {
  const CaseRow *least = nullptr, *greatest = nullptr;
  for (const CaseRow& row : rows) {
    const double value = row.values[column];
    if (std::isnan(value)) continue;
    if (!least || value < least->values[column]) least = &row;
    if (!greatest || value > greatest->values[column]) greatest = &row;
  }
  if (!least) return;
  const Column& head = sweep.columns[column];
  text.row({fmt::format("{} [{}]", head.name, head.unit), fmt::format("{:.6g}", least->values[column]),
            fmt::format("{}", least->index), fmt::format("{:.6g}", greatest->values[column]),
            fmt::format("{}", greatest->index)});
}

std::string extremes_text(const Campaign& sweep, std::span<const CaseRow> rows) {
  TextTable text;
  text.row({"", "minimum", "at point", "maximum", "at point"});
  bool any = false;
  for (std::size_t c = 0; c < sweep.columns.size(); ++c) {
    const std::string& name = sweep.columns[c].name;
    const bool wanted = column_matches("grasps/*/impulse_magnitude", name) || column_matches("margins", name) ||
                        column_matches("grasps/*/largest_speed", name);
    if (!wanted) continue;
    any = true;
    extremes_row(sweep, rows, c, text);
  }
  return any ? "\n" + text.text() : "";
}

// Checks of conservation that fail by different values are one kind: "conservation check failed: energy_drift".
std::string kind_of_point(const std::string& reason) {
  return reason.starts_with(kNotConserved) ? reason.substr(0, reason.find(" is ")) : reason;
}

std::string reasons_text(std::span<const CaseRow> rows) {
  std::map<std::string, std::size_t> counts;
  for (const CaseRow& row : rows) {
    if (row.status != CaseStatus::ok) ++counts[std::string(name_of(row.status)) + ": " + kind_of_point(row.reason)];
  }
  std::vector<std::pair<std::string, std::size_t>> sorted(counts.begin(), counts.end());
  std::stable_sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) { return a.second > b.second; });
  std::string text = sorted.empty() ? "" : "\nnot ok:\n";
  for (std::size_t i = 0; i < std::min(sorted.size(), kShownKinds); ++i)
    text += paragraph(fmt::format("{} × {}", sorted[i].second, sorted[i].first), "  ");
  if (sorted.size() > kShownKinds) text += fmt::format("  and {} more, see table.csv\n", sorted.size() - kShownKinds);
  return text;
}

// Counts of yes, no, or neither, over points that are ok, for columns that the study stores.
std::string verdicts_text(const Campaign& sweep, std::span<const CaseRow> rows) {
  const auto column = [&](const char* name) {
    std::size_t c = 0;
    while (c < sweep.columns.size() && sweep.columns[c].name != name) ++c;
    return c;
  };
  const std::size_t captured = column("captured"), judged = column("captured/judged");
  const std::size_t feasible = column("ledger/feasible"), none = sweep.columns.size();
  std::map<std::string, std::size_t> captures, feasibilities;
  for (const CaseRow& row : rows) {
    if (row.status != CaseStatus::ok) continue;
    if (captured < none && !std::isnan(row.values[captured])) {
      const bool assumed = judged < none && row.values[judged] == 0;
      ++captures[row.values[captured] == 0 ? "no" : assumed ? "assumed, no envelope" : "yes"];
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

std::size_t count_of(std::span<const CaseRow> rows, CaseStatus status) {
  return static_cast<std::size_t>(
      std::count_if(rows.begin(), rows.end(), [&](const CaseRow& row) { return row.status == status; }));
}

std::string sweep_summary(const Campaign& sweep, std::span<const CaseRow> rows) {
  std::string text = fmt::format("{}: {} points, {} ok", sweep.name, rows.size(), count_of(rows, CaseStatus::ok));
  for (const CaseStatus status : {CaseStatus::failed, CaseStatus::unreachable}) {
    if (const std::size_t count = count_of(rows, status); count > 0)
      text += fmt::format(", {} {}", count, name_of(status));
  }
  return text + "\n" + verdicts_text(sweep, rows) + axes_text(sweep) + extremes_text(sweep, rows) + reasons_text(rows);
}

}  // namespace grapnel
