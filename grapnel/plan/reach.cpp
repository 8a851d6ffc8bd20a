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
// Errors below which the base motion is integrated with full accuracy [m or rad]: for the next shot, and immediately.
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

  // Tries the arms' solutions with the base fixed at X_WB, until there are `most` initial guesses.
  void attempt_from_arms(const Posed& X_WB, int most) {
    ArmStarts guesses(base_, problem_, X_WB);
    // An arm that misses its goal with a fixed base rarely reaches it with a moving base.
    constexpr int kHopeless = 3;
    if (!guesses.complete()) most = std::min(most, std::max(kHopeless, result_.starts + 1));
    while (result_.starts < most && !enough()) attempt(guesses.next());
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
  std::optional<ShootingIterate> newton(ShootingIterate shot) {
    constexpr int kMost = 60, kPatience = 8;
    double before = std::numeric_limits<double>::infinity();
    for (int i = 0; shot.valid && i < kMost; ++i) {
      if (i % kPatience == kPatience - 1) {
        if (shot.size() > 0.5 * before) return std::nullopt;  // slow progress
        before = shot.size();
      }
      if (shot.accuracy == SegmentAccuracy::search && shot.largest_error() <= kNearSearch) {
        shot = shooting_.shoot(shot.position, shot.rate, SegmentAccuracy::full);
        if (!shot.valid) return std::nullopt;
      }
      if (!closest_.valid || shot.size() < closest_.size()) closest_ = shot;
      if (shot.largest_error() <= 1e-2 * kArrived) return shot;
      const NewtonStep step =
          least_norm_step(shot.J, shot.error, shot.position, problem_.lower, problem_.upper, kDamping);
      ++result_.iterations;
      const double longest = step.d.lpNorm<Eigen::Infinity>();
      double fraction = longest > kLongestStep ? kLongestStep / longest : 1.0;
      ShootingIterate next;
      // The error after the next step is of the order of the square of the present error.
      const SegmentAccuracy accuracy = shot.largest_error() < kNear ? SegmentAccuracy::full : SegmentAccuracy::search;
      for (int halvings = 0; halvings < 9; ++halvings, fraction *= 0.5) {
        const std::vector<double> position = moved(shot.position, step.d, fraction, problem_);
        next = shooting_.shoot(position, shot.rate_at(position), accuracy);
        if (next.valid && next.size() < (1 - 1e-3 * fraction) * shot.size()) break;
        next.valid = false;
      }
      if (!next.valid) {
        return shot.largest_error() <= kArrived ? std::optional<ShootingIterate>(shot) : std::nullopt;
      }
      shot = std::move(next);
    }
    return std::nullopt;
  }

  double objective(const ShootingIterate& shot) {
    return guided_.objective.value(base_, problem_.goals, shot.position, shot.rate, nullptr);
  }

  bool within_rate_limits(const ShootingIterate& shot) const {
    for (std::size_t j = 0; j < problem_.rate_limit.size(); ++j) {
      if (std::abs(shot.rate[j]) > problem_.rate_limit[j]) return false;
    }
    return true;
  }

  bool is_better(const ShootingIterate& a, const ShootingIterate& b) {
    const bool good = within_rate_limits(a);
    return good != within_rate_limits(b) ? good : objective(a) < objective(b);
  }

  // Whether the errors of an attempt are within the bounds that each goal accepts.
  bool is_acceptable(const ShootingIterate& shot) const {
    if (!shot.valid) return false;
    const std::vector<GoalMiss> miss = misses(problem_.goals, shot.error);
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
      if (!shooting_.trouble().empty())
        result_.failure += fmt::format("; integrations of the base's motion ended early: {}", shooting_.trouble());
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
      keep(std::move(best), origin);
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
  void keep(ShootingIterate best, std::size_t origin) {
    constexpr std::size_t kFrom = 4;  // number of solutions to start from
    constexpr int kRandom = 3;        // further starts with random splines
    std::vector<ShootingIterate> from = {best};
    for (std::size_t i = 0; i < solutions_.size() && from.size() < kFrom; ++i) {
      if (i != origin) from.push_back(solutions_[i]);
    }
    std::optional<ConstrainedSolution> kept, nearest;
    const bool keeps = problem_.way.has_constraints();
    const int most = problem_.way.knots.value_or(keeps ? PathConstraints::kKnots : 0);
    std::optional<ConstrainedSolution> possible;  // a feasible motion, for any objective
    if (keeps) {
      ConstrainedSolution found = find_possible(from, most, kRandom);
      if (found.violation <= kTolerated)
        possible = std::move(found);
      else if (!found.obstructed)
        return refuse(best, found, most);
      else
        nearest = std::move(found);
    }
    const bool is_possible = !keeps || possible.has_value();
    const auto attempt = [&](const ShootingIterate& solution, int knots, int number) {
      ConstrainedSolution end;
      // The search for the optimal trajectory is expensive: with fewer knots than allowed only if a feasible trajectory
      // is close.
      const bool is_known = !keeps || (possible && knots == most);
      bool is_worth_it = is_known || is_worth_another_try(knots);
      if (!is_known && possible) {
        end = search_path(solution, knots, number);
        is_worth_it = end.violation <= kTolerated || (end.obstructed && is_worth_it);
      }
      if (is_worth_it) {
        constexpr int kFurtherSteps = 40;  // if a feasible trajectory is known
        // A feasible result is kept if the evaluation limit is reached.
        try {
          end = solve_with_path_constraints(base_, problem_, solution, knots, number,
                                            kept && number >= 0 ? kFurtherSteps : kMostSteps);
        } catch (const WorkLimit&) {
          if (!kept) throw;
          return;
        }
        result_.rhs_evaluations += end.rhs_evaluations;
      }
      if (end.kept && (!kept || end.objective < kept->objective)) kept = end;
      if (!end.kept && end.shot && (!nearest || end.violation < nearest->violation)) nearest = std::move(end);
    };
    // A requested spline may also start from the solution without a spline.
    if (problem_.way.knots.value_or(0) > 0) {
      attempt(best, 0, 0);
      const std::optional<ConstrainedSolution>& simple = kept ? kept : nearest;
      if (simple) from.push_back(*simple->shot);
    }
    std::vector<int> counts = {problem_.way.knots.value_or(0)};
    if (most > counts.front()) counts.push_back(most);
    for (const int knots : counts) {
      for (std::size_t i = 0; i < (is_possible ? from.size() : std::min(kFew, from.size())); ++i)
        attempt(from[i], knots, 0);
      if (possible && knots == most) attempt(*possible->shot, knots, 0);
      for (int i = 1; i <= kRandom && knots > 0 && !kept; ++i) attempt(best, knots, i);
      if (kept && !costs_much(*kept, best)) break;
    }
    // A search that needed many steps to become feasible may have ended early.
    if (kept && (kept->may_improve || costs_much(*kept, best)))
      attempt(ShootingIterate(*kept->shot), kept->knots, kOnwards);
    if (!kept && (!keeps || possible)) keep_first(best, most, attempt);
    if (!kept && possible) attempt(*possible->shot, most, kAsItIs);
    if (!kept) return refuse(best, nearest, most);
    // The minimum distance between nodes is below that at the nodes.
    if (wants_clearance(problem_)) attempt(ShootingIterate(*kept->shot), kept->knots, kAtAllNodes);
    take(*kept->shot);
    result_.knots = kept->knots, result_.coefficients = kept->coefficients;
    result_.way = kept->figures;
    result_.objective = kept->objective, result_.terms = kept->terms;
  }

  // Whether to try another search, for about half a second. Restoration steps may fail to avoid an obstacle where steps
  // with an objective succeed. Not if any solution from a single start is requested, as for most times of a window.
  bool is_worth_another_try(int knots) const {
    constexpr int kMostUnknowns = 105;
    constexpr double kMostWork = 4e6;  // maximum work, evaluations times joints
    const bool is_quick_look = problem_.objective.is_empty() && problem_.starts == 1;
    return !is_quick_look && base_.joints() * (1 + knots) <= kMostUnknowns &&
           static_cast<double>(result_.rhs_evaluations) * base_.joints() <= kMostWork;
  }

  // Whether the path constraints increase the objective so much that additional knots are worth trying.
  bool costs_much(const ConstrainedSolution& kept, const ShootingIterate& best) {
    constexpr double kMuch = 0.25;
    if (!problem_.objective.depends_on_end_alone()) return false;
    const double least = problem_.objective.value(base_, problem_.goals, best.position, best.rate, nullptr);
    return kept.objective - least > kMuch * std::abs(least);
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
    const bool known = nearest && nearest->shot;
    result_.found = false;
    take(known ? *nearest->shot : best);
    result_.failure = fmt::format(
        "the end-effectors arrive, but no trajectory with up to {} knots was found that satisfies the path constraints "
        "of approach.plan: in the closest attempt {}; more knots, a longer segment, waypoints or another guess may "
        "help",
        knots, known ? nearest->trouble : "the motion is not resolved");
    // take() does not evaluate splines.
    constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
    if (!known || nearest->shot->coefficients.empty()) return;
    result_.objective = kUnknown;
    std::fill(result_.terms.begin(), result_.terms.end(), kUnknown);
  }

  // If the objective prevents feasibility: finds a feasible trajectory without the objective, then continues with it.
  template <class Attempt>
  void keep_first(const ShootingIterate& best, int knots, Attempt&& attempt) {
    if (problem_.objective.is_empty()) return;
    ReachProblem simpler = problem_;
    simpler.objective = problem_.objective.depends_on_end_alone() ? Objective() : guided_.objective;
    const ConstrainedSolution first = solve_with_path_constraints(base_, simpler, best, knots, 0);
    result_.rhs_evaluations += first.rhs_evaluations;
    if (!first.kept) return;
    attempt(*first.shot, knots, kAsItIs);
    attempt(*first.shot, knots, 0);
  }

  // Copies a shot to the result, with its errors, objective and singular value.
  void take(const ShootingIterate& shot) {
    result_.position = shot.position.empty() ? problem_.guess : shot.position;
    result_.rate = shot.rate.empty() ? std::vector<double>(problem_.guess.size(), 0.0) : shot.rate;
    result_.X_WB = shot.X_WB;
    result_.unmet_rate = shot.unmet;
    result_.miss = misses(problem_.goals, shot.error);
    if (!shot.valid) return;
    result_.within_rate_limits = within_rate_limits(shot);
    // Terms that depend on the path are unknown here.
    constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
    result_.objective = problem_.objective.depends_on_end_alone() ? objective(shot) : kUnknown;
    for (const Objective::Term& t : problem_.objective.terms()) {
      result_.terms.push_back(Objective::depends_on_end_alone(t.kind)
                                  ? problem_.objective.term(t, base_, problem_.goals, shot.position, shot.rate, nullptr)
                                  : kUnknown);
    }
    result_.smallest_singular_value = smallest_singular_value(shot.J);
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
