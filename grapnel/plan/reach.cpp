#include "grapnel/plan/reach.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "grapnel/plan/arm_starts.hpp"
#include "grapnel/plan/path_restoration.hpp"
#include "grapnel/plan/reach_failure.hpp"
#include "grapnel/plan/shooting.hpp"

namespace grapnel {
namespace {

constexpr double kDamping = 1e-3;     // smaller singular values are damped [m/rad]
constexpr double kLongestStep = 0.6;  // maximum change of a joint per iteration [rad or m]
// Errors below which the base motion is integrated with full accuracy [m or rad]: for the next iterate, and
// immediately.
constexpr double kNear = 1e-3, kNearSearch = 1e-5;

std::vector<double> moved(const std::vector<double>& x, const Eigen::VectorXd& d, double fraction,
                          const ReachProblem& problem) {
  std::vector<double> y = x;
  for (std::size_t j = 0; j < y.size(); ++j) {
    y[j] = std::clamp(x[j] + fraction * d[static_cast<Eigen::Index>(j)], problem.lower[j], problem.upper[j]);
  }
  return y;
}

void check(const FloatingBase& base, const ReachProblem& p) {
  const std::size_t n = base.joints();
  for (const auto* values : {&p.start.position, &p.start.rate, &p.lower, &p.upper, &p.guess}) {
    if (values->size() != n) throw std::invalid_argument("plan_reach: one value per joint is needed");
  }
  if (!p.given_rates.empty() && p.given_rates.size() != n) {
    throw std::invalid_argument("plan_reach: one given rate per joint is needed");
  }
}

// One search: tries several initial guesses; gives the best solution or the closest attempt.
class Search {
 public:
  Search(FloatingBase& base, const ReachProblem& problem)
      : base_(base), problem_(problem), guided_(problem), shooting_(base, problem), closest_() {
    // Objectives of the path are minimized starting from solutions with minimum joint motion.
    if (!problem.objective.depends_on_end_alone()) {
      guided_.objective =
          Objective(Objective::Kind::excursion, problem.start, problem.guess, problem.lower, problem.upper);
    }
  }

  // Runs the search: Newton's method from the guess, from the arms' solutions and from settled base poses, then the
  // choice among the solutions.
  ReachSolution run() {
    std::vector<double> guess = problem_.guess;
    for (std::size_t j = 0; j < guess.size(); ++j)
      guess[j] = std::clamp(guess[j], problem_.lower[j], problem_.upper[j]);
    attempt(guess);
    const bool first_is_enough = problem_.objective.is_empty();
    if (problem_.starts > 1 && !(first_is_enough && !solutions_.empty())) {
      // The arms' inverse kinematics uses the final base pose of the best attempt so far, unless that attempt was poor.
      const bool near = closest_.valid && closest_.size() < 0.3 * first_error_;
      attempt_from_arms(near ? closest_.X_WB : problem_.start.X_WB, solutions_.empty() ? half() : problem_.starts);
    }
    if (solutions_.empty() && result_.starts < problem_.starts) attempt_with_base_settled();
    choose();
    result_.rhs_evaluations += shooting_.rhs_evaluations();
    return result_;
  }

 private:
  // A few different solutions are sufficient for the objective; more solutions cost time for little gain.
  bool enough() const { return solutions_.size() >= (problem_.objective.is_empty() ? 1u : 4u); }

  // Half of the initial guesses are reserved for other final base poses.
  int half() const { return (problem_.starts + 1) / 2; }

  // Tries the arms' solutions with the base fixed at X_WB, until there are `max_starts` initial guesses.
  void attempt_from_arms(const Posed& X_WB, int max_starts) {
    ArmStarts guesses(base_, problem_, X_WB);
    // An arm that misses its goal with a fixed base rarely reaches it with a moving base.
    constexpr int kHopeless = 3;
    if (!guesses.complete()) max_starts = std::min(max_starts, std::max(kHopeless, result_.starts + 1));
    while (result_.starts < max_starts && !enough()) attempt(guesses.next());
  }

