#include "grapnel/approach/approach_plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "grapnel/approach/flown_solution.hpp"
#include "grapnel/approach/phase_setups.hpp"
#include "grapnel/approach/planned_base.hpp"
#include "grapnel/approach/target_motion.hpp"
#include "grapnel/approach/way_setup.hpp"
#include "grapnel/plan/reach.hpp"
#include "grapnel/plan/reach_failure.hpp"
#include "grapnel/plan/shooting.hpp"
#include "grapnel/plan/straight_in.hpp"
#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/problem/enumeration_names.hpp"
#include "grapnel/problem/plan_objectives.hpp"
#include "grapnel/simulate/simulate_phase.hpp"

namespace grapnel {
namespace {

// Flights are good to about this [m, rad and their rates].
constexpr double kArrivedInFlight = 10 * kArrived;

// Of the joints' motion on a segment, as PathSegment::fly() takes it.
struct Spline {
  int knots = 0;
  std::vector<double> coefficients = {};
};

// Ends planning; becomes ApproachPlan::failure.
struct Unplannable : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// One plan, segment by segment. Joints are those of the servicer alone, which are the robot's in the same order.
class Planner {
 public:
  Planner(const CaptureProblem& problem, const TargetPlan& targets, CaptureDetail detail,
          const CaptureProgress& progress, double begin, ApproachPlan& plan)
      : problem_(problem),
        approach_(*problem.approach),
        targets_(targets),
        detail_(detail),
        plan_(plan),
        begin_(begin),
        servicer_(make_servicer(problem)),
        flown_(make_moving_servicer(problem)),
        flown_start_(initial_servicer_state(problem, flown_)),
        start_state_(without_inner_motion(flown_, flown_start_, servicer_)),
        base_(servicer_.model, problem.robot.base_mode == RobotSetup::Base::free),
        motion_(free_motion(servicer_.model, start_state_, begin, problem.gravity)),
        watch_(most_evaluations(), look_of(progress, most_evaluations())),
        time_(begin) {
    base_.be_watched_by(&watch_);
    if (approach_.plan && approach_.plan->idle_joints == PlanSetup::IdleJoints::held) hold_idle_joints();
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
    if (approach_.base_control && base_.floats()) keep_attitude();
  }

  void run() {
    if (approach_.sampled || !approach_.pieces.empty()) {
      follow_stated();
    } else {
      for (const Waypoint& w : approach_.waypoints) pass(w);
      const double final_segment_end =
          approach_.duration - (approach_.straight_in ? approach_.straight_in->duration : 0);
      if (approach_.straight_in) {
        stand_off_and_in(final_segment_end);
      } else {
        final_segment(final_segment_end);
      }
      if (approach_.plan) warn_of_thrusters();
    }
  }

  // Why it was given up, and what would help.
  std::string given_up() const {
    const PlanSetup plan = approach_.plan.value_or(PlanSetup{});
    return fmt::format(
        "planning the approach: given up after {} evaluations of the servicer's motion, at the segment from t = {:.6g} "
        "s on; the approach lasts {:.6g} s, and the longer a segment, the further joints swing on it and the more each "
        "of the search's {} initial guesses costs: a shorter last segment (waypoints, straight_in), fewer "
        "approach.plan.starts or approach.plan.objective: as_found take less, and approach.plan.max_evaluations allows "
        "more",
        plan.max_evaluations, time_, approach_.duration, plan.starts);
  }

  // What was reached, also where planning failed.
  void close() {
    plan_.report.final_position = position_;
    plan_.report.final_rates = rate_;
  }

 private:
  long most_evaluations() const { return approach_.plan.value_or(PlanSetup{}).max_evaluations; }
  static WorkWatch::Look look_of(const CaptureProgress& progress, long most) {
    if (!progress) return {};
    return [&progress, most](long done) { progress(kPlanning, static_cast<double>(done), static_cast<double>(most)); };
  }

  // Where attitude control does, the base is at the attitude that it is to have from the first, about the same centre
  // of mass.
  void keep_attitude() {
    PlacedLinks links;
    base_.place(position_, links);
    const Symmetric3d inertia = links.composite[0].rotational_about_com();
    if (!keeps_attitude(*approach_.base_control, inertia, shortest_motion())) return;
    base_.keep_attitude();
    X_WB_.R = attitude_control(*approach_.base_control, flown_, flown_start_).R_WD;
    X_WB_.p = motion_.p_WCom - X_WB_.R * links.com;
  }
  bool attitude_kept() const { return base_.floats() && !base_.turns(); }

  // How long the joints take at least from rest to rest: the shortest of the approach's parts, all of them also where
  // the rest is planned anew.
  double shortest_motion() const {
    const double end = approach_.duration - (approach_.straight_in ? approach_.straight_in->duration : 0);
    double shortest = approach_.straight_in ? std::min(end, approach_.straight_in->duration) : end, begin = 0;
    for (const Waypoint& w : approach_.waypoints) shortest = std::min(shortest, w.time - begin), begin = w.time;
    return begin > 0 ? std::min(shortest, end - begin) : shortest;
  }

