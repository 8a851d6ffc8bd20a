#include "grapnel/scenario/write_back.hpp"

#include <fmt/format.h>

#include "grapnel/approach/capture_goals.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {
namespace {

Node text_node(const std::string& text) {
  Node node;
  node.kind = Node::Kind::scalar;
  node.text = text;
  node.plain = is_text(node);  // else it would be a number, say, without quotes
  return node;
}

// Without the sign of zero, which nobody means.
Node plain_number(double value) { return number_node(value == 0 ? 0 : value); }

Node plain_list(const std::vector<double>& values) {
  Node node;
  node.kind = Node::Kind::sequence;
  for (const double value : values) node.items.push_back(plain_number(value));
  return node;
}
Node vector_node(const Vector3d& v) { return plain_list({v[0], v[1], v[2]}); }

void set(Node& mapping, const std::string& key, Node value) {
  mapping.kind = Node::Kind::mapping;
  if (Node* present = mapping.find(key))
    *present = std::move(value);
  else
    mapping.entries.push_back({key, {}, std::move(value)});
}
void drop(Node& mapping, const std::string& key) {
  std::erase_if(mapping.entries, [&](const NodeEntry& e) { return e.key == key; });
}

bool differs(const Vector3d& a, const Vector3d& b) { return a[0] != b[0] || a[1] != b[1] || a[2] != b[2]; }
bool differs(const std::optional<Vector3d>& a, const std::optional<Vector3d>& b) {
  return a.has_value() != b.has_value() || (a && differs(*a, *b));
}
bool differs(const Rotationd& a, const Rotationd& b) {
  for (int k = 0; k < 3; ++k) {
    if (differs(a.column(k), b.column(k))) return true;
  }
  return false;
}
bool differs(const Symmetric3d& a, const Symmetric3d& b) {
  return a.xx != b.xx || a.yy != b.yy || a.zz != b.zz || a.xy != b.xy || a.xz != b.xz || a.yz != b.yz;
}

Node inertia_node(const Symmetric3d& I) {
  Node node;
  node.kind = Node::Kind::mapping;
  const std::pair<const char*, double> components[] = {{"xx", I.xx}, {"yy", I.yy}, {"zz", I.zz},
                                                       {"xy", I.xy}, {"xz", I.xz}, {"yz", I.yz}};
  for (const auto& [key, value] : components) set(node, key, plain_number(value));
  return node;
}

void write_point(const GraspPoint& before, const GraspPoint& after, Node& node) {
  if (differs(before.X_TG.p, after.X_TG.p)) set(node, "position", vector_node(after.X_TG.p));
  if (differs(before.X_TG.R, after.X_TG.R)) {
    drop(node, "rpy");
    const Quaterniond q = quaternion_from(after.X_TG.R);
    set(node, "quaternion_wxyz", plain_list({q.w, q.x, q.y, q.z}));
  }
  if (after.approach_direction && differs(before.approach_direction, after.approach_direction))
    set(node, "approach_direction", vector_node(*after.approach_direction));
  if (after.normal && differs(before.normal, after.normal)) set(node, "normal", vector_node(*after.normal));
}

void write_target(const TargetSetup& before, const TargetSetup& after, Node& node) {
  if (before.mass != after.mass) set(node, "mass", plain_number(after.mass));
  if (differs(before.inertia, after.inertia)) set(node, "inertia", inertia_node(after.inertia));
  Node& state = *node.find("state");
  if (differs(before.V_WT.angular, after.V_WT.angular)) set(state, "angular_velocity", vector_node(after.V_WT.angular));
  if (differs(before.V_WT.linear, after.V_WT.linear)) set(state, "velocity", vector_node(after.V_WT.linear));
  for (std::size_t p = 0; p < after.grasp_points.size(); ++p) {
    Node& points = *node.find("grasp_points");
    const bool is_new = p >= before.grasp_points.size();
    if (is_new) {
      points.items.emplace_back();
      set(points.items.back(), "name", text_node(after.grasp_points[p].name));
    }
    write_point(is_new ? GraspPoint{} : before.grasp_points[p], after.grasp_points[p], points.items[p]);
  }
}

void write_grasp(const GraspSetup& before, const GraspSetup& after, Node& node) {
  using Orientation = GraspSetup::Orientation;
  if (before.grasp_point != after.grasp_point) set(node, "point", text_node(after.grasp_point));
  if (before.orientation != after.orientation) {
    const char* name = after.orientation == Orientation::axis   ? "axis"
                       : after.orientation == Orientation::pose ? "pose"
                                                                : "free";
    set(node, "orientation", text_node(name));
  }
  if (differs(before.relative_velocity, after.relative_velocity))
    set(node, "relative_velocity", vector_node(after.relative_velocity));
  if (differs(before.relative_angular_velocity, after.relative_angular_velocity))
    set(node, "relative_angular_velocity", vector_node(after.relative_angular_velocity));
}

}  // namespace

void write_back(const CaptureProblem& before, const CaptureProblem& after, Node& scenario) {
  for (std::size_t t = 0; t < after.targets.size(); ++t)
    write_target(before.targets[t], after.targets[t], scenario.find("targets")->items[t]);
  for (std::size_t g = 0; g < after.grasps.size(); ++g)
    write_grasp(before.grasps[g], after.grasps[g], scenario.find("grasps")->items[g]);
  if (!before.approach || !before.approach->plan) return;
  const PlanSetup &plan = *before.approach->plan, &changed = *after.approach->plan;
  Node& node = *scenario.find("approach")->find("plan");
  if (plan.guess != changed.guess) set(node, "guess", plain_list(changed.guess));
  if (plan.measure != changed.measure) set(node, "measure", text_node(name_of(changed.measure)));
}

}  // namespace grapnel
