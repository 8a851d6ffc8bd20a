#include "grapnel/approach/approach_plan.hpp"
#include "grapnel/problem/capture_problem.hpp"

namespace grapnel {

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
