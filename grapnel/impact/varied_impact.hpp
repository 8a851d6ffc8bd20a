#pragma once

/// @file
/// The matrices of an impact and their derivatives along a change of the problem, from one pass of dual numbers through
/// the kernels.

#include <Eigen/Core>

#include "grapnel/impact/plastic_impact.hpp"

namespace grapnel {

/// A direction in which the problem of an impact changes: derivatives with respect to one parameter.
struct ImpactVariation {
  std::vector<double> configuration;          // of the coordinates, as velocities (State::v's meaning); targets: zero
  std::vector<double> velocity;               // of State::v
  int grasp = -1;                             // whose contact point and hinge axis move
  Vector3d contact = Vector3d::zero();        // of its contact point, in W [m]
  Vector3d turn = Vector3d::zero();           // rotation of its hinge axis, in W [rad]
  int target = -1;                            // body whose mass and inertia change
  double mass = 0;                            // [kg]
  Symmetric3d inertia = Symmetric3d::zero();  // about its centre of mass, in its axes [kg m^2]

  explicit ImpactVariation(const Model& model)
      : configuration(model.velocities(), 0.0), velocity(model.velocities(), 0.0) {}
};

/// A matrix and its derivative.
struct DualMatrix {
  Eigen::MatrixXd value, derivative;
};

/// M, J and D of docs/theory.md, equations (7.1), (7.2) and (7.8), rows of grasps first, then of held rates.
struct VariedImpact {
  DualMatrix M;  // mass matrix
  DualMatrix J;  // relative Jacobian
  DualMatrix D;  // metric of impulses
  /// Selects constrained components of each grasp's relative twist, rows x 6; its derivative turns with the hinge.
  std::vector<DualMatrix> directions;
};

VariedImpact vary_impact(const Model& model, const State& state, std::span<const Grasp> grasps,
                         std::span<const HeldRate> held, const ImpactVariation& variation);

/// Jacobians of the grasping bodies alone at the contact points, stacked, 6 rows per grasp, in W, as the configuration
/// changes by `configuration` and the contact points stay.
DualMatrix vary_end_effectors(const Model& model, const State& state, std::span<const Grasp> grasps,
                              const std::vector<double>& configuration);

}  // namespace grapnel
