#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>

#include "grapnel/campaign/sensitivities.hpp"
#include "grapnel/describe/json.hpp"
#include "grapnel/result/described_table.hpp"
#include "grapnel/result/json_document.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

enum class SensitivityFormat { first };

}  // namespace

template <>
struct Described<SensitivityFormat> {
  static constexpr Choice choices[] = {choice(SensitivityFormat::first, "grapnel-sensitivities/1")};
  static constexpr Type type = enumeration<SensitivityFormat>("SensitivityFormat", choices);
};

template <>
struct Described<SensitivityReport::Settings> {
  using T = SensitivityReport::Settings;
  static constexpr Field fields[] = {
      field<&T::name>("name", "of the scenario or campaign"),
      field<&T::file>("file", "path as given"),
      field<&T::sha256>("sha256", "SHA-256 of the input"),
      field<&T::simulate>("simulate", "run: whole captures; impact: the impact only"),
      field<&T::plan>("plan", "per_case: every run plans its approach; nominal: all follow one plan"),
  };
  static constexpr Type type = structure<T>("SensitivitySettings", "the captures.", fields);
};

template <>
struct Described<SensitivityReport::Value> {
  using T = SensitivityReport::Value;
  static constexpr Field fields[] = {
      field<&T::name>("name", "path in the scenario, with the component"),
      field<&T::unit>("unit", "its unit"),
      field<&T::description>("description", "its meaning"),
      field<&T::value>("value", "as `unit`", "at which outcomes are differentiated; of a campaign the mean"),
      field<&T::deviation>("deviation", "as `unit`", "standard deviation of the campaign; absent: not stated"),
      field<&T::size>("size", "as `unit`", "magnitude, by which steps and effects are scaled; of a zero: see the page"),
  };
  static constexpr Type type = structure<T>("SensitivityValue", "a number that is varied.", fields);
};

template <>
struct Described<SensitivityReport::Derivative> {
  using T = SensitivityReport::Derivative;
  static constexpr Field fields[] = {
      field<&T::by>("by", "name of the value"),
      field<&T::verdict>(
          "verdict",
          "yes: differentiable, and the error is at most 1 % or negligible; NO: not differentiable here; not decided: "
          "the error is too large"),
      field<&T::derivative>("derivative", "SI", "outcome by value; absent: there is no estimate"),
      field<&T::error>("error", "SI", "its estimated error"),
      field<&T::elasticity>("elasticity", "1",
                            "value / outcome times the derivative; absent: the outcome is zero or negligible in its "
                            "vector, or the verdict not yes"),
      field<&T::share>("share", "1", "of the outcome's variance; correlated values may have negative shares"),
      field<&T::left>("left", "SI", "derivative below the value, if it differs"),
      field<&T::right>("right", "SI", "derivative above the value"),
      field<&T::one_sided>("one_sided", "whether values beyond a bound are invalid, so that one side was used"),
      field<&T::step>("step", "as the value", "largest step of the differences"),
      field<&T::reason>("reason", "of a verdict other than yes"),
  };
  static constexpr Type type = structure<T>("OutcomeDerivative", "the derivative of an outcome by a value.", fields);
};

template <>
struct Described<SensitivityReport::Outcome> {
  using T = SensitivityReport::Outcome;
  static constexpr Field fields[] = {
      field<&T::name>("name", "column of studies and campaigns"),
      field<&T::unit>("unit", "its unit"),
      field<&T::description>("description", "its meaning"),
      field<&T::value>("value", "as `unit`", "at the values; null: it does not exist").or_null(),
      field<&T::deviation>("deviation", "as `unit`", "standard deviation to first order; absent: not stated"),
      field<&T::deviation_absent>("deviation_absent", "why there is none, for a campaign; empty: there is"),
      field<&T::by>("by", "derivatives, in the order of the values"),
  };
  static constexpr Type type = structure<T>("SensitivityOutcome", "an outcome.", fields);
};

