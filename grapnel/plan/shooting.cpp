#include "grapnel/plan/shooting.hpp"

#include <algorithm>
#include <cmath>
#include <exception>
#include <nlopt.hpp>

#include "grapnel/dense/decompositions.hpp"

namespace grapnel {

namespace {

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
    : base_(base), problem_(problem), segment_(base, problem.start, problem.motion) {}

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
    const Eigen::VectorXd step = lu_solution(A, gap);
    for (int j = 0; j < n; ++j) shot.rate[j] += step[j];
  }
  shot.X_WB = end.X_WB;
  Eigen::MatrixXd E_theta, E_xi;
  goal_error(base_, end.X_WB, problem_.goals, shot.error, E_theta, E_xi);
  shot.K = Eigen::MatrixXd::Zero(n, n);
  if (!given && n > 0) {
    const Eigen::MatrixXd A = Eigen::MatrixXd::Identity(n, n) - rho_xi * end.per_rate;
    shot.K = lu_solution(A, rho_per_position(shot.position, end.X_WB) + rho_xi * end.per_position);
  }
  shot.J = E_theta + E_xi * (end.per_position + end.per_rate * shot.K);  // (2)
  shot.valid = shot.error.allFinite() && shot.J.allFinite();
  return shot;
}

namespace {

// Polishing moves a solution a little.
constexpr double kRateMargin = 0.9999;

// What NLopt's callbacks share.
struct Problem {
  FloatingBase& base;
  const ReachProblem& reach;
  Shooting& shooting;
  Eigen::MatrixXd rows;  // independent combinations of the error's components, orthonormal
  Shot shot;             // at the latest point

  // Evaluates unless it is the point known.
  const Shot& at(const std::vector<double>& x) {
    if (x != shot.position) shot = shooting.shoot(x, shot.rate);
    return shot;
  }
};

double objective(const std::vector<double>& x, std::vector<double>& gradient, void* data) {
  Problem& p = *static_cast<Problem*>(data);
  const Shot& shot = p.at(x);
  if (!shot.valid) throw nlopt::forced_stop();
  Objective::Gradient g;
  const double value = p.reach.objective.value(p.base, p.reach.goals, x, shot.rate, gradient.empty() ? nullptr : &g);
  if (!gradient.empty()) {
    const Eigen::Index n = static_cast<Eigen::Index>(x.size());
    Eigen::Map<Eigen::VectorXd>(gradient.data(), n) =
        Eigen::Map<const Eigen::VectorXd>(g.position.data(), n) +
        shot.K.transpose() * Eigen::Map<const Eigen::VectorXd>(g.rate.data(), n);
  }
  return value;
}

// Rates within their limits: rate - limit <= 0 and -rate - limit <= 0, over the limit, for each joint that has one.
void rate_limits(unsigned m, double* result, unsigned n, const double* x, double* gradient, void* data) {
  Problem& p = *static_cast<Problem*>(data);
  const Shot& shot = p.at(std::vector<double>(x, x + n));
  if (!shot.valid) throw nlopt::forced_stop();
  unsigned row = 0;
  for (unsigned j = 0; j < n && row < m; ++j) {
    const double limit = kRateMargin * p.reach.rate_limit[j];
    if (!std::isfinite(limit)) continue;
    for (double sign : {1.0, -1.0}) {
      result[row] = sign * shot.rate[j] / limit - 1;
      for (unsigned k = 0; gradient && k < n; ++k) gradient[row * n + k] = sign * shot.K(j, k) / limit;
      ++row;
    }
  }
}

void constraints(unsigned m, double* result, unsigned n, const double* x, double* gradient, void* data) {
  Problem& p = *static_cast<Problem*>(data);
  const Shot& shot = p.at(std::vector<double>(x, x + n));
  if (!shot.valid) throw nlopt::forced_stop();
  Eigen::Map<Eigen::VectorXd>(result, m) = p.rows * shot.error;
  if (gradient) {
    Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(gradient, m, n) =
        p.rows * shot.J;
  }
}

}  // namespace

