#include "grapnel/approach/approach_plan.hpp"

#include <fmt/format.h>

#include "grapnel/approach/plan_report.hpp"
#include "grapnel/approach/plan_simulation.hpp"
#include "grapnel/approach/planning_setup.hpp"
#include "grapnel/approach/segment_solution.hpp"
#include "grapnel/approach/straight_in_plan.hpp"

namespace grapnel {
namespace {

// Stated motion of all joints => draft up to the end of the approach.
void follow_stated(const ApproachSetup& approach, PlanDraft& draft) {
  const auto stated = [&](std::size_t joint) {
    if (!approach.sampled) return trajectory_of(approach.pieces, joint);
    const SampledMotion& s = *approach.sampled;
    return interpolate_samples(s.times, s.positions[joint],
                               s.rates.empty() ? std::span<const double>{} : std::span(s.rates[joint]));
  };
  for (std::size_t j = 0; j < draft.plan.joints.size(); ++j) {
    draft.plan.joints[j] = stated(j);
    const JointPoint end = evaluate(draft.plan.joints[j], approach.duration);
    draft.position[j] = end.position, draft.rate[j] = end.rate;
  }
}

// Waypoint => segment to it: to its joints and rates, or to joints that bring the end-effectors to its positions and
// linear velocities, in W or in a target's frame at that time. Throws Unplannable.
void pass(PlanningTask& task, PlanDraft& draft, const Waypoint& w) {
  if (!w.joints.empty() || w.places.empty()) {
    advance(task, draft, w.time, {w.joints, w.rates ? *w.rates : std::vector<double>(w.joints.size(), 0.0)});
    return;
  }
  std::vector<Goal> goals;
  for (const Waypoint::Place& place : w.places) {
    Goal g;
    g.frame = task.servicer.model.frame_index(place.end_effector);
    g.name = place.end_effector;
    TargetMotion frame{Posed::identity(), Twistd::zero()};
    if (!place.target.empty()) frame = task.target_at(target_index(task.problem, place.target), w.time);
    g.X_WG = frame.X_WT * Posed{Rotationd::identity(), place.position};
    g.V_WG = shift(frame.V_WT, frame.X_WT.R * place.position);
    g.V_WG.linear += frame.X_WT.R * place.velocity;
    goals.push_back(g);
  }
  const ReachProblem reach = reach_to(task, draft, w.time, std::move(goals), RateDemand::linear);
  const std::string what = fmt::format(", waypoint at t = {:.6g} s", w.time);
  ReachSolution s = solve_where_loads_lead(task, draft, reach, what);
  if (disturbed(task)) s = allow_for_disturbance(task, draft, reach, s, what);
  advance(task, draft, w.time, {s.position, s.rate});
}

// End time => last segment to the grasp points: a search if approach.plan exists, otherwise stated final joints with
// rates by (6.4). Forward simulations correct both if disturbances act. Throws Unplannable.
void final_segment(PlanningTask& task, PlanDraft& draft, double end) {
  const ApproachSetup& approach = task.approach;
  ReachProblem reach =
      reach_to(task, draft, end, capture_goals(task.problem, task.servicer.model, task.targets), rate_demand(approach));
  if (approach.final_rates) reach.given_rates = *approach.final_rates;
  if (!approach.plan) {
    const std::vector<double>& position = approach.final_position;
    advance(task, draft, end, {position, settled_rates(task, draft, reach, position)});
    return;
  }
  apply_plan_setup(task, draft, reach);
  ReachSolution s = solve_where_loads_lead(task, draft, reach, "");
  if (s.approximate) warn_of_approximation(reach, s, draft.plan);
  if (disturbed(task) && !s.approximate) s = allow_for_disturbance(task, draft, reach, s, "");
  report(task, draft, reach, s);
  warn_of_rates(task, draft, s.rate, s.unmet_rate, end);
  advance(task, draft, end, values_of(s));
}

// Task => draft of the whole approach: stated trajectories, or one segment per waypoint, then the final segment or the
// stand-off with the final straight approach. Throws Unplannable.
void plan_motion(PlanningTask& task, PlanDraft& draft) {
  const ApproachSetup& approach = task.approach;
  if (approach.sampled || !approach.pieces.empty()) return follow_stated(approach, draft);
  for (const Waypoint& w : approach.waypoints) pass(task, draft, w);
  if (approach.straight_in) {
    plan_straight_approach(task, draft, approach.duration - approach.straight_in->duration);
  } else {
    final_segment(task, draft, approach.duration);
  }
  if (approach.plan) warn_of_thrusters(task, draft.plan);
}

// Message if the evaluation limit is reached, with possible remedies.
std::string given_up(const PlanningTask& task, const PlanDraft& draft) {
  const PlanSetup plan = task.approach.plan.value_or(PlanSetup{});
  return fmt::format(
      "planning the approach: evaluation limit reached after {} evaluations of the servicer's motion, in the segment "
      "that begins at t = {:.6g} s; the approach lasts {:.6g} s, and longer segments increase the joint motion and the "
      "cost of each of the search's {} initial guesses: shorten the last segment (waypoints, straight_in), reduce "
      "approach.plan.starts, set approach.plan.objective: as_found, or increase approach.plan.max_evaluations",
      plan.max_evaluations, draft.time, task.approach.duration, plan.starts);
}

}  // namespace

// Problem, target motion and begin => plan; a failed search or an exceeded evaluation limit becomes its `failure`.
// Other exceptions pass.
ApproachPlan plan_approach(const CaptureProblem& problem, const TargetPlan& targets, CaptureDetail detail,
                           const CaptureProgress& progress, double begin) {
  PlanningTask task(problem, targets, detail, progress, begin);
  PlanDraft draft = begin_draft(task);
  report_contacts(task, draft.plan);
  try {
    plan_motion(task, draft);
  } catch (const Unplannable& error) {
    draft.plan.failure = error.what();
  } catch (const WorkLimit&) {
    draft.plan.failure = given_up(task, draft);
  }
  draft.plan.report.final_position = draft.position;
  draft.plan.report.final_rates = draft.rate;
  draft.plan.report.rhs_evaluations = task.rhs_evaluations;
  return std::move(draft.plan);
}

// Problem whose joint motion is fully stated => its trajectories (6.1) without planning; empty if the approach needs a
// plan.
std::optional<ApproachPlan> stated_approach(const CaptureProblem& problem, const CaptureSystem& system) {
  const ApproachSetup& a = *problem.approach;
  if (a.plan || a.sampled || a.match || a.straight_in || !a.waypoints.empty()) return {};
  const std::size_t n = system.robot_joints.size();
  const auto at = [](const std::vector<double>& values, std::size_t j) { return values.empty() ? 0.0 : values[j]; };
  ApproachPlan plan;
  if (a.pieces.empty()) {
    plan.report.final_position = a.final_position;
    plan.report.final_rates = a.final_rates ? *a.final_rates : std::vector<double>(n, 0.0);
  }
  for (std::size_t j = 0; j < n; ++j) {
    plan.report.joints.push_back(
        system.model.bodies()[system.model.joints()[system.robot_joints[j]]].description.joint.name);
    if (!a.pieces.empty()) {
      plan.joints.push_back(trajectory_of(a.pieces, j));
      const JointPoint end = evaluate(plan.joints.back(), a.duration);
      plan.report.final_position.push_back(end.position), plan.report.final_rates.push_back(end.rate);
      continue;
    }
    plan.joints.emplace_back(0.0, JointPath{a.profile, a.duration, problem.joint_position[j], a.final_position[j],
                                            at(problem.joint_rate, j), plan.report.final_rates[j]});
  }
  return plan;
}

}  // namespace grapnel
