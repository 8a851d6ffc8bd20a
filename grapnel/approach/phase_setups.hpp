#pragma once

/// @file
/// From the problem's settings to what drives a phase.

#include <span>

#include "grapnel/control/joint_law.hpp"
#include "grapnel/problem/capture_system.hpp"
#include "grapnel/simulate/phase_dynamics.hpp"

namespace grapnel {

/// Loads on the bodies that a model has; others are left out.
std::vector<ExternalLoad> loads_on(const Model& model, std::span<const LoadSetup> loads);

/// Attitude control of the base from a setting; without a desired attitude it keeps that of `state`.
AttitudeControl attitude_control(const BaseControlSetup& setup, const CaptureSystem& system, const State& state);

/// The approach along these trajectories (one per robot joint), tracked as set; `ideal`: followed exactly without
/// noise, whatever the tracking, and the base's torque from outside where thrusters give it.
PhaseSetup approach_setup(const CaptureProblem& problem, const CaptureSystem& system, const State& start,
                          const std::vector<JointTrajectory>& joints, bool ideal);

/// What the robot's joints and base do in a piece of the run, between two events.
struct SegmentControl {
  bool approaching = true;            // before the approach's end: joints follow their trajectories,
  std::vector<bool> settled;          // per robot joint: but these, whose arm holds a target, are as post_impact says
  std::vector<double> hold;           // per robot joint: where it is held, or leaves from, once settled [rad or m]
  double post_impact_begin = 0;       // [s]; not read while approaching
  std::optional<Rotationd> attitude;  // R_WD of the base under control; absent: that of the piece's start
  std::shared_ptr<JointLaw> law;      // that works in it; its joints do nothing else
};

/// A gyro of the robot, in the order of its file, in a model that has it.
MomentGyro moment_gyro(const MomentGyroSetup& gyro, const CaptureSystem& system, std::size_t index);
/// The valves of the robot's thrusters, all closed; null without any.
std::shared_ptr<ThrusterBank> make_thruster_bank(const RobotSetup& robot);

/// What drives joints by post_impact.
JointControl control_of(PostImpactSetup::Joints joints);
/// Whether joints that hold afterwards move to a posture, or to let an identification see something.
bool moves_afterwards(const PostImpactSetup& post);
/// What a joint that has settled follows.
JointTrajectory settled_trajectory(const PostImpactSetup& post, const SegmentControl& control, std::size_t joint);

/// What drives a piece of the run. Clock and thrusters are new ones, which have seen no time; joints under a controller
/// have none yet.
PhaseSetup segment_setup(const CaptureProblem& problem, const CaptureSystem& system, const State& start,
                         const std::vector<JointTrajectory>& joints, const SegmentControl& control);

}  // namespace grapnel
