#include "grapnel/scenario/problem_bytes.hpp"

#include <cstring>
#include <memory>
#include <optional>
#include <type_traits>
#include <utility>
#include <vector>

namespace grapnel {
namespace {

// Structured bindings name every field of a structure: one that is added or taken away does not compile here.
class Bytes {
 public:
  std::string text;

  template <class... Fields>
  void all(const Fields&... fields) {
    (put(fields), ...);
  }

  template <class Number>
  requires std::is_arithmetic_v<Number> || std::is_enum_v<Number>
  void put(const Number& number) {
    char bytes[sizeof number];
    std::memcpy(bytes, &number, sizeof number);
    text.append(bytes, sizeof number);
  }
  void put(const std::string& words) {
    put(words.size());
    text += words;
  }
  template <class Value>
  void put(const std::optional<Value>& value) {
    put(value.has_value());
    if (value) put(*value);
  }
  template <class Value>
  void put(const std::vector<Value>& list) {
    put(list.size());
    for (const Value& one : list) put(one);
  }
  template <class A, class B>
  void put(const std::pair<A, B>& both) {
    all(both.first, both.second);
  }
  void put(const std::shared_ptr<const TriangleMesh>& mesh) { put(reinterpret_cast<std::uintptr_t>(mesh.get())); }

  void put(const Vector3d& v) { all(v[0], v[1], v[2]); }
  void put(const Symmetric3d& I) {
    const auto& [xx, yy, zz, xy, xz, yz] = I;
    all(xx, yy, zz, xy, xz, yz);
  }
  void put(const Rotationd& R) { all(R.column(0), R.column(1), R.column(2)); }
  void put(const Posed& X) {
    const auto& [R, p] = X;
    all(R, p);
  }
  void put(const Twistd& V) {
    const auto& [angular, linear] = V;
    all(angular, linear);
  }
  void put(const Momentumd& h) {
    const auto& [angular, linear] = h;
    all(angular, linear);
  }
  void put(const Wrenchd& F) {
    const auto& [moment, force] = F;
    all(moment, force);
  }

