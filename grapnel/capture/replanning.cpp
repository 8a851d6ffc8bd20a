#include "grapnel/capture/replanning.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "grapnel/approach/navigation.hpp"

namespace grapnel {
namespace {

// The last time at which the approach is replanned.
double last_replanning(const ApproachSetup& approach) {
  const double end = approach.duration - (approach.straight_in ? approach.straight_in->duration : 0);
  return approach.replan->until > 0 ? std::min(approach.replan->until, end) : end;
}

TargetMotion true_motion(const CaptureRun& run, std::size_t target) {
  const Model& model = run.bodies.system.model;
  const Kinematics k = forward_kinematics(model, run.bodies.state);
  const int frame = run.bodies.system.target_frames[target];
  return {frame_pose(model, k, frame), frame_twist(model, k, frame)};
}

}  // namespace

ApproachPlan plan_on_estimates(CaptureRun& run, const TargetPlan& truth) {
  if (!navigates(run.problem)) return plan_approach(run.problem, truth, run.detail, run.progress);
  const CaptureProblem estimated = estimated_problem(run.problem);
  const TargetPlan seems = plan_targets(estimated);
  ApproachPlan plan = plan_approach(estimated, seems, run.detail, run.progress);
  run.result.navigation.push_back({0, plan.failure.empty(), plan.report.rhs_evaluations,
                                   estimate_errors(run.problem, seems.start, truth.start), plan.failure});
  return plan;
}

double next_replanning(const CaptureRun& run, double now) {
  constexpr double kNever = std::numeric_limits<double>::infinity();
  if (!run.problem.approach || !run.problem.approach->replan || !run.joints.approaching() || !run.bodies.held.empty() ||
      !run.bodies.slips.empty())
    return kNever;
  const double every = run.problem.approach->replan->every, last = last_replanning(*run.problem.approach);
  double next = every * std::max(1.0, std::round(now / every));
  if (next <= now || GraspSchedule::is_now(next, now)) next = every * (std::round(now / every) + 1);
  return next < last && !GraspSchedule::is_now(next, last) ? next : kNever;
}

// Run at a replanning time => new references for the rest of the approach, planned for the targets that the last sensor
// readings predict (20.4); if the plan fails, the previous references remain. Both cases are reported. No effect at
// other times or with a held target.
void replan_if_due(CaptureRun& run) {
  const double now = run.bodies.time;
  if (!run.problem.approach->replan || !run.bodies.held.empty() || !run.bodies.slips.empty()) return;
  const double every = run.problem.approach->replan->every, nearest = every * std::round(now / every);
  if (nearest <= 0 || !GraspSchedule::is_now(nearest, now) || !(now < last_replanning(*run.problem.approach))) return;

  const CaptureProblem& problem = run.problem;
  std::vector<TargetMotion> truth, seems;
  TargetPlan targets;
  for (std::size_t t = 0; t < problem.targets.size(); ++t) {
    truth.push_back(true_motion(run, t));
    const std::optional<SensorRun::Fix> fix = run.sensors ? run.sensors->fix(t, now) : std::nullopt;
    seems.push_back(fix ? propagate_target(problem, problem.targets[t], fix->motion, fix->time, now) : truth.back());
    targets.capture.push_back(
        propagate_target(problem, problem.targets[t], seems.back(), now, problem.approach->duration));
  }
  targets.start = seems;
  std::vector<JointPoint> joints;
  for (const JointTrajectory& reference : run.joints.references()) joints.push_back(evaluate(reference, now));
  const CaptureProblem rest = rest_of_approach(problem, run.bodies.system, run.bodies.state, now, joints,
                                               run.result.plan->final_position, run.joints.controlled_attitude());
  ApproachPlan plan = plan_approach(rest, targets, run.detail, run.progress, now);
  const bool found = plan.failure.empty();
  run.result.navigation.push_back(
      {now, found, plan.report.rhs_evaluations, estimate_errors(problem, seems, truth), plan.failure});
  std::vector<std::string>& warnings = run.result.warnings;
  for (const std::string& warning : plan.warnings) {
    if (std::find(warnings.begin(), warnings.end(), warning) == warnings.end()) warnings.push_back(warning);
  }
  if (!found) return;
  std::optional<WindowReport> window = std::move(run.result.plan->window);
  std::vector<PlannedContact> contacts = std::move(run.result.plan->contacts);
  std::erase_if(contacts, [&](const PlannedContact& contact) { return contact.predicted >= now; });
  run.result.plan = plan.report;
  run.result.plan->window = std::move(window);
  contacts.insert(contacts.end(), plan.report.contacts.begin(), plan.report.contacts.end());
  run.result.plan->contacts = std::move(contacts);
  run.joints.follow(std::move(plan.joints));
}

}  // namespace grapnel
