#pragma once

/// @file
/// A capture to be simulated, as plain data: the content of a scenario file after units and names are resolved, or the
/// input of a program; the level of detail of its results, and the progress callback.
/// Public, kept stable.

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "grapnel/constraint/grasp_model.hpp"
#include "grapnel/impact/impact_setup.hpp"
#include "grapnel/model/geometry.hpp"
#include "grapnel/model/model.hpp"
#include "grapnel/plan/objective_kind.hpp"
#include "grapnel/problem/base_actuators.hpp"
#include "grapnel/problem/capture_stages.hpp"
#include "grapnel/problem/sensor_setup.hpp"
#include "grapnel/problem/shape_contacts.hpp"
#include "grapnel/problem/tendon_setup.hpp"
#include "grapnel/simulate/control_setup.hpp"
#include "grapnel/simulate/external_load.hpp"
#include "grapnel/simulate/integration_setup.hpp"
#include "grapnel/simulate/joint_control.hpp"
#include "grapnel/simulate/joint_trajectory.hpp"
#include "grapnel/simulate/magnetic_field.hpp"
#include "grapnel/simulate/orbit.hpp"

namespace grapnel {

class ControllerSource;
struct SourceTexts;

/// Limits of position and velocity relative to its grasp point within which an end-effector can close.
struct CaptureEnvelope {
  static constexpr double kAny = std::numeric_limits<double>::infinity();
  double position = kAny;          // distance [m]
  double angle = kAny;             // [rad]; relative to the grasp's required orientation; not evaluated if it is free
  double velocity = kAny;          // relative speed of the end-effector's origin [m/s]
  double angular_velocity = kAny;  // relative [rad/s]
};

/// Load limits of a joint or a gripper in an impact. Forces are peaks, or means over ImpactSetup::duration for
/// instantaneous impacts. Infinite if not given.
struct LoadRating {
  static constexpr double kNone = std::numeric_limits<double>::infinity();
  double force = kNone;            // [N]
  double moment = kNone;           // [N m]
  double impulse = kNone;          // [N s]
  double angular_impulse = kNone;  // [N m s]
  // Joints only, along or about the joint's axis: the load of a brake or drive [N m or N; N m s or N s].
  double driving = kNone;
  double driving_impulse = kNone;
};

/// A frame on a link that can grasp a target.
struct EndEffectorSetup : FrameDescription {
  std::optional<Vector3d> approach_axis = {};    // unit, in the end-effector's frame: the direction of approach
  std::optional<CaptureEnvelope> envelope = {};  // absent: every grasp succeeds
  LoadRating rating = {};                        // of the gripper; at the contact point
};

/// A reaction wheel: a balanced rotor that a motor turns relative to the base, about an axis fixed in the base. The
/// base's mass, centre of mass and inertia include all wheels, at rest relative to it. Besides these, a balanced rotor
/// contributes only its moment of inertia about its axis, so its position and mass are not needed.
struct WheelSetup {
  std::string name;
  Vector3d axis{0, 0, 1};                                   // unit, in the base's frame
  double inertia = 0;                                       // about the axis [kg m^2]
  double torque = std::numeric_limits<double>::infinity();  // maximum of the motor [N m]
  double rate = std::numeric_limits<double>::infinity();    // maximum, relative to the base [rad/s]
  JointFriction friction = {};                              // of its bearing
};

/// A control moment gyro with one gimbal: a balanced rotor that its motor keeps at a constant rate, in a gimbal that
/// turns relative to the base about an axis fixed in the base, perpendicular to the rotor's. The base's mass, centre of
/// mass and inertia include all gyros, with rotors at rest and gimbals at zero. As for wheels, a gyro's position and
/// mass are not needed.
struct MomentGyroSetup {
  std::string name;
  Vector3d gimbal_axis{0, 0, 1};  // unit, in the base's frame
  Vector3d spin_axis{1, 0, 0};    // unit, in the base's frame, with the gimbal at its zero
  double inertia = 0;             // of the rotor, about its axis [kg m^2]
  double spin_rate = 0;           // of the rotor in the gimbal [rad/s]
  // of all that turns with the gimbal, about its axis [kg m^2]
  double gimbal_inertia = 0;
  double torque = std::numeric_limits<double>::infinity();  // maximum of the gimbal's motor [N m]
  double rate = std::numeric_limits<double>::infinity();    // maximum commanded rate of the gimbal [rad/s]
  double bandwidth = 20;                                    // of the control loops of both rates [1/s]
};

/// The exhaust of a thruster, opposite to its force: a cone from the point of the force.
struct PlumeSetup {
  double half_angle = 0;  // [rad]
  double range = 0;       // beyond it the exhaust is harmless [m]
};

/// A thruster of the base.
struct ThrusterSetup : Thruster {
  std::string name;
  std::optional<PlumeSetup> plume = {};  // absent: the plume is not evaluated
};

/// A servicer: its bodies (one root, the base), end-effector frames, and shapes.
struct RobotSetup {
  std::string name;
  std::string base;  // name of the root body
  enum class Base { free, held, fixed };
  /// free: floats. held: kept at its initial pose by an ideal wrench during the approach, free from the impact on.
  /// fixed: fixed to the ground in all phases.
  Base base_mode = Base::free;
  std::vector<BodyDescription> bodies;  // joint of the base: free, or fixed with its pose in X_PF
  std::vector<EndEffectorSetup> end_effectors;
  std::vector<WheelSetup> wheels;                           // of the base
  std::vector<MomentGyroSetup> gyros;                       // of the base
  std::vector<ThrusterSetup> thrusters;                     // of the base
  OtherActuators actuators;                                 // of the base, of other kinds
  std::vector<TendonSetup> tendons;                         // on its joints
  std::optional<double> propellant;                         // available propellant [kg]; absent: not stated
  std::vector<std::pair<std::string, Geometry>> geometry;   // by body name; a body may have several
  std::vector<std::pair<std::string, LoadRating>> ratings;  // of joints, by name; at the joint's origin
  /// For a robot whose beams and gears have become pieces on springs (flexible_robot()): the original robot; otherwise
  /// null.
  std::shared_ptr<const RobotSetup> undeformed = {};
};

/// The shapes of a body of a robot, in their order in RobotSetup::geometry.
std::vector<Geometry> shapes_of(const RobotSetup& robot, const std::string& body);

struct GraspPoint {
  std::string name;
  Posed X_TG = Posed::identity();  // in the target's frame
  // unit, in the target's frame: the direction in which the end-effector arrives
  std::optional<Vector3d> approach_direction = {};
  std::optional<Vector3d> normal = {};  // unit, in the target's frame: the surface's, outward
};

/// An appendage of a target that may be flexible: a solar panel, a boom. Its frame is at the mount.
struct PanelSetup {
  std::string name;
  Posed X_TP = Posed::identity();             // in the target's frame
  double mass = 0;                            // [kg]
  Vector3d com = Vector3d::zero();            // in the panel's frame [m]
  Symmetric3d inertia = Symmetric3d::zero();  // about its centre of mass, its axes [kg m^2]
  std::optional<Vector3d> hinge_axis = {};    // unit, in the panel's frame: axis of the spring `hinge`
  std::optional<JointSpring> hinge = {};      // absent: fixed
  std::optional<BeamDescription> beam = {};
  std::vector<VibrationMode> modes = {};  // instead of a beam
  std::vector<Geometry> geometry;         // its shapes
};

/// A free body to be captured, rigid except for its panels. Mass, centre of mass and inertia are those of the whole,
/// with undeformed panels.
struct TargetSetup {
  std::string name;
  double mass = 0;                            // [kg]
  Vector3d com = Vector3d::zero();            // in the target's frame [m]
  Symmetric3d inertia = Symmetric3d::zero();  // about the centre of mass, target's axes [kg m^2]
  std::vector<Geometry> geometry;             // its shapes
  enum class Instant { start, capture };
  Instant given_at = Instant::capture;  // time of the pose and twist below; torque-free motion leads from there
  Posed X_WT = Posed::identity();
  Twistd V_WT = Twistd::zero();  // at the target frame's origin, in W
  std::vector<PanelSetup> panels;
  std::optional<TargetEstimate> estimate = {};  // used to plan the approach; absent: the true state
  std::vector<GraspPoint> grasp_points;
};

/// The largest load that a grasp holds: force and moment between gripper and target at the grasp, about its point; and
/// what happens beyond it. Infinite if not given.
struct GraspLimits {
  static constexpr double kNone = std::numeric_limits<double>::infinity();
  double force = kNone;   // [N]
  double moment = kNone;  // [N m]
  /// ellipsoid: (|f|/force)^2 + (|m|/moment)^2 <= 1. components: |f| <= force and |m| <= moment.
  enum class Combined { ellipsoid, components };
  Combined combined = Combined::ellipsoid;
  /// opens: the gripper loses the target. slips: force and moment stay at their limits, times kinetic_ratio, while
  /// gripper and target move relative to each other; a part without a limit does not slip, nor with components a part
  /// below its limit.
  enum class Beyond { opens, slips };
  Beyond beyond = Beyond::opens;
  double kinetic_ratio = 1;  // of the limits while it slips to those at rest
  /// Displacement and rotation of the gripper relative to the target since the grasp closed, from which on it is lost.
  double lost_distance = kNone;  // [m]
  double lost_angle = kNone;     // [rad]

