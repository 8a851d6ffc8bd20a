#pragma once

/// @file
/// What a capture leaves behind: plain data, SI units, vectors in the world frame W unless a name says otherwise.
/// Filled by simulate_capture(), read by the writers and reports. Thread safety: plain values.

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "grapnel/clearance/clearance_result.hpp"
#include "grapnel/result/ledger.hpp"
#include "grapnel/result/plan_report.hpp"
#include "grapnel/result/scene.hpp"
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

/// Whether a capture happened. assumed: nothing says what the gripper can close on (no envelope), so that it was taken
/// to hold whatever it met: nobody judged it.
enum class Captured { no, assumed, yes };

/// Whether one grip closes at the instant of capture: what success means.
struct GripOutcome {
  std::string end_effector;
  std::string target;
  std::string grasp_point;
  bool captured = false;                // it closed; see verdict()
  std::string reason;                   // in words
  double distance = 0;                  // from the grasp point [m]
  double angle = 0;                     // of what the grasp's orientation asks for; 0 if it is free [rad]
  double velocity = 0;                  // relative speed [m/s]
  double angular_velocity = 0;          // relative [rad/s]
  double time = 0;                      // when it closed, or was to close [s]
  std::optional<double> released = {};  // when it let go [s]
  bool judged = false;                  // by an envelope
  std::string limiting = {};            // the tolerance that was missed by the largest factor; empty if none was
  double target_moved = 0;              // by which contact.gap: translate_target moved the target [m]
  Captured verdict() const { return !captured ? Captured::no : judged ? Captured::yes : Captured::assumed; }
};

/// The system at the end of a phase.
struct PhaseEnd {
  double time = 0;
  BodyMotion base;
  JointMotion joints;
  std::vector<EndEffectorMotion> end_effectors;
  std::vector<BodyMotion> targets;
};

/// A contact that is no grip: how it was thrown back.
struct ContactRebound {
  Vector3d normal;                 // unit, from the target to the robot
  double normal_impulse = 0;       // [N s]
  Vector3d tangential_impulse;     // [N s]
  double compression = 0;          // of the normal impulse until the largest compression [N s]
  double normal_work = 0;          // done on the bodies [J]
  double friction_work = 0;        // [J]
  std::vector<std::string> modes;  // separated, sticking, sliding, reversed: in order
  double spread = 0;               // of the normal impulse over other orders of simultaneous contacts, relative
};

/// A contact or grip that was resolved in time.
struct ForceProfile {
  double peak_force = 0, peak_force_time = 0;    // time from the impact's beginning [N], [s]
  double peak_moment = 0, peak_moment_time = 0;  // [N m], [s]
  double largest_deformation = 0;                // [m]
  double duration = 0;                           // in touch, or until the grip was at rest [s]
  double energy_lost = 0;                        // by damping and friction [J]
  int touches = 0;
};

/// One grip or contact of the impact. Impulses act on the robot, at the common contact point; the target gets the
/// opposite there.
struct GraspImpulse {
  std::string end_effector;
  std::string target;
  std::string grasp_point;
  std::string model;       // rigid, hinge, point, or contact
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
  Vector3d relative_velocity_after = Vector3d::zero();
  Vector3d relative_angular_velocity_after = Vector3d::zero();
  std::optional<ContactRebound> rebound;  // of a contact
  std::optional<ForceProfile> profile;    // law compliant
};

/// What a joint passes on during the impact, at its origin, from parent to child.
struct JointImpulse {
  std::string joint;
  std::string body;          // the child
  Vector3d impulse;          // [N s]
  Vector3d angular_impulse;  // [N m s]
  double along_axis = 0;     // driving component: zero for a free joint without rotor [N m s or N s]
  /// Largest of what it passes on, law compliant; else 0 [N], [N m], [N m or N].
  double peak_force = 0, peak_moment = 0, peak_driving = 0;
};

/// A joint that brake or drive held during the impact, or was to hold: where the rates that drives are told contradict
/// the grasps, drives give way (docs/theory.md, section 7).
struct HeldJoint {
  std::string joint;
  double impulse = 0;     // on the joint, along or about its axis [N m s or N s]
  double work = 0;        // done by it [J]
  double told_rate = 0;   // that it was to hold [rad/s or m/s]
  double rate_after = 0;  // that it has after the impact
  bool gave_way = false;  // the grasps did not allow the rate that it was told
};

/// A load against a rating of the robot file.
struct LoadMargin {
  std::string of;        // joint or end-effector
  std::string quantity;  // force, moment, impulse, angular_impulse, driving, driving_impulse
  double load = 0;       // [N, N m, N s or N m s]
  double rating = 0;
  double margin() const { return 1 - load / rating; }
};

/// How much faster an arm's end-effector might meet its target before one of the arm's ratings is reached, all relative
/// velocities of the impact scaled alike.
struct SpeedLimit {
  std::string end_effector;
  double factor = 0;         // least of rating over load along the arm
  double largest_speed = 0;  // factor times the present relative speed of the contact point [m/s]
  std::string of, quantity;  // what is reached first
};

