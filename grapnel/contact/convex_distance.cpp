#include "grapnel/contact/convex_distance.hpp"

#include <array>
#include <limits>
#include <numbers>
#include <vector>

#include "grapnel/contact/motion_watch.hpp"

namespace grapnel {

namespace {

// A point w = a - b of the Minkowski difference of two cores.
struct Vertex {
  Vector3d w, a, b;
};

// Up to four vertices, and the weights of the point of their hull nearest to the origin.
struct Simplex {
  std::array<Vertex, 4> vertex;
  std::array<double, 4> weight;
  int count = 0;

  void add(const Vertex& v, double w) {
    vertex[count] = v;
    weight[count++] = w;
  }
  Vector3d point(Vector3d Vertex::*what) const {
    Vector3d p = Vector3d::zero();
    for (int i = 0; i < count; ++i) p += weight[i] * (vertex[i].*what);
    return p;
  }
};

// Keeps the nearer of two candidates.
struct Nearest {
  Simplex simplex;
  double square = std::numeric_limits<double>::infinity();

  void offer(const Simplex& candidate) {
    const Vector3d p = candidate.point(&Vertex::w);
    const double s = dot(p, p);
    if (s < square) square = s, simplex = candidate;
  }
};

void offer_edge(const Vertex& p, const Vertex& q, Nearest& nearest) {
  const Vector3d edge = q.w - p.w;
  const double length2 = dot(edge, edge);
  const double t = length2 > 0 ? -dot(p.w, edge) / length2 : 0;
  Simplex s;
  if (t < 1) s.add(p, t > 0 ? 1 - t : 1);
  if (t > 0) s.add(q, t < 1 ? t : 1);
  nearest.offer(s);
}

// Barycentric coordinates of the origin's projection onto the triangle's plane, from areas projected along the axis
// with the least reduction.
bool inside_triangle(const Vertex& p, const Vertex& q, const Vertex& r, std::array<double, 3>& weight) {
  const Vector3d n = cross(q.w - p.w, r.w - p.w);
  const double n2 = dot(n, n);
  if (!(n2 > 0)) return false;
  const Vector3d foot = (dot(p.w, n) / n2) * n;
  int k = 0;
  if (std::abs(n[1]) > std::abs(n[k])) k = 1;
  if (std::abs(n[2]) > std::abs(n[k])) k = 2;
  const int i = (k + 1) % 3, j = (k + 2) % 3;
  const auto area = [&](const Vector3d& x, const Vector3d& y) {
    return (x[i] - foot[i]) * (y[j] - foot[j]) - (x[j] - foot[j]) * (y[i] - foot[i]);
  };
  weight = {area(q.w, r.w) / n[k], area(r.w, p.w) / n[k], area(p.w, q.w) / n[k]};
  const double sum = weight[0] + weight[1] + weight[2];
  for (double& w : weight) w /= sum;
  return weight[0] > 0 && weight[1] > 0 && weight[2] > 0;
}

void offer_triangle(const Vertex& p, const Vertex& q, const Vertex& r, Nearest& nearest) {
  std::array<double, 3> weight;
  if (inside_triangle(p, q, r, weight)) {
    Simplex s;
    s.add(p, weight[0]), s.add(q, weight[1]), s.add(r, weight[2]);
    nearest.offer(s);
  } else {
    offer_edge(p, q, nearest), offer_edge(q, r, nearest), offer_edge(r, p, nearest);
  }
}

// Six times the signed volume of a tetrahedron.
double volume(const Vector3d& p, const Vector3d& q, const Vector3d& r, const Vector3d& s) {
  return dot(q - p, cross(r - p, s - p));
}

// Whether the origin is inside; otherwise evaluates the faces that separate it.
bool offer_tetrahedron(const std::array<Vertex, 4>& v, double scale, Nearest& nearest) {
  const Vector3d o = Vector3d::zero();
  const double whole = volume(v[0].w, v[1].w, v[2].w, v[3].w);
  const bool flat = !(std::abs(whole) > 1e-15 * scale * scale * scale);
  const std::array<double, 4> part = {volume(o, v[1].w, v[2].w, v[3].w), volume(v[0].w, o, v[2].w, v[3].w),
                                      volume(v[0].w, v[1].w, o, v[3].w), volume(v[0].w, v[1].w, v[2].w, o)};
  bool inside = !flat;
  for (int i = 0; i < 4; ++i) {
    if (!flat && part[i] * whole > 0) continue;
    inside = false;
    offer_triangle(v[(i + 1) % 4], v[(i + 2) % 4], v[(i + 3) % 4], nearest);
  }
  return inside;
}

// Reduces the simplex to the face nearest to the origin and computes its weights. False: the origin is inside.
bool reduce(Simplex& simplex, double scale) {
  Nearest nearest;
  const auto& v = simplex.vertex;
  switch (simplex.count) {
    case 2:
      offer_edge(v[0], v[1], nearest);
      break;
    case 3:
      offer_triangle(v[0], v[1], v[2], nearest);
      break;
    default:
      if (offer_tetrahedron(v, scale, nearest)) return false;
      break;
  }
  if (nearest.simplex.count > 0) simplex = nearest.simplex;
  return true;
}

ConvexDistance result_of(const Simplex& simplex, bool separated) {
  return {separated, simplex.point(&Vertex::a), simplex.point(&Vertex::b), simplex.point(&Vertex::w)};
}

}  // namespace

// Two cores => nearest points in the first one's frame, by Gilbert, Johnson and Keerthi; at most 200 steps. The result
// states overlap if the simplex contains the origin or the distance is a rounding error.
ConvexDistance convex_distance(const CorePair& pair) {
  constexpr int kMaxSteps = 200;  // cylinders need up to about 30, boxes 10
  constexpr double kRelative = 1e-14;
  const double scale = pair.scale();
  const double rounding = 4 * std::numeric_limits<double>::epsilon() * scale;

  // The centres are points of the cores (any point for hulls), so their difference is a point of the Minkowski
  // difference.
  Simplex simplex;
  if (pair.a.hull || pair.b.hull) {
    const Vector3d a = pair.a.any_point(), b = pair.X_AB * pair.b.any_point();
    simplex.add({a - b, a, b}, 1);
  } else {
    simplex.add({-pair.X_AB.p, Vector3d::zero(), pair.X_AB.p}, 1);
  }
  Vector3d v = simplex.point(&Vertex::w);
  double square = dot(v, v);
  double bound = 0;  // lower bound of the distance
  for (int step = 0; step < kMaxSteps; ++step) {
    const double distance = std::sqrt(square);
    if (!(distance > 16 * rounding)) return result_of(simplex, false);
    Vertex next;
    next.a = pair.support_a(-v), next.b = pair.support_b(v);
    next.w = next.a - next.b;
    bound = std::max(bound, dot(v, next.w) / distance);
    if (distance - bound <= kRelative * distance + rounding) break;

    Simplex larger = simplex;
    larger.add(next, 0);
    if (!reduce(larger, scale)) return result_of(simplex, false);
    const Vector3d nearer = larger.point(&Vertex::w);
    const double nearer_square = dot(nearer, nearer);
    if (!(nearer_square < square)) break;  // rounding error ends the descent
    simplex = larger, v = nearer, square = nearer_square;
  }
  return result_of(simplex, bound > 0);
}

// Ends of two segments => nearest points, the best of five candidates.
ConvexDistance segment_distance(const Vector3d& p1, const Vector3d& p2, const Vector3d& q1, const Vector3d& q2) {
  const Vector3d d = p2 - p1, e = q2 - q1, r = p1 - q1;
  const double dd = dot(d, d), ee = dot(e, e), de = dot(d, e);
  ConvexDistance best{true, p1, q1, r};
  double smallest = std::numeric_limits<double>::infinity();
  const auto offer = [&](double s, double t) {
    const Vector3d a = p1 + s * d, b = q1 + t * e, difference = a - b;
    const double square = dot(difference, difference);
    if (square < smallest) smallest = square, best = {true, a, b, difference};
  };
  const auto foot = [](double along, double length2) {
    return length2 > 0 ? std::clamp(along / length2, 0.0, 1.0) : 0.0;
  };
  // Candidates: each end with the other segment, and the common perpendicular.
  offer(0, foot(dot(r, e), ee));
  offer(1, foot(dot(r + d, e), ee));
  offer(foot(-dot(r, d), dd), 0);
  offer(foot(dot(e - r, d), dd), 1);
  const Vector3d n = cross(d, e);
  const double nn = dot(n, n);  // = dd ee - de^2 without its cancellation
  if (nn > 0) {
    const double s = dot(cross(e, r), n) / nn;
    if (s > 0 && s < 1) offer(s, foot(dot(r, e) + s * de, ee));
  }
  return best;
}

namespace {

// The direction of minimum depth so far.
struct MinimumDepth {
  const CorePair& pair;
  double depth = std::numeric_limits<double>::infinity();
  Vector3d normal{1, 0, 0};

