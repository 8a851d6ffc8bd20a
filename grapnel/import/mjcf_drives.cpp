#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "grapnel/import/mjcf_model.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Force range of drives [N m or N].
struct EffortRange {
  double lower = 0, upper = 0;
};

// Forces beyond a limit are cut off there.
EffortRange clamped(const EffortRange& force, const std::pair<double, double>& limit) {
  const auto& [lower, upper] = limit;
  return {std::clamp(force.lower, lower, upper), std::clamp(force.upper, lower, upper)};
}

EffortRange scaled(const EffortRange& range, double factor) {
  // Zero times an unlimited force is zero.
  const auto times = [&](double bound) { return factor == 0 ? 0 : factor * bound; };
  const double a = times(range.lower), b = times(range.upper);
  return {std::min(a, b), std::max(a, b)};
}

// The force of an actuator before its gear, as far as its ranges say.
EffortRange force_of(const MjcfAttributes& given, MjcfContext& context) {
  FaultList& faults = context.faults;
  // Tags are short names of settings that a default class may have set by another tag: the last one counts.
  bool gain_is_fixed = true, has_bias = false;
  double gain = 1;
  for (const MjcfElement* layer : given.layers) {
    const std::string tag = layer->tag();
    if (tag == "motor") {
      gain_is_fixed = true, has_bias = false, gain = 1;
    } else if (tag != "general") {
      has_bias = true;
    } else {
      if (layer->has("gaintype")) gain_is_fixed = layer->text("gaintype") == "fixed";
      if (layer->has("biastype")) has_bias = layer->text("biastype") != "none";
      if (const auto prm = layer->file->numbers(layer->node, "gainprm", 0, faults); prm && !prm->empty())
        gain = prm->front();
    }
  }
  EffortRange force{-kInfinity, kInfinity};
  const auto control = mjcf_range(given, "ctrllimited", "ctrlrange", context);
  if (control && gain_is_fixed && !has_bias) force = scaled({control->first, control->second}, gain);
  if (const auto limit = mjcf_range(given, "forcelimited", "forcerange", context)) force = clamped(force, *limit);
  return force;
}

class DriveReader {
 public:
  DriveReader(const MjcfTree& tree, const MjcfRobot& robot, MjcfContext& context, SourceModel& model)
      : context_(context), model_(model) {
    for (std::size_t i = 0; i < model.joints.size(); ++i) joints_[model.joints[i].name] = i;
    for (const MjcfBody& body : tree.bodies) {
      for (const MjcfPart& part : body.joints) all_joints_.insert(part.element().text("name"));
    }
    std::map<std::string, const MjcfBody*> bodies;
    for (const int i : robot.bodies) bodies[tree.bodies[i].name] = &tree.bodies[i];
    for (const SourceJoint& joint : model.joints) {
      const std::vector<MjcfPart>& parts = bodies.at(joint.child)->joints;
      parts_.push_back(parts.empty() ? nullptr : &parts.front());
    }
  }

  void read_actuator(const MjcfElement& element) {
    if (mjcf_kind(element.tag()) != "actuator") {
      context_.fault(element.mark(), fmt::format("<{}> is not allowed in <actuator>{}", element.tag(),
                                                 suggestion(element.tag(), {"motor", "general", "position", "velocity",
                                                                            "intvelocity", "damper"})));
      return;
    }
    context_.passed_over.check_attributes(element, context_.faults);
    const MjcfAttributes given = context_.defaults.attributes(element, "actuator", "", context_.faults);
    const std::string joint = element.text(element.has("jointinparent") ? "jointinparent" : "joint");
    if (joint.empty()) {
      context_.passed_over.element(element, "it does not drive a joint directly and is omitted");
      return;
    }
    const auto found = joints_.find(joint);
    if (found == joints_.end()) {
      if (!is_elsewhere(joint, element, element.has("jointinparent") ? "jointinparent" : "joint")) return;
      context_.passed_over.element(element, "it drives a joint outside the robot and is omitted");
      return;
    }
    const std::string tag = element.tag();
    if (tag == "muscle" || tag == "cylinder" || tag == "plugin" || tag == "dcmotor") {
      context_.fault(element.mark(), fmt::format("joint {} is driven by a <{}>, which is not supported; a <motor> is",
                                                 in_quotes(joint), tag));
      return;
    }
    if (tag != "motor" && tag != "general")
      context_.passed_over.element(element, "its control law is left to the scenario; forcerange limits the effort");
    const double gear = given.overlaid("gear", {1, 0, 0, 0, 0, 0}, context_.faults)[0];
    const EffortRange effort = scaled(force_of(given, context_), gear);
    EffortRange& sum = efforts_[joint];
    sum.lower += effort.lower, sum.upper += effort.upper;
  }

