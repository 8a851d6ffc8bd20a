#pragma once

/// @file
/// What a report of an impact says beyond its impulses: measures and sensitivities, and loads against the robot's
/// ratings.

#include "grapnel/impact_report/impact_report.hpp"
#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/result/capture_result.hpp"

namespace grapnel {

/// Fills the report's measures from its impulses; contacts count as point contacts.
void add_measures(const ImpactTask& task, ImpactReport& report);

/// Fills the report's sensitivities; for law plastic, whose impulses the report has.
void add_sensitivities(const ImpactTask& task, ImpactReport& report);

/// Columns of impulses in the constrained directions of the grasps, each grasp's part in W, scaled so that the largest
/// component is 1; columns of zeros are left out.
std::vector<SelfStress> describe_impulses(std::span<const Grasp> grasps, const Eigen::MatrixXd& columns);

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
