#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "grapnel/scenario/joint_values.hpp"
#include "grapnel/scenario/sections.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel {

// ---- What "approach" holds ----

template <>
struct Described<JointControl> {
  // The laws that have a name in files.
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
      field<&T::kind>(
          "modulation", "",
          "pulse_width: each fires in every period of the control clock for the time that gives what is asked "
          "for on the average. schmitt: each is on or off, with hysteresis; without a control clock at any "
          "time."),
      field<&T::level_on>("level_on", "1",
                          "Share of the least time on (pulse_width, where less is asked for) or of the force (schmitt) "
                          "from which on a thruster is on.")
          .above(0)
          .at_most(1),
      field<&T::level_off>("level_off", "1", "Share down to which it stays on; less than level_on.")
          .at_least(0)
          .at_most(1),
  });
  static constexpr Type type = structure<T>("thruster_modulation", "How thrusters give what is asked for.", fields);
};

template <>
struct Described<MomentumDumping> {
  using T = MomentumDumping;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::above>("above", "N m s", "Size of the wheels' momentum at which it begins.").above(0).required(),
      field<&T::below>("below", "N m s", "Size at which it ends; less than above.").at_least(0).required(),
      field<&T::torque>("torque", "N m", "Of the thrusters, on the average of a period.").above(0).required(),
  });
  static constexpr Type type = structure<T>(
      "momentum_dumping",
      "Thrusters take out the wheels' momentum, against it, while the wheels counter their torque and slow down.",
      fields);
};

template <>
struct Described<GyroSteering> {
  using T = GyroSteering;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::near>(
          "near", "1",
          "Singularity measure below which the array counts as near a singularity, and its rates are damped.")
          .above(0)
          .up_to(1000),
      field<&T::damping>("damping", "1", "Of the rates, at a singularity.").above(0).up_to(1000),
      field<&T::dither>("dither", "1", "Of the damping, which turns the gimbals out of a singularity; 0: none.")
          .at_least(0)
          .up_to(0.49),
  });
  static constexpr Type type =
      structure<T>("gyro_steering", "How gimbal rates are found near singular configurations.", fields);
};

template <>
struct Described<BaseControlSetup> {
  using T = BaseControlSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::actuators>(
          "actuators", "",
          "What gives the torque. wheels: the robot's reaction wheels; gyros: its control moment gyros; thrusters: its "
          "thrusters; outside: something that takes its momentum out of the system. Absent: the wheels, if the robot "
          "has any, else its gyros, else outside.")
          .optional(),
      field<&T::kp>("kp", "N m/rad", "Proportional gain.").at_least(0).as("axis gains").required(),
      field<&T::kd>("kd", "N m s/rad", "Derivative gain.").at_least(0).as("axis gains").required(),
      field<&T::limit>("limit", "N m", "Largest torque about each axis; absent: none.")
          .above(0)
          .as("axis gains")
          .optional(),
      field<&T::R_WD>("quaternion_wxyz", "",
                      "Desired attitude in W; absent, as rpy: the attitude at the phase's start.")
          .as("quaternion")
          .optional(),
      field<&T::R_WD>("rpy", "rad", "Desired attitude in W, in place of quaternion_wxyz.").as("rpy").optional(),
      field<&T::feedforward>("feedforward", "",
                             "Whether the torque that the joints' motion takes is added, as the model knows it, within "
                             "limit."),
      field<&T::wheel_speed_rate>(
          "wheel_speed_rate", "1/s",
          "At which the wheels' rates go to wheel_speeds, as far as that gives no torque on the "
          "base; 0: they do not.")
          .at_least(0),
      field<&T::wheel_speeds>("wheel_speeds", "rad/s",
                              "Per wheel; absent: zero, so that the wheels' momenta become least.")
          .plausible_to(kFastestRotor)
          .optional(),
      field<&T::modulation>("thrusters", "", "How thrusters give what is asked for.").optional(),
      field<&T::dumping>("dumping", "", "Thrusters take out the wheels' momentum; absent: they do not.").optional(),
      field<&T::steering>("steering", "", "How control moment gyros give what is asked for.").optional(),
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
      field<&T::bandwidth>("bandwidth", "Hz", "Highest frequency.").above(0),
      field<&T::seed>("seed", "", kSeedText).at_least(0).at_most(kLargestWhole),
  });
  static constexpr Type type =
      structure<T>("noise",
                   "What the joints' sensors misread: smooth, nearly Gaussian, the same for the same seed; joints with "
                   "ideal tracking follow the reference less this noise.",
                   fields);
};

