#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "grapnel/campaign/campaign_report.hpp"
#include "grapnel/result/text_table.hpp"

namespace grapnel {
namespace {

constexpr std::size_t kMostLines = 8;  // of any table
constexpr std::size_t kMostReasons = 5;
constexpr std::size_t kMostInputs = 3;  // that matter most, per number
constexpr double kMatters = 0.01;       // first-order index below which an input is not named

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
  const Proportion success = wilson(report.success, report.rows, campaign.confidence);
  return text + fmt::format("\nsuccess {} ({:g} % interval {} … {}): {} cases\n", percentage(success.estimate, success),
                            100 * campaign.confidence, percentage(success.lower, success),
                            percentage(success.upper, success), report.success);
}

std::string criteria_text(const Campaign& campaign, const CampaignReport& report) {
  if (campaign.success.empty()) return "";
  TextTable table;
  table.row({"criterion", "met", "from", "to", "fails alone"});
  for (std::size_t c = 0; c < campaign.success.size(); ++c) {
    const Proportion met = wilson(report.criteria[c].met, report.rows, campaign.confidence);
    table.row({campaign.success[c].name(), percentage(met.estimate, met), percentage(met.lower, met),
               percentage(met.upper, met), std::to_string(report.criteria[c].only_this)});
  }
  return "\n" + table.text();
}

// Columns that criteria read; the first ones without criteria. Numbers that are all the same say nothing.
std::vector<std::size_t> columns_to_show(const Campaign& campaign, const CampaignReport& report) {
  std::set<std::size_t> wanted;
  for (const Criterion& criterion : campaign.success)
    for (const std::size_t i : criterion.reads())
      if (i < report.columns.size()) wanted.insert(i);
  if (wanted.empty())
    for (std::size_t i = 0; i < report.columns.size(); ++i) wanted.insert(i);
  std::erase_if(wanted, [&](std::size_t i) {
    const Description& d = report.columns[i].description;
    return d.count == 0 || d.least == d.largest;
  });
  return {wanted.begin(), wanted.end()};
}

std::string quantiles_text(const Campaign& campaign, const CampaignReport& report) {
  const std::vector<std::size_t> shown = columns_to_show(campaign, report);
  if (shown.empty()) return "";
  // At most five quantiles fit: the outer ones, the median, and what is next to the ends.
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

// The inputs that explain most of a number's variance.
std::string influences(const CampaignReport& report, const CampaignReport::Measure& measure) {
  std::vector<std::size_t> order(measure.inputs.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto index = [&](std::size_t i) {
    const double s = measure.inputs[i].first_order;
    return std::isfinite(s) ? s : -1;
  };
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return index(a) > index(b); });
  std::string text;
  for (std::size_t j = 0; j < std::min(order.size(), kMostInputs); ++j) {
    const Sensitivity& s = measure.inputs[order[j]];
    if (!(s.first_order > kMatters && s.first_order > 2 * s.error)) break;
    text +=
        fmt::format("{}{} {:.0f} %", text.empty() ? "" : ", ", report.inputs[order[j]].head.name, 100 * s.first_order);
  }
  return text.empty() ? "no input alone" : text;
}

std::string sensitivity_text(const Campaign& campaign, const CampaignReport& report) {
  if (report.inputs.empty() || report.rows < 4) return "";
  std::set<std::string> wanted{"success"};
  for (const std::size_t i : columns_to_show(campaign, report)) wanted.insert(report.columns[i].head.name);
  std::string text = "\nvariance that goes with one input alone:\n";
  std::size_t lines = 0;
  for (const CampaignReport::Measure& measure : report.measures) {
    const bool constant = measure.name == "success" && (report.success == 0 || report.success == report.rows);
    if (constant || !wanted.contains(measure.name) || lines++ >= kMostLines) continue;
    text += paragraph(measure.name + ": " + influences(report, measure), "  ");
  }
  return lines == 0 ? "" : text;
}

std::string campaign_command(const Campaign& campaign) {
  // For a shell: a name with other characters stands in quotes.
  const bool plain = std::all_of(campaign.file.begin(), campaign.file.end(), [](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return std::isalnum(byte) || byte >= 0x80 || std::string_view("/._-+,:@%=").find(c) != std::string_view::npos;
  });
  std::string file = campaign.file;
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
    if (worst.cases.empty() || lines++ >= kMostLines) continue;
    const CampaignReport::Case& found = worst.cases.front();
    const Column& column = campaign.columns[worst.number];
    table.row({with_unit(column.name, column.unit), number(found.value), fmt::format("--only {}", found.index)});
  }
  if (lines == 0) return "";
  return fmt::format("\nworst cases; to look at one: {} --only K\n", campaign_command(campaign)) + table.text() +
         and_more(lines, kMostLines, "numbers");
}

std::string reasons_text(const CampaignReport& report) {
  if (report.reasons.empty()) return "";
  std::string text = "\nnot ok:\n";
  for (std::size_t i = 0; i < std::min(report.reasons.size(), kMostReasons); ++i) {
    const CampaignReport::Reason& reason = report.reasons[i];
    text += paragraph(fmt::format("{} × {}: {} (case {})", reason.count, name_of(reason.status), reason.text,
                                  reason.examples.front().first),
                      "  ");
  }
  return text + and_more(report.reasons.size(), kMostReasons, "reasons");
}

}  // namespace

std::string replay_command(const Campaign& campaign, std::uint64_t k) {
  return fmt::format("{} --only {}", campaign_command(campaign), k);
}

std::string campaign_summary(const Campaign& campaign, const CampaignReport& report) {
  std::string text = head(campaign, report) + criteria_text(campaign, report) + quantiles_text(campaign, report) +
                     sensitivity_text(campaign, report) + worst_text(campaign, report) + reasons_text(report);
  if (!report.envelope.empty()) text += "\nprobability of success\n" + envelope_summary(campaign, report.envelope);
  return text;
}

}  // namespace grapnel
