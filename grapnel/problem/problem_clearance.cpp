#include "grapnel/problem/problem_clearance.hpp"

#include <algorithm>
#include <set>

#include "grapnel/problem/contact_pairs.hpp"
#include "grapnel/problem/flexible_bodies.hpp"

namespace grapnel {

std::vector<int> tied_to(const Model& model, int body) {
  std::vector<int> bodies;
  for (std::size_t i = 0; i < model.bodies().size(); ++i) {
    if (model.bodies()[i].placement.link == model.bodies()[body].placement.link) bodies.push_back(static_cast<int>(i));
  }
  return bodies;
}

namespace {

// Ignores pairs of bodies in a model with segments on springs: segments of one link, and of adjacent links, whose
// shapes overlap at their common joint.
void ignore_neighbours(const CaptureProblem& problem, const RobotSetup& robot, const Model& model,
                       std::vector<std::pair<int, int>>& ignored) {
  const CaptureProblem rigid = rigid_problem(problem);
  const Model links = make_servicer(rigid).model;
  std::vector<BodyShape> shapes;
  for (const auto& [body, geometry] : rigid.robot.geometry) shapes.push_back({links.body_index(body), geometry});
  const ClearanceModel watched(links, std::move(shapes));
  std::set<std::pair<std::string, std::string>> pairs;
  for (const ClearancePair& pair : watched.pairs()) {
    const std::string &a = links.bodies()[pair.body_a].description.name,
                      &b = links.bodies()[pair.body_b].description.name;
    pairs.emplace(a, b), pairs.emplace(b, a);
  }
  std::set<std::string> shaped;  // that have shapes
  for (const auto& [body, geometry] : robot.geometry) shaped.insert(body);
  for (const std::string& a : shaped) {
    for (const std::string& b : shaped) {
      if (!(a < b)) continue;
      const int body_a = model.body_index(a), body_b = model.body_index(b);
      const auto link = [&](int body) { return link_of_piece(model.bodies()[body].description); };
      if (!pairs.contains({link(body_a), link(body_b)})) ignored.emplace_back(body_a, body_b);
    }
  }
}

// Ignores pairs of bodies that may touch.
void ignore_contacts(const CaptureProblem& problem, const CaptureSystem& system,
                     std::vector<std::pair<int, int>>& ignored) {
  for (const ContactPair& pair : contact_pairs(problem, make_capture_system(problem))) {
    for (const int a : bodies_named(problem, system, pair.a)) {
      for (const int b : bodies_named(problem, system, pair.b)) ignored.emplace_back(a, b);
    }
  }
}

}  // namespace

std::vector<int> gripper_bodies(const CaptureSystem& system, const GraspSetup& grasp) {
  const Model& model = system.model;
  std::vector<int> bodies;
  for (int body : tied_to(model, model.frames()[model.frame_index(grasp.end_effector)].body)) {
    for (int segment : pieces_of(model, link_of_piece(model.bodies()[body].description))) bodies.push_back(segment);
  }
  return bodies;
}

// Problem and system => pairs of shapes to check. Excluded: parts of one target, neighbouring segments of flexible
// links, pairs of clearance.ignore, pairs that may touch, and gripper with its target unless its grasp is `checked`.
ClearanceModel make_clearance_model(const CaptureProblem& problem, const CaptureSystem& system,
                                    const std::vector<bool>& checked) {
  const Model& model = system.model;
  if (!problem.clearance.enabled) return {};
  std::vector<BodyShape> shapes;
  for (PlacedShape& shape : shapes_in_model(problem, system)) shapes.push_back({shape.body, std::move(shape.geometry)});
  std::vector<std::pair<int, int>> ignored;
  std::vector<int> targets;
  for (std::size_t t = 0; t < problem.targets.size(); ++t) {
    targets.push_back(target_body_index(system, t));
    const std::vector<int> parts = bodies_of_target(system, t);
    for (int a : parts) {
      for (int b : parts) {
        if (a < b) ignored.emplace_back(a, b);
      }
    }
  }
  if (!system.elastic_joints.empty()) {
    std::optional<RobotSetup> made;
    ignore_neighbours(problem, modelled_robot(problem.robot, true, made), model, ignored);
  }
  for (const auto& [a, b] : problem.clearance.ignore) {
    for (int segment_a : pieces_of(model, name_in_model(problem, a))) {
      for (int segment_b : pieces_of(model, name_in_model(problem, b))) ignored.emplace_back(segment_a, segment_b);
    }
  }
  if (!problem.contacts.empty()) ignore_contacts(problem, system, ignored);
  for (std::size_t i = 0; i < problem.grasps.size(); ++i) {
    const GraspSetup& g = problem.grasps[i];
    if (!checked.empty() && checked[i]) continue;
    for (int body : gripper_bodies(system, g)) ignored.emplace_back(body, targets[target_index(problem, g.target)]);
  }
  // A captured target is a child of the grasping link and may touch only that link.
  return ClearanceModel(model, std::move(shapes), ignored, targets);
}

// Checked grasps => indices of the model's pairs of gripper and target, sorted, each once.
std::vector<int> gripper_pairs(const CaptureProblem& problem, const CaptureSystem& system, const ClearanceModel& model,
                               const std::vector<bool>& checked) {
  std::vector<int> pairs;
  for (std::size_t i = 0; i < checked.size(); ++i) {
    if (!checked[i]) continue;
    const std::vector<int> gripper = gripper_bodies(system, problem.grasps[i]);
    const int target = target_body_index(system, target_index(problem, problem.grasps[i].target));
    const auto is_gripper = [&](int body) { return std::find(gripper.begin(), gripper.end(), body) != gripper.end(); };
    for (std::size_t p = 0; p < model.pairs().size(); ++p) {
      const ClearancePair& pair = model.pairs()[p];
      if ((is_gripper(pair.body_a) && pair.body_b == target) || (is_gripper(pair.body_b) && pair.body_a == target))
        pairs.push_back(static_cast<int>(p));
    }
  }
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  return pairs;
}

}  // namespace grapnel
