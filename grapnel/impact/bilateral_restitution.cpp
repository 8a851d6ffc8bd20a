#include "grapnel/impact/bilateral_restitution.hpp"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "grapnel/dynamics/mass_matrix.hpp"
#include "grapnel/impact/plastic_impact.hpp"

namespace grapnel {
namespace {

// Relative tolerance of a row's velocity against E, relative to the fastest row; the metric D makes rows commensurable.
constexpr double kInconsistent = 1e-8;

// Grasps and coefficients => nothing; throws std::invalid_argument unless every row of every grasp has one coefficient
// within 0 to 1.
void check(std::span<const Grasp> grasps, std::span<const std::vector<double>> restitution) {
  if (restitution.size() != grasps.size()) {
    throw std::invalid_argument(fmt::format("bilateral_restitution: coefficients of {} grasps for {} grasps",
                                            restitution.size(), grasps.size()));
  }
  for (std::size_t i = 0; i < grasps.size(); ++i) {
    if (static_cast<int>(restitution[i].size()) != row_count(grasps[i].model)) {
      throw std::invalid_argument(fmt::format("bilateral_restitution: grasp {} has {} rows but {} coefficients", i + 1,
                                              row_count(grasps[i].model), restitution[i].size()));
    }
    for (double e : restitution[i]) {
      if (!(e >= 0 && e <= 1)) {
        throw std::invalid_argument(
            fmt::format("bilateral_restitution: coefficient {} of grasp {} is not within 0 to 1", e, i + 1));
      }
    }
  }
}

std::string row_name(const Grasp& grasp, std::size_t index, int row) {
  constexpr const char* kAxes[] = {"x", "y", "z"};
  const int angular = row_count(grasp.model) - linear_row_count(grasp.model);
  if (row >= angular) return fmt::format("grasp {}, linear {}", index + 1, kAxes[row - angular]);
  if (!turns_about_axis(grasp.model)) return fmt::format("grasp {}, angular {}", index + 1, kAxes[row]);
  return fmt::format("grasp {}, angular, direction {} normal to the hinge", index + 1, row + 1);
}

// Velocity errors per row, in the scale of D, and their bound => names of the rows above the bound, separated by
// semicolons; empty if there is none.
std::string inconsistent_rows(const Eigen::VectorXd& error, double bound, std::span<const Grasp> grasps,
                              std::span<const HeldRate> held) {
  std::string names;
  Eigen::Index row = 0;
  const auto note = [&](const std::string& name) {
    if (std::abs(error[row++]) > bound) names += (names.empty() ? "" : "; ") + name;
  };
  for (std::size_t i = 0; i < grasps.size(); ++i) {
    for (int r = 0; r < row_count(grasps[i].model); ++r) note(row_name(grasps[i], i, r));
  }
  for (const HeldRate& h : held)
    note(h.is_mode() ? "a mode of vibration or a coupling of joints" : fmt::format("held velocity {}", h.velocity));
  return names;
}

}  // namespace

// State, grasps, coefficients, held rates => v+, impulses and checks for u+ = -E u- (11.10), solved by (7.5) to (7.7).
// `inconsistent` names the redundant rows whose velocity differs from -E u- by more than the rounding error.
ImpactSolution bilateral_restitution(const Model& model, const State& state, std::span<const Grasp> grasps,
                                     std::span<const std::vector<double>> restitution, std::span<const HeldRate> held) {
  check(grasps, restitution);
  const Kinematics kinematics = forward_kinematics(model, state);
  const Eigen::MatrixXd M = mass_matrix(model, state);
  const BilateralRows rows = bilateral_rows(model, kinematics, M, grasps, held);
  const Eigen::Map<const Eigen::VectorXd> v(state.v.data(), static_cast<Eigen::Index>(state.v.size()));
  const Eigen::VectorXd u = rows.J * v;
  Eigen::VectorXd wanted = rows.held_after;  // u+ = -E u-
  for (Eigen::Index row = 0; const std::vector<double>& grasp : restitution) {
    for (double e : grasp) wanted[row] = -e * u[row], ++row;
  }
  ImpactSolution result = solve_rows(M, rows, state, wanted, grasps, held);
  if (rows.J.rows() == 0) return result;
  // Velocities of redundant rows satisfy a linear relation, which E u- may violate.
  const Eigen::Map<const Eigen::VectorXd> after(result.velocity.data(), v.size());
  wanted.tail(static_cast<Eigen::Index>(rows.held.size())) = after(rows.held);  // of overpowered drives
  const Eigen::VectorXd size = rows.D.diagonal().cwiseSqrt();
  const Eigen::VectorXd error = (rows.J * after - wanted).cwiseQuotient(size);
  const double fastest =
      std::max(u.cwiseQuotient(size).lpNorm<Eigen::Infinity>(), wanted.cwiseQuotient(size).lpNorm<Eigen::Infinity>());
  // Rounding error of J v itself, for grasps whose velocities are far above their relative ones.
  const double rounding = 1e-14 * (rows.J.cwiseAbs() * v.cwiseAbs()).cwiseQuotient(size).lpNorm<Eigen::Infinity>();
  result.inconsistent = inconsistent_rows(error, std::max(kInconsistent * fastest, 100 * rounding), grasps, held);
  return result;
}

}  // namespace grapnel
