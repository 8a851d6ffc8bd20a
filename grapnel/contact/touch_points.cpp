#include "grapnel/contact/touch_points.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace grapnel {
namespace {

constexpr std::size_t kMaxPoints = 4;
constexpr int kRimPoints = 16;        // of the rim of a cylinder's cap
constexpr double kParallel = 1e-9;    // sine of the angle below which edges are parallel
constexpr double kSameDigits = 1e-9;  // distance of points that count as one, relative to the cores' size

// ---- Features of a core ----

// Points among which are the corners of every face of a core with the outward normal d, in its frame.
std::vector<Vector3d> corners(const ConvexCore& core, const Vector3d& d) {
  std::vector<Vector3d> all;
  if (core.map) return core.map->vertices();
  if (core.hull) {
    for (const Vector3d& v : core.hull->vertices) all.push_back(core.scaled(v - core.hull->center));
    return all;
  }
  const Vector3d& h = core.half;
  if (!core.round) {
    for (int i = 0; i < 8; ++i) all.push_back({i & 1 ? h[0] : -h[0], i & 2 ? h[1] : -h[1], i & 4 ? h[2] : -h[2]});
    return all;
  }
  const double start = std::atan2(d[1], d[0]);
  for (int k = 0; k < kRimPoints; ++k) {
    const double angle = start + 2 * std::numbers::pi * k / kRimPoints;
    const double x = h[0] * std::cos(angle), y = h[0] * std::sin(angle);
    all.push_back({x, y, h[2]}), all.push_back({x, y, -h[2]});
  }
  return all;
}

// Pose of a core, unit direction n => the points of its surface that are farthest along n, to kTouchTolerance.
std::vector<Vector3d> feature(const ConvexCore& core, const Posed& X, const Vector3d& n) {
  const Vector3d d = transposed_times(X.R, n);
  const double farthest = dot(d, support(core, d));
  std::vector<Vector3d> points;
  for (const Vector3d& p : corners(core, d)) {
    if (dot(d, p) >= farthest - kTouchTolerance) points.push_back(X * p + core.rounding * n);
  }
  if (points.empty()) points.push_back(X * support(core, d) + core.rounding * n);
  return points;
}

// ---- Polygons in the tangent plane ----

using Point2 = std::array<double, 2>;
using Polygon = std::vector<Point2>;  // convex, counter-clockwise; one or two points: a point, a segment

Point2 operator-(const Point2& a, const Point2& b) { return {a[0] - b[0], a[1] - b[1]}; }
double cross2(const Point2& a, const Point2& b) { return a[0] * b[1] - a[1] * b[0]; }
double dot2(const Point2& a, const Point2& b) { return a[0] * b[0] + a[1] * b[1]; }
double length(const Point2& a) { return std::hypot(a[0], a[1]); }
Point2 between(const Point2& a, const Point2& b, double t) {
  return {a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])};
}

// Points => their convex hull, without points that are nearer to another or to an edge than `same` [m].
Polygon hull_of(Polygon points, double same) {
  std::sort(points.begin(), points.end());
  Polygon distinct;
  for (const Point2& p : points) {
    const auto is_near = [&](const Point2& q) { return length(p - q) <= same; };
    if (std::none_of(distinct.begin(), distinct.end(), is_near)) distinct.push_back(p);
  }
  if (distinct.size() < 3) return distinct;
  const auto chain = [&](auto begin, auto end) {
    Polygon half;
    for (auto it = begin; it != end; ++it) {
      const auto turns = [&] {
        const Point2 edge = *it - half[half.size() - 2];
        return cross2(edge, half.back() - half[half.size() - 2]) < -same * length(edge);
      };
      while (half.size() > 1 && !turns()) half.pop_back();
      half.push_back(*it);
    }
    half.pop_back();
    return half;
  };
  Polygon hull = chain(distinct.begin(), distinct.end());
  const Polygon upper = chain(distinct.rbegin(), distinct.rend());
  hull.insert(hull.end(), upper.begin(), upper.end());
  return hull;
}

// The part of a polygon or segment to the left of the line from a to b.
Polygon left_of(const Polygon& polygon, const Point2& a, const Point2& b, double same) {
  const Point2 edge = b - a;
  const auto side = [&](const Point2& p) { return cross2(edge, p - a) / length(edge); };
  Polygon kept;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Point2 &p = polygon[i], &next = polygon[(i + 1) % polygon.size()];
    const double here = side(p), there = side(next);
    if (here >= -same) kept.push_back(p);
    if ((here < -same) != (there < -same))
      kept.push_back(between(p, next, std::clamp(here / (here - there), 0.0, 1.0)));
  }
  return kept;
}