  void put(const JointDescription& joint) {
    const auto& [name, type, axis, limits, friction, rotor_inertia, gear_ratio] = joint;
    const auto& [lower, upper, rate, effort] = limits;
    const auto& [viscous, coulomb, transition_rate] = friction;
    all(name, type, axis, lower, upper, rate, effort, viscous, coulomb, transition_rate, rotor_inertia, gear_ratio);
  }
  void put(const BodyDescription& body) {
    const auto& [name, parent, X_PF, joint, mass, com, inertia] = body;
    all(name, parent, X_PF, joint, mass, com, inertia);
  }
  void put(const FrameDescription& frame) {
    const auto& [name, body, X_BE] = frame;
    all(name, body, X_BE);
  }
  void put(const Geometry& geometry) {
    const auto& [shape, size, X_BG, mesh] = geometry;
    all(shape, size, X_BG, mesh);
  }
  void put(const CaptureEnvelope& envelope) {
    const auto& [position, angle, velocity, angular_velocity] = envelope;
    all(position, angle, velocity, angular_velocity);
  }
  void put(const LoadRating& rating) {
    const auto& [force, moment, impulse, angular_impulse, driving, driving_impulse] = rating;
    all(force, moment, impulse, angular_impulse, driving, driving_impulse);
  }
  void put(const EndEffectorSetup& e) {
    put(static_cast<const FrameDescription&>(e));
    all(e.approach_axis, e.envelope, e.rating);
  }
  void put(const RobotSetup& robot) {
    const auto& [name, base, base_mode, bodies, end_effectors, geometry, ratings] = robot;
    all(name, base, base_mode, bodies, end_effectors, geometry, ratings);
  }
  void put(const GraspPoint& point) {
    const auto& [name, X_TG, approach_direction, normal] = point;
    all(name, X_TG, approach_direction, normal);
  }
  void put(const TargetSetup& target) {
    const auto& [name, mass, com, inertia, geometry, given_at, X_WT, V_WT, grasp_points] = target;
    all(name, mass, com, inertia, geometry, given_at, X_WT, V_WT, grasp_points);
  }
  void put(const GraspSetup& grasp) {
    const auto& [end_effector, target, point, model, hinge_axis, contact, orientation, closes, closes_at, velocity,
                 angular_velocity] = grasp;
    all(end_effector, target, point, model, hinge_axis, contact, orientation, closes, closes_at, velocity,
        angular_velocity);
  }
  void put(const TrackingNoise& noise) {
    const auto& [position, bandwidth, seed] = noise;
    all(position, bandwidth, seed);
  }
  void put(const TrackingSetup& tracking) {
    const auto& [mode, kp, kd, noise] = tracking;
    all(mode, kp, kd, noise);
  }
  void put(const BaseControlSetup& control) {
    const auto& [kp, kd, limit, R_WD] = control;
    all(kp, kd, limit, R_WD);
  }
  void put(const PlanSetup& plan) {
    const auto& [measure, guess, starts, seed, max_evaluations] = plan;
    all(measure, guess, starts, seed, max_evaluations);
  }
  void put(const Waypoint::Place& place) {
    const auto& [end_effector, target, position, velocity] = place;
    all(end_effector, target, position, velocity);
  }
  void put(const Waypoint& waypoint) {
    const auto& [time, joints, rates, places] = waypoint;
    all(time, joints, rates, places);
  }
  void put(const StraightIn& straight) {
    const auto& [stand_off, duration, final_speed] = straight;
    all(stand_off, duration, final_speed);
  }
  void put(const SampledMotion& motion) {
    const auto& [times, positions, rates] = motion;
    all(times, positions, rates);
  }
  void put(const MotionPiece& piece) {
    const auto& [until, series] = piece;
    all(until, series);
  }
  void put(const ApproachSetup& approach) {
    const auto& [duration, profile, final_position, plan, sampled, pieces, final_rates, match, waypoints, straight_in,
                 tracking, base_control, capture_at] = approach;
    all(duration, profile, final_position, plan, sampled, pieces, final_rates, match, waypoints, straight_in, tracking,
        base_control, capture_at);
  }
  void put(const ContactSetup& contact) {
    const auto& [gap, refuse_beyond, largest_gap] = contact;
    all(gap, refuse_beyond, largest_gap);
  }
  void put(const ContactComplianceSetup& contact) {
    const auto& [model, stiffness, damping, exponent, slip_speed] = contact;
    all(model, stiffness, damping, exponent, slip_speed);
  }
  void put(const GripComplianceSetup& grip) {
    const auto& [linear_stiffness, linear_damping, angular_stiffness, angular_damping] = grip;
    all(linear_stiffness, linear_damping, angular_stiffness, angular_damping);
  }
  void put(const CompliantSetup& compliant) {
    const auto& [longest, settled, relative_tolerance, samples, most_steps] = compliant;
    all(longest, settled, relative_tolerance, samples, most_steps);
  }
  void put(const ImpactSetup& impact) {
    const auto& [law, duration, joints, restitution, angular_restitution, friction, hypothesis, contact, grip,
                 compliant] = impact;
    all(law, duration, joints, restitution, angular_restitution, friction, hypothesis, contact, grip, compliant);
  }
  void put(const PostImpactSetup::Release& release) {
    const auto& [after, end_effectors] = release;
    all(after, end_effectors);
  }
  void put(const PostImpactSetup& post) {
    const auto& [duration, joints, kp, kd, base_control, releases] = post;
    all(duration, joints, kp, kd, base_control, releases);
  }
  void put(const LoadProfile& profile) {
    const auto& [shape, start, end, frequency, phase, times, values] = profile;
    all(shape, start, end, frequency, phase, times, values);
  }
  void put(const LoadSetup& load) {
    const auto& [body, p_BP, in_body, amplitude, profile] = load;
    all(body, p_BP, in_body, amplitude, profile);
  }
  void put(const ClearanceSetup& clearance) {
    const auto& [enabled, required, ignore] = clearance;
    all(enabled, required, ignore);
  }
  void put(const IntegrationSetup& integration) {
    const auto& [method, root_velocity, loops, baumgarte_time, relative_tolerance, absolute_tolerance, step, max_step,
                 max_steps] = integration;
    all(method, root_velocity, loops, baumgarte_time, relative_tolerance, absolute_tolerance, step, max_step,
        max_steps);
  }
  void put(const CaptureProblem& problem) {
    const auto& [name, unused_sha256, unused_source, robot, gravity, targets, grasps, X_WB, V_WB, momentum,
                 joint_position, joint_rate, approach, contact, impact, post_impact, loads, clearance, integration,
                 output_interval, output_as_published] = problem;
    all(name, robot, gravity, targets, grasps, X_WB, V_WB, momentum, joint_position, joint_rate, approach, contact,
        impact, post_impact, loads, clearance, integration, output_interval, output_as_published);
  }
};

}  // namespace

std::string problem_bytes(const CaptureProblem& problem) {
  Bytes bytes;
  bytes.put(problem);
  return std::move(bytes.text);
}

}  // namespace grapnel