Shot best_near(FloatingBase& base, const ReachProblem& problem, Shooting& shooting, const Shot& solution) {
  if (solution.J.size() == 0) return solution;  // no joints: nothing to choose, and no SVD
  const Eigen::BDCSVD<Eigen::MatrixXd> svd(solution.J, Eigen::ComputeThinU | Eigen::ComputeThinV);
  Eigen::Index rank = 0;
  while (rank < svd.singularValues().size() && svd.singularValues()[rank] > 1e-6 * svd.singularValues()[0]) ++rank;
  const int n = base.joints();
  if (rank == 0 || rank >= n) return solution;  // nothing is left free
  Problem data{base, problem, shooting, svd.matrixU().leftCols(rank).transpose(), solution};
  nlopt::opt optimizer(nlopt::LD_SLSQP, static_cast<unsigned>(n));
  optimizer.set_lower_bounds(problem.lower);
  optimizer.set_upper_bounds(problem.upper);
  optimizer.set_min_objective(objective, &data);
  optimizer.add_equality_mconstraint(constraints, &data, std::vector<double>(rank, 1e-9));
  const auto limited = 2 * std::count_if(problem.rate_limit.begin(), problem.rate_limit.end(),
                                         [](double limit) { return std::isfinite(limit); });
  if (limited > 0) optimizer.add_inequality_mconstraint(rate_limits, &data, std::vector<double>(limited, 1e-9));
  optimizer.set_xtol_rel(1e-9);
  optimizer.set_xtol_abs(1e-9);
  optimizer.set_maxeval(120);
  std::vector<double> x = solution.position;
  double least = 0;
  try {
    optimizer.optimize(x, least);
  } catch (const std::exception&) {
    // Roundoff or a point that cannot be evaluated: what was reached so far is in x, and may be good enough.
  }
  Shot end = shooting.shoot(x, data.shot.valid ? data.shot.rate : solution.rate);
  return end.valid ? end : solution;
}

namespace {

constexpr double kStructural = 1e-9;  // of the largest singular value: this direction does not exist

Eigen::VectorXd solve(const Eigen::MatrixXd& J, const Eigen::VectorXd& e, double damping, NewtonStep& step) {
  const Eigen::BDCSVD<Eigen::MatrixXd> svd(J, Eigen::ComputeThinU | Eigen::ComputeThinV);
  const Eigen::VectorXd& sigma = svd.singularValues();
  Eigen::VectorXd y = svd.matrixU().transpose() * -e;
  step.smallest_singular_value = sigma.size() ? sigma[0] : 0;
  step.filtered = false;
  for (Eigen::Index i = 0; i < sigma.size(); ++i) {
    const double s = sigma[i];
    if (s <= kStructural * sigma[0] || s == 0) {
      y[i] = 0;
      continue;
    }
    step.smallest_singular_value = std::min(step.smallest_singular_value, s);
    const double lack = std::max(0.0, damping - s);
    if (lack > 0) step.filtered = true;
    y[i] *= s / (s * s + lack * lack);
  }
  return svd.matrixV() * y;
}

}  // namespace

NewtonStep least_norm_step(const Eigen::MatrixXd& J, const Eigen::VectorXd& e, const std::vector<double>& x,
                           const std::vector<double>& lower, const std::vector<double>& upper, double damping) {
  const int n = static_cast<int>(x.size());
  NewtonStep step;
  step.d = Eigen::VectorXd::Zero(n);
  if (n == 0 || e.size() == 0) return step;
  std::vector<int> free(n);
  for (int j = 0; j < n; ++j) free[j] = j;
  Eigen::VectorXd rest = e;  // what the fixed variables leave
  while (!free.empty()) {
    const Eigen::VectorXd d = solve(J(Eigen::all, free), rest, damping, step);
    std::size_t worst = free.size();
    double worst_excess = 1e-12, put = 0;
    for (std::size_t k = 0; k < free.size(); ++k) {
      const int j = free[k];
      const double below = lower[j] - (x[j] + d[k]), above = x[j] + d[k] - upper[j];
      if (std::max(below, above) <= worst_excess) continue;
      worst_excess = std::max(below, above);
      worst = k;
      put = below > above ? lower[j] - x[j] : upper[j] - x[j];
    }
    if (worst == free.size()) {
      for (std::size_t k = 0; k < free.size(); ++k) step.d[free[k]] = d[k];
      return step;
    }
    const int j = free[worst];
    step.d[j] = put;
    step.at_bound.push_back(j);
    rest += put * J.col(j);
    free.erase(free.begin() + static_cast<std::ptrdiff_t>(worst));
  }
  return step;
}

}  // namespace grapnel
