/// The stand-off of a final straight approach, from which it satisfies the path constraints.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>

#include "grapnel/approach/plan_report.hpp"
#include "grapnel/approach/planning_setup.hpp"
#include "grapnel/approach/segment_solution.hpp"
#include "grapnel/approach/straight_in_plan.hpp"
#include "grapnel/plan/constrained_straight_in.hpp"
#include "grapnel/plan/shooting.hpp"

namespace grapnel {
namespace {

// Combines the figures of two parts of a path.
PathFigures both(const PathFigures& a, const PathFigures& b) {
  PathFigures f = a;
  f.position_margin = std::min(a.position_margin, b.position_margin);
  f.rate_share = std::max(a.rate_share, b.rate_share);
  if (b.effort_share) f.effort_share = std::max(a.effort_share.value_or(0), *b.effort_share);
  if (b.clearance.distance < a.clearance.distance) f.clearance = b.clearance, f.clearance_time = b.clearance_time;
  f.base_turn = std::max(a.base_turn, b.base_turn);
  for (std::size_t i = 0; i < f.wheel_share.size() && i < b.wheel_share.size(); ++i)
    f.wheel_share[i] = std::max(a.wheel_share[i], b.wheel_share[i]);
  return f;
}

// In [-1, 1]; not the library's distributions, whose numbers differ from one standard library to the next.
double random_number(std::mt19937_64& generator) {
  return std::ldexp(static_cast<double>(generator() >> 11), -53) * 2 - 1;
}

// A stand-off configuration and the final straight approach from it.
struct StandOff {
  ReachSolution solution;
  ConstrainedStraightIn straight_in;
};

StandOff try_stand_off(PlanningTask& task, StraightInProblem in, const ReachProblem& reach, ReachSolution solution) {
  in.position = solution.position, in.X_WB = solution.X_WB;
  in.rate_begin = solution.rate;
  StandOff result{std::move(solution), constrain_straight_in(task.base, in, reach)};
  task.rhs_evaluations += result.straight_in.rhs_evaluations;
  return result;
}

// Guess => nearest stand-off configuration and its straight approach. The path to it is planned only if that approach
// is feasible. Empty if no configuration was found.
std::optional<StandOff> stand_off_near(PlanningTask& task, StraightInProblem in, const ReachProblem& reach,
                                       const std::vector<double>& guess, int starts) {
  ReachProblem near = reach;
  near.starts = starts;
  const auto plan = [&](const std::vector<double>& from) -> std::optional<StandOff> {
    near.guess = from;
    near.objective = Objective(Objective::Kind::nearest, reach.start, from, reach.lower, reach.upper);
    ReachSolution solution = plan_reach(task.base, near);
    task.rhs_evaluations += solution.rhs_evaluations;
    if (!solution.found || solution.approximate) return std::nullopt;
    return try_stand_off(task, in, reach, std::move(solution));
  };
  // The path to the stand-off is the most expensive part; it is planned once the straight approach is feasible.
  near.constraints = {};
  const std::optional<StandOff> bare = plan(guess);
  if (!bare || !bare->straight_in.failure.empty()) return bare;
  near.constraints = reach.constraints;
  in.self_motion = bare->straight_in.self_motion;
  return plan(bare->solution.position);
}

// Stand-off whose straight approach violates constraints => the one nearest to the start that its linearization
// proposes.
std::optional<StandOff> constrained_stand_off(PlanningTask& task, StraightInProblem in, const ReachProblem& reach,
                                              const StandOff& from) {
  in.position = from.solution.position, in.X_WB = from.solution.X_WB;
  const StartFreedom freedom = start_freedom(task.base, reach, from.solution);
  if (freedom.position.cols() == 0) return std::nullopt;
  const ConstrainedStraightIn result = constrain_straight_in(task.base, in, reach, &freedom);
  task.rhs_evaluations += result.rhs_evaluations;
  if (result.start.empty()) return std::nullopt;
  std::vector<double> guess = result.start;
  for (std::size_t j = 0; j < guess.size(); ++j) guess[j] = std::clamp(guess[j], reach.lower[j], reach.upper[j]);
  in.self_motion = result.self_motion;
  return stand_off_near(task, in, reach, guess, 1);
}

// Evaluates the objective at a solution that another objective selected.
void take_objective(PlanningTask& task, const ReachProblem& reach, ReachSolution& solution) {
  ReachProblem with_knots = reach;
  with_knots.start.knots = solution.knots;
  Shooting shooting(task.base, with_knots);
  const ShootingIterate iterate =
      shooting.shoot(solution.position, solution.rate, SegmentAccuracy::full, solution.coefficients);
  const ConstrainedSolution end = solve_with_path_constraints(task.base, reach, iterate, solution.knots, kAsItIs);
  task.rhs_evaluations += end.rhs_evaluations + shooting.rhs_evaluations();
  solution.objective = end.objective, solution.terms = end.terms;
}

// Best attempt => report of it, and Unplannable with the violated constraint and possible remedies.
[[noreturn]] void refuse_straight_in(const PlanningTask& task, PlanDraft& draft, const StraightInProblem& in,
                                     const ReachProblem& reach, const StandOff& best, int tried) {
  report(task, draft, reach, best.solution);
  draft.plan.report.found = false;
  const bool is_free = best.straight_in.self_motions > 0;
  throw Unplannable(fmt::format(
      "planning the approach, straight in: the end-effectors arrive, but no joint motion was found that satisfies the "
      "path constraints of approach.plan from t = {:.4g} s on; from the best of {} configurations at the stand-off "
      "{}{}; {}",
      in.begin, tried, best.straight_in.failure,
      is_free
          ? ""
          : "; the motion cannot be changed, because no joint is redundant (as many conditions of the end-effectors "
            "as joints that move them)",
      is_free ? "a longer straight_in.duration, a shorter stand_off or another guess may help"
              : "orientation: axis or free, roll: free, a longer straight_in.duration, a shorter stand_off or another "
                "guess may help"));
}

// Stand-off of the search => stand-off from which the straight approach satisfies (6.9c): the same one, others proposed
// by its linearization, or near random configurations. Throws Unplannable with the smallest violation.
StandOff enforce_path_constraints(PlanningTask& task, PlanDraft& draft, StraightInProblem in, const ReachProblem& reach,
                                  ReachSolution solution) {
  constexpr int kElsewhere = 6, kEnough = 2, kEnoughFar = 1;
  int tried = 1, elsewhere = 0;
  const std::vector<double> chosen = solution.position;
  const long before = task.rhs_evaluations;
  const auto much = [&] {
    constexpr long kMuch = 550'000;  // evaluations times joints: more than half a second
    return (task.rhs_evaluations - before) * task.base.joints() > kMuch;
  };
  StandOff best = try_stand_off(task, in, reach, std::move(solution));
  std::optional<StandOff> now = best;
  // Segments through a singularity take more steps; one such result is sufficient.
  constexpr long kFewSteps = 2000;
  in.max_steps = std::min<std::int64_t>(in.max_steps, kFewSteps);
  std::mt19937_64 generator(reach.seed);
  for (int i = 0; !best.straight_in.feasible; ++i) {
    // The straight approach proposes its initial state.
    constexpr int kNearer = 3;
    constexpr double kNoNearer = 0.9;
    for (int k = 0; now && !now->straight_in.feasible && k < kNearer && !(i >= kEnough && much()); ++k) {
      const double violation = now->straight_in.violation;
      now = constrained_stand_off(task, in, reach, *now);
      if (!now) break;
      ++tried;
      if (now->straight_in.feasible || now->straight_in.violation < best.straight_in.violation) best = *now;
      if (now->straight_in.violation > kNoNearer * violation) break;
    }
    // If the violation is still large after this number of attempts or amount of work, the search ends.
    constexpr double kFar = 0.1;
    const bool far = best.straight_in.violation > kFar;
    if (best.straight_in.feasible || i == kElsewhere || (far && elsewhere >= kEnoughFar) || (i >= kEnough && much()))
      break;
    // Other configurations: random changes of the grasping arms, larger with every attempt.
    std::vector<double> guess = chosen;
    for (std::size_t j = 0; j < guess.size(); ++j) {
      constexpr double kFarther = 0.5;  // increment per attempt [rad or m]
      const double shift = kFarther * (i + 1) * random_number(generator);
      const bool grasps = std::any_of(reach.goals.begin(), reach.goals.end(),
                                      [&](const Goal& g) { return task.base.carries(static_cast<int>(j), g.frame); });
      if (grasps) guess[j] = std::clamp(guess[j] + shift, reach.lower[j], reach.upper[j]);
    }
    now = stand_off_near(task, in, reach, guess, 4);
    if (!now) continue;
    ++tried, ++elsewhere;
    if (now->straight_in.feasible || now->straight_in.violation < best.straight_in.violation) best = *now;
  }
  // A segment within its limits that passes a singularity is accepted, with a warning.
  if (!best.straight_in.feasible && !best.straight_in.failure.empty())
    refuse_straight_in(task, draft, in, reach, best, tried);
  if (tried > 1) take_objective(task, reach, best.solution);
  best.solution.figures = both(best.solution.figures.value_or(PathFigures{}), best.straight_in.figures);
  return best;
}

}  // namespace

PlannedStandOff plan_stand_off(PlanningTask& task, PlanDraft& draft, StraightInProblem& in,
                               const std::vector<double>& guess) {
  ReachProblem reach = reach_to(task, draft, in.begin, goals_at(in, in.targets, in.begin), RateDemand::task);
  apply_plan_setup(task, draft, reach);
  if (!guess.empty()) reach.guess = guess, reach.starts = 1;
  ReachSolution s = solve_segment(task, draft, reach, ", stand-off");
  in.self_motion = {};
  if (reach.constraints.has_constraints()) {
    StandOff constrained = enforce_path_constraints(task, draft, in, reach, std::move(s));
    s = std::move(constrained.solution);
    in.self_motion = constrained.straight_in.self_motion;
  }
  report(task, draft, reach, s);
  return {std::move(reach), std::move(s)};
}

}  // namespace grapnel
