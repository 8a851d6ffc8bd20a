#include "grapnel/compare/identification_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "grapnel/describe/json.hpp"
#include "grapnel/result/described_table.hpp"
#include "grapnel/result/json_document.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

enum class IdentificationFormat { first };

constexpr double kShownWeight = 0.01;  // of a combination
constexpr double kShownCorrelation = 0.9;
constexpr std::size_t kShownMinima = 6;

std::string status_text(ParameterStatus status) {
  switch (status) {
    case ParameterStatus::identified:
      return "";
    case ParameterStatus::at_lower_bound:
      return "at its lower bound";
    case ParameterStatus::at_upper_bound:
      return "at its upper bound";
    case ParameterStatus::from_prior:
      return "by its prior only";
    case ParameterStatus::not_identifiable:
      return "not identifiable";
  }
  return "";
}

std::string six_digits(double value) { return fmt::format("{:.6g}", value); }

FittedLogsReport::Chi chi_of(const ChiSquare& c) {
  return {c.value, c.numbers, c.per_number(), c.bound, c.numbers >= 1 && c.agrees()};
}

FittedLogsReport::Log log_of(const Identification& identification, const LogFit& fit, std::size_t i) {
  const Identification::Log& log = identification.logs[i];
  const LogEstimate& one = fit.logs[i];
  FittedLogsReport::Log report;
  report.name = log.name, report.file = log.log.file, report.sha256 = log.log.sha256;
  report.scenario = log.run.scenario, report.scenario_sha256 = log.run.sha256;
  report.folder = "logs/" + log.name;
  report.verdict = one.comparison.report.verdict;
  report.chi_square = chi_of(one.chi_square);
  const FittedLog& fitted = identification.problem.logs[i];
  report.clock = {one.clock.offset, one.offset_uncertainty,
                  fitted.fits_drift ? std::optional(one.clock.drift) : std::nullopt, one.drift_uncertainty,
                  one.clock.reference};
  report.biases = one.biases;
  if (one.left_out || !one.why_not_left_out.empty())
    report.left_out = {one.left_out ? std::optional(chi_of(*one.left_out)) : std::nullopt, one.left_out_values,
                       one.why_not_left_out};
  return report;
}

void set_matrices(const Identification& identification, const LogFit& fit, FittedLogsReport& report) {
  for (const std::size_t k : fit.in_covariance)
    report.in_covariance.push_back(identification.problem.parameters[k].name);
  const Eigen::MatrixXd& C = fit.covariance;
  for (Eigen::Index i = 0; i < C.rows(); ++i) {
    report.covariance.emplace_back(), report.correlation.emplace_back();
    for (Eigen::Index k = 0; k < C.cols(); ++k) {
      report.covariance.back().push_back(C(i, k));
      report.correlation.back().push_back(C(i, k) / std::sqrt(C(i, i) * C(k, k)));
    }
  }
}

std::string parameter_table(const FittedLogsReport& report) {
  TextTable table;
  table.row({"parameter", "unit", "value", "uncertainty", "95 % interval", "bounds", ""});
  for (const FittedLogsReport::Parameter& p : report.parameters) {
    const ParameterEstimate& e = p.estimate;
    const bool is_known = e.status != ParameterStatus::not_identifiable;
    table.row({printable_line(p.name), p.unit, is_known ? six_digits(e.value) : "-",
               e.uncertainty ? small_number(*e.uncertainty) : "-",
               e.interval ? six_digits((*e.interval)[0]) + " … " + six_digits((*e.interval)[1]) : "-",
               short_number(p.from) + " … " + short_number(p.to), status_text(e.status)});
  }
  return table.text();
}