  // A joint whose value follows another's is what URDF calls mimic.
  void read_equality(const MjcfElement& element) {
    static constexpr std::array kKinds{"connect", "weld",     "joint",      "tendon",
                                       "flex",    "flexvert", "flexstrain", "distance"};
    const std::string tag = element.tag();
    if (std::ranges::find(kKinds, tag) == kKinds.end()) {
      context_.fault(element.mark(), fmt::format("<{}> is not allowed in <equality>{}", tag,
                                                 suggestion(tag, {kKinds.begin(), kKinds.end()})));
      return;
    }
    const MjcfAttributes given = context_.defaults.attributes(element, "equality", "", context_.faults);
    if (!given.flag("active", true, context_.faults)) {
      context_.passed_over.element(element, "a constraint that is not active is not read");
      return;
    }
    if (tag != "joint") {
      context_.fault(element.mark(),
                     fmt::format("<{}> in <equality> is not supported: a robot file has no closed loops; "
                                 "remove it, or set active=\"false\"",
                                 tag));
      return;
    }
    context_.passed_over.check_attributes(element, context_.faults, "equality");
    read_coupling(element, given);
  }

  // Tendons that only measure, or transmit actuators, have no separate influence.
  void read_tendon(const MjcfElement& element) {
    const std::string tag = element.tag();
    if (tag != "fixed" && tag != "spatial") {
      context_.fault(element.mark(),
                     fmt::format("<{}> is not allowed in <tendon>{}", tag, suggestion(tag, {"fixed", "spatial"})));
      return;
    }
    const MjcfAttributes given = context_.defaults.attributes(element, "tendon", "", context_.faults);
    context_.passed_over.check_attributes(element, context_.faults, "tendon");
    for (const char* acting : {"stiffness", "damping", "frictionloss", "armature"}) {
      const auto value = given.number(acting, context_.faults);
      if (!value || *value == 0) continue;
      context_.fault(given.mark(acting),
                     fmt::format("{} of a tendon is {}: tendons that act on joints are not supported", acting, *value));
      return;
    }
    if (mjcf_range(given, "limited", "range", context_)) {
      context_.fault(given.mark("range"), "limits of tendons are not supported");
      return;
    }
    context_.passed_over.element(
        element, "a tendon without stiffness, damping, friction and limits has no influence and is not read");
  }

  void finish() {
    for (std::size_t i = 0; i < parts_.size(); ++i) set_effort(model_.joints[i], parts_[i]);
    std::vector<std::string> undriven;
    for (const SourceJoint& joint : model_.joints) {
      if (joint.kind != SourceJoint::Kind::fixed && !efforts_.contains(joint.name)) undriven.push_back(joint.name);
    }
    if (!undriven.empty())
      context_.decide(
          model_.joints.front().mark,
          fmt::format("without an actuator in the file, so their effort limits are unknown: {}", some_of(undriven)));
  }

 private:
  // Whether a joint exists that is not one of the robot's moving joints; else a fault.
  bool is_elsewhere(const std::string& joint, const MjcfElement& element, const char* attribute) {
    if (all_joints_.contains(joint)) return true;
    const std::vector<std::string> names(all_joints_.begin(), all_joints_.end());
    context_.fault(element.mark(attribute),
                   fmt::format("there is no joint {}{}", in_quotes(joint), suggestion(joint, names, "joints")));
    return false;
  }

  void read_coupling(const MjcfElement& element, const MjcfAttributes& given) {
    const std::string follower = element.file->required_text(element.node, "joint1", context_.faults);
    const std::string leader = element.text("joint2");
    if (follower.empty()) return;
    if (leader.empty()) {
      context_.fault(element.mark(),
                     fmt::format("joint {} is held at a value by <equality>, which is not supported: remove "
                                 "the constraint, and lock the joint",
                                 in_quotes(follower)));
      return;
    }
    for (const auto& [name, attribute] : {std::pair(follower, "joint1"), std::pair(leader, "joint2")}) {
      if (joints_.contains(name)) continue;
      if (is_elsewhere(name, element, attribute))
        context_.passed_over.element(element, "it couples a joint outside the robot and is omitted");
      return;
    }
    const std::vector<double> c = given.overlaid("polycoef", {0, 1, 0, 0, 0}, context_.faults);
    if (c[2] != 0 || c[3] != 0 || c[4] != 0) {
      context_.fault(given.mark("polycoef"),
                     fmt::format("joint {} follows {} by a polynomial of higher degree, which is "
                                 "not supported: only c0 + c1 q is",
                                 in_quotes(follower), in_quotes(leader)));
      return;
    }
    // q1 - ref1 = c0 + c1 (q2 - ref2)
    const double ref1 = reference_of(follower);
    const double ref2 = reference_of(leader);
    SourceJoint& joint = model_.joints[joints_.at(follower)];
    if (joint.mimic) {
      context_.fault(element.mark(), fmt::format("joint {} follows two others", in_quotes(follower)));
      return;
    }
    joint.mimic = SourceMimic{element.mark(), leader, c[1], ref1 + c[0] - c[1] * ref2};
  }