  // h(n) of the Minkowski difference A - B, for unit n.
  double along(const Vector3d& n) const { return dot(n, pair.support_a(n) - pair.support_b(-n)); }
  void offer(const Vector3d& unit) {
    const double h = along(unit);
    if (h < depth) depth = h, normal = unit;
  }
  // Evaluates both directions along a vector, unless it is (nearly) zero.
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

// Minimum depth over directions perpendicular to `axis`: the lowest of equally spaced ones, and golden section searches
// around those that are lower than both neighbours and close to the lowest.
void search_circle(const Vector3d& axis, MinimumDepth& minimum) {
  constexpr int kDirections = 64;
  constexpr double kSpacing = 2 * std::numbers::pi / kDirections;
  const auto [u, v] = perpendiculars(axis);
  const auto direction = [&, u = u, v = v](double angle) { return std::cos(angle) * u + std::sin(angle) * v; };
  std::array<double, kDirections> h;
  for (int i = 0; i < kDirections; ++i) h[i] = minimum.along(direction(kSpacing * i));
  // Between neighbouring directions h changes by at most the scale times the spacing.
  const double slack = kSpacing * minimum.pair.scale();
  for (int i = 0; i < kDirections; ++i) {
    if (h[i] > h[(i + 1) % kDirections] || h[i] > h[(i + kDirections - 1) % kDirections]) continue;
    if (h[i] - slack > minimum.depth) continue;
    const double angle =
        golden_minimum([&](double x) { return minimum.along(direction(x)); }, kSpacing * (i - 1), kSpacing * (i + 1));
    minimum.offer(direction(angle));
  }
}

// Descent from a direction in steps that grow on success and shrink on failure. It may stop early at edges between two
// parts of the surface; those directions are on the circles.
void descend(Vector3d n, double step, MinimumDepth& minimum) {
  double h = minimum.along(n);
  for (int round = 0; round < 120 && step > 1e-9; ++round) {
    const auto [u, v] = perpendiculars(n);
    bool lower = false;
    for (const Vector3d& side : {u, -u, v, -v}) {
      Vector3d trial = n + step * side;
      trial *= 1 / norm(trial);
      const double h_trial = minimum.along(trial);
      if (h_trial < h) {
        n = trial, h = h_trial, lower = true;
        break;
      }
    }
    step *= lower ? 1.5 : 0.5;
  }
  minimum.offer(n);
}

// Rims of two cylinders may touch along any direction: selects the lowest few of directions spread over the sphere, and
// improves each.
void search_sphere(MinimumDepth& minimum) {
  constexpr int kDirections = 200, kStarts = 4;
  constexpr double kSpacing = 0.25;  // approximate angle between neighbours
  struct Start {
    double h = std::numeric_limits<double>::infinity();
    Vector3d n{1, 0, 0};
  };
  std::array<Start, kStarts> starts;
  for (int i = 0; i < kDirections; ++i) {
    // Fibonacci spiral.
    const double z = 1 - (2 * i + 1.0) / kDirections, r = std::sqrt(1 - z * z), angle = 2.399963229728653 * i;
    const Vector3d n{r * std::cos(angle), r * std::sin(angle), z};
    const double h = minimum.along(n);
    // One start per neighbourhood: replaces a close one if lower, else the highest.
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
  for (const Start& s : starts) descend(s.n, 0.5 * kSpacing, minimum);
}

// Face normals and edge directions of a core, in the first core's frame for R = R_AB; for cylinders those of straight
// elements.
struct Directions {
  std::vector<Vector3d> normals, edges;
};
// Core and its rotation => unit normals of its faces and directions of its edges; of a round core only the axis, since
// its lateral surface is treated separately.
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

// Pairs with the hull of a mesh: all face normals of the Minkowski difference if they are few enough; otherwise, and
// for round shapes, searches.
void offer_hulls(const CorePair& pair, MinimumDepth& minimum) {
  constexpr std::size_t kMaxNormals = 4000;
  const Directions a = directions_of(pair.a, Rotationd::identity()), b = directions_of(pair.b, pair.X_AB.R);
  const bool many = a.edges.empty() || b.edges.empty() || a.normals.size() + b.normals.size() > kMaxNormals;
  minimum.offer_line(pair.X_AB.p);
  if (many) search_sphere(minimum);
  for (const std::vector<Vector3d>* normals : {&a.normals, &b.normals}) {
    if (normals->size() > kMaxNormals) continue;
    for (const Vector3d& n : *normals) minimum.offer_line(n);
  }
  for (const Vector3d& d : a.edges) {
    for (const Vector3d& e : b.edges) minimum.offer_line(cross(d, e));
  }
  if (pair.a.round) {
    for (const Vector3d& e : b.edges) search_circle(e, minimum);
    search_circle({0, 0, 1}, minimum);
  }
  if (pair.b.round) {
    for (const Vector3d& d : a.edges) search_circle(d, minimum);
    search_circle(pair.X_AB.R.column(2), minimum);
  }
}

// Pairs of boxes, cylinders, segments and points.
void offer_primitives(const CorePair& pair, MinimumDepth& minimum) {
  const Rotationd& R = pair.X_AB.R;
  minimum.offer_line(pair.X_AB.p);
  for (int i = 0; i < 3; ++i) {
    minimum.offer_line(Vector3d::unit(i));
    minimum.offer_line(R.column(i));
    for (int j = 0; j < 3; ++j) minimum.offer_line(cross(Vector3d::unit(i), R.column(j)));
  }
  if (pair.a.round || pair.b.round) {
    for (int i = pair.a.round ? 2 : 0; i < 3; ++i) search_circle(Vector3d::unit(i), minimum);
    for (int i = pair.b.round ? 2 : 0; i < 3; ++i) search_circle(R.column(i), minimum);
  }
  if (pair.a.round && pair.b.round) search_sphere(minimum);
}

}  // namespace

// Overlapping cores => minimum depth, its normal and contact points, in the first one's frame. Candidate normals first,
// then refinement by the nearest points of the cores after their separation.
Penetration penetration(const CorePair& pair) {
  MinimumDepth minimum{pair};
  if (pair.a.hull || pair.b.hull)
    offer_hulls(pair, minimum);
  else
    offer_primitives(pair, minimum);

  // Contact points: the nearest points after a translation by slightly more than the depth. If the normal was not
  // optimal, these points give a better one.
  const double gap = 1e-4 * pair.scale();
  CorePair apart = pair;
  Penetration result{};
  for (int step = 0; step < 30; ++step) {
    apart.X_AB.p = pair.X_AB.p + (minimum.depth + gap) * minimum.normal;
    const ConvexDistance touch = convex_distance(apart);
    result = {minimum.depth, minimum.normal, touch.point_a, touch.point_a - minimum.depth * minimum.normal};
    minimum.offer((-1 / norm(touch.difference)) * touch.difference);
    if (!(minimum.depth < result.depth - 1e-13 * pair.scale())) break;
  }
  return result;
}

}  // namespace grapnel
