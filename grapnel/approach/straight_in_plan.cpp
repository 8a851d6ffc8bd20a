#include "grapnel/approach/straight_in_plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "grapnel/approach/plan_report.hpp"
#include "grapnel/approach/plan_simulation.hpp"
#include "grapnel/approach/predicted_contacts.hpp"
#include "grapnel/approach/segment_solution.hpp"
#include "grapnel/approach/straight_in_simulations.hpp"

namespace grapnel {
namespace {

// Minimum simulated error that triggers a warning [m, rad and their rates].
constexpr double kReported = 1e-7;

// Root mean square over the segment, of all joints together: the terms are orthonormal.
double norm_of(const SelfMotion& z) {
  return std::sqrt(std::inner_product(z.coefficients.begin(), z.coefficients.end(), z.coefficients.begin(), 0.0));
}

// Planned straight approach => errors in the report. Above 1 mm or 1 mrad throws Unplannable with the cause: a
// singularity or a demand that the joints cannot meet; above 1e-9 a warning.
void require_arrival(const StraightInPath& path, ApproachPlan& plan) {
  constexpr double kMissed = 1e-3;  // [m and rad]; a smaller error gives a warning
  report_gaps(path.gaps, plan.report);
  double largest = 0;
  std::string text;
  for (std::size_t i = 0; i < path.gaps.size(); ++i) {
    const double distance = norm(path.gaps[i].position), angle = norm(path.gaps[i].turn);
    largest = std::max({largest, distance, angle});
    if (distance <= kMissed && angle <= kMissed) continue;
    text += fmt::format("{}end-effector '{}' ends {:.4g} m and {:.4g} rad from its grasp point",
                        text.empty() ? "" : "; ", plan.report.miss[i].end_effector, distance, angle);
  }
  if (text.empty()) {
    if (largest > 1e-9) {
      plan.warnings.push_back(fmt::format(
          "approach: straight in, the final errors of the end-effectors are up to {:.3g} m or rad", largest));
    }
    return;
  }
  plan.report.found = false;
  throw Unplannable(fmt::format(
      "planning the approach, straight in: {}: {}", text,
      path.damped ? fmt::format("its arm reaches a singularity of the generalized Jacobian at t = {:.4g} s (for "
                                "example, fully extended) and cannot move beyond it; a shorter stand_off or another "
                                "initial configuration of the arm (initial.joints, plan.guess) may help",
                                path.damped_begin)
                  : std::string("its joints cannot produce the demanded motion; a longer duration, orientation: free "
                                "or another approach_direction may help")));
}

// Planned straight approach => its segments in the draft, joints and rates at its end, report, and warnings of damped
// singularities (6.9) and unmet demands. Throws Unplannable if it failed.
void take_straight_in(PlanningTask& task, PlanDraft& draft, const StraightInProblem& in, const StraightInPath& path) {
  task.rhs_evaluations += path.rhs_evaluations;
  if (!path.finished) throw Unplannable("planning the approach, straight in: " + path.failure);
  require_arrival(path, draft.plan);
  for (std::size_t j = 0; j < draft.plan.joints.size(); ++j) {
    auto& segments = draft.plan.joints[j].segments;
    segments.insert(segments.end(), path.joints[j].segments.begin(), path.joints[j].segments.end());
    draft.position[j] = evaluate(draft.plan.joints[j], in.end).position;
  }
  draft.rate = path.rate_end;
  draft.plan.report.straight_in =
      StraightInReport{in.begin,        in.stand_off,      in.final_speed,         path.smallest_singular_value,
                       path.damped,     path.damped_begin, path.damped_end,        path.unmet,
                       path.unmet_time, path.fit_error,    norm_of(in.self_motion)};
  if (path.damped) {
    draft.plan.warnings.push_back(
        fmt::format("approach: straight in, the arms pass a singularity of the generalized Jacobian between t = {:.4g} "
                    "and {:.4g} s (smallest singular value {:.3g}); joint rates are damped there and the demanded "
                    "motion is missed by up to {:.3g} (m/s or rad/s)",
                    path.damped_begin, path.damped_end, path.smallest_singular_value, path.unmet));
  } else if (path.unmet > 1e-9) {
    draft.plan.warnings.push_back(
        fmt::format("approach: straight in, the joints cannot produce the demanded motion; up to {:.3g} (m/s or rad/s) "
                    "is unmet, at t = {:.4g} s",
                    path.unmet, path.unmet_time));
  }
}

// Straight approach => motion to the stand-off and the final straight approach in the draft; returns its final errors.
// `guess`: as for plan_stand_off().
Gaps come_in(PlanningTask& task, PlanDraft& draft, StraightInProblem& in, const std::vector<double>& guess) {
  const ReachSolution s = plan_stand_off(task, draft, in, guess).solution;
  advance(task, draft, in.begin, values_of(s));
  in.position = draft.position, in.X_WB = draft.X_WB;
  in.rate_begin = s.rate;  // exactly, so that rates are continuous between segments
  StraightInPath path = plan_straight_in(task.base, in);
  take_straight_in(task, draft, in, path);
  return std::move(path.gaps);
}

// Message: for each demanded quantity the largest error over the end-effectors.
std::string in_words(const std::vector<GoalGap>& gaps) {
  GoalGap largest;
  const auto larger = [](Vector3d& result, const Vector3d& v) {
    if (norm(v) > norm(result)) result = v;
  };
  for (const GoalGap& gap : gaps) {
    larger(largest.position, gap.position), larger(largest.turn, gap.turn);
    larger(largest.velocity, gap.velocity), larger(largest.spin, gap.spin);
  }
  std::vector<std::string> missed;
  const auto append = [&](const Vector3d& v, const char* what) {
    if (norm(v) > kReported) missed.push_back(fmt::format("{:.2g} {}", norm(v), what));
  };
  append(largest.position, "m from their grasp points");
  append(largest.turn, "rad from the demanded orientation");
  append(largest.velocity, "m/s from the demanded relative velocity");
  append(largest.spin, "rad/s from the demanded relative angular velocity");
  return fmt::format("{}", fmt::join(missed, ", "));
}

// Subtracts the errors from the goals, in the targets' frames.
void shift_goals(const PlanningTask& task, const Gaps& gaps, StraightInProblem& in) {
  for (std::size_t g = 0; g < gaps.size(); ++g) {
    StraightGoal& goal = in.goals[g];
    const Rotationd& R_WT = task.targets.capture[static_cast<std::size_t>(goal.target)].X_WT.R;
    goal.X_TG.p = goal.X_TG.p - transposed_times(R_WT, gaps[g].position);
    goal.turn_T = goal.turn_T - transposed_times(R_WT, gaps[g].turn);
    goal.velocity_T = goal.velocity_T - transposed_times(R_WT, gaps[g].velocity);
    goal.spin_T = goal.spin_T - transposed_times(R_WT, gaps[g].spin);
  }
}

// Straight approach of a flexible robot => plan of the rigid robot whose simulation has the demanded final values; the
// errors are subtracted from the goals in the targets' frames (22.10). Warns of the deflection on the path.
void come_in_bending(PlanningTask& task, PlanDraft& draft, StraightInProblem& in) {
  constexpr int kMaxCorrections = 12;
  const StraightInProblem meant = in;
  std::vector<double> guess;
  const auto plan = [&] {
    Gaps left = come_in(task, draft, in, guess);
    guess = in.position;
    return left;
  };
  const auto simulate_plan = [&] { return simulated_gaps(task, meant, simulate(task, draft.plan.joints, in.end)); };
  const auto correct = [&](const Gaps& gaps) { shift_goals(task, gaps, in); };
  const std::string missed =
      in_words(correct_by_simulations(draft, {plan, simulate_plan, correct}, kMaxCorrections).gaps);
  draft.plan.warnings.push_back(fmt::format(
      "approach: straight_in brings the end-effectors of the flexible robot to {} at its end; it is planned for a "
      "rigid robot, and the path of the end-effectors differs by the deflection{}",
      missed.empty() ? "the demanded poses and velocities" : "up to " + missed,
      draft.plan.report.path ? "; the same holds for joint limits and other path constraints, which the run checks"
                             : ""));
}

void warn_of_simulated_miss(const PlanningTask& task, const SimulatedErrors& errors, ApproachPlan& plan) {
  const std::string missed = in_words(errors.gaps);
  if (missed.empty()) return;
  plan.warnings.push_back(
      fmt::format("approach: straight_in, simulated under {}, leaves the end-effectors up to {}, and corrections do "
                  "not reduce this: {}",
                  disturbances(task), missed,
                  errors.beside > kReported ? "each correction changes the loads by more than it compensates"
                                            : "the joints cannot produce the required motion"));
}

// Straight approach under disturbances => plan whose simulation has final errors (6.9d) within tolerance: momentum and
// target motion of each simulation enter the next plan; remaining errors are subtracted from the demands.
void come_in_simulated(PlanningTask& task, PlanDraft& draft, StraightInProblem& in) {
  constexpr int kMaxCorrections = 14;
  PlannedStandOff planned = plan_stand_off(task, draft, in, {});
  const ReachProblem& reach = planned.reach;
  const ReachSolution s = allow_for_disturbance(task, draft, reach, std::move(planned.solution), ", stand-off");
  report(task, draft, reach, s);
  in.position = s.position, in.rate_begin = s.rate;
  const State there = planned_state(task, simulate_segment(task, draft, reach, values_of(s)));
  in.X_WB = root_pose(task.servicer.model, there, task.servicer.base);
  auto around = std::make_shared<StraightInSurroundings>();
  const FreeMotion as_it_begins = free_motion(task.servicer.model, there, in.begin, task.problem.gravity);
  const Vector3d w_B = turn_beside(task, there);
  around->motion = [as_it_begins](double) { return as_it_begins; };
  around->w_B = [w_B](double) { return w_B; };
  if (targets_loaded(task) || task.problem.orbit || touches_after(task.targets, in.begin))
    around->targets = targets_over(task, in);
  in.surroundings = around;
  const StraightInProblem meant = in;
  const auto plan = [&] {
    advance(task, draft, in.begin, values_of(s));
    StraightInPath path = plan_straight_in(task.base, in);
    take_straight_in(task, draft, in, path);
    return std::move(path.gaps);
  };
  const auto simulate_plan = [&] {
    around = std::make_shared<StraightInSurroundings>(*around);
    return simulate_approach(task, draft, meant, *around);
  };
  double before = std::numeric_limits<double>::infinity();
  const auto correct = [&](const Gaps& gaps) {
    in.surroundings = around;
    // Corrections of the goals compensate inaccuracies of the series, for example at a sudden change of a load.
    constexpr double kNoGain = 0.9;
    const double now = largest_of(gaps);
    if (now > kNoGain * before) shift_goals(task, gaps, in);
    before = now;
  };
  warn_of_simulated_miss(task, correct_by_simulations(draft, {plan, simulate_plan, correct}, kMaxCorrections),
                         draft.plan);
}

}  // namespace

void plan_straight_approach(PlanningTask& task, PlanDraft& draft, double begin) {
  const StraightIn& setup = *task.approach.straight_in;
  StraightInProblem in;
  in.begin = begin, in.end = task.approach.duration;
  in.motion = task.motion, in.gravity = task.problem.gravity;
  in.max_steps = task.problem.integration.max_steps;
  in.stand_off = setup.stand_off, in.final_speed = setup.final_speed;
  for (std::size_t t = 0; t < task.problem.targets.size(); ++t) {
    const TargetMotion at = task.target_at(t, begin);
    in.targets.push_back({at.X_WT, at.V_WT, task.problem.targets[t].com, task.problem.targets[t].inertia});
  }
  in.goals = straight_goals(task.problem, task.servicer.model);
  if (touches_after(task.targets, begin))
    draft.plan.warnings.push_back(fmt::format(
        "approach: targets touch during the final straight approach, which begins at t = {:.6g} s; the end-effectors "
        "follow the jumps of their velocities: let it begin after the contact by a shorter straight_in.duration, or "
        "choose another capture time",
        begin));
  if (bends(task)) {
    come_in_bending(task, draft, in);
  } else if (disturbed(task) || targets_loaded(task) || touches_after(task.targets, begin)) {
    come_in_simulated(task, draft, in);
  } else {
    come_in(task, draft, in, {});
  }
}

}  // namespace grapnel