std::string log_table(const FittedLogsReport& report) {
  const auto optional = [](const std::optional<double>& x) { return x ? small_number(*x) : "-"; };
  TextTable table;
  table.row({"log", "numbers", "chi-square", "offset [s]", "uncertainty", "drift", "left out", "agrees"});
  for (const FittedLogsReport::Log& log : report.logs) {
    const bool has = log.left_out && log.left_out->chi_square;
    table.row(
        {printable_line(log.name), fmt::format("{:.0f}", log.chi_square.numbers),
         small_number(log.chi_square.per_number), fmt::format("{:.7g}", log.clock.offset),
         optional(log.clock.offset_uncertainty), optional(log.clock.drift),
         has ? small_number(log.left_out->chi_square->per_number) + (log.left_out->chi_square->agrees ? "" : ", NO")
             : "-",
         verdict_word(log.verdict)});
  }
  return table.text();
}

// "not identifiable: 0.71 mass - 0.71 speed".
std::string combination_text(const FittedLogsReport::Direction& direction) {
  std::string sum;
  for (const FittedLogsReport::Weight& one : direction.weights) {
    if (std::abs(one.weight) < kShownWeight) continue;
    const char* sign = one.weight < 0 ? (sum.empty() ? "-" : " - ") : (sum.empty() ? "" : " + ");
    sum += fmt::format("{}{:.2g} {}", sign, std::abs(one.weight), printable_line(one.parameter));
  }
  return fmt::format("not identifiable (in units of the ranges): {}; singular value {}", sum,
                     small_number(direction.singular_value));
}

std::string minima_text(const FittedLogsReport& report) {
  if (report.minima.size() < 2) return {};
  std::string text = "\nlocal minima, the best first:\n";
  TextTable table;
  std::vector<std::string> head{"chi-square", "numbers", "starts"};
  for (const FittedLogsReport::Parameter& p : report.parameters) head.push_back(printable_line(p.name));
  table.row(std::move(head));
  for (std::size_t k = 0; k < std::min(report.minima.size(), kShownMinima); ++k) {
    const FittedLogsReport::Minimum& one = report.minima[k];
    std::vector<std::string> cells{small_number(one.chi_square), fmt::format("{:.0f}", one.numbers),
                                   std::to_string(one.starts)};
    for (const double value : one.values) cells.push_back(short_number(value));
    table.row(std::move(cells));
  }
  return text + table.text();
}

}  // namespace

template <>
struct Described<IdentificationFormat> {
  static constexpr Choice choices[] = {choice(IdentificationFormat::first, "grapnel-identification-result/1")};
  static constexpr Type type = enumeration<IdentificationFormat>("IdentificationFormat", choices);
};

template <>
struct Described<ParameterStatus> : Enumeration<ParameterStatus, "ParameterStatus", "identified", "at_lower_bound",
                                                "at_upper_bound", "from_prior", "not_identifiable"> {};

template <>
struct Described<FittedLogsReport::Settings> {
  using T = FittedLogsReport::Settings;
  static constexpr Field fields[] = {
      field<&T::name>("name", "name of the identification"),
      field<&T::sha256>("sha256", "SHA-256 of the file, of the scenarios with included files, and of the logs"),
      field<&T::starts>("starts", "1", "number of searches"),
      field<&T::seed>("seed", "1", "seed of the starts"),
      field<&T::iterations>("iterations", "1", "maximum number of iterations of a search"),
  };
  static constexpr Type type = structure<T>("IdentificationSettings", "settings.", fields);
};

template <>
struct Described<FittedLogsReport::Chi> {
  using T = FittedLogsReport::Chi;
  static constexpr Field fields[] = {
      field<&T::value>("value", "1", "sum of the squares of the weighted residuals"),
      field<&T::numbers>("degrees_of_freedom", "1", "number of independent residuals"),
      field<&T::per_number>("per_degree_of_freedom", "1", "their ratio"),
      field<&T::bound>("bound", "1", "largest ratio that agrees"),
      field<&T::agrees>("agrees", "whether the ratio is within the bound"),
  };
  static constexpr Type type = structure<T>("FitChiSquare", "chi-square.", fields);
};

