#pragma once

/// @file
/// Begin and end of slips of grasps (docs/theory, section 8.7). All functions require the free system.

#include "grapnel/capture/capture_run.hpp"

namespace grapnel {

/// Grasps with these loads, which are at their limits, begin to slip, or the part of a slipping grasp that held until
/// now; positions and velocities do not change.
void begin_slips(CaptureRun& run, const std::vector<HoldLoad>& loads);

/// Slips, or parts of them, at rest hold again, in their present relative pose; slips beyond their limits open. The
/// rest of the relative velocity, at most the slip resolution, vanishes in a plastic impact.
void end_slips(CaptureRun& run, const GraspOverloads& overloads);

/// Opens the slipping grasps of a release, and adds them to its report.
void release_slips(CaptureRun& run, const PostImpactSetup::Release& release, ReleaseReport& report);

}  // namespace grapnel
