#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>
#include <stdexcept>
#include <string_view>
#include <unordered_map>

#include "grapnel/campaign/campaign_report.hpp"
#include "grapnel/campaign/statistics.hpp"
#include "grapnel/study/case_pool.hpp"

// Attribution of the results' variance to inputs.
namespace grapnel {
namespace {

constexpr std::size_t kGroups = 20;      // of success_by
constexpr std::size_t kWorstCases = 10;  // unless the campaign states the number

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

// Equal values stay in one group.
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

/// Numbers that define the worst cases: those of the campaign, then those that criteria limit.
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

// Runs independent tasks 0 to n - 1 on several threads; not on dozens, because each holds a column in memory.
template <class Work>
void for_each_of(std::size_t n, int threads, const Work& work) {
  constexpr int kMostThreads = 8;
  run_jobs(n, {std::min(threads, kMostThreads), {}, {}}, {},
           [&](std::size_t i, const RowSink&, const std::stop_token&) { work(i); });
}

void describe_columns(const Rows& rows, int threads, CampaignReport& report) {
  report.columns.resize(rows.campaign.columns.size());
  for_each_of(report.columns.size(), threads, [&](std::size_t i) {
    const std::vector<double> numbers = rows.table.numbers(rows.table.columns()[i]);
    report.columns[i] = describe(rows, rows.table.columns()[i], numbers, ranking_of(numbers));
    for (CampaignReport::Worst& list : report.worst)
      if (list.number == i) find_worst(rows, numbers, list);
  });
}

}  // namespace

// An input for the measurement of its influence. In a campaign over a design it may be an offset on a value that
// depends on the design, such as a plan's joint values: then the deviation from its mean at the design point is used,
// because otherwise its influence would include that of the design.
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

CampaignReport analyze_campaign(const Campaign& campaign, const CampaignTable& table, const std::string& version,
                                int threads) {
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
  describe_columns(rows, threads, report);
  measure_influences(rows, inputs, threads, report);
  count_reasons(rows, report);
  count_grasps(rows, report);
  name_missing(campaign, report);
  return report;
}

namespace {

using InputGroup = CampaignReport::InputGroup;
using Measure = CampaignReport::Measure;

constexpr std::size_t kMostMeasures = 64;     // success and columns
constexpr std::size_t kRowsOfGroups = 20000;  // largest number of rows, evenly spread, for fits of groups
constexpr double kRounding = 1e-9;            // relative to a column's numbers, or to others of their unit
constexpr double kNothing = 1e-15;            // [SI]

// --- Groups ---

// The object of which an input is a coordinate: "targets.a.grasp_points.grip" for its position and its orientation,
// "targets.a.state" of pose, "targets.a.state.angular_velocity" of "…/x".
std::string owner_of(const std::string& input) {
  std::string path = input.substr(0, input.rfind('/'));
  for (const std::string_view list : {"grasp_points.", "grasp_points["}) {
    const std::size_t at = path.find(list);
    if (at == std::string::npos) continue;
    const std::size_t end = path.find('.', at + list.size());
    return path.substr(0, end);
  }
  for (const std::string_view part : {".position", ".quaternion_wxyz", ".rpy"})
    if (path.ends_with(part)) return path.substr(0, path.size() - part.size());
  return path;
}

std::vector<InputGroup> groups_of(const Campaign& campaign) {
  std::vector<InputGroup> groups;
  for (std::size_t i = 0; i < campaign.inputs.size(); ++i) {
    const std::string owner = owner_of(campaign.inputs[i].name);
    const auto known = std::find_if(groups.begin(), groups.end(), [&](const InputGroup& g) { return g.name == owner; });
    if (known == groups.end())
      groups.push_back({owner, {i}});
    else
      known->inputs.push_back(i);
  }
  for (InputGroup& group : groups) {
    for (const std::size_t i : group.inputs) group.names.push_back(campaign.inputs[i].name);
    if (group.inputs.size() == 1) group.name = group.names.front();
  }
  for (const StudyAxis& axis : campaign.design) groups.push_back({axis.name, {}});
  return groups;
}

// --- Columns ---

std::string parent_of(const std::string& name) {
  const std::size_t at = name.rfind('/');
  return at == std::string::npos ? std::string() : name.substr(0, at);
}

double largest_of(const Description& d) { return d.count == 0 ? 0 : std::max(std::abs(d.least), std::abs(d.largest)); }

// Whether a column's numbers differ only by rounding error: relative to themselves, to the other components of their
// vector, and to all other columns of their unit.
class Rounding {
 public:
  explicit Rounding(const CampaignReport& report) : report_(report) {
    for (const CampaignReport::Numbers& column : report.columns) {
      const double largest = largest_of(column.description);
      double& of_vector = vectors_[parent_of(column.head.name) + " " + column.head.unit];
      double& of_unit = units_[column.head.unit];
      of_vector = std::max(of_vector, largest);
      of_unit = std::max(of_unit, largest);
    }
  }
  bool is(std::size_t i) const {
    const CampaignReport::Numbers& column = report_.columns[i];
    const Description& d = column.description;
    const double largest = largest_of(d), spread = d.largest - d.least;
    if (largest < kNothing) return true;
    if (column.head.unit == "1" || column.head.unit.empty()) return spread <= kRounding * largest;
    return spread <= kRounding * vectors_.at(parent_of(column.head.name) + " " + column.head.unit) ||
           largest <= kRounding * units_.at(column.head.unit);
  }

