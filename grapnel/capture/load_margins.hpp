#pragma once

/// @file
/// An impact's loads against the ratings of the robot file. Thread safety: pure functions.

#include "grapnel/capture/capture_problem.hpp"
#include "grapnel/result/capture_result.hpp"

namespace grapnel {

/// Fills the report's margins, for every rating that is given, and per grasp how much faster its end-effector might
/// come until one of its arm (the joints from it to the base, and the gripper) is reached. Forces and moments are peaks
/// where the impact was resolved in time, else impulses over ImpactReport::duration.
///
/// With all of u- scaled, the loads of an impact without duration scale alike (impulses are homogeneous of first degree
/// in u- under every law of ImpactSetup but the compliant one with a force that is not linear, where the factor is an
/// estimate). Joints that are braked during the impact load their arm by their own motion as well: no limits are given
/// then.
void add_margins(const CaptureProblem& problem, ImpactReport& report);

}  // namespace grapnel
