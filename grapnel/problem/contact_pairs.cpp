#include "grapnel/problem/contact_pairs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "grapnel/problem/flexible_bodies.hpp"
#include "grapnel/problem/problem_clearance.hpp"

namespace grapnel {

ContactMaterial surface_of(const MaterialSetup& material, bool on_hard) {
  ContactMaterial surface = material.surface;
  if (!material.restitution) return surface;
  const double e = *material.restitution;
  if (surface.hard && on_hard) {
    surface.restitution = e;
    surface.dissipation = dissipation_for(std::max(e, kLeastRestitutionAtRest), surface.rest_speed);
  } else if (!surface.hard || e > 0) {
    surface.dissipation = dissipation_for(e, material.restitution_speed);
  } else {
    surface.dissipation = dissipation_for(kLeastRestitutionAtRest, material.restitution_speed);
  }
  return surface;
}

// Two equal surfaces in series have half the stiffness and half the damping of one.
ContactLaw contact_law_of(const MaterialSetup& a, const MaterialSetup& b, bool same) {
  ContactMaterial surface_a = surface_of(a, b.surface.hard), surface_b = surface_of(b, a.surface.hard);
  if (same) {
    for (ContactMaterial* surface : {&surface_a, &surface_b}) surface->stiffness *= 2, surface->damping *= 2;
  }
  return combine(surface_a, surface_b);
}

// ---- Bodies as the problem states them ----

bool has_shape(const CaptureProblem& problem, const BodyName& body) {
  const auto is_shape = [](const Geometry& g) { return g.shape != Geometry::Shape::none; };
  if (body.obstacle) {
    const std::vector<Geometry>& shapes = problem.obstacles.at(*body.obstacle).geometry;
    return shapes.empty() || std::ranges::any_of(shapes, is_shape);
  }
  if (!body.target) {
    return std::ranges::any_of(problem.robot.geometry,
                               [&](const auto& one) { return one.first == body.name && is_shape(one.second); });
  }
  const TargetSetup& target = problem.targets.at(*body.target);
  if (body.name.empty()) return std::ranges::any_of(target.geometry, is_shape);
  const auto panel = std::ranges::find(target.panels, body.name, &PanelSetup::name);
  return panel != target.panels.end() && std::ranges::any_of(panel->geometry, is_shape);
}

namespace {

// The robot's links, in groups that fixed joints connect.
class StatedLinks {
 public:
  explicit StatedLinks(const CaptureProblem& problem) : problem_(problem) {}

  // The body of a group that a moving joint carries. Null: there is no such body.
  const BodyDescription* group_of(const std::string& name) const {
    const BodyDescription* body = find(name);
    for (std::size_t k = 0; body && k < count() && !is_base(*body) && body->joint.type == JointType::fixed; ++k)
      body = find(body->parent);
    return body;
  }
  // The next group towards the base that has shapes; null: there is none.
  const BodyDescription* carrier_of(const BodyDescription* group) const {
    for (std::size_t k = 0; group && k < count(); ++k) {
      group = is_base(*group) ? nullptr : group_of(group->parent);
      if (group && is_shaped(*group)) return group;
    }
    return nullptr;
  }
  bool is_fixed(const std::string& name) const {
    const BodyDescription* group = group_of(name);
    return group && is_base(*group) && problem_.robot.base_mode == RobotSetup::Base::fixed;
  }

 private:
  std::size_t count() const { return problem_.robot.bodies.size(); }
  bool is_base(const BodyDescription& body) const { return body.name == problem_.robot.base; }
  const BodyDescription* find(const std::string& name) const {
    const auto found = std::ranges::find(problem_.robot.bodies, name, &BodyDescription::name);
    return found == problem_.robot.bodies.end() ? nullptr : &*found;
  }
  bool is_shaped(const BodyDescription& group) const {
    return std::ranges::any_of(problem_.robot.bodies, [&](const BodyDescription& body) {
      return has_shape(problem_, body.name) && group_of(body.name) == &group;
    });
  }

