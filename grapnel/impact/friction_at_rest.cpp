#include "grapnel/impact/friction_at_rest.hpp"

#include <Eigen/Jacobi>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {
namespace {

constexpr int kSweepsBetween = 8;  // sweeps before the active set is tried
constexpr int kMaxSweeps = 48;     // maximum number of sweeps
constexpr double kInside = 1e-12;  // of the radius: a force closer to the edge is on it
constexpr int kActiveIterations = 8;
constexpr double kNoFreedom = 1e-11;  // eigenvalues below this fraction of the largest are zero
constexpr double kCentral = 1e-22;    // end of the interior-point method: pull times slack
// the smaller of the two, below which it is clear whether the point is on the edge
constexpr double kPlain = 1e-15;
constexpr int kInteriorSteps = 60, kShortenings = 10;
constexpr double kNeighbourhood = 1e-3;  // minimum of pull times slack, relative to the mean
constexpr int kCenterSteps = 40;
constexpr double kLawLeft = 1e-11;  // residual of Coulomb's law over b: above rounding
constexpr double kRank = 1e-13;     // of A without rounding errors
constexpr double kNoRate = 1e-9;    // of b
constexpr int kEdgeRounds = 8;      // iterations of Newton's method afterwards, each with other points on the edge

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

// Points whose forces are on their cones' edges.
std::vector<Eigen::Index> on_edge(const Eigen::VectorXd& force, const Eigen::VectorXd& radius) {
  std::vector<Eigen::Index> edge;
  for (Eigen::Index i = 0; i < radius.size(); ++i) {
    if (force.segment<2>(2 * i).norm() >= (1 - kInside) * radius[i]) edge.push_back(i);
  }
  return edge;
}

// Forces l and, for points on the edge, a with A l + b + a l = 0: a >= 0 for friction.
struct ActiveForces {
  Eigen::VectorXd l, a;
};

// Newton's method from a nearby start. Returns false if it does not converge: `small` is the permitted residual.
// `rank`: pivots below this fraction of the largest are zero.
bool solve_active(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, const Eigen::VectorXd& radius,
                  const std::vector<Eigen::Index>& edge, double small, std::optional<double> rank,
                  ActiveForces& forces) {
  const Eigen::Index m = radius.size(), edges = static_cast<Eigen::Index>(edge.size());
  Eigen::VectorXd &l = forces.l, &a = forces.a;
  Eigen::VectorXd residual(2 * m + edges);
  Eigen::MatrixXd slope(2 * m + edges, 2 * m + edges);
  for (int round = 0; round < kActiveIterations; ++round) {
    slope.setZero();
    slope.topLeftCorner(2 * m, 2 * m) = A;
    residual.head(2 * m) = A * l + b;
    for (Eigen::Index k = 0; k < edges; ++k) {
      const Eigen::Index i = edge[static_cast<std::size_t>(k)];
      if (radius[i] <= 0) {  // no force and no equation
        slope.middleRows<2>(2 * i).setZero(), slope.middleCols<2>(2 * i).setZero();
        slope.block<2, 2>(2 * i, 2 * i).setIdentity();
        residual.segment<2>(2 * i).setZero();
        slope(2 * m + k, 2 * m + k) = 1, residual[2 * m + k] = 0;
        continue;
      }
      const Eigen::Vector2d own = l.segment<2>(2 * i);
      slope.block<2, 2>(2 * i, 2 * i).diagonal().array() += a[k];
      slope.block<2, 1>(2 * i, 2 * m + k) = own / radius[i];
      slope.block<1, 2>(2 * m + k, 2 * i) = own.transpose() / radius[i];
      residual.segment<2>(2 * i) += a[k] * own;
      residual[2 * m + k] = 0.5 * (own.squaredNorm() / radius[i] - radius[i]);
    }
    if (!residual.allFinite()) return false;
    if (round > 0 && residual.head(2 * m).lpNorm<Eigen::Infinity>() <= small &&
        residual.tail(edges).lpNorm<Eigen::Infinity>() <= 1e-14 * radius.maxCoeff()) {
      return true;
    }
    if (round + 1 == kActiveIterations) break;
    const Eigen::VectorXd step =
        rank ? least_norm_solution(slope, residual, *rank) : least_norm_solution(slope, residual);
    l -= step.head(2 * m);
    for (Eigen::Index k = 0; k < edges; ++k) {
      const double r = radius[edge[static_cast<std::size_t>(k)]];
      if (r > 0) a[k] -= step[2 * m + k] / r;
    }
  }
  return false;
}

// Solves for forces near `result` with the same points inside and on their cones. Returns false, with `result`
// unchanged, if that is not the solution: optimality conditions of a convex problem suffice.
bool solve_near(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, const Eigen::VectorXd& radius, double small,
                FrictionForces& result) {
  const std::vector<Eigen::Index> edge = on_edge(result.force, radius);
  ActiveForces found{result.force, Eigen::VectorXd::Zero(static_cast<Eigen::Index>(edge.size()))};
  for (std::size_t k = 0; k < edge.size(); ++k) {
    const double r = radius[edge[k]];
    if (r > 0) found.a[static_cast<Eigen::Index>(k)] = result.rate.segment<2>(2 * edge[k]).norm() / r;
  }
  if (!solve_active(A, b, radius, edge, small, std::nullopt, found)) return false;
  for (Eigen::Index i = 0; i < radius.size(); ++i) {
    const double size = found.l.segment<2>(2 * i).norm();
    if (size > (1 + 1e-12) * radius[i]) return false;
    if (size > radius[i]) found.l.segment<2>(2 * i) *= radius[i] / size;
  }
  if (!edge.empty() && found.a.minCoeff() < 0) return false;
  result.force = found.l;
  result.rate = A * result.force + b;
  return true;
}

// --- Slow convergence of sweeps: redundant contacts ---
//
// Redundant points can share the sticking forces in many ways. Sweeps then converge ever more slowly, or follow
// rounding errors of b along A's null space. An interior-point method is not affected: it takes 10 to 30 steps for any
// A, to about half the digits, and ends in the interior of the set of solutions, so that it shows which points are on
// the edge. Newton's method completes the solution.

// The problem without points that have no cone or no mobility, with b of length 1 and in the range of A.
struct FreePoints {
  std::vector<Eigen::Index> points;
  Eigen::VectorXd radius;
  Eigen::MatrixXd A;
  Eigen::VectorXd b;
  double push = 0;  // unit of A and b

