#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "grapnel/scenario/joint_values.hpp"
#include "grapnel/scenario/sections.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel {

// ---- Contents of "approach" ----

template <>
struct Described<JointControl> {
  // The control laws with a name in files.
  static constexpr auto choices = [] {
    std::array<Choice, std::size(kJointControls) - 1> named{};
    std::size_t n = 0;
    for (const JointControlLaw& law : kJointControls) {
      if (!law.name_in_files.empty()) named.at(n++) = choice(law.control, law.name_in_files);
    }
    return named;
  }();
  static constexpr Type type = enumeration<JointControl>("Mode", choices);
};

template <>
struct Described<ThrusterModulation> {
  using T = ThrusterModulation;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::kind>("modulation", "",
                      "pulse_width: each thruster fires in every period of `control` for the time that gives the "
                      "command on average, all reduced in proportion where that exceeds the period. schmitt: each is "
                      "on or off by the commanded share of its force, with hysteresis: at the sample instants of "
                      "`control`, or without it at any time."),
      field<&T::level_on>("level_on", "1",
                          "Share above which a thruster is on: with schmitt of its force; with pulse_width of "
                          "min_on_time, for smaller commands.")
          .above(0)
          .at_most(1),
      field<&T::level_off>("level_off", "1", "Share down to which it stays on; less than level_on.")
          .at_least(0)
          .at_most(1),
  });
  static constexpr Type type =
      structure<T>("thruster_modulation", "How thrusters produce the commanded force and torque.", fields);
};

template <>
struct Described<MomentumDumping> {
  using T = MomentumDumping;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::above>("above", "N m s",
                       "Size of the wheels' momentum, relative to the base, at which dumping begins, as read at the "
                       "sample whose pulses begin.")
          .above(0)
          .required(),
      field<&T::below>("below", "N m s", "Size at which it ends; less than `above`.").at_least(0).required(),
      field<&T::torque>("torque", "N m",
                        "Torque of the thrusters, averaged over a period, without the ramps of the forces. The wheels' "
                        "motors must have it in reserve; otherwise the base is disturbed.")
          .above(0)
          .required(),
  });
  static constexpr Type type = structure<T>(
      "momentum_dumping",
      "Thrusters unload the wheels' momentum, while the wheels counter the thrusters' torque and slow down.", fields);
};

template <>
struct Described<GyroSteering> {
  using T = GyroSteering;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::near>("near", "1",
                      "Singularity measure below which the array is near a singularity: gimbal rates are damped and "
                      "the torque is incomplete; both are reported. A pyramid with gimbals at their zeros has 1.09.")
          .above(0)
          .up_to(1000),
      field<&T::damping>("damping", "1", "Damping of the rates at a singularity, lambda0 of (17.9).")
          .above(0)
          .up_to(1000),
      field<&T::dither>("dither", "1",
                        "Share epsilon0 of (17.10): it rotates the gimbals out of a singularity in which damping alone "
                        "would leave them; 0: none.")
          .at_least(0)
          .up_to(0.49),
  });
  static constexpr Type type =
      structure<T>("gyro_steering", "How gimbal rates are computed near singular configurations.", fields);
};

