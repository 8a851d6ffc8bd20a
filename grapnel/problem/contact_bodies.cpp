#include "grapnel/problem/contact_bodies.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <stdexcept>
#include <utility>

#include "grapnel/model/tree.hpp"
#include "grapnel/problem/flexible_bodies.hpp"
#include "grapnel/problem/problem_clearance.hpp"

namespace grapnel {

ContactMaterial surface_of(const MaterialSetup& material) {
  ContactMaterial surface = material.surface;
  if (material.restitution) surface.dissipation = dissipation_for(*material.restitution, material.restitution_speed);
  return surface;
}

// Two equal surfaces in series have half the stiffness and half the damping of one.
ContactLaw contact_law_of(const MaterialSetup& a, const MaterialSetup& b, bool same) {
  ContactMaterial surface_a = surface_of(a), surface_b = surface_of(b);
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

// The pairs in a system, in the order of the rules.
class ContactPairs {
 public:
  ContactPairs(const CaptureProblem& problem, const CaptureSystem& system) : problem_(problem), system_(system) {
    for (const PlacedShape& shape : shapes_in_model(problem, system)) shaped_.insert(shape.body);
  }

  void add(const ContactPairsSetup& rule) {
    const ContactLaw law = law_of(rule.materials);
    const std::set<Pair> excluded = excluded_by(rule);
    const auto place = [&](int a, int b) {
      if (!excluded.contains(in_order(a, b))) put(a, b, law);
    };
    for (const auto& [a, b] : rule.pairs) for_all(a, b, place);
    for (const BodyName& a : rule.first_group) {
      for (const BodyName& b : rule.second_group) {
        if (contact_pair_fault(problem_, a, b).empty()) for_all(a, b, place);
      }
    }
    if (rule.all) for_monitored(place);
  }

  std::vector<ContactBodies> take() { return std::move(pairs_); }

 private:
  using Pair = std::pair<int, int>;
  static Pair in_order(int a, int b) { return std::minmax({a, b}); }

  const MaterialSetup& material(const std::string& name) const {
    const auto found = std::ranges::find(problem_.materials, name, &MaterialSetup::name);
    if (found == problem_.materials.end())
      throw std::out_of_range(fmt::format("contacts: unknown material '{}'", name));
    return *found;
  }

  ContactLaw law_of(const std::vector<std::string>& materials) const {
    if (materials.empty()) throw std::out_of_range("contacts: a rule without material");
    return contact_law_of(material(materials.front()), material(materials.back()), materials.size() == 1);
  }

  // The bodies of that name that have shapes.
  std::vector<int> bodies_of(const BodyName& body) const {
    if (body.obstacle) {
      if (*body.obstacle >= problem_.obstacles.size())
        throw std::out_of_range(fmt::format("contacts: there is no obstacle {}", *body.obstacle));
      return {obstacle_body(*body.obstacle)};
    }
    std::vector<int> bodies = body.target && body.name.empty()
                                  ? std::vector<int>{target_body_index(system_, *body.target)}
                                  : pieces_of(system_.model, name_in_model(problem_, body));
    std::erase_if(bodies, [&](int b) { return !shaped_.contains(b); });
    return bodies;
  }

  template <class Place>
  void for_all(const BodyName& first, const BodyName& second, const Place& place) const {
    const std::vector<int> others = bodies_of(second);
    for (const int a : bodies_of(first)) {
      for (const int b : others) place(a, b);
    }
  }

  // The pairs that clearance monitors, and every body with every obstacle.
  template <class Place>
  void for_monitored(const Place& place) const {
    CaptureProblem monitored = problem_;
    monitored.clearance.enabled = true;
    const std::vector<bool> with_grippers(problem_.grasps.size(), true);
    const ClearanceModel clearance = make_clearance_model(monitored, system_, with_grippers);
    for (const ClearancePair& pair : clearance.pairs()) place(pair.body_a, pair.body_b);
    for (const int body : shaped_) {
      for (std::size_t k = 0; k < problem_.obstacles.size(); ++k) place(body, obstacle_body(k));
    }
  }

  std::set<Pair> excluded_by(const ContactPairsSetup& rule) const {
    std::set<Pair> excluded;
    for (const auto& [a, b] : rule.exclude)
      for_all(a, b, [&](int body_a, int body_b) { excluded.insert(in_order(body_a, body_b)); });
    return excluded;
  }

  // Whether they cannot move relative to each other.
  bool is_one_body(int a, int b) const {
    const auto is_fixed = [&](int body) {
      return is_obstacle(body) || system_.model.tree().links[link(body)].joint == JointType::fixed;
    };
    if (is_fixed(a) && is_fixed(b)) return true;
    return a == b || (!is_obstacle(a) && !is_obstacle(b) && link(a) == link(b));
  }
  std::size_t link(int body) const {
    return static_cast<std::size_t>(system_.model.bodies()[static_cast<std::size_t>(body)].placement.link);
  }

  void put(int a, int b, const ContactLaw& law) {
    if (is_one_body(a, b)) return;
    const auto [at, is_new] = known_.emplace(in_order(a, b), pairs_.size());
    if (is_new)
      pairs_.push_back({a, b, law});
    else
      pairs_[at->second] = {a, b, law};
  }

  const CaptureProblem& problem_;
  const CaptureSystem& system_;
  std::set<int> shaped_;
  std::map<Pair, std::size_t> known_;
  std::vector<ContactBodies> pairs_;
};

}  // namespace

std::vector<ContactBodies> contact_bodies(const CaptureProblem& problem, const CaptureSystem& system) {
  if (problem.contacts.empty()) return {};
  ContactPairs pairs(problem, system);
  for (const ContactPairsSetup& rule : problem.contacts) pairs.add(rule);
  return pairs.take();
}

}  // namespace grapnel
