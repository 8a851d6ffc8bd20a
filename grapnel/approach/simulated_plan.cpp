/// Corrections of plans by forward simulation with all loads, for effects outside the momentum integral.

#include <fmt/format.h>

#include <algorithm>

#include "grapnel/approach/approach_planner.hpp"

namespace grapnel {

bool ApproachPlanner::disturbed() const {
  return bends() || loaded() || approach_.base_control.has_value() || problem_.orbit.has_value() || has_rotors();
}

// Settings => differences between planned and simulated robot as a predicate ("is rigid and has no loads"); empty if
// none.
std::string ApproachPlanner::planned_robot() const {
  std::vector<std::string> differs;
  if (bends()) differs.push_back("is rigid");
  if (attitude_held()) {
    differs.push_back("holds its base's attitude exactly");
  } else if (approach_.base_control) {
    differs.push_back("floats freely, since the attitude control is too weak to hold the attitude during the motion");
  } else if (has_rotors() && base_.floats()) {
    differs.push_back("floats freely, with its rotors fixed to the base");
  }
  if (problem_.orbit) differs.push_back("has no orbital field");
  if (loaded()) differs.push_back("has no loads");
  return fmt::format("{}", fmt::join(differs, " and "));
}

void ApproachPlanner::warn_of_thrusters() {
  const std::optional<BaseControlSetup>& control = approach_.base_control;
  if (!control ||
      control->actuators.value_or(BaseControlSetup::Actuators::wheels) == BaseControlSetup::Actuators::wheels)
    return;
  plan_.warnings.push_back(
      "approach: the plan assumes a base torque equal to the attitude control's demand at all times, and no force; the "
      "thrusters switch on and off, and the end-effectors miss their goals by the resulting error");
}

std::string ApproachPlanner::disturbances() const {
  return std::string(problem_.orbit ? "the orbit's field, " : "") +
         (simulated_servicer_.wheels.empty() ? "" : "the reaction wheels, ") +
         (simulated_servicer_.gyros.empty() ? "" : "the control moment gyros, ") +
         (bends() ? "flexible bodies, " : "") + (targets_.contacts.empty() ? "" : "contacts of the targets, ") +
         "the loads or the base's attitude control";
}

bool ApproachPlanner::targets_loaded() const {
  return std::any_of(problem_.loads.begin(), problem_.loads.end(), [&](const LoadSetup& load) {
    return std::any_of(problem_.grasps.begin(), problem_.grasps.end(), [&](const GraspSetup& g) {
      return load.body == BodyName::of_target(target_index(problem_, g.target));
    });
  });
}

// Goals and end states of the flexible and the rigid servicer => goals for the rigid one, shifted by the deflection of
// pose and twist (22.10); unchanged without flexible links.
std::vector<Goal> ApproachPlanner::less_bending(std::vector<Goal> goals, const State& simulated,
                                                const State& rigid) const {
  if (!bends()) return goals;
  const Kinematics bent = forward_kinematics(simulated_servicer_.model, simulated),
                   straight = forward_kinematics(servicer_.model, rigid);
  for (Goal& goal : goals) {
    const int frame = simulated_servicer_.model.frame_index(servicer_.model.frames()[goal.frame].name);
    const Posed is = frame_pose(simulated_servicer_.model, bent, frame),
                taken_for = frame_pose(servicer_.model, straight, goal.frame);
    const Rotationd back = taken_for.R * transpose(is.R);
    goal.X_WG.p += taken_for.p - is.p;
    goal.X_WG.R = back * goal.X_WG.R;
    goal.direction_W = back * goal.direction_W;
    goal.V_WG +=
        frame_twist(servicer_.model, straight, goal.frame) - frame_twist(simulated_servicer_.model, bent, frame);
  }
  return goals;
}

State ApproachPlanner::simulate_disturbed(const ReachProblem& reach, const std::vector<double>& position,
                                          const std::vector<double>& rate, const Spline& spline,
                                          const StepWatch& watch) {
  std::vector<JointTrajectory> joints = plan_.joints;
  SegmentStart start = reach.start;
  start.knots = spline.knots;
  PathSegment segment(base_, start, motion_);
  for (std::size_t j = 0; j < position.size(); ++j) {
    const auto segments = segment.joint_segments(static_cast<int>(j), position[j], rate[j], spline.coefficients);
    joints[j].segments.insert(joints[j].segments.end(), segments.begin(), segments.end());
  }
  return simulate(joints, reach.start.end, watch);
}

// Joint trajectories => state of the servicer at `end` in a simulation of all loads with exact tracking; with a probe
// in at least 400 steps. Throws std::runtime_error if the simulation fails.
State ApproachPlanner::simulate(const std::vector<JointTrajectory>& joints, double end, StepWatch watch) {
  PhaseDynamics dynamics(simulated_servicer_.model,
                         approach_setup(problem_, simulated_servicer_, simulated_start_, joints, true));
  watch.each_step = each_step();
  IntegrationSetup integration = problem_.integration;
  if (watch.probe) {
    // Inside a long step the state is known to order 7 only.
    constexpr double kSteps = 400;
    const double max_step = (end - begin_) / kSteps;
    integration.max_step = integration.max_step > 0 ? std::min(integration.max_step, max_step) : max_step;
  }
  const PhaseOutcome outcome = simulate_phase(dynamics, {simulated_start_, begin_, end}, integration, {.watch = watch});
  if (!outcome.finished) throw std::runtime_error("planning the approach: " + outcome.failure);
  plan_.report.rhs_evaluations += outcome.rhs_evaluations;
  return outcome.end_state;
}

// Segment => base pose and twist at its end with fixed joints, simulated with loads and orbital field, and by constant
// momentum. Empty without such effects or if the latter integration fails.
std::optional<ApproachPlanner::Drift> ApproachPlanner::drift(const ReachProblem& reach) {
  if (!base_.floats() || !(loaded() || problem_.orbit)) return {};
  const std::vector<double> at_rest(position_.size(), 0.0);
  const State end =
      without_inner_motion(simulated_servicer_, simulate_disturbed(reach, position_, at_rest, {}), servicer_);
  Drift d;
  d.X_WB = root_pose(servicer_.model, end, servicer_.base);
  d.V_WB = root_twist(servicer_.model, end, servicer_.base);
  PathSegment segment(base_, reach.start, motion_);
  const SegmentEnd free = segment.integrate(position_, at_rest, false);
  plan_.report.rhs_evaluations += segment.rhs_evaluations();
  if (!free.finished) return {};
  d.X_WB_free = free.X_WB;
  base_.place(position_);
  base_.move(at_rest, motion_.in_base(reach.start.end, free.X_WB));
  d.V_WB_free = free.X_WB.R * twist_from(base_.base_twist());
  return d;
}

// Segment of a failed search => part of the message: the path of the centre of mass by momentum and, above 1 mm or 1
// mrad, the drift by loads and the orbital field.
std::string ApproachPlanner::explain_base(const ReachProblem& reach) {
  constexpr double kWorthMention = 1e-3;  // [m and rad]
  if (!base_.floats()) return {};
  const double span = reach.start.end - time_;
  const std::string by_momentum = fmt::format(
      "; a plan moves the joints, and the base by their reactions only: the servicer's initial momentum moves its "
      "centre of mass by {:.4g} m during the {:.6g} s of this segment",
      norm(motion_.com_at(reach.start.end) - motion_.com_at(time_)), span);
  std::optional<Drift> d;
  try {
    d = drift(reach);
  } catch (const std::runtime_error&) {
    return by_momentum;  // the simulation failed: no result
  }
  if (!d || (d->distance() < kWorthMention && d->turn() < kWorthMention)) return by_momentum;
  const Vector3d moved = d->X_WB.p - d->X_WB_free.p;
  return by_momentum +
         fmt::format("; {} the base by a further {:.4g} m ([{:.4g}, {:.4g}, {:.4g}]) and {:.4g} rad with fixed joints",
                     loaded() && problem_.orbit ? "loads and the orbit's field move"
                     : loaded()                 ? "loads (external_wrenches) move"
                                                : "the orbit's field moves",
                     d->distance(), moved[0], moved[1], moved[2], d->turn());
}

// Segment => solution without loads or, if there is none and the base drifts by more than 1 cm or 0.01 rad, one to
// goals that are moved back by the drift. Throws Unplannable.
ReachSolution ApproachPlanner::solve_where_loads_lead(const ReachProblem& reach, const std::string& what) {
  constexpr double kFar = 1e-2;  // [m and rad]; a nearer base is found by corrections
  ReachSolution plain = plan_reach(base_, reach);
  plan_.report.rhs_evaluations += plain.rhs_evaluations;
  if (plain.found) return plain;
  std::optional<Drift> d;
  if (!depends_on_path(reach)) d = drift(reach);
  if (!d || (d->distance() < kFar && d->turn() < kFar)) refuse_unreachable(reach, plain, what);
  // Goals as a base sees them that has not drifted.
  ReachProblem seen = reach;
  const Posed X = d->X_WB_free * inverse(d->X_WB);
  for (Goal& g : seen.goals) {
    const Twistd carried = shift(d->V_WB, g.X_WG.p - d->X_WB.p);
    g.X_WG = X * g.X_WG;
    g.V_WG = X.R * (g.V_WG - carried) + shift(d->V_WB_free, g.X_WG.p - d->X_WB_free.p);
    g.direction_W = X.R * g.direction_W;
  }
  ReachSolution led = plan_reach(base_, seen);
  plan_.report.rhs_evaluations += led.rhs_evaluations;
  if (!led.found || led.approximate) refuse_unreachable(reach, plain, what);
  return led;
}

// Final values and spline => part of a warning: largest base rotation and wheel rates over their limits in a simulation
// with exact tracking; empty if the base does not float.
std::string ApproachPlanner::what_it_does(const ReachProblem& reach, const std::vector<double>& position,
                                          const std::vector<double>& rate, const Spline& spline) {
  if (!base_.floats()) return {};
  const Rotationd R_from = attitude_held() ? X_WB_.R : problem_.X_WB.R;
  const Model& model = simulated_servicer_.model;
  double turn = 0, share = 0;
  StepWatch watch;
  watch.check = [&](double, const State& state, const PhaseIntegrals&) {
    turn = std::max(turn, rotation_angle(transpose(R_from) * root_pose(model, state, simulated_servicer_.base).R));
    for (std::size_t w = 0; w < simulated_servicer_.wheels.size(); ++w) {
      const Body& body = model.bodies()[model.joints()[static_cast<std::size_t>(simulated_servicer_.wheels[w])]];
      share = std::max(share, std::abs(state.v[static_cast<std::size_t>(body.v)]) / problem_.robot.wheels[w].rate);
    }
  };
  watch.checks = 128;
  simulate_disturbed(reach, position, rate, spline, watch);
  std::string text =
      fmt::format("; in a simulation with exact joint tracking, its base rotates by up to {:.3g} rad from {}", turn,
                  attitude_held() ? "its desired attitude" : "its initial attitude");
  if (share > 0) text += fmt::format(", and its wheels reach {:.3g} of their maximum rates", share);
  return text;
}

// Final values and spline => errors at the end of their simulation: of the goals, and of the rates against (6.3) with
// the momentum at that end.
SimulatedEnd ApproachPlanner::disturbed_end(const ReachProblem& reach, const std::vector<double>& position,
                                            const std::vector<double>& rate, const Spline& spline) {
  const State simulated = simulate_disturbed(reach, position, rate, spline);
  const State end = without_inner_motion(simulated_servicer_, simulated, servicer_);
  const std::vector<Goal> goals = less_bending(reach.goals, simulated, end);
  const Posed X_WB = root_pose(servicer_.model, end, servicer_.base);
  base_.place(position);
  SimulatedEnd result;
  goal_error(base_, X_WB, goals, result.error);
  result.gap = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(rate.size()));
  if (reach.demand == RateDemand::given) return result;
  const FreeMotion now = free_motion(servicer_.model, end, reach.start.end, problem_.gravity);
  // An attitude-controlled base rotates by the lag of its control.
  const DemandedRates demanded =
      demanded_rates(base_, X_WB, now.in_base(reach.start.end, X_WB), goals, reach.demand, turn_beside(end));
  for (std::size_t j = 0; j < rate.size(); ++j) {
    const auto k = static_cast<Eigen::Index>(j);
    result.gap[k] = demanded.rates[k] - rate[j];
  }
  result.unmet = demanded.unmet;
  return result;
}

