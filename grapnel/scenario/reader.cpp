#include "grapnel/scenario/reader.hpp"

#include <fmt/format.h>

#include <cmath>

#include "grapnel/scenario/descriptions.hpp"
#include "grapnel/scenario/plausibility.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {
namespace {

const Node kNothing;

// The numbers of a list, if it is one and all are finite.
std::optional<std::vector<double>> finite_list(const Node& node) {
  if (!node.is_sequence()) return {};
  std::vector<double> values;
  for (const Node& entry : node.items) {
    const auto value = number_of(entry);
    if (!value || !std::isfinite(*value)) return {};
    values.push_back(*value);
  }
  return values;
}

Rotationd rotation_of(const Node& mapping, const std::string& path, FaultList& faults) {
  if (const auto rpy = vector_at(mapping, "rpy")) return rotation_from_rpy((*rpy)[0], (*rpy)[1], (*rpy)[2]);
  const Node& node = part(mapping, "quaternion_wxyz");
  const auto q = finite_list(node);
  if (!q || q->size() != 4) return Rotationd::identity();
  const auto& v = *q;
  if (const auto R = rotation_from_wxyz(std::span<const double, 4>(v))) {
    doubt_quaternion(std::span<const double, 4>(v), node.mark, below(path, "quaternion_wxyz"), faults);
    return *R;
  }
  const double length = std::hypot(std::hypot(v[0], v[1]), std::hypot(v[2], v[3]));
  faults.add(node.mark,
             fmt::format("{} has length {:.9g}, must be 1 within 1e-6{}", below(path, "quaternion_wxyz"), length,
                         length > 0 && std::isfinite(length)
                             ? fmt::format("; normalised it is [{:.9g}, {:.9g}, {:.9g}, {:.9g}]", v[0] / length,
                                           v[1] / length, v[2] / length, v[3] / length)
                             : ""));
  return Rotationd::identity();
}

// A value of a plain type, if the node is one. False: the type is none.
bool read_plain(const Node& node, const Field& field, const Type& type, void* place) {
  switch (type.kind) {
    case Type::Kind::real:
      if (const auto value = number_of(node); value && !std::isnan(*value)) *static_cast<double*>(place) = *value;
      return true;
    case Type::Kind::whole:
      // A value out of range is a known fault and must only be safe to convert. Whole numbers up to 2^53 are exact.
      if (const auto value = number_of(node);
          value && std::abs(*value) <= 9007199254740992 && field.range.contains(*value))
        type.set_whole(place, static_cast<std::int64_t>(*value));
      return true;
    case Type::Kind::boolean:
      if (const auto value = boolean_of(node)) type.set_whole(place, *value);
      return true;
    case Type::Kind::text:
      if (is_text(node)) *static_cast<std::string*>(place) = node.text;
      return true;
    case Type::Kind::choice:
      if (const auto value = is_text(node) ? choice_named(type, node.text) : std::nullopt)
        type.set_whole(place, *value);
      return true;
    case Type::Kind::list:
      if (type.fixed_size != 3) return false;
      if (const auto values = finite_list(node); values && values->size() == 3)
        *static_cast<Vector3d*>(place) = {(*values)[0], (*values)[1], (*values)[2]};
      return true;
    case Type::Kind::optional:
    case Type::Kind::alternatives:
    case Type::Kind::structure:
      break;
  }
  return false;
}

// Whether a node can be a value of the type, as far as its kind tells; a list of numbers must have nothing else.
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

// A value of any type. One that cannot be it leaves the place as it is.
void read_value(const Node& node, const Field& field, const Type& type, void* place) {
  if (!can_be(node, type)) return;
  switch (type.kind) {
    case Type::Kind::optional:
      if (!can_be(node, type.of())) return;
      type.resize(place, 1);
      return read_value(node, field, type.of(), type.item(place, 0));
    case Type::Kind::alternatives:
      for (std::size_t i = 0; i < type.alternatives.size(); ++i) {
        if (!can_be(node, type.alternatives[i]())) continue;
        type.resize(place, i);
        return read_value(node, field, type.alternatives[i](), type.item(place, i));
      }
      return;
    case Type::Kind::list:
      if (type.fixed_size == 0) type.resize(place, node.items.size());
      for (std::size_t i = 0; i < node.items.size(); ++i)
        read_value(node.items[i], field, type.of(), type.item(place, i));
      return;
    case Type::Kind::structure:
      return read_structure(node, type, place);
    default:
      read_plain(node, field, type, place);
  }
}

void read_members(const Node& mapping, const Type& type, void* structure) {
  for (const Field& field : type.fields) {
    const Node* node = mapping.find(field.key);
    if (!node || !field.place || !(field.form.empty() || field.form == "number or infinity")) continue;
    const Type& value = field.type();
    const Type& inner = value.kind == Type::Kind::optional ? value.of() : value;
    if (inner.kind == Type::Kind::list && inner.fixed_size == 0) continue;
    void* place = field.place(structure);
    if (!place) continue;
    if (value.kind == Type::Kind::optional) {
      value.resize(place, 1);
      place = value.item(place, 0);
    }
    if (!read_plain(*node, field, inner, place) && inner.kind == Type::Kind::structure)
      read_members(*node, inner, place);
  }
}

bool is_matrix(const Node& node) { return node.is_sequence() && !node.items.empty() && node.items[0].is_sequence(); }

// The six entries xx, yy, zz, xy, xz, yz of a symmetric 3 x 3 matrix; of two that differ by rounding their mean.
std::optional<std::vector<double>> symmetric_entries(const Node& node, const std::string& path, FaultList& faults) {
  constexpr double kSymmetric = 1e-6;  // of the largest entry: tables have six digits
  std::vector<std::vector<double>> a;
  double largest = 0;
  for (const Node& row : node.items) {
    const auto values = finite_list(row);
    if (!values || values->size() != 3) return {};
    for (const double value : *values) largest = std::max(largest, std::abs(value));
    a.push_back(*values);
  }
  if (a.size() != 3) return {};
  bool symmetric = true;
  for (const auto& [i, j] : {std::pair{0, 1}, std::pair{0, 2}, std::pair{1, 2}}) {
    if (std::abs(a[i][j] - a[j][i]) <= kSymmetric * largest) continue;
    symmetric = false;
    faults.add(node.items[j].items[i].mark, fmt::format("{} is not symmetric: [{}][{}] is {} and [{}][{}] is {}", path,
                                                        i, j, a[i][j], j, i, a[j][i]));
  }
  if (!symmetric) return {};
  return std::vector<double>{
      a[0][0], a[1][1], a[2][2], (a[0][1] + a[1][0]) / 2, (a[0][2] + a[2][0]) / 2, (a[1][2] + a[2][1]) / 2};
}

}  // namespace

