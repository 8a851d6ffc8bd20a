#include "grapnel/contact/clearance_model.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "grapnel/contact/convex_distance.hpp"

namespace grapnel {

namespace {

// Whether a shape has a volume.
bool has_valid_size(const Geometry& geometry) {
  const Vector3d& s = geometry.size;
  const auto positive = [](double x) { return x > 0 && std::isfinite(x); };
  switch (geometry.shape) {
    case Geometry::Shape::box:
      return positive(s[0]) && positive(s[1]) && positive(s[2]);
    case Geometry::Shape::cylinder:
      return positive(s[0]) && positive(s[1]);
    case Geometry::Shape::capsule:
      return positive(s[0]) && s[1] >= 0 && std::isfinite(s[1]);
    case Geometry::Shape::sphere:
      return positive(s[0]);
    case Geometry::Shape::mesh:
      return geometry.mesh && !geometry.mesh->hull.is_empty() && positive(s[0]) && positive(s[1]) && positive(s[2]);
    case Geometry::Shape::none:
      break;
  }
  return true;
}

// Shapes and ignored pairs => nothing; throws std::invalid_argument with the name of the body if a body index, a size
// or a mesh is invalid.
void check(const Model& model, const std::vector<BodyShape>& shapes, std::span<const std::pair<int, int>> ignored) {
  const auto is_body = [&](int i) { return i >= 0 && i < static_cast<int>(model.bodies().size()); };
  for (const BodyShape& s : shapes) {
    if (!is_body(s.body)) {
      throw std::invalid_argument("ClearanceModel: a shape is on body " + std::to_string(s.body) +
                                  ", which the model does not have");
    }
    if (!has_valid_size(s.geometry)) {
      throw std::invalid_argument("ClearanceModel: the shape of body '" + model.bodies()[s.body].description.name +
                                  (s.geometry.shape == Geometry::Shape::mesh
                                       ? "' has no mesh with a hull, or a scale that is not positive and finite"
                                       : "' has a size that is not positive and finite"));
    }
  }
  for (const auto& [a, b] : ignored) {
    if (!is_body(a) || !is_body(b)) {
      throw std::invalid_argument("ClearanceModel: an ignored pair has a body that the model does not have");
    }
  }
}

// Bodies without relative motion form a group, identified by its first body; bodies fixed to the world form one more,
// identified by the number of bodies.
class Groups {
 public:
  // Bodies, parent before child => their groups, the parent of each group along the tree, and which groups have shapes.
  // Held bodies form groups without a parent, whatever their joint.
  Groups(const Model& model, const std::vector<BodyShape>& shapes, std::span<const int> held) {
    const int world = static_cast<int>(model.bodies().size());
    group_.resize(world);
    parent_.assign(world + 1, -1);
    shaped_.assign(world + 1, false);
    for (int i = 0; i < world; ++i) {
      const Body& body = model.bodies()[i];
      const int parent = body.parent < 0 ? world : group_[body.parent];
      const JointType joint = body.description.joint.type;
      const bool is_held = std::ranges::find(held, i) != held.end();
      group_[i] = joint == JointType::fixed && !is_held ? parent : i;
      if (group_[i] == i && joint != JointType::free && !is_held) parent_[i] = parent;
    }
    for (const BodyShape& s : shapes) shaped_[group_[s.body]] = true;
  }
  // Whether two bodies are in one group, or in groups that a joint connects (through groups without shapes).
  bool neighbours(int body_a, int body_b) const {
    const int a = group_[body_a], b = group_[body_b];
    return a == b || carrier(a) == b || carrier(b) == a;
  }

 private:
  int carrier(int group) const {
    for (group = parent_[group]; group >= 0 && !shaped_[group]; group = parent_[group]) {
    }
    return group;
  }

