#pragma once

/// @file
/// A capture to be simulated, as plain data: what a scenario file says after units and names are resolved, or what a
/// program sets up itself; how much of it is to be worked out, and who waits for it. Public, kept stable.

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "grapnel/constraint/grasp.hpp"
#include "grapnel/impact/compliant_impact.hpp"
#include "grapnel/impact/contact_impact.hpp"
#include "grapnel/model/geometry.hpp"
#include "grapnel/model/model.hpp"
#include "grapnel/plan/objective_kind.hpp"
#include "grapnel/problem/sensor_setup.hpp"
#include "grapnel/result/result_documents.hpp"
#include "grapnel/simulate/attitude_control.hpp"
#include "grapnel/simulate/controller.hpp"
#include "grapnel/simulate/controller_source.hpp"
#include "grapnel/simulate/external_load.hpp"
#include "grapnel/simulate/integration_setup.hpp"
#include "grapnel/simulate/joint_control.hpp"
#include "grapnel/simulate/joint_trajectory.hpp"
#include "grapnel/simulate/moment_gyros.hpp"
#include "grapnel/simulate/orbit.hpp"
#include "grapnel/simulate/replay_controller.hpp"
#include "grapnel/simulate/thruster_bank.hpp"
#include "grapnel/simulate/tracking_noise.hpp"

