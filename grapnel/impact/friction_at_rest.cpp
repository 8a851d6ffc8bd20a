#include "grapnel/impact/friction_at_rest.hpp"

#include <Eigen/Jacobi>
#include <algorithm>
#include <cmath>
#include <vector>

#include "grapnel/dense/decompositions.hpp"

namespace grapnel {
namespace {

constexpr int kSweepsBetween = 8;   // sweeps before the active set is tried
constexpr int kMostSweeps = 20000;  // where only sweeps can tell
constexpr double kInside = 1e-12;   // of the radius: nearer the edge than this a force is on it
constexpr int kActiveIterations = 8;

// One point's plane: eigenvalues and vectors of its block of A.
struct Disc {
  Eigen::Matrix2d axes = Eigen::Matrix2d::Identity();
  Eigen::Array2d w;
  explicit Disc(const Eigen::Matrix2d& A) {
    Eigen::JacobiRotation<double> turn;
    turn.makeJacobi(A(0, 0), A(0, 1), A(1, 1));
    Eigen::Matrix2d diagonal = A;
    diagonal.applyOnTheLeft(0, 1, turn.adjoint());
    diagonal.applyOnTheRight(0, 1, turn);
    axes.applyOnTheRight(0, 1, turn);
    w = diagonal.diagonal().array().max(0.0);
  }
};

// Minimizes 1/2 x^T A x + c^T x over |x| <= r in the plane: -A^-1 c, or on the circle -(A + a 1)^-1 c with a >= 0.
Eigen::Vector2d minimize_on_disc(const Disc& disc, const Eigen::Vector2d& c, double r) {
  if (r <= 0 || c.squaredNorm() == 0) return Eigen::Vector2d::Zero();
  const Eigen::Array2d d = (disc.axes.transpose() * c).array();
  const double smallest = 1e-14 * disc.w.maxCoeff() + 1e-300;
  const auto at = [&](double a) -> Eigen::Array2d { return -d / (disc.w + a).max(smallest); };
  if (at(0).matrix().norm() <= r) return disc.axes * at(0).matrix();
  // 1/r - 1/|x(a)| is nearly linear in a: Newton from the left is monotone.
  double a = std::max(0.0, c.norm() / r - disc.w.maxCoeff());
  for (int i = 0; i < 60; ++i) {
    const Eigen::Array2d x = at(a);
    const double n = x.matrix().norm();
    const double slope = (x * x / (disc.w + a).max(smallest)).sum() / n;  // -d|x|/da
    const double step = (n - r) / r * n / slope;
    a = std::max(0.0, a + step);
    if (std::abs(step) <= 1e-15 * a) break;
  }
  const Eigen::Vector2d x = at(a).matrix();
  return disc.axes * (x * (r / x.norm()));
}

// Solves for forces near `result` with the same points inside their cones and on them. Returns false, and `result` as
// it was, if that is not the solution: optimality conditions of a convex problem suffice.
bool solve_active(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, const Eigen::VectorXd& radius, double small,
                  FrictionForces& result) {
  const Eigen::Index m = radius.size();
  std::vector<Eigen::Index> edge;
  for (Eigen::Index i = 0; i < m; ++i) {
    if (result.force.segment<2>(2 * i).norm() >= (1 - kInside) * radius[i]) edge.push_back(i);
  }
  const Eigen::Index edges = static_cast<Eigen::Index>(edge.size());
  // Unknowns: forces l and, on the edge, a >= 0 with A l + b + a l = 0.
  Eigen::VectorXd l = result.force, a = Eigen::VectorXd::Zero(edges), miss(2 * m + edges);
  for (Eigen::Index k = 0; k < edges; ++k) {
    const Eigen::Index i = edge[static_cast<std::size_t>(k)];
    if (radius[i] > 0) a[k] = result.rate.segment<2>(2 * i).norm() / radius[i];
  }
  Eigen::MatrixXd slope(2 * m + edges, 2 * m + edges);
  for (int round = 0; round < kActiveIterations; ++round) {
    slope.setZero();
    slope.topLeftCorner(2 * m, 2 * m) = A;
    miss.head(2 * m) = A * l + b;
    for (Eigen::Index k = 0; k < edges; ++k) {
      const Eigen::Index i = edge[static_cast<std::size_t>(k)];
      if (radius[i] <= 0) {  // no force, and nothing to solve for
        slope.middleRows<2>(2 * i).setZero(), slope.middleCols<2>(2 * i).setZero();
        slope.block<2, 2>(2 * i, 2 * i).setIdentity();
        miss.segment<2>(2 * i).setZero();
        slope(2 * m + k, 2 * m + k) = 1, miss[2 * m + k] = 0;
        continue;
      }
      const Eigen::Vector2d own = l.segment<2>(2 * i);
      slope.block<2, 2>(2 * i, 2 * i).diagonal().array() += a[k];
      slope.block<2, 1>(2 * i, 2 * m + k) = own / radius[i];
      slope.block<1, 2>(2 * m + k, 2 * i) = own.transpose() / radius[i];
      miss.segment<2>(2 * i) += a[k] * own;
      miss[2 * m + k] = 0.5 * (own.squaredNorm() / radius[i] - radius[i]);
    }
    if (!miss.allFinite()) return false;
    if (round > 0 && miss.head(2 * m).lpNorm<Eigen::Infinity>() <= small &&
        miss.tail(edges).lpNorm<Eigen::Infinity>() <= 1e-14 * radius.maxCoeff()) {
      break;
    }
    if (round + 1 == kActiveIterations) return false;
    const Eigen::VectorXd step = least_norm_solution(slope, miss);
    l -= step.head(2 * m);
    for (Eigen::Index k = 0; k < edges; ++k) {
      const double r = radius[edge[static_cast<std::size_t>(k)]];
      if (r > 0) a[k] -= step[2 * m + k] / r;
    }
  }
  for (Eigen::Index i = 0; i < m; ++i) {
    const double size = l.segment<2>(2 * i).norm();
    if (size > (1 + 1e-12) * radius[i]) return false;
    if (size > radius[i]) l.segment<2>(2 * i) *= radius[i] / size;
  }
  if (edges > 0 && a.minCoeff() < 0) return false;
  result.force = l;
  return true;
}

}  // namespace

FrictionForces friction_at_rest(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, const Eigen::VectorXd& radius,
                                const Eigen::VectorXd& start) {
  const Eigen::Index m = radius.size();
  FrictionForces result{Eigen::VectorXd::Zero(2 * m), b};
  std::vector<Disc> discs;
  for (Eigen::Index i = 0; i < m; ++i) discs.emplace_back(A.block<2, 2>(2 * i, 2 * i));
  if (start.size() == 2 * m) {
    for (Eigen::Index i = 0; i < m; ++i) {
      const double size = start.segment<2>(2 * i).norm();
      result.force.segment<2>(2 * i) = start.segment<2>(2 * i) * (size > radius[i] ? radius[i] / size : 1.0);
    }
    result.rate.noalias() += A * result.force;
  }
  const int most = m == 1 ? 1 : kMostSweeps;
  const double small = 1e-15 * b.norm();
  Eigen::VectorXd push(2 * m);
  // Point by point: each step is exact in its plane and lowers the convex function.
  for (int sweep = 1; sweep <= most; ++sweep) {
    double moved = 0;
    for (Eigen::Index i = 0; i < m; ++i) {
      const Eigen::Vector2d old = result.force.segment<2>(2 * i);
      const Eigen::Vector2d rest = result.rate.segment<2>(2 * i) - A.block<2, 2>(2 * i, 2 * i) * old;
      const Eigen::Vector2d now = minimize_on_disc(discs[static_cast<std::size_t>(i)], rest, radius[i]);
      const Eigen::Vector2d change = now - old;
      push = A.col(2 * i) * change[0] + A.col(2 * i + 1) * change[1];
      result.rate += push;
      moved = std::max(moved, push.squaredNorm());
      result.force.segment<2>(2 * i) = now;
    }
    if (std::sqrt(moved) <= small) break;
    if (sweep % kSweepsBetween == 0 && solve_active(A, b, radius, small, result)) break;
  }
  result.rate = A * result.force + b;
  return result;
}

StickShare least_used_cones(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, const Eigen::VectorXd& radius) {
  // A factor does if the forces it allows leave no rate.
  const double none = 1e-9 * b.norm();
  const auto share = [&](double factor) { return friction_at_rest(A, b, factor * radius); };
  double low = 0, high = 1;
  FrictionForces best = share(high);
  if (best.rate.norm() > none) return {best.force, 2};
  for (int i = 0; i < 24; ++i) {
    const double middle = 0.5 * (low + high);
    FrictionForces tried = share(middle);
    if (tried.rate.norm() > none) {
      low = middle;
    } else {
      high = middle, best = std::move(tried);
    }
  }
  return {best.force, high};
}

}  // namespace grapnel
