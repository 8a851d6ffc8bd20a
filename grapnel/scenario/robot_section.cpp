#include <algorithm>
#include <array>

#include "grapnel/scenario/actuator_arrays.hpp"
#include "grapnel/scenario/sections.hpp"

namespace grapnel {
namespace {

// Mappings of files for a subset of a structure's members.
struct OriginKeys;
struct JointKeys;
struct GripperRatingKeys;
struct BaseKeys;

}  // namespace

// ---- What robot files hold ----

template <>
struct Described<JointType> {
  static constexpr auto choices = [] {
    std::array<Choice, std::ranges::count_if(kJointTypes, &JointTraits::in_robot_files)> result{};
    std::size_t next = 0;
    for (const JointTraits& t : kJointTypes) {
      if (t.in_robot_files) result[next++] = choice(t.type, t.name);
    }
    return result;
  }();
  static constexpr Type type = enumeration<JointType>("JointType", choices);
};
template <>
const Type& type_of<JointType>() {
  return Described<JointType>::type;
}

template <>
struct Described<Geometry> {
  using T = Geometry;
  // Shapes to which a key applies.
  static bool is_box(const T& t) { return t.shape == T::Shape::box; }
  static bool is_mesh(const T& t) { return t.shape == T::Shape::mesh; }
  static bool is_long(const T& t) { return t.shape == T::Shape::cylinder || t.shape == T::Shape::capsule; }
  static bool is_round(const T& t) { return t.shape == T::Shape::sphere || is_long(t); }
  static constexpr auto fields = std::to_array<Field>({
      field<&T::shape>("shape", "", "Kind of the shape.").required(),
      field<&T::size>("size", "m", "Edge lengths of a box along its x, y, z.").above(0).optional().when<[](const T& t) {
        return is_box(t);
      }>(),
      found<[](T& t) -> double& { return t.size[0]; }>("radius", "m", "Radius of a cylinder, capsule or sphere.")
          .above(0)
          .optional()
          .when<[](const T& t) { return is_round(t); }>(),
      found<[](T& t) -> double& { return t.size[1]; }>(
          "length", "m", "Length along the z axis: of a cylinder, or of a capsule between the centres of its end caps.")
          .above(0)
          .optional()
          .when<[](const T& t) { return is_long(t); }>(),
      key<std::string>(
          "file", "",
          "Of a mesh: its file of triangles, .stl, .obj or .dae, by its path relative to the file that names it.")
          .as("mesh file")
          .optional(),
      found<[](T& t) -> double& { return t.size[0]; }>(
          "scale", "",
          "Of a mesh: factor from its numbers to metres (0.001 for millimetres), or 3, for x, y, z. Absent: 1.")
          .above(0)
          .as("scale")
          .optional()
          .when<[](const T& t) { return is_mesh(t); }>(),
      found<[](T& t) -> Vector3d& { return t.X_BG.p; }>(
          "position", "m", "Centre of the shape in the body's frame; for a mesh the origin of its file."),
      quaternion_of<&T::X_BG>(),
      rpy_of<&T::X_BG>(),
  });
  static constexpr auto rules = std::to_array<Rule>({
      not_both("quaternion_wxyz, rpy"),
      when("shape", "box").require("size").forbid("radius, length, file, scale"),
      when("shape", "cylinder, capsule").require("radius, length").forbid("size, file, scale"),
      when("shape", "sphere").require("radius").forbid("size, length, file, scale"),
      when("shape", "mesh").require("file").forbid("size, radius, length"),
  });
  static constexpr Type type = structure<T>(
      "geometry", "A shape for visualization and clearance; it does not affect the motion.", fields, rules);
};

template <>
struct Described<OriginKeys> {
  using T = BodyDescription;
  static constexpr auto fields = std::to_array<Field>({
      found<[](T& t) -> Vector3d& { return t.X_PF.p; }>("position", "m", "Position of the joint's frame."),
      quaternion_of<&T::X_PF>(),
      rpy_of<&T::X_PF>(),
  });
  static constexpr auto rules = std::to_array<Rule>({not_both("quaternion_wxyz, rpy")});
  static constexpr Type type =
      structure<T>("origin", "Pose of the joint's frame in the parent's frame.", fields, rules);
};

template <>
struct Described<JointStop> {
  using T = JointStop;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::restitution>("restitution", "", "Rate after the stop over the rate before it.")
          .at_least(0)
          .at_most(1)
          .required(),
      field<&T::rest_rate>("rest_rate", "rad/s or m/s", "A joint that reaches its stop more slowly rests there.")
          .at_least(0),
  });
  static constexpr Type type = structure<T>(
      "joint_stop",
      "Stops at the joint's limits. Without them limits are only monitored. Needs a lower or an upper limit.", fields);
};

