#pragma once

/// @file
/// The result of a capture: plain data, SI units, vectors in the world frame W unless a name specifies otherwise.
/// motion_fields.cpp, impact_fields.cpp and summary_fields.cpp describe each field with its unit. Filled by
/// simulate_capture(), read by the writers and reports. Public, kept stable.

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

// The plan of an approach. motion_fields.cpp describes the fields.

/// Deviation of an end-effector from its goal when the joints follow the plan exactly.
struct PlannedMiss {
  std::string end_effector;
  double distance = 0;
  double angle = 0;
  std::optional<double> velocity = {};
  std::optional<double> angular_velocity = {};
};

/// The final straight approach.
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

/// One term of the sum that is a plan's objective.
struct PlanTerm {
  std::string name;
  double weight = 0;
  double value = 0;
};

/// Predicted load of a reaction wheel on the planned trajectory.
struct WheelShare {
  std::string wheel;
  double share = 0;
};

/// Properties of a planned segment.
struct PlannedPath {
  int knots = 0;
  std::optional<double> position_margin;
  std::optional<double> rate_share;
  std::optional<double> effort_share;
  std::optional<double> clearance;
  std::string body_a, body_b;
  double clearance_time = 0;
  bool attitude_held = false;
  double base_turn = 0;
  std::vector<WheelShare> wheels;
};

/// A capture time that the planner evaluated.
struct WindowPoint {
  double time = 0;
  bool reachable = false;
  std::string reason;
  double objective = 0;
  double speed = 0;
  double direction_angle = 0;
  double reach_share = 0;
};

/// The evaluated capture times and the selected one.
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

  bool searched = false;  // final positions were searched; the fields below are valid only then
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
  std::optional<PlannedPath> path;
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

/// An end-effector and its motion relative to its grasp point (end-effector minus grasp point).
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

/// Whether the capture succeeded. assumed: no envelope states the gripper's capture range, so the grasp is assumed to
/// close without an evaluation.
enum class Captured { no, assumed, yes };

/// Whether one grasp closes at the instant of capture, the criterion of success.
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
  bool judged = false;  // an envelope was evaluated
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
  std::vector<RetainedModes> by_modes;  // with flexible bodies and the law `plastic`
  std::optional<ImpactMeasures> measures;
  std::vector<ImpactSensitivity> sensitivities;
  std::vector<LoadMargin> margins;
  std::vector<SpeedLimit> speed_limits;
};

/// Closure of the loops in one phase.
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

/// The largest value of one load in one phase, impacts included: evaluated in every step of the integrator,
/// independently of the output interval.
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

/// A violation that makes the motion infeasible for a real robot.
struct Violation {
  std::string kind;
  std::string what;
  std::string phase;
  double time = 0;
};

/// Why a control law that moves all joints ended.
enum class LawEnd {
  running,      // still active at the end of the run
  at_rest,      // its target came to rest
  rank_lost,    // near a singular configuration
  joint_limit,  // a joint reached the end of its range
  released      // its target was released
};

/// End-effectors under impedance control, in one phase.
struct ImpedanceReport {
  double begin = 0;
  double end = 0;
  LawEnd ended = LawEnd::running;
  std::string joint;            // joint whose range ended the law
  double largest_distance = 0;  // of an end-effector from its reference [m]
  double largest_distance_time = 0;
  double distance_after = 0;  // largest of the end-effectors
  double largest_angle = 0;   // [rad]
  double largest_angle_time = 0;
  double angle_after = 0;
  double least_share = 1;
  double least_share_time = 0;
  bool within_limits = true;
  double least_condition = 1;
  double least_condition_time = 0;
};

/// A target that several grasps hold and squeeze.
struct GraspForceReport {
  /// One pair of grasps.
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
  int internal_rank = 0;            // number of internal directions that the efforts control
  double other_internal_force = 0;  // largest other internal wrench of the grasps, in the law's metric [N]
  double largest_distance = 0;      // of the target from its reference position [m]
  double largest_angle = 0;         // [rad]
  double least_scale = 1;
  double least_scale_time = 0;
  bool within_limits = true;
  double least_condition = 1;
  double least_condition_time = 0;
};

