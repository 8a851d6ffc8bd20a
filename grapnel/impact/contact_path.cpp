#include "grapnel/impact/contact_path.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <limits>

#include "grapnel/impact/contact_path_motion.hpp"

namespace grapnel {

namespace {

constexpr double kGrowth = 6, kShrink = 0.2;
constexpr double kWorthStiff = 30;  // how much further a stiff step must go than an explicit one
constexpr int kPatience = 40;       // explicit steps so short that a stiff one would be worth it, before one is tried
constexpr double kSmallestStep = 1e-13;
constexpr double kStop = 1e-12;   // slower than this fraction of the approach a contact has come to rest
constexpr double kEdge = 1e-10;   // a friction force this near the cone's edge is on it
constexpr double kAtOnce = 1e-4;  // an event within so short a step from where it was not due is one at its start
constexpr double kNegligibleRebound = 50;  // of the tolerance: forces and velocities left of a cascade that never ends
constexpr double kFeed = 1000;             // steps after which twice as much is left of it
constexpr double kSlowdown = 0.9;          // largest fraction of its speed that a sliding contact loses in a step

// What ends a step early.
struct Event {
  int contact = -1;
  Watch watch = Watch::velocity;
};

class Follower {
 public:
  explicit Follower(const ContactPathProblem& problem)
      : problem_(problem), motion_(problem), count_(motion_.count()), result_() {
    result_.modes.resize(static_cast<std::size_t>(count_));
    first_slip_.assign(static_cast<std::size_t>(count_), Eigen::Vector2d::Zero());
    small_ = std::max(1e-14, 4 * motion_.rounding());
    stop_ = std::max(kStop, 10 * motion_.rounding());
  }

  ContactPath run();

 private:
  bool start();
  void advance();
  double spring_step() const;
  double longest_step() const;
  double try_step(double h) { return stiff_ ? motion_.try_stiff_step(h) : motion_.try_step(h); }
  double choose_step();
  double tightness() const;
  double bound(Watch watch) const { return watch == Watch::cone ? 1e-11 : small_; }
  Event event_in_step(const Event& but) const;
  double instant(const Event& e, double before, double h);
  bool locate(Event& found, double& h);
  bool slows_too_fast(double h) const;
  void decide_friction(int pushed_over);
  void settle_at_rest(const std::vector<int>& rest, int pushed_over);
  bool came_to_rest();
  void note_modes();
  void note(int i, ContactMode mode);
  ContactPath finish();