template <>
struct Described<JointLimits> {
  using T = JointLimits;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::lower>("lower", "rad or m", "Minimum of joint values in a scenario. Absent: none.")
          .as("number or infinity")
          .optional(),
      field<&T::upper>("upper", "rad or m", "Maximum of joint values in a scenario. Absent: none.")
          .as("number or infinity")
          .optional(),
      field<&T::rate>("rate", "rad/s or m/s", "Maximum of given rates in a scenario. Absent: none.")
          .above(0)
          .up_to(1e+09)
          .as("number or infinity")
          .optional(),
      field<&T::effort>("effort", "N m or N", "Saturation of the drive. Absent: none.")
          .above(0)
          .as("number or infinity")
          .optional(),
      field<&T::stop>("stop", "", "").optional(),
  });
  static constexpr Type type = structure<T>("joint_limits", "Limits of the joint.", fields);
};

template <>
struct Described<JointFriction::Model> : Enumeration<JointFriction::Model, "FrictionModel", "smooth", "sticking"> {};

template <>
struct Described<JointFriction> {
  using T = JointFriction;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::model>(
          "model", "",
          "smooth: -(viscous rate + coulomb tanh(rate / transition_rate)), which creeps at rest. sticking: -(viscous "
          "rate + coulomb sign(rate)) while the joint moves; at rest friction holds it up to `static`."),
      field<&T::viscous>("viscous", "N m s/rad or N s/m", "Viscous friction.").at_least(0),
      field<&T::coulomb>("coulomb", "N m or N", "Coulomb friction.").at_least(0),
      field<&T::static_effort>(
          "static", "N m or N",
          "Of the model sticking: breakaway effort of a joint at rest, at least `coulomb`. Absent: `coulomb`.")
          .at_least(0)
          .optional(),
      field<&T::transition_rate>("transition_rate", "rad/s or m/s",
                                 "Of the model smooth: transition of Coulomb friction between the two directions.")
          .above(0),
  });
  static constexpr auto rules = std::to_array<Rule>({
      needs("static", "model"),
      when("model", "smooth").forbid("static"),
  });
  static constexpr Type type = structure<T>("joint_friction", "Friction of a joint or a bearing.", fields, rules);
};

template <>
struct Described<TorqueRipple> {
  using T = TorqueRipple;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::amplitude>("amplitude", "", "Amplitude relative to the effort.").at_least(0).at_most(1).required(),
      field<&T::per_turn>("per_turn", "", "Periods per turn of the motor.").above(0).required(),
      field<&T::phase>("phase", "rad", "Phase at the joint's zero."),
  });
  static constexpr Type type = structure<T>(
      "torque_ripple",
      "The motor's effort is the commanded effort times 1 + amplitude sin(per_turn gear_ratio joint value + phase).",
      fields);
};

template <>
struct Described<JointMotor> {
  using T = JointMotor;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::no_load_rate>(
          "no_load_rate", "rad/s or m/s",
          "Joint rate at which the maximum effort in the direction of motion is zero; it falls linearly from "
          "limits.effort at rest. Against the direction of motion the maximum is limits.effort. Absent: none.")
          .above(0)
          .up_to(1e+09)
          .as("number or infinity")
          .optional(),
      field<&T::ripple>("ripple", "", "").optional(),
      field<&T::torque_constant>("torque_constant", "",
                                 "Torque constant of the motor, before its gear, in N m/A: current is effort over "
                                 "gear_ratio times this; absent: electrical energy is not computed.")
          .above(0)
          .optional(),
      field<&T::resistance>("resistance", "", "Winding resistance, in Ohm.").at_least(0),
  });
  static constexpr auto rules = std::to_array<Rule>({needs("resistance", "torque_constant")});
  static constexpr Type type = structure<T>("joint_motor", "Limits and losses of the joint's motor.", fields, rules);
};

