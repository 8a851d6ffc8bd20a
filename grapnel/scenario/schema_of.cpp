#include "grapnel/scenario/schema_of.hpp"

#include <fmt/format.h>

#include <cmath>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <vector>

namespace grapnel {
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

Json number_json(double x) {
  constexpr double kExact = 9007199254740992;
  if (x == std::floor(x) && std::abs(x) <= kExact) return static_cast<std::int64_t>(x);
  return x;
}

Json number_schema(const Range& range, const char* type = "number") {
  Json schema{{"type", type}};
  if (std::isfinite(range.least))
    schema[range.least_excluded ? "exclusiveMinimum" : "minimum"] = number_json(range.least);
  if (std::isfinite(range.most)) schema[range.most_excluded ? "exclusiveMaximum" : "maximum"] = number_json(range.most);
  return schema;
}
Json titled(Json schema, std::string_view title) {
  schema["title"] = title;
  return schema;
}
Json numbers_schema(std::size_t count, const Range& range) {
  return {{"type", "array"},
          {"title", fmt::format("a list of {} numbers", count)},
          {"items", number_schema(range)},
          {"minItems", count},
          {"maxItems", count}};
}
const Json& name_schema() {
  static const Json kName{{"type", "string"}, {"minLength", 1}};
  return kName;
}

// ---- Values that stand in files in forms of their own ----

Json joint_mapping(const Json& value, const char* title) {
  return {{"type", "object"}, {"title", title}, {"additionalProperties", value}};
}
Json joint_list(const Json& value, const char* title) {
  return {{"type", "array"}, {"title", title}, {"items", value}};
}

Json joint_values_form(const Field& field) {
  const Json value = number_schema(field.range);
  return {
      {"anyOf", {joint_mapping(value, "a mapping {joint name: value}"), joint_list(value, "a list in joint order")}}};
}

Json gains_form(const Field& field) {
  const Json value = number_schema(field.range);
  return {{"anyOf",
           {titled(value, "a number for all joints"), joint_mapping(value, "a mapping {joint name: value}"),
            joint_list(value, "a list in joint order")}}};
}

Json axis_gains_form(const Field& field) {
  return {{"anyOf", {titled(number_schema(field.range), "a number for all axes"), numbers_schema(3, field.range)}}};
}

Json final_rates_form(const Field&) {
  const Json match{{"enum", {"velocity", "twist", "velocity_least_rates"}},
                   {"description",
                    "velocity: the linear part, the end-effector not turning. twist: both parts. "
                    "velocity_least_rates: the linear part with the smallest joint rates."}};
  Json by_name = joint_mapping(number_schema({}), "a mapping {joint name: rate}");
  by_name["not"] = {{"required", Json::array({"match"})}};
  return {{"anyOf",
           {{{"type", "object"},
             {"title", "{match: velocity}"},
             {"required", Json::array({"match"})},
             {"additionalProperties", false},
             {"properties", {{"match", match}}}},
            by_name,
            joint_list(number_schema({}), "a list in joint order")}}};
}

Json restitution_form(const Field& field) {
  Json part = number_schema(field.range);
  const Json one = titled(part, "a number from 0 to 1");
  part["default"] = 0;
  return {{"anyOf",
           {one,
            {{"type", "object"},
             {"title", "{linear: e, angular: e}"},
             {"additionalProperties", false},
             {"properties", {{"linear", part}, {"angular", part}}}}}}};
}

Json number_or_any_form(const Field& field) {
  return {{"anyOf",
           {titled(number_schema(field.range), "a number"),
            {{"type", "string"}, {"enum", Json::array({"any"})}, {"title", "any"}}}}};
}

Json series_form(const Field&) {
  const Json one{{"type", "array"}, {"items", number_schema({})}, {"minItems", 1}, {"maxItems", 100}};
  return {{"anyOf",
           {joint_mapping(one, "a mapping {joint name: list of numbers}"),
            joint_list(one, "a list of lists in joint order")}}};
}

Json load_table_form(const Field&) { return {{"type", "array"}, {"items", numbers_schema(7, {})}}; }

Json pairs_form(const Field&) {
  return {{"type", "array"},
          {"items",
           {{"type", "array"},
            {"title", "a list of 2 names"},
            {"items", name_schema()},
            {"minItems", 2},
            {"maxItems", 2}}}};
}

Json inertia_form(const Field& field) {
  Json diagonal = numbers_schema(3, {}), all = numbers_schema(6, {});
  diagonal["title"] = "[Ixx, Iyy, Izz]", all["title"] = "[Ixx, Iyy, Izz, Ixy, Ixz, Iyz]";
  const Json matrix{{"type", "array"},
                    {"title", "a symmetric 3 x 3 matrix"},
                    {"items", numbers_schema(3, {})},
                    {"minItems", 3},
                    {"maxItems", 3}};
  Json components = Json::object();
  for (const char* key : {"xx", "yy", "zz", "xy", "xz", "yz"}) {
    components[key] = number_schema({});
    components[key]["x-unit"] = field.unit;
    if (key[0] != key[1]) components[key]["default"] = 0;
  }
  const Json mapping{{"type", "object"},
                     {"title", "a mapping {xx, yy, zz, xy, xz, yz}"},
                     {"required", {"xx", "yy", "zz"}},
                     {"additionalProperties", false},
                     {"properties", components}};
  return {{"anyOf", {diagonal, all, matrix, mapping}}};
}

Json infinite_form(const Field& field) {
  Json schema = number_schema(field.range);
  schema["x-infinity"] = true;
  return schema;
}

const std::map<std::string_view, Json (*)(const Field&)>& forms() {
  static const std::map<std::string_view, Json (*)(const Field&)> kForms{
      {"any text",
       [](const Field&) {
         return Json{{"type", "string"}};
       }},
      {"values by path",
       [](const Field&) {
         return Json{{"type", "object"}, {"additionalProperties", Json::object()}};
       }},
      {"anything",
       [](const Field&) {
         return Json{{"type", "array"}, {"items", Json::object()}};
       }},
      {"quaternion", [](const Field&) { return numbers_schema(4, {}); }},
      {"rpy", [](const Field&) { return numbers_schema(3, {}); }},
      {"scale", [](const Field& field) { return number_schema(field.range); }},
      {"joint values", joint_values_form},
      {"gains", gains_form},
      {"axis gains", axis_gains_form},
      {"final rates", final_rates_form},
      {"restitution", restitution_form},
      {"number or any", number_or_any_form},
      {"number or infinity", infinite_form},
      {"series by joint", series_form},
      {"load table", load_table_form},
      {"pairs of names", pairs_form},
      {"inertia", inertia_form}};
  return kForms;
}

// ---- What keys demand of each other ----

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

// The schema of a list's items where a rule says what they are.
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
    then["properties"][std::string(rule.narrowed)] = {{"type", "array"}, {"items", item_schema(rule.items(), item)}};
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

Json value_json(const Type& type, const void* value) {
  switch (type.kind) {
    case Type::Kind::boolean:
      return type.whole(value) != 0;
    case Type::Kind::whole:
      return type.whole(value);
    case Type::Kind::real:
      return number_json(*static_cast<const double*>(value));
    case Type::Kind::text:
      return *static_cast<const std::string*>(value);
    case Type::Kind::choice:
      return name_of_choice(type, type.whole(value));
    case Type::Kind::list: {
      Json list = Json::array();
      const auto add = [&](const void* item) { list.push_back(value_json(type.of(), item)); };
      for (std::size_t i = 0; i < type.size(value); ++i) type.show_item(value, i, visitor_of(add));
      return list;
    }
    case Type::Kind::structure:
      return Json::object();
    case Type::Kind::optional:
    case Type::Kind::alternatives:
      break;
  }
  throw std::logic_error("no default of an optional value, or of one with alternatives");
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
      definitions[name] = nullptr;  // its place in the order
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
    if (std::isfinite(field.largest)) schema["x-largest"] = field.largest;
    if (const auto absent = default_of(owner, field)) schema["default"] = *absent;
    if (!field.text.empty()) schema["description"] = field.text;
    return schema;
  }

  Json in_form(const Field& field) {
    constexpr std::string_view kConstant = "constant ", kOneOf = "one of ";
    if (field.form.starts_with(kConstant)) return {{"const", field.form.substr(kConstant.size())}};
    if (field.form.starts_with(kOneOf)) return {{"enum", names_in(field.form.substr(kOneOf.size()))}};
    if (field.form == "robot") return robot_form(field);
    if (field.form == "places by end-effector") {
      return {{"type", "object"},
              {"title", "a mapping {end-effector: place}"},
              {"additionalProperties", reference(field.type().of())}};
    }
    const auto form = forms().find(field.form);
    return form != forms().end() ? form->second(field) : by_type(field.type(), field);
  }

  Json robot_form(const Field& field) {
    return {{"anyOf",
             {titled(name_schema(), "the path of a robot file"),
              {{"allOf", Json::array({reference(field.type())})},
               {"type", "object"},
               {"title", "a mapping with a robot's content"}}}}};
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
    const auto take = [&](const void* value) { found = value_json(field.type(), value); };
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
