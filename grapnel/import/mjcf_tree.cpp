#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <set>

#include "grapnel/import/mjcf_model.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

constexpr std::array kParts{"body",   "frame", "inertial",  "joint",    "freejoint", "geom",   "site",
                            "camera", "light", "composite", "flexcomp", "replicate", "attach", "plugin"};

class TreeReader {
 public:
  TreeReader(MjcfContext& context, MjcfTree& tree) : context_(context), tree_(tree) {}

  // Where an element stands: in a body, perhaps inside of frames.
  struct Place {
    int body = -1;
    Posed X_BF = Posed::identity();
    std::string childclass;
    bool in_frame = false;
  };

  void read(const MjcfElement& around, const Place& place) {
    for (const MjcfElement& child : around.children) read_child(child, place);
  }

  // Bodies without a name get one that no other has, when all names are known.
  void name_bodies() {
    int unnamed = 0;
    for (MjcfBody& body : tree_.bodies) {
      if (!body.name.empty()) continue;
      do {
        body.name = fmt::format("body_{}", ++unnamed);
      } while (!names_.insert(body.name).second);
    }
    if (unnamed > 0)
      context_.decide(tree_.world_mark,
                      fmt::format("{} without a name: called body_1, body_2, … in the order of the file",
                                  unnamed == 1 ? "one body is" : fmt::format("{} bodies are", unnamed)));
  }

 private:
  MjcfPart part(const MjcfElement& element, const std::string& kind, const Place& place) {
    return {context_.defaults.attributes(element, kind, place.childclass, context_.faults), place.X_BF};
  }

  void read_child(const MjcfElement& child, const Place& place) {
    const std::string tag = child.tag();
    if (tag == "body") {
      read_body(child, place);
    } else if (tag == "frame") {
      read_frame(child, place);
    } else if (tag == "camera" || tag == "light") {
      context_.passed_over.element(child, "only visual, not read");
    } else if (std::ranges::find(kParts, tag) == kParts.end()) {
      context_.fault(child.mark(), fmt::format("<{}> is not allowed in a body{}", tag,
                                               suggestion(tag, {kParts.begin(), kParts.end()})));
    } else if (place.body < 0) {
      read_part_of_world(child);
    } else {
      read_part(child, place, tree_.bodies[place.body]);
    }
  }

  void read_part(const MjcfElement& child, const Place& place, MjcfBody& body) {
    const std::string tag = child.tag();
    if (tag == "inertial") {
      context_.passed_over.check_attributes(child, context_.faults);
      body.inertials.push_back({{{&child}}, place.X_BF});
    } else if (tag == "joint" || tag == "freejoint") {
      body.joints.push_back(tag == "joint" ? part(child, tag, place) : MjcfPart{{{&child}}, place.X_BF});
      if (place.in_frame)
        context_.fault(child.mark(), "a joint inside of <frame> is not supported: put it directly into its body");
    } else if (tag == "geom") {
      context_.passed_over.check_attributes(child, context_.faults);
      body.geoms.push_back(part(child, tag, place));
    } else if (tag == "site") {
      context_.passed_over.check_attributes(child, context_.faults);
      body.sites.push_back(part(child, tag, place));
    } else {
      body.refused.push_back(&child);
    }
  }

  void read_part_of_world(const MjcfElement& child) {
    const std::string tag = child.tag();
    if (tag == "geom" || tag == "site") {
      context_.passed_over.check_attributes(child, context_.faults);
      context_.passed_over.element(child, "in the worldbody: surroundings, not part of the robot");
    } else {
      context_.fault(child.mark(), fmt::format("<{}> in the worldbody {}", tag,
                                               tag == "joint" || tag == "freejoint" || tag == "inertial"
                                                   ? "is not allowed: the world neither moves nor has a mass"
                                                   : "is not supported"));
    }
  }

  void read_frame(const MjcfElement& element, Place place) {
    context_.passed_over.check_attributes(element, context_.faults);
    context_.defaults.check_class(element, "childclass", context_.faults);
    if (element.has("childclass")) place.childclass = element.text("childclass");
    place.X_BF = place.X_BF * mjcf_pose({{&element}}, context_.compiler, context_.faults);
    place.in_frame = true;
    read(element, place);
  }

  void read_body(const MjcfElement& element, const Place& around) {
    context_.passed_over.check_attributes(element, context_.faults);
    context_.defaults.check_class(element, "childclass", context_.faults);
    MjcfBody body;
    body.name = element.text("name");
    if (!body.name.empty() && !names_.insert(body.name).second)
      context_.fault(element.mark("name"), fmt::format("there are two bodies {}", in_quotes(body.name)));
    body.element = &element;
    body.parent = around.body;
    body.X_PB = around.X_BF * mjcf_pose({{&element}}, context_.compiler, context_.faults);
    if (MjcfAttributes{{&element}}.flag("mocap", false, context_.faults))
      context_.passed_over.element(element, "mocap: taken as a body that does not move");
    tree_.bodies.push_back(std::move(body));
    Place place;
    place.body = static_cast<int>(tree_.bodies.size()) - 1;
    place.childclass = element.has("childclass") ? element.text("childclass") : around.childclass;
    read(element, place);
  }

  MjcfContext& context_;
  MjcfTree& tree_;
  std::set<std::string> names_{"world"};
};

// A body on the world with its subtree.
struct Trunk {
  int root;
  std::vector<int> bodies;
  bool is_free = false;     // its root has a free joint
  bool has_joints = false;  // besides
};

