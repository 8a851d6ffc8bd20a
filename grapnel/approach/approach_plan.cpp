#include "grapnel/approach/approach_plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "grapnel/approach/approach_planner.hpp"
#include "grapnel/approach/predicted_contacts.hpp"
#include "grapnel/model/coupling.hpp"
#include "grapnel/plan/path_constraint_check.hpp"
#include "grapnel/plan/reach_failure.hpp"
#include "grapnel/plan/shooting.hpp"
#include "grapnel/problem/contact_pairs.hpp"
#include "grapnel/problem/enumeration_names.hpp"
#include "grapnel/problem/plan_objectives.hpp"

namespace grapnel {

ApproachPlanner::ApproachPlanner(const CaptureProblem& problem, const TargetPlan& targets, CaptureDetail detail,
                                 const CaptureProgress& progress, double begin, ApproachPlan& plan)
    : problem_(problem),
      approach_(*problem.approach),
      targets_(predict_contacts(problem, targets, begin, problem.approach->duration, shown_on(progress))),
      detail_(detail),
      plan_(plan),
      begin_(begin),
      servicer_(make_servicer(problem)),
      simulated_servicer_(make_moving_servicer(problem)),
      simulated_start_(initial_servicer_state(problem, simulated_servicer_)),
      start_state_(without_inner_motion(simulated_servicer_, simulated_start_, servicer_)),
      base_(servicer_.model, problem.robot.base_mode == RobotSetup::Base::free),
      motion_(free_motion(servicer_.model, start_state_, begin, problem.gravity)),
      watch_(max_evaluations(), progress_callback(progress, max_evaluations())),
      time_(begin) {
  base_.be_watched_by(&watch_);
  hold_idle_joints();
  const std::size_t n = servicer_.robot_joints.size();
  position_ = problem.joint_position;
  rate_ = problem.joint_rate.empty() ? std::vector<double>(n, 0.0) : problem.joint_rate;
  X_WB_ = problem.X_WB;
  plan_.joints.resize(n);
  for (int j : servicer_.robot_joints) {
    const JointDescription& joint = servicer_.model.bodies()[servicer_.model.joints()[j]].description.joint;
    plan_.report.joints.push_back(joint.name);
    lower_.push_back(joint.limits.lower);
    upper_.push_back(joint.limits.upper);
    rate_limit_.push_back(joint.limits.rate);
    effort_limit_.push_back(joint.limits.effort);
  }
  if (approach_.base_control && base_.floats()) hold_attitude();
}

void ApproachPlanner::report_contacts() {
  if (problem_.contacts.empty() || problem_.grasps.empty()) return;  // without grasps there is no capture to disturb
  plan_.report.assumes =
      "targets touch each other and obstacles as predicted without the servicer, and the servicer touches nothing";
  for (const TargetContact& contact : targets_.contacts) {
    const std::string a = contact_name(problem_, contact.a), b = contact_name(problem_, contact.b);
    plan_.report.contacts.push_back({a, b, contact.time});
    for (const BodyName& body : {contact.a, contact.b}) {
      if (!body.target || problem_.targets[*body.target].given_at == TargetSetup::Instant::start) continue;
      plan_.warnings.push_back(fmt::format(
          "targets.{}.state: it is stated at the capture, t = {:.6g} s, but {} and {} touch before, at t = {:.6g} s: "
          "target '{}' moves differently from then on and does not have this state at the capture; state it at the "
          "start, or move what it touches",
          problem_.targets[*body.target].name, approach_.duration, a, b, contact.time,
          problem_.targets[*body.target].name));
    }
  }
}

// Problem => plan_: stated trajectories, or one segment per waypoint, then the final segment or the stand-off with the
// final straight approach. Throws Unplannable.
void ApproachPlanner::run() {
  report_contacts();
  if (approach_.sampled || !approach_.pieces.empty()) {
    follow_stated();
  } else {
    for (const Waypoint& w : approach_.waypoints) pass(w);
    const double final_segment_end = approach_.duration - (approach_.straight_in ? approach_.straight_in->duration : 0);
    if (approach_.straight_in) {
      stand_off_and_in(final_segment_end);
    } else {
      final_segment(final_segment_end);
    }
    if (approach_.plan) warn_of_thrusters();
  }
}

std::string ApproachPlanner::given_up() const {
  const PlanSetup plan = approach_.plan.value_or(PlanSetup{});
  return fmt::format(
      "planning the approach: evaluation limit reached after {} evaluations of the servicer's motion, in the segment "
      "that begins at t = {:.6g} s; the approach lasts {:.6g} s, and longer segments increase the joint motion and the "
      "cost of each of the search's {} initial guesses: shorten the last segment (waypoints, straight_in), reduce "
      "approach.plan.starts, set approach.plan.objective: as_found, or increase approach.plan.max_evaluations",
      plan.max_evaluations, time_, approach_.duration, plan.starts);
}

void ApproachPlanner::close() {
  plan_.report.final_position = position_;
  plan_.report.final_rates = rate_;
}

void ApproachPlanner::hold_attitude() {
  PlacedLinks links;
  base_.place(position_, links);
  const Symmetric3d inertia = links.composite[0].rotational_about_com();
  if (!holds_attitude(*approach_.base_control, inertia, shortest_motion())) return;
  base_.hold_attitude();
  X_WB_.R = attitude_control(*approach_.base_control, simulated_servicer_, simulated_start_).R_WD;
  X_WB_.p = motion_.p_WCom - X_WB_.R * links.com;
}

double ApproachPlanner::shortest_motion() const {
  const double end = approach_.duration - (approach_.straight_in ? approach_.straight_in->duration : 0);
  double shortest = approach_.straight_in ? std::min(end, approach_.straight_in->duration) : end, begin = 0;
  for (const Waypoint& w : approach_.waypoints) shortest = std::min(shortest, w.time - begin), begin = w.time;
  return begin > 0 ? std::min(shortest, end - begin) : shortest;
}

// Holds coupled joints, and joints without an end-effector of a grasp if the plan states it.
void ApproachPlanner::hold_idle_joints() {
  const Model& model = servicer_.model;
  const bool all_idle = approach_.plan && approach_.plan->idle_joints == PlanSetup::IdleJoints::held;
  if (!all_idle && model.couplings().empty()) return;
  std::vector<bool> held(static_cast<std::size_t>(base_.joints()));
  for (int j = 0; j < base_.joints(); ++j) {
    const auto carries = [&](const GraspSetup& g) { return base_.carries(j, model.frame_index(g.end_effector)); };
    held[static_cast<std::size_t>(j)] = is_coupled(model, model.joints()[static_cast<std::size_t>(j)]) ||
                                        (all_idle && std::ranges::none_of(problem_.grasps, carries));
  }
  base_.hold(std::move(held));
}

// Final values and spline of a segment => its joint trajectories in plan_, and time, joints, rates and base pose at its
// end. The base is integrated by (6.5) only if a later segment or a check needs its pose.
void ApproachPlanner::advance(double end, const std::vector<double>& position, const std::vector<double>& rate,
                              int knots, const std::vector<double>& coefficients) {
  SegmentStart start = segment_to(end);
  start.knots = knots;
  PathSegment segment(base_, start, motion_);
  SegmentEnd at_end;
  // The base pose at this time is needed by later segments and as a check.
  if (end < approach_.duration || detail_ == CaptureDetail::full) {
    at_end = segment.integrate(position, rate, false, SegmentAccuracy::full, coefficients);
    if (!at_end.finished) throw std::runtime_error("planning the approach: " + at_end.failure);
  }
  for (std::size_t j = 0; j < position.size(); ++j) {
    const auto segments = segment.joint_segments(static_cast<int>(j), position[j], rate[j], coefficients);
    plan_.joints[j].segments.insert(plan_.joints[j].segments.end(), segments.begin(), segments.end());
  }
  plan_.report.rhs_evaluations += segment.rhs_evaluations();
  time_ = end, position_ = position, rate_ = rate, X_WB_ = at_end.X_WB;
}

// End time, goals and demand => problem of one segment from the present state: limits (held joints: their values), the
// present joints as the guess, excursion (6.8a) as the objective.
ReachProblem ApproachPlanner::reach_to(double end, std::vector<Goal> goals, RateDemand demand) const {
  ReachProblem reach;
  reach.start = segment_to(end);
  reach.motion = motion_;
  reach.goals = std::move(goals);
  reach.demand = demand;
  reach.lower = lower_, reach.upper = upper_;
  for (std::size_t j = 0; j < position_.size(); ++j) {
    if (base_.is_held(static_cast<int>(j))) reach.lower[j] = reach.upper[j] = position_[j];
  }
  reach.rate_limit = rate_limit_;
  reach.guess = position_;
  reach.objective = Objective(Objective::Kind::excursion, reach.start, reach.guess, lower_, upper_);
  return reach;
}

// approach.plan => search, objective and path constraints (6.20) of `reach`. Throws Unplannable if a setting cannot be
// evaluated: wheel momentum without attitude control, clearance without pairs of bodies.
void ApproachPlanner::set_search(ReachProblem& reach) {
  const PlanSetup& plan = *approach_.plan;
  reach.starts = plan.starts, reach.seed = plan.seed;
  if (!plan.guess.empty()) reach.guess = plan.guess;
  reach.objective = Objective(objective_terms(plan), reach.start, reach.guess, lower_, upper_);
  PathConstraints& constraints = reach.constraints;
  constraints.limits = plan.limits == PlanSetup::Limits::during_approach;
  constraints.effort_limit = effort_limit_;
  constraints.base_turn = plan.base_turn.value_or(constraints.base_turn);
  constraints.R_WB0 = problem_.X_WB.R;
  constraints.clearance = plan.clearance;
  constraints.knots = plan.knots;
  if (plan.wheel_momentum || weight_in(plan, PlanSetup::Objective::wheel_momentum) > 0) set_wheels(constraints);
  if (attitude_held()) refuse_turning(plan);
  if (plan.clearance || weight_in(plan, PlanSetup::Objective::clearance) > 0) {
    constraints.bodies =
        constraint_bodies(problem_, servicer_, [this](std::size_t target, double t) { return target_at(target, t); });
    if (constraints.bodies->model.pairs().empty()) {
      throw Unplannable(
          "planning the approach: approach.plan requires clearance, but there is no pair of bodies to check: shapes "
          "('geometry') of the robot's links and of the targets are missing, or clearance.ignore or "
          "approach.plan.contacts: allowed excludes all pairs");
    }
    check_start_clearance(reach);
  }
  if (weight_in(plan, PlanSetup::Objective::impulse) > 0 || weight_in(plan, PlanSetup::Objective::impulse_index) > 0)
    constraints.end_measure = capture_measure(problem_, base_, motion_, reach.start.end, targets_.capture);
}

// State at the segment's begin => `reach` with the required clearance, which is reduced, with a warning, if the
// approach is replanned and the bodies are nearer. Otherwise throws Unplannable with the nearest pairs.
void ApproachPlanner::check_start_clearance(ReachProblem& reach) {
  if (!reach.constraints.clearance) return;
  constexpr double kRounding = 1e-6;  // [m]; plans satisfy the clearance to this tolerance
  constexpr std::size_t kNamed = 3;   // pairs
  PlacedLinks links;
  base_.place(position_, links);
  PathSegment::SegmentPoint start;
  start.time = time_, start.position = position_, start.rate = rate_, start.X_WB = X_WB_, start.placed = &links;
  start.acceleration.assign(position_.size(), 0.0);
  PathConstraintCheck check(base_, reach);
  std::vector<PathConstraintCheck::Found> found = check.scan(
      1, [&](int) { return start; }, 0, -std::numeric_limits<double>::infinity(), nullptr);
  std::erase_if(found, [](const PathConstraintCheck::Found& f) {
    return f.at.kind != PathConstraintCheck::Kind::clearance || f.value <= kRounding;
  });
  if (found.empty()) return;
  std::stable_sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.value > b.value; });
  const ConstraintBodies& bodies = *reach.constraints.bodies;
  std::set<std::pair<int, int>> seen;  // bodies may have several shapes
  std::erase_if(found, [&](const PathConstraintCheck::Found& f) {
    const ClearancePair& pair = bodies.model.pairs()[static_cast<std::size_t>(f.at.index)];
    return !seen.insert(std::minmax(pair.body_a, pair.body_b)).second;
  });
  const double required = *reach.constraints.clearance, nearest = required - found.front().value;
  std::string pairs;
  for (std::size_t i = 0; i < std::min(kNamed, found.size()); ++i) {
    const ClearancePair& pair = bodies.model.pairs()[static_cast<std::size_t>(found[i].at.index)];
    const double distance = required - found[i].value;
    pairs += fmt::format(
        "{}'{}' and '{}' {}", pairs.empty() ? "" : ", ", bodies.names[pair.body_a], bodies.names[pair.body_b],
        distance < 0 ? fmt::format("overlap by {:.4g} m", -distance) : fmt::format("are {:.4g} m apart", distance));
  }
  if (found.size() > kNamed) pairs += fmt::format(", and {} more pairs", found.size() - kNamed);
  if (begin_ > 0 && nearest > 0) {
    constexpr double kRoom = 0.99;
    reach.constraints.clearance = kRoom * nearest;
    plan_.warnings.push_back(
        fmt::format("approach: replanned at t = {:.4g} s, where {}: the remaining approach keeps a clearance of {:.4g} "
                    "m instead of the {:.4g} m of approach.plan.clearance",
                    time_, pairs, *reach.constraints.clearance, required));
    return;
  }
  throw Unplannable(fmt::format(
      "planning the approach: at the start of the segment, t = {:.4g} s, {}; the minimum clearance is {:.4g} m "
      "(approach.plan.clearance), and no motion changes the start: {}, set a smaller clearance, or add the pair to "
      "clearance.ignore",
      time_, pairs, required,
      time_ == 0 ? "change initial.joints or initial.base" : "change the waypoint at which the segment begins"));
}

