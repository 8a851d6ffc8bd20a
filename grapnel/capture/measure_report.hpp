#pragma once

/// @file
/// Measures and sensitivities of an impact, as results have them. Thread safety: pure functions.

#include "grapnel/capture/impact_report.hpp"

namespace grapnel {

/// Fills the report's measures from its impulses; contacts count as point contacts.
void add_measures(const ImpactTask& task, ImpactReport& report);

/// Fills the report's sensitivities; for law plastic, whose impulses the report has.
void add_sensitivities(const ImpactTask& task, ImpactReport& report);

/// Columns of impulses in the constrained directions of the grasps, each grasp's part in W, scaled so that the largest
/// component is 1; columns of zeros are left out.
std::vector<SelfStress> describe_impulses(std::span<const Grasp> grasps, const Eigen::MatrixXd& columns);

}  // namespace grapnel