template <>
struct Described<BaseControlSetup> {
  using T = BaseControlSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::actuators>("actuators", "",
                           "Source of the torque. wheels: the robot's reaction wheels; gyros: its control moment "
                           "gyros; thrusters: its thrusters; outside: an external torque; or another kind of the "
                           "robot's `actuators`. Absent: `wheels` if the robot has any, else `gyros` if it has any, "
                           "else `outside`.")
          .optional(),
      field<&T::kp>("kp", "N m/rad", "Proportional gain, for all axes, or each.")
          .at_least(0)
          .as("axis gains")
          .required(),
      field<&T::kd>("kd", "N m s/rad", "Derivative gain, for all axes, or each.")
          .at_least(0)
          .as("axis gains")
          .required(),
      field<&T::limit>("limit", "N m", "Maximum torque about each axis. Absent: none.")
          .above(0)
          .as("axis gains")
          .optional(),
      field<&T::R_WD>("quaternion_wxyz", "", "Desired attitude in W. Absent: the attitude at the phase's start.")
          .as("quaternion")
          .optional(),
      field<&T::R_WD>("rpy", "rad", "Desired attitude in W. Absent: the attitude at the phase's start.")
          .as("rpy")
          .optional(),
      field<&T::feedforward>(
          "feedforward", "",
          "Whether the torque of the joints' motion is added, as the model predicts it (18.6), so that arms do not "
          "rotate the base; within `limit`. Joints without a reference count with their rates alone."),
      field<&T::wheel_speed_rate>(
          "wheel_speed_rate", "1/s",
          "Rate at which the wheels' rates approach wheel_speeds, as far as that exerts no torque on the base (18.7). "
          "With `control` it uses the rates read at the sample instants and should be well below 1/period.")
          .at_least(0),
      field<&T::wheel_speeds>("wheel_speeds", "rad/s",
                              "Rate per wheel, within their maximum rates. With zeros the wheels' momenta become the "
                              "minimum-norm momenta with their present sum. Needs wheel_speed_rate. Absent: zero.")
          .plausible_to(kFastestRotor)
          .optional(),
      field<&T::modulation>("thrusters", "",
                            "Modulation of the thrusters; with `actuators: thrusters` or `dumping`. Absent: defaults.")
          .optional(),
      field<&T::dumping>("dumping", "",
                         "Thrusters remove the wheels' momentum by pulse_width, while the wheels provide the torque of "
                         "attitude control and compensate the average torque of the pulses.")
          .optional(),
      field<&T::steering>("steering", "",
                          "Behaviour of control moment gyros near singular configurations, in which they cannot "
                          "provide torque about every axis. Only where gyros provide it. Absent: defaults.")
          .optional(),
  });
  static constexpr auto rules = std::to_array<Rule>({not_both("quaternion_wxyz, rpy")});
  static constexpr Type type =
      structure<T>("base_control",
                   "A torque that holds the base's attitude: -(kp times the rotation vector from the desired attitude "
                   "+ kd times the angular velocity), about the base's axes.",
                   fields, rules);
};

template <>
struct Described<TrackingNoise> {
  using T = TrackingNoise;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::position>("position", "rad or m", "Standard deviation.").at_least(0).required(),
      field<&T::bandwidth>("bandwidth", "Hz", "Highest frequency of the noise.").above(0),
      field<&T::seed>("seed", "", kSeedText).at_least(0).at_most(kLargestWhole),
  });
  static constexpr Type type =
      structure<T>("noise",
                   "Errors of the joints' sensors: smooth, nearly Gaussian, reproducible for the same seed; joints "
                   "with ideal tracking follow the reference minus this noise.",
                   fields);
};

template <>
struct Described<TrackingSetup> {
  using T = TrackingSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::mode>("mode", "",
                      "ideal: the joints follow exactly. pd: torques by (4.1). computed_torque: the torques of the "
                      "model; errors decay with the gains. controller: torques of `control`. impedance: the "
                      "end-effectors move to their grasp points by the law of `impedance`, straight in the targets' "
                      "frames along the profile, until the first grasp closes."),
      field<&T::kp>("kp", "N m/rad or N/m; for computed_torque 1/s^2",
                    "Proportional gains, for modes pd and computed_torque, and for pd after impedance ends. `ideal` "
                    "ignores them.")
          .at_least(0)
          .as("gains of tracking")
          .optional()
          .when<[](const T& t) { return has_gains(t.mode); }>(),
      field<&T::kd>("kd", "N m s/rad or N s/m; for computed_torque 1/s", "Derivative gains, likewise.")
          .at_least(0)
          .as("gains of tracking")
          .optional()
          .when<[](const T& t) { return has_gains(t.mode); }>(),
      field<&T::noise>("noise", "", "").optional(),
  });
  static constexpr auto rules = std::to_array<Rule>({when("mode", "pd, computed_torque, impedance").require("kp, kd")});
  static constexpr Type type = structure<T>("tracking", "Control of the joints.", fields, rules);
};

