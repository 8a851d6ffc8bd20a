#include "grapnel/capture/elastic_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "grapnel/dynamics/elastic_modes.hpp"
#include "grapnel/dynamics/mass_matrix.hpp"
#include "grapnel/problem/flexible_bodies.hpp"
#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr std::size_t kShown = 20;     // modes in a report
constexpr std::size_t kAllShown = 12;  // numbers of modes evaluated individually; beyond, by doubling, and all
constexpr double kMatters = 0.05;      // relative change of the impulse by modes that causes no warning
constexpr double kNoImpulse = 1e-9;    // [N s]
// relative to the total mass and its moment: smaller effective ones are rounding errors
constexpr double kSeen = 1e-12;
constexpr double kRankThreshold = 1e-9;  // of the largest singular value

std::vector<int> velocities_of(const CaptureSystem& system, bool base, bool joints) {
  std::vector<int> locked;
  const Model& model = system.model;
  if (base && model.has_free_root(system.base)) {
    for (int k = 0; k < 6; ++k) locked.push_back(model.bodies()[system.base].v + k);
  }
  for (const int j : joints ? system.robot_joints : std::vector<int>{})
    locked.push_back(model.bodies()[model.joints()[j]].v);
  return locked;
}

// The columns of T: free velocities without springs, one by one, then the modes.
MatrixXd reachable(const Model& model, std::span<const HeldRate> held, std::span<const ElasticMode> modes,
                   std::size_t count) {
  std::vector<bool> apart(static_cast<std::size_t>(model.velocities()), false);
  for (const int body : model.springs()) apart[model.bodies()[body].v] = true;
  for (const HeldRate& h : held) apart[h.velocity] = true;
  const auto others = std::count(apart.begin(), apart.end(), false);
  MatrixXd T = MatrixXd::Zero(model.velocities(), others + static_cast<Index>(count));
  Index column = 0;
  for (int v = 0; v < model.velocities(); ++v) {
    if (!apart[v]) T(v, column++) = 1;
  }
  for (std::size_t m = 0; m < count; ++m) T.col(column++) = modes[m].shape;
  return T;
}

// All numbers of modes up to a dozen, then by doubling, and all of them.
std::vector<std::size_t> counts_up_to(std::size_t all) {
  std::vector<std::size_t> counts;
  for (std::size_t n = 0; n <= std::min(all, kAllShown); ++n) counts.push_back(n);
  for (std::size_t n = 2 * kAllShown; n < all; n *= 2) counts.push_back(n);
  if (counts.back() != all) counts.push_back(all);
  return counts;
}

}  // namespace

double fastest_vibration(const CaptureSystem& system, const State& state) {
  const std::vector<ElasticMode> free = elastic_modes(system.model, state, {});
  return free.empty() ? 0 : free.back().frequency;
}

ElasticReport elastic_report(const CaptureSystem& system, const State& state, std::string at, double time) {
  const Model& model = system.model;
  ElasticReport report;
  report.at = std::move(at), report.time = time;
  report.springs = static_cast<int>(model.springs().size());
  const auto held = elastic_modes(model, state, velocities_of(system, true, true));
  const auto braked = elastic_modes(model, state, velocities_of(system, false, true));
  const auto free = elastic_modes(model, state, {});
  report.fastest = free.empty() ? 0 : free.back().frequency;
  for (std::size_t i = 0; i < std::min(held.size(), kShown); ++i) {
    ElasticModeReport mode;
    mode.held = held[i].frequency, mode.damping_ratio = held[i].damping_ratio;
    if (i < braked.size()) mode.braked = braked[i].frequency;
    if (i < free.size()) mode.free = free[i].frequency;
    if (model.has_free_root(system.base)) {
      const VectorXd share = participation(model, state, held[i], system.base);
      for (int k = 0; k < 3; ++k) {
        const auto square = [&](Index row) {
          return share[row] * share[row] > kSeen * share.squaredNorm() ? share[row] * share[row] : 0.0;
        };
        mode.effective_inertia[k] = square(k);
        mode.effective_mass[k] = square(k + 3);
      }
    }
    report.modes.push_back(mode);
  }
  return report;
}

