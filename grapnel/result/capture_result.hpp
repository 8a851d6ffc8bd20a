#pragma once

/// @file
/// What a capture leaves behind: plain data, SI units, vectors in the world frame W unless a name says otherwise. What
/// each field is, with its unit, stands where it is described: motion_fields.cpp, impact_fields.cpp,
/// summary_fields.cpp. Filled by simulate_capture(), read by the writers and reports. Public, kept stable.

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "grapnel/clearance/clearance_result.hpp"
#include "grapnel/result/actuation_result.hpp"
#include "grapnel/result/knowledge_result.hpp"
#include "grapnel/result/ledger.hpp"
#include "grapnel/result/scene.hpp"
#include "grapnel/result/time_series.hpp"
#include "grapnel/spatial/spatial_vector.hpp"

namespace grapnel {

// What planning an approach has found. What each field is: motion_fields.cpp.

/// How far an end-effector stays from its goal when the joints follow the plan exactly.
struct PlannedMiss {
  std::string end_effector;
  double distance = 0;
  double angle = 0;
  std::optional<double> velocity = {};
  std::optional<double> angular_velocity = {};
};

/// The piece straight in.
struct StraightInReport {
  double begin = 0;
  double stand_off = 0;
  double final_speed = 0;
  double smallest_singular_value = 0;
  bool damped = false;
  double damped_begin = 0, damped_end = 0;
  double unmet = 0;
  double unmet_time = 0;
  double fit_error = 0;
  double self_motion = 0;
};

/// One of the terms that a plan's objective is the sum of.
struct PlanTerm {
  std::string name;
  double weight = 0;
  double value = 0;
};

/// What a wheel is to hold on a planned way.
struct WheelShare {
  std::string wheel;
  double share = 0;
};

/// What a planned segment does on its way.
struct PlannedWay {
  int knots = 0;
  std::optional<double> position_margin;
  std::optional<double> rate_share;
  std::optional<double> effort_share;
  std::optional<double> clearance;
  std::string body_a, body_b;
  double clearance_time = 0;
  bool attitude_kept = false;
  double base_turn = 0;
  std::vector<WheelShare> wheels;
};

/// A time of capture that was looked at.
struct WindowPoint {
  double time = 0;
  bool reachable = false;
  std::string reason;
  double objective = 0;
  double speed = 0;
  double direction_angle = 0;
  double reach_share = 0;
};

/// The times of capture that were looked at, and the one that was taken.
struct WindowReport {
  double time = 0;
  std::optional<double> not_before;
  std::vector<WindowPoint> points;
};

struct PlanReport {
  std::vector<std::string> joints;
  std::vector<double> final_position;
  std::vector<double> final_rates;
  double unmet_rate = 0;