// Wheels, momentum and attitude => momentum model (6.26) and its limit in `constraints`. If the begin of the segment
// exceeds the limit: Unplannable, or a larger limit with a warning if the approach is replanned.
void ApproachPlanner::set_wheels(PathConstraints& constraints) {
  if (!attitude_held()) {
    throw Unplannable(
        "planning the approach: the wheel momentum settings of approach.plan require an attitude-controlled base, but "
        "approach.base_control is too weak to hold the attitude while the joints move; increase its gains or set "
        "feedforward");
  }
  constraints.wheels = planned_wheels(problem_, motion_, problem_.X_WB.R, X_WB_.R, begin_);
  constraints.wheel_share = approach_.plan->wheel_momentum.value_or(constraints.wheel_share);
  PlacedLinks links;
  base_.place(position_, links);
  const Vector3d u = FloatingBase::momentum_of_rates(links, rate_);
  for (std::size_t i = 0; i < constraints.wheels->wheels.size(); ++i) {
    const double share = std::abs(constraints.wheels->share(i, time_, u));
    constexpr double kRounding = 1e-6;  // tolerance of plans
    if (share <= constraints.wheel_share + kRounding) continue;
    const std::string what = fmt::format(
        "wheel '{}' needs {:.6g} of its momentum capacity to hold the base's attitude at the segment's begin, t = "
        "{:.4g} s; the limit approach.plan.wheel_momentum is {:.6g}",
        constraints.wheels->wheels[i].name, share, time_, constraints.wheel_share);
    if (begin_ == 0) {
      throw Unplannable("planning the approach: " + what + ", and no joint motion can change that");
    }
    // A replanned approach continues from the state of the controlled base. There is rarely a feasible trajectory
    // without any further increase of the momentum.
    constexpr double kRoom = 1.01;
    constraints.wheel_share = kRoom * share;
    plan_.warnings.push_back(fmt::format("approach: replanned, {}; the limit for the remaining approach is {:.6g}",
                                         what, constraints.wheel_share));
  }
}

