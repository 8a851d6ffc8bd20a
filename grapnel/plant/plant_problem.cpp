#include "grapnel/plant/plant_problem.hpp"

#include <algorithm>
#include <optional>
#include <utility>

namespace grapnel {
namespace {

void take_out_laws(ApproachSetup& approach) {
  approach.tracking.mode = JointControl::controller;
  approach.tracking.kp.clear(), approach.tracking.kd.clear();
  approach.base_control.reset();
}

void take_out_laws(PostImpactSetup& post) {
  post.joints = PostImpactSetup::Joints::controller;
  post.kp.clear(), post.kd.clear();
  post.detumble.reset(), post.keep_base_attitude.reset(), post.model.reset();
  post.base_control.reset();
  if (!post.until) return;
  post.until->event.reset();  // of a law
  const PhaseUntil& until = *post.until;
  const bool any_left = until.base_rate || until.target_rate || until.relative_rate || until.joint_rate ||
                        until.wheel_momentum_below || until.wheel_momentum_above;
  if (!any_left) post.until.reset();
}

bool has_actuators(const RobotSetup& robot) {
  return !robot.wheels.empty() || !robot.gyros.empty() || !robot.thrusters.empty();
}

// Whether the scenario controls the base by external torques.
bool turns_from_outside(const CaptureProblem& problem) {
  const auto is_outside = [](const std::optional<BaseControlSetup>& control) {
    return control && control->actuators == BaseControlSetup::Actuators::outside;
  };
  return (problem.approach && is_outside(problem.approach->base_control)) ||
         std::ranges::any_of(problem.post_impact, is_outside, &PostImpactSetup::base_control);
}

}  // namespace

CaptureProblem plant_of(CaptureProblem problem, bool base_torque) {
  if (!problem.control)
    throw PlantError(
        "the scenario has no control.period, the sample time of commands and outputs; add it, or use --set "
        "'control.period=10 ms'");
  ControlSetup& control = *problem.control;
  const std::string other = control.log               ? "control.torques"
                            : !control.plugin.empty() ? "control.plugin"
                            : !control.fmu.empty()    ? "control.fmu"
                                                      : "";
  if (!other.empty())
    throw PlantError("the scenario's " + other +
                     " conflicts with the external control of an exported plant; remove it, with its inputs, outputs "
                     "and parameters, or use --set 'control={period: 10 ms, external: true}'");
  if (!problem.approach && !problem.post_impact)
    throw PlantError("the scenario has neither an approach nor a post_impact nor a motion, so nothing in it moves");
  const bool is_fixed = problem.robot.base_mode == RobotSetup::Base::fixed;
  if (is_fixed && base_torque) throw PlantError("the robot's base is fixed, so no torque rotates it");
  if (is_fixed && problem.joint_position.empty())
    throw PlantError("the robot's base is fixed and it has no driven joints, so there is nothing to command");
  const bool turns_by_actuators = !is_fixed && has_actuators(problem.robot);
  const bool turns_by_torque =
      !is_fixed && !turns_by_actuators && (problem.joint_position.empty() || turns_from_outside(problem));
  if (problem.approach) take_out_laws(*problem.approach);
  for (PostImpactSetup& phase : problem.post_impact) take_out_laws(phase);
  control.external = true;
  control.base_torque = control.base_torque || base_torque || turns_by_torque;
  control.base_actuators = turns_by_actuators && !control.base_torque;
  return problem;
}

}  // namespace grapnel
