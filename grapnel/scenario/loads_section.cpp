#include <fmt/format.h>

#include <algorithm>

#include "grapnel/problem/flexible_bodies.hpp"
#include "grapnel/scenario/sections.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {

// ---- Contents of "orbit", "external_wrenches" and "clearance" ----

template <>
struct Described<LoadProfile> {
  using T = LoadProfile;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::shape>("shape", "",
                       "constant: from start to end. half_sine: sin(pi (t - start) / (end - start)). sine: sin(2 pi "
                       "frequency (t - start) + phase). table: the wrench itself, linear between samples, zero before "
                       "the first and after the last.")
          .required(),
      field<&T::start>("start", "s", "Zero before it. Absent: 0.").optional(),
      field<&T::end>("end", "s", "Zero from it on; after `start`. Absent: none.").optional(),
      field<&T::frequency>("frequency", "Hz", "Frequency of the sine.").above(0).optional(),
      field<&T::phase>("phase", "rad", "Phase of the sine at its start. Absent: 0.").optional(),
      field<&T::values>("values", "s, N, N m",
                        "Rows [t, Fx, Fy, Fz, Mx, My, Mz] with increasing t: the wrench itself, so `force`, `torque` "
                        "and `stream` are not allowed. Linear between rows, zero before the first and after the last.")
          .items(2, 0)
          .as("load table")
          .optional(),
  });
  static constexpr auto rules = std::to_array<Rule>({
      when("shape", "constant").forbid("frequency, phase, values"),
      when("shape", "half_sine").require("end").forbid("frequency, phase, values"),
      when("shape", "sine").require("frequency").forbid("values"),
      when("shape", "table").require("values").forbid("start, end, frequency, phase"),
  });
  static constexpr Type type = structure<T>(
      "load_profile", "Factor over time, which counts from the start of the scenario. Absent: constant for ever.",
      fields, rules);
};

template <>
struct Described<Stream> {
  using T = Stream;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::direction>("direction", "",
                           "Unit vector of the flow, in W or, with `frame: orbit`, in the orbit's axes: [0, -1, 0] is "
                           "air on a circular orbit.")
          .as("unit vector")
          .required(),
      field<&T::pressure>("pressure", "N/m^2",
                          "Pressure on a plate that faces the stream and absorbs it: of sunlight 4.56e-6 at the Earth, "
                          "of air rho v^2 C_D / 2.")
          .at_least(0)
          .required(),
      field<&T::area>("area", "m^2", "Area of the plate.").above(0).up_to(1e6).required(),
      field<&T::normal>("normal", "", "Unit vector in the body's frame: outward normal of the exposed side.")
          .as("unit vector")
          .required(),
      field<&T::both_sides>("both_sides", "", "Whether the back is exposed as well, as of a solar panel."),
      field<&T::specular>("specular", "", "Share of specular reflection.").at_least(0).at_most(1),
      field<&T::diffuse>("diffuse", "",
                         "Share of diffuse reflection; with the specular one at most 1, the rest is absorbed.")
          .at_least(0)
          .at_most(1),
  });
  static constexpr Type type =
      structure<T>("stream",
                   "Air or light on a flat plate: a force that depends on the body's attitude (14.7), in addition to "
                   "`force` and `torque`. Times the factor of `time`; not with a table.",
                   fields);
};

template <>
struct Described<LoadSetup> {
  using T = LoadSetup;
  static constexpr auto fields = std::to_array<Field>({
      key<std::string>("body", "", "The robot's base or link on which the wrench acts.").optional(),
      key<std::string>("target", "", "The target on which it acts, in place of `body`.").optional(),
      field<&T::p_BP>("position", "m", "Point of application, in that body's frame."),
      field<&T::frame>("frame", "",
                       "Axes of force and torque. body: those of the body, which rotate with it. orbit: radial, "
                       "along-track, cross-track, which rotate with the orbit."),
      found<[](T& t) -> Vector3d& { return t.amplitude.linear; }>(
          "force", "N", "Force, times the factor of `time`. Not with a table. Absent: zero.")
          .optional(),
      found<[](T& t) -> Vector3d& { return t.amplitude.angular; }>(
          "torque", "N m",
          "Torque about the point of application, times the factor of `time`. Not with a table. Absent: zero.")
          .optional(),
      field<&T::profile>("time", "", "").optional(),
      field<&T::stream>("stream", "", "").optional(),
  });
  static constexpr auto rules = std::to_array<Rule>({one_of("body, target")});
  static constexpr Type type =
      structure<T>("external_wrench", "An external force and torque on one body.", fields, rules);
};

