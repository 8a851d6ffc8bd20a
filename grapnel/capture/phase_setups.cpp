#include "grapnel/capture/phase_setups.hpp"

namespace grapnel {
namespace {

// What every phase of a problem has.
PhaseSetup common_setup(const CaptureProblem& problem, const CaptureSystem& system,
                        const std::optional<BaseControlSetup>& control, const State& start) {
  PhaseSetup setup;
  setup.drives.resize(system.model.joints().size());
  setup.gravity = problem.gravity;
  setup.recover_roots = problem.integration.root_velocity == IntegrationSetup::RootVelocity::recovered;
  setup.loads = loads_on(system.model, problem.loads);
  if (control) setup.attitude = attitude_control(*control, system, start);
  return setup;
}

}  // namespace

std::vector<ExternalLoad> loads_on(const Model& model, std::span<const LoadSetup> loads) {
  std::vector<ExternalLoad> result;
  for (const LoadSetup& load : loads) {
    for (std::size_t i = 0; i < model.bodies().size(); ++i) {
      if (model.bodies()[i].description.name != load.body) continue;
      const Vector3d p_BP = own_frame(model, static_cast<int>(i)) * load.p_BP;
      result.push_back({static_cast<int>(i), p_BP, load.in_body, load.amplitude, load.profile});
    }
  }
  return result;
}

AttitudeControl attitude_control(const BaseControlSetup& setup, const CaptureSystem& system, const State& state) {
  AttitudeControl control;
  control.root = system.base;
  control.R_WD = setup.R_WD ? *setup.R_WD : root_pose(system.model, state, system.base).R;
  control.kp = setup.kp, control.kd = setup.kd, control.limit = setup.limit;
  return control;
}

PhaseSetup approach_setup(const CaptureProblem& problem, const CaptureSystem& system, const State& start,
                          const std::vector<JointTrajectory>& joints, bool ideal) {
  const TrackingSetup& tracking = problem.approach->tracking;
  PhaseSetup setup = common_setup(problem, system, problem.approach->base_control, start);
  setup.held_root = problem.robot.base_mode == RobotSetup::Base::held ? system.base : -1;
  for (std::size_t j = 0; j < system.robot_joints.size(); ++j) {
    JointDrive& drive = setup.drives[system.robot_joints[j]];
    drive.trajectory = joints[j];
    drive.control = JointControl::prescribed;
    if (ideal) continue;
    if (tracking.noise) drive.noise = NoiseSignal(*tracking.noise, static_cast<std::uint32_t>(j));
    if (tracking.mode == TrackingSetup::Mode::ideal) continue;
    drive.control = tracking.mode == TrackingSetup::Mode::pd ? JointControl::pd : JointControl::computed_torque;
    drive.kp = tracking.kp[j];
    drive.kd = tracking.kd[j];
  }
  return setup;
}

PhaseSetup post_impact_setup(const CaptureProblem& problem, const CaptureSystem& system, const State& start) {
  const PostImpactSetup& post = *problem.post_impact;
  PhaseSetup setup = common_setup(problem, system, post.base_control, start);
  if (post.joints == PostImpactSetup::Joints::free) return setup;
  for (std::size_t j = 0; j < system.robot_joints.size(); ++j) {
    JointDrive& drive = setup.drives[system.robot_joints[j]];
    drive.trajectory =
        JointTrajectory::at_rest(start.q[system.model.bodies()[system.model.joints()[system.robot_joints[j]]].q]);
    const bool braked = post.joints == PostImpactSetup::Joints::braked;
    drive.control = braked ? JointControl::prescribed : JointControl::pd;
    if (!braked) drive.kp = post.kp[j], drive.kd = post.kd[j];
  }
  return setup;
}

}  // namespace grapnel
