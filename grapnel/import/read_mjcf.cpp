#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "grapnel/import/mjcf_model.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

constexpr std::array kSections{"compiler", "option",    "size",   "visual",    "statistic", "default",
                               "custom",   "extension", "asset",  "worldbody", "contact",   "equality",
                               "tendon",   "actuator",  "sensor", "keyframe",  "deformable"};

constexpr Posed moved_by(const Vector3d& p) { return {Rotationd::identity(), p}; }

bool is_finite(const Posed& X) {
  double sum = X.p[0] + X.p[1] + X.p[2];
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) sum += X.R(i, j);
  }
  return std::isfinite(sum);
}

// A name that is not taken yet.
std::string unique_name(std::string name, std::set<std::string>& taken) {
  const std::string stem = name;
  for (int i = 2; !taken.insert(name).second; ++i) name = fmt::format("{}_{}", stem, i);
  return name;
}

// <option>: the medium around the robot acts on it; all else is how MuJoCo integrates.
void read_option(const MjcfElement& option, MjcfContext& context) {
  const MjcfAttributes given{{&option}};
  for (const char* medium : {"density", "viscosity"}) {
    const auto value = given.number(medium, context.faults);
    if (value && *value != 0)
      context.fault(
          option.mark(medium),
          fmt::format("{} of the medium is {}: forces of a fluid are not supported; remove it for a robot in space",
                      medium, *value));
  }
  context.passed_over.check_attributes(option, context.faults);
  for (const MjcfElement& flag : option.children) {
    context.passed_over.element(flag,
                                "switches of MuJoCo's simulation are not followed; joints keep their limits, "
                                "damping and friction");
  }
}

void read_assets(const MjcfElement& assets, MjcfContext& context) {
  static constexpr std::array kKnown{"mesh", "texture", "material", "hfield", "skin", "model"};
  for (const MjcfElement& child : assets.children) {
    if (child.tag() == "mesh") {
      const MjcfMesh mesh = read_mjcf_mesh(child, context);
      if (!mesh.name.empty() && !context.meshes.emplace(mesh.name, mesh).second)
        context.fault(child.mark("name"), fmt::format("there are two meshes {}", in_quotes(mesh.name)));
    } else if (std::ranges::find(kKnown, child.tag()) != kKnown.end()) {
      context.passed_over.element(child, "an asset for looks, or for surroundings, is not read");
    } else {
      context.fault(child.mark(), fmt::format("<{}> is not allowed in <asset>{}", child.tag(),
                                              suggestion(child.tag(), {kKnown.begin(), kKnown.end()})));
    }
  }
}

void check_defaults(const MjcfElement& section, MjcfContext& context) {
  context.passed_over.check_attributes(section, context.faults);
  for (const MjcfElement& child : section.children) {
    if (child.tag() == "default") {
      check_defaults(child, context);
    } else {
      context.passed_over.check_attributes(child, context.faults);
    }
  }
}

// Sections outside the tree of bodies without effect on joints.
void read_sections(const MjcfElement& root, MjcfContext& context) {
  context.passed_over.check_attributes(root, context.faults);
  // Angle units and classes apply to the whole model, independently of their position.
  for (const MjcfElement& section : root.children) {
    if (section.tag() != "compiler") continue;
    context.compiler.read(section, context.faults);
    context.passed_over.check_attributes(section, context.faults);
  }
  for (const MjcfElement& section : root.children) {
    if (section.tag() != "default") continue;
    check_defaults(section, context);
    context.defaults.read(section, context.faults);
  }
  for (const MjcfElement& section : root.children) {
    const std::string tag = section.tag();
    if (tag == "option") {
      read_option(section, context);
    } else if (tag == "asset") {
      read_assets(section, context);
    } else if (tag == "deformable") {
      for (const MjcfElement& child : section.children) {
        if (child.tag() == "skin") {
          context.passed_over.element(child, "only visual, not read");
        } else {
          context.fault(child.mark(), fmt::format("<{}> is a deformable body, which is not supported", child.tag()));
        }
      }
    } else if (tag == "contact") {
      for (const MjcfElement& child : section.children) {
        context.passed_over.element(child,
                                    "pairs for contacts are not read; a scenario's clearance names pairs to ignore");
      }
    } else if (tag == "sensor" || tag == "keyframe" || tag == "custom" || tag == "size" || tag == "visual" ||
               tag == "statistic" || tag == "extension") {
      context.passed_over.element(section, "without influence on the motion, not read");
    } else if (std::ranges::find(kSections, tag) == kSections.end()) {
      context.fault(section.mark(), fmt::format("<{}> is not allowed in <mujoco>{}", tag,
                                                suggestion(tag, {kSections.begin(), kSections.end()})));
    }
  }
}