  // The final base pose may differ strongly from the initial one: tries initial guesses at the base pose that results
  // from motions of all arms to their goals.
  void attempt_with_base_settled() {
    constexpr double kReached = 1e-2;  // final rates, not considered here, move the base slightly further [m and rad]
    const SettledArms settled = settle_arms(base_, problem_, closest_.valid ? closest_.position : problem_.guess);
    for (const Nearest& n : settled.nearest) {
      if (n.error.size() > 0 && n.error.lpNorm<Eigen::Infinity>() > kReached) return;
    }
    attempt(settled.theta);
    attempt_from_arms(settled.X_WB, problem_.starts);
  }

  void attempt(const std::vector<double>& from) {
    ++result_.starts;
    const std::vector<double> rest(from.size(), 0.0);
    ShootingIterate first = shooting_.shoot(from, rest, SegmentAccuracy::search);
    if (result_.starts == 1 && first.valid) first_error_ = first.size();
    std::optional<ShootingIterate> end = newton(std::move(first));
    if (end) solutions_.push_back(std::move(*end));
  }

  // Newton's method with minimum-norm steps, shortened until the error decreases. The base motion has search accuracy
  // while the error is large, and full accuracy at the end. Empty if it does not converge to a solution.
  std::optional<ShootingIterate> newton(ShootingIterate iterate) {
    constexpr int kMaxIterations = 60, kPatience = 8;
    double before = std::numeric_limits<double>::infinity();
    for (int i = 0; iterate.valid && i < kMaxIterations; ++i) {
      if (i % kPatience == kPatience - 1) {
        if (iterate.size() > 0.5 * before) return std::nullopt;  // slow progress
        before = iterate.size();
      }
      if (iterate.accuracy == SegmentAccuracy::search && iterate.largest_error() <= kNearSearch) {
        iterate = shooting_.shoot(iterate.position, iterate.rate, SegmentAccuracy::full);
        if (!iterate.valid) return std::nullopt;
      }
      if (!closest_.valid || iterate.size() < closest_.size()) closest_ = iterate;
      if (iterate.largest_error() <= 1e-2 * kArrived) return iterate;
      const NewtonStep step =
          minimum_norm_step(iterate.J, iterate.error, iterate.position, problem_.lower, problem_.upper, kDamping);
      ++result_.iterations;
      const double longest = step.d.lpNorm<Eigen::Infinity>();
      double fraction = longest > kLongestStep ? kLongestStep / longest : 1.0;
      ShootingIterate next;
      // The error after the next step is of the order of the square of the present error.
      const SegmentAccuracy accuracy =
          iterate.largest_error() < kNear ? SegmentAccuracy::full : SegmentAccuracy::search;
      for (int halvings = 0; halvings < 9; ++halvings, fraction *= 0.5) {
        const std::vector<double> position = moved(iterate.position, step.d, fraction, problem_);
        next = shooting_.shoot(position, iterate.rate_at(position), accuracy);
        if (next.valid && next.size() < (1 - 1e-3 * fraction) * iterate.size()) break;
        next.valid = false;
      }
      if (!next.valid) {
        return iterate.largest_error() <= kArrived ? std::optional<ShootingIterate>(iterate) : std::nullopt;
      }
      iterate = std::move(next);
    }
    return std::nullopt;
  }

  double objective(const ShootingIterate& iterate) {
    return guided_.objective.value(base_, problem_.goals, iterate.position, iterate.rate, nullptr);
  }

  bool within_rate_limits(const ShootingIterate& iterate) const {
    for (std::size_t j = 0; j < problem_.rate_limit.size(); ++j) {
      if (std::abs(iterate.rate[j]) > problem_.rate_limit[j]) return false;
    }
    return true;
  }

  bool is_better(const ShootingIterate& a, const ShootingIterate& b) {
    const bool good = within_rate_limits(a);
    return good != within_rate_limits(b) ? good : objective(a) < objective(b);
  }

  // Whether the errors of an attempt are within the bounds that each goal accepts.
  bool is_acceptable(const ShootingIterate& iterate) const {
    if (!iterate.valid) return false;
    const std::vector<GoalMiss> miss = misses(problem_.goals, iterate.error);
    for (std::size_t i = 0; i < miss.size(); ++i) {
      const Goal& g = problem_.goals[i];
      if (miss[i].distance > std::max(kArrived, g.accepted_distance)) return false;
      if (miss[i].angle > std::max(kArrived, g.accepted_angle)) return false;
    }
    return true;
  }

