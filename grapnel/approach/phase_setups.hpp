#pragma once

/// @file
/// Converts a problem's settings to the drives and controllers of a phase.

#include <span>

#include "grapnel/control/joint_law.hpp"
#include "grapnel/problem/capture_system.hpp"
#include "grapnel/simulate/phase_dynamics.hpp"

namespace grapnel {

/// Loads on the bodies of the system; loads on other bodies are dropped.
std::vector<ExternalLoad> loads_on(const CaptureSystem& system, std::span<const LoadSetup> loads);

/// Attitude control of the base; without a desired attitude it holds the attitude of `state`.
AttitudeControl attitude_control(const BaseControlSetup& setup, const CaptureSystem& system, const State& state);

/// The approach along these trajectories (one per robot joint) with the configured tracking. `ideal`: exact tracking
/// without noise for any setting, and an external torque on the base in place of thrusters.
PhaseSetup approach_setup(const CaptureProblem& problem, const CaptureSystem& system, const State& start,
                          const std::vector<JointTrajectory>& joints, bool ideal);

/// Control of joints and base during one part of the run, between two events.
struct SegmentControl {
  bool approaching = true;       // before the approach's end: joints follow their trajectories,
  std::vector<bool> settled;     // per robot joint: except these, whose arm holds a target; post_impact applies to them
  std::vector<double> hold;      // per robot joint: initial or held value once settled [rad or m]
  double post_impact_begin = 0;  // [s]; not read while approaching
  std::vector<double> excursions;  // per tendon of the robot, when that phase began [m]
  std::optional<Rotationd>
      attitude;                   // desired R_WD of the base control; absent: the attitude at the begin of this part
  std::shared_ptr<JointLaw> law;  // active control law; controls its joints exclusively
};

/// A gyro of the robot, in the order of its file, in a model that contains it.
MomentGyro moment_gyro(const MomentGyroSetup& gyro, const CaptureSystem& system, std::size_t index);
/// The valves of the robot's thrusters, all closed; null without thrusters.
std::shared_ptr<ThrusterBank> make_thruster_bank(const RobotSetup& robot);

/// The arms of a tendon in a model of the robot.
std::vector<Tendon::Arm> tendon_arms(const TendonSetup& tendon, const CaptureSystem& system);

/// Joint control for a setting of post_impact.
JointControl control_of(PostImpactSetup::Joints joints);
/// Whether held joints move after the impact: to a posture, or as excitation for an identification.
bool moves_afterwards(const PostImpactSetup& post);
/// Reference trajectory of a settled joint.
JointTrajectory settled_trajectory(const PostImpactSetup& post, const SegmentControl& control, std::size_t joint);

/// Setup of one part of the run. Clock and thrusters are newly created; joints under a controller get none here.
PhaseSetup segment_setup(const CaptureProblem& problem, const CaptureSystem& system, const State& start,
                         const std::vector<JointTrajectory>& joints, const SegmentControl& control);

}  // namespace grapnel