 private:
  const CampaignReport& report_;
  std::map<std::string, double> vectors_, units_;
};

/// Columns that are compared with the inputs: those that criteria read, then shares of tolerances, then all others.
std::vector<std::size_t> columns_to_measure(const Campaign& campaign) {
  std::vector<std::size_t> chosen;
  const auto add = [&](std::size_t i) {
    if (i < campaign.columns.size() && std::find(chosen.begin(), chosen.end(), i) == chosen.end()) chosen.push_back(i);
  };
  for (const Criterion& criterion : campaign.success)
    std::for_each(criterion.reads().begin(), criterion.reads().end(), add);
  for (std::size_t i = 0; i < campaign.columns.size(); ++i)
    if (campaign.columns[i].name.find("/tolerance_used/") != std::string::npos) add(i);
  for (std::size_t i = 0; i < campaign.columns.size(); ++i) add(i);
  return chosen;
}

class Influences {
 public:
  Influences(const Rows& rows, const std::vector<Ranking>& inputs, CampaignReport& report)
      : rows_(rows), inputs_(inputs), report_(report) {
    report.groups = groups_of(rows.campaign);
    // Rows at multiples of the golden ratio: evenly spread, and not aligned with the digits of Sobol's sequence.
    for (std::size_t row = 0; row < rows.count(); ++row) {
      const auto place = static_cast<std::uint32_t>((row * 0x9e3779b97f4a7c15u) >> 32);
      if (rows.count() <= kRowsOfGroups ||
          static_cast<double>(place) * 0x1p-32 < static_cast<double>(kRowsOfGroups) / static_cast<double>(rows.count()))
        picked_.push_back(row);
    }
    rank_axes();
    fit_groups();
  }

  void measure(Measure::Of of, const std::string& name, const std::string& unit, const std::vector<double>& numbers) {
    report_.measures.push_back(measured(of, name, unit, numbers));
  }

  Measure measured(Measure::Of of, const std::string& name, const std::string& unit,
                   const std::vector<double>& numbers) {
    const RankedNumbers ranked(numbers);
    Measure result{name, unit, ranked.count, {}, {}, 1, of};
    for (const Ranking& input : inputs_) result.inputs.push_back(sensitivity_of(input, ranked));
    std::vector<double> some;
    for (const std::size_t row : picked_) some.push_back(numbers[row]);
    std::size_t axis = 0, fit = 0;
    for (const InputGroup& group : report_.groups) {
      if (group.inputs.empty())
        result.groups.push_back(sensitivity_of(axes_[axis++], ranked));
      else if (group.inputs.size() == 1)
        result.groups.push_back(result.inputs[group.inputs.front()]);
      else {
        const std::lock_guard one_at_a_time(fitting_);  // a fit caches the basis of its last rows
        result.groups.push_back(together(result, group, fits_[fit++].of(some)));
      }
      const double share = result.groups.back().first_order;
      // A constant input explains nothing.
      if (!std::isnan(share)) result.unexplained -= std::max(share, 0.0);
      if (group.inputs.size() > 1 && std::isnan(share)) result.unexplained = NAN;
    }
    result.unexplained = result.count < 4 ? NAN : std::clamp(result.unexplained, 0.0, 1.0);
    return result;
  }

