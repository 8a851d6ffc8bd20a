#include "grapnel/fit/least_squares.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {
namespace {

constexpr double kFirstDamping = 1e-3;  // of the diagonal
constexpr double kLeastDamping = 1e-12, kMostDamping = 1e12;
constexpr double kRelativeReduction = 1e-9;
constexpr double kAccepted = 1e-3;  // actual per promised reduction
constexpr std::size_t kTrials = 25;

// One search.
class Search {
 public:
  Search(const LeastSquares& problem, const Eigen::VectorXd& start) : problem_(problem) {
    at_.x = start.cwiseMax(problem.lower).cwiseMin(problem.upper);
  }

  std::optional<LeastSquaresResult> run(std::size_t most_iterations) {
    const auto first = problem_.residuals(at_.x);
    if (!first) return std::nullopt;
    take(at_.x, *first);
    while (at_.iterations < most_iterations && !at_.converged) {
      const auto jacobian = problem_.jacobian(at_.x);
      if (!jacobian) break;
      ++at_.iterations;
      if (!improve(*jacobian)) break;
    }
    return at_;
  }

 private:
  void take(const Eigen::VectorXd& x, const Eigen::VectorXd& residuals) {
    at_.x = x, at_.residuals = residuals, at_.cost = residuals.squaredNorm();
  }

  // Steps with increasing damping until one reduces the cost. Returns false if none does.
  bool improve(const Eigen::MatrixXd& jacobian) {
    const Eigen::VectorXd gradient = jacobian.transpose() * at_.residuals;
    const Eigen::MatrixXd normal = jacobian.transpose() * jacobian;
    scale_ =
        scale_.size() == 0 ? Eigen::VectorXd(normal.diagonal()) : Eigen::VectorXd(scale_.cwiseMax(normal.diagonal()));
    for (std::size_t trial = 0; trial < kTrials; ++trial) {
      const Eigen::VectorXd step = projected_step(normal, gradient);
      const double promised = -(2 * gradient.dot(step) + step.dot(normal * step));
      if (trial == 0 && !(promised > std::max(kStopReduction, kRelativeReduction * at_.cost))) {
        // The damping must not hide a reduction.
        const double damping = damping_;
        damping_ = kLeastDamping;
        const Eigen::VectorXd full = projected_step(normal, gradient);
        damping_ = damping;
        const double most = -(2 * gradient.dot(full) + full.dot(normal * full));
        at_.converged = !(most > std::max(kStopReduction, kRelativeReduction * at_.cost));
        if (at_.converged) return true;
        damping_ = kLeastDamping;
        continue;
      }
      if (!(step.norm() > 0)) return false;
      const Eigen::VectorXd x = at_.x + step;
      const auto residuals = problem_.residuals(x);
      const double reduction = residuals ? at_.cost - residuals->squaredNorm() : -1;
      if (residuals && reduction > kAccepted * promised && promised > 0) {
        take(x, *residuals);
        const double ratio = std::clamp(reduction / promised, 0.0, 1.0);
        damping_ = std::max(damping_ * (ratio > 0.75 ? 0.1 : ratio > 0.25 ? 0.5 : 2), kLeastDamping);
        return true;
      }
      ++at_.rejected;
      damping_ = std::max(10 * damping_, kFirstDamping);
      if (damping_ > kMostDamping) return false;
    }
    return false;
  }

  // (26.5) over the variables that no bound holds; those whose steps pass a bound stop there, and the others are
  // solved again.
  Eigen::VectorXd projected_step(const Eigen::MatrixXd& normal, const Eigen::VectorXd& gradient) const {
    const Eigen::Index n = at_.x.size();
    Eigen::VectorXd step = Eigen::VectorXd::Zero(n);
    std::vector<Eigen::Index> free;
    for (Eigen::Index k = 0; k < n; ++k) {
      const bool is_held = (at_.x[k] <= problem_.lower[k] && gradient[k] > 0) ||
                           (at_.x[k] >= problem_.upper[k] && gradient[k] < 0) || !(scale_[k] > 0);
      if (!is_held) free.push_back(k);
    }
    while (!free.empty()) {
      const Eigen::VectorXd target = -(gradient + normal * step);
      const Eigen::VectorXd inner = solved(normal, target, free);
      std::vector<Eigen::Index> inside;
      for (std::size_t i = 0; i < free.size(); ++i) {
        const Eigen::Index k = free[i];
        const double to = at_.x[k] + inner[static_cast<Eigen::Index>(i)];
        if (to < problem_.lower[k] || to > problem_.upper[k])
          step[k] = (to < problem_.lower[k] ? problem_.lower[k] : problem_.upper[k]) - at_.x[k];
        else
          inside.push_back(k);
      }
      if (inside.size() == free.size()) {
        for (std::size_t i = 0; i < free.size(); ++i) step[free[i]] = inner[static_cast<Eigen::Index>(i)];
        break;
      }
      free = std::move(inside);
    }
    return step;
  }

  // In variables scaled to a unit diagonal.
  Eigen::VectorXd solved(const Eigen::MatrixXd& normal, const Eigen::VectorXd& target,
                         const std::vector<Eigen::Index>& free) const {
    const auto m = static_cast<Eigen::Index>(free.size());
    Eigen::MatrixXd A(m, m);
    Eigen::VectorXd b(m), d(m);
    for (Eigen::Index i = 0; i < m; ++i) d[i] = 1 / std::sqrt(scale_[free[static_cast<std::size_t>(i)]]);
    for (Eigen::Index i = 0; i < m; ++i) {
      b[i] = d[i] * target[free[static_cast<std::size_t>(i)]];
      for (Eigen::Index k = 0; k < m; ++k)
        A(i, k) = d[i] * d[k] * normal(free[static_cast<std::size_t>(i)], free[static_cast<std::size_t>(k)]);
    }
    for (Eigen::Index i = 0; i < m; ++i) A(i, i) += damping_;
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(A);
    const Eigen::VectorXd along = eigen.eigenvectors().transpose() * b;
    const Eigen::VectorXd y = eigen.eigenvectors() * along.cwiseQuotient(eigen.eigenvalues().cwiseMax(kLeastDamping));
    return d.cwiseProduct(y);
  }

  const LeastSquares& problem_;
  LeastSquaresResult at_;
  Eigen::VectorXd scale_;
  double damping_ = kFirstDamping;
};

}  // namespace

std::optional<LeastSquaresResult> minimize_squares(const LeastSquares& problem, const Eigen::VectorXd& start,
                                                   std::size_t most_iterations) {
  return Search(problem, start).run(most_iterations);
}

}  // namespace grapnel