template <>
struct Described<JointSpring> {
  using T = JointSpring;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::stiffness>("stiffness", "N m/rad or N/m", "Stiffness of the spring.").above(0).required(),
      field<&T::damping>("damping", "N m s/rad or N s/m", "Damping beside the spring.").at_least(0),
      field<&T::rest>("rest", "rad or m", "Joint value of the unstressed spring; also the initial value, at rest."),
  });
  static constexpr Type type =
      structure<T>("joint_spring",
                   "A spring and a damper at an undriven joint, such as the hinge of a solar panel: effort -(stiffness "
                   "(joint value - rest) + damping rate). The joint has no entry in initial.joints and other joint "
                   "values, no limits.stop and no friction of the model sticking.",
                   fields);
};

template <>
struct Described<JointElasticity> {
  using T = JointElasticity;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::stiffness>("stiffness", "N m/rad or N/m", "Stiffness of the gear, seen at the joint.")
          .above(0)
          .required(),
      field<&T::damping>("damping", "N m s/rad or N s/m", "Damping of the gear, seen at the joint.").at_least(0),
      field<&T::backlash>(
          "backlash", "rad or m",
          "Free motion of the link relative to its motor, seen at the joint, before the spring acts; half of it on "
          "either side of the initial position. The damper acts there too. Frequencies are those of a gear in contact.")
          .at_least(0),
  });
  static constexpr Type type =
      structure<T>("joint_elasticity",
                   "A flexible gear: a spring and a damper about or along the joint's axis, between motor and link. "
                   "The joint's value is then that of the motor, divided by gear_ratio; limits, friction and control "
                   "act on it. Absent: the gear is rigid.",
                   fields);
};

template <>
struct Described<CouplingTerm> {
  using T = CouplingTerm;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::joint>("joint", "", "Name of the joint that it follows.").required(),
      field<&T::ratio>(
          "ratio", "1",
          "Change of the joint per change of that joint, not zero; in m/rad or rad/m between a sliding and "
          "a turning joint, as a number without unit."),
      field<&T::offset>("offset", "rad or m", "Value of the joint where that joint is zero."),
  });
  static constexpr Type type = structure<T>(
      "mimic", "A term of a coupling, without play and without loss: ratio times the value of `joint`, plus offset.",
      fields);
};

template <>
struct Described<TendonArm> {
  using T = TendonArm;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::joint>("joint", "", "Name of the joint.").required(),
      field<&T::arm>(
          "arm", "m, or 1 for a prismatic joint",
          "Moment arm: effort on the joint per tension; not zero. Positive: the tendon moves the joint in its "
          "positive direction.")
          .required(),
  });
  static constexpr Type type = structure<T>("tendon_arm", "The action of a tendon on one joint.", fields);
};

template <>
struct Described<TendonSetup> {
  using T = TendonSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::name>("name", "", "Name, unique among tendons.").required(),
      field<&T::joints>("joints", "", "The joints that it pulls.").items(1, 100).required(),
      field<&T::stiffness>("stiffness", "N/m",
                           "Stiffness of the tendon with its drive. Needed by commands with a `speed`.")
          .above(0)
          .optional(),
  });
  static constexpr Type type = structure<T>(
      "tendon",
      "A tendon that pulls several joints with one tension: each gets the effort `arm` times tension. `tendons` of a "
      "phase of motion commands it.",
      fields);
};

template <>
struct Described<LoadRating> {
  using T = LoadRating;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::force>("force", "N", "Maximum of the transmitted force.").above(0).optional(),
      field<&T::moment>("moment", "N m", "Maximum of the transmitted moment.").above(0).optional(),
      field<&T::impulse>("impulse", "N s", "Maximum of the impulse, of the whole impact.").above(0).optional(),
      field<&T::angular_impulse>("angular_impulse", "N m s", "Maximum of the angular impulse, of the whole impact.")
          .above(0)
          .optional(),
      field<&T::driving>("driving", "N m or N",
                         "Maximum effort about or along the axis: the load of brake or drive. During motion "
                         "limits.effort applies too where it is smaller.")
          .above(0)
          .optional(),
      field<&T::driving_impulse>("driving_impulse", "N m s or N s", "Maximum of its impulse, of the whole impact.")
          .above(0)
          .optional(),
  });
  static constexpr auto rules = std::to_array<Rule>({not_empty()});
  static constexpr Type type =
      structure<T>("joint_rating",
                   "Maximum loads of the joint in any phase, magnitudes at its origin: peaks, and for instantaneous "
                   "impacts the impulses divided by impact.duration. Absent ratings are not evaluated.",
                   fields, rules);
};

