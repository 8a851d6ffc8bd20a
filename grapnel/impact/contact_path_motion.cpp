#include "grapnel/impact/contact_path_motion.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "grapnel/impact/contact_path_kernel.hpp"
#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {
namespace {

constexpr double kRedundant = 1e-11;  // eigenvalues below this fraction of the largest are zero

// Eigenvalues and vectors of A with its rows scaled to unit diagonal, so that heavy and light bodies have equal weight.
struct Scaled {
  Eigen::VectorXd size;
  Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen;
  explicit Scaled(const Eigen::MatrixXd& A) : size(A.diagonal().cwiseMax(1e-300).cwiseSqrt()) {
    const Eigen::VectorXd inverse = size.cwiseInverse();
    eigen.compute(Eigen::MatrixXd(inverse.asDiagonal() * A * inverse.asDiagonal()));
  }
  bool redundant() const { return eigen.eigenvalues().minCoeff() < kRedundant * eigen.eigenvalues().maxCoeff(); }
  Eigen::MatrixXd inverse() const {
    const Eigen::VectorXd& w = eigen.eigenvalues();
    Eigen::VectorXd reciprocal = Eigen::VectorXd::Zero(w.size());
    for (Eigen::Index i = 0; i < w.size(); ++i) {
      if (w[i] > 0 && w[i] >= kRedundant * w.maxCoeff()) reciprocal[i] = 1 / w[i];
    }
    const Eigen::MatrixXd V = size.cwiseInverse().asDiagonal() * eigen.eigenvectors();
    return V * reciprocal.asDiagonal() * V.transpose();
  }
};

constexpr double kSmallCone = 1e-4;  // minimum scale of cones, relative to the largest

}  // namespace

// Problem => dimensionless W, u and stiffnesses, divided by the largest W_nn, approach speed and stiffness; initial
// point with zero impulses. For Newton's hypothesis it also sets the rebound velocities -e u_n (11.6).
PathMotion::PathMotion(const ContactPathProblem& problem)
    : problem_(problem),
      count_(static_cast<int>(problem.contacts.size())),
      springs_(problem.contacts.size()),
      at_{count_},
      table_(static_cast<std::size_t>(at_.size())),
      b_(2 * count_) {
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
  for (int i = 0; i < count_; ++i) {
    if (hypothesis(i) == RestitutionHypothesis::newton)
      contact(i).released = std::max(0.0, -restitution(i) * before_[3 * i]);
  }
  now_.y = now_.rate = Eigen::VectorXd::Zero(8 * n);
  now_.u = before_;
  end_ = now_;
  end_rate_ = Eigen::VectorXd::Zero(3 * n);
  double* const W = table_.data() + at_.mobility();
  for (Eigen::Index r = 0; r < 3 * n; ++r) {
    for (Eigen::Index c = 0; c < 3 * n; ++c) W[3 * n * r + c] = W_(r, c);
    table_[static_cast<std::size_t>(at_.before() + r)] = before_[r];
    table_[static_cast<std::size_t>(at_.scale() + r)] = std::sqrt(W_(r, r));
  }
}

bool PathMotion::any_touching() const {
  return std::any_of(springs_.begin(), springs_.end(),
                     [](const PathSpring& s) { return s.phase != NormalPhase::open; });
}

bool PathMotion::rebounds_negligible(double small) const {
  for (int i = 0; i < count_; ++i) {
    if (!touches(i)) continue;
    // The rebound velocity that the spring could cause.
    const double stored = std::abs(now_.y[i]) * std::sqrt(W_(3 * i, 3 * i) / stiffness(i));
    if (stored > small || std::abs(normal_velocity(now_, i) - contact(i).released) > small) return false;
  }
  return true;
}