  // Joints that move no end-effector that grasps.
  void hold_idle_joints() {
    std::vector<bool> held(static_cast<std::size_t>(base_.joints()));
    for (int j = 0; j < base_.joints(); ++j) {
      held[static_cast<std::size_t>(j)] = std::none_of(
          problem_.grasps.begin(), problem_.grasps.end(),
          [&](const GraspSetup& g) { return base_.carries(j, servicer_.model.frame_index(g.end_effector)); });
    }
    base_.hold(std::move(held));
  }

  // --- Segments
  // ---------------------------------------------------------------------------------------------------------

  SegmentStart segment_to(double end) const { return {time_, end, approach_.profile, position_, rate_, X_WB_}; }

  // Flies a segment to final values and goes on from there.
  void advance(double end, const std::vector<double>& position, const std::vector<double>& rate, int knots = 0,
               const std::vector<double>& coefficients = {}) {
    SegmentStart start = segment_to(end);
    start.knots = knots;
    PathSegment segment(base_, start, motion_);
    SegmentEnd at_end;
    // Where the base then is matters to what follows, and as a check.
    if (end < approach_.duration || detail_ == CaptureDetail::full) {
      at_end = segment.fly(position, rate, false, SegmentAccuracy::full, coefficients);
      if (!at_end.finished) throw std::runtime_error("planning the approach: " + at_end.failure);
    }
    for (std::size_t j = 0; j < position.size(); ++j) {
      const auto pieces = segment.pieces(static_cast<int>(j), position[j], rate[j], coefficients);
      plan_.joints[j].pieces.insert(plan_.joints[j].pieces.end(), pieces.begin(), pieces.end());
    }
    plan_.report.rhs_evaluations += segment.rhs_evaluations();
    time_ = end, position_ = position, rate_ = rate, X_WB_ = at_end.X_WB;
  }

