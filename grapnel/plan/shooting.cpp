#include "grapnel/plan/shooting.hpp"

#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>
#include <nlopt.hpp>

#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {

namespace {

// Larger final rates, which would move a joint this far within the segment, are rejected: they are not useful plans and
// require excessively many steps.
constexpr double kFast = 1;       // [rad/s or m/s]
constexpr double kWildest = 200;  // [rad or m]
// Maximum part of the final rates left to the linear prediction, relative to the scale of the rates; and the required
// accuracy of the iteration in any case.
constexpr double kPredicted[] = {1e-7, 1e-9};
constexpr int kMaxSettlings = 25;

}  // namespace

Posed displaced(const Posed& X, const Vector6d& xi) {
  const Vector3d w{xi[0], xi[1], xi[2]};
  const double angle = norm(w);
  const Rotationd R = angle > 0 ? rotation_about((1 / angle) * w, angle) : Rotationd::identity();
  return {X.R * R, X.p + X.R * Vector3d{xi[3], xi[4], xi[5]}};
}

// Base and problem, which must outlive it => shooting on the segment that begins at problem.start.
Shooting::Shooting(FloatingBase& base, const ReachProblem& problem)
    : base_(base), problem_(problem), segment_(base, problem.start, problem.motion) {}

// Other unknowns => final rates predicted by K; the present rates if the predicted change is large.
std::vector<double> ShootingIterate::rate_at(const std::vector<double>& other, std::span<const double> others) const {
  std::vector<double> result = rate;
  if (K.size() == 0) return result;
  const auto n = static_cast<Eigen::Index>(position.size());
  Eigen::VectorXd change = K.leftCols(n) * (as_vector(other) - as_vector(position));
  for (std::size_t i = 0; i < others.size(); ++i) {
    change += (others[i] - coefficients[i]) * K.col(n + static_cast<Eigen::Index>(i));
  }
  // Derivatives are not valid over large distances.
  constexpr double kFar = 0.1;  // [rad/s or m/s]
  const double largest = change.lpNorm<Eigen::Infinity>();
  if (!(largest <= std::max(kFar, as_vector(rate).lpNorm<Eigen::Infinity>()))) return result;
  for (std::size_t j = 0; j < result.size(); ++j) result[j] += change[static_cast<Eigen::Index>(j)];
  return result;
}