namespace grapnel {

/// What an end-effector can close on: how far it may be from its grasp point, and how fast, relative to it.
struct CaptureEnvelope {
  static constexpr double kAny = std::numeric_limits<double>::infinity();
  double position = kAny;          // distance [m]
  double angle = kAny;             // [rad]; of what the grasp's orientation asks for, nothing if it is free
  double velocity = kAny;          // relative speed of the end-effector's origin [m/s]
  double angular_velocity = kAny;  // relative [rad/s]
};

/// What a joint or a gripper may be loaded with in an impact. Forces are peaks, or means over ImpactSetup::duration
/// where the impact takes no time. Infinite where nothing is given.
struct LoadRating {
  static constexpr double kNone = std::numeric_limits<double>::infinity();
  double force = kNone;            // [N]
  double moment = kNone;           // [N m]
  double impulse = kNone;          // [N s]
  double angular_impulse = kNone;  // [N m s]
  // Joints only, along or about the joint's axis: what a brake or drive has to hold [N m or N; N m s or N s].
  double driving = kNone;
  double driving_impulse = kNone;
};

/// A frame on a link that can grasp.
struct EndEffectorSetup : FrameDescription {
  std::optional<Vector3d> approach_axis =
      {};  // unit, in the end-effector's frame: the direction in which it reaches out
  std::optional<CaptureEnvelope> envelope = {};  // absent: whatever it meets it holds
  LoadRating rating = {};                        // of the gripper; at the contact point
};

/// A reaction wheel: a balanced rotor that a motor turns against the base, about an axis fixed in it. The base's mass,
/// centre of mass and inertia are those of the base with all wheels at rest in it. Of a balanced rotor nothing but its
/// moment of inertia about its axis matters beside: neither where it is nor what else it weighs.
struct WheelSetup {
  std::string name;
  Vector3d axis{0, 0, 1};                                   // unit, in the base's frame
  double inertia = 0;                                       // about the axis [kg m^2]
  double torque = std::numeric_limits<double>::infinity();  // largest of the motor [N m]
  double rate = std::numeric_limits<double>::infinity();    // largest relative to the base [rad/s]
  JointFriction friction = {};                              // of its bearing
};

/// A control moment gyro with one gimbal: a balanced rotor that its motor keeps at a rate, in a gimbal that turns
/// against the base about an axis fixed in it, perpendicular to the rotor's. The base's mass, centre of mass and
/// inertia are those with all gyros in it, rotors at rest and gimbals at their zeros; as of wheels, neither where a
/// gyro is nor what it weighs matters beside.
struct MomentGyroSetup {
  std::string name;
  Vector3d gimbal_axis{0, 0, 1};                            // unit, in the base's frame
  Vector3d spin_axis{1, 0, 0};                              // unit, in the base's frame, with the gimbal at its zero
  double inertia = 0;                                       // of the rotor, about its axis [kg m^2]
  double spin_rate = 0;                                     // of the rotor in the gimbal [rad/s]
  double gimbal_inertia = 0;                                // of all that the gimbal turns, about its axis [kg m^2]
  double torque = std::numeric_limits<double>::infinity();  // largest of the gimbal's motor [N m]
  double rate = std::numeric_limits<double>::infinity();    // largest that is commanded to the gimbal [rad/s]
  double bandwidth = 20;                                    // of the loops that keep both rates [1/s]
};

/// What comes out of a thruster, against its force: a cone from where the force acts.
struct PlumeSetup {
  double half_angle = 0;  // [rad]
  double range = 0;       // beyond which it does no harm [m]
};

/// A thruster of the base.
struct ThrusterSetup : Thruster {
  std::string name;
  std::optional<PlumeSetup> plume = {};  // absent: nobody watches it
};

/// A servicer: its bodies (the base first in meaning: the one root), end-effector frames, and shapes for drawing.
struct RobotSetup {
  std::string name;
  std::string base;  // name of the root body
  enum class Base { free, held, fixed };
  /// free: floats. held: kept at its initial pose by an ideal wrench during the approach, free from the impact on.
  /// fixed: bolted to the ground in all phases.
  Base base_mode = Base::free;
  std::vector<BodyDescription> bodies;  // joint of the base: free, or fixed with its pose in X_PF
  std::vector<EndEffectorSetup> end_effectors;
  std::vector<WheelSetup> wheels;                           // of the base
  std::vector<MomentGyroSetup> gyros;                       // of the base
  std::vector<ThrusterSetup> thrusters;                     // of the base
  std::optional<double> propellant;                         // at hand [kg]; absent: nobody says
  std::vector<std::pair<std::string, Geometry>> geometry;   // by body name; a body may have several
  std::vector<std::pair<std::string, LoadRating>> ratings;  // of joints, by name; at the joint's origin
  /// Of a robot whose beams and gears have become pieces on springs (flexible_robot()): what it was; else null.
  std::shared_ptr<const RobotSetup> undeformed = {};
};

/// The shapes of a body of a robot, in their order in RobotSetup::geometry.
std::vector<Geometry> shapes_of(const RobotSetup& robot, const std::string& body);

struct GraspPoint {
  std::string name;
  Posed X_TG = Posed::identity();                   // in the target's frame
  std::optional<Vector3d> approach_direction = {};  // unit, in the target's frame: in which the end-effector comes in
  std::optional<Vector3d> normal = {};              // unit, in the target's frame: the surface's, outward
};

/// What stands out from a target and may bend: a solar panel, a boom. Its frame is where it is mounted.
struct PanelSetup {
  std::string name;
  Posed X_TP = Posed::identity();             // in the target's frame
  double mass = 0;                            // [kg]
  Vector3d com = Vector3d::zero();            // in the panel's frame [m]
  Symmetric3d inertia = Symmetric3d::zero();  // about its centre of mass, its axes [kg m^2]
  std::optional<Vector3d> hinge_axis = {};    // unit, in the panel's frame: it turns about it on `hinge`
  std::optional<JointSpring> hinge = {};      // absent: fixed
  std::optional<BeamDescription> beam = {};
  std::vector<VibrationMode> modes = {};  // in place of a beam
  std::vector<Geometry> geometry;         // its shapes
};

/// A free body to be caught, rigid but for its panels. Mass, centre of mass and inertia are those of the whole, with
/// its panels as they are at rest.
struct TargetSetup {
  std::string name;
  double mass = 0;                            // [kg]
  Vector3d com = Vector3d::zero();            // in the target's frame [m]
  Symmetric3d inertia = Symmetric3d::zero();  // about the centre of mass, target's axes [kg m^2]
  std::vector<Geometry> geometry;             // its shapes
  enum class Instant { start, capture };
  Instant given_at = Instant::capture;  // when pose and twist below hold; propagated from there free of torque
  Posed X_WT = Posed::identity();
  Twistd V_WT = Twistd::zero();  // at the target frame's origin, in W
  std::vector<PanelSetup> panels;
  std::optional<TargetEstimate> estimate = {};  // on which the approach is planned; absent: the truth
  std::vector<GraspPoint> grasp_points;
};

/// An end-effector meets a grasp point and holds it.
struct GraspSetup {
  std::string end_effector;
  std::string target;
  std::string grasp_point;
  GraspModel model = GraspModel::rigid;
  Vector3d hinge_axis{0, 0, 1};  // unit, in the end-effector's frame; for model hinge
  /// No grasp: the end-effector only touches the target there, and rebounds by ImpactSetup's contact law; `model`
  /// is not read. What surface it meets: contact_normal().
  bool contact = false;
  /// What the end-effector's orientation at the grasp is to be. axis: its approach axis along the grasp point's
  /// approach direction; pose: its frame that of the grasp point.
  enum class Orientation { free, axis, pose };
  Orientation orientation = Orientation::free;
  /// When it closes. together: with all others, at the end of the approach (ApproachSetup::capture_at). at_time: at
  /// `closes_at`. on_arrival: as soon as the end-effector is within its envelope, in the approach or after it.
  enum class Closes { together, at_time, on_arrival };
  Closes closes = Closes::together;
  double closes_at = 0;  // [s], from the start of the run
  /// With which velocity it is to arrive, relative to the grasp point, in W: added to what ApproachSetup::match asks
  /// for [m/s], [rad/s].
  Vector3d relative_velocity = Vector3d::zero();
  Vector3d relative_angular_velocity = Vector3d::zero();
};

/// How final joint rates are found from the grasp points' motion through the generalized Jacobian.
enum class RateMatch { velocity, twist, velocity_least_rates };

struct TrackingSetup {
  JointControl mode = JointControl::prescribed;
  std::vector<double> kp;  // per joint, in the order of Model::joints() [N m/rad or N/m]; computed torque: [1/s^2]
  std::vector<double> kd;  // [N m s/rad or N s/m]; computed torque: [1/s]
  std::optional<TrackingNoise> noise;
};

/// A torque that controls the base's attitude (AttitudeControl).
struct BaseControlSetup {
  /// What gives it. outside: something that takes its momentum out of the system, as ideal thrusters would. wheels: the
  /// base's reaction wheels. gyros: its control moment gyros. thrusters: its thrusters. Absent: the wheels, where there
  /// are any, else the gyros, else outside.
  enum class Actuators { outside, wheels, thrusters, gyros };
  std::optional<Actuators> actuators;
  Vector3d kp = Vector3d::zero();  // about the base's axes [N m/rad]
  Vector3d kd = Vector3d::zero();  // [N m s/rad]
  Vector3d limit{AttitudeControl::kNone, AttitudeControl::kNone, AttitudeControl::kNone};  // [N m]
  std::optional<Rotationd> R_WD;                 // desired attitude; absent: the one at the phase's start
  bool feedforward = false;                      // of what the joints' motion takes (BaseActuators::feedforward)
  double wheel_speed_rate = 0;                   // see BaseActuators [1/s]
  std::vector<double> wheel_speeds;              // likewise [rad/s]
  std::optional<ThrusterModulation> modulation;  // of thrusters; absent: its defaults
  std::optional<MomentumDumping> dumping;
  std::optional<GyroSteering> steering;  // of gyros; absent: its defaults
};

/// The on-board computer: laws of joints (pd, computed_torque), attitude control and a controller of the user's own
/// speak at the ticks of one clock (ControlClock). Joints that follow their motion exactly are not sampled.
struct ControlSetup {
  ControlTiming timing;
  /// A controller of one's own, in a shared library (plugin/plugin_controller.hpp); empty: none. It drives joints where
  /// TrackingSetup::mode or PostImpactSetup::joints say so.
  std::string plugin;             // as the scenario names it
  std::string file;               // where it is, for the system's loader
  std::string sha256;             // of that file; empty: of a problem that a program made
  std::string parameters = "{}";  // JSON, an object that the controller understands
  /// In place of a plugin, an FMU for co-simulation (fmi/fmu_controller.hpp), as the scenario names it; empty: none.
  std::string fmu;
  std::string inputs = "{}", outputs = "{}";  // JSON, objects: variables of the FMU, and the signals that they are
  /// In place of both, a controller of the program that simulates.
  bool external = false;
  /// Makes the controller of `fmu` and `external`; null: there is none (yet).
  std::shared_ptr<const ControllerSource> source = {};
  /// In place of a plugin, a log of joint efforts that is replayed; null: none. Its rows are at multiples of the
  /// period.
  std::shared_ptr<const EffortLog> log = {};
  bool base_torque = false;  // controller or log says the torque on a free base too, where it drives the joints
  /// In place of that, a controller of the program (`external`) says every wheel's torque, every
  /// gimbal's rate and every thruster's valve.
  bool base_actuators = false;
  bool has_controller() const { return log || external || !plugin.empty() || !fmu.empty(); }
};

/// Weights of a plan's objectives, of which the weighted sum is minimized. What each is, with its unit: PlanTerm.
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

/// Final joint values are looked for: those with which the momentum-conserving motion brings every end-effector to its
/// grasp point.
struct PlanSetup {
  /// What is minimized among the solutions.
  using Objective = ObjectiveKind;
  Objective objective = Objective::excursion;
  std::optional<PlanWeights> weights;  // in place of `objective`
  std::vector<double> guess;           // per joint: where the search begins; empty: the initial values
  int starts = 16;                     // at most so many initial guesses, the guess first
  std::uint64_t seed = 0;              // of the others
  /// Where planning gives up: evaluations of the servicer's kinematics and momentum, over the whole approach.
  long max_evaluations = 30'000'000;

