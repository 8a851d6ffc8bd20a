#pragma once

/// @file
/// A planned approach as a scenario that says the joint values themselves.

#include <string>

#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/text/yaml_tree.hpp"

namespace grapnel {

/// Whether the program has to find something before the approach can be flown.
bool has_something_to_plan(const ApproachSetup& approach);

/// Plans the approach of `problem`, if there is anything to plan, and makes its scenario's tree say what was found:
/// approach.final_joints and final_rates in place of approach.plan and of rates to be matched, joint values and rates
/// for waypoints given by places; of an approach that goes straight in, or
/// whose rates are beyond a joint's limit (of which planning only warns), approach.pieces in place of all these.
/// Relative velocities at grasps have then done their work and are dropped. The tree's approach is the same motion as
/// before, up to rounding, and stays it whatever else in the scenario changes.
/// @throws std::runtime_error, a line without its end, if there is no plan.
void freeze_plan(const CaptureProblem& problem, Node& scenario);

}  // namespace grapnel
