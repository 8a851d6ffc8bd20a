#include "grapnel/problem/target_motion.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "grapnel/dynamics/symmetric_solve.hpp"
#include "grapnel/integrate/integrate.hpp"
#include "grapnel/problem/capture_system.hpp"
#include "grapnel/simulate/simulate_phase.hpp"

namespace grapnel {
namespace {

// Tolerance of the orientation per step [rad]. Its cost is a few microseconds; all later results depend on it.
constexpr double kTurnTolerance = 1e-14;
// About 20 per revolution.
constexpr long kMaxSteps = 1'000'000;

// Motion of a body under gravity alone. Its angular momentum L about the centre of mass is constant in W, and w_B =
// J^-1 R^T L is integrated; the centre of mass follows a parabola.
TargetMotion propagate_freely(const TargetSetup& target, const TargetMotion& at_t0, double t0, double t1,
                              const Vector3d& gravity) {
  const Rotationd& R0 = at_t0.X_WT.R;
  const Vector3d L = R0 * (target.inertia * transposed_times(R0, at_t0.V_WT.angular));
  const SymmetricFactor3<double> J(target.inertia);
  const auto rate_in_body = [&](const Quaterniond& q) { return J.solve(transposed_times(rotation_matrix(q), L)); };
  Manifold manifold;
  manifold.size = 4, manifold.quaternions = {0};
  Tolerances tolerances;
  tolerances.rtol = tolerances.atol = 0.5 * kTurnTolerance;
  StepControl control;
  control.max_steps = kMaxSteps;
  DormandPrince853<double> stepper(manifold, tolerances, control);
  const Quaterniond q0 = quaternion_from(R0);
  const double y0[] = {q0.w, q0.x, q0.y, q0.z};
  const auto turn = [&](double, std::span<const double> y, std::span<double> dydt) {
    const Quaterniond q{y[0], y[1], y[2], y[3]};
    const Quaterniond dq = quaternion_rate(q, rate_in_body(q));
    dydt[0] = dq.w, dydt[1] = dq.x, dydt[2] = dq.y, dydt[3] = dq.z;
  };
  const IntegrationResult result = integrate(stepper, turn, t0, y0, t1);
  if (!result.finished())
    throw std::runtime_error(fmt::format("propagating target '{}': {}", target.name, result.explanation()));
  const std::span<const double> y = stepper.state();
  const Quaterniond q1{y[0], y[1], y[2], y[3]};
  const Rotationd R1 = rotation_matrix(q1);
  const double s = t1 - t0;
  const Vector3d arm0 = R0 * target.com, arm1 = R1 * target.com;
  const Vector3d velocity0 = at_t0.V_WT.linear + cross(at_t0.V_WT.angular, arm0);
  const Vector3d angular = R1 * rate_in_body(q1);
  const Vector3d velocity1 = velocity0 + s * gravity;
  const Vector3d com1 = at_t0.X_WT.p + arm0 + s * velocity0 + (0.5 * s * s) * gravity;
  return {{R1, com1 - arm1}, {angular, velocity1 - cross(angular, arm1)}};
}

}  // namespace

// Motion at t0 => motion at t1, which may be earlier. Without loads only the rotation at constant angular momentum is
// integrated, with loads or an orbital field the whole motion (5.1). Throws std::runtime_error if that fails.
TargetMotion propagate_target(const TargetSetup& target, const TargetMotion& at_t0, double t0, double t1,
                              const TargetPropagation& propagation) {
  const auto& [gravity, loads, orbit, integration, each_step] = propagation;
  if (t0 == t1) return at_t0;
  if (!orbit && loads.empty()) return propagate_freely(target, at_t0, t0, t1, gravity);
  const Model model = ModelBuilder().add(target_body(target)).build();
  PhaseSetup setup;
  setup.gravity = gravity;
  for (const LoadSetup& load : loads)
    setup.loads.push_back({0, load.p_BP, load.frame, load.amplitude, load.profile, load.stream});
  if (orbit) setup.orbit = reference_orbit(*orbit);
  PhaseDynamics dynamics(model, setup);
  State state = zero_state(model);
  set_root_pose(model, 0, at_t0.X_WT, state);
  set_root_twist(model, 0, at_t0.V_WT, state);
  const PhaseOutcome outcome =
      simulate_phase(dynamics, {state, t0, t1}, integration, {.watch = {.each_step = each_step}});
  if (!outcome.finished)
    throw std::runtime_error(fmt::format("propagating target '{}': {}", target.name, outcome.failure));
  return {root_pose(model, outcome.end_state, 0), root_twist(model, outcome.end_state, 0)};
}

TargetMotion propagate_target(const CaptureProblem& problem, const TargetSetup& target, const TargetMotion& at_t0,
                              double t0, double t1, const std::function<void(double t)>& each_step) {
  std::vector<LoadSetup> loads;
  const BodyName itself = BodyName::of_target(target_index(problem, target.name));
  std::copy_if(problem.loads.begin(), problem.loads.end(), std::back_inserter(loads),
               [&](const LoadSetup& load) { return load.body == itself; });
  return propagate_target(target, at_t0, t0, t1,
                          {problem.gravity, loads, problem.orbit, problem.integration, each_step});
}

// Problem => motion of each target at the start and at the capture; the instant that is not stated is propagated from
// the other.
TargetPlan plan_targets(const CaptureProblem& problem, const std::function<void(double t)>& each_step) {
  const double T = problem.approach ? problem.approach->duration : 0.0;
  TargetPlan plan;
  for (const TargetSetup& t : problem.targets) {
    const TargetMotion given{t.X_WT, t.V_WT};
    const auto propagate = [&](double from, double to) {
      return propagate_target(problem, t, given, from, to, each_step);
    };
    const bool at_start = t.given_at == TargetSetup::Instant::start;
    plan.start.push_back(at_start ? given : propagate(T, 0));
    plan.capture.push_back(at_start ? propagate(0, T) : given);
  }
  return plan;
}

}  // namespace grapnel