template <>
struct Described<PlanWeights> {
  using T = PlanWeights;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::excursion>(
          "excursion", "1/rad^2",
          "Half the sum of squares of the joints' displacements, more where final rates make them swing (6.8a).")
          .at_least(0),
      field<&T::nearest>("nearest", "1/rad^2",
                         "Half the sum of squares of the distances of the final joint values from `guess`.")
          .at_least(0),
      field<&T::limits>("limits", "1",
                        "Half the sum of squares of the distances of the final joint values from the middles of the "
                        "joints' ranges, over the ranges.")
          .at_least(0),
      field<&T::manipulability>("manipulability", "1", "-log sqrt(det(J_g J_g^T)), summed over the end-effectors.")
          .at_least(0),
      field<&T::effort>(
          "effort", "1/(N m)^2",
          "Half the mean over the segment of the sum of squares of the joints' efforts, without friction.")
          .at_least(0),
      field<&T::base_attitude>("base_attitude", "1/rad^2",
                               "Half the square of the base's rotation angle at the capture.")
          .at_least(0),
      field<&T::base_motion>(
          "base_motion", "1/rad^2",
          "Half the mean square of the base's angular velocity, times the square of the segment's duration.")
          .at_least(0),
      field<&T::clearance>("clearance", "1/m", "Minus the minimum distance of the bodies, as under plan.clearance.")
          .at_least(0),
      field<&T::impulse>("impulse", "1/J",
                         "P^T D P / 2 of the impulses P with which rigid grasps (of their `model`) stop the relative "
                         "motion at the capture: the energy of the free targets from each impulse alone; joints as in "
                         "impact.joints. Zero for matched motion. Not with straight_in.")
          .at_least(0),
      field<&T::impulse_index>(
          "impulse_index", "1",
          "Impulse per relative motion at the grasps, against an immovable robot with one grasp per target: mean over "
          "its directions, of (13.5). For unknown mismatches. Not with straight_in.")
          .at_least(0),
      field<&T::wheel_momentum>("wheel_momentum", "1",
                                "Half the mean over the segment of the sum of squares of the wheels' momenta over "
                                "their capacities, as under plan.wheel_momentum.")
          .at_least(0),
  });
  static constexpr Type type =
      structure<T>("weights",
                   "In place of `objective`: the sum of these terms with these weights is minimized; omitted terms "
                   "have weight zero. A term with a negligible weight (1e-9) is reported with the result.",
                   fields);
};

template <>
struct Described<CaptureWindow> {
  using T = CaptureWindow;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::earliest>("earliest", "s", "First evaluated time.").above(0).required(),
      field<&T::latest>("latest", "s", "Last evaluated time; after `earliest`.").above(0).required(),
      field<&T::step>("step", "s",
                      "Interval between evaluated times, at most 10,000 of them; 0: a fiftieth of the window.")
          .at_least(0),
      field<&T::choose>("choose", "",
                        "objective: the time whose plan has the lowest objective (not with as_found, which has none). "
                        "soonest: the first reachable time. slowest: the reachable time at which the fastest grasp "
                        "point moves slowest relative to the servicer's centre of mass."),
  });
  static constexpr Type type = structure<T>(
      "window", "In place of `duration`: the planner searches the time of capture T between two times.", fields);
};

