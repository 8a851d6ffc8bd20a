#include "grapnel/scenario/schema.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>
#include <vector>

#include "grapnel/describe/json.hpp"
#include "grapnel/scenario/forms.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "grapnel/scenario/sections.hpp"
#include "grapnel/text/units.hpp"

namespace grapnel {

using Json = nlohmann::ordered_json;

const Json& robot_schema_document() {
  static const Json kSchema = schema_of(robot_description(), "Grapnel robot, version 1");
  return kSchema;
}
const Json& target_schema_document() {
  static const Json kSchema = [] {
    Json schema = schema_of(targets_description().of(), "Grapnel target, version 1");
    const Json& robot = robot_schema_document()["properties"];
    Json properties{{"schema", robot["schema"]}, {"description", robot["description"]}};
    properties["schema"]["const"] = "grapnel-target/1";
    for (auto& [key, part] : schema["properties"].items()) {
      if (key != "state" && key != "ready_made") properties[key] = part;
    }
    schema["properties"] = std::move(properties);
    std::erase_if(schema["required"].get_ref<Json::array_t&>(), [](const Json& key) { return key == "state"; });
    return schema;
  }();
  return kSchema;
}
const Json& scenario_schema_document() {
  static const Json kSchema = schema_of(scenario_description(), "Grapnel scenario, version 1");
  return kSchema;
}

namespace {

bool is_dimensionless(const std::string& stated) {
  const auto units = units_of_place(stated);
  return std::all_of(units.begin(), units.end(), [](std::string_view unit) { return unit == "1"; });
}

// `has_unit`: numbers here have one.
void allow_units(Json& schema, bool has_unit) {
  if (!schema.is_object()) return;
  if (const auto unit = schema.find("x-unit"); unit != schema.end()) has_unit = !is_dimensionless(*unit);
  if (schema.value("x-any-unit", false)) has_unit = true;
  if (has_unit && schema.contains("type") && schema["type"] == "number") {
    schema["type"] = {"number", "string"};
    schema["pattern"] = number_with_unit_pattern();
  }
  for (const char* key : {"items", "additionalProperties", "then"}) {
    if (schema.contains(key)) allow_units(schema[key], has_unit);
  }
  for (const char* key : {"anyOf", "allOf", "oneOf"}) {
    if (!schema.contains(key)) continue;
    for (Json& part : schema[key]) allow_units(part, has_unit);
  }
  for (const char* key : {"properties", "definitions"}) {
    if (!schema.contains(key)) continue;
    for (auto& [name, part] : schema[key].items()) allow_units(part, has_unit);
  }
}

// Keys that a ready-made target supplies if they are absent.
void allow_ready_made(Json& schema) {
  for (auto& [name, part] : schema["definitions"].items()) {
    if (!part.contains("properties") || !part["properties"].contains("ready_made")) continue;
    Json own = Json::array(), always = Json::array();
    for (const Json& key : part["required"]) (key == "state" ? always : own).push_back(key);
    part["required"] = always;
    part["anyOf"] = {{{"required", own}}, {{"required", {"ready_made"}}}};
  }
}

}  // namespace

std::string published(Json schema) {
  allow_units(schema, false);
  if (schema.contains("definitions")) allow_ready_made(schema);
  return schema.dump(2) + "\n";
}

std::string scenario_schema() { return published(scenario_schema_document()); }
std::string target_schema() { return published(target_schema_document()); }
std::string robot_schema() { return published(robot_schema_document()); }

// ---- Places ----

namespace {

// Follows steps through the schema and all its matching alternatives, and records their content.
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
  // Dead ends are not recorded.
  bool try_part(const Json& schema, std::span<const PathStep> steps, PlaceRule& rule) const {
    PlaceRule copy = rule;
    if (!follow(schema, steps, copy)) return false;
    rule = std::move(copy);
    return true;
  }

