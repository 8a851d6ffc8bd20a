#include <algorithm>
#include <stdexcept>

#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/scenario/descriptions.hpp"

namespace grapnel {
namespace {

// Mappings of files that hold some members of a structure.
struct InitialBaseKeys;
struct InitialKeys;
struct TargetStateKeys;
struct OutputKeys;

}  // namespace

template <>
struct Described<TargetSetup::Instant> {
  static constexpr auto choices = std::to_array<Choice>({
      choice(TargetSetup::Instant::start, "start"),
      choice(TargetSetup::Instant::capture, "capture"),
  });
  static constexpr Type type = enumeration<TargetSetup::Instant>("Instant", choices);
};

template <>
struct Described<GraspModel> {
  static constexpr auto choices = std::to_array<Choice>({
      choice(GraspModel::rigid, "rigid"),
      choice(GraspModel::hinge, "hinge"),
      choice(GraspModel::point, "point"),
  });
  static constexpr Type type = enumeration<GraspModel>("GraspModel", choices);
};

template <>
struct Described<GraspSetup::Orientation> {
  static constexpr auto choices = std::to_array<Choice>({
      choice(GraspSetup::Orientation::free, "free"),
      choice(GraspSetup::Orientation::axis, "axis"),
      choice(GraspSetup::Orientation::pose, "pose"),
  });
  static constexpr Type type = enumeration<GraspSetup::Orientation>("Orientation", choices);
};

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
struct Described<PlanSetup::Measure> {
  static constexpr auto choices = std::to_array<Choice>({
      choice(PlanSetup::Measure::excursion, "excursion"),
      choice(PlanSetup::Measure::nearest, "nearest"),
      choice(PlanSetup::Measure::limits, "limits"),
      choice(PlanSetup::Measure::manipulability, "manipulability"),
      choice(PlanSetup::Measure::as_found, "as_found"),
  });
  static constexpr Type type = enumeration<PlanSetup::Measure>("Measure", choices);
};

template <>
struct Described<JointProfile> {
  static constexpr auto choices = std::to_array<Choice>({
      choice(JointProfile::quartic, "quartic"),
      choice(JointProfile::cycloidal, "cycloidal"),
      choice(JointProfile::quintic, "quintic"),
  });
  static constexpr Type type = enumeration<JointProfile>("JointProfile", choices);
};

template <>
struct Described<RateMatch> {
  static constexpr auto choices = std::to_array<Choice>({
      choice(RateMatch::velocity, "velocity"),
      choice(RateMatch::twist, "twist"),
      choice(RateMatch::velocity_least_rates, "velocity_least_rates"),
  });
  static constexpr Type type = enumeration<RateMatch>("RateMatch", choices);
};

template <>
struct Described<ApproachSetup::CaptureAt> {
  static constexpr auto choices = std::to_array<Choice>({
      choice(ApproachSetup::CaptureAt::end, "end"),
      choice(ApproachSetup::CaptureAt::envelope, "envelope"),
  });
  static constexpr Type type = enumeration<ApproachSetup::CaptureAt>("CaptureAt", choices);
};

template <>
struct Described<ContactSetup::Gap> {
  static constexpr auto choices = std::to_array<Choice>({
      choice(ContactSetup::Gap::weld_as_found, "weld_as_found"),
      choice(ContactSetup::Gap::translate_target, "translate_target"),
      choice(ContactSetup::Gap::refuse, "refuse"),
  });
  static constexpr Type type = enumeration<ContactSetup::Gap>("Gap", choices);
};

template <>
struct Described<ContactForceModel> {
  static constexpr auto choices = std::to_array<Choice>({
      choice(ContactForceModel::kelvin_voigt, "kelvin_voigt"),
      choice(ContactForceModel::hertz, "hertz"),
      choice(ContactForceModel::hunt_crossley, "hunt_crossley"),
  });
  static constexpr Type type = enumeration<ContactForceModel>("ContactForceModel", choices);
};

template <>
struct Described<ImpactSetup::Law> {
  static constexpr auto choices = std::to_array<Choice>({
      choice(ImpactSetup::Law::plastic, "plastic"),
      choice(ImpactSetup::Law::bilateral_restitution, "bilateral_restitution"),
      choice(ImpactSetup::Law::restitution, "restitution"),
      choice(ImpactSetup::Law::friction, "friction"),
      choice(ImpactSetup::Law::compliant, "compliant"),
      choice(ImpactSetup::Law::as_published, "as_published"),
  });
  static constexpr Type type = enumeration<ImpactSetup::Law>("Law", choices);
};

template <>
struct Described<ImpactSetup::Joints> {
  static constexpr auto choices = std::to_array<Choice>({
      choice(ImpactSetup::Joints::free, "free"),
      choice(ImpactSetup::Joints::braked, "braked"),
      choice(ImpactSetup::Joints::driven, "driven"),
  });
  static constexpr Type type = enumeration<ImpactSetup::Joints>("Joints", choices);
};

template <>
struct Described<RestitutionHypothesis> {
  static constexpr auto choices = std::to_array<Choice>({
      choice(RestitutionHypothesis::stronge, "stronge"),
      choice(RestitutionHypothesis::poisson, "poisson"),
      choice(RestitutionHypothesis::newton, "newton"),
  });
  static constexpr Type type = enumeration<RestitutionHypothesis>("RestitutionHypothesis", choices);
};

template <>
struct Described<PostImpactSetup::Joints> {
  static constexpr auto choices = std::to_array<Choice>({
      choice(PostImpactSetup::Joints::free, "free"),
      choice(PostImpactSetup::Joints::pd, "pd"),
      choice(PostImpactSetup::Joints::braked, "braked"),
  });
  static constexpr Type type = enumeration<PostImpactSetup::Joints>("Joints", choices);
};

template <>
struct Described<LoadProfile::Shape> {
  static constexpr auto choices = std::to_array<Choice>({
      choice(LoadProfile::Shape::constant, "constant"),
      choice(LoadProfile::Shape::half_sine, "half_sine"),
      choice(LoadProfile::Shape::sine, "sine"),
      choice(LoadProfile::Shape::table, "table"),
  });
  static constexpr Type type = enumeration<LoadProfile::Shape>("Shape", choices);
};

template <>
struct Described<IntegrationSetup::Method> {
  static constexpr auto choices = std::to_array<Choice>({
      choice(IntegrationSetup::Method::adaptive_8, "adaptive_8"),
      choice(IntegrationSetup::Method::rk4, "rk4"),
  });
  static constexpr Type type = enumeration<IntegrationSetup::Method>("Method", choices);
};

template <>
struct Described<IntegrationSetup::RootVelocity> {
  static constexpr auto choices = std::to_array<Choice>({
      choice(IntegrationSetup::RootVelocity::recovered, "recovered"),
      choice(IntegrationSetup::RootVelocity::integrated, "integrated"),
  });
  static constexpr Type type = enumeration<IntegrationSetup::RootVelocity>("RootVelocity", choices);
};

template <>
struct Described<IntegrationSetup::Loops> {
  static constexpr auto choices = std::to_array<Choice>({
      choice(IntegrationSetup::Loops::projection, "projection"),
      choice(IntegrationSetup::Loops::baumgarte, "baumgarte"),
      choice(IntegrationSetup::Loops::acceleration, "acceleration"),
      choice(IntegrationSetup::Loops::open, "open"),
  });
  static constexpr Type type = enumeration<IntegrationSetup::Loops>("Loops", choices);
};

template <>
struct Described<Momentumd> {
  using T = Momentumd;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::linear>("linear", "kg m/s", "In W."),
      field<&T::angular>("angular", "kg m^2/s", "About the robot's centre of mass, in W."),
  });
  static constexpr Type type = structure<T>(
      "momentum", "The robot's total momentum, in place of the base's velocities, which follow from it.", fields);
};