template <>
struct Described<PlanSetup> {
  using T = PlanSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::objective>("objective", "",
                           "Minimized among the solutions: one of the terms that `weights` names. as_found: none; the "
                           "first solution from the guess is used without minimization."),
      field<&T::weights>("weights", "", "").optional(),
      field<&T::guess>("guess", "rad or m",
                       "Start of the search: all moving joints, within their limits. Absent: the initial values.")
          .as("joint values")
          .optional(),
      field<&T::starts>("starts", "", "Maximum number of initial guesses; all except the guess are random.")
          .at_least(1)
          .at_most(1000),
      field<&T::seed>("seed", "", kSeedText).at_least(0).at_most(kLargestWhole),
      field<&T::max_evaluations>("max_evaluations", "",
                                 "Limit of planning: evaluations of the servicer's kinematics and momentum, over the "
                                 "whole approach. Beyond it planning fails with a message that suggests remedies.")
          .at_least(1)
          .at_most(1000000000000),
      field<&T::limits>(
          "limits", "",
          "Where the joints' limits are enforced. at_end: positions, and rates where such a solution exists, at the "
          "end. on_the_way: positions, rates and efforts during the complete segment; otherwise planning fails."),
      field<&T::clearance>("clearance", "m",
                           "Minimum distance during the complete segment between the bodies that the scenario's "
                           "`clearance` monitors, pairs of `contacts` included, and from all obstacles. Also between "
                           "an end-effector (with all bodies fixed to it) and its "
                           "own target while it is farther from its grasp point than near_grasp. Absent: not checked.")
          .at_least(0)
          .optional(),
      field<&T::near_grasp>("near_grasp", "m",
                            "Distance from its grasp point within which an end-effector may touch its target. Absent: "
                            "the extent of the end-effector's shapes from its origin, plus `clearance`.")
          .at_least(0)
          .optional(),
      field<&T::contacts>("contacts", "",
                          "Pairs that may touch by the scenario's `contacts`, before the capture. avoided: they keep "
                          "`clearance` as all others. allowed: they may touch."),
      field<&T::base_turn>(
          "base_turn", "rad",
          "Maximum rotation of the base from its initial attitude, during the complete segment. Absent: any.")
          .above(0)
          .optional(),
      field<&T::wheel_momentum>(
          "wheel_momentum", "1",
          "Maximum share of its capacity (moment of inertia times maximum rate), during the complete segment, of each "
          "wheel that keeps the base's attitude. Needs base_control with wheels, which all have a `rate`, that is "
          "strong enough to keep the attitude and has no `dumping`. Absent: any.")
          .above(0)
          .at_most(1)
          .optional(),
      field<&T::knots>("knots", "",
                       "Inner knots of splines that are added to each joint's polynomial. They give the trajectory "
                       "more freedom to satisfy constraints and to reduce an objective. Absent: 0; 4 where the "
                       "constraints cannot be satisfied without.")
          .at_least(0)
          .at_most(30)
          .optional(),
      field<&T::idle_joints>(
          "idle_joints", "",
          "Joints that move no grasping end-effector. used: they move where that reduces the objective. held: they end "
          "at their initial values, at rest; from rest they do not move at all."),
  });
  static constexpr auto rules = std::to_array<Rule>({
      when("objective", "nearest").require("guess"),
      not_both("objective, weights"),
      needs("near_grasp", "clearance"),
      needs("contacts", "clearance"),
  });
  static constexpr Type type =
      structure<T>("plan",
                   "The planner searches for final joint values for which the momentum-conserving motion brings every "
                   "end-effector to its grasp point. Needs `grasps`.",
                   fields, rules);
};

template <>
struct Described<MotionPiece> {
  using T = MotionPiece;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::until>("until", "s",
                       "End of the segment, from the start of the approach. A segment begins at the end of the "
                       "previous one, the first at 0.")
          .above(0)
          .required(),
      field<&T::series>(
          "series", "rad or m",
          "For every moving joint the coefficients c0, c1, ... of Chebyshev polynomials of the first kind: position = "
          "sum of ck Tk(x), with x from -1 to 1 over the segment (T0 = 1, T1 = x, T2 = 2 x^2 - 1, ...).")
          .as("series by joint")
          .required(),
  });
  static constexpr Type type = structure<T>(
      "piece", "The joints' motion from the end of the previous piece; the first begins at t = 0.", fields);
};

template <>
struct Described<Waypoint::Place> {
  using T = Waypoint::Place;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::position>("position", "m", "Position of the end-effector's origin.").up_to(1e+09).required(),
      field<&T::target>("target", "", "The target whose frame applies to position and velocity. Absent: the world.")
          .optional(),
      field<&T::velocity>("velocity", "m/s",
                          "Velocity of the end-effector's origin, relative to that frame. Absent: zero.")
          .optional(),
  });
  static constexpr Type type = structure<T>("place", "", fields);
};

