#include "grapnel/scenario/read_robot.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "grapnel/scenario/descriptions.hpp"
#include "grapnel/scenario/plausibility.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

void read_joint(const Node& node, const std::string& path, JointDescription& joint, FaultList& faults) {
  if (node.find("axis")) joint.axis = unit_vector_at(node, "axis", path, faults);
  if (joint.limits.lower <= joint.limits.upper) return;
  faults.add(part(part(node, "limits"), "lower").mark,
             fmt::format("{}: lower limit {} is above upper limit {}", below(path, "limits"), joint.limits.lower,
                         joint.limits.upper));
  joint.limits.lower = -std::numeric_limits<double>::infinity();
  joint.limits.upper = std::numeric_limits<double>::infinity();
}

// Inertia and shape, the same for base and links; mass and centre of mass have been read.
void read_body(const Node& node, const std::string& path, const Meshes& meshes, BodyDescription& body,
               RobotSetup& setup, FaultList& faults) {
  body.inertia = inertia_at(node, path, faults);
  const Geometry geometry = geometry_at(node, path, meshes, faults);
  check_com(node, path, body.mass, body.com, body.inertia, faults);
  doubt_inertia(node, path, body.mass, body.com, body.inertia, geometry, faults);
  if (geometry.shape != Geometry::Shape::none) setup.geometry.emplace_back(body.name, geometry);
}

void read_base(const Node& node, const std::string& path, const Meshes& meshes, ReadRobot& robot, FaultList& faults) {
  robot.links.add_from(node, path, faults);
  RobotSetup& setup = robot.setup;
  BodyDescription& base = setup.bodies.emplace_back();
  base.mass = 1;  // where a fault leaves it open
  read_members(node, "robot.base", &setup);
  base.name = setup.base;
  base.joint.type = setup.base_mode == RobotSetup::Base::fixed ? JointType::fixed : JointType::free;
  read_body(node, path, meshes, base, setup, faults);
}

void read_link(const Node& node, const std::string& path, const Meshes& meshes, ReadRobot& robot, FaultList& faults) {
  robot.links.add_from(node, path, faults);
  const Node& joint = part(node, "joint");
  const std::string joint_path = below(path, "joint");
  robot.joint_names.add_from(joint, joint_path, faults);
  BodyDescription link;
  link.mass = 1;  // where a fault leaves it open
  read_members(node, "robot.links", &link);
  read_joint(joint, joint_path, link.joint, faults);
  link.X_PF = pose_of(part(joint, "origin"), below(joint_path, "origin"), faults);
  read_body(node, path, meshes, link, robot.setup, faults);
  const auto type =
      choice_named(field_named(description_at("robot.links.joint"), "type")->type(), text_at(joint, "type"));
  if (!type) robot.types_known = false;
  if (type && link.joint.type == JointType::fixed) robot.fixed_joints.insert(link.joint.name);
  if (const Node* rating = joint.find("rating"))
    read_members(*rating, "robot.links.joint.rating",
                 &robot.setup.ratings.emplace_back(link.joint.name, LoadRating{}).second);
  robot.setup.bodies.push_back(std::move(link));
}

// The cycles among parents, each as its members in order. A link that merely hangs on a cycle is no member.
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

// Parents that exist and do not lead back to the link itself.
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
    // Between two of one name nobody can say whose parent is meant.
    if (it == cycle_of.end() || robot.links.is_duplicate(name)) continue;
    faults.add(part(link, "parent").mark,
               fmt::format("{}: the parents of {} form a cycle: {}", item(path, i), in_quotes(name), it->second));
  }
}

void read_end_effectors(const Node& list, const std::string& path, ReadRobot& robot, FaultList& faults) {
  if (list.kind != Node::Kind::null && !list.is_sequence()) robot.end_effectors.make_incomplete();
  for (std::size_t i = 0; i < list.items.size(); ++i) {
    const Node& node = list.items[i];
    const std::string here = item(path, i);
    robot.end_effectors.add_from(node, here, faults);
    EndEffectorSetup end_effector;
    read_members(node, "robot.end_effectors", &end_effector);
    robot.links.expect(end_effector.body, part(node, "link").mark, here, faults);
    end_effector.X_BE = pose_of(node, here, faults);
    if (node.find("approach_axis")) end_effector.approach_axis = unit_vector_at(node, "approach_axis", here, faults);
    doubt_approach_axis(node, here, end_effector, faults);
    robot.setup.end_effectors.push_back(std::move(end_effector));
  }
}

// The joint order is the model's; without a model the file's, for what does not depend on the order.
void order_joints(ReadRobot& robot, bool faultless, const Mark& mark, FaultList& faults) {
  if (faultless) {
    try {
      const Model model = build_model(robot.setup);
      for (const int body : model.joints()) robot.joints.push_back(model.bodies()[body].description.joint);
      robot.order_known = true;
    } catch (const ModelError& error) {
      for (const std::string& fault : error.faults()) faults.add(mark, fault);
    }
  }
  if (!robot.order_known) {
    for (const BodyDescription& body : robot.setup.bodies) {
      if (has_one_axis(body.joint.type) && !body.joint.name.empty()) robot.joints.push_back(body.joint);
    }
  }
  for (std::size_t i = 0; i < robot.joints.size(); ++i) robot.joint_index.emplace(robot.joints[i].name, i);
}

}  // namespace

Model build_model(const RobotSetup& setup) {
  ModelBuilder builder;
  for (const BodyDescription& body : setup.bodies) builder.add(body);
  for (const FrameDescription& frame : setup.end_effectors) builder.add(frame);
  return builder.build();
}

ReadRobot read_robot(const Node& node, const std::string& path, const Meshes& meshes, FaultList& faults) {
  ReadRobot robot;
  robot.setup.name = text_at(node, "name");
  const Node& links = part(node, "links");
  // The structural check has run on the same list of faults: any of its findings makes the model doubtful.
  const bool sound_structure = faults.empty();
  read_base(part(node, "base"), below(path, "base"), meshes, robot, faults);
  if (!links.is_sequence()) {
    for (NameTable* table : {&robot.links, &robot.joint_names}) table->make_incomplete();
  }
  for (std::size_t i = 0; i < links.items.size(); ++i)
    read_link(links.items[i], item(below(path, "links"), i), meshes, robot, faults);
  check_parents(links, below(path, "links"), robot, faults);
  read_end_effectors(part(node, "end_effectors"), below(path, "end_effectors"), robot, faults);
  order_joints(robot, sound_structure && faults.empty(), node.mark, faults);
  return robot;
}

}  // namespace grapnel
