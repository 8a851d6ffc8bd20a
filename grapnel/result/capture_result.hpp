#pragma once

/// @file
/// What a capture leaves behind: plain data, SI units, vectors in the world frame W unless a name says otherwise.
/// Filled by simulate_capture(), read by the writers and reports. Thread safety: plain values.

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "grapnel/clearance/clearance_result.hpp"
#include "grapnel/result/ledger.hpp"
#include "grapnel/result/plan_report.hpp"
#include "grapnel/result/time_series.hpp"
#include "grapnel/spatial/spatial_vector.hpp"

namespace grapnel {

/// How a run ended. Pessimistic until proven otherwise.
enum class CaptureStatus { not_run, completed, failed };

/// Motion of a free body's frame at one instant.
struct BodyMotion {
  std::string name;
  Vector3d position;            // of the frame's origin [m]
  Quaterniond quaternion_wxyz;  // R_WB
  Vector3d angular_velocity;    // [rad/s]
  Vector3d velocity;            // of the frame's origin [m/s]
};

struct JointMotion {
  std::vector<std::string> names;
  std::vector<double> position;  // [rad or m]
  std::vector<double> velocity;  // [rad/s or m/s]
};

/// An end-effector against the grasp point it is to meet (relative: end-effector minus grasp point).
struct EndEffectorMotion {
  std::string name;
  Vector3d position;
  Vector3d velocity;
  Vector3d angular_velocity;
  std::string target;  // empty: grips nothing
  std::string grasp_point;
  double miss_distance = 0;  // [m]
  Vector3d relative_velocity = Vector3d::zero();
  Vector3d relative_angular_velocity = Vector3d::zero();
};

/// Whether one grip closes at the instant of capture: what success means.
struct GripOutcome {
  std::string end_effector;
  std::string target;
  std::string grasp_point;
  bool captured = false;
  std::string reason;              // in words
  double distance = 0;             // from the grasp point [m]
  double angle = 0;                // of what the grasp's orientation asks for; 0 if it is free [rad]
  double velocity = 0;             // relative speed [m/s]
  double angular_velocity = 0;     // relative [rad/s]
  double time = 0;                 // when it closed, or was to close [s]
  std::optional<double> released;  // when it let go [s]
};

/// The system at the end of a phase.
struct PhaseEnd {
  double time = 0;
  BodyMotion base;
  JointMotion joints;
  std::vector<EndEffectorMotion> end_effectors;
  std::vector<BodyMotion> targets;
};

/// One grip of the impact. Impulses act on the robot, at the common contact point; the target gets the opposite there.
struct GraspImpulse {
  std::string end_effector;
  std::string target;
  std::string grasp_point;
  std::string model;       // rigid, hinge or point
  Vector3d contact_point;  // [m]
  double gap = 0;          // distance of end-effector and grasp point when they were joined [m]
  double gap_angle = 0;    // angle between their frames when they were joined [rad]
  Vector3d target_displacement = Vector3d::zero();  // by contact.gap: translate_target [m]
  Vector3d impulse;                                 // [N s]
  Vector3d angular_impulse;                         // about the contact point [N m s]
  double impulse_magnitude = 0;                     // [N s]
  double mean_force = 0;                            // impulse_magnitude over impact.duration [N]
  std::vector<bool> determined;       // per component [angular; linear] in W: unique, not a matter of self-stress
  Vector3d relative_velocity_before;  // end-effector minus target at the contact point [m/s]
  Vector3d relative_angular_velocity_before;  // [rad/s]
};

/// What a joint passes on during the impact, at its origin, from parent to child.
struct JointImpulse {
  std::string joint;
  std::string body;          // the child
  Vector3d impulse;          // [N s]
  Vector3d angular_impulse;  // [N m s]
  double along_axis = 0;     // driving component: zero for a free joint without rotor [N m s or N s]
};

/// The thesis's own estimate, (3.8)-(3.13), beside the right one. Absent fields: undefined for this capture.
struct AsPublished {
  struct Grasp {
    std::string end_effector;
    Vector3d impulse;
    Vector3d angular_impulse;
    double impulse_magnitude = 0;
  };
  std::vector<Grasp> grasps;
  std::vector<double> joint_velocity_after;   // (3.11)
  double linear_momentum_error = 0;           // |total after - before| [N s]
  double angular_momentum_error = 0;          // [N m s]
  double relative_linear_momentum_error = 0;  // over ledger.scale
  double relative_angular_momentum_error = 0;
};

/// Joints locked at once after the grip: a second impulse with its own books.
struct BrakeGrip {
  std::string end_effector;
  std::string target;
  Vector3d impulse;          // that the grip passes on because of the brake, on the robot at the contact point [N s]
  Vector3d angular_impulse;  // about the contact point [N m s]
};
struct BrakeReport {
  std::vector<std::string> joints;
  std::vector<double> impulse;  // [N m s or N s] per joint
  double kinetic_energy_before = 0;
  double kinetic_energy_after = 0;
  std::vector<BrakeGrip> grasps;
  Vector3d base_velocity_change = Vector3d::zero();          // by the brake alone [m/s]
  Vector3d base_angular_velocity_change = Vector3d::zero();  // [rad/s]
};

/// Two grips of one target, and whether both can be where they are meant to be: no motion of the target changes the
/// distances, so their difference is what remains open, or is welded as found.
struct LoopGap {
  std::string target;
  std::string end_effectors[2];
  std::string grasp_points[2];
  double end_effector_distance = 0;  // between the end-effectors [m]
  double grasp_point_distance = 0;   // between the grasp points they are to hold [m]
  double gap() const { return std::abs(end_effector_distance - grasp_point_distance); }
};

/// What a body received in the impact: unique, also where the impulses of single grips are not.
struct BodyImpulse {
  std::string body;
  Vector3d impulse;          // [N s]
  Vector3d angular_impulse;  // about the body's centre of mass [N m s]
};

/// An impulse that changes no velocity: one vector of the null space's basis, per grip as in GraspImpulse, scaled so
/// that its largest component is 1 (N s or N m s).
struct SelfStress {
  std::vector<Vector3d> impulse;          // per grip of the impact [N s]
  std::vector<Vector3d> angular_impulse;  // [N m s]
};

struct ImpactReport {
  std::string law = "plastic";
  double time = 0;
  double duration = 0;  // over which mean forces are taken [s]
  std::vector<GraspImpulse> grasps;
  std::vector<JointImpulse> joints;
  Vector3d base_impulse = Vector3d::zero();          // passed to the base by the arms [N s]
  Vector3d base_angular_impulse = Vector3d::zero();  // about the base's origin [N m s]
  int rank = 0;
  int rows = 0;
  std::vector<SelfStress> null_space;  // rows - rank of them
  std::vector<LoopGap> loops;          // per further grip of a target, against its first
  std::vector<BodyImpulse> body_impulses;
  double kinetic_energy_before = 0;
  double kinetic_energy_after = 0;
  Vector3d base_velocity_change = Vector3d::zero();
  Vector3d base_angular_velocity_change = Vector3d::zero();
  std::vector<std::string> joint_names;  // of joint_velocity_change
  std::vector<double> joint_velocity_change;
  std::vector<BodyMotion> targets_before;
  std::vector<BodyMotion> targets_after;
  std::optional<AsPublished> as_published;
  std::string as_published_absent;  // why, if it is absent
  std::optional<BrakeReport> brake;
};

/// How loops were kept closed in one phase.
struct LoopReport {
  std::string phase;
  std::vector<std::string> closures;  // "end-effector - target", of the grips that close loops of the tree
  int rows = 0;
  int rank = 0;                             // as the phase began
  double unprojected_position = 0;          // largest defect that one step left before projection [m]
  double unprojected_angle = 0;             // [rad]
  double unprojected_velocity = 0;          // [m/s]
  double unprojected_angular_velocity = 0;  // [rad/s]
  double correction_total = 0;   // sum of all corrections, in the norm that judges steps, times the tolerance
  double integration_error = 0;  // sum of the steps' error estimates in the same measure
};

/// The load on one grip while it holds.
struct GripLoad {
  std::string phase;
  std::string end_effector;
  std::string target;
  double largest_force = 0;   // [N]
  double force_time = 0;      // [s]
  double largest_moment = 0;  // about the grip [N m]
  double moment_time = 0;
  std::vector<bool> determined;  // per component [angular; linear] in W as the phase began: not a matter of self-stress
};

/// Grips that let go.
struct ReleaseReport {
  double time = 0;
  std::vector<std::string> end_effectors;
  std::vector<std::string> targets;
};

/// An integration's cost.
struct PhaseCost {
  std::string phase;
  long rhs_evaluations = 0;
  long steps = 0;
  long rejected = 0;
  double linear_momentum_mended = 0;   // by taking the base's velocity from momentum instead of integrating it [N s]
  double angular_momentum_mended = 0;  // [N m s]
};

struct CaptureResult {
  CaptureStatus status = CaptureStatus::not_run;
  std::string failure;  // body, time and condition, if it failed
  std::string scenario_name;
  std::string scenario_sha256;  // of the scenario's and all included files' bytes, and of overrides
  std::vector<std::string> warnings;
  std::optional<PhaseEnd> approach_start;
  std::optional<PhaseEnd> approach_end;
  std::optional<PlanReport> plan;  // of the approach
  double capture_time = 0;         // when the grips were to close [s]
  std::vector<GripOutcome> grips;  // per grasp; empty where the run did not come so far
  /// All grips closed.
  bool captured() const {
    return !grips.empty() && std::all_of(grips.begin(), grips.end(), [](const GripOutcome& g) { return g.captured; });
  }
  std::optional<ImpactReport> impact;       // the first
  std::vector<ImpactReport> later_impacts;  // of grips that closed later
  std::vector<ReleaseReport> releases;
  std::vector<LoopReport> loops;     // per phase with closed loops
  std::vector<GripLoad> grip_loads;  // per phase and grip
  std::optional<PhaseEnd> post_impact_end;
  std::vector<LeastClearance> clearance;  // per phase in which bodies with shapes were watched
  std::vector<ClearanceEvent> clearance_events;
  std::vector<std::pair<std::string, std::string>> clearance_unwatched;  // hand and target of each grasp; ignored pairs
  std::vector<LimitEvent> limit_events;
  Ledger ledger;
  std::vector<PhaseCost> cost;
  TimeSeries series;
};

}  // namespace grapnel