void ApproachPlanner::refuse_turning(const PlanSetup& plan) {
  std::string requested = plan.base_turn ? "base_turn" : "";
  for (const auto objective : {PlanSetup::Objective::base_attitude, PlanSetup::Objective::base_motion}) {
    if (weight_in(plan, objective) > 0) requested += (requested.empty() ? "" : ", ") + std::string(name_of(objective));
  }
  if (requested.empty()) return;
  throw Unplannable(fmt::format(
      "planning the approach: {}: no base rotation is planned, because approach.base_control is assumed strong enough "
      "to hold the base's attitude; the simulation shows the actual rotation of the controlled base",
      requested));
}

ReachSolution ApproachPlanner::solve(const ReachProblem& reach, const std::string& what) {
  const ReachSolution solution = plan_reach(base_, reach);
  plan_.report.rhs_evaluations += solution.rhs_evaluations;
  if (!solution.found) refuse_unreachable(reach, solution, what);
  return solution;
}

void ApproachPlanner::refuse_unreachable(const ReachProblem& reach, const ReachSolution& solution,
                                         const std::string& what) {
  constexpr double kMissed = 1e-5;  // [m]
  const bool misses =
      std::any_of(solution.miss.begin(), solution.miss.end(), [](const GoalMiss& m) { return m.distance > kMissed; });
  const std::string base = misses ? explain_base(reach) : "";  // before the report changes the joint values
  report(reach, solution);
  throw Unplannable(fmt::format("planning the approach{}: {}{}", what, solution.failure, base));
}