template <>
struct Described<GripperRatingKeys> {
  using T = LoadRating;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::force>("force", "N", "Maximum of the force.").above(0).optional(),
      field<&T::moment>("moment", "N m", "Maximum of the moment.").above(0).optional(),
      field<&T::impulse>("impulse", "N s", "Maximum of the impulse.").above(0).optional(),
      field<&T::angular_impulse>("angular_impulse", "N m s", "Maximum of the angular impulse.").above(0).optional(),
  });
  static constexpr auto rules = std::to_array<Rule>({not_empty()});
  static constexpr Type type = structure<T>(
      "gripper_rating",
      "Maximum loads of the gripper at the contact point, as for joints. The result compares loads with ratings.",
      fields, rules);
};

template <>
struct Described<CaptureEnvelope> {
  using T = CaptureEnvelope;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::position>("position", "m", "Maximum distance from its grasp point. Absent: any.").above(0).optional(),
      field<&T::angle>("angle", "rad",
                       "Maximum angle from the grasp's `orientation`; without effect if that is free. Absent: any.")
          .above(0)
          .optional(),
      field<&T::velocity>("velocity", "m/s", "Maximum speed of its origin relative to the grasp point. Absent: any.")
          .above(0)
          .optional(),
      field<&T::angular_velocity>("angular_velocity", "rad/s",
                                  "Maximum angular velocity relative to the target. Absent: any.")
          .above(0)
          .optional(),
  });
  static constexpr auto rules = std::to_array<Rule>({not_empty()});
  static constexpr Type type = structure<T>("envelope",
                                            "Capture envelope, with at least one of its keys. approach.capture_at with "
                                            "envelope needs it. Absent: none, and a capture is `assumed`.",
                                            fields, rules);
};

template <>
struct Described<JointKeys> {
  using T = BodyDescription;
  static constexpr auto fields = std::to_array<Field>({
      found<[](T& t) -> std::string& { return t.joint.name; }>("name", "", "Name, unique among joints.").required(),
      found<[](T& t) -> JointType& { return t.joint.type; }>(
          "type", "", "continuous: revolute without position limits. fixed: takes `name` and `origin` only.")
          .required(),
      found<[](T& t) -> Vector3d& { return t.joint.axis; }>(
          "axis", "",
          "Unit vector in the joint's frame: rotation axis of a revolute joint, direction of a prismatic joint. A "
          "length off by more than 1e-9 is rejected; the message gives the normalized axis.")
          .as("unit vector")
          .optional(),
      group<T, OriginKeys>("origin", ""),
      found<[](T& t) -> JointLimits& { return t.joint.limits; }>("limits", "", ""),
      key<LoadRating>("rating", "", "").as("joint rating").optional(),
      found<[](T& t) -> JointFriction& { return t.joint.friction; }>("friction", "", ""),
      found<[](T& t) -> double& { return t.joint.rotor_inertia; }>("rotor_inertia", "kg m^2",
                                                                   "Moment of inertia of the motor about its own axis.")
          .at_least(0),
      found<[](T& t) -> double& { return t.joint.gear_ratio; }>(
          "gear_ratio", "1, or rad/m for a prismatic joint",
          "Motor turns per joint turn; its square times rotor_inertia adds to the joint's inertia in every phase."),
      found<[](T& t) -> std::optional<Vector3d>& { return t.joint.rotor_axis; }>(
          "rotor_axis", "",
          "Unit vector in the joint's frame. The rotor rotates about it, gear_ratio times as fast as the joint, in the "
          "link that carries it; its spin has momentum and acts on that link. Mass and inertia of that link include "
          "the rotor. Absent: none; the rotor only adds to the joint's inertia.")
          .as("unit vector")
          .optional(),
      found<[](T& t) -> std::optional<JointMotor>& { return t.joint.motor; }>("motor", "", "").optional(),
      found<[](T& t) -> std::optional<JointElasticity>& { return t.joint.elasticity; }>("elasticity", "", "")
          .optional(),
      found<[](T& t) -> std::optional<JointSpring>& { return t.joint.spring; }>("spring", "", "").optional(),
      found<[](T& t) -> std::vector<CouplingTerm>& { return t.joint.mimic; }>(
          "mimic", "",
          "Couplings to other joints, as by a gear, a belt or a linkage: the joint's value is `ratio` times that of "
          "`joint`, plus `offset`; with several the sum. The joint has no motor, since the coupling drives it.")
          .items(0, 20)
          .one_or_list("a mapping of one joint; a list of joints"),
  });
  static constexpr auto rules = std::to_array<Rule>({
      when("type", "revolute, continuous, prismatic").require("axis"),
      when("type", "continuous").forbid("limits.lower, limits.upper, limits.stop"),
      when("type", "fixed")
          .forbid("axis, limits, friction, rotor_inertia, gear_ratio, rotor_axis, motor, elasticity, spring, mimic, "
                  "rating.driving, rating.driving_impulse"),
      not_both("elasticity, spring"),
      not_both("motor, spring"),
      not_both("motor, mimic"),
      not_both("elasticity, mimic"),
      not_both("spring, mimic"),
      needs("elasticity", "rotor_inertia"),
      needs("rotor_axis", "rotor_inertia"),
  });
  static constexpr Type type = structure<T>("joint", "The joint that carries the link.", fields, rules);
};

