#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <unordered_map>

#include "grapnel/campaign/campaign_report.hpp"

namespace grapnel {
namespace {

constexpr std::size_t kGroups = 20;      // of success_by
constexpr std::size_t kWorstCases = 10;  // unless the campaign says how many

void check_heads(const Campaign& campaign, const CampaignTable& table) {
  const auto same = [](const auto& asked, const std::vector<CampaignTable::Head>& heads) {
    return std::equal(asked.begin(), asked.end(), heads.begin(), heads.end(),
                      [](const auto& a, const CampaignTable::Head& b) { return a.name == b.name; });
  };
  if (!same(campaign.inputs, table.inputs()) || !same(campaign.columns, table.columns()))
    throw std::runtime_error("the table has other inputs or columns than campaign " + campaign.name);
}

CampaignReport::Settings settings_of(const Campaign& campaign) {
  return {campaign.name,
          campaign.description,
          std::filesystem::path(campaign.file).filename().string(),
          campaign.sha256,
          std::to_string(campaign.seed),
          campaign.sampling,
          campaign.mode,
          campaign.plan,
          campaign.cases,
          campaign.total()};
}

void count_outcomes(const Rows& rows, CampaignReport& report) {
  report.rows = rows.count();
  for (std::size_t row = 0; row < rows.count(); ++row) {
    if (rows.status[row] >= report.status.size()) throw std::runtime_error("the table has an unknown status");
    ++report.status[rows.status[row]];
    report.success += rows.success[row];
  }
}

CampaignReport::Numbers describe(const Rows& rows, const CampaignTable::Head& head, const std::vector<double>& numbers,
                                 const Ranking& ranking) {
  std::vector<double> sorted;
  sorted.reserve(ranking.order.size());
  for (const std::uint32_t row : ranking.order) sorted.push_back(numbers[row]);
  CampaignReport::Numbers result{head, {}, {}, {}, {}};
  result.description =
      describe_sorted(sorted, numbers.size() - sorted.size(), rows.campaign.quantiles, rows.campaign.confidence);
  result.histogram = histogram_of_sorted(sorted);
  const auto bins = static_cast<std::int64_t>(result.histogram.counts.size());
  result.successes.assign(result.histogram.counts.size(), 0);
  for (std::size_t j = 0; j < sorted.size(); ++j) {
    const std::int64_t bin = result.histogram.bin_of(sorted[j]);
    if (bin >= 0 && bin < bins) result.successes[static_cast<std::size_t>(bin)] += rows.success[ranking.order[j]];
  }
  return result;
}

// Equal values stay together.
CampaignReport::SuccessBy success_by(const Rows& rows, const std::vector<double>& input, const Ranking& ranking) {
  CampaignReport::SuccessBy by;
  const std::size_t n = ranking.order.size();
  for (std::size_t group = 0, begin = 0; group < kGroups && begin < n; ++group) {
    std::size_t end = (group + 1) * n / kGroups;
    if (end <= begin) continue;
    while (end < n && ranking.same[end]) ++end;
    by.from.push_back(input[ranking.order[begin]]);
    by.to.push_back(input[ranking.order[end - 1]]);
    by.trials.push_back(end - begin);
    by.successes.push_back(0);
    for (std::size_t j = begin; j < end; ++j) by.successes.back() += rows.success[ranking.order[j]];
    begin = end;
  }
  return by;
}

/// By which numbers worst cases are looked for: the campaign's, then those that criteria limit.
std::vector<CampaignReport::Worst> worst_lists(const Campaign& campaign) {
  std::vector<CampaignReport::Worst> lists;
  const auto add = [&](std::size_t number, bool largest, bool magnitude) {
    const auto same = [&](const CampaignReport::Worst& list) {
      return list.number == number && list.largest == largest && list.magnitude == magnitude;
    };
    if (std::none_of(lists.begin(), lists.end(), same))
      lists.push_back({number, campaign.columns[number].name, campaign.columns[number].unit, largest, magnitude, {}});
  };
  for (std::size_t i = 0; i < campaign.columns.size(); ++i)
    if (!campaign.series.worst_by.empty() && campaign.columns[i].name == campaign.series.worst_by) add(i, true, false);
  for (const Criterion& criterion : campaign.success)
    for (const CriterionLimit& limit : criterion.limits())
      if (limit.number < campaign.columns.size()) add(limit.number, limit.at_most, limit.magnitude);
  return lists;
}

void find_worst(const Rows& rows, const std::vector<double>& numbers, CampaignReport::Worst& list) {
  const auto badness = [&](std::uint32_t row) {
    const double value = list.magnitude ? std::abs(numbers[row]) : numbers[row];
    return list.largest ? value : -value;
  };
  std::vector<std::uint32_t> candidates;
  for (std::size_t row = 0; row < rows.count(); ++row)
    if (rows.ok(row) && std::isfinite(numbers[row])) candidates.push_back(static_cast<std::uint32_t>(row));
  const std::size_t asked = rows.campaign.series.worst > 0 ? rows.campaign.series.worst : kWorstCases;
  const std::size_t count = std::min(asked, candidates.size());
  std::partial_sort(
      candidates.begin(), candidates.begin() + static_cast<std::ptrdiff_t>(count), candidates.end(),
      [&](std::uint32_t a, std::uint32_t b) { return badness(a) != badness(b) ? badness(a) > badness(b) : a < b; });
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t row = candidates[i];
    CampaignReport::Case found{
        rows.index[row], numbers[row], rows.success[row] != 0, {}, replay_command(rows.campaign, rows.index[row])};
    for (std::size_t input = 0; input < rows.campaign.inputs.size(); ++input) {
      double value = NAN;
      rows.table.read(rows.table.inputs()[input], row, std::span<double>(&value, 1));
      found.inputs.push_back(value);
    }
    list.cases.push_back(std::move(found));
  }
}

std::vector<Ranking> analyze_inputs(const Rows& rows, CampaignReport& report) {
  std::vector<Ranking> rankings;
  for (std::size_t i = 0; i < rows.campaign.inputs.size(); ++i) {
    const std::vector<double> numbers = rows.table.numbers(rows.table.inputs()[i]);
    rankings.push_back(ranking_of(numbers));
    report.inputs.push_back(describe(rows, rows.table.inputs()[i], numbers, rankings.back()));
    report.inputs.back().success_by = success_by(rows, numbers, rankings.back());
    if (!rows.campaign.design.empty()) rankings.back() = ranking_of(apart_from_design(rows, numbers));
  }
  return rankings;
}

void describe_columns(const Rows& rows, CampaignReport& report) {
  for (std::size_t i = 0; i < rows.campaign.columns.size(); ++i) {
    const std::vector<double> numbers = rows.table.numbers(rows.table.columns()[i]);
    report.columns.push_back(describe(rows, rows.table.columns()[i], numbers, ranking_of(numbers)));
    for (CampaignReport::Worst& list : report.worst)
      if (list.number == i) find_worst(rows, numbers, list);
  }
}

}  // namespace