  const ContactPathProblem& problem_;
  PathMotion motion_;
  int count_;
  ContactPath result_;
  std::vector<Eigen::Vector2d> first_slip_;
  double small_, stop_;
  double step_ = 1e-2, stiff_step_ = 1e-2;
  bool stiff_ = false;  // which kind of step is being tried
  int short_steps_ = 0;
};

bool Follower::start() {
  bool any = false;
  for (int i = 0; i < count_; ++i) {
    if (motion_.normal_velocity(motion_.y(), i) >= -small_) continue;
    motion_.contact(i).phase = NormalPhase::loading;
    any = true;
  }
  return any;
}

// A fraction of the fastest spring's period, so that no spring turns twice in a step; and sliding must not end in it.
double Follower::spring_step() const {
  double squares = 1e-6;
  for (int i = 0; i < count_; ++i) squares += motion_.frequency_squared(i);
  return 0.5 / std::sqrt(squares);
}

double Follower::longest_step() const {
  double h = spring_step();
  for (int i = 0; i < count_; ++i) {
    const PathSpring& c = motion_.contact(i);
    if (!motion_.touches(i) || c.hold != Hold::slides) continue;
    const Eigen::Vector2d s = motion_.slip(motion_.y(), i);
    const double speed = s.norm();
    if (speed <= stop_) continue;
    const double slowing = -s.dot(motion_.slip_rate(i)) / speed;
    if (slowing > 0) h = std::min(h, kSlowdown * speed / slowing);
  }
  return h;
}

// An event that the step just tried has passed, other than `but`.
Event Follower::event_in_step(const Event& but) const {
  for (int i = 0; i < count_; ++i) {
    for (Watch watch : {Watch::velocity, Watch::release, Watch::cone}) {
      if ((but.contact == i && but.watch == watch) || !motion_.watches(i, watch)) continue;
      if (stiff_ && watch == Watch::cone) continue;  // this step needs not know when
      if (motion_.gap(motion_.end(), i, watch) < -bound(watch)) return {i, watch};
    }
  }
  return {};
}

// When within the step of size h the event happens: Illinois' rule, every value from a step of its own, which is left
// in end(). Negative: a step of this size failed though the longer one did not, by chance, over a change of friction.
double Follower::instant(const Event& e, double before, double h) {
  double low = 0, high = h, g_low = before, g_high = motion_.gap(motion_.end(), e.contact, e.watch);
  double at = h, value = g_high;
  int side = 0;
  for (int i = 0; i < 100 && std::abs(value) > 0.1 * bound(e.watch) && high - low > 1e-16 * h; ++i) {
    at = i % 8 == 7 ? 0.5 * (low + high) : (low * g_high - high * g_low) / (g_high - g_low);
    if (!(try_step(at) <= 1) && stiff_) return -at;
    value = motion_.gap(motion_.end(), e.contact, e.watch);
    const int now = value > 0 ? 1 : -1;
    (now > 0 ? low : high) = at;
    (now > 0 ? g_low : g_high) = value;
    if (side == now) (now > 0 ? g_high : g_low) *= 0.5;
    side = now;
  }
  return at;
}

// Looks for events in the step of size h just tried and cuts h to the first. Returns false if the step must be tried
// again with another h, now smaller.
bool Follower::locate(Event& found, double& h) {
  found = {};
  for (int round = 0; round < 3 * count_ + 3; ++round) {
    const Event e = event_in_step(found);
    if (e.contact < 0) break;
    const double before = motion_.gap(motion_.y(), e.contact, e.watch);
    if (before <= bound(e.watch)) {
      // It stood at its event when the step began and has gone over: at once, or by a turn within the step.
      if (h > kAtOnce * std::min(1.0, spring_step()) && !(motion_.gap_rate(e.contact, e.watch) < -1e-9)) {
        h *= 0.1;
        return false;
      }
      found = e, h = 0;
      break;
    }
    h = instant(e, before, h);
    if (h < 0) {
      h *= -0.3;
      return false;
    }
    found = e;
  }
  return true;
}

bool Follower::slows_too_fast(double h) const {
  if (stiff_ || h < 1e-12) return false;
  for (int i = 0; i < count_; ++i) {
    const PathSpring& c = motion_.contact(i);
    if (!motion_.touches(i) || c.hold != Hold::slides) continue;
    const Eigen::Vector2d before = motion_.slip(motion_.y(), i), after = motion_.slip(motion_.end(), i);
    if (before.norm() <= stop_) continue;
    if (after.norm() < 0.04 * before.norm() || after.dot(before) < 0) {
      if (after.norm() > stop_) return true;
    }
  }
  return false;
}

// Which contacts at rest in their tangent planes stick, and how the others begin to slide. `pushed_over`: one that has
// just reached its cone's edge, or -1.
void Follower::decide_friction(int pushed_over) {
  std::vector<int> rest;
  for (int i = 0; i < count_; ++i) {
    PathSpring& c = motion_.contact(i);
    if (!motion_.touches(i)) continue;
    if (motion_.friction(i) == 0) {
      c.hold = Hold::slides;
      continue;
    }
    if (motion_.slip(motion_.y(), i).norm() > stop_) {
      c.hold = Hold::slides, c.direction = motion_.slip(motion_.y(), i).normalized();
      continue;
    }
    rest.push_back(i);
  }
  settle_at_rest(rest, pushed_over);
  motion_.prepare();
}

void Follower::settle_at_rest(const std::vector<int>& rest, int pushed_over) {
  if (rest.empty()) return;
  for (int i : rest) {
    PathSpring& c = motion_.contact(i);
    c.offset += motion_.slip(motion_.y(), i);  // what was left of its speed counts as none
    c.share.setZero();
  }
  const RestProblem r = motion_.at_rest(rest);
  const FrictionForces forces = friction_at_rest(r.A, r.b, r.radius);
  const double none = 1e-9 * (r.b.norm() + r.A.norm() * r.radius.norm());
  std::vector<int> sticking;
  for (std::size_t k = 0; k < rest.size(); ++k) {
    const auto at = 2 * static_cast<Eigen::Index>(k);
    PathSpring& c = motion_.contact(rest[k]);
    const Eigen::Vector2d force = forces.force.segment<2>(at), rate = forces.rate.segment<2>(at);
    const double radius = r.radius[static_cast<Eigen::Index>(k)];
    const double near = kEdge * radius + 1e-14 * motion_.friction(rest[k]) * motion_.y().head(count_).maxCoeff();
    const bool edge = rest[k] == pushed_over && !r.redundant && force.norm() >= radius - near;
    c.hold = rate.norm() > none || edge ? Hold::slides : Hold::sticks;
    if (c.hold == Hold::sticks) {
      sticking.push_back(rest[k]);
    } else {
      c.direction = force.norm() > 0 ? Eigen::Vector2d(-force.normalized()) : Eigen::Vector2d(rate.normalized());
    }
  }
  if (sticking.empty() || !r.redundant) return;
  // Redundant: some distribution of the forces holds; take the one that uses the cones least.
  motion_.prepare();
  const RestProblem again = motion_.at_rest(sticking);
  const StickShare share = least_used_cones(again.A, again.b, again.radius);
  for (std::size_t k = 0; k < sticking.size(); ++k) {
    const auto at = 2 * static_cast<Eigen::Index>(k);
    PathSpring& c = motion_.contact(sticking[k]);
    const double radius = again.radius[static_cast<Eigen::Index>(k)];
    const Eigen::Vector2d force = share.force.segment<2>(at);
    if (share.used > 1 - 1e-6 && sticking[k] == pushed_over && force.norm() > 0) {
      c.hold = Hold::slides, c.direction = -force.normalized();
    } else if (radius > 0) {
      c.share = force / radius;
    }
  }
}

// Whether a contact has come to rest in this step, or, in a stiff one, begun to slide.
bool Follower::came_to_rest() {
  bool any = false;
  for (int i = 0; i < count_; ++i) {
    const PathSpring& c = motion_.contact(i);
    if (!motion_.touches(i) || motion_.friction(i) == 0) continue;
    const Eigen::Vector2d before = motion_.slip(motion_.y(), i), after = motion_.slip(motion_.end(), i);
    if (c.hold == Hold::sticks) {
      any = any || (stiff_ && after.norm() > stop_);
      continue;
    }
    any = any || (before.norm() > stop_ && after.norm() <= stop_) ||
          (before.norm() <= stop_ && after.dot(c.direction) < -0.5 * stop_);
  }
  return any;
}

void Follower::note(int i, ContactMode mode) {
  std::vector<ContactMode>& modes = result_.modes[static_cast<std::size_t>(i)];
  if (modes.empty() || modes.back() != mode) modes.push_back(mode);
}

void Follower::note_modes() {
  for (int i = 0; i < count_; ++i) {
    const PathSpring& c = motion_.contact(i);
    if (!motion_.touches(i)) continue;
    const Eigen::Vector2d slip = motion_.slip(motion_.y(), i);
    if (c.hold == Hold::sticks || slip.norm() <= stop_) {
      if (c.hold == Hold::sticks) note(i, ContactMode::sticking);
      continue;
    }
    Eigen::Vector2d& first = first_slip_[static_cast<std::size_t>(i)];
    if (first.isZero()) first = slip.normalized();
    note(i, slip.dot(first) >= 0 ? ContactMode::sliding : ContactMode::reversed);
  }
}

// A contact about to stop must not be lost in the error: of how much of the tolerance there is left.
double Follower::tightness() const {
  double slowest = 1;
  for (int i = 0; i < count_; ++i) {
    if (!motion_.touches(i) || motion_.contact(i).hold != Hold::slides || motion_.friction(i) == 0) continue;
    const double speed = motion_.slip(motion_.y(), i).norm();
    if (speed > stop_) slowest = std::min(slowest, speed);
  }
  return std::clamp(0.01 * slowest / problem_.tolerance, 0.03, 1.0);
}

// The kind of the next step and its size: the stiff kind costs more and must go much further for that. It takes
// whatever has not yet died down of a turn of friction for done, so that only explicit steps may follow an event.
double Follower::choose_step() {
  const double explicit_step = std::min(step_, longest_step()), stiff_step = std::min(stiff_step_, spring_step());
  const bool worth = stiff_step > kWorthStiff * explicit_step;
  if (!worth) short_steps_ = 0;
  stiff_ = worth && short_steps_ >= kPatience;
  return stiff_ ? stiff_step : explicit_step;
}

// One accepted step, to an event at the latest.
void Follower::advance() {
  motion_.begin_step();
  double h = choose_step();
  const double tight = tightness();
  Event event;
  for (;;) {
    h = std::max(h, kSmallestStep);
    const double error = try_step(h) / (stiff_ ? 1 : tight);
    double& next = stiff_ ? stiff_step_ : step_;
    if (!(error <= 1) && h > kSmallestStep) {
      h *= std::isfinite(error) ? std::max(kShrink, 0.9 * std::pow(error, -1.0 / 8)) : 0.1;
      next = h;
      if (stiff_) h = choose_step();
      continue;
    }
    if (slows_too_fast(h)) {
      h *= 0.3;
      continue;
    }
    next = h * std::min(kGrowth, 0.9 * std::pow(std::max(error, 1e-16), -1.0 / 8));
    if (locate(event, h)) break;
  }
  if (!stiff_) ++short_steps_, stiff_step_ = std::min(1.5 * stiff_step_, 0.1);
  const bool at_rest = h > 0 && came_to_rest();
  if (h > 0) motion_.accept();
  note_modes();
  if (event.contact >= 0) {
    motion_.pass(event.contact, event.watch);
    if (!motion_.touches(event.contact)) note(event.contact, ContactMode::separated);
  }
  if (event.contact >= 0 || at_rest) {
    short_steps_ = 0;
    decide_friction(event.watch == Watch::cone ? event.contact : -1);
    step_ = std::max(step_, 1e-3);
    stiff_step_ = std::max(stiff_step_, 1e-3);
    note_modes();
  }
}

ContactPath Follower::finish() {
  motion_.fill(result_);
  for (std::vector<ContactMode>& modes : result_.modes) {
    if (modes.size() > 1 && modes.back() == ContactMode::separated) modes.pop_back();
    if (modes.empty()) modes.push_back(ContactMode::separated);
  }
  return std::move(result_);
}

ContactPath Follower::run() {
  if (!start()) return finish();
  decide_friction(-1);
  note_modes();
  for (; motion_.any_touching(); ++result_.steps) {
    // Errors of the steps feed a cascade that hardly decays: the longer it has lasted the more they are.
    if (motion_.rebounds_negligible(kNegligibleRebound * problem_.tolerance * (1 + result_.steps / kFeed))) break;
    if (result_.steps == problem_.most_steps || !motion_.y().allFinite()) {
      result_.failure = fmt::format("contacts did not part within {} steps of the inner time", result_.steps);
      break;
    }
    advance();
  }
  return finish();
}

}  // namespace

ContactPath follow_contacts(const ContactPathProblem& problem) { return Follower(problem).run(); }

// The step of PathMotion for contacts that slide slowly, come to rest or begin to slide: friction turns to its
// direction in a time of |u_t|/(mu f W), which no explicit method can follow, and several contacts can change between
// sticking and sliding at almost the same time. Friction is implicit and set-valued, a convex problem of all contacts
// in every substep (the time stepping of Moreau), so no such change need be located; extrapolated over the number of
// substeps to order kColumns where the step is smooth (Deuflhard's method; Hairer and Wanner, Solving Ordinary
// Differential Equations II, IV.9). Over a change the error is of second order in a step, which then becomes short.

namespace {
constexpr int kFewestColumns = 3, kColumns = static_cast<int>(PathMotion::kStiffColumns);
constexpr double kKink = 1e9;  // error reported where extrapolation does not help: the step must be much shorter
}  // namespace

// Contacts that touch and rub, and how their tangential velocities answer their friction.
void PathMotion::prepare_stiff() {
  rubbing_.clear();
  for (int i = 0; i < count_; ++i) {
    if (touches(i) && friction(i) > 0) rubbing_.push_back(i);
  }
  const Eigen::Index m = static_cast<Eigen::Index>(rubbing_.size());
  rub_.resize(2 * m, 2 * m), rub_rate_.resize(2 * m), rub_radius_.resize(m);
  for (Eigen::Index i = 0; i < m; ++i) {
    for (Eigen::Index j = 0; j < m; ++j) {
      rub_.block<2, 2>(2 * i, 2 * j) =
          W_.block<2, 2>(3 * rubbing_[static_cast<std::size_t>(i)] + 1, 3 * rubbing_[static_cast<std::size_t>(j)] + 1);
    }
  }
}

// One substep from y() + `increment`, in place: f_1 = f_0 + h f'(u_0), then friction with u_1 = u_0 + h W F, which is
// (11.5) with the velocities for the rates. `base`: u at y(). `l`: friction, a guess and the result. The work of
// friction is taken with u_1, that of normal forces with the mean.
void PathMotion::moreau(double h, const Eigen::VectorXd& base, PathState& increment, Eigen::VectorXd& l) {
  const int n = count_;
  u_ = base;
  u_.noalias() += W_ * increment.segment(n, 3 * n);
  force_.setZero(3 * n);
  for (int i = 0; i < n; ++i) {
    if (touches(i)) force_[3 * i] = y_[i] + increment[i] + h * force_rate(i, u_[3 * i]);
  }
  const Eigen::Index m = static_cast<Eigen::Index>(rubbing_.size());
  for (Eigen::Index k = 0; k < m; ++k) {
    const int i = rubbing_[static_cast<std::size_t>(k)];
    rub_rate_.segment<2>(2 * k) = u_.segment<2>(3 * i + 1) - contact(i).offset;
    rub_rate_.segment<2>(2 * k).noalias() += h * (W_.middleRows<2>(3 * i + 1) * force_);
    rub_radius_[k] = friction(i) * std::max(0.0, force_[3 * i]);
  }
  if (m > 0) l = friction_at_rest(h * rub_, rub_rate_, rub_radius_, l).force;
  for (Eigen::Index k = 0; k < m; ++k) {
    force_.segment<2>(3 * rubbing_[static_cast<std::size_t>(k)] + 1) = l.segment<2>(2 * k);
  }
  end_rate_.noalias() = h * (W_ * force_);
  increment.segment(n, 3 * n) += h * force_;
  for (int i = 0; i < n; ++i) {
    if (!touches(i)) continue;
    const double f = force_[3 * i], work = h * f * (u_[3 * i] + 0.5 * end_rate_[3 * i]);
    increment[i] = f - y_[i];
    if (contact(i).phase == NormalPhase::loading) increment[4 * n + i] += h * f, increment[5 * n + i] += work;
    increment[6 * n + i] += work;
    const Eigen::Vector2d u_t = u_.segment<2>(3 * i + 1) + end_rate_.segment<2>(3 * i + 1);
    increment[7 * n + i] += h * force_.segment<2>(3 * i + 1).dot(u_t);
  }
}

// What the forces did must be what the impulses did: an estimate that agreement of the columns cannot fool.
double PathMotion::unexplained(const Eigen::VectorXd& base, const PathState& increment) const {
  const auto impulse = increment.segment(count_, 3 * count_);
  return std::abs(impulse.dot(base + 0.5 * (W_ * impulse)) - increment.tail(2 * count_).sum()) / problem_.tolerance;
}

double PathMotion::try_stiff_step(double h) {
  prepare_stiff();
  forces(y_, u_, force_);
  Eigen::VectorXd first(2 * static_cast<Eigen::Index>(rubbing_.size()));
  for (std::size_t k = 0; k < rubbing_.size(); ++k) {
    first.segment<2>(2 * static_cast<Eigen::Index>(k)) = force_.segment<2>(3 * rubbing_[k] + 1);
  }
  // Increments, not states, are extrapolated: their rounding is small where the step is. Aitken and Neville: row j
  // holds the results of 1, 2, ..., j + 1 substeps extrapolated.
  const Eigen::VectorXd base = before_ + W_ * y_.segment(count_, 3 * count_);
  std::array<PathState, kStiffColumns> row;
  Eigen::VectorXd l;
  double error = std::numeric_limits<double>::infinity();
  for (int j = 0; j < kColumns; ++j) {
    PathState y = PathState::Zero(y_.size());
    l = first;
    for (int k = 0; k <= j; ++k) moreau(h / (j + 1), base, y, l);
    for (int m = 1; m <= j; ++m) {
      PathState& last = row[static_cast<std::size_t>(m - 1)];
      difference_ = (y - last) / ((j + 1.0) / (j + 1 - m) - 1);
      last = y;
      y += difference_;
    }
    row[static_cast<std::size_t>(j)] = y;
    if (j == 0) continue;
    difference_ = y - row[static_cast<std::size_t>(j - 1)];
    const double now = error_size(difference_);
    end_ = y_ + y;
    if (j + 1 >= kFewestColumns && now <= 1) return std::max(now, unexplained(base, y));
    if (j + 1 > kFewestColumns && now > 0.5 * error) return kKink;
    error = now;
  }
  return error;
}

}  // namespace grapnel
