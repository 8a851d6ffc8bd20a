#include "grapnel/model/geometry.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "grapnel/spatial/pose.hpp"

namespace grapnel {
namespace convex_hull_test {

using Points = std::vector<Vector3d>;

double farthest(const Points& points, const Vector3d& n) {
  double most = -std::numeric_limits<double>::infinity();
  for (const Vector3d& p : points) most = std::max(most, dot(n, p));
  return most;
}

// Checks the hull: equal extent in every direction, and vertices are input points.
void expect_hull_of(const Points& points, const ConvexHull& hull, double size) {
  ASSERT_FALSE(hull.is_empty());
  for (const Vector3d& v : hull.vertices) {
    const bool given = std::any_of(points.begin(), points.end(), [&](const Vector3d& p) { return norm(p - v) == 0; });
    EXPECT_TRUE(given);
  }
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  Points directions = hull.normals;
  for (int i = 0; i < 300; ++i) directions.push_back({normal(random), normal(random), normal(random)});
  for (Vector3d n : directions) {
    n *= 1 / norm(n);
    EXPECT_LT(farthest(points, n) - farthest(hull.vertices, n), 1e-11 * size);  // measured 6e-13
  }
  ASSERT_EQ(hull.offsets.size(), hull.normals.size());
  for (std::size_t k = 0; k < hull.normals.size(); ++k) {
    EXPECT_NEAR(norm(hull.normals[k]), 1, 1e-14);
    EXPECT_NEAR(hull.offsets[k], farthest(points, hull.normals[k]) - dot(hull.normals[k], hull.center), 1e-11 * size);
  }
  for (const Vector3d& e : hull.edges) EXPECT_NEAR(norm(e), 1, 1e-14);
}

// Points of a box's surface on a grid: faces full of points in one plane, edges full of points in one line.
Points box_points(int n, const Vector3d& size, const Rotationd& R) {
  Points points;
  for (int i = 0; i <= n; ++i) {
    for (int j = 0; j <= n; ++j) {
      for (int k = 0; k <= n; ++k) {
        if (i % n != 0 && j % n != 0 && k % n != 0) continue;
        points.push_back(R * Vector3d{size[0] * i / n, size[1] * j / n, size[2] * k / n});
      }
    }
  }
  return points;
}

TEST(ConvexHull, Box) {
  for (const int n : {1, 2, 7}) {
    const ConvexHull hull = convex_hull(box_points(n, {1, 2, 3}, Rotationd::identity()));
    expect_hull_of(box_points(n, {1, 2, 3}, Rotationd::identity()), hull, 3);
    EXPECT_EQ(hull.normals.size(), 6u) << n;
    EXPECT_EQ(hull.edges.size(), 3u) << n;
    EXPECT_THAT(hull.center.e, testing::ElementsAre(0.5, 1, 1.5));
    EXPECT_THAT(hull.half.e, testing::ElementsAre(0.5, 1, 1.5));
  }
  EXPECT_EQ(convex_hull(box_points(1, {1, 2, 3}, Rotationd::identity())).vertices.size(), 8u);
}

// Due to rounding errors no four of these are coplanar.
TEST(ConvexHull, RotatedBox) {
  const Rotationd R = rotation_about({0.36, 0.48, 0.8}, 1.2345);
  for (const int n : {1, 2, 7}) {
    const Points points = box_points(n, {1, 2, 3}, R);
    const ConvexHull hull = convex_hull(points);
    expect_hull_of(points, hull, 3);
    for (int k = 0; k < 3; ++k) {
      for (const Vector3d& n0 : {R.column(k), -R.column(k)}) {
        const bool there = std::any_of(hull.normals.begin(), hull.normals.end(),
                                       [&](const Vector3d& m) { return norm(m - n0) < 1e-10; });
        EXPECT_TRUE(there) << n;
      }
    }
  }
}

TEST(ConvexHull, RandomPoints) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (const int count : {4, 5, 8, 30, 300, 3000}) {
    for (const double scale : {1e-50, 1.0, 1e6}) {
      Points points;
      for (int i = 0; i < count; ++i)
        points.push_back({scale * uniform(random), uniform(random) * scale, scale * uniform(random)});
      const ConvexHull hull = convex_hull(points);
      expect_hull_of(points, hull, 2 * scale);
      if (count < 30) continue;
      EXPECT_LT(hull.vertices.size(), points.size());
    }
  }
}

// All on the surface: every point is a vertex.
TEST(ConvexHull, Sphere) {
  std::mt19937 random(2);
  std::normal_distribution<double> normal;
  Points points;
  for (int i = 0; i < 20000; ++i) {
    const Vector3d v{normal(random), normal(random), normal(random)};
    points.push_back(1 / norm(v) * v);
  }
  const ConvexHull hull = convex_hull(points);
  EXPECT_EQ(hull.vertices.size(), points.size());
  EXPECT_LE(hull.normals.size(), 2 * points.size() - 4);  // Euler: as many triangles, of which a few are in one plane
  EXPECT_GT(hull.normals.size(), 2 * points.size() - 24);
  EXPECT_TRUE(hull.edges.empty());  // too many
}

// A cylinder's rims, a cone's tip above a disc, points that nearly coincide.
TEST(ConvexHull, RoundShapes) {
  Points points;
  for (int i = 0; i < 64; ++i) {
    const double a = 2 * M_PI * i / 64;
    points.push_back({std::cos(a), std::sin(a), 0});
    points.push_back({std::cos(a), std::sin(a), 2});
    points.push_back({std::cos(a) * (1 + 1e-15), std::sin(a), 2});
  }
  const ConvexHull cylinder = convex_hull(points);
  expect_hull_of(points, cylinder, 2);
  EXPECT_GE(cylinder.normals.size(), 66u);
  points.push_back({0, 0, 2 + 1e-9});
  expect_hull_of(points, convex_hull(points), 2);
}

TEST(ConvexHull, IsEmptyForCoplanarPoints) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(convex_hull({}).is_empty());
  EXPECT_TRUE(convex_hull(Points(10, {1, 2, 3})).is_empty());
  EXPECT_TRUE(convex_hull(Points{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}).is_empty());
  EXPECT_TRUE(convex_hull(Points{{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {3, 3, 3}, {-1, -1, -1}}).is_empty());
  EXPECT_TRUE(convex_hull(Points{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {0.5, 0.25, 0}}).is_empty());
  EXPECT_TRUE(convex_hull(Points{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 1e-10}}).is_empty());
  EXPECT_TRUE(convex_hull(Points{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, nan}}).is_empty());
  EXPECT_TRUE(convex_hull(Points{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, inf}}).is_empty());
  EXPECT_TRUE(convex_hull(Points{{0, 0, 0}, {1e-300, 0, 0}, {0, 1e-300, 0}, {0, 0, 1e-300}}).is_empty());
  EXPECT_FALSE(convex_hull(Points{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1e-6}}).is_empty());
}

TEST(TriangleMesh, RequiresAHull) {
  const Points corners{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const auto mesh = make_triangle_mesh("corner", corners, {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}});
  EXPECT_EQ(mesh->name, "corner");
  EXPECT_EQ(mesh->hull.vertices.size(), 4u);
  const auto refusal = [](const Points& vertices, const std::vector<std::array<int, 3>>& triangles) {
    try {
      make_triangle_mesh("m", vertices, triangles);
    } catch (const std::invalid_argument& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(refusal(corners, {}), "mesh 'm': there is no triangle");
  EXPECT_EQ(refusal(corners, {{0, 1, 4}}), "mesh 'm': there is no vertex 4");
  EXPECT_EQ(refusal(corners, {{0, -1, 2}}), "mesh 'm': there is no vertex -1");
  EXPECT_EQ(refusal({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}),
            "mesh 'm': its vertices are not finite or all in one plane");
}

}  // namespace convex_hull_test
}  // namespace grapnel
