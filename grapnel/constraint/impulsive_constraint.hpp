#pragma once

/// @file
/// Impulses that bring velocities onto linear constraints, with redundant rows recognized.

#include "grapnel/dense/decompositions.hpp"

namespace grapnel {

/// Solution of M (v+ - v-) = J^T P with J v+ = w.
struct ImpulsiveSolution {
  Eigen::VectorXd velocity;    // v+, unique
  Eigen::VectorXd impulse;     // P: of all solutions the one with the least P^T D P
  Eigen::MatrixXd null_space;  // rows x (rows - rank): basis of self-stresses, impulses that change no velocity
  int rank = 0;
};

/// Solves for given mass matrix M (symmetric positive definite), constraint Jacobian J (rows x velocities), velocity v-
/// and metric D (rows x rows, symmetric positive definite) that decides among impulses when rows are redundant and that
/// makes them commensurable for the rank decision.
///
/// With M = L L^T, D = G G^T and Y = L^-1 J^T G^-T the post-impact velocity is the M-orthogonal projection
///   L^T v+ = (1 - Y Y^+) L^T v-,   P = -G^-T Y^+ L^T v-,
/// (for w = 0; in general Y^+T G^-1 w joins) by the singular value decomposition of Y, so that the rank is decided on
/// dimensionless numbers whose squares are the eigenvalues of G^-1 W G^-T, W = J M^-1 J^T. `after` is w, rows; empty:
/// zero. It must be in the range of J, or the part that is not is left out.
/// @throws std::invalid_argument if sizes do not fit or M or D is not positive definite.
ImpulsiveSolution solve_impulsive_constraint(const Eigen::MatrixXd& M, const Eigen::MatrixXd& J,
                                             const Eigen::VectorXd& v, const Eigen::MatrixXd& D,
                                             const Eigen::VectorXd& after = {});
/// The same for M's factor, which those who need it for more than this have already.
ImpulsiveSolution solve_impulsive_constraint(const Cholesky& M, const Eigen::MatrixXd& J, const Eigen::VectorXd& v,
                                             const Eigen::MatrixXd& D, const Eigen::VectorXd& after = {});

}  // namespace grapnel
