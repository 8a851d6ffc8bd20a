#include "grapnel/impact/contact_path.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "grapnel/impact/contact_path_motion.hpp"
#include "grapnel/impact/friction_at_rest.hpp"

namespace grapnel {

namespace {

constexpr double kGrowth = 6, kShrink = 0.2;
constexpr double kWorthStiff = 30;  // required length of a stiff step relative to an explicit one
constexpr int kPatience = 40;       // number of very short explicit steps before a stiff one is tried
constexpr double kSmallestStep = 1e-13;
constexpr double kStop = 1e-12;   // fraction of the approach speed below which a contact is at rest
constexpr double kEdge = 1e-10;   // relative distance from the cone's edge below which a friction force is on it
constexpr double kAtOnce = 1e-4;  // an event in so short a step counts as one at its start
constexpr double kNegligibleRebound = 50;  // times the tolerance: remaining forces and velocities of an endless cascade
constexpr double kFeed = 1000;             // steps after which the remaining amount is doubled
constexpr double kLawMissed = 1e-9;        // residual of friction at rest, relative to its input; measured 1e-14
constexpr int kMostCrawls = 2000;          // maximum number of slow solutions: half a second for five contacts
constexpr double kSlowdown = 0.9;          // maximum fraction of its speed that a sliding contact loses in a step

// An event that ends a step early.
struct Event {
  int contact = -1;
  Watch watch = Watch::velocity;
};

// One path as a state machine: it requests an explicit step, and continues when the step has been tried, so that steps
// of several paths are tried together. It makes stiff steps itself.
class Follower {
 public:
  explicit Follower(const ContactPathProblem& problem) : problem_(problem), motion_(problem), count_(motion_.count()) {
    result_.modes.resize(static_cast<std::size_t>(count_));
    first_slip_.assign(static_cast<std::size_t>(count_), Eigen::Vector2d::Zero());
    small_ = std::max(1e-14, 4 * motion_.rounding());
    stop_ = std::max(kStop, 10 * motion_.rounding());
  }

  /// Runs to the first explicit step, or to the path's end.
  void begin();
  bool done() const { return done_; }
  bool failed() const { return !result_.failure.empty(); }
  /// Abandons the path, unless it is done.
  void give_up() {
    if (!done_) result_.failure = "not followed to its end: the first path failed";
    done_ = true;
  }
  /// Writes the next step into a lane; call after begin(), unless done, and for each step.
  void enter(const PathLanes& lanes, int lane) { motion_.enter(lanes, lane); }
  void put(const PathLanes& lanes, int lane) { motion_.put(lanes, lane, size_); }
  /// The step was tried: runs to the next one, or to the path's end.
  void take(const PathLanes& lanes, int lane) {
    judge(motion_.take(lanes, lane));
    go_on();
  }
  ContactPath finish();

 private:
  bool start();
  void go_on();
  void begin_step();
  void judge(double error);
  bool passes(double error);
  void try_again(double h);
  void seek(const Event& event, double before);
  bool look();
  bool found();
  void end_step();
  double spring_step() const;
  double longest_step() const;
  double choose_step();
  double tightness() const;
  double bound(Watch watch) const { return watch == Watch::cone ? 1e-11 : small_; }
  Event event_in_step(const Event& but) const;
  bool slows_too_fast(double h) const;
  void decide_friction(int pushed_over);
  void settle_at_rest(const std::vector<int>& rest, int pushed_over);
  bool came_to_rest();
  void note_modes();
  void note(int i, ContactMode mode);

  const ContactPathProblem& problem_;
  PathMotion motion_;
  int count_;
  ContactPath result_;
  std::vector<Eigen::Vector2d> first_slip_;
  double small_, stop_;
  double step_ = 1e-2, stiff_step_ = 1e-2;
  bool stiff_ = false;  // kind of the tried step
  int short_steps_ = 0;
  bool done_ = false;

  // The step being tried.
  double size_ = 0;    // of the try
  double length_ = 0;  // of the step: an event in it can be earlier
  double tightness_ = 1;
  Event event_;     // that ends it
  int rounds_ = 0;  // of the search for events
  // Search for the instant of an event: Illinois method, one step per value.
  bool seeking_ = false;
  Event sought_;
  double low_ = 0, high_ = 0, gap_low_ = 0, gap_high_ = 0, gap_ = 0, at_ = 0;
  int side_ = 0, looks_ = 0;
};

bool Follower::start() {
  bool any = false;
  for (int i = 0; i < count_; ++i) {
    if (motion_.normal_velocity(motion_.now(), i) >= -small_) continue;
    motion_.contact(i).phase = NormalPhase::loading;
    any = true;
  }
  return any;
}

// A fraction of the fastest spring's period, so that no spring turns twice in a step; sliding must not end in it.
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
    const Eigen::Vector2d s = motion_.slip(motion_.now(), i);
    const double speed = s.norm();
    if (speed <= stop_) continue;
    const double slowing = -s.dot(motion_.slip_rate(i)) / speed;
    if (slowing > 0) h = std::min(h, kSlowdown * speed / slowing);
  }
  return h;
}

