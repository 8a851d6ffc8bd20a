#include "grapnel/simulate/simulate_phase.hpp"

#include <cmath>

#include "grapnel/integrate/integrate.hpp"

namespace grapnel {
namespace {

// t0, t0 + interval, ..., t1; a last regular instant within rounding of t1 is left out.
std::vector<double> output_times(double t0, double t1, double interval) {
  std::vector<double> times{t0};
  if (interval > 0) {
    const double direction = t1 < t0 ? -1 : 1;
    for (long k = 1;; ++k) {
      const double t = t0 + direction * static_cast<double>(k) * interval;
      if ((t1 - t) * direction <= 1e-9 * interval) break;
      times.push_back(t);
    }
  }
  if (t1 != t0) times.push_back(t1);
  return times;
}

template <class Method>
PhaseOutcome run(Method&& stepper, PhaseDynamics& dynamics, const State& start, double t0, double t1, double interval,
                 const std::function<void(const PhaseSample&)>& observe) {
  std::vector<double> motor(dynamics.model().joints().size()), friction(motor.size());
  const auto observer = [&](double t, std::span<const double> y) {
    if (!observe) return;
    dynamics.efforts(t, y, motor, friction);
    const State state = dynamics.state(t, y);
    const PhaseIntegrals integrals = dynamics.integrals(y);
    observe({t, state, integrals, motor, friction});
  };
  const std::vector<double> y0 = dynamics.initial(start, t0);
  const IntegrationResult result = integrate(stepper, dynamics, t0, y0, t1, output_times(t0, t1, interval), observer);
  PhaseOutcome outcome;
  outcome.finished = result.finished();
  if (!outcome.finished) outcome.failure = result.explanation();
  outcome.end_time = result.time;
  outcome.end_state = dynamics.state(result.time, stepper.state());
  outcome.integrals = dynamics.integrals(stepper.state());
  outcome.momentum_mended = dynamics.momentum_mended(stepper.state());
  outcome.rhs_evaluations = static_cast<long>(result.statistics.rhs_evaluations);
  outcome.steps = static_cast<long>(result.statistics.accepted);
  outcome.rejected = static_cast<long>(result.statistics.rejected);
  outcome.quaternion_defect = result.statistics.largest_quaternion_defect;
  return outcome;
}

}  // namespace

PhaseOutcome simulate_phase(PhaseDynamics& dynamics, const State& start, double t0, double t1, double interval,
                            const IntegrationSetup& integration,
                            const std::function<void(const PhaseSample&)>& observe) {
  if (integration.method == IntegrationSetup::Method::rk4) {
    return run(RungeKutta4<double>(dynamics.manifold(), integration.step), dynamics, start, t0, t1, interval, observe);
  }
  Tolerances tolerances;
  tolerances.rtol = integration.relative_tolerance;
  tolerances.atol = integration.absolute_tolerance;
  StepControl control;
  if (integration.max_step > 0) control.max_step = integration.max_step;
  control.max_steps = integration.max_steps;
  return run(DormandPrince853<double>(dynamics.manifold(), tolerances, control), dynamics, start, t0, t1, interval,
             observe);
}

}  // namespace grapnel
