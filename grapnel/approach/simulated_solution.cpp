#include "grapnel/approach/simulated_solution.hpp"

#include <algorithm>
#include <optional>

#include "grapnel/plan/shooting.hpp"
#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {
namespace {

constexpr double kDifference =
    1e-6;  // of joint values and rates, for finite differences; simulations are accurate to 1e-12
constexpr double kDamping = 1e-3;     // smaller singular values are damped [m/rad]
constexpr double kLongestStep = 0.6;  // of one joint in one iteration [rad or m, rad/s or m/s]

// Derivatives of error and gap.
struct Sensitivities {
  Eigen::MatrixXd error_position, error_rate, gap_position, gap_rate;
};

// Simulation and iterate => derivatives of error and rate gap by forward differences, one simulation per rate and,
// `with_positions`, per position.
Sensitivities sensitivities(const Simulation& simulation, const SimulatedSolution& at, bool with_positions) {
  const auto n = static_cast<Eigen::Index>(at.position.size());
  const Eigen::Index rows = at.end.error.size();
  Sensitivities s{Eigen::MatrixXd::Zero(rows, n), Eigen::MatrixXd::Zero(rows, n), Eigen::MatrixXd::Zero(n, n),
                  Eigen::MatrixXd::Zero(n, n)};
  std::vector<double> position = at.position, rate = at.rate;
  const auto difference = [&](double& x, auto&& error, auto&& gap) {
    const double before = x;
    x += kDifference;
    const SimulatedEnd end = simulation(position, rate);
    error = (end.error - at.end.error) / kDifference;
    gap = (end.gap - at.end.gap) / kDifference;
    x = before;
  };
  for (Eigen::Index j = 0; j < n; ++j) {
    const auto k = static_cast<std::size_t>(j);
    if (with_positions) difference(position[k], s.error_position.col(j), s.gap_position.col(j));
    difference(rate[k], s.error_rate.col(j), s.gap_rate.col(j));
  }
  return s;
}

// Changes of positions and rates.
struct Step {
  Eigen::VectorXd position, rate;
  double longest() const { return std::max(position.lpNorm<Eigen::Infinity>(), rate.lpNorm<Eigen::Infinity>()); }
};

// Newton step. With g + G_q dq + G_r dr = 0 the rates follow from the positions: dr = r0 + K dq; then minimum norm in
// dq.
Step newton_step(const Sensitivities& s, const SimulatedSolution& at, const std::vector<double>& lower,
                 const std::vector<double>& upper, bool rates_given) {
  const Eigen::Index n = s.gap_rate.rows();
  Eigen::VectorXd r0 = Eigen::VectorXd::Zero(n);
  Eigen::MatrixXd K = Eigen::MatrixXd::Zero(n, n);
  if (!rates_given) {
    r0 = lu_solution(-s.gap_rate, at.end.gap);
    K = lu_solution(-s.gap_rate, s.gap_position);
  }
  Step step{Eigen::VectorXd::Zero(n), r0};
  if (!lower.empty()) {
    step.position = minimum_norm_step(s.error_position + s.error_rate * K, at.end.error + s.error_rate * r0,
                                      at.position, lower, upper, kDamping)
                        .d;
    step.rate += K * step.position;
  }
  return step;
}

}  // namespace

double SimulatedEnd::size() const {
  double largest = 0;
  for (const Eigen::VectorXd* v : {&error, &gap}) {
    if (v->size() > 0) largest = std::max(largest, v->lpNorm<Eigen::Infinity>());
    if (!v->allFinite()) return std::numeric_limits<double>::infinity();
  }
  return largest;
}

// First guess => final positions and rates whose simulation has error and gap up to 10 times `tolerance`. Damped Newton
// steps; sensitivities are reused while a step reduces the error to at most a twentieth.
SimulatedSolution solve_by_simulations(const Simulation& simulation, std::vector<double> position,
                                       std::vector<double> rate, const std::vector<double>& lower,
                                       const std::vector<double>& upper, double tolerance) {
  constexpr int kMaxIterations = 40, kHalvings = 7;
  SimulatedSolution now{false, std::move(position), std::move(rate), {}, 0};
  now.end = simulation(now.position, now.rate);
  std::optional<Sensitivities> s;
  for (; now.iterations < kMaxIterations && now.end.size() > tolerance; ++now.iterations) {
    const bool fresh = !s;
    if (fresh) s = sensitivities(simulation, now, !lower.empty());
    // Given rates always have zero gap.
    const bool rates_given = s->gap_rate.isZero(0) && now.end.gap.isZero(0);
    const Step step = newton_step(*s, now, lower, upper, rates_given);
    double fraction = std::min(1.0, kLongestStep / step.longest());
    SimulatedSolution next = now;
    bool better = false;
    for (int i = 0; i < kHalvings && !better; ++i, fraction *= 0.5) {
      for (std::size_t j = 0; j < now.position.size(); ++j) {
        const auto k = static_cast<Eigen::Index>(j);
        next.position[j] = now.position[j] + fraction * step.position[k];
        next.rate[j] = now.rate[j] + fraction * step.rate[k];
      }
      next.end = simulation(next.position, next.rate);
      better = next.end.size() < (1 - 1e-2 * fraction) * now.end.size();
      if (!fresh && !better) break;  // no further steps with outdated sensitivities
    }
    if (!better && fresh) break;
    // Sensitivities are reused while they reduce the error.
    if (!better || next.end.size() > 0.05 * now.end.size()) s.reset();
    if (better) next.iterations = now.iterations, now = std::move(next);
  }
  // Simulations are accurate to about the tolerance.
  now.found = now.end.size() <= 10 * tolerance;
  return now;
}

}  // namespace grapnel
