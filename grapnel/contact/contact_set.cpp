#include "grapnel/contact/contact_set.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "grapnel/contact/contact_chain.hpp"
#include "grapnel/dynamics/kinematics.hpp"

namespace grapnel {

namespace {

// A pair closer than this is at the boundary of its mode, and its velocity decides [m].
constexpr double kGrazing = 1e-13;

// The gap at which a hard pair closes at a time after its impact, which returns to zero at half the rest speed, more
// slowly than the gap opens [m].
double level_at(double level, double time, double rest_speed) { return std::min(0.0, level + 0.5 * rest_speed * time); }

MovingBody motion_of(int body, const Kinematics& kinematics) {
  if (body < 0) return {Posed::identity(), Twistd::zero()};
  return {kinematics.X_WB[body], kinematics.V_WB[body]};
}
Posed pose_of(int body, const Kinematics& kinematics) { return body < 0 ? Posed::identity() : kinematics.X_WB[body]; }

double power_of(int body, const Vector3d& p_WC, const Wrenchd& F, const Kinematics& kinematics) {
  if (body < 0) return 0;
  return dot(F, shift(kinematics.V_WB[body], p_WC - kinematics.X_WB[body].p));
}

}  // namespace

ContactSet::ContactSet(const std::vector<ContactSurface>& surfaces, const std::vector<SurfacePair>& pairs, int groups)
    : groups_(groups), histories_(groups), touching_(groups, 0) {
  const int count = static_cast<int>(surfaces.size());
  for (const SurfacePair& pair : pairs) {
    if (pair.a < 0 || pair.b < 0 || pair.a >= count || pair.b >= count)
      throw std::invalid_argument("ContactSet: no surface has this index");
    if (pair.group < 0 || pair.group >= groups) throw std::invalid_argument("ContactSet: no group has this index");
    const ContactSurface &a = surfaces[pair.a], &b = surfaces[pair.b];
    if (a.body == b.body) throw std::invalid_argument("ContactSet: both surfaces of a pair are on one body");
    pairs_.push_back({a.body, b.body, pair.group, PairContact(a.shape, b.shape, pair.law)});
    if (a.chain || b.chain) {
      const ContactSurface& other = a.chain ? b : a;
      if (other.chain || other.shape.kind() != ContactShape::Kind::sphere)
        throw std::invalid_argument("ContactSet: a flexible link meets another shape than a sphere");
      Pair& of_link = pairs_.back();
      of_link.chain = a.chain ? a.chain : b.chain, of_link.chain_is_a = a.chain != nullptr;
      of_link.p_BC = other.shape.X_BC().p;
    }
    any_hard_ = any_hard_ || pair.law.hard;
  }
}

// --- Flexible links ---

ChainMotion ContactSet::chain_motion(const Pair& pair, const Kinematics& kinematics) {
  const MovingBody ball = motion_of(pair.chain_is_a ? pair.body_b : pair.body_a, kinematics);
  const Vector3d p_WC = ball.X_WB * pair.p_BC;
  return {*pair.chain, kinematics, p_WC, shift(ball.V_WB, p_WC - ball.X_WB.p).linear};
}

// Of both surfaces' frames: bodies, or a flexible link as it acts on the other surface.
std::pair<MovingBody, MovingBody> ContactSet::motions_of(const Pair& pair, const Kinematics& kinematics) {
  if (!pair.chain) return {motion_of(pair.body_a, kinematics), motion_of(pair.body_b, kinematics)};
  const MovingBody link = chain_motion(pair, kinematics).link();
  if (pair.chain_is_a) return {link, motion_of(pair.body_b, kinematics)};
  return {motion_of(pair.body_a, kinematics), link};
}

std::pair<Posed, Posed> ContactSet::poses_of(const Pair& pair, const Kinematics& kinematics) {
  if (!pair.chain) return {pose_of(pair.body_a, kinematics), pose_of(pair.body_b, kinematics)};
  const auto [a, b] = motions_of(pair, kinematics);
  return {a.X_WB, b.X_WB};
}

std::vector<std::pair<int, int>> ContactSet::all_bodies_of(std::size_t pair) const {
  const Pair& p = pairs_[pair];
  if (!p.chain) return {bodies_of(pair)};
  std::vector<std::pair<int, int>> all;
  for (const ContactChain::Piece& piece : p.chain->pieces)
    all.emplace_back(p.chain_is_a ? piece.body : p.body_a, p.chain_is_a ? p.body_b : piece.body);
  return all;
}

std::size_t ContactSet::most_wrenches() const {
  std::size_t count = 0;
  for (const Pair& pair : pairs_) count += pair.chain ? 4 : 2;
  return count;
}

// The force of a pair => forces between bodies.
void ContactSet::spread(Pair& pair, const ContactForce& force, const Kinematics& kinematics) {
  if (!pair.chain) {
    pair.acting[0] = {pair.body_a, pair.body_b, force.p_WC, force.on_b}, pair.acting_count = 1;
    return;
  }
  const ChainMotion motion = chain_motion(pair, kinematics);
  const Posed X_WB = pose_of(pair.chain_is_a ? pair.body_b : pair.body_a, kinematics);
  const Vector3d p_WC = X_WB * pair.p_BC;
  const Wrenchd on_sphere = shift(pair.chain_is_a ? force.on_b : force.on_a, p_WC - force.p_WC);
  pair.acting_count = 0;
  for (const ChainMotion::Part& part : motion.parts(on_sphere)) {
    if (part.body < 0) continue;
    const int body_a = pair.chain_is_a ? part.body : pair.body_a, body_b = pair.chain_is_a ? pair.body_b : part.body;
    pair.acting[pair.acting_count++] = {body_a, body_b, p_WC, pair.chain_is_a ? part.on_sphere : -part.on_sphere};
  }
}

// --- Modes ---

// Apart: the gap, or a lower bound by bounding spheres. Otherwise the overlap. Hard pairs
// close at a level that returns to zero after an impact, and touch up to kPartingGap.
double ContactSet::margin_of(Pair& pair, double t, const Kinematics& kinematics) {
  const auto [X_WA, X_WB] = poses_of(pair, kinematics);
  if (pair.mode == Mode::apart) {
    const double bound = pair.contact.gap_bound(X_WA, X_WB);
    const double gap = bound > 0 ? bound : pair.contact.gap(X_WA, X_WB);
    return pair.is_hard() ? gap - level_at(pair.hard.level, t - pair.hard.level_time, pair.contact.law().rest_speed)
                          : gap;
  }
  const double overlap = pair.contact.overlap(X_WA, X_WB);
  return pair.is_hard() && pair.mode == Mode::touching ? kPartingGap + overlap : overlap;
}

// Whether the surfaces of a pair at the boundary of its mode move apart.
bool ContactSet::parts(const Pair& pair, const Kinematics& kinematics) const {
  const auto [a, b] = motions_of(pair, kinematics);
  const ShapeSeparation s = pair.contact.separation(a.X_WB, b.X_WB);
  const Vector3d v_a = shift(a.V_WB, s.point_a - a.X_WB.p).linear, v_b = shift(b.V_WB, s.point_b - b.X_WB.p).linear;
  return dot(v_b - v_a, s.normal) > 0;
}

// The mode of a pair whose present mode has this margin. A pair that touches without overlap has no force, so it counts
// as touching unless it moves apart.
ContactSet::Mode ContactSet::mode_after(const Pair& pair, double margin, const Kinematics& kinematics) const {
  const bool is_apart = pair.mode == Mode::apart;
  if (!pair.is_hard() && std::abs(margin) <= kGrazing) return parts(pair, kinematics) ? Mode::apart : Mode::touching;
  if (margin > 0) return pair.mode;
  return is_apart ? Mode::touching : Mode::apart;
}

void ContactSet::set_mode(Pair& pair, Mode mode, double t) {
  if (pair.mode == mode) return;
  GroupHistory& history = histories_[pair.group];
  int& touching = touching_[pair.group];
  if (pair.mode == Mode::touching && --touching == 0) {
    history.duration += t - *history.since;
    history.since.reset();
  }
  if (mode == Mode::touching && touching++ == 0) {
    ++history.touches;
    history.since = t;
    if (!history.first_time) history.first_time = t;
    if (pair.is_hard() && !history.persistent_since) history.persistent_since = t;
  }
  if (mode == Mode::touching) {  // undeformed at first
    pair.base.slip += pair.stick.slip, pair.base.spin += pair.stick.spin;
    pair.stick = {};
  }
  pair.mode = mode;
}

void ContactSet::begin(double t, const Kinematics& kinematics) {
  for (Pair& pair : pairs_) {
    if (pair.mode != Mode::unknown) continue;
    if (pair.is_hard()) {
      part(pair, t, kinematics);
      continue;
    }
    pair.mode = Mode::apart;
    set_mode(pair, mode_after(pair, margin_of(pair, t, kinematics), kinematics), t);
  }
}

void ContactSet::take(const ContactSet& other) {
  if (other.size() != size() || other.groups() != groups())
    throw std::invalid_argument("ContactSet: the other set has other pairs");
  for (std::size_t i = 0; i < size(); ++i) {
    pairs_[i].mode = other.pairs_[i].mode, pairs_[i].stick = other.pairs_[i].stick;
    pairs_[i].base = other.pairs_[i].base, pairs_[i].hard = other.pairs_[i].hard;
  }
  histories_ = other.histories_, touching_ = other.touching_;
}

void ContactSet::let_pass(int group, const Kinematics& kinematics, double t, bool but_touching) {
  for (Pair& pair : pairs_) {
    if (pair.group != group || (but_touching && pair.mode == Mode::touching)) continue;
    set_mode(pair, Mode::apart, t);
    pair.hard.level = 0;
    if (!(margin_of(pair, t, kinematics) > 0)) pair.mode = Mode::passing;
  }
}

double ContactSet::margin(double t, const Kinematics& kinematics) {
  double least = std::numeric_limits<double>::infinity();
  for (Pair& pair : pairs_) {
    if (pair.watched) least = std::min(least, margin_of(pair, t, kinematics));
  }
  return least;
}

// `duration`: of the longer one of the steps that end and begin here. Pairs beyond the reach of both need neither
// distance nor margin.
ContactSet::Clearance ContactSet::clearance_of(Pair& pair, const Kinematics& kinematics, double duration) {
  Clearance at;
  if (pair.mode == Mode::unknown) return at;
  const bool apart = pair.mode == Mode::apart, touching = pair.mode == Mode::touching;
  const auto [a, b] = motions_of(pair, kinematics);
  const double level = pair.is_hard() && touching ? kPartingGap : 0;
  if (apart) {
    at.gap = pair.contact.gap_bound(a.X_WB, b.X_WB), at.speed = pair.contact.speed_bound(a, b);
    at.between = pair.contact.between_centers(a.X_WB, b.X_WB);
    if (at.gap > kFaster * at.speed * duration) return at;
    at.gap = std::max(at.gap, pair.contact.gap(a.X_WB, b.X_WB));  // the bound of neighbours may be far below
    if (pair.is_hard()) return at;
  }
  at.is_smooth = pair.contact.has_sphere();
  if (at.is_smooth) {
    const PairContact::SphereGap s = pair.contact.sphere_gap(a, b);
    at.margin = apart ? s.gap : level - s.gap, at.rate = apart ? s.rate : -s.rate;
  }
  if (!apart) {
    at.gap = at.is_smooth ? at.margin : level + pair.contact.overlap(a.X_WB, b.X_WB);
    at.speed = at.is_smooth ? std::abs(at.rate) : pair.contact.overlap_speed(a, b);
    if (!touching) at.speed = std::max(at.speed, pair.contact.speed_bound(a, b));  // deep: few points are in contact
  }
  return at;
}

void ContactSet::begin_step(const Kinematics& kinematics, double duration) {
  for (Pair& pair : pairs_) {
    pair.watched = true;
    pair.at_begin = clearance_of(pair, kinematics, duration);
  }
}

namespace {

// Margin, rate away from an end of the step, and the largest acceleration towards zero => the time until zero, if all
// of them are the worst; infinite if never.
double time_until_zero(double margin, double rate, double acceleration) {
  const double m = std::max(margin, 0.0);
  if (acceleration > 0) return (rate + std::sqrt(rate * rate + 2 * acceleration * m)) / acceleration;
  return rate < 0 ? -m / rate : std::numeric_limits<double>::infinity();
}

}  // namespace

// Whether a pair may leave its mode in a step, by velocities: a margin that falls from the value at the begin and rises
// to that at the end, both at the greatest rate, is the least possible one. By accelerations: the same with the rates
// at both ends, and the largest of three means of the acceleration: over the step, and weighted at each end.
bool ContactSet::may_change(const Clearance& begin, const Clearance& end, double duration, bool overlaps,
                            double prescribed_travel) {
  const double change = overlaps ? std::abs(end.gap - begin.gap) : norm(end.between - begin.between);
  const double travel = std::max(std::max(begin.speed, end.speed) * duration, change);
  if (begin.gap > 0 && end.gap > 0 && begin.gap + end.gap > kFaster * travel + prescribed_travel) return false;
  if (prescribed_travel > 0 || !begin.is_smooth || !end.is_smooth || !(end.margin > 0) || !(begin.margin > -kGrazing))
    return true;
  if (!(begin.margin > kGrazing || begin.rate > 0)) return true;
  const double mean = (end.margin - begin.margin) / duration;
  const double acceleration =
      kFaster / duration *
      std::max({std::abs(end.rate - begin.rate), 2 * std::abs(mean - begin.rate), 2 * std::abs(end.rate - mean)});
  return !(time_until_zero(begin.margin, begin.rate, acceleration) +
               time_until_zero(end.margin, -end.rate, acceleration) >
           duration);
}

double ContactSet::reach_of(int body) const {
  double reach = 0;
  for (const Pair& pair : pairs_) {
    if (pair.body_a != body && pair.body_b != body) continue;
    if (pair.chain) return std::numeric_limits<double>::infinity();
    reach = std::max(reach, pair.contact.reach_of(pair.body_b == body));
  }
  return reach;
}

bool ContactSet::end_step(const Kinematics& kinematics, double duration, double prescribed_travel, double next) {
  bool any = false;
  for (Pair& pair : pairs_) {
    const Clearance end = clearance_of(pair, kinematics, std::max(duration, next));
    pair.watched = may_change(pair.at_begin, end, duration, pair.mode != Mode::apart, prescribed_travel);
    pair.at_begin = end;
    any = any || pair.watched;
  }
  return any;
}

bool ContactSet::may_part(double duration) const {
  constexpr double kFewSteps = 4;
  return std::any_of(pairs_.begin(), pairs_.end(), [&](const Pair& pair) {
    const Clearance& at = pair.at_begin;
    const double fall = at.is_smooth ? std::max(0.0, -at.rate) : at.speed;
    return pair.mode == Mode::touching && at.gap < kFewSteps * duration * fall;
  });
}

double ContactSet::least_overlap(const Kinematics& kinematics) {
  double least = std::numeric_limits<double>::infinity();
  for (Pair& pair : pairs_) {
    if (pair.mode != Mode::touching) continue;
    const auto [X_WA, X_WB] = poses_of(pair, kinematics);
    least = std::min(least, pair.contact.overlap(X_WA, X_WB));
  }
  return least;
}

void ContactSet::choose_modes(double t, const Kinematics& kinematics) {
  for (Pair& pair : pairs_) {
    const Mode mode = mode_after(pair, margin_of(pair, t, kinematics), kinematics);
    if (pair.is_hard() && mode == Mode::apart && pair.mode != Mode::apart)
      part(pair, t, kinematics);
    else
      set_mode(pair, mode, t);
  }
}

// --- Forces ---

void ContactSet::add_to_group(const Pair& pair, const ContactForce& force, const Vector3d& force_on_b, double power) {
  GroupContact& group = groups_[pair.group];
  group.touches = true;
  group.beyond_model = group.beyond_model || force.beyond_model;
  group.p_WC += force.normal_force * force.p_WC;
  group.force_on_b += force_on_b;
  group.normal_force += force.normal_force;
  group.depth = std::max(group.depth, force.depth);
  group.slip_speed = std::max(group.slip_speed, force.slip_speed);
  group.friction_use = std::max(group.friction_use, force.friction_use);
  group.damping_power += force.damping_power, group.friction_power += force.friction_power;
  group.power += power;
}

void ContactSet::evaluate(const Kinematics& kinematics, std::vector<ExternalWrench>& wrenches) {
  std::fill(groups_.begin(), groups_.end(), GroupContact{});
  for (Pair& pair : pairs_) {
    if (pair.mode != Mode::touching) continue;
    const auto [a, b] = motions_of(pair, kinematics);
    const ContactForce& force = pair.contact.evaluate(a, b, pair.stick);
    if (!force.touches) {
      GroupContact& group = groups_[pair.group];
      if (force.beyond_model)
        group.beyond_model = true;  // one shape is inside of the other
      else
        group.slip_speed = std::max(group.slip_speed, pair.contact.graze(a, b, pair.stick).slip_speed);
      continue;
    }
    spread(pair, force, kinematics);
    Vector3d force_on_b = Vector3d::zero();
    double power = 0;
    for (int i = 0; i < pair.acting_count; ++i) {
      const ActingForce& f = pair.acting[i];
      if (f.body_a >= 0) wrenches.push_back({f.body_a, f.p_WC, -f.on_b});
      if (f.body_b >= 0) wrenches.push_back({f.body_b, f.p_WC, f.on_b});
      force_on_b += f.on_b.linear;
      power += power_of(f.body_a, f.p_WC, -f.on_b, kinematics) + power_of(f.body_b, f.p_WC, f.on_b, kinematics);
    }
    add_to_group(pair, force, force_on_b, power);
  }
  for (GroupContact& group : groups_) {
    if (!(group.normal_force > 0)) continue;
    group.p_WC *= 1 / group.normal_force;
  }
}

void ContactSet::set_stick(std::span<const double> numbers) {
  const double* at = numbers.data();
  for (Pair& pair : pairs_) {
    pair.stick.slip = Vector3d{at[0], at[1], at[2]} - pair.base.slip;
    pair.stick.spin = at[3] - pair.base.spin;
    at += kStickCount;
  }
}

void ContactSet::rebase_stick() {
  for (Pair& pair : pairs_) pair.base = {-pair.stick.slip, -pair.stick.spin};
}

void ContactSet::add_active_sticks(int offset, std::vector<int>& numbers) const {
  for (const Pair& pair : pairs_) {
    const bool acts = pair.mode == Mode::touching && pair.contact.law().static_friction > 0;
    for (int i = 0; acts && i < kStickCount; ++i) numbers.push_back(offset + i);
    offset += kStickCount;
  }
}

void ContactSet::stick_rates(std::span<double> rates) const {
  double* at = rates.data();
  for (const Pair& pair : pairs_) {
    const bool touches = pair.mode == Mode::touching;
    const StickState rate = touches ? pair.contact.last().stick_rate : StickState{};
    std::copy(rate.slip.e, rate.slip.e + 3, at);
    at[3] = rate.spin;
    at += kStickCount;
  }
}

double ContactSet::elastic_energy(std::size_t group, const Kinematics& kinematics) {
  double energy = 0;
  for (Pair& pair : pairs_) {
    if (pair.group != static_cast<int>(group) || pair.mode != Mode::touching) continue;
    const auto [X_WA, X_WB] = poses_of(pair, kinematics);
    energy += pair.contact.elastic_energy(X_WA, X_WB);
  }
  return energy;
}

ShapeSeparation ContactSet::separation(std::size_t pair, const Kinematics& kinematics) const {
  const Pair& p = pairs_[pair];
  const auto [X_WA, X_WB] = poses_of(p, kinematics);
  return p.contact.separation(X_WA, X_WB);
}

}  // namespace grapnel
