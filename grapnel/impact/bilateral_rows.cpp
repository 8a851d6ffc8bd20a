#include "grapnel/impact/bilateral_rows.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "grapnel/constraint/impulsive_constraint.hpp"

namespace grapnel {
namespace {

Eigen::VectorXd as_vector(const std::vector<double>& v) {
  return Eigen::Map<const Eigen::VectorXd>(v.data(), static_cast<Eigen::Index>(v.size()));
}

// Solves and fills the books. `u_after` is what J v+ is to be; `impulse` receives P in constrained directions.
ImpactSolution solve(const Eigen::MatrixXd& M, const Eigen::MatrixXd& J, const State& state, const Eigen::MatrixXd& D,
                     const Eigen::VectorXd& u_after, Eigen::VectorXd& impulse) {
  const Eigen::VectorXd before = as_vector(state.v);
  const ImpulsiveSolution solved = solve_impulsive_constraint(M, J, before, D, u_after);
  const Eigen::VectorXd& after = solved.velocity;
  const Eigen::VectorXd change = after - before;
  const Eigen::VectorXd u = J * before;
  impulse = solved.impulse;

  ImpactSolution result;
  result.velocity.assign(after.begin(), after.end());
  result.rank = solved.rank;
  result.rows = static_cast<int>(J.rows());
  result.null_space = solved.null_space;
  result.kinetic_energy_before = 0.5 * before.dot(M * before);
  result.kinetic_energy_after = 0.5 * after.dot(M * after);
  // dT = P^T (u- + u+) / 2, which is -u-^T W^+ u- / 2 where u+ is zero: P is in the row space up to self-stress, which
  // does no work on u- or u+.
  const double work = 0.5 * impulse.dot(u + u_after);
  const double energy_scale = std::max(result.kinetic_energy_before, 1e-300);
  result.energy_identity_residual =
      std::abs((result.kinetic_energy_after - result.kinetic_energy_before) - work) / energy_scale;
  const double speed = std::max(u.size() > 0 ? u.lpNorm<Eigen::Infinity>() : 0.0, before.lpNorm<Eigen::Infinity>());
  if (speed > 0 && J.rows() > 0) result.constraint_residual = (J * after - u_after).lpNorm<Eigen::Infinity>() / speed;
  // Over the size of M v-, not of M dv: a grip that meets its target's motion exactly has a dv of rounding alone.
  if (result.kinetic_energy_before > 0) {
    const Eigen::VectorXd residual = M * change - J.transpose() * impulse;
    result.generalized_momentum_residual =
        std::sqrt(std::abs(residual.dot(M.llt().solve(residual))) / (2 * result.kinetic_energy_before));
  }
  return result;
}

// Per component of the grip's wrench: whether every self-stress leaves it alone. Self-stresses have unit size in the
// metric D, so a component's share is measured against the largest that unit size allows, sqrt(a D^-1 a^T) for
// direction a.
std::vector<bool> determined_components(const Eigen::MatrixXd& directions, const Eigen::MatrixXd& null_rows,
                                        const Eigen::MatrixXd& D) {
  const Eigen::MatrixXd stress = directions.transpose() * null_rows;  // 6 x (rows - rank)
  const Eigen::MatrixXd largest = directions.transpose() * D.llt().solve(directions);
  std::vector<bool> determined(6, true);
  for (int i = 0; i < 6; ++i) determined[i] = stress.row(i).norm() <= 1e-8 * std::sqrt(largest(i, i));
  return determined;
}

}  // namespace

BilateralRows bilateral_rows(const Model& model, const Kinematics& kinematics, const Eigen::MatrixXd& M,
                             std::span<const Grasp> grasps, std::span<const HeldRate> held) {
  const Eigen::MatrixXd J_grips = grasp_jacobian(model, kinematics, grasps);
  const Eigen::Index grip_rows = J_grips.rows(), held_rows = static_cast<Eigen::Index>(held.size());
  const Eigen::Index count = grip_rows + held_rows;
  BilateralRows rows{Eigen::MatrixXd::Zero(count, model.velocities()), Eigen::MatrixXd::Zero(count, count),
                     Eigen::VectorXd::Zero(count)};
  rows.J.topRows(grip_rows) = J_grips;
  for (Eigen::Index i = 0; i < held_rows; ++i) {
    rows.J(grip_rows + i, held[i].velocity) = 1;
    rows.held_after[grip_rows + i] = held[i].after;
  }
  for (Eigen::Index row = 0; const Grasp& g : grasps) {
    rows.D.block(row, row, row_count(g.model), row_count(g.model)) = target_mobility(model, kinematics, g);
    row += row_count(g.model);
  }
  if (held_rows > 0) {
    // Held rates only have to be commensurable: what each impulse does alone.
    const Eigen::MatrixXd J_held = rows.J.bottomRows(held_rows);
    const Eigen::MatrixXd alone = J_held * M.llt().solve(J_held.transpose());
    rows.D.bottomRightCorner(held_rows, held_rows) = alone.diagonal().asDiagonal();
  }
  return rows;
}

ImpactSolution solve_rows(const Eigen::MatrixXd& M, const BilateralRows& rows, const State& before,
                          const Eigen::VectorXd& u_after, std::span<const Grasp> grasps,
                          std::span<const HeldRate> held) {
  Eigen::VectorXd impulse;
  ImpactSolution result = solve(M, rows.J, before, rows.D, u_after, impulse);
  Eigen::Index row = 0;
  for (const Grasp& g : grasps) {
    const int count = row_count(g.model);
    const Eigen::MatrixXd A = constrained_directions(g);
    const Eigen::VectorXd P = A.transpose() * impulse.segment(row, count);
    result.contacts.push_back(
        {{{P[0], P[1], P[2]}, {P[3], P[4], P[5]}},
         determined_components(A, result.null_space.middleRows(row, count), rows.D.block(row, row, count, count))});
    row += count;
  }
  for (const HeldRate& h : held) {
    result.held_impulses.push_back(impulse[row++]);
    result.velocity[h.velocity] = h.after;  // exactly, not to rounding
  }
  return result;
}

}  // namespace grapnel
