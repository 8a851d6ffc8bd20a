#pragma once

/// @file
/// Events between motion segments, at which velocities jump: grasps close or contacts touch, in an instantaneous or
/// compliant impact; brakes lock joints; grasps release.

#include "grapnel/capture/capture_run.hpp"
#include "grapnel/capture/phase_segment.hpp"

namespace grapnel {

// --- Order of events (grasp_events.cpp) ---

/// Closes grasps that are due at the current instant of a phase: on arrival or at stated times. Grasps that close
/// together wait for the approach's end. Returns whether motion remains in the phase.
bool close_due_grasps(CaptureRun& run, const MotionPhase& phase);

/// Decides on grasps of the problem, and closes those within their envelopes simultaneously, in one impact; grasps
/// precede contacts. Returns whether any closed.
bool close_grasps(CaptureRun& run, const std::vector<std::size_t>& grasps);

/// Opens grasps whose release time in the phase has been reached.
void release_due_grasps(CaptureRun& run, MotionPhase& phase);

// --- Common parts of all impact laws (grasp_events.cpp) ---

/// A contact that begins.
struct Meeting {
  std::string phase;                 // its name
  std::vector<std::size_t> closing;  // grasps of the problem
  Contact contact;                   // in the free system: grasps that already hold, then these
};
/// Converts the bodies to the free system, moves targets by the rule for gaps, and settles the arms that close. @throws
/// RunFailure if gaps are too large.
Meeting meet(CaptureRun& run, const std::vector<std::size_t>& closing);
/// Closes the grasps that hold, and marks the others as parted. In the free system. `unfinished`: for a compliant
/// impact, per closing grasp (may be empty), its state if the impact was cut short.
void hold_or_part(CaptureRun& run, const Meeting& meeting, ImpactSetup::Law law, const ImpactReport& report,
                  std::span<const std::string> unfinished = {});
/// Adds a report to the result, with margins and warnings.
void keep_report(CaptureRun& run, ImpactReport report);

// --- Impacts (grasp_events.cpp) ---

/// Instantaneous impact of grasps or contacts: in the free system, in which grasps that already hold are constraints
/// like the new ones.
void impact_at_once(CaptureRun& run, const std::vector<std::size_t>& closing, ImpactSetup::Law law);
/// Compliant impact: grasps and contacts are compliant during the impact, and grasps are rigid afterwards.
void impact_in_time(CaptureRun& run, const std::vector<std::size_t>& closing);

// --- Brakes (grasp_events.cpp) ---

/// Stops settled joints immediately, if brakes hold them after the approach. In the free system.
std::optional<BrakeReport> lock_settled_joints(CaptureRun& run);
/// The same in the current system, if joints settle while no grasp closes.
void stop_joints(CaptureRun& run);

}  // namespace grapnel
