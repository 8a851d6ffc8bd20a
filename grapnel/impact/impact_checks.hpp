#pragma once

/// @file
/// Checks of one impact without duration, of every law: (9.5) and (9.6) of docs/theory.md. They are relative to what
/// takes part in the impact, so that a heavy body elsewhere hides nothing.

#include <Eigen/Core>

#include "grapnel/model/model.hpp"

namespace grapnel {

struct ImpactChecks {
  double kinetic_energy_before = 0;  // [J], by the mass matrix, of the whole model
  double kinetic_energy_after = 0;
  double energy_identity_residual = 0;       // |dT - work of the impulses|, over T before or after of what takes part
  double generalized_momentum_residual = 0;  // (3.6): |M dv - J^T P| in the energy norm, over that of M v, likewise
};

/// Per velocity: one if rows `J` (rows x velocities) act on the tree that it belongs to, zero otherwise.
Eigen::VectorXd taking_part(const Model& model, const Eigen::MatrixXd& J);

/// Checks of the impact that makes `after` of the velocities `before`, under the generalized impulse `impulse` (J^T P).
/// `work` [J]: what the impulses do, P^T (u- + u+) / 2. `part` is taking_part() of all rows.
ImpactChecks impact_checks(const Eigen::MatrixXd& M, const Eigen::VectorXd& part, const Eigen::VectorXd& before,
                           const Eigen::VectorXd& after, const Eigen::VectorXd& impulse, double work);

}  // namespace grapnel
