#include "grapnel/clearance/limit_watch.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "grapnel/clearance/motion_segment.hpp"

namespace grapnel {

namespace {

// Of the limit's size.
constexpr double kTolerance = 1e-9;

double finite_size(double limit) { return std::isfinite(limit) ? std::abs(limit) : 0; }

}  // namespace

std::vector<LimitWatch::Monitor> LimitWatch::monitors_of(const Model& model) const {
  std::vector<Monitor> monitors;
  const auto add = [&](LimitKind kind, int joint, double sign, double limit, double tolerance) {
    if (std::isfinite(limit)) monitors.push_back({kind, joint, sign, limit, limit + sign * tolerance});
  };
  for (int j = 0; j < static_cast<int>(model.joints().size()); ++j) {
    const JointLimits& l = model.bodies()[model.joints()[j]].description.joint.limits;
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

void LimitWatch::sample(double time, const State& state, std::span<const double> efforts) {
  if (!phase_) throw std::logic_error("LimitWatch: sample outside a phase");
  const Model& model = *phase_->model;
  if (phase_->has_sample && !(time >= phase_->time)) {
    throw std::invalid_argument("LimitWatch: the time goes backwards in phase '" + phase_->name + "'");
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
      watch_motion(monitor, time, state);
    } else if (!efforts.empty()) {
      watch_sample(monitor, {time, efforts[monitor.joint]});
    }
  }
  phase_->has_sample = true;
  phase_->time = time;
  phase_->state = state;
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
  const Body& body = phase_->model->bodies()[phase_->model->joints()[monitor.joint]];
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
    watch_piece(monitor, {t0, v0}, end, rate);
    return;
  }
  const auto value = [&](double t) { return motion.value((t - t0) / h); };
  const Point begin{t0, q0};
  // Towards the limit at first and away from it at last: the turn is in between.
  if (monitor.sign * v0 > 0 && monitor.sign * v1 < 0) {
    const double turn_time = crossing(rate, t0, time, v0);
    const Point turn{turn_time, value(turn_time)};
    watch_piece(monitor, begin, turn, value);
    watch_piece(monitor, turn, end, value);
  } else {
    watch_piece(monitor, begin, end, value);
  }
}

// A time in which the value crosses the limit at most once; value(t) -> double.
template <class Function>
void LimitWatch::watch_piece(Monitor& monitor, const Point& begin, const Point& end, Function&& value) {
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
    events_.push_back({monitor.kind,
                       phase_->model->bodies()[phase_->model->joints()[monitor.joint]].description.joint.name,
                       phase_->name, point.time, point.time, point.value, point.time, monitor.limit});
  }
  LimitEvent& event = events_[monitor.open_event];
  event.end_time = point.time;
  if (monitor.sign * (point.value - event.worst_value) > 0)
    event.worst_value = point.value, event.worst_time = point.time;
}

}  // namespace grapnel
