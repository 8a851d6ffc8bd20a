#pragma once

/// @file
/// Plans of an approach on estimates of the targets: the first one, and what is left of it planned anew in flight.

#include "grapnel/approach/approach_plan.hpp"
#include "grapnel/capture/capture_run.hpp"

namespace grapnel {

/// The plan of the whole approach on the estimates, noted in the result where there are any.
ApproachPlan plan_on_estimates(CaptureRun& run, const TargetPlan& truth);

/// When what is left of the approach is planned anew next, after `now`; infinite: not any more [s].
double next_replanning(const CaptureRun& run, double now);

/// At such a time: by what the relative pose sensors have said until now of targets that have one, and by the truth of
/// others. Where no plan is found the one before stays.
void replan_if_due(CaptureRun& run);

}  // namespace grapnel
