#include <fmt/format.h>

#include <algorithm>

#include "grapnel/scenario/sections.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {

// ---- Contents of "materials", "obstacles" and "contacts" ----

// Both coefficients of friction, in a special form.
template <>
struct Described<ContactMaterial> {
  static constexpr Type type = structure<ContactMaterial>("contact_surface", "", {});
};

template <>
struct Described<MaterialSetup> {
  using T = MaterialSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::name>("name", "", "Name, unique among materials. It takes precedence over that of a ready-made one.")
          .required(),
      found<[](T& t) -> ContactMaterial& { return t.surface; }>(
          "like", "",
          "Ready-made material, whose elasticity and dry friction apply unless given here. Those without published "
          "friction have none.")
          .as("ready-made material")
          .optional(),
      found<[](T& t) -> double& { return t.surface.stiffness; }>(
          "stiffness", "N/m",
          "Linear stiffness of a contact, in place of `youngs_modulus`. With `contacts.materials` that of one surface.")
          .above(0)
          .at_most(1e12)
          .optional(),
      found<[](T& t) -> double& { return t.surface.modulus; }>(
          "youngs_modulus", "Pa", "Young's modulus: elasticity by Hertz and by pressure fields. Needs `poisson_ratio`.")
          .above(0)
          .up_to(1e15)
          .optional(),
      found<[](T& t) -> double& { return t.surface.poisson_ratio; }>("poisson_ratio", "", "Poisson's ratio.")
          .above(-1)
          .at_most(0.5)
          .optional(),
      found<[](T& t) -> double& { return t.surface.damping; }>(
          "damping", "N s/m", "Damping of a contact, in addition to `dissipation`. Absent: 0.")
          .at_least(0)
          .optional(),
      found<[](T& t) -> double& { return t.surface.damping_depth; }>(
          "damping_depth", "m", "Depth from which on the damping acts in full. Absent: 1e-4.")
          .above(0)
          .optional(),
      field<&T::restitution>("restitution", "",
                             "Coefficient of restitution of an impact at `restitution_speed`, from which the "
                             "dissipation follows; of two hard surfaces at any speed. 0 only if `hard`. Absent: by "
                             "`dissipation`.")
          .at_least(0)
          .at_most(1)
          .optional(),
      field<&T::restitution_speed>("restitution_speed", "m/s",
                                   "Approach speed at which the coefficient of restitution applies. Absent: 0.1.")
          .above(0)
          .optional(),
      found<[](T& t) -> bool& { return t.surface.hard; }>(
          "hard", "",
          "`true`: contact with another hard surface begins with an impact in an instant. Needs `restitution`. Absent: "
          "false.")
          .optional(),
      found<[](T& t) -> double& { return t.surface.rest_speed; }>(
          "rest_speed", "m/s",
          "Largest approach speed of hard surfaces at which contact lasts, with elasticity and friction as between "
          "other surfaces. Absent: 1e-3.")
          .above(0)
          .optional(),
      found<[](T& t) -> double& { return t.surface.dissipation; }>(
          "dissipation", "s/m",
          "Of Hunt and Crossley: the elastic force times 1 plus this times the approach speed. Absent: 0.")
          .at_least(0)
          .optional(),
      found<[](T& t) -> ContactMaterial& { return t.surface; }>(
          "friction", "",
          "Coefficients of static and kinetic friction, or one number for both; `kinetic` must not be larger. Absent: "
          "0, or that of `like`.")
          .at_least(0)
          .as("friction coefficients")
          .optional(),
      found<[](T& t) -> double& { return t.surface.stiction_speed; }>(
          "stiction_speed", "m/s", "Slip speed around which friction falls from static to kinetic. Absent: 1e-2.")
          .above(0)
          .optional(),
      found<[](T& t) -> double& { return t.surface.stiction_displacement; }>(
          "stiction_displacement", "m",
          "Elastic tangential displacement at which static friction is reached; bodies stick up to it. Absent: 1e-4.")
          .above(0)
          .optional(),
      found<[](T& t) -> double& { return t.surface.rolling_length; }>(
          "rolling_length", "m", "Couple against rolling, per normal force. Absent: 0.")
          .at_least(0)
          .optional(),
      found<[](T& t) -> double& { return t.surface.torsional_length; }>(
          "torsional_length", "m", "Couple against spinning about the normal, per normal force. Absent: 0.")
          .at_least(0)
          .optional(),
      found<[](T& t) -> double& { return t.surface.stiction_rate; }>(
          "stiction_rate", "rad/s", "Rolling rate at which the couple against rolling has its maximum. Absent: 1e-3.")
          .above(0)
          .optional(),
  });
  static constexpr auto rules = std::to_array<Rule>({
      not_both("stiffness, youngs_modulus"),
      not_both("stiffness, poisson_ratio"),
      not_both("restitution, dissipation"),
      needs("restitution_speed", "restitution"),
      needs("rest_speed", "hard"),
  });
  static constexpr Type type = structure<T>(
      "material", "A surface material. It states either `stiffness`, or `youngs_modulus`, or `like`.", fields, rules);
};

