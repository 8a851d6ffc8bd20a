#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "grapnel/problem/flexible_bodies.hpp"
#include "grapnel/scenario/actuator_arrays.hpp"
#include "grapnel/scenario/joint_values.hpp"
#include "grapnel/scenario/plausibility.hpp"
#include "grapnel/scenario/sections.hpp"
#include "grapnel/text/message_text.hpp"

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
struct Described<BeamMaterial> {
  using T = BeamMaterial;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::young_modulus>("young_modulus", "Pa", "E.").above(0).required(),
      field<&T::shear_modulus>("shear_modulus", "Pa", "G.").above(0).required(),
      field<&T::density>("density", "kg/m^3", "Density.").above(0).required(),
  });
  static constexpr Type type = structure<T>(
      "beam_material",
      "With a section, in place of mass per length, rotary inertia and the four stiffnesses: isotropic and linear.",
      fields);
};

template <>
struct Described<BeamSection> {
  using T = BeamSection;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::diameter>("diameter", "m", "Outer diameter of a round section.").above(0).optional(),
      field<&T::width>("width", "m", "Outer width of a rectangle, along the section's y axis.").above(0).optional(),
      field<&T::height>("height", "m", "Outer height of a rectangle, along the section's z axis.").above(0).optional(),
      field<&T::wall_thickness>("wall_thickness", "m", "Wall thickness; absent: solid.").above(0).optional(),
  });
  static constexpr auto rules = std::to_array<Rule>({not_empty()});
  static constexpr Type type =
      structure<T>("beam_section", "A circle or a rectangle, solid or hollow; with a material.", fields, rules);
};

template <>
struct Described<BeamStation> {
  using T = BeamStation;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::at>("at", "m", "Distance from the beam's beginning: 0 at the first, the beam's length at the last.")
          .at_least(0)
          .required(),
      field<&T::mass_per_length>(
          "mass_per_length", "kg/m",
          "As of the beam. Every station states it, or none; the same holds for the next five keys.")
          .above(0)
          .optional(),
      field<&T::rotary_inertia>("rotary_inertia", "kg m", "As of the beam.").above(0).optional(),
      field<&T::bending_stiffness_y>("bending_stiffness_y", "N m^2", "As of the beam.").above(0).optional(),
      field<&T::bending_stiffness_z>("bending_stiffness_z", "N m^2", "As of the beam.").above(0).optional(),
      field<&T::torsional_stiffness>("torsional_stiffness", "N m^2", "As of the beam.").above(0).optional(),
      field<&T::axial_stiffness>("axial_stiffness", "N", "As of the beam.").above(0).optional(),
      field<&T::section>("section", "",
                         "As of the beam: every station has one, of one kind (round or rectangular, solid or hollow).")
          .optional(),
  });
  static constexpr Type type =
      structure<T>("beam_station", "Properties of the beam at one position; the same keys as for the beam.", fields);
};