  bool slips() const { return beyond == Beyond::slips; }
};

/// An end-effector that arrives at a grasp point and holds it.
struct GraspSetup {
  std::string end_effector;
  std::string target;
  std::string grasp_point;
  GraspModel model = GraspModel::rigid;
  Vector3d hinge_axis{0, 0, 1};  // unit, in the end-effector's frame; for model hinge
  /// Contact instead of grasp: the end-effector only touches the target there, and rebounds by ImpactSetup's contact
  /// law; `model` is not used. The surface is that of contact_normal().
  bool contact = false;
  /// The required orientation of the end-effector at the grasp. axis: its approach axis along the grasp point's
  /// approach direction; pose: its frame equal to that of the grasp point.
  enum class Orientation { free, axis, pose };
  Orientation orientation = Orientation::free;
  /// The time of closing. together: with all others, at the end of the approach (ApproachSetup::capture_at). at_time:
  /// at `closes_at`. on_arrival: as soon as the end-effector is within its envelope, in the approach or after it.
  /// when_settled: as soon as the target is settled in the gripper (StagesSetup), unless an escape path was found.
  enum class Closes { together, at_time, on_arrival, when_settled };
  Closes closes = Closes::together;
  double closes_at = 0;  // [s], from the start of the run
  /// The load beyond which the grasp opens (lost) or slips; absent: it holds any load.
  std::optional<GraspLimits> holds = {};
  /// Later attempts of a grasp that missed, was lost or was released: at these times [s], in increasing order, from the
  /// start of the run; and as soon as the end-effector is within its envelope again, after it has been outside.
  std::vector<double> closes_again_at = {};
  bool closes_again_on_arrival = false;
  /// Required velocity at arrival, relative to the grasp point, in W: added to the velocity of ApproachSetup::match
  /// [m/s], [rad/s].
  Vector3d relative_velocity = Vector3d::zero();
  Vector3d relative_angular_velocity = Vector3d::zero();
};

/// Whether a grasp that does not hold is attempted again.
inline bool closes_again(const GraspSetup& grasp) {
  return !grasp.closes_again_at.empty() || grasp.closes_again_on_arrival;
}

/// The condition that determines the final joint rates from the grasp points' motion through the generalized Jacobian.
enum class RateMatch { velocity, twist, velocity_least_rates };

struct TrackingSetup {
  JointControl mode = JointControl::prescribed;
  std::vector<double> kp;  // per joint, in the order of Model::joints() [N m/rad or N/m]; computed torque: [1/s^2]
  std::vector<double> kd;  // [N m s/rad or N s/m]; computed torque: [1/s]
  std::optional<TrackingNoise> noise;
};

/// A torque that controls the base's attitude (AttitudeControl).
struct BaseControlSetup {
  /// The source of the torque. outside: an external torque, which changes the system's momentum, as with ideal
  /// thrusters. wheels: the base's reaction wheels. gyros: its control moment gyros. thrusters: its thrusters. Absent:
  /// the wheels if there are any, else the gyros, else outside. Other kinds: those of RobotSetup::actuators.
  using Actuators = BaseActuatorKind;
  std::optional<Actuators> actuators;
  Vector3d kp = Vector3d::zero();  // about the base's axes [N m/rad]
  Vector3d kd = Vector3d::zero();  // [N m s/rad]
  static constexpr double kNone = std::numeric_limits<double>::infinity();
  Vector3d limit{kNone, kNone, kNone};  // [N m]
  std::optional<Rotationd> R_WD;        // desired attitude; absent: the one at the phase's start
  // of the reaction torque of the joints' motion (BaseActuators::feedforward)
  bool feedforward = false;
  double wheel_speed_rate = 0;                   // see BaseActuators [1/s]
  std::vector<double> wheel_speeds;              // likewise [rad/s]
  std::optional<ThrusterModulation> modulation;  // of thrusters; absent: its defaults
  std::optional<MomentumDumping> dumping;
  std::optional<GyroSteering> steering;  // of gyros; absent: its defaults
};

/// The on-board computer: control laws of joints (pd, computed_torque), attitude control and a user-defined controller
/// are evaluated at the sample times of one clock (ControlClock). Joints that follow their motion exactly are not
/// sampled.
struct ControlSetup {
  ControlTiming timing;
  /// A user-defined controller in a shared library (control/plugin_controller.hpp); empty: none. It drives the joints
  /// if TrackingSetup::mode or PostImpactSetup::joints is controller.
  std::string plugin;             // as the scenario names it
  std::string file;               // path for the system's loader
  std::string sha256;             // of that file; empty for a problem made by a program
  std::string parameters = "{}";  // JSON object passed to the controller
  /// Instead of a plugin, an FMU for co-simulation (control/fmu_controller.hpp), as the scenario names it; empty: none.
  std::string fmu;
  std::string inputs = "{}", outputs = "{}";  // JSON objects: variables of the FMU, and their signals
  /// Instead of both, a controller of the calling program.
  bool external = false;
  /// Creates the controller of `fmu` and `external`; null: none (yet).
  std::shared_ptr<const ControllerSource> source = {};
  /// Instead of a plugin, a log of joint efforts to be replayed; null: none. Its rows are at multiples of the period.
  std::shared_ptr<const EffortLog> log = {};
  bool base_torque = false;  // controller or log also commands the torque on a free base, while it drives the joints
  /// Instead of that, the controller commands every wheel's torque, every gimbal's rate and every thruster's valve.
  bool base_actuators = false;
  bool has_controller() const { return log || external || !plugin.empty() || !fmu.empty(); }
};

/// Weights of a plan's objectives; the weighted sum is minimized. PlanTerm describes each objective with its unit.
struct PlanWeights {
  double excursion = 0;
  double nearest = 0;
  double limits = 0;
  double manipulability = 0;
  double effort = 0;
  double base_attitude = 0;
  double base_motion = 0;
  double clearance = 0;
  double impulse = 0;
  double impulse_index = 0;
  double wheel_momentum = 0;
};

/// Planning searches for final joint values with which the momentum-conserving motion brings every end-effector to its
/// grasp point.
struct PlanSetup {
  /// The objective that is minimized among the solutions.
  using Objective = ObjectiveKind;
  Objective objective = Objective::excursion;
  std::optional<PlanWeights> weights;  // instead of `objective`
  std::vector<double> guess;           // per joint: initial guess of the search; empty: the initial values
  int starts = 16;                     // maximum number of initial guesses, the guess first
  std::uint64_t seed = 0;              // of the other initial guesses
  /// Limit at which planning fails: evaluations of the servicer's kinematics and momentum, over the whole approach.
  long max_evaluations = 30'000'000;

