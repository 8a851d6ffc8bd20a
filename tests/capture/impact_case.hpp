#pragma once

/// @file
/// Captures for the impact laws: two hands at their targets, everything moving, and what must hold after any law.

#include "capture/loop_case.hpp"

namespace grapnel::testing {

/// random_loops() with one target per arm (two arms of four joints), where the point that each hand meets has a surface
/// normal opposite to its motion, oblique. No approach; 2 s of motion afterwards.
CaptureProblem meeting_case(int index);
/// The same with contacts instead of grasps under the given law, e and mu.
CaptureProblem rebound_case(ImpactSetup::Law law, double restitution, double friction, int index);
/// The same with grasps that yield [N/m], about critically damped for what is met here.
CaptureProblem yielding_case(double linear_stiffness, int index);

/// Relative twist [angular; linear] of a grasp at the sample, at the end-effector's origin.
Twistd relative_twist_at(const CaptureProblem& problem, const CaptureResult& result, std::size_t grasp,
                         std::size_t sample);
/// The largest difference of momenta (of everything, about the world's origin, over their size) between two samples.
double momentum_jump(const CaptureResult& result, std::size_t before, std::size_t after);

}  // namespace grapnel::testing
