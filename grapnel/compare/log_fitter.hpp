#pragma once

/// @file
/// The searches of a fit, and the derivatives that its statistics need.

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "grapnel/compare/least_squares.hpp"
#include "grapnel/compare/log_fit.hpp"
#include "grapnel/compare/log_residuals.hpp"

namespace grapnel {

/// The runs of some logs with the same values of the parameters; null: the run failed.
using RunsOfLogs = std::vector<std::shared_ptr<const Quantities>>;

/// Residuals and means of some logs, one log after the other, then the priors.
struct StackedResiduals {
  Eigen::VectorXd white, means;
};

/// Derivatives by the parameters, scaled to their ranges, and by the clocks of the logs. `error`: estimated error of
/// the columns of the parameters.
struct Derivatives {
  Eigen::MatrixXd white, means, error;
};

/// A fit to some of the logs. Variables x: the parameters, scaled to 0 ... 1 between their bounds, then offset and
/// drift of each log where they are fitted.
class LogFitter {
 public:
  /// `logs`: indices in the problem.
  LogFitter(const LogFitProblem& problem, std::vector<std::size_t> logs, const FitOptions& options);

  // ---- Variables ----

  std::size_t parameters() const { return problem_.parameters.size(); }
  const std::vector<std::size_t>& logs() const { return logs_; }
  std::vector<double> values_of(const Eigen::VectorXd& x) const;
  Eigen::VectorXd scaled(const std::vector<double>& values) const;
  /// d value / d x of a parameter.
  double slope_of(std::size_t parameter, double x) const;
  std::vector<LogClock> clocks_of(const Eigen::VectorXd& x) const;
  /// The indices of a log's clock in x; the first is -1 without an offset, the second without a drift.
  std::pair<Eigen::Index, Eigen::Index> clock_variables(std::size_t log) const;
  std::size_t priors() const;
  /// Lower and upper bounds of x.
  std::pair<Eigen::VectorXd, Eigen::VectorXd> bounds() const;

  // ---- Searches ----

  struct Solution {
    Eigen::VectorXd x;
    double cost = 0;
    bool converged = false;
    double numbers = 0;  // independent residuals and priors in the cost
  };
  /// Searches from scaled parameters: the samples are selected and the clocks found, then the sum of squares is
  /// minimized, until the selection remains. Empty: the start cannot be simulated, or not with the selection, or no
  /// sample is selected.
  std::optional<Solution> search(const Eigen::VectorXd& start, std::size_t number);
  /// The same with given samples and clocks.
  std::optional<Solution> search_selected(const Eigen::VectorXd& x, std::vector<Selection> selections);
  /// The clocks that fit best with fixed parameters. Empty: not to be simulated.
  std::optional<Solution> fit_clocks(const Eigen::VectorXd& x);

  // ---- At a point ----

  RunsOfLogs run(const Eigen::VectorXd& x);
  std::optional<StackedResiduals> residuals(const Eigen::VectorXd& x);
  /// By central differences; with `refined` of two step sizes, whose difference estimates the error.
  std::optional<Derivatives> derivatives(const Eigen::VectorXd& x, bool refined);

  const std::vector<Selection>& selections() const { return selections_; }
  const std::vector<double>& middles() const { return middles_; }
  void set_selection(std::vector<Selection> selections, std::vector<double> middles);
  const std::string& last_failure() const { return failure_; }

  std::vector<FitEvaluation> evaluations;
  std::size_t runs = 0, failed_runs = 0;

 private:
  using TakeRun = std::function<void(std::size_t point, std::size_t log, std::shared_ptr<const Quantities> run)>;
  // Calls `take` concurrently.
  void run_all(const std::vector<Eigen::VectorXd>& points, const TakeRun& take);
  using PartsOfLogs = std::vector<std::optional<WhiteResiduals>>;
  std::optional<StackedResiduals> stacked(const PartsOfLogs& parts, const Eigen::VectorXd& x) const;
  std::optional<StackedResiduals> stacked(const RunsOfLogs& runs, const Eigen::VectorXd& x) const;
  // Returns whether there is any sample.
  bool select(const RunsOfLogs& runs, const std::vector<LogClock>& clocks);
  void set_clocks(const std::vector<LogClock>& clocks, Eigen::VectorXd& x) const;
  bool find_other_clocks(const RunsOfLogs& runs, Solution& solution);
  LeastSquares problem_of(std::size_t number);
  Eigen::VectorXd first_steps(const Eigen::VectorXd& x) const;
  // How a difference of a parameter was formed.
  struct Difference {
    double curvature = 0;  // second difference per first one; infinite if a run failed
    bool is_central = false;
    double truncation = 0;  // of the derivative, up to a factor that is the same for all steps
  };
  std::optional<Derivatives> differences(const Eigen::VectorXd& x, const Eigen::VectorXd& steps,
                                         const StackedResiduals& here, std::vector<Difference>& formed);
  void add_clock_columns(const RunsOfLogs& runs, const Eigen::VectorXd& x, Derivatives& d) const;
  void record(std::size_t number, const Eigen::VectorXd& x, const std::optional<double>& cost);

  const LogFitProblem& problem_;
  std::vector<std::size_t> logs_;
  const FitOptions& options_;
  std::vector<std::pair<Eigen::Index, Eigen::Index>> clock_variables_;  // per position in logs_
  Eigen::Index size_ = 0;                                               // of x
  std::vector<Selection> selections_;
  double numbers_ = 0;  // of the selection and the priors
  std::vector<double> middles_;
  Eigen::VectorXd steps_;         // of differences; they shrink where the residuals curve
  bool drifts_are_held_ = false;  // in the first search, which finds the offsets
  std::string failure_;
  // The latest runs.
  std::vector<double> run_values_;
  RunsOfLogs run_;
};

/// The statistics at a solution: fills everything but `minima` and the counts.
void evaluate_fit(const LogFitProblem& problem, LogFitter& fitter, const Eigen::VectorXd& x, bool converged,
                  LogFit& fit);
/// Fits all logs but one, for each, and compares the one left out.
void cross_validate(const LogFitProblem& problem, const FitOptions& options, LogFitter& fitter,
                    const Eigen::VectorXd& x, LogFit& fit);

}  // namespace grapnel