// Solution of a search => plan_.report: objective and its terms, errors per end-effector, numbers of the search. If
// nothing was found, the planner keeps the final values of the nearest iterate.
void ApproachPlanner::report(const ReachProblem& reach, const ReachSolution& solution) {
  PlanReport& r = plan_.report;
  r.searched = true;
  r.found = solution.found;
  r.objective = !approach_.plan           ? "excursion"
                : approach_.plan->weights ? "weights"
                                          : name_of(approach_.plan->objective);
  r.objective_value = solution.objective;
  r.terms.clear();
  for (std::size_t i = 0; i < solution.terms.size(); ++i) {
    const Objective::Term& term = reach.objective.terms()[i];
    r.terms.push_back({name_of(term.kind), term.weight, solution.terms[i]});
  }
  if (solution.figures) r.path = planned_path(reach, solution);
  r.miss.clear();
  for (std::size_t i = 0; i < reach.goals.size(); ++i) {
    r.miss.push_back({reach.goals[i].name, solution.miss[i].distance, solution.miss[i].angle});
  }
  r.starts = solution.starts, r.solutions = solution.solutions, r.distinct_solutions = solution.distinct;
  r.iterations = solution.iterations;
  r.smallest_singular_value = solution.smallest_singular_value;
  r.unmet_rate = solution.unmet_rate;
  if (!solution.found) position_ = solution.position, rate_ = solution.rate;
}