  // What the last segment that is planned keeps all the way.
  /// Where the joints' limits hold. at_end: positions and rates at the segment's end. on_the_way: positions, rates and
  /// efforts all the way.
  enum class Limits { at_end, on_the_way };
  Limits limits = Limits::at_end;
  std::optional<double> clearance;   // least distance of the bodies that are watched [m]
  std::optional<double> near_grasp;  // from its grasp point, within which an end-effector may touch its target [m]
  std::optional<double> base_turn;   // largest turn of the base from its initial attitude [rad]
  /// Largest share of the momentum that it can hold, of each wheel that keeps the base's attitude.
  std::optional<double> wheel_momentum;
  std::optional<int> knots;  // inner knots of the joints' splines; absent: those that it takes

  /// Joints that move no grasping end-effector. used: they move where that makes the objective less. held: they end
  /// where they began, at rest.
  enum class IdleJoints { used, held };
  IdleJoints idle_joints = IdleJoints::used;
};

/// A place to pass on the way. Either joint values, or places of some end-effectors, found by planning.
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

/// The last piece of way is straight in the target's frame, along the approach direction of each grasp.
struct StraightIn {
  double stand_off = 0;    // distance from the grasp point at which it begins, at rest relative to the target [m]
  double duration = 0;     // of this piece, within the approach's [s]
  double final_speed = 0;  // towards the grasp point, relative to it, at the end [m/s]
  /// Of an end-effector about its approach direction, against its target. free: as the joints move least. matched: it
  /// turns as the target does.
  enum class Roll { free, matched };
  Roll roll = Roll::free;
};

/// The time of capture is looked for between two times.
struct CaptureWindow {
  double earliest = 0, latest = 0;  // [s]
  double step = 0;                  // between the times that are looked at; 0: a fiftieth of the window [s]
  /// objective: the time whose plan has the least objective. soonest: the first that can be reached. slowest: the one
  /// at which the grasp points move slowest against the servicer's centre of mass.
  enum class Choose { objective, soonest, slowest };
  Choose choose = Choose::objective;
};

/// Joint positions over time from outside.
struct SampledMotion {
  std::vector<double> times;                   // [s], from the start of the approach
  std::vector<std::vector<double>> positions;  // per joint, per time
  std::vector<std::vector<double>> rates;      // likewise; empty: a spline chooses them
};

/// A piece of joint motion as polynomials. It begins where and when the one before ends, the first at t = 0.
struct MotionPiece {
  double until = 0;  // [s], from the start of the approach
  /// Per joint: coefficients in Chebyshev polynomials of the first kind over the piece's time, as in ChebyshevPiece.
  std::vector<std::vector<double>> series;
};

struct ApproachSetup {
  double duration = 0;                  // T [s]
  std::optional<CaptureWindow> window;  // in which T is looked for; with plan only
  JointProfile profile = JointProfile::quartic;
  /// Where the joints go: exactly one of these four.
  std::vector<double> final_position;  // per joint
  std::optional<PlanSetup> plan;
  std::optional<SampledMotion> sampled;
  std::vector<MotionPiece> pieces;  // the last until T