// An event in the tried step, other than `but`.
Event Follower::event_in_step(const Event& but) const {
  for (int i = 0; i < count_; ++i) {
    for (Watch watch : {Watch::velocity, Watch::release, Watch::cone}) {
      if ((but.contact == i && but.watch == watch) || !motion_.watches(i, watch)) continue;
      if (stiff_ && watch == Watch::cone) continue;  // this step does not need the instant
      if (motion_.gap(motion_.end(), i, watch) < -bound(watch)) return {i, watch};
    }
  }
  return {};
}

bool Follower::slows_too_fast(double h) const {
  if (stiff_ || h < 1e-12) return false;
  for (int i = 0; i < count_; ++i) {
    const PathSpring& c = motion_.contact(i);
    if (!motion_.touches(i) || c.hold != Hold::slides) continue;
    const Eigen::Vector2d before = motion_.slip(motion_.now(), i), after = motion_.slip(motion_.end(), i);
    if (before.norm() <= stop_) continue;
    if (after.norm() < 0.04 * before.norm() || after.dot(before) < 0) {
      if (after.norm() > stop_) return true;
    }
  }
  return false;
}

// Decides which contacts at rest in their tangent planes stick, and how the others begin to slide. `pushed_over`: one
// that has just reached its cone's edge, or -1.
void Follower::decide_friction(int pushed_over) {
  std::vector<int> rest;
  for (int i = 0; i < count_; ++i) {
    PathSpring& c = motion_.contact(i);
    if (!motion_.touches(i)) continue;
    if (motion_.friction(i) == 0) {
      c.hold = Hold::slides;
      continue;
    }
    if (motion_.slip(motion_.now(), i).norm() > stop_) {
      c.hold = Hold::slides, c.direction = motion_.slip(motion_.now(), i).normalized();
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
    c.offset += motion_.slip(motion_.now(), i);  // its remaining speed counts as zero
    c.share.setZero();
  }
  const RestProblem r = motion_.at_rest(rest);
  const FrictionForces forces = friction_at_rest(r.mobility.A, r.b, r.radius);
  motion_.count(forces);
  const double none = 1e-9 * (r.b.norm() + r.mobility.A.norm() * r.radius.norm());
  std::vector<int> sticking;
  for (std::size_t k = 0; k < rest.size(); ++k) {
    const auto at = 2 * static_cast<Eigen::Index>(k);
    PathSpring& c = motion_.contact(rest[k]);
    const Eigen::Vector2d force = forces.force.segment<2>(at), rate = forces.rate.segment<2>(at);
    const double radius = r.radius[static_cast<Eigen::Index>(k)];
    const double near = kEdge * radius + 1e-14 * motion_.friction(rest[k]) * motion_.now().y.head(count_).maxCoeff();
    const bool edge = rest[k] == pushed_over && !r.mobility.redundant && force.norm() >= radius - near;
    c.hold = rate.norm() > none || edge ? Hold::slides : Hold::sticks;
    if (c.hold == Hold::sticks) {
      sticking.push_back(rest[k]);
    } else {
      c.direction = force.norm() > 0 ? Eigen::Vector2d(-force.normalized()) : Eigen::Vector2d(rate.normalized());
    }
  }
  if (sticking.empty() || !r.mobility.redundant) return;
  // Redundant: some distribution of the forces satisfies the cones; take the one with minimum use of the cones.
  const RestProblem again = motion_.at_rest(sticking);
  const StickShare share = least_used_cones(again.mobility.A, again.b, again.radius);
  motion_.count(share);
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
    const Eigen::Vector2d before = motion_.slip(motion_.now(), i), after = motion_.slip(motion_.end(), i);
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
    const Eigen::Vector2d slip = motion_.slip(motion_.now(), i);
    if (c.hold == Hold::sticks || slip.norm() <= stop_) {
      if (c.hold == Hold::sticks) note(i, ContactMode::sticking);
      continue;
    }
    Eigen::Vector2d& first = first_slip_[static_cast<std::size_t>(i)];
    if (first.isZero()) first = slip.normalized();
    note(i, slip.dot(first) >= 0 ? ContactMode::sliding : ContactMode::reversed);
  }
}