/// An impact that was resolved in time.
struct CompliantReport {
  std::string end;                  // separated, settled, time_over
  double duration = 0;              // [s]
  double energy_lost = 0;           // [J]
  double elastic_energy_after = 0;  // left in springs, given up when grips become rigid [J]
  double residual_impulse = 0;      // largest that then takes out what relative motion is left [N s]
  double energy_residual = 0;       // of the balance, over the kinetic energy before
  long rhs_evaluations = 0;
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

/// What an impulse at one grip does, and what the present motion asks for: measures of the configuration at the
/// contact point, everything else free (but for joints that are held). Vectors and axes in W.
struct EndEffectorMeasure {
  std::string end_effector;
  /// Change of the twist [angular; linear] per impulse [angular; linear], 6 x 6, row by row: of the end-effector alone,
  /// and relative to the target [1/(kg m^2), 1/(kg m); 1/(kg m), 1/kg].
  std::vector<double> inverse_inertia, pair_inverse_inertia;
  std::vector<Vector3d> linear_axes, angular_axes;   // of the impulse ellipsoids, unit vectors
  std::vector<double> linear_mass, angular_inertia;  // semi-axes along them, descending [kg], [kg m^2]
  double impulse_index = 0;                          // impulse of a point contact per relative speed [kg]
  double robot_effective_mass = 0;                   // along the present relative velocity [kg]
  double pair_effective_mass = 0;
  double miss_of_robot_com = 0;   // of the line of impulse, from the robot's centre of mass [m]
  double miss_of_system_com = 0;  // from that of robot and target
};

/// The same for all grips together.
struct ImpactMeasures {
  std::vector<EndEffectorMeasure> end_effectors;  // per grasp
  /// How much impulse a relative motion of the grips brings at worst and at best, and the present one; 1: as against an
  /// immovable robot [1].
  double largest_impulse = 0, smallest_impulse = 0, coupled_index = 0;
  double miss_of_robot_com = 0, miss_of_system_com = 0;  // of the resultant of all impulses [m]
  /// Change of the base's twist [angular; linear] per impulse [angular; linear] at each grip: per grip 6 x 6, row by
  /// row; zero in directions that the grip leaves free.
  std::vector<std::vector<double>> base_response;
  std::vector<SelfStress> zero_disturbance;  // impulses that leave the base's twist alone: a basis
  std::vector<SelfStress> zero_turning;      // that leave its angular velocity alone
};

/// Derivatives of the impact with respect to what is uncertain.
struct ImpactSensitivity {
  std::string parameter;  // "relative velocity x", "approach angle z", "target mass", ...
  std::string unit;       // of the parameter
  std::string end_effector, target;
  std::string undefined;                                     // why there is none
  std::vector<Vector3d> impulse, angular_impulse;            // per grasp [N s, N m s per unit]
  std::vector<double> impulse_magnitude;                     // per grasp
  Vector3d base_velocity_change = Vector3d::zero();          // [m/s per unit]
  Vector3d base_angular_velocity_change = Vector3d::zero();  // [rad/s per unit]
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
  bool show_as_published = false;   // the scenario asks for it, or goes on with it
  std::optional<BrakeReport> brake;
  std::string hypothesis;              // stronge, poisson or newton, of contacts
  bool energy_created = false;         // by the hypothesis: Newton's with friction can
  bool unique = true;                  // whether simultaneous contacts share the impulse in one way only
  std::string inconsistent;            // bilateral restitution that no motion satisfies: which rows
  std::string joints_during = "free";  // free, braked or driven
  std::vector<HeldJoint> held_joints;
  std::optional<CompliantReport> compliant;
  std::optional<ImpactMeasures> measures;
  std::vector<ImpactSensitivity> sensitivities;  // law plastic
  std::vector<LoadMargin> margins;               // against the robot's ratings
  std::vector<SpeedLimit> speed_limits;          // per grasp whose arm has ratings
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

/// The largest of one load in one phase, impacts included: found by the integrator in every step, whatever the interval
/// of output.
struct PeakLoad {
  std::string of;        // joint, end-effector, or "base control"
  std::string quantity;  // force, moment, driving, impulse, angular_impulse, driving_impulse
  std::string phase;
  double peak = 0;                                          // [N, N m, N s or N m s]
  double time = 0;                                          // [s]
  double rating = std::numeric_limits<double>::infinity();  // infinite: none is given
  bool assumed_duration = false;  // a mean over impact.duration, which is an assumption: the peak may be larger
  double margin() const { return 1 - peak / rating; }
};

/// The first thing that a real robot could not have done, in the order of time.
struct Violation {
  std::string kind;  // overlap, clearance, position, rate, effort
  std::string what;  // in words: which bodies, which joint
  std::string phase;
  double time = 0;  // [s]
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
  /// Whether all of them did, as far as anybody judged it.
  Captured capture_verdict() const {
    Captured verdict = grips.empty() ? Captured::no : Captured::yes;
    for (const GripOutcome& g : grips) verdict = std::min(verdict, g.verdict());
    return verdict;
  }
  std::optional<ImpactReport> impact;       // the first
  std::vector<ImpactReport> later_impacts;  // of grips that closed later
  std::vector<ReleaseReport> releases;
  std::vector<LoopReport> loops;     // per phase with closed loops
  std::vector<GripLoad> grip_loads;  // per phase and grip
  std::vector<PeakLoad> peak_loads;  // over all phases: per load and phase
  std::optional<PhaseEnd> post_impact_end;
  std::vector<LeastClearance> clearance;  // per phase in which bodies with shapes were watched
  std::vector<ClearanceEvent> clearance_events;
  std::vector<std::pair<std::string, std::string>> clearance_unwatched;  // hand and target of each grasp; ignored pairs
  std::vector<LimitEvent> limit_events;
  std::optional<Violation> first_violation;
  /// From here on bodies overlap, which the model lets them do and nature does not: what follows is beyond its validity
  /// [s].
  std::optional<double> valid_until;
  Ledger ledger;
  std::vector<PhaseCost> cost;
  Scene scene;  // the bodies; `series` moves them
  TimeSeries series;
};

}  // namespace grapnel
