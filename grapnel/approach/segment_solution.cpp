#include "grapnel/approach/segment_solution.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "grapnel/approach/plan_report.hpp"
#include "grapnel/approach/plan_simulation.hpp"
#include "grapnel/approach/simulated_solution.hpp"
#include "grapnel/plan/reach_failure.hpp"
#include "grapnel/plan/shooting.hpp"

namespace grapnel {
namespace {

// Base motion until a segment's end with fixed joints: with conserved momentum, and with loads and the orbital field.
struct Drift {
  Posed X_WB_free = Posed::identity(), X_WB = Posed::identity();
  Twistd V_WB_free = Twistd::zero(), V_WB = Twistd::zero();  // at the base's origin, in W
  double distance() const { return norm(X_WB.p - X_WB_free.p); }
  double turn() const { return rotation_angle(transpose(X_WB_free.R) * X_WB.R); }
};

// Segment => base pose and twist at its end with fixed joints, simulated with loads and orbital field, and by constant
// momentum. Empty without such effects or if the latter integration fails.
std::optional<Drift> drift(PlanningTask& task, const PlanDraft& draft, const ReachProblem& reach) {
  if (!task.base.floats() || !(loaded(task) || task.problem.orbit)) return {};
  const std::vector<double> at_rest(draft.position.size(), 0.0);
  const State end = planned_state(task, simulate_segment(task, draft, reach, {draft.position, at_rest}));
  Drift d;
  d.X_WB = root_pose(task.servicer.model, end, task.servicer.base);
  d.V_WB = root_twist(task.servicer.model, end, task.servicer.base);
  PathSegment segment(task.base, reach.start, task.motion);
  const SegmentEnd free = segment.integrate(draft.position, at_rest, false);
  task.rhs_evaluations += segment.rhs_evaluations();
  if (!free.finished) return {};
  d.X_WB_free = free.X_WB;
  task.base.place(draft.position);
  task.base.move(at_rest, task.motion.in_base(reach.start.end, free.X_WB));
  d.V_WB_free = free.X_WB.R * twist_from(task.base.base_twist());
  return d;
}

// Segment of a failed search => part of the message: the path of the centre of mass by momentum and, above 1 mm or 1
// mrad, the drift by loads and the orbital field.
std::string explain_base(PlanningTask& task, const PlanDraft& draft, const ReachProblem& reach) {
  constexpr double kWorthMention = 1e-3;  // [m and rad]
  if (!task.base.floats()) return {};
  const double span = reach.start.end - draft.time;
  const std::string by_momentum = fmt::format(
      "; a plan moves the joints, and the base by their reactions only: the servicer's initial momentum moves its "
      "centre of mass by {:.4g} m during the {:.6g} s of this segment",
      norm(task.motion.com_at(reach.start.end) - task.motion.com_at(draft.time)), span);
  std::optional<Drift> d;
  try {
    d = drift(task, draft, reach);
  } catch (const std::runtime_error&) {
    return by_momentum;  // the simulation failed: no result
  }
  if (!d || (d->distance() < kWorthMention && d->turn() < kWorthMention)) return by_momentum;
  const Vector3d moved = d->X_WB.p - d->X_WB_free.p;
  return by_momentum +
         fmt::format("; {} the base by a further {:.4g} m ([{:.4g}, {:.4g}, {:.4g}]) and {:.4g} rad with fixed joints",
                     loaded(task) && task.problem.orbit ? "loads and the orbit's field move"
                     : loaded(task)                     ? "loads (external_wrenches) move"
                                                        : "the orbit's field moves",
                     d->distance(), moved[0], moved[1], moved[2], d->turn());
}

[[noreturn]] void refuse_unreachable(PlanningTask& task, PlanDraft& draft, const ReachProblem& reach,
                                     const ReachSolution& solution, const std::string& what) {
  constexpr double kMissed = 1e-5;  // [m]
  const bool misses =
      std::any_of(solution.miss.begin(), solution.miss.end(), [](const GoalMiss& m) { return m.distance > kMissed; });
  const std::string base =
      misses ? explain_base(task, draft, reach) : "";  // before the report changes the joint values
  report(task, draft, reach, solution);
  throw Unplannable(fmt::format("planning the approach{}: {}{}", what, solution.failure, base));
}

// Goals and end states of the flexible and the rigid servicer => goals for the rigid one, shifted by the deflection of
// pose and twist (22.10); unchanged without flexible links.
std::vector<Goal> less_bending(const PlanningTask& task, std::vector<Goal> goals, const State& simulated,
                               const State& rigid) {
  if (!bends(task)) return goals;
  const Kinematics bent = forward_kinematics(task.simulated_servicer.model, simulated),
                   straight = forward_kinematics(task.servicer.model, rigid);
  for (Goal& goal : goals) {
    const int frame = task.simulated_servicer.model.frame_index(task.servicer.model.frames()[goal.frame].name);
    const Posed is = frame_pose(task.simulated_servicer.model, bent, frame),
                taken_for = frame_pose(task.servicer.model, straight, goal.frame);
    const Rotationd back = taken_for.R * transpose(is.R);
    goal.X_WG.p += taken_for.p - is.p;
    goal.X_WG.R = back * goal.X_WG.R;
    goal.direction_W = back * goal.direction_W;
    goal.V_WG += frame_twist(task.servicer.model, straight, goal.frame) -
                 frame_twist(task.simulated_servicer.model, bent, frame);
  }
  return goals;
}

// Final values and spline => part of a warning: largest base rotation and wheel rates over their limits in a simulation
// with exact tracking; empty if the base does not float.
std::string what_it_does(PlanningTask& task, const PlanDraft& draft, const ReachProblem& reach,
                         const SegmentValues& values) {
  if (!task.base.floats()) return {};
  const Rotationd R_from = task.attitude_held() ? draft.X_WB.R : task.problem.X_WB.R;
  const Model& model = task.simulated_servicer.model;
  double turn = 0, share = 0;
  StepWatch watch;
  watch.check = [&](double, const State& state, const PhaseIntegrals&) {
    turn = std::max(turn, rotation_angle(transpose(R_from) * root_pose(model, state, task.simulated_servicer.base).R));
    for (std::size_t w = 0; w < task.simulated_servicer.wheels.size(); ++w) {
      const Body& body = model.bodies()[model.joints()[static_cast<std::size_t>(task.simulated_servicer.wheels[w])]];
      share = std::max(share, std::abs(state.v[static_cast<std::size_t>(body.v)]) / task.problem.robot.wheels[w].rate);
    }
  };
  watch.checks = 128;
  simulate_segment(task, draft, reach, values, watch);
  std::string text =
      fmt::format("; in a simulation with exact joint tracking, its base rotates by up to {:.3g} rad from {}", turn,
                  task.attitude_held() ? "its desired attitude" : "its initial attitude");
  if (share > 0) text += fmt::format(", and its wheels reach {:.3g} of their maximum rates", share);
  return text;
}

// Final values and spline => errors at the end of their simulation: of the goals, and of the rates against (6.3) with
// the momentum at that end.
SimulatedEnd disturbed_end(PlanningTask& task, const PlanDraft& draft, const ReachProblem& reach,
                           const SegmentValues& values) {
  const State simulated = simulate_segment(task, draft, reach, values);
  const State end = planned_state(task, simulated);
  const std::vector<Goal> goals = less_bending(task, reach.goals, simulated, end);
  const Posed X_WB = root_pose(task.servicer.model, end, task.servicer.base);
  task.base.place(values.position);
  SimulatedEnd result;
  goal_error(task.base, X_WB, goals, result.error);
  result.gap = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(values.rate.size()));
  if (reach.demand == RateDemand::given) return result;
  const FreeMotion now = free_motion(task.servicer.model, end, reach.start.end, task.problem.gravity);
  // An attitude-controlled base rotates by the lag of its control.
  const DemandedRates demanded =
      demanded_rates(task.base, X_WB, now.in_base(reach.start.end, X_WB), goals, reach.demand, turn_beside(task, end));
  for (std::size_t j = 0; j < values.rate.size(); ++j) {
    const auto k = static_cast<Eigen::Index>(j);
    result.gap[k] = demanded.rates[k] - values.rate[j];
  }
  result.unmet = demanded.unmet;
  return result;
}

// Stated final joints and rates without disturbances => rates that meet the demand at the end of a simulation, or the
// given ones with a warning if they do not converge.
std::vector<double> disturbed_rates(PlanningTask& task, PlanDraft& draft, const ReachProblem& reach,
                                    const std::vector<double>& position, const std::vector<double>& undisturbed) {
  // The final poses are given; their error is not considered.
  const Simulation simulation = [&](const std::vector<double>& p, const std::vector<double>& r) {
    SimulatedEnd end = disturbed_end(task, draft, reach, {p, r});
    end.error.setZero();
    return end;
  };
  const SimulatedSolution simulated = solve_by_simulations(simulation, position, undisturbed, {}, {}, kArrived);
  if (simulated.found) {
    draft.plan.report.unmet_rate = simulated.end.unmet;
    return simulated.rate;
  }
  draft.plan.warnings.push_back(
      fmt::format("approach: final joint rates did not converge under {}; the plan uses the rates computed without "
                  "them, so the end-effectors' final motion differs from the demanded one",
                  disturbances(task)));
  return undisturbed;
}

}  // namespace

