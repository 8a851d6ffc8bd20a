#include "grapnel/import/assembly_steps.hpp"

#include <algorithm>
#include <cmath>

#include "grapnel/text/yaml_values.hpp"

namespace grapnel {

Node vector_node_of(const Vector3d& v, const Mark& mark) {
  const double values[] = {v[0] + 0.0, v[1] + 0.0, v[2] + 0.0};
  return list_node(values, mark);
}

namespace {
bool is_unturned(const Rotationd& R) {
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      if (R(i, j) != (i == j ? 1.0 : 0.0)) return false;
    }
  }
  return true;
}
// Half turns about z or nearly so: as a quaternion they would raise the doubt that its numbers are in the order
// x, y, z, w.
bool is_half_turn_about_z(const Quaterniond& q) { return std::abs(q.z) > 0.9 && std::abs(q.w) < 0.3; }
// Of a rotation whose pitch is far from a quarter turn.
Vector3d rpy_of(const Rotationd& R) {
  return {std::atan2(R(2, 1), R(2, 2)), -std::asin(std::clamp(R(2, 0), -1.0, 1.0)), std::atan2(R(1, 0), R(0, 0))};
}
bool is_origin(const Vector3d& p) { return p[0] == 0 && p[1] == 0 && p[2] == 0; }
}  // namespace

bool is_identity(const Posed& X) { return is_unturned(X.R) && is_origin(X.p); }

void put_pose(Node& mapping, const Posed& X, const Mark& mark) {
  std::erase_if(mapping.entries,
                [](const NodeEntry& e) { return e.key == "position" || e.key == "quaternion_wxyz" || e.key == "rpy"; });
  if (!is_origin(X.p)) put(mapping, "position", vector_node_of(X.p, mark));
  if (is_unturned(X.R)) return;
  const Quaterniond q = quaternion_from(X.R);
  if (is_half_turn_about_z(q)) {
    put(mapping, "rpy", vector_node_of(rpy_of(X.R), mark));
    return;
  }
  const double values[] = {q.w + 0.0, q.x + 0.0, q.y + 0.0, q.z + 0.0};
  put(mapping, "quaternion_wxyz", list_node(values, mark));
}
Node pose_node(const Posed& X, const Mark& mark) {
  Node node = mapping_node(mark);
  put_pose(node, X, mark);
  return node;
}

Posed pose_in(const Node& mapping) {
  Posed X = Posed::identity();
  const auto numbers = [&](const char* key, std::size_t count) {
    const Node* node = mapping.find(key);
    const auto values = node ? numbers_in(*node) : std::nullopt;
    return values && values->size() == count ? *values : std::vector<double>();
  };
  if (const auto p = numbers("position", 3); !p.empty()) X.p = {p[0], p[1], p[2]};
  if (const auto a = numbers("rpy", 3); !a.empty()) X.R = rotation_from_rpy(a[0], a[1], a[2]);
  if (const auto q = numbers("quaternion_wxyz", 4); !q.empty()) {
    const double length = std::hypot(std::hypot(q[0], q[1]), std::hypot(q[2], q[3]));
    if (length > 0) X.R = rotation_matrix(Quaterniond{q[0] / length, q[1] / length, q[2] / length, q[3] / length});
  }
  return X;
}

Node shape_node(const Geometry& shape, const Posed& X_BL, const std::string& file, const Mark& mark) {
  Node node = mapping_node(mark);
  const Vector3d& s = shape.size;
  const auto put_shape = [&](const char* name) { put(node, "shape", text_node(name, mark)); };
  const auto put_number = [&](const char* key, double value) { put(node, key, number_node(value, mark)); };
  switch (shape.shape) {
    case Geometry::Shape::box:
      put_shape("box");
      put(node, "size", vector_node_of(s, mark));
      break;
    case Geometry::Shape::cylinder:
    case Geometry::Shape::capsule:
      put_shape(shape.shape == Geometry::Shape::cylinder ? "cylinder" : "capsule");
      put_number("radius", s[0]);
      put_number("length", s[1]);
      break;
    case Geometry::Shape::sphere:
      put_shape("sphere");
      put_number("radius", s[0]);
      break;
    case Geometry::Shape::mesh:
      put_shape("mesh");
      put(node, "file", text_node(file, mark));
      if (s[0] != s[1] || s[1] != s[2])
        put(node, "scale", vector_node_of(s, mark));
      else if (s[0] != 1)
        put_number("scale", s[0]);
      break;
    case Geometry::Shape::none:
      break;
  }
  put_pose(node, X_BL * shape.X_BG, mark);
  return node;
}

}  // namespace grapnel