template <>
struct Described<BodyDescription> {
  using T = BodyDescription;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::name>("name", "", "Name, unique among links and base.").required(),
      field<&T::parent>("parent", "", "Name of the base or of another link.").required(),
      group<T, JointKeys>("joint", "").required(),
      field<&T::mass>("mass", "kg", "Mass of the link.").above(0).required(),
      field<&T::com>("com", "m", kComText),
      field<&T::inertia>("inertia", "kg m^2", kInertiaText).as("inertia").required(),
      field<&T::beam>("beam", "", "").optional(),
      field<&T::modes>("modes", "", "Flexible modes of the link, clamped at its frame, in place of a beam.")
          .items(0, 50),
      key<std::vector<Geometry>>("geometry", "", kShapesText)
          .as("geometry of body")
          .one_or_list(kShapesTitles)
          .optional(),
  });
  static constexpr Type type =
      structure<T>("link", "A body, rigid unless it has a beam; its frame sits at the joint that carries it.", fields);
};

template <>
struct Described<EndEffectorSetup> {
  using T = EndEffectorSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::name>("name", "", "Name, unique among end-effectors.").required(),
      field<&T::body>("link", "", "Name of the link, or of the base, that carries the end-effector.").required(),
      found<[](T& t) -> Vector3d& { return t.X_BE.p; }>("position", "m", "Position in the link's frame."),
      quaternion_of<&T::X_BE>(),
      rpy_of<&T::X_BE>(),
      field<&T::approach_axis>(
          "approach_axis", "",
          "Unit vector in the end-effector's frame: its reach direction. Needed by grasps with `orientation: axis`.")
          .as("unit vector")
          .optional(),
      field<&T::envelope>("envelope", "", "").optional(),
      field<&T::rating>(&type_of<GripperRatingKeys>, "rating", "").optional(),
  });
  static constexpr auto rules = std::to_array<Rule>({not_both("quaternion_wxyz, rpy")});
  static constexpr Type type = structure<T>("end_effector", "", fields, rules);
};

template <>
struct Described<WheelSetup> {
  using T = WheelSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::name>("name", "", "Name, unique among wheels.").required(),
      field<&T::axis>("axis", "", "Unit vector in the base's frame.").as("unit vector").required(),
      field<&T::inertia>("inertia", "kg m^2", "Moment of inertia about the axis.").above(0).required(),
      field<&T::torque>("torque", "N m", "Maximum torque of the motor. Absent: none.")
          .above(0)
          .as("number or infinity")
          .optional(),
      field<&T::rate>("rate", "rad/s",
                      "Maximum rate relative to the base. A wheel that reaches it is kept there by its motor until it "
                      "is commanded to slow down. Absent: none.")
          .above(0)
          .up_to(1e+09)
          .plausible_to(kFastestRotor)
          .as("number or infinity")
          .optional(),
      field<&T::friction>("friction", "", "Friction of its bearing; the model sticking is rejected."),
  });
  static constexpr Type type = structure<T>(
      "reaction_wheel",
      "A balanced rotor that a motor accelerates relative to the base. base_control of scenarios commands it.", fields);
};

