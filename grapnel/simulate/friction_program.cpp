#include "grapnel/simulate/friction_program.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// Eigenvalues of A below this are zero: they are squares, like the pivots of closures (loop_limits.hpp).
constexpr double kImmobileSquare = 1e-11;
// Relative to the largest component of b: a smaller remainder in these directions is a rounding error.
constexpr double kFlat = 1e-8;
// Tolerances of a basis of self-stresses, relative to the largest singular value, and of entries, relative to their
// terms.
constexpr double kDependent = 1e-9, kEntryRounding = 1e-9;

// --- The program in a box ---

class BoxMinimizer {
 public:
  explicit BoxMinimizer(const BoxProgram& program) : p_(program), n_(program.b.size()) {
    s_.x = VectorXd::Zero(n_);
    s_.bound.assign(n_, 0);
    for (Index i = 0; i < n_; ++i) {
      if (p_.lower[i] >= 0) s_.bound[i] = -1;
      if (p_.upper[i] <= 0) s_.bound[i] = 1;
      fixed_.push_back(p_.lower[i] >= p_.upper[i]);
    }
    s_.gradient = p_.b;
  }

  BoxSolution run() {
    const Index most = 50 + 20 * n_;
    for (Index count = 0; count < most; ++count) {
      const bool reached = descend();
      if (!s_.bounded) break;
      if (reached && !release(count > most / 2)) break;
    }
    return std::move(s_);
  }

 private:
  // Moves to the minimum over the free variables, as far as the bounds permit. Returns whether it was reached.
  bool descend() {
    std::vector<Index> free;
    for (Index i = 0; i < n_; ++i) {
      if (s_.bound[i] == 0) free.push_back(i);
    }
    if (free.empty()) return true;
    const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(MatrixXd(p_.A(free, free)));
    const VectorXd g = eigen.eigenvectors().transpose() * s_.gradient(free);
    const VectorXd slack = eigen.eigenvectors().cwiseAbs().transpose() * p_.tolerance(free) +
                           VectorXd::Constant(g.size(), kFlat * p_.b.cwiseAbs().maxCoeff());
    VectorXd newton = VectorXd::Zero(g.size()), flat = newton;
    bool falls = false;  // unbounded along a direction without curvature
    for (Index k = 0; k < g.size(); ++k) {
      if (eigen.eigenvalues()[k] > kImmobileSquare) {
        newton[k] = -g[k] / eigen.eigenvalues()[k];
      } else if (std::abs(g[k]) > slack[k]) {
        flat[k] = -g[k], falls = true;
      }
    }
    const VectorXd step = eigen.eigenvectors() * (falls ? flat : newton);
    double length = falls ? kInfinity : 1;
    Index hit = -1;
    for (Index k = 0; k < step.size(); ++k) {
      const Index i = free[k];
      if (step[k] == 0) continue;
      const double room = ((step[k] > 0 ? p_.upper[i] : p_.lower[i]) - s_.x[i]) / step[k];
      if (room < length) length = std::max(room, 0.0), hit = i, sense_ = step[k] > 0 ? 1 : -1;
    }
    if (!std::isfinite(length)) return s_.bounded = false;
    for (Index k = 0; k < step.size(); ++k) s_.x[free[k]] += length * step[k];
    if (hit >= 0) s_.x[hit] = sense_ > 0 ? p_.upper[hit] : p_.lower[hit], s_.bound[hit] = sense_;
    s_.gradient = p_.A * s_.x + p_.b;
    return hit < 0;
  }

  // Frees a variable at a bound if the objective decreases away from it; `first`: the first such variable, which
  // ensures termination.
  bool release(bool first) {
    Index worst = -1;
    double most = 0.1;
    for (Index i = 0; i < n_; ++i) {
      if (s_.bound[i] == 0 || fixed_[i]) continue;
      const double pull = s_.bound[i] * s_.gradient[i] / std::max(p_.tolerance[i], 1e-300);
      if (pull > most) most = pull, worst = i;
      if (first && worst >= 0) break;
    }
    if (worst < 0) return false;
    s_.bound[worst] = 0;
    return true;
  }

  const BoxProgram& p_;
  Index n_;
  BoxSolution s_;
  std::vector<bool> fixed_;
  int sense_ = 0;
};

// --- Minimization of the maximum excess ---

// Constraints g + G z <= w t, the first of which is -1 <= t.
struct ExcessRows {
  MatrixXd G;
  VectorXd g, w;
};

