#include "grapnel/plan/least_distance.hpp"

#include <algorithm>
#include <cmath>

namespace grapnel {

NearestBelow::NearestBelow(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, Eigen::VectorXd c)
    : rows_of_(A.transpose()), c_(std::move(c)), products_(static_cast<std::size_t>(A.rows())) {
  if (count() == 0) return;
  r_ = A * c_ - b;
  mean_square_ = A.squaredNorm() / static_cast<double>(count());
}

const Eigen::VectorXd& NearestBelow::products(Eigen::Index row) {
  Eigen::VectorXd& p = products_[static_cast<std::size_t>(row)];
  if (p.size() == 0) p = rows_of_.transpose() * rows_of_.col(row);
  return p;
}

// Relaxation e^2 => solution of (1): adds the most violated row to the active set until none is violated.
LeastDistance NearestBelow::with(double giving) {
  constexpr double kMet = 1e-10;
  LeastDistance result{c_, 0, Eigen::VectorXd::Zero(count())};
  if (count() == 0) return result;
  square_ = giving * mean_square_ + 1e-30;
  factored_ = 0;
  settle();
  for (Eigen::Index round = 0; round < 3 * count(); ++round) {
    result.left = square_ * l_.sum();
    Eigen::VectorXd beyond = r_;
    for (std::size_t i = 0; i < active_.size(); ++i) beyond -= l_[static_cast<Eigen::Index>(i)] * products(active_[i]);
    for (const Eigen::Index i : active_) beyond[i] = 0;
    Eigen::Index most = 0;
    if (!(beyond.maxCoeff(&most) - result.left > kMet)) break;
    add(most);
  }
  for (std::size_t i = 0; i < active_.size(); ++i) {
    result.multipliers[active_[i]] = l_[static_cast<Eigen::Index>(i)];
    result.x -= l_[static_cast<Eigen::Index>(i)] * rows_of_.col(active_[i]);
  }
  result.left = square_ * l_.sum();
  return result;
}

void NearestBelow::begin_with(std::vector<Eigen::Index> rows) {
  active_ = std::move(rows);
  l_.setZero(static_cast<Eigen::Index>(active_.size()));
  factored_ = 0;
}

// Adds a row to the active set and removes rows whose multipliers would become negative.
void NearestBelow::add(Eigen::Index row) {
  const auto last = static_cast<Eigen::Index>(active_.size());
  active_.push_back(row);
  l_.conservativeResize(last + 1);
  l_[last] = 0;
  settle();
}

// Updates L L^T of the active rows' products from the first changed row on. An added row costs a square, not a cube, of
// the number of rows.
void NearestBelow::factor() {
  // Regularization for dependent rows.
  constexpr double kRounding = 1e-12;  // of the row's square
  const auto size = static_cast<Eigen::Index>(active_.size());
  if (L_.rows() < size) L_.conservativeResize(2 * size + 8, 2 * size + 8);
  for (; factored_ < size; ++factored_) {
    const Eigen::Index k = factored_;
    const Eigen::VectorXd& p = products(active_[static_cast<std::size_t>(k)]);
    Eigen::VectorXd row(k);
    for (Eigen::Index i = 0; i < k; ++i) row[i] = p[active_[static_cast<std::size_t>(i)]] + square_;
    L_.topLeftCorner(k, k).triangularView<Eigen::Lower>().solveInPlace(row);
    L_.row(k).head(k) = row.transpose();
    L_(k, k) = std::sqrt((p[active_[static_cast<std::size_t>(k)]] + square_) * (1 + kRounding) - row.squaredNorm());
  }
}

// Multipliers of the active rows; removes rows whose multipliers would be negative.
void NearestBelow::settle() {
  while (!active_.empty()) {
    factor();
    const auto size = static_cast<Eigen::Index>(active_.size());
    const auto L = L_.topLeftCorner(size, size).triangularView<Eigen::Lower>();
    const Eigen::VectorXd next = L.transpose().solve(L.solve(Eigen::VectorXd(r_(active_))));
    if (!next.allFinite()) return;  // overflow or NaN: the multipliers are unchanged
    if (next.minCoeff() > 0) {
      l_ = next;
      return;
    }
    // Maximum share of the step for which all remain positive.
    double share = 1;
    for (Eigen::Index i = 0; i < size; ++i) {
      if (next[i] <= 0) share = std::min(share, l_[i] / (l_[i] - next[i]));
    }
    l_ += share * (next - l_);
    const double smallest = 1e-14 * l_.maxCoeff();
    for (Eigen::Index i = size; i-- > 0;) {
      if (!(next[i] <= 0 && l_[i] <= smallest)) continue;
      active_.erase(active_.begin() + i);
      factored_ = std::min(factored_, i);
      for (Eigen::Index k = i; k + 1 < l_.size(); ++k) l_[k] = l_[k + 1];
      l_.conservativeResize(l_.size() - 1);
    }
  }
}

LeastDistance nearest_below(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, const Eigen::VectorXd& c,
                            double giving) {
  return NearestBelow(A, b, c).with(giving);
}

}  // namespace grapnel
