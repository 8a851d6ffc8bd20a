#include "grapnel/clearance/clearance_watch.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "grapnel/clearance/motion_segment.hpp"

namespace grapnel {

namespace {

// A pair's speed between two samples may exceed that at the samples by this much.
constexpr double kSpeedMargin = 1.5;

// Rate of a pair's distance [m/s]: how its nearest points part along the normal.
double parting_rate(const ClearancePair& pair, const ShapeDistance& d, const Kinematics& kinematics) {
  const auto velocity = [&](int body, const Vector3d& point) {
    const Twistd& V = kinematics.V_WB[body];
    return V.linear + cross(V.angular, point - kinematics.X_WB[body].p);
  };
  return dot(d.normal, velocity(pair.body_b, d.point_b) - velocity(pair.body_a, d.point_a));
}

}  // namespace

ClearanceWatch::ClearanceWatch(double required) : required_(required) {
  if (std::isnan(required)) throw std::invalid_argument("ClearanceWatch: the required clearance is not a number");
}

void ClearanceWatch::begin_phase(std::string name, const Model& model, const ClearanceModel& clearance) {
  if (phase_) throw std::logic_error("ClearanceWatch: phase '" + phase_->name + "' has not ended");
  const std::size_t pairs = clearance.pairs().size();
  Sample sample{0, zero_state(model), Kinematics(model), std::vector<double>(pairs), std::vector<double>(pairs)};
  phase_.emplace(Phase{name, &model, &clearance, sample, sample, false, MotionSegment(model), zero_state(model),
                       Kinematics(model), std::vector<int>(pairs, -1), events_.size()});
  least_.emplace_back().phase = std::move(name);
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

Clearance ClearanceWatch::sample(double time, const State& state) {
  if (!phase_) throw std::logic_error("ClearanceWatch: sample outside a phase");
  if (phase_->has_sample && !(time >= phase_->last.time)) {
    throw std::invalid_argument("ClearanceWatch: the time goes backwards in phase '" + phase_->name + "'");
  }
  fill(time, state, phase_->next);
  const Clearance clearance = phase_->clearance->minimum(phase_->next.kinematics);
  MinimumClearance& least = least_.back();
  if (clearance.distance < least.distance) {
    note_least(clearance.pair, time, {clearance.distance, clearance.point_a, clearance.point_b, clearance.normal},
               least);
  }
  if (phase_->has_sample && time > phase_->last.time) {
    watch_between();
  } else {
    watch_first();
  }
  std::swap(phase_->last, phase_->next);
  phase_->has_sample = true;
  return clearance;
}

void ClearanceWatch::end_phase() {
  if (!phase_) throw std::logic_error("ClearanceWatch: end_phase outside a phase");
  phase_.reset();
}

void ClearanceWatch::forget_phase() {
  if (!phase_) throw std::logic_error("ClearanceWatch: forget_phase outside a phase");
  events_.resize(phase_->events_before);
  least_.pop_back();
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

// Pairs that are too near from the first sample on.
void ClearanceWatch::watch_first() {
  const Sample& next = phase_->next;
  for (int i = 0; i < static_cast<int>(next.bound.size()); ++i) {
    if (next.bound[i] >= required_) continue;
    const ShapeDistance d = phase_->clearance->distance(i, next.kinematics);
    if (d.distance < required_) note_event(i, next.time, d);
  }
}

void ClearanceWatch::watch_between() {
  const Sample& last = phase_->last;
  const Sample& next = phase_->next;
  const ClearanceModel& clearance = *phase_->clearance;
  const double way = kSpeedMargin * (next.time - last.time);
  const double matters = std::max(required_, least_.back().distance);
  bool segment_set = false;
  for (int i = 0; i < static_cast<int>(last.bound.size()); ++i) {
    // A distance that changes no faster than a speed s is nowhere in between below half of d0 + d1 - s h.
    const double most = way * std::max(last.speed[i], next.speed[i]);
    const bool open = phase_->open_event[i] >= 0;
    const auto stays_clear = [&](double d0, double d1) { return !open && 0.5 * (d0 + d1 - most) >= matters; };
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

void ClearanceWatch::watch_pair(int pair, const ShapeDistance& at_last, const ShapeDistance& at_next) {
  const Sample& last = phase_->last;
  const Sample& next = phase_->next;
  const ClearancePair& p = phase_->clearance->pairs()[pair];
  if (!(parting_rate(p, at_last, last.kinematics) < 0 && parting_rate(p, at_next, next.kinematics) > 0)) {
    watch_piece(pair, last.time, at_last, next.time, at_next);
    return;
  }
  const double nearest = golden_minimum([&](double t) { return distance_at(pair, t).distance; }, last.time, next.time);
  const ShapeDistance at_nearest = distance_at(pair, nearest);
  if (at_nearest.distance < least_.back().distance) note_least(pair, nearest, at_nearest, least_.back());
  watch_piece(pair, last.time, at_last, nearest, at_nearest);
  watch_piece(pair, nearest, at_nearest, next.time, at_next);
}

// A time in which the distance of a pair does not turn.
void ClearanceWatch::watch_piece(int pair, double begin, const ShapeDistance& at_begin, double end,
                                 const ShapeDistance& at_end) {
  const bool below_begin = at_begin.distance < required_, below_end = at_end.distance < required_;
  const auto crosses = [&](double level) {
    return crossing([&](double t) { return distance_at(pair, t).distance - level; }, begin, end,
                    at_begin.distance - level);
  };
  double time = begin;
  if (below_begin) note_event(pair, begin, at_begin);
  if (below_begin != below_end) {
    time = crosses(required_);
    if (below_end) note_event(pair, time, distance_at(pair, time));
    if (!below_end) {
      events_[phase_->open_event[pair]].end_time = time;
      phase_->open_event[pair] = -1;
    }
  }
  if (!below_end) return;
  const bool overlaps = events_[phase_->open_event[pair]].overlap_begin.has_value();
  if (at_end.distance < 0 && !overlaps) note_overlap(pair, required_ == 0 ? time : crosses(0));
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
  if (d.distance < event.least.distance) note_least(pair, time, d, event.least);
}

// The pair overlaps at this time, during an event; the first of all counts.
void ClearanceWatch::note_overlap(int pair, double time) {
  std::optional<double>& begin = events_[phase_->open_event[pair]].overlap_begin;
  if (!begin) begin = time;
}

void ClearanceWatch::note_least(int pair, double time, const ShapeDistance& d, MinimumClearance& least) const {
  const ClearancePair& p = phase_->clearance->pairs()[pair];
  const auto name = [&](int body) { return phase_->model->bodies()[body].description.name; };
  least = {d.distance, name(p.body_a), name(p.body_b), d.point_a, d.point_b, time, phase_->name};
}

}  // namespace grapnel
