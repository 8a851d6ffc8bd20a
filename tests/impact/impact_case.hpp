#pragma once

/// @file
/// Random robots with random grasps on random targets, and functions for tests of impact identities.

#include <Eigen/Core>

#include "grapnel/dynamics/mass_matrix.hpp"
#include "grapnel/impact/plastic_impact.hpp"
#include "support/eigen_values.hpp"
#include "support/random_robot.hpp"

namespace grapnel::testing {

inline constexpr int kImpacts = 300;

struct ImpactCase {
  Model model;
  State state;
  std::vector<Grasp> grasps;
};

/// Case `index`: one to three targets, each with one or two grasps of all kinds at points near it. A robot body may
/// hold several targets, so loops occur. Some cases have a fixed root, some have spherical joints.
ImpactCase random_impact(int index);
/// The same with every target grasped once and a free root.
ImpactCase random_open_impact(int index);

inline State with_velocity(State state, const std::vector<double>& v) {
  state.v = v;
  return state;
}
/// Stacked impulses in the grasps' constrained directions.
Eigen::VectorXd stacked_impulse(const ImpactCase& c, const ImpactSolution& solution);

}  // namespace grapnel::testing