template <>
struct Described<MomentGyroSetup> {
  using T = MomentGyroSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::name>("name", "", "Name, unique among gyros.").required(),
      field<&T::gimbal_axis>("gimbal_axis", "", "Unit vector in the base's frame: rotation axis of the gimbal.")
          .as("unit vector")
          .required(),
      field<&T::spin_axis>("spin_axis", "",
                           "Unit vector in the base's frame, perpendicular to gimbal_axis: the rotor's axis with the "
                           "gimbal at its zero.")
          .as("unit vector")
          .required(),
      field<&T::inertia>("inertia", "kg m^2",
                         "Moment of inertia of the rotor about its axis. Across it the rotor has half of that, the "
                         "minimum that a body can have.")
          .above(0)
          .required(),
      field<&T::spin_rate>(
          "spin_rate", "rad/s",
          "Rate of the rotor in the gimbal. Its motor keeps it, whatever torque that takes; the torque is reported.")
          .above(0)
          .up_to(1e+09)
          .plausible_to(kFastestRotor)
          .required(),
      field<&T::gimbal_inertia>("gimbal_inertia", "kg m^2",
                                "Moment of inertia about the gimbal's axis, of all parts that rotate with it, "
                                "including the rotor: more than half of `inertia`.")
          .above(0)
          .required(),
      field<&T::torque>("torque", "N m",
                        "Maximum torque of the gimbal's motor. The gimbal rotates as this torque allows. Absent: none.")
          .above(0)
          .as("number or infinity")
          .optional(),
      field<&T::rate>("rate", "rad/s", "Maximum commanded rate of the gimbal. Absent: none.")
          .above(0)
          .up_to(1e+09)
          .as("number or infinity")
          .optional(),
      field<&T::bandwidth>("bandwidth", "1/s",
                           "Bandwidth of the loops by which both motors keep their rates: a gimbal reaches a commanded "
                           "rate as 1 - exp(-bandwidth t).")
          .above(0)
          .up_to(1e+06),
  });
  static constexpr Type type = structure<T>("moment_gyro",
                                            "A control moment gyro: a rotor at a constant rate in a gimbal that a "
                                            "motor turns relative to the base. base_control of scenarios commands it.",
                                            fields);
};

template <>
struct Described<PlumeSetup> {
  using T = PlumeSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::half_angle>("half_angle", "rad", "Half angle of the cone.").above(0).at_most(1.5).required(),
      field<&T::range>("range", "m", "Length of the cone.").above(0).required(),
  });
  static constexpr Type type = structure<T>(
      "plume", "Cone from the point of the force, against its true direction. Absent: not monitored.", fields);
};

template <>
struct Described<ThrusterSetup> {
  using T = ThrusterSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::name>("name", "", "Name, unique among thrusters.").required(),
      found<[](T& t) -> Vector3d& { return t.position; }>("position", "m",
                                                          "Point of application of its force, in the base's frame.")
          .required(),
      found<[](T& t) -> Vector3d& { return t.direction; }>(
          "direction", "",
          "Unit vector of its force on the base, in the base's frame; the plume has the opposite direction.")
          .as("unit vector")
          .required(),
      found<[](T& t) -> double& { return t.force; }>("force", "N", "Force while it is on.").above(0).required(),
      found<[](T& t) -> double& { return t.specific_impulse; }>(
          "specific_impulse", "s",
          "Specific impulse of its propellant; the mass flow is force / (specific impulse times 9.80665 m/s^2).")
          .above(0)
          .required(),
      found<[](T& t) -> double& { return t.min_on_time; }>("min_on_time", "s", "Minimum time that its valve is open.")
          .at_least(0),
      found<[](T& t) -> double& { return t.rise; }>("rise_time", "s",
                                                    "Duration of the linear rise of the force after the valve opens.")
          .at_least(0),
      found<[](T& t) -> double& { return t.fall; }>("fall_time", "s",
                                                    "Duration of its fall after the valve has closed.")
          .at_least(0),
      found<[](T& t) -> Vector3d& { return t.misalignment; }>(
          "misalignment", "rad",
          "Rotation vector about the base's axes from its stated to its true direction. Unknown to the controller; "
          "campaigns can draw it like any number.")
          .by_default("[0, 0, 0]"),
      field<&T::plume>("plume", "", "").optional(),
  });
  static constexpr Type type = structure<T>(
      "thruster", "A thruster of the base, on or off. base_control of scenarios commands its valve.", fields);
};