  // Selects the best of the solutions, each improved within the remaining freedom of the goals.
  void choose() {
    result_.solutions = static_cast<int>(solutions_.size());
    result_.distinct = distinct();
    if (solutions_.empty() && is_acceptable(closest_)) {
      solutions_.push_back(closest_);
      result_.approximate = true;
    }
    result_.found = !solutions_.empty();
    if (!result_.found) {
      take(closest_);
      const Failure why = explain_failure(base_, problem_, closest_, result_.starts);
      result_.failure = why.text;
      if (!shooting_.failure().empty())
        result_.failure += fmt::format("; integrations of the base's motion ended early: {}", shooting_.failure());
      result_.miss = why.miss;
      return;
    }
    std::stable_sort(solutions_.begin(), solutions_.end(),
                     [&](const ShootingIterate& a, const ShootingIterate& b) { return is_better(a, b); });
    ShootingIterate best = solutions_.front();
    std::size_t origin = 0;  // index of the best solution
    if (!problem_.objective.is_empty() && !result_.approximate) {
      constexpr std::size_t kImproved = 2;
      for (std::size_t i = 0; i < std::min(kImproved, solutions_.size()); ++i) {
        const std::optional<ShootingIterate> better = newton(best_near(base_, guided_, shooting_, solutions_[i]));
        if (better && is_better(*better, best)) best = *better, origin = i;
      }
    }
    if (depends_on_path(problem_) && result_.approximate) {
      result_.found = false;
      take(best);
      result_.failure =
          "the end-effectors reach their goals only to within half their envelopes; path constraints and objectives of "
          "the path are not supported for such a goal: remove the path constraints from approach.plan";
    } else if (depends_on_path(problem_)) {
      enforce_constraints(std::move(best), origin);
    } else {
      take(best);
    }
  }

  // Number of solutions that differ by more than 1e-3 in a joint.
  int distinct() const {
    constexpr double kSame = 1e-3;  // [rad or m]
    int count = 0;
    for (std::size_t i = 0; i < solutions_.size(); ++i) {
      const auto is_like = [&](const ShootingIterate& other) {
        double largest = 0;
        for (std::size_t j = 0; j < other.position.size(); ++j) {
          largest = std::max(largest, std::abs(other.position[j] - solutions_[i].position[j]));
        }
        return largest <= kSame;
      };
      count += std::none_of(solutions_.begin(), solutions_.begin() + static_cast<std::ptrdiff_t>(i), is_like);
    }
    return count;
  }

  static constexpr std::size_t kFew = 3;  // number of initial solutions if feasible trajectories are rare

