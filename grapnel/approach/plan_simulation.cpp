#include "grapnel/approach/plan_simulation.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "grapnel/approach/phase_setups.hpp"

namespace grapnel {

bool bends(const PlanningTask& task) { return !task.simulated_servicer.elastic_joints.empty(); }

bool loaded(const PlanningTask& task) { return !loads_on(task.servicer, task.problem.loads).empty(); }

bool has_rotors(const PlanningTask& task) {
  return !task.simulated_servicer.wheels.empty() || !task.simulated_servicer.gyros.empty();
}

bool disturbed(const PlanningTask& task) {
  return bends(task) || loaded(task) || task.approach.base_control.has_value() || task.problem.orbit.has_value() ||
         has_rotors(task);
}

bool targets_loaded(const PlanningTask& task) {
  return std::any_of(task.problem.loads.begin(), task.problem.loads.end(), [&](const LoadSetup& load) {
    return std::any_of(task.problem.grasps.begin(), task.problem.grasps.end(), [&](const GraspSetup& g) {
      return load.body == BodyName::of_target(target_index(task.problem, g.target));
    });
  });
}

std::string disturbances(const PlanningTask& task) {
  return std::string(task.problem.orbit ? "the orbit's field, " : "") +
         (task.simulated_servicer.wheels.empty() ? "" : "the reaction wheels, ") +
         (task.simulated_servicer.gyros.empty() ? "" : "the control moment gyros, ") +
         (bends(task) ? "flexible bodies, " : "") + (task.targets.contacts.empty() ? "" : "contacts of the targets, ") +
         "the loads or the base's attitude control";
}

std::string planned_robot(const PlanningTask& task) {
  std::vector<std::string> differs;
  if (bends(task)) differs.push_back("is rigid");
  if (task.attitude_held()) {
    differs.push_back("holds its base's attitude exactly");
  } else if (task.approach.base_control) {
    differs.push_back("floats freely, since the attitude control is too weak to hold the attitude during the motion");
  } else if (has_rotors(task) && task.base.floats()) {
    differs.push_back("floats freely, with its rotors fixed to the base");
  }
  if (task.problem.orbit) differs.push_back("has no orbital field");
  if (loaded(task)) differs.push_back("has no loads");
  return fmt::format("{}", fmt::join(differs, " and "));
}

State simulate(PlanningTask& task, const std::vector<JointTrajectory>& joints, double end, StepWatch watch) {
  PhaseDynamics dynamics(task.simulated_servicer.model,
                         approach_setup(task.problem, task.simulated_servicer, task.simulated_start, joints, true));
  watch.each_step = task.each_step();
  IntegrationSetup integration = task.problem.integration;
  if (watch.probe) {
    // Inside a long step the state is known to order 7 only.
    constexpr double kSteps = 400;
    const double max_step = (end - task.begin) / kSteps;
    integration.max_step = integration.max_step > 0 ? std::min(integration.max_step, max_step) : max_step;
  }
  const PhaseOutcome outcome =
      simulate_phase(dynamics, {task.simulated_start, task.begin, end}, integration, {.watch = watch});
  if (!outcome.finished) throw std::runtime_error("planning the approach: " + outcome.failure);
  task.rhs_evaluations += outcome.rhs_evaluations;
  return outcome.end_state;
}

State simulate_segment(PlanningTask& task, const PlanDraft& draft, const ReachProblem& reach,
                       const SegmentValues& values, const StepWatch& watch) {
  std::vector<JointTrajectory> joints = draft.plan.joints;
  SegmentStart start = reach.start;
  start.knots = values.knots;
  PathSegment segment(task.base, start, task.motion);
  for (std::size_t j = 0; j < values.position.size(); ++j) {
    const auto segments =
        segment.joint_segments(static_cast<int>(j), values.position[j], values.rate[j], values.coefficients);
    joints[j].segments.insert(joints[j].segments.end(), segments.begin(), segments.end());
  }
  return simulate(task, joints, reach.start.end, watch);
}

State planned_state(const PlanningTask& task, const State& simulated) {
  return without_inner_motion(task.simulated_servicer, simulated, task.servicer);
}

Vector3d turn_beside(const PlanningTask& task, const State& servicer) {
  if (!task.attitude_held()) return Vector3d::zero();
  const Posed X_WB = root_pose(task.servicer.model, servicer, task.servicer.base);
  return transposed_times(X_WB.R, root_twist(task.servicer.model, servicer, task.servicer.base).angular);
}

}  // namespace grapnel
