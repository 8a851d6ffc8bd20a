#include "grapnel/impact/plastic_impact.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "grapnel/dynamics/mass_matrix.hpp"
#include "grapnel/dynamics/momentum.hpp"
#include "grapnel/impact/yielding_drives.hpp"
#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {

namespace {

double kinetic_energy(const Eigen::MatrixXd& M, const Eigen::VectorXd& v) { return 0.5 * v.dot(M * v); }

// Infinite for a nonzero value with zero scale.
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

// M, velocities before and after, J^T P and its work => kinetic energies [J], residuals of momentum (9.5) and of the
// energy identity (9.6). Residuals are relative to the larger kinetic energy of the trees that take part; that of the
// momentum of the other trees to 1e-8 of their kinetic energy, if this is more.
ImpactChecks impact_checks(const Eigen::MatrixXd& M, const Cholesky& factor, const Eigen::VectorXd& part,
                           const Eigen::VectorXd& before, const Eigen::VectorXd& after, const Eigen::VectorXd& impulse,
                           double work) {
  ImpactChecks checks;
  checks.kinetic_energy_before = kinetic_energy(M, before);
  checks.kinetic_energy_after = kinetic_energy(M, after);
  const double T0 = kinetic_energy(M, before.cwiseProduct(part)), T1 = kinetic_energy(M, after.cwiseProduct(part));
  const Eigen::VectorXd others = Eigen::VectorXd::Ones(part.size()) - part;
  const double T_others =
      std::max(kinetic_energy(M, before.cwiseProduct(others)), kinetic_energy(M, after.cwiseProduct(others)));
  // Relative to M v, not M dv: for a grasp that meets its target's motion exactly, dv is a rounding error. The energy
  // after the impact may exceed that before if drives do work. Of what is at rest up to rounding, nothing is relative.
  constexpr double kAtRest = 1e-20;
  const double scale = std::max({T0, T1, kAtRest * T_others});
  checks.energy_identity_residual = ratio(std::abs((T1 - T0) - work), scale);
  // A body outside the impact must not change its motion, except by rounding: 1e-4 of its speed counts. M couples no
  // trees.
  constexpr double kRounded = 1e-8;
  const Eigen::VectorXd residual = M * (after - before) - impulse;
  const auto momentum = [&](const Eigen::VectorXd& of, double energy) {
    const Eigen::VectorXd r = residual.cwiseProduct(of);
    return std::sqrt(ratio(std::abs(r.dot(cholesky_solution(factor, r))), 2 * energy));
  };
  checks.generalized_momentum_residual =
      std::max(momentum(part, scale), momentum(others, std::max(scale, kRounded * T_others)));
  return checks;
}

std::vector<HeldRate> coupling_rates(const Model& model) {
  std::vector<HeldRate> rates;
  for (const JointCoupling& coupling : model.couplings()) {
    HeldRate& rate = rates.emplace_back(HeldRate{-1, 0, std::vector<double>(model.velocities(), 0.0)});
    for (const auto& [body, factor] : coupling.joints) rate.row[model.bodies()[body].v] = factor;
  }
  return rates;
}

ImpactSolution plastic_impact(const Model& model, const State& state, std::span<const Grasp> grasps,
                              std::span<const HeldRate> held) {
  const Kinematics kinematics = forward_kinematics(model, state);
  const Eigen::MatrixXd M = mass_matrix(model, state);
  const BilateralRows rows = bilateral_rows(model, kinematics, M, grasps, held);
  return solve_rows(M, rows, state, rows.held_after, grasps, held);
}

namespace {

// Solves and fills in the checks. `u_after` is the required J v+; `impulse` receives P in constrained directions.
ImpactSolution solve(const Eigen::MatrixXd& M, const BilateralRows& rows, const State& state,
                     const Eigen::VectorXd& u_after, Eigen::VectorXd& impulse) {
  const Eigen::MatrixXd& J = rows.J;
  const Eigen::VectorXd before = as_vector(state.v);
  const Cholesky factor(M);
  const ImpulsiveSolution solved = solve_bilateral(M, factor, rows, before, u_after);
  const Eigen::VectorXd& after = solved.velocity;
  const Eigen::VectorXd u = J * before;
  impulse = solved.impulse;

  ImpactSolution result;
  result.status = ImpactSolution::Status::solved;
  result.velocity.assign(after.begin(), after.end());
  result.rank = solved.rank;
  result.rows = static_cast<int>(J.rows());
  result.null_space = solved.null_space;
  // dT = P^T (u- + u+) / 2, which is -u-^T W^+ u- / 2 where u+ is zero: P is in the row space up to self-stress, which
  // does no work on u- or u+.
  const double work = 0.5 * impulse.dot(u + u_after);
  static_cast<ImpactChecks&>(result) =
      impact_checks(M, factor, rows.part, before, after, J.transpose() * impulse, work);
  if (J.rows() == 0) return result;
  const double speed = std::max(u.lpNorm<Eigen::Infinity>(), before.cwiseProduct(rows.part).lpNorm<Eigen::Infinity>());
  if (speed > 0) result.constraint_residual = (J * after - u_after).lpNorm<Eigen::Infinity>() / speed;
  return result;
}

// Per component of the grasp's wrench: whether no self-stress changes it. Self-stresses have unit size in the metric D,
// so a component's share is relative to the maximum for unit size, sqrt(a D^-1 a^T) for direction a.
std::vector<bool> determined_components(const Eigen::MatrixXd& directions, const Eigen::MatrixXd& null_space,
                                        Eigen::Index row, const Eigen::MatrixXd& D) {
  if (null_space.cols() == 0) return std::vector<bool>(6, true);
  const Eigen::MatrixXd stress =
      directions.transpose() * null_space.middleRows(row, directions.rows());  // 6 x (rows - rank)
  const Eigen::MatrixXd largest = directions.transpose() * cholesky_solution(Cholesky(D), directions);
  std::vector<bool> determined(6, true);
  for (int i = 0; i < 6; ++i) determined[i] = stress.row(i).norm() <= 1e-8 * std::sqrt(largest(i, i));
  return determined;
}

}  // namespace

// Grasps and held rates => J, metric D (7.8), required rates and rotor inertias; rows of grasps, then modes, then held
// velocities. Throws std::invalid_argument if modes do not come first or a velocity is held twice.
BilateralRows bilateral_rows(const Model& model, const Kinematics& kinematics, const Eigen::MatrixXd& M,
                             std::span<const Grasp> grasps, std::span<const HeldRate> held) {
  const Eigen::MatrixXd J_grasps = grasp_jacobian(model, kinematics, grasps);
  const Eigen::Index grasp_rows = J_grasps.rows(), held_rows = static_cast<Eigen::Index>(held.size());
  const Eigen::Index count = grasp_rows + held_rows;
  const auto mode_rows = std::count_if(held.begin(), held.end(), [](const HeldRate& h) { return h.is_mode(); });
  BilateralRows rows{Eigen::MatrixXd::Zero(count, model.velocities()),
                     Eigen::MatrixXd::Zero(count, count),
                     Eigen::VectorXd::Zero(count),
                     Eigen::VectorXd(held_rows - mode_rows),
                     {},
                     {}};
  rows.J.topRows(grasp_rows) = J_grasps;
  for (Eigen::Index i = 0; i < held_rows; ++i) {
    rows.held_after[grasp_rows + i] = held[i].after;
    if (held[i].is_mode() != (i < mode_rows)) throw std::invalid_argument("bilateral_rows: modes come first");
    if (held[i].is_mode()) {
      rows.J.row(grasp_rows + i) = as_vector(held[i].row);
      continue;
    }
    rows.J(grasp_rows + i, held[i].velocity) = 1;
    rows.held_inertia[i - mode_rows] = drive_inertia(model, held[i].velocity);
    if (std::find(rows.held.begin(), rows.held.end(), held[i].velocity) != rows.held.end())
      throw std::invalid_argument("bilateral_rows: a velocity is held twice");
    rows.held.push_back(held[i].velocity);
  }
  rows.part = taking_part(model, rows.J);
  for (Eigen::Index row = 0; const Grasp& g : grasps) {
    rows.D.block(row, row, row_count(g.model), row_count(g.model)) = target_mobility(model, kinematics, g);
    row += row_count(g.model);
  }
  if (held_rows > 0) {
    // Held rates only need commensurable scales: the response to each impulse alone.
    const Eigen::MatrixXd J_held = rows.J.bottomRows(held_rows);
    const Eigen::MatrixXd alone = J_held * cholesky_solution(Cholesky(M), J_held.transpose());
    rows.D.bottomRightCorner(held_rows, held_rows) = alone.diagonal().asDiagonal();
  }
  return rows;
}

// M, rows, v-, required J v+ => v+, P, rank and self-stresses, held velocities eliminated by (7.21), (7.22), the rest
// by (7.5) to (7.7). P has minimum norm in D. Throws std::invalid_argument if every velocity is held and grasps exist.
ImpulsiveSolution solve_bilateral(const Eigen::MatrixXd& M, const Cholesky& factor, const BilateralRows& rows,
                                  const Eigen::VectorXd& v, const Eigen::VectorXd& u_after) {
  const std::vector<int>& held = rows.held;
  if (held.empty()) return solve_impulsive_constraint(factor, rows.J, v, rows.D, u_after);
  std::vector<int> free;
  for (int i = 0; i < static_cast<int>(v.size()); ++i) {
    if (std::find(held.begin(), held.end(), i) == held.end()) free.push_back(i);
  }
  const auto m = static_cast<Eigen::Index>(held.size()), g = rows.J.rows() - m;
  const Eigen::MatrixXd J_g = rows.J.topRows(g), J_h = J_g(Eigen::all, held);
  const Eigen::VectorXd s = u_after.tail(m);
  ImpulsiveSolution part;  // of the velocities that are not held
  part.impulse = Eigen::VectorXd(0);
  if (!free.empty()) {  // (7.21)
    const Eigen::MatrixXd M_ff = M(free, free);
    const Eigen::VectorXd pushed = v(free) - cholesky_solution(Cholesky(M_ff), M(free, held) * (s - v(held)));
    part = solve_impulsive_constraint(M_ff, J_g(Eigen::all, free), pushed, rows.D.topLeftCorner(g, g),
                                      u_after.head(g) - J_h * s);
  } else if (g > 0) {
    throw std::invalid_argument("solve_bilateral: all velocities are held, including the targets'");
  }
  ImpulsiveSolution whole;
  whole.rank = part.rank + static_cast<int>(m);
  whole.velocity = v;
  whole.velocity(free) = part.velocity;
  whole.velocity(held) = s;
  const Eigen::VectorXd change = M * (whole.velocity - v);
  whole.impulse.resize(g + m);
  whole.impulse.head(g) = part.impulse;
  whole.impulse.tail(m) = Eigen::VectorXd(change(held)) - J_h.transpose() * part.impulse;  //               (7.22)
  const Eigen::Index count = part.null_space.cols();
  whole.null_space.resize(g + m, count);
  if (count == 0) return whole;
  // Self-stresses of unit size in D, and the minimum-norm P.
  whole.null_space.topRows(g) = part.null_space;
  whole.null_space.bottomRows(m) = -J_h.transpose() * part.null_space;
  const Cholesky metric(rows.D);
  const Eigen::MatrixXd scaled = metric.matrixU() * whole.null_space;
  const Eigen::MatrixXd Z = thin_qr(scaled).Q;
  whole.null_space = upper_solution(metric, Z);
  whole.impulse -= whole.null_space * (Z.transpose() * (metric.matrixU() * whole.impulse));
  return whole;
}

// Rows and required J v+ => v+, impulses per grasp (on the robot at C, in W) and per held rate, checks. If held rates
// contradict the grasps, it solves again with the nearest consistent rates (7.20).
ImpactSolution solve_rows(const Eigen::MatrixXd& M, const BilateralRows& rows, const State& before,
                          const Eigen::VectorXd& u_after, std::span<const Grasp> grasps,
                          std::span<const HeldRate> held) {
  Eigen::VectorXd impulse, wanted = u_after;
  ImpactSolution result = solve(M, rows, before, wanted, impulse);
  if (const auto allowed = rates_that_grasps_allow(rows, wanted, result.null_space)) {
    wanted.tail(rows.held_inertia.size()) = *allowed;
    result = solve(M, rows, before, wanted, impulse);
  }
  Eigen::Index row = 0;
  for (const Grasp& g : grasps) {
    const int count = row_count(g.model);
    const Eigen::MatrixXd A = constrained_directions(g);
    const Eigen::VectorXd P = A.transpose() * impulse.segment(row, count);
    result.contacts.push_back({{{P[0], P[1], P[2]}, {P[3], P[4], P[5]}},
                               determined_components(A, result.null_space, row, rows.D.block(row, row, count, count))});
    row += count;
  }
  for (std::size_t i = 0; i < held.size(); ++i) result.held_impulses.push_back(impulse[row++]);
  return result;
}

// States before and after, external impulses => per body the impulse through its joint, in W about the body's origin
// (7.10): momentum changes less external impulses, summed from the tips to the root.
std::vector<Impulsed> joint_impulses(const Model& model, const State& before, const State& after,
                                     std::span<const ExternalImpulse> external) {
  const Kinematics k_before = forward_kinematics(model, before), k_after = forward_kinematics(model, after);
  const std::size_t count = model.bodies().size();
  // The impulse on each body, about its own frame's origin.
  std::vector<Impulsed> needed(count);
  for (std::size_t i = 0; i < count; ++i) {
    const BodyMomentum m0 = body_momentum(model, k_before, static_cast<int>(i));
    const BodyMomentum m1 = body_momentum(model, k_after, static_cast<int>(i));
    const Momentumd change = shift(m1.h - m0.h, k_before.X_WB[i].p - m0.p_WC);
    needed[i] = {change.angular, change.linear};
  }
  for (const ExternalImpulse& e : external) needed[e.body] -= shift(e.P_WC, k_before.X_WB[e.body].p - e.p_WC);
  // From the tips inward: a joint transmits the impulses on its body and all bodies beyond it.
  for (std::size_t i = count; i-- > 0;) {
    const int parent = model.bodies()[i].parent;
    if (parent >= 0) needed[parent] += shift(needed[i], k_before.X_WB[parent].p - k_before.X_WB[i].p);
  }
  return needed;
}

}  // namespace grapnel