template <>
struct Described<BeamDescription> {
  using T = BeamDescription;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::from>("from", "m",
                      "Beginning of the beam, in the link's frame. The part before it moves with the beginning.")
          .by_default("[0, 0, 0]"),
      field<&T::to>("to", "m",
                    "End of the beam. The part beyond it (child links, end-effectors, shapes) moves with the end.")
          .required(),
      field<&T::section_y>("section_y", "",
                           "Direction of the section's principal axis y, in the link's frame; its component along the "
                           "beam is ignored. x is along the beam, from `from` to `to`, and z completes the "
                           "right-handed system. Absent: the link's y axis; its z axis where the beam is along y.")
          .optional(),
      field<&T::mass_per_length>("mass_per_length", "kg/m",
                                 "Mass per length of the beam. Absent: the link's mass over the beam's length.")
          .above(0)
          .optional(),
      field<&T::rotary_inertia>(
          "rotary_inertia", "kg m",
          "Rotary inertia of the section about the beam, per length: density times polar moment of area.")
          .at_least(0),
      field<&T::bending_stiffness_y>("bending_stiffness_y", "N m^2",
                                     "E I of bending about the section's y axis, in which points of the beam move "
                                     "along z. Absent: does not bend about y.")
          .above(0)
          .optional(),
      field<&T::bending_stiffness_z>("bending_stiffness_z", "N m^2",
                                     "E I of bending about the section's z axis. Absent: does not bend about z.")
          .above(0)
          .optional(),
      field<&T::torsional_stiffness>("torsional_stiffness", "N m^2",
                                     "G J. Needs inertia about the beam: rotary_inertia, or the link's inertia about a "
                                     "beam that has the link's whole mass. Absent: does not twist.")
          .above(0)
          .optional(),
      field<&T::axial_stiffness>("axial_stiffness", "N", "E A. Absent: does not stretch.").above(0).optional(),
      field<&T::material>("material", "", "").optional(),
      field<&T::section>("section", "", "A circle or a rectangle, constant along the beam; with a `material`.")
          .optional(),
      field<&T::stretches>("stretches", "",
                           "With a section and a material: whether the beam also stretches, with E A. Its axial modes "
                           "are fast; `modes` and fastest_mode limit them."),
      field<&T::stations>("stations", "",
                          "A non-uniform beam: positions from its beginning to its end. Their values, numbers or sizes "
                          "of sections, are linear between them and are not stated by the beam.")
          .items(0, 100),
      field<&T::damping_ratio>("damping_ratio", "",
                               "Damping ratio of the first mode of each kind (bending about y, bending about z, "
                               "stretching, twisting) of the beam alone, clamped at its beginning. Damping is "
                               "proportional to stiffness: for other modes the ratio grows with the frequency.")
          .at_least(0)
          .at_most(1),
      field<&T::segments>("segments", "",
                          "Number of equal lengths, each with springs at its two Gauss points. Errors of bending fall "
                          "with its fourth power, errors of twisting and of the stiffening by tension with the square. "
                          "The fastest frequency, and with it the computation time, grows unless `modes` limits it.")
          .at_least(1)
          .at_most(100),
      field<&T::modes>(
          "modes", "",
          "Number of retained modes of each kind (bending about y, bending about z, stretching, twisting), the slowest "
          "ones. They are those of the link clamped at its beginning, with its load (without a captured target) and "
          "all joints at zero. At most 2 `segments`. Absent: all that the segments have.")
          .at_least(1)
          .at_most(200)
          .optional(),
      field<&T::fastest_mode>("fastest_mode", "Hz",
                              "Maximum frequency of the retained modes: integration steps must resolve every one.")
          .above(0),
  });
  static constexpr Type type =
      structure<T>("beam",
                   "The link is flexible along a straight beam, modelled as rigid segments on springs. The link's "
                   "mass, centre of mass and inertia describe the whole undeformed link and include the beam, a "
                   "slender rod; bodies beside the beam move with its ends.",
                   fields);
};