// The part of two segments that both have in common: of crossing ones the point of their lines.
Polygon common_part(const Polygon& p, const Polygon& q) {
  const Point2 along = p[1] - p[0], other = q[1] - q[0];
  const double c = cross2(along, other);
  if (std::abs(c) > kParallel * length(along) * length(other))
    return {between(p[0], p[1], std::clamp(cross2(q[0] - p[0], other) / c, 0.0, 1.0))};
  const double square = dot2(along, along);
  const auto [first, last] = std::minmax({dot2(q[0] - p[0], along) / square, dot2(q[1] - p[0], along) / square});
  return {between(p[0], p[1], std::clamp(first, 0.0, 1.0)), between(p[0], p[1], std::clamp(last, 0.0, 1.0))};
}

Polygon intersection(const Polygon& p, const Polygon& q, double same) {
  if (p.size() == 1) return p;
  if (q.size() == 1) return q;
  if (p.size() == 2 && q.size() == 2) return common_part(p, q);
  if (q.size() == 2) return intersection(q, p, same);
  Polygon rest = p;
  for (std::size_t i = 0; i < q.size() && !rest.empty(); ++i) rest = left_of(rest, q[i], q[(i + 1) % q.size()], same);
  return rest;
}

// Polygon => at most four of its corners: the two that are farthest apart, and the farthest from their line on each
// side.
Polygon extremes(const Polygon& polygon) {
  if (polygon.size() <= kMaxPoints) return polygon;
  std::size_t a = 0, b = 1;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    for (std::size_t j = i + 1; j < polygon.size(); ++j) {
      if (length(polygon[i] - polygon[j]) > length(polygon[a] - polygon[b])) a = i, b = j;
    }
  }
  const Point2 line = polygon[b] - polygon[a];
  std::size_t left = a, right = a;
  const auto height = [&](std::size_t i) { return cross2(line, polygon[i] - polygon[a]); };
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    if (height(i) > height(left)) left = i;
    if (height(i) < height(right)) right = i;
  }
  Polygon found{polygon[a], polygon[b]};
  for (const std::size_t i : {left, right}) {
    if (i != a) found.push_back(polygon[i]);
  }
  return found;
}

// Features of both surfaces, normal => the touching points. `middle`: between both surfaces along the normal [m];
// `scale`: of the cores [m]. Without a common part, the nearest points decide.
TouchPoints touch(const std::vector<Vector3d>& of_a, const std::vector<Vector3d>* of_b, const Vector3d& n,
                  double middle, double scale, const Vector3d& nearest) {
  const Rotationd R = rotation_between({0, 0, 1}, n);
  const auto flat = [&](const std::vector<Vector3d>& points) {
    Polygon polygon;
    for (const Vector3d& p : points) polygon.push_back({dot(p, R.column(0)), dot(p, R.column(1))});
    return hull_of(polygon, kSameDigits * scale);
  };
  Polygon common = flat(of_a);
  if (of_b) common = hull_of(intersection(common, flat(*of_b), kSameDigits * scale), kSameDigits * scale);
  if (common.empty()) common.push_back({dot(nearest, R.column(0)), dot(nearest, R.column(1))});
  TouchPoints found{n, {}};
  for (const Point2& p : extremes(common)) found.points.push_back(p[0] * R.column(0) + p[1] * R.column(1) + middle * n);
  return found;
}

}  // namespace

// Cores => normal by their distance, or by their depth where they nearly touch and their nearest points give no
// direction; the corners of the common part of both features.
TouchPoints touch_points(const CorePair& pair) {
  constexpr double kNoDirection = 1e-6;  // distance of cores, relative to their size
  const ConvexDistance apart = convex_distance(pair);
  const double distance = norm(apart.difference), scale = pair.scale();
  Vector3d n, nearest;
  if (apart.separated && distance > kNoDirection * scale) {
    n = (-1 / distance) * apart.difference;
    nearest = 0.5 * (apart.point_a + apart.point_b);
  } else {
    const Penetration inside = penetration(pair);
    n = inside.normal;
    nearest = 0.5 * (inside.point_a + inside.point_b);
  }
  const std::vector<Vector3d> of_a = feature(pair.a, Posed::identity(), n);
  std::vector<Vector3d> of_b = feature(pair.b, pair.X_AB, -n);
  double level_a = dot(n, of_a.front()), level_b = dot(n, of_b.front());
  for (const Vector3d& p : of_a) level_a = std::max(level_a, dot(n, p));
  for (const Vector3d& p : of_b) level_b = std::min(level_b, dot(n, p));
  return touch(of_a, &of_b, n, 0.5 * (level_a + level_b), scale, nearest);
}

TouchPoints touch_points_on_plane(const ConvexCore& a, const Posed& X_AB) {
  const Vector3d n = -X_AB.R.column(2);
  const std::vector<Vector3d> of_a = feature(a, Posed::identity(), n);
  double level = dot(n, of_a.front());
  for (const Vector3d& p : of_a) level = std::max(level, dot(n, p));
  return touch(of_a, nullptr, n, 0.5 * (level + dot(n, X_AB.p)), a.reach() + a.rounding, of_a.front());
}

}  // namespace grapnel