template <>
struct Described<Waypoint> {
  using T = Waypoint;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::time>("time", "s",
                      "From the start of the approach: between 0 and T, or with straight_in the beginning of that "
                      "segment; both excluded.")
          .above(0)
          .required(),
      field<&T::joints>("joints", "rad or m", "Values of all moving joints, within their limits.")
          .as("joint values")
          .optional(),
      field<&T::rates>("rates", "rad/s or m/s",
                       "Rates with `joints`; joints left out of a mapping are at rest. Absent: zero.")
          .as("joint values")
          .optional(),
      field<&T::places>("end_effectors", "",
                        "Positions of some end-effectors, for which joint values are then searched.")
          .as("places by end-effector")
          .items(1, 0)
          .optional(),
  });
  static constexpr auto rules = std::to_array<Rule>({
      one_of("joints, end_effectors"),
      needs("rates", "joints"),
  });
  static constexpr Type type = structure<T>("waypoint",
                                            "Joint values, or places of end-effectors from which the planner computes "
                                            "joint values, at an instant of the approach.",
                                            fields, rules);
};

template <>
struct Described<StraightIn> {
  using T = StraightIn;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::stand_off>("stand_off", "m",
                           "Distance from the grasp point at which the segment begins, at rest relative to the target.")
          .above(0)
          .required(),
      field<&T::duration>("duration", "s", "Duration of this segment; less than the approach's.").above(0).required(),
      field<&T::final_speed>("final_speed", "m/s", "Speed towards the grasp point, relative to it, at the end.")
          .at_least(0),
      field<&T::roll>(
          "roll", "",
          "Rotation of an end-effector about its approach direction. free: as minimum joint motion gives it, so it may "
          "rotate relative to its target when it closes. matched: it rotates about that direction with the target."),
  });
  static constexpr Type type =
      structure<T>("straight_in",
                   "The last segment is a final straight approach in the target's frame, along each grasp point's "
                   "approach_direction, which every grasped point must then have.",
                   fields);
};

template <>
struct Described<ApproachSetup> {
  using T = ApproachSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::duration>("duration", "s",
                          "T. Required, unless a trajectory or pieces define it, or `window` replaces it.")
          .above(0)
          .optional(),
      field<&T::window>("window", "", "").optional(),
      field<&T::profile>(
          "profile", "",
          "Motion of every segment between two postures. quartic: the thesis's (3.1), which starts from rest; with "
          "initial.joint_rates and ideal tracking, or after a waypoint with rates, use another."),
      field<&T::final_position>("final_joints", "rad or m", "Final values of all moving joints, within their limits.")
          .as("joint values")
          .optional(),
      field<&T::plan>("plan", "", "").optional(),
      key<std::string>(
          "trajectory", "",
          "Path of a CSV file with joint values over time, relative to this file: a header line time,<joint>,..., "
          "optionally with <joint>.rate for all joints, and a line of numbers per sample.")
          .optional(),
      field<&T::pieces>("pieces", "",
                        "The joints' motion as polynomials, in the order of time from 0; each piece begins where the "
                        "previous one ends.")
          .items(1, 10000)
          .optional(),
      field<&T::final_rates>("final_rates", "rad/s or m/s",
                             "Joint rates at the end; joints left out of a mapping end at rest. With {match: ...} they "
                             "match the motion of the grasp points. Absent: zero; with `plan` {match: twist}.")
          .as("final rates")
          .optional(),
      field<&T::tracking>("tracking", "", ""),
      field<&T::waypoints>("waypoints", "", "Intermediate postures, in the order of time.").items(0, 1000),
      field<&T::straight_in>("straight_in", "", "").optional(),
      field<&T::base_control>(&base_control_description, "base_control", "").optional(),
      field<&T::capture_at>("capture_at", "",
                            "Closing time of the grasps without closes_at and closes_on_arrival. end: at T. envelope: "
                            "as soon as each of their end-effectors is within its envelope, at T at the latest; each "
                            "needs one, and there must be at least one such grasp."),
      field<&T::replan>(&replan_description, "replan", "").optional(),
  });
  static constexpr auto rules = std::to_array<Rule>({
      one_of("final_joints, plan, trajectory, pieces"),
      needs("final_joints", "duration"),
      when("plan").require_one_of("duration, window"),
      needs("window", "plan"),
      needs("straight_in", "plan"),
      when("trajectory").forbid("profile, waypoints", "the file gives the joint values at all times"),
      when("trajectory").forbid("final_rates", "the rates at the end follow from the file"),
      when("pieces").forbid("profile, waypoints", "they give the joint values at all times"),
      when("pieces").forbid("final_rates", "the rates at the end follow from them"),
      when("straight_in").forbid("final_rates", "the rates follow from straight_in"),
  });
  static constexpr Type type =
      structure<T>("approach", "The motion from the initial joint values to the capture.", fields, rules);
};

