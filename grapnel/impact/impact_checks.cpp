#include "grapnel/impact/impact_checks.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "grapnel/dense/decompositions.hpp"

namespace grapnel {
namespace {

double kinetic_energy(const Eigen::MatrixXd& M, const Eigen::VectorXd& v) { return 0.5 * v.dot(M * v); }

// Infinite where something came of nothing.
double ratio(double value, double scale) { return value == 0 ? 0 : value / scale; }

}  // namespace

Eigen::VectorXd taking_part(const Model& model, const Eigen::MatrixXd& J) {
  std::vector<bool> touched(model.bodies().size());
  const auto count_of = [&](const Body& body) { return velocity_count(body.description.joint.type); };
  for (const Body& body : model.bodies()) {
    if (!J.middleCols(body.v, count_of(body)).isZero(0)) touched[body.root] = true;
  }
  Eigen::VectorXd part(model.velocities());
  for (const Body& body : model.bodies()) part.segment(body.v, count_of(body)).setConstant(touched[body.root] ? 1 : 0);
  return part;
}

ImpactChecks impact_checks(const Eigen::MatrixXd& M, const Eigen::VectorXd& part, const Eigen::VectorXd& before,
                           const Eigen::VectorXd& after, const Eigen::VectorXd& impulse, double work) {
  ImpactChecks checks;
  checks.kinetic_energy_before = kinetic_energy(M, before);
  checks.kinetic_energy_after = kinetic_energy(M, after);
  const double T0 = kinetic_energy(M, before.cwiseProduct(part)), T1 = kinetic_energy(M, after.cwiseProduct(part));
  // Of M v, not of M dv: a grasp that meets its target's motion exactly has a dv of rounding alone. After the impact
  // there may be more of it than before, where drives work.
  const double scale = std::max(T0, T1);
  checks.energy_identity_residual = ratio(std::abs((T1 - T0) - work), scale);
  // Over everything: a body that takes no part must not change its motion.
  const Eigen::VectorXd residual = M * (after - before) - impulse;
  checks.generalized_momentum_residual = std::sqrt(ratio(std::abs(residual.dot(M.llt().solve(residual))), 2 * scale));
  return checks;
}

}  // namespace grapnel