template <>
struct Described<InitialBaseKeys> {
  using T = CaptureProblem;
  static constexpr auto fields = std::to_array<Field>({
      found<[](T& t) -> Vector3d& { return t.X_WB.p; }>("position", "m", "Of the base frame's origin.").up_to(1e+09),
      found<[](T& t) -> Rotationd& { return t.X_WB.R; }>(
          "quaternion_wxyz", "",
          "Unit quaternion w, x, y, z; normalised if its length is within 1e-6 of 1, refused otherwise.")
          .as("quaternion")
          .optional(),
      found<[](T& t) -> Rotationd& { return t.X_WB.R; }>(
          "rpy", "rad", "Roll, pitch, yaw about fixed axes: Rz(yaw) Ry(pitch) Rx(roll), as in URDF.")
          .as("rpy")
          .optional(),
      found_if<[](T& t) { return t.V_WB ? &t.V_WB->angular : nullptr; }>("angular_velocity", "rad/s",
                                                                         "Of the base, in W; absent: zero.")
          .optional(),
      found_if<[](T& t) { return t.V_WB ? &t.V_WB->linear : nullptr; }>(
          "velocity", "m/s", "Of the base frame's origin, in W; absent: zero.")
          .optional(),
      field<&T::momentum>("momentum", "", "").optional(),
  });
  static constexpr auto rules = std::to_array<Rule>({
      not_both("quaternion_wxyz, rpy"),
      not_both("momentum, angular_velocity"),
      not_both("momentum, velocity"),
  });
  static constexpr Type type = structure<T>("initial_base", "", fields, rules);
};