  // Path constraints of the last planned segment. The extent of the joint limits: at_end: positions and rates at the
  // segment's end. during_approach: positions, rates and efforts along the whole trajectory.
  enum class Limits { at_end, during_approach };
  Limits limits = Limits::at_end;
  std::optional<double> clearance;  // minimum distance of the bodies of ClearanceSetup [m]
  // distance from its grasp point within which an end-effector may touch its target [m]
  std::optional<double> near_grasp;
  /// Pairs of CaptureProblem::contacts before the capture. avoided: they keep `clearance` as all others. allowed: they
  /// may touch.
  enum class Contacts { avoided, allowed };
  Contacts contacts = Contacts::avoided;
  std::optional<double> base_turn;  // maximum rotation of the base from its initial attitude [rad]
  /// Maximum share of its momentum capacity, for each wheel that controls the base's attitude.
  std::optional<double> wheel_momentum;
  std::optional<int> knots;  // inner knots of the joints' splines; absent: as many as required

  /// Joints that move no grasping end-effector. used: they move if that reduces the objective. held: they end at their
  /// initial positions, at rest.
  enum class IdleJoints { used, held };
  IdleJoints idle_joints = IdleJoints::used;
};

/// An intermediate point of the approach: either joint values, or positions of some end-effectors, found by planning.
struct Waypoint {
  double time = 0;                           // [s]
  std::vector<double> joints;                // per joint; empty: by `places`
  std::optional<std::vector<double>> rates;  // per joint, at `joints`; absent: zero
  struct Place {
    std::string end_effector;
    std::string target;                    // frame of position and velocity; empty: the world
    Vector3d position;                     // of the end-effector's origin [m]
    Vector3d velocity = Vector3d::zero();  // relative to that frame [m/s]
  };
  std::vector<Place> places;
};

/// The final straight approach: in the target's frame, along the approach direction of each grasp.
struct StraightIn {
  double stand_off = 0;    // distance from the grasp point where it begins, at rest relative to the target [m]
  double duration = 0;     // of this segment, within the approach's [s]
  double final_speed = 0;  // towards the grasp point, relative to it, at the end [m/s]
  /// Rotation of an end-effector about its approach direction, relative to its target. free: minimum-norm joint motion.
  /// matched: it turns with the target.
  enum class Roll { free, matched };
  Roll roll = Roll::free;
};

/// Interval in which the time of capture is searched.
struct CaptureWindow {
  double earliest = 0, latest = 0;  // [s]
  double step = 0;                  // between the evaluated times; 0: a fiftieth of the window [s]
  /// objective: the time whose plan has the minimum objective. soonest: the first feasible time. slowest: the time at
  /// which the grasp points move slowest relative to the servicer's centre of mass.
  enum class Choose { objective, soonest, slowest };
  Choose choose = Choose::objective;
};

/// Joint positions over time, given by samples.
struct SampledMotion {
  std::vector<double> times;                   // [s], from the start of the approach
  std::vector<std::vector<double>> positions;  // per joint, per time
  std::vector<std::vector<double>> rates;      // likewise; empty: those of a spline
};

/// A piece of joint motion as polynomials. It begins where and when the previous one ends, the first at t = 0.
struct MotionPiece {
  double until = 0;  // [s], from the start of the approach
  /// Per joint: coefficients in Chebyshev polynomials of the first kind over the piece's time, as in ChebyshevSegment.
  std::vector<std::vector<double>> series;
};

struct ApproachSetup {
  double duration = 0;                  // T [s]
  std::optional<CaptureWindow> window;  // in which T is searched; with plan only
  JointProfile profile = JointProfile::quartic;
  /// The joints' motion: exactly one of these four.
  std::vector<double> final_position;  // per joint
  std::optional<PlanSetup> plan;
  std::optional<SampledMotion> sampled;
  std::vector<MotionPiece> pieces;  // the last until T