  // Enforces the path constraints, starting from the best solution, then from others, and with a spline that was not
  // requested if nothing else succeeds. Selects the feasible trajectory with the minimum objective.
  void enforce_constraints(ShootingIterate best, std::size_t origin) {
    constexpr std::size_t kFrom = 4;  // number of solutions to start from
    constexpr int kRandom = 3;        // further starts with random splines
    std::vector<ShootingIterate> from = {best};
    for (std::size_t i = 0; i < solutions_.size() && from.size() < kFrom; ++i) {
      if (i != origin) from.push_back(solutions_[i]);
    }
    std::optional<ConstrainedSolution> chosen, nearest;
    const bool is_constrained = problem_.constraints.has_constraints();
    const int max_knots = problem_.constraints.knots.value_or(is_constrained ? PathConstraints::kKnots : 0);
    std::optional<ConstrainedSolution> possible;  // a feasible motion, for any objective
    if (is_constrained) {
      ConstrainedSolution found = find_possible(from, max_knots, kRandom);
      if (found.violation <= kTolerated)
        possible = std::move(found);
      else if (!found.obstructed)
        return refuse(best, found, max_knots);
      else
        nearest = std::move(found);
    }
    const bool is_possible = !is_constrained || possible.has_value();
    const auto attempt = [&](const ShootingIterate& solution, int knots, int number) {
      ConstrainedSolution end;
      // The search for the optimal trajectory is expensive: with fewer knots than allowed only if a feasible trajectory
      // is close.
      const bool is_known = !is_constrained || (possible && knots == max_knots);
      bool is_worth_it = is_known || is_worth_another_try(knots);
      if (!is_known && possible) {
        end = search_path(solution, knots, number);
        is_worth_it = end.violation <= kTolerated || (end.obstructed && is_worth_it);
      }
      if (is_worth_it) {
        constexpr int kFurtherSteps = 40;  // if a feasible trajectory is known
        // A feasible result is returned if the evaluation limit is reached.
        try {
          end = solve_with_path_constraints(base_, problem_, solution, knots, number,
                                            chosen && number >= 0 ? kFurtherSteps : kMaxSearchSteps);
        } catch (const WorkLimit&) {
          if (!chosen) throw;
          return;
        }
        result_.rhs_evaluations += end.rhs_evaluations;
      }
      if (end.feasible && (!chosen || end.objective < chosen->objective)) chosen = end;
      if (!end.feasible && end.iterate && (!nearest || end.violation < nearest->violation)) nearest = std::move(end);
    };
    // A requested spline may also start from the solution without a spline.
    if (problem_.constraints.knots.value_or(0) > 0) {
      attempt(best, 0, 0);
      const std::optional<ConstrainedSolution>& simple = chosen ? chosen : nearest;
      if (simple) from.push_back(*simple->iterate);
    }
    std::vector<int> counts = {problem_.constraints.knots.value_or(0)};
    if (max_knots > counts.front()) counts.push_back(max_knots);
    for (const int knots : counts) {
      for (std::size_t i = 0; i < (is_possible ? from.size() : std::min(kFew, from.size())); ++i)
        attempt(from[i], knots, 0);
      if (possible && knots == max_knots) attempt(*possible->iterate, knots, 0);
      for (int i = 1; i <= kRandom && knots > 0 && !chosen; ++i) attempt(best, knots, i);
      if (chosen && !costs_much(*chosen, best)) break;
    }
    // A search that needed many steps to become feasible may have ended early.
    if (chosen && (chosen->may_improve || costs_much(*chosen, best)))
      attempt(ShootingIterate(*chosen->iterate), chosen->knots, kOnwards);
    if (!chosen && (!is_constrained || possible)) attempt_without_objective(best, max_knots, attempt);
    if (!chosen && possible) attempt(*possible->iterate, max_knots, kAsItIs);
    if (!chosen) return refuse(best, nearest, max_knots);
    // The minimum distance between nodes is below that at the nodes.
    if (wants_clearance(problem_)) attempt(ShootingIterate(*chosen->iterate), chosen->knots, kAtAllNodes);
    take(*chosen->iterate);
    result_.knots = chosen->knots, result_.coefficients = chosen->coefficients;
    result_.figures = chosen->figures;
    result_.objective = chosen->objective, result_.terms = chosen->terms;
  }

  // Whether to try another search, for about half a second. Restoration steps may fail to avoid an obstacle where steps
  // with an objective succeed. Not if any solution from a single start is requested, as for most times of a window.
  bool is_worth_another_try(int knots) const {
    constexpr int kMaxUnknowns = 105;
    constexpr double kMaxWork = 4e6;  // maximum work, evaluations times joints
    const bool is_quick_search = problem_.objective.is_empty() && problem_.starts == 1;
    return !is_quick_search && base_.joints() * (1 + knots) <= kMaxUnknowns &&
           static_cast<double>(result_.rhs_evaluations) * base_.joints() <= kMaxWork;
  }

  // Whether the path constraints increase the objective so much that additional knots are worth trying.
  bool costs_much(const ConstrainedSolution& constrained, const ShootingIterate& best) {
    constexpr double kMuch = 0.25;
    if (!problem_.objective.depends_on_end_alone()) return false;
    const double unconstrained = problem_.objective.value(base_, problem_.goals, best.position, best.rate, nullptr);
    return constrained.objective - unconstrained > kMuch * std::abs(unconstrained);
  }

  ConstrainedSolution search_path(const ShootingIterate& solution, int knots, int number) {
    ConstrainedSolution end = nearest_feasible_path(base_, problem_, solution, knots, number, kTolerated);
    result_.rhs_evaluations += end.rhs_evaluations;
    return end;
  }