template <>
struct Described<InitialKeys> {
  using T = CaptureProblem;
  static constexpr auto fields = std::to_array<Field>({
      group<T, InitialBaseKeys>("base", ""),
      field<&T::joint_position>("joints", "rad or m",
                                "Every moving joint's value; needed unless the robot has none or approach.trajectory "
                                "or approach.pieces say it.")
          .as("joint values")
          .optional(),
      field<&T::joint_rate>("joint_rates", "rad/s or m/s",
                            "Joint rates; joints left out of a mapping are at rest. Absent: those of "
                            "approach.trajectory or approach.pieces, else all at rest.")
          .as("joint values")
          .optional(),
  });
  static constexpr Type type = structure<T>(
      "initial", "The state at t = 0. With no approach it is the state at the instant of capture.", fields);
};

template <>
struct Described<GraspPoint> {
  using T = GraspPoint;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::name>("name", "", "").required(),
      found<[](T& t) -> Vector3d& { return t.X_TG.p; }>("position", "m", "In the target's frame."),
      found<[](T& t) -> Rotationd& { return t.X_TG.R; }>(
          "quaternion_wxyz", "",
          "Unit quaternion w, x, y, z; normalised if its length is within 1e-6 of 1, refused otherwise.")
          .as("quaternion")
          .optional(),
      found<[](T& t) -> Rotationd& { return t.X_TG.R; }>(
          "rpy", "rad", "Roll, pitch, yaw about fixed axes: Rz(yaw) Ry(pitch) Rx(roll), as in URDF.")
          .as("rpy")
          .optional(),
      field<&T::approach_direction>(
          "approach_direction", "",
          "Unit vector in the target's frame: the direction in which the end-effector comes in.")
          .as("unit vector")
          .optional(),
      field<&T::normal>("normal", "",
                        "Unit vector in the target's frame: the surface's outward normal, for grasps with model "
                        "contact. Absent: against the approach_direction, else that of a spherical target.")
          .as("unit vector")
          .optional(),
  });
  static constexpr auto rules = std::to_array<Rule>({
      not_both("quaternion_wxyz, rpy"),
  });
  static constexpr Type type = structure<T>("grasp_point", "", fields, rules);
};

template <>
struct Described<TargetStateKeys> {
  using T = TargetSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::given_at>(
          "at", "",
          "When it holds: at t = 0 or at the instant of capture. The target moves free of torque in between."),
      found<[](T& t) -> Vector3d& { return t.X_WT.p; }>("position", "m", "Of the target frame's origin, in W.")
          .up_to(1e+09)
          .required(),
      found<[](T& t) -> Rotationd& { return t.X_WT.R; }>(
          "quaternion_wxyz", "",
          "Unit quaternion w, x, y, z; normalised if its length is within 1e-6 of 1, refused otherwise.")
          .as("quaternion")
          .optional(),
      found<[](T& t) -> Rotationd& { return t.X_WT.R; }>(
          "rpy", "rad", "Roll, pitch, yaw about fixed axes: Rz(yaw) Ry(pitch) Rx(roll), as in URDF.")
          .as("rpy")
          .optional(),
      found<[](T& t) -> Vector3d& { return t.V_WT.angular; }>("angular_velocity", "rad/s", "In W."),
      found<[](T& t) -> Vector3d& { return t.V_WT.linear; }>("velocity", "m/s", "Of the target frame's origin, in W."),
  });
  static constexpr auto rules = std::to_array<Rule>({
      not_both("quaternion_wxyz, rpy"),
  });
  static constexpr Type type = structure<T>("target_state", "", fields, rules);
};

