#include <fmt/format.h>

#include <array>
#include <iterator>
#include <utility>

#include "grapnel/import/assembly_steps.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {
namespace {

std::string text_of(const Node* node) { return node && node->is_scalar() ? node->text : std::string(); }

// The items of a list below a key; none if there is no list.
std::vector<Node> taken_items(Node& mapping, std::string_view key) {
  Node* list = mapping.find(key);
  return list && list->is_sequence() ? std::move(list->items) : std::vector<Node>();
}

void append(Node& mapping, std::string_view key, std::vector<Node> items) {
  if (items.empty()) return;
  Node* list = mapping.find(key);
  if (!list || !list->is_sequence()) {
    put(mapping, key, sequence_node(items[0].mark));
    list = mapping.find(key);
  }
  list->items.insert(list->items.end(), std::make_move_iterator(items.begin()), std::make_move_iterator(items.end()));
}

// A body of the bus by its name; of the base if there is no name. Null if there is none.
Node* body_of(Node& bus, const std::string& name) {
  Node* base = bus.find("base");
  if (base && (name.empty() || text_of(base->find("name")) == name || (!base->find("name") && name == "base")))
    return base;
  Node* links = bus.find("links");
  if (!links) return nullptr;
  for (Node& link : links->items) {
    if (!name.empty() && text_of(link.find("name")) == name) return &link;
  }
  return nullptr;
}

std::vector<std::string> body_names(const Node& bus) {
  const Node* base = bus.find("base");
  const std::string base_name = base ? text_of(base->find("name")) : std::string();
  std::vector<std::string> names{base_name.empty() ? "base" : base_name};
  if (const Node* links = bus.find("links")) {
    for (const Node& link : links->items) names.push_back(text_of(link.find("name")));
  }
  return names;
}

// Converts poses in the frame of a base to the frame of the body that replaces it.
void move_pose(Node& holder, const Posed& X_LB, const Mark& mark) {
  if (!is_identity(X_LB)) put_pose(holder, X_LB * pose_in(holder), mark);
}

// Shapes of a base without mass go to the body that it is mounted on.
void move_shapes(Node& body, Node geometry, const Posed& X_LB) {
  std::vector<Node> shapes;
  if (geometry.is_sequence())
    shapes = std::move(geometry.items);
  else
    shapes.push_back(std::move(geometry));
  for (Node& shape : shapes) move_pose(shape, X_LB, shape.mark);
  Node* present = body.find("geometry");
  if (present && present->is_mapping()) {
    Node list = sequence_node(present->mark);
    list.items.push_back(std::move(*present));
    *present = std::move(list);
  }
  if (!present && shapes.size() == 1)
    put(body, "geometry", std::move(shapes[0]));
  else
    append(body, "geometry", std::move(shapes));
}

// A base as a link on a fixed joint.
Node fixed_link(Node base, const std::string& parent, const Posed& X_LB, const std::string& joint_name,
                const Mark& mark) {
  Node link = mapping_node(base.mark);
  link.comment = base.comment;
  put(link, "name", text_node(text_of(base.find("name")).empty() ? "base" : text_of(base.find("name")), base.mark));
  put(link, "parent", text_node(parent, mark));
  Node joint = mapping_node(mark);
  put(joint, "name", text_node(joint_name, mark));
  put(joint, "type", text_node("fixed", mark));
  if (!is_identity(X_LB)) put(joint, "origin", pose_node(X_LB, mark));
  put(link, "joint", std::move(joint));
  for (NodeEntry& entry : base.entries) {
    if (entry.key != "name" && entry.key != "mode") link.entries.push_back(std::move(entry));
  }
  return link;
}

}  // namespace