  FreePoints(const Eigen::MatrixXd& all, const Eigen::VectorXd& b_of_all, const Eigen::VectorXd& radii) {
    for (Eigen::Index i = 0; i < radii.size(); ++i) {
      if (radii[i] > 0 && all.block<2, 2>(2 * i, 2 * i).trace() > 0) points.push_back(i);
    }
    const Eigen::Index m = count();
    A.resize(2 * m, 2 * m), b.resize(2 * m), radius = radii(points);
    for (Eigen::Index i = 0; i < m; ++i) {
      const Eigen::Index from = points[static_cast<std::size_t>(i)];
      b.segment<2>(2 * i) = b_of_all.segment<2>(2 * from);
      for (Eigen::Index j = 0; j < m; ++j)
        A.block<2, 2>(2 * i, 2 * j) = all.block<2, 2>(2 * from, 2 * points[static_cast<std::size_t>(j)]);
    }
    if (m > 0) restrict_to_range();
    push = b.norm();
    if (push > 0) A /= push, b /= push;
  }
  Eigen::Index count() const { return static_cast<Eigen::Index>(points.size()); }

 private:
  // Both derive from motions of the same bodies, so the part of b outside the range of A is a rounding error, which no
  // force could balance.
  void restrict_to_range() {
    const Eigen::VectorXd size = A.diagonal().cwiseMax(1e-300).cwiseSqrt(), inverse = size.cwiseInverse();
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(
        Eigen::MatrixXd(inverse.asDiagonal() * A * inverse.asDiagonal()));
    Eigen::VectorXd w = eigen.eigenvalues(), along = eigen.eigenvectors().transpose() * b.cwiseProduct(inverse);
    for (Eigen::Index k = 0; k < w.size(); ++k) {
      if (!(w[k] >= kNoFreedom * eigen.eigenvalues().maxCoeff())) along[k] = w[k] = 0;
    }
    const Eigen::MatrixXd V = size.asDiagonal() * eigen.eigenvectors();
    b = V * along;
    A = V * w.asDiagonal() * V.transpose();
  }
};

// Forces x over their radii with A l + b + pull x = 0 and nearly zero pull (1 - |x|^2) / 2, equal for all points.
struct CentralForces {
  Eigen::VectorXd x, pull, slack;  // slack: (1 - |x|^2) / 2
};

// The fraction of `step` up to the boundary of the unit discs.
double longest_inside(const CentralForces& at, const Eigen::VectorXd& step) {
  double longest = std::numeric_limits<double>::infinity();
  for (Eigen::Index i = 0; i < at.slack.size(); ++i) {
    // |x + t dx| = 1
    const Eigen::Vector2d x = at.x.segment<2>(2 * i), dx = step.segment<2>(2 * i);
    const double outward = x.dot(dx), root = std::sqrt(outward * outward + 2 * at.slack[i] * dx.squaredNorm());
    if (root + outward > 0) longest = std::min(longest, 2 * at.slack[i] / (root + outward));
  }
  return longest;
}

// A primal-dual interior-point method.
CentralForces central_forces(const FreePoints& p) {
  const Eigen::Index m = p.count();
  CentralForces at{Eigen::VectorXd::Zero(2 * m), Eigen::VectorXd::Ones(m), Eigen::VectorXd::Constant(m, 0.5)};
  Eigen::VectorXd unit(2 * m), turn(m);
  for (Eigen::Index i = 0; i < m; ++i) unit.segment<2>(2 * i).setConstant(p.radius[i]);
  const Eigen::MatrixXd A = unit.asDiagonal() * p.A * unit.asDiagonal();
  const Eigen::VectorXd b = p.b.cwiseProduct(unit);
  double aim = 0.1;  // of pull times slack: smaller after a long step
  for (int step = 0; step < kInteriorSteps; ++step) {
    const double mean = at.pull.dot(at.slack) / static_cast<double>(m), wanted = aim * mean;
    // If each is resolved, further steps would follow only rounding errors.
    if (mean <= kCentral || at.pull.cwiseMin(at.slack).maxCoeff() <= kPlain) break;
    // The linearized conditions, with the change of pulls eliminated.
    Eigen::MatrixXd slope = A;
    Eigen::VectorXd residual = A * at.x + b;
    for (Eigen::Index i = 0; i < m; ++i) {
      const Eigen::Vector2d x = at.x.segment<2>(2 * i);
      slope.block<2, 2>(2 * i, 2 * i).diagonal().array() += p.radius[i] * at.pull[i];
      slope.block<2, 2>(2 * i, 2 * i) += p.radius[i] * at.pull[i] / at.slack[i] * x * x.transpose();
      residual.segment<2>(2 * i) += p.radius[i] * wanted / at.slack[i] * x;
    }
    const Cholesky factors(slope);
    if (factors.info() != Eigen::Success) break;
    const Eigen::VectorXd change = -cholesky_solution(factors, residual);
    if (!change.allFinite()) break;
    double reach = longest_inside(at, change);
    for (Eigen::Index i = 0; i < m; ++i) {
      const double outward = at.x.segment<2>(2 * i).dot(change.segment<2>(2 * i));
      turn[i] = (wanted + at.pull[i] * outward) / at.slack[i] - at.pull[i];
      if (turn[i] < 0) reach = std::min(reach, -at.pull[i] / turn[i]);
    }
    // No point may reach its edge long before the others: steps would become ever shorter.
    double length = std::min(1.0, 0.99 * reach);
    CentralForces next = at;
    for (int attempt = 0; attempt < kShortenings; ++attempt, length *= 0.7) {
      next.x = at.x + length * change, next.pull = at.pull + length * turn;
      for (Eigen::Index i = 0; i < m; ++i) next.slack[i] = 0.5 * (1 - next.x.segment<2>(2 * i).squaredNorm());
      const Eigen::ArrayXd products = next.pull.array() * next.slack.array();
      if (products.minCoeff() >= kNeighbourhood * products.mean()) break;
    }
    at = next;
    aim = length > 0.9 ? 0.01 : length > 0.5 ? 0.1 : length > 0.2 ? 0.5 : 1;
  }
  return at;
}

// Residual of Coulomb's law, over b: the rate of a force inside its cone, and the part of it that a force on the edge
// does not oppose.
double law_residual(const FreePoints& p, const Eigen::VectorXd& l) {
  const Eigen::VectorXd rate = p.A * l + p.b;
  double most = 0;
  for (Eigen::Index i = 0; i < p.count(); ++i) {
    const Eigen::Vector2d own = l.segment<2>(2 * i) / p.radius[i], r = rate.segment<2>(2 * i);
    const double against = own.norm() >= 1 - kInside ? std::max(0.0, -r.dot(own)) : 0;
    most = std::max(most, (r + against * own).norm());
  }
  return most;
}

// Moves to the centre of all forces equivalent to `l`: the maximum of the product of slacks of points that are not on
// the edge (the analytic centre). Newton's method along the null space of their A.
void center(const FreePoints& p, const std::vector<char>& on, Eigen::VectorXd& l) {
  std::vector<Eigen::Index> inside, rows;
  for (Eigen::Index i = 0; i < p.count(); ++i) {
    if (on[static_cast<std::size_t>(i)]) continue;
    inside.push_back(i);
    rows.insert(rows.end(), {2 * i, 2 * i + 1});
  }
  const Eigen::Index m = static_cast<Eigen::Index>(inside.size());
  if (m < 2) return;
  const Eigen::MatrixXd A = p.A(rows, rows);
  const Eigen::VectorXd size = A.diagonal().cwiseMax(1e-300).cwiseSqrt(), inverse = size.cwiseInverse();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(
      Eigen::MatrixXd(inverse.asDiagonal() * A * inverse.asDiagonal()));
  Eigen::Index free = 0;  // eigenvalues are in ascending order
  while (free < 2 * m && eigen.eigenvalues()[free] < kNoFreedom * eigen.eigenvalues().maxCoeff()) ++free;
  if (free == 0) return;
  Eigen::MatrixXd along = inverse.asDiagonal() * eigen.eigenvectors().leftCols(free);
  Eigen::VectorXd x(2 * m), slack(m);
  for (Eigen::Index k = 0; k < m; ++k) {
    const double radius = p.radius[inside[static_cast<std::size_t>(k)]];
    x.segment<2>(2 * k) = l.segment<2>(2 * inside[static_cast<std::size_t>(k)]) / radius;
    along.middleRows<2>(2 * k) /= radius;
  }
  along.colwise().normalize();
  Eigen::VectorXd pull(free);
  Eigen::MatrixXd slope(free, free);
  for (int step = 0; step < kCenterSteps; ++step) {
    pull.setZero(), slope.setZero();
    for (Eigen::Index k = 0; k < m; ++k) {
      const Eigen::Vector2d own = x.segment<2>(2 * k);
      slack[k] = 0.5 * (1 - own.squaredNorm());
      if (!(slack[k] > 0)) return;
      const Eigen::VectorXd outward = along.middleRows<2>(2 * k).transpose() * own / slack[k];
      pull += outward;
      slope += along.middleRows<2>(2 * k).transpose() * along.middleRows<2>(2 * k) / slack[k];
      slope += outward * outward.transpose();
    }
    const Cholesky factors(slope);
    if (factors.info() != Eigen::Success) break;
    const Eigen::VectorXd change = cholesky_solution(factors, pull);
    // The norm of the step in the metric of the slope: below one it stays inside.
    const double size_of_step = std::sqrt(std::max(0.0, pull.dot(change)));
    if (!(size_of_step > 1e-15)) break;
    x -= along * (change / (size_of_step < 0.1 ? 1.0 : 1 + size_of_step));
    if (size_of_step < 1e-8) break;  // the next would be of second order
  }
  for (Eigen::Index k = 0; k < m; ++k) {
    const Eigen::Index i = inside[static_cast<std::size_t>(k)];
    l.segment<2>(2 * i) = p.radius[i] * x.segment<2>(2 * k);
  }
}

// The central solution; if Newton's method does not converge to it, the result of the interior-point method.
Eigen::VectorXd solve_inside(const FreePoints& p) {
  const Eigen::Index m = p.count();
  const CentralForces central = central_forces(p);
  Eigen::VectorXd middle(2 * m);
  std::vector<char> on(static_cast<std::size_t>(m));
  for (Eigen::Index i = 0; i < m; ++i) {
    middle.segment<2>(2 * i) = p.radius[i] * central.x.segment<2>(2 * i);
    on[static_cast<std::size_t>(i)] = central.slack[i] < central.pull[i];
  }
  const double small = 4e-15 * (1 + (p.A.cwiseAbs() * middle.cwiseAbs()).maxCoeff());
  for (int round = 0; round < kEdgeRounds; ++round) {
    std::vector<Eigen::Index> edge;
    for (Eigen::Index i = 0; i < m; ++i) {
      if (on[static_cast<std::size_t>(i)]) edge.push_back(i);
    }
    ActiveForces found{middle, central.pull(edge).cwiseQuotient(p.radius(edge))};
    if (!solve_active(p.A, p.b, p.radius, edge, small, kRank, found)) break;
    // Checks points on the edge whose friction would have to push, and points outside their cones.
    bool right = true;
    for (std::size_t k = 0; k < edge.size(); ++k) {
      if (found.a[static_cast<Eigen::Index>(k)] * p.radius[edge[k]] >= -4 * small) continue;
      right = false, on[static_cast<std::size_t>(edge[k])] = 0;
    }
    for (Eigen::Index i = 0; i < m; ++i) {
      const double size = found.l.segment<2>(2 * i).norm() / p.radius[i];
      const double beyond = (size - 1) * p.radius[i] * p.A.block<2, 2>(2 * i, 2 * i).trace();
      if (size > 1 + 1e-12 && beyond > 4 * small) right = false, on[static_cast<std::size_t>(i)] = 1;
      if (size > 1 || (size > 0 && on[static_cast<std::size_t>(i)])) found.l.segment<2>(2 * i) /= size;
    }
    if (!right) continue;
    center(p, on, found.l);
    return found.l;
  }
  if (law_residual(p, middle) <= kLawLeft) center(p, on, middle);
  return middle;
}

// Point by point: each step is exact in its plane and decreases the convex function. Returns false without convergence.
bool sweep_points(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, const Eigen::VectorXd& radius, int most,
                  FrictionForces& result) {
  const Eigen::Index m = radius.size();
  std::vector<Disc> discs;
  for (Eigen::Index i = 0; i < m; ++i) discs.emplace_back(A.block<2, 2>(2 * i, 2 * i));
  const double small = 1e-15 * b.norm();
  Eigen::VectorXd push(2 * m);
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
    if (m == 1 || std::sqrt(moved) <= small) return true;
    if (sweep % kSweepsBetween == 0 && solve_near(A, b, radius, small, result)) return true;
  }
  return false;
}

