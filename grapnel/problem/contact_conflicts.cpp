// Conflicts of contacts between shapes: materials, obstacles, and pairs of bodies that may touch.
#include <map>
#include <set>
#include <stdexcept>

#include "grapnel/problem/capture_system.hpp"
#include "grapnel/problem/conflict_finder.hpp"
#include "grapnel/problem/contact_pairs.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

class ContactConflicts : ConflictFinder {
 public:
  using ConflictFinder::ConflictFinder;

  void check() {
    check_obstacles();
    for (std::size_t i = 0; i < problem_.materials.size(); ++i)
      check_material(problem_.materials[i], fmt::format("materials[{}]", i));
    for (std::size_t i = 0; i < problem_.contacts.size(); ++i)
      check_rule(problem_.contacts[i], problem_.contacts.size() == 1 ? "contacts" : fmt::format("contacts[{}]", i));
  }

 private:
  using Pair = std::pair<BodyName, BodyName>;

  // ---- Obstacles and materials ----

  void check_obstacles() {
    if (problem_.obstacles.empty()) return;
    if (problem_.orbit)
      add_key("obstacles",
              "obstacles: they are fixed in W, which falls with 'orbit', where an obstacle would fall as a free body; "
              "state it as a target, or leave out one of both");
    for (std::size_t i = 0; i < problem_.obstacles.size(); ++i) {
      const std::string& name = problem_.obstacles[i].name;
      const char* const kind = find_named(problem_.robot.bodies, name) ? "link"
                               : find_named(problem_.targets, name)    ? "target"
                                                                       : nullptr;
      const std::string path = fmt::format("obstacles[{}].name", i);
      if (kind)
        add(path, "{}: there is a {} {}; obstacles need other names", path, kind, in_quotes(name)).relies_on = path;
    }
  }

  void check_material(const MaterialSetup& material, const std::string& path) {
    const ContactMaterial& surface = material.surface;
    const std::size_t before = found_.size();
    if (!(surface.modulus != 0) && !(surface.stiffness != 0)) {
      add(path, "missing key in {}: give 'stiffness', or 'youngs_modulus' with 'poisson_ratio', or 'like'", path);
    } else if (surface.modulus != 0 && surface.stiffness != 0) {
      add(path, "{} has both a stiffness and a Young's modulus, only one is allowed", path);
    }
    if (surface.kinetic_friction > surface.static_friction)
      add(path + ".friction", "{}.friction: kinetic is {}, must be at most static, {}", path, surface.kinetic_friction,
          surface.static_friction);
    if (surface.hard && !material.restitution) add(path, "missing key 'restitution' in {}, needed with hard", path);
    if (!surface.hard && material.restitution == 0.0)
      add(path + ".restitution", "{}.restitution is 0, must be greater than 0 unless the material is hard", path);
    if (found_.size() == before) {
      try {
        contact_law_of(material, material, true);
      } catch (const std::invalid_argument& fault) {
        add(path, "{}: {}", path, fault.what());
      }
    }
    for (std::size_t k = before; k < found_.size(); ++k) found_[k].relies_on = path;
  }

  // ---- Rules ----

  void check_rule(const ContactPairsSetup& rule, const std::string& path) {
    const std::size_t before = found_.size();
    check_materials(rule, path);
    for (std::size_t k = 0; k < rule.pairs.size(); ++k) check_pair(rule, k, path);
    check_groups(rule, path);
    for (std::size_t k = before; k < found_.size(); ++k) found_[k].relies_on = path;
  }