  // Tests feasibility: the first trajectory from these solutions that satisfies the constraints at the nodes, or the
  // closest one. Random splines help only in nearly feasible cases.
  ConstrainedSolution find_possible(const std::vector<ShootingIterate>& from, int knots, int random) {
    constexpr double kWorthMore = 0.1;
    ConstrainedSolution best;
    best.violation = std::numeric_limits<double>::infinity();
    const auto attempt = [&](const ShootingIterate& solution, int number) {
      ConstrainedSolution end = search_path(solution, knots, number);
      if (end.violation < best.violation) best = std::move(end);
    };
    for (std::size_t i = 0; i < std::min(kFew, from.size()) && best.violation > kTolerated; ++i) attempt(from[i], 0);
    for (int i = 1; i <= random && knots > 0 && best.violation > kTolerated && best.violation < kWorthMore; ++i)
      attempt(from.front(), i);
    return best;
  }

  // Records the failure of the path constraints with the closest attempt.
  void refuse(const ShootingIterate& best, const std::optional<ConstrainedSolution>& nearest, int knots) {
    const bool known = nearest && nearest->iterate;
    result_.found = false;
    take(known ? *nearest->iterate : best);
    result_.failure = fmt::format(
        "the end-effectors arrive, but no trajectory with up to {} knots was found that satisfies the path constraints "
        "of approach.plan: in the closest attempt {}; more knots, a longer segment, waypoints or another guess may "
        "help",
        knots, known ? nearest->failure : "the motion is not resolved");
    // take() does not evaluate splines.
    constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
    if (!known || nearest->iterate->coefficients.empty()) return;
    result_.objective = kUnknown;
    std::fill(result_.terms.begin(), result_.terms.end(), kUnknown);
  }

  // If the objective prevents feasibility: finds a feasible trajectory without the objective, then continues with it.
  template <class Attempt>
  void attempt_without_objective(const ShootingIterate& best, int knots, Attempt&& attempt) {
    if (problem_.objective.is_empty()) return;
    ReachProblem simpler = problem_;
    simpler.objective = problem_.objective.depends_on_end_alone() ? Objective() : guided_.objective;
    const ConstrainedSolution first = solve_with_path_constraints(base_, simpler, best, knots, 0);
    result_.rhs_evaluations += first.rhs_evaluations;
    if (!first.feasible) return;
    attempt(*first.iterate, knots, kAsItIs);
    attempt(*first.iterate, knots, 0);
  }

  // Copies an iterate to the result, with its errors, objective and singular value.
  void take(const ShootingIterate& iterate) {
    result_.position = iterate.position.empty() ? problem_.guess : iterate.position;
    result_.rate = iterate.rate.empty() ? std::vector<double>(problem_.guess.size(), 0.0) : iterate.rate;
    result_.X_WB = iterate.X_WB;
    result_.unmet_rate = iterate.unmet;
    result_.miss = misses(problem_.goals, iterate.error);
    if (!iterate.valid) return;
    result_.within_rate_limits = within_rate_limits(iterate);
    // Terms that depend on the path are unknown here.
    constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
    result_.objective = problem_.objective.depends_on_end_alone() ? objective(iterate) : kUnknown;
    for (const Objective::Term& t : problem_.objective.terms()) {
      result_.terms.push_back(
          Objective::depends_on_end_alone(t.kind)
              ? problem_.objective.term(t, base_, problem_.goals, iterate.position, iterate.rate, nullptr)
              : kUnknown);
    }
    result_.smallest_singular_value = smallest_singular_value(iterate.J);
  }

  FloatingBase& base_;
  const ReachProblem& problem_;
  ReachProblem guided_;  // the problem with the objective that the search itself minimizes
  Shooting shooting_;
  std::vector<ShootingIterate> solutions_;
  ShootingIterate closest_;
  double first_error_ = 0;
  ReachSolution result_;
};

}  // namespace

ReachSolution plan_reach(FloatingBase& base, const ReachProblem& problem) {
  check(base, problem);
  return Search(base, problem).run();
}

}  // namespace grapnel