template <>
struct Described<SensitivityReport::Limit> {
  using T = SensitivityReport::Limit;
  static constexpr Field fields[] = {
      field<&T::criterion>("criterion", "name of the criterion with this limit"),
      field<&T::outcome>("outcome", "the limited outcome"),
      field<&T::bound>("bound", "as the outcome", "the limit"),
      field<&T::at_most>("at_most", "whether it is an upper limit"),
      field<&T::magnitude>("magnitude", "whether it limits the magnitude"),
      field<&T::holds>("holds", "whether it holds at the values"),
      field<&T::probability>("probability", "1",
                             "that it holds, to first order, if the outcome is normal; absent: no deviation"),
  };
  static constexpr Type type = structure<T>("SensitivityLimit", "a limit of a criterion of success.", fields);
};

template <>
const Type& type_of<SensitivityReport>() {
  using T = SensitivityReport;
  static constexpr Field fields[] = {
      derived<[](const T&) { return SensitivityFormat::first; }>("schema", "", "format of this file"),
      field<&T::version>("version", "version of Grapnel"),
      field<&T::settings>("settings", "the captures"),
      field<&T::runs>("runs", "1", "number of simulated captures"),
      field<&T::values>("values", "the numbers that were varied"),
      field<&T::outcomes>("outcomes", "outcomes with their derivatives"),
      field<&T::covariance_of>("covariance_of", "names of the outcomes of the covariance"),
      field<&T::covariance>("covariance", "SI", "of these outcomes to first order; a list of rows"),
      field<&T::limits>("limits", "limits of the campaign's criteria"),
      field<&T::unjudged>("unjudged", "criteria without a first-order probability"),
      field<&T::notes>("notes", "about the method and outcomes"),
  };
  static constexpr Type type =
      structure<T>("SensitivityReport", "derivatives of outcomes, and first-order uncertainty.", fields);
  return type;
}

std::string sensitivities_json(const SensitivityReport& report) { return json_text(json_of(report)); }

std::string sensitivities_csv(const SensitivityReport& report) {
  std::string out =
      "outcome,outcome_unit,outcome_value,value,value_unit,value_at,verdict,derivative,error,elasticity,share,"
      "one_sided,reason\n";
  const auto number = [&](const std::optional<double>& x) {
    out += ",";
    append_csv_number(x.value_or(NAN), out);
  };
  for (const SensitivityReport::Outcome& outcome : report.outcomes) {
    for (std::size_t k = 0; k < outcome.by.size(); ++k) {
      const SensitivityReport::Derivative& one = outcome.by[k];
      const SensitivityReport::Value& value = report.values[k];
      out += csv_quoted(outcome.name) + "," + csv_quoted(outcome.unit);
      number(outcome.value);
      out += "," + csv_quoted(value.name) + "," + csv_quoted(value.unit);
      number(value.value);
      out += std::string(",") + name_of(one.verdict);
      for (const auto& x : {one.derivative, one.error, one.elasticity, one.share}) number(x);
      out += std::string(one.one_sided ? ",1," : ",0,") + csv_quoted(one.reason) + "\n";
    }
  }
  return out;
}

// --- Text ---

namespace {

constexpr std::size_t kMostValues = 10;  // per outcome

std::string value_text(double value, const std::string& unit) {
  return short_number(value) + (unit.empty() || unit == "1" ? "" : " " + unit);
}
std::string cell(const std::optional<double>& value) { return value ? short_number(*value) : "-"; }
std::string percent(const std::optional<double>& share) { return share ? fmt::format("{:.1f} %", 100 * *share) : "-"; }

// The change of the outcome for a change of the value by its size or deviation.
double effect_of(const SensitivityReport::Derivative& one, const SensitivityReport::Value& value) {
  return std::abs(one.derivative.value_or(0)) * value.deviation.value_or(value.size);
}

// Values by their effects; those without a determined derivative last.
std::vector<std::size_t> by_effect(const SensitivityReport& report, const SensitivityReport::Outcome& outcome) {
  std::vector<std::size_t> order(outcome.by.size());
  std::iota(order.begin(), order.end(), 0);
  const auto key = [&](std::size_t k) {
    return std::pair(outcome.by[k].verdict != Differentiable::yes, -effect_of(outcome.by[k], report.values[k]));
  };
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return key(a) < key(b); });
  return order;
}

