#include "grapnel/compare/log_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>

#include "grapnel/campaign/filling_sample.hpp"
#include "grapnel/compare/log_fitter.hpp"

namespace grapnel {
namespace {

constexpr double kSamePlace = 0.01;  // of the ranges
constexpr double kSameCost = 0.01;   // of chi-square, relative above 1
constexpr double kLacking = 2;       // chi-square of a number that a solution lacks, in those of the best
constexpr double kComparable = 0.5;  // of the largest count of numbers, for that best

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

// Sums of squares over different selections of samples, as if over equally many numbers (docs/theory/26, Search):
// without this, the best fit would be that of the fewest samples.
class Ranking {
 public:
  struct Sum {
    double cost = 0, numbers = 0;
  };
  explicit Ranking(const std::vector<Sum>& sums) {
    for (const Sum& one : sums) most_ = std::max(most_, one.numbers);
    for (const Sum& one : sums) {
      if (one.numbers > 0 && one.numbers >= kComparable * most_) rate_ = std::min(rate_, one.cost / one.numbers);
    }
  }
  double rank(double cost, double numbers) const {
    return numbers < most_ ? cost + kLacking * std::max(rate_, 1.0) * (most_ - numbers) : cost;
  }

 private:
  double most_ = 0, rate_ = std::numeric_limits<double>::infinity();
};

struct Ranked {
  Solution solution;
  double rank = 0;
};

bool are_same(const Ranked& a, const Ranked& b, Eigen::Index parameters) {
  return std::abs(a.rank - b.rank) <= kSameCost * std::max(std::min(a.rank, b.rank), 1.0) &&
         (a.solution.x - b.solution.x).head(parameters).cwiseAbs().maxCoeff() <= kSamePlace;
}

// The solutions without those that equal a better one.
void set_minima(const LogFitter& fitter, std::vector<Ranked> solutions, LogFit& fit) {
  std::stable_sort(solutions.begin(), solutions.end(),
                   [](const Ranked& a, const Ranked& b) { return a.rank < b.rank; });
  std::vector<Ranked> distinct;
  for (const Ranked& one : solutions) {
    const auto same = std::find_if(distinct.begin(), distinct.end(), [&](const Ranked& other) {
      return are_same(one, other, static_cast<Eigen::Index>(fitter.parameters()));
    });
    if (same != distinct.end()) {
      ++fit.minima[static_cast<std::size_t>(same - distinct.begin())].starts;
      continue;
    }
    distinct.push_back(one);
    const Solution& s = one.solution;
    fit.minima.push_back({fitter.values_of(s.x), s.cost, s.numbers, 1, s.converged});
  }
}

void set_best_evaluation(LogFit& fit) {
  std::vector<Ranking::Sum> sums;
  for (const FitEvaluation& one : fit.evaluations) {
    if (one.chi_square) sums.push_back({*one.chi_square, one.numbers});
  }
  const Ranking ranking(sums);
  const FitEvaluation* best = nullptr;
  double least = 0;
  for (const FitEvaluation& one : fit.evaluations) {
    if (!one.chi_square) continue;
    const double rank = ranking.rank(*one.chi_square, one.numbers);
    if (!best || rank < least) best = &one, least = rank;
  }
  if (best) fit.best = best->values;
}

// The end of a search with its selection.
struct Searched {
  std::optional<Solution> solution;
  std::vector<Selection> selections;
  std::vector<double> middles;
};

// A search from each start. Returns the best one.
Searched search_all(const LogFitProblem& problem, LogFitter& fitter, LogFit& fit) {
  std::vector<Searched> all;
  std::vector<Ranking::Sum> sums;
  for (std::size_t start = 0; start < problem.settings.starts; ++start) {
    const auto solution = fitter.search(start_of(problem, fitter, start), start + 1);
    if (!solution) {
      ++fit.failed_starts;
      continue;
    }
    sums.push_back({solution->cost, solution->numbers});
    all.push_back({solution, fitter.selections(), fitter.middles()});
  }
  const Ranking ranking(sums);
  std::vector<Ranked> solutions;
  std::size_t best = 0;
  for (const Searched& one : all) {
    solutions.push_back({*one.solution, ranking.rank(one.solution->cost, one.solution->numbers)});
    if (solutions.back().rank < solutions[best].rank) best = solutions.size() - 1;
  }
  set_minima(fitter, std::move(solutions), fit);
  return all.empty() ? Searched{} : std::move(all[best]);
}

// A stop ends the cross-validation and not the fit.
void validate(const LogFitProblem& problem, const FitOptions& options, LogFitter& fitter, const Eigen::VectorXd& x,
              LogFit& fit) {
  try {
    cross_validate(problem, options, fitter, x, fit);
  } catch (const FitStopped&) {
    fit.stopped_validating = true;
    for (LogEstimate& log : fit.logs) {
      if (!log.left_out && log.why_not_left_out.empty()) log.why_not_left_out = "stopped";
    }
  }
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
      validate(problem, options, fitter, best.solution->x, fit);
    count();
  } catch (const FitStopped&) {
    fit.stopped = true;
    count();
    set_best_evaluation(fit);
  }
  return fit;
}

}  // namespace grapnel