// Speed bound => none, at_rest (touching contacts do not move and friction balances the normal forces), or ever_harder
// (friction also balances their growth under Newton's hypothesis) (docs/theory, section 11, Wedging).
PathMotion::Wedge PathMotion::wedged(double small) {
  std::vector<int> rubbing;
  Eigen::VectorXd force = Eigen::VectorXd::Zero(count_), growth = force;
  for (int i = 0; i < count_; ++i) {
    if (!touches(i)) continue;
    if (std::abs(normal_velocity(now_, i)) > small) return Wedge::none;
    force[i] = now_.y[i], growth[i] = force_rate(i, 0);
    if (growth[i] < 0) return Wedge::none;  // Poisson's spring loses its force at rest, too
    if (friction(i) == 0) continue;
    if (slip(now_, i).norm() > small) return Wedge::none;
    rubbing.push_back(i);
  }
  if (!balanced(rubbing, force, small)) return Wedge::none;
  if (growth.isZero()) return Wedge::at_rest;
  // If friction can balance their growth it can always balance them, since cones are convex.
  return balanced(rubbing, growth, small * growth.maxCoeff()) ? Wedge::ever_harder : Wedge::none;
}

// Whether friction of the contacts `rubbing` can balance these normal forces: the remainder must not cause a speed
// above `small` within a spring's period.
bool PathMotion::balanced(const std::vector<int>& rubbing, const Eigen::VectorXd& normal, double small) {
  const Eigen::Index m = static_cast<Eigen::Index>(rubbing.size());
  force_.setZero(3 * count_);
  for (int i = 0; i < count_; ++i) force_[3 * i] = normal[i];
  Eigen::VectorXd b(2 * m), radius(m);
  for (Eigen::Index k = 0; k < m; ++k) {
    const int i = rubbing[static_cast<std::size_t>(k)];
    b.segment<2>(2 * k) = W_.middleRows<2>(3 * i + 1) * force_;
    radius[k] = friction(i) * std::max(0.0, normal[i]);
  }
  remove_rounding(b, force_.norm());
  const FrictionForces forces = friction_at_rest(mobility_of(rubbing).A, b, radius);
  count(forces);
  for (Eigen::Index k = 0; k < m; ++k)
    force_.segment<2>(3 * rubbing[static_cast<std::size_t>(k)] + 1) = forces.force.segment<2>(2 * k);
  for (int i = 0; i < count_; ++i) {
    if (!touches(i)) continue;
    const Eigen::Vector3d acceleration = W_.middleRows<3>(3 * i) * force_;
    const double felt = friction(i) > 0 ? acceleration.norm() : std::abs(acceleration[0]);
    if (!(felt <= small * std::sqrt(frequency_squared(i)))) return false;
  }
  return true;
}

double PathMotion::frequency_squared(int i) const {
  if (!touches(i)) return 0;
  double k = stiffness(i) * W_(3 * i, 3 * i);
  if (contact(i).phase != NormalPhase::unloading) return k;
  if (hypothesis(i) == RestitutionHypothesis::stronge) k /= restitution(i) * restitution(i);
  if (hypothesis(i) == RestitutionHypothesis::poisson) k += std::pow(contact(i).slope / contact(i).top, 2);
  return k;
}

// The spring's law (docs/theory, section 11).
double PathMotion::force_rate(int i, double normal_velocity) const {
  const PathSpring& c = contact(i);
  if (c.phase == NormalPhase::open) return 0;
  if (hypothesis(i) == RestitutionHypothesis::newton) return -stiffness(i) * (normal_velocity - c.released);
  if (c.phase == NormalPhase::loading) return -stiffness(i) * normal_velocity;
  if (hypothesis(i) == RestitutionHypothesis::poisson) return c.slope;
  return -stiffness(i) / (restitution(i) * restitution(i)) * normal_velocity;
}

