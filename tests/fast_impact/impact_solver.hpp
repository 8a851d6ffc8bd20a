#pragma once

/// @file
/// Plastic impact of all grasps in O(n): an independent implementation of plastic_impact(), for tests and benchmarks.
/// Captures do not use it; docs/performance.md states its benefits and costs.

#include <memory>
#include <span>

#include "grapnel/impact/plastic_impact.hpp"

namespace grapnel {

/// Solves impacts of one model with the same bodies grasping, at any states and contact points.
class ImpactSolver {
 public:
  /// Of `grasps` the bodies and kinds are read. The model must outlive the solver.
  /// @throws std::invalid_argument if a grasp names no two bodies, or two that no joint parts.
  ImpactSolver(const Model& model, std::span<const Grasp> grasps);
  ~ImpactSolver();
  ImpactSolver(ImpactSolver&&) noexcept;
  ImpactSolver& operator=(ImpactSolver&&) noexcept;

  /// Solves the impact at coordinates q and velocities v. `grasps`: those of the constructor, now with their contact
  /// points and hinge axes in W. `held`: as of plastic_impact(), but all velocities of a free root or of a spherical
  /// joint, or none; drives are overpowered as there. Allocates nothing.
  /// @throws std::invalid_argument for another model's sizes, other grasps, or a joint held in part.
  void solve(std::span<const double> q, std::span<const double> v, std::span<const Grasp> grasps,
             std::span<const HeldRate> held = {});

  /// Of the last solve() (before the first: zero). Velocities v+ of the whole model.
  std::span<const double> velocity() const;
  /// Per grasp, on the robot at the contact point, in W [N m s; N s]. Where rows are redundant those with the least sum
  /// of P^T (J_t M_t^-1 J_t^T) P, as of plastic_impact().
  std::span<const Impulsed> impulses() const;
  /// Per velocity: the impulse that a held one takes, zero at the others [N m s or N s].
  std::span<const double> held_impulses() const;
  /// Independent rows of the grasps, given what is held, and all rows of the grasps. plastic_impact() counts held rates
  /// in both.
  int rank() const;
  int rows() const;
  /// What is left of the relative velocities in the constrained directions, over the velocities of the two sides (both
  /// in units in which the free target's mobility is 1).
  double constraint_residual() const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace grapnel