template <>
struct Described<MagneticField> {
  using T = MagneticField;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::axis>("axis", "", "Unit vector in W: rotation axis of the Earth, to the north pole.").as("unit vector"),
      field<&T::greenwich>("greenwich", "",
                           "Unit vector in W: perpendicular to axis, to the meridian of Greenwich, at t = 0.")
          .as("unit vector"),
  });
  static constexpr auto rules = std::to_array<Rule>({needs("axis", "greenwich"), needs("greenwich", "axis")});
  static constexpr Type type =
      structure<T>("magnetic_field", "The Earth's magnetic field: the dipole of IGRF-14, which rotates with the Earth.",
                   fields, rules);
};

template <>
struct Described<OrbitSetup> {
  using T = OrbitSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::body>("body", "", "The central body, with its gravitational parameter and equatorial radius."),
      field<&T::altitude>("altitude", "m",
                          "Altitude of a circular orbit above the body's equatorial radius, such as `400 km`.")
          .at_least(1e4)
          .up_to(1e10)
          .optional(),
      field<&T::semi_major_axis>(
          "semi_major_axis", "m",
          "In place of `altitude`. With `eccentricity`, the lowest point must be above the surface.")
          .above(0)
          .up_to(1e12)
          .optional(),
      field<&T::mu>("mu", "m^3/s^2",
                    "Gravitational parameter of another body, whose surface is then unknown. Absent: that of `body`.")
          .above(0)
          .optional(),
      field<&T::eccentricity>("eccentricity", "", "Eccentricity of the orbit. Absent: 0.")
          .at_least(0)
          .at_most(0.99)
          .optional(),
      field<&T::true_anomaly>("true_anomaly", "rad",
                              "True anomaly at t = 0, from the lowest point in the direction of motion. Absent: 0.")
          .optional(),
      field<&T::radial>("radial", "", "Unit vector in W: outward, at t = 0. Absent: [1, 0, 0].")
          .as("unit vector")
          .optional(),
      field<&T::along_track>(
          "along_track", "",
          "Unit vector in W: perpendicular to `radial` in the plane of the orbit, in the direction of motion, at t = "
          "0. On ellipses it differs slightly from the direction of the velocity. Absent: [0, 1, 0].")
          .as("unit vector")
          .optional(),
      field<&T::magnetic_field>("magnetic_field", "", "Magnetic field of the Earth; absent: not evaluated.").optional(),
  });
  static constexpr auto rules = std::to_array<Rule>({
      one_of("altitude, semi_major_axis"),
      when("altitude")
          .forbid("eccentricity, true_anomaly", "an altitude defines a circular orbit; use semi_major_axis"),
      when("altitude").forbid("mu", "an altitude refers to the surface of body; use semi_major_axis"),
      needs("radial", "along_track"),
      needs("along_track", "radial"),
  });
  static constexpr Type type =
      structure<T>("orbit",
                   "The orbit of the frame W, which does not rotate: W's origin is the reference point. Every body is "
                   "subject to the difference of gravity at its position.",
                   fields, rules);
};

template <>
struct Described<ClearanceSetup> {
  using T = ClearanceSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::enabled>("enabled", "",
                         "Whether distances between bodies with a `geometry` are monitored: between two bodies the "
                         "minimum over all pairs of their shapes."),
      field<&T::required>("required", "m", "Required distance; a smaller one is a violation.").at_least(0),
      field<&T::ignore>("ignore", "",
                        "Pairs of links, the base, targets and their panels (TARGET/PANEL) that are not checked "
                        "against each other. The name of a target does not include its panels. If a link and a target "
                        "share a name, the name means the link.")
          .as("pairs of names"),
  });
  static constexpr Type type = structure<T>(
      "clearance", "Monitored distances between bodies with a geometry; they do not influence the motion.", fields);
};

