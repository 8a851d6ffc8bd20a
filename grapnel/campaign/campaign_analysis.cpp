#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <set>
#include <stdexcept>
#include <unordered_map>

#include "grapnel/campaign/campaign_report.hpp"

namespace grapnel {
namespace {

constexpr std::size_t kRowsAtOnce = 1 << 14;  // where many columns are needed together
constexpr std::size_t kMostMeasures = 64;
constexpr std::size_t kGroups = 20;      // of success_by
constexpr std::size_t kWorstCases = 10;  // unless the campaign says how many
constexpr std::size_t kMostReasons = 50;
constexpr std::size_t kMostKinds = 10000;  // of reasons that are counted each
constexpr std::size_t kExamples = 3;

/// What every part of the analysis reads.
struct Rows {
  const Campaign& campaign;
  const CampaignTable& table;
  std::vector<std::uint64_t> index;
  std::vector<std::uint8_t> status, success;

  std::size_t count() const { return index.size(); }
  bool ok(std::size_t row) const { return status[row] == static_cast<std::uint8_t>(CaseStatus::ok); }
  /// A number by its index among columns and inputs.
  std::vector<double> numbers(std::size_t i) const {
    const std::size_t columns = campaign.columns.size();
    return i < columns ? table.column(i) : table.input(i - columns);
  }
  void read(std::size_t i, std::size_t first, std::span<double> out) const {
    const std::size_t columns = campaign.columns.size();
    if (i < columns)
      table.read_column(i, first, out);
    else
      table.read_input(i - columns, first, out);
  }
};

void check_heads(const Campaign& campaign, const CampaignTable& table) {
  const auto same = [](const auto& asked, const std::vector<CampaignTable::Head>& heads) {
    return std::equal(asked.begin(), asked.end(), heads.begin(), heads.end(),
                      [](const auto& a, const CampaignTable::Head& b) { return a.name == b.name; });
  };
  if (!same(campaign.inputs, table.inputs()) || !same(campaign.columns, table.columns()))
    throw std::runtime_error("the table has other inputs or columns than campaign " + campaign.name);
}

void count_outcomes(const Rows& rows, CampaignReport& report) {
  report.rows = rows.count();
  for (std::size_t row = 0; row < rows.count(); ++row) {
    if (rows.status[row] >= report.status.size()) throw std::runtime_error("the table has an unknown status");
    ++report.status[rows.status[row]];
    report.success += rows.success[row];
  }
}

std::vector<CampaignReport::CriterionCount> count_criteria(const Rows& rows) {
  const std::vector<Criterion>& criteria = rows.campaign.success;
  std::vector<CampaignReport::CriterionCount> counts(criteria.size());
  std::set<std::size_t> reads;
  for (const Criterion& criterion : criteria) reads.insert(criterion.reads().begin(), criterion.reads().end());
  std::map<std::size_t, std::vector<double>> block;
  std::vector<double> numbers(rows.campaign.columns.size() + rows.campaign.inputs.size(), NAN);
  std::vector<std::uint8_t> holds(criteria.size());
  for (std::size_t first = 0; first < rows.count() && !criteria.empty(); first += kRowsAtOnce) {
    const std::size_t size = std::min(kRowsAtOnce, rows.count() - first);
    for (const std::size_t i : reads) {
      block[i].resize(size);
      rows.read(i, first, block[i]);
    }
    for (std::size_t row = 0; row < size; ++row) {
      if (!rows.ok(first + row)) continue;
      for (const auto& [i, values] : block) numbers[i] = values[row];
      for (std::size_t c = 0; c < criteria.size(); ++c) holds[c] = criteria[c].holds(numbers);
      const auto failed = std::count(holds.begin(), holds.end(), 0);
      for (std::size_t c = 0; c < criteria.size(); ++c) {
        counts[c].met += holds[c];
        counts[c].only_this += failed == 1 && !holds[c];
      }
    }
  }
  return counts;
}

CampaignReport::Numbers describe(const Rows& rows, const CampaignTable::Head& head, const std::vector<double>& numbers,
                                 const Ranking& ranking) {
  std::vector<double> sorted;
  sorted.reserve(ranking.order.size());
  for (const std::uint32_t row : ranking.order) sorted.push_back(numbers[row]);
  CampaignReport::Numbers result{head, {}, {}, {}};
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

/// Columns that are compared with the inputs: what criteria read, then all others, as far as they are not too many.
std::vector<std::size_t> columns_to_measure(const Campaign& campaign) {
  std::vector<std::size_t> chosen;
  const auto add = [&](std::size_t i) {
    if (i < campaign.columns.size() && std::find(chosen.begin(), chosen.end(), i) == chosen.end()) chosen.push_back(i);
  };
  for (const Criterion& criterion : campaign.success)
    std::for_each(criterion.reads().begin(), criterion.reads().end(), add);
  for (std::size_t i = 0; i < campaign.columns.size(); ++i) add(i);
  return chosen;
}

void measure(const std::string& name, const std::string& unit, const RankedNumbers& numbers,
             const std::vector<Ranking>& inputs, std::vector<CampaignReport::Measure>& measures) {
  CampaignReport::Measure result{name, unit, numbers.count, {}};
  for (const Ranking& input : inputs) result.inputs.push_back(sensitivity_of(input, numbers));
  measures.push_back(std::move(result));
}

/// By which numbers worst cases are looked for: the campaign's, then those that criteria limit.
std::vector<CampaignReport::Worst> worst_lists(const Campaign& campaign) {
  std::vector<CampaignReport::Worst> lists;
  const auto add = [&](std::size_t number, bool largest, bool magnitude) {
    const auto same = [&](const CampaignReport::Worst& list) {
      return list.number == number && list.largest == largest && list.magnitude == magnitude;
    };
    if (std::none_of(lists.begin(), lists.end(), same)) lists.push_back({number, largest, magnitude, {}});
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
    CampaignReport::Case found{rows.index[row], numbers[row], rows.success[row] != 0, {}};
    for (std::size_t input = 0; input < rows.campaign.inputs.size(); ++input) {
      double value = NAN;
      rows.table.read_input(input, row, std::span<double>(&value, 1));
      found.inputs.push_back(value);
    }
    list.cases.push_back(std::move(found));
  }
}

// An input as its influence is measured. In a campaign over a design it may stand for an offset on what the design
// makes of the scenario, a plan's joint values for instance: then what counts is how far it is from its mean at the
// design point, or its influence would be the design's.
std::vector<double> apart_from_design(const Rows& rows, std::vector<double> numbers) {
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

std::vector<Ranking> analyze_inputs(const Rows& rows, CampaignReport& report) {
  std::vector<Ranking> rankings;
  for (std::size_t i = 0; i < rows.campaign.inputs.size(); ++i) {
    const std::vector<double> numbers = rows.table.input(i);
    rankings.push_back(ranking_of(numbers));
    report.inputs.push_back(describe(rows, rows.table.inputs()[i], numbers, rankings.back()));
    report.success_by.push_back(success_by(rows, numbers, rankings.back()));
    if (!rows.campaign.design.empty()) rankings.back() = ranking_of(apart_from_design(rows, numbers));
  }
  return rankings;
}

void analyze_columns(const Rows& rows, const std::vector<Ranking>& inputs, CampaignReport& report) {
  const std::vector<double> success(rows.success.begin(), rows.success.end());
  measure("success", "1", RankedNumbers(success), inputs, report.measures);
  const std::vector<std::size_t> wanted = columns_to_measure(rows.campaign);
  // In the order of the columns, so that each is read once; in the order of `wanted` afterwards.
  std::map<std::size_t, std::vector<CampaignReport::Measure>> measured;
  for (std::size_t i = 0; i < rows.campaign.columns.size(); ++i) {
    const std::vector<double> numbers = rows.table.column(i);
    const Ranking ranking = ranking_of(numbers);
    const CampaignTable::Head& head = rows.table.columns()[i];
    report.columns.push_back(describe(rows, head, numbers, ranking));
    for (CampaignReport::Worst& list : report.worst)
      if (list.number == i) find_worst(rows, numbers, list);
    const Description& d = report.columns.back().description;
    if (d.count < 2 || d.least == d.largest) continue;
    const auto place = static_cast<std::size_t>(std::find(wanted.begin(), wanted.end(), i) - wanted.begin());
    if (place + 1 >= kMostMeasures)
      ++report.measures_left_out;
    else
      measure(head.name, head.unit, RankedNumbers(numbers, ranking), inputs, measured[place]);
  }
  for (auto& [place, measures] : measured) report.measures.push_back(std::move(measures.front()));
}

void group_reasons(const Rows& rows, CampaignReport& report) {
  const std::vector<std::int32_t> numbers = rows.table.reasons();
  std::map<std::int32_t, std::string> texts;  // of the last ones: many rows have the same
  std::map<std::pair<std::uint8_t, std::string>, CampaignReport::Reason> kinds;
  for (std::size_t row = 0; row < rows.count(); ++row) {
    if (rows.ok(row)) continue;
    auto known = texts.find(numbers[row]);
    if (known == texts.end()) {
      if (texts.size() >= kMostKinds) texts.clear();
      known = texts.emplace(numbers[row], rows.table.reason_text(numbers[row])).first;
    }
    const std::string kind = without_numbers(known->second);
    auto group = kinds.find({rows.status[row], kind});
    if (group == kinds.end()) {
      if (kinds.size() >= kMostKinds) {
        ++report.reasons_left_out;
        continue;
      }
      const CampaignReport::Reason first{static_cast<CaseStatus>(rows.status[row]), kind, 0, {}};
      group = kinds.emplace(std::pair(rows.status[row], kind), first).first;
    }
    CampaignReport::Reason& reason = group->second;
    ++reason.count;
    if (reason.examples.size() < kExamples) reason.examples.emplace_back(rows.index[row], known->second);
  }
  for (auto& [key, reason] : kinds) report.reasons.push_back(std::move(reason));
  std::stable_sort(report.reasons.begin(), report.reasons.end(), [](const auto& a, const auto& b) {
    return a.count != b.count ? a.count > b.count : a.examples.front().first < b.examples.front().first;
  });
  for (std::size_t i = kMostReasons; i < report.reasons.size(); ++i) report.reasons_left_out += report.reasons[i].count;
  if (report.reasons.size() > kMostReasons) report.reasons.resize(kMostReasons);
}

}  // namespace

std::string without_numbers(const std::string& reason) {
  const auto is_digit = [&](std::size_t i) { return i < reason.size() && reason[i] >= '0' && reason[i] <= '9'; };
  // Digits in names stay: "tip-1", "arm2".
  const auto in_word = [&](std::size_t i) {
    const auto c = static_cast<unsigned char>(reason[i]);
    return std::isalnum(c) || c == '_' || c == '-' || c == '.' || c == '/' || c == '\'' || c >= 0x80;
  };
  std::string text;
  for (std::size_t i = 0; i < reason.size();) {
    const bool begins = i == 0 || !in_word(i - 1);
    std::size_t end = i;
    if (begins && (reason[end] == '-' || reason[end] == '+')) ++end;
    if (!begins || !is_digit(end)) {
      text += reason[i++];
      continue;
    }
    while (is_digit(end) || (end < reason.size() && reason[end] == '.' && is_digit(end + 1))) ++end;
    std::size_t power = end;
    if (power < reason.size() && (reason[power] == 'e' || reason[power] == 'E')) {
      ++power;
      if (power < reason.size() && (reason[power] == '-' || reason[power] == '+')) ++power;
      if (is_digit(power)) {
        end = power;
        while (is_digit(end)) ++end;
      }
    }
    text += "…";
    i = end;
  }
  return text;
}

CampaignReport analyze_campaign(const Campaign& campaign, const CampaignTable& table) {
  check_heads(campaign, table);
  const Rows rows{campaign, table, table.indices(), table.status(), table.success()};
  CampaignReport report;
  count_outcomes(rows, report);
  report.criteria = count_criteria(rows);
  report.worst = worst_lists(campaign);
  const std::vector<Ranking> inputs = analyze_inputs(rows, report);
  analyze_columns(rows, inputs, report);
  group_reasons(rows, report);
  report.envelope = envelope_of(campaign, rows.index, rows.status, rows.success);
  return report;
}

}  // namespace grapnel
