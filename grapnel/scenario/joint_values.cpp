#include "grapnel/scenario/joint_values.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>

#include "grapnel/scenario/plausibility.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/units.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {
namespace {

std::string names_of(const std::vector<JointDescription>& joints) {
  std::vector<std::string> names;
  for (const JointDescription& joint : joints) names.push_back(joint.name);
  return some_of(names);
}

// Calls visit(joint index, node, path) for all that belongs to a joint.
template <class Visit>
void for_each_node(const Node& node, const std::string& path, const ReadRobot& robot, Visit visit) {
  if (node.is_sequence() && robot.order_known && node.items.size() == robot.joints.size()) {
    for (std::size_t i = 0; i < node.items.size(); ++i)
      visit(i, node.items[i], fmt::format("{} (joint {})", item(path, i), in_quotes(robot.joints[i].name)));
  }
  for (const NodeEntry& entry : node.entries) {
    const auto it = robot.joint_index.find(entry.key);
    if (it != robot.joint_index.end()) visit(it->second, entry.value, below(path, shortened(entry.key)));
  }
}

// Calls visit(joint index, value, place, path) for every number that belongs to a joint.
template <class Visit>
void for_each_value(const Node& node, const std::string& path, const ReadRobot& robot, Visit visit) {
  for_each_node(node, path, robot, [&](std::size_t joint, const Node& one, const std::string& name) {
    if (const auto value = number_of(one)) visit(joint, *value, one.mark, name);
  });
}

// "; 30 degrees are 0.523598776" if an angle exceeds a full turn and would be within the limits as degrees.
std::string degrees_advice(const JointDescription& joint, double value) {
  const double as_degrees = value * std::numbers::pi / 180;
  const bool fits = as_degrees >= joint.limits.lower && as_degrees <= joint.limits.upper;
  if (!turns_about_axis(joint.type) || !fits || std::abs(value) <= 2 * std::numbers::pi || std::abs(value) > 720)
    return {};
  return fmt::format("; it is in rad, {} degrees are {:.9g}", value, as_degrees);
}

void check_names(const Node& node, const std::string& path, const ReadRobot& robot, bool all, FaultList& faults) {
  for (const NodeEntry& entry : node.entries) {
    if (robot.fixed_joints.contains(entry.key)) {
      faults.add(entry.mark, fmt::format("joint {} in {} is fixed and has no value", in_quotes(entry.key), path));
    } else {
      robot.joint_names.expect(entry.key, entry.mark, path, faults);
    }
  }
  if (!all || !robot.count_known()) return;
  std::vector<JointDescription> missing;
  std::set<std::string, std::less<>> given;
  for (const NodeEntry& entry : node.entries) {
    given.insert(entry.key);
    // A misspelt name has been reported with a suggestion.
    if (!robot.joint_names.contains(entry.key)) given.insert(nearest(entry.key, robot.joint_names.names()));
  }
  for (const JointDescription& joint : robot.joints) {
    if (!given.contains(joint.name) && joint.mimic.empty()) missing.push_back(joint);
  }
  if (!missing.empty()) faults.add(node.mark, fmt::format("{} lacks joints: {}", path, names_of(missing)));
}

// Checks the names of a mapping, or the length of a list.
void check_joints(const Node& node, const std::string& path, const ReadRobot& robot, bool all, FaultList& faults) {
  const std::size_t count = robot.joints.size();
  if (node.is_mapping()) check_names(node, path, robot, all, faults);
  if (node.is_sequence() && robot.count_known() && node.items.size() != count) {
    faults.add(node.mark,
               fmt::format("{} has {}, must have {}, one for each moving joint{}", path,
                           counted(node.items.size(), "item"), count, count > 0 ? ": " + names_of(robot.joints) : ""));
  }
}

// Joints that follow others and are not stated get the values, or rates, of their couplings. Each pass settles at least
// one joint of every chain.
void follow_stated(const std::vector<JointDescription>& joints, const std::vector<bool>& stated, bool of_rates,
                   std::vector<double>& values) {
  const auto place = [&](const std::string& name) {
    const auto is_it = [&](const JointDescription& joint) { return joint.name == name; };
    return static_cast<std::size_t>(std::find_if(joints.begin(), joints.end(), is_it) - joints.begin());
  };
  const auto is_coupled = [](const JointDescription& joint) { return !joint.mimic.empty(); };
  const auto passes = std::count_if(joints.begin(), joints.end(), is_coupled);
  for (std::ptrdiff_t pass = 0; pass < passes; ++pass) {
    for (std::size_t j = 0; j < joints.size(); ++j) {
      if (stated[j] || joints[j].mimic.empty()) continue;
      values[j] = 0;
      for (const CouplingTerm& term : joints[j].mimic) {
        if (const std::size_t k = place(term.joint); k < values.size())
          values[j] += term.ratio * values[k] + (of_rates ? 0 : term.offset);
      }
    }
  }
}

// Values in joint order. A joint absent from a mapping gets `absent`, or is an error if there is no such value. Empty
// if errors make values or order uncertain; names and lengths are checked even then.
std::optional<std::vector<double>> joint_values_of(const Node& node, const std::string& path, const ReadRobot& robot,
                                                   std::optional<double> absent, FaultList& faults) {
  const std::size_t count = robot.joints.size();
  if (const auto one = number_of(node)) return std::vector<double>(count, *one);
  check_joints(node, path, robot, !absent, faults);
  if (!robot.order_known || (!node.is_mapping() && !node.is_sequence())) return {};
  std::vector<double> values(count, absent.value_or(0));
  for_each_value(node, path, robot,
                 [&](std::size_t i, double value, const Mark&, const std::string&) { values[i] = value; });
  return values;
}

// Wrong units and invalid numbers have been reported. A number with an explicit unit needs no plausibility warning.
template <class Visit>
void for_each_fitting(const Node& node, const std::string& path, const ReadRobot& robot, Visit visit) {
  for_each_node(node, path, robot, [&](std::size_t i, const Node& one, const std::string& name) {
    const auto value = number_of(one);
    const int of_joint = slides_along_axis(robot.joints[i].type) ? 2 : 1;
    if (value && (one.unit == 0 || one.unit == of_joint)) visit(i, *value, one.mark, name, one.unit != 0);
  });
}

void check_position_limits(const Node& node, const std::string& path, const ReadRobot& robot, FaultList& faults) {
  for_each_fitting(
      node, path, robot, [&](std::size_t i, double value, const Mark& mark, const std::string& name, bool has_unit) {
        const JointLimits& limits = robot.joints[i].limits;
        if (is_within(limits, value, false)) {
          if (turns_about_axis(robot.joints[i].type) && !has_unit) doubt_angle(value, mark, name, faults);
          return;
        }
        faults.add(mark, fmt::format("{} is {}, beyond the joint's limits {} to {}{}", name, value, limits.lower,
                                     limits.upper, has_unit ? "" : degrees_advice(robot.joints[i], value)));
      });
}

void check_rate_limits(const Node& node, const std::string& path, const ReadRobot& robot, FaultList& faults) {
  for_each_fitting(
      node, path, robot, [&](std::size_t i, double value, const Mark& mark, const std::string& name, bool has_unit) {
        if (is_within(robot.joints[i].limits, value, true)) {
          if (turns_about_axis(robot.joints[i].type) && !has_unit) doubt_angular_rate(value, mark, name, faults);
          return;
        }
        faults.add(mark,
                   fmt::format("{} is {}, beyond the joint's rate limit {}", name, value, robot.joints[i].limits.rate));
      });
}

// Gains of computed torque have one unit for all joint types: the third in the list.
void check_gain_units(const Node& node, std::string_view stated, const std::string& path, bool of_accelerations,
                      const ReadRobot& robot, FaultList& faults) {
  if (!of_accelerations) return check_units(node, stated, path, robot, faults);
  const auto check = [&](const Node& one, const std::string& name) {
    if (one.unit == 0 || one.unit == Node::kRefusedUnit || one.unit == 3) return;
    const std::vector<std::string_view> units = units_of_place(stated);
    faults.add(one.mark, fmt::format("{} is in {}; with computed_torque gains are in {}", name, units.at(one.unit - 1u),
                                     units.at(2)));
  };
  if (node.is_scalar()) check(node, path);
  for_each_node(node, path, robot, [&](std::size_t, const Node& one, const std::string& name) { check(one, name); });
}

// ---- Forms ----

using Json = nlohmann::ordered_json;
using Numbers = std::span<const double>;

// Joint limits apply to values and rates, not to gains.
enum class Limits { none, position, rate };
Limits limits_of(const Field& field) {
  return field.form.starts_with("gains of ") || field.form == "offsets of joints" ? Limits::none
         : field.unit.starts_with("rad/s")                                        ? Limits::rate
                                                                                  : Limits::position;
}

Json by_name(const Json& value, const char* title) {
  return {{"type", "object"}, {"title", title}, {"additionalProperties", value}};
}
Json in_order(const Json& value, const char* title) { return {{"type", "array"}, {"title", title}, {"items", value}}; }

constexpr const char *kByName = "a mapping {joint name: value}", *kInOrder = "a list in joint order";

Json values_schema(const Field& field, const TypeReference&) {
  const Json value = number_schema(field.range);
  return {{"anyOf", {by_name(value, kByName), in_order(value, kInOrder)}}};
}

Json gains_schema(const Field& field, const TypeReference&) {
  const Json value = number_schema(field.range);
  return {{"anyOf", {titled(value, "a number for all joints"), by_name(value, kByName), in_order(value, kInOrder)}}};
}

// The joints whose values a list, or a mapping by its keys, states.
std::vector<bool> stated_joints(const Node& node, const std::vector<JointDescription>& joints) {
  std::vector<bool> stated;
  for (const JointDescription& joint : joints) stated.push_back(!node.is_mapping() || node.find(joint.name) != nullptr);
  return stated;
}

// The numbers; joints absent from a mapping of rates are at rest, or follow others.
std::string read_numbers(const ValueToRead& at) {
  const Limits limits = limits_of(at.field);
  const ReadRobot& robot = *at.scope.robot;
  const std::optional<double> absent = limits == Limits::rate ? std::optional(0.0) : std::nullopt;
  std::string name = at.name();
  auto& values = at.into<std::vector<double>>();
  values = joint_values_of(at.node, name, robot, absent, at.scope.faults).value_or(std::vector<double>{});
  if (limits != Limits::none && values.size() == robot.joints.size())
    follow_stated(robot.joints, stated_joints(at.node, robot.joints), limits == Limits::rate, values);
  return name;
}

void read_values(const ValueToRead& at) {
  const std::string name = read_numbers(at);
  check_units(at.node, at.field.unit, name, *at.scope.robot, at.scope.faults);
  if (limits_of(at.field) == Limits::position) check_position_limits(at.node, name, *at.scope.robot, at.scope.faults);
  if (limits_of(at.field) == Limits::rate) check_rate_limits(at.node, name, *at.scope.robot, at.scope.faults);
}

// A number for all joints, or single ones; joints absent from a mapping have none.
void read_offsets(const ValueToRead& at) {
  const std::string name = at.name();
  at.into<std::vector<double>>() =
      joint_values_of(at.node, name, *at.scope.robot, 0.0, at.scope.faults).value_or(std::vector<double>{});
  check_units(at.node, at.field.unit, name, *at.scope.robot, at.scope.faults);
}

bool are_of_accelerations(const TrackingSetup& tracking) { return tracking.mode == JointControl::computed_torque; }
bool are_of_accelerations(const PostImpactSetup& post) {
  return post.joints == PostImpactSetup::Joints::computed_torque;
}

// For a structure whose control law is in a key that is read before.
template <class Owner>
void read_gains(const ValueToRead& at) {
  const std::string name = read_numbers(at);
  const bool of_accelerations = are_of_accelerations(*static_cast<const Owner*>(at.owner));
  check_gain_units(at.node, at.field.unit, name, of_accelerations, *at.scope.robot, at.scope.faults);
}

// The joints of the form's values, in its order; empty for one number for all.
std::optional<std::vector<std::size_t>> joints_of(const NumberPlace& at, const std::vector<JointDescription>& order) {
  std::vector<std::size_t> which;
  const auto add = [&](std::string_view name) {
    for (std::size_t j = 0; j < order.size(); ++j) {
      if (order[j].name == name) which.push_back(j);
    }
  };
  if (at.rest.empty() && at.form.is_scalar()) return which;
  if (at.rest.empty() && at.form.is_sequence() && at.form.items.size() == order.size()) {
    for (std::size_t j = 0; j < order.size(); ++j) which.push_back(j);
  } else if (at.rest.empty() && at.form.is_mapping()) {
    for (const NodeEntry& entry : at.form.entries) add(entry.key);
    if (which.size() != at.form.entries.size()) return {};
  } else if (at.rest.size() == 1 && at.form.is_scalar()) {
    if (at.rest[0].is_index)
      which.push_back(at.rest[0].index);
    else
      add(at.rest[0].key);
  }
  if (which.empty() || std::any_of(which.begin(), which.end(), [&](auto j) { return j >= order.size(); })) return {};
  return which;
}

NumberWriter values_writer(const NumberPlace& at) {
  const Limits limits = limits_of(at.field);
  const std::vector<JointDescription> order = moving_joints(at.problem.robot);
  const auto which = joints_of(at, order);
  if (!which || (which->empty() && limits != Limits::none)) return nullptr;
  const std::vector<bool> stated = stated_joints(at.form, order);
  return [=, field = at.field, which = *which](CaptureProblem&, void* place, Numbers numbers) {
    auto& values = *static_cast<std::vector<double>*>(place);
    const bool all = which.empty();
    if (numbers.size() != (all ? 1 : which.size()) || !allows(field, numbers)) return false;
    if (values.size() != order.size()) return false;
    if (all) values.assign(order.size(), numbers[0]);
    for (std::size_t i = 0; i < which.size(); ++i) {
      if (limits != Limits::none && !is_within(order[which[i]].limits, numbers[i], limits == Limits::rate))
        return false;
      values[which[i]] = numbers[i];
    }
    if (limits != Limits::none) follow_stated(order, stated, limits == Limits::rate, values);
    return true;
  };
}

Node values_node(const Type&, const void* value) {
  return numbers_node(*static_cast<const std::vector<double>*>(value));
}

// Given, or matched to the motion of the grasp points.
Json final_rates_schema(const Field&, const TypeReference&) {
  Json names;
  for (const Choice& choice : type_of<RateMatch>().choices) names.push_back(choice.name);
  const Json match{{"enum", names},
                   {"description",
                    "Rates that match the motion of the grasp points through the generalized Jacobian; needs `grasps`. "
                    "velocity: the linear part, with zero angular velocity of the end-effector. twist: both parts. "
                    "velocity_least_rates: the linear part with the smallest joint rates."}};
  Json named = by_name(number_schema({}), "a mapping {joint name: rate}");
  named["not"] = {{"required", Json::array({"match"})}};
  return {{"anyOf",
           {{{"type", "object"},
             {"title", "{match: velocity}"},
             {"required", Json::array({"match"})},
             {"additionalProperties", false},
             {"properties", {{"match", match}}}},
            named,
            in_order(number_schema({}), kInOrder)}}};
}
void read_final_rates(const ValueToRead& at) {
  if (at.node.entry("match")) {
    const auto match = value_named<RateMatch>(text_at(at.node, "match"));
    static_cast<ApproachSetup*>(at.owner)->match = match.value_or(RateMatch::velocity);
    return;
  }
  for (const NodeEntry& entry : at.node.entries) {
    // A slip in this one key would otherwise read as the name of a joint.
    if (at.scope.robot->joint_names.contains(entry.key) || nearest(entry.key, {"match"}).empty()) continue;
    at.scope.faults.add(entry.mark,
                        fmt::format("unknown key {} in {}; did you mean 'match'?", in_quotes(entry.key), at.name()));
    return;
  }
  read_values(at);
}

// Coefficients of every joint.
Json series_schema(const Field&, const TypeReference&) {
  const Json one{{"type", "array"}, {"items", number_schema({})}, {"minItems", 1}, {"maxItems", 100}};
  return {{"anyOf",
           {by_name(one, "a mapping {joint name: list of numbers}"), in_order(one, "a list of lists in joint order")}}};
}
void read_series(const ValueToRead& at) {
  auto& series = at.into<std::vector<std::vector<double>>>();
  check_joints(at.node, at.name(), *at.scope.robot, true, at.scope.faults);
  for (const Node* one : joint_nodes(at.node, *at.scope.robot)) {
    const auto numbers = one->is_sequence() ? numbers_in(*one) : std::nullopt;
    series.push_back(numbers.value_or(std::vector<double>{}));  // else reported by the schema
  }
  for_each_node(at.node, at.name(), *at.scope.robot, [&](std::size_t j, const Node& one, const std::string& name) {
    for (std::size_t i = 0; i < one.items.size(); ++i)
      check_unit(one.items[i], at.field.unit, at.scope.robot->joints[j], item(name, i), at.scope.faults);
  });
}

const Form kJointForms[] = {
    {.name = "joint values",
     .schema = values_schema,
     .read = read_values,
     .numbers = values_writer,
     .write = values_node},
    {.name = "gains of tracking",
     .schema = gains_schema,
     .read = read_gains<TrackingSetup>,
     .numbers = values_writer,
     .write = values_node},
    {.name = "gains of post_impact",
     .schema = gains_schema,
     .read = read_gains<PostImpactSetup>,
     .numbers = values_writer,
     .write = values_node},
    {.name = "offsets of joints",
     .schema = gains_schema,
     .read = read_offsets,
     .numbers = values_writer,
     .write = values_node},
    {.name = "final rates", .schema = final_rates_schema, .read = read_final_rates, .numbers = values_writer},
    {.name = "series by joint", .schema = series_schema, .read = read_series},
};

}  // namespace