  std::optional<std::vector<double>> final_rates;  // given; else by `match`; else zero
  std::optional<RateMatch> match;
  std::vector<Waypoint> waypoints;        // in the order of time
  std::optional<StraightIn> straight_in;  // with plan only; then rates follow from it
  TrackingSetup tracking;
  std::optional<BaseControlSetup> base_control;
  /// When the grasps close. end: at T. envelope: as soon as every end-effector is within its envelope, at T at the
  /// latest.
  enum class CaptureAt { end, envelope };
  CaptureAt capture_at = CaptureAt::end;
  std::optional<ReplanSetup> replan;  // with plan only
};

/// What to do about the distance between an end-effector and its grasp point at the instant of capture.
struct ContactSetup {
  enum class Gap { weld_as_found, translate_target, refuse };
  Gap gap = Gap::weld_as_found;
  double refuse_beyond = 0;  // [m], for refuse
  /// Beyond this gap a grasp without an envelope is an error, not a capture [m]; absent: a fraction of the arm's reach,
  /// stated in docs/formats/scenario.md; infinite: whatever it is.
  std::optional<double> largest_gap = {};
};

/// How contacts (GraspSetup::contact) yield where an impact is resolved in time; see CompliantContact.
struct ContactComplianceSetup {
  ContactForceModel model = ContactForceModel::kelvin_voigt;
  double stiffness = 0;
  double damping = 0;
  double exponent = 1.5;
  double slip_speed = 1e-4;  // [m/s]
};

/// How grasps yield; see CompliantGrasp.
struct GraspComplianceSetup {
  double linear_stiffness = 0;   // [N/m]
  double linear_damping = 0;     // [N s/m]
  double angular_stiffness = 0;  // [N m/rad]
  double angular_damping = 0;    // [N m s/rad]
};

struct ImpactSetup {
  /// plastic: grasps, exact, all at once. bilateral_restitution: grasps whose relative velocity is reversed in part, u+
  /// = -E u-, and that do not hold. restitution: contacts, without friction. friction: contacts, with Coulomb's.
  /// compliant: grasps and contacts, resolved in time. as_published: the thesis's (3.9)-(3.13), for comparison:
  /// momentum is not conserved, and velocities of a closed loop do not fit it. With restitution and friction, grasps
  /// that close at the same time close first, plastically.
  enum class Law { plastic, bilateral_restitution, restitution, friction, compliant, as_published };
  Law law = Law::plastic;
  double duration = 1e-3;  // over which mean forces are taken, and that tells slow modes [s]
  /// Joints during the impact. free: driven by nothing. braked: at rest from its first instant on. driven: they keep
  /// their rates, as with infinitely heavy rotors.
  /// impedance: by the law of ImpedanceSetup, law compliant only.
  enum class Joints { free, braked, driven, impedance };
  Joints joints = Joints::free;
  /// What bends during an impact. all: everything. none: nothing does meanwhile, and what bent goes on as fast as
  /// before (for laws without duration: the more modes can answer a rigid contact the less its impulse is). slow: those
  /// modes of vibration answer whose period is longer than `duration`, and the others go on as before.
  enum class Modes { all, none, slow };
  Modes modes = Modes::all;
  double restitution = 0;          // e of contacts; of grasps, of the linear rows
  double angular_restitution = 0;  // of grasps
  double friction = 0;             // Coulomb's coefficient; laws friction and compliant
  RestitutionHypothesis hypothesis = RestitutionHypothesis::stronge;
  ContactComplianceSetup contact;  // law compliant
  GraspComplianceSetup grasp;
  CompliantSetup compliant;
};

/// After the capture the joints go to a posture: their references leave from where the joints were at the impact, at
/// rest, and are at rest when they arrive.
struct PostureMove {
  std::vector<double> joints;  // per joint [rad or m]
  double after = 0;            // when it begins, since post_impact began [s]
  double duration = 0;         // [s]
  JointProfile profile = JointProfile::quintic;
};

/// A held target is brought to rest through its grasps (DetumblingLaw).
struct DetumbleSetup {
  double torque = 0;   // bound on the torque that it is given, about its centre of mass [N m]
  std::string target;  // which; empty: the only one that is grasped
};

/// The joints keep the base's attitude (BaseKeepingLaw).
struct KeepBaseSetup {
  double rate = 0.5;              // at which the base comes back to its attitude, critically damped [1/s]
  std::vector<double> posture;    // per joint: towards which they go as far as the base allows; empty: they do not
  double posture_rate = 0.05;     // of that motion [1/s]
  std::optional<Rotationd> R_WD;  // the attitude; absent: the one as post_impact begins
};

/// Impedance at end-effectors (ImpedanceLaw): in the approach, in an impact in time and afterwards, where joints say
/// so.
struct ImpedanceSetup {
  std::vector<std::string> end_effectors;  // empty: all that grasps name
  /// What is controlled: all six directions, the position, or x, y and the turn about z of W.
  enum class Motion { pose, position, plane };
  Motion motion = Motion::pose;
  /// operational_space: exact for the model. transpose: J*^T (K e - D v), without mass and model.
  enum class Law { operational_space, transpose };
  Law law = Law::operational_space;
  // Along and about the axes of the reference:
  Vector3d mass{1, 1, 1};                                                             // apparent [kg]
  Vector3d damping = Vector3d::zero(), stiffness = Vector3d::zero();                  // [N s/m], [N/m]
  Vector3d inertia{1, 1, 1};                                                          // apparent [kg m^2]
  Vector3d angular_damping = Vector3d::zero(), angular_stiffness = Vector3d::zero();  // [N m s/rad], [N m/rad]
  /// Whether forces of contact are known to the law; else it takes them for zero.
  enum class Force { sensed, not_sensed };
  Force force = Force::sensed;
  /// target: in an impact the apparent mass along each contact's normal is that with which the target is stopped.
  enum class Match { none, target };
  Match match = Match::none;
  double null_rate = 1;  // at which motion of the joints beside is damped [1/s]
};

/// Motion and internal force of a target that several grasps hold (GraspForceLaw).
struct GraspForceSetup {
  std::string target;  // which; empty: the only one that is grasped
  struct Pair {
    std::vector<std::string> between;  // two end-effectors
    double force = 0;                  // with which they squeeze it along the line between their grasps [N]
    double after = 0;                  // since post_impact began [s]
    double ramp = 0;                   // time over which it comes up [s]
  };
  std::vector<Pair> pairs;
  /// hold: the target stays where it was relative to the base. brake: it comes to rest, as by DetumbleSetup.
  enum class Motion { hold, brake };
  Motion motion = Motion::hold;
  double rate = 0.5;           // of hold, critically damped; of brake, at the end [1/s]
  double torque = 0;           // of brake: bound [N m]
  double moment_length = 0.5;  // of the metric |F|^2 + |N|^2/length^2 that distributes loads [m]
};

/// At which rates the system counts as at rest after the impact.
struct RestSetup {
  double angular_velocity = 0;                                  // of the base, largest [rad/s]
  double joint_rate = std::numeric_limits<double>::infinity();  // of every driven joint, largest [rad/s or m/s]
};

/// What ends a phase of motion before its duration: as soon as all that is given here holds. Rates are magnitudes.
struct PhaseUntil {
  std::optional<double> base_rate;             // the base turns no faster [rad/s]
  std::optional<double> target_rate;           // no target turns faster [rad/s]
  std::optional<double> relative_rate;         // no target turns faster relative to the base [rad/s]
  std::optional<double> joint_rate;            // no driven joint moves faster [rad/s or m/s]
  std::optional<double> wheel_momentum_below;  // no wheel holds more than this share of its largest momentum
  std::optional<double> wheel_momentum_above;  // a wheel holds this share of its largest momentum, or more
  enum class Event { law_ended };  // the law that moves the joints together is over
  std::optional<Event> event;
};

/// A phase of motion after the impact, or of a run without one.
struct PostImpactSetup {
  std::string name;                 // in results; empty: by its place in the sequence (phase_name)
  double duration = 0;              // at the longest [s]
  std::optional<PhaseUntil> until;  // absent: it lasts its duration
  /// free: no torques. pd, computed_torque (JointControl): the joints are held where they were at the impact, rates
  /// zero, or go where `move` says; the model that computes torques has the targets that are held. braked: locked.
  /// controller: by the plugin or the log of ControlSetup; a plugin is asked to hold them there, or to follow `move`.
  /// detumble, keep_base_attitude, impedance (CaptureProblem::impedance), grasp_force: as their setups say, by pd
  /// before a target is held and where the law has ended.
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
  std::vector<double> kp, kd;                       // where has_gains(), as TrackingSetup's: per joint
  std::optional<DetumbleSetup> detumble;            // with joints: detumble
  std::optional<KeepBaseSetup> keep_base_attitude;  // with joints: keep_base_attitude
  std::optional<GraspForceSetup> grasp_force;       // with joints: grasp_force
  std::optional<PostureMove> move;
  std::optional<BaseControlSetup> base_control;
  std::optional<RestSetup> at_rest;  // absent: it is not evaluated
  /// Grasps that are released.
  struct Release {
    double after = 0;                        // since this phase began [s]
    std::vector<std::string> end_effectors;  // empty: all that hold something
  };
  std::vector<Release> releases;
  std::optional<AssumedTarget> assumed;
  std::optional<IdentifySetup> identify;
  std::optional<LawModel> model;  // absent: what is identified, else what is assumed, else the truth
};

/// Phases of motion, each from the end of the one before. A sequence that is used as an optional is its first phase,
/// and in a run the phase at hand.
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

