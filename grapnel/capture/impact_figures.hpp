#pragma once

/// @file
/// Additional results of an impact: measures and sensitivities, and loads relative to the robot's ratings.

#include "grapnel/capture/impact_report.hpp"
#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/result/capture_result.hpp"

namespace grapnel {

/// Fills the report's measures from its impulses; contacts count as point contacts.
void add_measures(const ImpactTask& task, ImpactReport& report);

/// Fills the report's sensitivities; for law plastic, whose impulses the report has.
void add_sensitivities(const ImpactTask& task, ImpactReport& report);

/// Columns of impulses in the constrained directions of the grasps, each grasp's part in W, scaled so that the largest
/// component is 1; zero columns are omitted.
std::vector<SelfStress> describe_impulses(std::span<const Grasp> grasps, const Eigen::MatrixXd& columns);

/// The rating of a quantity: force, moment, impulse, angular_impulse, driving or driving_impulse.
double limit_of(const LoadRating& rating, std::string_view quantity);
/// Loads of the report's joints, six each, then of its grasps, without phase and rating. `peaks`: of a compliant
/// impact, per joint.
std::vector<PeakLoad> impact_loads(const ImpactReport& report, std::span<const JointPeakTimes> peaks = {});

/// Fills the report's margins, for every given rating, and per grasp the factor by which its end-effector could arrive
/// faster until one of its arm's ratings (the joints from it to the base, and the gripper) is reached. Forces and
/// moments are peaks for compliant impacts, otherwise impulses over ImpactReport::duration.
///
/// With all of u- scaled, the loads of an instantaneous impact scale alike (impulses are homogeneous of first degree in
/// u- under every law of ImpactSetup except the compliant one with a nonlinear force, where the factor is an estimate).
/// Joints that are braked during the impact also load their arm by their own motion: no limits are given then.
void add_margins(const CaptureProblem& problem, ImpactReport& report);

}  // namespace grapnel
