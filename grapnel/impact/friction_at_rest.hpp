#pragma once

/// @file
/// Coulomb friction of contacts that do not slide: forces that hold as many of them as the cones allow.

#include <Eigen/Core>

namespace grapnel {

/// Friction at m points in their tangent planes.
struct FrictionForces {
  Eigen::VectorXd force;  // 2 m
  Eigen::VectorXd rate;   // 2 m: A force + b, the initial slip rate: zero for sticking points
  double missed = 0;      // residual of Coulomb's law, over |b|: above rounding if it was not solved
  bool crawled = false;   // sweeps did not converge: the interior-point method was used, at ten times the cost
};

/// The choice among forces if sticking points can share the load in many ways. `any`: the first solution found.
/// `middle`: the one farthest from the cones' edges (the analytic centre), which depends smoothly on b and radius.
enum class FrictionChoice { any, middle };

/// The l that minimizes 1/2 l^T A l + l^T b over |l_i| <= radius_i (l_i: two components). Its optimality conditions are
/// Coulomb's law at the onset of sliding: either A l + b is zero at point i, or |l_i| = radius_i opposite to it
/// (docs/theory, section 11). `A`: 2 m x 2 m, symmetric, positive semidefinite; if it is singular the rate is still
/// unique, but the forces are not. `b`: in the range of A up to rounding, as for rates of the same bodies. `start`:
/// forces near the solution, or empty. The cost is bounded.
FrictionForces friction_at_rest(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, const Eigen::VectorXd& radius,
                                const Eigen::VectorXd& start = {}, FrictionChoice choice = FrictionChoice::any);

/// If every point can stick although A is singular: the factor by which all radii can shrink until one cannot, and
/// forces at (about) that factor. Above 1: not all can stick.
struct StickShare {
  Eigen::VectorXd force;
  double used = 0;  // largest |l_i| / radius_i
  int crawled = 0;  // number of slow solutions
};
StickShare least_used_cones(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, const Eigen::VectorXd& radius);

}  // namespace grapnel
