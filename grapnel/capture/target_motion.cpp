#include "grapnel/capture/target_motion.hpp"

#include <fmt/format.h>

#include <stdexcept>

#include "grapnel/capture/phase_setups.hpp"
#include "grapnel/simulate/simulate_phase.hpp"

namespace grapnel {

TargetMotion propagate_target(const TargetSetup& target, const TargetMotion& at_t0, double t0, double t1,
                              const Vector3d& gravity, const IntegrationSetup& integration,
                              std::span<const LoadSetup> loads) {
  if (t0 == t1) return at_t0;
  const Model model = ModelBuilder().add(target_body(target)).build();
  PhaseSetup setup;
  setup.gravity = gravity;
  setup.loads = loads_on(model, loads);
  PhaseDynamics dynamics(model, setup);
  State state = zero_state(model);
  set_root_pose(model, 0, at_t0.X_WT, state);
  set_root_twist(model, 0, at_t0.V_WT, state);
  const PhaseOutcome outcome = simulate_phase(dynamics, state, t0, t1, 0, integration);
  if (!outcome.finished)
    throw std::runtime_error(fmt::format("propagating target '{}': {}", target.name, outcome.failure));
  return {root_pose(model, outcome.end_state, 0), root_twist(model, outcome.end_state, 0)};
}

TargetPlan plan_targets(const CaptureProblem& problem) {
  const double T = problem.approach ? problem.approach->duration : 0.0;
  TargetPlan plan;
  for (const TargetSetup& t : problem.targets) {
    const TargetMotion given{t.X_WT, t.V_WT};
    const auto propagate = [&](double from, double to) {
      return propagate_target(t, given, from, to, problem.gravity, problem.integration, problem.loads);
    };
    const bool at_start = t.given_at == TargetSetup::Instant::start;
    plan.start.push_back(at_start ? given : propagate(T, 0));
    plan.capture.push_back(at_start ? propagate(0, T) : given);
  }
  return plan;
}

}  // namespace grapnel
