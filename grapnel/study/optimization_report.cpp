#include "grapnel/study/optimization_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "grapnel/describe/json.hpp"
#include "grapnel/result/result_documents.hpp"
#include "grapnel/result/text_table.hpp"

namespace grapnel {
namespace {

enum class ResultFormat { first };

// Smaller numbers are not shown on the terminal, such as components normal to the plane of a planar mechanism.
constexpr double kRounding = 1e-12;

std::string with_unit(const std::string& name, const std::string& unit) {
  return unit.empty() ? name : name + " [" + unit + "]";
}

std::string search_name(std::size_t search) { return search == 0 ? "sample" : fmt::format("local {}", search); }

// The unit of the weighted sum, if it has one.
std::string objective_unit(const Optimization& optimization) {
  const std::string unit = optimization.objective.front().measured.unit;
  for (const ObjectiveTerm& term : optimization.objective) {
    if (term.measured.unit != unit) return {};
  }
  return unit;
}

// Columns of the table on the terminal.
bool is_searched(const std::string& name) {
  for (const char* pattern :
       {"grasps/*/impulse_magnitude", "grasps/*/angular_impulse_magnitude", "grasps/*/peak_force",
        "grasps/*/relative_speed", "grasps/*/largest_speed", "base/angular_velocity_change", "base/velocity_change",
        "kinetic_energy_before", "kinetic_energy_after", "joints/*/position", "joints/*/driving_impulse",
        "clearance/minimum", "ledger/feasible"}) {
    if (column_matches(pattern, name)) return true;
  }
  return false;
}

std::string shown(double value) { return std::isnan(value) ? "-" : fmt::format("{:.6g}", value); }

// Relative changes only for positive quantities; for quantities of either sign they are not meaningful.
void comparison_row(const std::string& name, double before, double after, TextTable& table, bool positive = true) {
  if (std::isnan(before) && std::isnan(after)) return;
  const bool relates = positive && before > 0 && after > 0;
  table.row({name, shown(before), shown(after), relates ? fmt::format("{:+.1f} %", 100 * (after / before - 1)) : ""});
}

// Rounding error, or zero.
bool is_silent(double value) { return !(std::abs(value) > kRounding); }

Measured least_margin(const Optimization& optimization) {
  Measured margins{"", "1", {}, Combine::least};
  for (std::size_t c = 0; c < optimization.columns.size(); ++c) {
    if (column_matches("margins", optimization.columns[c].name)) margins.columns.push_back(c);
  }
  return margins;
}

std::string comparison_rows(const Optimization& optimization, const Evaluation& before, const Evaluation& after) {
  TextTable table;
  table.row({"", "before", "after", "change"});
  comparison_row(with_unit("objective", objective_unit(optimization)), before.score.objective, after.score.objective,
                 table);
  for (std::size_t i = 0; i < optimization.limits.size(); ++i) {
    const double was = before.score.limits.empty() ? NAN : before.score.limits[i];
    comparison_row(optimization.limits[i].text(), was, after.score.limits[i], table);
  }
  const Measured margins = least_margin(optimization);
  comparison_row("minimum margin to a rating [1]", value_of(margins, before.row.values),
                 value_of(margins, after.row.values), table);
  for (std::size_t c = 0; c < optimization.columns.size(); ++c) {
    const Column& column = optimization.columns[c];
    const double was = before.row.values[c], is = after.row.values[c];
    if (!is_searched(column.name) || (is_silent(was) && is_silent(is))) continue;
    const bool positive = !column_matches("joints", column.name) && !column_matches("base", column.name);
    comparison_row(with_unit(column.name, column.unit), was, is, table, positive);
  }
  return table.text();
}

// Three verdicts: a point without evaluated clearance and limits is not known to be feasible.
Verdict feasibility_of(const Optimization& optimization, const Evaluation& point) {
  for (std::size_t c = 0; c < optimization.columns.size() && c < point.row.values.size(); ++c) {
    if (optimization.columns[c].name != "ledger/feasible" || std::isnan(point.row.values[c])) continue;
    return point.row.values[c] != 0 ? Verdict::yes : Verdict::no;
  }
  return Verdict::not_checked;
}

std::string most_frequent_reason(const OptimizationOutcome& outcome) {
  std::map<std::string, std::size_t> counts;
  for (const Evaluation& one : outcome.evaluations) {
    const std::string& reason = one.row.reason;
    if (!reason.empty()) ++counts[reason.starts_with(kNotConserved) ? reason.substr(0, reason.find(" is ")) : reason];
  }
  const auto most =
      std::max_element(counts.begin(), counts.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  return most == counts.end() ? "" : most->first;
}

}  // namespace

std::string objective_text(const Optimization& optimization) {
  std::string text;
  for (const ObjectiveTerm& term : optimization.objective) {
    text += text.empty() ? "" : " + ";
    if (term.weight != 1) text += fmt::format("{} × ", term.weight);
    text += term.measured.name;
  }
  return (optimization.maximize ? "maximize " : "minimize ") + text;
}

std::string evaluations_csv(const Optimization& optimization, const OptimizationOutcome& outcome) {
  std::string out = "point,search";
  for (const OptimizationVariable& v : optimization.variables) out += "," + csv_quoted(with_unit(v.name, v.unit));
  out += ",status,reason,acceptable," + csv_quoted(with_unit("objective", objective_unit(optimization))) + ",violation";
  for (const OptimizationLimit& limit : optimization.limits) out += "," + csv_quoted(limit.text());
  for (const Column& column : optimization.columns) out += "," + csv_quoted(with_unit(column.name, column.unit));
  out += "\n";
  const auto add = [&](double value) {
    out += ",";
    append_csv_number(value, out);
  };
  for (const Evaluation& one : outcome.evaluations) {
    out += std::to_string(one.row.index) + "," + search_name(one.search);
    for (const double value : one.values) add(value);
    out += std::string(",") + name_of(one.row.status) + "," + csv_quoted(one.row.reason) + "," +
           (one.score.acceptable() ? "1" : "0");
    add(one.score.objective);
    add(one.score.reached ? one.score.violation : NAN);
    for (const double value : one.score.limits) add(value);
    for (const double value : one.row.values) add(value);
    out += "\n";
  }
  return out;
}

template <>
struct Described<ResultFormat> {
  static constexpr Choice choices[] = {choice(ResultFormat::first, "grapnel-optimization-result/1")};
  static constexpr Type type = enumeration<ResultFormat>("OptimizationResultFormat", choices);
};

template <>
struct Described<OptimizationReport::Settings> {
  using T = OptimizationReport::Settings;
  static constexpr Field fields[] = {
      field<&T::name>("name", "name of the optimization"),
      field<&T::sha256>("sha256", "SHA-256 of the file's bytes and of the scenario with its included files"),
      field<&T::simulate>("simulate", "as in the file"),
  };
  static constexpr Type type = structure<T>("OptimizationSettings", "settings of the optimization.", fields);
};

template <>
struct Described<OptimizationReport::Feasible> {
  using T = OptimizationReport::Feasible;
  static constexpr Field fields[] = {
      field<&T::before>("before", "verdict of the unchanged scenario"),
      field<&T::after>("after", "verdict of the best point; absent without one"),
  };
  static constexpr Type type = structure<T>(
      "FeasibilityChange", "whether joints stay within their limits and bodies keep their clearance.", fields);
};

template <>
struct Described<OptimizationReport::Variable> {
  using T = OptimizationReport::Variable;
  static constexpr Field fields[] = {
      field<&T::name>("name", "name of the variable"),
      field<&T::unit>("unit", "unit of its numbers; empty: unknown"),
      field<&T::from>("from", "as the variable", "lower bound"),
      field<&T::to>("to", "as the variable", "upper bound"),
      field<&T::best>("best", "as the variable", "value at the best point; absent without one"),
  };
  static constexpr Type type = structure<T>("Variable", "a number that was varied.", fields);
};

template <>
struct Described<OptimizationReport::Change> {
  using T = OptimizationReport::Change;
  static constexpr Field fields[] = {
      field<&T::name>("name", "name of the objective, the limit or the column"),
      field<&T::unit>("unit", "unit of its numbers; empty: the sum of several units"),
      field<&T::before>("before", "as `unit`", "value of the unchanged scenario; null: it does not exist").or_null(),
      field<&T::after>("after", "as `unit`",
                       "value at the best point; null: it does not exist; absent without a best point")
          .or_null()
          .when<[](const T& c) { return c.has_after; }>(),
  };
  static constexpr Type type = structure<T>("Change", "a number before and after.", fields);
};

template <>
const Type& type_of<OptimizationReport>() {
  using T = OptimizationReport;
  static constexpr Field fields[] = {
      derived<[](const T&) { return ResultFormat::first; }>("schema", "", "format of this file"),
      field<&T::version>("version", "version of Grapnel"),
      field<&T::settings>("optimization", "settings of the optimization"),
      field<&T::evaluations>("evaluations", "1", "number of evaluated points"),
      derived<[](const T& o) { return o.status[0]; }>("ok", "1", "points that completed"),
      derived<[](const T& o) { return o.status[1]; }>("failed", "1", "points that failed"),
      derived<[](const T& o) { return o.status[2]; }>("unreachable", "1",
                                                      "points for which no configuration was found"),
      field<&T::beyond_limits>("beyond_limits", "1", "points that are ok but violate limits"),
      field<&T::best>("best", "1", "the best point, as `point` in evaluations.csv; null: no point meets all limits")
          .or_null(),
      field<&T::why>("why", "reason for which no point meets all limits; absent with a best point"),
      field<&T::before_acceptable>("before_acceptable", "whether the unchanged scenario meets all limits"),
      field<&T::before_reason>("before_reason",
                               "reason for which the unchanged scenario has no result; absent if it has one"),
      field<&T::feasibility>("feasibility", "feasibility before and after"),
      field<&T::variables>("variables", "variables in the order of the file"),
      field<&T::objective>("objective", "minimized or maximized columns"),
      field<&T::limits>("limits", "limits in the order of the file"),
      field<&T::columns>("columns", "all stored columns"),
      field<&T::text>("text", "text of the optimization file"),
  };
  static constexpr Type type =
      structure<T>("OptimizationReport",
                   "results of an optimization: before, the unchanged scenario, and after, the best point.", fields);
  return type;
}

std::string comparison_json(const Optimization& optimization, const OptimizationOutcome& outcome,
                            const Evaluation* after, const std::string& version) {
  const Evaluation& before = outcome.before;
  const auto change = [&](const std::string& name, const std::string& unit, auto&& number_of) {
    return OptimizationReport::Change{name, unit, number_of(before), after ? number_of(*after) : NAN, after != nullptr};
  };
  OptimizationReport report;
  report.version = version;
  report.settings = {optimization.name, optimization.sha256, optimization.mode};
  report.evaluations = outcome.evaluations.size();
  for (const CaseStatus status : {CaseStatus::ok, CaseStatus::failed, CaseStatus::unreachable})
    report.status[static_cast<std::size_t>(status)] = outcome.count(status);
  report.beyond_limits = outcome.beyond_limits();
  report.best = outcome.best;
  if (!outcome.best) report.why = why_nothing_is_best(optimization, outcome);
  report.before_acceptable = before.score.acceptable();
  if (!before.row.reason.empty()) report.before_reason = before.row.reason;
  report.feasibility.before = feasibility_of(optimization, before);
  if (after) report.feasibility.after = feasibility_of(optimization, *after);
  for (std::size_t k = 0; k < optimization.variables.size(); ++k) {
    const OptimizationVariable& v = optimization.variables[k];
    report.variables.push_back({v.name, v.unit, v.from, v.to, {}});
    if (outcome.best) report.variables.back().best = outcome.evaluations[*outcome.best].values[k];
  }
  report.objective = change(objective_text(optimization), objective_unit(optimization),
                            [](const Evaluation& e) { return e.score.objective; });
  for (std::size_t i = 0; i < optimization.limits.size(); ++i) {
    const OptimizationLimit& limit = optimization.limits[i];
    report.limits.push_back(
        change(limit.text(), limit.measured.unit, [i](const Evaluation& e) { return e.score.limits[i]; }));
  }
  for (std::size_t c = 0; c < optimization.columns.size(); ++c) {
    const Column& column = optimization.columns[c];
    report.columns.push_back(change(column.name, column.unit, [c](const Evaluation& e) { return e.row.values[c]; }));
  }
  report.text = optimization.text;
  return json_of(report).dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

std::string comparison_text(const Optimization& optimization, const OptimizationOutcome& outcome,
                            const Evaluation* after) {
  std::string text = fmt::format("{}: {}\n{} evaluations, {} ok", optimization.name, objective_text(optimization),
                                 outcome.evaluations.size(), outcome.count(CaseStatus::ok));
  for (const CaseStatus status : {CaseStatus::failed, CaseStatus::unreachable}) {
    if (outcome.count(status) > 0) text += fmt::format(", {} {}", outcome.count(status), name_of(status));
  }
  if (outcome.beyond_limits() > 0) text += fmt::format("; {} of the ok points violate limits", outcome.beyond_limits());
  text += "\n";
  if (!outcome.before.score.reached)
    text += paragraph("before: " + outcome.before.row.reason, "");
  else if (!outcome.before.score.acceptable())
    text += "before: violates limits\n";
  if (!after || !outcome.best) return text;
  const Evaluation& best = outcome.evaluations[*outcome.best];
  text += fmt::format("\nbest: point {} ({})\n", best.row.index, search_name(best.search));
  TextTable values;
  for (std::size_t k = 0; k < optimization.variables.size(); ++k) {
    const OptimizationVariable& v = optimization.variables[k];
    const bool at_end = best.values[k] == v.from || best.values[k] == v.to;
    values.row({v.name, fmt::format("{:.6g}{}", best.values[k], v.unit.empty() ? "" : " " + v.unit),
                fmt::format("of {:.6g} … {:.6g}", v.from, v.to), at_end ? "at the end of its range" : ""});
  }
  text += values.text() + "\n" + comparison_rows(optimization, outcome.before, *after);
  text += fmt::format("\nfeasible: before {}, after {}\n", name_of(feasibility_of(optimization, outcome.before)),
                      name_of(feasibility_of(optimization, *after)));
  if (outcome.before.score.acceptable() && comes_before(optimization, outcome.before.score, after->score))
    text += "\nthe unchanged scenario is better than any evaluated point\n";
  return text;
}

std::string why_nothing_is_best(const Optimization& optimization, const OptimizationOutcome& outcome) {
  if (!outcome.nearest) {
    const std::string reason = most_frequent_reason(outcome);
    return "no point has a result" + (reason.empty() ? "" : ", most frequent reason: " + reason);
  }
  const Evaluation& nearest = outcome.evaluations[*outcome.nearest];
  const std::size_t worst = nearest.score.worst_limit, count = optimization.limits.size();
  std::string which = worst < count    ? fmt::format("the limit '{}' is violated, with {:.6g}",
                                                     optimization.limits[worst].text(), nearest.score.limits[worst])
                      : worst == count ? fmt::format("joint limits or clearances are violated, by {:.6g} in total",
                                                     nearest.row.values.back())
                                       : "the objective has no value";
  return fmt::format("no point meets all limits; the nearest is point {}, where {}", nearest.row.index, which);
}

}  // namespace grapnel