bool is_free_joint(const MjcfPart& joint) {
  return joint.element().tag() == "freejoint" || joint.attributes.text("type", "hinge") == "free";
}

std::vector<Trunk> trunks_of(const MjcfTree& tree) {
  std::vector<Trunk> trunks;
  std::vector<std::size_t> trunk_of(tree.bodies.size());
  for (std::size_t i = 0; i < tree.bodies.size(); ++i) {
    const MjcfBody& body = tree.bodies[i];
    if (body.parent < 0) trunks.push_back({static_cast<int>(i), {}});
    trunk_of[i] = body.parent < 0 ? trunks.size() - 1 : trunk_of[body.parent];
    Trunk& trunk = trunks[trunk_of[i]];
    trunk.bodies.push_back(static_cast<int>(i));
    for (const MjcfPart& joint : body.joints) {
      const bool floats = body.parent < 0 && is_free_joint(joint);
      (floats ? trunk.is_free : trunk.has_joints) = true;
    }
  }
  return trunks;
}

std::string names_of(const MjcfTree& tree, const std::vector<const Trunk*>& trunks) {
  std::vector<std::string> names;
  names.reserve(trunks.size());
  for (const Trunk* trunk : trunks) names.push_back(tree.bodies[trunk->root].name);
  return some_of(names);
}

std::vector<const Trunk*> those(const std::vector<Trunk>& trunks, bool (*wanted)(const Trunk&)) {
  std::vector<const Trunk*> result;
  for (const Trunk& trunk : trunks) {
    if (wanted(trunk)) result.push_back(&trunk);
  }
  return result;
}

// The trees of the robot; empty after an error.
std::vector<const Trunk*> chosen_trunks(const MjcfTree& tree, const std::vector<Trunk>& trunks, MjcfContext& context) {
  const auto free_with_joints = those(trunks, [](const Trunk& t) { return t.is_free && t.has_joints; });
  const auto on_world = those(trunks, [](const Trunk& t) { return !t.is_free && t.has_joints; });
  const auto free = those(trunks, [](const Trunk& t) { return t.is_free; });
  const auto ambiguous = [&](const std::vector<const Trunk*>& several, const char* what) {
    context.fault(tree.bodies[several[1]->root].element->mark(),
                  fmt::format("bodies {} {}, so the robot is ambiguous; keep one of them in the file",
                              names_of(tree, several), what));
    return std::vector<const Trunk*>{};
  };
  if (free_with_joints.size() > 1) return ambiguous(free_with_joints, "float and carry joints");
  if (free_with_joints.size() == 1) return free_with_joints;
  if (!on_world.empty()) return on_world;
  if (free.size() > 1) return ambiguous(free, "float");
  if (free.size() == 1) return free;
  const auto all = those(trunks, [](const Trunk&) { return true; });
  if (all.size() > 1) return ambiguous(all, "do not move");
  return all;
}

}  // namespace

MjcfTree read_mjcf_tree(const MjcfElement& root, MjcfContext& context) {
  MjcfTree tree;
  tree.world_mark = root.mark();
  TreeReader reader(context, tree);
  bool found = false;
  for (const MjcfElement& section : root.children) {
    if (section.tag() != "worldbody") continue;
    if (!found) tree.world_mark = section.mark();
    found = true;
    reader.read(section, {});
  }
  reader.name_bodies();
  for (MjcfBody& body : tree.bodies)
    body.moves = !body.joints.empty() || (body.parent >= 0 && tree.bodies[body.parent].moves);
  if (tree.bodies.empty())
    context.fault(tree.world_mark, found ? "there is no <body> in the worldbody" : "there is no <worldbody>");
  return tree;
}

std::optional<MjcfRobot> choose_mjcf_robot(const MjcfTree& tree, MjcfContext& context) {
  const std::vector<Trunk> trunks = trunks_of(tree);
  const std::vector<const Trunk*> chosen = chosen_trunks(tree, trunks, context);
  if (chosen.empty()) return std::nullopt;
  MjcfRobot robot;
  robot.hangs_on_world =
      chosen.size() > 1 || (!chosen.front()->is_free && !tree.bodies[chosen.front()->root].joints.empty());
  for (const Trunk* trunk : chosen) robot.bodies.insert(robot.bodies.end(), trunk->bodies.begin(), trunk->bodies.end());
  std::ranges::sort(robot.bodies);
  const MjcfBody& root = tree.bodies[chosen.front()->root];
  const Mark mark = root.element->mark();
  if (robot.hangs_on_world) {
    context.decide(
        mark,
        fmt::format("{} are connected to the world by joints, and the world becomes a link without mass: give it one "
                    "(--bus), or choose a base",
                    names_of(tree, chosen)));
  } else {
    context.decide(mark, fmt::format("body {} is the base{}; the scenario sets its pose", in_quotes(root.name),
                                     chosen.front()->is_free ? "" : ", which is fixed to the world in the file"));
  }
  std::vector<const Trunk*> rest;
  for (const Trunk& trunk : trunks) {
    if (std::ranges::find(chosen, &trunk) == chosen.end()) rest.push_back(&trunk);
  }
  if (!rest.empty())
    context.decide(tree.bodies[rest.front()->root].element->mark(),
                   fmt::format("not part of the robot and omitted, with their child bodies: {}", names_of(tree, rest)));
  return robot;
}

}  // namespace grapnel