template <>
struct Described<TargetSetup> {
  using T = TargetSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::name>("name", "", "").required(),
      field<&T::mass>("mass", "kg", "").above(0).required(),
      field<&T::inertia>("inertia", "kg m^2",
                         "Inertia about the centre of mass, in the body's axes. Ixy is the tensor's component: minus "
                         "the integral of x y dm.")
          .as("inertia")
          .required(),
      field<&T::com>("com", "m", "Centre of mass in the body's frame."),
      field<&T::geometry>(&geometry_description, "geometry", "").optional(),
      group<T, TargetStateKeys>("state", "").required(),
      field<&T::grasp_points>("grasp_points", "", "Named frames on the target where an end-effector can hold it."),
  });
  static constexpr Type type = structure<T>("target", "", fields);
};

template <>
struct Described<GraspSetup> {
  using T = GraspSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::end_effector>("end_effector", "", "").required(),
      field<&T::target>("target", "", "").required(),
      field<&T::grasp_point>("point", "", "Name of a grasp point of that target.").required(),
      field<&T::model>("model", "",
                       "rigid: holds position and the orientation found at contact. hinge: leaves one rotation free. "
                       "point: holds the position. contact: no grip; it touches and is thrown back, by impact.law "
                       "restitution, friction or compliant.")
          .as("one of rigid, hinge, point, contact")
          .by_default("\"rigid\""),
      field<&T::hinge_axis>("axis", "", "Unit vector of a hinge in the end-effector's frame; ignored by other models.")
          .as("unit vector")
          .optional(),
      field<&T::orientation>("orientation", "",
                             "What the end-effector's orientation at the grasp is to be. free: any. axis: its "
                             "approach_axis along the grasp point's approach_direction. pose: its frame that of the "
                             "grasp point. Absent: axis if the grasp point has an approach_direction, else free.")
          .optional(),
      field<&T::closes_at>(
          "closes_at", "s",
          "When it closes, from the start of the scenario; absent: with the others, when the approach ends.")
          .above(0)
          .optional(),
      key<bool>("closes_on_arrival", "",
                "true: it closes as soon as its end-effector is within its envelope, in the approach or after it.")
          .by_default("false"),
      field<&T::relative_velocity>("relative_velocity", "m/s",
                                   "With which it is to arrive, end-effector minus grasp point, in W: added to what "
                                   "approach.final_rates matches. Absent: zero.")
          .optional(),
      field<&T::relative_angular_velocity>("relative_angular_velocity", "rad/s",
                                           "Likewise; needs final_rates {match: twist}.")
          .optional(),
  });
  static constexpr auto rules = std::to_array<Rule>({
      not_both("closes_at, closes_on_arrival"),
      when("model", "hinge").require("axis"),
  });
  static constexpr Type type = structure<T>("grasp", "", fields, rules);
};

template <>
struct Described<BaseControlSetup> {
  using T = BaseControlSetup;
  static constexpr auto fields = std::to_array<Field>({
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
  });
  static constexpr auto rules = std::to_array<Rule>({
      not_both("quaternion_wxyz, rpy"),
  });
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
      field<&T::seed>("seed", "", "Of the random numbers; the same seed gives the same results.")
          .at_least(0)
          .at_most(9007199254740991),
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
      field<&T::mode>("mode", "",
                      "ideal: the joints follow the profile exactly. pd: joint torques by the law (4.1). "
                      "computed_torque: torques that the model asks for, the errors decaying with the gains."),
      field<&T::kp>("kp", "N m/rad or N/m; for computed_torque 1/s^2",
                    "Proportional gain, for modes pd and computed_torque; ignored otherwise.")
          .at_least(0)
          .as("gains")
          .optional(),
      field<&T::kd>("kd", "N m s/rad or N s/m; for computed_torque 1/s",
                    "Derivative gain, for modes pd and computed_torque; ignored otherwise.")
          .at_least(0)
          .as("gains")
          .optional(),
      field<&T::noise>("noise", "", "").optional(),
  });
  static constexpr auto rules = std::to_array<Rule>({
      when("mode", "pd, computed_torque").require("kp, kd"),
  });
  static constexpr Type type = structure<T>("tracking", "", fields, rules);
};

