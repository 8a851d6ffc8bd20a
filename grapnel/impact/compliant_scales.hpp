#pragma once

/// @file
/// How large everything is in a compliant impact, estimated by the rigid one: what errors are judged by.

#include <Eigen/Core>

#include "grapnel/impact/compliant_system.hpp"

namespace grapnel {

struct CompliantScales {
  std::vector<double> of_y;  // size of each integrated number
  double speed = 0;          // largest relative speed of contacts and grasps, turning included [m/s]
  double shortest_time = 0;  // of all springs: 1 / natural frequency [s]
  double longest_contact_time = 0, longest_grasp_time = 0;  // [s]
  /// Grasps' relative motion: kinetic energy u^T A u / 2 of the stacked relative twists [angular; linear], expressed in
  /// the targets' axes at the start, with the inertia there. 6 grasps x 6 grasps.
  Eigen::MatrixXd grasp_inertia;
};

/// `system`: at the start, load() current.
CompliantScales compliant_scales(const Model& model, const State& state, const CompliantSystem& system,
                                 std::span<const CompliantContact> contacts, std::span<const CompliantGrasp> grasps);

/// Errors allowed per step, `relative` times the sizes, but not below the rounding of coordinates of order one.
std::vector<double> absolute_tolerances(const Model& model, const CompliantScales& scales, double relative);

}  // namespace grapnel
