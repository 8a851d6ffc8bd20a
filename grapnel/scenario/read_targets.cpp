#include "grapnel/scenario/read_targets.hpp"

#include <fmt/format.h>

#include "grapnel/scenario/grip_times.hpp"
#include "grapnel/scenario/plausibility.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

GraspPoint read_grasp_point(const Node& node, const std::string& path, FaultList& faults) {
  GraspPoint point{text_at(node, "name"), pose_of(node, path, faults), {}, {}};
  if (node.find("normal")) point.normal = unit_vector_at(node, "normal", path, faults);
  if (node.find("approach_direction"))
    point.approach_direction = unit_vector_at(node, "approach_direction", path, faults);
  return point;
}

void read_target(const Node& node, const std::string& path, Reading& reading) {
  FaultList& faults = reading.faults;
  reading.targets.add_from(node, path, faults);
  TargetSetup target;
  target.mass = 1;  // where a fault leaves it open
  read_members(node, "targets", &target);
  target.inertia = inertia_at(node, path, faults);
  target.geometry = geometry_at(node, path, reading.meshes, faults);
  check_com(node, path, target.mass, target.com, target.inertia, faults);
  doubt_inertia(node, path, target.mass, target.com, target.inertia, target.geometry, faults);
  const Node& state = part(node, "state");
  target.X_WT = pose_of(state, below(path, "state"), faults);
  NameTable points("grasp point");
  const Node& list = part(node, "grasp_points");
  if (!list.is_sequence()) points.make_incomplete();
  for (std::size_t i = 0; i < list.items.size(); ++i) {
    const std::string here = item(below(path, "grasp_points"), i);
    points.add_from(list.items[i], here, faults);
    target.grasp_points.push_back(read_grasp_point(list.items[i], here, faults));
  }
  doubt_grasp_points(node, path, target, faults);
  reading.points.emplace(target.name, std::move(points));
  reading.problem.targets.push_back(std::move(target));
}

// What the end-effector's orientation is to be, and whether both sides have what that takes.
GraspSetup::Orientation read_orientation(const Node& node, const std::string& path, const GraspSetup& grasp,
                                         Reading& reading) {
  using Orientation = GraspSetup::Orientation;
  const GraspPoint* point = grasp_point_named(reading, grasp.target, grasp.grasp_point);
  const EndEffectorSetup* end_effector = end_effector_named(reading, grasp.end_effector);
  const std::string given = text_at(node, "orientation");
  if (given == "free" || given == "pose") return grasp.orientation;
  if (given == "axis") {
    const Mark& mark = part(node, "orientation").mark;
    if (point && !point->approach_direction) {
      reading.faults.add(
          mark, fmt::format("{}.orientation: axis needs an 'approach_direction' at grasp point {} of target {}", path,
                            in_quotes(point->name), in_quotes(grasp.target)));
    }
    if (end_effector && !end_effector->approach_axis) {
      reading.faults.add(mark, fmt::format("{}.orientation: axis needs an 'approach_axis' at end-effector {}", path,
                                           in_quotes(end_effector->name)));
    }
    return Orientation::axis;
  }
  if (node.find("orientation") || !point || !point->approach_direction) return Orientation::free;
  if (end_effector && !end_effector->approach_axis) {
    reading.faults.add(part(node, "end_effector").mark,
                       fmt::format("{}: grasp point {} has an approach_direction and end-effector {} no approach_axis "
                                   "to go with it; give the end-effector one, or the grasp orientation: free",
                                   path, in_quotes(point->name), in_quotes(end_effector->name)));
  }
  return Orientation::axis;
}

void check_all_targets_grasped(Reading& reading) {
  const Node& list = part(reading.root, "targets");
  for (const Node& target : list.items) {
    const std::string name = text_at(target, "name");
    if (name.empty() || reading.gripped.contains(name)) continue;
    reading.faults.add(
        part(target, "name").mark,
        fmt::format("target {} is grasped by nobody; add a grasp or remove the target", in_quotes(name)));
  }
}

}  // namespace

void read_targets(Reading& reading) {
  const Node& list = part(reading.root, "targets");
  if (!list.is_sequence()) reading.targets.make_incomplete();
  for (std::size_t i = 0; i < list.items.size(); ++i) read_target(list.items[i], item("targets", i), reading);
}

void read_grasps(Reading& reading) {
  FaultList& faults = reading.faults;
  const Node& list = part(reading.root, "grasps");
  const bool doubtful = list.kind != Node::Kind::null && !list.is_sequence();
  std::map<std::string, std::size_t, std::less<>> user_of;  // end-effector to grasp
  bool all_known = !doubtful;
  for (std::size_t i = 0; i < list.items.size() && !faults.full(); ++i) {
    const Node& node = list.items[i];
    const std::string path = item("grasps", i);
    GraspSetup grasp;
    read_members(node, "grasps", &grasp);
    const std::string model = text_at(node, "model");
    grasp.contact = model == "contact";
    grasp.model = model == "hinge" ? GraspModel::hinge : model == "point" ? GraspModel::point : GraspModel::rigid;
    if (grasp.model == GraspModel::hinge) grasp.hinge_axis = unit_vector_at(node, "axis", path, faults);
    grasp.orientation = read_orientation(node, path, grasp, reading);
    read_closing(node, path, grasp, reading);

    reading.robot.end_effectors.expect(grasp.end_effector, part(node, "end_effector").mark, path, faults);
    const auto [first, fresh] = user_of.emplace(grasp.end_effector, i);
    if (!fresh && !grasp.end_effector.empty()) {
      faults.add(part(node, "end_effector").mark,
                 fmt::format("end-effector {} in {} is used twice; it already holds in {}",
                             in_quotes(grasp.end_effector), path, item("grasps", first->second)));
    }
    const bool target_known =
        reading.targets.expect(grasp.target, part(node, "target").mark, path, faults) && !grasp.target.empty();
    all_known = all_known && target_known;
    if (const auto it = reading.points.find(grasp.target); it != reading.points.end()) {
      it->second.expect(grasp.grasp_point, part(node, "point").mark, below(path, "point"), faults);
    }
    reading.gripped.insert(grasp.target);
    reading.problem.grasps.push_back(std::move(grasp));
  }
  // A misspelt target in a grasp may well mean the one that seems to be left alone.
  if (all_known) check_all_targets_grasped(reading);
}

}  // namespace grapnel
