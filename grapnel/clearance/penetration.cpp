#include "grapnel/clearance/penetration.hpp"

#include <array>
#include <limits>
#include <numbers>
#include <vector>

#include "grapnel/clearance/convex_distance.hpp"
#include "grapnel/clearance/scalar_search.hpp"

namespace grapnel {

namespace {

// The direction of least depth so far.
struct LeastDepth {
  const CorePair& pair;
  double depth = std::numeric_limits<double>::infinity();
  Vector3d normal{1, 0, 0};

  // h(n) of the Minkowski difference A - B, for unit n.
  double along(const Vector3d& n) const { return dot(n, pair.support_a(n) - pair.support_b(-n)); }
  void offer(const Vector3d& unit) {
    const double h = along(unit);
    if (h < depth) depth = h, normal = unit;
  }
  // Both ways along any vector that is not (nearly) zero.
  void offer_line(const Vector3d& v) {
    const double length = norm(v);
    if (!(length > 1e-9)) return;
    const Vector3d n = (1 / length) * v;
    offer(n), offer(-n);
  }
};

// Two unit vectors perpendicular to the unit vector n and to each other.
std::array<Vector3d, 2> perpendiculars(const Vector3d& n) {
  const int k = std::abs(n[0]) < 0.6 ? 0 : 1;
  Vector3d u = cross(n, Vector3d::unit(k));
  u *= 1 / norm(u);
  return {u, cross(n, u)};
}

// The least depth along directions perpendicular to `axis`: the lowest of equally spaced ones, and the golden section
// around each of those lower than both neighbours and near the lowest.
void search_circle(const Vector3d& axis, LeastDepth& least) {
  constexpr int kDirections = 64;
  constexpr double kSpacing = 2 * std::numbers::pi / kDirections;
  const auto [u, v] = perpendiculars(axis);
  const auto direction = [&, u = u, v = v](double angle) { return std::cos(angle) * u + std::sin(angle) * v; };
  std::array<double, kDirections> h;
  for (int i = 0; i < kDirections; ++i) h[i] = least.along(direction(kSpacing * i));
  // From one direction to the next h changes by less than the scale times the spacing.
  const double slack = kSpacing * least.pair.scale();
  for (int i = 0; i < kDirections; ++i) {
    if (h[i] > h[(i + 1) % kDirections] || h[i] > h[(i + kDirections - 1) % kDirections]) continue;
    if (h[i] - slack > least.depth) continue;
    const double angle =
        golden_minimum([&](double x) { return least.along(direction(x)); }, kSpacing * (i - 1), kSpacing * (i + 1));
    least.offer(direction(angle));
  }
}

// Walks downhill from a direction in steps that grow while they help and shrink where they do not. Where two parts of
// the surface meet it may stop short; those directions are on the circles.
void descend(Vector3d n, double step, LeastDepth& least) {
  double h = least.along(n);
  for (int round = 0; round < 120 && step > 1e-9; ++round) {
    const auto [u, v] = perpendiculars(n);
    bool lower = false;
    for (const Vector3d& side : {u, -u, v, -v}) {
      Vector3d trial = n + step * side;
      trial *= 1 / norm(trial);
      const double h_trial = least.along(trial);
      if (h_trial < h) {
        n = trial, h = h_trial, lower = true;
        break;
      }
    }
    step *= lower ? 1.5 : 0.5;
  }
  least.offer(n);
}

// Rims of two cylinders touch along any direction: the lowest few of directions spread over the sphere, each improved.
void search_sphere(LeastDepth& least) {
  constexpr int kDirections = 200, kStarts = 4;
  constexpr double kSpacing = 0.25;  // about the angle between neighbours
  struct Start {
    double h = std::numeric_limits<double>::infinity();
    Vector3d n{1, 0, 0};
  };
  std::array<Start, kStarts> starts;
  for (int i = 0; i < kDirections; ++i) {
    // Fibonacci's spiral.
    const double z = 1 - (2 * i + 1.0) / kDirections, r = std::sqrt(1 - z * z), angle = 2.399963229728653 * i;
    const Vector3d n{r * std::cos(angle), r * std::sin(angle), z};
    const double h = least.along(n);
    // One start per neighbourhood: replace a near one if lower, else the highest.
    Start* place = &starts[0];
    for (Start& s : starts) {
      if (dot(s.n, n) > std::cos(1.5 * kSpacing) && std::isfinite(s.h)) {
        place = &s;
        break;
      }
      if (s.h > place->h) place = &s;
    }
    if (h < place->h) *place = {h, n};
  }
  for (const Start& s : starts) descend(s.n, 0.5 * kSpacing, least);
}

// Normals of the faces of a core and directions of its edges, in the first core's frame for R = R_AB; of cylinders
// those that are straight.
struct Directions {
  std::vector<Vector3d> normals, edges;
};
Directions directions_of(const ConvexCore& core, const Rotationd& R) {
  Directions d;
  if (core.hull) {
    for (const Vector3d& n : core.hull->normals) {
      const Vector3d v = R * core.scaled_normal(n);
      d.normals.push_back((1 / norm(v)) * v);
    }
    for (const Vector3d& e : core.hull->edges) {
      const Vector3d v = R * core.scaled(e);
      d.edges.push_back((1 / norm(v)) * v);
    }
    return d;
  }
  for (int k = core.round ? 2 : 0; k < 3; ++k) d.edges.push_back(R.column(k));
  d.normals = d.edges;
  return d;
}

// Pairs with the hull of a mesh: all normals of faces of the Minkowski difference, as long as they are few enough.
// Else, and for what is round, searches.
void offer_hulls(const CorePair& pair, LeastDepth& least) {
  constexpr std::size_t kMostNormals = 4000;
  const Directions a = directions_of(pair.a, Rotationd::identity()), b = directions_of(pair.b, pair.X_AB.R);
  const bool many = a.edges.empty() || b.edges.empty() || a.normals.size() + b.normals.size() > kMostNormals;
  least.offer_line(pair.X_AB.p);
  if (many) search_sphere(least);
  for (const std::vector<Vector3d>* normals : {&a.normals, &b.normals}) {
    if (normals->size() > kMostNormals) continue;
    for (const Vector3d& n : *normals) least.offer_line(n);
  }
  for (const Vector3d& d : a.edges) {
    for (const Vector3d& e : b.edges) least.offer_line(cross(d, e));
  }
  if (pair.a.round) {
    for (const Vector3d& e : b.edges) search_circle(e, least);
    search_circle({0, 0, 1}, least);
  }
  if (pair.b.round) {
    for (const Vector3d& d : a.edges) search_circle(d, least);
    search_circle(pair.X_AB.R.column(2), least);
  }
}

// Pairs of boxes, cylinders, segments and points.
void offer_primitives(const CorePair& pair, LeastDepth& least) {
  const Rotationd& R = pair.X_AB.R;
  least.offer_line(pair.X_AB.p);
  for (int i = 0; i < 3; ++i) {
    least.offer_line(Vector3d::unit(i));
    least.offer_line(R.column(i));
    for (int j = 0; j < 3; ++j) least.offer_line(cross(Vector3d::unit(i), R.column(j)));
  }
  if (pair.a.round || pair.b.round) {
    for (int i = pair.a.round ? 2 : 0; i < 3; ++i) search_circle(Vector3d::unit(i), least);
    for (int i = pair.b.round ? 2 : 0; i < 3; ++i) search_circle(R.column(i), least);
  }
  if (pair.a.round && pair.b.round) search_sphere(least);
}

}  // namespace

Penetration penetration(const CorePair& pair) {
  LeastDepth least{pair};
  if (pair.a.hull || pair.b.hull)
    offer_hulls(pair, least);
  else
    offer_primitives(pair, least);

  // Where they would touch: the nearest points once they are moved apart by a little more than the depth. If the normal
  // was not the best one, these points give a better one.
  const double gap = 1e-4 * pair.scale();
  CorePair apart = pair;
  Penetration result{};
  for (int step = 0; step < 30; ++step) {
    apart.X_AB.p = pair.X_AB.p + (least.depth + gap) * least.normal;
    const ConvexDistance touch = convex_distance(apart);
    result = {least.depth, least.normal, touch.point_a, touch.point_a - least.depth * least.normal};
    least.offer((-1 / norm(touch.difference)) * touch.difference);
    if (!(least.depth < result.depth - 1e-13 * pair.scale())) break;
  }
  return result;
}

}  // namespace grapnel
