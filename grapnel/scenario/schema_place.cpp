#include "grapnel/scenario/schema_place.hpp"

#include <nlohmann/json.hpp>

#include "grapnel/scenario/magnitudes.hpp"
#include "grapnel/scenario/schema.hpp"

namespace grapnel {
namespace {

using Json = nlohmann::ordered_json;

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

}  // namespace grapnel
