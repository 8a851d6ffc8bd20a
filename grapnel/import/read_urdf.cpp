#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "grapnel/import/source_model.hpp"
#include "grapnel/import/xml_file.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

using pugi::xml_node;

// A robot file has at most 4000 links; a URDF model may have more, fixed to each other.
constexpr std::size_t kMost = 10'000;

// Known elements without meaning for the mechanics of a robot.
struct LeftOut {
  std::string_view name, what;
};
constexpr LeftOut kLeftOut[] = {
    {"gazebo", "for the Gazebo simulator"},
    {"ros2_control", "for the controllers of ROS 2"},
    {"sensor", "sensors are not part of the mechanics"},
    {"safety_controller", "limits that a controller sets itself; those of <limit> count"},
    {"calibration", "for the calibration of encoders"},
    {"contact", "contact parameters of a simulator"},
    {"contact_coefficients", "contact parameters of a simulator"},
    {"mujoco", "settings for MuJoCo's compiler"},
    {"self_collision_checking", "for a collision checker"},
    {"disable_collisions", "for a collision checker"},
    {"loop_joint", "robot files have no loops"},
};

std::string lower_case(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return lower;
}

std::string_view trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \t\r\n");
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t\r\n") - begin + 1);
}

bool is_element(const xml_node& node) { return node.type() == pugi::node_element; }

// Elements and expressions of a macro processor.
struct MacroFinder : pugi::xml_tree_walker {
  struct Found {
    xml_node node;
    std::string attribute;  // with an expression; empty: the element is a macro
  };
  std::vector<Found> found;
  bool defines = false;  // found only in files that were not expanded

  bool for_each(xml_node& node) override {
    const std::string_view name = node.name();
    if (name.starts_with("xacro:")) {
      static constexpr std::string_view kDefinitions[] = {"xacro:macro", "xacro:property", "xacro:include",
                                                          "xacro:arg"};
      defines |= std::find(std::begin(kDefinitions), std::end(kDefinitions), name) != std::end(kDefinitions);
      found.push_back({node, {}});
      return true;
    }
    for (const pugi::xml_attribute& attribute : node.attributes()) {
      if (std::string_view(attribute.value()).find("${") != std::string_view::npos)
        found.push_back({node, attribute.name()});
    }
    return true;
  }
};

class UrdfReader {
 public:
  UrdfReader(const XmlFile& file, FaultList& faults) : file_(file), faults_(faults) {}

  SourceModel read() {
    const xml_node root = file_.root();
    if (!root || !is_urdf(root)) return {};
    model_.name = root.attribute("name").value();
    for (const xml_node& node : root.children()) {
      if (!is_element(node) || faults_.full()) continue;
      const std::string_view name = node.name();
      if (model_.links.size() > kMost || model_.joints.size() > kMost) {
        faults_.add(file_.mark(node), fmt::format("the robot has more than {} links or joints", kMost));
        return {};
      }
      if (name == "link")
        read_link(node);
      else if (name == "joint")
        read_joint(node);
      else if (name != "transmission" && name != "material")
        leave_out(node);
    }
    for (const xml_node& node : root.children("transmission")) read_transmission(node);
    finish_drives();
    add_world();
    if (file_.expressions() > 0)
      decide(file_.first_expression(), fmt::format("{} in place of a number, as here: its value is used",
                                                   counted(file_.expressions(), "arithmetic expression")));
    if (model_.links.empty() && faults_.empty()) faults_.add(file_.mark(root), "the robot has no <link>");
    say_left_out();
    return std::move(model_);
  }

