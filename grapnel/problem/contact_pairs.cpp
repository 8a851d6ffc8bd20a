#include "grapnel/problem/contact_pairs.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "grapnel/problem/flexible_bodies.hpp"
#include "grapnel/problem/problem_clearance.hpp"

namespace grapnel {
namespace {

// The material with its dissipation. `share`: linear values are those of a contact of two such surfaces.
ContactMaterial surface_of(const MaterialSetup& material, double share) {
  ContactMaterial surface = material.surface;
  if (material.restitution) surface.dissipation = dissipation_for(*material.restitution, material.restitution_speed);
  surface.stiffness *= share, surface.damping *= share;
  return surface;
}

const MaterialSetup& material_named(const CaptureProblem& problem, const std::string& name) {
  const auto found = std::ranges::find(problem.materials, name, &MaterialSetup::name);
  if (found == problem.materials.end()) throw std::invalid_argument("contacts: no material is called " + name);
  return *found;
}

bool is_pair(const std::pair<BodyName, BodyName>& one, const BodyName& a, const BodyName& b) {
  return (one.first == a && one.second == b) || (one.first == b && one.second == a);
}

// Bodies of the problem that have shapes, in the order of robot, targets, panels.
std::vector<BodyName> bodies_with_shapes(const CaptureProblem& problem) {
  std::vector<BodyName> bodies;
  const auto add = [&](BodyName body) {
    if (std::ranges::find(bodies, body) == bodies.end()) bodies.push_back(std::move(body));
  };
  const RobotSetup& robot = problem.robot.undeformed ? *problem.robot.undeformed : problem.robot;
  for (const auto& [body, geometry] : robot.geometry) add(body);
  for (std::size_t t = 0; t < problem.targets.size(); ++t) {
    if (!problem.targets[t].geometry.empty()) add(BodyName::of_target(t));
    for (const PanelSetup& panel : problem.targets[t].panels) {
      if (!panel.geometry.empty()) add(BodyName::of_target(t, panel.name));
    }
  }
  return bodies;
}

using Pairs = std::vector<std::pair<BodyName, BodyName>>;

// Pairs that clearance monitors, grippers with their targets included; then every body with every obstacle.
Pairs all_pairs(const CaptureProblem& problem, const CaptureSystem& free) {
  CaptureProblem watched = problem;
  watched.contacts.clear();
  watched.clearance.enabled = true;
  const ClearanceModel model = make_clearance_model(watched, free, std::vector<bool>(problem.grasps.size(), true));
  const std::vector<BodyName> bodies = bodies_with_shapes(problem);
  std::vector<std::size_t> name_of(free.model.bodies().size(), bodies.size());
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    for (const int body : bodies_named(problem, free, bodies[i])) name_of[body] = i;
  }
  std::vector<std::pair<std::size_t, std::size_t>> found;
  for (const ClearancePair& pair : model.pairs()) {
    const auto [i, j] = std::minmax(name_of[pair.body_a], name_of[pair.body_b]);
    if (i != j && j < bodies.size()) found.emplace_back(i, j);
  }
  std::ranges::sort(found);
  found.erase(std::unique(found.begin(), found.end()), found.end());
  Pairs pairs;
  for (const auto& [i, j] : found) pairs.emplace_back(bodies[i], bodies[j]);
  for (const BodyName& body : bodies) {
    for (std::size_t k = 0; k < problem.obstacles.size(); ++k) pairs.emplace_back(body, BodyName::of_obstacle(k));
  }
  return pairs;
}

Pairs pairs_of(const ContactPairsSetup& setup, const CaptureProblem& problem, const CaptureSystem& free) {
  if (setup.all) return all_pairs(problem, free);
  Pairs pairs = setup.pairs;
  for (const BodyName& a : setup.first_group) {
    for (const BodyName& b : setup.second_group) pairs.emplace_back(a, b);
  }
  return pairs;
}

}  // namespace

ContactLaw contact_law(const MaterialSetup& a, const MaterialSetup& b, bool is_one) {
  const double share = is_one ? 2 : 1;  // two equal springs in series
  return combine(surface_of(a, share), surface_of(b, share));
}

std::vector<ContactPair> contact_pairs(const CaptureProblem& problem, const CaptureSystem& free) {
  std::vector<ContactPair> all;
  for (const ContactPairsSetup& setup : problem.contacts) {
    if (setup.materials.empty()) throw std::invalid_argument("contacts: a material is missing");
    const ContactLaw law = contact_law(material_named(problem, setup.materials.front()),
                                       material_named(problem, setup.materials.back()), setup.materials.size() == 1);
    for (auto& [a, b] : pairs_of(setup, problem, free)) {
      const auto is_this = [&](const auto& pair) { return is_pair(pair, a, b); };
      if (a == b || std::ranges::any_of(setup.exclude, is_this)) continue;
      const auto known = std::ranges::find_if(all, [&](const ContactPair& c) { return is_pair({c.a, c.b}, a, b); });
      if (known == all.end())
        all.push_back({a, b, law});
      else
        *known = {a, b, law};
    }
  }
  return all;
}

std::string contact_name(const CaptureProblem& problem, const BodyName& body) {
  return body.obstacle ? problem.obstacles.at(*body.obstacle).name : shown_name(problem, body);
}

std::vector<int> bodies_named(const CaptureProblem& problem, const CaptureSystem& system, const BodyName& body) {
  if (body.obstacle) return {};
  return pieces_of(system.model, name_in_model(problem, body));
}

}  // namespace grapnel
