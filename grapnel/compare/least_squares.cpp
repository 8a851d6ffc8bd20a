#include "grapnel/compare/least_squares.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {
namespace {

constexpr double kFirstDamping = 1e-3;  // of the diagonal
constexpr double kLeastDamping = 1e-12, kMostDamping = 1e12;
constexpr double kRelativeReduction = 1e-9;
constexpr double kAccepted = 1e-3;  // actual per promised reduction
constexpr std::size_t kTrials = 25;
constexpr Eigen::Index kPassesPerVariable = 8;  // of the active set
constexpr double kRounding = 1e-10;             // of gradients

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
        const double least = std::max(kStopReduction, kRelativeReduction * at_.cost);
        at_.converged = std::abs(most) <= least;
        if (at_.converged) return true;
        if (most > least) {
          damping_ = kLeastDamping;
          continue;
        }
      }
      if (!(step.norm() > 0)) return false;
      const Eigen::VectorXd x = after(step);
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

  // Exactly at a bound where the step ends there.
  Eigen::VectorXd after(const Eigen::VectorXd& step) const {
    Eigen::VectorXd x = at_.x + step;
    for (Eigen::Index k = 0; k < x.size(); ++k) {
      if (step[k] <= problem_.lower[k] - at_.x[k]) x[k] = problem_.lower[k];
      if (step[k] >= problem_.upper[k] - at_.x[k]) x[k] = problem_.upper[k];
    }
    return x;
  }

  // The minimum of the model of (26.5) between the bounds by an active set: from zero the step moves towards the
  // minimum over the free variables until one of them reaches its bound and is held there. At such a minimum, the held
  // variable whose gradient points most strongly inwards is released. Each move reduces the model, and so promises a
  // reduction.
  Eigen::VectorXd projected_step(const Eigen::MatrixXd& normal, const Eigen::VectorXd& gradient) const {
    const Eigen::Index n = at_.x.size();
    Eigen::VectorXd step = Eigen::VectorXd::Zero(n);
    std::vector<Eigen::Index> free;
    for (Eigen::Index k = 0; k < n; ++k) {
      const bool is_held = (at_.x[k] <= problem_.lower[k] && gradient[k] > 0) ||
                           (at_.x[k] >= problem_.upper[k] && gradient[k] < 0) || !(scale_[k] > 0);
      if (!is_held) free.push_back(k);
    }
    for (Eigen::Index pass = 0; pass < kPassesPerVariable * n; ++pass) {
      if (!move_to_bound(normal, gradient, step, free)) continue;
      const std::optional<Eigen::Index> released = wrongly_held(normal, gradient, step, free);
      if (!released) break;
      free.insert(std::lower_bound(free.begin(), free.end(), *released), *released);
    }
    return step;
  }

  // Moves towards the minimum over the free variables. Returns false if one of them reached its bound and is free no
  // more.
  bool move_to_bound(const Eigen::MatrixXd& normal, const Eigen::VectorXd& gradient, Eigen::VectorXd& step,
                     std::vector<Eigen::Index>& free) const {
    if (free.empty()) return true;
    Eigen::VectorXd held = step;
    for (const Eigen::Index k : free) held[k] = 0;
    const Eigen::VectorXd inner = solved(normal, -(gradient + normal * held), free);
    double share = 1;
    std::optional<std::size_t> first;
    for (std::size_t i = 0; i < free.size(); ++i) {
      const Eigen::Index k = free[i];
      const double to = inner[static_cast<Eigen::Index>(i)], low = problem_.lower[k] - at_.x[k],
                   high = problem_.upper[k] - at_.x[k];
      if (to >= low && to <= high) continue;
      const double reached = std::clamp(((to < low ? low : high) - step[k]) / (to - step[k]), 0.0, 1.0);
      if (!first || reached < share) share = reached, first = i;
    }
    for (std::size_t i = 0; i < free.size(); ++i) {
      const Eigen::Index k = free[i];
      const double to = inner[static_cast<Eigen::Index>(i)];
      step[k] = first ? step[k] + share * (to - step[k]) : to;
      if (first == i) step[k] = (to < 0 ? problem_.lower[k] : problem_.upper[k]) - at_.x[k];
    }
    if (!first) return true;
    free.erase(free.begin() + static_cast<std::ptrdiff_t>(*first));
    return false;
  }

  std::optional<Eigen::Index> wrongly_held(const Eigen::MatrixXd& normal, const Eigen::VectorXd& gradient,
                                           const Eigen::VectorXd& step, const std::vector<Eigen::Index>& free) const {
    const Eigen::VectorXd slope = gradient + normal * step + damping_ * scale_.cwiseProduct(step);
    const Eigen::VectorXd rounding = kRounding * (gradient.cwiseAbs() + (normal * step).cwiseAbs());
    std::optional<Eigen::Index> worst;
    double most = 0;
    for (Eigen::Index k = 0; k < step.size(); ++k) {
      if (!(scale_[k] > 0) || !(problem_.upper[k] > problem_.lower[k])) continue;
      if (std::binary_search(free.begin(), free.end(), k)) continue;
      const bool is_low = step[k] <= problem_.lower[k] - at_.x[k];
      const double inwards = (is_low ? -slope[k] : slope[k]) - rounding[k], size = inwards / std::sqrt(scale_[k]);
      if (inwards > 0 && size > most) most = size, worst = k;
    }
    return worst;
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