  /// Of all phases, at the longest [s].
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

/// Whether joints have gains: they follow something, or hold.
constexpr bool has_gains(PostImpactSetup::Joints joints) {
  return joints != PostImpactSetup::Joints::free && joints != PostImpactSetup::Joints::braked &&
         joints != PostImpactSetup::Joints::controller;
}
/// Whether a law moves all of them together (grapnel/control/), by efforts, and pd where it is over.
constexpr bool is_law(PostImpactSetup::Joints joints) {
  using Joints = PostImpactSetup::Joints;
  return joints == Joints::detumble || joints == Joints::keep_base_attitude || joints == Joints::impedance ||
         joints == Joints::grasp_force;
}

/// A wrench on a body as a function of time, in all phases (ExternalLoad).
struct LoadSetup {
  std::string body;                    // of the robot, or target_body_name()
  Vector3d p_BP = Vector3d::zero();    // point of attack, in the body's frame [m]
  LoadFrame frame = LoadFrame::world;  // of the components; orbit: needs CaptureProblem::orbit
  Wrenchd amplitude = Wrenchd::zero();
  LoadProfile profile;
  std::optional<Stream> stream = {};  // of air or light, its force times the profile
};

/// The orbit with which W falls, without turning: its origin is the orbit's reference point. Either `altitude`, a
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
  Vector3d along_track{0, 1, 0};  // unit, in W: perpendicular to it, the way the orbit goes
  /// The reference point at t = 0, and its velocity, in the frame of the problem: no file says them, whose frame has
  /// its origin there; seen_from() does [m], [m/s].
  Vector3d position = Vector3d::zero();
  Vector3d velocity = Vector3d::zero();
};
/// Gravitational parameter [m^3/s^2] and equatorial radius [m] of a body.
struct CentralBody {
  double mu, radius;
};
CentralBody central_body(OrbitSetup::Body body);
/// What acts near such an orbit. Without altitude and semi_major_axis it is faulty (fault_of).
ReferenceOrbit reference_orbit(const OrbitSetup& setup);

