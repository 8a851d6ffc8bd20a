#pragma once

/// @file
/// Captures for the impact laws: two end-effectors at their targets, all bodies moving, and checks that hold for any
/// law.

#include "capture/loop_case.hpp"

namespace grapnel::testing {

/// random_loops() with one target per arm (two arms of four joints). The surface normal at each contact point is
/// oblique and opposite to the end-effector's motion. No approach; 2 s of motion afterwards.
CaptureProblem contact_capture_case(int index);
/// The same with contacts instead of grasps under the given law, e and mu.
CaptureProblem rebound_case(ImpactSetup::Law law, double restitution, double friction, int index);
/// The same with compliant grasps of this stiffness [N/m], approximately critically damped.
CaptureProblem yielding_case(double linear_stiffness, int index);

/// Relative twist [angular; linear] of a grasp at the sample, at the end-effector's origin.
Twistd relative_twist_at(const CaptureProblem& problem, const CaptureResult& result, std::size_t grasp,
                         std::size_t sample);
/// The largest difference of the total momenta about the world's origin between two samples, relative to their size.
double momentum_jump(const CaptureResult& result, std::size_t before, std::size_t after);

}  // namespace grapnel::testing