const Type& approach_description() { return type_of<std::optional<ApproachSetup>>(); }
const Type& base_control_description() { return type_of<std::optional<BaseControlSetup>>(); }

// ---- Reading ----

namespace {

// Tolerances for agreement of a stated motion with other values, and of each piece with the previous one.
constexpr double kSameDuration = 1e-9;  // relative
constexpr double kSameMotion = 1e-6;    // [rad or m; rad/s or m/s]

// Checks that the pieces form a continuous motion.
class PiecesCheck {
 public:
  PiecesCheck(const std::vector<MotionPiece>& pieces, Reading& reading)
      : pieces_(pieces), reading_(reading), ends_(reading.robot.joints.size()) {}

  // False if errors make the motion uncertain.
  bool check(const Node& list) {
    const std::size_t before = reading_.faults.size();
    double begin = 0;
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
      if (!(pieces_[i].until > begin) || !check(list.items[i], i, begin)) return false;
      begin = pieces_[i].until;
    }
    return reading_.faults.size() == before && reading_.robot.order_known && !pieces_.empty();
  }

 private:
  bool check(const Node& node, std::size_t i, double begin) {
    const std::vector<const Node*> nodes = joint_nodes(part(node, "series"), reading_.robot);
    const auto is_empty = [](const std::vector<double>& series) { return series.empty(); };
    if (nodes.size() != ends_.size() || pieces_[i].series.size() != ends_.size() ||
        std::any_of(pieces_[i].series.begin(), pieces_[i].series.end(), is_empty))
      return false;
    for (std::size_t j = 0; j < nodes.size(); ++j) {
      check_continuity(
          begin, i, j, nodes[j]->mark,
          fmt::format("{}.series of joint {}", item("approach.pieces", i), in_quotes(reading_.robot.joints[j].name)));
    }
    return true;
  }

  // A jump would be an unphysical impulse.
  void check_continuity(double begin, std::size_t i, std::size_t joint, const Mark& mark, const std::string& name) {
    const MotionPiece& piece = pieces_[i];
    JointTrajectory trajectory;
    trajectory.segments.push_back({begin, piece.until, ChebyshevSegment{piece.series[joint]}});
    const JointPoint first = evaluate(trajectory, begin), last = evaluate(trajectory, piece.until);
    JointPoint& before = ends_[joint];
    for (const double x : {first.position, first.rate, last.position, last.rate}) {
      if (std::isfinite(x)) continue;
      reading_.faults.add(mark, name + " gives positions or rates that overflow");
      return;
    }
    if (i > 0) {
      check_same(first.position, before.position, mark, name, "at");
      check_same(first.rate, before.rate, mark, name, "with the rate");
    }
    before = last;
  }

  void check_same(double here, double before, const Mark& mark, const std::string& name, const char* what) {
    if (std::abs(here - before) <= kSameMotion) return;
    reading_.faults.add(
        mark, fmt::format("{} begins {} {}, but the previous piece ends {} {}; they must agree within {}", name, what,
                          here, what, before, kSameMotion));
  }

  const std::vector<MotionPiece>& pieces_;
  Reading& reading_;
  std::vector<JointPoint> ends_;  // per joint: of the previous piece
};

class ApproachReader {
 public:
  explicit ApproachReader(Reading& reading)
      : node_(part(reading.root, "approach")),
        reading_(reading),
        robot_(reading.robot),
        faults_(reading.faults),
        approach_(*reading.problem.approach) {}