  std::vector<int> group_;    // per body
  std::vector<int> parent_;   // per group
  std::vector<bool> shaped_;  // per group
};

}  // namespace

// Shapes, ignored pairs and held bodies => bounds of each shape and all pairs of shapes except those of one group, of
// adjacent groups and of ignored bodies.
ClearanceModel::ClearanceModel(const Model& model, std::vector<BodyShape> shapes,
                               std::span<const std::pair<int, int>> ignored_pairs, std::span<const int> held)
    : shapes_(std::move(shapes)) {
  check(model, shapes_, ignored_pairs);
  std::erase_if(shapes_, [](const BodyShape& s) { return s.geometry.shape == Geometry::Shape::none; });
  for (const BodyShape& s : shapes_) bounds_.push_back(bounds_of(s.geometry));
  const Groups groups(model, shapes_, held);
  const auto is_ignored = [&](int a, int b) {
    return std::ranges::any_of(ignored_pairs,
                               [&](const auto& p) { return std::minmax(p.first, p.second) == std::minmax(a, b); });
  };
  for (int i = 0; i < static_cast<int>(shapes_.size()); ++i) {
    for (int j = i + 1; j < static_cast<int>(shapes_.size()); ++j) {
      const int a = shapes_[i].body, b = shapes_[j].body;
      if (groups.neighbours(a, b) || is_ignored(a, b)) continue;
      pairs_.push_back({i, j, a, b});
    }
  }
}

// Shape => bounding sphere and bounding capsule about the axis of a cylinder or the longest axis of a box, in the
// body's frame [m].
ClearanceModel::Bounds ClearanceModel::bounds_of(const Geometry& geometry) {
  const ConvexCore core = core_of(geometry);
  int longest = 2;
  if (!core.round) {
    for (int k = 0; k < 2; ++k) {
      if (core.half[k] > core.half[longest]) longest = k;
    }
  }
  Vector3d across = core.half;
  across[longest] = 0;
  const double slenderness = core.round ? core.half[0] : norm(across);
  return {core_pose(geometry).p, core.reach() + core.rounding, core.half[longest] * geometry.X_BG.R.column(longest),
          slenderness + core.rounding};
}

ClearanceModel::PlacedBounds ClearanceModel::placed(int shape, const Kinematics& kinematics) const {
  const Posed& X_WB = kinematics.X_WB[shapes_[shape].body];
  return {X_WB * bounds_[shape].center, X_WB.R * bounds_[shape].half_axis};
}

double ClearanceModel::sphere_bound(const ClearancePair& pair, const Vector3d& center_a,
                                    const Vector3d& center_b) const {
  return norm(center_b - center_a) - bounds_[pair.shape_a].reach - bounds_[pair.shape_b].reach;
}

double ClearanceModel::capsule_bound(const ClearancePair& pair, const PlacedBounds& a, const PlacedBounds& b) const {
  const ConvexDistance axes =
      segment_distance(a.center - a.half_axis, a.center + a.half_axis, b.center - b.half_axis, b.center + b.half_axis);
  return norm(axes.difference) - bounds_[pair.shape_a].slenderness - bounds_[pair.shape_b].slenderness;
}

ShapeDistance ClearanceModel::distance(int pair, const Kinematics& kinematics) const {
  const ClearancePair& p = pairs_.at(pair);
  return shape_distance(shapes_[p.shape_a].geometry, kinematics.X_WB[p.body_a], shapes_[p.shape_b].geometry,
                        kinematics.X_WB[p.body_b]);
}

double ClearanceModel::coarse_bound(int pair, const Kinematics& kinematics) const {
  const ClearancePair& p = pairs_.at(pair);
  return sphere_bound(p, kinematics.X_WB[p.body_a] * bounds_[p.shape_a].center,
                      kinematics.X_WB[p.body_b] * bounds_[p.shape_b].center);
}

double ClearanceModel::lower_bound(int pair, const Kinematics& kinematics) const {
  const ClearancePair& p = pairs_.at(pair);
  const PlacedBounds a = placed(p.shape_a, kinematics), b = placed(p.shape_b, kinematics);
  return std::max(sphere_bound(p, a.center, b.center), capsule_bound(p, a, b));
}

double ClearanceModel::speed_bound(int pair, const Kinematics& kinematics) const {
  // Maximum speed of B's bounding sphere in the frame of A: common motion of the bodies does not count.
  const ClearancePair& p = pairs_.at(pair);
  const Twistd& V_WA = kinematics.V_WB[p.body_a];
  const Twistd& V_WB = kinematics.V_WB[p.body_b];
  const Posed& X_WB = kinematics.X_WB[p.body_b];
  const Vector3d center = X_WB * bounds_[p.shape_b].center;
  const Vector3d v_A = V_WA.linear + cross(V_WA.angular, center - kinematics.X_WB[p.body_a].p);
  const Vector3d v_B = V_WB.linear + cross(V_WB.angular, center - X_WB.p);
  return norm(v_B - v_A) + norm(V_WB.angular - V_WA.angular) * bounds_[p.shape_b].reach;
}

// Body poses => minimum distance of all pairs that are not left out, with nearest points. Bounding spheres, then
// capsules exclude pairs; the remaining distances are exact.
Clearance ClearanceModel::minimum(const Kinematics& kinematics, const std::vector<bool>& left_out) const {
  Clearance best;
  std::vector<int> counted;
  for (int i = 0; i < static_cast<int>(pairs_.size()); ++i) {
    if (left_out.empty() || !left_out[i]) counted.push_back(i);
  }
  if (counted.empty()) return best;
  std::vector<PlacedBounds> at(shapes_.size());
  for (int i = 0; i < static_cast<int>(at.size()); ++i) at[i] = placed(i, kinematics);
  const auto bound = [&](int pair) {
    const ClearancePair& p = pairs_[pair];
    return sphere_bound(p, at[p.shape_a].center, at[p.shape_b].center);
  };
  const auto measure = [&](int pair) {
    const ShapeDistance d = distance(pair, kinematics);
    if (!(d.distance >= best.distance)) {
      best = {d.distance, pair, pairs_[pair].body_a, pairs_[pair].body_b, d.point_a, d.point_b, d.normal};
    }
  };
  // Starts with the pair with the smallest bound: most others are then excluded by their spheres alone.
  const int first = *std::ranges::min_element(counted, {}, bound);
  measure(first);
  for (int i : counted) {
    const ClearancePair& p = pairs_[i];
    if (i == first || bound(i) >= best.distance) continue;
    // Depths of cylinders are upper bounds, which may exceed those of capsules; therefore capsules exclude only pairs
    // that do not overlap.
    if (capsule_bound(p, at[p.shape_a], at[p.shape_b]) >= std::max(best.distance, 0.0)) continue;
    measure(i);
  }
  return best;
}

namespace {

// Distance, nearest points and normal of two cores in the frame of the first.

// A unit vector perpendicular to d and e as far as possible.
Vector3d any_normal(const Vector3d& d, const Vector3d& e) {
  const Vector3d n = cross(d, e);
  if (const double length = norm(n); length > 1e-9 * norm(d) * norm(e)) return (1 / length) * n;
  const Vector3d& along = norm(d) > norm(e) ? d : e;
  for (int k = 0; k < 3; ++k) {
    const Vector3d side = cross(along, Vector3d::unit(k));
    if (const double length = norm(side); length > 0.5 * norm(along) && length > 0) return (1 / length) * side;
  }
  return {1, 0, 0};
}

ShapeDistance segments(const CorePair& pair) {
  const Vector3d p{0, 0, pair.a.half[2]};
  const Vector3d q = pair.b.half[2] * pair.X_AB.R.column(2);
  const ConvexDistance found = segment_distance(-p, p, pair.X_AB.p - q, pair.X_AB.p + q);
  const double distance = norm(found.difference);
  // Crossing segments: a distance without a direction.
  const bool crossing = !(distance > 1e-14 * pair.scale());
  const Vector3d normal = crossing ? any_normal(p, q) : (-1 / distance) * found.difference;
  return {distance, found.point_a, found.point_b, normal};
}

// A hull and a point in its frame, which may be inside it.
ShapeDistance hull_and_point(const ConvexCore& core, const Vector3d& point) {
  const ConvexCore one{};
  const ConvexDistance found = convex_distance({core, one, {Rotationd::identity(), point}});
  const double distance = norm(found.difference);
  if (found.separated && distance > 1e-9 * core.reach())
    return {distance, found.point_a, point, (-1 / distance) * found.difference};
  double min_depth = std::numeric_limits<double>::infinity();
  Vector3d normal{1, 0, 0};
  // A plane n . x = o of the hull becomes (n / s) . x = o after scaling.
  for (std::size_t k = 0; k < core.hull->normals.size(); ++k) {
    const Vector3d n = core.scaled_normal(core.hull->normals[k]);
    const double length = norm(n), depth = (core.hull->offsets[k] - dot(n, point)) / length;
    if (depth < min_depth) min_depth = depth, normal = (1 / length) * n;
  }
  return {-min_depth, point + min_depth * normal, point, normal};
}

// A core and a point in its frame, which may be inside it.
ShapeDistance core_and_point(const ConvexCore& core, const Vector3d& point) {
  if (core.hull) return hull_and_point(core, point);
  // In cylindrical coordinates a cylinder is a rectangle; in each coordinate, the excess over the half extent.
  const double radius = std::hypot(point[0], point[1]);
  Vector3d outward[3], excess{-1, -1, -1};
  int count = 0;
  const auto direction = [&](const Vector3d& n, double along, double half) {
    outward[count] = n;
    excess[count++] = along - half;
  };
  if (core.round) {
    direction(radius > 0 ? Vector3d{point[0] / radius, point[1] / radius, 0} : Vector3d{1, 0, 0}, radius, core.half[0]);
    direction({0, 0, std::copysign(1.0, point[2])}, std::abs(point[2]), core.half[2]);
  } else {
    for (int k = 0; k < 3; ++k) {
      direction(std::copysign(1.0, point[k]) * Vector3d::unit(k), std::abs(point[k]), core.half[k]);
    }
  }
  Vector3d away = Vector3d::zero();
  int nearest = 0;
  for (int k = 0; k < count; ++k) {
    if (excess[k] > 0) away += excess[k] * outward[k];
    if (excess[k] > excess[nearest]) nearest = k;
  }
  // Outside: norm of the excesses; inside: distance to the nearest surface.
  double distance = norm(away);
  Vector3d normal = outward[nearest];
  if (distance > 0) {
    normal = (1 / distance) * away;
  } else {
    distance = excess[nearest];
  }
  return {distance, point - distance * normal, point, normal};
}

// Distance from A to B => distance from B to A: points exchanged, normal reversed.
ShapeDistance reversed(const ShapeDistance& d) { return {d.distance, d.point_b, d.point_a, -d.normal}; }

// Refines the nearest points of separated cores, which are not exact for cylinders: each in turn is replaced by the
// point of its core nearest to the other.
ConvexDistance sharpened(const CorePair& pair, ConvexDistance d) {
  const Posed X_BA = inverse(pair.X_AB);
  double square = dot(d.difference, d.difference);
  for (int step = 0; step < 20; ++step) {
    const Vector3d point_b = pair.X_AB * core_and_point(pair.b, X_BA * d.point_a).point_a;
    const Vector3d point_a = core_and_point(pair.a, point_b).point_a;
    const Vector3d difference = point_a - point_b;
    if (!(dot(difference, difference) < square)) break;
    square = dot(difference, difference);
    d = {true, point_a, point_b, difference};
  }
  return d;
}

ShapeDistance general(const CorePair& pair) {
  ConvexDistance found = convex_distance(pair);
  if (found.separated && (pair.a.round || pair.b.round)) found = sharpened(pair, found);
  const double distance = norm(found.difference);
  // Close to contact the difference of the points loses its direction; the search over directions does not.
  if (found.separated && distance > 1e-9 * pair.scale()) {
    return {distance, found.point_a, found.point_b, (-1 / distance) * found.difference};
  }
  const Penetration overlap = penetration(pair);
  return {-overlap.depth, overlap.point_a, overlap.point_b, overlap.normal};
}

ShapeDistance core_distance(const CorePair& pair) {
  if (pair.a.is_segment() && pair.b.is_segment()) return segments(pair);
  if (pair.b.is_point()) return core_and_point(pair.a, pair.X_AB.p);
  if (pair.a.is_point()) {
    const ShapeDistance d = core_and_point(pair.b, inverse(pair.X_AB).p);
    return reversed({d.distance, pair.X_AB * d.point_a, Vector3d::zero(), pair.X_AB.R * d.normal});
  }
  return general(pair);
}

}  // namespace

ShapeDistance shape_distance(const Geometry& a, const Posed& X_WA, const Geometry& b, const Posed& X_WB) {
  if (a.shape == Geometry::Shape::none || b.shape == Geometry::Shape::none) {
    return {std::numeric_limits<double>::infinity(), X_WA.p, X_WB.p, {1, 0, 0}};
  }
  const Posed X_WG = X_WA * core_pose(a);
  const ConvexCore core_a = core_of(a), core_b = core_of(b);
  const ShapeDistance d = core_distance({core_a, core_b, inverse(X_WG) * (X_WB * core_pose(b))});
  return {d.distance - core_a.rounding - core_b.rounding, X_WG * (d.point_a + core_a.rounding * d.normal),
          X_WG * (d.point_b - core_b.rounding * d.normal), X_WG.R * d.normal};
}

}  // namespace grapnel
