#include "grapnel/report/outline.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace grapnel {

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
  // Corners that only rounding makes are none: an edge-on circle is a line.
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
  if (shape.shape != "mesh") return;
  centre_ = Vector3d::zero();
  for (const Vector3d& p : points_) centre_ += (1 / static_cast<double>(points_.size())) * p;
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