// Figures of a solution => report of its path: smallest margins and clearance, largest shares of limits, base rotation
// [rad] and wheel shares (6.27).
PlannedPath ApproachPlanner::planned_path(const ReachProblem& reach, const ReachSolution& solution) const {
  const PathFigures& f = *solution.figures;
  PlannedPath path;
  path.knots = solution.knots;
  if (std::isfinite(f.position_margin)) path.position_margin = f.position_margin;
  path.rate_share = f.rate_share > 0 ? std::optional(f.rate_share) : std::nullopt;
  path.effort_share = f.effort_share;
  if (f.clearance.pair >= 0) {
    path.clearance = f.clearance.distance, path.clearance_time = f.clearance_time;
    path.body_a = reach.constraints.bodies->names[static_cast<std::size_t>(f.clearance.body_a)];
    path.body_b = reach.constraints.bodies->names[static_cast<std::size_t>(f.clearance.body_b)];
  }
  path.attitude_held = attitude_held();
  path.base_turn = f.base_turn;
  for (std::size_t i = 0; i < f.wheel_share.size(); ++i)
    path.wheels.push_back({reach.constraints.wheels->wheels[i].name, f.wheel_share[i]});
  return path;
}

// Waypoint => segment to it: to its joints and rates, or to joints that bring the end-effectors to its positions and
// linear velocities, in W or in a target's frame at that time. Throws Unplannable.
void ApproachPlanner::pass(const Waypoint& w) {
  if (!w.joints.empty() || w.places.empty()) {
    advance(w.time, w.joints, w.rates ? *w.rates : std::vector<double>(w.joints.size(), 0.0));
    return;
  }
  std::vector<Goal> goals;
  for (const Waypoint::Place& place : w.places) {
    Goal g;
    g.frame = servicer_.model.frame_index(place.end_effector);
    g.name = place.end_effector;
    TargetMotion frame{Posed::identity(), Twistd::zero()};
    if (!place.target.empty()) frame = target_at(target_index(problem_, place.target), w.time);
    g.X_WG = frame.X_WT * Posed{Rotationd::identity(), place.position};
    g.V_WG = shift(frame.V_WT, frame.X_WT.R * place.position);
    g.V_WG.linear += frame.X_WT.R * place.velocity;
    goals.push_back(g);
  }
  const ReachProblem reach = reach_to(w.time, std::move(goals), RateDemand::linear);
  const std::string what = fmt::format(", waypoint at t = {:.6g} s", w.time);
  ReachSolution s = solve_where_loads_lead(reach, what);
  if (disturbed()) s = allow_for_disturbance(reach, s, what);
  advance(w.time, s.position, s.rate);
}

