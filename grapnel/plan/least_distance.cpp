#include "grapnel/plan/least_distance.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace grapnel {
namespace {

// The multipliers of (1) that are not zero.
class Multipliers {
 public:
  Multipliers(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, const Eigen::VectorXd& c, double giving)
      : A_(A), r_(A * c - b), square_(giving * A.squaredNorm() / static_cast<double>(A.rows()) + 1e-30) {}

  const std::vector<Eigen::Index>& rows() const { return rows_; }
  const Eigen::VectorXd& values() const { return l_; }
  double left() const { return square_ * l_.sum(); }

  // A row more, and without those that are in its way.
  void add(Eigen::Index row) {
    insert(row);
    while (!rows_.empty()) {
      const auto size = static_cast<Eigen::Index>(rows_.size());
      const auto L = L_.topLeftCorner(size, size).triangularView<Eigen::Lower>();
      const Eigen::VectorXd next = L.transpose().solve(L.solve(Eigen::VectorXd(r_(rows_))));
      if (next.minCoeff() > 0) {
        l_ = next;
        return;
      }
      if (!next.allFinite()) return;  // rows of numbers too large, or of none: they stay as they were
      // As far as all stay positive.
      double share = 1;
      for (Eigen::Index i = 0; i < size; ++i) {
        if (next[i] <= 0) share = std::min(share, l_[i] / (l_[i] - next[i]));
      }
      l_ += share * (next - l_);
      const double smallest = 1e-14 * l_.maxCoeff();
      for (Eigen::Index i = size; i-- > 0;) {
        if (next[i] <= 0 && l_[i] <= smallest) erase(i);
      }
      factor();
    }
  }

 private:
  void insert(Eigen::Index row) {
    const auto last = static_cast<Eigen::Index>(rows_.size());
    rows_.push_back(row);
    if (G_.rows() <= last) {
      const Eigen::Index room = 2 * last + 8;
      G_.conservativeResize(room, room), L_.conservativeResize(room, room);
    }
    // Rows that depend on each other do not make it singular.
    constexpr double kRounding = 1e-12;  // of the row's square
    for (Eigen::Index i = 0; i <= last; ++i)
      G_(i, last) = G_(last, i) = A_.row(row).dot(A_.row(rows_[static_cast<std::size_t>(i)])) + square_;
    G_(last, last) *= 1 + kRounding;
    l_.conservativeResize(last + 1);
    l_[last] = 0;
    factor();
  }

  void erase(Eigen::Index i) {
    const auto last = static_cast<Eigen::Index>(rows_.size()) - 1;
    rows_.erase(rows_.begin() + i);
    for (Eigen::Index k = i; k < last; ++k) {
      G_.row(k).head(last + 1) = G_.row(k + 1).head(last + 1).eval();
      l_[k] = l_[k + 1];
    }
    for (Eigen::Index k = i; k < last; ++k) G_.col(k).head(last) = G_.col(k + 1).head(last).eval();
    l_.conservativeResize(last);
    factored_ = std::min(factored_, i);
  }

  // L L^T = G, row by row from where it is not so any more: a row more costs its square, not its cube.
  void factor() {
    const auto size = static_cast<Eigen::Index>(rows_.size());
    for (; factored_ < size; ++factored_) {
      const Eigen::Index k = factored_;
      Eigen::VectorXd row = G_.col(k).head(k);
      L_.topLeftCorner(k, k).triangularView<Eigen::Lower>().solveInPlace(row);
      L_.row(k).head(k) = row.transpose();
      L_(k, k) = std::sqrt(G_(k, k) - row.squaredNorm());
    }
  }

  const Eigen::MatrixXd& A_;
  Eigen::VectorXd r_;  // A c - b
  double square_;      // e^2
  std::vector<Eigen::Index> rows_;
  Eigen::MatrixXd G_;  // of these rows, with e^2 for what they share
  Eigen::MatrixXd L_;  // its lower factor, up to row factored_
  Eigen::Index factored_ = 0;
  Eigen::VectorXd l_;
};

}  // namespace

LeastDistance nearest_below(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, const Eigen::VectorXd& c,
                            double giving) {
  constexpr double kMet = 1e-10;
  LeastDistance result{c, 0};
  const Eigen::Index count = A.rows();
  if (count == 0) return result;
  Multipliers l(A, b, c, giving);
  for (Eigen::Index round = 0; round < 3 * count; ++round) {
    Eigen::VectorXd beyond = A * result.x - b;
    for (const Eigen::Index i : l.rows()) beyond[i] = 0;
    Eigen::Index most = 0;
    if (!(beyond.maxCoeff(&most) - result.left > kMet)) break;
    l.add(most);
    result.x = c;
    for (std::size_t i = 0; i < l.rows().size(); ++i)
      result.x -= l.values()[static_cast<Eigen::Index>(i)] * A.row(l.rows()[i]).transpose();
    result.left = l.left();
  }
  return result;
}

}  // namespace grapnel
