#include "grapnel/plan/newton_step.hpp"

#include <algorithm>

#include "grapnel/dense/decompositions.hpp"

namespace grapnel {
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
