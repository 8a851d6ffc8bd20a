// What of the results' variance goes with which input.
#include <algorithm>
#include <cmath>
#include <map>
#include <string_view>

#include "grapnel/campaign/campaign_report.hpp"
#include "grapnel/campaign/sensitivity.hpp"

namespace grapnel {
namespace {

using InputGroup = CampaignReport::InputGroup;
using Measure = CampaignReport::Measure;

constexpr std::size_t kMostMeasures = 64;     // success and columns
constexpr std::size_t kRowsOfGroups = 20000;  // of more rows so many, spread evenly, tell what groups explain
constexpr double kRounding = 1e-9;            // of a column's numbers, or of others of their kind
constexpr double kNothing = 1e-15;            // [SI]

// --- Groups ---

// What an input is a coordinate of: "targets.a.grasp_points.grip" of its position and its orientation,
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

// Whether a column's numbers differ by rounding alone: compared with themselves, with the other components of their
// vector, and with all other columns of their unit.
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

/// Columns that are compared with the inputs: what criteria read, then what tells of tolerances, then all others.
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
    // Rows by the multiples of the golden ratio: evenly spread, and in no step with the digits of Sobol's sequence.
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
      else
        result.groups.push_back(together(result, group, fits_[fit++].of(some)));
      const double share = result.groups.back().first_order;
      // Of an input that never changes nothing is known, and nothing is explained.
      if (!std::isnan(share)) result.unexplained -= std::max(share, 0.0);
      if (group.inputs.size() > 1 && std::isnan(share)) result.unexplained = NAN;
    }
    result.unexplained = result.count < 4 ? NAN : std::clamp(result.unexplained, 0.0, 1.0);
    report_.measures.push_back(std::move(result));
  }

  void measure_criteria() {
    const std::vector<Criterion>& criteria = rows_.campaign.success;
    if (criteria.size() < 2) return;  // a single one is success itself, where cases are ok
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

  void measure_columns() {
    const Rounding rounding(report_);
    std::size_t measured = 1;  // success
    for (std::size_t i = 0; i < rows_.campaign.columns.size(); ++i) {
      const Description& d = report_.columns[i].description;
      if (d.count >= 2 && d.least < d.largest && rounding.is(i))
        report_.rounding.push_back(report_.columns[i].head.name);
    }
    for (const std::size_t i : columns_to_measure(rows_.campaign)) {
      const Description& d = report_.columns[i].description;
      if (d.count < 2 || d.least == d.largest || rounding.is(i)) continue;
      if (measured++ >= kMostMeasures)
        ++report_.measures_left_out;
      else
        measure(Measure::Of::column, report_.columns[i].head.name, report_.columns[i].head.unit, rows_.numbers(i));
    }
  }

 private:
  // A fit of all may miss what one of them alone explains, as of a success within a window.
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
  std::vector<std::size_t> picked_;     // rows that groups are fitted to
  std::vector<Ranking> axes_;           // of the design
  std::vector<GroupSensitivity> fits_;  // of groups with several inputs
};

}  // namespace

void measure_influences(const Rows& rows, const std::vector<Ranking>& inputs, CampaignReport& report) {
  Influences influences(rows, inputs, report);
  influences.measure(Measure::Of::success, "success", "1",
                     std::vector<double>(rows.success.begin(), rows.success.end()));
  influences.measure_criteria();
  influences.measure_columns();
}

}  // namespace grapnel
