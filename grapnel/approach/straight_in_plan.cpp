/// The final straight approach: planning to the stand-off, then along the approach direction in the tumbling target's
/// frame.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "grapnel/approach/approach_planner.hpp"
#include "grapnel/approach/predicted_contacts.hpp"
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

// Root mean square over the segment, of all joints together: the terms are orthonormal.
double norm_of(const SelfMotion& z) {
  return std::sqrt(std::inner_product(z.coefficients.begin(), z.coefficients.end(), z.coefficients.begin(), 0.0));
}

// In [-1, 1]; not the library's distributions, whose numbers differ from one standard library to the next.
double random_number(std::mt19937_64& generator) {
  return std::ldexp(static_cast<double>(generator() >> 11), -53) * 2 - 1;
}

}  // namespace

// Time of the stand-off => segment to it and the final straight approach (docs/theory, section 6.3); disturbances and
// flexible links are compensated by simulations. Throws Unplannable.
void ApproachPlanner::stand_off_and_in(double begin) {
  const StraightIn& setup = *approach_.straight_in;
  StraightInProblem in;
  in.begin = begin, in.end = approach_.duration;
  in.motion = motion_, in.gravity = problem_.gravity;
  in.max_steps = problem_.integration.max_steps;
  in.stand_off = setup.stand_off, in.final_speed = setup.final_speed;
  for (std::size_t t = 0; t < problem_.targets.size(); ++t) {
    const TargetMotion at = target_at(t, begin);
    in.targets.push_back({at.X_WT, at.V_WT, problem_.targets[t].com, problem_.targets[t].inertia});
  }
  in.goals = straight_goals(problem_, servicer_.model);
  if (touches_after(targets_, begin))
    plan_.warnings.push_back(fmt::format(
        "approach: targets touch during the final straight approach, which begins at t = {:.6g} s; the end-effectors "
        "follow the jumps of their velocities: let it begin after the contact by a shorter straight_in.duration, or "
        "choose another capture time",
        begin));
  if (bends()) {
    come_in_bending(in);
  } else if (disturbed() || targets_loaded() || touches_after(targets_, begin)) {
    come_in_simulated(in);
  } else {
    come_in(in, {});
  }
}

// Straight approach and guess => joints at the stand-off and the problem they solve; with path constraints also the
// self-motion (6.9a) of the straight approach, stored in `in`. Throws Unplannable.
ApproachPlanner::PlannedStandOff ApproachPlanner::plan_stand_off(StraightInProblem& in,
                                                                 const std::vector<double>& guess) {
  ReachProblem reach = reach_to(in.begin, goals_at(in, in.targets, in.begin), RateDemand::task);
  set_search(reach);
  if (!guess.empty()) reach.guess = guess, reach.starts = 1;
  ReachSolution s = solve(reach, ", stand-off");
  in.self_motion = {};
  if (reach.constraints.has_constraints()) {
    StandOff constrained = enforce_path_constraints(in, reach, std::move(s));
    s = std::move(constrained.solution);
    in.self_motion = constrained.straight_in.self_motion;
  }
  report(reach, s);
  return {std::move(reach), std::move(s)};
}

std::vector<GoalGap> ApproachPlanner::come_in(StraightInProblem& in, const std::vector<double>& guess) {
  const ReachSolution s = plan_stand_off(in, guess).solution;
  advance(in.begin, s.position, s.rate, s.knots, s.coefficients);
  in.position = position_, in.X_WB = X_WB_;
  in.rate_begin = s.rate;  // exactly, so that rates are continuous between segments
  StraightInPath path = plan_straight_in(base_, in);
  take_straight_in(in, path);
  return std::move(path.gaps);
}

ApproachPlanner::StandOff ApproachPlanner::try_stand_off(StraightInProblem in, const ReachProblem& reach,
                                                         ReachSolution solution) {
  in.position = solution.position, in.X_WB = solution.X_WB;
  in.rate_begin = solution.rate;
  StandOff result{std::move(solution), constrain_straight_in(base_, in, reach)};
  plan_.report.rhs_evaluations += result.straight_in.rhs_evaluations;
  return result;
}