template <>
struct Described<ObstacleSetup> {
  using T = ObstacleSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::name>("name", "", "Name, unique among obstacles, links and targets.").required(),
      key<bool>("half_space", "", "`true`: all points with z <= 0 in its frame, such as a floor or a wall.").optional(),
      field<&T::geometry>(&shapes_description, "geometry", "One or several shapes, in its frame.")
          .one_or_list(kShapesTitles)
          .optional(),
      found<[](T& t) -> Vector3d& { return t.X_WO.p; }>("position", "m", "Position of its frame, in W.").up_to(1e9),
      quaternion_of<&T::X_WO>(),
      rpy_of<&T::X_WO>(),
  });
  static constexpr auto rules = std::to_array<Rule>({one_of("half_space, geometry"), not_both("quaternion_wxyz, rpy")});
  static constexpr Type type = structure<T>("obstacle", "A body fixed in W that others may touch.", fields, rules);
};

template <>
struct Described<ContactPairsSetup> {
  using T = ContactPairsSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::pairs>("pairs", "",
                       "Pairs of links, the base, targets, their panels (TARGET/PANEL) and obstacles. If a link and a "
                       "target share a name, the name means the link. Bodies that a joint connects cannot be a pair.")
          .as("pairs of names")
          .items(1, 10000)
          .optional(),
      key<std::vector<std::vector<std::string>>>(
          "between", "",
          "Two groups of bodies: every body of one with every body of the other, except bodies that a joint connects.")
          .as("two groups of names")
          .optional(),
      field<&T::all>("all", "",
                     "`true`: every pair that `clearance` monitors, end-effectors and their "
                     "targets included, and every body with every obstacle.")
          .optional(),
      field<&T::exclude>("exclude", "", "Pairs that `between` or `all` leaves out.")
          .as("pairs of names")
          .items(1, 10000)
          .optional(),
      key<std::string>("material", "",
                       "Material of both surfaces, by its name under `materials`, or a ready-made one. Its stiffness "
                       "and damping are those of the contact.")
          .optional(),
      field<&T::materials>("materials", "",
                           "Materials of the first and of the second body of each pair, in series: both with a "
                           "stiffness, or both with a modulus.")
          .items(2, 2)
          .optional(),
  });
  static constexpr auto rules = std::to_array<Rule>({
      one_of("pairs, between, all"),
      one_of("material, materials"),
      not_both("pairs, exclude"),
      not_both("all, materials"),
  });
  static constexpr Type type =
      structure<T>("contact_rule", "Bodies that may touch; all others pass through each other.", fields, rules);
};

const Type& materials_description() { return type_of<std::vector<MaterialSetup>>(); }
const Type& obstacles_description() { return type_of<std::vector<ObstacleSetup>>(); }
const Type& contacts_description() { return type_of<std::vector<ContactPairsSetup>>(); }

// ---- Reading ----