  void finish(const TrajectoryFile* file) {
    if (file) read_samples(*file);
    if (const Node* pieces = node_.find("pieces")) follow_pieces(*pieces);
    // Until a time is selected the approach has its largest duration.
    if (approach_.window && !node_.find("duration")) approach_.duration = approach_.window->latest;
    const Node* rates = node_.find("final_rates");
    if (!rates && approach_.plan && !node_.find("straight_in")) approach_.match = RateMatch::twist;
    const NodeEntry* match = rates ? rates->entry("match") : nullptr;
    if (match && !reading_.root.entry("grasps"))
      faults_.add(match->mark, "approach.final_rates.match needs 'grasps': there is no motion to match");
    if (approach_.tracking.noise) {
      const Field& position = *field_named(type_of<TrackingNoise>(), "position");
      check_units(part(part(part(node_, "tracking"), "noise"), "position"), position.unit,
                  "approach.tracking.noise.position", robot_, faults_);
    }
    const Node& waypoints = part(node_, "waypoints");
    for (std::size_t i = 0; i < waypoints.items.size() && !faults_.full(); ++i)
      check_places(part(waypoints.items[i], "end_effectors"), item("approach.waypoints", i));
  }

 private:
  void read_samples(const TrajectoryFile& file) {
    std::optional<SampledMotion> motion = read_trajectory(file, robot_, faults_);
    if (!motion) return;
    end_at(motion->times.back(), "the trajectory ends");
    const auto first_of = [](const std::vector<std::vector<double>>& series) {
      std::vector<double> first;
      first.reserve(series.size());
      for (const std::vector<double>& one : series) first.push_back(one.front());
      return first;
    };
    begin_with(first_of(motion->positions), first_of(motion->rates), "the trajectory starts");
    approach_.sampled = std::move(*motion);
  }

  void follow_pieces(const Node& list) {
    if (!PiecesCheck(approach_.pieces, reading_).check(list)) return;
    end_at(approach_.pieces.back().until, "the pieces end");
    std::vector<double> position, rate;
    for (std::size_t j = 0; j < robot_.joints.size(); ++j) {
      const JointPoint first = evaluate(trajectory_of({approach_.pieces.data(), 1}, j), 0);
      position.push_back(first.position), rate.push_back(first.rate);
    }
    begin_with(position, rate, "the pieces start");
  }

  // The duration of a stated motion.
  void end_at(double end, std::string_view source) {
    if (node_.find("duration") && std::abs(approach_.duration - end) > kSameDuration * end) {
      faults_.add(part(node_, "duration").mark,
                  fmt::format("approach.duration is {} [s], but {} at {}; make them agree or leave out the duration",
                              approach_.duration, source, end));
    }
    approach_.duration = end;
  }

  // The initial joint values and rates of a stated motion; rates may come from a spline.
  void begin_with(const std::vector<double>& position, const std::vector<double>& rate, const std::string& source) {
    const bool ideal = approach_.tracking.mode == JointControl::prescribed;
    const Node& initial = part(reading_.root, "initial");
    const Node *joints = initial.find("joints"), *rates = initial.find("joint_rates");
    if (joints) check_agreement(*joints, "initial.joints", robot_, {position, kSameMotion, source + " at"}, faults_);
    if (rates && ideal && rate.empty() && !robot_.joints.empty()) {
      faults_.add(initial.entry("joint_rates")->mark,
                  "initial.joint_rates: with ideal tracking the joints start with the trajectory's rates; leave out "
                  "joint_rates");
    } else if (rates && ideal) {
      check_agreement(*rates, "initial.joint_rates", robot_, {rate, kSameMotion, source + " with"}, faults_);
    }
    // Joints with ideal tracking start exactly on the stated motion.
    if (!joints || ideal) reading_.problem.joint_position = position;
    if (!rates || ideal) reading_.problem.joint_rate = rate;
  }

  // Names of end-effectors and targets in a waypoint.
  void check_places(const Node& places, const std::string& waypoint) {
    const std::string path = below(waypoint, "end_effectors");
    for (const NodeEntry& place : places.entries) {
      robot_.end_effectors.expect(place.key, place.mark, path, faults_);
      const Node& target = part(place.value, "target");
      reading_.targets.expect(text_at(place.value, "target"), target.mark, below(path, shortened(place.key)), faults_);
    }
  }

  const Node& node_;
  Reading& reading_;
  const ReadRobot& robot_;
  FaultList& faults_;
  ApproachSetup& approach_;
};

}  // namespace

void finish_approach(const TrajectoryFile* file, Reading& reading) {
  if (reading.problem.approach) ApproachReader(reading).finish(file);
}

}  // namespace grapnel