std::vector<RetainedModes> impulses_by_modes(const ImpactTask& task) {
  const Model& model = task.system.model;
  const State& state = task.contact.state;
  if (model.springs().empty() || task.contact.grasps.empty()) return {};
  if (!model.couplings().empty()) return {};  // elastic_modes() has none
  std::vector<HeldRate> held;                 // none of impact.modes
  std::vector<int> locked;
  for (const HeldRate& h : task.held) {
    if (h.is_mode() || yields(held_joint(model, h))) continue;
    held.push_back(h), locked.push_back(h.velocity);
  }
  const std::vector<ElasticMode> modes = elastic_modes(model, state, locked);
  const Kinematics k = forward_kinematics(model, state);
  const MatrixXd M = mass_matrix(model, state), J = grasp_jacobian(model, k, task.contact.grasps);
  VectorXd v = as_vector(state.v), change = VectorXd::Zero(v.size());  // instantaneous change by drives and brakes
  for (const HeldRate& h : held) change[h.velocity] = h.after - state.v[h.velocity];
  const BilateralRows rows = bilateral_rows(model, k, M, task.contact.grasps, {});
  const Cholesky metric(rows.D);
  std::vector<RetainedModes> list;
  for (const std::size_t count : counts_up_to(modes.size())) {
    const MatrixXd T = reachable(model, held, modes, count);
    const MatrixXd J_T = J * T, M_T = T.transpose() * M * T;
    const Cholesky factor(M_T);
    // M_T z = J_T^T P - T^T M change,  J (v + change + T z) = 0.
    const VectorXd pulled = T.transpose() * (M * change);
    const VectorXd u = J * (v + change) - J_T * cholesky_solution(factor, pulled);
    // With P = L^-T Q, L L^T = D: L^-1 W L^-T Q = -L^-1 u, with minimum-norm Q.
    const MatrixXd half = lower_solution(metric, J_T);
    const MatrixXd W = half * cholesky_solution(factor, MatrixXd(half.transpose()));
    const VectorXd Q = least_norm_solution(W, -lower_solution(metric, u), kRankThreshold);
    const VectorXd P = upper_solution(metric, Q);
    RetainedModes entry;
    entry.modes = static_cast<int>(count);
    entry.frequency = count == 0 ? 0 : modes[count - 1].frequency;
    Index row = 0;
    for (const Grasp& grasp : task.contact.grasps) {
      const MatrixXd directions = constrained_directions(grasp);  // rows x 6
      const VectorXd wrench = directions.transpose() * P.segment(row, directions.rows());
      entry.impulses.push_back(wrench.tail(3).norm());
      row += directions.rows();
    }
    list.push_back(std::move(entry));
  }
  return list;
}

std::vector<HeldRate> rates_of_fast_modes(const Model& model, const State& state, std::span<const HeldRate> held,
                                          double frequency) {
  std::vector<int> locked;
  VectorXd v = as_vector(state.v);
  for (const HeldRate& h : held) locked.push_back(h.velocity), v[h.velocity] = h.after;
  std::vector<HeldRate> rates;
  const std::vector<ElasticMode> modes = elastic_modes(model, state, locked);
  if (modes.empty()) return rates;
  const MatrixXd M = mass_matrix(model, state);
  for (const ElasticMode& mode : modes) {
    if (mode.frequency < frequency) continue;
    const VectorXd row = M * mode.shape;
    rates.push_back({-1, row.dot(v), {row.begin(), row.end()}});
  }
  return rates;
}

std::string describe_dependence_on_modes(const ImpactReport& report) {
  if (report.by_modes.size() < 2) return {};
  const RetainedModes& all = report.by_modes.back();
  const RetainedModes& none = report.by_modes.front();
  const double largest = std::max(*std::max_element(all.impulses.begin(), all.impulses.end()),
                                  *std::max_element(none.impulses.begin(), none.impulses.end()));
  std::size_t worst = 0;
  for (std::size_t g = 0; g < all.impulses.size(); ++g) {
    const auto change = [&](std::size_t i) { return std::abs(all.impulses[i] - none.impulses[i]); };
    if (change(g) > change(worst)) worst = g;
  }
  const double change = std::abs(all.impulses[worst] - none.impulses[worst]);
  if (!(largest > kNoImpulse && change > kMatters * largest)) return {};
  return fmt::format(
      "the impulse of a plastic impact depends on the number of responding modes and does not converge with it: "
      "at "
      "{} {:.4g} N s without flexible modes, {:.4g} with all {} modes (impact.by_modes of the summary); use "
      "impact.law: "
      "compliant, "
      "with the stiffness of the contacts, which converges",
      report.grasps[worst].end_effector, none.impulses[worst], all.impulses[worst], all.modes);
}

}  // namespace grapnel
