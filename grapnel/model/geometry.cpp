#include "grapnel/model/geometry.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <unordered_map>

namespace grapnel {

// Vertices [m] and triangles => mesh with its convex hull. Throws std::invalid_argument with the name if there is no
// triangle, an index is invalid or the vertices have no volume.
std::shared_ptr<const TriangleMesh> make_triangle_mesh(std::string name, std::vector<Vector3d> vertices,
                                                       std::vector<std::array<int, 3>> triangles) {
  const auto refuse = [&](const std::string& why) {
    throw std::invalid_argument(fmt::format("mesh '{}': {}", name, why));
  };
  if (triangles.empty()) refuse("there is no triangle");
  for (const auto& triangle : triangles) {
    for (const int v : triangle) {
      if (v < 0 || v >= static_cast<int>(vertices.size())) refuse(fmt::format("there is no vertex {}", v));
    }
  }
  ConvexHull hull = convex_hull(vertices);
  if (hull.is_empty()) refuse("its vertices are not finite or all in one plane");
  return std::make_shared<const TriangleMesh>(
      TriangleMesh{std::move(name), std::move(vertices), std::move(triangles), std::move(hull)});
}

namespace {

__extension__ using Wide = __int128;  // differences of 41 bits: their triple product needs 125

// A grid point, components within +-kGrid.
constexpr double kGrid = 0x1p39;
constexpr double kThinnest = 1e-9;  // of kGrid: minimum extent of a body
struct Place {
  std::int64_t x, y, z;
};
Place operator-(const Place& a, const Place& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }

struct Normal {
  Wide x, y, z;
};
Normal cross(const Place& a, const Place& b) {
  return {Wide{a.y} * b.z - Wide{a.z} * b.y, Wide{a.z} * b.x - Wide{a.x} * b.z, Wide{a.x} * b.y - Wide{a.y} * b.x};
}
Wide dot(const Normal& n, const Place& p) { return n.x * p.x + n.y * p.y + n.z * p.z; }
Vector3d to_vector(const Normal& n) {
  return {static_cast<double>(n.x), static_cast<double>(n.y), static_cast<double>(n.z)};
}

struct Face {
  std::array<int, 3> vertex;    // counter-clockwise seen from outside
  std::array<int, 3> neighbor;  // across the edge from vertex k to k + 1
  Normal normal;
  std::vector<int> above;  // points outside of this face; each point is in the list of one face
  bool alive = true;
};

class Quickhull {
 public:
  explicit Quickhull(std::vector<Place> places) : at_(std::move(places)) {}

  // False: all points are coplanar.
  bool build() {
    if (!first_tetrahedron()) return false;
    while (!open_.empty()) {
      const int face = open_.back();
      open_.pop_back();
      if (faces_[face].alive && !faces_[face].above.empty()) add_farthest(face);
    }
    return true;
  }
  const std::vector<Face>& faces() const { return faces_; }

 private:
  // Positive: the point is outside of the face.
  Wide height(const Face& face, int point) const { return dot(face.normal, at_[point] - at_[face.vertex[0]]); }

  Face face_of(int a, int b, int c) const {
    return {{a, b, c}, {-1, -1, -1}, cross(at_[b] - at_[a], at_[c] - at_[a]), {}, true};
  }

  // Points => first four faces, outward, with the other points assigned to them; false if all points are coplanar.
  // Takes an extreme point and then the farthest from point, line and plane.
  bool first_tetrahedron() {
    const int count = static_cast<int>(at_.size());
    const auto farthest = [&](auto measure) {
      int best = 0;
      for (int i = 1; i < count; ++i) {
        if (measure(i) > measure(best)) best = i;
      }
      return best;
    };
    const int a = farthest([&](int i) { return at_[i].x; });
    const auto square = [](const Normal& n) {
      const Vector3d v = to_vector(n);
      return v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
    };
    const auto distance = [&](int i) {
      const Place d = at_[i] - at_[a];
      return Wide{d.x} * d.x + Wide{d.y} * d.y + Wide{d.z} * d.z;
    };
    const int b = farthest(distance);
    const int c = farthest([&](int i) { return square(cross(at_[b] - at_[a], at_[i] - at_[a])); });
    Face base = face_of(a, b, c);
    const int d = farthest([&](int i) {
      const Wide h = height(base, i);
      return h < 0 ? -h : h;
    });
    const Wide side = height(base, d);
    if (!(std::abs(static_cast<double>(side)) > kThinnest * kGrid * norm(to_vector(base.normal)))) return false;
    // The fourth point is on the inner side of the first face.
    faces_ = side < 0 ? std::vector{face_of(a, b, c), face_of(a, d, b), face_of(b, d, c), face_of(c, d, a)}
                      : std::vector{face_of(a, c, b), face_of(a, b, d), face_of(b, c, d), face_of(c, a, d)};
    link_all();
    std::vector<int> points(at_.size());
    for (int i = 0; i < count; ++i) points[i] = i;
    distribute(points, 0);
    return true;
  }

