#include <fmt/format.h>

#include <algorithm>

#include "grapnel/problem/flexible_bodies.hpp"
#include "grapnel/scenario/actuator_arrays.hpp"
#include "grapnel/scenario/joint_values.hpp"
#include "grapnel/scenario/plausibility.hpp"
#include "grapnel/scenario/sections.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

void doubt_body(const Node& node, const std::string& path, const BodyDescription& body, const RobotSetup& setup,
                FaultList& faults) {
  doubt_inertia(node, path, {body.mass, body.com, body.inertia}, shapes_of(setup, body.name), faults);
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
    const Type& type = field.type();
    const std::string here = below(path, field.key);
    if (type.kind == Type::Kind::structure || (field.is_one_or_list && value->is_mapping())) {
      check_joint_units(*value, type.kind == Type::Kind::structure ? type : type.of(), joint, here, faults);
    } else if (field.is_one_or_list) {
      for (std::size_t i = 0; i < value->items.size(); ++i)
        check_joint_units(value->items[i], type.of(), joint, item(here, i), faults);
    } else {
      check_unit(*value, field.unit, joint, here, faults);
    }
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
  if (type) check_joint_units(joint, joint_description(), link.joint, below(path, "joint"), faults);
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

// Checks the names of tendons, and the units of their moment arms by the types of the joints.
void finish_tendons(const Node& list, const std::string& path, const ReadRobot& robot, FaultList& faults) {
  const std::vector<TendonSetup>& tendons = robot.setup.tendons;
  finish_actuators(list, path, "tendon", tendons.size(), faults);
  const std::string_view unit = field_named(tendon_arm_description(), "arm")->unit;
  for (std::size_t i = 0; i < tendons.size() && i < list.items.size(); ++i) {
    const Node& joints = part(list.items[i], "joints");
    for (std::size_t k = 0; k < tendons[i].joints.size() && k < joints.items.size(); ++k) {
      const std::string here = below(item(below(item(path, i), "joints"), k), "arm");
      for (const BodyDescription& body : robot.setup.bodies) {
        if (body.joint.name == tendons[i].joints[k].joint && has_one_axis(body.joint.type))
          check_unit(part(joints.items[k], "arm"), unit, body.joint, here, faults);
      }
    }
  }
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
  finish_tendons(part(node, "tendons"), below(path, "tendons"), robot, faults);
  for (const NodeEntry& kind : part(node, "actuators").entries)
    finish_actuators(kind.value, below(below(path, "actuators"), kind.key), "actuator", kind.value.items.size(),
                     faults);
  doubt_inertia_points(node, path, setup, faults);
  order_joints(robot, sound_structure && faults.empty(), node.mark, faults);
  return robot;
}

}  // namespace grapnel
