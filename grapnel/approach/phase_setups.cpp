#include "grapnel/approach/phase_setups.hpp"

#include "grapnel/model/coupling.hpp"

namespace grapnel {
namespace {

// Settings common to all phases of a problem.
PhaseSetup common_setup(const CaptureProblem& problem, const CaptureSystem& system,
                        const std::optional<BaseControlSetup>& control, const State& start) {
  PhaseSetup setup;
  setup.drives.resize(system.model.joints().size());
  setup.gravity = problem.gravity;
  setup.recover_roots = problem.integration.root_velocity == IntegrationSetup::RootVelocity::recovered;
  setup.loads = loads_on(system, problem.loads);
  if (problem.orbit) setup.orbit = reference_orbit(*problem.orbit);
  if (problem.integration.loops != IntegrationSetup::Loops::open) setup.closures = system.closures;
  for (const SlippingGrasp& slipping : system.slips) setup.slips.push_back(slipping.slip);
  setup.project_loops = problem.integration.loops == IntegrationSetup::Loops::projection;
  if (problem.integration.loops == IntegrationSetup::Loops::baumgarte)
    setup.loop_feedback = 1 / problem.integration.baumgarte_time;
  if (control) setup.attitude = attitude_control(*control, system, start);
  setup.actuators.feedforward = control && control->feedforward;
  if (problem.control) {
    setup.clock = std::make_shared<ControlClock>(problem.control->timing, system.robot_joints.size());
    setup.channels = system.robot_joints;
  }
  return setup;
}

// A joint that follows its trajectory.
JointDrive tracking_drive(const TrackingSetup& tracking, const JointTrajectory& trajectory, std::size_t joint,
                          bool ideal) {
  JointDrive drive;
  drive.trajectory = trajectory;
  drive.control = JointControl::prescribed;
  if (ideal) return drive;
  if (tracking.noise) drive.noise = NoiseSignal(*tracking.noise, static_cast<std::uint32_t>(joint));
  if (tracking.mode == JointControl::prescribed) return drive;
  drive.control = tracking.mode == JointControl::impedance ? JointControl::pd : tracking.mode;
  if (!has_gains(tracking.mode)) return drive;
  drive.kp = tracking.kp[joint];
  drive.kd = tracking.kd[joint];
  return drive;
}

}  // namespace

// Stated loads => loads on the bodies of this system, point and surface normal in the body's own frame; loads on bodies
// that the system lacks are omitted.
std::vector<ExternalLoad> loads_on(const CaptureSystem& system, std::span<const LoadSetup> loads) {
  std::vector<ExternalLoad> result;
  for (const LoadSetup& load : loads) {
    const int body = body_named(system, load.body);
    if (body < 0) continue;
    const Posed own = own_frame(system, body);
    std::optional<Stream> stream = load.stream;
    if (stream) stream->normal = own.R * stream->normal;
    result.push_back({body, own * load.p_BP, load.frame, load.amplitude, load.profile, stream});
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

namespace {

// Reaction wheels as the actuators of the base torque, if selected.
void use_wheels(const CaptureProblem& problem, const CaptureSystem& system,
                const std::optional<BaseControlSetup>& control, PhaseSetup& setup) {
  const bool commanded = setup.commanded_root >= 0;
  if (!control && !commanded) return;
  if (control && control->actuators && control->actuators != BaseControlSetup::Actuators::wheels) return;
  for (std::size_t w = 0; w < system.wheels.size(); ++w) {
    const WheelSetup& wheel = problem.robot.wheels[w];
    const int velocity = system.model.bodies()[system.model.joints()[system.wheels[w]]].v;
    setup.wheels.push_back({system.wheels[w], velocity, wheel.axis, wheel.torque, wheel.rate, wheel.inertia});
  }
  if (!control) return;
  setup.actuators.wheel_speed_rate = control->wheel_speed_rate;
  setup.actuators.wheel_speeds = control->wheel_speeds;
}

// Control moment gyros, whose motors are always active, and whether they produce the base torque.
void use_gyros(const CaptureProblem& problem, const CaptureSystem& system,
               const std::optional<BaseControlSetup>& control, PhaseSetup& setup) {
  for (std::size_t g = 0; g < system.gyros.size(); ++g)
    setup.gyros.push_back(moment_gyro(problem.robot.gyros[g], system, g));
  using Actuators = BaseControlSetup::Actuators;
  if (setup.gyros.empty() || setup.actuators.one_by_one) return;
  const bool absent = control && !control->actuators, requested = control && control->actuators == Actuators::gyros;
  const bool commanded = !control && setup.commanded_root >= 0;
  if (!requested && !((absent || commanded) && problem.robot.wheels.empty())) return;
  setup.actuators.steering = control ? control->steering.value_or(GyroSteering{}) : GyroSteering{};
}

// The thrusters, if they actuate the base or unload the wheels.
void use_thrusters(const CaptureProblem& problem, const std::optional<BaseControlSetup>& control, PhaseSetup& setup) {
  if (setup.actuators.one_by_one && (problem.control->base_actuators || !problem.control->log->thruster.empty()))
    setup.actuators.thrusters = make_thruster_bank(problem.robot);
  if (!control || (control->actuators != BaseControlSetup::Actuators::thrusters && !control->dumping)) return;
  setup.actuators.thrusters = make_thruster_bank(problem.robot);
  setup.actuators.modulation = control->modulation.value_or(ThrusterModulation{});
  setup.actuators.dumping = control->dumping;
}

}  // namespace

PhaseSetup approach_setup(const CaptureProblem& problem, const CaptureSystem& system, const State& start,
                          const std::vector<JointTrajectory>& joints, bool ideal) {
  PhaseSetup setup = common_setup(problem, system, problem.approach->base_control, start);
  setup.held_root = problem.robot.base_mode == RobotSetup::Base::held ? system.base : -1;
  for (std::size_t j = 0; j < system.robot_joints.size(); ++j) {
    if (follows_others(system.model.joint_body(system.robot_joints[j]))) continue;
    setup.drives[system.robot_joints[j]] = tracking_drive(problem.approach->tracking, joints[j], j, ideal);
  }
  use_wheels(problem, system, problem.approach->base_control, setup);
  use_gyros(problem, system, problem.approach->base_control, setup);
  return setup;
}

MomentGyro moment_gyro(const MomentGyroSetup& gyro, const CaptureSystem& system, std::size_t index) {
  const CaptureSystem::Gyro joints = system.gyros[index];
  const Body& gimbal = system.model.bodies()[system.model.joints()[joints.gimbal]];
  const Body& rotor = system.model.bodies()[system.model.joints()[joints.rotor]];
  MomentGyro g;
  g.gimbal = joints.gimbal, g.rotor = joints.rotor;
  g.gimbal_coordinate = gimbal.q, g.gimbal_velocity = gimbal.v, g.rotor_velocity = rotor.v;
  g.gimbal_axis = gyro.gimbal_axis, g.spin_axis = gyro.spin_axis;
  g.inertia = gyro.inertia, g.spin_rate = gyro.spin_rate;
  g.torque = gyro.torque, g.rate = gyro.rate, g.bandwidth = gyro.bandwidth;
  return g;
}

std::shared_ptr<ThrusterBank> make_thruster_bank(const RobotSetup& robot) {
  if (robot.thrusters.empty()) return {};
  Vector3d com = Vector3d::zero();
  for (const BodyDescription& body : robot.bodies) {
    if (body.name == robot.base) com = body.com;
  }
  return std::make_shared<ThrusterBank>(std::vector<Thruster>(robot.thrusters.begin(), robot.thrusters.end()), com);
}

std::vector<Tendon::Arm> tendon_arms(const TendonSetup& tendon, const CaptureSystem& system) {
  std::vector<Tendon::Arm> arms;
  for (std::size_t joint = 0; joint < system.model.joints().size(); ++joint) {
    const Body& body = system.model.joint_body(joint);
    for (const TendonArm& one : tendon.joints) {
      if (one.joint == body.description.joint.name) arms.push_back({static_cast<int>(joint), body.q, one.arm});
    }
  }
  return arms;
}

namespace {

// Commands of the current phase => tendons that pull their joints.
std::vector<Tendon> pulled_tendons(const CaptureProblem& problem, const CaptureSystem& system,
                                   const SegmentControl& control) {
  std::vector<Tendon> tendons;
  if (control.approaching || !problem.post_impact) return tendons;
  for (const TendonCommand& command : problem.post_impact->tendons) {
    const TendonSetup* setup = tendon_named(problem.robot, command.tendon);
    const auto index = static_cast<std::size_t>(setup - problem.robot.tendons.data());
    Tendon& tendon = tendons.emplace_back();
    tendon.arms = tendon_arms(*setup, system);
    tendon.tension = command.tension, tendon.speed = command.speed;
    tendon.stiffness = setup->stiffness.value_or(0);
    tendon.begin = control.post_impact_begin;
    tendon.excursion_at_begin = index < control.excursions.size() ? control.excursions[index] : 0;
  }
  return tendons;
}

}  // namespace

// Setting of post_impact => control of each joint. Controllers that command all joints together (detumbling, impedance
// and the like) leave pd to the others; braked joints are prescribed.
JointControl control_of(PostImpactSetup::Joints joints) {
  switch (joints) {
    case PostImpactSetup::Joints::free:
      return JointControl::free;
    case PostImpactSetup::Joints::pd:
    case PostImpactSetup::Joints::detumble:
    case PostImpactSetup::Joints::keep_base_attitude:
    case PostImpactSetup::Joints::impedance:
    case PostImpactSetup::Joints::grasp_force:
      return JointControl::pd;
    case PostImpactSetup::Joints::computed_torque:
      return JointControl::computed_torque;
    case PostImpactSetup::Joints::controller:
      return JointControl::controller;
    case PostImpactSetup::Joints::braked:
      break;
  }
  return JointControl::prescribed;
}

// Problem, state and control of one part of the run => setup of its phases: base and its actuators, drives that track
// or hold, and the controller that replaces the drives of its joints.
PhaseSetup segment_setup(const CaptureProblem& problem, const CaptureSystem& system, const State& start,
                         const std::vector<JointTrajectory>& joints, const SegmentControl& control) {
  const MotionPhases& post = problem.post_impact;
  const std::optional<BaseControlSetup>& base =
      control.approaching ? problem.approach->base_control : post->base_control;
  PhaseSetup setup = common_setup(problem, system, base, start);
  if (setup.attitude && control.attitude) setup.attitude->R_WD = *control.attitude;
  // A base held during the approach is released at the first grasp.
  const bool held = problem.robot.base_mode == RobotSetup::Base::held && control.approaching && system.grasps.empty() &&
                    system.slips.empty();
  setup.held_root = held ? system.base : -1;
  const bool has_controller = control.approaching ? problem.approach->tracking.mode == JointControl::controller
                                                  : post && post->joints == PostImpactSetup::Joints::controller;
  if (has_controller && problem.control && !held) {
    setup.actuators.one_by_one =
        problem.control->base_actuators || (problem.control->log && problem.control->log->commands_actuators());
    if (problem.control->base_torque || setup.actuators.one_by_one) setup.commanded_root = system.base;
  }
  use_wheels(problem, system, base, setup);
  use_gyros(problem, system, base, setup);
  use_thrusters(problem, base, setup);
  if (base && base->actuators && is_other(*base->actuators))
    setup.effectors = {functions_of(*base->actuators).make(problem)};
  for (std::size_t j = 0; j < system.robot_joints.size(); ++j) {
    if (follows_others(system.model.joint_body(system.robot_joints[j]))) continue;
    JointDrive& drive = setup.drives[system.robot_joints[j]];
    if (control.approaching && !control.settled[j]) {
      drive = tracking_drive(problem.approach->tracking, joints[j], j, false);
      continue;
    }
    if (!post || post->joints == PostImpactSetup::Joints::free) continue;
    if (!control.approaching &&
        is_pulled(problem.robot, *post, system.model.joint_body(system.robot_joints[j]).description.joint.name))
      continue;
    drive.control = control_of(post->joints);
    if (drive.control == JointControl::prescribed) {  // locked at its present value
      const double here = start.q[system.model.bodies()[system.model.joints()[system.robot_joints[j]]].q];
      drive.trajectory = JointTrajectory::at_rest(here);
      continue;
    }
    drive.trajectory = settled_trajectory(*post, control, j);
    if (!has_gains(drive.control)) continue;
    drive.kp = post->kp[j], drive.kd = post->kd[j];
  }
  setup.tendons = pulled_tendons(problem, system, control);
  if (control.law) {
    for (int j : control.law->joints()) setup.drives[j] = {.control = JointControl::controller};
    setup.controller = std::make_shared<JointLawController>(control.law);
  }
  return setup;
}

}  // namespace grapnel
