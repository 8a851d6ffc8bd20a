#pragma once

/// @file
/// Parameters of a simulation that explain logs of measurements: weighted least squares over the residuals of
/// comparisons, with the uncertainty, the identifiability and the consistency of the result. docs/theory/26 has the
/// equations. Plain data and one function, for any simulation.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "grapnel/compare/align_log.hpp"
#include "grapnel/compare/compare_log.hpp"

namespace grapnel {

/// A parameter between two bounds.
struct FittedParameter {
  std::string name;
  std::string unit;                   ///< empty: unknown
  double from = 0, to = 1;            ///< of the search
  double start = 0;                   ///< first estimate
  bool is_logarithmic = false;        ///< the search and the interval are in its logarithm
  std::optional<double> uncertainty;  ///< prior standard uncertainty about `start`
};

/// A log with the simulation of its experiment.
struct FittedLog {
  std::string name;
  /// The measured quantities with the course of a run with these values of the parameters. Called concurrently from
  /// several threads. A quantity whose bias is free has an infinite bias_uncertainty. @throws std::exception: there is
  /// no run; FitStopped
  std::function<std::vector<ComparedQuantity>(std::span<const double> values, const std::stop_token& stop)> simulate;
  ComparedTimes times;
  double offset = 0;                                  ///< run time minus log time [s]
  bool fits_offset = false;                           ///< `offset` is not used
  std::optional<std::array<double, 2>> offset_range;  ///< of the search [s]; empty: half of the shorter record overlaps
  double drift = 0;                                   ///< as in LogClock [1]
  bool fits_drift = false;                            ///< `drift` is not used
  double largest_drift = 5e-4;                        ///< largest magnitude of a fitted drift [1]
  std::optional<double> reference = {};               ///< as in LogClock [s]; empty: the middle of the log
};

struct FitSettings {
  std::size_t starts = 3;       ///< the first at the starts of the parameters, the others spread between their bounds
  std::uint64_t seed = 0;       ///< of the other starts
  std::size_t iterations = 50;  ///< at most, of each search
  bool cross_validate = true;   ///< with two logs or more
  double tolerance = 1e-9;      ///< relative accuracy of the simulations, for the steps of differences
};

struct LogFitProblem {
  std::vector<FittedParameter> parameters;
  std::vector<FittedLog> logs;
  FitSettings settings;
};

/// Thrown by simulations when a stop is requested; not a std::exception, so that it is not a failed run.
struct FitStopped {};

enum class ParameterStatus {
  identified,
  at_lower_bound,
  at_upper_bound,
  from_prior,       ///< the logs do not improve the prior
  not_identifiable  ///< the logs do not determine it, or only in combination with others
};

struct ParameterEstimate {
  double value = 0;
  ParameterStatus status = ParameterStatus::not_identifiable;
  std::optional<double> uncertainty;              ///< standard; of identified parameters and `from_prior`
  std::optional<std::array<double, 2>> interval;  ///< 95 %; only if the model agrees with the logs
};

/// A singular value of the scaled Jacobian with its direction, in the parameters scaled to their ranges.
struct ParameterCombination {
  double singular_value = 0;
  bool is_identifiable = false;
  std::vector<double> direction;  ///< unit, per parameter
};

struct BiasEstimate {
  std::string quantity, component, unit;
  double value = 0, uncertainty = 0;
};

/// Chi-square with its number of degrees of freedom and the largest value that agrees.
struct ChiSquare {
  double value = 0, numbers = 0, bound = 0;
  double per_number() const { return numbers > 0 ? value / numbers : 0; }
  bool agrees() const { return per_number() <= bound; }
};

struct LogEstimate {
  LogClock clock;
  std::optional<double> offset_uncertainty, drift_uncertainty;
  std::vector<BiasEstimate> biases;  ///< of quantities with a bias
  ChiSquare chi_square;
  std::optional<ChiSquare> left_out;  ///< of this log under the fit to the others
  std::string why_not_left_out;       ///< reason without a value, if it was asked for
  std::vector<double> left_out_values;
  LogComparison comparison;  ///< of compare, with the fitted clock, free biases removed
};

/// A result of the searches; those that ended at the same place are one.
struct LocalMinimum {
  std::vector<double> values;
  double chi_square = 0;
  double numbers = 0;      ///< independent residuals and priors in it; each search selects its own samples
  std::size_t starts = 0;  ///< that ended here
  bool converged = false;
};

/// A simulation of all logs.
struct FitEvaluation {
  std::size_t start = 0;
  std::vector<double> values;
  std::optional<double> chi_square;  ///< empty: a run failed
  double numbers = 0;                ///< independent residuals and priors in it
  std::string reason;                ///< why
};

struct LogFit {
  bool stopped = false;             ///< on request: only `evaluations` and `best` are set
  bool stopped_validating = false;  ///< on request after the fit: some logs have no `left_out`
  std::vector<double> best;
  std::string failure;  ///< no start could be simulated
  bool converged = false;
  Verdict agrees = Verdict::not_checked;
  std::string reason;
  ChiSquare chi_square;
  std::vector<ParameterEstimate> parameters;
  std::vector<std::size_t> in_covariance;          ///< parameters with an uncertainty
  Eigen::MatrixXd covariance;                      ///< of these
  std::vector<ParameterCombination> combinations;  ///< the best determined first
  std::vector<LocalMinimum> minima;                ///< the best first
  std::size_t failed_starts = 0;
  std::vector<LogEstimate> logs;
  std::vector<FitEvaluation> evaluations;
  std::size_t runs = 0, failed_runs = 0;
  std::vector<std::string> warnings;
};

struct FitOptions {
  int threads = 1;
  std::stop_token stop = {};
  /// Called from the calling thread with the number of the start, from 1, and its evaluations so far.
  std::function<void(std::size_t start, std::size_t evaluations)> progress = {};
};

/// Fits. The same bits for any number of threads. @throws std::invalid_argument if no quantity has an uncertainty
LogFit fit_logs(const LogFitProblem& problem, const FitOptions& options);

}  // namespace grapnel
