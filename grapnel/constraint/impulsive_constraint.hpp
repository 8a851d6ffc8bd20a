#pragma once

/// @file
/// Impulses that bring velocities onto linear constraints; detects redundant rows.

#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {

/// Solution of M (v+ - v-) = J^T P with J v+ = w.
struct ImpulsiveSolution {
  Eigen::VectorXd velocity;    // v+, unique
  Eigen::VectorXd impulse;     // P: the solution with the minimum P^T D P
  Eigen::MatrixXd null_space;  // rows x (rows - rank): basis of self-stresses, impulses that change no velocity
  int rank = 0;
};

/// Solves for a given mass matrix M (symmetric positive definite), constraint Jacobian J (rows x velocities), velocity
/// v- and metric D (rows x rows, symmetric positive definite). D selects the impulse if rows are redundant, and makes
/// impulses commensurable for the rank decision.
///
/// With M = L L^T, D = G G^T and Y = L^-1 J^T G^-T the post-impact velocity is the M-orthogonal projection
///   L^T v+ = (1 - Y Y^+) L^T v-,   P = -G^-T Y^+ L^T v-,
/// (for w = 0; in general Y^+T G^-1 w is added) by the singular value decomposition of Y. The rank is therefore decided
/// on dimensionless numbers whose squares are the eigenvalues of G^-1 W G^-T, W = J M^-1 J^T. `after` is w, rows;
/// empty: zero. Components of w outside the range of J are ignored. @throws std::invalid_argument if sizes do not match
/// or M or D is not positive definite.
ImpulsiveSolution solve_impulsive_constraint(const Eigen::MatrixXd& M, const Eigen::MatrixXd& J,
                                             const Eigen::VectorXd& v, const Eigen::MatrixXd& D,
                                             const Eigen::VectorXd& after = {});
/// Likewise for a given factor of M.
ImpulsiveSolution solve_impulsive_constraint(const Cholesky& M, const Eigen::MatrixXd& J, const Eigen::VectorXd& v,
                                             const Eigen::MatrixXd& D, const Eigen::VectorXd& after = {});

}  // namespace grapnel
