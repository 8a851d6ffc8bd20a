#include <fmt/format.h>

#include <algorithm>

#include "grapnel/scenario/plausibility.hpp"
#include "grapnel/scenario/ready_made.hpp"
#include "grapnel/scenario/sections.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

struct TargetStateKeys;
struct PanelOriginKeys;

}  // namespace

// ---- What "targets" and "grasps" hold ----

template <>
struct Described<GraspPoint> {
  using T = GraspPoint;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::name>("name", "", "Name, unique within the target.").required(),
      found<[](T& t) -> Vector3d& { return t.X_TG.p; }>("position", "m", "Position in the target's frame."),
      quaternion_of<&T::X_TG>(),
      rpy_of<&T::X_TG>(),
      field<&T::approach_direction>("approach_direction", "",
                                    "Unit vector in the target's frame: approach direction of the end-effector.")
          .as("unit vector")
          .optional(),
      field<&T::normal>(
          "normal", "",
          "Unit vector in the target's frame: outward normal of the surface, for grasps with model contact. Absent: "
          "opposite to approach_direction, else that of a target whose only shape is a sphere.")
          .as("unit vector")
          .optional(),
  });
  static constexpr auto rules = std::to_array<Rule>({not_both("quaternion_wxyz, rpy")});
  static constexpr Type type = structure<T>("grasp_point", "", fields, rules);
};

template <>
struct Described<TargetStateKeys> {
  using T = TargetSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::given_at>(
          "at", "",
          "Time of the state. start: t = 0. capture: the instant of capture. In between the target moves without "
          "torque, except for loads and the field of an `orbit`. Without an approach both are t = 0."),
      found<[](T& t) -> Vector3d& { return t.X_WT.p; }>("position", "m", "Position of the target frame's origin, in W.")
          .up_to(1e+09)
          .required(),
      quaternion_of<&T::X_WT>(),
      rpy_of<&T::X_WT>(),
      found<[](T& t) -> Vector3d& { return t.V_WT.angular; }>("angular_velocity", "rad/s", "Angular velocity, in W."),
      found<[](T& t) -> Vector3d& { return t.V_WT.linear; }>(
          "velocity", "m/s", "Velocity of the target frame's origin (not of the centre of mass), in W."),
  });
  static constexpr auto rules = std::to_array<Rule>({not_both("quaternion_wxyz, rpy")});
  static constexpr Type type = structure<T>("target_state", "State of the target.", fields, rules);
};

template <>
struct Described<PanelOriginKeys> {
  using T = PanelSetup;
  static constexpr auto fields = std::to_array<Field>({
      found<[](T& t) -> Vector3d& { return t.X_TP.p; }>("position", "m", "Position of the panel's frame."),
      quaternion_of<&T::X_TP>(),
      rpy_of<&T::X_TP>(),
  });
  static constexpr auto rules = std::to_array<Rule>({not_both("quaternion_wxyz, rpy")});
  static constexpr Type type =
      structure<T>("panel_origin", "The panel's frame, where it is mounted, in the target's frame.", fields, rules);
};

template <>
struct Described<PanelSetup> {
  using T = PanelSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::name>("name", "", "Name, unique within the target.").required(),
      group<T, PanelOriginKeys>("origin", ""),
      field<&T::mass>("mass", "kg", "Mass of the panel.").above(0).required(),
      field<&T::com>("com", "m", kComText),
      field<&T::inertia>("inertia", "kg m^2", kInertiaText).as("inertia").required(),
      field<&T::hinge_axis>("hinge_axis", "", "Unit vector in the panel's frame: rotation axis of the panel.")
          .as("unit vector")
          .optional(),
      field<&T::hinge>(&spring_description, "hinge",
                       "Spring and damper of the hinge, as a joint's `spring`. Absent: the panel is fixed.")
          .optional(),
      field<&T::beam>(&beam_description, "beam", "Makes the panel flexible along a beam, in the panel's frame.")
          .optional(),
      field<&T::modes>(&vibrations_description, "modes", "Flexible modes in place of a beam.").items(0, 50),
      field<&T::geometry>(&shapes_description, "geometry", kShapesText).one_or_list(kShapesTitles).optional(),
  });
  static constexpr auto rules = std::to_array<Rule>({
      needs("hinge", "hinge_axis"),
      needs("hinge_axis", "hinge"),
      not_both("beam, modes"),
  });
  static constexpr Type type = structure<T>(
      "panel", "An appendage of the target, optionally flexible or on a hinge, without a drive.", fields, rules);
};

