#include "grapnel/approach/planning_setup.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "grapnel/approach/planning_task.hpp"
#include "grapnel/impact/impulse_measures.hpp"
#include "grapnel/impact/plastic_impact.hpp"
#include "grapnel/model/coupling.hpp"
#include "grapnel/plan/path_constraint_check.hpp"
#include "grapnel/problem/contact_pairs.hpp"
#include "grapnel/problem/enumeration_names.hpp"
#include "grapnel/problem/flexible_bodies.hpp"
#include "grapnel/problem/plan_objectives.hpp"
#include "grapnel/problem/problem_clearance.hpp"
#include "grapnel/simulate/reaction_wheels.hpp"

namespace grapnel {
namespace {

// The objective's terms with their weights.
std::vector<Objective::Term> objective_terms(const PlanSetup& plan) {
  std::vector<Objective::Term> terms;
  for (const PlanObjective& one : kPlanObjectives) {
    const double weight = weight_in(plan, one);
    if (weight > 0) terms.push_back({one.objective, weight});
  }
  return terms;
}

// Wheels that hold the base at R_WD from `begin` on, where it is at R_WB and the wheels have the rates of the problem,
// and motion of the servicer with its wheels fixed to the base => terms of (6.26) as shares of the maximum momenta: H =
// R_D^T L, rows of A^+ and null motion of each wheel.
WheelMomentum planned_wheels(const CaptureProblem& problem, const FreeMotion& motion, const Rotationd& R_WB,
                             const Rotationd& R_WD, double begin) {
  const BaseControlSetup& control = *problem.approach->base_control;
  std::vector<ReactionWheel> wheels;
  std::vector<double> before, wanted;  // J Omega_0 and J Omega_d [N m s]
  WheelMomentum result;
  result.begin = begin, result.rate = control.wheel_speed_rate;
  for (std::size_t i = 0; i < problem.robot.wheels.size(); ++i) {
    const WheelSetup& w = problem.robot.wheels[i];
    wheels.push_back({.axis = w.axis, .torque = w.torque, .rate = w.rate, .inertia = w.inertia});
    before.push_back(problem.wheel_rate.empty() ? 0 : w.inertia * problem.wheel_rate[i]);
    wanted.push_back(control.wheel_speeds.empty() ? 0 : w.inertia * control.wheel_speeds[i]);
  }
  const WheelArray array(wheels);
  const auto of_base = [&](std::span<const double> momenta) {  // A J Omega
    Vector3d h = Vector3d::zero();
    for (std::size_t i = 0; i < wheels.size(); ++i) h += momenta[i] * wheels[i].axis;
    return h;
  };
  const Vector3d h_0 = of_base(before), h_d = of_base(wanted);
  result.H = transposed_times(R_WD, motion.h.angular + R_WB * h_0);
  for (std::size_t i = 0; i < wheels.size(); ++i) {
    const Vector3d& share = array.shares()[i];  // row of A^+
    const double largest = wheels[i].inertia * wheels[i].rate;
    const double null_before = before[i] - dot(share, h_0), null_wanted = wanted[i] - dot(share, h_d);
    // Without wheel_speed_rate the null motion is constant.
    result.wheels.push_back({problem.robot.wheels[i].name, (1 / largest) * share, null_wanted / largest,
                             (null_before - null_wanted) / largest});
  }
  return result;
}

// Obstacle => its shapes, a half-space as a box whose face is centred beneath the base; its distances are exact for
// bodies that are less than kHalf from there.
std::vector<Geometry> shapes_of(const ObstacleSetup& obstacle, const Posed& X_WB) {
  if (!obstacle.geometry.empty()) return obstacle.geometry;
  constexpr double kHalf = 1e4;  // [m]
  Geometry box{Geometry::Shape::box, {2 * kHalf, 2 * kHalf, kHalf}};
  const Vector3d base = inverse(obstacle.X_WO) * X_WB.p;
  box.X_BG.p = {base[0], base[1], -0.5 * kHalf};
  return {box};
}

// Problem => problem whose clearance model has all pairs that a plan keeps apart: pairs of `contacts` unless they are
// allowed, and obstacles, as targets that follow those of the problem.
CaptureProblem kept_apart(const CaptureProblem& stated) {
  CaptureProblem problem = rigid_problem(stated);
  problem.impact.reset();  // not all targets need a grasp
  const std::size_t targets = problem.targets.size();
  const auto stand_in = [&](const BodyName& body) {
    return body.obstacle ? BodyName::of_target(targets + *body.obstacle) : body;
  };
  auto& ignore = problem.clearance.ignore;
  if (!problem.contacts.empty() && problem.approach->plan->contacts == PlanSetup::Contacts::allowed) {
    for (const ContactPair& pair : contact_pairs(problem, make_capture_system(problem)))
      ignore.emplace_back(stand_in(pair.a), stand_in(pair.b));
  }
  problem.contacts.clear(), problem.stages.clear();
  for (std::size_t k = 0; k < problem.obstacles.size(); ++k) {
    const ObstacleSetup& obstacle = problem.obstacles[k];
    TargetSetup& body = problem.targets.emplace_back();
    body.name = obstacle.name, body.mass = 1, body.inertia = Symmetric3d::diagonal(1, 1, 1);
    body.geometry = shapes_of(obstacle, problem.X_WB);
    body.X_WT = obstacle.X_WO;
    for (std::size_t t = 0; t < targets + k; ++t) {
      ignore.emplace_back(BodyName::of_target(t), BodyName::of_target(targets + k));
      for (const PanelSetup& panel : problem.targets[t].panels)
        ignore.emplace_back(BodyName::of_target(t, panel.name), BodyName::of_target(targets + k));
    }
  }
  return problem;
}

// A base that does not move relative to obstacles is not kept apart from them.
void ignore_still_base(const CaptureSystem& system, std::size_t targets, CaptureProblem& problem) {
  if (problem.robot.base_mode == RobotSetup::Base::free) return;
  for (const int body : tied_to(system.model, system.base)) {
    for (std::size_t t = targets; t < problem.targets.size(); ++t) {
      if (system.addresses[body].owner == BodyAddress::Owner::robot)
        problem.clearance.ignore.emplace_back(system.model.bodies()[body].description.name, BodyName::of_target(t));
    }
  }
}

// Bodies that may touch the target of a grasp near its grasp point: those fixed to the end-effector, and links that the
// end-effector's body carries and that may touch the target by `contacts`, as fingers.
std::vector<int> gripper_near_grasp(const CaptureProblem& stated, const CaptureProblem& problem,
                                    const CaptureSystem& system, const GraspSetup& grasp) {
  const Model& model = system.model;
  const int palm = model.frames()[model.frame_index(grasp.end_effector)].body;
  std::vector<int> bodies = tied_to(model, palm);
  if (stated.contacts.empty()) return bodies;
  const auto is_carried = [&](int body) {
    for (; body >= 0; body = model.bodies()[body].parent) {
      if (std::ranges::find(bodies, body) != bodies.end()) return true;
    }
    return false;
  };
  const BodyName target = BodyName::of_target(target_index(problem, grasp.target));
  std::vector<int> fingers;
  for (const ContactPair& pair : contact_pairs(stated, make_capture_system(stated))) {
    if (pair.a != target && pair.b != target) continue;
    for (const int body : bodies_named(problem, system, pair.a == target ? pair.b : pair.a)) {
      if (system.addresses[body].owner == BodyAddress::Owner::robot && is_carried(body)) fingers.push_back(body);
    }
  }
  bodies.insert(bodies.end(), fingers.begin(), fingers.end());
  return bodies;
}

// Problem and motion of a target at a time => bodies for clearance along a path, with the robot rigid: robot bodies are
// placed by their links, targets by `target_at`. Pairs that `contacts` names are kept apart unless PlanSetup::contacts
// allows them to touch. An end-effector and the links that gripper_near_grasp() names may touch its target within
// PlanSetup::near_grasp of the grasp point; its default is the extent of the gripper's shapes from the end-effector
// plus the required clearance. The result refers only to what `target_at` refers to.
std::shared_ptr<const ConstraintBodies> constraint_bodies(
    const CaptureProblem& stated, const CaptureSystem& servicer,
    std::function<TargetMotion(std::size_t target, double time)> target_at) {
  const std::size_t targets = stated.targets.size();
  CaptureProblem problem = kept_apart(stated);
  const CaptureSystem system = make_capture_system(problem);
  const Model& model = system.model;
  ignore_still_base(system, targets, problem);
  auto bodies = std::make_shared<ConstraintBodies>();
  bodies->model = make_clearance_model(problem, system, std::vector<bool>(problem.grasps.size(), true));
  // Targets move as planned, with their panels at rest.
  struct Placed {
    std::size_t body, target;
    Posed X_TB;
  };
  std::vector<Placed> placed;
  const Kinematics at_rest = forward_kinematics(model, initial_servicer_state(problem, system));
  for (std::size_t b = 0; b < model.bodies().size(); ++b) {
    bodies->names.push_back(shown_name(system, static_cast<int>(b)));
    bodies->link.push_back(-1), bodies->X_LB.push_back(Posed::identity());
    const BodyAddress& address = system.addresses[b];
    if (address.owner == BodyAddress::Owner::target) {
      const Posed X_WT = frame_pose(model, at_rest, system.target_frames[address.target]);
      placed.push_back({b, address.target, inverse(X_WT) * at_rest.X_WB[b]});
    }
    if (address.owner != BodyAddress::Owner::robot) continue;
    const BodyPlacement& placement = servicer.model.bodies()[body_at(servicer, address)].placement;
    bodies->link.back() = placement.link, bodies->X_LB.back() = placement.X_LB;
  }
  std::vector<Posed> X_WO;
  for (const ObstacleSetup& obstacle : problem.obstacles) X_WO.push_back(obstacle.X_WO);
  bodies->place_others = [placed, targets, X_WO, target_at = std::move(target_at)](double time,
                                                                                   std::vector<Posed>& X_WB) {
    std::vector<Posed> X_WT;
    for (std::size_t t = 0; t < targets; ++t) X_WT.push_back(target_at(t, time).X_WT);
    X_WT.insert(X_WT.end(), X_WO.begin(), X_WO.end());
    for (const Placed& each : placed) X_WB[each.body] = X_WT[each.target] * each.X_TB;
  };
  bodies->end_effector.assign(bodies->model.pairs().size(), -1);
  for (const GraspSetup& g : problem.grasps) {
    const Frame& frame = model.frames()[model.frame_index(g.end_effector)];
    const std::vector<int> gripper = tied_to(model, frame.body);
    ConstraintBodies::EndEffector h;
    h.frame = servicer.model.frame_index(g.end_effector);
    h.target = target_body_index(system, target_index(problem, g.target));
    h.p_TG = own_frame(system, h.target) * grasp_point_of(problem, g).X_TG.p;
    double reach = 0;  // maximum distance of the gripper's shapes from the end-effector
    for (std::size_t s = 0; s < bodies->model.shapes().size(); ++s) {
      const int body = bodies->model.shapes()[s].body;
      if (std::find(gripper.begin(), gripper.end(), body) == gripper.end()) continue;
      const Posed X_BE =
          inverse(model.bodies()[body].placement.X_LB) * model.bodies()[frame.body].placement.X_LB * frame.X_BE;
      reach = std::max(reach, bodies->model.farthest(static_cast<int>(s), X_BE.p));
    }
    h.near = problem.approach->plan->near_grasp.value_or(reach + problem.approach->plan->clearance.value_or(0));
    const std::vector<int> near_grasp = gripper_near_grasp(stated, problem, system, g);
    for (std::size_t p = 0; p < bodies->end_effector.size(); ++p) {
      const ClearancePair& pair = bodies->model.pairs()[p];
      const auto is_gripper = [&](int body) {
        return std::find(near_grasp.begin(), near_grasp.end(), body) != near_grasp.end();
      };
      if ((is_gripper(pair.body_a) && pair.body_b == h.target) || (is_gripper(pair.body_b) && pair.body_a == h.target))
        bodies->end_effector[p] = static_cast<int>(bodies->end_effectors.size());
    }
    bodies->end_effectors.push_back(h);
  }
  return bodies;
}

// Problem and targets at the capture => PathConstraints::end_measure: builds the state just before the impact with
// rigid grasps, and joints free or held by drives or brakes as the problem states, and returns its planned impulse
// (docs/theory, section 7) or the index (13.5). `base` is scratch, of the servicer, to which alone the result refers;
// `motion` gives its motion at `end`.
std::function<double(Objective::Kind kind, std::span<const double> position, std::span<const double> rate,
                     const Posed& X_WB)>
capture_measure(const CaptureProblem& problem, FloatingBase& base, const FreeMotion& motion, double end,
                const std::vector<TargetMotion>& targets) {
  struct Capture {
    CaptureSystem system;
    State state;
    std::vector<GraspSetup> grasps;
    std::vector<std::size_t> target_of;  // grasp
    ImpactSetup::Joints joints;
  };
  auto capture = std::make_shared<Capture>(Capture{make_capture_system(problem), {}, problem.grasps, {}, {}});
  const Model& model = capture->system.model;
  capture->state = initial_servicer_state(problem, capture->system);
  for (std::size_t t = 0; t < targets.size(); ++t) {
    const int body = model.frames()[capture->system.target_frames[t]].body;
    set_root_pose(model, body, targets[t].X_WT, capture->state);
    set_root_twist(model, body, targets[t].V_WT, capture->state);
  }
  for (const GraspSetup& g : problem.grasps) capture->target_of.push_back(target_index(problem, g.target));
  capture->joints = problem.impact ? problem.impact->joints : ImpactSetup::Joints::free;
  return [capture, &base, motion, end](Objective::Kind kind, std::span<const double> position,
                                       std::span<const double> rate, const Posed& X_WB) {
    const CaptureSystem& system = capture->system;
    State& state = capture->state;
    std::vector<HeldRate> held = coupling_rates(system.model);
    for (std::size_t j = 0; j < position.size(); ++j) {
      const Body& body = system.model.bodies()[system.model.joints()[system.robot_joints[j]]];
      state.q[body.q] = position[j], state.v[body.v] = rate[j];
      if (follows_others(body)) continue;
      if (capture->joints == ImpactSetup::Joints::driven) held.push_back({body.v, rate[j]});
      if (capture->joints == ImpactSetup::Joints::braked) held.push_back({body.v, 0.0});
    }
    base.place(position);
    base.move(rate, motion.in_base(end, X_WB));
    if (base.floats()) {
      set_root_pose(system.model, system.base, X_WB, state);
      const Twistd V_B = twist_from(base.base_twist());
      set_root_twist(system.model, system.base, X_WB.R * V_B, state);
    }
    const Kinematics kinematics = forward_kinematics(system.model, state);
    std::vector<Grasp> grasps;
    for (std::size_t i = 0; i < capture->grasps.size(); ++i) {
      const GraspSetup& g = capture->grasps[i];
      const int frame = system.model.frame_index(g.end_effector);
      const int target = system.model.frames()[system.target_frames[capture->target_of[i]]].body;
      const Posed X_WE = frame_pose(system.model, kinematics, frame);
      grasps.push_back({system.model.frames()[frame].body, target, g.model, X_WE.p, X_WE.R * g.hinge_axis});
    }
    const PlannedImpulse impulse = planned_impulse(system.model, state, grasps, held);
    return kind == Objective::Kind::impulse ? impulse.energy : impulse.mean_impulse;
  };
}

// State at the segment's begin => `reach` with the required clearance, which is reduced, with a warning, if the
// approach is replanned and the bodies are nearer. Otherwise throws Unplannable with the nearest pairs.
void check_start_clearance(PlanningTask& task, PlanDraft& draft, ReachProblem& reach) {
  if (!reach.constraints.clearance) return;
  constexpr double kRounding = 1e-6;  // [m]; plans satisfy the clearance to this tolerance
  constexpr std::size_t kNamed = 3;   // pairs
  PlacedLinks links;
  task.base.place(draft.position, links);
  PathSegment::SegmentPoint start;
  start.time = draft.time, start.position = draft.position, start.rate = draft.rate, start.X_WB = draft.X_WB,
  start.placed = &links;
  start.acceleration.assign(draft.position.size(), 0.0);
  PathConstraintCheck check(task.base, reach);
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
  if (task.begin > 0 && nearest > 0) {
    constexpr double kRoom = 0.99;
    reach.constraints.clearance = kRoom * nearest;
    draft.plan.warnings.push_back(
        fmt::format("approach: replanned at t = {:.4g} s, where {}: the remaining approach keeps a clearance of {:.4g} "
                    "m instead of the {:.4g} m of approach.plan.clearance",
                    draft.time, pairs, *reach.constraints.clearance, required));
    return;
  }
  throw Unplannable(fmt::format(
      "planning the approach: at the start of the segment, t = {:.4g} s, {}; the minimum clearance is {:.4g} m "
      "(approach.plan.clearance), and no motion changes the start: {}, set a smaller clearance, or add the pair to "
      "clearance.ignore",
      draft.time, pairs, required,
      draft.time == 0 ? "change initial.joints or initial.base" : "change the waypoint at which the segment begins"));
}

// Wheels, momentum and attitude => momentum model (6.26) and its limit in `constraints`. If the begin of the segment
// exceeds the limit: Unplannable, or a larger limit with a warning if the approach is replanned.
void set_wheels(PlanningTask& task, PlanDraft& draft, PathConstraints& constraints) {
  if (!task.attitude_held()) {
    throw Unplannable(
        "planning the approach: the wheel momentum settings of approach.plan require an attitude-controlled base, but "
        "approach.base_control is too weak to hold the attitude while the joints move; increase its gains or set "
        "feedforward");
  }
  constraints.wheels = planned_wheels(task.problem, task.motion, task.problem.X_WB.R, draft.X_WB.R, task.begin);
  constraints.wheel_share = task.approach.plan->wheel_momentum.value_or(constraints.wheel_share);
  PlacedLinks links;
  task.base.place(draft.position, links);
  const Vector3d u = FloatingBase::momentum_of_rates(links, draft.rate);
  for (std::size_t i = 0; i < constraints.wheels->wheels.size(); ++i) {
    const double share = std::abs(constraints.wheels->share(i, draft.time, u));
    constexpr double kRounding = 1e-6;  // tolerance of plans
    if (share <= constraints.wheel_share + kRounding) continue;
    const std::string what = fmt::format(
        "wheel '{}' needs {:.6g} of its momentum capacity to hold the base's attitude at the segment's begin, t = "
        "{:.4g} s; the limit approach.plan.wheel_momentum is {:.6g}",
        constraints.wheels->wheels[i].name, share, draft.time, constraints.wheel_share);
    if (task.begin == 0) {
      throw Unplannable("planning the approach: " + what + ", and no joint motion can change that");
    }
    // A replanned approach continues from the state of the controlled base. There is rarely a feasible trajectory
    // without any further increase of the momentum.
    constexpr double kRoom = 1.01;
    constraints.wheel_share = kRoom * share;
    draft.plan.warnings.push_back(fmt::format("approach: replanned, {}; the limit for the remaining approach is {:.6g}",
                                              what, constraints.wheel_share));
  }
}

// Rejects settings that contradict an attitude-controlled base.
void refuse_turning(const PlanSetup& plan) {
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

}  // namespace

void apply_plan_setup(PlanningTask& task, PlanDraft& draft, ReachProblem& reach) {
  const PlanSetup& plan = *task.approach.plan;
  reach.starts = plan.starts, reach.seed = plan.seed;
  if (!plan.guess.empty()) reach.guess = plan.guess;
  reach.objective = Objective(objective_terms(plan), reach.start, reach.guess, task.lower, task.upper);
  PathConstraints& constraints = reach.constraints;
  constraints.limits = plan.limits == PlanSetup::Limits::during_approach;
  constraints.effort_limit = task.effort_limit;
  constraints.base_turn = plan.base_turn.value_or(constraints.base_turn);
  constraints.R_WB0 = task.problem.X_WB.R;
  constraints.clearance = plan.clearance;
  constraints.knots = plan.knots;
  if (plan.wheel_momentum || weight_in(plan, PlanSetup::Objective::wheel_momentum) > 0)
    set_wheels(task, draft, constraints);
  if (task.attitude_held()) refuse_turning(plan);
  if (plan.clearance || weight_in(plan, PlanSetup::Objective::clearance) > 0) {
    constraints.bodies = constraint_bodies(task.problem, task.servicer,
                                           [&task](std::size_t target, double t) { return task.target_at(target, t); });
    if (constraints.bodies->model.pairs().empty()) {
      throw Unplannable(
          "planning the approach: approach.plan requires clearance, but there is no pair of bodies to check: shapes "
          "('geometry') of the robot's links and of the targets are missing, or clearance.ignore or "
          "approach.plan.contacts: allowed excludes all pairs");
    }
    check_start_clearance(task, draft, reach);
  }
  if (weight_in(plan, PlanSetup::Objective::impulse) > 0 || weight_in(plan, PlanSetup::Objective::impulse_index) > 0)
    constraints.end_measure =
        capture_measure(task.problem, task.base, task.motion, reach.start.end, task.targets.capture);
}

}  // namespace grapnel