const Type& external_wrenches_description() { return type_of<std::vector<LoadSetup>>(); }
const Type& orbit_description() { return type_of<std::optional<OrbitSetup>>(); }
const Type& clearance_description() { return type_of<ClearanceSetup>(); }

// ---- Reading ----

namespace {

std::optional<std::size_t> index_of_target(const CaptureProblem& problem, std::string_view name) {
  const auto at = std::ranges::find(problem.targets, name, &TargetSetup::name);
  if (name.empty() || at == problem.targets.end()) return {};
  return static_cast<std::size_t>(at - problem.targets.begin());
}

void finish_wrench(const Node& node, const std::string& path, LoadSetup& load, Reading& reading) {
  const std::string body = text_at(node, "body"), target = text_at(node, "target");
  reading.robot.links.expect(body, part(node, "body").mark, path, reading.faults);
  reading.targets.expect(target, part(node, "target").mark, path, reading.faults);
  load.body = body;
  if (const auto index = index_of_target(reading.problem, target)) load.body = BodyName::of_target(*index);
  if (load.profile.shape != LoadProfile::Shape::table) return;
  for (const char* key : {"force", "torque", "stream"}) {
    const NodeEntry* entry = node.entry(key);
    if (!entry) continue;
    reading.faults.add(
        entry->mark,
        fmt::format("'{}' in {} has no effect with time.shape: table, whose values are the wrench", key, path));
  }
}

}  // namespace

std::optional<BodyName> named_body(const Node& node, const std::string& path, Reading& reading, bool with_obstacles) {
  if (!is_text(node) || node.text.empty()) return {};
  const NameTable &links = reading.robot.links, &targets = reading.targets, &obstacles = reading.obstacles;
  if (links.contains(node.text)) return node.text;
  if (const auto target = index_of_target(reading.problem, node.text)) return BodyName::of_target(*target);
  std::vector<std::string> panels;
  for (std::size_t t = 0; t < reading.problem.targets.size(); ++t) {
    const TargetSetup& target = reading.problem.targets[t];
    for (const PanelSetup& panel : target.panels) {
      panels.push_back(panel_body_name(target.name, panel.name));
      if (panels.back() == node.text) return BodyName::of_target(t, panel.name);
    }
  }
  for (std::size_t k = 0; with_obstacles && k < reading.problem.obstacles.size(); ++k) {
    if (reading.problem.obstacles[k].name == node.text) return BodyName::of_obstacle(k);
  }
  if (links.complete() && targets.complete() && (!with_obstacles || obstacles.complete())) {
    std::vector<std::string> names = links.names();
    names.insert(names.end(), targets.names().begin(), targets.names().end());
    names.insert(names.end(), panels.begin(), panels.end());
    if (with_obstacles) names.insert(names.end(), obstacles.names().begin(), obstacles.names().end());
    reading.faults.add(node.mark, fmt::format("unknown body {} in {}{}", in_quotes(node.text), path,
                                              suggestion(node.text, names, "bodies")));
  }
  return {};
}

void finish_external_wrenches(Reading& reading) {
  const Node& list = part(reading.root, "external_wrenches");
  for (std::size_t i = 0; i < reading.problem.loads.size(); ++i)
    finish_wrench(list.items[i], item("external_wrenches", i), reading.problem.loads[i], reading);
}

void finish_clearance(Reading& reading) {
  const Node& pairs = part(part(reading.root, "clearance"), "ignore");
  for (std::size_t i = 0; i < pairs.items.size() && !reading.faults.full(); ++i) {
    const Node& pair = pairs.items[i];
    if (pair.items.size() != 2) continue;
    const std::string path = item("clearance.ignore", i);
    const auto first = named_body(pair.items[0], path, reading, false);
    const auto second = named_body(pair.items[1], path, reading, false);
    if (!first || !second) continue;
    if (*first == *second) {
      reading.faults.add(pair.items[1].mark, fmt::format("{} names {} twice", path, in_quotes(pair.items[1].text)));
    }
    reading.problem.clearance.ignore.emplace_back(*first, *second);
  }
}

}  // namespace grapnel
