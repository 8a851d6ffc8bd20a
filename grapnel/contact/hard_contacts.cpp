/// Impacts of hard pairs: where they touch at an instant, and what their motion afterwards means for their modes
/// (theory section 23, Hard contacts).

#include <algorithm>
#include <limits>

#include "grapnel/contact/contact_chain.hpp"
#include "grapnel/contact/point_velocity.hpp"

namespace grapnel {

namespace {

// Depth below the gap at an impact at which the pair would close again: above rounding errors of gaps [m].
constexpr double kRoundingOfGap = 1e-11;

}  // namespace

// A hard pair becomes apart. It closes again below the present gap, or at gap zero.
void ContactSet::part(Pair& pair, double t, const Kinematics& kinematics) {
  set_mode(pair, Mode::apart, t);
  const auto [X_WA, X_WB] = poses_of(pair, kinematics);
  const double gap = pair.contact.gap(X_WA, X_WB);
  pair.hard.level = std::min(gap, 0.0) - kRoundingOfGap;
  if (gap > kRoundingOfGap) pair.hard.level = 0;
  pair.hard.level_time = t;
}

bool ContactSet::is_crowded(const Pair& pair, double t) {
  return pair.hard.full && t - pair.hard.times[pair.hard.next] <= kCrowdedTime;
}

// Appends the points of a hard pair that touches. Returns whether it must have an impact: it is apart, and closes
// faster than its rest speed.
bool ContactSet::add_hard_points(std::size_t index, double t, const Kinematics& kinematics,
                                 std::vector<HardPoint>& points) const {
  const Pair& pair = pairs_[index];
  const auto [X_WA, X_WB] = poses_of(pair, kinematics);
  if (pair.contact.gap_bound(X_WA, X_WB) > kTouchTolerance || pair.contact.gap(X_WA, X_WB) > kTouchTolerance)
    return false;
  const ContactLaw& law = pair.contact.law();
  const TouchPoints touch = pair.contact.touch(X_WA, X_WB);
  int body_a = pair.body_a, body_b = pair.body_b;
  if (pair.chain) (pair.chain_is_a ? body_a : body_b) = chain_motion(pair, kinematics).body();
  double fastest = -std::numeric_limits<double>::infinity();
  for (const Vector3d& p : touch.points) {
    const Vector3d relative = point_velocity(body_b, p, kinematics) - point_velocity(body_a, p, kinematics);
    const double approach = -dot(relative, touch.normal);
    fastest = std::max(fastest, approach);
    points.push_back({index, body_a, body_b, p, touch.normal, law.restitution, law.kinetic_friction, approach,
                      pair.mode == Mode::touching, law.rest_speed});
  }
  return pair.mode == Mode::apart && fastest >= law.rest_speed && !is_crowded(pair, t);
}

bool ContactSet::takes_part(const Pair& pair) {
  return pair.is_hard() && (pair.mode == Mode::apart || pair.mode == Mode::touching);
}

std::vector<HardPoint> ContactSet::impact_points(double t, const Kinematics& kinematics) {
  std::vector<HardPoint> points;
  bool any = false;
  for (std::size_t i = 0; any_hard_ && i < pairs_.size(); ++i) {
    if (takes_part(pairs_[i]) && add_hard_points(i, t, kinematics, points)) any = true;
  }
  if (!any) points.clear();
  return points;
}

std::vector<HardPoint> ContactSet::touching_points(double t, const Kinematics& kinematics) const {
  std::vector<HardPoint> points;
  for (std::size_t i = 0; any_hard_ && i < pairs_.size(); ++i) {
    if (takes_part(pairs_[i])) add_hard_points(i, t, kinematics, points);
  }
  return points;
}

// Points of one pair, their impacts, kinematics at the impact => history of its group, and its mode: apart if every
// point separates faster than the rest speed; otherwise it touches.
void ContactSet::note_pair_impact(Pair& pair, double t, std::span<const HardPoint> points,
                                  std::span<const HardPointImpact> impacts, const Kinematics& kinematics) {
  GroupHistory& history = histories_[pair.group];
  double impulse = 0, slowest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < points.size(); ++i) {
    impulse += impacts[i].impulse;
    history.impact_work += impacts[i].work;
    history.impact_loss += impacts[i].loss, history.impact_friction_loss += impacts[i].friction_loss;
    slowest = std::min(slowest, impacts[i].separation_speed);
    if (impacts[i].impulse > 0) history.fastest_impact = std::max(history.fastest_impact, points[i].approach_speed);
  }
  history.impact_impulse += impulse;
  const bool parts = pair.mode == Mode::apart && slowest >= pair.contact.law().rest_speed;
  if (impulse > 0) {
    ++history.impacts;
    history.last_impact = t;
    pair.hard.times[pair.hard.next] = t;
    pair.hard.next = (pair.hard.next + 1) % kCrowdedImpacts;
    pair.hard.full = pair.hard.full || pair.hard.next == 0;
    if (parts && touching_[pair.group] == 0) {
      ++history.touches;
      if (!history.first_time) history.first_time = t;
    }
  }
  if (parts)
    part(pair, t, kinematics);
  else
    set_mode(pair, Mode::touching, t);
}

void ContactSet::note_impact(double t, std::span<const HardPoint> points, std::span<const HardPointImpact> impacts,
                             const Kinematics& kinematics) {
  for (std::size_t begin = 0; begin < points.size();) {
    std::size_t end = begin;
    while (end < points.size() && points[end].pair == points[begin].pair) ++end;
    note_pair_impact(pairs_[points[begin].pair], t, points.subspan(begin, end - begin),
                     impacts.subspan(begin, end - begin), kinematics);
    begin = end;
  }
}

}  // namespace grapnel