template <>
struct Described<PlanSetup> {
  using T = PlanSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::measure>("measure", "",
                         "What is least among the solutions. excursion: the joints' ways. nearest: the distance from "
                         "guess. limits: the distance from the middle of the joints' ranges. manipulability: minus the "
                         "manipulability of the arms. as_found: nothing; the first solution from the guess is taken."),
      field<&T::guess>("guess", "rad or m",
                       "Every moving joint's value where the search begins; absent: the initial values.")
          .as("joint values")
          .optional(),
      field<&T::starts>("starts", "",
                        "At most so many beginnings of the search; the guess is the first, the others are random.")
          .at_least(1)
          .at_most(1000),
      field<&T::seed>("seed", "", "Of the random numbers; the same seed gives the same results.")
          .at_least(0)
          .at_most(9007199254740991),
      field<&T::max_evaluations>(
          "max_evaluations", "",
          "Where planning gives up: evaluations of the servicer's kinematics and momentum, over the whole approach.")
          .at_least(1)
          .at_most(1000000000000),
  });
  static constexpr auto rules = std::to_array<Rule>({
      when("measure", "nearest").require("guess"),
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
      field<&T::duration>("duration", "s", "T. With a trajectory or pieces it may be left out: then it is their end.")
          .above(0)
          .optional(),
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
      field<&T::base_control>("base_control", "", "").optional(),
      field<&T::capture_at>(
          "capture_at", "",
          "When the grips close that have no time of their own. end: at the end of the approach. envelope: as soon as "
          "each of their end-effectors is within its envelope, at the end at the latest."),
  });
  static constexpr auto rules = std::to_array<Rule>({
      one_of("final_joints, plan, trajectory, pieces"),
      needs("final_joints", "duration"),
      needs("plan", "duration"),
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

template <>
struct Described<ContactSetup> {
  using T = ContactSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::gap>("gap", "",
                     "weld_as_found: the relative pose is kept. translate_target: the target is moved until its grasp "
                     "point is at the tip; with several grips by the mean of their gaps, what remains is kept. refuse: "
                     "the simulation fails beyond the limit."),
      field<&T::refuse_beyond>("limit", "m", "Largest accepted distance, for gap refuse; ignored otherwise.")
          .above(0)
          .optional(),
      field<&T::largest_gap>("largest_gap", "m",
                             "Across what distance an end-effector without an envelope may be taken to hold, after "
                             "gap; beyond it the run fails. Absent: a tenth of its arm's reach. any: whatever it is.")
          .above(0)
          .as("number or any")
          .optional(),
  });
  static constexpr auto rules = std::to_array<Rule>({
      when("gap", "refuse").require("limit"),
  });
  static constexpr Type type = structure<T>(
      "contact", "What to do about the distance between an end-effector and its grasp point at the instant of capture.",
      fields, rules);
};

template <>
struct Described<ContactComplianceSetup> {
  using T = ContactComplianceSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::model>("model", "",
                       "kelvin_voigt: k d + c d'. hertz: k d^1.5. hunt_crossley: k d^n (1 + a d'). Never negative."),
      field<&T::stiffness>("stiffness", "N/m, N/m^1.5 or N/m^n", "k.").above(0).required(),
      field<&T::damping>("damping", "N s/m, or s/m", "c, or a for hunt_crossley.").at_least(0),
      field<&T::exponent>("exponent", "", "n of hunt_crossley.").at_least(1).at_most(5),
      field<&T::slip_speed>("slip_speed", "m/s", "Below which friction is regularized.").above(0),
  });
  static constexpr Type type =
      structure<T>("contact_compliance", "Law compliant: normal force of contacts over the deformation d.", fields);
};

