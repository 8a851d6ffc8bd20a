#include "grapnel/fit/log_fit.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "grapnel/campaign/filling_sample.hpp"
#include "grapnel/fit/log_fitter.hpp"

namespace grapnel {
namespace {

constexpr double kSamePlace = 0.01;  // of the ranges
constexpr double kSameCost = 0.01;   // of chi-square, relative above 1

using Solution = LogFitter::Solution;

Eigen::VectorXd start_of(const LogFitProblem& problem, const LogFitter& fitter, std::size_t number) {
  std::vector<double> values;
  for (const FittedParameter& p : problem.parameters) values.push_back(p.start);
  Eigen::VectorXd x = fitter.scaled(values);
  const FillingSample sample(problem.parameters.size(), problem.settings.seed);
  for (std::size_t k = 0; k < problem.parameters.size() && number > 0; ++k)
    x[static_cast<Eigen::Index>(k)] = sample.at(number, k);
  return x;
}

bool are_same(const Solution& a, const Solution& b, Eigen::Index parameters) {
  return std::abs(a.cost - b.cost) <= kSameCost * std::max(std::min(a.cost, b.cost), 1.0) &&
         (a.x - b.x).head(parameters).cwiseAbs().maxCoeff() <= kSamePlace;
}

// The solutions without those that equal a better one.
void set_minima(const LogFitter& fitter, std::vector<Solution> solutions, LogFit& fit) {
  std::stable_sort(solutions.begin(), solutions.end(),
                   [](const Solution& a, const Solution& b) { return a.cost < b.cost; });
  std::vector<Solution> distinct;
  for (const Solution& one : solutions) {
    const auto same = std::find_if(distinct.begin(), distinct.end(), [&](const Solution& other) {
      return are_same(one, other, static_cast<Eigen::Index>(fitter.parameters()));
    });
    if (same != distinct.end()) {
      ++fit.minima[static_cast<std::size_t>(same - distinct.begin())].starts;
      continue;
    }
    distinct.push_back(one);
    fit.minima.push_back({fitter.values_of(one.x), one.cost, 1, one.converged});
  }
}

void set_best_evaluation(LogFit& fit) {
  const FitEvaluation* best = nullptr;
  for (const FitEvaluation& one : fit.evaluations) {
    if (one.chi_square && (!best || *one.chi_square < *best->chi_square)) best = &one;
  }
  if (best) fit.best = best->values;
}

// A search from each start; the selection of the best one remains in `best`.
struct Searched {
  std::optional<Solution> solution;
  std::vector<Selection> selections;
  std::vector<double> middles;
};

Searched search_all(const LogFitProblem& problem, LogFitter& fitter, LogFit& fit) {
  Searched best;
  std::vector<Solution> solutions;
  for (std::size_t start = 0; start < problem.settings.starts; ++start) {
    const auto solution = fitter.search(start_of(problem, fitter, start), start + 1);
    if (!solution) {
      ++fit.failed_starts;
      continue;
    }
    solutions.push_back(*solution);
    if (best.solution && !(solution->cost < best.solution->cost)) continue;
    best = {solution, fitter.selections(), fitter.middles()};
  }
  set_minima(fitter, std::move(solutions), fit);
  return best;
}

}  // namespace

LogFit fit_logs(const LogFitProblem& problem, const FitOptions& options) {
  LogFit fit;
  std::vector<std::size_t> logs(problem.logs.size());
  std::iota(logs.begin(), logs.end(), 0u);
  LogFitter fitter(problem, logs, options);
  const auto count = [&] {
    fit.evaluations = fitter.evaluations;
    fit.runs += fitter.runs, fit.failed_runs += fitter.failed_runs;
  };
  try {
    const Searched best = search_all(problem, fitter, fit);
    if (!best.solution) {
      fit.failure = fitter.last_failure();
      count();
      return fit;
    }
    fitter.set_selection(best.selections, best.middles);
    evaluate_fit(problem, fitter, best.solution->x, best.solution->converged, fit);
    if (problem.settings.cross_validate && problem.logs.size() > 1)
      cross_validate(problem, options, fitter, best.solution->x, fit);
    count();
  } catch (const FitStopped&) {
    fit.stopped = true;
    count();
    set_best_evaluation(fit);
  }
  return fit;
}

}  // namespace grapnel