template <>
struct Described<TrackingSetup> {
  using T = TrackingSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::mode>(
          "mode", "",
          "ideal: the joints follow the profile exactly. pd: joint torques by the law (4.1). "
          "computed_torque: torques that the model asks for, the errors decaying with the gains. controller: "
          "torques that control.plugin says. impedance: the hands go to their grasp points by the law of impedance, "
          "straight in the targets' frames along the profile."),
      field<&T::kp>("kp", "N m/rad or N/m; for computed_torque 1/s^2",
                    "Proportional gain, for modes pd and computed_torque, and of pd where impedance is over; ignored "
                    "otherwise.")
          .at_least(0)
          .as("gains of tracking")
          .optional()
          .when<[](const T& t) { return has_gains(t.mode); }>(),
      field<&T::kd>("kd", "N m s/rad or N s/m; for computed_torque 1/s", "Derivative gain, likewise.")
          .at_least(0)
          .as("gains of tracking")
          .optional()
          .when<[](const T& t) { return has_gains(t.mode); }>(),
      field<&T::noise>("noise", "", "").optional(),
  });
  static constexpr auto rules = std::to_array<Rule>({when("mode", "pd, computed_torque, impedance").require("kp, kd")});
  static constexpr Type type = structure<T>("tracking", "", fields, rules);
};

template <>
struct Described<PlanWeights> {
  using T = PlanWeights;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::excursion>("excursion", "1/rad^2", "Of the joints' ways.").at_least(0),
      field<&T::nearest>("nearest", "1/rad^2", "Of the distance from guess.").at_least(0),
      field<&T::limits>("limits", "1", "Of the distance from the middle of the joints' ranges.").at_least(0),
      field<&T::manipulability>("manipulability", "1", "Of minus the manipulability of the arms.").at_least(0),
      field<&T::effort>("effort", "1/(N m)^2", "Of half the mean square of the joints' efforts.").at_least(0),
      field<&T::base_attitude>("base_attitude", "1/rad^2", "Of half the square of the base's turn at the capture.")
          .at_least(0),
      field<&T::base_motion>("base_motion", "1/rad^2",
                             "Of half the mean square of the base's angular velocity, times "
                             "the square of the segment's duration.")
          .at_least(0),
      field<&T::clearance>("clearance", "1/m", "Of minus the minimum clearance on the way.").at_least(0),
      field<&T::impulse>("impulse", "1/J",
                         "Of the capture's impulses: the energy that each of them alone would give the free target.")
          .at_least(0),
      field<&T::impulse_index>("impulse_index", "1",
                               "Of what relative motions at the grasps bring, against an immovable robot, on the mean "
                               "of their directions.")
          .at_least(0),
      field<&T::wheel_momentum>("wheel_momentum", "1",
                                "Of half the mean of the sum of squares of the wheels' momenta over the most that they "
                                "can hold, while they keep the base's attitude.")
          .at_least(0),
  });
  static constexpr Type type = structure<T>(
      "weights", "Weights of objectives, the sum of which is minimized; those left out count nothing.", fields);
};

