#pragma once

/// @file
/// What the grips carry while they hold: the multipliers of (2.11) as internal wrenches. Thread safety: pure functions.

#include "grapnel/capture/capture_system.hpp"
#include "grapnel/simulate/simulate_phase.hpp"

namespace grapnel {

/// Wrench of one grip, on the robot at the grip, in W, [moment; force].
struct GripWrench {
  Wrenchd F_WC = Wrenchd::zero();
  std::vector<bool> determined;             // per component: the same whatever self-stress the loops carry
  Wrenchd beyond_solver = Wrenchd::zero();  // F_WC less what the solver of the loops has it be
};

/// Per entry of system.grips, at a sample of a phase (`kinematics` of its state). All grips of a target together give
/// it the motion it has; where loops are redundant or joints held, self-stresses leave single grips open, and of all
/// wrenches those with the least sum of F^T (J_t M_t^-1 J_t^T) F are returned, as in the impact (7.8).
/// `with_determined`: fill that too.
std::vector<GripWrench> grip_wrenches(const CaptureSystem& system, const Kinematics& kinematics,
                                      const PhaseSample& sample, bool with_determined = false);

/// Efforts of held joints beside these wrenches: where joints are prescribed in a loop, its self-stress is in their
/// efforts too, and those in the sample belong to the solver's wrenches. Adds to `motor`, per Model::joints().
void add_self_stress(const CaptureSystem& system, const Kinematics& kinematics, std::span<const GripWrench> wrenches,
                     std::span<double> motor);

}  // namespace grapnel