// Family => rows g + G z <= w t, one per finite bound: the effort x0 + N z exceeds it by at most w t. The first row is
// t >= -1.
ExcessRows excess_rows(const EffortFamily& f) {
  std::vector<std::pair<Index, int>> sides;
  for (Index i = 0; i < f.x0.size(); ++i) {
    if (std::isfinite(f.upper[i])) sides.emplace_back(i, 1);
    if (std::isfinite(f.lower[i])) sides.emplace_back(i, -1);
  }
  const Index count = static_cast<Index>(sides.size()) + 1;
  ExcessRows r{MatrixXd::Zero(count, f.N.cols()), VectorXd(count), VectorXd::Ones(count)};
  r.g[0] = -1;
  for (Index row = 1; row < count; ++row) {
    const auto [i, side] = sides[row - 1];
    r.G.row(row) = side * f.N.row(i);
    r.g[row] = side > 0 ? f.x0[i] - f.upper[i] : f.lower[i] - f.x0[i];
    r.w[row] = f.weight[i];
  }
  return r;
}

// max g^T y with G^T y = 0, w^T y = 1, y >= 0: the basis contains the rows that determine t, initially only the first.
class MinimaxSimplex {
 public:
  explicit MinimaxSimplex(ExcessRows rows) : r_(std::move(rows)), k_(r_.G.cols()) {
    const Eigen::ColPivHouseholderQR<MatrixXd> qr(MatrixXd(r_.G.transpose()));
    basis_.push_back(0);
    for (Index i = 0; i < k_; ++i) basis_.push_back(qr.colsPermutation().indices()[i]);
  }

  // Returns z and t.
  VectorXd run() {
    const Index rows = r_.g.size();
    VectorXd corner;
    for (Index count = 0; count < 100 + 50 * rows; ++count) {
      const MatrixXd B = basis();
      corner = lu_solution(B.transpose(), -r_.g(basis_));
      const double t = -corner[k_];
      Index entering = -1;
      for (Index i = 0; i < rows && entering < 0; ++i) {
        const double violation = r_.g[i] + r_.G.row(i).dot(corner.head(k_)) - r_.w[i] * t;
        const double size = std::abs(r_.g[i]) + r_.w[i] * (1 + std::abs(t));
        if (violation > kZero * size && std::find(basis_.begin(), basis_.end(), i) == basis_.end()) entering = i;
      }
      if (entering < 0 || !replace(B, entering)) break;
    }
    corner[k_] = -corner[k_];
    return corner;
  }

 private:
  static constexpr double kZero = 1e-14, kPivot = 1e-9;

  MatrixXd basis() const {
    MatrixXd B(k_ + 1, k_ + 1);
    for (Index i = 0; i <= k_; ++i) {
      B.col(i).head(k_) = r_.G.row(basis_[i]).transpose();
      B(k_, i) = r_.w[basis_[i]];
    }
    return B;
  }

  // Basis matrix and entering row => whether a row left the basis in exchange. Ratio test on the dual variables y; of
  // equal ratios the smallest row index leaves (Bland).
  bool replace(const MatrixXd& B, Index entering) {
    VectorXd column(k_ + 1);
    column.head(k_) = r_.G.row(entering).transpose();
    column[k_] = r_.w[entering];
    const VectorXd y = lu_solution(B, VectorXd::Unit(k_ + 1, k_)), d = lu_solution(B, column);
    Index leaving = -1;
    double least = kInfinity;
    for (Index i = 0; i <= k_; ++i) {
      if (!(d[i] > kPivot * d.cwiseAbs().maxCoeff())) continue;
      const double ratio = std::max(y[i], 0.0) / d[i];
      const bool tie = leaving >= 0 && std::abs(ratio - least) <= 1e-14 * (1 + least);
      const bool sooner = tie ? basis_[i] < basis_[leaving] : ratio < least;
      if (sooner) leaving = i, least = ratio;
    }
    if (leaving < 0) return false;
    basis_[leaving] = entering;
    return true;
  }

  ExcessRows r_;
  Index k_;
  std::vector<Index> basis_;
};

// u >= 0 that minimizes |E u - f|.
VectorXd nonnegative_least_squares(const MatrixXd& E, const VectorXd& f) {
  const Index n = E.cols();
  VectorXd u = VectorXd::Zero(n);
  std::vector<Index> in;
  std::vector<bool> is_in(static_cast<std::size_t>(n), false);
  const double zero = 1e-14 * (1 + E.cwiseAbs().maxCoeff());
  for (Index count = 0; count < 10 * n; ++count) {
    const VectorXd pull = E.transpose() * (f - E * u);
    Index best = -1;
    for (Index i = 0; i < n; ++i) {
      if (!is_in[i] && pull[i] > zero && (best < 0 || pull[i] > pull[best])) best = i;
    }
    if (best < 0) break;
    in.push_back(best), is_in[best] = true;
    while (!in.empty()) {
      const VectorXd s = least_norm_solution(E(Eigen::all, in), f);
      double length = 1;
      for (Index k = 0; k < s.size(); ++k) {
        const double at = u[in[k]];
        if (s[k] <= 0) length = std::min(length, at / std::max(at - s[k], 1e-300));
      }
      for (Index k = 0; k < s.size(); ++k) {
        double& at = u[in[k]];
        at += length * (s[k] - at);
      }
      if (length >= 1) break;
      std::erase_if(in, [&](Index i) {
        if (u[i] > 1e-15) return false;
        u[i] = 0, is_in[i] = false;
        return true;
      });
    }
  }
  return u;
}

