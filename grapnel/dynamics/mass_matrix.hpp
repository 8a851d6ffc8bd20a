#pragma once

/// @file
/// Matrices of the equations of motion (2.7), M vdot + c = tau + sum J^T F. Public, kept stable.

#include <Eigen/Core>

#include "grapnel/dynamics/forward_dynamics.hpp"

namespace grapnel {

/// The mass matrix M of (2.7), rotors included; velocities x velocities. No allocation if `M` has that size. With modal
/// joints M is that of modal_chains.hpp, which allocates.
void mass_matrix(const Model& model, const State& state, Workspace& workspace, Eigen::MatrixXd& M);
Eigen::MatrixXd mass_matrix(const Model& model, const State& state);

/// The bias c = [c_b; c_m] of (2.7): generalized forces at zero acceleration, gravity included.
void bias(const Model& model, const State& state, const Vector3d& gravity, Workspace& workspace,
          std::vector<double>& c);

}  // namespace grapnel