  void check_materials(const ContactPairsSetup& rule, const std::string& path) {
    const std::vector<std::string>& names = rule.materials;
    const std::string place = path + (names.size() == 1 ? ".material" : ".materials");
    if (names.empty() || names.size() > 2) {
      add(path, "{} has {} materials, must have 1 or 2", path, names.size());
      return;
    }
    std::vector<const MaterialSetup*> materials;
    for (const std::string& name : names) {
      materials.push_back(find_named(problem_.materials, name));
      if (!materials.back()) {
        std::vector<std::string> known;
        for (const MaterialSetup& one : problem_.materials) known.push_back(one.name);
        add(place, "unknown material {} in {}{}", in_quotes(name), place, suggestion(name, known, "materials"));
      }
    }
    const MaterialSetup *a = materials.front(), *b = materials.back();
    if (!a || !b || a == b) return;
    if (rule.all) add(place, "{} has no meaning with all, whose pairs have no order; state material", place);
    const bool hertz_a = a->surface.modulus > 0, hertz_b = b->surface.modulus > 0;
    if (hertz_a == hertz_b || (hertz_a ? b : a)->surface.stiffness == 0) return;
    add(place, "{}: {} has a Young's modulus and {} a stiffness; both need the same kind of elasticity", place,
        in_quotes((hertz_a ? a : b)->name), in_quotes((hertz_a ? b : a)->name));
  }

  bool exists(const BodyName& body) const {
    if (body.obstacle) return *body.obstacle < problem_.obstacles.size();
    if (!body.target) return find_named(problem_.robot.bodies, body.name) != nullptr;
    if (*body.target >= problem_.targets.size()) return false;
    return body.name.empty() || find_named(problem_.targets[*body.target].panels, body.name);
  }
  std::string name_of_body(const BodyName& body) const { return in_quotes(shown_name(problem_, body)); }

  // A body without shapes is reported once.
  void check_shape(const BodyName& body, const std::string& path) {
    if (has_shape(problem_, body) || !shapeless_.insert(shown_name(problem_, body)).second) return;
    add(path, "{}: {} has no geometry, so it cannot touch anything", path, name_of_body(body));
  }

  void check_pair(const ContactPairsSetup& rule, std::size_t k, const std::string& of_rule) {
    const auto& [a, b] = rule.pairs[k];
    const std::string path = fmt::format("{}.pairs[{}]", of_rule, k);
    if (!exists(a) || !exists(b)) return;  // reported elsewhere
    if (a == b) {
      add(path, "{} names {} twice", path, name_of_body(a));
      return;
    }
    if (const std::string fault = contact_pair_fault(problem_, a, b); !fault.empty()) {
      add(path, "{}: {} and {} {}", path, name_of_body(a), name_of_body(b), fault);
      return;
    }
    check_shape(a, path), check_shape(b, path);
    check_again(rule, a, b, path);
  }

  // The same pair in two places needs the same materials.
  void check_again(const ContactPairsSetup& rule, const BodyName& a, const BodyName& b, const std::string& path) {
    const auto key = [&](const BodyName& body) {
      return (body.obstacle ? "o:" : body.target ? "t:" : "b:") + shown_name(problem_, body);
    };
    std::vector<std::string> materials = rule.materials;
    if (materials.size() == 2 && key(a) > key(b)) std::swap(materials[0], materials[1]);
    const auto [first, is_new] = stated_.emplace(std::minmax({key(a), key(b)}), Stated{materials, path});
    if (is_new || first->second.materials == materials) return;
    add(path, "{}: {} and {} are a pair with other materials in {}", path, name_of_body(a), name_of_body(b),
        first->second.path);
  }

  void check_groups(const ContactPairsSetup& rule, const std::string& of_rule) {
    const std::string path = of_rule + ".between";
    bool any = false;
    for (const std::vector<BodyName>* group : {&rule.first_group, &rule.second_group}) {
      for (const BodyName& body : *group) {
        if (exists(body)) check_shape(body, path);
      }
    }
    for (const BodyName& a : rule.first_group) {
      for (const BodyName& b : rule.second_group)
        any = any || !exists(a) || !exists(b) || contact_pair_fault(problem_, a, b).empty();
    }
    if (any || rule.first_group.empty() || rule.second_group.empty()) return;
    add(path, "{} selects no pair: every two of these bodies are one, or are connected, or are both fixed", path);
  }

  struct Stated {
    std::vector<std::string> materials;
    std::string path;
  };
  std::map<std::pair<std::string, std::string>, Stated> stated_;
  std::set<std::string> shapeless_;
};

}  // namespace

void find_contact_conflicts(const CaptureProblem& problem, std::vector<ProblemFault>& found) {
  ContactConflicts(problem, found).check();
}

}  // namespace grapnel
