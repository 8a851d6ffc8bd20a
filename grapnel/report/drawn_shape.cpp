#include "grapnel/report/drawn_shape.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <stdexcept>

#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kRodRadius = 0.035;   // of a rod's length
constexpr double kShortestRod = 1e-6;  // [m]
constexpr double kPointMass = 0.05;    // [m] radius of a point mass
constexpr double kThinnest = 0.02;     // minimum thickness relative to the longest edge, for visibility

// A capsule from a to b in the body's frame.
SceneShape rod(const Vector3d& a, const Vector3d& b) {
  const Vector3d difference = b - a;
  const double length = norm(difference);
  SceneShape shape;
  shape.shape = "capsule";
  shape.size = {kRodRadius * length, length, 0};
  shape.X_BG = {rotation_between(Vector3d::unit(2), (1 / length) * difference), 0.5 * (a + b)};
  return shape;
}

std::vector<SceneShape> rods_of(const Scene& scene, const SceneBody& body) {
  std::vector<SceneShape> rods;
  const auto lead_to = [&](const Vector3d& p) {
    if (norm(p) > kShortestRod) rods.push_back(rod(Vector3d::zero(), p));
  };
  for (const SceneBody& other : scene.bodies) {
    if (other.kind == "link" && other.parent == body.name && other.joint) lead_to(other.joint->X_PF.p);
  }
  for (const SceneFrame& end_effector : scene.end_effectors) {
    if (end_effector.body == body.name) lead_to(end_effector.X_BE.p);
  }
  return rods;
}

class MeshBuilder {
 public:
  explicit MeshBuilder(const Posed& X_BG) : X_(X_BG) {}
  int add(const Vector3d& point, const Vector3d& normal) {
    mesh_.points.push_back(X_ * point);
    mesh_.normals.push_back(X_.R * normal);
    return static_cast<int>(mesh_.points.size()) - 1;
  }
  void triangle(int a, int b, int c) { mesh_.triangles.push_back({a, b, c}); }
  void quad(int a, int b, int c, int d) { triangle(a, b, c), triangle(a, c, d); }
  DrawnMesh take() { return std::move(mesh_); }

 private:
  Posed X_;
  DrawnMesh mesh_;
};

void add_box(MeshBuilder& out, const Vector3d& edges) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-1.0, 1.0}) {
      const Vector3d n = side * Vector3d::unit(axis);
      const Vector3d u = Vector3d::unit((axis + 1) % 3), v = cross(n, u);
      const auto corner = [&](double a, double b) {
        const Vector3d p = n + a * u + b * v;
        return out.add({0.5 * edges[0] * p[0], 0.5 * edges[1] * p[1], 0.5 * edges[2] * p[2]}, n);
      };
      const int a = corner(-1, -1), b = corner(1, -1), c = corner(1, 1), d = corner(-1, 1);
      out.quad(a, b, c, d);
    }
  }
}

// A surface of revolution about z: rings of (radius, z, normal's radial and z part), joined in turn.
struct Ring {
  double radius, z, normal_out, normal_up;
};

void add_rings(MeshBuilder& out, const std::vector<Ring>& rings, int facets) {
  std::vector<int> before, now;
  for (std::size_t r = 0; r < rings.size(); ++r) {
    now.clear();
    for (int k = 0; k <= facets; ++k) {
      const double angle = 2 * kPi * (k % facets) / facets, c = std::cos(angle), s = std::sin(angle);
      const Ring& ring = rings[r];
      now.push_back(out.add({ring.radius * c, ring.radius * s, ring.z},
                            {ring.normal_out * c, ring.normal_out * s, ring.normal_up}));
    }
    for (std::size_t k = 0; r > 0 && k < static_cast<std::size_t>(facets); ++k) {
      if (rings[r - 1].radius > 0) out.triangle(before[k], before[k + 1], now[k + 1]);
      if (rings[r].radius > 0) out.triangle(before[k], now[k + 1], now[k]);
    }
    before = now;
  }
}

