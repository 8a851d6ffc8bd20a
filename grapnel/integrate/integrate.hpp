#pragma once

/// @file
/// Integration from one time to another with output at given times: the steppers' loop for callers that need nothing
/// special. Thread safety: as the stepper that is passed in.

#include <cmath>
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
  double time = 0.0;  // reached: the end time if finished, else the time of failure
  IntegrationStatistics statistics;

  bool finished() const { return status == StepStatus::finished; }
  std::string explanation() const { return explain(status, time); }
};

/// Integrates y' = rhs(t, y) from y0 (n numbers) at t0 to t1 with a stepper (`DormandPrince853`, `RungeKutta4`), and
/// calls observer(t, y) at every output time that is reached, in order, with the state y (n numbers; quaternions
/// normalized; valid during the call). Output times run from t0 towards t1 and may include both and repeat. The state
/// at t1 is stepper.state(). Allocates one state besides the result. A failure is reported in the result, not thrown.
/// Throws std::invalid_argument if an output time is out of order or outside [t0, t1], or as stepper.start() does.
template <class Method, RightHandSide<typename Method::Scalar> Rhs, class Observer>
IntegrationResult integrate(Method& stepper, Rhs&& rhs, double t0, std::span<const typename Method::Scalar> y0,
                            double t1, std::span<const double> output_times, Observer&& observer) {
  using S = typename Method::Scalar;
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
  return integrate(stepper, rhs, t0, y0, t1, {}, [](double, std::span<const typename Method::Scalar>) {});
}

}  // namespace grapnel