// Stand-off of the search => stand-off from which the straight approach satisfies (6.9c): the same one, others proposed
// by its linearization, or near random configurations. Throws Unplannable with the smallest violation.
ApproachPlanner::StandOff ApproachPlanner::enforce_path_constraints(StraightInProblem in, const ReachProblem& reach,
                                                                    ReachSolution solution) {
  constexpr int kElsewhere = 6, kEnough = 2, kEnoughFar = 1;
  int tried = 1, elsewhere = 0;
  const std::vector<double> chosen = solution.position;
  const long before = plan_.report.rhs_evaluations;
  const auto much = [&] {
    constexpr long kMuch = 550'000;  // evaluations times joints: more than half a second
    return (plan_.report.rhs_evaluations - before) * base_.joints() > kMuch;
  };
  StandOff best = try_stand_off(in, reach, std::move(solution));
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
      now = constrained_stand_off(in, reach, *now);
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
                                      [&](const Goal& g) { return base_.carries(static_cast<int>(j), g.frame); });
      if (grasps) guess[j] = std::clamp(guess[j] + shift, reach.lower[j], reach.upper[j]);
    }
    now = stand_off_near(in, reach, guess, 4);
    if (!now) continue;
    ++tried, ++elsewhere;
    if (now->straight_in.feasible || now->straight_in.violation < best.straight_in.violation) best = *now;
  }
  // A segment within its limits that passes a singularity is accepted, with a warning.
  if (!best.straight_in.feasible && !best.straight_in.failure.empty()) refuse_straight_in(in, reach, best, tried);
  if (tried > 1) take_objective(reach, best.solution);
  best.solution.figures = both(best.solution.figures.value_or(PathFigures{}), best.straight_in.figures);
  return best;
}

std::optional<ApproachPlanner::StandOff> ApproachPlanner::constrained_stand_off(StraightInProblem in,
                                                                                const ReachProblem& reach,
                                                                                const StandOff& from) {
  in.position = from.solution.position, in.X_WB = from.solution.X_WB;
  const StartFreedom freedom = start_freedom(base_, reach, from.solution);
  if (freedom.position.cols() == 0) return std::nullopt;
  const ConstrainedStraightIn result = constrain_straight_in(base_, in, reach, &freedom);
  plan_.report.rhs_evaluations += result.rhs_evaluations;
  if (result.start.empty()) return std::nullopt;
  std::vector<double> guess = result.start;
  for (std::size_t j = 0; j < guess.size(); ++j) guess[j] = std::clamp(guess[j], reach.lower[j], reach.upper[j]);
  in.self_motion = result.self_motion;
  return stand_off_near(in, reach, guess, 1);
}

// Guess => nearest stand-off configuration and its straight approach. The path to it is planned only if that approach
// is feasible. Empty if no configuration was found.
std::optional<ApproachPlanner::StandOff> ApproachPlanner::stand_off_near(StraightInProblem in,
                                                                         const ReachProblem& reach,
                                                                         const std::vector<double>& guess, int starts) {
  ReachProblem near = reach;
  near.starts = starts;
  const auto plan = [&](const std::vector<double>& from) -> std::optional<StandOff> {
    near.guess = from;
    near.objective = Objective(Objective::Kind::nearest, reach.start, from, reach.lower, reach.upper);
    ReachSolution solution = plan_reach(base_, near);
    plan_.report.rhs_evaluations += solution.rhs_evaluations;
    if (!solution.found || solution.approximate) return std::nullopt;
    return try_stand_off(in, reach, std::move(solution));
  };
  // The path to the stand-off is the most expensive part; it is planned once the straight approach is feasible.
  near.constraints = {};
  const std::optional<StandOff> bare = plan(guess);
  if (!bare || !bare->straight_in.failure.empty()) return bare;
  near.constraints = reach.constraints;
  in.self_motion = bare->straight_in.self_motion;
  return plan(bare->solution.position);
}

void ApproachPlanner::take_objective(const ReachProblem& reach, ReachSolution& solution) {
  ReachProblem with_knots = reach;
  with_knots.start.knots = solution.knots;
  Shooting shooting(base_, with_knots);
  const ShootingIterate iterate =
      shooting.shoot(solution.position, solution.rate, SegmentAccuracy::full, solution.coefficients);
  const ConstrainedSolution end = solve_with_path_constraints(base_, reach, iterate, solution.knots, kAsItIs);
  plan_.report.rhs_evaluations += end.rhs_evaluations + shooting.rhs_evaluations();
  solution.objective = end.objective, solution.terms = end.terms;
}

