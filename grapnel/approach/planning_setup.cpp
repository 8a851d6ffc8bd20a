#include "grapnel/approach/planning_setup.hpp"

#include <algorithm>

#include "grapnel/impact/impulse_measures.hpp"
#include "grapnel/impact/plastic_impact.hpp"
#include "grapnel/model/coupling.hpp"
#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/problem/contact_pairs.hpp"
#include "grapnel/problem/flexible_bodies.hpp"
#include "grapnel/problem/plan_objectives.hpp"
#include "grapnel/simulate/reaction_wheels.hpp"

namespace grapnel {

std::vector<Objective::Term> objective_terms(const PlanSetup& plan) {
  std::vector<Objective::Term> terms;
  for (const PlanObjective& one : kPlanObjectives) {
    const double weight = weight_in(plan, one);
    if (weight > 0) terms.push_back({one.objective, weight});
  }
  return terms;
}

// Wheels, momentum of the servicer and desired attitude => terms of (6.26) as shares of the maximum momenta: H = R_D^T
// L, rows of A^+ and null motion of each wheel.
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

namespace {

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

}  // namespace

// Problem and target motion => bodies for clearance along a path, with the robot rigid: robot bodies are placed by
// their links, targets by `target_at`; per grasp, the distance within which gripper and target may touch.
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

// Problem and targets at the capture => function of final joints, rates and base pose that builds the state just before
// the impact and returns its planned impulse (docs/theory, section 7) or the index (13.5).
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

}  // namespace grapnel