ReachSolution solve_segment(PlanningTask& task, PlanDraft& draft, const ReachProblem& reach, const std::string& what) {
  const ReachSolution solution = plan_reach(task.base, reach);
  task.rhs_evaluations += solution.rhs_evaluations;
  if (!solution.found) refuse_unreachable(task, draft, reach, solution, what);
  return solution;
}

ReachSolution solve_where_loads_lead(PlanningTask& task, PlanDraft& draft, const ReachProblem& reach,
                                     const std::string& what) {
  constexpr double kFar = 1e-2;  // [m and rad]; a nearer base is found by corrections
  ReachSolution plain = plan_reach(task.base, reach);
  task.rhs_evaluations += plain.rhs_evaluations;
  if (plain.found) return plain;
  std::optional<Drift> d;
  if (!depends_on_path(reach)) d = drift(task, draft, reach);
  if (!d || (d->distance() < kFar && d->turn() < kFar)) refuse_unreachable(task, draft, reach, plain, what);
  // Goals as a base sees them that has not drifted.
  ReachProblem seen = reach;
  const Posed X = d->X_WB_free * inverse(d->X_WB);
  for (Goal& g : seen.goals) {
    const Twistd carried = shift(d->V_WB, g.X_WG.p - d->X_WB.p);
    g.X_WG = X * g.X_WG;
    g.V_WG = X.R * (g.V_WG - carried) + shift(d->V_WB_free, g.X_WG.p - d->X_WB_free.p);
    g.direction_W = X.R * g.direction_W;
  }
  ReachSolution led = plan_reach(task.base, seen);
  task.rhs_evaluations += led.rhs_evaluations;
  if (!led.found || led.approximate) refuse_unreachable(task, draft, reach, plain, what);
  return led;
}