  std::optional<std::vector<double>> final_rates;  // given; else from `match`; else zero
  std::optional<RateMatch> match;
  std::vector<Waypoint> waypoints;        // in the order of time
  std::optional<StraightIn> straight_in;  // with plan only; it determines the final rates
  TrackingSetup tracking;
  std::optional<BaseControlSetup> base_control;
  /// The time at which the grasps close. end: at T. envelope: as soon as every end-effector is within its envelope, at
  /// T at the latest.
  enum class CaptureAt { end, envelope };
  CaptureAt capture_at = CaptureAt::end;
  std::optional<ReplanSetup> replan;  // with plan only
};

/// Treatment of the distance between an end-effector and its grasp point at the instant of capture.
struct ContactSetup {
  enum class Gap { weld_as_found, translate_target, refuse };
  Gap gap = Gap::weld_as_found;
  double refuse_beyond = 0;  // [m], for refuse
  /// Gap beyond which a grasp without an envelope is an error, not a capture [m]; absent: a fraction of the arm's
  /// reach, stated in docs/formats/scenario.md; infinite: no limit.
  std::optional<double> largest_gap = {};
};

/// After the capture the joints move to a posture: their references start at the joints' positions at the impact, at
/// rest, and end at rest.
struct PostureMove {
  std::vector<double> joints;  // per joint: the posture [rad or m]
  double after = 0;            // start, since post_impact began [s]
  double duration = 0;         // [s]
  JointProfile profile = JointProfile::quintic;
};

/// Brings a held target to rest through its grasps (DetumblingLaw).
struct DetumbleSetup {
  double torque = 0;   // maximum torque on the target, about its centre of mass [N m]
  std::string target;  // the target; empty: the only one that is grasped
};

/// The joints control the base's attitude (BaseKeepingLaw).
struct KeepBaseSetup {
  double rate = 0.5;              // at which the base returns to its attitude, critically damped [1/s]
  std::vector<double> posture;    // per joint: reference posture in the null space; empty: none
  double posture_rate = 0.05;     // rate of that motion [1/s]
  std::optional<Rotationd> R_WD;  // the attitude; absent: that at the start of post_impact
};

/// Impedance at end-effectors (ImpedanceLaw): in the approach, in a compliant impact and afterwards, if joints is
/// impedance there.
struct ImpedanceSetup : ImpedanceGains {
  std::vector<std::string> end_effectors;  // empty: all that grasps name
  /// target: in an impact the apparent mass along each contact's normal is the one that stops the target.
  enum class Match { none, target };
  Match match = Match::none;
};

/// Motion and internal force of a target that several grasps hold (GraspForceLaw).
struct GraspForceSetup {
  std::string target;  // the target; empty: the only one that is grasped
  struct Pair {
    std::vector<std::string> between;  // two end-effectors
    double force = 0;                  // squeezing force along the line between their grasps [N]
    double after = 0;                  // since post_impact began [s]
    double ramp = 0;                   // time over which the force increases [s]
  };
  std::vector<Pair> pairs;
  /// hold: the target keeps its pose relative to the base. brake: it comes to rest, as with DetumbleSetup.
  enum class Motion { hold, brake };
  Motion motion = Motion::hold;
  double rate = 0.5;           // of hold, critically damped; of brake, at the end [1/s]
  double torque = 0;           // of brake: bound [N m]
  double moment_length = 0.5;  // of the metric |F|^2 + |N|^2/length^2 that distributes the load [m]
};

/// Rates below which the system counts as at rest after the impact.
struct RestSetup {
  double angular_velocity = 0;                                  // of the base, maximum [rad/s]
  double joint_rate = std::numeric_limits<double>::infinity();  // of every driven joint, maximum [rad/s or m/s]
};

/// Conditions that end a phase of motion before its duration: it ends as soon as all given ones hold. Rates are
/// magnitudes.
struct PhaseUntil {
  std::optional<double> base_rate;             // upper bound for the base [rad/s]
  std::optional<double> target_rate;           // upper bound for all targets [rad/s]
  std::optional<double> relative_rate;         // upper bound for all targets, relative to the base [rad/s]
  std::optional<double> joint_rate;            // upper bound for all driven joints [rad/s or m/s]
  std::optional<double> wheel_momentum_below;  // upper bound for all wheels, as a share of the maximum momentum
  std::optional<double> wheel_momentum_above;  // at least one wheel holds this share of its maximum momentum or more
  /// law_ended: the law that moves the joints together has ended. latched: a grasp that waits until its target is
  /// settled has closed.
  enum class Event { law_ended, latched };
  std::optional<Event> event;
};

/// A phase of motion after the impact, or of a run without one.
struct PostImpactSetup {
  std::string name;                 // in results; empty: by its index in the sequence (phase_name)
  double duration = 0;              // maximum [s]
  std::optional<PhaseUntil> until;  // absent: it lasts its duration
  /// free: no torques. pd, computed_torque (JointControl): the joints hold their positions at the impact with zero
  /// rates, or follow `move`; the model of computed torques includes the held targets. braked: locked. controller: by
  /// the plugin or the log of ControlSetup; the references of a plugin are these positions, or `move`. detumble,
  /// keep_base_attitude, impedance (CaptureProblem::impedance), grasp_force: by their setups; by pd before a target is
  /// held and after the law has ended.
  enum class Joints {
    free,
    pd,
    computed_torque,
    braked,
    controller,
    detumble,
    keep_base_attitude,
    impedance,
    grasp_force
  };
  Joints joints = Joints::free;
  std::vector<double> kp, kd;                       // if has_gains(), as in TrackingSetup: per joint
  std::vector<TendonCommand> tendons;               // drive their joints instead of `joints`; others are slack
  std::optional<DetumbleSetup> detumble;            // with joints: detumble
  std::optional<KeepBaseSetup> keep_base_attitude;  // with joints: keep_base_attitude
  std::optional<GraspForceSetup> grasp_force;       // with joints: grasp_force
  std::optional<PostureMove> move;
  std::optional<BaseControlSetup> base_control;
  std::optional<RestSetup> at_rest;  // absent: not evaluated
  /// Grasps that are released during the phase.
  struct Release {
    double after = 0;                        // since this phase began [s]
    std::vector<std::string> end_effectors;  // empty: all that hold a target
  };
  std::vector<Release> releases;
  std::optional<AssumedTarget> assumed;
  std::optional<IdentifySetup> identify;
  std::optional<LawModel> model;  // absent: identified, else assumed, else true values
};

/// Phases of motion, each from the end of the previous one. Used as an optional, a sequence stands for its first phase,
/// and in a run for the current phase.
class MotionPhases : public std::vector<PostImpactSetup> {
 public:
  MotionPhases() = default;
  MotionPhases(PostImpactSetup only) : std::vector<PostImpactSetup>{std::move(only)} {}
  MotionPhases& operator=(PostImpactSetup only) {
    clear();
    push_back(std::move(only));
    return *this;
  }

