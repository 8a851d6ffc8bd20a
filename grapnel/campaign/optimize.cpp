#include "grapnel/campaign/optimize.hpp"
#include "grapnel/campaign/filling_sample.hpp"
#include "grapnel/text/error_text.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <map>
#include <nlopt.hpp>
#include <stdexcept>

namespace grapnel {
namespace {

// Local searches end when their steps are smaller than this fraction of the variables' ranges.
constexpr double kFinest = 1e-7;
// First step along limits, as a fraction of the ranges.
constexpr double kAlongLimits = 0.05;
// Step of central differences, as a fraction of the ranges. Larger steps raise the truncation error, of the order of
// the square; smaller ones the errors of outcomes, about 1e-9 of their size, divided by the step.
constexpr double kDifference = 1e-4;
// Value of unacceptable points for the local search, larger than any objective.
constexpr double kBeyondLimits = 1e30, kOutOfReach = 1e100;

// Ends a running simulation by EvaluationStopped.
CaptureProgress stops_at(const std::stop_token& stop) {
  return [stop](const std::string&, double, double) {
    if (stop.stop_requested()) throw EvaluationStopped{};
  };
}

CaseRow run_at(const Optimization& optimization, std::span<const double> values, const std::stop_token& stop) {
  try {
    return run_case(optimization.point(values), optimization.mode, optimization.columns, stops_at(stop));
  } catch (const std::exception& error) {
    return {0, CaseStatus::failed, error_text(error), std::vector<double>(optimization.columns.size(), NAN)};
  }
}

Evaluation evaluate_at(const Optimization& optimization, std::vector<double> values, std::size_t search,
                       const std::stop_token& stop) {
  Evaluation one{std::move(values), search, {}, {}};
  one.row = run_at(optimization, one.values, stop);
  one.score = score_of(optimization, one.row);
  return one;
}

double in_range(const OptimizationVariable& variable, double part) {
  return part >= 1 ? variable.to : variable.from + part * (variable.to - variable.from);
}

std::vector<double> sample_point(const Optimization& optimization, const FillingSample& sample, std::size_t index) {
  std::vector<double> values;
  for (std::size_t k = 0; k < optimization.variables.size(); ++k) {
    const OptimizationVariable& variable = optimization.variables[k];
    values.push_back(index == 0 ? std::clamp(variable.start, variable.from, variable.to)
                                : in_range(variable, sample.at(index, k)));
  }
  return values;
}

double merit(const Optimization& optimization, const Score& score) {
  if (!score.reached) return kOutOfReach;
  if (!score.acceptable()) return kBeyondLimits * (1 + score.violation);
  return optimization.maximize ? -score.objective : score.objective;
}

// One local search, in variables scaled to their ranges. `done` receives every point and returns whether to continue.
class LocalSearch {
 public:
  LocalSearch(const Optimization& optimization, std::size_t number, const std::function<bool(const Evaluation&)>& done,
              const std::stop_token& stop)
      : optimization_(optimization), number_(number), done_(done), stop_(stop) {}

  std::vector<Evaluation> run(const Evaluation& start, double step, std::size_t evaluations) && {
    if (optimization_.search.steps == LocalSteps::gradient)
      along_gradient(start, evaluations);
    else
      compare_points(start, step, evaluations);
    return std::move(path_);
  }

 private:
  // The best of the start and all points so far.
  Evaluation best(const Evaluation& start) const {
    const Evaluation* best = &start;
    for (const Evaluation& one : path_) {
      if (comes_before(optimization_, one.score, best->score)) best = &one;
    }
    return *best;
  }

  // With limits, half of the evaluations follow them: steps that only compare points stall at a limit that is oblique
  // to the variables.
  void compare_points(const Evaluation& start, double step, std::size_t evaluations) {
    const std::size_t along = optimization_.limits.empty() ? 0 : evaluations / 2;
    subplex(start, step, evaluations - along);
    along_limits(best(start), kAlongLimits, along);
  }

