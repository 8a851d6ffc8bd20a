#include "grapnel/scenario/schema.hpp"

#include <array>
#include <nlohmann/json.hpp>

#include "grapnel/scenario/scenario.hpp"
#include "grapnel/scenario/sections.hpp"

namespace grapnel {

using Json = nlohmann::ordered_json;

const Json& robot_schema_document() {
  static const Json kSchema = schema_of(robot_description(), "Grapnel robot, version 1");
  return kSchema;
}
const Json& scenario_schema_document() {
  static const Json kSchema = schema_of(scenario_description(), "Grapnel scenario, version 1");
  return kSchema;
}

std::string scenario_schema() { return scenario_schema_document().dump(2) + "\n"; }
std::string robot_schema() { return robot_schema_document().dump(2) + "\n"; }

// ---- Places ----

namespace {

// Follows steps through the schema, through every alternative that has them, and notes what it meets.
class Follower {
 public:
  explicit Follower(const Json& root) : root_(root) {}

  bool follow(const Json& schema, std::span<const PathStep> steps, PlaceRule& rule) const {
    if (!schema.is_object()) return steps.empty();
    note(schema, steps.empty(), rule);
    bool found = steps.empty();
    if (schema.contains("$ref")) {
      const std::string reference = schema["$ref"];
      found = follow(root_.at(Json::json_pointer(reference.substr(1))), steps, rule) || found;
    }
    for (const char* key : {"allOf", "anyOf"}) {
      if (!schema.contains(key)) continue;
      for (const Json& part : schema[key]) found = try_part(part, steps, rule) || found;
    }
    if (steps.empty()) {
      if (schema.contains("items")) try_part(schema["items"], steps, rule);
      return true;
    }
    if (const Json* below = next(schema, steps[0])) found = try_part(*below, steps.subspan(1), rule) || found;
    return found;
  }

 private:
  // What leads nowhere leaves no trace.
  bool try_part(const Json& schema, std::span<const PathStep> steps, PlaceRule& rule) const {
    PlaceRule copy = rule;
    if (!follow(schema, steps, copy)) return false;
    rule = std::move(copy);
    return true;
  }

  static const Json* next(const Json& schema, const PathStep& step) {
    if (step.is_index) return schema.contains("items") ? &schema["items"] : nullptr;
    if (schema.contains("properties")) {
      const auto it = schema["properties"].find(step.key);
      if (it != schema["properties"].end()) return &*it;
    }
    const auto other = schema.find("additionalProperties");
    return other != schema.end() && other->is_object() ? &*other : nullptr;
  }

  static void note(const Json& schema, bool is_place, PlaceRule& rule) {
    if (schema.contains("x-unit")) rule.unit = schema["x-unit"];
    if (schema.contains("x-largest")) rule.largest = schema["x-largest"];
    if (!is_place) return;
    if (schema.contains("description") && rule.description.empty()) rule.description = schema["description"];
    if (schema.contains("exclusiveMinimum")) rule.above = schema["exclusiveMinimum"];
    if (schema.contains("minimum")) rule.from = schema["minimum"];
    if (schema.contains("maximum")) rule.to = schema["maximum"];
  }

  const Json& root_;
};

}  // namespace

PlaceRule place_rule(std::span<const PathStep> steps) {
  const Json& schema = scenario_schema_document();
  PlaceRule rule;
  rule.is_known = Follower(schema).follow(schema, steps, rule);
  if (std::isinf(rule.largest)) rule.largest = magnitudes_of(rule.unit).largest;
  return rule;
}

// ---- Magnitudes ----

namespace {

struct OfUnit {
  std::string_view unit;  // the first of a place's
  Magnitudes magnitudes;
};

// Longer units before those that they begin with.
constexpr std::array kUnits{
    OfUnit{"kg m^2/s", {1e25, 0}}, OfUnit{"kg m^2", {1e25, 0}}, OfUnit{"kg m/s", {1e20, 0}}, OfUnit{"kg", {1e15, 1e-9}},
    OfUnit{"m/s^2", {1e6, 0}},     OfUnit{"m/s", {1e6, 0}},     OfUnit{"m", {1e4, 1e-9}},    OfUnit{"rad/s", {1e4, 0}},
    OfUnit{"rad", {1e4, 0}},       OfUnit{"Hz", {1e6, 1e-9}},   OfUnit{"s", {1e9, 1e-12}},   OfUnit{"N", {1e15, 0}},
    OfUnit{"1", {1e6, 0}},
};

}  // namespace

Magnitudes magnitudes_of(std::string_view unit) {
  for (const OfUnit& one : kUnits) {
    if (!unit.starts_with(one.unit)) continue;
    const std::string_view rest = unit.substr(one.unit.size());
    // "N m/rad or N/m" is a newton of something; "rad or m" a radian.
    if (rest.empty() || rest[0] == ' ' || rest[0] == ',' || rest[0] == '/' || rest[0] == ';') return one.magnitudes;
  }
  return {};
}

}  // namespace grapnel