template <>
struct Described<VibrationMode> {
  using T = VibrationMode;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::frequency>("frequency", "", "Frequency, clamped at the frame, in Hz.").above(0).required(),
      field<&T::damping_ratio>("damping_ratio", "", "Damping ratio of the mode.").at_least(0).at_most(1),
      field<&T::translation>("translation", "",
                             "Participation of translation, in kg^(1/2): the momentum per rate of the mode's "
                             "coordinate. Its square is the effective mass."),
      field<&T::rotation>(
          "rotation", "",
          "Participation of rotation about the frame's origin, in kg^(1/2) m: the angular momentum per rate."),
  });
  static constexpr Type type = structure<T>(
      "vibration_mode",
      "A mode of the body clamped at its frame, of unit modal mass: the momentum per rate of its coordinate. The "
      "square of its translation is its effective mass. The body's mass and inertia include it.",
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
  });
  static constexpr auto rules = std::to_array<Rule>({
      when("type", "revolute, continuous, prismatic").require("axis"),
      when("type", "continuous").forbid("limits.lower, limits.upper, limits.stop"),
      when("type", "fixed")
          .forbid("axis, limits, friction, rotor_inertia, gear_ratio, rotor_axis, motor, elasticity, spring, "
                  "rating.driving, rating.driving_impulse"),
      not_both("elasticity, spring"),
      not_both("motor, spring"),
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

const Type& joint_friction_description() { return type_of<JointFriction>(); }
const Type& beam_description() { return type_of<std::optional<BeamDescription>>(); }
const Type& spring_description() { return type_of<std::optional<JointSpring>>(); }
const Type& vibrations_description() { return type_of<std::vector<VibrationMode>>(); }
const Type& shapes_description() { return type_of<std::vector<Geometry>>(); }
const Type& robot_description() { return type_of<RobotSetup>(); }

// ---- How they are read ----

namespace {

void doubt_body(const Node& node, const std::string& path, const BodyDescription& body, const RobotSetup& setup,
                FaultList& faults) {
  doubt_inertia(node, path, body.mass, body.com, body.inertia, shapes_of(setup, body.name), faults);
}

void finish_base(const Node& node, const std::string& path, ReadRobot& robot, FaultList& faults) {
  RobotSetup& setup = robot.setup;
  BodyDescription& base = setup.bodies[0];
  robot.links.add_from(node, path, faults);
  base.name = setup.base;
  base.joint.type = setup.base_mode == RobotSetup::Base::fixed ? JointType::fixed : JointType::free;
  doubt_body(node, path, base, setup, faults);
}

// Values with units that do not apply to a joint of this type, in its mapping and below.
void check_joint_units(const Node& node, const Type& keys, const JointDescription& joint, const std::string& path,
                       FaultList& faults) {
  for (const Field& field : keys.fields) {
    const Node* value = node.find(field.key);
    if (!value) continue;
    if (field.type().kind == Type::Kind::structure)
      check_joint_units(*value, field.type(), joint, below(path, field.key), faults);
    else
      check_unit(*value, field.unit, joint, below(path, field.key), faults);
  }
}

void finish_link(const Node& node, const std::string& path, BodyDescription& link, ReadRobot& robot,
                 FaultList& faults) {
  robot.links.add_from(node, path, faults);
  const Node& joint = part(node, "joint");
  robot.joint_names.add_from(joint, below(path, "joint"), faults);
  JointLimits& limits = link.joint.limits;
  if (!(limits.lower <= limits.upper)) limits.lower = -JointLimits{}.upper, limits.upper = JointLimits{}.upper;
  const auto type = value_named<JointType>(text_at(joint, "type"));
  if (!type) robot.types_known = false;
  if (type) check_joint_units(joint, type_of<JointKeys>(), link.joint, below(path, "joint"), faults);
  if (type) doubt_joint_limits(joint, below(path, "joint"), link.joint, faults);
  if (type && link.joint.type == JointType::fixed) robot.fixed_joints.insert(link.joint.name);
  doubt_body(node, path, link, robot.setup, faults);
}

// The cycles among parents, each as its members in order. Descendants of a cycle are not members.
std::vector<std::vector<std::string>> parent_cycles(const std::vector<BodyDescription>& bodies) {
  std::map<std::string_view, std::string_view> parent_of;
  for (const BodyDescription& body : bodies) parent_of.emplace(body.name, body.parent);
  std::vector<std::vector<std::string>> cycles;
  std::set<std::string_view> settled;
  for (const BodyDescription& body : bodies) {
    std::vector<std::string_view> chain;
    std::map<std::string_view, std::size_t> place;
    std::string_view at = body.name;
    while (!at.empty() && parent_of.contains(at) && !settled.contains(at) && place.emplace(at, chain.size()).second) {
      chain.push_back(at);
      at = parent_of[at];
    }
    if (const auto it = place.find(at); it != place.end()) {
      cycles.emplace_back(chain.begin() + static_cast<std::ptrdiff_t>(it->second), chain.end());
    }
    settled.insert(chain.begin(), chain.end());
  }
  return cycles;
}

// "upper -> lower -> upper", from the given member on.
std::string cycle_text(const std::vector<std::string>& cycle, std::size_t from) {
  constexpr std::size_t kMost = 10;
  std::string text = shortened(cycle[from]);
  for (std::size_t k = 1; k < std::min(cycle.size(), kMost); ++k) {
    text += " -> " + shortened(cycle[(from + k) % cycle.size()]);
  }
  return text + (cycle.size() > kMost ? " -> …" : "") + " -> " + shortened(cycle[from]);
}

// Checks that parents exist and form no cycle.
void check_parents(const Node& links, const std::string& path, const ReadRobot& robot, FaultList& faults) {
  std::map<std::string, std::string, std::less<>> cycle_of;
  for (const std::vector<std::string>& cycle : parent_cycles(robot.setup.bodies)) {
    for (std::size_t k = 0; k < cycle.size(); ++k) cycle_of.emplace(cycle[k], cycle_text(cycle, k));
  }
  for (std::size_t i = 0; i < links.items.size() && !faults.full(); ++i) {
    const Node& link = links.items[i];
    const std::string name = text_at(link, "name"), parent = text_at(link, "parent");
    if (!robot.links.expect(parent, part(link, "parent").mark, item(path, i), faults)) continue;
    const auto it = cycle_of.find(name);
    // With duplicate names the parent is ambiguous.
    if (it == cycle_of.end() || robot.links.is_duplicate(name)) continue;
    faults.add(part(link, "parent").mark,
               fmt::format("{}: the parents of {} form a cycle: {}", item(path, i), in_quotes(name), it->second));
  }
}

void finish_end_effectors(const Node& list, const std::string& path, ReadRobot& robot, FaultList& faults) {
  if (list.kind != Node::Kind::null && !list.is_sequence()) robot.end_effectors.make_incomplete();
  for (std::size_t i = 0; i < robot.setup.end_effectors.size(); ++i) {
    const std::string here = item(path, i);
    robot.end_effectors.add_from(list.items[i], here, faults);
    robot.links.expect(robot.setup.end_effectors[i].body, part(list.items[i], "link").mark, here, faults);
    doubt_approach_axis(list.items[i], here, robot.setup.end_effectors[i], faults);
  }
}

void finish_actuators(const Node& list, const std::string& path, const std::string& kind, std::size_t count,
                      FaultList& faults) {
  NameTable names(kind);
  for (std::size_t i = 0; i < count && i < list.items.size(); ++i) names.add_from(list.items[i], item(path, i), faults);
}

// Positions of joints and end-effectors on a body, in its frame; for a link including its joint.
std::vector<Vector3d> points_on(const RobotSetup& setup, std::size_t body) {
  const std::string& name = setup.bodies[body].name;
  std::vector<Vector3d> points;
  if (body > 0) points.push_back(Vector3d::zero());
  for (const BodyDescription& other : setup.bodies) {
    if (!other.parent.empty() && other.parent == name) points.push_back(other.X_PF.p);
  }
  for (const EndEffectorSetup& e : setup.end_effectors) {
    if (e.body == name) points.push_back(e.X_BE.p);
  }
  return points;
}

void doubt_inertia_points(const Node& node, const std::string& path, const RobotSetup& setup, FaultList& faults) {
  const Node& links = part(node, "links");
  for (std::size_t i = 0; i < setup.bodies.size(); ++i) {
    const BodyDescription& body = setup.bodies[i];
    if (i > 0 && (!links.is_sequence() || i - 1 >= links.items.size())) return;
    // The mounting points of arms on a base do not bound its extent.
    const std::vector<Vector3d> points = i > 0 ? points_on(setup, i) : std::vector<Vector3d>();
    doubt_inertia_point(i > 0 ? links.items[i - 1] : part(node, "base"),
                        i > 0 ? item(below(path, "links"), i - 1) : below(path, "base"), body, points,
                        shapes_of(setup, body.name), faults);
  }
}

// The joint order is the model's; without a model the file's, for what does not depend on the order.
void order_joints(ReadRobot& robot, bool faultless, const Mark& mark, FaultList& faults) {
  if (faultless) {
    try {
      robot.joints = moving_joints(robot.setup);
      robot.order_known = true;
    } catch (const ModelError& error) {
      for (const std::string& fault : error.faults()) faults.add(mark, fault);
    }
  }
  if (!robot.order_known) {
    for (const BodyDescription& body : robot.setup.bodies) {
      if (has_one_axis(body.joint.type) && !yields(body.joint) && !body.joint.name.empty())
        robot.joints.push_back(body.joint);
    }
  }
  for (std::size_t i = 0; i < robot.joints.size(); ++i) robot.joint_index.emplace(robot.joints[i].name, i);
}

}  // namespace

Model build_model(const RobotSetup& setup) {
  ModelBuilder builder;
  for (const BodyDescription& body : setup.bodies) builder.add(body);
  for (const FrameDescription& frame : setup.end_effectors) builder.add(frame);
  return std::move(builder).build();
}

std::vector<JointDescription> moving_joints(const RobotSetup& setup) {
  std::vector<JointDescription> joints;
  const Model model = build_model(setup);
  for (const int body : model.joints()) {
    const JointDescription& joint = model.bodies()[body].description.joint;
    if (!yields(joint)) joints.push_back(joint);
  }
  return joints;
}

ReadRobot read_robot(const Node& node, const std::string& path, const Meshes& meshes, FaultList& faults) {
  ReadRobot robot;
  RobotSetup& setup = robot.setup;
  // The structural check has run on the same list of faults: any of its findings makes the model doubtful.
  const bool sound_structure = faults.empty();
  setup.bodies.resize(1);
  read_members(node, robot_description(), path, &setup, {faults, meshes, nullptr, &setup});
  if (const Node* array = node.find("wheel_array")) {
    WheelArraySetup wheels;
    read_members(*array, wheel_array_description(), below(path, "wheel_array"), &wheels,
                 {faults, meshes, nullptr, &setup});
    setup.wheels = wheels_of(wheels);
  }
  if (const Node* array = node.find("gyro_array")) {
    GyroArraySetup gyros;
    read_members(*array, gyro_array_description(), below(path, "gyro_array"), &gyros,
                 {faults, meshes, nullptr, &setup});
    setup.gyros = gyros_of(gyros);
  }
  add_conflicts(robot_conflicts(setup, path), node, faults);
  finish_base(part(node, "base"), below(path, "base"), robot, faults);
  const Node& links = part(node, "links");
  if (!links.is_sequence()) {
    for (NameTable* table : {&robot.links, &robot.joint_names}) table->make_incomplete();
  }
  for (std::size_t i = 0; i + 1 < setup.bodies.size(); ++i)
    finish_link(links.items[i], item(below(path, "links"), i), setup.bodies[i + 1], robot, faults);
  check_parents(links, below(path, "links"), robot, faults);
  finish_end_effectors(part(node, "end_effectors"), below(path, "end_effectors"), robot, faults);
  finish_actuators(part(node, "wheels"), below(path, "wheels"), "wheel", setup.wheels.size(), faults);
  finish_actuators(part(node, "gyros"), below(path, "gyros"), "gyro", setup.gyros.size(), faults);
  finish_actuators(part(node, "thrusters"), below(path, "thrusters"), "thruster", setup.thrusters.size(), faults);
  doubt_inertia_points(node, path, setup, faults);
  order_joints(robot, sound_structure && faults.empty(), node.mark, faults);
  return robot;
}

}  // namespace grapnel