  // Quadratic models from derivatives of objective and limits (Kraft's SLSQP); then, at a kink of the worst of several
  // columns for example, steps that only compare points, with the evaluations that remain.
  void along_gradient(const Evaluation& start, std::size_t evaluations) {
    by_gradient_ = true;
    if (scale_to(start)) {
      nlopt::opt search(nlopt::LD_SLSQP, static_cast<unsigned>(optimization_.variables.size()));
      search.set_min_objective([](const std::vector<double>& x, std::vector<double>& slopes,
                                  void* self) { return static_cast<LocalSearch*>(self)->objective_with(x, slopes); },
                               this);
      search.add_inequality_mconstraint(
          [](unsigned count, double* result, unsigned n, const double* x, double* slopes, void* self) {
            static_cast<LocalSearch*>(self)->excess_with({x, x + n}, {result, count}, slopes);
          },
          this, std::vector<double>(optimization_.limits.size() + 1, 0.0));
      go(search, start, kAlongLimits, evaluations);
    }
    if (path_.size() < evaluations) subplex(best(start), kDifference, evaluations - path_.size());
  }

  // Steps that only compare points.
  void subplex(const Evaluation& start, double step, std::size_t evaluations) {
    nlopt::opt search(nlopt::LN_SBPLX, static_cast<unsigned>(optimization_.variables.size()));
    search.set_min_objective(
        [](const std::vector<double>& x, std::vector<double>&, void* self) {
          return merit(static_cast<LocalSearch*>(self)->optimization_, static_cast<LocalSearch*>(self)->at(x).score);
        },
        this);
    go(search, start, step, evaluations);
  }

  // Along limits: linear models of objective and limits (Powell's COBYLA).
  void along_limits(const Evaluation& start, double step, std::size_t evaluations) {
    if (!scale_to(start)) return;
    nlopt::opt search(nlopt::LN_COBYLA, static_cast<unsigned>(optimization_.variables.size()));
    search.set_min_objective([](const std::vector<double>& x, std::vector<double>&,
                                void* self) { return static_cast<LocalSearch*>(self)->objective(x); },
                             this);
    search.add_inequality_mconstraint(
        [](unsigned count, double* result, unsigned n, const double* x, double*, void* self) {
          const Score& score = static_cast<LocalSearch*>(self)->at({x, x + n}).score;
          for (unsigned i = 0; i < count; ++i) result[i] = static_cast<LocalSearch*>(self)->excess(score, i);
        },
        this, std::vector<double>(optimization_.limits.size() + 1, 0.0));
    go(search, start, step, evaluations);
  }

  // Scales objectives by that of the start. False if it has none.
  bool scale_to(const Evaluation& start) {
    if (!start.score.reached || std::isnan(start.score.objective)) return false;
    fallback_ = start.score.objective;
    scale_ = std::max(std::abs(fallback_), 1e-300);
    return true;
  }

  // The two points of the central difference by variable k, within the ranges; x itself in place of one that is not
  // reached.
  std::pair<std::vector<double>, std::vector<double>> beside(const std::vector<double>& x, std::size_t k) {
    const auto moved = [&](double by) {
      std::vector<double> there = x;
      there[k] = std::clamp(x[k] + by, 0.0, 1.0);
      return there != x && at(there).score.reached ? there : x;
    };
    std::vector<double> below = moved(-kDifference);
    return {std::move(below), moved(kDifference)};
  }

  double objective_with(const std::vector<double>& x, std::vector<double>& slopes) {
    const double value = objective(x);
    for (std::size_t k = 0; k < slopes.size(); ++k) {
      const auto [below, above] = beside(x, k);
      const double apart = above[k] - below[k];
      slopes[k] = apart > 0 ? (objective(above) - objective(below)) / apart : 0;
    }
    return value;
  }