/// What is watched besides the physics.
struct ClearanceSetup {
  bool enabled = true;
  double required = 0;                                      // [m]; less is a violation
  std::vector<std::pair<std::string, std::string>> ignore;  // pairs of bodies by their names in the model
};

/// Everything `simulate_capture()` needs. Phases that are absent are not simulated; with no approach the initial state
/// is the state at capture (t = 0).
struct CaptureProblem {
  std::string name;
  std::string sha256;                         // of the input it came from; empty for a program's own
  std::shared_ptr<const SourceTexts> source;  // that input; null for a program's own
  RobotSetup robot;
  Vector3d gravity = Vector3d::zero();  // uniform, in W [m/s^2]
  std::optional<OrbitSetup> orbit;      // with which W falls; absent: nothing but `gravity` and `loads` acts
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
  std::vector<double> gimbal_rate;     // likewise, which no file says: gimbals start at rest [rad/s]; empty: zero

  std::optional<ApproachSetup> approach;
  ContactSetup contact;
  std::optional<ImpactSetup> impact;
  MotionPhases post_impact;  // after the impact; without an impact after the approach, or from t = 0 (key `motion`)
  std::vector<LoadSetup> loads;
  std::optional<ControlSetup> control;      // absent: laws speak continuously
  std::optional<SensorSetup> sensors;       // with control only; absent: the laws see the truth
  std::optional<ImpedanceSetup> impedance;  // where joints are under impedance control
  ClearanceSetup clearance;
  IntegrationSetup integration;
  double output_interval = 0.05;     // [s]
  bool output_links = false;         // the time series has the links' velocities
  bool output_as_published = false;  // what the thesis's formulas give is shown beside, as with its own law
};