template <>
struct Described<CaptureWindow> {
  using T = CaptureWindow;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::earliest>("earliest", "s", "First time of capture that is looked at.").above(0).required(),
      field<&T::latest>("latest", "s", "Last one; after earliest.").above(0).required(),
      field<&T::step>("step", "s", "Between the times that are looked at; 0: a fiftieth of the window.").at_least(0),
      field<&T::choose>("choose", "",
                        "objective: the time whose plan has the least objective. soonest: the first time that can be "
                        "reached. slowest: the time at which the grasp points move slowest against the servicer's "
                        "centre of mass."),
  });
  static constexpr Type type =
      structure<T>("window", "The time of capture, the approach's duration, is looked for between two times.", fields);
};

template <>
struct Described<PlanSetup> {
  using T = PlanSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::objective>(
          "objective", "",
          "What is minimized among the solutions. excursion: the joints' ways. nearest: the distance from "
          "guess. limits: the distance from the middle of the joints' ranges. manipulability: minus the "
          "manipulability of the arms. as_found: nothing; the first solution from the guess is taken. effort: squares "
          "of the joints' efforts on the way. base_attitude: the base's turn at the capture. base_motion: squares of "
          "the base's angular velocity on the way. clearance: minus the minimum clearance on the way. impulse: the "
          "impulses of the capture, as of rigid grasps. impulse_index: what any relative motion there would bring."),
      field<&T::weights>("weights", "", "").optional(),
      field<&T::guess>("guess", "rad or m",
                       "Every moving joint's value where the search begins; absent: the initial values.")
          .as("joint values")
          .optional(),
      field<&T::starts>("starts", "",
                        "At most so many initial guesses of the search; the guess is the first, the others are random.")
          .at_least(1)
          .at_most(1000),
      field<&T::seed>("seed", "", kSeedText).at_least(0).at_most(kLargestWhole),
      field<&T::max_evaluations>(
          "max_evaluations", "",
          "Where planning gives up: evaluations of the servicer's kinematics and momentum, over the whole approach.")
          .at_least(1)
          .at_most(1000000000000),
      field<&T::limits>("limits", "",
                        "Where the joints' limits hold on the last segment that is planned. at_end: positions and "
                        "rates at its end. on_the_way: positions, rates and efforts all the way."),
      field<&T::clearance>("clearance", "m",
                           "Least distance, all the way, of the bodies that clearance watches, an end-effector and its "
                           "own target included until it is near the grasp point; absent: not looked at.")
          .at_least(0)
          .optional(),
      field<&T::near_grasp>("near_grasp", "m",
                            "Distance of its end-effector from the grasp point within which a hand may touch its "
                            "target; absent: as far as the hand reaches, and clearance.")
          .at_least(0)
          .optional(),
      field<&T::base_turn>("base_turn", "rad",
                           "Largest turn of the base from its initial attitude, all the way; absent: any.")
          .above(0)
          .optional(),
      field<&T::wheel_momentum>(
          "wheel_momentum", "1",
          "Largest share of the momentum that it can hold (moment of inertia times largest rate), "
          "all the way, of each wheel that keeps the base's attitude; absent: any.")
          .above(0)
          .at_most(1)
          .optional(),
      field<&T::knots>(
          "knots", "",
          "Inner knots of splines that give the joints more freedom on the way than one polynomial; "
          "absent: none, and where limits, clearance, base_turn or wheel_momentum are not kept without, 4.")
          .at_least(0)
          .at_most(30)
          .optional(),
      field<&T::idle_joints>("idle_joints", "",
                             "Joints that move no grasping end-effector. used: they move where that makes the "
                             "objective less. held: they end where they began, at rest."),
  });
  static constexpr auto rules = std::to_array<Rule>({
      when("objective", "nearest").require("guess"),
      not_both("objective, weights"),
      needs("near_grasp", "clearance"),
  });
  static constexpr Type type = structure<T>("plan",
                                            "Final joint values are looked for: those with which the "
                                            "momentum-conserving motion brings every end-effector to its grasp point.",
                                            fields, rules);
};

template <>
struct Described<MotionPiece> {
  using T = MotionPiece;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::until>("until", "s", "Its end, from the start of the approach.").above(0).required(),
      field<&T::series>("series", "rad or m",
                        "Every moving joint's coefficients in Chebyshev polynomials of the first kind of x, which goes "
                        "from -1 to 1 over the piece.")
          .as("series by joint")
          .required(),
  });
  static constexpr Type type =
      structure<T>("piece", "The joints' motion from the end of the piece before, the first from t = 0.", fields);
};