void add_cylinder(MeshBuilder& out, double radius, double length, int facets) {
  const double h = length / 2;
  add_rings(out, {{0, -h, 0, -1}, {radius, -h, 0, -1}}, facets);
  add_rings(out, {{radius, -h, 1, 0}, {radius, h, 1, 0}}, facets);
  add_rings(out, {{radius, h, 0, 1}, {0, h, 0, 1}}, facets);
}

// A sphere, or a capsule whose halves are `length` apart.
void add_capsule(MeshBuilder& out, double radius, double length, int facets) {
  std::vector<Ring> rings;
  const int half = std::max(facets / 4, 2);
  for (int k = 0; k <= 2 * half; ++k) {
    const double latitude = kPi / 2 * (k - half) / half;
    const bool pole = k == 0 || k == 2 * half;
    const double c = pole ? 0 : std::cos(latitude), s = k == 0 ? -1 : pole ? 1 : std::sin(latitude);
    if (k == half && length > 0) rings.push_back({radius, -length / 2, 1, 0});
    rings.push_back({radius * c, radius * s + (k < half ? -length / 2 : length / 2), c, s});
  }
  add_rings(out, rings, facets);
}

Vector3d scaled(const Vector3d& p, const Vector3d& s) { return {p[0] * s[0], p[1] * s[1], p[2] * s[2]}; }

void add_mesh(MeshBuilder& out, const SceneMesh& mesh, const Vector3d& scales) {
  const bool mirrored = scales[0] * scales[1] * scales[2] < 0;
  const auto point = [&](int index) {
    const std::size_t at = 3 * static_cast<std::size_t>(index);
    return scaled({mesh.vertices[at], mesh.vertices[at + 1], mesh.vertices[at + 2]}, scales);
  };
  for (std::size_t t = 0; t + 2 < mesh.triangles.size(); t += 3) {
    const Vector3d a = point(mesh.triangles[t]);
    Vector3d b = point(mesh.triangles[t + 1]), c = point(mesh.triangles[t + 2]);
    if (mirrored) std::swap(b, c);
    const Vector3d n = cross(b - a, c - a);
    const double length = norm(n);
    if (!(length > 0)) continue;  // without area
    const Vector3d unit = (1 / length) * n;
    const int first = out.add(a, unit);
    out.add(b, unit), out.add(c, unit);
    out.triangle(first, first + 1, first + 2);
  }
}

}  // namespace

SceneShape box_of_inertia(const SceneBody& body) {
  SceneShape shape;
  shape.X_BG = {Rotationd::identity(), body.com};
  const Symmetric3d& I = body.inertia;
  Eigen::Matrix3d matrix;
  matrix << I.xx, I.xy, I.xz, I.xy, I.yy, I.yz, I.xz, I.yz, I.zz;
  const bool diagonal = I.xy == 0 && I.xz == 0 && I.yz == 0;
  Eigen::Vector3d principal(I.xx, I.yy, I.zz);
  if (!diagonal) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(matrix);
    Eigen::Matrix3d axes = solver.eigenvectors();
    if (axes.determinant() < 0) axes.col(2) = -axes.col(2);
    principal = solver.eigenvalues();
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) shape.X_BG.R(i, j) = axes(i, j);
    }
  }
  if (!(body.mass > 0) || !(principal.maxCoeff() > 0)) {
    shape.shape = "sphere";
    shape.size = {kPointMass, 0, 0};
    return shape;
  }
  // I_x = m (b^2 + c^2) / 12, so that a^2 = 6 (I_y + I_z - I_x) / m.
  shape.shape = "box";
  double longest = 0;
  for (int k = 0; k < 3; ++k) {
    shape.size[k] = std::sqrt(std::max(6 * (principal.sum() - 2 * principal[k]) / body.mass, 0.0));
    longest = std::max(longest, shape.size[k]);
  }
  for (int k = 0; k < 3; ++k) shape.size[k] = std::max(shape.size[k], kThinnest * longest);
  return shape;
}

