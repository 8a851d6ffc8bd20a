#include "grapnel/campaign/quantity.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "grapnel/capture/contact.hpp"
#include "grapnel/dynamics/kinematics.hpp"
#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/problem/capture_system.hpp"
#include "grapnel/problem/target_motion.hpp"

namespace grapnel {
namespace {

// In the order of application.
constexpr std::array<QuantityInfo, 5> kQuantities{{
    {QuantityKind::mass_ratio, "1", false, false,
     "mass of the target over that of the servicer; its inertia is scaled by the same factor"},
    {QuantityKind::target_spin, "rad/s", true, false, "angular velocity of the target about its axis"},
    {QuantityKind::relative_speed, "m/s", false, true,
     "relative speed of the contact point, end-effector minus target"},
    {QuantityKind::relative_direction, "rad", true, true, "rotation angle of the relative velocity"},
    {QuantityKind::approach_angle, "rad", true, true,
     "angle of the end-effector's approach axis from the inward normal"},
}};

[[noreturn]] void refuse(const Quantity& quantity, const std::string& why) {
  throw std::invalid_argument(fmt::format("{}: {}", name_of(quantity.kind), why));
}

bool is_meant(const Quantity& quantity, const std::string& name) { return quantity.of.empty() || quantity.of == name; }

TargetSetup& target_named(CaptureProblem& problem, const std::string& name) {
  return problem.targets[target_index(problem, name)];
}

Vector3d inward_normal(const CaptureProblem& problem, const GraspSetup& grasp) {
  const GraspPoint& point = grasp_point_of(problem, grasp);
  if (point.normal) return -*point.normal;
  if (point.approach_direction) return *point.approach_direction;
  const Vector3d to_com = target_of(problem, grasp).com - point.X_TG.p;
  const double distance = norm(to_com);
  return distance > 0 ? (1 / distance) * to_com : Vector3d::zero();
}

// --- Targets ---

void set_mass_ratio(const QuantityValue& set, TargetSetup& target, const RobotSetup& robot) {
  if (!(set.value > 0)) refuse(set.quantity, "must be greater than 0");
  double servicer = 0;
  for (const BodyDescription& body : robot.bodies) servicer += body.mass;
  const double scale = set.value * servicer / target.mass;
  target.mass = set.value * servicer;
  Symmetric3d& I = target.inertia;
  for (double* component : {&I.xx, &I.yy, &I.zz, &I.xy, &I.xz, &I.yz}) *component *= scale;
}

void set_spin(const QuantityValue& set, TargetSetup& target) {
  const Vector3d present = target.V_WT.angular;
  const double rate = norm(present);
  if (!set.quantity.axis && !(rate > 0))
    refuse(set.quantity, fmt::format("target '{}' does not spin and has no spin axis; give 'axis'", target.name));
  const Vector3d axis = set.quantity.axis ? *set.quantity.axis : (1 / rate) * present;
  const Vector3d p_TC_W = target.X_WT.R * target.com;
  const Vector3d v_C = shift(target.V_WT, p_TC_W).linear;
  target.V_WT = shift(Twistd{set.value * axis, v_C}, -p_TC_W);
}

// --- Relative velocities ---

// The target's attitude at the capture.
Rotationd attitude_at_capture(const Quantity& quantity, const CaptureProblem& problem, const TargetSetup& target) {
  if (target.given_at == TargetSetup::Instant::capture || !problem.approach) return target.X_WT.R;
  if (problem.approach->window) {
    refuse(quantity, fmt::format("approach.window does not fix the capture time of target '{}', and so its attitude; "
                                 "state approach.duration, or the target state at: capture",
                                 target.name));
  }
  return propagate_target(problem, target, {target.X_WT, target.V_WT}, 0, problem.approach->duration).X_WT.R;
}

// Final rates must follow from the grasp points' motion; otherwise a requested relative velocity has no effect.
void expect_rates_follow(const CaptureProblem& problem, const GraspSetup& grasp, const Quantity& quantity) {
  const ApproachSetup& approach = *problem.approach;
  if (approach.straight_in)
    refuse(quantity, "approach.straight_in sets the relative velocity; vary approach.straight_in.final_speed");
  if (approach.sampled || !approach.pieces.empty())
    refuse(quantity, "the approach follows a trajectory, which sets the relative velocity");
  if (approach.final_rates || (!approach.match && !approach.plan))
    refuse(quantity, "the approach's final rates are given; approach.final_rates needs 'match'");
  if (grasp.closes != GraspSetup::Closes::together)
    refuse(quantity, fmt::format("the grasp of '{}' does not close at the end of the approach", grasp.end_effector));
}

// Without an approach: relative velocity of a grasp's contact point, from the initial state.
Vector3d initial_relative_velocity(const CaptureProblem& problem, std::size_t grasp) {
  const CaptureSystem system = make_capture_system(problem);
  State state = initial_servicer_state(problem, system);
  for (std::size_t t = 0; t < problem.targets.size(); ++t) {
    const int body = system.model.frames()[system.target_frames[t]].body;
    set_root_pose(system.model, body, problem.targets[t].X_WT, state);
    set_root_twist(system.model, body, problem.targets[t].V_WT, state);
  }
  const Contact contact = make_contact(problem, system, state, {});
  if (!contact.refused.empty()) throw std::invalid_argument("contact refused: " + contact.refused);
  const Kinematics k = forward_kinematics(system.model, contact.state);
  const int end_effector = system.model.frame_index(problem.grasps[grasp].end_effector);
  const int target = system.target_frames[target_index(problem, problem.grasps[grasp].target)];
  const Vector3d p_WE = frame_pose(system.model, k, end_effector).p;  // the contact point
  const Vector3d p_TE = p_WE - frame_pose(system.model, k, target).p;
  return frame_twist(system.model, k, end_effector).linear - shift(frame_twist(system.model, k, target), p_TE).linear;
}

Vector3d relative_velocity(const CaptureProblem& problem, std::size_t grasp) {
  return problem.approach ? problem.grasps[grasp].relative_velocity : initial_relative_velocity(problem, grasp);
}

void set_relative_velocity(const Quantity& quantity, const Vector3d& u, CaptureProblem& problem, std::size_t grasp) {
  GraspSetup& g = problem.grasps[grasp];
  if (problem.approach) {
    g.relative_velocity = u;
    return;
  }
  const auto same = [&](const GraspSetup& other) { return other.target == g.target; };
  if (std::count_if(problem.grasps.begin(), problem.grasps.end(), same) > 1)
    refuse(quantity, fmt::format("without an approach the target moves, and '{}' is grasped more than once", g.target));
  TargetSetup& target = target_named(problem, g.target);
  target.V_WT.linear += relative_velocity(problem, grasp) - u;
}

void set_relative_speed(const QuantityValue& set, CaptureProblem& problem, std::size_t grasp) {
  const GraspSetup& g = problem.grasps[grasp];
  Vector3d direction = set.quantity.direction.value_or(Vector3d::zero());
  if (!set.quantity.direction) {
    direction = attitude_at_capture(set.quantity, problem, target_of(problem, g)) * inward_normal(problem, g);
    if (!(norm(direction) > 0))
      refuse(set.quantity, fmt::format("grasp point '{}' is the centre of mass and has no approach_direction; give "
                                       "'direction'",
                                       g.grasp_point));
  }
  set_relative_velocity(set.quantity, set.value * direction, problem, grasp);
}

void turn_relative_velocity(const QuantityValue& set, CaptureProblem& problem, std::size_t grasp) {
  const Rotationd R_WT = attitude_at_capture(set.quantity, problem, target_of(problem, problem.grasps[grasp]));
  const Vector3d axis = R_WT * set.quantity.axis.value_or(Vector3d::unit(2));
  set_relative_velocity(set.quantity, rotation_about(axis, set.value) * relative_velocity(problem, grasp), problem,
                        grasp);
}

// --- Approach angle ---

void set_approach_angle(const QuantityValue& set, CaptureProblem& problem, std::size_t grasp) {
  GraspSetup& g = problem.grasps[grasp];
  if (!problem.approach || !problem.approach->plan)
    refuse(set.quantity, "the configuration is given; it needs approach.plan");
  if (!end_effector_of(problem, g).approach_axis)
    refuse(set.quantity, fmt::format("end-effector '{}' has no approach_axis", g.end_effector));
  const Vector3d normal = inward_normal(problem, g);
  if (!(norm(normal) > 0))
    refuse(set.quantity,
           fmt::format("grasp point '{}' is the centre of mass and has no approach_direction", g.grasp_point));
  GraspPoint turned = grasp_point_of(problem, g);
  if (g.contact) turned.normal = contact_normal(target_of(problem, g), turned);  // the surface is unchanged
  turned.approach_direction = rotation_about(set.quantity.axis.value_or(Vector3d::unit(2)), set.value) * normal;
  turned.name = fmt::format("{} (as '{}' approaches)", turned.name, g.end_effector);
  g.grasp_point = turned.name;
  g.orientation = GraspSetup::Orientation::axis;
  target_named(problem, g.target).grasp_points.push_back(std::move(turned));
}

void apply(const QuantityValue& set, CaptureProblem& problem) {
  if (!std::isfinite(set.value)) refuse(set.quantity, "must be a finite number");
  bool any = false;
  if (!info(set.quantity.kind).of_grasp) {
    for (TargetSetup& target : problem.targets) {
      if (!is_meant(set.quantity, target.name)) continue;
      any = true;
      if (set.quantity.kind == QuantityKind::mass_ratio)
        set_mass_ratio(set, target, problem.robot);
      else
        set_spin(set, target);
    }
    if (!any) refuse(set.quantity, fmt::format("unknown target '{}'", set.quantity.of));
    return;
  }
  for (std::size_t g = 0; g < problem.grasps.size(); ++g) {
    if (!is_meant(set.quantity, problem.grasps[g].end_effector)) continue;
    any = true;
    if (set.quantity.kind == QuantityKind::approach_angle) {
      set_approach_angle(set, problem, g);
      continue;
    }
    if (problem.approach) expect_rates_follow(problem, problem.grasps[g], set.quantity);
    if (set.quantity.kind == QuantityKind::relative_speed)
      set_relative_speed(set, problem, g);
    else
      turn_relative_velocity(set, problem, g);
  }
  if (!any) refuse(set.quantity, fmt::format("no grasp of end-effector '{}'", set.quantity.of));
}

}  // namespace

const QuantityInfo& info(QuantityKind kind) { return kQuantities[static_cast<std::size_t>(kind)]; }

void apply_quantities(std::span<const QuantityValue> values, CaptureProblem& problem) {
  for (const QuantityInfo& one : kQuantities) {
    for (const QuantityValue& value : values) {
      if (value.quantity.kind == one.kind) apply(value, problem);
    }
  }
}

std::vector<Vector3d> inward_normals(const CaptureProblem& problem) {
  std::vector<Vector3d> normals;
  for (const GraspSetup& grasp : problem.grasps) normals.push_back(inward_normal(problem, grasp));
  return normals;
}

}  // namespace grapnel
