#pragma once

/// @file
/// Rows that hold in both directions during an impact: those of grasps, then held rates; and the solution of any impact
/// that prescribes their velocities afterwards.

#include "grapnel/constraint/impulsive_constraint.hpp"
#include "grapnel/impact/plastic_impact.hpp"

namespace grapnel {

struct BilateralRows {
  Eigen::MatrixXd J;             // rows x velocities: grasp_jacobian(), then a unit entry per held rate
  Eigen::MatrixXd D;             // rows x rows: metric (7.8) of docs/theory.md; held rates the diagonal of J M^-1 J^T
  Eigen::VectorXd held_after;    // rows: zero for grasps, HeldRate::after for held rates
  Eigen::VectorXd held_inertia;  // per held rate: drive_inertia(), with which it resists grasps that contradict it
  std::vector<int> held;         // their indices in State::v
  Eigen::VectorXd part;          // per velocity: taking_part() of these rows
};

/// `kinematics` of the state at which `M` is the mass matrix.
BilateralRows bilateral_rows(const Model& model, const Kinematics& kinematics, const Eigen::MatrixXd& M,
                             std::span<const Grasp> grasps, std::span<const HeldRate> held);

/// M (v+ - v-) = J^T P, J v+ = `u_after` as far as redundant rows allow. Held velocities are eliminated, so that they
/// are exact and the least singular value of what is left is that of the grasps: (7.21) of docs/theory.md. As of
/// solve_impulsive_constraint() otherwise.
/// @throws std::invalid_argument if M is not positive definite.
ImpulsiveSolution solve_bilateral(const Eigen::MatrixXd& M, const BilateralRows& rows, const Eigen::VectorXd& v,
                                  const Eigen::VectorXd& u_after);

/// M (v+ - v-) = J^T P, J v+ = `u_after` as far as redundant rows allow (docs/theory.md, equations (7.5)-(7.7)), with
/// its checks; drives whose rates the grasps do not allow give way, (7.20). `rows` are those of `grasps` and `held`.
ImpactSolution solve_rows(const Eigen::MatrixXd& M, const BilateralRows& rows, const State& before,
                          const Eigen::VectorXd& u_after, std::span<const Grasp> grasps,
                          std::span<const HeldRate> held);

}  // namespace grapnel