template <>
struct Described<FittedLogsReport::Parameter> {
  using T = FittedLogsReport::Parameter;
  static constexpr Field fields[] = {
      field<&T::name>("name", "name of the parameter"),
      field<&T::paths>("paths", "its places in the scenario"),
      field<&T::unit>("unit", "its unit; empty: it has several"),
      field<&T::from>("from", "as `unit`", "lower bound"),
      field<&T::to>("to", "as `unit`", "upper bound"),
      field<&T::start>("start", "as `unit`", "first estimate"),
      field<&T::is_logarithmic>("logarithmic", "whether the search is in the logarithm"),
      field<&T::prior_uncertainty>("prior_uncertainty", "as `unit`",
                                   "standard uncertainty of `start`; absent: no prior"),
      derived<[](const T& p) { return p.estimate.status; }>("status", "",
                                                            "identified; at_lower_bound, at_upper_bound: the best "
                                                            "value is a bound; from_prior: the logs do not improve the "
                                                            "prior; not_identifiable: the logs do not determine it, or "
                                                            "only in combination with others"),
      derived<[](const T& p) { return p.estimate.value; }>("value", "as `unit`",
                                                           "best value; without meaning if not_identifiable"),
      derived<[](const T& p) { return p.estimate.uncertainty; }>(
          "uncertainty", "as `unit`", "standard uncertainty; absent unless identified or from_prior"),
      derived<[](const T& p) { return p.estimate.interval; }>(
          "interval", "as `unit`", "95 % interval; absent without an uncertainty, or if the model disagrees"),
  };
  static constexpr Type type = structure<T>("IdentifiedParameter", "an identified parameter.", fields);
};

template <>
struct Described<FittedLogsReport::Weight> {
  using T = FittedLogsReport::Weight;
  static constexpr Field fields[] = {
      field<&T::parameter>("parameter", "name of the parameter"),
      field<&T::weight>("weight", "1", "component of a unit vector, in the range of the parameter"),
  };
  static constexpr Type type = structure<T>("CombinationWeight", "a part of a combination.", fields);
};

template <>
struct Described<FittedLogsReport::Direction> {
  using T = FittedLogsReport::Direction;
  static constexpr Field fields[] = {
      field<&T::singular_value>("singular_value", "1",
                                "of the derivatives by the parameters, scaled to their ranges; its inverse is the "
                                "standard uncertainty of the combination"),
      field<&T::is_identifiable>("identifiable", "whether the logs determine the combination"),
      field<&T::weights>("weights", "the combination"),
  };
  static constexpr Type type = structure<T>("Combination", "a combination of parameters.", fields);
};

template <>
struct Described<FittedLogsReport::Minimum> {
  using T = FittedLogsReport::Minimum;
  static constexpr Field fields[] = {
      field<&T::chi_square>("chi_square", "1", "sum of the squares of the weighted residuals"),
      field<&T::numbers>("numbers", "1", "number of independent residuals and priors in it"),
      field<&T::starts>("starts", "1", "number of searches that ended there"),
      field<&T::converged>("converged", "whether the search met its stop rule"),
      field<&T::values>("values", "as `unit`", "values in the order of `parameters`"),
  };
  static constexpr Type type = structure<T>("LocalMinimum", "the end of searches.", fields);
};

template <>
struct Described<FittedLogsReport::Clock> {
  using T = FittedLogsReport::Clock;
  static constexpr Field fields[] = {
      field<&T::offset>("offset", "s", "time of the run minus time of the log, at `reference`"),
      field<&T::offset_uncertainty>("offset_uncertainty", "s", "its standard uncertainty; absent: it is stated"),
      field<&T::drift>("drift", "1", "rate of the difference; absent: it is not fitted"),
      field<&T::drift_uncertainty>("drift_uncertainty", "1", "its standard uncertainty"),
      field<&T::reference>("reference", "s", "time of the log from which the drift counts"),
  };
  static constexpr Type type = structure<T>("FittedClock", "the clock of a log.", fields);
};