 private:
  bool is_urdf(const xml_node& root) {
    const Mark mark = file_.mark(root);
    const std::string source = mark.source ? *mark.source : std::string();
    MacroFinder macros;
    file_.root().parent().traverse(macros);
    if (macros.defines || lower_case(source).ends_with(".xacro")) {
      faults_.add(macros.found.empty() ? mark : file_.mark(macros.found[0].node),
                  fmt::format("this is a xacro file, which has to be expanded first: xacro {} > robot.urdf",
                              shell_word(source)));
      return false;
    }
    for (const auto& [node, attribute] : macros.found) {
      if (faults_.full()) return false;
      if (attribute.empty())
        faults_.add(file_.mark(node),
                    fmt::format("the macro <{}> was left over when xacro expanded the file: define it "
                                "there, or remove it",
                                shortened(printable_line(node.name()))));
      else
        faults_.add(file_.mark(node, attribute),
                    fmt::format("{} of <{}> is {}: xacro left an expression that it did not expand",
                                shortened(printable_line(attribute)), shortened(printable_line(node.name())),
                                in_quotes(node.attribute(attribute.c_str()).value())));
    }
    if (!macros.found.empty()) return false;
    const std::string_view name = root.name();
    if (name == "robot") return true;
    faults_.add(mark, fmt::format("the outermost element is <{}>, expected <robot>{}", shortened(printable_line(name)),
                                  name == "sdf" ? "; SDF files are not supported, use a URDF of the same robot" : ""));
    return false;
  }

  // Joints may hang on a world that the file does not declare.
  void add_world() {
    if (links_.contains("world")) return;
    const auto joint = std::find_if(model_.joints.begin(), model_.joints.end(),
                                    [](const SourceJoint& one) { return one.parent == "world"; });
    if (joint == model_.joints.end()) return;
    SourceLink world;
    world.name = "world";
    world.mark = joint->parent_mark;
    decide(world.mark, "link 'world' is not declared and becomes an empty root");
    model_.links.push_back(std::move(world));
  }

  // ---- Decisions ----

  void decide(const Mark& mark, std::string text, std::string about = {}) {
    model_.decisions.push_back({mark, std::move(text), std::move(about)});
  }

  struct Count {
    Mark first;
    std::size_t count = 0;
  };
  void leave_out(const xml_node& node) {
    auto [it, fresh] = left_out_.try_emplace(node.name());
    if (fresh) it->second.first = file_.mark(node), order_.push_back(node.name());
    ++it->second.count;
  }

  void say_left_out() {
    for (const std::string& name : order_) {
      const Count& count = left_out_[name];
      const auto* const known =
          std::find_if(std::begin(kLeftOut), std::end(kLeftOut), [&](const LeftOut& one) { return one.name == name; });
      decide(count.first,
             fmt::format("<{}> ({}): omitted, {}", shortened(printable_line(name)), counted(count.count, "element"),
                         known == std::end(kLeftOut) ? "its meaning is unknown" : known->what));
    }
  }

  // ---- Links ----

  bool is_new(std::map<std::string, Mark>& names, const std::string& name, const Mark& mark, const char* kind) {
    if (name.empty()) return false;  // has been reported
    const auto [it, fresh] = names.emplace(name, mark);
    if (!fresh) {
      faults_.add(mark, fmt::format("{} {} occurs twice, first in line {}; names must be unique", kind, in_quotes(name),
                                    it->second.line));
    }
    return fresh;
  }

  void read_link(const xml_node& node) {
    SourceLink link;
    link.mark = file_.mark(node);
    link.name = file_.required_text(node, "name", faults_);
    const bool fresh = is_new(links_, link.name, link.mark, "link");
    for (const xml_node& child : node.children()) {
      if (!is_element(child)) continue;
      const std::string_view name = child.name();
      if (name == "inertial")
        read_inertial(child, link);
      else if (name == "visual" || name == "collision")
        read_shape(child, link);
      else if (name != "material")
        leave_out(child);
    }
    if (fresh) model_.links.push_back(std::move(link));
  }

  Posed origin_of(const xml_node& node) {
    Posed X = Posed::identity();
    const xml_node origin = node.child("origin");
    if (!origin) return X;
    if (const auto xyz = file_.vector(origin, "xyz", faults_)) X.p = *xyz;
    if (const auto rpy = file_.vector(origin, "rpy", faults_)) X.R = rotation_from_rpy((*rpy)[0], (*rpy)[1], (*rpy)[2]);
    if (const auto q = file_.numbers(origin, "quat_xyzw", 4, faults_)) {
      const double length = std::hypot(std::hypot((*q)[0], (*q)[1]), std::hypot((*q)[2], (*q)[3]));
      if (std::abs(length - 1) < 1e-3)
        X.R = rotation_matrix(Quaterniond{(*q)[3] / length, (*q)[0] / length, (*q)[1] / length, (*q)[2] / length});
      else
        faults_.add(file_.mark(origin, "quat_xyzw"), fmt::format("quat_xyzw has length {:.6g}, must be 1", length));
    }
    return X;
  }