  ReachProblem reach_to(double end, std::vector<Goal> goals, RateDemand demand) const {
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

  // The settings of approach.plan.
  void set_search(ReachProblem& reach) {
    const PlanSetup& plan = *approach_.plan;
    reach.starts = plan.starts, reach.seed = plan.seed;
    if (!plan.guess.empty()) reach.guess = plan.guess;
    reach.objective = Objective(objective_terms(plan), reach.start, reach.guess, lower_, upper_);
    WaySetup& way = reach.way;
    way.limits = plan.limits == PlanSetup::Limits::on_the_way;
    way.effort_limit = effort_limit_;
    way.base_turn = plan.base_turn.value_or(way.base_turn);
    way.R_WB0 = problem_.X_WB.R;
    way.clearance = plan.clearance;
    way.knots = plan.knots;
    if (plan.wheel_momentum || weight_in(plan, PlanSetup::Objective::wheel_momentum) > 0) set_wheels(way);
    if (attitude_kept()) refuse_turning(plan);
    if (plan.clearance || weight_in(plan, PlanSetup::Objective::clearance) > 0) {
      way.bodies =
          way_bodies(problem_, servicer_, [this](std::size_t target, double t) { return target_at(target, t); });
      if (way.bodies->model.pairs().empty()) {
        throw Unplannable(
            "planning the approach: approach.plan asks for clearance, and there are no two bodies whose distance could "
            "be looked at: shapes ('geometry') of the robot's links and of the targets are missing, or "
            "clearance.ignore leaves all pairs out");
      }
    }
    if (weight_in(plan, PlanSetup::Objective::impulse) > 0 || weight_in(plan, PlanSetup::Objective::impulse_index) > 0)
      way.end_measure = capture_measure(problem_, base_, motion_, reach.start.end, targets_.capture);
  }

  void set_wheels(WaySetup& way) {
    if (!attitude_kept()) {
      throw Unplannable(
          "planning the approach: what approach.plan asks of the wheels' momenta is planned for a base that keeps its "
          "attitude, and approach.base_control is too weak for that while the joints move; it needs higher gains or "
          "feedforward");
    }
    way.wheels = planned_wheels(problem_, motion_, problem_.X_WB.R, X_WB_.R, begin_);
    way.wheel_share = approach_.plan->wheel_momentum.value_or(way.wheel_share);
    PlacedLinks links;
    base_.place(position_, links);
    const Vector3d u = FloatingBase::momentum_of_rates(links, rate_);
    for (std::size_t i = 0; i < way.wheels->wheels.size(); ++i) {
      const double share = std::abs(way.wheels->share(i, time_, u));
      constexpr double kRounding = 1e-6;  // plans keep to it
      if (share <= way.wheel_share + kRounding) continue;
      const std::string what = fmt::format(
          "wheel '{}' has to hold {:.6g} of the momentum that it can hold, to keep the base's attitude, as the segment "
          "begins, at t = {:.4g} s; approach.plan.wheel_momentum allows {:.6g}",
          way.wheels->wheels[i].name, share, time_, way.wheel_share);
      if (begin_ == 0) {
        throw Unplannable("planning the approach: " + what + ", which no motion of the joints can change any more");
      }
      // The rest of an approach goes on from what the controlled base has come to, and from there hardly a way leads
      // that takes no more at all.
      constexpr double kRoom = 1.01;
      way.wheel_share = kRoom * share;
      plan_.warnings.push_back(
          fmt::format("approach: planned anew, {}; {:.6g} is allowed of the rest", what, way.wheel_share));
    }
  }

  // What makes no sense of a base that is planned for as one that keeps its attitude.
  static void refuse_turning(const PlanSetup& plan) {
    std::string asked = plan.base_turn ? "base_turn" : "";
    for (const auto objective : {PlanSetup::Objective::base_attitude, PlanSetup::Objective::base_motion}) {
      if (weight_in(plan, objective) > 0) asked += (asked.empty() ? "" : ", ") + std::string(name_of(objective));
    }
    if (asked.empty()) return;
    throw Unplannable(fmt::format(
        "planning the approach: {}: the plan is made for a base that keeps its attitude, which approach.base_control "
        "is taken to be strong enough for, so there is no turn to plan; how far the controlled base turns is seen in "
        "the run",
        asked));
  }

  ReachSolution solve(const ReachProblem& reach, const std::string& what) {
    const ReachSolution solution = plan_reach(base_, reach);
    plan_.report.rhs_evaluations += solution.rhs_evaluations;
    if (!solution.found) {
      report(reach, solution);
      throw Unplannable(fmt::format("planning the approach{}: {}", what, solution.failure));
    }
    return solution;
  }

  void report(const ReachProblem& reach, const ReachSolution& solution) {
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
    if (solution.way) r.way = planned_way(reach, solution);
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

  PlannedWay planned_way(const ReachProblem& reach, const ReachSolution& solution) const {
    const WayFigures& f = *solution.way;
    PlannedWay way;
    way.knots = solution.knots;
    if (std::isfinite(f.position_margin)) way.position_margin = f.position_margin;
    way.rate_share = f.rate_share > 0 ? std::optional(f.rate_share) : std::nullopt;
    way.effort_share = f.effort_share;
    if (f.clearance.pair >= 0) {
      way.clearance = f.clearance.distance, way.clearance_time = f.clearance_time;
      way.body_a = reach.way.bodies->names[static_cast<std::size_t>(f.clearance.body_a)];
      way.body_b = reach.way.bodies->names[static_cast<std::size_t>(f.clearance.body_b)];
    }
    way.attitude_kept = attitude_kept();
    way.base_turn = f.base_turn;
    for (std::size_t i = 0; i < f.wheel_share.size(); ++i)
      way.wheels.push_back({reach.way.wheels->wheels[i].name, f.wheel_share[i]});
    return way;
  }

  // --- Waypoints ----------------------------------------------------------------------------------------------------

  void pass(const Waypoint& w) {
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
    ReachSolution s = solve(reach, what);
    if (disturbed()) s = allow_for_disturbance(reach, s, what);
    advance(w.time, s.position, s.rate);
  }

  TargetMotion target_at(std::size_t target, double time) const {
    return propagate_target(problem_, problem_.targets[target], targets_.capture[target], approach_.duration, time,
                            each_step());
  }

  // For integrations of the whole dynamics.
  std::function<void(double)> each_step() const {
    constexpr long kOfOneStep = 12;  // of the method of order 8
    return [this](double) { watch_.count(kOfOneStep); };
  }

  // --- The final segment
  // ------------------------------------------------------------------------------------------------

  void final_segment(double end) {
    ReachProblem reach = reach_to(end, capture_goals(problem_, servicer_.model, targets_), rate_demand(approach_));
    if (approach_.final_rates) reach.given_rates = *approach_.final_rates;
    std::vector<double> position = approach_.final_position, rate, coefficients;
    int knots = 0;
    if (approach_.plan) {
      set_search(reach);
      ReachSolution s = solve(reach, "");
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

  // Rates that meet the demand at given final values.
  std::vector<double> settled_rates(const ReachProblem& reach, const std::vector<double>& position) {
    const std::size_t n = position.size();
    if (reach.demand == RateDemand::given)
      return reach.given_rates.empty() ? std::vector<double>(n, 0.0) : reach.given_rates;
    Shooting shooting(base_, reach);
    const Shot shot = shooting.shoot(position, std::vector<double>(n, 0.0));
    plan_.report.rhs_evaluations += shooting.rhs_evaluations();
    if (!shot.valid) {
      throw Unplannable(
          "planning the approach: final joint rates did not converge; the final configuration may be near a "
          "singularity of the generalized Jacobian; other final_joints, or final_rates that are given, may help");
    }
    warn_of_unmet(shot.unmet, shot.rate);
    warn_of_rates(shot.rate, reach.start.end);
    plan_.report.unmet_rate = shot.unmet;
    return shot.rate;
  }

  void warn_of_unmet(double unmet, const std::vector<double>& rates) {
    double largest = 1e-3;
    for (double r : rates) largest = std::max(largest, std::abs(r));
    if (unmet <= 1e-9 * largest) return;
    plan_.warnings.push_back(
        fmt::format("approach: no joint rates give the end-effectors the demanded motion at the final configuration; "
                    "the largest component left unmatched is {:.3g} (m/s or rad/s)",
                    unmet));
  }

  void warn_of_approximation(const ReachProblem& reach, const ReachSolution& s) {
    for (std::size_t i = 0; i < reach.goals.size(); ++i) {
      if (s.miss[i].distance <= kArrived && s.miss[i].angle <= kArrived) continue;
      plan_.warnings.push_back(fmt::format(
          "approach: no exact solution for end-effector '{}'; the plan leaves {:.3g} m and {:.3g} rad, within "
          "half its envelope (its joints, with the base they turn, cannot do more)",
          reach.goals[i].name, s.miss[i].distance, s.miss[i].angle));
    }
  }

  // Rates that no joint can have, or that make it swing on its way. Before the final segment is added to the plan.
  void warn_of_rates(const std::vector<double>& rates, double end) {
    constexpr double kSwing = 0.19;                 // of rate times duration: the largest |e(x)| of (6.1)
    constexpr double kWide = 2 * std::numbers::pi;  // [rad or m]
    std::size_t widest = 0;
    double swing = 0;
    for (std::size_t j = 0; j < rates.size(); ++j) {
      if (std::abs(rates[j]) > rate_limit_[j]) {
        plan_.warnings.push_back(fmt::format(
            "approach: the demanded final motion takes a rate of {:.4g} at joint '{}', whose limit is {:.4g}{}",
            rates[j], plan_.report.joints[j], rate_limit_[j],
            !approach_.plan ? ""
            : disturbed()   ? "; it was corrected for what momentum alone does not say"
                            : "; no solution within the rate limits was found"));
      }
      const double out = kSwing * std::abs(rates[j]) * (end - time_);
      if (out > swing) swing = out, widest = j;
    }
    if (swing <= kWide) return;
    plan_.warnings.push_back(fmt::format(
        "approach: joints swing out on the way for the rates that they are to end with, '{}' by about {:.3g} "
        "(rad or m) for {:.4g} on a segment of {:.4g} s; a shorter last segment (waypoints, straight_in) swings less",
        plan_.report.joints[widest], swing, rates[widest], end - time_));
  }

  // --- What the momentum integral does not know ---------------------------------------------------------------------

  // Loads on the servicer, an orbit's field, attitude control, rotors or what bends: the motion is then not that of
  // joints and a constant momentum.
  bool disturbed() const {
    return bends() || loaded() || approach_.base_control.has_value() || problem_.orbit.has_value() || has_rotors();
  }
  bool bends() const { return !flown_.elastic_joints.empty(); }
  bool has_rotors() const { return !flown_.wheels.empty() || !flown_.gyros.empty(); }
  bool loaded() const { return !loads_on(servicer_.model, problem_.loads).empty(); }

  // The robot that is planned for, where it is not the one that flies: it ...
  std::string planned_robot() const {
    std::vector<std::string> differs;
    if (bends()) differs.push_back("does not bend");
    if (attitude_kept()) {
      differs.push_back("keeps its base's attitude exactly");
    } else if (approach_.base_control) {
      differs.push_back(
          "floats freely, without the attitude control, which is too weak to keep the attitude meanwhile");
    } else if (has_rotors() && base_.floats()) {
      differs.push_back("floats freely, its rotors at rest in the base");
    }
    if (problem_.orbit) differs.push_back("feels no field of the orbit");
    if (loaded()) differs.push_back("bears no loads");
    return fmt::format("{}", fmt::join(differs, " and "));
  }

  // Where another robot flies than is planned for; once, not again with every rest that is planned anew.
  bool is_to_be_said_what_flies() const { return begin_ == 0 && !planned_robot().empty(); }

  // Flights that correct plans know what attitude control asks, and wheels, but no thrusters.
  void warn_of_thrusters() {
    const std::optional<BaseControlSetup>& control = approach_.base_control;
    if (!control ||
        control->actuators.value_or(BaseControlSetup::Actuators::wheels) == BaseControlSetup::Actuators::wheels)
      return;
    plan_.warnings.push_back(
        "approach: planned as if the base's attitude control gave the torque that it asks for at any time, and no "
        "force; thrusters switch, and the end-effectors will miss by what that does");
  }

  // Of them, those that there are.
  std::string disturbances() const {
    return std::string(problem_.orbit ? "the orbit's field, " : "") +
           (flown_.wheels.empty() ? "" : "the reaction wheels, ") +
           (flown_.gyros.empty() ? "" : "the control moment gyros, ") + (bends() ? "what yields, " : "") +
           "the loads or the base's attitude control";
  }

  // Loads on a target that is to be grasped.
  bool targets_loaded() const {
    return std::any_of(problem_.loads.begin(), problem_.loads.end(), [&](const LoadSetup& load) {
      return std::any_of(problem_.grasps.begin(), problem_.grasps.end(),
                         [&](const GraspSetup& g) { return load.body == target_body_name(g.target); });
    });
  }

  // Goals for the servicer taken for rigid, whose end-effectors are where it wants them when those that its bending has
  // moved are where they are to be, and likewise their velocities.
  std::vector<Goal> less_bending(std::vector<Goal> goals, const State& flown, const State& rigid) const {
    if (!bends()) return goals;
    const Kinematics bent = forward_kinematics(flown_.model, flown),
                     straight = forward_kinematics(servicer_.model, rigid);
    for (Goal& goal : goals) {
      const int frame = flown_.model.frame_index(servicer_.model.frames()[goal.frame].name);
      const Posed is = frame_pose(flown_.model, bent, frame),
                  taken_for = frame_pose(servicer_.model, straight, goal.frame);
      const Rotationd back = taken_for.R * transpose(is.R);
      goal.X_WG.p += taken_for.p - is.p;
      goal.X_WG.R = back * goal.X_WG.R;
      goal.direction_W = back * goal.direction_W;
      goal.V_WG += frame_twist(servicer_.model, straight, goal.frame) - frame_twist(flown_.model, bent, frame);
    }
    return goals;
  }

  // Where joints that follow these final values exactly bring the servicer, with everything that acts on it.
  State fly_disturbed(const ReachProblem& reach, const std::vector<double>& position, const std::vector<double>& rate,
                      const Spline& spline, const StepWatch& watch = {}) {
    std::vector<JointTrajectory> joints = plan_.joints;
    SegmentStart start = reach.start;
    start.knots = spline.knots;
    PathSegment segment(base_, start, motion_);
    for (std::size_t j = 0; j < position.size(); ++j) {
      const auto pieces = segment.pieces(static_cast<int>(j), position[j], rate[j], spline.coefficients);
      joints[j].pieces.insert(joints[j].pieces.end(), pieces.begin(), pieces.end());
    }
    return fly(joints, reach.start.end, watch);
  }
  State fly(const std::vector<JointTrajectory>& joints, double end, StepWatch watch = {}) {
    PhaseDynamics dynamics(flown_.model, approach_setup(problem_, flown_, flown_start_, joints, true));
    watch.each_step = each_step();
    const PhaseOutcome outcome = simulate_phase(dynamics, flown_start_, begin_, end, problem_.integration, watch);
    if (!outcome.finished) throw std::runtime_error("planning the approach: " + outcome.failure);
    plan_.report.rhs_evaluations += outcome.rhs_evaluations;
    return outcome.end_state;
  }

  // What the base and its wheels do in such a flight, in words.
  std::string what_it_does(const ReachProblem& reach, const std::vector<double>& position,
                           const std::vector<double>& rate, const Spline& spline) {
    if (!base_.floats()) return {};
    const Rotationd R_from = attitude_kept() ? X_WB_.R : problem_.X_WB.R;
    const Model& model = flown_.model;
    double turn = 0, share = 0;
    StepWatch watch;
    watch.look = [&](double, const State& state, const PhaseIntegrals&) {
      turn = std::max(turn, rotation_angle(transpose(R_from) * root_pose(model, state, flown_.base).R));
      for (std::size_t w = 0; w < flown_.wheels.size(); ++w) {
        const Body& body = model.bodies()[model.joints()[static_cast<std::size_t>(flown_.wheels[w])]];
        share = std::max(share, std::abs(state.v[static_cast<std::size_t>(body.v)]) / problem_.robot.wheels[w].rate);
      }
    };
    watch.looks = 128;
    fly_disturbed(reach, position, rate, spline, watch);
    std::string text =
        fmt::format("; flown with joints that follow exactly, its base turns by up to {:.3g} rad from {}", turn,
                    attitude_kept() ? "the attitude that it is to keep" : "its initial attitude");
    if (share > 0) text += fmt::format(", and its wheels come to {:.3g} of their largest rates", share);
    return text;
  }

  // A disturbed motion's end, against the goals and the demand.
  FlownEnd disturbed_end(const ReachProblem& reach, const std::vector<double>& position,
                         const std::vector<double>& rate, const Spline& spline) {
    const State flown = fly_disturbed(reach, position, rate, spline);
    const State end = without_inner_motion(flown_, flown, servicer_);
    const std::vector<Goal> goals = less_bending(reach.goals, flown, end);
    const Posed X_WB = root_pose(servicer_.model, end, servicer_.base);
    base_.place(position);
    FlownEnd result;
    Eigen::MatrixXd unused, unused_too;
    goal_error(base_, X_WB, goals, result.error, unused, unused_too);
    result.gap = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(rate.size()));
    if (reach.demand == RateDemand::given) return result;
    const FreeMotion now = free_motion(servicer_.model, end, reach.start.end, problem_.gravity);
    // A base that is to keep its attitude turns by what its control lags.
    const Vector3d w_B = attitude_kept()
                             ? transposed_times(X_WB.R, root_twist(servicer_.model, end, servicer_.base).angular)
                             : Vector3d::zero();
    const DemandedRates demanded =
        demanded_rates(base_, X_WB, now.in_base(reach.start.end, X_WB), goals, reach.demand, w_B);
    for (std::size_t j = 0; j < rate.size(); ++j) {
      const auto k = static_cast<Eigen::Index>(j);
      result.gap[k] = demanded.rates[k] - rate[j];
    }
    result.unmet = demanded.unmet;
    return result;
  }

  // From the solution without disturbance to the one with it. A spline's coefficients stay, so that what was asked of
  // the way is kept but for what the final values change.
  ReachSolution allow_for_disturbance(const ReachProblem& reach, ReachSolution solution, const std::string& what) {
    const Spline spline{solution.knots, solution.coefficients};
    const Flight flight = [&](const std::vector<double>& position, const std::vector<double>& rate) {
      return disturbed_end(reach, position, rate, spline);
    };
    const FlownSolution flown =
        solve_by_flights(flight, solution.position, solution.rate, reach.lower, reach.upper, kArrived);
    solution.iterations += flown.iterations;
    solution.position = flown.position, solution.rate = flown.rate;
    solution.miss = misses(reach.goals, flown.end.error);
    solution.unmet_rate = flown.end.unmet;
    if (flown.found) {
      if (asks_of_way(reach) && is_to_be_said_what_flies()) {
        plan_.warnings.push_back(fmt::format(
            "approach: limits on the way, clearance and what else is asked of the way are kept by the plan of "
            "the robot that {}; how far the one that flies keeps limits and clearance, with the final values that "
            "bring it to its points, is watched in the run{}",
            planned_robot(), what_it_does(reach, solution.position, solution.rate, spline)));
      }
      return solution;
    }
    solution.found = false;
    report(reach, solution);
    std::string text;
    for (std::size_t i = 0; i < solution.miss.size(); ++i) {
      text += fmt::format("{}end-effector '{}' stays {:.3g} m", text.empty() ? "" : ", ", reach.goals[i].name,
                          solution.miss[i].distance);
      if (reach.goals[i].orientation != Goal::Orientation::free)
        text += fmt::format(" and {:.3g} rad", solution.miss[i].angle);
    }
    throw Unplannable(
        fmt::format("planning the approach{}: without {} there is a solution, with them none "
                    "was found from it after {} corrections: {} from its point; another approach.plan.guess may help",
                    what, disturbances(), flown.iterations, text));
  }

  // Rates that meet the demand at given final values at the end of the disturbed motion that they lead to; the
  // undisturbed ones, with a warning, where none are found.
  std::vector<double> disturbed_rates(const ReachProblem& reach, const std::vector<double>& position,
                                      const std::vector<double>& undisturbed) {
    // Where the end-effectors come to be is given: their error is no matter.
    const Flight flight = [&](const std::vector<double>& p, const std::vector<double>& r) {
      FlownEnd end = disturbed_end(reach, p, r, {});
      end.error.setZero();
      return end;
    };
    const FlownSolution flown = solve_by_flights(flight, position, undisturbed, {}, {}, kArrived);
    if (flown.found) {
      plan_.report.unmet_rate = flown.end.unmet;
      return flown.rate;
    }
    plan_.warnings.push_back(
        fmt::format("approach: final joint rates did not converge under {}; those of the "
                    "motion without them are taken, and the end-effectors' final motion is not the demanded one",
                    disturbances()));
    return undisturbed;
  }

  // --- Straight in --------------------------------------------------------------------------------------------------

  void stand_off_and_in(double begin) {
    const StraightIn& setup = *approach_.straight_in;
    StraightInProblem in;
    in.begin = begin, in.end = approach_.duration;
    in.motion = motion_, in.gravity = problem_.gravity;
    in.most_steps = problem_.integration.max_steps;
    in.stand_off = setup.stand_off, in.final_speed = setup.final_speed;
    for (std::size_t t = 0; t < problem_.targets.size(); ++t) {
      const TargetMotion at = target_at(t, begin);
      in.targets.push_back({at.X_WT, at.V_WT, problem_.targets[t].com, problem_.targets[t].inertia});
    }
    in.goals = straight_goals(problem_, servicer_.model);
    if (bends()) {
      come_in_bending(in);
    } else {
      come_in(in, {});
    }
    std::vector<std::string> how;
    if (attitude_kept()) how.push_back("for a base that keeps its attitude exactly");
    if (approach_.base_control && !attitude_kept()) how.push_back("without attitude control");
    if (!approach_.base_control && has_rotors() && base_.floats()) how.push_back("with rotors at rest in the base");
    if (loaded() || targets_loaded()) how.push_back("without loads");
    if (!how.empty()) {
      plan_.warnings.push_back(
          fmt::format("approach: straight_in is planned {}; the end-effectors will miss by what that leaves out",
                      fmt::join(how, " and ")));
    }
    if (problem_.orbit) warn_of_orbit(in);
  }

  // To the stand-off and straight in. `guess`: where the search for the stand-off begins; empty: as approach.plan says.
  void come_in(StraightInProblem& in, const std::vector<double>& guess) {
    ReachProblem reach = reach_to(in.begin, goals_at(in, in.targets, in.stand_off, 0), RateDemand::task);
    set_search(reach);
    if (!guess.empty()) reach.guess = guess, reach.starts = 1;
    const ReachSolution s = solve(reach, ", stand-off");
    report(reach, s);
    if (disturbed() && !bends() && asks_of_way(reach) && is_to_be_said_what_flies()) {
      plan_.warnings.push_back(fmt::format(
          "approach: limits on the way, clearance and what else is asked of the way to the stand-off are kept by the "
          "plan of the robot that {}; with straight_in its final values are not corrected for the one that flies, "
          "whose limits and clearance are watched in the run{}",
          planned_robot(), what_it_does(reach, s.position, s.rate, {s.knots, s.coefficients})));
    }
    advance(in.begin, s.position, s.rate, s.knots, s.coefficients);
    in.position = position_, in.X_WB = X_WB_;
    take_straight_in(in, plan_straight_in(base_, in));
  }

  // The grasp points to which the rigid robot comes in are shifted, in their targets, by what a flight of the one that
  // bends is off, until that one's end-effectors are on the points that are meant.
  void come_in_bending(StraightInProblem& in) {
    constexpr int kMost = 8;
    const std::vector<StraightGoal> meant = in.goals;
    const ApproachPlan before = plan_;
    const double time = time_;
    const std::vector<double> position = position_, rate = rate_;
    const Posed X_WB = X_WB_;
    std::vector<double> guess;
    for (int i = 0;; ++i) {
      come_in(in, guess);
      guess = in.position;
      const std::vector<Vector3d> missed = missed_by_bending(meant, in.end);  // in the targets
      double largest = 0;
      for (std::size_t g = 0; g < meant.size(); ++g) {
        plan_.report.miss[g].distance = norm(missed[g]);
        largest = std::max(largest, norm(missed[g]));
      }
      if (largest <= kArrivedInFlight || i == kMost) {
        plan_.warnings.push_back(fmt::format(
            "approach: straight_in brings the end-effectors of the robot that bends to within {:.2g} m of their "
            "points; it is planned for the one that does not bend, from whose velocities and turns there they differ "
            "by what bends",
            largest));
        return;
      }
      for (std::size_t g = 0; g < meant.size(); ++g) in.goals[g].X_TG.p = in.goals[g].X_TG.p - missed[g];
      const long evaluations = plan_.report.rhs_evaluations;
      plan_ = before;
      plan_.report.rhs_evaluations = evaluations;
      time_ = time, position_ = position, rate_ = rate, X_WB_ = X_WB;
    }
  }

  // How far end-effectors are from their grasp points at the end of the plan, if it is flown by the robot that bends.
  std::vector<Vector3d> missed_by_bending(const std::vector<StraightGoal>& goals, double end) {
    const Kinematics k = forward_kinematics(flown_.model, fly(plan_.joints, end));
    std::vector<Vector3d> missed;
    for (const StraightGoal& goal : goals) {
      const int frame = flown_.model.frame_index(servicer_.model.frames()[goal.frame].name);
      const Posed& X_WT = targets_.capture[static_cast<std::size_t>(goal.target)].X_WT;
      missed.push_back(inverse(X_WT) * frame_pose(flown_.model, k, frame).p - goal.X_TG.p);
    }
    return missed;
  }

  // What the field near the orbit does to a plan that knows nothing of it, at most (14.6). Places: an acceleration of
  // at most 2 mu/R^3 times the distance from the reference point, of the servicer in the whole approach, of a target in
  // the piece straight in. Attitudes: at most 3/2 mu/R^3, from (14.3) with the largest difference of moments of
  // inertia.
  void warn_of_orbit(const StraightInProblem& in) {
    const ReferenceOrbit orbit = reference_orbit(*problem_.orbit);
    const OrbitPoint begin = orbit_point(orbit, 0), end = orbit_point(orbit, in.end);
    const double gradient = std::max(begin.gradient, end.gradient), piece = in.end - in.begin;
    const Vector3d velocity = (1 / motion_.mass) * motion_.h.linear;
    const double servicer =
        std::max(norm(motion_.p_WCom - begin.position), norm(motion_.p_WCom + in.end * velocity - end.position));
    double target = 0;
    for (const TargetMotion& at : targets_.capture) target = std::max(target, norm(at.X_WT.p - end.position));
    plan_.warnings.push_back(fmt::format(
        "approach: straight_in is planned without the orbit's field, which displaces the servicer and the targets "
        "meanwhile by up to {:.2g} m and turns them by up to {:.2g} rad: the end-effectors will miss by what it does",
        gradient * (servicer * in.end * in.end + target * piece * piece), 0.75 * gradient * in.end * in.end));
  }

  // A singularity on the way may be passed and made up for; one at the end may not.
  void require_arrival(const StraightInPath& path) {
    constexpr double kMissed = 1e-3;  // [m and rad]; less is a warning
    double largest = 0;
    std::string text;
    for (std::size_t i = 0; i < path.miss.size(); ++i) {
      plan_.report.miss[i].distance = path.miss[i].distance;
      plan_.report.miss[i].angle = path.miss[i].angle;
      largest = std::max({largest, path.miss[i].distance, path.miss[i].angle});
      if (path.miss[i].distance <= kMissed && path.miss[i].angle <= kMissed) continue;
      text += fmt::format("{}end-effector '{}' ends {:.4g} m and {:.4g} rad from its point", text.empty() ? "" : "; ",
                          plan_.report.miss[i].end_effector, path.miss[i].distance, path.miss[i].angle);
    }
    if (text.empty()) {
      if (largest > 1e-9) {
        plan_.warnings.push_back(fmt::format(
            "approach: straight in, the end-effectors end up to {:.3g} m or rad from their points", largest));
      }
      return;
    }
    plan_.report.found = false;
    throw Unplannable(fmt::format(
        "planning the approach, straight in: {}: {}", text,
        path.damped
            ? fmt::format("its arm comes to a singularity of the generalized Jacobian at t = {:.4g} s (stretched "
                          "out, say), beyond which it does not reach; a shorter stand_off or another start of the arm "
                          "(initial.joints, plan.guess) may help",
                          path.damped_begin)
            : std::string("its joints cannot give the demanded motion; more duration, orientation: free or another "
                          "approach_direction may help")));
  }

  void take_straight_in(const StraightInProblem& in, const StraightInPath& path) {
    plan_.report.rhs_evaluations += path.rhs_evaluations;
    if (!path.finished) throw Unplannable("planning the approach, straight in: " + path.failure);
    require_arrival(path);
    for (std::size_t j = 0; j < plan_.joints.size(); ++j) {
      auto& pieces = plan_.joints[j].pieces;
      pieces.insert(pieces.end(), path.joints[j].pieces.begin(), path.joints[j].pieces.end());
      position_[j] = evaluate(plan_.joints[j], in.end).position;
    }
    rate_ = path.rate_end;
    plan_.report.straight_in =
        StraightInReport{in.begin,        in.stand_off,      in.final_speed,  path.smallest_singular_value,
                         path.damped,     path.damped_begin, path.damped_end, path.unmet,
                         path.unmet_time, path.fit_error};
    if (path.damped) {
      plan_.warnings.push_back(fmt::format(
          "approach: straight in, the arms pass a singularity of the generalized Jacobian between t = {:.4g} "
          "and {:.4g} s (smallest singular value {:.3g}); joint rates are damped there and the demanded "
          "motion is missed by up to {:.3g} (m/s or rad/s)",
          path.damped_begin, path.damped_end, path.smallest_singular_value, path.unmet));
    } else if (path.unmet > 1e-9) {
      plan_.warnings.push_back(
          fmt::format("approach: straight in, the joints cannot give the demanded motion; up to {:.3g} (m/s or rad/s) "
                      "is left unmet, at t = {:.4g} s",
                      path.unmet, path.unmet_time));
    }
  }

  // --- Stated motion ------------------------------------------------------------------------------------------------

  JointTrajectory stated(std::size_t joint) const {
    if (!approach_.sampled) return trajectory_of(approach_.pieces, joint);
    const SampledMotion& s = *approach_.sampled;
    return interpolate_samples(s.times, s.positions[joint],
                               s.rates.empty() ? std::span<const double>{} : std::span(s.rates[joint]));
  }

  void follow_stated() {
    for (std::size_t j = 0; j < plan_.joints.size(); ++j) {
      plan_.joints[j] = stated(j);
      const JointPoint end = evaluate(plan_.joints[j], approach_.duration);
      position_[j] = end.position, rate_[j] = end.rate;
    }
  }

  const CaptureProblem& problem_;
  const ApproachSetup& approach_;
  const TargetPlan& targets_;
  const CaptureDetail detail_;
  ApproachPlan& plan_;
  const double begin_;
  CaptureSystem servicer_;  // for what plans by momentum: its wheels are parts of the base
  CaptureSystem flown_;     // with wheels that turn
  State flown_start_;
  State start_state_;  // of servicer_
  FloatingBase base_;
  FreeMotion motion_;
  mutable WorkWatch watch_;
  double time_;
  std::vector<double> position_, rate_, lower_, upper_, rate_limit_, effort_limit_;
  Posed X_WB_;
};

}  // namespace

ApproachPlan plan_approach(const CaptureProblem& problem, const TargetPlan& targets, CaptureDetail detail,
                           const CaptureProgress& progress, double begin) {
  ApproachPlan plan;
  Planner planner(problem, targets, detail, progress, begin, plan);
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