// The error must not hide that a contact is about to stop: returns the usable fraction of the tolerance.
double Follower::tightness() const {
  double slowest = 1;
  for (int i = 0; i < count_; ++i) {
    if (!motion_.touches(i) || motion_.contact(i).hold != Hold::slides || motion_.friction(i) == 0) continue;
    const double speed = motion_.slip(motion_.now(), i).norm();
    if (speed > stop_) slowest = std::min(slowest, speed);
  }
  return std::clamp(0.01 * slowest / problem_.tolerance, 0.03, 1.0);
}

// Chooses the kind of the next step and its size: the stiff kind costs more and must be correspondingly longer. It
// treats transients of a change of friction as decayed, so that only explicit steps may follow an event.
double Follower::choose_step() {
  const double explicit_step = std::min(step_, longest_step()), stiff_step = std::min(stiff_step_, spring_step());
  const bool worth = stiff_step > kWorthStiff * explicit_step;
  if (!worth) short_steps_ = 0;
  stiff_ = worth && short_steps_ >= kPatience;
  return stiff_ ? stiff_step : explicit_step;
}

void Follower::begin() {
  done_ = !start();
  if (done_) return;
  decide_friction(-1);
  note_modes();
  begin_step();
  go_on();
}

void Follower::go_on() {
  while (!done_ && stiff_) judge(motion_.try_stiff_step(size_));
}

void Follower::begin_step() {
  done_ = true;
  if (!motion_.now().y.allFinite()) {
    result_.failure = "the impulses are not finite";
    return;
  }
  // Errors of the steps feed a cascade that barely decays: the bound grows with its length.
  const double negligible = kNegligibleRebound * problem_.tolerance * (1 + result_.steps / kFeed);
  const bool is_over = !motion_.any_touching() || motion_.rebounds_negligible(negligible);
  const PathMotion::Wedge wedge = is_over ? PathMotion::Wedge::none : motion_.wedged(negligible);
  // Reports the friction residual, however the path ends.
  if (motion_.violates_law() > kLawMissed) {
    result_.failure =
        fmt::format("friction of contacts at rest violates Coulomb's law by {:.1e}, relative to the driving rates",
                    motion_.violates_law());
    return;
  }
  if (is_over || wedge == PathMotion::Wedge::at_rest) return;
  if (wedge == PathMotion::Wedge::ever_harder) {
    result_.failure = "bodies are wedged at rest, and the forces that separate them grow without bound";
    return;
  }
  if (motion_.crawled() > kMostCrawls) {
    result_.failure = fmt::format(
        "friction of redundant contacts took the interior-point method {} times within {} steps of the inner time",
        motion_.crawled(), result_.steps);
    return;
  }
  if (result_.steps == problem_.most_steps) {
    result_.failure = fmt::format("contacts did not part within {} steps of the inner time", result_.steps);
    return;
  }
  done_ = false;
  motion_.begin_step();
  tightness_ = tightness();
  try_again(choose_step());
}

void Follower::try_again(double h) {
  seeking_ = false;
  size_ = length_ = std::max(h, kSmallestStep);
}

// Evaluates the tried step: another try, a search for an event in it, or the next step.
void Follower::judge(double error) {
  if (seeking_) {
    // A step of this size can fail although the longer one passed, because of a change of friction.
    if (!(error <= 1) && stiff_) return try_again(0.3 * at_);
    if (!found()) return;
  } else {
    if (!passes(error)) return;
    event_ = {};
    rounds_ = 0;
  }
  // Finds the first of the events in the step; each found event shortens it.
  for (; rounds_ < 3 * count_ + 3; ++rounds_) {
    const Event e = event_in_step(event_);
    if (e.contact < 0) break;
    const double before = motion_.gap(motion_.now(), e.contact, e.watch);
    if (before > bound(e.watch)) {
      ++rounds_;
      return seek(e, before);
    }
    // It was at its event when the step began and has crossed: immediately, or by a reversal within the step.
    if (length_ > kAtOnce * std::min(1.0, spring_step()) && !(motion_.gap_rate(e.contact, e.watch) < -1e-9))
      return try_again(0.1 * length_);
    event_ = e, length_ = 0;
    break;
  }
  end_step();
  begin_step();
}

// Whether the tried step is accurate enough; sets the size of the next.
bool Follower::passes(double error) {
  if (!stiff_) error /= tightness_;
  double& next = stiff_ ? stiff_step_ : step_;
  double h = length_;
  if (!(error <= 1) && h > kSmallestStep) {
    h *= std::isfinite(error) ? std::max(kShrink, 0.9 * std::pow(error, -1.0 / 8)) : 0.1;
    next = h;
    try_again(stiff_ ? choose_step() : h);
    return false;
  }
  if (slows_too_fast(h)) {
    try_again(0.3 * h);
    return false;
  }
  next = h * std::min(kGrowth, 0.9 * std::pow(std::max(error, 1e-16), -1.0 / 8));
  return true;
}