TargetMotion ApproachPlanner::target_at(std::size_t target, double time) const {
  return motion_in_plan(problem_, targets_, target, approach_.duration, time, each_step());
}

std::function<void(double)> ApproachPlanner::each_step() const {
  constexpr long kOfOneStep = 12;  // evaluations per step of the method of order 8
  return [this](double) { watch_.count(kOfOneStep); };
}

// End time => last segment to the grasp points: a search if approach.plan exists, otherwise stated final joints with
// rates by (6.4). Forward simulations correct both if disturbances act. Throws Unplannable.
void ApproachPlanner::final_segment(double end) {
  ReachProblem reach = reach_to(end, capture_goals(problem_, servicer_.model, targets_), rate_demand(approach_));
  if (approach_.final_rates) reach.given_rates = *approach_.final_rates;
  std::vector<double> position = approach_.final_position, rate, coefficients;
  int knots = 0;
  if (approach_.plan) {
    set_search(reach);
    ReachSolution s = solve_where_loads_lead(reach, "");
    if (s.approximate) warn_of_approximation(reach, s);
    if (disturbed() && !s.approximate) s = allow_for_disturbance(reach, s, "");
    report(reach, s);
    position = s.position, rate = s.rate;
    knots = s.knots, coefficients = s.coefficients;
    warn_of_unmet(s.unmet_rate, rate);
    warn_of_rates(rate, end);
  } else {
    rate = settled_rates(reach, position);
    if (disturbed() && reach.demand != RateDemand::given) rate = disturbed_rates(reach, position, rate);
  }
  advance(end, position, rate, knots, coefficients);
}

// Final joints => final rates: the stated ones (default zero), or the solution of (6.4) by Newton's method. Throws
// Unplannable if that does not converge.
std::vector<double> ApproachPlanner::settled_rates(const ReachProblem& reach, const std::vector<double>& position) {
  const std::size_t n = position.size();
  if (reach.demand == RateDemand::given)
    return reach.given_rates.empty() ? std::vector<double>(n, 0.0) : reach.given_rates;
  Shooting shooting(base_, reach);
  const ShootingIterate iterate = shooting.shoot(position, std::vector<double>(n, 0.0));
  plan_.report.rhs_evaluations += shooting.rhs_evaluations();
  if (!iterate.valid) {
    throw Unplannable(
        "planning the approach: final joint rates did not converge; the final configuration may be near a singularity "
        "of the generalized Jacobian; other final_joints, or given final_rates, may help");
  }
  warn_of_unmet(iterate.unmet, iterate.rate);
  warn_of_rates(iterate.rate, reach.start.end);
  plan_.report.unmet_rate = iterate.unmet;
  return iterate.rate;
}