  static const Json* next(const Json& schema, const PathStep& step) {
    if (step.is_index || schema.value("type", Json()) == "array")
      return schema.contains("items") ? &schema["items"] : nullptr;
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

PlaceRule place_rule(std::string_view path) {
  std::vector<PathStep> steps;
  for (std::size_t at = 0; at < path.size();) {
    const bool is_index = path[at] == '[';
    const std::size_t end = std::min(path.find_first_of(is_index ? "]" : ".[", at), path.size());
    if (end > at) steps.push_back({std::string(path.substr(at, end - at)), 0, is_index});
    at = end < path.size() && path[end] != '[' ? end + 1 : end;
  }
  return place_rule(steps);
}

// ---- Magnitudes ----

namespace {

struct OfUnit {
  std::string_view unit;  // first unit of a place
  Magnitudes magnitudes;
};

// Longer units before their prefixes.
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

namespace {

using Json = nlohmann::ordered_json;

// The names in "a, b, c".
std::vector<std::string> names_in(std::string_view list, std::string_view between = ", ") {
  std::vector<std::string> names;
  for (std::size_t at = 0; at < list.size();) {
    const std::size_t end = std::min(list.find(between, at), list.size());
    names.emplace_back(list.substr(at, end - at));
    at = end + between.size();
  }
  return names;
}

// ---- Rules between keys ----

Json required(const std::vector<std::string>& keys) { return {{"required", keys}}; }

Json condition_of(const Rule& rule) {
  Json condition = Json::object();
  const std::vector<std::string> values = names_in(rule.values);
  const std::string key(rule.keys);
  if (values.size() == 1) condition["properties"][key]["const"] = values[0];
  if (values.size() > 1) condition["properties"][key]["enum"] = values;
  condition["required"] = Json::array({key});
  return condition;
}

// The schema of a list's items if a rule states it.
using ItemSchema = std::function<Json(const Type&, const Field&)>;

void add_consequence(const Rule& rule, const ItemSchema& item_schema, Json& then) {
  if (!rule.others.empty()) then["required"] = names_in(rule.others);
  for (const std::string& key : names_in(rule.choices)) then["oneOf"].push_back(required({key}));
  for (const std::string& name : names_in(rule.forbidden)) {
    const std::size_t dot = name.find('.');
    Json& place = dot == std::string::npos
                      ? then["properties"][name]
                      : then["properties"][name.substr(0, dot)]["properties"][name.substr(dot + 1)];
    place = rule.why.empty() ? Json(false) : Json{{"not", Json::object()}, {"description", rule.why}};
  }
  if (rule.items) {
    Field item;
    item.range.least = rule.least;
    Json list{{"type", "array"}, {"items", item_schema(rule.items(), item)}};
    if (rule.items().kind == Type::Kind::real) list["x-any-unit"] = true;  // unit depends on another key
    then["properties"][std::string(rule.narrowed)] = std::move(list);
  }
}

void add_rules(std::span<const Rule> rules, const ItemSchema& item_schema, Json& schema) {
  std::vector<Json> choices, exclusions, conditions;
  for (const Rule& rule : rules) {
    const std::vector<std::string> keys = names_in(rule.keys);
    switch (rule.kind) {
      case Rule::Kind::needs:
        schema["dependencies"][keys[0]] = names_in(rule.others);
        break;
      case Rule::Kind::not_both:
        exclusions.push_back({{"not", required(keys)}});
        break;
      case Rule::Kind::one_of: {
        Json alternatives = Json::array();
        for (const std::string& key : keys) alternatives.push_back(required({key}));
        if (schema.contains("oneOf"))
          choices.push_back({{"oneOf", alternatives}});
        else
          schema["oneOf"] = alternatives;
        break;
      }
      case Rule::Kind::any_of:
        schema["minProperties"] = 1;
        break;
      case Rule::Kind::when: {
        const Json condition = condition_of(rule);
        const bool again = !conditions.empty() && conditions.back()["if"] == condition;
        if (!again) conditions.push_back({{"if", condition}, {"then", Json::object()}});
        add_consequence(rule, item_schema, conditions.back()["then"]);
      }
    }
  }
  for (const Json& choice : choices) schema["allOf"].push_back(choice);
  for (const std::vector<Json>& parts : {exclusions, conditions}) {
    if (parts.size() == 1) {
      schema.update(parts[0]);
    } else {
      for (const Json& part : parts) schema["allOf"].push_back(part);
    }
  }
}

// ---- Structures ----

// Numbers as in files.
void write_plainly(Json& value) {
  if (value.is_number_float()) value = number_json(value.get<double>());
  if (!value.is_array()) return;
  for (Json& item : value) write_plainly(item);
}

class SchemaWriter {
 public:
  Json object(const Type& type) {
    Json schema{{"type", "object"}};
    if (!type.text.empty()) schema["description"] = type.text;
    std::vector<std::string> needed;
    Json properties = Json::object();
    for (const Field& field : type.fields) {
      if (field.is_required) needed.emplace_back(field.key);
      properties[std::string(field.key)] = property(type, field);
    }
    if (!needed.empty()) schema["required"] = needed;
    schema["additionalProperties"] = false;
    schema["properties"] = std::move(properties);
    add_rules(
        type.rules, [this](const Type& of, const Field& field) { return by_type(of, field); }, schema);
    return schema;
  }

  Json definitions;

 private:
  Json reference(const Type& type) {
    const std::string name(type.name);
    if (!definitions.contains(name)) {
      definitions[name] = nullptr;  // reserves its position
      Json schema = object(type);
      definitions[name] = std::move(schema);
    }
    return {{"$ref", "#/definitions/" + name}};
  }

  Json property(const Type& owner, const Field& field) {
    Json schema = in_form(field);
    if (field.least_items > 0 && schema.contains("type"))
      schema[schema["type"] == "object" ? "minProperties" : "minItems"] = field.least_items;
    if (field.most_items > 0) schema["maxItems"] = field.most_items;
    if (!field.unit.empty()) schema["x-unit"] = field.unit;
    if (field.has_any_unit) schema["x-any-unit"] = true;
    if (std::isfinite(field.largest)) schema["x-largest"] = field.largest;
    if (std::isfinite(field.plausible)) schema["x-plausible"] = field.plausible;
    if (const auto absent = default_of(owner, field)) schema["default"] = *absent;
    if (!field.text.empty()) schema["description"] = field.text;
    return schema;
  }

  Json in_form(const Field& field) {
    if (field.is_one_or_list) return one_or_list(field);
    const Form* form = form_of(field);
    if (!form || !form->schema) return by_type(field.type(), field);
    return form->schema(field, [this](const Type& type) { return reference(type); });
  }

  Json by_type(const Type& type, const Field& field) {
    switch (type.kind) {
      case Type::Kind::boolean:
        return {{"type", "boolean"}};
      case Type::Kind::whole:
        return number_schema(field.range, "integer");
      case Type::Kind::real:
        return number_schema(field.range);
      case Type::Kind::text:
        return name_schema();
      case Type::Kind::choice: {
        Json names = Json::array();
        for (const Choice& choice : type.choices) names.push_back(choice.name);
        return {{"enum", names}};
      }
      case Type::Kind::optional:
        return by_type(type.of(), field);
      case Type::Kind::structure:
        return reference(type);
      case Type::Kind::alternatives:
        return one_of_types(type, field);
      case Type::Kind::list:
        break;
    }
    if (type.fixed_size > 0) return numbers_schema(type.fixed_size, field.range);
    const Type& item = type.of();
    Json list{{"type", "array"}, {"items", by_type(item, field)}};
    if (item.kind == Type::Kind::text) list["title"] = field.title.empty() ? "a list of names" : field.title;
    if (item.kind == Type::Kind::real) list["title"] = "a list of numbers";
    if (item.kind == Type::Kind::list && item.fixed_size == 0 && field.least_items > 0)
      list["items"]["minItems"] = field.least_items;
    return list;
  }

  Json one_or_list(const Field& field) {
    const std::vector<std::string> titles = names_in(field.title, "; ");
    const Json item = reference(field.type().of());
    return {{"anyOf",
             {{{"allOf", Json::array({item})}, {"type", "object"}, {"title", titles.at(0)}},
              {{"type", "array"}, {"title", titles.at(1)}, {"items", item}}}}};
  }

  Json one_of_types(const Type& type, const Field& field) {
    const std::vector<std::string> titles = names_in(field.title, "; ");
    Json schemas = Json::array();
    for (std::size_t i = 0; i < type.alternatives.size(); ++i) {
      const Type& one = type.alternatives[i]();
      Json schema = by_type(one, field);
      if (one.kind == Type::Kind::structure) schema = {{"allOf", Json::array({schema})}, {"type", "object"}};
      if (one.kind == Type::Kind::choice) schema["type"] = "string";
      if (one.kind == Type::Kind::list && field.least_items > 0) schema["minItems"] = field.least_items;
      if (i < titles.size())
        schema["title"] = titles[i];
      else if (one.kind == Type::Kind::real)
        schema["title"] = "a number";
      schemas.push_back(std::move(schema));
    }
    return {{"anyOf", schemas}};
  }

  static std::optional<Json> default_of(const Type& owner, const Field& field) {
    if (field.is_required || !field.has_default || field.type().kind == Type::Kind::optional) return {};
    if (!field.default_text.empty()) return Json::parse(field.default_text);
    if (field.type().kind == Type::Kind::structure) return Json::object();
    std::optional<Json> found;
    const auto take = [&](const void* value) { found = json_of(field.type(), value), write_plainly(*found); };
    const auto look = [&](const void* untouched) { field.show(untouched, visitor_of(take)); };
    owner.show_default(visitor_of(look));
    return found;
  }
};

}  // namespace

Json schema_of(const Type& type, const std::string& title) {
  SchemaWriter writer;
  Json schema{{"$schema", "http://json-schema.org/draft-07/schema#"}, {"title", title}};
  schema.update(writer.object(type));
  schema["definitions"] = std::move(writer.definitions);
  return schema;
}

}  // namespace grapnel