std::span<const Form> joint_value_forms() { return kJointForms; }

bool is_within(const JointLimits& limits, double value, bool is_rate) {
  return is_rate ? std::abs(value) <= limits.rate : value >= limits.lower && value <= limits.upper;
}

void check_unit(const Node& value, std::string_view stated, const JointDescription& joint, const std::string& name,
                FaultList& faults) {
  const bool slides = slides_along_axis(joint.type);
  const unsigned of_joint = slides ? 2 : 1;
  const std::vector<std::string_view> units = units_of_place(stated);
  if (value.unit == 0 || value.unit == Node::kRefusedUnit || value.unit == of_joint || units.size() < 2) return;
  faults.add(value.mark,
             fmt::format("{} is in {}, but joint {} {}: expected {}", name, units.at(value.unit - 1u),
                         in_quotes(joint.name), slides ? "slides" : "turns", expected_of(units.at(of_joint - 1))));
}

void check_units(const Node& values, std::string_view stated, const std::string& path, const ReadRobot& robot,
                 FaultList& faults) {
  if (!values.is_scalar()) {
    for_each_node(values, path, robot, [&](std::size_t j, const Node& one, const std::string& name) {
      check_unit(one, stated, robot.joints[j], name, faults);
    });
    return;
  }
  const std::size_t before = faults.size();
  for (const JointDescription& joint : robot.joints) {
    if (faults.size() == before) check_unit(values, stated, joint, path, faults);
  }
}

std::vector<const Node*> joint_nodes(const Node& node, const ReadRobot& robot) {
  if (!robot.order_known) return {};
  std::vector<const Node*> nodes(robot.joints.size());
  for (std::size_t i = 0; i < node.items.size() && i < nodes.size(); ++i) nodes[i] = &node.items[i];
  for (const NodeEntry& entry : node.entries) {
    const auto it = robot.joint_index.find(entry.key);
    if (it != robot.joint_index.end()) nodes[it->second] = &entry.value;
  }
  if (std::find(nodes.begin(), nodes.end(), nullptr) != nodes.end()) return {};
  return nodes;
}

void check_agreement(const Node& node, const std::string& path, const ReadRobot& robot, const ExpectedValues& expected,
                     FaultList& faults) {
  for_each_value(node, path, robot, [&](std::size_t i, double value, const Mark& mark, const std::string& name) {
    if (std::abs(value - expected.values[i]) <= expected.tolerance) return;
    faults.add(mark, fmt::format("{} is {}, but {} {}; they must agree within {}; correct one or leave out {}", name,
                                 value, expected.source, expected.values[i], expected.tolerance, path));
  });
}

}  // namespace grapnel
