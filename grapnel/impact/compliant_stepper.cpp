#include "grapnel/impact/compliant_stepper.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace grapnel {
namespace {

// Maximum shift of the end of a step that is repeated for an event, relative to its length; beyond: repeat again.
constexpr double kLanded = 1e-14;
constexpr int kMaxLandings = 4, kMaxLookups = 60;
// Corrections of Newton's method at which rounding errors of overlaps may stop it, relative to the tolerances: overlaps
// are differences of positions of several metres.
constexpr double kShapeRounding = 0.1;
// Margin at which steps end for an event of shapes: behind zero, where the present modes have certainly ended [m].
constexpr double kBehind = 5e-14;
// Margin below which a mode of shapes has ended, beyond rounding errors [m].
constexpr double kEnded = 1e-12;

}  // namespace

StiffSystem StiffIntegrator::stiff_system() {
  const int positions = system_.rate_offset(), coupled = system_.loss_offset(0);
  return {positions, coupled - positions, system_.size() - coupled,
          [this](std::span<const double> t, std::span<const double> y, std::span<double> dydt) {
            const bool stages = t.size() == static_cast<std::size_t>(RadauIIA::kStages);
            system_.rates(t, y, dydt, stages ? std::span(stage_loads_) : std::span<InterfaceLoad>());
          }};
}

// System, sizes and tolerances of the integrated quantities, first step and end [s] => integrator at t = 0 with all
// integrated quantities zero (docs/theory, section 12, Integration).
StiffIntegrator::StiffIntegrator(CompliantSystem& system, std::span<const double> sizes,
                                 std::span<const double> tolerances, double first_step, double end)
    : system_(system),
      stage_loads_(static_cast<std::size_t>(RadauIIA::kStages * system.interfaces())),
      radau_(stiff_system(), std::vector<double>(system.size()), sizes, tolerances),
      first_step_(first_step),
      end_(end),
      stop_(end),
      at_(system.size()),
      crossed_(system.events()),
      directions_(system.events()),
      begin_(system.events()),
      before_(begin_),
      now_(begin_),
      there_(begin_) {
  restart();
}

void StiffIntegrator::values(double t, std::span<const double> y, std::vector<double>& g) {
  if (!g.empty()) system_.event_values(t, y, g);
}

bool StiffIntegrator::crosses(std::size_t index, double before, double now) const {
  return directions_[index] < 0 ? before > 0 && now <= 0 : before < 0 && now >= 0;
}

// State at the end of the last step => stepped, end, event or failed. Event functions are checked at all stages; the
// step is repeated such that it ends at the first zero crossing (docs/theory, section 12, Integration).
StiffIntegrator::Result StiffIntegrator::step() {
  if (!radau_.step(stop_)) return Result::failed;
  std::fill(crossed_.begin(), crossed_.end(), 0);
  if (begin_.empty()) return time() >= stop_ ? Result::end : Result::stepped;
  const bool clear = shapes_stay_clear();
  if (!clear) begin_.back() = value_at(begin_.size() - 1, radau_.begin());
  before_ = begin_;
  double from = radau_.begin();
  for (int i = 0; i < RadauIIA::kStages; ++i) {  // stages are closer than steps
    const double to = radau_.time_of_stage(i);
    values_at_stage(i, clear, now_);
    // The first of the functions that cross between two stages.
    std::size_t first = now_.size();
    double when = to;
    for (std::size_t k = 0; k < now_.size(); ++k) {
      if (!crosses(k, before_[k], now_[k])) continue;
      const double t = crossing(k, from, to, before_[k], now_[k]);
      if (first == now_.size() || t < when) first = k, when = t;
    }
    if (first < now_.size()) return land(when, first) ? Result::event : Result::failed;
    before_.swap(now_);
    from = to;
  }
  begin_.swap(before_);
  if (system_.has_shapes() && begin_.back() < -kEnded) {  // a mode that was at its boundary has ended
    crossed_.back() = directions_.back();
    return Result::event;
  }
  return time() >= stop_ ? Result::end : Result::stepped;
}

// Whether no shapes can touch in the last step, whose margin then needs no search.
bool StiffIntegrator::shapes_stay_clear() {
  if (!system_.has_shapes()) return true;
  return !system_.end_shape_step(time(), y(), time() - radau_.begin());
}