template <>
struct Described<BiasEstimate> {
  using T = BiasEstimate;
  static constexpr Field fields[] = {
      field<&T::quantity>("quantity", "name in the mapping"),
      field<&T::component>("component", "component of the quantity"),
      field<&T::unit>("unit", "its unit"),
      field<&T::value>("value", "as `unit`", "estimated bias of the measurements"),
      field<&T::uncertainty>("uncertainty", "as `unit`", "its standard uncertainty"),
  };
  static constexpr Type type = structure<T>("FittedBias", "an estimated bias.", fields);
};

template <>
struct Described<FittedLogsReport::LeftOut> {
  using T = FittedLogsReport::LeftOut;
  static constexpr Field fields[] = {
      field<&T::chi_square>("chi_square",
                            "of the log under the fit to the others, with the uncertainty of that fit; absent: not "
                            "computed"),
      field<&T::values>("values", "as `unit`", "values of that fit, in the order of `parameters`"),
      field<&T::reason>("reason", "reason without a value; else empty"),
  };
  static constexpr Type type = structure<T>("LeftOut", "cross-validation of a log.", fields);
};

template <>
struct Described<FittedLogsReport::Log> {
  using T = FittedLogsReport::Log;
  static constexpr Field fields[] = {
      field<&T::name>("name", "name of the log"),
      field<&T::file>("file", "its file, without its folder"),
      field<&T::sha256>("sha256", "SHA-256 of the file"),
      field<&T::scenario>("scenario", "name of the scenario"),
      field<&T::scenario_sha256>("scenario_sha256", "its SHA-256 with the starts of the parameters"),
      field<&T::folder>("folder", "folder of its comparison with the fitted run"),
      field<&T::verdict>("agrees", "verdict of that comparison"),
      field<&T::chi_square>("chi_square", "of the samples in the fit"),
      field<&T::clock>("clock", "its clock"),
      field<&T::biases>("biases", "estimated biases, of quantities with one"),
      field<&T::left_out>("left_out", "cross-validation; absent with a single log"),
  };
  static constexpr Type type = structure<T>("IdentifiedLog", "a log.", fields);
};

template <>
const Type& type_of<FittedLogsReport>() {
  using T = FittedLogsReport;
  static constexpr Field fields[] = {
      derived<[](const T&) { return IdentificationFormat::first; }>("schema", "", "format of this file"),
      field<&T::version>("version", "version of Grapnel"),
      field<&T::settings>("identification", "settings of the identification"),
      field<&T::verdict>("agrees", "whether the model with the best values is consistent with all logs"),
      field<&T::reason>("reason", "the values behind the verdict"),
      field<&T::converged>("converged", "whether the best search met its stop rule"),
      field<&T::chi_square>("chi_square", "of all logs and priors"),
      field<&T::parameters>("parameters", "in the order of the file"),
      field<&T::in_covariance>("covariance_parameters", "parameters with an uncertainty, in the order of the matrices"),
      field<&T::covariance>("covariance", "units of the parameters", "their covariance"),
      field<&T::correlation>("correlation", "1", "their correlation"),
      field<&T::combinations>("combinations",
                              "combinations of the parameters that are not at a bound, the best determined first"),
      field<&T::minima>("minima", "ends of the searches, the best first"),
      field<&T::failed_starts>("failed_starts", "1", "searches whose start could not be simulated"),
      field<&T::runs>("runs", "1", "number of simulations"),
      field<&T::failed_runs>("failed_runs", "1", "simulations that failed; their steps were rejected"),
      field<&T::logs>("logs", "in the order of the file"),
      field<&T::warnings>("warnings", "doubts about the result"),
      field<&T::text>("text", "text of the identification file"),
  };
  static constexpr Type type =
      structure<T>("FittedLogsReport", "parameters of a scenario identified from logs.", fields);
  return type;
}