// An input as its influence is measured. In a campaign over a design it may stand for an offset on what the design
// makes of the scenario, a plan's joint values for instance: then what counts is how far it is from its mean at the
// design point, or its influence would be the design's.
std::vector<double> apart_from_design(const Rows& rows, std::vector<double> numbers) {
  if (rows.campaign.design.empty()) return numbers;
  const std::uint64_t cases = rows.campaign.cases;
  std::unordered_map<std::uint64_t, double> first;
  bool same = true;
  for (std::size_t row = 0; row < rows.count() && same; ++row) {
    if (std::isfinite(numbers[row]))
      same = first.emplace(rows.index[row] % cases, numbers[row]).first->second == numbers[row];
  }
  if (same) return numbers;
  struct Mean {
    double sum = 0;
    std::size_t count = 0;
  };
  std::unordered_map<std::uint64_t, Mean> means;
  for (std::size_t row = 0; row < rows.count(); ++row) {
    Mean& mean = means[rows.index[row] / cases];
    if (std::isfinite(numbers[row])) mean.sum += numbers[row], ++mean.count;
  }
  for (std::size_t row = 0; row < rows.count(); ++row) {
    const Mean& mean = means[rows.index[row] / cases];
    numbers[row] -= mean.count > 0 ? mean.sum / static_cast<double>(mean.count) : 0;
  }
  return numbers;
}

CampaignReport analyze_campaign(const Campaign& campaign, const CampaignTable& table, const std::string& version) {
  check_heads(campaign, table);
  const Rows rows{campaign, table, table.indices(), table.status(), table.success()};
  CampaignReport report;
  report.version = version;
  report.settings = settings_of(campaign);
  report.confidence = campaign.confidence;
  report.axes = campaign.design;
  report.text = campaign.text;
  count_outcomes(rows, report);
  report.success_map = success_map_of(campaign, rows.index, rows.status, rows.success);
  count_criteria(rows, report);
  report.worst = worst_lists(campaign);
  const std::vector<Ranking> inputs = analyze_inputs(rows, report);
  describe_columns(rows, report);
  measure_influences(rows, inputs, report);
  count_reasons(rows, report);
  count_grasps(rows, report);
  say_what_is_not_said(campaign, report);
  return report;
}

}  // namespace grapnel