// Writes the contacts' states as numbers of the equations: see PathTable.
void PathMotion::write_springs() {
  for (int i = 0; i < count_; ++i) {
    const PathSpring& c = contact(i);
    double* const s = table_.data() + at_.spring(i);
    const bool unloading = c.phase == NormalPhase::unloading, newton = hypothesis(i) == RestitutionHypothesis::newton;
    const bool rubs = touches(i) && friction(i) > 0;
    s[PathTable::pace] = touches(i) ? -stiffness(i) : 0;
    s[PathTable::pull] = 0;
    s[PathTable::released] = newton ? c.released : 0;
    if (unloading && hypothesis(i) == RestitutionHypothesis::poisson)
      s[PathTable::pace] = 0, s[PathTable::pull] = c.slope;
    if (unloading && hypothesis(i) == RestitutionHypothesis::stronge)
      s[PathTable::pace] = -stiffness(i) / (restitution(i) * restitution(i));
    s[PathTable::loading] = c.phase == NormalPhase::loading ? 1 : 0;
    s[PathTable::friction] = rubs ? friction(i) : 0;
    Eigen::Map<Eigen::Vector2d>(s + PathTable::offset) = c.offset;
    Eigen::Map<Eigen::Vector2d> along(s + PathTable::along);
    along.setZero();
    double& slow = s[PathTable::slow];
    if (touches(i) && c.hold == Hold::sticks) {
      slow = kSticks, along = -c.share;
    } else if (!rubs) {
      slow = kFrictionless;
    } else {
      // At the start of sliding the velocity has no direction yet.
      slow = c.direction.isZero() ? kAnySpeed : kSlow, along = c.direction;
    }
  }
}

// The solution operator of sticking, l = s - undo (W_t f): rows and columns of contacts that stick.
void PathMotion::write_undo() {
  double* const undo = table_.data() + at_.undo();
  std::fill_n(undo, 4 * count_ * count_, 0.0);
  sticking_.clear();
  for (int i = 0; i < count_; ++i) {
    if (touches(i) && contact(i).hold == Hold::sticks) sticking_.push_back(i);
  }
  if (sticking_.empty()) return;
  const Eigen::MatrixXd& inverse = mobility_of(sticking_).inverse;
  Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> all(undo, 2 * count_, 2 * count_);
  const Eigen::Index m = static_cast<Eigen::Index>(sticking_.size());
  for (Eigen::Index i = 0; i < m; ++i) {
    for (Eigen::Index j = 0; j < m; ++j) {
      all.block<2, 2>(2 * sticking_[static_cast<std::size_t>(i)], 2 * sticking_[static_cast<std::size_t>(j)]) =
          inverse.block<2, 2>(2 * i, 2 * j);
    }
  }
}

// Contact indices => W_tt of these contacts, its pseudo-inverse and whether it is singular; computed once per set of
// contacts.
const RestMobility& PathMotion::mobility_of(const std::vector<int>& contacts) {
  const auto known = std::find_if(mobilities_.begin(), mobilities_.end(),
                                  [&](const RestMobility& m) { return m.contacts == contacts; });
  if (known != mobilities_.end()) return *known;
  const Eigen::Index m = static_cast<Eigen::Index>(contacts.size());
  RestMobility made{contacts, Eigen::MatrixXd(2 * m, 2 * m), {}};
  for (Eigen::Index i = 0; i < m; ++i) {
    for (Eigen::Index j = 0; j < m; ++j) {
      made.A.block<2, 2>(2 * i, 2 * j) =
          W_.block<2, 2>(3 * contacts[static_cast<std::size_t>(i)] + 1, 3 * contacts[static_cast<std::size_t>(j)] + 1);
    }
  }
  if (m > 0) {
    const Scaled scaled(made.A);
    made.inverse = scaled.inverse(), made.redundant = scaled.redundant();
  }
  return mobilities_.emplace_back(std::move(made));
}

void PathMotion::prepare() {
  write_springs();
  write_undo();
  rates_known_ = false;
  springs_changed_ = point_changed_ = true;
}