  void read_inertial(const xml_node& node, SourceLink& link) {
    const Mark mark = file_.mark(node);
    if (link.inertia) {
      faults_.add(mark, fmt::format("link {} has two <inertial>, expected one", in_quotes(link.name)));
      return;
    }
    const Posed X_LI = origin_of(node);
    const std::optional<double> mass = file_.number(node.child("mass"), "value", faults_);
    if (!node.child("mass").attribute("value"))
      faults_.add(mark, fmt::format("<inertial> of link {} has no mass: <mass value=\"…\"/>", in_quotes(link.name)));
    const xml_node tensor = node.child("inertia");
    const auto component = [&](const char* key) { return file_.number(tensor, key, faults_).value_or(0); };
    const Symmetric3d inertia{component("ixx"), component("iyy"), component("izz"),
                              component("ixy"), component("ixz"), component("iyz")};
    link.inertia = SourceInertia{mark, mass.value_or(0), X_LI.p, rotate(X_LI.R, inertia)};
  }

  void read_shape(const xml_node& node, SourceLink& link) {
    SourceShape shape;
    shape.mark = file_.mark(node);
    shape.is_visual = std::string_view(node.name()) == "visual";
    shape.shape.X_BG = origin_of(node);
    const auto is_shape = [](const xml_node& child) { return is_element(child); };
    const xml_node geometry = node.child("geometry"), form = geometry.find_child(is_shape);
    const std::string_view name = form.name();
    Geometry& g = shape.shape;
    if (name == "box") {
      g.shape = Geometry::Shape::box;
      if (const auto size = required_vector(form, "size")) g.size = *size;
    } else if (name == "cylinder" || name == "capsule") {
      g.shape = name == "capsule" ? Geometry::Shape::capsule : Geometry::Shape::cylinder;
      g.size = {required_number(form, "radius"), required_number(form, "length"), 0};
    } else if (name == "sphere") {
      g.shape = Geometry::Shape::sphere;
      g.size = {required_number(form, "radius"), 0, 0};
    } else if (name == "mesh") {
      g.shape = Geometry::Shape::mesh;
      g.size = read_scale(form);
      shape.mesh_file = file_.required_text(form, "filename", faults_);
    } else {
      const std::string what = form ? fmt::format("a <{}>", shortened(printable_line(name))) : "no <geometry>";
      decide(shape.mark,
             fmt::format("<{}> of link {} has {}, which is not a known shape: omitted", node.name(),
                         in_quotes(link.name), what),
             link.name);
      return;
    }
    link.shapes.push_back(std::move(shape));
  }

  Vector3d read_scale(const xml_node& mesh) {
    const auto scale = file_.numbers(mesh, "scale", 0, faults_);
    if (!scale) return {1, 1, 1};
    if (scale->size() == 1) return {scale->front(), scale->front(), scale->front()};
    if (scale->size() == 3) return {(*scale)[0], (*scale)[1], (*scale)[2]};
    faults_.add(file_.mark(mesh, "scale"), fmt::format("scale of <mesh> has {} numbers, expected 3", scale->size()));
    return {1, 1, 1};
  }

  double required_number(const xml_node& node, const char* attribute) {
    return file_.required_text(node, attribute, faults_).empty() ? 0
                                                                 : file_.number(node, attribute, faults_).value_or(0);
  }
  std::optional<Vector3d> required_vector(const xml_node& node, const char* attribute) {
    if (file_.required_text(node, attribute, faults_).empty()) return {};
    return file_.vector(node, attribute, faults_);
  }

  // ---- Joints ----