namespace {

void finish_obstacles(Reading& reading) {
  const Node& list = part(reading.root, "obstacles");
  FaultList& faults = reading.faults;
  if (list.kind != Node::Kind::null && !list.is_sequence()) reading.obstacles.make_incomplete();
  for (std::size_t i = 0; i < reading.problem.obstacles.size(); ++i) {
    const Node& node = list.items[i];
    const std::string path = item("obstacles", i);
    reading.obstacles.add_from(node, path, faults);
    const Node &half_space = part(node, "half_space"), &geometry = part(node, "geometry");
    if (const auto is_one = boolean_of(half_space); is_one && !*is_one) {
      faults.add(half_space.mark,
                 fmt::format("{0}.half_space is false; leave it out and state {0}.geometry, or set it to true", path));
    }
    if (geometry.is_sequence() && geometry.items.empty()) {
      faults.add(geometry.mark,
                 fmt::format("{}.geometry is empty; state a shape, or half_space: true in its place", path));
    }
  }
}

// A key for another elasticity replaces that of the ready-made material.
void finish_material(const Node& node, const std::string& path, MaterialSetup& material, FaultList& faults) {
  if (node.entry("stiffness")) material.surface.modulus = material.surface.poisson_ratio = 0;
  const NodeEntry* modulus = node.entry("youngs_modulus");
  if (modulus && !node.entry("poisson_ratio") && !node.entry("like"))
    faults.add(modulus->mark, fmt::format("missing key 'poisson_ratio' in {}, needed with youngs_modulus", path));
}

void finish_materials(Reading& reading) {
  const Node& list = part(reading.root, "materials");
  if (list.kind != Node::Kind::null && !list.is_sequence()) reading.materials.make_incomplete();
  for (std::size_t i = 0; i < reading.problem.materials.size(); ++i) {
    const std::string path = item("materials", i);
    reading.materials.add_from(list.items[i], path, reading.faults);
    finish_material(list.items[i], path, reading.problem.materials[i], reading.faults);
  }
}

// A name of the list or of a ready-made material, which is then added to the list.
void find_material(const std::string& name, const Mark& mark, const std::string& path, Reading& reading) {
  std::vector<MaterialSetup>& known = reading.problem.materials;
  if (name.empty() || reading.materials.contains(name)) return;
  if (std::ranges::find(known, name, &MaterialSetup::name) != known.end()) return;
  if (const PublishedMaterial* ready_made = published_material(name)) {
    known.push_back({name, ready_made->material});
    return;
  }
  if (!reading.materials.complete() || reading.faults.full()) return;
  std::vector<std::string> names = reading.materials.names();
  for (const PublishedMaterial& one : published_materials()) names.emplace_back(one.name);
  reading.faults.add(
      mark, fmt::format("unknown material {} in {}{}", in_quotes(name), path, suggestion(name, names, "materials")));
}

std::vector<std::pair<BodyName, BodyName>> pairs_of(const Node& list, const std::string& path, Reading& reading) {
  std::vector<std::pair<BodyName, BodyName>> pairs;
  for (std::size_t i = 0; i < list.items.size() && !reading.faults.full(); ++i) {
    const Node& pair = list.items[i];
    if (pair.items.size() != 2) continue;
    const auto first = named_body(pair.items[0], item(path, i), reading, true);
    const auto second = named_body(pair.items[1], item(path, i), reading, true);
    if (first && second) pairs.emplace_back(*first, *second);
  }
  return pairs;
}

std::vector<BodyName> group_of(const Node& list, const std::string& path, Reading& reading) {
  std::vector<BodyName> bodies;
  for (const Node& one : list.items) {
    if (const auto body = named_body(one, path, reading, true)) bodies.push_back(*body);
  }
  return bodies;
}

void finish_rule(const Node& node, const std::string& path, ContactPairsSetup& rule, Reading& reading) {
  rule.pairs = pairs_of(part(node, "pairs"), below(path, "pairs"), reading);
  rule.exclude = pairs_of(part(node, "exclude"), below(path, "exclude"), reading);
  const Node& groups = part(node, "between");
  if (groups.items.size() == 2) {
    const std::string between = below(path, "between");
    rule.first_group = group_of(groups.items[0], item(between, 0), reading);
    rule.second_group = group_of(groups.items[1], item(between, 1), reading);
  }
  const Node& all = part(node, "all");
  if (const auto is_on = boolean_of(all); is_on && !*is_on)
    reading.faults.add(all.mark, fmt::format("{}.all is false, so this rule selects no pair; remove the rule", path));
  if (const std::string material = text_at(node, "material"); !material.empty()) {
    rule.materials = {material};
    find_material(material, part(node, "material").mark, below(path, "material"), reading);
    return;
  }
  const Node& materials = part(node, "materials");
  for (std::size_t k = 0; k < rule.materials.size() && k < materials.items.size(); ++k)
    find_material(rule.materials[k], materials.items[k].mark, below(path, "materials"), reading);
}

}  // namespace

void finish_contacts(Reading& reading) {
  finish_obstacles(reading);
  finish_materials(reading);
  const Node& rules = part(reading.root, "contacts");
  std::vector<ContactPairsSetup>& read = reading.problem.contacts;
  for (std::size_t i = 0; i < read.size() && !reading.faults.full(); ++i) {
    // Conflicts name their place in the same manner.
    const std::string path = read.size() == 1 ? "contacts" : item("contacts", i);
    const Node& node = rules.is_sequence() ? rules.items[i] : rules;
    if (node.is_mapping()) finish_rule(node, path, read[i], reading);
  }
}

}  // namespace grapnel
