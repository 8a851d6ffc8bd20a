#pragma once

/// @file
/// Integration from one time to another with output at given times: a ready-made loop around a stepper. Thread safety:
/// that of the given stepper.

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "grapnel/integrate/dormand_prince_853.hpp"
#include "grapnel/integrate/runge_kutta_4.hpp"
#include "grapnel/integrate/stepper.hpp"

namespace grapnel {

/// How an integration ended.
struct IntegrationResult {
  StepStatus status = StepStatus::not_started;
  double time = 0.0;  // time reached: the end time if finished, else the time of failure
  IntegrationStatistics statistics;

  bool finished() const { return status == StepStatus::finished; }
  std::string explanation() const { return explain(status, time); }
};

/// Output times, and observer(t, y) which is called at each that is reached. The times run in the direction of the
/// integration and may include both ends and repeat.
template <class Observer>
struct ObservedTimes {
  std::span<const double> times;
  Observer observer;
};
template <class Observer>
ObservedTimes(std::span<const double>, Observer) -> ObservedTimes<Observer>;

/// Integrates y' = rhs(t, y) from y0 (n numbers) at t0 to t1 with a stepper (`DormandPrince853`, `RungeKutta4`), and
/// observes the state y at output times (n numbers; quaternions normalized; valid during the call). The state at t1 is
/// stepper.state(). Allocates one state besides the result. A failure is reported in the result, not thrown.
/// Throws std::invalid_argument if an output time is out of order or outside [t0, t1], or as stepper.start() does.
template <class Method, RightHandSide<typename Method::Scalar> Rhs, class Observer>
IntegrationResult integrate(Method& stepper, Rhs&& rhs, double t0, std::span<const typename Method::Scalar> y0,
                            double t1, const ObservedTimes<Observer>& outputs) {
  using S = typename Method::Scalar;
  const auto& [output_times, observer] = outputs;
  const double direction = t1 < t0 ? -1.0 : 1.0;
  double earliest = t0;
  for (const double t : output_times) {
    if (!((t - earliest) * direction >= 0.0 && (t1 - t) * direction >= 0.0)) {
      throw std::invalid_argument("integrate: output time " + std::to_string(t) +
                                  " is out of order or outside the interval");
    }
    earliest = t;
  }

  stepper.start(rhs, t0, y0, t1);
  std::vector<S> y(y0.size());
  std::size_t next = 0;
  const auto usable = [&] {
    return stepper.status() == StepStatus::running || stepper.status() == StepStatus::finished;
  };
  for (; usable() && next < output_times.size() && output_times[next] == t0; ++next) observer(t0, stepper.state());
  while (stepper.status() == StepStatus::running) {
    stepper.step(rhs);
    if (!usable()) break;
    for (; next < output_times.size() && (stepper.time() - output_times[next]) * direction >= 0.0; ++next) {
      const double t = output_times[next];
      if (t == stepper.time()) {
        observer(t, stepper.state());
      } else {
        stepper.interpolate(rhs, t, std::span<S>(y));
        observer(t, std::span<const S>(y));
      }
    }
  }
  return {stepper.status(), stepper.time(), stepper.statistics()};
}

/// The same without output.
template <class Method, RightHandSide<typename Method::Scalar> Rhs>
IntegrationResult integrate(Method& stepper, Rhs&& rhs, double t0, std::span<const typename Method::Scalar> y0,
                            double t1) {
  const auto ignore = [](double, std::span<const typename Method::Scalar>) {};
  return integrate(stepper, rhs, t0, y0, t1, ObservedTimes{std::span<const double>(), ignore});
}

// Event location: finds the time at which a function g(t, y) of the state changes sign within a stepper's last step, on
// the step's dense output, without repeating the integration. Thread safety: a locator holds a scratch state and
// belongs to one thread at a time.

/// Sign changes to report, in the direction of integration.
enum class Crossing { rising, falling, any };

/// Resolution of the search.
struct EventOptions {
  int samples =
      8;  // number of equal parts of the step at whose ends g is evaluated; more parts detect shorter excursions
  double time_tolerance = 1e-13;  // of the time found, relative to the step, in addition to the resolution of time
};

/// A sign change.
struct EventLocation {
  double time;   // just after the sign change in the direction of integration, or where g is exactly 0
  bool rising;   // g goes from negative to positive (or 0) in the direction of integration
  double value;  // g at `time`
};

/// A short time interval that contains a sign change.
struct Bracket {
  double begin;
  double begin_value;
  double end;
  double end_value;
};

/// Shrinks a bracket (begin_value and end_value of opposite sign, or one of them 0) until its length is at most
/// `tolerance` [time], or zero where f is exactly 0. Calls f(t) → double. Inverse quadratic interpolation where safe,
/// otherwise bisection (T. R. Chandrupatla, Advances in Engineering Software 28 (1997) 145–149). begin and end keep
/// their sides. Throws only exceptions of f.
template <class Function>
Bracket shrink_bracket(Function&& f, Bracket bracket, double tolerance) {
  if (bracket.begin_value == 0.0 || bracket.end_value == 0.0) return bracket;
  const bool begin_positive = bracket.begin_value > 0.0;
  double x1 = bracket.end, f1 = bracket.end_value;      // latest point
  double x2 = bracket.begin, f2 = bracket.begin_value;  // opposite sign
  double fraction = 0.5;                                // next point, from x1 to x2
  while (std::abs(x2 - x1) > tolerance && f1 != 0.0) {
    const double x = x1 + fraction * (x2 - x1);
    if (x == x1 || x == x2) break;  // the resolution of time
    const double fx = f(x);
    double x3 = x1, f3 = f1;  // the discarded point
    if ((fx > 0.0) != (f1 > 0.0)) {
      x3 = x2, f3 = f2;
      x2 = x1, f2 = f1;
    }
    x1 = x, f1 = fx;
    const double xi = (x1 - x2) / (x3 - x2);
    const double phi = (f1 - f2) / (f3 - f2);
    const bool monotonic = phi * phi < xi && (1.0 - phi) * (1.0 - phi) < 1.0 - xi;
    fraction = monotonic
                   ? f1 / (f2 - f1) * (f3 / (f2 - f3)) + (x3 - x1) / (x2 - x1) * (f1 / (f3 - f1)) * (f2 / (f3 - f2))
                   : 0.5;
    const double margin = std::min(0.5, 0.5 * tolerance / std::abs(x2 - x1));
    fraction = std::clamp(fraction, margin, 1.0 - margin);
  }
  if (f1 == 0.0) return {x1, f1, x1, f1};  // exact root
  return (f1 > 0.0) == begin_positive ? Bracket{x1, f1, x2, f2} : Bracket{x2, f2, x1, f1};
}

/// Finds sign changes of functions of the state.
template <class S>
class EventLocator {
 public:
  /// Allocates a scratch state. Throws std::invalid_argument if samples < 1 or time_tolerance is not positive.
  explicit EventLocator(const Manifold& manifold, const EventOptions& options = {})
      : options_(options), y_(static_cast<std::size_t>(manifold.size)) {
    if (options.samples < 1) throw std::invalid_argument("EventOptions: samples must be at least 1");
    if (!(options.time_tolerance > 0.0)) throw std::invalid_argument("EventOptions: time_tolerance must be positive");
  }