// ---- From the chosen bodies to links and joints ----

class RobotMaker {
 public:
  RobotMaker(const MjcfTree& tree, const MjcfRobot& robot, MjcfContext& context, SourceModel& model)
      : tree_(tree), robot_(robot), context_(context), model_(model), anchors_(tree.bodies.size(), Vector3d::zero()) {}

  void make() {
    // Names that are made up must not be those that the file gives.
    for (const int i : robot_.bodies) {
      for (const MjcfPart& part : tree_.bodies[i].joints) joint_names_.insert(part.element().text("name"));
    }
    if (robot_.hangs_on_world) add_world();
    for (const int i : robot_.bodies) {
      for (const MjcfElement* refused : tree_.bodies[i].refused) refuse(*refused);
    }
    for (const int i : robot_.bodies) add_body(i);
    scale_to_total_mass();
  }

 private:
  void refuse(const MjcfElement& element) {
    context_.fault(
        element.mark(),
        fmt::format("<{}> is not supported: it makes bodies, joints or forces that are not in the file; write "
                    "them out (MuJoCo saves a model with everything written out)",
                    element.tag()));
  }

  void add_world() {
    world_ = unique_name("world", link_names_);
    SourceLink link;
    link.name = world_;
    link.mark = tree_.world_mark;
    model_.links.push_back(std::move(link));
  }

  void add_body(int i) {
    const MjcfBody& body = tree_.bodies[i];
    link_names_.insert(body.name);
    SourceLink link;
    link.name = body.name;
    link.mark = body.element->mark();
    if (const auto joint = read_joint(i)) model_.joints.push_back(*joint);
    // From the body's frame to the link's, whose origin is at the joint.
    const Vector3d anchor = anchors_[i];
    link.inertia = read_mjcf_inertia(body, context_);
    if (link.inertia) link.inertia->com -= anchor;
    link.shapes = read_mjcf_shapes(body, context_);
    for (SourceShape& shape : link.shapes) shape.shape.X_BG.p -= anchor;
    for (const MjcfPart& part : body.sites) add_site(part, body.name, anchor);
    model_.links.push_back(std::move(link));
  }

  void add_site(const MjcfPart& part, const std::string& link, const Vector3d& anchor) {
    const Posed X_BF = mjcf_place(part, context_);
    const MjcfElement& site = part.element();
    if (!site.has("name")) {
      context_.passed_over.element(site, "sites without a name are omitted");
      return;
    }
    const std::string name = site.text("name");
    if (!frame_names_.insert(name).second) {
      context_.fault(site.mark("name"), fmt::format("there are two sites {}", in_quotes(name)));
      return;
    }
    const Posed X_LF = moved_by(-anchor) * X_BF;
    if (!is_finite(X_LF))
      context_.fault(site.mark(), fmt::format("the place of site {} is not finite", in_quotes(name)));
    model_.frames.push_back({name, site.mark(), link, X_LF});
  }

