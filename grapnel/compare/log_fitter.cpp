#include "grapnel/compare/log_fitter.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <tuple>

#include "grapnel/campaign/case_pool.hpp"
#include "grapnel/text/error_text.hpp"

namespace grapnel {
namespace {

constexpr double kMostCurvature = 0.1;  // second difference per first difference
constexpr double kLeastStep = 1e-9;     // of differences, relative to the range
constexpr std::size_t kShrinkings = 3;  // of a step
constexpr std::size_t kRounds = 4;      // of selection
constexpr double kFar = 1e300;
constexpr double kClearlyBetter = 1;  // chi-square

}  // namespace

LogFitter::LogFitter(const LogFitProblem& problem, std::vector<std::size_t> logs, const FitOptions& options)
    : problem_(problem), logs_(std::move(logs)), options_(options) {
  size_ = static_cast<Eigen::Index>(problem.parameters.size());
  for (const std::size_t log : logs_) {
    const Eigen::Index offset = problem.logs[log].fits_offset ? size_++ : -1;
    clock_variables_.push_back({offset, problem.logs[log].fits_drift ? size_++ : -1});
  }
  middles_.assign(logs_.size(), 0.0);
}

// ---- Variables ----

std::vector<double> LogFitter::values_of(const Eigen::VectorXd& x) const {
  std::vector<double> values;
  for (std::size_t k = 0; k < parameters(); ++k) {
    const FittedParameter& p = problem_.parameters[k];
    const double u = x[static_cast<Eigen::Index>(k)];
    const double value = p.is_logarithmic ? p.from * std::pow(p.to / p.from, u) : p.from + u * (p.to - p.from);
    values.push_back(u <= 0 ? p.from : u >= 1 ? p.to : value);
  }
  return values;
}

Eigen::VectorXd LogFitter::scaled(const std::vector<double>& values) const {
  Eigen::VectorXd x = Eigen::VectorXd::Zero(size_);
  for (std::size_t k = 0; k < parameters(); ++k) {
    const FittedParameter& p = problem_.parameters[k];
    const double u = p.is_logarithmic ? std::log(values[k] / p.from) / std::log(p.to / p.from)
                                      : (values[k] - p.from) / (p.to - p.from);
    x[static_cast<Eigen::Index>(k)] = std::clamp(u, 0.0, 1.0);
  }
  return x;
}

double LogFitter::slope_of(std::size_t parameter, double x) const {
  const FittedParameter& p = problem_.parameters[parameter];
  return p.is_logarithmic ? p.from * std::pow(p.to / p.from, x) * std::log(p.to / p.from) : p.to - p.from;
}

std::pair<Eigen::Index, Eigen::Index> LogFitter::clock_variables(std::size_t log) const {
  for (std::size_t i = 0; i < logs_.size(); ++i) {
    if (logs_[i] == log) return clock_variables_[i];
  }
  return {-1, -1};
}

std::vector<LogClock> LogFitter::clocks_of(const Eigen::VectorXd& x) const {
  std::vector<LogClock> clocks;
  for (std::size_t i = 0; i < logs_.size(); ++i) {
    const auto [offset, drift] = clock_variables_[i];
    clocks.push_back({offset < 0 ? problem_.logs[logs_[i]].offset : x[offset],
                      drift < 0 ? problem_.logs[logs_[i]].drift : x[drift], middles_[i]});
  }
  return clocks;
}

void LogFitter::set_clocks(const std::vector<LogClock>& clocks, Eigen::VectorXd& x) const {
  for (std::size_t i = 0; i < logs_.size(); ++i) {
    const auto [offset, drift] = clock_variables_[i];
    if (offset >= 0) x[offset] = clocks[i].offset;
    if (drift >= 0) x[drift] = clocks[i].drift;
  }
}

std::size_t LogFitter::priors() const {
  return static_cast<std::size_t>(std::count_if(problem_.parameters.begin(), problem_.parameters.end(),
                                                [](const FittedParameter& p) { return p.uncertainty.has_value(); }));
}

void LogFitter::set_selection(std::vector<Selection> selections, std::vector<double> middles) {
  selections_ = std::move(selections), middles_ = std::move(middles);
  steps_.resize(0);
}

// ---- Runs ----

// In parallel over points and logs.
void LogFitter::run_all(const std::vector<Eigen::VectorXd>& points, const TakeRun& take) {
  std::vector<std::vector<double>> values;
  for (const Eigen::VectorXd& x : points) values.push_back(values_of(x));
  std::vector<std::string> failures(points.size() * logs_.size());
  PoolOptions pool{.threads = options_.threads, .stop = options_.stop};
  std::mutex mutex;
  bool stopped = false;
  run_jobs(failures.size(), pool, {}, [&](std::size_t job, const RowSink&, const std::stop_token& stop) {
    const std::size_t point = job / logs_.size(), log = job % logs_.size();
    std::shared_ptr<const Quantities> simulated;
    try {
      simulated = std::make_shared<const Quantities>(problem_.logs[logs_[log]].simulate(values[point], stop));
    } catch (const FitStopped&) {
      const std::lock_guard lock(mutex);
      stopped = true;
    } catch (const std::exception& error) {
      failures[job] = error_text(error);
    }
    if (simulated) take(point, log, std::move(simulated));
  });
  if (stopped || options_.stop.stop_requested()) throw FitStopped{};
  runs += failures.size();
  for (const std::string& failure : failures) {
    if (failure.empty()) continue;
    ++failed_runs;
    failure_ = failure;
  }
}

RunsOfLogs LogFitter::run(const Eigen::VectorXd& x) {
  std::vector<double> values = values_of(x);
  if (run_.empty() || values != run_values_) {
    RunsOfLogs now(logs_.size());
    run_all({x}, [&](std::size_t, std::size_t log, std::shared_ptr<const Quantities> one) { now[log] = one; });
    run_ = std::move(now);
    run_values_ = std::move(values);
  }
  return run_;
}

std::optional<StackedResiduals> LogFitter::stacked(const RunsOfLogs& runs_of_logs, const Eigen::VectorXd& x) const {
  const std::vector<LogClock> clocks = clocks_of(x);
  PartsOfLogs parts(logs_.size());
  for (std::size_t i = 0; i < logs_.size(); ++i) {
    if (runs_of_logs[i]) parts[i] = white_residuals(*runs_of_logs[i], clocks[i], selections_[i]);
  }
  return stacked(parts, x);
}

std::optional<StackedResiduals> LogFitter::stacked(const PartsOfLogs& parts, const Eigen::VectorXd& x) const {
  Eigen::Index white = 0, means = 0;
  for (const std::optional<WhiteResiduals>& one : parts) {
    if (!one) return std::nullopt;
    white += one->white.size(), means += one->means.size();
  }
  StackedResiduals all{Eigen::VectorXd(white + static_cast<Eigen::Index>(priors())), Eigen::VectorXd(means)};
  white = means = 0;
  for (const std::optional<WhiteResiduals>& one : parts) {
    all.white.segment(white, one->white.size()) = one->white, white += one->white.size();
    all.means.segment(means, one->means.size()) = one->means, means += one->means.size();
  }
  const std::vector<double> values = values_of(x);
  for (std::size_t k = 0; k < parameters(); ++k) {
    const FittedParameter& p = problem_.parameters[k];
    if (p.uncertainty) all.white[white++] = (values[k] - p.start) / *p.uncertainty;
  }
  return all;
}

std::optional<StackedResiduals> LogFitter::residuals(const Eigen::VectorXd& x) { return stacked(run(x), x); }

// ---- Derivatives ----

// Truncation and the accuracy of the simulations balance at the cube root of the accuracy.
Eigen::VectorXd LogFitter::first_steps(const Eigen::VectorXd& x) const {
  Eigen::VectorXd steps(static_cast<Eigen::Index>(parameters()));
  const std::vector<double> values = values_of(x);
  for (std::size_t k = 0; k < parameters(); ++k) {
    const FittedParameter& p = problem_.parameters[k];
    const double size = p.is_logarithmic ? 1 / std::log(p.to / p.from) : std::abs(values[k]) / (p.to - p.from);
    steps[static_cast<Eigen::Index>(k)] = std::cbrt(problem_.settings.tolerance) * std::clamp(size, 0.01, 1.0);
  }
  return steps;
}

// Central differences, with unequal steps beside a bound; at a bound one-sided ones.
std::optional<Derivatives> LogFitter::differences(const Eigen::VectorXd& x, const Eigen::VectorXd& steps,
                                                  const StackedResiduals& here, std::vector<Difference>& formed) {
  std::vector<Eigen::VectorXd> points;
  for (Eigen::Index k = 0; k < steps.size(); ++k) {
    for (const double sign : {-1.0, 1.0}) {
      points.push_back(x);
      points.back()[k] = std::clamp(x[k] + sign * steps[k], 0.0, 1.0);
    }
  }
  // Only the residuals of the runs remain.
  const std::vector<LogClock> clocks = clocks_of(x);
  std::vector<PartsOfLogs> all(points.size(), PartsOfLogs(logs_.size()));
  run_all(points, [&](std::size_t point, std::size_t log, std::shared_ptr<const Quantities> one) {
    all[point][log] = white_residuals(*one, clocks[log], selections_[log]);
  });
  Derivatives d{Eigen::MatrixXd::Zero(here.white.size(), size_), Eigen::MatrixXd::Zero(here.means.size(), size_), {}};
  formed.assign(static_cast<std::size_t>(steps.size()), {});
  bool complete = true;
  for (Eigen::Index k = 0; k < steps.size(); ++k) {
    const std::size_t low = 2 * static_cast<std::size_t>(k), high = low + 1;
    const auto before = stacked(all[low], points[low]), after = stacked(all[high], points[high]);
    Difference& one = formed[static_cast<std::size_t>(k)];
    if (!before || !after) one.curvature = std::numeric_limits<double>::infinity();
    const double back = before ? x[k] - points[low][k] : 0, ahead = after ? points[high][k] - x[k] : 0;
    if (!(back + ahead > 0)) {
      complete = false;
      continue;
    }
    one.is_central = back > 0 && ahead > 0;
    one.truncation = one.is_central ? back * ahead : back + ahead;
    const StackedResiduals &a = back > 0 ? *before : here, &b = ahead > 0 ? *after : here;
    if (!one.is_central) {
      d.white.col(k) = (b.white - a.white) / (back + ahead), d.means.col(k) = (b.means - a.means) / (back + ahead);
      continue;
    }
    // The derivative of the parabola through the three points.
    const auto slope = [&](const Eigen::VectorXd& from, const Eigen::VectorXd& middle, const Eigen::VectorXd& to) {
      return Eigen::VectorXd(((back / ahead) * (to - middle) + (ahead / back) * (middle - from)) / (back + ahead));
    };
    d.white.col(k) = slope(a.white, here.white, b.white), d.means.col(k) = slope(a.means, here.means, b.means);
    const double first = (b.white - a.white).norm();
    const Eigen::VectorXd bend = (b.white - here.white) / ahead - (here.white - a.white) / back;
    if (first > 0) one.curvature = bend.norm() * (back + ahead) / 2 / first;
  }
  if (!complete) return std::nullopt;
  return d;
}

void LogFitter::add_clock_columns(const RunsOfLogs& runs_of_logs, const Eigen::VectorXd& x, Derivatives& d) const {
  const std::vector<LogClock> clocks = clocks_of(x);
  Eigen::Index white = 0, means = 0;
  for (std::size_t i = 0; i < logs_.size(); ++i) {
    WhiteResiduals one;
    for (const bool by_drift : {false, true}) {
      const Eigen::Index column = by_drift ? clock_variables_[i].second : clock_variables_[i].first;
      if (column < 0 && by_drift && one.white.size() > 0) continue;
      one = clock_derivative(*runs_of_logs[i], clocks[i], selections_[i], by_drift);
      if (column < 0) continue;
      d.white.col(column).segment(white, one.white.size()) = one.white;
      d.means.col(column).segment(means, one.means.size()) = one.means;
    }
    white += one.white.size(), means += one.means.size();
  }
}

std::optional<Derivatives> LogFitter::derivatives(const Eigen::VectorXd& x, bool refined) {
  const RunsOfLogs runs_here = run(x);
  const auto here = stacked(runs_here, x);
  if (!here) return std::nullopt;
  if (steps_.size() == 0) steps_ = first_steps(x);
  std::optional<Derivatives> d;
  std::vector<Difference> formed;
  for (std::size_t shrinking = 0; shrinking <= kShrinkings; ++shrinking) {
    d = differences(x, steps_, *here, formed);
    bool is_smooth = true;
    for (Eigen::Index k = 0; k < steps_.size() && shrinking < kShrinkings; ++k) {
      if (!(formed[static_cast<std::size_t>(k)].curvature > kMostCurvature) || steps_[k] / 4 < kLeastStep) continue;
      steps_[k] /= 4;
      is_smooth = false;
    }
    if (is_smooth) break;
  }
  if (!d) return std::nullopt;
  if (refined) {
    std::vector<Difference> finer;
    const auto half = differences(x, steps_ / 2, *here, finer);
    if (!half) return std::nullopt;
    const Eigen::Index n = steps_.size();
    d->error = (half->white - d->white).leftCols(n);
    for (Eigen::Index k = 0; k < n; ++k) {
      // Richardson: the errors are in the ratio of the truncations.
      const Difference &one = formed[static_cast<std::size_t>(k)], &fine = finer[static_cast<std::size_t>(k)];
      const double ratio = one.is_central == fine.is_central ? one.truncation / fine.truncation : 1;
      const double factor = ratio > 1 ? ratio / (ratio - 1) : 1;
      d->means.col(k) += factor * (half->means.col(k) - d->means.col(k));
      d->white.col(k) += factor * d->error.col(k);
    }
  }
  add_clock_columns(runs_here, x, *d);
  return d;
}

// ---- Searches ----

bool LogFitter::select(const RunsOfLogs& runs_of_logs, const std::vector<LogClock>& clocks) {
  selections_.clear();
  numbers_ = 0;
  for (std::size_t i = 0; i < logs_.size(); ++i) {
    selections_.push_back(selected_samples(problem_.logs[logs_[i]], *runs_of_logs[i], clocks[i]));
    numbers_ += independent_numbers(*runs_of_logs[i], selections_.back());
  }
  const bool has_samples = numbers_ > 0;
  numbers_ += static_cast<double>(priors());
  return has_samples;
}

void LogFitter::record(std::size_t number, const Eigen::VectorXd& x, const std::optional<double>& cost) {
  evaluations.push_back({number, values_of(x), cost, cost ? numbers_ : 0, cost ? std::string() : failure_});
  if (options_.progress) options_.progress(number, evaluations.size());
}

std::pair<Eigen::VectorXd, Eigen::VectorXd> LogFitter::bounds() const {
  Eigen::VectorXd lower = Eigen::VectorXd::Constant(size_, -kFar), upper = Eigen::VectorXd::Constant(size_, kFar);
  lower.head(static_cast<Eigen::Index>(parameters())).setZero();
  upper.head(static_cast<Eigen::Index>(parameters())).setOnes();
  for (std::size_t i = 0; i < logs_.size(); ++i) {
    const auto& range = problem_.logs[logs_[i]].offset_range;
    const auto [offset, drift] = clock_variables_[i];
    if (range && offset >= 0) lower[offset] = (*range)[0], upper[offset] = (*range)[1];
    if (drift >= 0) upper[drift] = problem_.logs[logs_[i]].largest_drift, lower[drift] = -upper[drift];
  }
  return {lower, upper};
}

LeastSquares LogFitter::problem_of(std::size_t number) {
  LeastSquares squares;
  std::tie(squares.lower, squares.upper) = bounds();
  for (const auto& [offset, drift] : clock_variables_) {
    if (drift >= 0 && drifts_are_held_) squares.lower[drift] = squares.upper[drift] = 0;
  }
  squares.residuals = [this, number](const Eigen::VectorXd& x) -> std::optional<Eigen::VectorXd> {
    const bool is_new = values_of(x) != run_values_;
    failure_ = "a sample that the fit uses has no simulated value";
    auto all = residuals(x);
    if (is_new || !all) record(number, x, all ? std::optional(all->white.squaredNorm()) : std::nullopt);
    if (!all) return std::nullopt;
    return std::move(all->white);
  };
  squares.jacobian = [this](const Eigen::VectorXd& x) -> std::optional<Eigen::MatrixXd> {
    auto d = derivatives(x, false);
    if (!d) return std::nullopt;
    return std::move(d->white);
  };
  return squares;
}

// Offsets that fit clearly better with the present parameters, as another period of a motion does.
bool LogFitter::find_other_clocks(const RunsOfLogs& runs_of_logs, Solution& solution) {
  std::vector<LogClock> clocks = clocks_of(solution.x);
  bool found = false;
  for (std::size_t i = 0; i < logs_.size(); ++i) {
    const FittedLog& log = problem_.logs[logs_[i]];
    if (!log.fits_offset) continue;
    const LogClock other = first_clock(log, *runs_of_logs[i], clocks[i].drift);
    const auto now = white_residuals(*runs_of_logs[i], clocks[i], selections_[i]);
    const auto then = white_residuals(*runs_of_logs[i], other, selections_[i]);
    if (!now || !then || !(then->white.squaredNorm() < now->white.squaredNorm() - kClearlyBetter)) continue;
    clocks[i] = other;
    found = true;
  }
  set_clocks(clocks, solution.x);
  return found;
}

std::optional<LogFitter::Solution> LogFitter::search(const Eigen::VectorXd& start, std::size_t number) {
  steps_.resize(0);
  Solution solution{start, 0, false, 0};
  RunsOfLogs now = run(solution.x);
  if (std::any_of(now.begin(), now.end(), [](const auto& one) { return !one; })) {
    record(number, start, std::nullopt);
    return std::nullopt;
  }
  std::vector<LogClock> clocks;
  for (std::size_t i = 0; i < logs_.size(); ++i) {
    const FittedLog& log = problem_.logs[logs_[i]];
    clocks.push_back(first_clock(log, *now[i], log.fits_drift ? 0 : log.drift));
    middles_[i] = clocks[i].reference;
  }
  set_clocks(clocks, solution.x);
  const bool has_drift = std::any_of(clock_variables_.begin(), clock_variables_.end(),
                                     [](const auto& variables) { return variables.second >= 0; });
  for (std::size_t round = 0; round < kRounds; ++round) {
    if (!select(now, clocks_of(solution.x))) {
      failure_ = "the run and the logs have no common samples";
      record(number, start, std::nullopt);
      return std::nullopt;
    }
    if (round == 0) {
      const auto first = stacked(now, solution.x);
      record(number, start, first ? std::optional(first->white.squaredNorm()) : std::nullopt);
    }
    drifts_are_held_ = round == 0;
    const auto result = minimize_squares(problem_of(number), solution.x, problem_.settings.iterations);
    drifts_are_held_ = false;
    if (!result) return std::nullopt;
    solution = {result->x, result->cost, result->converged, numbers_};
    now = run(solution.x);
    const std::vector<Selection> before = selections_;
    const bool is_other = round == 0 && find_other_clocks(now, solution);
    select(now, clocks_of(solution.x));
    const bool was_held = round == 0 && has_drift;
    if (!is_other && !was_held && selections_ == before) break;
    if (round + 1 == kRounds) selections_ = before;
  }
  return solution;
}

std::optional<LogFitter::Solution> LogFitter::search_selected(const Eigen::VectorXd& x,
                                                              std::vector<Selection> selections) {
  steps_.resize(0);
  selections_ = std::move(selections);
  const auto result = minimize_squares(problem_of(0), x, problem_.settings.iterations);
  if (!result) return std::nullopt;
  return Solution{result->x, result->cost, result->converged, numbers_};
}

std::optional<LogFitter::Solution> LogFitter::fit_clocks(const Eigen::VectorXd& x) {
  LeastSquares squares = problem_of(0);
  const auto n = static_cast<Eigen::Index>(parameters());
  squares.lower.head(n) = squares.upper.head(n) = x.head(n);
  const RunsOfLogs runs_here = run(x);
  squares.residuals = [&](const Eigen::VectorXd& at) -> std::optional<Eigen::VectorXd> {
    auto all = stacked(runs_here, at);
    if (!all) return std::nullopt;
    return std::move(all->white);
  };
  squares.jacobian = [&](const Eigen::VectorXd& at) -> std::optional<Eigen::MatrixXd> {
    const auto here = stacked(runs_here, at);
    if (!here) return std::nullopt;
    Derivatives d{
        Eigen::MatrixXd::Zero(here->white.size(), size_), Eigen::MatrixXd::Zero(here->means.size(), size_), {}};
    add_clock_columns(runs_here, at, d);
    return std::move(d.white);
  };
  const auto result = minimize_squares(squares, x, problem_.settings.iterations);
  if (!result) return std::nullopt;
  return Solution{result->x, result->cost, result->converged, numbers_};
}

}  // namespace grapnel