  bool has_value() const { return !empty(); }
  explicit operator bool() const { return !empty(); }
  PostImpactSetup* operator->() { return &front(); }
  const PostImpactSetup* operator->() const { return &front(); }
  PostImpactSetup& operator*() { return front(); }
  const PostImpactSetup& operator*() const { return front(); }
  void reset() { clear(); }
  PostImpactSetup& emplace() {
    *this = PostImpactSetup{};
    return front();
  }

  /// The maximum duration of all phases [s].
  double total_duration() const {
    double all = 0;
    for (const PostImpactSetup& phase : *this) all += phase.duration;
    return all;
  }
  template <class Predicate>
  bool any(Predicate holds) const {
    for (const PostImpactSetup& phase : *this) {
      if (holds(phase)) return true;
    }
    return false;
  }
};

/// Whether joints have gains: they follow a reference, or hold.
constexpr bool has_gains(PostImpactSetup::Joints joints) {
  return joints != PostImpactSetup::Joints::free && joints != PostImpactSetup::Joints::braked &&
         joints != PostImpactSetup::Joints::controller;
}
/// The robot's tendon of that name; null: it has none.
const TendonSetup* tendon_named(const RobotSetup& robot, const std::string& name);
/// Whether a command of the phase's tendons drives the joint.
bool is_pulled(const RobotSetup& robot, const PostImpactSetup& phase, const std::string& joint);
/// Whether a law moves all joints together (grapnel/control/) by efforts, and pd after its end.
constexpr bool is_law(PostImpactSetup::Joints joints) {
  using Joints = PostImpactSetup::Joints;
  return joints == Joints::detumble || joints == Joints::keep_base_attitude || joints == Joints::impedance ||
         joints == Joints::grasp_force;
}

/// A wrench on a body as a function of time, in all phases (ExternalLoad).
struct LoadSetup {
  BodyName body;
  Vector3d p_BP = Vector3d::zero();    // point of application, in the body's frame [m]
  LoadFrame frame = LoadFrame::world;  // of the components; orbit: needs CaptureProblem::orbit
  Wrenchd amplitude = Wrenchd::zero();
  LoadProfile profile;
  std::optional<Stream> stream = {};  // of air or light; its force is multiplied by the profile
};

/// The orbit with which W falls, without rotation: W's origin is the orbit's reference point. Either `altitude`, a
/// circular orbit, or `semi_major_axis`.
struct OrbitSetup {
  enum class Body { earth, moon, mars };
  Body body = Body::earth;
  std::optional<double> altitude = {};         // above the body's equatorial radius [m]
  std::optional<double> semi_major_axis = {};  // [m]
  std::optional<double> mu = {};               // gravitational parameter of another body [m^3/s^2]
  double eccentricity = 0;
  double true_anomaly = 0;        // at t = 0 [rad]
  Vector3d radial{1, 0, 0};       // unit, in W: outward at t = 0
  Vector3d along_track{0, 1, 0};  // unit, in W: perpendicular to it, in the direction of orbital motion
  std::optional<MagneticField> magnetic_field = {};  // of the Earth; absent: not evaluated
  /// The reference point at t = 0, and its velocity, in the frame of the problem. Zero for files, whose frame has its
  /// origin there; seen_from() sets them [m], [m/s].
  Vector3d position = Vector3d::zero();
  Vector3d velocity = Vector3d::zero();
};
/// Gravitational parameter [m^3/s^2] and equatorial radius [m] of a body.
struct CentralBody {
  double mu, radius;
};
CentralBody central_body(OrbitSetup::Body body);
/// The field near such an orbit. Without altitude and semi_major_axis fault_of() reports an error.
ReferenceOrbit reference_orbit(const OrbitSetup& setup);

/// Evaluation of clearances.
struct ClearanceSetup {
  bool enabled = true;
  double required = 0;                                // [m]; a smaller distance is a violation
  std::vector<std::pair<BodyName, BodyName>> ignore;  // pairs of bodies
};

/// The input of `simulate_capture()`. Absent phases are not simulated; without an approach the initial state is the
/// state at capture (t = 0).
struct CaptureProblem {
  std::string name;
  std::string sha256;                         // of the input file; empty for problems made by programs
  std::shared_ptr<const SourceTexts> source;  // the input file's text; null for problems made by programs
  RobotSetup robot;
  Vector3d gravity = Vector3d::zero();  // uniform, in W [m/s^2]
  std::optional<OrbitSetup> orbit;      // with which W falls; absent: only `gravity` and `loads` act
  std::vector<TargetSetup> targets;
  std::vector<GraspSetup> grasps;