template <>
struct Described<TargetSetup> {
  using T = TargetSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::name>("name", "", "Name, unique among targets. Absent: that of the ready-made target.").required(),
      key<std::string>("ready_made", "",
                       "Name of a ready-made target: its `mass`, `com`, `inertia`, `geometry` and grasp_points apply "
                       "unless given here. `grapnel init --list` prints the names.")
          .optional(),
      field<&T::mass>("mass", "kg", "Mass, including panels.").above(0).required(),
      field<&T::inertia>("inertia", "kg m^2", kInertiaText).as("inertia").required(),
      field<&T::com>("com", "m", kComText),
      field<&T::geometry>(&shapes_description, "geometry", kShapesText).one_or_list(kShapesTitles).optional(),
      group<T, TargetStateKeys>("state", "").required(),
      field<&T::estimate>(&target_estimate_description, "estimate", "").optional(),
      field<&T::panels>("panels", "", "Panels and booms of the target that may be flexible or hinged.").items(0, 100),
      field<&T::grasp_points>("grasp_points", "", "Named frames on the target where an end-effector can hold it."),
  });
  static constexpr Type type = structure<T>("target", "", fields);
};

template <>
struct Described<GraspLimits> {
  using T = GraspLimits;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::force>("force", "N", "Largest force between gripper and target. Absent: any.").above(0).optional(),
      field<&T::moment>("moment", "N m", "Largest moment between them, about the grasp point. Absent: any.")
          .above(0)
          .optional(),
      field<&T::combined>("combined", "",
                          "ellipsoid: the squares of force and moment, each relative to its limit, sum to at most 1. "
                          "components: each is at most its limit."),
      field<&T::beyond>(
          "beyond", "",
          "opens: beyond its limits the grasp opens and the gripper loses the target. slips: force and "
          "moment stay at the limits, times `kinetic_ratio`, and gripper and target move relative to each "
          "other until they are at rest; a part without a limit does not slip, nor one below a separate limit."),
      field<&T::kinetic_ratio>("kinetic_ratio", "1", "Limits while the grasp slips, relative to those at rest.")
          .above(0)
          .at_most(1),
      field<&T::lost_distance>(
          "lost_distance", "m",
          "Displacement of the gripper relative to the target since closing, beyond which a grasp that slips is lost. "
          "Absent: any.")
          .above(0)
          .optional(),
      field<&T::lost_angle>("lost_angle", "rad", "The same for its rotation. Absent: any.").above(0).optional(),
  });
  static constexpr auto rules = std::to_array<Rule>({not_empty()});
  static constexpr Type type = structure<T>(
      "holds",
      "Largest load that the grasp holds; beyond it the grasp opens or slips. Not for model contact. Absent: any load.",
      fields, rules);
};

