#include "grapnel/study_files/frozen_plan.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "grapnel/approach/approach_plan.hpp"
#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/problem/moving_frame.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {
namespace {

void drop(Node& mapping, const std::string& key) {
  std::erase_if(mapping.entries, [&](const NodeEntry& e) { return e.key == key; });
}

// Where an entry was, so that faults in what it becomes point there.
Mark mark_of(const Node& mapping, const std::string& key) {
  const NodeEntry* entry = mapping.entry(key);
  return entry ? entry->mark : mapping.mark;
}

void set(Node& mapping, const std::string& key, Node value) {
  if (NodeEntry* present = mapping.entry(key))
    present->value = std::move(value);
  else
    mapping.entries.push_back({key, value.mark, value});
}

void freeze_waypoints(const ApproachSetup& approach, const ApproachPlan& plan, Node& list) {
  for (std::size_t w = 0; w < approach.waypoints.size(); ++w) {
    if (approach.waypoints[w].places.empty()) continue;
    Node& node = list.items[w];
    const Mark mark = mark_of(node, "end_effectors");
    std::vector<double> position, rate;
    for (const JointTrajectory& joint : plan.joints) {
      const JointPoint point = evaluate(joint, approach.waypoints[w].time);
      position.push_back(point.position), rate.push_back(point.rate);
    }
    drop(node, "end_effectors");
    set(node, "joints", list_node(position, mark));
    set(node, "rates", list_node(rate, mark));
  }
}

Node marked(Node::Kind kind, const Mark& mark) {
  Node node;
  node.kind = kind;
  node.mark = mark;
  return node;
}

// Values of all joints; by their names if those of `before` are.
Node joint_node(const Node* before, const std::vector<std::string>& joints, const std::vector<double>& values,
                const Mark& mark) {
  const bool by_name = before && before->kind == Node::Kind::mapping && !before->find("match");
  if (!by_name) return list_node(values, mark);
  Node mapping = marked(Node::Kind::mapping, mark);
  for (std::size_t j = 0; j < joints.size(); ++j) set(mapping, joints[j], number_node(values[j], mark));
  return mapping;
}

// Final values, and those at waypoints.
void freeze_places(const ApproachSetup& approach, const ApproachPlan& plan, Node& node) {
  const Mark by_plan = mark_of(node, approach.plan ? "plan" : "final_joints"), by_match = mark_of(node, "final_rates");
  drop(node, "plan");
  const std::vector<std::string>& joints = plan.report.joints;
  set(node, "final_joints", joint_node(node.find("final_joints"), joints, plan.report.final_position, by_plan));
  set(node, "final_rates", joint_node(node.find("final_rates"), joints, plan.report.final_rates, by_match));
  if (Node* waypoints = node.find("waypoints")) freeze_waypoints(approach, plan, *waypoints);
}

// The whole motion.
void freeze_motion(const ApproachPlan& plan, Node& node) {
  const Mark mark = mark_of(node, node.find("straight_in") ? "straight_in" : "final_rates");
  Node list = marked(Node::Kind::sequence, mark);
  for (const MotionPiece& piece : motion_pieces(plan.joints)) {
    Node series = marked(Node::Kind::sequence, mark);
    for (const std::vector<double>& one : piece.series) series.items.push_back(list_node(one, mark));
    Node entry = marked(Node::Kind::mapping, mark);
    set(entry, "until", number_node(piece.until, mark));
    set(entry, "series", std::move(series));
    list.items.push_back(std::move(entry));
  }
  for (const char* key : {"plan", "straight_in", "waypoints", "profile", "final_joints", "final_rates"})
    drop(node, key);
  set(node, "pieces", std::move(list));
}

// Whether stated rates would be refused that the plan only warns of.
bool is_too_fast(const CaptureProblem& problem, const ApproachPlan& plan) {
  std::vector<double> times{problem.approach->duration};
  for (const Waypoint& waypoint : problem.approach->waypoints) times.push_back(waypoint.time);
  for (std::size_t j = 0; j < plan.joints.size(); ++j) {
    const auto is_it = [&](const BodyDescription& body) { return body.joint.name == plan.report.joints[j]; };
    const auto body = std::find_if(problem.robot.bodies.begin(), problem.robot.bodies.end(), is_it);
    if (body == problem.robot.bodies.end()) continue;
    for (const double t : times) {
      if (std::abs(evaluate(plan.joints[j], t).rate) > body->joint.limits.rate) return true;
    }
  }
  return false;
}

}  // namespace

bool has_something_to_plan(const ApproachSetup& approach) {
  const auto by_places = [](const Waypoint& waypoint) { return !waypoint.places.empty(); };
  return approach.plan || approach.match ||
         std::any_of(approach.waypoints.begin(), approach.waypoints.end(), by_places);
}

void freeze_plan(const CaptureProblem& problem, Node& scenario) {
  if (!problem.approach || !has_something_to_plan(*problem.approach)) return;
  const ApproachSetup& approach = *problem.approach;
  // In the frame in which runs plan too: searches end within a tolerance, in another frame at another rounding.
  const CaptureProblem seen = seen_from(moving_frame(problem), problem);
  const ApproachPlan plan = plan_approach(seen, plan_targets(seen));
  if (!plan.failure.empty()) throw std::runtime_error(plan.failure);
  Node& node = *scenario.find("approach");
  if (approach.straight_in || is_too_fast(problem, plan))
    freeze_motion(plan, node);
  else
    freeze_places(approach, plan, node);
  if (Node* grasps = scenario.find("grasps")) {
    for (Node& grasp : grasps->items) {
      drop(grasp, "relative_velocity");
      drop(grasp, "relative_angular_velocity");
    }
  }
}

}  // namespace grapnel
