#include "grapnel/plan/shooting.hpp"

#include <algorithm>
#include <cmath>

#include "grapnel/dense/decompositions.hpp"

namespace grapnel {
namespace {

// The base's motion is integrated this well; positions come out to about 1e-12 m.
constexpr double kRelativeTolerance = 1e-12, kAbsoluteTolerance = 1e-14;
// Faster rates at the end, that would turn a joint this far within the segment, are no plan and cost endless steps.
constexpr double kFast = 1;       // [rad/s or m/s]
constexpr double kWildest = 200;  // [rad or m]
// Steps of the central differences of rho: it is cheap, smooth and of order one.
constexpr double kStep = 1e-5;

Posed displaced(const Posed& X, const Vector6d& xi) {
  const Vector3d w{xi[0], xi[1], xi[2]};
  const double angle = norm(w);
  const Rotationd R = angle > 0 ? rotation_about((1 / angle) * w, angle) : Rotationd::identity();
  return {X.R * R, X.p + X.R * Vector3d{xi[3], xi[4], xi[5]}};
}

}  // namespace

Shooting::Shooting(FloatingBase& base, const ReachProblem& problem)
    : base_(base),
      problem_(problem),
      segment_(base, problem.start, problem.motion, kRelativeTolerance, kAbsoluteTolerance) {}

// rho of (1) at the configuration that is placed.
Eigen::VectorXd Shooting::rho(const Posed& X_WB, double* unmet) const {
  const Momentumd h_B = problem_.motion.in_base(problem_.start.end, X_WB);
  const DemandedRates d = demanded_rates(base_, X_WB, h_B, problem_.goals, problem_.demand);
  if (unmet) *unmet = d.unmet;
  return d.rates;
}

Eigen::MatrixXd Shooting::rho_per_displacement(const Posed& X_WB) const {
  Eigen::MatrixXd D = Eigen::MatrixXd::Zero(base_.joints(), 6);
  if (!base_.floats()) return D;
  for (int k = 0; k < 6; ++k) {
    const Vector6d xi = kStep * Vector6d::Unit(k);
    D.col(k) = (rho(displaced(X_WB, xi)) - rho(displaced(X_WB, -xi))) / (2 * kStep);
  }
  return D;
}

Eigen::MatrixXd Shooting::rho_per_position(const std::vector<double>& position, const Posed& X_WB) const {
  const int n = base_.joints();
  Eigen::MatrixXd D(n, n);
  std::vector<double> x = position;
  for (int j = 0; j < n; ++j) {
    x[j] = position[j] + kStep;
    base_.place(x);
    const Eigen::VectorXd above = rho(X_WB);
    x[j] = position[j] - kStep;
    base_.place(x);
    D.col(j) = (above - rho(X_WB)) / (2 * kStep);
    x[j] = position[j];
  }
  base_.place(position);
  return D;
}

Shot Shooting::shoot(const std::vector<double>& position, const std::vector<double>& rate) {
  const int n = base_.joints();
  Shot shot;
  shot.position = position;
  shot.rate = rate;
  const bool given = problem_.demand == RateDemand::given;
  if (given) shot.rate = problem_.given_rates.empty() ? std::vector<double>(n, 0.0) : problem_.given_rates;

  constexpr int kMost = 25;
  SegmentEnd end;
  Eigen::MatrixXd rho_xi = Eigen::MatrixXd::Zero(n, 6);
  double last = std::numeric_limits<double>::infinity();
  for (int i = 0;; ++i) {
    end = segment_.fly(shot.position, shot.rate, true);
    if (!end.finished) trouble_ = end.failure;
    if (!end.finished || i == kMost) return shot;
    base_.place(shot.position);
    if (given || n == 0) break;
    const Eigen::VectorXd wanted = rho(end.X_WB, &shot.unmet);
    const Eigen::VectorXd gap = wanted - Eigen::Map<const Eigen::VectorXd>(shot.rate.data(), n);
    if (!gap.allFinite()) return shot;
    const double fastest = wanted.lpNorm<Eigen::Infinity>();
    if (fastest > kFast && fastest * (problem_.start.end - problem_.start.begin) > kWildest) return shot;
    const double size = gap.lpNorm<Eigen::Infinity>(), scale = std::max(1.0, wanted.lpNorm<Eigen::Infinity>());
    rho_xi = rho_per_displacement(end.X_WB);
    if (size <= 1e-13 * scale || (size <= 1e-10 * scale && size > 0.3 * last)) break;
    if (i > 4 && size > 2 * last) return shot;
    last = size;
    // d(gap)/d(rate) = rho_xi xi_rate - 1.
    const Eigen::MatrixXd A = Eigen::MatrixXd::Identity(n, n) - rho_xi * end.per_rate;
    const Eigen::VectorXd step = A.partialPivLu().solve(gap);
    for (int j = 0; j < n; ++j) shot.rate[j] += step[j];
  }
  shot.X_WB = end.X_WB;
  Eigen::MatrixXd E_theta, E_xi;
  goal_error(base_, end.X_WB, problem_.goals, shot.error, E_theta, E_xi);
  shot.K = Eigen::MatrixXd::Zero(n, n);
  if (!given && n > 0) {
    const Eigen::MatrixXd A = Eigen::MatrixXd::Identity(n, n) - rho_xi * end.per_rate;
    shot.K = A.partialPivLu().solve(rho_per_position(shot.position, end.X_WB) + rho_xi * end.per_position);
  }
  shot.J = E_theta + E_xi * (end.per_position + end.per_rate * shot.K);  // (2)
  shot.valid = shot.error.allFinite() && shot.J.allFinite();
  return shot;
}

}  // namespace grapnel
