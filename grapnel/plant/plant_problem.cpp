#include "grapnel/plant/plant_problem.hpp"

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
  post.until->event = PhaseUntil::Event::none;  // of a law
  const PhaseUntil& until = *post.until;
  const bool any_left = until.base_rate || until.target_rate || until.relative_rate || until.joint_rate ||
                        until.wheel_momentum_below || until.wheel_momentum_above;
  if (!any_left) post.until.reset();
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
  if (problem.approach) take_out_laws(*problem.approach);
  for (PostImpactSetup& phase : problem.post_impact) take_out_laws(phase);
  const bool is_fixed = problem.robot.base_mode == RobotSetup::Base::fixed;
  if (is_fixed && base_torque) throw PlantError("the robot's base is fixed, so no torque rotates it");
  control.external = true;
  control.base_torque = control.base_torque || base_torque;
  control.base_actuators =
      !is_fixed && !control.base_torque &&
      !(problem.robot.wheels.empty() && problem.robot.gyros.empty() && problem.robot.thrusters.empty());
  return problem;
}

}  // namespace grapnel
