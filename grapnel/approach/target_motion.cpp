#include "grapnel/approach/target_motion.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "grapnel/approach/phase_setups.hpp"
#include "grapnel/dynamics/symmetric_solve.hpp"
#include "grapnel/integrate/integrate.hpp"
#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/simulate/simulate_phase.hpp"

namespace grapnel {
namespace {

// Tolerance of the orientation per step [rad]. Its cost is a few microseconds; all later results depend on it.
constexpr double kTurnTolerance = 1e-14;
// About 20 per revolution.
constexpr long kMostSteps = 1'000'000;

// Motion of a body under gravity alone. Its angular momentum L about the centre of mass is constant in W, and w_B =
// J^-1 R^T L is integrated; the centre of mass follows a parabola.
TargetMotion fly_freely(const TargetSetup& target, const TargetMotion& at_t0, double t0, double t1,
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
  control.max_steps = kMostSteps;
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
                              const Vector3d& gravity, const IntegrationSetup& integration,
                              std::span<const LoadSetup> loads, const std::function<void(double t)>& each_step,
                              const std::optional<OrbitSetup>& orbit) {
  if (t0 == t1) return at_t0;
  const std::string body = target_body_name(target.name);
  if (!orbit && std::none_of(loads.begin(), loads.end(), [&](const LoadSetup& load) { return load.body == body; }))
    return fly_freely(target, at_t0, t0, t1, gravity);
  const Model model = ModelBuilder().add(target_body(target)).build();
  PhaseSetup setup;
  setup.gravity = gravity;
  setup.loads = loads_on(model, loads);
  if (orbit) setup.orbit = reference_orbit(*orbit);
  PhaseDynamics dynamics(model, setup);
  State state = zero_state(model);
  set_root_pose(model, 0, at_t0.X_WT, state);
  set_root_twist(model, 0, at_t0.V_WT, state);
  StepWatch watch;
  watch.each_step = each_step;
  const PhaseOutcome outcome = simulate_phase(dynamics, state, t0, t1, integration, watch);
  if (!outcome.finished)
    throw std::runtime_error(fmt::format("propagating target '{}': {}", target.name, outcome.failure));
  return {root_pose(model, outcome.end_state, 0), root_twist(model, outcome.end_state, 0)};
}

TargetMotion propagate_target(const CaptureProblem& problem, const TargetSetup& target, const TargetMotion& at_t0,
                              double t0, double t1, const std::function<void(double t)>& each_step) {
  return propagate_target(target, at_t0, t0, t1, problem.gravity, problem.integration, problem.loads, each_step,
                          problem.orbit);
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

namespace {

Goal::Orientation orientation_of(const GraspSetup& grasp) {
  return grasp.orientation == GraspSetup::Orientation::axis   ? Goal::Orientation::axis
         : grasp.orientation == GraspSetup::Orientation::pose ? Goal::Orientation::pose
                                                              : Goal::Orientation::free;
}

// Used only for orientation by axis, which requires it.
Vector3d approach_axis(const CaptureProblem& problem, const GraspSetup& grasp) {
  return end_effector_of(problem, grasp).approach_axis.value_or(Vector3d{1, 0, 0});
}

}  // namespace

// Grasps and targets at the capture => goals: pose and twist of each grasp point in W plus the demanded relative twist,
// direction, and half of the capture envelope as accepted errors.
std::vector<Goal> capture_goals(const CaptureProblem& problem, const Model& model, const TargetPlan& targets) {
  std::vector<Goal> goals;
  for (const GraspSetup& grasp : problem.grasps) {
    const GraspPoint& point = grasp_point_of(problem, grasp);
    const TargetMotion& at = targets.capture[target_index(problem, grasp.target)];
    Goal g;
    g.frame = model.frame_index(grasp.end_effector);
    g.name = grasp.end_effector, g.target = grasp.target, g.point = grasp.grasp_point;
    g.X_WG = at.X_WT * point.X_TG;
    g.V_WG = shift(at.V_WT, at.X_WT.R * point.X_TG.p);
    g.V_WG += Twistd{grasp.relative_angular_velocity, grasp.relative_velocity};
    g.orientation = orientation_of(grasp);
    if (point.approach_direction) g.direction_W = at.X_WT.R * *point.approach_direction;
    g.axis_E = approach_axis(problem, grasp);
    // Half of the gripper's envelope is reserved for control errors.
    if (const auto& envelope = end_effector_of(problem, grasp).envelope) {
      g.accepted_distance = std::isfinite(envelope->position) ? 0.5 * envelope->position : 0;
      g.accepted_angle = std::isfinite(envelope->angle) ? 0.5 * envelope->angle : 0;
    }
    goals.push_back(g);
  }
  return goals;
}

std::vector<StraightGoal> straight_goals(const CaptureProblem& problem, const Model& model) {
  std::vector<StraightGoal> goals;
  for (const GraspSetup& grasp : problem.grasps) {
    const GraspPoint& point = grasp_point_of(problem, grasp);
    goals.push_back({model.frame_index(grasp.end_effector), grasp.end_effector,
                     static_cast<int>(target_index(problem, grasp.target)), point.X_TG,
                     point.approach_direction.value_or(Vector3d{1, 0, 0}), orientation_of(grasp),
                     approach_axis(problem, grasp), grasp.target, grasp.grasp_point,
                     problem.approach->straight_in->roll == StraightIn::Roll::matched});
  }
  return goals;
}

// Approach settings => demand of (6.2): stated rates first, then approach.match; without either, twist for a search and
// given (zero) rates for stated joints.
RateDemand rate_demand(const ApproachSetup& approach) {
  if (approach.final_rates) return RateDemand::given;
  if (!approach.match) return approach.plan ? RateDemand::twist : RateDemand::given;
  switch (*approach.match) {
    case RateMatch::velocity:
      return RateDemand::velocity;
    case RateMatch::twist:
      return RateDemand::twist;
    case RateMatch::velocity_least_rates:
      break;
  }
  return RateDemand::linear;
}

}  // namespace grapnel
