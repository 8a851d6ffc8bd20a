#include "grapnel/contact/motion_watch.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "grapnel/dynamics/forward_dynamics.hpp"

namespace grapnel {

namespace {

// Assumed maximum ratio of a pair's speed between two samples to that at the samples.
constexpr double kSpeedMargin = 1.5;

// Tolerances of parting pairs: relative to a depth, which is found by searches, and as a distance [m], for rounding
// errors of touching pairs.
constexpr double kOfDepth = 0.02, kOfTouch = 1e-6;

// Rate of a pair's distance [m/s]: relative velocity of its nearest points along the normal.
double parting_rate(const ClearancePair& pair, const ShapeDistance& d, const Kinematics& kinematics) {
  const auto velocity = [&](int body, const Vector3d& point) {
    const Twistd& V = kinematics.V_WB[body];
    return V.linear + cross(V.angular, point - kinematics.X_WB[body].p);
  };
  return dot(d.normal, velocity(pair.body_b, d.point_b) - velocity(pair.body_a, d.point_a));
}

// Merges the events of shapes to events of bodies: events of two bodies that overlap in time become one.
std::vector<ClearanceEvent> united_by_bodies(std::vector<ClearanceEvent> events) {
  using Bodies = std::pair<std::string_view, std::string_view>;
  std::ranges::stable_sort(events, {}, &ClearanceEvent::begin_time);
  std::vector<ClearanceEvent> united;
  std::map<Bodies, std::size_t> last;
  for (const ClearanceEvent& event : events) {
    Bodies bodies{event.minimum.body_a, event.minimum.body_b};
    if (bodies.second < bodies.first) std::swap(bodies.first, bodies.second);
    const auto [known, is_first] = last.emplace(bodies, united.size());
    if (is_first || event.begin_time > united[known->second].end_time) {
      known->second = united.size();
      united.push_back(event);
      continue;
    }
    ClearanceEvent& earlier = united[known->second];
    earlier.end_time = std::max(earlier.end_time, event.end_time);
    if (event.overlap_begin)
      earlier.overlap_begin = std::min(earlier.overlap_begin.value_or(*event.overlap_begin), *event.overlap_begin);
    if (event.minimum.distance < earlier.minimum.distance) earlier.minimum = event.minimum;
  }
  return united;
}

}  // namespace

ClearanceWatch::ClearanceWatch(double required) : required_(required) {
  if (std::isnan(required)) throw std::invalid_argument("ClearanceWatch: the required clearance is not a number");
}

// Models and parting pairs of a phase => state for its samples. Only pairs that are still parting keep the largest
// distance reached before, and with it their reduced required clearance.
void ClearanceWatch::begin_phase(std::string name, const Model& model, const ClearanceModel& clearance,
                                 std::span<const int> parting) {
  if (phase_) throw std::logic_error("ClearanceWatch: phase '" + phase_->name + "' has not ended");
  const std::size_t pairs = clearance.pairs().size();
  Sample sample{0, zero_state(model), Kinematics(model), std::vector<double>(pairs), std::vector<double>(pairs)};
  phase_.emplace(Phase{name,
                       &model,
                       &clearance,
                       sample,
                       sample,
                       false,
                       MotionSegment(model),
                       zero_state(model),
                       Kinematics(model),
                       std::vector<int>(pairs, -1),
                       events_.size(),
                       std::vector<double>(pairs, required_),
                       {parting.begin(), parting.end()},
                       std::vector<bool>(parting.empty() ? 0 : pairs, false),
                       reached_});
  // Pairs that are no longer parting, such as those held again, lose their record.
  std::map<std::pair<int, int>, double> still;
  for (int pair : parting) {
    if (const auto known = reached_.find(shapes_of(pair)); known != reached_.end()) still.insert(*known);
  }
  reached_ = std::move(still);
  for (const auto& [shapes, distance] : reached_) {
    for (int pair : parting) {
      if (shapes_of(pair) == shapes) require(pair, distance);
    }
  }
  minima_.emplace_back().phase = std::move(name);
}

std::pair<int, int> ClearanceWatch::shapes_of(int pair) const {
  const ClearancePair& p = phase_->clearance->pairs().at(pair);
  return {p.shape_a, p.shape_b};
}

void ClearanceWatch::require(int pair, double reached) {
  const double depth = std::max(0.0, -reached);
  phase_->required[pair] = reached < required_ + kOfTouch ? -(1 + kOfDepth) * depth - kOfTouch : required_;
}

// Called first for each sample.
void ClearanceWatch::follow_parting() {
  for (int pair : phase_->parting) {
    const double distance = phase_->clearance->distance(pair, phase_->next.kinematics).distance;
    const auto [known, is_first] = reached_.try_emplace(shapes_of(pair), distance);
    if (is_first) require(pair, distance);
    const bool has_parted = std::max(known->second, distance) >= required_ + kOfTouch;
    phase_->left_out[pair] = !has_parted && !(distance < phase_->required[pair]);
  }
}

void ClearanceWatch::fill(double time, const State& state, Sample& sample) const {
  forward_kinematics(*phase_->model, state, sample.kinematics);
  sample.time = time;
  sample.state = state;
  for (int i = 0; i < static_cast<int>(sample.bound.size()); ++i) {
    sample.bound[i] = phase_->clearance->coarse_bound(i, sample.kinematics);
    sample.speed[i] = phase_->clearance->speed_bound(i, sample.kinematics);
  }
}

// Time and state => minimum clearance at this sample; updates the minimum of the phase and its events, in between as
// well, and the largest distance that parting pairs have reached.
Clearance ClearanceWatch::sample(double time, const State& state) {
  if (!phase_) throw std::logic_error("ClearanceWatch: sample outside a phase");
  if (phase_->has_sample && !(time >= phase_->last.time)) {
    throw std::invalid_argument("ClearanceWatch: the time decreases in phase '" + phase_->name + "'");
  }
  fill(time, state, phase_->next);
  follow_parting();
  const Clearance clearance = phase_->clearance->minimum(phase_->next.kinematics, phase_->left_out);
  MinimumClearance& minimum = minima_.back();
  if (clearance.distance < minimum.distance) {
    note_minimum(clearance.pair, time, {clearance.distance, clearance.point_a, clearance.point_b, clearance.normal},
                 minimum);
  }
  if (phase_->has_sample && time > phase_->last.time) {
    watch_between();
  } else {
    watch_first();
  }
  for (int pair : phase_->parting) {
    double& reached = reached_.at(shapes_of(pair));
    reached = std::max(reached, phase_->clearance->distance(pair, phase_->next.kinematics).distance);
    require(pair, reached);
  }
  std::swap(phase_->last, phase_->next);
  phase_->has_sample = true;
  return clearance;
}

void ClearanceWatch::end_phase() {
  if (!phase_) throw std::logic_error("ClearanceWatch: end_phase outside a phase");
  const auto first = events_.begin() + static_cast<std::ptrdiff_t>(phase_->events_before);
  const std::vector<ClearanceEvent> united = united_by_bodies({first, events_.end()});
  events_.erase(first, events_.end());
  events_.insert(events_.end(), united.begin(), united.end());
  phase_.reset();
}

void ClearanceWatch::forget_phase() {
  if (!phase_) throw std::logic_error("ClearanceWatch: forget_phase outside a phase");
  events_.resize(phase_->events_before);
  minima_.pop_back();
  reached_ = phase_->reached_before;
  phase_.reset();
}

std::vector<ClearanceEvent> ClearanceWatch::events() const {
  std::vector<ClearanceEvent> sorted = events_;
  std::ranges::stable_sort(sorted, {}, &ClearanceEvent::begin_time);
  return sorted;
}

ShapeDistance ClearanceWatch::distance_at(int pair, double time) {
  phase_->segment.interpolate(time, phase_->between);
  forward_kinematics(*phase_->model, phase_->between, phase_->between_kinematics);
  return phase_->clearance->distance(pair, phase_->between_kinematics);
}

// Pairs that are too close from the first sample on.
void ClearanceWatch::watch_first() {
  const Sample& next = phase_->next;
  for (int i = 0; i < static_cast<int>(next.bound.size()); ++i) {
    if (next.bound[i] >= phase_->required[i]) continue;
    const ShapeDistance d = phase_->clearance->distance(i, next.kinematics);
    if (d.distance < phase_->required[i]) note_event(i, next.time, d);
  }
}

// Last two samples => searches of pairs that may come nearer than required, or than the minimum so far. Bounds of
// increasing cost exclude the others by their distances at both samples and their speeds.
void ClearanceWatch::watch_between() {
  const Sample& last = phase_->last;
  const Sample& next = phase_->next;
  const ClearanceModel& clearance = *phase_->clearance;
  const double scaled_time = kSpeedMargin * (next.time - last.time);
  const double matters = std::max(required_, minima_.back().distance);
  bool segment_set = false;
  for (int i = 0; i < static_cast<int>(last.bound.size()); ++i) {
    // A distance with rate at most s stays above half of d0 + d1 - s h in between.
    const double travel = scaled_time * std::max(last.speed[i], next.speed[i]);
    const bool open = phase_->open_event[i] >= 0;
    const auto stays_clear = [&](double d0, double d1) { return !open && 0.5 * (d0 + d1 - travel) >= matters; };
    if (stays_clear(last.bound[i], next.bound[i])) continue;
    if (stays_clear(clearance.lower_bound(i, last.kinematics), clearance.lower_bound(i, next.kinematics))) continue;
    const ShapeDistance at_last = clearance.distance(i, last.kinematics);
    const ShapeDistance at_next = clearance.distance(i, next.kinematics);
    if (stays_clear(at_last.distance, at_next.distance)) continue;
    if (!segment_set) phase_->segment.set(last.time, last.state, next.time, next.state);
    segment_set = true;
    watch_pair(i, at_last, at_next);
  }
}

// Distances of a pair at both samples => its events and minimum in between. If it approaches and then separates, golden
// section finds the minimum and divides the interval into two monotonic parts.
void ClearanceWatch::watch_pair(int pair, const ShapeDistance& at_last, const ShapeDistance& at_next) {
  const Sample& last = phase_->last;
  const Sample& next = phase_->next;
  const ClearancePair& p = phase_->clearance->pairs()[pair];
  if (!(parting_rate(p, at_last, last.kinematics) < 0 && parting_rate(p, at_next, next.kinematics) > 0)) {
    watch_interval(pair, last.time, at_last, next.time, at_next);
    return;
  }
  const double nearest = golden_minimum([&](double t) { return distance_at(pair, t).distance; }, last.time, next.time);
  const ShapeDistance at_nearest = distance_at(pair, nearest);
  const bool counts = phase_->required[pair] == required_ || at_nearest.distance < phase_->required[pair];
  if (counts && at_nearest.distance < minima_.back().distance) note_minimum(pair, nearest, at_nearest, minima_.back());
  watch_interval(pair, last.time, at_last, nearest, at_nearest);
  watch_interval(pair, nearest, at_nearest, next.time, at_next);
}

// An interval in which the distance of a pair is monotonic.
void ClearanceWatch::watch_interval(int pair, double begin, const ShapeDistance& at_begin, double end,
                                    const ShapeDistance& at_end) {
  const double required = phase_->required[pair];
  const bool below_begin = at_begin.distance < required, below_end = at_end.distance < required;
  const auto crosses = [&](double level) {
    return crossing([&](double t) { return distance_at(pair, t).distance - level; }, begin, end,
                    at_begin.distance - level);
  };
  double time = begin;
  if (below_begin) note_event(pair, begin, at_begin);
  if (below_begin != below_end) {
    time = crosses(required);
    if (below_end) note_event(pair, time, distance_at(pair, time));
    if (!below_end) {
      events_[phase_->open_event[pair]].end_time = time;
      phase_->open_event[pair] = -1;
    }
  }
  if (!below_end) return;
  const bool overlaps = events_[phase_->open_event[pair]].overlap_begin.has_value();
  if (at_end.distance < 0 && !overlaps) note_overlap(pair, required <= 0 ? time : crosses(0));
  note_event(pair, end, at_end);
}

// Begins the pair's event at this time or continues it.
void ClearanceWatch::note_event(int pair, double time, const ShapeDistance& d) {
  int& open = phase_->open_event[pair];
  if (open < 0) {
    open = static_cast<int>(events_.size());
    ClearanceEvent event;
    event.phase = phase_->name;
    event.begin_time = time;
    event.required = required_;
    events_.push_back(event);
  }
  ClearanceEvent& event = events_[open];
  event.end_time = time;
  if (d.distance < 0) note_overlap(pair, time);
  if (d.distance < event.minimum.distance) note_minimum(pair, time, d, event.minimum);
}

// The pair overlaps at this time, during an event; the first overlap is recorded.
void ClearanceWatch::note_overlap(int pair, double time) {
  std::optional<double>& begin = events_[phase_->open_event[pair]].overlap_begin;
  if (!begin) begin = time;
}

void ClearanceWatch::note_minimum(int pair, double time, const ShapeDistance& d, MinimumClearance& minimum) const {
  const ClearancePair& p = phase_->clearance->pairs()[pair];
  const auto name = [&](int body) { return phase_->model->bodies()[body].description.name; };
  minimum = {d.distance, name(p.body_a), name(p.body_b), d.point_a, d.point_b, time, phase_->name};
}

namespace {

// Relative to the limit.
constexpr double kTolerance = 1e-9;

// Limit => its magnitude, 0 if it is infinite.
double finite_size(double limit) { return std::isfinite(limit) ? std::abs(limit) : 0; }

}  // namespace

// Model => one monitor per finite limit and sign, with a tolerance of 1e-9 of the limit; saturation counts from 1e-9
// below the effort limit on.
std::vector<LimitWatch::Monitor> LimitWatch::monitors_of(const Model& model) const {
  std::vector<Monitor> monitors;
  const auto add = [&](LimitKind kind, int joint, double sign, double limit, double tolerance) {
    if (std::isfinite(limit)) monitors.push_back({kind, joint, sign, limit, limit + sign * tolerance});
  };
  for (int j = 0; j < static_cast<int>(model.joints().size()); ++j) {
    const JointLimits& l = model.joint_body(j).description.joint.limits;
    const double position = kTolerance * std::max(finite_size(l.lower), finite_size(l.upper));
    add(LimitKind::position, j, 1, l.upper, position);
    add(LimitKind::position, j, -1, l.lower, position);
    for (const double sign : {1.0, -1.0}) {
      add(LimitKind::rate, j, sign, sign * l.rate, kTolerance * l.rate);
      add(LimitKind::effort, j, sign, sign * l.effort, kTolerance * l.effort);
      if (efforts_are_cut_ && l.effort > 0) {
        add(LimitKind::effort_saturated, j, sign, sign * l.effort, -kTolerance * l.effort);
      }
    }
  }
  return monitors;
}

void LimitWatch::begin_phase(std::string name, const Model& model) {
  if (phase_) throw std::logic_error("LimitWatch: phase '" + phase_->name + "' has not ended");
  phase_.emplace(Phase{std::move(name), &model, monitors_of(model), false, 0, zero_state(model)});
}

// Time, state and efforts => events of effort limits; of position and rate limits only if the phase has no steps.
// Throws std::logic_error outside a phase, std::invalid_argument for decreasing times or wrong sizes.
void LimitWatch::sample(double time, const State& state, std::span<const double> efforts) {
  if (!phase_) throw std::logic_error("LimitWatch: sample outside a phase");
  const Model& model = *phase_->model;
  if (!phase_->by_steps && phase_->has_sample && !(time >= phase_->time)) {
    throw std::invalid_argument("LimitWatch: the time decreases in phase '" + phase_->name + "'");
  }
  if (static_cast<int>(state.q.size()) != model.coordinates() ||
      static_cast<int>(state.v.size()) != model.velocities()) {
    throw std::invalid_argument("LimitWatch: the state has another model's size");
  }
  if (!efforts.empty() && efforts.size() != model.joints().size()) {
    throw std::invalid_argument("LimitWatch: there must be one effort per joint");
  }
  for (Monitor& monitor : phase_->monitors) {
    if (monitor.kind == LimitKind::position || monitor.kind == LimitKind::rate) {
      if (!phase_->by_steps) watch_motion(monitor, time, state);
    } else if (!efforts.empty()) {
      watch_sample(monitor, {time, efforts[monitor.joint]});
    }
  }
  if (phase_->by_steps) return;
  phase_->has_sample = true;
  phase_->time = time;
  phase_->state = state;
}

// Motion inside a step => events of position and rate limits. States between the ends are evaluated only if some joint
// can reach its limit in the step.
void LimitWatch::step(double begin, double end, bool fresh, const StateAt& at) {
  if (!phase_) throw std::logic_error("LimitWatch: step outside a phase");
  const bool continues = phase_->by_steps && !fresh && phase_->time == begin;
  if (!continues) phase_->state = at(begin), phase_->time = begin;
  const State first = phase_->state;
  phase_->has_sample = phase_->by_steps = true;
  phase_->state = at(end), phase_->time = end;
  std::vector<State> inside;  // created when a monitor needs them
  std::vector<Instant> instants;
  for (Monitor& monitor : phase_->monitors) {
    if (monitor.kind != LimitKind::position && monitor.kind != LimitKind::rate) continue;
    const Instant a = instant_of(monitor, begin, first), b = instant_of(monitor, end, phase_->state);
    if (!may_pass(monitor, a, b)) {
      monitor.open_event = -1;
      continue;
    }
    const auto time_of = [&](int part) { return begin + (end - begin) * part / kParts; };
    for (int part = static_cast<int>(inside.size()) + 1; part < kParts; ++part) inside.push_back(at(time_of(part)));
    instants.assign(1, a);
    for (int part = 1; part < kParts; ++part)
      instants.push_back(instant_of(monitor, time_of(part), inside[static_cast<std::size_t>(part) - 1]));
    instants.push_back(b);
    watch_parts(monitor, instants, at);
  }
}

LimitWatch::Instant LimitWatch::instant_of(const Monitor& monitor, double time, const State& state) const {
  const Body& body = phase_->model->joint_body(monitor.joint);
  return {time, state.q[body.q], state.v[body.v]};
}

// Whether the joint can exceed the limit between two instants of a smooth motion. If the rates at both ends agree with
// the mean rate, the motion between them is simple; the margin is a multiple of their disagreement.
bool LimitWatch::may_pass(const Monitor& monitor, const Instant& a, const Instant& b) {
  constexpr double kMargin = 4;
  const double h = b.time - a.time, mean = h > 0 ? (b.position - a.position) / h : a.rate;
  const double change = std::max({std::abs(a.rate - mean), std::abs(b.rate - mean), std::abs(b.rate - a.rate)});
  const bool position = monitor.kind == LimitKind::position;
  const double nearest = position
                             ? std::max(monitor.sign * a.position, monitor.sign * b.position) + kMargin * h * change
                             : std::max(monitor.sign * a.rate, monitor.sign * b.rate) + kMargin * change;
  return !(nearest < monitor.sign * monitor.threshold);
}

void LimitWatch::watch_parts(Monitor& monitor, std::span<const Instant> instants, const StateAt& at) {
  for (std::size_t part = 0; part + 1 < instants.size(); ++part) {
    if (monitor.kind == LimitKind::position) {
      watch_positions(monitor, instants[part], instants[part + 1], at);
    } else {
      watch_rates(monitor, instants, part, at);
    }
  }
}

// Part of a step in which the joint reverses at most once.
void LimitWatch::watch_positions(Monitor& monitor, const Instant& a, const Instant& b, const StateAt& at) {
  const auto value = [&](double t) { return instant_of(monitor, t, at(t)).position; };
  const Point begin{a.time, a.position}, end{b.time, b.position};
  const bool turns = monitor.sign * a.rate > 0 && monitor.sign * b.rate < 0;
  if (!turns || !may_pass(monitor, a, b)) return watch_interval(monitor, begin, end, value);
  const double time = crossing([&](double t) { return instant_of(monitor, t, at(t)).rate; }, a.time, b.time, a.rate);
  const Point turn{time, value(time)};
  watch_interval(monitor, begin, turn, value);
  watch_interval(monitor, turn, end, value);
}

// Part of a step in which the rate has at most one maximum.
void LimitWatch::watch_rates(Monitor& monitor, std::span<const Instant> instants, std::size_t part, const StateAt& at) {
  const Instant &a = instants[part], &b = instants[part + 1];
  const auto value = [&](double t) { return instant_of(monitor, t, at(t)).rate; };
  const Point begin{a.time, a.rate}, end{b.time, b.rate};
  // The maximum may be inside the part if its larger end is at least as large as the neighbouring values.
  const auto size = [&](std::size_t i) { return monitor.sign * instants[i].rate; };
  const bool rises = part == 0 || size(part) >= size(part - 1);
  const bool falls = part + 2 >= instants.size() || size(part + 1) >= size(part + 2);
  const double min_gain = 0.25 * std::abs(b.rate - a.rate);
  const bool near = std::max(size(part), size(part + 1)) + min_gain >= monitor.sign * monitor.threshold;
  if (!(rises && falls && near) || !may_pass(monitor, a, b)) return watch_interval(monitor, begin, end, value);
  const double time = golden_minimum([&](double t) { return -monitor.sign * value(t); }, a.time, b.time);
  const Point top{time, value(time)};
  watch_interval(monitor, begin, top, value);
  watch_interval(monitor, top, end, value);
}

void LimitWatch::end_phase() {
  if (!phase_) throw std::logic_error("LimitWatch: end_phase outside a phase");
  phase_.reset();
}

std::vector<LimitEvent> LimitWatch::events() const {
  std::vector<LimitEvent> sorted = events_;
  std::ranges::stable_sort(sorted, {}, &LimitEvent::begin_time);
  return sorted;
}

// Position and rate: the motion from the last sample to this one.
void LimitWatch::watch_motion(Monitor& monitor, double time, const State& state) {
  const Body& body = phase_->model->joint_body(monitor.joint);
  const bool position = monitor.kind == LimitKind::position;
  const double q1 = state.q[body.q], v1 = state.v[body.v];
  const Point end{time, position ? q1 : v1};
  if (!phase_->has_sample || !(time > phase_->time)) {
    watch_sample(monitor, end);
    return;
  }
  const double q0 = phase_->state.q[body.q], v0 = phase_->state.v[body.v];
  const double t0 = phase_->time, h = time - t0;
  const HermiteCubic motion{q0, v0, q1, v1, h};
  const auto rate = [&](double t) { return motion.rate((t - t0) / h); };
  if (!position) {
    watch_interval(monitor, {t0, v0}, end, rate);
    return;
  }
  const auto value = [&](double t) { return motion.value((t - t0) / h); };
  const Point begin{t0, q0};
  // Towards the limit at the begin and away from it at the end: the reversal is in between.
  if (monitor.sign * v0 > 0 && monitor.sign * v1 < 0) {
    const double turn_time = crossing(rate, t0, time, v0);
    const Point turn{turn_time, value(turn_time)};
    watch_interval(monitor, begin, turn, value);
    watch_interval(monitor, turn, end, value);
  } else {
    watch_interval(monitor, begin, end, value);
  }
}

// An interval in which the value crosses the limit at most once; value(t) -> double.
template <class Function>
void LimitWatch::watch_interval(Monitor& monitor, const Point& begin, const Point& end, Function&& value) {
  const bool beyond_begin = monitor.beyond(begin.value), beyond_end = monitor.beyond(end.value);
  if (beyond_begin) note_event(monitor, begin);
  if (beyond_begin != beyond_end) {
    const double time = crossing([&](double t) { return value(t) - monitor.threshold; }, begin.time, end.time,
                                 begin.value - monitor.threshold);
    note_event(monitor, {time, value(time)});
    if (!beyond_end) monitor.open_event = -1;
  }
  if (beyond_end) note_event(monitor, end);
}

// Efforts, and first samples: events begin and end at samples.
void LimitWatch::watch_sample(Monitor& monitor, const Point& point) {
  if (monitor.beyond(point.value)) {
    note_event(monitor, point);
  } else {
    monitor.open_event = -1;
  }
}

// Begins the monitor's event at this point or continues it.
void LimitWatch::note_event(Monitor& monitor, const Point& point) {
  if (monitor.open_event < 0) {
    monitor.open_event = static_cast<int>(events_.size());
    events_.push_back({monitor.kind, phase_->model->joint_body(monitor.joint).description.joint.name, phase_->name,
                       point.time, point.time, point.value, point.time, monitor.limit});
  }
  LimitEvent& event = events_[monitor.open_event];
  event.end_time = point.time;
  if (monitor.sign * (point.value - event.worst_value) > 0)
    event.worst_value = point.value, event.worst_time = point.time;
}

// Model => storage for one cubic per coordinate.
MotionSegment::MotionSegment(const Model& model)
    : model_(&model),
      cubics_(model.coordinates()),
      rates_begin_(model.coordinates()),
      rates_end_(model.coordinates()) {}

// States at t0 and t1 => cubic Hermite polynomial of every coordinate; final quaternions have the sign that is nearer
// to the initial ones.
void MotionSegment::set(double t0, const State& begin, double t1, const State& end) {
  t0_ = t0;
  coordinate_rates(*model_, begin.q, begin.v, rates_begin_);
  coordinate_rates(*model_, end.q, end.v, rates_end_);
  for (std::size_t i = 0; i < cubics_.size(); ++i) {
    cubics_[i] = {begin.q[i], rates_begin_[i], end.q[i], rates_end_[i], t1 - t0};
  }
  // Selects the quaternion of the final orientation that is closer to the initial one.
  for (const int k : model_->quaternions()) {
    double product = 0;
    for (int i = k; i < k + 4; ++i) product += begin.q[i] * end.q[i];
    if (product >= 0) continue;
    for (int i = k; i < k + 4; ++i) cubics_[i].x1 = -cubics_[i].x1, cubics_[i].r1 = -cubics_[i].r1;
  }
}

void MotionSegment::interpolate(double t, State& state) const {
  for (std::size_t i = 0; i < cubics_.size(); ++i) state.q[i] = cubics_[i].value((t - t0_) / cubics_[i].h);
  for (const int k : model_->quaternions()) {
    double square = 0;
    for (int i = k; i < k + 4; ++i) square += state.q[i] * state.q[i];
    for (int i = k; i < k + 4; ++i) state.q[i] /= std::sqrt(square);
  }
}

}  // namespace grapnel