  Posed X_WB = Posed::identity();  // initial base pose
  /// The base's initial motion: its twist at B's origin in W, or the robot's total momentum [angular about its centre
  /// of mass; linear] in W, from which the twist follows by (2.3).
  std::optional<Twistd> V_WB;
  std::optional<Momentumd> momentum;
  std::vector<double> joint_position;  // per joint
  std::vector<double> joint_rate;      // per joint; empty: zero
  std::vector<double> wheel_rate;      // per wheel, relative to the base [rad/s]; empty: zero
  std::vector<double> gimbal_angle;    // per gyro, relative to the base [rad]; empty: zero
  std::vector<double> gimbal_rate;     // likewise, never in files: gimbals start at rest [rad/s]; empty: zero

  std::optional<ApproachSetup> approach;
  ContactSetup contact;
  std::vector<MaterialSetup> materials;
  std::vector<ObstacleSetup> obstacles;
  std::vector<ContactPairsSetup> contacts;  // pairs that may touch; others pass through each other
  std::vector<StagesSetup> stages;          // at most one per target
  std::optional<ImpactSetup> impact;
  MotionPhases post_impact;  // after the impact; without an impact after the approach, or from t = 0 (key `motion`)
  std::vector<LoadSetup> loads;
  std::optional<ControlSetup> control;      // absent: laws act continuously
  std::optional<SensorSetup> sensors;       // with control only; absent: the laws receive true values
  std::optional<ImpedanceSetup> impedance;  // for joints under impedance control
  ClearanceSetup clearance;
  IntegrationSetup integration;
  double output_interval = 0.05;     // [s]
  bool output_links = false;         // the time series includes the links' velocities
  bool output_as_published = false;  // results of the thesis's formulas are added, as with its own law
};

/// The key of the phases in files and messages: post_impact, or motion without an impact.
const char* phases_key(const CaptureProblem& problem);
/// The name of a phase in results: its own; the key for a single phase, phase_1, phase_2, ... for several.
std::string phase_name(const CaptureProblem& problem, std::size_t phase);

// --- Settings of a run that are not part of a scenario ---

/// The level of detail of results.
enum class CaptureDetail {
  /// All of CaptureResult.
  full,
  /// The results that studies and campaigns keep of a case (campaign/column.hpp): warnings, plan, grasps, impacts with
  /// impulses, joints, energies and margins, states between phases, clearance, limits, ledger and cost. These are
  /// bit-identical to those of `full`, except for the ledger: without clearance, joint limits or closed loops its
  /// checks are evaluated at ends of steps, some 32 in a phase, instead of output instants; likewise for efforts
  /// against their limits, which are evaluated together with clearance. Absent: scene, time series, loads of phases in
  /// motion (those of impacts are present), and of an impact its measures, sensitivities, null space and the published
  /// estimate.
  columns,
  /// The same with the loads of all phases: takes about 1.7 times as long, and lanes cannot integrate it.
  columns_and_loads
};

/// Called after each step: the phase, the simulated time reached and the phase's end. During planning of the approach
/// the phase is kPlanning, and the two numbers are the evaluations so far and their limit (PlanSetup::max_evaluations).
/// An exception ends the run; a std::runtime_error becomes the result's failure.
using CaptureProgress = std::function<void(const std::string& phase, double time, double end)>;

inline constexpr const char* kPlanning = "planning";

// --- Resolution of names in grasps, for problems whose names have been checked (make_capture_system) ---

/// Index of a target in CaptureProblem::targets.
std::size_t target_index(const CaptureProblem& problem, const std::string& target);
const TargetSetup& target_of(const CaptureProblem& problem, const GraspSetup& grasp);
const GraspPoint& grasp_point_of(const CaptureProblem& problem, const GraspSetup& grasp);
const EndEffectorSetup& end_effector_of(const CaptureProblem& problem, const GraspSetup& grasp);

/// Outward unit normal of a target's surface at a grasp point, in the target's frame: the point's own; else opposite to
/// its approach direction; else, for a target whose only shape is a sphere, from the centre through the point. Empty if
/// none of these exists.
std::optional<Vector3d> contact_normal(const TargetSetup& target, const GraspPoint& point);

// --- Joint motion stated in pieces, to and from trajectories ---

/// The motion of one joint.
JointTrajectory trajectory_of(std::span<const MotionPiece> segments, std::size_t joint);

/// Converts trajectories, which begin at 0 and whose pieces end at the same times. Series remain unchanged, polynomial
/// profiles become series of degree 5, cycloidal ones their interpolants, which differ only by rounding errors. @throws
/// std::invalid_argument if the pieces' ends differ.
std::vector<MotionPiece> motion_segments(std::span<const JointTrajectory> joints);

}  // namespace grapnel
