#pragma once

/// @file
/// What joints pass on at an instant of a motion: d'Alembert's principle body by body, from accelerations in the world.
/// Thread safety: pure functions.

#include <vector>

#include "grapnel/capture/capture_system.hpp"
#include "grapnel/dynamics/forward_dynamics.hpp"
#include "grapnel/simulate/simulate_phase.hpp"

namespace grapnel {

/// Per body: the wrench that its joint transmits from the parent to it, in W, about the body frame's origin (the
/// joint), driving and constraint components alike. `vdot`: accelerations of the velocities; `external`: what acts on
/// the bodies from outside the tree.
std::vector<Wrenchd> joint_wrenches(const Model& model, const State& state, std::span<const double> vdot,
                                    std::span<const ExternalWrench> external);
std::vector<Wrenchd> joint_wrenches(const Model& model, const Kinematics& kinematics, std::span<const double> vdot,
                                    std::span<const ExternalWrench> external);

/// The same at a sample of a phase (`kinematics` of its state), with gravity, loads, and what grips pass on that close
/// loops of the tree. `grips`: the wrenches on the robot at the grips, in W, per entry of system.grips.
std::vector<Wrenchd> joint_wrenches(const CaptureSystem& system, const Kinematics& kinematics,
                                    const PhaseSample& sample, std::span<const Wrenchd> grips);

/// Bodies of the robot that joints carry, fixed ones too: all but the base. Their order is the robot's in every model
/// of one capture.
std::vector<int> carried_bodies(const CaptureSystem& system);

}  // namespace grapnel