  double reference_of(const std::string& joint) {
    const MjcfPart* part = parts_[joints_.at(joint)];
    return part != nullptr ? mjcf_joint_reference(part->attributes, context_) : 0;
  }

  void set_effort(SourceJoint& joint, const MjcfPart* part) {
    if (joint.kind == SourceJoint::Kind::fixed || part == nullptr) return;
    const auto driven = efforts_.find(joint.name);
    EffortRange effort = driven == efforts_.end() ? EffortRange{-kInfinity, kInfinity} : driven->second;
    if (const auto limit = mjcf_range(part->attributes, "actuatorfrclimited", "actuatorfrcrange", context_))
      effort = clamped(effort, *limit);
    const char* unit = joint.kind == SourceJoint::Kind::prismatic ? "N" : "N m";
    const double down = -effort.lower, up = effort.upper;
    if (down == kInfinity && up == kInfinity) return;
    if (down == 0 && up == 0) {
      context_.decide(
          joint.mark,
          fmt::format("joint {}: its drives give 0 {}; no limit is assumed, because otherwise they could not move it",
                      in_quotes(joint.name), unit),
          joint.name);
      return;
    }
    const bool one_way = !(down > 0) || !(up > 0);
    joint.effort = one_way ? std::max(std::abs(down), std::abs(up)) : std::min(down, up);
    if (std::abs(down - up) <= 1e-12 * std::max(std::abs(down), std::abs(up))) return;
    context_.decide(joint.mark,
                    fmt::format("joint {}: its drives give {:.6g} to {:.6g} {}; taken is {:.6g} both ways",
                                in_quotes(joint.name), effort.lower, effort.upper, unit, *joint.effort),
                    joint.name);
  }

  MjcfContext& context_;
  SourceModel& model_;
  std::map<std::string, std::size_t> joints_;  // of the robot, by name
  std::vector<const MjcfPart*> parts_;         // of these in the file; null of fixed ones
  std::set<std::string> all_joints_;           // of the file
  std::map<std::string, EffortRange> efforts_;
};

}  // namespace

std::optional<std::pair<double, double>> mjcf_range(const MjcfAttributes& given, const char* switched,
                                                    const char* range, MjcfContext& context) {
  static constexpr std::array kSwitch{"auto", "true", "false"};
  const std::string limited = given.word(switched, kSwitch, context.faults);
  const auto values = given.numbers(range, 2, context.faults);
  const bool has_range = values && ((*values)[0] != 0 || (*values)[1] != 0);
  if (limited == "false" || (limited == "auto" && !has_range)) return std::nullopt;
  if (limited == "auto" && !context.compiler.autolimits) {
    context.fault(given.mark(range), fmt::format("{} of <{}> without {}, which autolimits=\"false\" asks for", range,
                                                 given.element().tag(), switched));
    return std::nullopt;
  }
  if (!values || !((*values)[0] < (*values)[1])) {
    if (values || given.giver(range) == nullptr)
      context.fault(given.mark(values ? range : switched),
                    values ? fmt::format("{} of <{}> goes from {} to {}, expected a lower and a higher value", range,
                                         given.element().tag(), (*values)[0], (*values)[1])
                           : fmt::format("<{}> has {}=\"true\" without {}", given.element().tag(), switched, range));
    return std::nullopt;
  }
  return std::pair((*values)[0], (*values)[1]);
}

double mjcf_joint_reference(const MjcfAttributes& joint, MjcfContext& context) {
  const double ref = joint.number("ref", context.faults).value_or(0);
  return joint.text("type", "hinge") == "slide" ? ref : context.compiler.angle(ref);
}

void read_mjcf_drives(const MjcfElement& root, const MjcfTree& tree, const MjcfRobot& robot, MjcfContext& context,
                      SourceModel& model) {
  DriveReader reader(tree, robot, context, model);
  for (const MjcfElement& section : root.children) {
    const std::string tag = section.tag();
    for (const MjcfElement& child : section.children) {
      if (tag == "actuator") reader.read_actuator(child);
      if (tag == "equality") reader.read_equality(child);
      if (tag == "tendon") reader.read_tendon(child);
    }
  }
  reader.finish();
}

}  // namespace grapnel
