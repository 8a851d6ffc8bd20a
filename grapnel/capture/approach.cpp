#include "grapnel/capture/approach.hpp"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "grapnel/dynamics/free_floating.hpp"
#include "grapnel/simulate/simulate_phase.hpp"

namespace grapnel {
namespace {

const TargetSetup& target_named(const CaptureProblem& problem, const std::string& name, std::size_t& at) {
  at = static_cast<std::size_t>(std::find_if(problem.targets.begin(), problem.targets.end(),
                                             [&](const TargetSetup& t) { return t.name == name; }) -
                                problem.targets.begin());
  return problem.targets.at(at);
}

// Twist a gripping end-effector should have: the grasp point's velocity, with the target's spin or none.
Twistd demanded_twist(const CaptureProblem& problem, const TargetPlan& targets, const GraspSetup& grasp) {
  std::size_t at = 0;
  const TargetSetup& target = target_named(problem, grasp.target, at);
  const auto point = std::find_if(target.grasp_points.begin(), target.grasp_points.end(),
                                  [&](const GraspPoint& g) { return g.name == grasp.grasp_point; });
  const TargetMotion& motion = targets.capture[at];
  Twistd V = shift(motion.V_WT, motion.X_WT.R * point->X_TG.p);
  if (problem.approach->match != RateMatch::twist) V.angular = Vector3d::zero();
  return V;
}

// The servicer at the end of an ideally tracked approach with these final rates.
State ideal_end_state(const CaptureProblem& problem, const CaptureSystem& servicer, const State& start,
                      const std::vector<double>& rates) {
  PhaseSetup setup;
  setup.drives = approach_drives(problem, servicer, rates);
  for (JointDrive& drive : setup.drives) drive.control = JointControl::prescribed;
  setup.gravity = problem.gravity;
  setup.held_root = problem.robot.base_mode == RobotSetup::Base::held ? servicer.base : -1;
  PhaseDynamics dynamics(servicer.model, setup);
  const PhaseOutcome outcome = simulate_phase(dynamics, start, 0, problem.approach->duration, 0, problem.integration);
  if (!outcome.finished) throw std::runtime_error("planning the approach: " + outcome.failure);
  return outcome.end_state;
}

struct RateSolution {
  Eigen::VectorXd rates;
  double unmatched;
};

// Least-squares, least-norm rates that give the gripping end-effectors the demanded motion at this state (2.3).
RateSolution demanded_rates(const CaptureProblem& problem, const CaptureSystem& servicer, const State& state,
                            const TargetPlan& targets) {
  const bool linear_only = problem.approach->match == RateMatch::velocity_least_rates;
  const Eigen::Index rows = linear_only ? 3 : 6;
  const Eigen::Index count = static_cast<Eigen::Index>(problem.grasps.size());
  const Eigen::Index joints = static_cast<Eigen::Index>(servicer.robot_joints.size());
  Eigen::MatrixXd J(rows * count, joints);
  Eigen::VectorXd b(rows * count);
  const Model& model = servicer.model;
  const Kinematics kinematics = forward_kinematics(model, state);
  // A held base does not move with the joints: then the ordinary Jacobian rules.
  const bool floating = problem.robot.base_mode == RobotSetup::Base::free;
  const int roots[] = {servicer.base};
  const Momentumd momentum = momentum_about(model, kinematics, center_of_mass(model, kinematics, roots), roots);
  for (Eigen::Index i = 0; i < count; ++i) {
    const GraspSetup& grasp = problem.grasps[i];
    const int frame = model.frame_index(grasp.end_effector);
    const Twistd V = demanded_twist(problem, targets, grasp);
    Eigen::VectorXd demand(6);
    demand << V.angular[0], V.angular[1], V.angular[2], V.linear[0], V.linear[1], V.linear[2];
    Eigen::MatrixXd J_E;
    if (floating) {
      J_E = generalized_jacobian(model, state, servicer.base, frame);
      const Vector3d p = frame_pose(model, kinematics, frame).p;
      demand -= momentum_twist(model, state, servicer.base, model.frames()[frame].body, p, momentum);
    } else {
      J_E = frame_jacobian(model, kinematics, frame)(Eigen::all, joint_velocities(model, servicer.base));
    }
    J.middleRows(rows * i, rows) = J_E.bottomRows(rows);
    b.segment(rows * i, rows) = demand.tail(rows);
  }
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> solver;
  solver.setThreshold(1e-10);
  solver.compute(J);
  RateSolution solution{solver.solve(b), 0};
  solution.unmatched = (J * solution.rates - b).lpNorm<Eigen::Infinity>();
  return solution;
}

}  // namespace

TargetMotion propagate_target(const TargetSetup& target, const TargetMotion& at_t0, double t0, double t1,
                              const Vector3d& gravity, const IntegrationSetup& integration) {
  if (t0 == t1) return at_t0;
  const Model model = ModelBuilder().add(target_body(target)).build();
  PhaseSetup setup;
  setup.gravity = gravity;
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
    const bool at_start = t.given_at == TargetSetup::Instant::start;
    plan.start.push_back(at_start ? given : propagate_target(t, given, T, 0, problem.gravity, problem.integration));
    plan.capture.push_back(at_start ? propagate_target(t, given, 0, T, problem.gravity, problem.integration) : given);
  }
  return plan;
}