std::vector<SceneShape> drawn_shapes(const Scene& scene, std::size_t body) {
  const SceneBody& it = scene.bodies[body];
  if (!it.shapes.empty()) return it.shapes;
  if (it.kind == "link") {
    std::vector<SceneShape> rods = rods_of(scene, it);
    if (!rods.empty()) return rods;
  }
  return {box_of_inertia(it)};
}

MotionExtent motion_extent(const RunSource& run) {
  const Scene& scene = *run.scene;
  Vector3d low = std::numeric_limits<double>::infinity() * Vector3d{1, 1, 1}, high = -1.0 * low;
  double reach = 0;  // of a body's points from its frame's origin
  for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
    const RecordedPose pose(run.series, scene.bodies[b].series);
    for (std::size_t i = 0; i < run.series.time.size(); ++i) {
      const Vector3d p = pose.position(i);
      for (int k = 0; k < 3; ++k) low[k] = std::min(low[k], p[k]), high[k] = std::max(high[k], p[k]);
    }
    for (const SceneShape& shape : drawn_shapes(scene, b)) {
      for (const Vector3d& p : triangles_of(scene, shape, 8).points) reach = std::max(reach, norm(p));
    }
  }
  return {0.5 * (low + high), 0.5 * norm(high - low) + reach};
}

std::vector<SceneShape> drawn_shapes(const SceneObstacle& obstacle, const MotionExtent& extent) {
  if (!obstacle.half_space) return obstacle.shapes;
  constexpr double kThickness = 0.01;  // relative to the radius
  const double radius = extent.radius > 0 ? extent.radius : 1, thickness = kThickness * radius;
  const Vector3d centre = inverse(obstacle.X_WO) * extent.centre;
  SceneShape plate;
  plate.shape = "box", plate.size = {2 * radius, 2 * radius, thickness};
  plate.X_BG.p = {centre[0], centre[1], -0.5 * thickness};
  return {plate};
}

DrawnMesh triangles_of(const Scene& scene, const SceneShape& shape, int facets) {
  MeshBuilder out(shape.X_BG);
  if (shape.shape == "box") {
    add_box(out, shape.size);
  } else if (shape.shape == "cylinder") {
    add_cylinder(out, shape.size[0], shape.size[1], facets);
  } else if (shape.shape == "capsule") {
    add_capsule(out, shape.size[0], shape.size[1], facets);
  } else if (shape.shape == "sphere") {
    add_capsule(out, shape.size[0], 0, facets);
  } else if (shape.shape == "mesh" && shape.mesh >= 0 && static_cast<std::size_t>(shape.mesh) < scene.meshes.size()) {
    add_mesh(out, scene.meshes[static_cast<std::size_t>(shape.mesh)], shape.size);
  } else {
    throw std::runtime_error("a body's shape '" + shape.shape + "' cannot be drawn");
  }
  return out.take();
}

View view_along(const std::string& name) {
  const Vector3d x = Vector3d::unit(0), y = Vector3d::unit(1), z = Vector3d::unit(2);
  if (name == "x") return {y, z, x, "y", "z"};
  if (name == "y") return {x, z, -y, "x", "z"};
  if (name == "z") return {x, y, z, "x", "y"};
  if (name == "iso") {
    const double a = std::sqrt(0.5), b = std::sqrt(1.0 / 6), c = std::sqrt(1.0 / 3);
    return {{-a, a, 0}, {-b, -b, 2 * b}, {c, c, c}, "", ""};
  }
  throw std::invalid_argument("a view is x, y, z or iso, not '" + name + "'");
}