  // The joint that carries a body; none for the root.
  std::optional<SourceJoint> read_joint(int i) {
    const MjcfBody& body = tree_.bodies[i];
    const std::vector<MjcfPart>& parts = body.joints;
    if (parts.size() > 1) {
      context_.fault(parts[1].element().mark(),
                     fmt::format("body {} has {}: bodies with several are not supported; give each its own body with "
                                 "its own mass{}",
                                 in_quotes(body.name), counted(parts.size(), "joint"),
                                 body.parent < 0 ? ", or a base that floats one <freejoint/>" : ""));
      return std::nullopt;
    }
    const bool is_root = body.parent < 0 && !robot_.hangs_on_world;
    if (is_root) {
      if (!parts.empty()) check_free_joint(parts.front());
      return std::nullopt;
    }
    SourceJoint joint;
    joint.parent = body.parent < 0 ? world_ : tree_.bodies[body.parent].name;
    joint.child = body.name;
    joint.mark = joint.parent_mark = joint.child_mark = joint.limit_mark = body.element->mark();
    joint.axis = Vector3d::unit(2);
    Posed X_joint = Posed::identity();  // of the joint's frame in the body's, where the joint is at zero
    if (!parts.empty()) {
      const MjcfPart& part = parts.front();
      joint.name = part.element().text("name");
      if (!joint.name.empty() && !given_joints_.insert(joint.name).second)
        context_.fault(part.element().mark("name"), fmt::format("there are two joints {}", in_quotes(joint.name)));
      X_joint = read_moving_joint(part, body, joint);
      if (joint.kind != SourceJoint::Kind::prismatic) anchors_[i] = X_joint.p;
    }
    if (joint.name.empty()) joint.name = unique_name(body.name + (parts.empty() ? "_fixed" : "_joint"), joint_names_);
    const Vector3d parent_anchor = body.parent < 0 ? Vector3d::zero() : anchors_[body.parent];
    joint.X_PJ = moved_by(-parent_anchor) * body.X_PB * X_joint;
    if (!is_finite(joint.X_PJ))
      context_.fault(joint.mark, fmt::format("the place of body {} is not finite", in_quotes(body.name)));
    return joint;
  }

  // A free joint is what a base has; what acts on it has no counterpart.
  void check_free_joint(const MjcfPart& part) {
    context_.passed_over.check_attributes(part.element(), context_.faults);
    if (part.element().tag() == "freejoint") return;
    for (const char* acting : {"armature", "damping", "stiffness", "frictionloss"}) {
      const auto value = part.attributes.number(acting, context_.faults);
      if (!value || *value == 0) continue;
      context_.fault(
          part.attributes.mark(acting),
          fmt::format("the free joint of the base has {} {}, which a floating base cannot have; <freejoint/> "
                      "inherits nothing from default classes",
                      acting, *value));
    }
  }

  // Kind, axis, limits and friction of a hinge or slide; returns where it is in its body.
  Posed read_moving_joint(const MjcfPart& part, const MjcfBody& body, SourceJoint& joint) {
    const MjcfAttributes& given = part.attributes;
    FaultList& faults = context_.faults;
    joint.mark = joint.limit_mark = part.element().mark();
    context_.passed_over.check_attributes(part.element(), faults);
    static constexpr std::array kTypes{"hinge", "slide", "ball", "free"};
    const std::string type = part.element().tag() == "freejoint" ? "free" : given.word("type", kTypes, faults);
    if (type == "ball") {
      context_.fault(given.mark("type"),
                     fmt::format("the joint of body {} is a ball joint, which is not supported: write "
                                 "three hinges on separate bodies, each with its mass",
                                 in_quotes(body.name)));
      return Posed::identity();
    }
    if (type == "free") {
      context_.fault(part.element().mark(), fmt::format("body {} has a free joint inside of a tree; only the root of a "
                                                        "robot can float",
                                                        in_quotes(body.name)));
      return Posed::identity();
    }
    const bool turns = type == "hinge";
    joint.axis = read_axis(given);
    read_limits(given, turns, joint);
    read_resistance(given, joint);
    // Where its value is ref, the body is where the file puts it.
    const double ref = mjcf_joint_reference(given, context_);
    if (!turns) return moved_by(-ref * joint.axis);
    const Vector3d anchor = given.vector("pos", faults).value_or(Vector3d::zero());
    return {rotation_about(joint.axis, -ref), anchor};
  }

  Vector3d read_axis(const MjcfAttributes& given) {
    const Vector3d axis = given.vector("axis", context_.faults).value_or(Vector3d::unit(2));
    const double largest = std::max({std::abs(axis[0]), std::abs(axis[1]), std::abs(axis[2])});
    if (!(largest > 1e-14)) {
      context_.fault(given.mark("axis"), "axis of <joint> is zero, expected a direction");
      return Vector3d::unit(2);
    }
    const Vector3d scaled = (1 / largest) * axis;
    return (1 / norm(scaled)) * scaled;
  }

