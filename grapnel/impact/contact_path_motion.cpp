#include "grapnel/impact/contact_path_motion.hpp"

#include <Eigen/Jacobi>
#include <algorithm>
#include <cmath>
#include <vector>

#include "grapnel/dense/decompositions.hpp"

namespace grapnel {
namespace {

constexpr double kRedundant = 1e-11;  // eigenvalues below this fraction of the largest are zero

// Eigenvalues and vectors of A with its rows scaled to unit diagonal, so that heavy and light bodies count alike.
struct Scaled {
  Eigen::VectorXd size;
  Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen;
  explicit Scaled(const Eigen::MatrixXd& A) : size(A.diagonal().cwiseMax(1e-300).cwiseSqrt()) {
    const Eigen::VectorXd inverse = size.cwiseInverse();
    eigen.compute(inverse.asDiagonal() * A * inverse.asDiagonal());
  }
  bool redundant() const { return eigen.eigenvalues().minCoeff() < kRedundant * eigen.eigenvalues().maxCoeff(); }
  Eigen::MatrixXd inverse() const {
    const Eigen::VectorXd& w = eigen.eigenvalues();
    Eigen::VectorXd reciprocal = Eigen::VectorXd::Zero(w.size());
    for (Eigen::Index i = 0; i < w.size(); ++i) {
      if (w[i] >= kRedundant * w.maxCoeff()) reciprocal[i] = 1 / w[i];
    }
    const Eigen::MatrixXd V = size.cwiseInverse().asDiagonal() * eigen.eigenvectors();
    return V * reciprocal.asDiagonal() * V.transpose();
  }
};

constexpr double kSmallCone = 1e-4;  // cones below this fraction of the largest are measured against that

}  // namespace

PathMotion::PathMotion(const ContactPathProblem& problem)
    : problem_(problem), count_(static_cast<int>(problem.contacts.size())), springs_(problem.contacts.size()) {
  const Eigen::Index n = count_;
  stiffness_.resize(n);
  double fastest = 0, largest = 0;
  for (Eigen::Index i = 0; i < n; ++i) {
    stiffness_[i] = problem.contacts[static_cast<std::size_t>(i)].stiffness;
    fastest = std::max(fastest, -problem.u[3 * i]);
    largest = std::max(largest, problem.W(3 * i, 3 * i));
  }
  if (n > 0) stiffness_ /= stiffness_.maxCoeff();
  if (fastest > 0) speed_ = fastest;
  if (largest > 0) mobility_ = largest;
  rounding_ = problem.rounding / speed_;
  W_ = problem.W / mobility_;
  before_ = problem.u / speed_;
  if (problem.hypothesis == RestitutionHypothesis::newton) {
    for (int i = 0; i < count_; ++i) contact(i).released = std::max(0.0, -restitution(i) * before_[3 * i]);
  }
  y_ = end_ = stage_state_ = difference_ = Eigen::VectorXd::Zero(8 * n);
  stages_ = Eigen::MatrixXd::Zero(8 * n, dop853::kStages);
  end_rate_ = Eigen::VectorXd::Zero(3 * n);
}

bool PathMotion::any_touching() const {
  return std::any_of(springs_.begin(), springs_.end(),
                     [](const PathSpring& s) { return s.phase != NormalPhase::open; });
}

bool PathMotion::rebounds_negligible(double small) const {
  for (int i = 0; i < count_; ++i) {
    if (!touches(i)) continue;
    // The velocity to which the spring could make it rebound.
    const double stored = std::abs(y_[i]) * std::sqrt(W_(3 * i, 3 * i) / stiffness(i));
    if (stored > small || std::abs(normal_velocity(y_, i) - contact(i).released) > small) return false;
  }
  return true;
}

double PathMotion::normal_velocity(const PathState& y, int i) const {
  return before_[3 * i] + W_.row(3 * i).dot(y.segment(count_, 3 * count_));
}

Eigen::Vector2d PathMotion::slip(const PathState& y, int i) const {
  return before_.segment<2>(3 * i + 1) + W_.middleRows<2>(3 * i + 1) * y.segment(count_, 3 * count_) -
         contact(i).offset;
}

double PathMotion::frequency_squared(int i) const {
  if (!touches(i)) return 0;
  double k = stiffness(i) * W_(3 * i, 3 * i);
  if (contact(i).phase != NormalPhase::unloading) return k;
  if (problem_.hypothesis == RestitutionHypothesis::stronge) k /= restitution(i) * restitution(i);
  if (problem_.hypothesis == RestitutionHypothesis::poisson) k += std::pow(contact(i).slope / contact(i).top, 2);
  return k;
}

// The law of the spring (docs/theory.md, section 11).
double PathMotion::force_rate(int i, double normal_velocity) const {
  const PathSpring& c = contact(i);
  if (c.phase == NormalPhase::open) return 0;
  if (problem_.hypothesis == RestitutionHypothesis::newton) return -stiffness(i) * (normal_velocity - c.released);
  if (c.phase == NormalPhase::loading) return -stiffness(i) * normal_velocity;
  if (problem_.hypothesis == RestitutionHypothesis::poisson) return c.slope;
  return -stiffness(i) / (restitution(i) * restitution(i)) * normal_velocity;
}

// Velocities, and the forces [normal, tangential] of all contacts.
void PathMotion::forces(const PathState& y, Eigen::VectorXd& u, Eigen::VectorXd& force) const {
  u = before_;
  u.noalias() += W_ * y.segment(count_, 3 * count_);
  force.setZero(3 * count_);
  for (int i = 0; i < count_; ++i) {
    const PathSpring& c = contact(i);
    if (c.phase == NormalPhase::open) continue;
    force[3 * i] = y[i];
    const double radius = friction(i) * y[i];
    if (radius == 0) continue;
    if (c.hold == Hold::sticks) {
      force.segment<2>(3 * i + 1) = radius * c.share;
      continue;
    }
    const Eigen::Vector2d s = u.segment<2>(3 * i + 1) - c.offset;
    const double speed = s.norm();
    // The first moments of sliding have no direction of their own yet.
    const Eigen::Vector2d along =
        speed > 1e-13 || c.direction.isZero() ? Eigen::Vector2d(s / std::max(speed, 1e-300)) : c.direction;
    force.segment<2>(3 * i + 1) = -radius * along;
  }
  if (sticking_.empty()) return;
  // Sticking: what all others do to the tangential velocities is undone.
  Eigen::VectorXd b(2 * static_cast<Eigen::Index>(sticking_.size()));
  for (std::size_t k = 0; k < sticking_.size(); ++k) {
    b.segment<2>(2 * static_cast<Eigen::Index>(k)) = W_.middleRows<2>(3 * sticking_[k] + 1) * force;
  }
  const Eigen::VectorXd undo = inverse_ * b;
  for (std::size_t k = 0; k < sticking_.size(); ++k) {
    force.segment<2>(3 * sticking_[k] + 1) -= undo.segment<2>(2 * static_cast<Eigen::Index>(k));
  }
}

void PathMotion::derivative(const PathState& y, Eigen::Ref<Eigen::VectorXd> rate) {
  const int n = count_;
  forces(y, u_, force_);
  rate.segment(n, 3 * n) = force_;
  for (int i = 0; i < n; ++i) {
    const double u_n = u_[3 * i], power = force_[3 * i] * u_n;
    const bool loading = contact(i).phase == NormalPhase::loading;
    rate[i] = force_rate(i, u_n);
    rate[4 * n + i] = loading ? force_[3 * i] : 0.0;
    rate[5 * n + i] = loading ? power : 0.0;
    rate[6 * n + i] = power;
    rate[7 * n + i] = force_.segment<2>(3 * i + 1).dot(u_.segment<2>(3 * i + 1));
  }
}

void PathMotion::prepare() {
  sticking_.clear();
  for (int i = 0; i < count_; ++i) {
    if (touches(i) && contact(i).hold == Hold::sticks) sticking_.push_back(i);
  }
  if (sticking_.empty()) return;
  const Eigen::Index m = static_cast<Eigen::Index>(sticking_.size());
  Eigen::MatrixXd A(2 * m, 2 * m);
  for (Eigen::Index i = 0; i < m; ++i) {
    for (Eigen::Index j = 0; j < m; ++j) {
      A.block<2, 2>(2 * i, 2 * j) = W_.block<2, 2>(3 * sticking_[static_cast<std::size_t>(i)] + 1,
                                                   3 * sticking_[static_cast<std::size_t>(j)] + 1);
    }
  }
  inverse_ = Scaled(A).inverse();
}

RestProblem PathMotion::at_rest(const std::vector<int>& rest) const {
  // At the very beginning forces are zero and only what they grow with is known: it has the same directions.
  Eigen::VectorXd normal = Eigen::VectorXd::Zero(count_);
  for (int i = 0; i < count_; ++i) {
    if (touches(i)) normal[i] = std::max(0.0, y_[i]);
  }
  if (normal.isZero()) {
    for (int i = 0; i < count_; ++i) normal[i] = std::max(0.0, force_rate(i, normal_velocity(y_, i)));
  }
  const Eigen::Index m = static_cast<Eigen::Index>(rest.size());
  RestProblem r{Eigen::MatrixXd(2 * m, 2 * m), Eigen::VectorXd(2 * m), Eigen::VectorXd(m)};
  Eigen::VectorXd force = Eigen::VectorXd::Zero(3 * count_);
  for (int i = 0; i < count_; ++i) {
    if (!touches(i)) continue;
    force[3 * i] = normal[i];
    const bool resting = std::find(rest.begin(), rest.end(), i) != rest.end();
    if (!resting && friction(i) > 0) force.segment<2>(3 * i + 1) = -friction(i) * normal[i] * contact(i).direction;
  }
  for (Eigen::Index i = 0; i < m; ++i) {
    const int a = rest[static_cast<std::size_t>(i)];
    r.b.segment<2>(2 * i) = W_.middleRows<2>(3 * a + 1) * force;
    r.radius[i] = friction(a) * normal[a];
    for (Eigen::Index j = 0; j < m; ++j) {
      r.A.block<2, 2>(2 * i, 2 * j) = W_.block<2, 2>(3 * a + 1, 3 * rest[static_cast<std::size_t>(j)] + 1);
    }
  }
  if (m > 0) r.redundant = Scaled(r.A).redundant();
  return r;
}

bool PathMotion::watches(int i, Watch watch) const {
  switch (watch) {
    case Watch::velocity:
      return true;
    case Watch::release:
      return contact(i).phase == NormalPhase::unloading;
    default:
      return touches(i) && contact(i).hold == Hold::sticks && friction(i) > 0;
  }
}

double PathMotion::gap(const PathState& y, int i, Watch watch) const {
  const PathSpring& c = contact(i);
  if (watch == Watch::velocity) {
    const double u_n = normal_velocity(y, i);
    return c.phase == NormalPhase::loading ? -u_n : c.phase == NormalPhase::unloading ? u_n : u_n - c.released;
  }
  if (watch == Watch::release) {
    if (problem_.hypothesis == RestitutionHypothesis::newton) return c.released - normal_velocity(y, i);
    return y[i] / c.top;
  }
  // Where the normal force goes to zero the cone does, and what sticking takes need not.
  const double radius = friction(i) * std::max(0.0, y[i]), largest = friction(i) * y.head(count_).maxCoeff();
  if (largest <= 0) return 1;
  forces(y, u_, force_);
  return (radius - force_.segment<2>(3 * i + 1).norm()) / std::max(radius, kSmallCone * largest);
}

double PathMotion::gap_rate(int i, Watch watch) const {
  const PathSpring& c = contact(i);
  if (watch == Watch::cone) return 0;
  const double acceleration = W_.row(3 * i).dot(stages_.col(0).segment(count_, 3 * count_));
  if (watch == Watch::velocity) return c.phase == NormalPhase::loading ? -acceleration : acceleration;
  return problem_.hypothesis == RestitutionHypothesis::newton ? -acceleration : stages_(i, 0) / c.top;
}

void PathMotion::open(int i) {
  PathSpring& c = contact(i);
  c.phase = NormalPhase::open;
  c.hold = Hold::slides;
  c.offset.setZero();
  c.direction.setZero();
  c.share.setZero();
  y_[i] = 0;
}

// A turning point: the normal velocity has come up to zero.
void PathMotion::turn(int i, double velocity) {
  PathSpring& c = contact(i);
  c.phase = NormalPhase::unloading;
  c.top = y_[i];
  switch (problem_.hypothesis) {
    case RestitutionHypothesis::newton:
      if (c.released <= std::max(0.0, velocity)) open(i);
      return;
    case RestitutionHypothesis::poisson: {
      // Left to give: e times the impulse of compression, less what is given already. It ends with f = 0.
      const double left = (1 + restitution(i)) * y_[4 * count_ + i] - y_[count_ + 3 * i];
      if (left <= 1e-13 * y_[4 * count_ + i] || c.top <= 0) return open(i);
      c.slope = -c.top * c.top / (2 * left);
      return;
    }
    default:
      if (restitution(i) < 1e-7 || c.top <= 0) open(i);
  }
}

void PathMotion::pass(int i, Watch watch) {
  PathSpring& c = contact(i);
  if (watch == Watch::cone) return;
  if (watch == Watch::release) return open(i);
  const double velocity = normal_velocity(y_, i);
  if (c.phase == NormalPhase::loading) return turn(i, velocity);
  // Pressed again, or for the first time.
  const bool restoring = c.phase == NormalPhase::open && c.released > 0 && velocity > 0;
  c.phase = restoring ? NormalPhase::unloading : NormalPhase::loading;
}

template <std::size_t N>
void PathMotion::stage(const std::array<dop853::Term, N>& row, int number, double h) {
  stage_state_ = y_;
  for (const dop853::Term& t : row) stage_state_.noalias() += (h * t.weight) * stages_.col(t.stage - 1);
  derivative(stage_state_, stages_.col(number - 1));
}

void PathMotion::begin_step() { derivative(y_, stages_.col(0)); }

Eigen::Vector2d PathMotion::slip_rate(int i) const {
  return W_.middleRows<2>(3 * i + 1) * stages_.col(0).segment(count_, 3 * count_);
}

double PathMotion::try_step(double h) {
  stage(dop853::kStage2, 2, h);
  stage(dop853::kStage3, 3, h);
  stage(dop853::kStage4, 4, h);
  stage(dop853::kStage5, 5, h);
  stage(dop853::kStage6, 6, h);
  stage(dop853::kStage7, 7, h);
  stage(dop853::kStage8, 8, h);
  stage(dop853::kStage9, 9, h);
  stage(dop853::kStage10, 10, h);
  stage(dop853::kStage11, 11, h);
  stage(dop853::kStage12, 12, h);
  end_ = y_;
  for (const dop853::Term& t : dop853::kSolution) end_.noalias() += (h * t.weight) * stages_.col(t.stage - 1);
  // The combination of both estimates is Hairer's (II.10).
  difference_.setZero();
  for (const dop853::Term& t : dop853::kError5) difference_ += (h * t.weight) * stages_.col(t.stage - 1);
  const double e5 = error_size(difference_);
  difference_ = end_ - y_;
  for (const dop853::Term& t : dop853::kThirdOrder) difference_ -= (h * t.weight) * stages_.col(t.stage - 1);
  const double e3 = error_size(difference_);
  return e5 == 0 ? 0.0 : e5 * e5 / std::sqrt(e5 * e5 + 0.01 * e3 * e3);
}

// Errors of forces, of impulses as the velocities feel them, and of the energy balance, over the tolerance.
double PathMotion::error_size(const PathState& error) const {
  double largest = error.head(count_).lpNorm<Eigen::Infinity>();
  for (Eigen::Index i = 0; i < 3 * count_; ++i) {
    largest = std::max(largest, std::abs(error[count_ + i]) * std::sqrt(W_(i, i)));
  }
  return std::max(largest, error.tail(4 * count_).lpNorm<Eigen::Infinity>()) / problem_.tolerance;
}

void PathMotion::fill(ContactPath& path) const {
  const int n = count_;
  const double impulse = speed_ / mobility_, energy = speed_ * impulse;
  path.impulse = impulse * y_.segment(n, 3 * n);
  for (int i = 0; i < n; ++i) {
    path.compression.push_back(impulse * y_[4 * n + i]);
    path.compression_work.push_back(energy * y_[5 * n + i]);
    path.normal_work.push_back(energy * y_[6 * n + i]);
    path.friction_work.push_back(energy * y_[7 * n + i]);
  }
}

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
  // Point by point: each step is exact in its plane and lowers the convex function.
  for (int sweep = 1; sweep <= most; ++sweep) {
    double moved = 0;
    for (Eigen::Index i = 0; i < m; ++i) {
      const Eigen::Vector2d old = result.force.segment<2>(2 * i);
      const Eigen::Vector2d rest = result.rate.segment<2>(2 * i) - A.block<2, 2>(2 * i, 2 * i) * old;
      const Eigen::Vector2d now = minimize_on_disc(discs[static_cast<std::size_t>(i)], rest, radius[i]);
      const Eigen::Vector2d change = now - old;
      result.rate.noalias() += A.middleCols<2>(2 * i) * change;
      moved = std::max(moved, (A.middleCols<2>(2 * i) * change).norm());
      result.force.segment<2>(2 * i) = now;
    }
    if (moved <= small) break;
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
