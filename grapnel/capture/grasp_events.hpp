#pragma once

/// @file
/// Events between motion segments, at which velocities jump: grasps close or contacts touch, in an instantaneous or
/// compliant impact; brakes lock joints; grasps release.

#include "grapnel/capture/capture_run.hpp"
#include "grapnel/capture/phase_segment.hpp"

namespace grapnel {

/// Closes grasps that are due at the current instant of a phase: on arrival or at stated times. Grasps that close
/// together wait for the approach's end. Returns whether motion remains in the phase.
bool close_due_grasps(CaptureRun& run, const MotionPhase& phase);

/// Decides on grasps of the problem, and closes those within their envelopes simultaneously, in one impact; grasps
/// precede contacts. Returns whether any closed.
bool close_grasps(CaptureRun& run, const std::vector<std::size_t>& grasps);

/// Grasps that reached their limits at the end of the last segment (CaptureRun::overloads) open, or begin to slip;
/// slips that came to rest hold again, and those that reached the limits of the slip open.
void open_overloaded_grasps(CaptureRun& run);

/// Opens grasps whose release time in the phase has been reached.
void release_due_grasps(CaptureRun& run, MotionPhase& phase);

/// Stops settled joints immediately if brakes hold them after the approach, and no grasp closes.
void stop_joints(CaptureRun& run);

}  // namespace grapnel