  bool searched = false;  // final positions were looked for; the rest is meaningful then
  bool found = false;
  std::string objective;
  double objective_value = 0;
  std::vector<PlanTerm> terms;
  std::vector<PlannedMiss> miss;
  int starts = 0;
  int solutions = 0;
  int distinct_solutions = 0;
  int iterations = 0;
  long rhs_evaluations = 0;
  double smallest_singular_value = 0;
  std::optional<StraightInReport> straight_in;
  std::optional<PlannedWay> way;
  std::optional<WindowReport> window;
};

/// How a run ended. Pessimistic until proven otherwise.
enum class CaptureStatus { not_run, completed, failed };

/// Motion of a free body's frame at one instant.
struct BodyMotion {
  std::string name;
  Vector3d position;
  Quaterniond quaternion_wxyz;
  Vector3d angular_velocity;
  Vector3d velocity;
};

struct JointMotion {
  std::vector<std::string> names;
  std::vector<double> position;
  std::vector<double> velocity;
};

/// An end-effector against the grasp point it is to meet (relative: end-effector minus grasp point).
struct EndEffectorMotion {
  std::string name;
  Vector3d position;
  Vector3d velocity;
  Vector3d angular_velocity;
  std::string target;
  std::string grasp_point;
  double miss_distance = 0;
  Vector3d relative_velocity = Vector3d::zero();
  Vector3d relative_angular_velocity = Vector3d::zero();
};

/// Whether a capture happened. assumed: nothing says what the gripper can close on (no envelope), so that it was taken
/// to hold whatever it met: nobody judged it.
enum class Captured { no, assumed, yes };

/// Whether one grasp closes at the instant of capture: what success means.
struct GraspOutcome {
  std::string end_effector;
  std::string target;
  std::string grasp_point;
  bool captured = false;  // it closed; see verdict()
  std::string reason;
  double distance = 0;
  double angle = 0;
  double velocity = 0;
  double angular_velocity = 0;
  double time = 0;
  std::optional<double> released = {};
  bool judged = false;  // by an envelope
  std::string limiting = {};
  double target_moved = 0;
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

/// A contact that does not hold: how it rebounded.
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

/// A contact or grasp that was resolved in time.
struct ForceProfile {
  double peak_force = 0, peak_force_time = 0;
  double peak_moment = 0, peak_moment_time = 0;
  double largest_deformation = 0;
  double duration = 0;
  double energy_lost = 0;
  int touches = 0;
};

/// One grasp or contact of the impact. Impulses act on the robot, at the common contact point; the target gets the
/// opposite there.
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

/// What a joint passes on during the impact, at its origin, from parent to child.
struct JointImpulse {
  std::string joint;
  std::string body;
  Vector3d impulse;
  Vector3d angular_impulse;
  double along_axis = 0;
  double peak_force = 0, peak_moment = 0, peak_driving = 0;
};

/// A joint that brake or drive held during the impact, or was to hold: where the rates that drives are told contradict
/// the grasps, drives give way (docs/theory, section 7).
struct HeldJoint {
  std::string joint;
  double impulse = 0;
  double work = 0;
  double told_rate = 0;
  double rate_after = 0;
  bool gave_way = false;
};

/// A load against a rating of the robot file.
struct LoadMargin {
  std::string of;
  std::string quantity;
  double load = 0;
  double rating = 0;
  double margin() const { return load == 0 ? 1 : 1 - load / rating; }
};

/// How much faster an arm's end-effector might meet its target before one of the arm's ratings is reached, all relative
/// velocities of the impact scaled alike.
struct SpeedLimit {
  std::string end_effector;
  double factor = 0;
  double largest_speed = 0;
  std::string of, quantity;
};

/// An impact that was resolved in time.
struct CompliantReport {
  std::string end;
  double duration = 0;
  double energy_lost = 0;
  double elastic_energy_after = 0;
  double residual_impulse = 0;
  double energy_residual = 0;
  double motor_work = 0;
  long rhs_evaluations = 0;
  int modes = 0;              // of vibration of what bends, as the bodies met, joints as they are in the impact
  int slower_modes = 0;       // of these, with a period longer than `duration`
  double slowest_period = 0;  // [s]; 0 where nothing bends
  double fastest_period = 0;  // [s]
};

/// A hand's mass as a contact meets it, and the target's, along the contact's normal.
struct EffectiveMass {
  std::string end_effector;
  std::string target;
  double hand = 0;                 // without control, joints free [kg]
  std::optional<double> apparent;  // by the impedance law, contact forces sensed [kg]
  double of_target = 0;            // [kg]
  double restitution = 0;          // e of the contact between such masses, springs and dampers of the law at rest
  double target_speed_before = 0;  // along the normal, into the robot, relative to the hand [m/s]
  double target_speed_after = 0;   // of the target along it, of what it had [m/s]
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
  std::vector<double> joint_velocity_after;
  double linear_momentum_error = 0;
  double angular_momentum_error = 0;
  double relative_linear_momentum_error = 0;
  double relative_angular_momentum_error = 0;
};

/// Joints locked at once after the grasp: a second impulse with its own checks.
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

/// Two grasps of one target, and whether both can be where they are meant to be: no motion of the target changes the
/// distances, so their difference is what remains open, or is welded as found.
struct LoopGap {
  std::string target;
  std::string end_effectors[2];
  std::string grasp_points[2];
  double end_effector_distance = 0;
  double grasp_point_distance = 0;
  double gap() const { return std::abs(end_effector_distance - grasp_point_distance); }
};

/// What a body received in the impact: unique, also where the impulses of single grasps are not.
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

/// What an impulse at one grasp does, and what the present motion asks for: measures of the configuration at the
/// contact point, everything else free (but for joints that are held). Vectors and axes in W.
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

/// The same for all grasps together.
struct ImpactMeasures {
  std::vector<EndEffectorMeasure> end_effectors;
  double largest_impulse = 0, smallest_impulse = 0, coupled_index = 0;
  double miss_of_robot_com = 0, miss_of_system_com = 0;
  std::vector<std::vector<double>> base_response;  // per grasp 6 x 6, row by row
  std::vector<SelfStress> zero_disturbance;
  std::vector<SelfStress> zero_base_angular_velocity;
};

/// Derivatives of the impact with respect to what is uncertain.
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

/// What a plastic impact would be if only the slowest modes of vibration could answer it.
struct ModesKept {
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
  std::vector<ModesKept> by_modes;  // where something bends and the law is plastic
  std::optional<ImpactMeasures> measures;
  std::vector<ImpactSensitivity> sensitivities;
  std::vector<LoadMargin> margins;
  std::vector<SpeedLimit> speed_limits;
};

/// How loops were kept closed in one phase.
struct LoopReport {
  std::string phase;
  std::vector<std::string> closures;
  int rows = 0;
  int rank = 0;
  double unprojected_position = 0;
  double unprojected_angle = 0;
  double unprojected_velocity = 0;
  double unprojected_angular_velocity = 0;
  double correction_total = 0;
  double integration_error = 0;
};

/// The load on one grasp while it holds.
struct GraspLoad {
  std::string phase;
  std::string end_effector;
  std::string target;
  double largest_force = 0;
  double force_time = 0;
  double largest_moment = 0;
  double moment_time = 0;
  std::vector<bool> determined;  // per component [angular; linear] in W
};

/// The largest of one load in one phase, impacts included: found by the integrator in every step, whatever the interval
/// of output.
struct PeakLoad {
  std::string of;
  std::string quantity;
  std::string phase;
  double peak = 0;
  double time = 0;
  double rating = std::numeric_limits<double>::infinity();  // infinite: none is given
  bool assumed_duration = false;
  double margin() const { return peak == 0 ? 1 : 1 - peak / rating; }
};

/// The first thing that a real robot could not have done, in the order of time.
struct Violation {
  std::string kind;
  std::string what;
  std::string phase;
  double time = 0;
};

/// How a law that moves all joints together came to its end.
enum class LawEnd {
  running,      // it had not when the run ended
  at_rest,      // what it was to bring to rest was
  rank_lost,    // near a configuration in which the joints cannot do what it asks for
  joint_limit,  // a joint reached the end of its range
  released      // what it works on was let go
};

/// Of hands under impedance control, in one phase.
struct ImpedanceReport {
  double begin = 0;
  double end = 0;
  LawEnd ended = LawEnd::running;
  std::string joint;            // whose range ended it
  double largest_distance = 0;  // of a hand from its reference [m]
  double largest_distance_time = 0;
  double distance_after = 0;  // largest of the hands
  double largest_angle = 0;   // [rad]
  double largest_angle_time = 0;
  double angle_after = 0;
  double least_share = 1;
  double least_share_time = 0;
  bool within_limits = true;
  double least_condition = 1;
  double least_condition_time = 0;
};

/// Of a target that several grasps hold and squeeze.
struct GraspForceReport {
  /// Of one pair of grasps.
  struct Pair {
    std::vector<std::string> between;
    double reference = 0;      // at the end [N]
    double force = 0;          // by the multipliers of the closed loops, at the end [N]
    double largest_error = 0;  // [N]
    double largest_error_time = 0;
  };
  std::string target;
  double begin = 0;
  double end = 0;
  LawEnd ended = LawEnd::running;
  std::string joint;
  std::vector<Pair> pairs;
  int internal_rank = 0;            // internal directions that the efforts reach
  double other_internal_force = 0;  // largest of what else the grasps bear inside, in the law's metric [N]
  double largest_distance = 0;      // of the target from where it is to be held [m]
  double largest_angle = 0;         // [rad]
  double least_scale = 1;
  double least_scale_time = 0;
  bool within_limits = true;
  double least_condition = 1;
  double least_condition_time = 0;
};

/// Of a target that is brought to rest through its grasps.
struct DetumblingReport {
  std::string target;
  double begin = 0;
  double end = 0;
  LawEnd ended = LawEnd::running;
  std::string joint;  // whose range ended it
  double torque_bound = 0;
  double largest_torque = 0;
  double angular_momentum_before = 0;
  double angular_momentum_after = 0;
  double speed_before = 0;
  double speed_after = 0;
  double expected_duration = 0;
  double first_scale = 1;
  double least_scale = 1;
  double least_scale_time = 0;
  bool within_limits = true;
  double largest_demand = 0;
  double largest_demand_time = 0;
  std::string limiting;
  double least_condition = 1;
  double least_condition_time = 0;
};

/// Of a base whose attitude the joints keep.
struct BaseKeepingReport {
  double begin = 0;
  double end = 0;
  LawEnd ended = LawEnd::running;
  std::string joint;  // whose range ended it
  double largest_angle = 0;
  double largest_angle_time = 0;
  double angle_after = 0;
  double angular_velocity_after = 0;
  int rank = 0;
  double least_share = 1;
  double least_share_time = 0;
  bool within_limits = true;
  double least_condition = 1;
  double least_condition_time = 0;
};

/// Grasps that are released.
struct ReleaseReport {
  double time = 0;
  std::vector<std::string> end_effectors;
  std::vector<std::string> targets;
};

/// The reference orbit of a run.
struct OrbitReport {
  std::string body;
  double radius = 0;
  double rate = 0;
  double period = 0;
};

/// A mode of vibration, as frequencies of three supports; NaN where that has fewer modes.
struct ElasticModeReport {
  double held = std::numeric_limits<double>::quiet_NaN();  // [Hz]
  double braked = held, free = held;
  double damping_ratio = 0;  // of `held`
  Vector3d effective_mass = Vector3d::zero();
  Vector3d effective_inertia = Vector3d::zero();
};

/// What bends, at an instant of a run.
struct ElasticReport {
  std::string at;   // start, or captured
  double time = 0;  // [s]
  int springs = 0;
  double fastest = 0;  // frequency of the fastest mode, joints and base free [Hz]
  std::vector<ElasticModeReport> modes;
};

/// The on-board computer of a run.
struct ControlReport {
  double period = 0;
  double delay = 0;
  std::string plugin;
  std::string plugin_sha256;
};

/// A reaction wheel in a run. Rates are relative to the base.
struct WheelReport {
  std::string name;
  double inertia = 0;  // about its axis
  double rate_before = 0, rate_after = 0;
  double largest_rate = 0;                                           // at the instants that were looked at
  double largest_torque = std::numeric_limits<double>::quiet_NaN();  // likewise; unknown where nobody looked
  double rate_limit = 0, torque_limit = 0;                           // infinite: none
  double momentum_after() const { return inertia * rate_after; }
};

/// A control moment gyro in a run. Angles and rates are those of its gimbal, relative to the base.
struct GyroReport {
  std::string name;
  double momentum = 0;  // of the rotor in its gimbal [N m s]
  double angle_before = 0, angle_after = 0;
  double largest_rate = 0;                                                // at the instants that were looked at
  double largest_torque = std::numeric_limits<double>::quiet_NaN();       // likewise; unknown where nobody looked
  double rate_limit = 0, torque_limit = 0;                                // infinite: none
  double largest_spin_torque = std::numeric_limits<double>::quiet_NaN();  // of the rotor's motor, likewise
};
/// A time in which an array that is steered is near a singularity.
struct SingularityHazard {
  double begin = 0, end = 0;          // [s]
  double least_measure = 0;           // GyroArray::singularity_measure
  double largest_torque_lacking = 0;  // of what was asked for [N m]
  double duration() const { return end - begin; }
};
/// The control moment gyros of a run.
struct GyrosReport {
  std::vector<GyroReport> each;
  double least_singularity_measure = std::numeric_limits<double>::infinity();
  bool steered = false;                                    // by attitude control or a controller
  double near = std::numeric_limits<double>::quiet_NaN();  // measure below which it is; unknown if never steered
  double largest_torque_lacking = std::numeric_limits<double>::quiet_NaN();  // [N m]; likewise
  std::vector<SingularityHazard> hazards;
};

/// A joint that has met a stop at the end of its range.
struct StopImpact {
  double time = 0;
  std::string joint;
  bool upper = false;  // which end
  double rate_before = 0, rate_after = 0;
  double impulse = 0;      // of the stop on the joint, along its axis
  double energy_lost = 0;  // by the whole system
};

/// What a joint with sticking friction, stops or a motor whose electricity is known did in one phase.
struct JointReport {
  /// At the phase's end. prescribed: it moves as prescribed, and neither sticks nor meets its stops.
  enum class Mode { moving, stuck, at_lower_stop, at_upper_stop, prescribed };
  std::string phase;
  std::string joint;
  Mode mode = Mode::moving;
  int sticks = 0;      // times that it came to rest
  int breakaways = 0;  // times that it left it
  /// Largest part of its breakaway effort that friction gave while it was held; absent: it does not stick.
  std::optional<double> friction_share;
  bool friction_determined = true;  // false: closed loops left that friction open, and one admissible set is reported
  double friction_heat = 0;         // that friction made
  int stop_impacts = 0;
  double stop_energy_lost = 0;
  double motor_work = 0;              // mechanical, at the joint
  std::optional<double> copper_loss;  // in the winding; absent: not known
  /// What the motor took, less what it gave back.
  std::optional<double> electrical_energy() const {
    return copper_loss ? std::optional(*copper_loss + motor_work) : std::nullopt;
  }
};

/// A thruster in a run.
struct ThrusterReport {
  std::string name;
  long firings = 0;
  double on_time = 0;     // of its valve [s]
  double duty = 0;        // on_time over the time of the phases in which thrusters are at work
  double impulse = 0;     // of its force [N s]
  double propellant = 0;  // [kg]
};
/// A body in the plume of a thruster that fires.
struct PlumeHazard {
  std::string thruster, body;
  double first_time = 0;  // [s]
  double duration = 0;    // of firing with a point of the body in the plume [s]
};
/// Thrusters take the wheels' momentum out.
struct DumpingReport {
  long begun = 0;               // how often
  double first_begin = 0;       // [s]
  double duration = 0;          // of all [s]
  bool active = false;          // as the run ended
  double largest_momentum = 0;  // of the wheels, as pulses began [N m s]
};
/// The thrusters of a run.
struct ThrustersReport {
  std::vector<ThrusterReport> each;
  double propellant = 0;                                      // used [kg]
  double at_hand = std::numeric_limits<double>::quiet_NaN();  // [kg]; unknown: nobody says
  double excess() const { return propellant > at_hand ? propellant - at_hand : 0; }
  std::optional<DumpingReport> dumping;
  std::vector<PlumeHazard> hazards;
};

/// A phase of motion after the approach.
struct MotionPhaseReport {
  /// How it ended. duration: after its duration. condition: what it is `until` held.
  enum class End { duration, condition };
  std::string name;
  double begin = 0;
  double end = 0;
  End ended = End::duration;
  std::optional<PhaseEnd> at_end;
  double duration() const { return end - begin; }
};

/// An integration's cost.
struct PhaseCost {
  std::string phase;
  long rhs_evaluations = 0;
  long steps = 0;
  long rejected = 0;
};

struct CaptureResult {
  CaptureStatus status = CaptureStatus::not_run;
  std::string failure;  // body, time and condition, if it failed
  std::string scenario_name;
  std::string scenario_sha256;  // of the scenario's and all included files' bytes, and of overrides
  std::vector<std::string> warnings;
  std::optional<OrbitReport> orbit;    // with which W falls
  std::vector<ElasticReport> elastic;  // where something bends: at the start, and when a target has been caught
  std::optional<ControlReport> control;
  std::vector<SensorReport> sensors;  // read at its ticks
  std::optional<PhaseEnd> approach_start;
  std::optional<PhaseEnd> approach_end;
  std::optional<PlanReport> plan;            // of the approach
  std::vector<NavigationReport> navigation;  // where targets are estimated or the approach is replanned
  double capture_time = 0;                   // when the grasps were to close [s]
  std::vector<GraspOutcome> grasps;          // per grasp; empty where the run did not come so far
  /// All grasps closed.
  bool captured() const {
    return !grasps.empty() &&
           std::all_of(grasps.begin(), grasps.end(), [](const GraspOutcome& g) { return g.captured; });
  }
  /// Whether all of them did, as far as anybody judged it.
  Captured capture_verdict() const {
    Captured verdict = grasps.empty() ? Captured::no : Captured::yes;
    for (const GraspOutcome& g : grasps) verdict = std::min(verdict, g.verdict());
    return verdict;
  }
  std::optional<ImpactReport> impact;       // the first
  std::vector<ImpactReport> later_impacts;  // of grasps that closed later
  std::vector<ReleaseReport> releases;
  std::vector<LoopReport> loops;                       // per phase with closed loops
  std::vector<GraspLoad> grasp_loads;                  // per phase and grasp
  std::vector<PeakLoad> peak_loads;                    // over all phases: per load and phase
  bool without_impact = false;                         // the scenario has none: motion alone
  std::vector<MotionPhaseReport> phases;               // after the impact, or of motion alone; that have ended
  std::optional<PhaseEnd> post_impact_end;             // of the last of them
  std::optional<DetumblingReport> detumbling;          // in it
  std::optional<BaseKeepingReport> base_keeping;       // in it
  std::optional<ImpedanceReport> approach_impedance;   // in the approach
  std::optional<ImpedanceReport> impedance;            // after the impact
  std::optional<GraspForceReport> grasp_force;         // likewise
  std::optional<IdentificationReport> identification;  // in it
  std::vector<WheelReport> wheels;                     // of the base, in the robot's order
  std::optional<GyrosReport> gyros;                    // of the base, where it has any
  std::vector<JointReport> joints;           // per phase in motion, of joints of which there is something to say
  std::vector<StopImpact> stop_impacts;      // the first ones
  long stop_impact_count = 0;                // all
  std::optional<ThrustersReport> thrusters;  // of the base, where it has any
  std::vector<SaturationReport> saturation;  // the longest first
  std::vector<StabilityReport> stability;    // per phase in motion that was observed in every step
  std::optional<RestReport> rest;            // where the problem states at which rates the system is at rest
  std::vector<MinimumClearance> clearance;   // per phase in which bodies with shapes were watched
  std::vector<ClearanceEvent> clearance_events;
  std::vector<std::pair<std::string, std::string>>
      clearance_unwatched;  // end-effector and target of each grasp until it opens; ignored pairs
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
