#include "grapnel/campaign/changed_scenario.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "grapnel/approach/approach_plan.hpp"
#include "grapnel/approach/capture_window.hpp"
#include "grapnel/problem/captured_model.hpp"
#include "grapnel/scenario/forms.hpp"
#include "grapnel/scenario/imported_robot.hpp"
#include "grapnel/scenario/mesh_files.hpp"
#include "grapnel/scenario/ready_made.hpp"
#include "grapnel/scenario/sections.hpp"
#include "grapnel/text/write_yaml.hpp"
#include "grapnel/text/yaml_tree.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {
namespace {

void drop(Node& mapping, std::string_view key) {
  std::erase_if(mapping.entries, [&](const NodeEntry& e) { return e.key == key; });
}

void set(Node& mapping, std::string_view key, Node value) {
  mapping.kind = Node::Kind::mapping;
  if (Node* present = mapping.find(key))
    *present = std::move(value);
  else
    mapping.entries.push_back({std::string(key), value.mark, std::move(value)});
}

bool is_inside_robot(const Change& change) {
  return change.path.starts_with("robot.") || change.path.starts_with("robot[");
}

// The path of a file named in the scenario, relative to another place; absolute for an empty place, so that the text
// does not depend on its location.
void move_path(const std::filesystem::path& scenario, const std::filesystem::path& place, Node* named) {
  if (!named || !is_text(*named) || named->text.empty()) return;
  const std::filesystem::path file = std::filesystem::absolute(path_beside(scenario, named->text)).lexically_normal();
  named->text = place.empty()
                    ? file.generic_string()
                    : std::filesystem::proximate(file, std::filesystem::absolute(place).parent_path()).generic_string();
}

// The paths in the import of a scenario's robot: files of models and buses, folders of packages.
std::vector<Node*> import_path_nodes(Node& scenario) {
  std::vector<Node*> paths;
  const auto add = [&](Node* mapping, const char* key) {
    Node* node = mapping ? mapping->find(key) : nullptr;
    if (node && is_text(*node) && !find_ready_made(ReadyMade::Kind::robots, node->text)) paths.push_back(node);
  };
  const auto add_settings = [&](Node* settings) {
    add(settings, "bus");
    if (Node* packages = settings ? settings->find("packages") : nullptr) {
      for (NodeEntry& entry : packages->entries) {
        if (is_text(entry.value)) paths.push_back(&entry.value);
      }
    }
  };
  add_settings(scenario.find("import"));
  Node* robot = scenario.find("robot");
  if (!robot || !is_put_together(*robot)) return paths;
  add(robot, "bus");
  if (Node* arms = robot->find("arms")) {
    for (Node& arm : arms->items) add(&arm, "file"), add_settings(&arm);
  }
  return paths;
}

}  // namespace

void include_robot(Node& root, const std::filesystem::path& scenario, const ScenarioFiles& files) {
  Node* robot = root.find("robot");
  if (robot && needs_import(*robot)) {
    auto imported = imported_robot(root, scenario, files);
    if (!imported) {  // imported again
      ScenarioFiles fresh;
      FaultList unexpected;
      imported = import_robot(root, scenario, fresh, unexpected);
    }
    if (!imported) return;
    *robot = imported->tree;
    drop(root, "import");
    return;
  }
  if (!robot || !is_text(*robot)) return;
  const std::filesystem::path path = robot_path(scenario, robot->text);
  const auto file = files.find(path);
  if (!file) return;
  *robot = file->tree;
  for (Node* mesh : mesh_file_nodes(*robot)) move_path(path, scenario, mesh);
}

Node changed_tree(const std::filesystem::path& scenario, std::span<const Change> changes, const ScenarioFiles& files) {
  Node root = files.find(scenario)->tree;
  FaultList unexpected;  // the changes have been applied before
  std::filesystem::path robot_file;
  std::set<std::string, std::less<>> targets;
  apply_changes(root, import_first(root, changes), targets, unexpected, [&](const Change& change) {
    Node* robot = root.find("robot");
    const bool inside = is_inside_robot(change) && !is_import_choice(root, change.path);
    if (inside && robot && needs_import(*robot)) {
      include_robot(root, scenario, files);
    } else if (inside && robot && is_text(*robot)) {
      const std::filesystem::path path = robot_path(scenario, robot->text);
      if (const auto file = files.find(path)) *robot = file->tree, robot_file = path;
    }
    return true;
  });
  // Values are written back into the target.
  include_targets(root, targets, unexpected);
  if (Node* list = root.find("targets")) {
    for (Node& target : list->items) drop(target, "ready_made");
  }
  if (Node* robot = root.find("robot"); robot && !robot_file.empty()) {
    for (Node* mesh : mesh_file_nodes(*robot)) move_path(robot_file, scenario, mesh);
  }
  return root;
}

void preserve_normals(const CaptureProblem& before, StudyCase& point) {
  for (std::size_t g = 0; g < point.problem.grasps.size(); ++g) {
    const GraspSetup& grasp = point.problem.grasps[g];
    if (grasp.grasp_point == before.grasps[g].grasp_point) continue;
    for (TargetSetup& target : point.problem.targets) {
      if (target.name != grasp.target) continue;
      for (GraspPoint& one : target.grasp_points) {
        if (one.name == grasp.grasp_point && !one.normal) one.normal = -point.inward_normals[g];
      }
    }
  }
}

