// Meshes in clearance: their convex hulls, against boxes of the same form and against brute force.
#include <gtest/gtest.h>

#include <limits>

#include "contact/random_shape.hpp"
#include "contact/small_models.hpp"
#include "grapnel/contact/clearance_model.hpp"

namespace grapnel::testing {
namespace mesh_distance_test {

using Points = std::vector<Vector3d>;
using Triangles = std::vector<std::array<int, 3>>;

Geometry mesh_of(Points vertices, Triangles triangles, const Vector3d& scale = {1, 1, 1}) {
  return {Shape::mesh, scale, Posed::identity(), make_triangle_mesh("test", std::move(vertices), std::move(triangles))};
}

// A box with the given edges about `center`, as a mesh file.
Geometry box_mesh(const Vector3d& size, const Vector3d& center) {
  Points corners;
  for (int i = 0; i < 8; ++i) {
    const double x = i & 1 ? 0.5 : -0.5, y = i & 2 ? 0.5 : -0.5, z = i & 4 ? 0.5 : -0.5;
    corners.push_back(center + Vector3d{x * size[0], y * size[1], z * size[2]});
  }
  return mesh_of(corners, {{0, 2, 1},
                           {1, 2, 3},
                           {4, 5, 6},
                           {5, 7, 6},
                           {0, 1, 4},
                           {1, 5, 4},
                           {2, 6, 3},
                           {3, 6, 7},
                           {0, 4, 2},
                           {2, 4, 6},
                           {1, 3, 5},
                           {3, 7, 5}});
}

Posed random_pose(Random& random, double far) {
  Vector3d axis{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
  axis *= 1 / norm(axis);
  return {rotation_about(axis, random.uniform(-3, 3)),
          {random.uniform(-far, far), random.uniform(-far, far), random.uniform(-far, far)}};
}

void expect_consistent(const ShapeDistance& d) {
  EXPECT_NEAR(norm(d.normal), 1, 1e-12);
  EXPECT_LT(norm(d.point_b - d.point_a - d.distance * d.normal), 1e-12);
}

// A box-shaped mesh has the distances of the box.
TEST(MeshDistance, BoxMeshEqualsBox) {
  Random random(3);
  double apart = 0, overlapping = 0;
  int overlaps = 0;
  for (int i = 0; i < 4000; ++i) {
    const Vector3d center{random.uniform(-2, 2), random.uniform(-2, 2), random.uniform(-2, 2)};
    Geometry box = random_shape(Shape::box, 0.1, 2, random);
    Geometry mesh = box_mesh(box.size, center);
    const Posed X = random_pose(random, 1);
    box.X_BG = X;
    mesh.X_BG = {X.R, X.p - X.R * center};
    if (i % 2 == 1) {  // the file in other units along each axis
      const Vector3d s{0.001, 0.01, 2};
      Geometry other = box_mesh({box.size[0] / s[0], box.size[1] / s[1], box.size[2] / s[2]},
                                {center[0] / s[0], center[1] / s[1], center[2] / s[2]});
      mesh.mesh = other.mesh, mesh.size = s;
    }
    const Geometry other = random_shape(kShapes[i % 4], 0.1, 2, random);
    const Posed X_WA = random_pose(random, 1), X_WB = random_pose(random, i % 3 == 0 ? 0.5 : 4);
    const ShapeDistance expected = shape_distance(box, X_WA, other, X_WB);
    const ShapeDistance d = shape_distance(mesh, X_WA, other, X_WB), reversed = shape_distance(other, X_WB, mesh, X_WA);
    expect_consistent(d);
    EXPECT_NEAR(d.distance, reversed.distance, 1e-9);
    const double error = std::abs(d.distance - expected.distance);
    EXPECT_LT(error, 1e-9) << i << " " << shape_name(other.shape) << " " << expected.distance;
    (expected.distance > 0 ? apart : overlapping) = std::max(expected.distance > 0 ? apart : overlapping, error);
    overlaps += expected.distance < 0;
  }
  EXPECT_GT(overlaps, 300);
  std::printf("[ measured ] box or mesh of a box: %.2g apart, %.2g overlapping\n", apart, overlapping);
}

// --- Brute force ---

double point_triangle(const Vector3d& p, const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const auto segment = [&](const Vector3d& s, const Vector3d& t) {
    const double along = std::clamp(dot(p - s, t - s) / dot(t - s, t - s), 0.0, 1.0);
    return norm(p - s - along * (t - s));
  };
  double smallest = std::min({segment(a, b), segment(b, c), segment(c, a)});
  const Vector3d n = cross(b - a, c - a);
  const bool over =
      dot(cross(b - a, p - a), n) > 0 && dot(cross(c - b, p - b), n) > 0 && dot(cross(a - c, p - c), n) > 0;
  if (over) smallest = std::min(smallest, std::abs(dot(p - a, n)) / norm(n));
  return smallest;
}

// Distance of segments by the condition of the common perpendicular, or at an end.
double segment_segment(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d) {
  const auto end = [](const Vector3d& p, const Vector3d& s, const Vector3d& t) {
    const double along = std::clamp(dot(p - s, t - s) / dot(t - s, t - s), 0.0, 1.0);
    return norm(p - s - along * (t - s));
  };
  double smallest = std::min({end(a, c, d), end(b, c, d), end(c, a, b), end(d, a, b)});
  const Vector3d u = b - a, v = d - c, n = cross(u, v);
  const double nn = dot(n, n);
  if (!(nn > 0)) return smallest;
  const double s = dot(cross(c - a, v), n) / nn, t = dot(cross(c - a, u), n) / nn;
  if (s >= 0 && s <= 1 && t >= 0 && t <= 1) smallest = std::min(smallest, std::abs(dot(c - a, n)) / std::sqrt(nn));
  return smallest;
}

// All triples with every point on one side: the faces of the hull, oriented outward.
Triangles brute_hull(const Points& p) {
  Triangles faces;
  const int n = static_cast<int>(p.size());
  for (int i = 0; i < n; ++i) {
    for (int j = i + 1; j < n; ++j) {
      for (int k = j + 1; k < n; ++k) {
        const Vector3d m = cross(p[j] - p[i], p[k] - p[i]);
        int above = 0, below = 0;
        for (int q = 0; q < n; ++q) {
          if (q == i || q == j || q == k) continue;
          (dot(m, p[q] - p[i]) > 0 ? above : below) += 1;
        }
        if (above == 0) faces.push_back({i, j, k});
        if (below == 0) faces.push_back({i, k, j});
      }
    }
  }
  return faces;
}

struct Polyhedron {
  Points points;
  Triangles faces;
};
double extent_along(const Polyhedron& a, const Vector3d& n) {
  double largest = -std::numeric_limits<double>::infinity();
  for (const Vector3d& p : a.points) largest = std::max(largest, dot(n, p));
  return largest;
}
Vector3d face_normal(const Polyhedron& a, std::size_t f) {
  const auto& t = a.faces[f];
  const Vector3d n = cross(a.points[t[1]] - a.points[t[0]], a.points[t[2]] - a.points[t[0]]);
  return (1 / norm(n)) * n;
}

// Positive: minimum over vertices with faces and edges with edges. Negative: minimum depth over all normals of faces
// and of pairs of edges.
double brute_distance(const Polyhedron& a, const Polyhedron& b) {
  double depth = std::numeric_limits<double>::infinity();
  const auto offer = [&](const Vector3d& n) {
    depth = std::min(depth, extent_along(a, n) + extent_along(b, -n));
    depth = std::min(depth, extent_along(a, -n) + extent_along(b, n));
  };
  for (std::size_t f = 0; f < a.faces.size(); ++f) offer(face_normal(a, f));
  for (std::size_t f = 0; f < b.faces.size(); ++f) offer(face_normal(b, f));
  double smallest = std::numeric_limits<double>::infinity();
  for (const auto& s : a.faces) {
    for (const auto& t : b.faces) {
      for (int k = 0; k < 3; ++k) {
        smallest = std::min(smallest, point_triangle(a.points[s[k]], b.points[t[0]], b.points[t[1]], b.points[t[2]]));
        smallest = std::min(smallest, point_triangle(b.points[t[k]], a.points[s[0]], a.points[s[1]], a.points[s[2]]));
        for (int m = 0; m < 3; ++m) {
          const Vector3d &p = a.points[s[k]], &q = a.points[s[(k + 1) % 3]], &u = b.points[t[m]],
                         &v = b.points[t[(m + 1) % 3]];
          smallest = std::min(smallest, segment_segment(p, q, u, v));
          const Vector3d n = cross(q - p, v - u);
          if (norm(n) > 1e-9) offer((1 / norm(n)) * n);
        }
      }
    }
  }
  return depth > 0 ? -depth : smallest;
}

TEST(MeshDistance, RandomHullsAgreeWithBruteForce) {
  Random random(5);
  double apart = 0, overlapping = 0;
  int overlaps = 0;
  for (int i = 0; i < 300; ++i) {
    Polyhedron body[2];
    Geometry mesh[2];
    Posed X[2];
    for (int k = 0; k < 2; ++k) {
      const int count = 4 + (i + 3 * k) % 6;
      const Vector3d off{random.uniform(-3, 3), random.uniform(-3, 3), random.uniform(-3, 3)};
      for (int n = 0; n < count; ++n)
        body[k].points.push_back(off + Vector3d{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)});
      body[k].faces = brute_hull(body[k].points);
      mesh[k] = mesh_of(body[k].points, body[k].faces);
      X[k] = random_pose(random, i % 2 == 0 ? 0.3 : 2);
      X[k].p -= X[k].R * off;
      for (Vector3d& p : body[k].points) p = X[k] * p;
    }
    const double expected = brute_distance(body[0], body[1]);
    const ShapeDistance d = shape_distance(mesh[0], X[0], mesh[1], X[1]);
    expect_consistent(d);
    const double error = std::abs(d.distance - expected);
    EXPECT_LT(error, 1e-10) << i << " " << expected;
    (expected > 0 ? apart : overlapping) = std::max(expected > 0 ? apart : overlapping, error);
    overlaps += expected < 0;
    // Spheres too, with centres possibly inside.
    const Geometry ball{Shape::sphere, {0.1, 0, 0}, Posed::identity(), {}};
    const Posed at = random_pose(random, 1.5);
    double from = std::numeric_limits<double>::infinity(), inside = from;
    for (std::size_t f = 0; f < body[0].faces.size(); ++f) {
      const auto& t = body[0].faces[f];
      from = std::min(from, point_triangle(at.p, body[0].points[t[0]], body[0].points[t[1]], body[0].points[t[2]]));
      inside = std::min(inside, extent_along(body[0], face_normal(body[0], f)) - dot(face_normal(body[0], f), at.p));
    }
    const double ball_distance = (inside > 0 ? -inside : from) - 0.1;
    EXPECT_NEAR(shape_distance(mesh[0], X[0], ball, at).distance, ball_distance, 1e-12) << i;
  }
  EXPECT_GT(overlaps, 50);
  std::printf("[ measured ] hulls and brute force: %.2g apart, %.2g overlapping\n", apart, overlapping);
}

// The penetration depth of a hull with many faces is found by searches: at least the true depth, and close to it.
TEST(MeshDistance, FineSphereMesh) {
  Points points;
  Triangles triangles;
  constexpr int kRings = 24, kSides = 48;
  points.push_back({0, 0, 1});
  for (int i = 1; i < kRings; ++i) {
    const double polar = M_PI * i / kRings;
    for (int k = 0; k < kSides; ++k) {
      const double a = 2 * M_PI * k / kSides;
      points.push_back({std::sin(polar) * std::cos(a), std::sin(polar) * std::sin(a), std::cos(polar)});
    }
  }
  points.push_back({0, 0, -1});
  triangles.push_back({0, 1, 2});
  const Geometry mesh = mesh_of(points, triangles);
  const Geometry ball{Shape::sphere, {1, 0, 0}, Posed::identity(), {}};
  const Geometry box{Shape::box, {1, 0.5, 0.25}, Posed::identity(), {}};
  Random random(8);
  for (int i = 0; i < 100; ++i) {
    const Posed X = random_pose(random, 0.9);
    const double of_ball = shape_distance(ball, Posed::identity(), box, X).distance;
    const double of_mesh = shape_distance(mesh, Posed::identity(), box, X).distance;
    // The mesh lies inside the unit ball, at most 0.01 below its surface.
    EXPECT_GT(of_mesh, of_ball - 1e-3);
    EXPECT_LT(of_mesh, of_ball + 0.01);
  }
}

// A nonconvex mesh is replaced by its hull: its distance is at most that of the mesh.
TEST(MeshDistance, UsesTheConvexHull) {
  // An L: a ball in its corner touches the hull although it is clear of the mesh.
  const Points l{{0, 0, 0}, {2, 0, 0}, {2, 0.1, 0}, {0.1, 0.1, 0}, {0.1, 2, 0}, {0, 2, 0},
                 {0, 0, 1}, {2, 0, 1}, {2, 0.1, 1}, {0.1, 0.1, 1}, {0.1, 2, 1}, {0, 2, 1}};
  const Geometry mesh = mesh_of(l, {{0, 1, 7}, {0, 7, 6}});
  const Geometry ball{Shape::sphere, {0.1, 0, 0}, {Rotationd::identity(), {0.6, 0.6, 0.5}}, {}};
  EXPECT_LT(shape_distance(mesh, Posed::identity(), ball, Posed::identity()).distance, 0);
  const Geometry beyond{Shape::sphere, {0.1, 0, 0}, {Rotationd::identity(), {3, 0.05, 0.5}}, {}};
  EXPECT_NEAR(shape_distance(mesh, Posed::identity(), beyond, Posed::identity()).distance, 0.9, 1e-14);
}

// Bounds must not exclude close meshes, for any origin of their file.
TEST(MeshDistance, BoundsAreLowerBounds) {
  Random random(11);
  const Model model = free_bodies(4);
  for (int i = 0; i < 200; ++i) {
    std::vector<BodyShape> shapes;
    for (int b = 0; b < 4; ++b) {
      Geometry g = b < 2 ? box_mesh({random.log_uniform(0.1, 2), random.log_uniform(0.1, 2), 0.5},
                                    {random.uniform(-2, 2), random.uniform(-2, 2), 5})
                         : random_shape(kShapes[(i + b) % 4], 0.1, 2, random);
      g.X_BG = random_pose(random, 1);
      shapes.push_back({b, g});
    }
    const ClearanceModel clearance(model, shapes);
    Kinematics k(model);
    for (Posed& X : k.X_WB) X = random_pose(random, 3);
    ASSERT_EQ(clearance.pairs().size(), 6u);
    double smallest = std::numeric_limits<double>::infinity();
    for (int p = 0; p < 6; ++p) {
      const double distance = clearance.distance(p, k).distance;
      EXPECT_LE(clearance.coarse_bound(p, k), std::max(distance, 0.0) + 1e-12);
      EXPECT_LE(clearance.lower_bound(p, k), std::max(distance, 0.0) + 1e-12);
      smallest = std::min(smallest, distance);
    }
    if (smallest > 0) {
      EXPECT_EQ(clearance.minimum(k).distance, smallest);
    }
  }
}

TEST(MeshDistance, RequiresAHull) {
  const Model model = free_bodies(1);
  Geometry mesh = box_mesh({1, 1, 1}, {0, 0, 0});
  EXPECT_NO_THROW(ClearanceModel(model, {{0, mesh}}));
  mesh.size[1] = 0;
  EXPECT_THROW(ClearanceModel(model, {{0, mesh}}), std::invalid_argument);
  mesh = box_mesh({1, 1, 1}, {0, 0, 0});
  auto hullless = std::make_shared<TriangleMesh>(*mesh.mesh);
  hullless->hull = {};
  mesh.mesh = hullless;
  EXPECT_THROW(ClearanceModel(model, {{0, mesh}}), std::invalid_argument);
  mesh.mesh = nullptr;
  EXPECT_THROW(ClearanceModel(model, {{0, mesh}}), std::invalid_argument);
}

}  // namespace mesh_distance_test
}  // namespace grapnel::testing
