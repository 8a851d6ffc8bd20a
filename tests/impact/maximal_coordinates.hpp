#pragma once

/// @file
/// Plastic impact in maximal coordinates, an independent reference: six velocities per body (in W, at its centre of
/// mass), joints and grasps as constraint rows, all in one dense system
///   [M  C^T][ v+ ]   [M v-]
///   [C   0 ][-l  ] = [ 0  ],   M = diag(I_c, m 1) + sum a s^T s,
/// where row s gives a joint's rate from the bodies' velocities and a is the reflected inertia of its rotor. It uses
/// only Grapnel's descriptions and forward kinematics: no mass matrix, no Jacobian, no projection.

#include <Eigen/Core>

#include "grapnel/constraint/grasp.hpp"

namespace grapnel::testing {

struct MaximalSolution {
  std::vector<Twistd> V_WB;       // per body after the impact, at its frame's origin, in W
  std::vector<Impulsed> contact;  // per grasp, on the robot at the contact point (minimum norm if not unique)
  std::vector<Impulsed> joint;    // per body: what its joint transmits, about the body frame's origin, in W
  double residual = 0;            // of the linear system, relative
};

MaximalSolution maximal_impact(const Model& model, const State& state, std::span<const Grasp> grasps);

}  // namespace grapnel::testing