/// The key of the phases in files and messages: post_impact, without an impact motion.
const char* phases_key(const CaptureProblem& problem);
/// The name of a phase in results: its own; of an only one the key, of several phase_1, phase_2, ...
std::string phase_name(const CaptureProblem& problem, std::size_t phase);

// --- Settings of a run that no scenario states ---

/// How much of a capture is worked out.
enum class CaptureDetail {
  /// Everything that CaptureResult can hold.
  full,
  /// What studies and campaigns keep of a case (study/column.hpp): warnings, plan, grasps, impacts with impulses,
  /// joints, energies and margins, states between phases, clearance, limits, ledger and cost. What is there is the
  /// same, bit for bit, but for the ledger: where neither clearance nor joint limits nor closed loops are watched its
  /// checks look at the ends of steps, some 32 in a phase, instead of output instants; and for efforts against their
  /// limits, which are looked at where clearance is. Absent: scene, time series, loads of phases in motion (those of
  /// impacts are there), and of an impact its measures, sensitivities, null space and the published estimate.
  columns,
  /// The same with the loads of all phases: some two thirds slower, and nothing of it may be integrated in lanes.
  columns_and_loads
};

/// Told after every step where a run is: the phase, the simulated time reached and the phase's end. While the approach
/// is planned the phase is kPlanning, and the two numbers are the evaluations so far and the most there may be
/// (PlanSetup::max_evaluations). What it throws ends the run, unless it is a std::runtime_error, which becomes the
/// result's failure.
using CaptureProgress = std::function<void(const std::string& phase, double time, double end)>;

