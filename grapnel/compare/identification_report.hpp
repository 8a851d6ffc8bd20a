#pragma once

/// @file
/// Results of an identification as text and files; docs/formats/identification.md is the contract of
/// identification.json.

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "grapnel/compare/identification.hpp"
#include "grapnel/describe/type.hpp"

namespace grapnel {

// Beside the report, whose members are optional: a nested structure is incomplete there.
struct FittedChi {
  double value = 0, numbers = 0, per_number = 0, bound = 0;
  bool agrees = false;
};
struct FittedLeftOut {
  std::optional<FittedChi> chi_square;
  std::vector<double> values;
  std::string reason;
};

struct FittedLogsReport {
  struct Settings {
    std::string name, sha256;
    std::size_t starts = 0, iterations = 0;
    std::uint64_t seed = 0;
  };
  using Chi = FittedChi;
  struct Parameter {
    std::string name, unit;
    std::vector<std::string> paths;
    double from = 0, to = 0, start = 0;
    bool is_logarithmic = false;
    std::optional<double> prior_uncertainty;
    ParameterEstimate estimate;
  };
  struct Weight {
    std::string parameter;
    double weight = 0;
  };
  struct Direction {
    double singular_value = 0;
    bool is_identifiable = false;
    std::vector<Weight> weights;
  };
  struct Minimum {
    double chi_square = 0, numbers = 0;
    std::size_t starts = 0;
    bool converged = false;
    std::vector<double> values;
  };
  struct Clock {
    double offset = 0;
    std::optional<double> offset_uncertainty, drift, drift_uncertainty;
    double reference = 0;
  };
  using LeftOut = FittedLeftOut;
  struct Log {
    std::string name, file, sha256, scenario, scenario_sha256, folder;
    Verdict verdict = Verdict::not_checked;
    Chi chi_square;
    Clock clock;
    std::vector<BiasEstimate> biases;
    std::optional<LeftOut> left_out;
  };
  std::string version;
  Settings settings;
  Verdict verdict = Verdict::not_checked;
  std::string reason;
  bool converged = false;
  Chi chi_square;
  std::vector<Parameter> parameters;
  std::vector<std::string> in_covariance;
  std::vector<std::vector<double>> covariance, correlation;
  std::vector<Direction> combinations;
  std::vector<Minimum> minima;
  std::size_t failed_starts = 0, runs = 0, failed_runs = 0;
  std::vector<Log> logs;
  std::vector<std::string> warnings;
  std::string text;
};
template <>
const Type& type_of<FittedLogsReport>();

FittedLogsReport identification_report(const Identification& identification, const LogFit& fit,
                                       const std::string& version);

/// identification.json
std::string identification_json(const FittedLogsReport& report);
/// The tables of the terminal.
std::string identification_text(const FittedLogsReport& report);
/// evaluations.csv: one line per evaluation.
std::string identification_evaluations_csv(const Identification& identification, const LogFit& fit);

}  // namespace grapnel