template <>
struct Described<GripComplianceSetup> {
  using T = GripComplianceSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::linear_stiffness>("linear_stiffness", "N/m", "").above(0).required(),
      field<&T::linear_damping>("linear_damping", "N s/m", "").at_least(0),
      field<&T::angular_stiffness>("angular_stiffness", "N m/rad", "").above(0).optional(),
      field<&T::angular_damping>("angular_damping", "N m s/rad", "").at_least(0),
  });
  static constexpr Type type = structure<T>(
      "grip_compliance", "Law compliant: spring and damper of grips, in every direction that they hold.", fields);
};

template <>
struct Described<ImpactSetup> {
  using T = ImpactSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::law>("law", "",
                     "plastic: grips; the grasped points move together afterwards. bilateral_restitution: grips throw "
                     "the relative velocity back, u+ = -E u-, and do not hold. restitution: contacts, without "
                     "friction. friction: contacts, with Coulomb's. compliant: grips and contacts resolved in time. "
                     "as_published: the thesis's (3.9)-(3.13), for comparison: momentum is not conserved."),
      field<&T::duration>("duration", "s", "Over which mean forces are taken; it has no influence on the motion.")
          .above(0),
      field<&T::joints>("joints", "",
                        "The robot's joints during the impact. Absent or free: driven by nothing (their rotors count). "
                        "braked: at rest from its first instant on. driven: they keep their rates, as with infinitely "
                        "heavy rotors, as far as the grasps allow; else drives give way as little as possible.")
          .optional(),
      field<&T::restitution>("restitution", "",
                             "e, of laws restitution and friction; of bilateral_restitution a number for all rows, or "
                             "one for linear and one for angular rows.")
          .at_least(0)
          .at_most(1)
          .as("restitution")
          .optional(),
      field<&T::hypothesis>("hypothesis", "",
                            "What e means (absent: stronge): the ratio of works (e^2), of normal impulses, or of "
                            "normal velocities. Newton's can create energy with friction; such a result is flagged.")
          .optional(),
      field<&T::friction>("friction", "", "Coulomb's coefficient; laws friction and compliant. Absent: 0.")
          .at_least(0)
          .optional(),
      field<&T::contact>("contact", "", "").optional(),
      field<&T::grip>("grip", "", "").optional(),
      found<[](T& t) -> double& { return t.compliant.longest; }>(
          "longest", "s",
          "Law compliant: the impact is over at the latest after this time (absent: 1 s); what relative motion a grip "
          "then has left is taken out at once.")
          .above(0)
          .optional(),
      found<[](T& t) -> double& { return t.compliant.settled; }>(
          "settled", "",
          "Law compliant: a grip is at rest when this fraction is left of the energy of its relative motion. Absent: "
          "1e-8.")
          .above(0)
          .at_most(0.1)
          .optional(),
  });
  static constexpr Type type = structure<T>("impact", "What happens when grasps close.", fields);
};

template <>
struct Described<PostImpactSetup::Release> {
  using T = PostImpactSetup::Release;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::after>("after", "s", "Since post_impact began; before its end.").above(0).required(),
      field<&T::end_effectors>("end_effectors", "", "Whose grips; absent: all that hold something then.")
          .items(1, 0)
          .optional(),
  });
  static constexpr Type type = structure<T>("release", "Grips let go; momenta are carried over.", fields);
};

template <>
struct Described<PostImpactSetup> {
  using T = PostImpactSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::duration>("duration", "s", "").above(0).required(),
      field<&T::joints>(
          "joints", "",
          "free: no torques. pd: hold the joint values found at the impact. braked: locked by a second impulse."),
      field<&T::kp>("kp", "N m/rad or N/m", "Proportional gain, for joints pd; ignored otherwise.")
          .at_least(0)
          .as("gains")
          .optional(),
      field<&T::kd>("kd", "N m s/rad or N s/m", "Derivative gain, for joints pd; ignored otherwise.")
          .at_least(0)
          .as("gains")
          .optional(),
      field<&T::base_control>("base_control", "", "").optional(),
      field<&T::releases>("release", "", "Grips that let go, in the order of time.").items(0, 1000),
  });
  static constexpr auto rules = std::to_array<Rule>({
      when("joints", "pd").require("kp, kd"),
  });
  static constexpr Type type = structure<T>("post_impact", "The motion of the joined system.", fields, rules);
};