inline constexpr const char* kPlanning = "planning";

// --- What the names in a grasp mean, in problems whose names have been checked (make_capture_system) ---

/// Position of a target in CaptureProblem::targets.
std::size_t target_index(const CaptureProblem& problem, const std::string& target);
const TargetSetup& target_of(const CaptureProblem& problem, const GraspSetup& grasp);
const GraspPoint& grasp_point_of(const CaptureProblem& problem, const GraspSetup& grasp);
const EndEffectorSetup& end_effector_of(const CaptureProblem& problem, const GraspSetup& grasp);

/// Outward unit normal of a target's surface at a grasp point, in the target's frame: the point's own, else against its
/// approach direction, else from the centre through it of a target whose only shape is a sphere. Empty if none of these
/// is there.
std::optional<Vector3d> contact_normal(const TargetSetup& target, const GraspPoint& point);

// --- Joint motion stated piece by piece, to and from trajectories ---

/// The motion of one joint.
JointTrajectory trajectory_of(std::span<const MotionPiece> pieces, std::size_t joint);

/// What states these trajectories, which begin at 0 and whose pieces end at the same times. Series stay what they are,
/// polynomial profiles become series of degree 5, cycloidal ones their interpolants, which differ by rounding alone.
/// @throws std::invalid_argument if the pieces' ends differ.
std::vector<MotionPiece> motion_pieces(std::span<const JointTrajectory> joints);

}  // namespace grapnel