  // Neighbours of the first four faces.
  void link_all() {
    for (int f = 0; f < 4; ++f) {
      for (int k = 0; k < 3; ++k) {
        const int from = faces_[f].vertex[k], to = faces_[f].vertex[(k + 1) % 3];
        for (int g = 0; g < 4; ++g) {
          for (int m = 0; m < 3; ++m) {
            if (faces_[g].vertex[m] == to && faces_[g].vertex[(m + 1) % 3] == from) faces_[f].neighbor[k] = g;
          }
        }
      }
    }
  }

  // Assigns points to faces that they are outside of, among those from `first` on; points inside of all faces are
  // dropped.
  void distribute(const std::vector<int>& points, std::size_t first) {
    for (const int p : points) {
      for (std::size_t f = first; f < faces_.size(); ++f) {
        if (height(faces_[f], p) > 0) {
          faces_[f].above.push_back(p);
          break;
        }
      }
    }
    for (std::size_t f = first; f < faces_.size(); ++f) {
      if (!faces_[f].above.empty()) open_.push_back(static_cast<int>(f));
    }
  }

  // Replaces all faces visible from the face's farthest point by a fan from that point to the horizon.
  void add_farthest(int seed) {
    const std::vector<int>& above = faces_[seed].above;
    const int p = *std::max_element(above.begin(), above.end(),
                                    [&](int i, int j) { return height(faces_[seed], i) < height(faces_[seed], j); });
    // Edges of the horizon, from the vertex `first`, and the face beyond.
    struct Edge {
      int second, beyond;
    };
    std::unordered_map<int, Edge> horizon;
    std::vector<int> seen{seed}, orphans;
    faces_[seed].alive = false;
    for (std::size_t i = 0; i < seen.size(); ++i) {
      Face& face = faces_[seen[i]];
      orphans.insert(orphans.end(), face.above.begin(), face.above.end());
      face.above = {};
      for (int k = 0; k < 3; ++k) {
        const int next = face.neighbor[k];
        if (!faces_[next].alive) continue;
        if (height(faces_[next], p) > 0) {
          faces_[next].alive = false;
          seen.push_back(next);
        } else {
          horizon[face.vertex[k]] = {face.vertex[(k + 1) % 3], next};
        }
      }
    }
    // Visibility of a face does not depend on the search order, so the horizon is one closed line.
    const std::size_t fan = faces_.size();
    const int start = horizon.begin()->first;
    for (int first = start;;) {
      const Edge edge = horizon.at(first);
      Face face = face_of(first, edge.second, p);
      const int here = static_cast<int>(faces_.size());
      face.neighbor = {edge.beyond, here + 1, here - 1};
      Face& beyond = faces_[edge.beyond];
      for (int k = 0; k < 3; ++k) {
        if (beyond.vertex[k] == edge.second && beyond.vertex[(k + 1) % 3] == first) beyond.neighbor[k] = here;
      }
      faces_.push_back(std::move(face));
      first = edge.second;
      if (first == start) break;
    }
    faces_.back().neighbor[1] = static_cast<int>(fan);
    faces_[fan].neighbor[2] = static_cast<int>(faces_.size()) - 1;
    std::erase(orphans, p);
    distribute(orphans, fan);
  }