  void read_joint(const xml_node& node) {
    static constexpr std::pair<std::string_view, SourceJoint::Kind> kKinds[] = {
        {"fixed", SourceJoint::Kind::fixed},           {"revolute", SourceJoint::Kind::revolute},
        {"continuous", SourceJoint::Kind::continuous}, {"prismatic", SourceJoint::Kind::prismatic},
        {"floating", SourceJoint::Kind::floating},     {"planar", SourceJoint::Kind::planar}};
    SourceJoint joint;
    joint.mark = file_.mark(node);
    joint.name = file_.required_text(node, "name", faults_);
    const bool fresh = is_new(joints_, joint.name, joint.mark, "joint");
    const std::string type(trimmed(file_.required_text(node, "type", faults_)));
    const auto* const kind = std::find_if(std::begin(kKinds), std::end(kKinds),
                                          [&](const auto& one) { return one.first == lower_case(type); });
    if (kind != std::end(kKinds)) {
      joint.kind = kind->second;
    } else if (!type.empty()) {
      std::vector<std::string> names;
      for (const auto& one : kKinds) names.emplace_back(one.first);
      faults_.add(file_.mark(node, "type"), fmt::format("joint {} has the unknown type {}{}", in_quotes(joint.name),
                                                        in_quotes(type), suggestion(type, names)));
    }
    joint.parent = link_of(node, "parent", joint.parent_mark);
    joint.child = link_of(node, "child", joint.child_mark);
    joint.X_PJ = origin_of(node);
    read_axis(node, joint);
    read_limits(node, joint);
    read_dynamics(node.child("dynamics"), joint);
    if (const xml_node mimic = node.child("mimic")) {
      joint.mimic = SourceMimic{file_.mark(mimic), file_.required_text(mimic, "joint", faults_),
                                file_.number(mimic, "multiplier", faults_).value_or(1),
                                file_.number(mimic, "offset", faults_).value_or(0)};
    }
    for (const xml_node& child : node.children()) {
      static constexpr std::string_view kKnown[] = {"origin", "parent", "child", "axis", "limit", "dynamics", "mimic"};
      if (is_element(child) && std::find(std::begin(kKnown), std::end(kKnown), child.name()) == std::end(kKnown))
        leave_out(child);
    }
    if (!fresh) return;
    joint_index_.emplace(joint.name, model_.joints.size());
    model_.joints.push_back(std::move(joint));
  }

  std::string link_of(const xml_node& joint, const char* role, Mark& mark) {
    const xml_node node = joint.child(role);
    mark = file_.mark(node ? node : joint);
    if (node) return file_.required_text(node, "link", faults_);
    if (joint.attribute("name").value()[0] != '\0')
      faults_.add(mark,
                  fmt::format("joint {} has no <{} link=\"…\"/>", in_quotes(joint.attribute("name").value()), role));
    return {};
  }

  void read_axis(const xml_node& node, SourceJoint& joint) {
    const xml_node axis = node.child("axis");
    if (!axis || !has_axis(joint)) return;
    const auto xyz = required_vector(axis, "xyz");
    if (!xyz) return;
    const double length = std::hypot((*xyz)[0], (*xyz)[1], (*xyz)[2]);
    if (!(length > 1e-9) || !std::isfinite(length)) {
      faults_.add(file_.mark(axis, "xyz"), fmt::format("the axis of joint {} has no direction: its length is {:.6g}",
                                                       in_quotes(joint.name), length));
      return;
    }
    // Exact values remain exact.
    joint.axis = std::abs(length - 1) < 1e-15 ? *xyz : (1 / length) * *xyz;
    if (std::abs(length - 1) > 1e-6) {
      decide(file_.mark(axis, "xyz"),
             fmt::format("joint {}: the axis has length {:.6g} and is normalised", in_quotes(joint.name), length),
             joint.name);
    }
  }

  // A number, or empty if the file states no limit.
  std::optional<double> limit(const xml_node& node, const char* attribute) {
    std::string text = lower_case(trimmed(node.attribute(attribute).value()));
    if (text.starts_with('+') || text.starts_with('-')) text.erase(0, 1);
    if (text == "inf" || text == "infinity") return {};
    return file_.number(node, attribute, faults_);
  }