RatePlan plan_final_rates(const CaptureProblem& problem, const TargetPlan& targets) {
  const ApproachSetup& approach = *problem.approach;
  const CaptureSystem servicer = make_servicer(problem);
  RatePlan plan;
  plan.rates.assign(servicer.robot_joints.size(), 0.0);
  if (approach.final_rates) plan.rates = *approach.final_rates;
  if (!approach.match || approach.final_rates) return plan;

  // theta_dot <- rates demanded at the configuration reached with theta_dot. The configuration depends on the rates
  // only through the base's path, so plain iteration contracts quickly (a factor of 10 or more for a heavy base).
  const State start = initial_servicer_state(problem, servicer);
  constexpr int kMaxIterations = 60;
  double change = 0;
  for (plan.iterations = 1; plan.iterations <= kMaxIterations; ++plan.iterations) {
    const RateSolution next =
        demanded_rates(problem, servicer, ideal_end_state(problem, servicer, start, plan.rates), targets);
    change = 0;
    double largest = 0;
    for (std::size_t j = 0; j < plan.rates.size(); ++j) {
      change = std::max(change, std::abs(next.rates[j] - plan.rates[j]));
      largest = std::max(largest, std::abs(next.rates[j]));
      plan.rates[j] = next.rates[j];
    }
    plan.unmatched = next.unmatched;
    if (!(std::isfinite(largest))) break;
    if (change <= 1e-13 * std::max(largest, 1e-3) || (plan.iterations > 20 && change <= 1e-10 * largest)) {
      if (plan.unmatched > 1e-9 * std::max(largest, 1e-3)) {
        plan.warning = fmt::format(
            "approach: no joint rates give the end-effectors the demanded motion at the final configuration; the "
            "largest "
            "component left unmatched is {:.3g} (m/s or rad/s)",
            plan.unmatched);
      }
      return plan;
    }
  }
  throw std::runtime_error(
      fmt::format("planning the approach: final joint rates did not converge in {} iterations (last change {:.3g} "
                  "rad/s); the final "
                  "configuration may be near a singularity of the generalized Jacobian",
                  kMaxIterations, change));
}

std::vector<JointDrive> approach_drives(const CaptureProblem& problem, const CaptureSystem& system,
                                        const std::vector<double>& final_rates) {
  const ApproachSetup& approach = *problem.approach;
  std::vector<JointDrive> drives(system.model.joints().size());
  for (std::size_t j = 0; j < system.robot_joints.size(); ++j) {
    JointDrive& drive = drives[system.robot_joints[j]];
    drive.path = {approach.profile,
                  approach.duration,
                  problem.joint_position[j],
                  approach.final_position[j],
                  problem.joint_rate.empty() ? 0.0 : problem.joint_rate[j],
                  final_rates[j]};
    if (approach.tracking.mode == TrackingSetup::Mode::pd) {
      drive.control = JointControl::pd;
      drive.kp = approach.tracking.kp[j];
      drive.kd = approach.tracking.kd[j];
    } else {
      drive.control = JointControl::prescribed;
    }
  }
  return drives;
}

}  // namespace grapnel