template <>
struct Described<GraspSetup> {
  using T = GraspSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::end_effector>("end_effector", "", "End-effector of the robot. Each has one grasp.").required(),
      field<&T::target>("target", "", "Name of the target.").required(),
      field<&T::grasp_point>("point", "", "Name of a grasp point of that target.").required(),
      field<&T::model>(
          "model", "",
          "rigid: holds position and the orientation found at contact (6 rows). hinge: leaves one rotation free (5). "
          "point: holds the position (3). contact: does not hold; the end-effector touches and rebounds, and the "
          "target is free again. It needs impact.law restitution, friction or compliant, and a surface normal.")
          .as("one of rigid, hinge, point, contact")
          .by_default("\"rigid\""),
      field<&T::hinge_axis>("axis", "", "Unit vector of the hinge in the end-effector's frame. Other models ignore it.")
          .as("unit vector")
          .optional()
          .when<[](const T& t) { return t.model == GraspModel::hinge; }>(),
      field<&T::orientation>(
          "orientation", "",
          "Required orientation of the end-effector at the grasp. free: any. axis: its approach_axis along the point's "
          "approach_direction, free to rotate about it; both vectors are required, also where this is the default. "
          "pose: its frame is that of the grasp point. Absent: axis if the point has an approach_direction, else free.")
          .optional(),
      field<&T::closes_at>(
          "closes_at", "s",
          "Closing time, from the start of the scenario; at most the end of post_impact. Needs `impact`, and after the "
          "approach post_impact. Absent: with the others, at the end of the approach.")
          .above(0)
          .optional(),
      key<bool>("closes_on_arrival", "",
                "Whether it closes as soon as its end-effector is within its envelope, which is required, in the "
                "approach or after it. Needs `impact`.")
          .by_default("false"),
      key<bool>("closes_when_settled", "",
                "Whether it closes as soon as its target is settled in the gripper, as `stages` state it, wherever the "
                "end-effector is then. Needs `impact`, `post_impact` and `stages`.")
          .by_default("false"),
      field<&T::holds>("holds", "", "").optional(),
      field<&T::closes_again_at>("closes_again_at", "s",
                                 "Later closing times, increasing, from the start of the scenario. At each of them the "
                                 "grasp closes if it does not hold then: after a miss, a loss (`holds`) or a release. "
                                 "Each is after the first closing and at most the end of post_impact.")
          .above(0)
          .items(0, 1000),
      field<&T::closes_again_on_arrival>(
          "closes_again_on_arrival", "",
          "Whether it closes again, after a miss, a loss or a release, as soon as its end-effector is within its "
          "envelope, after having been outside. Needs an envelope and `impact`."),
      field<&T::relative_velocity>(
          "relative_velocity", "m/s",
          "Relative velocity at arrival, end-effector minus grasp point, in W: added to the rates of "
          "approach.final_rates.match. Not with given final rates, a trajectory, pieces or straight_in. Absent: zero.")
          .optional(),
      field<&T::relative_angular_velocity>(
          "relative_angular_velocity", "rad/s",
          "Relative angular velocity at arrival, likewise; needs `final_rates: {match: twist}`. Absent: zero.")
          .optional(),
  });
  static constexpr auto rules = std::to_array<Rule>({
      not_both("closes_at, closes_on_arrival"),
      not_both("closes_at, closes_when_settled"),
      not_both("closes_on_arrival, closes_when_settled"),
      when("model", "hinge").require("axis"),
  });
  static constexpr Type type = structure<T>("grasp", "", fields, rules);
};

const Type& targets_description() { return type_of<std::vector<TargetSetup>>(); }
const Type& grasps_description() { return type_of<std::vector<GraspSetup>>(); }

// ---- How they are read ----

namespace {

void finish_target(const Node& node, const std::string& path, const TargetSetup& target, Reading& reading) {
  FaultList& faults = reading.faults;
  reading.targets.add_from(node, path, faults);
  doubt_target_inertia(node, path, target, faults);
  NameTable points("grasp point");
  const Node& list = part(node, "grasp_points");
  const std::string ready_made = text_at(node, "ready_made");
  const bool is_unknown = !ready_made.empty() && !find_ready_made(ReadyMade::Kind::targets, ready_made);
  if (!list.is_sequence() || is_unknown) points.make_incomplete();
  for (std::size_t i = 0; i < list.items.size(); ++i)
    points.add_from(list.items[i], item(below(path, "grasp_points"), i), faults);
  doubt_grasp_points(node, path, target, faults);
  reading.points.emplace(target.name, std::move(points));
}

// The required orientation of the end-effector, and whether end-effector and grasp point have the required axes.
GraspSetup::Orientation orientation_of(const Node& node, const std::string& path, const GraspSetup& grasp,
                                       Reading& reading) {
  using Orientation = GraspSetup::Orientation;
  const GraspPoint* point = reading.grasp_point(grasp);
  const EndEffectorSetup* end_effector = reading.end_effector(grasp.end_effector);
  const std::string given = text_at(node, "orientation");
  if (given == "free" || given == "pose") return grasp.orientation;
  if (given == "axis") {
    const Mark& mark = part(node, "orientation").mark;
    if (point && !point->approach_direction) {
      reading.faults.add(
          mark, fmt::format("{}.orientation: axis needs an 'approach_direction' at grasp point {} of target {}", path,
                            in_quotes(point->name), in_quotes(grasp.target)));
    }
    if (end_effector && !end_effector->approach_axis) {
      reading.faults.add(mark, fmt::format("{}.orientation: axis needs an 'approach_axis' at end-effector {}", path,
                                           in_quotes(end_effector->name)));
    }
    return Orientation::axis;
  }
  if (node.find("orientation") || !point || !point->approach_direction) return Orientation::free;
  if (end_effector && !end_effector->approach_axis) {
    reading.faults.add(part(node, "end_effector").mark,
                       fmt::format("{}: grasp point {} has an approach_direction, but end-effector {} has no "
                                   "approach_axis; add one, or set orientation: free for the grasp",
                                   path, in_quotes(point->name), in_quotes(end_effector->name)));
  }
  return Orientation::axis;
}

// Whether the scenario has a capture; otherwise targets may move freely.
bool is_capture(const Reading& reading) {
  const Node& approach = part(reading.root, "approach");
  return reading.root.entry("grasps") || reading.root.entry("impact") || approach.entry("plan") ||
         part(approach, "final_rates").entry("match");
}

// Whether a rule of `contacts` selects the target or one of its panels.
bool may_touch(const CaptureProblem& problem, std::size_t target) {
  const auto is_target = [&](const BodyName& body) { return body.target == target; };
  return std::ranges::any_of(problem.contacts, [&](const ContactPairsSetup& rule) {
    return rule.all || std::ranges::any_of(rule.first_group, is_target) ||
           std::ranges::any_of(rule.second_group, is_target) || std::ranges::any_of(rule.pairs, [&](const auto& pair) {
             return is_target(pair.first) || is_target(pair.second);
           });
  });
}

}  // namespace

