#pragma once

/// @file
/// The result of a capture: plain data, SI units, vectors in the world frame W unless a name specifies otherwise.
/// motion_fields.cpp, impact_fields.cpp and summary_fields.cpp describe each field with its unit. Filled by
/// simulate_capture(), read by the writers and reports. Public, kept stable.

#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "grapnel/contact/clearance_result.hpp"
#include "grapnel/result/actuation_result.hpp"
#include "grapnel/result/contact_result.hpp"
#include "grapnel/result/impact_result.hpp"
#include "grapnel/result/knowledge_result.hpp"
#include "grapnel/result/ledger.hpp"
#include "grapnel/result/motion_result.hpp"
#include "grapnel/result/scene.hpp"
#include "grapnel/result/time_series.hpp"
#include "grapnel/spatial/spatial_vector.hpp"

namespace grapnel {

/// How a run ended. Pessimistic until proven otherwise.
enum class CaptureStatus { not_run, completed, failed };

/// Whether the capture succeeded. assumed: no envelope states the gripper's capture range, so the grasp is assumed to
/// close without an evaluation.
enum class Captured { no, assumed, yes };

/// Whether one grasp closes at the instant of capture, the criterion of success.
struct GraspOutcome {
  std::string end_effector;
  std::string target;
  std::string grasp_point;
  bool captured = false;  // it closed and was not lost; see verdict()
  std::string reason;
  double distance = 0;
  double angle = 0;
  double velocity = 0;
  double angular_velocity = 0;
  double time = 0;
  std::optional<double> released = {};
  std::optional<double> lost = {};
  std::optional<double> slipped = {};  // first onset of slip since it closed
  bool slips = false;                  // at the end
  double slip_distance = 0;            // displacement by slip since it closed
  double slip_angle = 0;
  int closings = 0;
  std::optional<double> largest_load = {};
  std::optional<double> largest_load_time = {};
  bool judged = false;  // an envelope was evaluated, or the target was settled
  std::string limiting = {};
  double target_moved = 0;
  Captured verdict() const { return !captured ? Captured::no : judged ? Captured::yes : Captured::assumed; }
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

/// A control law that moves all joints together, in the approach or after the impact. A law reports the members that
/// drive_fields.cpp lists for it; the others keep their defaults. The deviations are those of the end-effectors
/// (impedance), of the target (grasp_force) or of the base (base_keeping) from their references.
struct LawReport {
  enum class Law { detumbling, base_keeping, impedance, grasp_force };
  /// Two grasps that squeeze a target.
  struct Squeeze {
    std::vector<std::string> between;
    double reference = 0;      // at the end [N]
    double force = 0;          // by the multipliers of the closed loops, at the end [N]
    double largest_error = 0;  // [N]
    double largest_error_time = 0;
  };
  Law law = Law::detumbling;
  bool in_approach = false;
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
  double first_share = 1;
  double largest_demand = 0;
  double largest_demand_time = 0;
  std::string limiting;
  std::vector<Squeeze> pairs;
  int rank = 0;                     // number of directions that the joints control, at the start
  double other_internal_force = 0;  // largest other internal wrench of the grasps, in the law's metric [N]
  double largest_distance = 0;      // [m]
  double largest_distance_time = 0;
  double distance_after = 0;
  double largest_angle = 0;  // [rad]
  double largest_angle_time = 0;
  double angle_after = 0;
  double angular_velocity_after = 0;
  double least_share = 1;  // of the command that the limits admit
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

/// A grasp that opened under a load beyond its limits.
struct LossReport {
  double time = 0;
  std::string end_effector;
  std::string target;
  double force = 0;
  double moment = 0;
  double load = 0;
  bool in_impact = false;
  bool by_slip = false;
};

/// The end of a slip.
enum class SlipEnd { slips, sticks, lost, released };

/// A grasp that slipped.
struct SlipReport {
  double time = 0;
  std::string end_effector;
  std::string target;
  double force = 0;
  double moment = 0;
  SlipEnd ended = SlipEnd::slips;
  double until = 0;
  double distance = 0;
  double angle = 0;
  double energy = 0;
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
  long implicit_steps = 0;                                 // of `steps`
  std::vector<std::array<double, 2>> implicit_spans = {};  // begins and ends of intervals of implicit steps [s]
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
  std::vector<ImpactReport> impacts;  // in the order of time
  /// The first impact; null: none.
  const ImpactReport* impact() const { return impacts.empty() ? nullptr : impacts.data(); }
  std::vector<ImpactReport> later_impacts() const { return {impacts.begin() + !impacts.empty(), impacts.end()}; }
  std::vector<ReleaseReport> releases;
  std::vector<LossReport> losses;           // in the order of time
  std::vector<SlipReport> slips;            // likewise
  std::vector<LoopReport> loops;            // per phase with closed loops
  std::vector<GraspLoad> grasp_loads;       // per phase and grasp
  std::vector<PeakLoad> peak_loads;         // over all phases: per load and phase
  bool without_impact = false;              // the scenario has none: motion alone
  std::vector<MotionPhaseReport> phases;    // completed phases after the impact, or of motion alone
  std::optional<PhaseEnd> post_impact_end;  // of the last of them
  std::vector<LawReport> laws;              // one per law, in the approach and after the impact
  /// The report of a law; null: it did not act.
  const LawReport* law(LawReport::Law which, bool in_approach = false) const {
    const auto at = std::find_if(laws.begin(), laws.end(), [&](const LawReport& report) {
      return report.law == which && report.in_approach == in_approach;
    });
    return at == laws.end() ? nullptr : &*at;
  }
  std::optional<IdentificationReport> identification;  // after the impact
  std::vector<WheelReport> wheels;                     // of the base, in the robot's order
  std::optional<GyrosReport> gyros;                    // of the base, where it has any
  std::vector<ActuatorUse> actuators;                  // of the base, of other kinds
  std::vector<TendonReport> tendons;                   // in the robot's order
  std::vector<JointReport> joints;           // per phase in motion, of joints with sticking friction, stops or motors
  std::vector<StopImpact> stop_impacts;      // the first ones
  long stop_impact_count = 0;                // all
  std::optional<ThrustersReport> thrusters;  // of the base, where it has any
  std::vector<SaturationReport> saturation;  // the longest first
  std::vector<StabilityReport> stability;    // per phase in motion that was observed in every step
  std::vector<ControlLoopReport> control_loops;  // at the times at which linear models were requested
  std::optional<RestReport> rest;                // if the problem states the rates of rest
  std::vector<MinimumClearance> clearance;       // per phase in which bodies with shapes were monitored
  std::vector<ClearanceEvent> clearance_events;
  std::vector<ContactPairReport> contacts;  // per pair of bodies that may touch
  std::vector<StagesReport> stages;         // per target with stages
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