// Number of points that do not begin to slide.
int sticking(const FrictionForces& forces, double push) {
  int count = 0;
  for (Eigen::Index i = 0; i < forces.rate.size() / 2; ++i)
    count += forces.rate.segment<2>(2 * i).norm() <= kNoRate * push;
  return count;
}

}  // namespace

// A, b, cone radii, start, choice => forces and slip rates of (11.5): minimum of l^T A l / 2 + l^T b with |l_i| <=
// radius_i. Projected sweeps from point to point; without convergence, or for the middle of several solutions, the
// interior-point method (11.11). `residual` is the residual of Coulomb's law.
FrictionForces friction_at_rest(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, const Eigen::VectorXd& radius,
                                const Eigen::VectorXd& start, FrictionChoice choice) {
  const Eigen::Index m = radius.size();
  FrictionForces result{Eigen::VectorXd::Zero(2 * m), b};
  if (start.size() == 2 * m) {
    for (Eigen::Index i = 0; i < m; ++i) {
      const double size = start.segment<2>(2 * i).norm();
      result.force.segment<2>(2 * i) = start.segment<2>(2 * i) * (size > radius[i] ? radius[i] / size : 1.0);
    }
    result.rate.noalias() += A * result.force;
  }
  const bool middle = choice == FrictionChoice::middle;
  const bool swept = sweep_points(A, b, radius, middle ? kSweepsBetween : kMaxSweeps, result);
  if (!swept || (middle && sticking(result, b.norm()) > 1)) {
    result.crawled = true;
    const FreePoints free(A, b, radius);
    Eigen::VectorXd l = Eigen::VectorXd::Zero(2 * free.count());
    if (free.push > 0) l = solve_inside(free);
    const double residual = law_residual(free, l);
    if (residual <= kLawLeft || !swept) {
      result.force.setZero();
      for (Eigen::Index k = 0; k < free.count(); ++k)
        result.force.segment<2>(2 * free.points[static_cast<std::size_t>(k)]) = l.segment<2>(2 * k);
      result.rate = A * result.force + b;
    }
    // If cones and forces differ so much that interior points reach their edges too early, sweeps may continue.
    if (residual > kLawLeft && !swept && !sweep_points(A, b, radius, kMaxSweeps, result)) result.residual = residual;
  }
  result.rate = A * result.force + b;
  return result;
}

// A, b, radii => forces with which all points stick, and the smallest common factor of the radii that permits them, by
// 24 bisections; factor 2 if not all points can stick.
StickShare min_used_cones(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, const Eigen::VectorXd& radius) {
  // A factor is sufficient if its permitted forces leave no rate.
  const double none = kNoRate * b.norm();
  int crawled = 0;
  const auto share = [&](double factor) {
    FrictionForces forces = friction_at_rest(A, b, factor * radius);
    crawled += forces.crawled ? 1 : 0;
    return forces;
  };
  double low = 0, high = 1;
  FrictionForces best = share(high);
  if (best.rate.norm() > none) return {best.force, 2, crawled};
  for (int i = 0; i < 24; ++i) {
    const double middle = 0.5 * (low + high);
    FrictionForces tried = share(middle);
    if (tried.rate.norm() > none) {
      low = middle;
    } else {
      high = middle, best = std::move(tried);
    }
  }
  return {best.force, high, crawled};
}

}  // namespace grapnel
