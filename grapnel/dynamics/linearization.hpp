#pragma once

/// @file
/// Linear models of the equations of motion (2.7) about a state, for the design of controllers and estimators.
/// Public, kept stable (grapnel/api/linearization.hpp).

#include <Eigen/Core>
#include <vector>

#include "grapnel/dynamics/forward_dynamics.hpp"

namespace grapnel {

/// x' = A x + B u + ... to first order in x and u, where x = [xi; dv], n = Model::velocities() values each:
///
/// - xi: the displacement from the reference motion, in the order and units of State::v. A joint: the change of its
///   position. A free root: the rotation vector and the displacement [rad; m] in the axes of the reference base. A
///   spherical joint: the rotation vector in the reference child.
/// - dv: the change of State::v.
/// - u: the change of the generalized forces, as in Forces::generalized.
///
/// The reference motion passes through the state with the accelerations `vdot`. A and B are those at this instant.
struct Linearization {
  Eigen::MatrixXd A;         // 2n x 2n
  Eigen::MatrixXd B;         // 2n x n
  std::vector<double> vdot;  // of the reference motion, forward_dynamics()
};

/// The linear model about `state` under `forces`, by automatic differentiation: exact up to rounding errors. External
/// wrenches keep their components in W and the point of their body. Springs, friction and controllers of joints act
/// only as far as `forces` contain them. @throws std::invalid_argument if a size does not match the model, or if the
/// model has modal or coupled joints.
Linearization linearize(const Model& model, const State& state, const Forces& forces = {});

}  // namespace grapnel
