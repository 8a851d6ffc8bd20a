#include "grapnel/plan/best_solution.hpp"

#include <algorithm>
#include <cmath>
#include <exception>
#include <nlopt.hpp>

#include "grapnel/dense/decompositions.hpp"

namespace grapnel {
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

}  // namespace grapnel
