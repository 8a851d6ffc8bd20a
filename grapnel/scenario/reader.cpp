#include "grapnel/scenario/reader.hpp"

#include <fmt/format.h>

#include <cmath>

#include "grapnel/scenario/forms.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {
namespace {

const Node kNothing;

// The value at a key, or at an item of its list; `path` is that of the value.
void read_value(const ValueToRead& value) {
  const auto& [node, field, type, path, owner, place, scope] = value;
  const bool is_list = type.kind == Type::Kind::list && type.fixed_size == 0;
  if (const Form* form = form_of(type)) {
    if (form->read) form->read(value);
  } else if (type.kind == Type::Kind::optional) {
    type.resize(place, 1);
    read_value({node, field, type.of(), path, owner, type.item(place, 0), scope});
  } else if (type.kind == Type::Kind::structure) {
    read_members(node, type, path, place, scope);
  } else if (is_list && field.is_one_or_list && node.is_mapping()) {
    type.resize(place, 1);
    read_members(node, type.of(), path, type.item(place, 0), scope);
  } else if (is_list && node.is_sequence()) {
    type.resize(place, node.items.size());
    for (std::size_t i = 0; i < node.items.size() && !scope.faults.full(); ++i)
      read_value({node.items[i], field, type.of(), item(path, i), owner, type.item(place, i), scope});
  }
}

// Whether a node can be a value of the type, by its kind; a list of numbers must contain only numbers.
bool can_be(const Node& node, const Type& type) {
  switch (type.kind) {
    case Type::Kind::real:
    case Type::Kind::whole:
      return number_of(node).has_value();
    case Type::Kind::boolean:
      return boolean_of(node).has_value();
    case Type::Kind::text:
    case Type::Kind::choice:
      return is_text(node);
    case Type::Kind::list:
      return node.is_sequence() && (type.fixed_size == 0 || node.items.size() == type.fixed_size) &&
             (type.of().kind != Type::Kind::real || numbers_in(node));
    case Type::Kind::structure:
      return node.is_mapping();
    case Type::Kind::optional:
    case Type::Kind::alternatives:
      break;
  }
  return true;
}

// A value of any type. An unsuitable value leaves the place unchanged.
void read_if_possible(const Node& node, const Field& field, const Type& type, void* place, const ReadScope& scope) {
  if (!can_be(node, type)) return;
  if (const Form* form = form_of(type)) {
    form->read({node, field, type, {}, nullptr, place, scope});
    return;
  }
  switch (type.kind) {
    case Type::Kind::optional:
      if (!can_be(node, type.of())) return;
      type.resize(place, 1);
      return read_if_possible(node, field, type.of(), type.item(place, 0), scope);
    case Type::Kind::alternatives:
      for (std::size_t i = 0; i < type.alternatives.size(); ++i) {
        if (!can_be(node, type.alternatives[i]())) continue;
        type.resize(place, i);
        return read_if_possible(node, field, type.alternatives[i](), type.item(place, i), scope);
      }
      return;
    case Type::Kind::list:
      if (type.fixed_size == 0) type.resize(place, node.items.size());
      for (std::size_t i = 0; i < node.items.size(); ++i)
        read_if_possible(node.items[i], field, type.of(), type.item(place, i), scope);
      return;
    default:
      return read_structure(node, type, place);
  }
}

}  // namespace

void read_structure(const Node& mapping, const Type& type, void* structure) {
  FaultList no_faults;  // the schema finds all errors of plain values
  const Meshes no_meshes;
  const ReadScope scope{no_faults, no_meshes};
  for (const Field& field : type.fields) {
    const Node* node = mapping.find(field.key);
    if (node && field.place && (field.form.empty() || field.form == "any text"))
      read_if_possible(*node, field, field.type(), field.place(structure), scope);
  }
}

void read_members(const Node& mapping, const Type& type, const std::string& path, void* structure,
                  const ReadScope& scope) {
  for (const Field& field : type.fields) {
    const Node* node = mapping.find(field.key);
    if (!node || (field.is_present && !field.is_present(structure))) continue;
    void* place = field.place ? field.place(structure) : nullptr;
    if (!field.form.empty()) {
      const Form* form = form_of(field);
      if (form && form->read) form->read({*node, field, field.type(), path, structure, place, scope});
    } else if (place) {
      read_value({*node, field, field.type(), below(path, field.key), structure, place, scope});
    }
  }
}