// Best attempt => report of it, and Unplannable with the violated constraint and possible remedies.
void ApproachPlanner::refuse_straight_in(const StraightInProblem& in, const ReachProblem& reach, const StandOff& best,
                                         int tried) {
  report(reach, best.solution);
  plan_.report.found = false;
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

// Planned straight approach => errors in the report. Above 1 mm or 1 mrad throws Unplannable with the cause: a
// singularity or a demand that the joints cannot meet; above 1e-9 a warning.
void ApproachPlanner::require_arrival(const StraightInPath& path) {
  constexpr double kMissed = 1e-3;  // [m and rad]; a smaller error gives a warning
  report_gaps(path.gaps);
  double largest = 0;
  std::string text;
  for (std::size_t i = 0; i < path.gaps.size(); ++i) {
    const double distance = norm(path.gaps[i].position), angle = norm(path.gaps[i].turn);
    largest = std::max({largest, distance, angle});
    if (distance <= kMissed && angle <= kMissed) continue;
    text += fmt::format("{}end-effector '{}' ends {:.4g} m and {:.4g} rad from its grasp point",
                        text.empty() ? "" : "; ", plan_.report.miss[i].end_effector, distance, angle);
  }
  if (text.empty()) {
    if (largest > 1e-9) {
      plan_.warnings.push_back(fmt::format(
          "approach: straight in, the final errors of the end-effectors are up to {:.3g} m or rad", largest));
    }
    return;
  }
  plan_.report.found = false;
  throw Unplannable(fmt::format(
      "planning the approach, straight in: {}: {}", text,
      path.damped ? fmt::format("its arm reaches a singularity of the generalized Jacobian at t = {:.4g} s (for "
                                "example, fully extended) and cannot move beyond it; a shorter stand_off or another "
                                "initial configuration of the arm (initial.joints, plan.guess) may help",
                                path.damped_begin)
                  : std::string("its joints cannot produce the demanded motion; a longer duration, orientation: free "
                                "or another approach_direction may help")));
}

// Planned straight approach => its segments in plan_, joints and rates at its end, report, and warnings of damped
// singularities (6.9) and unmet demands. Throws Unplannable if it failed.
void ApproachPlanner::take_straight_in(const StraightInProblem& in, const StraightInPath& path) {
  plan_.report.rhs_evaluations += path.rhs_evaluations;
  if (!path.finished) throw Unplannable("planning the approach, straight in: " + path.failure);
  require_arrival(path);
  for (std::size_t j = 0; j < plan_.joints.size(); ++j) {
    auto& segments = plan_.joints[j].segments;
    segments.insert(segments.end(), path.joints[j].segments.begin(), path.joints[j].segments.end());
    position_[j] = evaluate(plan_.joints[j], in.end).position;
  }
  rate_ = path.rate_end;
  plan_.report.straight_in =
      StraightInReport{in.begin,        in.stand_off,      in.final_speed,         path.smallest_singular_value,
                       path.damped,     path.damped_begin, path.damped_end,        path.unmet,
                       path.unmet_time, path.fit_error,    norm_of(in.self_motion)};
  if (path.damped) {
    plan_.warnings.push_back(
        fmt::format("approach: straight in, the arms pass a singularity of the generalized Jacobian between t = {:.4g} "
                    "and {:.4g} s (smallest singular value {:.3g}); joint rates are damped there and the demanded "
                    "motion is missed by up to {:.3g} (m/s or rad/s)",
                    path.damped_begin, path.damped_end, path.smallest_singular_value, path.unmet));
  } else if (path.unmet > 1e-9) {
    plan_.warnings.push_back(
        fmt::format("approach: straight in, the joints cannot produce the demanded motion; up to {:.3g} (m/s or rad/s) "
                    "is unmet, at t = {:.4g} s",
                    path.unmet, path.unmet_time));
  }
}

}  // namespace grapnel