ReachSolution allow_for_disturbance(PlanningTask& task, PlanDraft& draft, const ReachProblem& reach,
                                    ReachSolution solution, const std::string& what) {
  const Simulation simulation = [&](const std::vector<double>& position, const std::vector<double>& rate) {
    return disturbed_end(task, draft, reach, {position, rate, solution.knots, solution.coefficients});
  };
  const SimulatedSolution simulated =
      solve_by_simulations(simulation, solution.position, solution.rate, reach.lower, reach.upper, kArrived);
  solution.iterations += simulated.iterations;
  solution.position = simulated.position, solution.rate = simulated.rate;
  solution.miss = misses(reach.goals, simulated.end.error);
  solution.unmet_rate = simulated.end.unmet;
  if (simulated.found) {
    if (depends_on_path(reach) && task.begin == 0 && !planned_robot(task).empty()) {
      draft.plan.warnings.push_back(fmt::format(
          "approach: the plan satisfies joint limits, clearance and other path constraints for a robot that {}; the "
          "simulated robot uses corrected final values, and the run checks its limits and clearance{}",
          planned_robot(task), what_it_does(task, draft, reach, values_of(solution))));
    }
    return solution;
  }
  solution.found = false;
  report(task, draft, reach, solution);
  std::string text;
  for (std::size_t i = 0; i < solution.miss.size(); ++i) {
    text += fmt::format("{}end-effector '{}' remains {:.3g} m", text.empty() ? "" : ", ", reach.goals[i].name,
                        solution.miss[i].distance);
    if (reach.goals[i].orientation != Goal::Orientation::free)
      text += fmt::format(" and {:.3g} rad", solution.miss[i].angle);
  }
  throw Unplannable(
      fmt::format("planning the approach{}: a plan without {} exists, but {} corrections for their effect did not "
                  "converge: {} from its grasp point; another approach.plan.guess may help",
                  what, disturbances(task), simulated.iterations, text));
}

std::vector<double> settled_rates(PlanningTask& task, PlanDraft& draft, const ReachProblem& reach,
                                  const std::vector<double>& position) {
  const std::size_t n = position.size();
  if (reach.demand == RateDemand::given)
    return reach.given_rates.empty() ? std::vector<double>(n, 0.0) : reach.given_rates;
  Shooting shooting(task.base, reach);
  const ShootingIterate iterate = shooting.shoot(position, std::vector<double>(n, 0.0));
  task.rhs_evaluations += shooting.rhs_evaluations();
  if (!iterate.valid) {
    throw Unplannable(
        "planning the approach: final joint rates did not converge; the final configuration may be near a singularity "
        "of the generalized Jacobian; other final_joints, or given final_rates, may help");
  }
  warn_of_rates(task, draft, iterate.rate, iterate.unmet, reach.start.end);
  draft.plan.report.unmet_rate = iterate.unmet;
  return disturbed(task) ? disturbed_rates(task, draft, reach, position, iterate.rate) : iterate.rate;
}

}  // namespace grapnel