void finish_targets(Reading& reading) {
  const Node& list = part(reading.root, "targets");
  if (!list.is_sequence()) reading.targets.make_incomplete();
  for (std::size_t i = 0; i < reading.problem.targets.size(); ++i)
    finish_target(list.items[i], item("targets", i), reading.problem.targets[i], reading);
}

void finish_grasps(Reading& reading) {
  FaultList& faults = reading.faults;
  const Node& list = part(reading.root, "grasps");
  for (std::size_t i = 0; i < reading.problem.grasps.size(); ++i) {
    GraspSetup& grasp = reading.problem.grasps[i];
    const Node& node = list.items[i];
    const std::string path = item("grasps", i);
    grasp.orientation = orientation_of(node, path, grasp, reading);
    if (node.find("closes_at"))
      grasp.closes = GraspSetup::Closes::at_time;
    else if (boolean_at(node, "closes_on_arrival"))
      grasp.closes = GraspSetup::Closes::on_arrival;
    else if (boolean_at(node, "closes_when_settled"))
      grasp.closes = GraspSetup::Closes::when_settled;
    reading.robot.end_effectors.expect(grasp.end_effector, part(node, "end_effector").mark, path, faults);
    reading.targets.expect(grasp.target, part(node, "target").mark, path, faults);
    if (const auto it = reading.points.find(grasp.target); it != reading.points.end())
      it->second.expect(grasp.grasp_point, part(node, "point").mark, below(path, "point"), faults);
  }
}

void check_all_targets_used(Reading& reading) {
  const Node& list = part(reading.root, "grasps");
  if (!is_capture(reading) || (list.kind != Node::Kind::null && !list.is_sequence())) return;
  std::set<std::string_view> grasped;
  for (const GraspSetup& grasp : reading.problem.grasps) {
    // A misspelt target name in a grasp may refer to the target that appears to have no grasp.
    if (grasp.target.empty() || !reading.targets.contains(grasp.target)) return;
    grasped.insert(grasp.target);
  }
  const Node& targets = part(reading.root, "targets");
  for (std::size_t i = 0; i < targets.items.size(); ++i) {
    const std::string name = text_at(targets.items[i], "name");
    if (name.empty() || grasped.contains(name) || (!grasped.empty() && may_touch(reading.problem, i))) continue;
    const bool contacts = reading.root.entry("contacts");
    reading.faults.add(part(targets.items[i], "name").mark,
                       fmt::format("no grasp{} refers to target {}; add a grasp{} or remove the target",
                                   contacts ? " and no contact" : "", in_quotes(name), contacts ? ", a contact," : ""));
  }
}

}  // namespace grapnel