template <>
struct Described<LoadProfile> {
  using T = LoadProfile;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::shape>("shape", "",
                       "constant: from start to end. half_sine: sin(pi (t - start) / (end - start)). sine: sin(2 pi "
                       "frequency (t - start) + phase). table: the wrench itself, linear between samples, zero before "
                       "the first and after the last.")
          .required(),
      field<&T::start>("start", "s", "The wrench is zero before it; absent: 0.").optional(),
      field<&T::end>("end", "s", "The wrench is zero from it on; absent: none.").optional(),
      field<&T::frequency>("frequency", "Hz", "Of a sine.").above(0).optional(),
      field<&T::phase>("phase", "rad", "Of a sine at its start; absent: 0.").optional(),
      field<&T::values>(
          "values", "s, N, N m",
          "Of a table: rows [t, Fx, Fy, Fz, Mx, My, Mz] in the order of time; the moment is about the point of attack.")
          .items(2, 0)
          .as("load table")
          .optional(),
  });
  static constexpr auto rules = std::to_array<Rule>({
      when("shape", "constant").forbid("frequency, phase, values"),
      when("shape", "half_sine").require("end").forbid("frequency, phase, values"),
      when("shape", "sine").require("frequency").forbid("values"),
      when("shape", "table").require("values").forbid("start, end, frequency, phase"),
  });
  static constexpr Type type = structure<T>(
      "load_profile", "How the wrench varies in time; t = 0 is the start of the scenario. Absent: constant for ever.",
      fields, rules);
};

template <>
struct Described<LoadSetup> {
  using T = LoadSetup;
  static constexpr auto fields = std::to_array<Field>({
      key<std::string>("body", "", "The robot's base or link on which it acts.").optional(),
      key<std::string>("target", "", "The target on which it acts, in place of body.").optional(),
      field<&T::p_BP>("position", "m", "Point of attack in the body's frame."),
      field<&T::in_body>("frame", "", "Whose axes force and torque are given in; those of the body turn with it.")
          .as("one of world, body")
          .by_default("\"world\""),
      found<[](T& t) -> Vector3d& { return t.amplitude.linear; }>(
          "force", "N", "Force, which the profile multiplies; absent: zero. Not with a table.")
          .optional(),
      found<[](T& t) -> Vector3d& { return t.amplitude.angular; }>(
          "torque", "N m",
          "Torque about the point of attack, which the profile multiplies; absent: zero. Not with a table.")
          .optional(),
      field<&T::profile>("time", "", "").optional(),
  });
  static constexpr auto rules = std::to_array<Rule>({
      one_of("body, target"),
  });
  static constexpr Type type =
      structure<T>("external_wrench", "A force and a torque on one body, from outside.", fields, rules);
};

template <>
struct Described<ClearanceSetup> {
  using T = ClearanceSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::enabled>("enabled", "", ""),
      field<&T::required>("required", "m", "A smaller distance is a violation.").at_least(0),
      field<&T::ignore>("ignore", "",
                        "Pairs of bodies that are not watched: links, the base and targets by name; of a link and a "
                        "target of one name the link is meant.")
          .as("pairs of names"),
  });
  static constexpr Type type = structure<T>(
      "clearance",
      "What is watched of the distances between bodies that have a geometry; without influence on the motion.", fields);
};