void mount_robot(Node& bus, Node robot, const Mount& mount, const std::string& joint, FaultList& faults) {
  Node* body = body_of(bus, mount.link);
  Node* base = robot.find("base");
  if (!base) return;  // has been reported
  if (!body) {
    if (bus.find("base"))
      faults.add(mount.mark, fmt::format("the bus has no link {}{}", in_quotes(mount.link),
                                         suggestion(mount.link, body_names(bus), "links")));
    return;
  }
  constexpr std::array<std::pair<const char*, const char*>, 5> kOfBase{{{"wheels", "reaction wheels"},
                                                                        {"wheel_array", "reaction wheels"},
                                                                        {"gyros", "control moment gyros"},
                                                                        {"gyro_array", "control moment gyros"},
                                                                        {"thrusters", "thrusters"}}};
  for (const auto& [key, what] : kOfBase) {
    if (const Node* list = robot.find(key); list && !(list->items.empty() && list->entries.empty()))
      faults.add(list->mark,
                 fmt::format("an arm on a bus has {}; only the bus's base can: move them into the bus's file", what));
  }
  const std::string given = text_of(body->find("name"));
  const std::string carrier = given.empty() ? "base" : given, base_name = text_of(base->find("name"));
  std::vector<Node> links = taken_items(robot, "links"), end_effectors = taken_items(robot, "end_effectors");
  if (base->find("mass")) {
    links.insert(links.begin(), fixed_link(std::move(*base), carrier, mount.X_LM, joint, mount.mark));
  } else {
    const auto hangs_on_base = [&](Node& one, const char* key) {
      Node* parent = one.find(key);
      if (text_of(parent) != base_name) return false;
      *parent = text_node(carrier, parent->mark);
      return true;
    };
    for (Node& link : links) {
      Node* carried_by = link.find("joint");
      if (!hangs_on_base(link, "parent") || !carried_by || is_identity(mount.X_LM)) continue;
      const Node* origin = carried_by->find("origin");
      Node moved = origin ? *origin : mapping_node(link.mark);
      move_pose(moved, mount.X_LM, moved.mark);
      put(*carried_by, "origin", std::move(moved));
    }
    for (Node& one : end_effectors) {
      if (hangs_on_base(one, "link")) move_pose(one, mount.X_LM, one.mark);
    }
    if (!base->comment.empty()) body->comment += (body->comment.empty() ? "" : "\n") + base->comment;
    if (Node* geometry = base->find("geometry")) move_shapes(*body, std::move(*geometry), mount.X_LM);
  }
  append(bus, "links", std::move(links));
  append(bus, "end_effectors", std::move(end_effectors));
  append(bus, "tendons", taken_items(robot, "tendons"));
}

void prefix_names(Node& robot, const std::string& prefix) {
  if (prefix.empty()) return;
  const auto rename = [&](Node* mapping, const char* key) {
    Node* name = mapping ? mapping->find(key) : nullptr;
    if (name && name->is_scalar() && !name->text.empty()) *name = text_node(prefix + name->text, name->mark);
  };
  if (Node* base = robot.find("base"); base && base->is_mapping()) {
    if (!base->find("name")) put(*base, "name", text_node("base", base->mark));
    rename(base, "name");
  }
  if (Node* links = robot.find("links")) {
    for (Node& link : links->items) {
      rename(&link, "name"), rename(&link, "parent");
      Node* joint = link.find("joint");
      rename(joint, "name");
      if (Node* mimic = joint ? joint->find("mimic") : nullptr) {
        rename(mimic, "joint");
        for (Node& term : mimic->items) rename(&term, "joint");
      }
    }
  }
  if (Node* frames = robot.find("end_effectors")) {
    for (Node& frame : frames->items) rename(&frame, "name"), rename(&frame, "link");
  }
  if (Node* tendons = robot.find("tendons")) {
    for (Node& tendon : tendons->items) {
      rename(&tendon, "name");
      Node* joints = tendon.find("joints");
      for (std::size_t k = 0; joints && k < joints->items.size(); ++k) rename(&joints->items[k], "joint");
    }
  }
}

}  // namespace grapnel
