#pragma once

/// @file
/// The sequence of phases after the approach: conditions that end a phase before its duration, and the change to the
/// next one.

#include "grapnel/capture/capture_run.hpp"
#include "grapnel/capture/phase_segment.hpp"

namespace grapnel {

/// Falls to zero when the rates and momenta that end the current phase are reached; empty if no such condition applies
/// in the motion segment that begins. `system` must outlive it.
StopCondition phase_condition(const CaptureRun& run, const CaptureSystem& system);

/// Begins the current phase of the sequence: attitude control, set points of the joints, laws.
MotionPhase begin_motion_phase(CaptureRun& run);
/// Closes the grasps that are due in the phase. Returns whether motion remains in it: its duration has not elapsed and
/// its end condition does not hold.
bool moves_on(CaptureRun& run, const MotionPhase& phase);
/// Ends the phase: writes its report, and makes the next one current. Returns whether there is a next one.
bool end_motion_phase(CaptureRun& run, const MotionPhase& phase);

}  // namespace grapnel