  void read_limits(const xml_node& node, SourceJoint& joint) {
    if (!has_axis(joint)) return;
    const xml_node limits = node.child("limit");
    const bool turns = joint.kind != SourceJoint::Kind::prismatic;
    joint.limit_mark = file_.mark(limits ? limits : node);
    const auto say = [&](const std::string& text) {
      decide(joint.limit_mark, fmt::format("joint {}: {}", in_quotes(joint.name), text), joint.name);
    };
    if (!limits) {
      if (joint.kind != SourceJoint::Kind::continuous) say("no <limit>; it moves without bounds");
      return;
    }
    joint.lower = limit(limits, "lower"), joint.upper = limit(limits, "upper");
    joint.rate = limit(limits, "velocity"), joint.effort = limit(limits, "effort");
    const bool some = limits.attribute("lower") || limits.attribute("upper");
    if (joint.kind == SourceJoint::Kind::continuous) {
      if (joint.lower.value_or(0) != 0 || joint.upper.value_or(0) != 0)
        say("lower and upper limits of a continuous joint have no meaning, omitted");
      joint.lower = joint.upper = {};
    } else if (!some) {
      say("<limit> has no lower and no upper; no limits are assumed, because it could not move with URDF's default of "
          "0");
    } else {
      if (!limits.attribute("lower")) joint.lower = 0, say("<limit> has no lower; it is 0, URDF's default");
      if (!limits.attribute("upper")) joint.upper = 0, say("<limit> has no upper; it is 0, URDF's default");
      if (joint.lower == 0.0 && joint.upper == 0.0) {
        joint.lower = joint.upper = {};
        say("lower and upper limit are 0; no limits are assumed, because it could not move (lock it to keep it at 0)");
      }
    }
    if (joint.rate == 0.0) {
      joint.rate = {};
      say(fmt::format("the velocity limit is 0 {}; no limit is assumed, because it could not move",
                      turns ? "rad/s" : "m/s"));
    }
    if (joint.effort == 0.0) {
      joint.effort = {};
      say(fmt::format("the effort limit is 0 {}; no limit is assumed, because no drive could move it",
                      turns ? "N m" : "N"));
    }
  }

  void read_dynamics(const xml_node& dynamics, SourceJoint& joint) {
    if (!dynamics) return;
    const auto positive = [&](const char* key) {
      const auto value = file_.number(dynamics, key, faults_);
      if (value && *value < 0) {
        faults_.add(file_.mark(dynamics, key),
                    fmt::format("{} of joint {} is {}, must not be negative", key, in_quotes(joint.name), *value));
        return std::optional<double>();
      }
      return value;
    };
    joint.viscous_friction = positive("damping").value_or(0);
    joint.coulomb_friction = positive("friction").value_or(0);
    for (const char* key : {"rotor_inertia", "rotorInertia"}) {
      if (const auto value = positive(key)) joint.rotor_inertia = *value;
    }
    if (const auto value = positive("armature")) reflected_[joint.name] = *value;
    for (const pugi::xml_attribute& one : dynamics.attributes()) {
      static constexpr std::string_view kKnown[] = {"damping", "friction", "armature", "rotor_inertia", "rotorInertia"};
      if (std::find(std::begin(kKnown), std::end(kKnown), one.name()) != std::end(kKnown)) continue;
      decide(file_.mark(dynamics, one.name()),
             fmt::format("joint {}: {} of <dynamics> is omitted, its meaning is unknown", in_quotes(joint.name),
                         in_quotes(one.name())),
             joint.name);
    }
  }

  // ---- Transmissions ----

  // The number in <name>50</name> or <name value="50"/>, in whichever of the elements has it first.
  std::optional<double> drive_value(std::initializer_list<xml_node> places, std::initializer_list<const char*> names) {
    for (const xml_node& place : places) {
      for (const char* name : names) {
        const xml_node node = place.child(name);
        if (!node) continue;
        if (node.attribute("value")) return file_.number(node, "value", faults_);
        const std::string_view text = trimmed(node.child_value());
        if (const auto value = arithmetic_value(text)) return value;
        faults_.add(file_.mark(node), fmt::format("<{}>: {} is not a finite number", name, in_quotes(text)));
        return {};
      }
    }
    return {};
  }