  /// The first sign change of g in the stepper's last step, in the direction of integration. The step's begin is
  /// excluded and its end included. Therefore consecutive steps report each crossing once, also if g is exactly 0 at
  /// their common time, and a restart at the time found does not find it again. A double crossing between two samples
  /// is detected if three samples show a dip whose parabola crosses zero. Calls g(t, y) → double with the state y (n
  /// numbers) at t, and stepper.prepare_dense_output(rhs). Throws std::logic_error if there is no completed step,
  /// std::domain_error if g is NaN.
  template <class Method, RightHandSide<S> Rhs, class Event>
  std::optional<EventLocation> find(Method& stepper, Rhs&& rhs, Event&& g, Crossing crossing = Crossing::any);

  /// The state at the time found by the last successful find(), n numbers.
  std::span<const S> state() const { return y_; }

 private:
  struct Sample {
    double time;
    double value;
  };

  static bool changes_sign(const Sample& a, const Sample& b, Crossing crossing) {
    const bool rising = a.value < 0.0 && b.value >= 0.0;
    const bool falling = a.value > 0.0 && b.value <= 0.0;
    return (rising && crossing != Crossing::falling) || (falling && crossing != Crossing::rising);
  }

  /// Extremum of the parabola through three samples of equal sign, if the middle one is nearest to zero.
  static std::optional<double> dip(const Sample& a, const Sample& b, const Sample& c) {
    const double sign = b.value > 0.0 ? 1.0 : -1.0;
    if (!(sign * a.value > 0.0 && sign * c.value > 0.0)) return std::nullopt;
    const double fall = sign * (a.value - b.value);
    const double rise = sign * (c.value - b.value);
    if (!(fall >= 0.0 && rise >= 0.0 && fall + rise > 0.0)) return std::nullopt;
    return b.time + 0.25 * (c.time - a.time) * (fall - rise) / (fall + rise);
  }

  EventOptions options_;
  std::vector<S> y_;
};

// Event function => first sign change in the last step: samples g on the dense output, brackets a change or a dip, and
// refines it with shrink_bracket().
template <class S>
template <class Method, RightHandSide<S> Rhs, class Event>
std::optional<EventLocation> EventLocator<S>::find(Method& stepper, Rhs&& rhs, Event&& g, Crossing crossing) {
  stepper.prepare_dense_output(rhs);
  const double begin = stepper.previous_time();
  const double length = stepper.time() - begin;
  const double resolution =
      4.0 * std::numeric_limits<double>::epsilon() * std::max(std::abs(begin), std::abs(stepper.time()));
  const double tolerance = options_.time_tolerance * std::abs(length) + resolution;

  const auto value_at = [&](double t) {
    stepper.interpolate(t, std::span<S>(y_));
    const double value = g(t, std::span<const S>(y_));
    if (std::isnan(value))
      throw std::domain_error("EventLocator: the event function is NaN at t = " + std::to_string(t));
    return value;
  };
  const auto locate = [&](const Sample& a, const Sample& b) {
    const Bracket bracket = shrink_bracket(value_at, {a.time, a.value, b.time, b.value}, tolerance);
    return EventLocation{bracket.end, a.value < 0.0, value_at(bracket.end)};
  };

  Sample earlier{begin, 0.0};  // 0: no dip detectable at the first sample
  Sample previous{begin, value_at(begin)};
  for (int i = 1; i <= options_.samples; ++i) {
    const double t = i == options_.samples ? stepper.time() : begin + length * i / options_.samples;
    const Sample current{t, value_at(t)};
    if (changes_sign(previous, current, crossing)) return locate(previous, current);
    if (const std::optional<double> turn = dip(earlier, previous, current)) {
      const Sample bottom{*turn, value_at(*turn)};
      // The parabola's extremum may be on either side of the middle sample.
      const bool before = (bottom.time - previous.time) * length < 0.0;
      const Sample& left = before ? earlier : previous;
      const Sample& right = before ? previous : current;
      if (changes_sign(left, bottom, crossing)) return locate(left, bottom);
      if (changes_sign(bottom, right, crossing)) return locate(bottom, right);
    }
    earlier = previous;
    previous = current;
  }
  return std::nullopt;
}

}  // namespace grapnel