template <>
struct Described<IntegrationSetup> {
  using T = IntegrationSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::method>("method", "", "adaptive_8: Dormand-Prince of order 8 with error control. rk4: fixed steps."),
      field<&T::root_velocity>("root_velocity", "",
                               "recovered: where nothing acts from outside, velocity and position of base and targets "
                               "follow from the momentum and the centre of mass at the phase's start, so that momentum "
                               "cannot drift. integrated: they are integrated like everything else."),
      field<&T::loops>("loops", "",
                       "How closed loops are kept closed. projection: positions and velocities are brought back after "
                       "every step and at every output. baumgarte: defects are fed back to the accelerations. "
                       "acceleration: on accelerations alone, as in the thesis: defects stay and grow. open: loops are "
                       "cut, further grips of a target do not hold it."),
      field<&T::baumgarte_time>("baumgarte_time", "s", "Within which defects decay, for loops: baumgarte; absent: 0.1.")
          .above(0)
          .optional(),
      field<&T::relative_tolerance>("relative_tolerance", "", "For adaptive_8.").at_least(1e-14).at_most(0.1),
      field<&T::absolute_tolerance>("absolute_tolerance", "", "For adaptive_8.").at_least(1e-18).at_most(0.1),
      field<&T::step>("step", "s", "For rk4.").above(0),
      field<&T::max_step>("max_step", "s",
                          "For adaptive_8; absent: a hundredth of a phase with driven joints, else none.")
          .above(0)
          .optional(),
      field<&T::max_steps>("max_steps", "", "A phase that needs more fails.").at_least(1).at_most(1000000000),
  });
  static constexpr auto rules = std::to_array<Rule>({
      needs("baumgarte_time", "loops"),
      when("loops", "projection, acceleration").forbid("baumgarte_time", "it is for baumgarte"),
  });
  static constexpr Type type = structure<T>("integration", "", fields, rules);
};

template <>
struct Described<OutputKeys> {
  using T = CaptureProblem;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::output_interval>("interval", "s", "Between the samples of the time series.").above(0),
      field<&T::output_as_published>("as_published", "",
                                     "Show what the thesis's formulas (3.8)-(3.13) would give beside the impact that "
                                     "keeps momentum. With law as_published it is always shown."),
  });
  static constexpr Type type = structure<T>("output", "", fields);
};

template <>
struct Described<CaptureProblem> {
  using T = CaptureProblem;
  static constexpr auto fields = std::to_array<Field>({
      key<std::string>("schema", "", "What the file is and the version of its format; absent: this version.")
          .as("constant grapnel-scenario/1")
          .optional(),
      field<&T::name>("name", "", "Shown in results.").required(),
      key<std::string>("description", "", "For the reader of the file.").as("any text").optional(),
      field<&T::robot>(&robot_description, "robot",
                       "The robot: a robot file, its path relative to this file, or the content of one.")
          .as("robot")
          .required(),
      field<&T::gravity>("gravity", "m/s^2", "Uniform gravity in W, for ground test beds."),
      group<T, InitialKeys>("initial", ""),
      field<&T::targets>("targets", "", "The free bodies to be caught."),
      field<&T::grasps>("grasps", "", "Who grips what; all at one instant where nothing else is said.")
          .items(1, 0)
          .optional(),
      field<&T::approach>("approach", "", "").optional(),
      field<&T::contact>("contact", "", ""),
      field<&T::impact>("impact", "", "").optional(),
      field<&T::post_impact>("post_impact", "", "").optional(),
      field<&T::loads>("external_wrenches", "", "Wrenches on bodies as given functions of time, in all phases.")
          .items(0, 1000),
      field<&T::clearance>("clearance", "", ""),
      field<&T::integration>("integration", "", ""),
      group<T, OutputKeys>("output", ""),
  });
  static constexpr auto rules = std::to_array<Rule>({
      needs("impact", "grasps"),
      needs("post_impact", "impact"),
      needs("grasps", "targets"),
  });
  static constexpr Type type =
      structure<T>("scenario",
                   "One capture: a robot, its targets, who grips what, and the phases to simulate. SI units, radians; "
                   "vectors in the world frame where nothing else is said.",
                   fields, rules);
};

const Type& scenario_description() { return type_of<CaptureProblem>(); }

const Type& description_at(std::string_view path) {
  const Type* type = &scenario_description();
  for (std::string_view rest = path; !rest.empty();) {
    const std::size_t dot = std::min(rest.find('.'), rest.size());
    const Field* field = field_named(*type, rest.substr(0, dot));
    if (!field) throw std::logic_error("nothing is described at " + std::string(path));
    type = &field->type();
    while (type->kind == Type::Kind::optional || type->kind == Type::Kind::list) type = &type->of();
    rest.remove_prefix(std::min(dot + 1, rest.size()));
  }
  return *type;
}

}  // namespace grapnel
