#include "grapnel/scenario/forms.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "grapnel/scenario/schema.hpp"
#include "grapnel/scenario/sections.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/units.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {

using Json = nlohmann::ordered_json;
using Numbers = std::span<const double>;

// ---- Schemas of plain values ----

Json number_json(double x) {
  constexpr double kExact = 9007199254740992;
  if (x == std::floor(x) && std::abs(x) <= kExact) return static_cast<std::int64_t>(x);
  return x;
}

Json number_schema(const Range& range, const char* type) {
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

// ---- Setters of numbers ----

bool allows(const Field& field, Numbers numbers) {
  const Magnitudes of_unit = magnitudes_of(field.unit);
  const double largest = std::isnan(field.largest) ? of_unit.largest : field.largest;
  const bool is_positive = field.range.least_excluded && field.range.least == 0;
  return std::all_of(numbers.begin(), numbers.end(), [&](double x) {
    return std::isfinite(x) && field.range.contains(x) && std::abs(x) <= largest &&
           !(is_positive && x < of_unit.smallest);
  });
}

namespace {

Node name_node(const std::string& text) {
  Node node;
  node.kind = Node::Kind::scalar;
  node.text = text;
  node.plain = is_text(node);  // else it would read as another kind without quotes
  return node;
}

// ---- Numbers, names, truth values, vectors ----

void read_number(const ValueToRead& at) {
  if (const auto value = number_of(at.node); value && !std::isnan(*value)) at.into<double>() = *value;
}

void read_whole_number(const ValueToRead& at) {
  // A value out of range has been reported; the conversion must only be safe. Whole numbers up to 2^53 are exact.
  const auto value = number_of(at.node);
  if (value && std::abs(*value) <= 9007199254740992 && at.field.range.contains(*value))
    at.type.set_whole(at.place, static_cast<std::int64_t>(*value));
}
NumberWriter whole_number_writer(const NumberPlace& at) {
  const Type& stated = at.field.type();
  const Type& type = stated.kind == Type::Kind::optional ? stated.of() : stated;
  if (!at.is_number()) return nullptr;
  return [field = at.field, set = type.set_whole](CaptureProblem&, void* place, Numbers numbers) {
    if (numbers.size() != 1 || !allows(field, numbers) || numbers[0] != std::floor(numbers[0])) return false;
    set(place, static_cast<std::int64_t>(numbers[0]));
    return true;
  };
}

void read_choice(const ValueToRead& at) {
  const auto value = is_text(at.node) ? choice_named(at.type, at.node.text) : std::nullopt;
  if (value) at.type.set_whole(at.place, *value);
}

void read_vector(const ValueToRead& at) {
  if (const auto v = finite_list(at.node, 3)) at.into<Vector3d>() = {(*v)[0], (*v)[1], (*v)[2]};
}
NumberWriter vector_writer(const NumberPlace& at) {
  return components_writer(at, [](const Vector3d&) { return true; });
}
const Form kNumber{
    .name = "number", .read = read_number, .numbers = number_writer, .write = [](const Type&, const void* value) {
      return plain_number_node(*static_cast<const double*>(value));
    }};
const Form kWholeNumber{.name = "whole number", .read = read_whole_number, .numbers = whole_number_writer};
const Form kTruth{.name = "truth", .read = [](const ValueToRead& at) {
                    if (const auto value = boolean_of(at.node)) at.type.set_whole(at.place, *value);
                  }};
const Form kName{
    .name = "name",
    .read =
        [](const ValueToRead& at) {
          if (is_text(at.node)) at.into<std::string>() = at.node.text;
        },
    .write = [](const Type&, const void* value) { return name_node(*static_cast<const std::string*>(value)); }};
const Form kChoice{.name = "choice", .read = read_choice, .write = [](const Type& type, const void* value) {
                     return name_node(std::string(name_of_choice(type, type.whole(value))));
                   }};
const Form kVector{.name = "vector", .read = read_vector, .numbers = vector_writer, .write = vector_node};

// ---- Numbers with alternatives ----

Json axis_gains_schema(const Field& field, const TypeReference&) {
  return {{"anyOf", {titled(number_schema(field.range), "a number for all axes"), numbers_schema(3, field.range)}}};
}
void read_axis_gains(const ValueToRead& at) {
  const auto one = number_of(at.node);
  if (!one) return read_vector(at);
  if (!std::isnan(*one)) at.into<Vector3d>() = {*one, *one, *one};
}
NumberWriter axis_gains_writer(const NumberPlace& at) {
  if (!at.is_number()) return vector_writer(at);
  return writer_of_one<Vector3d>(at, [](Vector3d& v, double x) { return v = {x, x, x}, true; });
}

Json restitution_schema(const Field& field, const TypeReference&) {
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
void read_restitution(const ValueToRead& at) {
  ImpactSetup& impact = *static_cast<ImpactSetup*>(at.owner);
  if (const auto e = number_of(at.node); e && !std::isnan(*e)) impact.restitution = impact.angular_restitution = *e;
  if (!at.node.is_mapping()) return;
  impact.restitution = number_at(at.node, "linear").value_or(0);
  impact.angular_restitution = number_at(at.node, "angular").value_or(0);
}
// A number for all rows, or {linear: e, angular: e}, or one of these.
NumberWriter restitution_writer(const NumberPlace& at) {
  std::vector<std::string> keys;
  if (at.rest.empty() && at.form.is_mapping()) {
    for (const NodeEntry& entry : at.form.entries) keys.push_back(entry.key);
  } else if (at.rest.size() == 1 && !at.rest[0].is_index) {
    keys.push_back(at.rest[0].key);
  } else if (!at.is_number()) {
    return nullptr;
  }
  return [field = at.field, keys](CaptureProblem& problem, void*, Numbers numbers) {
    ImpactSetup& impact = *problem.impact;
    if (numbers.size() != std::max<std::size_t>(keys.size(), 1) || !allows(field, numbers)) return false;
    if (keys.empty()) impact.restitution = impact.angular_restitution = numbers[0];
    for (std::size_t i = 0; i < keys.size(); ++i)
      (keys[i] == "angular" ? impact.angular_restitution : impact.restitution) = numbers[i];
    return true;
  };
}

Json friction_schema(const Field& field, const TypeReference&) {
  const Json part = number_schema(field.range);
  return {{"anyOf",
           {titled(part, "a number"),
            {{"type", "object"},
             {"title", "{static: mu_s, kinetic: mu_k}"},
             {"required", {"static", "kinetic"}},
             {"additionalProperties", false},
             {"properties", {{"static", part}, {"kinetic", part}}}}}}};
}
void read_friction(const ValueToRead& at) {
  auto& surface = *static_cast<ContactMaterial*>(at.place);
  if (const auto both = number_of(at.node); both && !std::isnan(*both))
    surface.static_friction = surface.kinetic_friction = *both;
  if (!at.node.is_mapping()) return;
  surface.static_friction = number_at(at.node, "static").value_or(0);
  surface.kinetic_friction = number_at(at.node, "kinetic").value_or(0);
}
// A number for both, or {static, kinetic}, or one of these.
NumberWriter friction_writer(const NumberPlace& at) {
  std::vector<std::string> keys;
  if (at.rest.empty() && at.form.is_mapping()) {
    for (const NodeEntry& entry : at.form.entries) keys.push_back(entry.key);
  } else if (at.rest.size() == 1 && !at.rest[0].is_index) {
    keys.push_back(at.rest[0].key);
  } else if (!at.is_number()) {
    return nullptr;
  }
  return [field = at.field, keys](CaptureProblem&, void* place, Numbers numbers) {
    auto& surface = *static_cast<ContactMaterial*>(place);
    if (numbers.size() != std::max<std::size_t>(keys.size(), 1) || !allows(field, numbers)) return false;
    if (keys.empty()) surface.static_friction = surface.kinetic_friction = numbers[0];
    for (std::size_t i = 0; i < keys.size(); ++i)
      (keys[i] == "kinetic" ? surface.kinetic_friction : surface.static_friction) = numbers[i];
    return true;
  };
}

Json ready_made_material_schema(const Field&, const TypeReference&) {
  Json names = Json::array();
  for (const PublishedMaterial& one : published_materials()) names.push_back(one.name);
  return {{"enum", std::move(names)}};
}
void read_ready_made_material(const ValueToRead& at) {
  if (!is_text(at.node)) return;
  if (const PublishedMaterial* found = published_material(at.node.text))
    *static_cast<ContactMaterial*>(at.place) = found->material;
}

Json number_or_any_schema(const Field& field, const TypeReference&) {
  return {{"anyOf",
           {titled(number_schema(field.range), "a number"),
            {{"type", "string"}, {"enum", Json::array({"any"})}, {"title", "any"}}}}};
}
void read_number_or_any(const ValueToRead& at) {
  if (is_text(at.node) && at.node.text == "any")
    at.into<double>() = std::numeric_limits<double>::infinity();
  else
    read_number(at);
}

Json number_or_infinity_schema(const Field& field, const TypeReference&) {
  Json schema = number_schema(field.range);
  schema["x-infinity"] = true;
  return schema;
}

// ---- Names without a separate enumeration ----

Json one_of_schema(const Field& field, const TypeReference&) {
  Json names = Json::array();
  std::string_view rest = field.form.substr(field.form.find("of ") + 3);
  for (std::size_t comma; (comma = rest.find(", ")) != rest.npos; rest.remove_prefix(comma + 2))
    names.push_back(rest.substr(0, comma));
  names.push_back(rest);
  return {{"enum", std::move(names)}};
}
void read_grasp_model(const ValueToRead& at) {
  GraspSetup& grasp = *static_cast<GraspSetup*>(at.owner);
  grasp.contact = at.node.text == "contact";
  grasp.model = at.node.text == "hinge"   ? GraspModel::hinge
                : at.node.text == "point" ? GraspModel::point
                                          : GraspModel::rigid;
}

Json pairs_schema(const Field&, const TypeReference&) {
  return {{"type", "array"},
          {"items",
           {{"type", "array"},
            {"title", "a list of 2 names"},
            {"items", name_schema()},
            {"minItems", 2},
            {"maxItems", 2}}}};
}

Json groups_schema(const Field&, const TypeReference&) {
  const Json group{{"type", "array"}, {"title", "a list of names"}, {"items", name_schema()}, {"minItems", 1}};
  return {
      {"type", "array"}, {"title", "a list of groups of names"}, {"items", group}, {"minItems", 2}, {"maxItems", 2}};
}

// ---- Rows [t, Fx, Fy, Fz, Mx, My, Mz] ----

Json load_table_schema(const Field&, const TypeReference&) {
  return {{"type", "array"}, {"items", numbers_schema(7, {})}};
}
// A unit, if the number was written with one, is that of its column.
void check_column_unit(const Node& number, std::size_t column, const ValueToRead& at) {
  const unsigned wanted = column == 0 ? 1 : column < 4 ? 2 : 3;
  if (number.unit == 0 || number.unit == Node::kRefusedUnit || number.unit == wanted || column > 6) return;
  const std::vector<std::string_view> units = units_of_place(at.field.unit);
  at.scope.faults.add(number.mark, fmt::format("{}: number {} of a row is in {}; expected {}", at.name(), column + 1,
                                               units.at(number.unit - 1u), expected_of(units.at(wanted - 1))));
}
void read_load_table(const ValueToRead& at) {
  LoadProfile& profile = *static_cast<LoadProfile*>(at.owner);
  for (const Node& item : at.node.items) {
    std::vector<double> row;
    for (const Node& entry : item.items) {
      check_column_unit(entry, row.size(), at);
      row.push_back(number_of(entry).value_or(0));
    }
    const bool is_row = row.size() == 7;  // otherwise it has been reported
    row.resize(7);
    profile.times.push_back(is_row ? row[0] : NAN);
    profile.values.push_back({{row[4], row[5], row[6]}, {row[1], row[2], row[3]}});
  }
}
// One number of a row. Times must stay in order: by reading.
NumberWriter load_table_writer(const NumberPlace& at) {
  const auto& values = *static_cast<const std::vector<Wrenchd>*>(at.value);
  if (at.rest.size() != 2 || !at.rest[0].is_index || !at.rest[1].is_index || !at.form.is_scalar()) return nullptr;
  const std::size_t row = at.rest[0].index, column = at.rest[1].index;
  if (column < 1 || column > 6 || row >= values.size()) return nullptr;
  return [=, field = at.field](CaptureProblem&, void* place, Numbers numbers) {
    if (numbers.size() != 1 || !allows(field, numbers)) return false;
    Wrenchd& wrench = (*static_cast<std::vector<Wrenchd>*>(place)).at(row);
    const int axis = static_cast<int>(column - 1) % 3;
    (column < 4 ? wrench.linear[axis] : wrench.angular[axis]) = numbers[0];
    return true;
  };
}

// ---- {end-effector: place} ----

Json places_schema(const Field& field, const TypeReference& reference) {
  return {{"type", "object"},
          {"title", "a mapping {end-effector: place}"},
          {"additionalProperties", reference(field.type().of())}};
}
void read_places(const ValueToRead& at) {
  auto& places = *static_cast<std::vector<Waypoint::Place>*>(at.place);
  for (const NodeEntry& entry : at.node.entries) {
    Waypoint::Place& place = places.emplace_back();
    place.end_effector = entry.key;
    read_members(entry.value, at.field.type().of(), below(at.name(), shortened(entry.key)), &place, at.scope);
  }
}

Json robot_schema_of(const Field& field, const TypeReference& reference) {
  return {{"anyOf",
           {titled(name_schema(), "the name of a ready-made robot, the path of a robot file or model"),
            {{"allOf", Json::array({reference(field.type())})},
             {"type", "object"},
             {"title", "a mapping with a robot's content"}},
            {{"allOf", Json::array({reference(robot_on_bus_description())})},
             {"type", "object"},
             {"title", "a mapping with a bus and arms"}}}}};
}

// ---- {name: value} ----

Json by_name_schema(Json value) { return {{"type", "object"}, {"additionalProperties", std::move(value)}}; }

// A mapping of any content, stored as JSON: parameters that only the plugin interprets.
Json json_value(const Node& node) {
  switch (node.kind) {
    case Node::Kind::null:
      return nullptr;
    case Node::Kind::mapping: {
      Json object = Json::object();
      for (const NodeEntry& entry : node.entries) object[entry.key] = json_value(entry.value);
      return object;
    }
    case Node::Kind::sequence: {
      Json list = Json::array();
      for (const Node& one : node.items) list.push_back(json_value(one));
      return list;
    }
    case Node::Kind::scalar:
      break;
  }
  if (const auto flag = boolean_of(node)) return *flag;
  if (const auto number = number_of(node)) {
    const bool is_whole = std::abs(*number) < 1e15 && std::trunc(*number) == *number;
    return is_whole ? Json(static_cast<std::int64_t>(*number)) : Json(*number);
  }
  return node.text;
}

void read_parameters(const ValueToRead& at) {
  if (at.node.is_mapping()) at.into<std::string>() = json_value(at.node).dump();
}

Node node_of(const Json& value) {
  if (value.is_object()) {
    Node mapping = mapping_node();
    for (const auto& [key, one] : value.items()) put(mapping, key, node_of(one));
    return mapping;
  }
  if (value.is_array()) {
    Node list = sequence_node();
    for (const Json& one : value) list.items.push_back(node_of(one));
    return list;
  }
  if (value.is_number()) return number_node(value.get<double>());
  if (value.is_string()) return text_node(value.get<std::string>());
  Node other;
  if (value.is_boolean()) other.kind = Node::Kind::scalar, other.text = value.get<bool>() ? "true" : "false";
  return other;
}

Node parameters_node(const Type&, const void* value) {
  return node_of(Json::parse(*static_cast<const std::string*>(value)));
}

const Form kForms[] = {
    {.name = "any text",
     .schema =
         [](const Field&, const TypeReference&) {
           return Json{{"type", "string"}};
         }},
    {.name = "values by path",
     .schema =
         [](const Field&, const TypeReference&) {
           return Json{{"type", "object"}, {"additionalProperties", Json::object()}};
         }},
    {.name = "parameters",
     .schema =
         [](const Field&, const TypeReference&) {
           return Json{{"type", "object"}, {"additionalProperties", Json::object()}};
         },
     .read = read_parameters,
     .write = parameters_node},
    {.name = "anything",
     .schema =
         [](const Field&, const TypeReference&) {
           return Json{{"type", "array"}, {"items", Json::object()}};
         }},
    {.name = "constant ",
     .schema =
         [](const Field& field, const TypeReference&) {
           return Json{{"const", field.form.substr(field.form.find(' ') + 1)}};
         }},
    {.name = "axis gains", .schema = axis_gains_schema, .read = read_axis_gains, .numbers = axis_gains_writer},
    {.name = "restitution", .schema = restitution_schema, .read = read_restitution, .numbers = restitution_writer},
    {.name = "friction coefficients", .schema = friction_schema, .read = read_friction, .numbers = friction_writer},
    {.name = "ready-made material", .schema = ready_made_material_schema, .read = read_ready_made_material},
    {.name = "number or any", .schema = number_or_any_schema, .read = read_number_or_any, .numbers = number_writer},
    {.name = "number or infinity", .schema = number_or_infinity_schema, .read = read_number, .numbers = number_writer},
    {.name = "one of rigid, hinge, point, contact", .schema = one_of_schema, .read = read_grasp_model},
    {.name = "one of ", .schema = one_of_schema},
    {.name = "pairs of names", .schema = pairs_schema},
    {.name = "two groups of names", .schema = groups_schema},
    {.name = "load table", .schema = load_table_schema, .read = read_load_table, .numbers = load_table_writer},
    {.name = "places by end-effector", .schema = places_schema, .read = read_places},
    {.name = "robot", .schema = robot_schema_of},
    {.name = "import"},  // imported_robot.cpp reads it first
    {.name = "mount"},
    {.name = "numbers by name",
     .schema = [](const Field&, const TypeReference&) { return by_name_schema(number_schema({})); }},
    {.name = "names by name",
     .schema = [](const Field&, const TypeReference&) { return by_name_schema(name_schema()); }},
};

}  // namespace

// Three numbers, or one of them; the check covers all three.
NumberWriter components_writer(const NumberPlace& at, bool (*check)(const Vector3d&)) {
  std::vector<int> which;
  if (at.is_list(3)) which = {0, 1, 2};
  if (at.rest.size() == 1 && at.rest[0].is_index && at.rest[0].index < 3 && at.form.is_scalar())
    which.push_back(static_cast<int>(at.rest[0].index));
  if (which.empty()) return nullptr;
  return [field = at.field, which, check](CaptureProblem&, void* place, Numbers numbers) {
    if (numbers.size() != which.size() || !allows(field, numbers)) return false;
    Vector3d& v = *static_cast<Vector3d*>(place);
    for (std::size_t i = 0; i < which.size(); ++i) v[which[i]] = numbers[i];
    return check(v);
  };
}
Node vector_node(const Type&, const void* value) {
  const Vector3d& v = *static_cast<const Vector3d*>(value);
  return numbers_node(std::vector<double>{v[0], v[1], v[2]});
}

Node plain_number_node(double value) { return number_node(value == 0 ? 0 : value); }

Node numbers_node(Numbers values) {
  Node node;
  node.kind = Node::Kind::sequence;
  for (const double value : values) node.items.push_back(plain_number_node(value));
  return node;
}

std::optional<std::vector<double>> finite_list(const Node& node, std::size_t count) {
  auto values = node.is_sequence() ? numbers_in(node) : std::nullopt;
  if (count > 0 && values && values->size() != count) return {};
  return values;
}

NumberWriter number_writer(const NumberPlace& at) {
  return writer_of_one<double>(at, [](double& member, double x) { return member = x, true; });
}

const Form* form_of(const Type& type) {
  switch (type.kind) {
    case Type::Kind::real:
      return &kNumber;
    case Type::Kind::whole:
      return &kWholeNumber;
    case Type::Kind::boolean:
      return &kTruth;
    case Type::Kind::text:
      return &kName;
    case Type::Kind::choice:
      return &kChoice;
    case Type::Kind::list:
      return type.fixed_size == 3 ? &kVector : nullptr;
    default:
      return nullptr;
  }
}

const Form* form_of(const Field& field) {
  const Type& type = field.type();
  if (field.form.empty()) return form_of(type.kind == Type::Kind::optional ? type.of() : type);
  for (const std::span<const Form> forms : {std::span<const Form>(kForms), body_forms(), joint_value_forms()}) {
    for (const Form& form : forms) {
      if (form.name == field.form || (form.name.ends_with(' ') && field.form.starts_with(form.name))) return &form;
    }
  }
  return nullptr;
}

}  // namespace grapnel
