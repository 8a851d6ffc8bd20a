#pragma once

/// @file
/// Plans of an approach with estimates of the targets: the initial plan, and replanning during the approach.

#include "grapnel/approach/approach_plan.hpp"
#include "grapnel/capture/capture_run.hpp"

namespace grapnel {

/// Plans the whole approach with the estimates; records in the result if there are any.
ApproachPlan plan_on_estimates(CaptureRun& run, const TargetPlan& truth);

/// The next time after `now` at which the rest of the approach is replanned; infinite: none [s].
double next_replanning(const CaptureRun& run, double now);

/// Replans at such a time: with the readings of relative pose sensors for targets that have one, and with true values
/// for the others. If no plan is found the previous one remains.
void replan_if_due(CaptureRun& run);

}  // namespace grapnel
