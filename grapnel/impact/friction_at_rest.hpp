#pragma once

/// @file
/// Coulomb friction of contacts that do not slide: forces that hold as many of them as the cones allow.

#include <Eigen/Core>

namespace grapnel {

/// Friction at m points in their tangent planes.
struct FrictionForces {
  Eigen::VectorXd force;  // 2 m
  Eigen::VectorXd rate;   // 2 m: A force + b, how the points begin to slide: zero where they stick
  double missed = 0;      // by how much Coulomb's law is missed, over |b|: more than rounding if it was not solved
  bool crawled = false;   // sweeps did not come to an end: it took the interior-point method, ten times as long
};

/// Which forces, where points that stick can share in many ways what that takes. `any`: those that are found soonest.
/// `middle`: those farthest from their cones' edges (their analytic centre), which change smoothly with b and radius.
enum class FrictionChoice { any, middle };

/// The l that minimizes 1/2 l^T A l + l^T b over |l_i| <= radius_i (l_i: two components). Its optimality conditions are
/// Coulomb's law at the onset of sliding: either A l + b is zero at point i, or |l_i| = radius_i against it
/// (docs/theory, section 11). `A`: 2 m x 2 m, symmetric, positive semidefinite; the rate is unique also where it is
/// singular, the forces then are not. `b`: in the range of A but for rounding, as rates that the same bodies have are.
/// `start`: forces near the solution, or empty. What it costs is bounded.
FrictionForces friction_at_rest(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, const Eigen::VectorXd& radius,
                                const Eigen::VectorXd& start = {}, FrictionChoice choice = FrictionChoice::any);

/// Where every point can stick although A is singular: the factor by which all radii can shrink until one cannot, and
/// forces at (about) that factor. Above 1: not all can stick.
struct StickShare {
  Eigen::VectorXd force;
  double used = 0;  // largest |l_i| / radius_i
  int crawled = 0;  // how often
};
StickShare least_used_cones(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, const Eigen::VectorXd& radius);

}  // namespace grapnel