// Final joint values => consistent final rates by Newton's method in the base coordinates, base pose, errors and total
// derivatives (2) of reach.hpp.
ShootingIterate Shooting::shoot(const std::vector<double>& position, const std::vector<double>& rate,
                                SegmentAccuracy accuracy, std::span<const double> coefficients) {
  const int n = base_.joints(), unknowns = n * (1 + problem_.start.knots);
  ShootingIterate iterate;
  iterate.coefficients.assign(coefficients.begin(), coefficients.end());
  iterate.coefficients.resize(static_cast<std::size_t>(unknowns - n));
  iterate.accuracy = accuracy;
  iterate.position = position;
  iterate.rate = rate;
  const bool given = problem_.demand == RateDemand::given;
  if (given) iterate.rate = problem_.given_rates.empty() ? std::vector<double>(n, 0.0) : problem_.given_rates;

  SegmentEnd end;
  RateSensitivity rho;
  Eigen::MatrixXd A;  // 1 - rho_xi xi_rate
  double last = std::numeric_limits<double>::infinity();
  for (int i = 0;; ++i) {
    end = segment_.integrate(iterate.position, iterate.rate, true, accuracy, iterate.coefficients);
    if (!end.finished) failure_ = end.failure;
    if (!end.finished || i == kMaxSettlings) return iterate;
    iterate.X_WB = end.X_WB;
    if (given || n == 0) break;
    const Momentumd h_B = problem_.motion.in_base(problem_.start.end, end.X_WB);
    const DemandedRates demanded = demanded_rates(base_, end.X_WB, h_B, problem_.goals, problem_.demand);
    iterate.unmet = demanded.unmet;
    const Eigen::VectorXd gap = demanded.rates - as_vector(iterate.rate);
    if (!gap.allFinite()) return iterate;
    const double fastest = demanded.rates.lpNorm<Eigen::Infinity>();
    if (fastest > kFast && fastest * (problem_.start.end - problem_.start.begin) > kWildest) return iterate;
    rho = rate_sensitivity(base_, end.X_WB, h_B, problem_.goals, problem_.demand, demanded);
    A = Eigen::MatrixXd::Identity(n, n) - rho.per_displacement * end.per_rate;
    const Eigen::VectorXd step = lu_solution(A, gap);
    if (!step.allFinite()) return iterate;
    const double size = step.lpNorm<Eigen::Infinity>();
    if (i > 4 && size > 2 * last) return iterate;  // does not converge
    last = size;
    for (int j = 0; j < n; ++j) iterate.rate[j] += step[j];
    if (size > kPredicted[static_cast<int>(accuracy)] * std::max(1.0, fastest)) continue;
    iterate.X_WB = displaced(end.X_WB, end.per_rate * step);
    break;
  }
  Eigen::MatrixXd E_theta, E_xi;
  goal_error(base_, iterate.X_WB, problem_.goals, iterate.error, E_theta, E_xi);
  Matrix6Xd per_unknown(6, unknowns);
  per_unknown << end.per_position, end.per_coefficient;
  iterate.K = Eigen::MatrixXd::Zero(n, unknowns);
  if (!given && n > 0) {
    Eigen::MatrixXd change = rho.per_displacement * per_unknown;
    change.leftCols(n) += rho.per_angle;
    iterate.K = lu_solution(A, change);
  }
  per_unknown += end.per_rate * iterate.K;
  iterate.J = E_xi * per_unknown;  // (2)
  iterate.J.leftCols(n) += E_theta;
  iterate.per_unknown = per_unknown;
  iterate.valid = iterate.error.allFinite() && iterate.J.allFinite();
  return iterate;
}

namespace {

// Margin for the small change of a solution by refinement.
constexpr double kRateMargin = 0.9999;

// Data shared by NLopt's callbacks.
struct Problem {
  FloatingBase& base;
  const ReachProblem& reach;
  Shooting& shooting;
  Eigen::MatrixXd rows;     // independent combinations of the error's components, orthonormal
  ShootingIterate iterate;  // at the last point