  std::vector<Place> at_;
  std::vector<Face> faces_;
  std::vector<int> open_;  // faces with points outside
};

// Groups triangles by planes: those whose normals agree with that of a larger neighbour. Returns the plane of each
// face.
std::vector<int> planes_of(const std::vector<Face>& faces, const std::vector<int>& alive,
                           std::vector<Vector3d>& normals) {
  constexpr double kAngle = 1e-8;
  std::vector<int> plane(faces.size(), -1), by_area = alive;
  std::vector<Vector3d> unit(faces.size());
  std::vector<double> area(faces.size());
  for (const int f : alive) {
    const Vector3d n = to_vector(faces[f].normal);
    area[f] = norm(n);
    unit[f] = (1 / area[f]) * n;
  }
  std::stable_sort(by_area.begin(), by_area.end(), [&](int a, int b) { return area[a] > area[b]; });
  std::vector<int> stack;
  for (const int seed : by_area) {
    if (plane[seed] >= 0) continue;
    const int id = static_cast<int>(normals.size());
    normals.push_back(unit[seed]);
    plane[seed] = id;
    stack.assign(1, seed);
    while (!stack.empty()) {
      const int f = stack.back();
      stack.pop_back();
      for (const int g : faces[f].neighbor) {
        if (plane[g] >= 0 || norm(unit[g] - unit[seed]) > kAngle) continue;
        plane[g] = id;
        stack.push_back(g);
      }
    }
  }
  return plane;
}

// Directions of the edges between planes; none if there are too many.
std::vector<Vector3d> edge_directions(const std::vector<Face>& faces, const std::vector<int>& alive,
                                      const std::vector<int>& plane, std::span<const Vector3d> at) {
  constexpr double kParallel = 1e-8;
  std::vector<Vector3d> directions;
  for (const int f : alive) {
    for (int k = 0; k < 3; ++k) {
      const int a = faces[f].vertex[k], b = faces[f].vertex[(k + 1) % 3];
      if (a > b || plane[f] == plane[faces[f].neighbor[k]]) continue;
      Vector3d d = at[b] - at[a];
      const double length = norm(d);
      if (!(length > 0)) continue;
      d *= 1 / length;
      const bool known = std::any_of(directions.begin(), directions.end(), [&](const Vector3d& e) {
        return norm(d - e) < kParallel || norm(d + e) < kParallel;
      });
      if (known) continue;
      if (directions.size() == ConvexHull::kMostEdges) return {};
      directions.push_back(d);
    }
  }
  return directions;
}

}  // namespace

// Points => vertices, face normals, offsets and edge directions of their hull; empty if they are not finite, coplanar
// or too small or large. Quickhull on an integer grid of the extent, so that orientations are exact.
ConvexHull convex_hull(std::span<const Vector3d> points) {
  ConvexHull hull;
  if (points.size() < 4) return hull;
  Vector3d lower = points[0], upper = points[0];
  for (const Vector3d& p : points) {
    for (int k = 0; k < 3; ++k) {
      if (!std::isfinite(p[k])) return hull;
      lower[k] = std::min(lower[k], p[k]), upper[k] = std::max(upper[k], p[k]);
    }
  }
  const Vector3d center = 0.5 * lower + 0.5 * upper, half = 0.5 * upper - 0.5 * lower;
  const double extent = std::max({half[0], half[1], half[2]});
  // Squares of lengths must not overflow or underflow.
  if (!(extent > 1e-100 && extent < 1e100)) return hull;

  std::vector<Place> places;
  for (const Vector3d& p : points) {
    const Vector3d g = (kGrid / extent) * (p - center);
    places.push_back({std::llround(g[0]), std::llround(g[1]), std::llround(g[2])});
  }
  Quickhull quickhull(places);
  if (!quickhull.build()) return hull;
  const std::vector<Face>& faces = quickhull.faces();

  std::vector<int> alive;
  std::vector<bool> taken(points.size(), false);
  for (int f = 0; f < static_cast<int>(faces.size()); ++f) {
    if (!faces[f].alive) continue;
    alive.push_back(f);
    for (const int v : faces[f].vertex) {
      if (taken[v]) continue;
      taken[v] = true;
      hull.vertices.push_back(points[v]);
    }
  }
  const std::vector<int> plane = planes_of(faces, alive, hull.normals);
  hull.edges = edge_directions(faces, alive, plane, points);
  hull.center = center, hull.half = half;
  hull.offsets.assign(hull.normals.size(), -std::numeric_limits<double>::infinity());
  for (const int f : alive) {
    double& offset = hull.offsets[plane[f]];
    for (const int v : faces[f].vertex) offset = std::max(offset, dot(hull.normals[plane[f]], points[v] - center));
  }
  return hull;
}

}  // namespace grapnel