  const CaptureProblem& problem_;
};

// Whether a panel is a rigid part of its target.
bool is_rigid(const TargetSetup& target, const std::string& panel) {
  const auto found = std::ranges::find(target.panels, panel, &PanelSetup::name);
  return found == target.panels.end() || (!found->hinge && !found->beam && found->modes.empty());
}

}  // namespace

std::string contact_pair_fault(const CaptureProblem& problem, const BodyName& a, const BodyName& b) {
  const char* const kFixed = "are fixed to each other, so they cannot touch";
  const char* const kStill = "are both fixed in W, so they cannot touch";
  if (a == b) return "are one body";
  const StatedLinks links(problem);
  const auto is_still = [&](const BodyName& body) {
    return body.obstacle || (!body.target && links.is_fixed(body.name));
  };
  if (is_still(a) && is_still(b)) return kStill;
  if (a.obstacle || b.obstacle || a.target != b.target) return {};
  if (a.target) {
    const TargetSetup& target = problem.targets.at(*a.target);
    const bool rigid_a = a.name.empty() || is_rigid(target, a.name);
    const bool rigid_b = b.name.empty() || is_rigid(target, b.name);
    if (rigid_a && rigid_b) return kFixed;
    return a.name.empty() || b.name.empty() ? "are connected, and their shapes may overlap there" : "";
  }
  const BodyDescription *group_a = links.group_of(a.name), *group_b = links.group_of(b.name);
  if (!group_a || !group_b) return {};
  if (group_a == group_b) return kFixed;
  const BodyDescription* moving = links.carrier_of(group_a) == group_b   ? group_a
                                  : links.carrier_of(group_b) == group_a ? group_b
                                                                         : nullptr;
  if (!moving) return {};
  return fmt::format("are connected by joint '{}', and their shapes may overlap there", moving->joint.name);
}

// ---- Pairs ----

namespace {

const MaterialSetup& material_named(const CaptureProblem& problem, const std::string& name) {
  const auto found = std::ranges::find(problem.materials, name, &MaterialSetup::name);
  if (found == problem.materials.end()) throw std::out_of_range("contacts: unknown material '" + name + "'");
  return *found;
}

ContactLaw law_of(const std::vector<std::string>& materials, const CaptureProblem& problem) {
  if (materials.empty()) throw std::out_of_range("contacts: a rule without material");
  return contact_law_of(material_named(problem, materials.front()), material_named(problem, materials.back()),
                        materials.size() == 1);
}

bool can_touch(const CaptureProblem& problem, const BodyName& a, const BodyName& b) {
  for (const BodyName& body : {a, b}) {
    if (body.obstacle && *body.obstacle >= problem.obstacles.size())
      throw std::out_of_range(fmt::format("contacts: there is no obstacle {}", *body.obstacle));
    if (!body.obstacle && !body.target &&
        std::ranges::find(problem.robot.bodies, body.name, &BodyDescription::name) == problem.robot.bodies.end())
      throw std::out_of_range("contacts: there is no link " + body.name);
  }
  return has_shape(problem, a) && has_shape(problem, b) && contact_pair_fault(problem, a, b).empty();
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
  for (const auto& [body, geometry] : problem.robot.geometry) add(body);
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

std::vector<ContactPair> contact_pairs(const CaptureProblem& problem, const CaptureSystem& free) {
  if (problem.contacts.empty()) return {};
  if (problem.robot.undeformed) {
    const CaptureProblem rigid = rigid_problem(problem);
    return contact_pairs(rigid, make_capture_system(rigid));
  }
  std::vector<ContactPair> all;
  for (const ContactPairsSetup& setup : problem.contacts) {
    const ContactLaw law = law_of(setup.materials, problem);
    for (const auto& pair_of_names : pairs_of(setup, problem, free)) {
      const BodyName &a = pair_of_names.first, &b = pair_of_names.second;
      const auto is_this = [&](const auto& pair) { return is_pair(pair, a, b); };
      if (std::ranges::any_of(setup.exclude, is_this) || !can_touch(problem, a, b)) continue;
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