/// A target that is brought to rest through its grasps.
struct DetumblingReport {
  std::string target;
  double begin = 0;
  double end = 0;
  LawEnd ended = LawEnd::running;
  std::string joint;  // joint whose range ended the law
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

/// A base whose attitude the joints control.
struct BaseHoldReport {
  double begin = 0;
  double end = 0;
  LawEnd ended = LawEnd::running;
  std::string joint;  // joint whose range ended the law
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

/// Grasps that are released together.
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

/// A mode of vibration with its frequencies for three supports; NaN if a support has fewer modes.
struct ElasticModeReport {
  double held = std::numeric_limits<double>::quiet_NaN();  // [Hz]
  double braked = held, free = held;
  double damping_ratio = 0;  // of `held`
  Vector3d effective_mass = Vector3d::zero();
  Vector3d effective_inertia = Vector3d::zero();
};

/// Flexible modes at an instant of a run.
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
  double largest_rate = 0;                                           // at the evaluated instants
  double largest_torque = std::numeric_limits<double>::quiet_NaN();  // likewise; NaN: not evaluated
  double rate_limit = 0, torque_limit = 0;                           // infinite: none
  double momentum_after() const { return inertia * rate_after; }
};

/// A control moment gyro in a run. Angles and rates are those of its gimbal, relative to the base.
struct GyroReport {
  std::string name;
  double momentum = 0;  // of the rotor in its gimbal [N m s]
  double angle_before = 0, angle_after = 0;
  double largest_rate = 0;                                                // at the evaluated instants
  double largest_torque = std::numeric_limits<double>::quiet_NaN();       // likewise; NaN: not evaluated
  double rate_limit = 0, torque_limit = 0;                                // infinite: none
  double largest_spin_torque = std::numeric_limits<double>::quiet_NaN();  // of the rotor's motor, likewise
};
/// An interval in which a steered array is near a singularity.
struct SingularityHazard {
  double begin = 0, end = 0;          // [s]
  double least_measure = 0;           // GyroArray::singularity_measure
  double largest_torque_lacking = 0;  // of the commanded torque [N m]
  double duration() const { return end - begin; }
};
/// The control moment gyros of a run.
struct GyrosReport {
  std::vector<GyroReport> each;
  double least_singularity_measure = std::numeric_limits<double>::infinity();
  bool steered = false;                                    // by attitude control or a controller
  double near = std::numeric_limits<double>::quiet_NaN();  // measure below which the array is near a singularity; NaN
                                                           // if never steered
  double largest_torque_lacking = std::numeric_limits<double>::quiet_NaN();  // [N m]; likewise
  std::vector<SingularityHazard> hazards;
};

/// Impact of a joint on a stop at the end of its range.
struct StopImpact {
  double time = 0;
  std::string joint;
  bool upper = false;  // which end
  double rate_before = 0, rate_after = 0;
  double impulse = 0;      // of the stop on the joint, along its axis
  double energy_lost = 0;  // by the whole system
};

/// Motion in one phase of a joint with sticking friction, stops or an electrically modelled motor.
struct JointReport {
  /// State at the end of the phase. prescribed: on a prescribed motion, which neither sticks nor meets stops.
  enum class Mode { moving, stuck, at_lower_stop, at_upper_stop, prescribed };
  std::string phase;
  std::string joint;
  Mode mode = Mode::moving;
  int sticks = 0;      // transitions to sticking
  int breakaways = 0;  // transitions to motion
  /// Largest friction while held, over the breakaway effort; absent: its friction does not stick.
  std::optional<double> friction_share;
  bool friction_determined =
      true;                  // false: closed loops leave the friction undetermined, and one admissible set is reported
  double friction_heat = 0;  // heat of joint friction
  int stop_impacts = 0;
  double stop_energy_lost = 0;
  double motor_work = 0;              // mechanical, at the joint
  std::optional<double> copper_loss;  // in the winding; absent: not known
  /// Energy drawn by the motor minus energy returned.
  std::optional<double> electrical_energy() const {
    return copper_loss ? std::optional(*copper_loss + motor_work) : std::nullopt;
  }
};

/// A thruster in a run.
struct ThrusterReport {
  std::string name;
  long firings = 0;
  double on_time = 0;     // of its valve [s]
  double duty = 0;        // on_time over the time of the phases in which thrusters are active
  double impulse = 0;     // of its force [N s]
  double propellant = 0;  // [kg]
};
/// A body in the plume of a firing thruster.
struct PlumeHazard {
  std::string thruster, body;
  double first_time = 0;  // [s]
  double duration = 0;    // of firing with a point of the body in the plume [s]
};
/// Unloading of the wheels' momentum by thrusters.
struct DumpingReport {
  long begun = 0;               // number of times
  double first_begin = 0;       // [s]
  double duration = 0;          // of all [s]
  bool active = false;          // as the run ended
  double largest_momentum = 0;  // of the wheels, as pulses began [N m s]
};
/// The thrusters of a run.
struct ThrustersReport {
  std::vector<ThrusterReport> each;
  double propellant = 0;                                        // used [kg]
  double available = std::numeric_limits<double>::quiet_NaN();  // [kg]; NaN: not given
  double excess() const { return propellant > available ? propellant - available : 0; }
  std::optional<DumpingReport> dumping;
  std::vector<PlumeHazard> hazards;
};

/// A phase of motion after the approach.
struct MotionPhaseReport {
  /// How it ended. duration: after its duration. condition: its `until` condition was met.
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
  std::optional<OrbitReport> orbit;    // of the frame W
  std::vector<ElasticReport> elastic;  // with flexible bodies: at the start, and with captured targets
  std::optional<ControlReport> control;
  std::vector<SensorReport> sensors;  // read at its sample times
  std::optional<PhaseEnd> approach_start;
  std::optional<PhaseEnd> approach_end;
  std::optional<PlanReport> plan;            // of the approach
  std::vector<NavigationReport> navigation;  // if targets are estimated or the approach is replanned
  double capture_time = 0;                   // when the grasps were to close [s]
  std::vector<GraspOutcome> grasps;          // per grasp; empty if the run ended before
  /// All grasps closed.
  bool captured() const {
    return !grasps.empty() &&
           std::all_of(grasps.begin(), grasps.end(), [](const GraspOutcome& g) { return g.captured; });
  }
  /// The verdict over all grasps.
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
  std::vector<MotionPhaseReport> phases;               // completed phases after the impact, or of motion alone
  std::optional<PhaseEnd> post_impact_end;             // of the last of them
  std::optional<DetumblingReport> detumbling;          // in it
  std::optional<BaseHoldReport> base_keeping;          // in it
  std::optional<ImpedanceReport> approach_impedance;   // in the approach
  std::optional<ImpedanceReport> impedance;            // after the impact
  std::optional<GraspForceReport> grasp_force;         // likewise
  std::optional<IdentificationReport> identification;  // in it
  std::vector<WheelReport> wheels;                     // of the base, in the robot's order
  std::optional<GyrosReport> gyros;                    // of the base, where it has any
  std::vector<ActuatorUse> actuators;                  // of the base, of other kinds
  std::vector<JointReport> joints;           // per phase in motion, of joints with sticking friction, stops or motors
  std::vector<StopImpact> stop_impacts;      // the first ones
  long stop_impact_count = 0;                // all
  std::optional<ThrustersReport> thrusters;  // of the base, where it has any
  std::vector<SaturationReport> saturation;  // the longest first
  std::vector<StabilityReport> stability;    // per phase in motion that was observed in every step
  std::optional<RestReport> rest;            // if the problem states the rates of rest
  std::vector<MinimumClearance> clearance;   // per phase in which bodies with shapes were monitored
  std::vector<ClearanceEvent> clearance_events;
  std::vector<std::pair<std::string, std::string>>
      clearance_unwatched;  // end-effector and target of each grasp until it opens; ignored pairs
  std::vector<LimitEvent> limit_events;
  std::optional<Violation> first_violation;
  /// From this time on bodies overlap, and the model is not valid [s].
  std::optional<double> valid_until;
  Ledger ledger;
  std::vector<PhaseCost> cost;
  Scene scene;  // the bodies; `series` moves them
  TimeSeries series;
};

}  // namespace grapnel