  // Evaluates, unless x is the last point.
  const ShootingIterate& at(const std::vector<double>& x) {
    if (x != iterate.position) iterate = shooting.shoot(x, iterate.rate_at(x), SegmentAccuracy::search);
    return iterate;
  }
};

// NLopt callback: final joints => objective at the final rates of (6.4) and its gradient with K of (6.8). Throws
// nlopt::forced_stop if the evaluation fails.
double objective(const std::vector<double>& x, std::vector<double>& gradient, void* data) {
  Problem& p = *static_cast<Problem*>(data);
  const ShootingIterate& iterate = p.at(x);
  if (!iterate.valid) throw nlopt::forced_stop();
  Objective::Gradient g;
  const double value = p.reach.objective.value(p.base, p.reach.goals, x, iterate.rate, gradient.empty() ? nullptr : &g);
  if (!gradient.empty()) {
    const Eigen::Index n = static_cast<Eigen::Index>(x.size());
    Eigen::Map<Eigen::VectorXd>(gradient.data(), n) =
        Eigen::Map<const Eigen::VectorXd>(g.position.data(), n) +
        iterate.K.transpose() * Eigen::Map<const Eigen::VectorXd>(g.rate.data(), n);
  }
  return value;
}

// Rate limits: rate - limit <= 0 and -rate - limit <= 0, divided by the limit, for each joint with a limit.
void rate_limits(unsigned m, double* result, unsigned n, const double* x, double* gradient, void* data) {
  Problem& p = *static_cast<Problem*>(data);
  const ShootingIterate& iterate = p.at(std::vector<double>(x, x + n));
  if (!iterate.valid) throw nlopt::forced_stop();
  unsigned row = 0;
  for (unsigned j = 0; j < n && row < m; ++j) {
    const double limit = kRateMargin * p.reach.rate_limit[j];
    if (!std::isfinite(limit)) continue;
    for (double sign : {1.0, -1.0}) {
      result[row] = sign * iterate.rate[j] / limit - 1;
      for (unsigned k = 0; gradient && k < n; ++k) gradient[row * n + k] = sign * iterate.K(j, k) / limit;
      ++row;
    }
  }
}

void constraints(unsigned m, double* result, unsigned n, const double* x, double* gradient, void* data) {
  Problem& p = *static_cast<Problem*>(data);
  const ShootingIterate& iterate = p.at(std::vector<double>(x, x + n));
  if (!iterate.valid) throw nlopt::forced_stop();
  Eigen::Map<Eigen::VectorXd>(result, m) = p.rows * iterate.error;
  if (gradient) {
    Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(gradient, m, n) =
        p.rows * iterate.J;
  }
}

// One run of the optimizer from x; false if it ended early, with x the last point.
bool improve(Problem& data, const std::vector<double>& lower, const std::vector<double>& upper,
             std::vector<double>& x) {
  nlopt::opt optimizer(nlopt::LD_SLSQP, static_cast<unsigned>(x.size()));
  optimizer.set_lower_bounds(lower);
  optimizer.set_upper_bounds(upper);
  optimizer.set_min_objective(objective, &data);
  optimizer.add_equality_mconstraint(constraints, &data, std::vector<double>(data.rows.rows(), 1e-7));
  const auto limited = 2 * std::count_if(data.reach.rate_limit.begin(), data.reach.rate_limit.end(),
                                         [](double limit) { return std::isfinite(limit); });
  if (limited > 0) optimizer.add_inequality_mconstraint(rate_limits, &data, std::vector<double>(limited, 1e-9));
  // Near the optimum the objective error is proportional to the square of the distance.
  optimizer.set_xtol_abs(1e-8);
  optimizer.set_ftol_rel(1e-13);
  optimizer.set_maxeval(120);
  double minimum = 0;
  try {
    optimizer.optimize(x, minimum);
  } catch (const std::exception&) {
    // Rounding errors or an invalid point: x is the last point, and may be sufficient.
    return false;
  }
  return true;
}

}  // namespace

// Solution => locally optimal iterate: rounds of SLSQP with independent combinations of the goal errors as constraints.
ShootingIterate best_near(FloatingBase& base, const ReachProblem& problem, Shooting& shooting,
                          const ShootingIterate& solution) {
  if (solution.J.size() == 0) return solution;  // no joints: no freedom, and no SVD
  const Eigen::BDCSVD<Eigen::MatrixXd> svd(solution.J, Eigen::ComputeThinU | Eigen::ComputeThinV);
  Eigen::Index rank = 0;
  while (rank < svd.singularValues().size() && svd.singularValues()[rank] > 1e-6 * svd.singularValues()[0]) ++rank;
  const int n = base.joints();
  if (rank == 0 || rank >= n) return solution;  // no freedom remains
  Problem data{base, problem, shooting, svd.matrixU().leftCols(rank).transpose(), solution};
  // Quadratic models are local: each round is limited to this distance, and the next one starts from its result.
  constexpr double kFarthest = 1;  // [rad or m]
  constexpr int kRounds = 4;
  std::vector<double> x = solution.position;
  for (int round = 0; round < kRounds; ++round) {
    std::vector<double> lower = problem.lower, upper = problem.upper;
    for (int j = 0; j < n; ++j) {
      lower[j] = std::max(lower[j], x[j] - kFarthest), upper[j] = std::min(upper[j], x[j] + kFarthest);
    }
    if (!improve(data, lower, upper, x)) break;
    bool at_edge = false;
    for (int j = 0; j < n; ++j) {
      at_edge =
          at_edge || (x[j] <= lower[j] && x[j] > problem.lower[j]) || (x[j] >= upper[j] && x[j] < problem.upper[j]);
    }
    if (!at_edge) break;
  }
  ShootingIterate end = data.iterate.valid && data.iterate.position == x
                            ? data.iterate
                            : shooting.shoot(x, data.iterate.valid ? data.iterate.rate_at(x) : solution.rate_at(x),
                                             SegmentAccuracy::search);
  return end.valid ? end : solution;
}

