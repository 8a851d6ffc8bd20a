#include "grapnel/capture/effort_watch.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "grapnel/integrate/integrate.hpp"

namespace grapnel {

void EffortWatch::begin_phase(std::string name) {
  name_ = std::move(name);
  monitors_.clear();
  events_.clear();
}

void EffortWatch::watch(std::string joint, std::size_t quantity, double limit, bool cut) {
  constexpr double kTolerance = 1e-9;  // relative to the limit
  if (!std::isfinite(limit) || (cut && !(limit > 0))) return;
  const double threshold = limit * (cut ? 1 - kTolerance : 1 + kTolerance);
  for (const double sign : {1.0, -1.0}) {
    monitors_.push_back(
        {cut ? LimitKind::effort_saturated : LimitKind::effort, joint, quantity, sign, limit, threshold});
  }
}

void EffortWatch::note(Monitor& monitor, double time, double value) {
  if (monitor.open < 0) {
    monitor.open = static_cast<int>(events_.size());
    events_.push_back({monitor.kind, monitor.joint, name_, time, time, value, time, monitor.sign * monitor.limit});
  }
  LimitEvent& event = events_[monitor.open];
  event.end_time = time;
  if (monitor.sign * (value - event.worst_value) > 0) event.worst_value = value, event.worst_time = time;
}

// Points of a step => begins, extends and ends events of efforts beyond their limits; crossings between two points are
// located by bracketing to 1e-9 of their distance.
void EffortWatch::step(std::span<const PeakSearch::Point> points, const PeakSearch::Quantities& at) {
  constexpr double kTime = 1e-9;  // relative to the distance of two points
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (Monitor& m : monitors_) {
      const PeakSearch::Point& p = points[i];
      const bool beyond = m.beyond(p) > 0;
      if (i > 0 && beyond != (m.beyond(points[i - 1]) > 0)) {
        const PeakSearch::Point& before = points[i - 1];
        const auto excess = [&](double t) {
          values_.resize(p.values.size());
          at(t, values_);
          return m.sign * values_[m.quantity] - m.threshold;
        };
        const Bracket crossing = shrink_bracket(excess, {before.time, m.beyond(before), p.time, m.beyond(p)},
                                                kTime * (p.time - before.time));
        note(m, 0.5 * (crossing.begin + crossing.end), m.sign * m.threshold);
      }
      if (beyond) {
        note(m, p.time, p.values[m.quantity]);
      } else {
        m.open = -1;
      }
    }
  }
}

std::vector<LimitEvent> EffortWatch::end_phase() {
  monitors_.clear();
  std::ranges::stable_sort(events_, {}, &LimitEvent::begin_time);
  return std::exchange(events_, {});
}

}  // namespace grapnel
