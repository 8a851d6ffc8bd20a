#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "grapnel/scenario/forms.hpp"
#include "grapnel/scenario/plausibility.hpp"
#include "grapnel/scenario/sections.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {
namespace {

using Json = nlohmann::ordered_json;
using Numbers = std::span<const double>;

// ---- Directions and orientations ----

bool is_unit_vector(const Vector3d& v) { return std::abs(std::hypot(v[0], v[1], v[2]) - 1) < 1e-9; }  // as the reader

void read_unit_vector(const ValueToRead& at) {
  at.into<Vector3d>() = unit_vector_of(at.node, at.name(), at.scope.faults);
}

void read_quaternion(const ValueToRead& at) {
  Rotationd& R = at.into<Rotationd>();
  R = Rotationd::identity();
  const auto given = finite_list(at.node, 4);
  if (!given) return;
  const std::span<const double, 4> v(*given);
  if (const auto rotation = rotation_from_wxyz(v)) {
    R = *rotation;
    doubt_quaternion(v, at.node.mark, at.name(), at.scope.faults);
    return;
  }
  const double length = std::hypot(std::hypot(v[0], v[1]), std::hypot(v[2], v[3]));
  at.scope.faults.add(
      at.node.mark, fmt::format("{} has length {:.9g}, must be 1 within 1e-6{}", at.name(), length,
                                length > 0 && std::isfinite(length)
                                    ? fmt::format("; normalised it is [{:.9g}, {:.9g}, {:.9g}, {:.9g}]", v[0] / length,
                                                  v[1] / length, v[2] / length, v[3] / length)
                                    : ""));
}
NumberWriter quaternion_writer(const NumberPlace& at) {
  if (!at.is_list(4)) return nullptr;
  return [](CaptureProblem&, void* place, Numbers v) {
    const auto R = v.size() == 4 ? rotation_from_wxyz(v.first<4>()) : std::nullopt;
    if (R) *static_cast<Rotationd*>(place) = *R;
    return R.has_value();
  };
}
Node quaternion_node(const Type&, const void* value) {
  const Quaterniond q = quaternion_from(*static_cast<const Rotationd*>(value));
  return numbers_node(std::vector<double>{q.w, q.x, q.y, q.z});
}

void read_rpy(const ValueToRead& at) {
  if (const auto v = finite_list(at.node, 3))
    at.into<Rotationd>() = rotation_from_rpy((*v)[0], (*v)[1], (*v)[2]);
  else
    at.into<Rotationd>() = Rotationd::identity();
}
NumberWriter rpy_writer(const NumberPlace& at) {
  if (!at.is_list(3)) return nullptr;
  return [field = at.field](CaptureProblem&, void* place, Numbers v) {
    if (v.size() != 3 || !allows(field, v)) return false;
    *static_cast<Rotationd*>(place) = rotation_from_rpy(v[0], v[1], v[2]);
    return true;
  };
}

// ---- Inertias: [Ixx, Iyy, Izz], with [Ixy, Ixz, Iyz], a matrix, or a mapping ----

constexpr const char* kComponents[] = {"xx", "yy", "zz", "xy", "xz", "yz"};

double* component(Symmetric3d& I, std::size_t i) {
  double* const all[] = {&I.xx, &I.yy, &I.zz, &I.xy, &I.xz, &I.yz};
  return all[i];
}

Json inertia_schema(const Field& field, const TypeReference&) {
  Json diagonal = numbers_schema(3, {}), all = numbers_schema(6, {});
  diagonal["title"] = "[Ixx, Iyy, Izz]", all["title"] = "[Ixx, Iyy, Izz, Ixy, Ixz, Iyz]";
  const Json matrix{{"type", "array"},
                    {"title", "a symmetric 3 x 3 matrix"},
                    {"items", numbers_schema(3, {})},
                    {"minItems", 3},
                    {"maxItems", 3}};
  Json components = Json::object();
  for (const char* key : kComponents) {
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

// The six components of a symmetric matrix; entries that differ by rounding are averaged.
std::vector<double> matrix_components(const Node& node, const std::string& name, FaultList& faults) {
  constexpr double kSymmetric = 1e-6;  // of the largest entry: tables have six digits
  std::vector<std::vector<double>> a;
  double largest = 0;
  for (const Node& row : node.items) {
    const auto values = finite_list(row, 3);
    if (!values) return {};
    for (const double value : *values) largest = std::max(largest, std::abs(value));
    a.push_back(*values);
  }
  if (a.size() != 3) return {};
  bool symmetric = true;
  for (const auto& [i, j] : {std::pair{0, 1}, std::pair{0, 2}, std::pair{1, 2}}) {
    if (std::abs(a[i][j] - a[j][i]) <= kSymmetric * largest) continue;
    symmetric = false;
    faults.add(node.items[j].items[i].mark, fmt::format("{} is not symmetric: [{}][{}] is {} and [{}][{}] is {}", name,
                                                        i, j, a[i][j], j, i, a[j][i]));
  }
  if (!symmetric) return {};
  return {a[0][0], a[1][1], a[2][2], (a[0][1] + a[1][0]) / 2, (a[0][2] + a[2][0]) / 2, (a[1][2] + a[2][1]) / 2};
}

void read_inertia(const ValueToRead& at) {
  std::vector<double> v;
  if (at.node.is_mapping()) {
    for (const char* key : kComponents) v.push_back(number_at(at.node, key).value_or(NAN));
  } else if (at.node.is_sequence() && !at.node.items.empty() && at.node.items[0].is_sequence()) {
    v = matrix_components(at.node, at.name(), at.scope.faults);
  } else {
    v = finite_list(at.node).value_or(std::vector<double>{});
    if (v.size() == 3) v.resize(6, 0.0);
  }
  Symmetric3d& inertia = at.into<Symmetric3d>();
  inertia = {1, 1, 1, 0, 0, 0};
  if (v.size() != 6 || !std::all_of(v.begin(), v.end(), [](double x) { return std::isfinite(x); })) return;
  const Symmetric3d given{v[0], v[1], v[2], v[3], v[4], v[5]};
  const std::string fault = inertia_fault(given);
  if (fault.empty())
    inertia = given;
  else
    at.scope.faults.add(at.node.mark, (at.path.empty() ? "" : at.path + ": ") + fault);
}

// The tensor as a list of 3 or 6, as a mapping, or one number of these.
NumberWriter inertia_writer(const NumberPlace& at) {
  std::vector<std::size_t> which;
  bool all_known = true;
  const auto add = [&](const std::string& name) {
    const auto* const found = std::find(std::begin(kComponents), std::end(kComponents), name);
    all_known = all_known && found != std::end(kComponents);
    which.push_back(static_cast<std::size_t>(found - std::begin(kComponents)));
  };
  if (at.is_list(3) || at.is_list(6)) {
    if (at.form.items[0].is_sequence()) return nullptr;  // a matrix
    for (std::size_t i = 0; i < at.form.items.size(); ++i) which.push_back(i);
  } else if (at.rest.empty()) {
    for (const NodeEntry& entry : at.form.entries) add(entry.key);
  } else if (at.rest.size() == 1 && at.form.is_scalar()) {
    if (!at.rest[0].is_index) add(at.rest[0].key);
    if (at.rest[0].is_index && at.rest[0].index < 6) which.push_back(at.rest[0].index);
  }
  if (which.empty() || !all_known) return nullptr;
  return [field = at.field, which](CaptureProblem&, void* place, Numbers numbers) {
    if (numbers.size() != which.size() || !allows(field, numbers)) return false;
    Symmetric3d& I = *static_cast<Symmetric3d*>(place);
    for (std::size_t i = 0; i < which.size(); ++i) *component(I, which[i]) = numbers[i];
    return inertia_fault(I).empty();
  };
}

Node inertia_node(const Type&, const void* value) {
  Symmetric3d I = *static_cast<const Symmetric3d*>(value);
  Node node;
  node.kind = Node::Kind::mapping;
  for (std::size_t i = 0; i < std::size(kComponents); ++i)
    node.entries.push_back({kComponents[i], {}, plain_number_node(*component(I, i))});
  return node;
}

// ---- Shapes ----

// The file of a mesh, with the scale 1; without its file there is no shape.
void read_mesh_file(const ValueToRead& at) {
  Geometry& geometry = *static_cast<Geometry*>(at.owner);
  if (geometry.shape != Geometry::Shape::mesh) return;
  const auto mesh = at.scope.meshes.find(at.node.text);
  if (is_text(at.node) && mesh != at.scope.meshes.end()) geometry.mesh = mesh->second;
  geometry.size = {1, 1, 1};
  if (!geometry.mesh) geometry.shape = Geometry::Shape::none;
}

// Scale along all axes of a mesh, or along each.
Json scale_schema(const Field& field, const TypeReference&) {
  return {{"anyOf",
           {titled(number_schema(field.range), "a number"),
            titled(numbers_schema(3, field.range), "a list of 3 numbers")}}};
}
void set_scale(double* size, double scale) { size[0] = size[1] = size[2] = scale; }
void read_scale(const ValueToRead& at) {
  auto* const size = static_cast<double*>(at.place);
  if (const auto scales = finite_list(at.node, 3)) std::copy(scales->begin(), scales->end(), size);
  if (const auto scale = number_of(at.node); scale && !std::isnan(*scale)) set_scale(size, *scale);
}
Node scale_node(const Type&, const void* value) {
  const auto* const size = static_cast<const double*>(value);
  return size[0] == size[1] && size[1] == size[2] ? plain_number_node(size[0]) : numbers_node({size, 3});
}
NumberWriter scale_writer(const NumberPlace& at) {
  return writer_of_one<double>(at, [](double& size, double scale) { return set_scale(&size, scale), true; });
}

// A robot keeps shapes and ratings in lists by name.
void read_shapes_by_name(const ValueToRead& at) {
  RobotSetup& robot = *at.scope.robot_setup;
  const bool of_base = at.owner == &robot;
  const std::string& name = of_base ? robot.base : static_cast<const BodyDescription*>(at.owner)->name;
  const auto read = [&](const Node& node, const std::string& path) {
    Geometry geometry;
    read_members(node, shapes_description().of(), path, &geometry, at.scope);
    if (geometry.shape != Geometry::Shape::none) robot.geometry.emplace_back(name, std::move(geometry));
  };
  if (at.node.is_mapping()) read(at.node, at.name());
  for (std::size_t i = 0; i < at.node.items.size() && !at.scope.faults.full(); ++i)
    read(at.node.items[i], item(at.name(), i));
}
void read_rating_by_name(const ValueToRead& at) {
  const std::string& joint = static_cast<const BodyDescription*>(at.owner)->joint.name;
  LoadRating& rating = at.scope.robot_setup->ratings.emplace_back(joint, LoadRating{}).second;
  read_members(at.node, at.field.type(), at.name(), &rating, at.scope);
}

const Form kBodyForms[] = {
    {.name = "quaternion",
     .schema = [](const Field&, const TypeReference&) { return numbers_schema(4, {}); },
     .read = read_quaternion,
     .numbers = quaternion_writer,
     .write = quaternion_node},
    {.name = "rpy",
     .schema = [](const Field&, const TypeReference&) { return numbers_schema(3, {}); },
     .read = read_rpy,
     .numbers = rpy_writer},
    {.name = "unit vector",
     .read = read_unit_vector,
     .numbers = [](const NumberPlace& at) { return components_writer(at, is_unit_vector); },
     .write = vector_node},
    {.name = "inertia",
     .schema = inertia_schema,
     .read = read_inertia,
     .numbers = inertia_writer,
     .write = inertia_node},
    {.name = "mesh file", .read = read_mesh_file},
    {.name = "scale", .schema = scale_schema, .read = read_scale, .numbers = scale_writer, .write = scale_node},
    {.name = "geometry of body", .read = read_shapes_by_name},
    {.name = "joint rating", .read = read_rating_by_name},
};

}  // namespace

std::span<const Form> body_forms() { return kBodyForms; }

std::optional<Rotationd> rotation_from_wxyz(std::span<const double, 4> q) {
  // hypot: the squares of valid input can overflow.
  const double length = std::hypot(std::hypot(q[0], q[1]), std::hypot(q[2], q[3]));
  if (!(std::abs(length - 1) <= 1e-6)) return {};
  return rotation_matrix(Quaterniond{q[0] / length, q[1] / length, q[2] / length, q[3] / length});
}

}  // namespace grapnel