template <>
struct Described<Waypoint::Place> {
  using T = Waypoint::Place;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::position>("position", "m", "Of the end-effector's origin, in the target's frame or in W.")
          .up_to(1e+09)
          .required(),
      field<&T::target>("target", "", "Whose frame position and velocity are in; absent: W.").optional(),
      field<&T::velocity>("velocity", "m/s", "Of the end-effector's origin, relative to that frame; absent: zero.")
          .optional(),
  });
  static constexpr Type type = structure<T>("place", "", fields);
};

template <>
struct Described<Waypoint> {
  using T = Waypoint;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::time>("time", "s", "From the start of the approach; before its end.").above(0).required(),
      field<&T::joints>("joints", "rad or m", "Every moving joint's value.").as("joint values").optional(),
      field<&T::rates>("rates", "rad/s or m/s",
                       "Joint rates; joints left out of a mapping are at rest. Absent: all at rest.")
          .as("joint values")
          .optional(),
      field<&T::places>("end_effectors", "", "Where end-effectors are to be; others are free.")
          .as("places by end-effector")
          .items(1, 0)
          .optional(),
  });
  static constexpr auto rules = std::to_array<Rule>({
      one_of("joints, end_effectors"),
      needs("rates", "joints"),
  });
  static constexpr Type type = structure<T>(
      "waypoint",
      "Joint values, or places of end-effectors for which joint values are looked for, at an instant of the approach.",
      fields, rules);
};

template <>
struct Described<StraightIn> {
  using T = StraightIn;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::stand_off>("stand_off", "m",
                           "Distance from the grasp point at which it begins, at rest relative to the target.")
          .above(0)
          .required(),
      field<&T::duration>("duration", "s", "Of this piece, at the end of the approach.").above(0).required(),
      field<&T::final_speed>("final_speed", "m/s", "Towards the grasp point, relative to it, at the end.").at_least(0),
      field<&T::roll>("roll", "",
                      "Of an end-effector about its approach direction, against its target. free: as the joints move "
                      "least. matched: it turns as the target does."),
  });
  static constexpr Type type = structure<T>(
      "straight_in",
      "The last piece of way is straight in the target's frame, along the approach direction of each grasp point.",
      fields);
};

template <>
struct Described<ApproachSetup> {
  using T = ApproachSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::duration>(
          "duration", "s",
          "T. With a trajectory or pieces it may be left out: then it is their end. With window it is looked for.")
          .above(0)
          .optional(),
      field<&T::window>("window", "", "").optional(),
      field<&T::profile>("profile", "", "Joint motion over time; quartic is the thesis's (3.1)."),
      field<&T::final_position>("final_joints", "rad or m", "Every moving joint's value at the end.")
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
                        "one before ends.")
          .items(1, 10000)
          .optional(),
      field<&T::final_rates>("final_rates", "rad/s or m/s",
                             "Joint rates at the end: given (joints left out of a mapping end at rest), or matched to "
                             "the motion of the grasp points. Absent: all at rest; with plan: {match: twist}.")
          .as("final rates")
          .optional(),
      field<&T::tracking>("tracking", "", ""),
      field<&T::waypoints>("waypoints", "", "Places to pass on the way, in the order of time.").items(0, 1000),
      field<&T::straight_in>("straight_in", "", "").optional(),
      field<&T::base_control>(&base_control_description, "base_control", "").optional(),
      field<&T::capture_at>(
          "capture_at", "",
          "When the grasps close that have no time of their own. end: at the end of the approach. envelope: as soon as "
          "each of their end-effectors is within its envelope, at the end at the latest."),
      field<&T::replan>(&replan_description, "replan", "").optional(),
  });
  static constexpr auto rules = std::to_array<Rule>({
      one_of("final_joints, plan, trajectory, pieces"),
      needs("final_joints", "duration"),
      when("plan").require_one_of("duration, window"),
      needs("window", "plan"),
      needs("straight_in", "plan"),
      when("trajectory").forbid("profile, waypoints", "the file says where the joints are at all times"),
      when("trajectory").forbid("final_rates", "the rates at the end follow from the file"),
      when("pieces").forbid("profile, waypoints", "they say where the joints are at all times"),
      when("pieces").forbid("final_rates", "the rates at the end follow from them"),
      when("straight_in").forbid("final_rates", "the rates follow from straight_in"),
  });
  static constexpr Type type =
      structure<T>("approach", "The motion from the initial joint values to the capture.", fields, rules);
};

