#pragma once

/// @file
/// The report of an impact: grasps, joints, measures and loads. impact_fields.cpp describes each field with its unit.
/// Public, kept stable.

#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "grapnel/result/motion_result.hpp"

namespace grapnel {

/// The rebound of a contact, which does not hold.
struct ContactRebound {
  Vector3d normal;
  double normal_impulse = 0;
  Vector3d tangential_impulse;
  double compression = 0;
  double normal_work = 0;
  double friction_work = 0;
  std::vector<std::string> modes;
  double spread = 0;
};

/// Force history of a contact or grasp in a compliant impact.
struct ForceProfile {
  double peak_force = 0, peak_force_time = 0;
  double peak_moment = 0, peak_moment_time = 0;
  double largest_deformation = 0;
  double duration = 0;
  double energy_lost = 0;
  int touches = 0;
};

/// One grasp or contact of the impact. Impulses act on the robot at the common contact point; the opposite impulses act
/// on the target.
struct GraspImpulse {
  std::string end_effector;
  std::string target;
  std::string grasp_point;
  std::string model;
  Vector3d contact_point;
  double gap = 0;
  double gap_angle = 0;
  Vector3d target_displacement = Vector3d::zero();
  Vector3d impulse;
  Vector3d angular_impulse;
  double impulse_magnitude = 0;
  double mean_force = 0;
  std::vector<bool> determined;  // per component [angular; linear] in W
  Vector3d relative_velocity_before;
  Vector3d relative_angular_velocity_before;
  Vector3d relative_velocity_after = Vector3d::zero();
  Vector3d relative_angular_velocity_after = Vector3d::zero();
  std::optional<ContactRebound> rebound;
  std::optional<ForceProfile> profile;
};

/// Impulse that a joint transmits during the impact, at its origin, from parent to child.
struct JointImpulse {
  std::string joint;
  std::string body;
  Vector3d impulse;
  Vector3d angular_impulse;
  double along_axis = 0;
  double peak_force = 0, peak_moment = 0, peak_driving = 0;
};

/// A joint that a brake or drive held during the impact, or was commanded to hold. Drives are overpowered by the
/// constraint where their commanded rates contradict the grasps (docs/theory, section 7).
struct HeldJoint {
  std::string joint;
  double impulse = 0;
  double work = 0;
  double commanded_rate = 0;
  double rate_after = 0;
  bool was_overpowered = false;
};

/// A load against a rating of the robot file.
struct LoadMargin {
  std::string of;
  std::string quantity;
  double load = 0;
  double rating = 0;
  double margin() const { return load == 0 ? 1 : 1 - load / rating; }
};

/// The maximum speed of an arm's end-effector at its target before one of the arm's ratings is reached; all relative
/// velocities of the impact are scaled by the same factor.
struct SpeedLimit {
  std::string end_effector;
  double factor = 0;
  double largest_speed = 0;
  std::string of, quantity;
};

/// A compliant impact.
struct CompliantReport {
  std::string end;
  double duration = 0;
  double energy_lost = 0;
  double elastic_energy_after = 0;
  double residual_impulse = 0;
  double energy_residual = 0;
  double motor_work = 0;
  long rhs_evaluations = 0;
  int modes = 0;              // flexible modes in the posture of first contact, joints as in the impact
  int slower_modes = 0;       // number of modes with a period longer than `duration`
  double slowest_period = 0;  // [s]; 0 without flexible bodies
  double fastest_period = 0;  // [s]
};

/// Effective masses of end-effector and target along the contact's normal.
struct EffectiveMass {
  std::string end_effector;
  std::string target;
  double of_end_effector = 0;      // without control, joints free [kg]
  std::optional<double> apparent;  // under the impedance law with sensed contact forces [kg]
  double of_target = 0;            // [kg]
  double restitution = 0;  // coefficient e of the contact between such masses, springs and dampers of the law at rest
  double target_speed_before = 0;  // along the normal, into the robot, relative to the end-effector [m/s]
  double target_speed_after = 0;   // of the target along the normal [m/s]
};

/// The thesis's estimate, (3.8)-(3.13), in addition to the exact one. Absent fields: undefined for this capture.
struct AsPublished {
  struct Grasp {
    std::string end_effector;
    Vector3d impulse;
    Vector3d angular_impulse;
    double impulse_magnitude = 0;
  };
  std::vector<Grasp> grasps;
  std::vector<double> joint_velocity_after;
  double linear_momentum_error = 0;
  double angular_momentum_error = 0;
  double relative_linear_momentum_error = 0;
  double relative_angular_momentum_error = 0;
};

/// Joints that lock immediately after the grasp: a second impulse with separate checks.
struct BrakeGrasp {
  std::string end_effector;
  std::string target;
  Vector3d impulse;
  Vector3d angular_impulse;
};
struct BrakeReport {
  std::vector<std::string> joints;
  std::vector<double> impulse;
  double kinetic_energy_before = 0;
  double kinetic_energy_after = 0;
  std::vector<BrakeGrasp> grasps;
  Vector3d base_velocity_change = Vector3d::zero();
  Vector3d base_angular_velocity_change = Vector3d::zero();
};

/// Geometric consistency of two grasps of one target. No motion of the target changes the two distances, so their
/// difference remains as the gap of the loop.
struct LoopGap {
  std::string target;
  std::string end_effectors[2];
  std::string grasp_points[2];
  double end_effector_distance = 0;
  double grasp_point_distance = 0;
  double gap() const { return std::abs(end_effector_distance - grasp_point_distance); }
};

/// Total impulse on a body in the impact: unique, even if the impulses of single grasps are not.
struct BodyImpulse {
  std::string body;
  Vector3d impulse;
  Vector3d angular_impulse;
};

/// An impulse that changes no velocity: one vector of the null space's basis, per grasp as in GraspImpulse, scaled so
/// that its largest component is 1 (N s or N m s).
struct SelfStress {
  std::vector<Vector3d> impulse;  // per grasp of the impact [N s]
  std::vector<Vector3d> angular_impulse;
};

/// Effect of an impulse at one grasp, and the impulse that the present motion requires: measures of the configuration
/// at the contact point, with all joints free except held joints. Vectors and axes in W.
struct EndEffectorMeasure {
  std::string end_effector;
  std::vector<double> inverse_inertia, pair_inverse_inertia;  // 6 x 6, row by row
  std::vector<Vector3d> linear_axes, angular_axes;
  std::vector<double> linear_mass, angular_inertia;
  double impulse_index = 0;
  double robot_effective_mass = 0;
  double pair_effective_mass = 0;
  double miss_of_robot_com = 0;
  double miss_of_system_com = 0;
};

/// The same measures for all grasps together.
struct ImpactMeasures {
  std::vector<EndEffectorMeasure> end_effectors;
  double largest_impulse = 0, smallest_impulse = 0, coupled_index = 0;
  double miss_of_robot_com = 0, miss_of_system_com = 0;
  std::vector<std::vector<double>> base_response;  // per grasp 6 x 6, row by row
  std::vector<SelfStress> zero_disturbance;
  std::vector<SelfStress> zero_base_angular_velocity;
};

/// Derivatives of the impact with respect to an uncertain parameter.
struct ImpactSensitivity {
  std::string parameter;
  std::string unit;
  std::string end_effector, target;
  std::string undefined;
  std::vector<Vector3d> impulse, angular_impulse;
  std::vector<double> impulse_magnitude;
  Vector3d base_velocity_change = Vector3d::zero();
  Vector3d base_angular_velocity_change = Vector3d::zero();
};

/// Two hard bodies that touch in an instantaneous impact and take part in it.
struct HardContactImpulse {
  std::string body_a, body_b;
  int points = 0;
  double normal_impulse = 0;            // sum of the points [N s]
  Vector3d impulse = Vector3d::zero();  // on body b, in W [N s]
  double approach_speed = 0;            // largest of a point before the impact; negative: it separates [m/s]
  double restitution_loss = 0;          // [J]
  double friction_loss = 0;             // [J]
};

/// The plastic impact if only the slowest flexible modes deform.
struct RetainedModes {
  int modes = 0;
  double frequency = 0;          // of the fastest one [Hz]; 0 without any
  std::vector<double> impulses;  // magnitudes, per grasp [N s]
};

struct ImpactReport {
  std::string law = "plastic";
  double time = 0;
  double duration = 0;
  std::vector<GraspImpulse> grasps;
  std::vector<JointImpulse> joints;
  Vector3d base_impulse = Vector3d::zero();
  Vector3d base_angular_impulse = Vector3d::zero();
  int rank = 0;
  int rows = 0;
  std::vector<SelfStress> null_space;
  std::vector<LoopGap> loops;
  std::vector<BodyImpulse> body_impulses;
  double kinetic_energy_before = 0;
  double kinetic_energy_after = 0;
  Vector3d base_velocity_change = Vector3d::zero();
  Vector3d base_angular_velocity_change = Vector3d::zero();
  std::vector<std::string> joint_names;
  std::vector<double> joint_velocity_change;
  std::vector<BodyMotion> targets_before;
  std::vector<BodyMotion> targets_after;
  std::optional<AsPublished> as_published;
  std::string as_published_absent;
  bool show_as_published = false;
  std::optional<BrakeReport> brake;
  std::string hypothesis;
  bool energy_created = false;
  bool unique = true;
  std::string inconsistent;
  std::string joints_during = "free";
  std::vector<HeldJoint> held_joints;
  std::optional<CompliantReport> compliant;
  std::vector<EffectiveMass> effective_masses;
  std::vector<HardContactImpulse> hard_contacts;
  std::vector<RetainedModes> by_modes;  // with flexible bodies and the law `plastic`
  std::optional<ImpactMeasures> measures;
  std::vector<ImpactSensitivity> sensitivities;
  std::vector<LoadMargin> margins;
  std::vector<SpeedLimit> speed_limits;
};

}  // namespace grapnel