FittedLogsReport identification_report(const Identification& identification, const LogFit& fit,
                                       const std::string& version) {
  const LogFitProblem& problem = identification.problem;
  FittedLogsReport report;
  report.version = version;
  report.settings = {identification.name, identification.sha256, problem.settings.starts, problem.settings.iterations,
                     problem.settings.seed};
  report.verdict = fit.agrees, report.reason = fit.reason, report.converged = fit.converged;
  report.chi_square = chi_of(fit.chi_square);
  for (std::size_t k = 0; k < problem.parameters.size(); ++k) {
    const FittedParameter& p = problem.parameters[k];
    report.parameters.push_back({p.name, p.unit, identification.paths[k], p.from, p.to, p.start, p.is_logarithmic,
                                 p.uncertainty, fit.parameters[k]});
  }
  set_matrices(identification, fit, report);
  for (const ParameterCombination& one : fit.combinations) {
    report.combinations.push_back({one.singular_value, one.is_identifiable, {}});
    for (std::size_t k = 0; k < one.direction.size(); ++k)
      report.combinations.back().weights.push_back({problem.parameters[k].name, one.direction[k]});
  }
  for (const LocalMinimum& one : fit.minima)
    report.minima.push_back({one.chi_square, one.numbers, one.starts, one.converged, one.values});
  report.failed_starts = fit.failed_starts, report.runs = fit.runs, report.failed_runs = fit.failed_runs;
  for (std::size_t i = 0; i < fit.logs.size(); ++i) report.logs.push_back(log_of(identification, fit, i));
  report.warnings = fit.warnings;
  report.text = identification.text;
  return report;
}

std::string identification_json(const FittedLogsReport& report) { return json_text(json_of(report)); }

std::string identification_text(const FittedLogsReport& report) {
  std::string text =
      fmt::format("{}: {} of {}, {}{}\n\n", printable_line(report.settings.name), counted(report.runs, "run"),
                  counted(report.settings.starts, "start"),
                  report.minima.size() == 1 ? "1 minimum" : fmt::format("{} minima", report.minima.size()),
                  report.failed_runs > 0 ? fmt::format("; {} failed", counted(report.failed_runs, "run")) : "");
  text += parameter_table(report) + "\n" + log_table(report);
  for (const FittedLogsReport::Direction& one : report.combinations) {
    if (!one.is_identifiable) text += "\n" + paragraph(combination_text(one), "");
  }
  for (std::size_t i = 0; i < report.correlation.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      if (std::abs(report.correlation[i][k]) > kShownCorrelation)
        text += fmt::format("\ncorrelation of {} and {}: {:.3f}\n", printable_line(report.in_covariance[k]),
                            printable_line(report.in_covariance[i]), report.correlation[i][k]);
    }
  }
  for (const FittedLogsReport::Log& log : report.logs) {
    for (const BiasEstimate& bias : log.biases)
      text += fmt::format("\nbias of {}{}{} in {}: {} {}, standard uncertainty {}\n", printable_line(bias.quantity),
                          bias.component.empty() ? "" : " ", printable_line(bias.component), printable_line(log.name),
                          small_number(bias.value), bias.unit, small_number(bias.uncertainty));
  }
  text += minima_text(report) + "\n";
  for (const std::string& warning : report.warnings) text += paragraph("warning: " + warning, "");
  text += paragraph(report.reason, "");
  return text + fmt::format("\nagrees: {}\n", verdict_word(report.verdict));
}

std::string identification_evaluations_csv(const Identification& identification, const LogFit& fit) {
  std::string csv = "start";
  for (const FittedParameter& p : identification.problem.parameters)
    csv += "," + csv_quoted(p.unit.empty() ? p.name : p.name + " [" + p.unit + "]");
  csv += ",chi_square,reason\n";
  for (const FitEvaluation& one : fit.evaluations) {
    csv += std::to_string(one.start);
    for (const double value : one.values) {
      csv += ",";
      append_csv_number(value, csv);
    }
    csv += ",";
    if (one.chi_square) append_csv_number(*one.chi_square, csv);
    csv += "," + csv_quoted(printable_line(one.reason)) + "\n";
  }
  return csv;
}

}  // namespace grapnel