  void read_transmission(const xml_node& node) {
    const Mark mark = file_.mark(node);
    const std::string named = in_quotes(node.attribute("name").value());
    std::vector<xml_node> joints;
    for (const xml_node& joint : node.children("joint")) joints.push_back(joint);
    if (joints.size() != 1) {
      decide(mark, fmt::format("transmission {} couples {}: omitted", named, counted(joints.size(), "joint")));
      return;
    }
    const std::string name = file_.required_text(joints[0], "name", faults_);
    const auto found = joint_index_.find(name);
    if (found == joint_index_.end()) {
      if (!name.empty())
        decide(mark,
               fmt::format("transmission {} is of joint {}, which does not exist: omitted", named, in_quotes(name)));
      return;
    }
    SourceJoint& joint = model_.joints[found->second];
    if (!driven_.emplace(name, mark).second) {
      decide(mark, fmt::format("joint {} has a transmission already; {} is omitted", in_quotes(name), named), name);
      return;
    }
    const xml_node actuator = node.child("actuator");
    const auto ratio =
        drive_value({actuator, joints[0], node}, {"mechanicalReduction", "drake:gear_ratio", "gearRatio"});
    if (ratio && *ratio != 0) joint.gear_ratio = *ratio;
    if (ratio && *ratio == 0)
      decide(mark, fmt::format("joint {}: a mechanicalReduction of 0 is invalid, 1 is used", in_quotes(name)), name);
    const auto rotor = drive_value({actuator, joints[0], node},
                                   {"rotorInertia", "motorInertia", "drake:rotor_inertia", "rotor_inertia"});
    if (rotor && *rotor < 0)
      faults_.add(mark,
                  fmt::format("the rotor inertia of joint {} is {}, must not be negative", in_quotes(name), *rotor));
    else if (rotor)
      joint.rotor_inertia = *rotor;
  }

  // Rotors reflected to the joint, and the used parts of the transmissions.
  void finish_drives() {
    std::size_t geared = 0, without_rotor = 0;
    for (SourceJoint& joint : model_.joints) {
      if (const auto it = reflected_.find(joint.name); it != reflected_.end()) {
        if (joint.rotor_inertia != 0)
          decide(joint.mark,
                 fmt::format("joint {}: armature and the rotor's inertia are both given, armature is used",
                             in_quotes(joint.name)),
                 joint.name);
        joint.rotor_inertia = it->second / (joint.gear_ratio * joint.gear_ratio);
      }
      if (!driven_.contains(joint.name)) continue;
      ++geared;
      without_rotor += joint.rotor_inertia == 0 ? 1 : 0;
    }
    if (geared == 0) return;
    const Mark first = std::min_element(driven_.begin(), driven_.end(), [](const auto& a, const auto& b) {
                         return a.second.line < b.second.line;
                       })->second;
    decide(first, fmt::format("transmissions of {}: gear ratios and rotor inertias are used, the rest (types, hardware "
                              "interfaces) is omitted{}",
                              counted(geared, "joint"),
                              without_rotor == 0 ? std::string()
                                                 : fmt::format("; {} of them give no rotor inertia, and a gear ratio "
                                                               "without one has no influence",
                                                               without_rotor)));
  }

  const XmlFile& file_;
  FaultList& faults_;
  SourceModel model_;
  std::map<std::string, Mark> links_, joints_, driven_;
  std::map<std::string, std::size_t> joint_index_;
  std::map<std::string, double> reflected_;  // inertia of the rotor reflected to the joint
  std::map<std::string, Count> left_out_;
  std::vector<std::string> order_;  // of omitted elements
};

}  // namespace

SourceModel read_urdf(const XmlFile& file, FaultList& faults) { return UrdfReader(file, faults).read(); }

}  // namespace grapnel