  // `slopes`: by limit and variable; null: not requested.
  void excess_with(const std::vector<double>& x, std::span<double> values, double* slopes) {
    const Score here = at(x).score;
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = excess(here, i);
    for (std::size_t k = 0; slopes != nullptr && k < x.size(); ++k) {
      const auto [below, above] = beside(x, k);
      const Score low = at(below).score, high = at(above).score;
      const double apart = above[k] - below[k];
      for (std::size_t i = 0; i < values.size(); ++i)
        slopes[i * x.size() + k] = apart > 0 ? (excess(high, i) - excess(low, i)) / apart : 0;
    }
  }

  void go(nlopt::opt& search, const Evaluation& start, double step, std::size_t evaluations) {
    if (evaluations == 0 || stopped_) return;
    most_ = path_.size() + evaluations;
    const auto& variables = optimization_.variables;
    std::vector<double> x;
    for (std::size_t k = 0; k < variables.size(); ++k)
      x.push_back((start.values[k] - variables[k].from) / (variables[k].to - variables[k].from));
    search.set_lower_bounds(0.0);
    search.set_upper_bounds(1.0);
    search.set_initial_step(step);
    search.set_xtol_abs(kFinest);
    double best = 0;
    try {
      search.optimize(x, best);
    } catch (const nlopt::forced_stop&) {  // all evaluations used, or stop requested
    } catch (const nlopt::roundoff_limited&) {
    } catch (const std::runtime_error&) {  // the models of COBYLA may degenerate near unreachable points
    }
  }

  // The point at x, valid until the next call. A repeated request of the last point is not simulated again; with
  // by_gradient_, of no point, since SLSQP requests limits after the differences of the objective.
  const Evaluation& at(const std::vector<double>& x) {
    if (x == last_ && !path_.empty()) return path_.back();
    if (by_gradient_) {
      const auto known = seen_.find(x);
      if (known != seen_.end()) return path_[known->second];
    }
    if (path_.size() == most_ || stopped_) throw nlopt::forced_stop();
    std::vector<double> values;
    for (std::size_t k = 0; k < x.size(); ++k) values.push_back(in_range(optimization_.variables[k], x[k]));
    last_ = x;
    try {
      path_.push_back(evaluate_at(optimization_, std::move(values), number_, stop_));
    } catch (const EvaluationStopped&) {
      stopped_ = true;
      throw nlopt::forced_stop();
    }
    if (by_gradient_) seen_.emplace(x, path_.size() - 1);
    stopped_ = !done_(path_.back());
    return path_.back();
  }

  // Scaled to its value at the start, as limits are to their bounds.
  double objective(const std::vector<double>& x) {
    const Score& score = at(x).score;
    const double value = score.reached && !std::isnan(score.objective) ? score.objective : fallback_;
    return (optimization_.maximize ? -value : value) / scale_;
  }
  double excess(const Score& score, std::size_t limit) const {
    if (!score.reached) return 1;
    if (limit == optimization_.limits.size()) return score.violation > 0 && score.worst_limit >= limit ? 1 : -1;
    const OptimizationLimit& one = optimization_.limits[limit];
    const double beyond = (one.at_most ? 1 : -1) * (score.limits[limit] - one.bound);
    return std::isnan(beyond) ? 1 : beyond / (one.bound != 0 ? std::abs(one.bound) : 1);
  }