namespace {

constexpr double kStructural = 1e-9;  // of the largest singular value; smaller ones are structural zeros

// Numerical filtering by singular values s of J: s / (s^2 + lack^2) instead of 1 / s.
double lack_of(double s, double damping, NewtonStep& step) {
  const double lack = std::max(0.0, damping - s);
  if (lack > 0) step.filtered = true;
  return lack;
}

// Computed from the eigenvalues s^2 of J J^T at a quarter of the cost of singular values. Values above the edge are
// accurate enough for the step; those below are damped.
Eigen::VectorXd damped_step(const Eigen::MatrixXd& J, const Eigen::VectorXd& e, double damping, NewtonStep& step) {
  constexpr double kNoDirection = 1e-15;  // of the largest square: rounding error
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> of(Eigen::MatrixXd(J * J.transpose()));
  const Eigen::VectorXd& squares = of.eigenvalues();  // increasing
  Eigen::VectorXd y = of.eigenvectors().transpose() * -e;
  const double largest = squares[squares.size() - 1];
  for (Eigen::Index i = 0; i < squares.size(); ++i) {
    if (squares[i] <= kNoDirection * largest || !(largest > 0)) {
      y[i] = 0;
      continue;
    }
    const double lack = lack_of(std::sqrt(squares[i]), damping, step);
    y[i] /= squares[i] + lack * lack;
  }
  return J.transpose() * (of.eigenvectors() * y);
}

// J and e => minimum-norm step. With damping: exact if all singular values exceed the threshold, otherwise damped;
// without: by the singular value decomposition.
Eigen::VectorXd solve(const Eigen::MatrixXd& J, const Eigen::VectorXd& e, double damping, NewtonStep& step) {
  step.filtered = false;
  if (damping > 0) {
    if (const auto d = least_norm_above(J, -e, damping)) return *d;
    return damped_step(J, e, damping, step);
  }
  const Eigen::BDCSVD<Eigen::MatrixXd> svd(J, Eigen::ComputeThinU | Eigen::ComputeThinV);
  const Eigen::VectorXd& sigma = svd.singularValues();
  Eigen::VectorXd y = svd.matrixU().transpose() * -e;
  for (Eigen::Index i = 0; i < sigma.size(); ++i) {
    const double s = sigma[i];
    if (s <= kStructural * sigma[0] || s == 0)
      y[i] = 0;
    else
      y[i] /= s;
  }
  return svd.matrixV() * y;
}

}  // namespace

double smallest_singular_value(const Eigen::MatrixXd& J) {
  if (J.size() == 0) return 0;
  const Eigen::VectorXd sigma = Eigen::BDCSVD<Eigen::MatrixXd>(J).singularValues();
  double smallest = sigma[0];
  for (double s : sigma) {
    if (s > kStructural * sigma[0]) smallest = std::min(smallest, s);
  }
  return smallest;
}

// J, e, bounds => minimum-norm step within the bounds, by fixing the most violated variable and solving again.
NewtonStep minimum_norm_step(const Eigen::MatrixXd& J, const Eigen::VectorXd& e, const std::vector<double>& x,
                             const std::vector<double>& lower, const std::vector<double>& upper, double damping) {
  const int n = static_cast<int>(x.size());
  NewtonStep step;
  step.d = Eigen::VectorXd::Zero(n);
  if (n == 0 || e.size() == 0) return step;
  std::vector<int> free;
  for (int j = 0; j < n; ++j) {
    if (lower[j] < upper[j] || x[j] != lower[j]) free.push_back(j);  // the others are fixed
  }
  Eigen::VectorXd rest = e;  // error remaining after the fixed variables
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
