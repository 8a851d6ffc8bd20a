#include "grapnel/clearance/clearance_model.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "grapnel/clearance/convex_distance.hpp"

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

// Bodies that cannot move against each other form a group, named by its first body; bodies fixed to the world form one
// more, named by the number of bodies.
class Groups {
 public:
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
  // In the frame of A, the fastest point of B's bounding sphere: motion that the bodies share does not count.
  const ClearancePair& p = pairs_.at(pair);
  const Twistd& V_WA = kinematics.V_WB[p.body_a];
  const Twistd& V_WB = kinematics.V_WB[p.body_b];
  const Posed& X_WB = kinematics.X_WB[p.body_b];
  const Vector3d center = X_WB * bounds_[p.shape_b].center;
  const Vector3d v_A = V_WA.linear + cross(V_WA.angular, center - kinematics.X_WB[p.body_a].p);
  const Vector3d v_B = V_WB.linear + cross(V_WB.angular, center - X_WB.p);
  return norm(v_B - v_A) + norm(V_WB.angular - V_WA.angular) * bounds_[p.shape_b].reach;
}

Clearance ClearanceModel::minimum(const Kinematics& kinematics) const {
  Clearance best;
  if (pairs_.empty()) return best;
  std::vector<PlacedBounds> at(shapes_.size());
  for (int i = 0; i < static_cast<int>(at.size()); ++i) at[i] = placed(i, kinematics);
  const auto bound = [&](const ClearancePair& p) {
    return sphere_bound(p, at[p.shape_a].center, at[p.shape_b].center);
  };
  const auto measure = [&](int pair) {
    const ShapeDistance d = distance(pair, kinematics);
    if (!(d.distance >= best.distance)) {
      best = {d.distance, pair, pairs_[pair].body_a, pairs_[pair].body_b, d.point_a, d.point_b, d.normal};
    }
  };
  // First the pair that looks nearest: most others are then excluded by their spheres alone.
  const auto nearest = std::ranges::min_element(pairs_, {}, bound);
  const int first = static_cast<int>(nearest - pairs_.begin());
  measure(first);
  for (int i = 0; i < static_cast<int>(pairs_.size()); ++i) {
    const ClearancePair& p = pairs_[i];
    if (i == first || bound(p) >= best.distance) continue;
    // Depths of cylinders are upper bounds, which those of capsules need not be below; so capsules exclude only pairs
    // that do not overlap.
    if (capsule_bound(p, at[p.shape_a], at[p.shape_b]) >= std::max(best.distance, 0.0)) continue;
    measure(i);
  }
  return best;
}

}  // namespace grapnel