  const Optimization& optimization_;
  std::size_t number_;
  const std::function<bool(const Evaluation&)>& done_;
  const std::stop_token stop_;
  std::vector<Evaluation> path_;
  std::vector<double> last_;
  bool by_gradient_ = false;
  std::map<std::vector<double>, std::size_t> seen_;  // positions in path_; with by_gradient_
  std::size_t most_ = 0;
  bool stopped_ = false;
  double fallback_ = 0, scale_ = 1;
};

// The best reached points, the first of equals first.
std::vector<Evaluation> best_of(const Optimization& optimization, const std::vector<Evaluation>& all) {
  std::vector<Evaluation> sorted;
  std::copy_if(all.begin(), all.end(), std::back_inserter(sorted), [](const Evaluation& e) { return e.score.reached; });
  std::stable_sort(sorted.begin(), sorted.end(), [&](const Evaluation& a, const Evaluation& b) {
    return comes_before(optimization, a.score, b.score);
  });
  if (sorted.size() > optimization.search.refine) sorted.resize(optimization.search.refine);
  return sorted;
}

void choose(const Optimization& optimization, OptimizationOutcome& outcome) {
  std::optional<std::size_t> first;
  for (std::size_t i = 0; i < outcome.evaluations.size(); ++i) {
    Evaluation& one = outcome.evaluations[i];
    one.row.index = i;
    if (!first || comes_before(optimization, one.score, outcome.evaluations[*first].score)) first = i;
  }
  if (!first || !outcome.evaluations[*first].score.reached) return;
  (outcome.evaluations[*first].score.acceptable() ? outcome.best : outcome.nearest) = first;
}

}  // namespace

std::size_t OptimizationOutcome::count(CaseStatus status) const {
  return static_cast<std::size_t>(std::count_if(evaluations.begin(), evaluations.end(),
                                                [&](const Evaluation& one) { return one.row.status == status; }));
}

std::size_t OptimizationOutcome::beyond_limits() const {
  return static_cast<std::size_t>(std::count_if(evaluations.begin(), evaluations.end(), [](const Evaluation& one) {
    return one.score.reached && !one.score.acceptable();
  }));
}

Evaluation evaluate(const Optimization& optimization, const StudyCase& point, const std::stop_token& stop) {
  Evaluation one;
  one.row = run_case(point, optimization.mode, optimization.columns, stops_at(stop));
  one.score = score_of(optimization, one.row);
  return one;
}

OptimizationOutcome optimize(const Optimization& optimization, const PoolOptions& options) {
  const SearchSetup& setup = optimization.search;
  OptimizationOutcome outcome;
  try {
    outcome.before = evaluate(optimization, optimization.before, options.stop);
  } catch (const EvaluationStopped&) {
    return outcome;
  }
  const std::size_t samples = setup.refine == 0 ? setup.evaluations : (setup.evaluations + 1) / 2;
  CaseProgress progress;
  progress.total = setup.evaluations;
  const FillingSample sample(optimization.variables.size(), setup.seed);
  std::vector<Evaluation> sampled(samples);
  const auto sampling = [&](std::size_t i, const RowSink& submit, const std::stop_token& stop) {
    try {
      sampled[i] = evaluate_at(optimization, sample_point(optimization, sample, i), 0, stop);
    } catch (const EvaluationStopped&) {
      return;
    }
    submit({sampled[i].row});
  };
  progress = run_jobs(samples, options, progress, sampling);

  const std::vector<Evaluation> starts = best_of(optimization, sampled);
  std::vector<std::vector<Evaluation>> paths(starts.size());
  const std::size_t left = setup.evaluations - samples;
  // The first searches get the remainder of the division.
  const auto share = [&](std::size_t i) { return left / starts.size() + (i < left % starts.size() ? 1 : 0); };
  // The distance of neighbours in the sample.
  const double step =
      std::min(0.25, std::pow(static_cast<double>(samples), -1 / static_cast<double>(optimization.variables.size())));
  const auto searching = [&](std::size_t i, const RowSink& submit, const std::stop_token& stop) {
    const std::function<bool(const Evaluation&)> done = [&](const Evaluation& one) {
      submit({one.row});
      return !stop.stop_requested();
    };
    paths[i] = LocalSearch(optimization, i + 1, done, stop).run(starts[i], step, share(i));
  };
  if (left > 0) run_jobs(starts.size(), options, progress, searching);

  outcome.evaluations = std::move(sampled);
  for (std::vector<Evaluation>& path : paths)
    outcome.evaluations.insert(outcome.evaluations.end(), std::make_move_iterator(path.begin()),
                               std::make_move_iterator(path.end()));
  std::erase_if(outcome.evaluations, [](const Evaluation& one) { return one.values.empty(); });  // after a stop
  choose(optimization, outcome);
  return outcome;
}

}  // namespace grapnel