// Solution without disturbances => solution whose simulation meets the goals, by Newton's method on simulations
// (docs/theory, section 6.2), with a warning if path constraints apply. Throws Unplannable.
ReachSolution ApproachPlanner::allow_for_disturbance(const ReachProblem& reach, ReachSolution solution,
                                                     const std::string& what) {
  const Spline spline{solution.knots, solution.coefficients};
  const Simulation simulation = [&](const std::vector<double>& position, const std::vector<double>& rate) {
    return disturbed_end(reach, position, rate, spline);
  };
  const SimulatedSolution simulated =
      solve_by_simulations(simulation, solution.position, solution.rate, reach.lower, reach.upper, kArrived);
  solution.iterations += simulated.iterations;
  solution.position = simulated.position, solution.rate = simulated.rate;
  solution.miss = misses(reach.goals, simulated.end.error);
  solution.unmet_rate = simulated.end.unmet;
  if (simulated.found) {
    if (depends_on_path(reach) && reports_model_difference()) {
      plan_.warnings.push_back(fmt::format(
          "approach: the plan satisfies joint limits, clearance and other path constraints for a robot that {}; the "
          "simulated robot uses corrected final values, and the run checks its limits and clearance{}",
          planned_robot(), what_it_does(reach, solution.position, solution.rate, spline)));
    }
    return solution;
  }
  solution.found = false;
  report(reach, solution);
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
                  what, disturbances(), simulated.iterations, text));
}

// Stated final joints and rates without disturbances => rates that meet the demand at the end of a simulation, or the
// given ones with a warning if they do not converge.
std::vector<double> ApproachPlanner::disturbed_rates(const ReachProblem& reach, const std::vector<double>& position,
                                                     const std::vector<double>& undisturbed) {
  // The final poses are given; their error is not considered.
  const Simulation simulation = [&](const std::vector<double>& p, const std::vector<double>& r) {
    SimulatedEnd end = disturbed_end(reach, p, r, {});
    end.error.setZero();
    return end;
  };
  const SimulatedSolution simulated = solve_by_simulations(simulation, position, undisturbed, {}, {}, kArrived);
  if (simulated.found) {
    plan_.report.unmet_rate = simulated.end.unmet;
    return simulated.rate;
  }
  plan_.warnings.push_back(
      fmt::format("approach: final joint rates did not converge under {}; the plan uses the rates computed without "
                  "them, so the end-effectors' final motion differs from the demanded one",
                  disturbances()));
  return undisturbed;
}

}  // namespace grapnel