std::vector<Point2> convex_hull(std::vector<Point2> points) {
  std::sort(points.begin(), points.end());
  points.erase(std::unique(points.begin(), points.end()), points.end());
  if (points.size() < 3) return points;
  const auto turn = [](const Point2& o, const Point2& a, const Point2& b) {
    return (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0]);
  };
  // Corners at the level of rounding error are removed: an edge-on circle is a line.
  double largest = 0;
  for (const Point2& p : points)
    largest = std::max({largest, std::abs(p[0] - points[0][0]), std::abs(p[1] - points[0][1])});
  const double flat = 1e-10 * largest * largest;
  std::vector<Point2> hull;  // the lower chain, then the upper one
  const auto add = [&](const Point2& p, std::size_t least) {
    while (hull.size() >= least + 2 && turn(hull[hull.size() - 2], hull.back(), p) <= flat) hull.pop_back();
    hull.push_back(p);
  };
  for (const Point2& p : points) add(p, 0);
  const std::size_t lower = hull.size() - 1;
  for (auto p = points.rbegin() + 1; p != points.rend(); ++p) add(*p, lower);
  hull.pop_back();
  return hull;
}

Silhouette::Silhouette(const Scene& scene, const SceneShape& shape) : centre_(shape.X_BG.p) {
  if (shape.shape == "sphere") {
    radius_ = shape.size[0];
    return;
  }
  points_ = triangles_of(scene, shape, 16).points;
  if (shape.shape == "mesh") *this = Silhouette(std::move(points_));
}

Silhouette::Silhouette(std::vector<Vector3d> points) : points_(std::move(points)), centre_(Vector3d::zero()) {
  for (const Vector3d& p : points_) centre_ += (1 / static_cast<double>(points_.size())) * p;
}

namespace {

// The parts of a mesh that share no point: points per part.
std::vector<std::vector<Vector3d>> connected_parts(const DrawnMesh& mesh) {
  std::vector<std::size_t> parent(mesh.points.size());
  std::iota(parent.begin(), parent.end(), std::size_t{0});
  const auto root = [&](std::size_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  std::map<std::array<double, 3>, std::size_t> by_place;  // triangles meet at equal points
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    const auto [found, is_new] = by_place.try_emplace({mesh.points[i][0], mesh.points[i][1], mesh.points[i][2]}, i);
    if (!is_new) parent[root(i)] = root(found->second);
  }
  for (const std::array<int, 3>& triangle : mesh.triangles) {
    for (const int other : {triangle[1], triangle[2]})
      parent[root(static_cast<std::size_t>(other))] = root(static_cast<std::size_t>(triangle[0]));
  }
  std::map<std::size_t, std::vector<Vector3d>> parts;
  for (std::size_t i = 0; i < mesh.points.size(); ++i) parts[root(i)].push_back(mesh.points[i]);
  std::vector<std::vector<Vector3d>> list;
  for (auto& [first, points] : parts) list.push_back(std::move(points));
  return list;
}

}  // namespace

std::vector<Silhouette> silhouettes_of(const Scene& scene, const SceneShape& shape) {
  constexpr std::size_t kMostParts = 256;
  std::vector<Silhouette> silhouettes;
  if (shape.shape == "mesh") {
    std::vector<std::vector<Vector3d>> parts = connected_parts(triangles_of(scene, shape));
    if (parts.size() <= kMostParts) {
      for (std::vector<Vector3d>& points : parts) silhouettes.push_back(Silhouette(std::move(points)));
    }
  }
  if (silhouettes.empty()) silhouettes.emplace_back(scene, shape);
  return silhouettes;
}

std::vector<Point2> Silhouette::operator()(const Posed& X_WB, const View& view) const {
  std::vector<Point2> seen;
  if (points_.empty()) {
    constexpr int kCorners = 36;
    const Point2 centre = view(X_WB * centre_);
    for (int k = 0; k < kCorners; ++k) {
      const double angle = 2 * 3.14159265358979323846 * k / kCorners;
      seen.push_back({centre[0] + radius_ * std::cos(angle), centre[1] + radius_ * std::sin(angle)});
    }
    return seen;
  }
  for (const Vector3d& p : points_) seen.push_back(view(X_WB * p));
  return convex_hull(std::move(seen));
}

}  // namespace grapnel