template <>
struct Described<BaseKeys> {
  using T = RobotSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::base>("name", "", "Its name as a link's parent.").by_default("\"base\""),
      field<&T::base_mode>("mode", "",
                           "free: floats. held: an ideal wrench keeps its initial pose during the approach; free from "
                           "the impact on. fixed: fixed to the ground."),
      found<[](T& t) -> double& { return t.bodies[0].mass; }>(
          "mass", "kg", "Mass of the base, with its wheels, gyros and propellant.")
          .above(0)
          .required(),
      found<[](T& t) -> Vector3d& { return t.bodies[0].com; }>("com", "m", kComText).by_default("[0, 0, 0]"),
      found<[](T& t) -> Symmetric3d& { return t.bodies[0].inertia; }>("inertia", "kg m^2", kInertiaText)
          .as("inertia")
          .required(),
      key<std::vector<Geometry>>("geometry", "", kShapesText)
          .as("geometry of body")
          .one_or_list(kShapesTitles)
          .optional(),
  });
  static constexpr Type type = structure<T>("base", "The body that carries the arms.", fields);
};

namespace {

// The bodies except the base, which comes first.
const Type& links_type() {
  static const Type type = [] {
    Type list = type_of<std::vector<BodyDescription>>();
    list.size = [](const void* value) {
      const std::size_t size = static_cast<const std::vector<BodyDescription>*>(value)->size();
      return size == 0 ? 0 : size - 1;
    };
    list.item = [](void* value, std::size_t i) -> void* {
      return &(*static_cast<std::vector<BodyDescription>*>(value))[i + 1];
    };
    list.show_item = [](const void* value, std::size_t i, ValueVisitor visitor) {
      visitor(&(*static_cast<const std::vector<BodyDescription>*>(value))[i + 1]);
    };
    list.resize = [](void* value, std::size_t size) {
      static_cast<std::vector<BodyDescription>*>(value)->resize(size + 1);
    };
    return list;
  }();
  return type;
}

constexpr Field links(std::string_view key, std::string_view unit, std::string_view text) {
  Field f = field<&RobotSetup::bodies>(key, unit, text);
  f.type = &links_type;
  return f;
}

// A key for members that other keys also set.
constexpr Field file_key(std::string_view key, const Type& (*type)(), std::string_view text) {
  Field f;
  f.key = key, f.text = text, f.type = type;
  return f.optional();
}

}  // namespace

template <>
struct Described<RobotSetup> {
  using T = RobotSetup;
  static constexpr auto fields = std::to_array<Field>({
      version_key("constant grapnel-robot/1"),
      field<&T::name>("name", "", "Name in reports.").by_default("\"robot\""),
      description_key(),
      group<T, BaseKeys>("base", "").required(),
      links("links", "", "Links in any order; a joint connects each to its parent. Branches are allowed.")
          .items(0, 4000),
      field<&T::end_effectors>("end_effectors", "", "Named frames on links, or on the base, that can grasp."),
      field<&T::wheels>("wheels", "", "Reaction wheels of the base. Its mass, centre of mass and inertia include them.")
          .items(0, 100),
      file_key("wheel_array", &wheel_array_description, "Equal reaction wheels in a standard arrangement."),
      file_key("gyro_array", &gyro_array_description, "Equal control moment gyros in a standard arrangement."),
      field<&T::gyros>("gyros", "",
                       "Control moment gyros of the base. Its mass, centre of mass and inertia include them, rotors at "
                       "rest and gimbals at their zeros.")
          .items(0, 100),
      field<&T::thrusters>("thrusters", "", "Thrusters of the base.").items(0, 100),
      field<&T::actuators>("actuators", "", "Actuators of the base of other kinds."),
      field<&T::tendons>("tendons", "", "Tendons of underactuated fingers.").items(0, 1000),
      field<&T::propellant>("propellant", "kg",
                            "Available propellant of the thrusters. Consumption beyond it is reported, and thrusters "
                            "continue to work. It is part of the base's mass, which remains constant.")
          .above(0)
          .optional(),
  });
  static constexpr auto rules = std::to_array<Rule>({not_both("wheels, wheel_array"), not_both("gyros, gyro_array")});
  static constexpr Type type = structure<T>(
      "robot", "A servicer: a base, links on joints, and end-effectors. SI units, radians.", fields, rules);
};

const Type& joint_description() { return type_of<JointKeys>(); }
const Type& tendon_arm_description() { return type_of<TendonArm>(); }
const Type& joint_friction_description() { return type_of<JointFriction>(); }
const Type& spring_description() { return type_of<std::optional<JointSpring>>(); }
const Type& shapes_description() { return type_of<std::vector<Geometry>>(); }
const Type& robot_description() { return type_of<RobotSetup>(); }

}  // namespace grapnel
