#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>

#include "grapnel/import/mjcf_model.hpp"

namespace grapnel {

// ---- Volume integrals of a mesh ----

namespace {

using Triangles = std::vector<std::array<int, 3>>;

// Whether every triangle's edge has exactly one neighbour with the same orientation.
bool is_closed(const Triangles& triangles) {
  std::vector<std::pair<int, int>> edges, reversed;
  for (const std::array<int, 3>& t : triangles) {
    for (int k = 0; k < 3; ++k) {
      edges.emplace_back(t[k], t[(k + 1) % 3]);
      reversed.emplace_back(t[(k + 1) % 3], t[k]);
    }
  }
  std::ranges::sort(edges), std::ranges::sort(reversed);
  return std::ranges::adjacent_find(edges) == edges.end() && edges == reversed;
}

// Six times the signed volume of the tetrahedron that a triangle makes with a point.
double six_volumes(const std::vector<Vector3d>& v, const std::array<int, 3>& t, const Vector3d& from) {
  return dot(v[t[0]] - from, cross(v[t[1]] - from, v[t[2]] - from));
}

Vector3d center_of_surface(const std::vector<Vector3d>& v, const Triangles& triangles) {
  double area = 0;
  Vector3d sum = Vector3d::zero();
  for (const std::array<int, 3>& t : triangles) {
    const double twice = norm(cross(v[t[1]] - v[t[0]], v[t[2]] - v[t[0]]));
    area += twice;
    sum += (twice / 3) * (v[t[0]] + v[t[1]] + v[t[2]]);
  }
  return (1 / area) * sum;
}

}  // namespace

// Tetrahedra from the surface's centre, with their signs. For one of a point at 0 and a, b, c with s = a + b + c and
// the determinant d: the volume is d/6, the integral of x is d/24 s, and that of x x^T is d/120 (s s^T + a a^T + b b^T
// + c c^T).
std::optional<MeshSolid> solid_within(const TriangleMesh& mesh, const Vector3d& scale) {
  if (!is_closed(mesh.triangles)) return std::nullopt;
  std::vector<Vector3d> v;
  v.reserve(mesh.vertices.size());
  for (const Vector3d& p : mesh.vertices) v.push_back({scale[0] * p[0], scale[1] * p[1], scale[2] * p[2]});
  const Vector3d center = center_of_surface(v, mesh.triangles);
  double volume = 0;
  Vector3d first = Vector3d::zero();
  std::array<double, 6> second{};  // xx, yy, zz, xy, xz, yz
  static constexpr std::array<std::pair<int, int>, 6> kComponents{{{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}}};
  for (const std::array<int, 3>& t : mesh.triangles) {
    const Vector3d a = v[t[0]] - center, b = v[t[1]] - center, c = v[t[2]] - center, s = a + b + c;
    const double d = dot(a, cross(b, c));
    volume += d / 6;
    first += (d / 24) * s;
    for (std::size_t k = 0; k < 6; ++k) {
      const auto& [i, j] = kComponents[k];
      second[k] += d / 120 * (s[i] * s[j] + a[i] * a[j] + b[i] * b[j] + c[i] * c[j]);
    }
  }
  if (!(std::abs(volume) > 0)) return std::nullopt;

  // All triangles may have their other side outside; so have those that a negative scale turns over.
  const double sign = volume > 0 ? 1 : -1;
  MeshSolid solid;
  solid.volume = std::abs(volume);
  const Vector3d com = (1 / volume) * first;
  solid.com = center + com;
  for (std::size_t k = 0; k < 6; ++k)
    second[k] = sign * second[k] - solid.volume * com[kComponents[k].first] * com[kComponents[k].second];
  solid.inertia = {
      second[1] + second[2], second[0] + second[2], second[0] + second[1], -second[3], -second[4], -second[5]};
  const auto is_seen_from_inside = [&](const std::array<int, 3>& t) {
    const double least = -1e-9 * solid.volume;
    return sign * six_volumes(v, t, center) >= least && sign * six_volumes(v, t, solid.com) >= least;
  };
  solid.is_star = std::ranges::all_of(mesh.triangles, is_seen_from_inside);
  return solid;
}

// ---- <mesh> ----

namespace {

// The end of a file's name after the dot, in lower case.
std::string extension_of(const std::string& file) {
  const std::size_t dot = file.rfind('.');
  std::string extension = dot == std::string::npos ? "" : file.substr(dot + 1);
  std::ranges::transform(extension, extension.begin(), [](unsigned char c) { return std::tolower(c); });
  return extension;
}

}  // namespace

MjcfMesh read_mjcf_mesh(const MjcfElement& element, MjcfContext& context) {
  context.passed_over.check_attributes(element, context.faults);
  const MjcfAttributes given = context.defaults.attributes(element, "mesh", "", context.faults);
  MjcfMesh mesh;
  mesh.element = &element;
  const std::filesystem::path said = given.text("file");
  mesh.name = given.text("name", said.stem().string().c_str());
  if (mesh.name.empty()) context.fault(element.mark(), "<mesh> has neither a name nor a file");
  const std::filesystem::path file = context.compiler.strip_paths ? said.filename() : said;
  mesh.file = (file.is_absolute() ? file : std::filesystem::path(context.compiler.meshdir) / file).string();
  mesh.scale = given.vector("scale", context.faults).value_or(Vector3d{1, 1, 1});
  // MuJoCo's vertices are scale * R^T (v - p) with refpos p and refquat R.
  const Vector3d p = given.vector("refpos", context.faults).value_or(Vector3d::zero());
  Rotationd R = Rotationd::identity();
  if (const auto quaternion = given.numbers("refquat", 4, context.faults))
    R = mjcf_rotation_of(*quaternion).value_or(Rotationd::identity());
  const Vector3d offset = transposed_times(R, p);
  mesh.X_GM = {transpose(R), {-mesh.scale[0] * offset[0], -mesh.scale[1] * offset[1], -mesh.scale[2] * offset[2]}};
  static constexpr std::array kInertia{"legacy", "exact", "convex", "shell"};
  const std::string inertia = given.word("inertia", kInertia, context.faults);
  mesh.is_exact = inertia == "exact";
  if (inertia == "convex" || inertia == "shell") mesh.other_inertia = inertia;
  const bool uniform = mesh.scale[0] == mesh.scale[1] && mesh.scale[1] == mesh.scale[2];
  const std::string extension = extension_of(mesh.file);
  if (said.empty()) {
    mesh.unusable = "its mesh has no file";
  } else if (extension != "stl" && extension != "obj") {
    mesh.unusable = "its mesh is neither .stl nor .obj";
  } else if (!uniform && rotation_angle(R) > 0) {
    mesh.unusable = "its mesh is rotated (refquat) and scaled differently along its axes";
  }
  return mesh;
}

}  // namespace grapnel