std::optional<Rotationd> rotation_from_wxyz(std::span<const double, 4> q) {
  // hypot: the squares of what a file may hold can overflow.
  const double length = std::hypot(std::hypot(q[0], q[1]), std::hypot(q[2], q[3]));
  if (!(std::abs(length - 1) <= 1e-6)) return {};
  return rotation_matrix(Quaterniond{q[0] / length, q[1] / length, q[2] / length, q[3] / length});
}

void read_members(const Node& mapping, std::string_view path, void* structure) {
  read_members(mapping, description_at(path), structure);
}

void read_structure(const Node& mapping, const Type& type, void* structure) {
  for (const Field& field : type.fields) {
    const Node* node = mapping.find(field.key);
    if (node && field.place && (field.form.empty() || field.form == "any text"))
      read_value(*node, field, field.type(), field.place(structure));
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
  const auto values = finite_list(part(mapping, key));
  if (!values || values->size() != 3) return {};
  return Vector3d{(*values)[0], (*values)[1], (*values)[2]};
}

std::uint64_t whole_number_at(const Node& mapping, std::string_view key, std::uint64_t most) {
  // A value out of range is a known fault and must only be safe to convert. Every whole number up to 2^53 is exact.
  const double value = number_at(mapping, key).value_or(0);
  return value >= 0 && value <= static_cast<double>(most) ? static_cast<std::uint64_t>(value) : 0;
}

bool boolean_at(const Node& mapping, std::string_view key) { return boolean_of(part(mapping, key)).value_or(false); }

Posed pose_of(const Node& mapping, const std::string& path, FaultList& faults) {
  return {rotation_of(mapping, path, faults), vector_at(mapping, "position").value_or(Vector3d::zero())};
}

Vector3d unit_vector_at(const Node& mapping, std::string_view key, const std::string& path, FaultList& faults) {
  const auto vector = vector_at(mapping, key);
  if (!vector) return Vector3d::unit(2);
  const Vector3d& v = *vector;
  const double length = std::hypot(v[0], v[1], v[2]);
  if (std::abs(length - 1) < 1e-9) return v;
  std::string advice;
  if (length > 0 && std::isfinite(length)) {
    // All digits, so that the suggestion passes this very check.
    advice = fmt::format("; normalised it is [{}, {}, {}]", v[0] / length, v[1] / length, v[2] / length);
  }
  faults.add(part(mapping, key).mark,
             fmt::format("{} has length {:.9g}, must be a unit vector{}", below(path, key), length, advice));
  return Vector3d::unit(2);
}

Symmetric3d inertia_at(const Node& mapping, const std::string& path, FaultList& faults) {
  const Node& node = part(mapping, "inertia");
  std::vector<double> v;
  if (is_matrix(node)) {
    v = symmetric_entries(node, below(path, "inertia"), faults).value_or(std::vector<double>{});
  } else if (node.is_mapping()) {
    for (const char* key : {"xx", "yy", "zz", "xy", "xz", "yz"}) v.push_back(number_at(node, key).value_or(NAN));
  } else {
    v = finite_list(node).value_or(std::vector<double>{});
    if (v.size() == 3) v.resize(6, 0.0);
  }
  const Symmetric3d neutral{1, 1, 1, 0, 0, 0};
  if (v.size() != 6) return neutral;
  for (const double value : v) {
    if (!std::isfinite(value)) return neutral;
  }
  const Symmetric3d inertia{v[0], v[1], v[2], v[3], v[4], v[5]};
  const std::string fault = inertia_fault(inertia);
  if (fault.empty()) return inertia;
  faults.add(node.mark, (path.empty() ? "" : path + ": ") + fault);
  return neutral;
}

Geometry geometry_at(const Node& mapping, const std::string& path, const Meshes& meshes, FaultList& faults) {
  const Node& node = part(mapping, "geometry");
  Geometry geometry;
  if (!node.is_mapping()) return geometry;
  const std::string shape = text_at(node, "shape");
  const double radius = number_at(node, "radius").value_or(0);
  if (shape == "box") {
    geometry.shape = Geometry::Shape::box;
    geometry.size = vector_at(node, "size").value_or(Vector3d::zero());
  } else if (shape == "cylinder" || shape == "capsule") {
    geometry.shape = shape == "capsule" ? Geometry::Shape::capsule : Geometry::Shape::cylinder;
    geometry.size = {radius, number_at(node, "length").value_or(0), 0};
  } else if (shape == "sphere") {
    geometry.shape = Geometry::Shape::sphere;
    geometry.size = {radius, 0, 0};
  } else if (shape == "mesh") {
    const auto mesh = meshes.find(text_at(node, "file"));
    if (mesh == meshes.end() || !mesh->second) return geometry;
    const double scale = number_at(node, "scale").value_or(1);
    geometry.shape = Geometry::Shape::mesh;
    geometry.size = {scale, scale, scale};
    geometry.mesh = mesh->second;
  }
  geometry.X_BG = pose_of(node, below(path, "geometry"), faults);
  return geometry;
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
  faults.add(mark, fmt::format("{} {} cannot be a name: results are filed under names{}", path, in_quotes(name), why));
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
  complete_ = false;  // one of the two may be what another name means
  const std::string earlier = it->second.line > 0 ? fmt::format("; first given in line {}", it->second.line) : "";
  faults.add(mark,
             fmt::format("duplicate name {} in {}: {} names must differ{}", in_quotes(name), path, kind_, earlier));
}

bool NameTable::expect(const std::string& name, const Mark& mark, const std::string& path, FaultList& faults) const {
  // Faulty or nameless things elsewhere may be what is meant; they have been reported.
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