const Type& approach_description() { return type_of<std::optional<ApproachSetup>>(); }
const Type& base_control_description() { return type_of<std::optional<BaseControlSetup>>(); }

// ---- How it is read ----

namespace {

// How well a stated motion must agree with what is also said elsewhere, and each piece with the one before.
constexpr double kSameDuration = 1e-9;  // relative
constexpr double kSameMotion = 1e-6;    // [rad or m; rad/s or m/s]

// Whether a motion stated piece by piece is one motion.
class PiecesCheck {
 public:
  PiecesCheck(const std::vector<MotionPiece>& pieces, Reading& reading)
      : pieces_(pieces), reading_(reading), ends_(reading.robot.joints.size()) {}

  // False where faults leave the motion in doubt.
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
      check_meeting(
          begin, i, j, nodes[j]->mark,
          fmt::format("{}.series of joint {}", item("approach.pieces", i), in_quotes(reading_.robot.joints[j].name)));
    }
    return true;
  }

  // A jump would be an impulse from nowhere.
  void check_meeting(double begin, std::size_t i, std::size_t joint, const Mark& mark, const std::string& name) {
    const MotionPiece& piece = pieces_[i];
    JointTrajectory trajectory;
    trajectory.pieces.push_back({begin, piece.until, ChebyshevPiece{piece.series[joint]}});
    const JointPoint first = evaluate(trajectory, begin), last = evaluate(trajectory, piece.until);
    JointPoint& before = ends_[joint];
    for (const double x : {first.position, first.rate, last.position, last.rate}) {
      if (std::isfinite(x)) continue;
      reading_.faults.add(mark, name + " gives positions or rates that no number can hold");
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
    reading_.faults.add(mark, fmt::format("{} begins {} {}, but the piece before ends {} {}; make them agree within {}",
                                          name, what, here, what, before, kSameMotion));
  }

  const std::vector<MotionPiece>& pieces_;
  Reading& reading_;
  std::vector<JointPoint> ends_;  // per joint: of the piece before
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
    // Until a time has been chosen the approach is as long as it can become.
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

  // The initial joint values and rates of a stated motion; it may have left the rates to a spline.
  void begin_with(const std::vector<double>& position, const std::vector<double>& rate, const std::string& source) {
    const bool ideal = approach_.tracking.mode == JointControl::prescribed;
    const Node& initial = part(reading_.root, "initial");
    const Node *joints = initial.find("joints"), *rates = initial.find("joint_rates");
    if (joints) check_agreement(*joints, "initial.joints", robot_, position, kSameMotion, source + " at", faults_);
    if (rates && ideal && rate.empty() && !robot_.joints.empty()) {
      faults_.add(initial.entry("joint_rates")->mark,
                  "initial.joint_rates: with ideal tracking the joints start with the trajectory's rates; leave out "
                  "joint_rates");
    } else if (rates && ideal) {
      check_agreement(*rates, "initial.joint_rates", robot_, rate, kSameMotion, source + " with", faults_);
    }
    // Joints that follow exactly are on the stated motion from the start, to the last bit.
    if (!joints || ideal) reading_.problem.joint_position = position;
    if (!rates || ideal) reading_.problem.joint_rate = rate;
  }

  // Names of the places that a waypoint is given by.
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