// Begins the search for the instant of an event in the tried step; `before`: its gap at the beginning.
void Follower::seek(const Event& event, double before) {
  seeking_ = true;
  sought_ = event;
  low_ = 0, high_ = at_ = length_;
  gap_low_ = before, gap_high_ = gap_ = motion_.gap(motion_.end(), event.contact, event.watch);
  side_ = 0, looks_ = 0;
  look();
}

// Requests the next try; false if the instant is found: that of the last.
bool Follower::look() {
  if (looks_ == 100 || !(std::abs(gap_) > 0.1 * bound(sought_.watch)) || !(high_ - low_ > 1e-16 * length_))
    return false;
  at_ = looks_ % 8 == 7 ? 0.5 * (low_ + high_) : (low_ * gap_high_ - high_ * gap_low_) / (gap_high_ - gap_low_);
  ++looks_;
  size_ = at_;
  return true;
}

// Evaluates the try at at_; true if the step now ends there, at the event.
bool Follower::found() {
  gap_ = motion_.gap(motion_.end(), sought_.contact, sought_.watch);
  const int now = gap_ > 0 ? 1 : -1;
  (now > 0 ? low_ : high_) = at_;
  (now > 0 ? gap_low_ : gap_high_) = gap_;
  if (side_ == now) (now > 0 ? gap_high_ : gap_low_) *= 0.5;
  side_ = now;
  if (look()) return false;
  seeking_ = false;
  length_ = at_;
  event_ = sought_;
  return true;
}

// Ends the step at its last try.
void Follower::end_step() {
  if (!stiff_) ++short_steps_, stiff_step_ = std::min(1.5 * stiff_step_, 0.1);
  const bool at_rest = length_ > 0 && came_to_rest();
  if (length_ > 0) motion_.accept();
  note_modes();
  if (event_.contact >= 0) {
    motion_.pass(event_.contact, event_.watch);
    if (!motion_.touches(event_.contact)) note(event_.contact, ContactMode::separated);
  }
  if (event_.contact >= 0 || at_rest) {
    short_steps_ = 0;
    decide_friction(event_.watch == Watch::cone ? event_.contact : -1);
    step_ = std::max(step_, 1e-3);
    stiff_step_ = std::max(stiff_step_, 1e-3);
    note_modes();
  }
  ++result_.steps;
}

ContactPath Follower::finish() {
  motion_.fill(result_);
  for (std::vector<ContactMode>& modes : result_.modes) {
    if (modes.size() > 1 && modes.back() == ContactMode::separated) modes.pop_back();
    if (modes.empty()) modes.push_back(ContactMode::separated);
  }
  return std::move(result_);
}

}  // namespace

std::vector<ContactPath> follow_contacts(std::span<const ContactPathProblem> problems,
                                         std::optional<lanes::InstructionSet> set, OtherPaths others) {
  if (problems.empty()) return {};
  const std::size_t contacts = problems[0].contacts.size();
  std::vector<Follower> paths;
  paths.reserve(problems.size());
  for (const ContactPathProblem& problem : problems) {
    if (problem.contacts.size() != contacts)
      throw std::invalid_argument("follow_contacts: paths have different numbers of contacts");
    paths.emplace_back(problem).begin();
  }
  const std::unique_ptr<PathSteps> steps =
      make_path_steps(set, static_cast<int>(contacts), static_cast<int>(problems.size()));
  const PathLanes& lanes = steps->lanes;
  // A lane whose path is done takes the next unfinished one; if none is left it makes steps of size zero.
  std::vector<Follower*> in_lane(static_cast<std::size_t>(lanes.width), nullptr);
  auto next = paths.begin();
  for (;;) {
    if (others == OtherPaths::if_first_ends && paths[0].failed()) {
      for (Follower& path : paths) path.give_up();
    }
    bool any = false;
    for (int l = 0; l < lanes.width; ++l) {
      Follower*& path = in_lane[static_cast<std::size_t>(l)];
      if (path != nullptr && path->done()) path = nullptr, lanes.size[l] = 0;
      if (path == nullptr) {
        next = std::find_if(next, paths.end(), [](const Follower& p) { return !p.done(); });
        if (next == paths.end()) continue;
        path = &*next++;
        path->enter(lanes, l);
      }
      path->put(lanes, l);
      any = true;
    }
    if (!any) break;
    steps->try_all();
    for (int l = 0; l < lanes.width; ++l) {
      if (Follower* const path = in_lane[static_cast<std::size_t>(l)]) path->take(lanes, l);
    }
  }
  std::vector<ContactPath> results;
  for (Follower& path : paths) results.push_back(path.finish());
  return results;
}

ContactPath follow_contacts(const ContactPathProblem& problem) {
  return std::move(follow_contacts(std::span(&problem, 1))[0]);
}

}  // namespace grapnel