void add_outcome_table(const SensitivityReport& report, const SensitivityReport::Outcome& outcome, std::string& text) {
  const bool propagates = !report.values.empty() && report.values.front().deviation.has_value();
  text += fmt::format("{} = {}", printable_line(outcome.name), value_text(outcome.value, outcome.unit));
  if (outcome.deviation)
    text += fmt::format(", standard deviation {} to first order", value_text(*outcome.deviation, outcome.unit));
  text += "\n";
  if (!outcome.deviation_absent.empty())
    text += paragraph("no standard deviation: " + printable_line(outcome.deviation_absent), "");
  text += "\n";
  TextTable table;
  table.row({"by", "at", "derivative", "error", propagates ? "share" : "elasticity", "verdict"});
  std::size_t rows = 0, without = 0;
  std::string reasons;
  for (const std::size_t k : by_effect(report, outcome)) {
    const SensitivityReport::Derivative& one = outcome.by[k];
    const SensitivityReport::Value& value = report.values[k];
    const bool yes = one.verdict == Differentiable::yes;
    if (yes && rows == kMostValues) {
      ++without;
      continue;
    }
    rows += yes;
    table.row({printable_line(one.by), value_text(value.value, value.unit), yes ? cell(one.derivative) : "-",
               yes && one.error ? small_number(*one.error) : "-",
               propagates ? percent(one.share) : cell(one.elasticity),
               std::string(name_of(one.verdict)) + (one.one_sided && yes ? ", one-sided" : "")});
    if (!yes)
      reasons += paragraph(
          fmt::format("{}: {}: {}", printable_line(one.by), name_of(one.verdict), printable_line(one.reason)), "  ");
  }
  text += table.text();
  if (without > 0) text += fmt::format("  and {} with less effect\n", without);
  text += reasons + "\n";
}

void add_limit_table(const SensitivityReport& report, std::string& text) {
  if (report.limits.empty() && report.unjudged.empty()) return;
  if (!report.limits.empty()) {
    TextTable table;
    table.row({"criterion", "outcome", "limit", "holds at the mean", "probability, first order"});
    for (const SensitivityReport::Limit& limit : report.limits) {
      table.row({printable_line(limit.criterion), printable_line(limit.outcome),
                 fmt::format("{}{} {}", limit.magnitude ? "magnitude " : "", limit.at_most ? "at most" : "at least",
                             short_number(limit.bound)),
                 limit.holds ? "yes" : "NO", limit.probability ? fmt::format("{:.4g}", *limit.probability) : "-"});
    }
    text += table.text();
    text += paragraph("First order: the outcome is linear in the values and normal. A campaign evaluates both.", "  ");
  }
  for (const std::string& criterion : report.unjudged)
    text += paragraph(fmt::format("no first-order probability of {}: it is not a limit of an outcome",
                                  in_quotes(printable_line(criterion))),
                      "  ");
  text += "\n";
}

}  // namespace

std::string sensitivities_text(const SensitivityReport& report) {
  std::string text = fmt::format("sensitivities of {}: {} by {}, {}\n\n", printable_line(report.settings.name),
                                 counted(report.outcomes.size(), "outcome"), counted(report.values.size(), "value"),
                                 counted(report.runs, "run"));
  for (const SensitivityReport::Outcome& outcome : report.outcomes) add_outcome_table(report, outcome, text);
  add_limit_table(report, text);
  for (const std::string& note : report.notes) text += paragraph(printable_line(note), "");
  return text;
}

}  // namespace grapnel