void ApproachPlanner::warn_of_unmet(double unmet, const std::vector<double>& rates) {
  double largest = 1e-3;
  for (double r : rates) largest = std::max(largest, std::abs(r));
  if (unmet <= 1e-9 * largest) return;
  plan_.warnings.push_back(
      fmt::format("approach: no joint rates give the end-effectors the demanded motion at the final configuration; the "
                  "largest unmet component is {:.3g} (m/s or rad/s)",
                  unmet));
}

void ApproachPlanner::warn_of_approximation(const ReachProblem& reach, const ReachSolution& s) {
  for (std::size_t i = 0; i < reach.goals.size(); ++i) {
    if (s.miss[i].distance <= kArrived && s.miss[i].angle <= kArrived) continue;
    plan_.warnings.push_back(fmt::format(
        "approach: end-effector '{}' does not reach its demanded pose exactly; the plan ends {:.3g} m and {:.3g} rad "
        "from it, within half its envelope; joint motion cannot reduce this error",
        reach.goals[i].name, s.miss[i].distance, s.miss[i].angle));
  }
}

// Final rates => warnings: rates beyond their limits, and joints that overshoot by more than 2 pi rad or m, by the term
// T e(x) of (6.1).
void ApproachPlanner::warn_of_rates(const std::vector<double>& rates, double end) {
  constexpr double kSwing = 0.19;                 // of rate times duration: the largest |e(x)| of (6.1)
  constexpr double kWide = 2 * std::numbers::pi;  // [rad or m]
  std::size_t widest = 0;
  double swing = 0;
  for (std::size_t j = 0; j < rates.size(); ++j) {
    if (std::abs(rates[j]) > rate_limit_[j]) {
      plan_.warnings.push_back(fmt::format(
          "approach: the demanded final motion requires a rate of {:.4g} at joint '{}', whose limit is {:.4g}{}",
          rates[j], plan_.report.joints[j], rate_limit_[j],
          !approach_.plan ? ""
          : disturbed()   ? "; the plan includes corrections from a forward simulation"
                          : "; no solution within the rate limits was found"));
    }
    const double out = kSwing * std::abs(rates[j]) * (end - time_);
    if (out > swing) swing = out, widest = j;
  }
  if (swing <= kWide) return;
  plan_.warnings.push_back(
      fmt::format("approach: joints overshoot to reach their final rates, '{}' by about {:.3g} (rad or m) for {:.4g} "
                  "on a segment of {:.4g} s; a shorter last segment (waypoints, straight_in) reduces the overshoot",
                  plan_.report.joints[widest], swing, rates[widest], end - time_));
}

JointTrajectory ApproachPlanner::stated(std::size_t joint) const {
  if (!approach_.sampled) return trajectory_of(approach_.pieces, joint);
  const SampledMotion& s = *approach_.sampled;
  return interpolate_samples(s.times, s.positions[joint],
                             s.rates.empty() ? std::span<const double>{} : std::span(s.rates[joint]));
}

void ApproachPlanner::follow_stated() {
  for (std::size_t j = 0; j < plan_.joints.size(); ++j) {
    plan_.joints[j] = stated(j);
    const JointPoint end = evaluate(plan_.joints[j], approach_.duration);
    position_[j] = end.position, rate_[j] = end.rate;
  }
}

// Problem, target motion and begin => plan; a failed search or an exceeded evaluation limit becomes its `failure`.
// Other exceptions pass.
ApproachPlan plan_approach(const CaptureProblem& problem, const TargetPlan& targets, CaptureDetail detail,
                           const CaptureProgress& progress, double begin) {
  ApproachPlan plan;
  ApproachPlanner planner(problem, targets, detail, progress, begin, plan);
  try {
    planner.run();
  } catch (const Unplannable& error) {
    plan.failure = error.what();
  } catch (const WorkLimit&) {
    plan.failure = planner.given_up();
  }
  planner.close();
  return plan;
}

}  // namespace grapnel