std::string changed_scenario_text(ScenarioOnFile scenario, const CaptureProblem& after,
                                  const std::filesystem::path& place, const std::string& suffix,
                                  const std::string& comment) {
  const std::filesystem::path& file = scenario.file;
  Node& tree = scenario.tree;
  write_back(scenario.problem, after, tree);
  for (Node* path : import_path_nodes(tree)) move_path(file, place, path);
  if (Node* robot = tree.find("robot"); robot && !find_ready_made(ReadyMade::Kind::robots, robot->text))
    move_path(file, place, robot);
  for (Node* mesh : mesh_file_nodes(tree)) move_path(file, place, mesh);
  if (Node* approach = tree.find("approach")) move_path(file, place, approach->find("trajectory"));
  if (Node* control = tree.find("control")) {
    for (const char* key : {"plugin", "fmu", "torques"}) move_path(file, place, control->find(key));
  }
  if (Node* name = tree.find("name")) {
    name->text += suffix;
    name->plain = name->plain && is_text(*name);
  }
  return yaml_text(tree, comment);
}

// ---- Writing back differences ----

namespace {

void write_differences(const Type& type, const void* before, const void* after, Node& mapping);

bool same(const Node& a, const Node& b) {
  const auto same_entries = [](const NodeEntry& x, const NodeEntry& y) {
    return x.key == y.key && same(x.value, y.value);
  };
  return a.text == b.text && std::equal(a.items.begin(), a.items.end(), b.items.begin(), b.items.end(), same) &&
         std::equal(a.entries.begin(), a.entries.end(), b.entries.begin(), b.entries.end(), same_entries);
}

// Items absent in `before` are compared with a default-constructed item. A single item may appear without a list.
void write_list(const Type& list, const void* before, const void* after, Node& node) {
  const Type& type = list.of();
  if (node.is_mapping() && list.size(after) != 1) return;  // such items are never added or removed
  for (std::size_t i = 0; i < list.size(after); ++i) {
    const auto write = [&](const void* b) {
      const auto to = [&](const void* a) { write_differences(type, b, a, node.is_mapping() ? node : node.items[i]); };
      list.show_item(after, i, visitor_of(to));
    };
    if (!node.is_mapping() && i >= node.items.size()) node.items.emplace_back();
    if (i < list.size(before))
      list.show_item(before, i, visitor_of(write));
    else
      type.show_default(visitor_of(write));
  }
}

void write_value(const Field& field, const Type& type, const void* before, const void* after, Node& mapping) {
  Node* present = mapping.find(field.key);
  if (type.kind == Type::Kind::optional) {
    if (type.size(after) == 0) return;
    const auto write = [&](const void* b) {
      const auto to = [&](const void* a) { write_value(field, type.of(), b, a, mapping); };
      type.show_item(after, 0, visitor_of(to));
    };
    if (type.size(before) == 1) return type.show_item(before, 0, visitor_of(write));
  }
  if (const Form* form = form_of(field)) {
    if (!form->write) return;
    const Type& value = type.kind == Type::Kind::optional ? type.of() : type;
    Node now;
    const auto take = [&](const void* a) { now = form->write(value, a); };
    if (type.kind == Type::Kind::optional)
      type.show_item(after, 0, visitor_of(take));
    else if (now = form->write(value, after); same(now, form->write(value, before)))
      return;
    if (field.form == "quaternion") drop(mapping, "rpy");
    set(mapping, field.key, std::move(now));
  } else if (present && type.kind == Type::Kind::structure) {
    write_differences(type, before, after, *present);
  } else if (present && type.kind == Type::Kind::list) {
    write_list(type, before, after, *present);
  }
}

void write_differences(const Type& type, const void* before, const void* after, Node& mapping) {
  for (const Field& field : type.fields) {
    if (!field.place || field.form == "robot" || (field.is_present && !field.is_present(after))) continue;
    const auto write = [&](const void* b) {
      const auto to = [&](const void* a) { write_value(field, field.type(), b, a, mapping); };
      field.show(after, visitor_of(to));
    };
    field.show(before, visitor_of(write));
  }
}

}  // namespace

void write_back(const CaptureProblem& before, const CaptureProblem& after, Node& scenario) {
  write_differences(scenario_description(), &before, &after, scenario);
}

// ---- Planned approaches ----

namespace {

// The location of the replaced entry, for errors in its replacement.
Mark mark_of(const Node& mapping, const std::string& key) {
  const NodeEntry* entry = mapping.entry(key);
  return entry ? entry->mark : mapping.mark;
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

// Values of all joints; by name if those of `before` are by name.
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
  for (const MotionPiece& piece : motion_segments(plan.joints)) {
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

// Whether the reader would reject rates for which the plan only gives a warning.
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

void freeze_plan(const CaptureProblem& stated, Node& scenario) {
  if (!stated.approach || !has_something_to_plan(*stated.approach)) return;
  Node& node = *scenario.find("approach");
  CaptureProblem problem = stated;
  if (stated.approach->window) {
    CaptureTime chosen = choose_capture_time(stated);
    if (!chosen.failure.empty()) throw std::runtime_error(chosen.failure);
    problem = std::move(chosen.problem);
    const Mark mark = mark_of(node, "window");
    drop(node, "window");
    set(node, "duration", number_node(problem.approach->duration, mark));
  }
  const ApproachSetup& approach = *problem.approach;
  // In the same frame as in runs: searches end within a tolerance, and another frame gives other rounding errors.
  const CaptureProblem seen = seen_from(moving_frame(problem), problem);
  const ApproachPlan plan = plan_approach(seen, plan_targets(seen));
  if (!plan.failure.empty()) throw std::runtime_error(plan.failure);
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