void StiffIntegrator::values_at_stage(int stage, bool clear, std::vector<double>& g) {
  if (clear) {
    system_.event_values(loads_at_stage(stage), g);
    if (system_.has_shapes()) g.back() = 1;
  } else if (stage == stages() - 1) {
    values(time(), y(), g);
  } else {
    values(time_of_stage(stage), at(time_of_stage(stage)), g);
  }
}

// Zero of function `index` on the step's polynomial, by the Illinois method; the signs at a and b differ.
double StiffIntegrator::crossing(std::size_t index, double a, double b, double at_a, double at_b) {
  const double close = kLanded * (b - a);
  int side = 0;
  double last = a;
  for (int i = 0; i < kMaxLookups && at_b != 0 && b - a > close; ++i) {
    const double t = std::clamp((a * at_b - b * at_a) / (at_b - at_a), std::min(a, b), std::max(a, b));
    const double value = value_at(index, t);
    if ((value > 0) == (at_b > 0) || value == 0) {
      b = t, at_b = value;
      if (side == 1) at_a *= 0.5;
      side = 1;
    } else {
      a = t, at_a = value;
      if (side == -1) at_b *= 0.5;
      side = -1;
    }
    if (std::abs(t - last) <= close) return t;
    last = t;
  }
  return b;
}

double StiffIntegrator::value_at(std::size_t index, double t) {
  values(t, at(t), there_);
  return there_[index];
}

// Repeats the step such that function `index` is zero at its end (of shapes: just behind it), near t: the polynomial is
// less accurate than the end.
bool StiffIntegrator::land(double t, std::size_t index) {
  const double behind = system_.has_shapes() && index + 1 == now_.size() ? kBehind : 0;
  for (int i = 0; i < kMaxLandings; ++i) {
    if (!radau_.end_at(t)) return false;
    if (!(time() > radau_.begin())) check_at_begin();
    if (system_.has_shapes()) {
      values(time(), y(), now_);
    } else {
      system_.event_values(loads_at_end(), now_);
    }
    const double length = time() - radau_.begin(), back = 1e-3 * length;
    if (!(length > 0)) break;
    const double slope = (now_[index] - value_at(index, time() - back)) / back,
                 correction = (now_[index] + behind) / slope;
    if (!(std::abs(correction) > kLanded * length && std::abs(correction) < back)) break;
    t = std::min(time() - correction, stop_);
  }
  for (std::size_t k = 0; k < crossed_.size(); ++k) {
    if (k != index && !crosses(k, begin_[k], now_[k])) continue;
    crossed_[k] = directions_[k];
    // the event has occurred
    now_[k] = directions_[k] * std::max(std::abs(now_[k]), std::numeric_limits<double>::min());
  }
  begin_.swap(now_);
  return true;
}

std::span<const double> StiffIntegrator::at(double t) {
  radau_.at(t, at_);
  return at_;
}

std::span<const InterfaceLoad> StiffIntegrator::loads_at_stage(int stage) const {
  const auto count = static_cast<std::size_t>(system_.interfaces());
  return std::span(stage_loads_).subspan(static_cast<std::size_t>(stage) * count, count);
}

// A step of zero length has its stages at its beginning.
void StiffIntegrator::check_at_begin() {
  system_.load(time(), y());
  for (int i = 0; i < stages(); ++i) {
    const auto at = static_cast<std::ptrdiff_t>(i) * system_.interfaces();
    std::copy(system_.loads().begin(), system_.loads().end(), stage_loads_.begin() + at);
  }
}

void StiffIntegrator::replace(std::span<const double> y, std::span<const double> sizes,
                              std::span<const double> tolerances) {
  const double t = time();
  evaluations_before_ += radau_.evaluations();
  radau_ = RadauIIA(stiff_system(), y, sizes, tolerances);
  radau_.accept_rounding(kShapeRounding);
  std::vector<double> slope(y.size());
  system_.rates(t, y, slope);
  radau_.continue_from(t, y, slope);
  at_.resize(y.size());
}

void StiffIntegrator::restart() {
  radau_.restart(first_step_);
  if (directions_.empty()) return;
  if (system_.has_shapes()) system_.begin_shape_step(time(), y());
  system_.event_directions(directions_);
  values(time(), y(), begin_);
}

std::string StiffIntegrator::message() const { return fmt::format("at {:.6g} s: {}", time(), radau_.message()); }

}  // namespace grapnel
