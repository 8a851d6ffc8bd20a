#pragma once

/// @file
/// The sequence of phases after the approach: what ends a phase before its duration, and the change to the next one.

#include "grapnel/capture/capture_run.hpp"
#include "grapnel/capture/phase_segment.hpp"

namespace grapnel {

/// Falls to zero where the rates and momenta that end the phase at hand are reached; empty where no such condition
/// counts in the piece of motion that begins. `system` must outlive it.
StopCondition phase_condition(const CaptureRun& run, const CaptureSystem& system);

/// The phase at hand of the sequence begins: attitude control, set points of the joints, laws.
MotionPhase begin_motion_phase(CaptureRun& run);
/// Closes the grasps that are due in it. Whether there is motion left in it: neither its time is over, nor does what
/// ends it hold.
bool moves_on(CaptureRun& run, const MotionPhase& phase);
/// It has ended: its report; the next one, if there is any, is the phase at hand from now on. Whether there is.
bool end_motion_phase(CaptureRun& run, const MotionPhase& phase);

}  // namespace grapnel