  void read_limits(const MjcfAttributes& given, bool turns, SourceJoint& joint) {
    if (const auto range = mjcf_range(given, "limited", "range", context_)) {
      joint.lower = turns ? context_.compiler.angle(range->first) : range->first;
      joint.upper = turns ? context_.compiler.angle(range->second) : range->second;
      joint.limit_mark = given.mark("range");
    }
    joint.kind = !turns        ? SourceJoint::Kind::prismatic
                 : joint.lower ? SourceJoint::Kind::revolute
                               : SourceJoint::Kind::continuous;
  }

  void read_resistance(const MjcfAttributes& given, SourceJoint& joint) {
    const auto not_negative = [&](const char* attribute) {
      const double value = given.number(attribute, context_.faults).value_or(0);
      if (value < 0)
        context_.fault(given.mark(attribute), fmt::format("{} of <joint> is {}, expected 0 or more", attribute, value));
      return std::max(value, 0.0);
    };
    joint.viscous_friction = not_negative("damping");
    joint.coulomb_friction = not_negative("frictionloss");
    joint.rotor_inertia = not_negative("armature");
    const auto stiffness = given.number("stiffness", context_.faults);
    if (stiffness && *stiffness != 0)
      context_.fault(
          given.mark("stiffness"),
          fmt::format("stiffness of <joint> is {}: springs in joints are not supported; remove the attribute "
                      "(stiffness=\"0\" where a default class gives it)",
                      *stiffness));
    const auto spring = given.numbers("springdamper", 2, context_.faults);
    if (spring && ((*spring)[0] != 0 || (*spring)[1] != 0))
      context_.fault(given.mark("springdamper"), "springdamper of <joint>: springs in joints are not supported");
  }

  // All bodies of the file count, also those that are not part of the robot.
  void scale_to_total_mass() {
    const auto total = context_.compiler.total_mass;
    if (!total) return;
    double found = 0;
    for (const SourceLink& link : model_.links) found += link.inertia ? link.inertia->mass : 0;
    std::set<int> chosen(robot_.bodies.begin(), robot_.bodies.end());
    for (std::size_t i = 0; i < tree_.bodies.size(); ++i) {
      if (chosen.contains(static_cast<int>(i))) continue;
      if (const auto inertia = read_mjcf_inertia(tree_.bodies[i], context_)) found += inertia->mass;
    }
    if (!(found > 0)) return;
    const double factor = *total / found;
    for (SourceLink& link : model_.links) {
      if (!link.inertia) continue;
      Symmetric3d& I = link.inertia->inertia;
      link.inertia->mass *= factor;
      I = {factor * I.xx, factor * I.yy, factor * I.zz, factor * I.xy, factor * I.xz, factor * I.yz};
    }
    context_.decide(tree_.world_mark,
                    fmt::format("settotalmass: all masses and inertias are multiplied with {:.6g}, so "
                                "that the bodies of the file weigh {:.6g} kg together",
                                factor, *total));
  }

  const MjcfTree& tree_;
  const MjcfRobot& robot_;
  MjcfContext& context_;
  SourceModel& model_;
  std::vector<Vector3d> anchors_;  // of the joint in the body's frame, by body
  std::string world_;
  std::set<std::string> link_names_, joint_names_, given_joints_, frame_names_;
};

}  // namespace

SourceModel read_mjcf(const std::filesystem::path& file, std::string text, FaultList& faults,
                      const MeshReader& read_mesh) {
  SourceModel model;
  const MjcfFiles files(file, std::move(text), faults);
  model.further_bytes = files.included_bytes();
  if (files.root() == nullptr) return model;
  MjcfContext context(faults);
  context.decisions = files.decisions();
  context.folder = file.parent_path();
  context.read_mesh = read_mesh;
  const MjcfElement& root = *files.root();
  model.name = root.has("model") ? root.text("model") : file.stem().string();
  read_sections(root, context);
  const MjcfTree tree = read_mjcf_tree(root, context);
  if (const auto robot = choose_mjcf_robot(tree, context)) {
    RobotMaker(tree, *robot, context, model).make();
    read_mjcf_drives(root, tree, *robot, context, model);
  }
  context.passed_over.say(context.decisions);
  model.decisions = std::move(context.decisions);
  return model;
}

}  // namespace grapnel