  void measure_criteria() {
    const std::vector<Criterion>& criteria = rows_.campaign.success;
    if (criteria.size() < 2) return;  // a single criterion equals success for cases that are ok
    for (const Criterion& criterion : criteria) {
      std::vector<double> truth(rows_.count(), NAN);
      std::vector<double> numbers(rows_.campaign.columns.size() + rows_.campaign.inputs.size(), NAN);
      std::map<std::size_t, std::vector<double>> read;
      for (const std::size_t i : criterion.reads()) read[i] = rows_.numbers(i);
      bool varies = false;
      double first = NAN;
      for (std::size_t row = 0; row < rows_.count(); ++row) {
        if (!rows_.ok(row)) continue;
        for (const auto& [i, values] : read) numbers[i] = values[row];
        const Verdict verdict = criterion.judge(numbers);
        if (verdict == Verdict::not_checked) continue;
        truth[row] = verdict == Verdict::yes;
        if (std::isnan(first)) first = truth[row];
        varies = varies || truth[row] != first;
      }
      if (varies) measure(Measure::Of::criterion, criterion.name(), "1", truth);
    }
  }

  void measure_columns(int threads) {
    const Rounding rounding(report_);
    for (std::size_t i = 0; i < rows_.campaign.columns.size(); ++i) {
      const Description& d = report_.columns[i].description;
      if (d.count >= 2 && d.least < d.largest && rounding.is(i))
        report_.rounding.push_back(report_.columns[i].head.name);
    }
    std::vector<std::size_t> chosen;
    for (const std::size_t i : columns_to_measure(rows_.campaign)) {
      const Description& d = report_.columns[i].description;
      if (d.count < 2 || d.least == d.largest || rounding.is(i)) continue;
      if (chosen.size() + 1 >= kMostMeasures)  // with success
        ++report_.measures_left_out;
      else
        chosen.push_back(i);
    }
    const std::size_t before = report_.measures.size();
    report_.measures.resize(before + chosen.size());
    for_each_of(chosen.size(), threads, [&](std::size_t k) {
      const CampaignTable::Head& head = report_.columns[chosen[k]].head;
      report_.measures[before + k] = measured(Measure::Of::column, head.name, head.unit, rows_.numbers(chosen[k]));
    });
  }

 private:
  // A fit of all inputs may explain less than one input alone, for example for success within a window.
  static Sensitivity together(const Measure& measure, const InputGroup& group, Sensitivity all) {
    if (std::isnan(all.first_order)) return all;
    for (const std::size_t i : group.inputs) {
      const Sensitivity& one = measure.inputs[i];
      if (one.first_order > all.first_order) all = {one.first_order, one.error, NAN};
    }
    all.rank_correlation = NAN;
    return all;
  }

  void rank_axes() {
    for (std::size_t a = 0; a < rows_.campaign.design.size(); ++a) {
      std::vector<double> at(rows_.count());
      for (std::size_t row = 0; row < rows_.count(); ++row) {
        const std::size_t value = rows_.campaign.position(rows_.index[row] / rows_.campaign.cases)[a];
        const StudyAxis& axis = rows_.campaign.design[a];
        at[row] = axis.is_numeric ? axis.values[value].number : static_cast<double>(value);
      }
      axes_.push_back(ranking_of(at));
    }
  }

  void fit_groups() {
    for (const InputGroup& group : report_.groups) {
      if (group.inputs.size() < 2) continue;
      std::vector<std::vector<double>> numbers;
      for (const std::size_t i : group.inputs) {
        const std::vector<double> all = apart_from_design(rows_, rows_.table.numbers(rows_.table.inputs()[i]));
        numbers.emplace_back();
        for (const std::size_t row : picked_) numbers.back().push_back(all[row]);
      }
      fits_.emplace_back(numbers);
    }
  }

  const Rows& rows_;
  const std::vector<Ranking>& inputs_;
  CampaignReport& report_;
  std::vector<std::size_t> picked_;     // rows for the fits of groups
  std::vector<Ranking> axes_;           // of the design
  std::vector<GroupSensitivity> fits_;  // of groups with several inputs
  std::mutex fitting_;
};

}  // namespace

void measure_influences(const Rows& rows, const std::vector<Ranking>& inputs, int threads, CampaignReport& report) {
  Influences influences(rows, inputs, report);
  influences.measure(Measure::Of::success, "success", "1",
                     std::vector<double>(rows.success.begin(), rows.success.end()));
  influences.measure_criteria();
  influences.measure_columns(threads);
}

}  // namespace grapnel
