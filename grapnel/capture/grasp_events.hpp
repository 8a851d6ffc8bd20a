#pragma once

/// @file
/// What happens at the instants between pieces of motion, where velocities jump: grasps close or contacts touch, in an
/// impact at once or in time; joints are locked by their brakes; grasps release.

#include "grapnel/capture/capture_run.hpp"
#include "grapnel/capture/phase_segment.hpp"

namespace grapnel {

// --- What happens when (grasp_events.cpp) ---

/// Closes what is due at a phase's present instant: grasps that close on arrival or at stated times. What closes
/// together at the approach's end waits for that. Whether there is motion left in the phase.
bool close_due_grasps(CaptureRun& run, const MotionPhase& phase);

/// Decides on grasps of the problem, and lets those meet that are within their envelopes: at once, in one impact; but
/// what grasps does so before what only touches. Whether any did.
bool close_grasps(CaptureRun& run, const std::vector<std::size_t>& grasps);

/// Opens grasps whose time since the phase's begin has come.
void release_due_grasps(CaptureRun& run, MotionPhase& phase);

// --- What grasps that close have in common, whatever the law (grasp_events.cpp) ---

/// A contact that begins.
struct Meeting {
  std::string phase;                 // its name
  std::vector<std::size_t> closing;  // grasps of the problem
  Contact contact;                   // in the free system: of grasps that hold already, then of these
};
/// Puts the bodies into the free system, and targets where the rule for gaps puts them; arms that close settle.
/// @throws RunFailure where gaps are too wide.
Meeting meet(CaptureRun& run, const std::vector<std::size_t>& closing);
/// What has met holds, or is apart again. In the free system. `unfinished`: of an impact in time, per grasp that closes
/// (may be empty): how it was still under way at its end.
void hold_or_part(CaptureRun& run, const Meeting& meeting, ImpactSetup::Law law, const ImpactReport& report,
                  std::span<const std::string> unfinished = {});
/// Puts a report into the result, with margins and warnings.
void keep_report(CaptureRun& run, ImpactReport report);

// --- Impacts (grasp_events.cpp) ---

/// Grasps close, or contacts touch: in the free system, where those that hold already are constraints like the new
/// ones.
void impact_at_once(CaptureRun& run, const std::vector<std::size_t>& closing, ImpactSetup::Law law);
/// The impact takes its time: grasps and contacts yield meanwhile, then grasps are rigid.
void impact_in_time(CaptureRun& run, const std::vector<std::size_t>& closing);

// --- Brakes (grasp_events.cpp) ---

/// Joints that settle stop at once, if brakes hold them after the approach. In the free system.
std::optional<BrakeReport> lock_settled_joints(CaptureRun& run);
/// The same in the system as it is, where joints settle while no grasp closes.
void stop_joints(CaptureRun& run);

}  // namespace grapnel