// Contacts at rest => A = W_tt, b and cone radii mu f of (11.5); b is the tangential acceleration due to normal forces
// and to friction of the sliding contacts. While all normal forces are zero, their rates take their place.
RestProblem PathMotion::at_rest(const std::vector<int>& rest) {
  // At the very beginning forces are zero and only their growth is known, which has the same directions.
  Eigen::VectorXd normal = Eigen::VectorXd::Zero(count_);
  for (int i = 0; i < count_; ++i) {
    if (touches(i)) normal[i] = std::max(0.0, now_.y[i]);
  }
  if (normal.isZero()) {
    for (int i = 0; i < count_; ++i) normal[i] = std::max(0.0, force_rate(i, normal_velocity(now_, i)));
  }
  const Eigen::Index m = static_cast<Eigen::Index>(rest.size());
  RestProblem r{mobility_of(rest), Eigen::VectorXd(2 * m), Eigen::VectorXd(m)};
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
  }
  remove_rounding(r.b, force.norm());
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

// Point, contact, event => signed distance to the event, positive before it: of u_n from zero or the release velocity,
// of the remaining force, or of the friction force from its cone relative to the radius.
double PathMotion::gap(const PathPoint& at, int i, Watch watch) const {
  const PathSpring& c = contact(i);
  if (watch == Watch::velocity) {
    const double u_n = normal_velocity(at, i);
    return c.phase == NormalPhase::loading ? -u_n : c.phase == NormalPhase::unloading ? u_n : u_n - c.released;
  }
  if (watch == Watch::release) {
    if (hypothesis(i) == RestitutionHypothesis::newton) return c.released - normal_velocity(at, i);
    return at.y[i] / c.top;
  }
  // The cone vanishes with the normal force, but the sticking force need not.
  const double radius = friction(i) * std::max(0.0, at.y[i]), largest = friction(i) * at.y.head(count_).maxCoeff();
  if (largest <= 0) return 1;
  return (radius - at.rate.segment<2>(count_ + 3 * i + 1).norm()) / std::max(radius, kSmallCone * largest);
}

double PathMotion::gap_rate(int i, Watch watch) const {
  const PathSpring& c = contact(i);
  if (watch == Watch::cone) return 0;
  const double acceleration = W_.row(3 * i).dot(now_.rate.segment(count_, 3 * count_));
  if (watch == Watch::velocity) return c.phase == NormalPhase::loading ? -acceleration : acceleration;
  return hypothesis(i) == RestitutionHypothesis::newton ? -acceleration : now_.rate[i] / c.top;
}

void PathMotion::open(int i) {
  PathSpring& c = contact(i);
  c.phase = NormalPhase::open;
  c.hold = Hold::slides;
  c.offset.setZero();
  c.direction.setZero();
  c.share.setZero();
  now_.y[i] = 0;
}

