#pragma once

/// @file
/// Scales of all quantities in a compliant impact, estimated from the rigid one: references for errors.

#include <Eigen/Core>

#include "grapnel/impact/compliant_system.hpp"

namespace grapnel {

struct CompliantScales {
  std::vector<double> of_y;  // size of each integrated number
  double speed = 0;          // maximum relative speed of contacts and grasps, including rotation [m/s]
  double shortest_time = 0;  // of all springs: 1 / natural frequency [s]
  double longest_contact_time = 0, longest_grasp_time = 0;  // [s]
  /// Grasps' relative motion: kinetic energy u^T A u / 2 of the stacked relative twists [angular; linear], expressed in
  /// the targets' axes at the start, with the inertia there. 6 grasps x 6 grasps.
  Eigen::MatrixXd grasp_inertia;
  double shape_impulse = 0, shape_moment = 0;  // of contacts between shapes [N s, N m s]

  /// Raises the sizes in of_y to those of rigid impacts at the shapes that touch. `system`: load() current.
  void add_shapes(const Model& model, const CompliantSystem& system, const ContactSet& contacts);
};

/// `system`: at the start, load() current.
CompliantScales compliant_scales(const Model& model, const State& state, const CompliantSystem& system,
                                 std::span<const CompliantContact> contacts, std::span<const CompliantGrasp> grasps);

/// Permitted errors per step: `relative` times the scales, but at least the rounding error of coordinates of order one.
std::vector<double> absolute_tolerances(const Model& model, const CompliantScales& scales, double relative);

}  // namespace grapnel
