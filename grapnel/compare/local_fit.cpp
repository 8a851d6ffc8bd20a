#include "grapnel/compare/local_fit.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {
namespace {

// The mean of t^k over [s - average, s], in units of the window.
double basis(double s, int k, double average, double window) {
  const double to = s / window, share = average / window;
  if (share <= 0) return std::pow(to, k);
  return (std::pow(to, k + 1) - std::pow(to - share, k + 1)) / ((k + 1) * share);
}

}  // namespace

bool StepFit::can_fit(const SideTimes& times, int degree) {
  const std::size_t least = static_cast<std::size_t>(degree) + 3;
  return times.before.size() >= least && times.after.size() >= least;
}

// Columns: of the side before, then of the side after; continuous: the common value, then the others.
StepFit::StepFit(const SideTimes& times, int degree, bool continuous, double average) {
  window_ = std::max(-*std::min_element(times.before.begin(), times.before.end()),
                     *std::max_element(times.after.begin(), times.after.end()));
  const Eigen::Index before = static_cast<Eigen::Index>(times.before.size());
  const Eigen::Index count = before + static_cast<Eigen::Index>(times.after.size());
  const int shared = continuous ? 1 : 0, per_side = degree + 1 - shared;
  Eigen::MatrixXd X = Eigen::MatrixXd::Zero(count, shared + 2 * per_side);
  for (Eigen::Index i = 0; i < count; ++i) {
    const bool is_before = i < before;
    const double s =
        is_before ? times.before[static_cast<std::size_t>(i)] : times.after[static_cast<std::size_t>(i - before)];
    if (continuous) X(i, 0) = 1;
    for (int k = shared; k <= degree; ++k) X(i, (is_before ? 0 : per_side) + k) = basis(s, k, average, window_);
  }
  value_before_ = 0, value_after_ = continuous ? 0 : per_side;
  slope_before_ = 1, slope_after_ = per_side + 1;
  ThinQr qr = thin_qr(X);
  Q_ = std::move(qr.Q), R_ = std::move(qr.R);
}

// Coefficient = e^T R^-1 Q^T y.
Eigen::VectorXd StepFit::weights(int coefficient) const {
  const Eigen::VectorXd unit = Eigen::VectorXd::Unit(R_.cols(), coefficient);
  return Q_ * lu_solution(R_.transpose(), unit);
}

Eigen::VectorXd StepFit::residual(const Eigen::VectorXd& samples) const {
  return samples - Q_ * (Q_.transpose() * samples);
}

}  // namespace grapnel