const Node& part(const Node& mapping, std::string_view key) {
  const Node* found = mapping.find(key);
  return found ? *found : kNothing;
}

std::string text_at(const Node& mapping, std::string_view key) {
  const Node& node = part(mapping, key);
  return is_text(node) ? node.text : std::string();
}

std::optional<double> number_at(const Node& mapping, std::string_view key) {
  const auto value = number_of(part(mapping, key));
  return value && !std::isnan(*value) ? value : std::nullopt;
}

std::optional<Vector3d> vector_at(const Node& mapping, std::string_view key) {
  const auto values = finite_list(part(mapping, key), 3);
  if (!values) return {};
  return Vector3d{(*values)[0], (*values)[1], (*values)[2]};
}

bool boolean_at(const Node& mapping, std::string_view key) { return boolean_of(part(mapping, key)).value_or(false); }

Vector3d unit_vector_of(const Node& node, const std::string& name, FaultList& faults) {
  const auto given = finite_list(node, 3);
  const Vector3d v = given ? Vector3d{(*given)[0], (*given)[1], (*given)[2]} : Vector3d::unit(2);
  const double length = std::hypot(v[0], v[1], v[2]);
  if (std::abs(length - 1) < 1e-9) return v;
  std::string advice;
  if (length > 0 && std::isfinite(length)) {
    // All digits, so that the suggestion passes this check.
    advice = fmt::format("; normalised it is [{}, {}, {}]", v[0] / length, v[1] / length, v[2] / length);
  }
  faults.add(node.mark, fmt::format("{} has length {:.9g}, must be a unit vector{}", name, length, advice));
  return Vector3d::unit(2);
}
Vector3d unit_vector_at(const Node& mapping, std::string_view key, const std::string& path, FaultList& faults) {
  return unit_vector_of(part(mapping, key), below(path, key), faults);
}

void check_name(const std::string& name, const Mark& mark, const std::string& path, FaultList& faults) {
  constexpr std::size_t kLongest = 200;  // [bytes]
  std::string why;
  if (name == "." || name == "..")
    why = "; this is a folder's name";
  else if (name.find('/') != std::string::npos)
    why = " and must not contain '/'";
  else if (name.size() > kLongest)
    why = fmt::format(" and may have {} bytes, not {}", kLongest, name.size());
  if (why.empty()) return;
  faults.add(mark, fmt::format("{} {} is not a valid name, because results are stored under names{}", path,
                               in_quotes(name), why));
}

void NameTable::add_from(const Node& entry, const std::string& path, FaultList& faults) {
  const std::string name = text_at(entry, "name");
  if (name.empty()) {
    complete_ = false;
    return;
  }
  const Mark& mark = part(entry, "name").mark;
  check_name(name, mark, below(path, "name"), faults);
  const auto [it, fresh] = marks_.emplace(name, mark);
  if (fresh) {
    names_.push_back(name);
    return;
  }
  duplicates_.insert(name);
  complete_ = false;  // another name may refer to either of the two
  const std::string earlier = it->second.line > 0 ? fmt::format("; first given in line {}", it->second.line) : "";
  faults.add(mark,
             fmt::format("duplicate name {} in {}: {} names must be unique{}", in_quotes(name), path, kind_, earlier));
}

bool NameTable::expect(const std::string& name, const Mark& mark, const std::string& path, FaultList& faults) const {
  // The name may refer to an invalid or unnamed entry, which has been reported.
  if (name.empty() || !complete_ || faults.full() || marks_.contains(name)) return true;
  faults.add(mark,
             fmt::format("unknown {} {} in {}{}", kind_, in_quotes(name), path, suggestion(name, names_, kind_ + "s")));
  return false;
}

std::string below(const std::string& path, std::string_view key) {
  return path.empty() ? std::string(key) : path + "." + std::string(key);
}
std::string item(const std::string& path, std::size_t index) { return fmt::format("{}[{}]", path, index); }

}  // namespace grapnel