// A turning point: the normal velocity reaches zero from below.
void PathMotion::turn(int i, double velocity) {
  PathSpring& c = contact(i);
  c.phase = NormalPhase::unloading;
  c.top = now_.y[i];
  switch (hypothesis(i)) {
    case RestitutionHypothesis::newton:
      if (c.released <= std::max(0.0, velocity)) open(i);
      return;
    case RestitutionHypothesis::poisson: {
      // Remaining impulse: e times the impulse of compression, less the impulse already given. It ends with f = 0.
      const double left = (1 + restitution(i)) * now_.y[4 * count_ + i] - now_.y[count_ + 3 * i];
      if (left <= 1e-13 * now_.y[4 * count_ + i] || c.top <= 0) return open(i);
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
  const double velocity = normal_velocity(now_, i);
  if (c.phase == NormalPhase::loading) return turn(i, velocity);
  // Pressed again, or for the first time.
  const bool restoring = c.phase == NormalPhase::open && c.released > 0 && velocity > 0;
  c.phase = restoring ? NormalPhase::unloading : NormalPhase::loading;
}

void PathMotion::find_rates(PathPoint& at) {
  path_rates<0>(at_, table_.data(), !sticking_.empty(), at.y.data(), at.u.data(), b_.data(), at.rate.data());
}

void PathMotion::begin_step() {
  if (!rates_known_) find_rates(now_);
  rates_known_ = true;
}

void PathMotion::accept() {
  std::swap(now_, end_);
  rates_known_ = end_rates_known_;
  point_changed_ = true;
}

namespace {
void to_lane(const double* from, int count, double* to, int width, int lane) {
  for (int i = 0; i < count; ++i) to[i * width + lane] = from[i];
}
void from_lane(const double* from, int count, int width, int lane, double* to) {
  for (int i = 0; i < count; ++i) to[i] = from[i * width + lane];
}
}  // namespace

void PathMotion::enter(const PathLanes& lanes, int lane) {
  to_lane(table_.data(), at_.size(), lanes.table, lanes.width, lane);
  springs_changed_ = false, point_changed_ = true;
}

void PathMotion::put(const PathLanes& lanes, int lane, double h) {
  lanes.size[lane] = h;
  if (springs_changed_) {
    const int first = at_.spring(0);
    to_lane(table_.data() + first, at_.size() - first, lanes.table + first * lanes.width, lanes.width, lane);
  }
  if (point_changed_) {
    to_lane(now_.y.data(), at_.state(), lanes.y, lanes.width, lane);
    to_lane(now_.rate.data(), at_.state(), lanes.rate, lanes.width, lane);
  }
  springs_changed_ = point_changed_ = false;
}

double PathMotion::take(const PathLanes& lanes, int lane) {
  from_lane(lanes.end, at_.state(), lanes.width, lane, end_.y.data());
  from_lane(lanes.end_u, 3 * count_, lanes.width, lane, end_.u.data());
  from_lane(lanes.end_rate, at_.state(), lanes.width, lane, end_.rate.data());
  end_rates_known_ = true;
  // Hairer's combination of both estimates (II.10).
  const double e5 = lanes.error[lane] / problem_.tolerance, e3 = lanes.error[lanes.width + lane] / problem_.tolerance;
  return e5 == 0 ? 0.0 : e5 * e5 / std::sqrt(e5 * e5 + 0.01 * e3 * e3);
}

Eigen::Vector2d PathMotion::slip_rate(int i) const {
  return W_.middleRows<2>(3 * i + 1) * now_.rate.segment(count_, 3 * count_);
}

// Errors of forces, of impulses as their effect on velocities, and of the energy balance, over the tolerance.
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
  path.impulse = impulse * now_.y.segment(n, 3 * n);
  for (int i = 0; i < n; ++i) {
    path.compression.push_back(impulse * now_.y[4 * n + i]);
    path.compression_work.push_back(energy * now_.y[5 * n + i]);
    path.normal_work.push_back(energy * now_.y[6 * n + i]);
    path.friction_work.push_back(energy * now_.y[7 * n + i]);
  }
}

// --- Kinds of steps ---

PathSteps::~PathSteps() = default;

// Instruction set, numbers of contacts and paths => stepper that tries one path per lane; without a set in doubles.
// AVX-512 is used only if the paths exceed the lanes of AVX2.
std::unique_ptr<PathSteps> make_path_steps(std::optional<lanes::InstructionSet> set, int contacts, int paths) {
  using lanes::InstructionSet;
  if (!set) return std::unique_ptr<PathSteps>(new_path_steps<double>(contacts));
  // Few paths by avx2, with identical bits: fewer empty lanes cost less.
  if (set == InstructionSet::avx512 && paths <= lanes::lane_count(InstructionSet::avx2)) set = InstructionSet::avx2;
  using MakeSteps = PathSteps* (*)(int);
  const MakeSteps make =
      lanes::of_set(*set, []<class Set>(std::type_identity<Set>) -> MakeSteps { return make_path_steps_of<Set>; });
  return std::unique_ptr<PathSteps>(make(contacts));
}

}  // namespace grapnel