// The fraction of the segment from x to y, both in the family, y within the bounds, from which on the bounds hold.
VectorXd drawn_within(const EffortFamily& f, const VectorXd& x, const VectorXd& y) {
  double share = 0;
  for (Index i = 0; i < x.size(); ++i) {
    const double beyond = std::max(f.lower[i] - x[i], x[i] - f.upper[i]);
    const double bound = x[i] > f.upper[i] ? f.upper[i] : f.lower[i];
    if (beyond > 0 && y[i] != x[i]) share = std::max(share, std::min(1.0, (bound - x[i]) / (y[i] - x[i])));
  }
  return x + share * (y - x);
}

}  // namespace

// Program (19.17) => minimizer, its gradient and active bounds.
BoxSolution minimize_in_box(const BoxProgram& program) { return BoxMinimizer(program).run(); }

// Family => minimum over z of the largest weighted excess (19.20) and a minimizer. Without self-stresses (no columns of
// N) the excess of x0, else the simplex method on the dual.
MinExcess min_excess(const EffortFamily& family) {
  const Index k = family.N.cols();
  if (k == 0) {
    double excess = -1;
    for (Index i = 0; i < family.x0.size(); ++i) {
      const double beyond = std::max(family.lower[i] - family.x0[i], family.x0[i] - family.upper[i]);
      excess = std::max(excess, beyond / family.weight[i]);
    }
    return {excess, family.x0};
  }
  const VectorXd corner = MinimaxSimplex(excess_rows(family)).run();
  return {corner[k], family.x0 + family.N * corner.head(k)};
}

// Family and a feasible member => minimum-norm member within the bounds (19.21). If the projection of x0 is outside, a
// least-distance program, solved by nonnegative least squares; `feasible` if that finds no solution.
VectorXd min_norm_within(const EffortFamily& family, const VectorXd& feasible) {
  const Index k = family.N.cols();
  const VectorXd x = family.x0 - family.N * (family.N.transpose() * family.x0);
  const auto within = [&](const VectorXd& y) {
    return ((y - family.upper).array() <= 0).all() && ((family.lower - y).array() <= 0).all();
  };
  if (k == 0 || within(x)) return x;
  // min |z|^2 with G z >= h: from nonnegative least squares with E = [G^T; h^T], f = [0; 1].
  EffortFamily centred = family;
  centred.x0 = x;
  const ExcessRows rows = excess_rows(centred);
  const Index m = rows.g.size() - 1;
  MatrixXd E(k + 1, m);
  E.topRows(k) = -rows.G.bottomRows(m).transpose();
  E.row(k) = rows.g.tail(m).transpose();
  const VectorXd f = VectorXd::Unit(k + 1, k);
  const VectorXd left = E * nonnegative_least_squares(E, f) - f;
  if (!(left[k] < -1e-9)) return feasible;
  return drawn_within(family, x - family.N * (left.head(k) / left[k]), feasible);
}

// Directions and sizes of their terms => orthonormal basis of the span (self-stresses N of (19.19)), by the singular
// value decomposition of the normalized columns without entries that are rounding errors.
MatrixXd basis_of(MatrixXd directions, const MatrixXd& terms) {
  for (Index j = 0; j < directions.cols(); ++j) {
    for (Index i = 0; i < directions.rows(); ++i) {
      if (!(std::abs(directions(i, j)) > kEntryRounding * terms(i, j))) directions(i, j) = 0;
    }
    const double size = directions.col(j).norm();
    if (size > 0) directions.col(j) /= size;
  }
  if (directions.size() == 0 || directions.cwiseAbs().maxCoeff() == 0) return MatrixXd(directions.rows(), 0);
  const Eigen::JacobiSVD<MatrixXd> svd(directions, Eigen::ComputeThinU);
  Index rank = 0;
  while (rank < svd.singularValues().size() && svd.singularValues()[rank] > kDependent * svd.singularValues()[0])
    ++rank;
  return svd.matrixU().leftCols(rank);
}

}  // namespace grapnel
