#include "grapnel/approach/navigation.hpp"

#include <algorithm>
#include <array>

#include "grapnel/dynamics/momentum.hpp"
#include "grapnel/simulate/sensor_reader.hpp"

namespace grapnel {

bool navigates(const CaptureProblem& problem) {
  return problem.approach &&
         (problem.approach->replan || std::any_of(problem.targets.begin(), problem.targets.end(),
                                                  [](const TargetSetup& t) { return t.estimate.has_value(); }));
}

CaptureProblem estimated_problem(const CaptureProblem& problem) {
  CaptureProblem estimated = problem;
  for (TargetSetup& target : estimated.targets) {
    if (!target.estimate) continue;
    const TargetEstimate& error = *target.estimate;
    target.X_WT.p += error.position_error;
    if (norm(error.orientation_error) > 0) target.X_WT.R = rotation_by(error.orientation_error) * target.X_WT.R;
    target.V_WT.linear += error.velocity_error;
    target.V_WT.angular += error.angular_velocity_error;
  }
  return estimated;
}

std::vector<EstimateReport> estimate_errors(const CaptureProblem& problem, const std::vector<TargetMotion>& estimated,
                                            const std::vector<TargetMotion>& truth) {
  std::vector<EstimateReport> errors;
  for (std::size_t t = 0; t < problem.targets.size(); ++t) {
    const TargetMotion &is = truth[t], &seems = estimated[t];
    errors.push_back({problem.targets[t].name, norm(seems.X_WT.p - is.X_WT.p),
                      rotation_angle(transpose(is.X_WT.R) * seems.X_WT.R), norm(seems.V_WT.linear - is.V_WT.linear),
                      norm(seems.V_WT.angular - is.V_WT.angular)});
  }
  return errors;
}

// Problem and state at `time` => problem of the remaining approach: joints at their reference, wheels and gimbals as
// they are, later waypoints only. Unless joints track exactly, the momentum replaces the base's twist.
CaptureProblem rest_of_approach(const CaptureProblem& problem, const CaptureSystem& system, const State& state,
                                double time, const std::vector<JointPoint>& joints, const std::vector<double>& planned,
                                const std::optional<Rotationd>& attitude) {
  CaptureProblem rest = problem;
  const Model& model = system.model;
  rest.joint_position.clear(), rest.joint_rate.clear(), rest.wheel_rate.clear();
  rest.gimbal_angle.clear(), rest.gimbal_rate.clear();
  for (const JointPoint& joint : joints) {
    rest.joint_position.push_back(joint.position);
    rest.joint_rate.push_back(joint.rate);
  }
  for (int wheel : system.wheels) rest.wheel_rate.push_back(state.v[model.bodies()[model.joints()[wheel]].v]);
  for (const CaptureSystem::Gyro& gyro : system.gyros) {
    const Body& gimbal = model.bodies()[model.joints()[gyro.gimbal]];
    rest.gimbal_angle.push_back(state.q[gimbal.q]);
    rest.gimbal_rate.push_back(state.v[gimbal.v]);
  }
  rest.momentum.reset();
  if (model.has_free_root(system.base)) {
    rest.X_WB = root_pose(model, state, system.base);
    rest.V_WB = root_twist(model, state, system.base);
    if (problem.approach->tracking.mode != JointControl::prescribed) {
      // Momentum is preserved rather than the base's twist, since joints lag behind their references.
      const std::array<int, 1> root = {system.base};
      const Kinematics kinematics = forward_kinematics(model, state);
      rest.momentum = momentum_about(model, kinematics, center_of_mass(model, kinematics, root), root);
      rest.V_WB.reset();
    }
  }
  ApproachSetup& approach = *rest.approach;
  std::erase_if(approach.waypoints, [&](const Waypoint& w) { return w.time <= time; });
  approach.plan->guess = planned;
  approach.plan->objective = PlanSetup::Objective::as_found;
  approach.plan->weights.reset();
  if (approach.base_control && attitude) approach.base_control->R_WD = *attitude;
  return rest;
}

}  // namespace grapnel
