#include "grapnel/contact/contact_shape.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

namespace grapnel {

namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

void check(const Geometry& geometry) {
  using Shape = Geometry::Shape;
  if (geometry.shape == Shape::none) throw std::invalid_argument("ContactShape: the geometry has no shape");
  const bool is_mesh = geometry.shape == Shape::mesh;
  if (is_mesh && (!geometry.mesh || geometry.mesh->hull.is_empty())) {
    throw std::invalid_argument("ContactShape: the mesh has no volume");
  }
  const int sizes = geometry.shape == Shape::sphere ? 1 : geometry.shape == Shape::box || is_mesh ? 3 : 2;
  for (int k = 0; k < sizes; ++k) {
    const double size = is_mesh ? std::abs(geometry.size[k]) : geometry.size[k];
    if (!(size > 0) || !std::isfinite(size)) throw std::invalid_argument("ContactShape: a size must be positive");
  }
}

bool is_identity_matrix(const Rotationd& R) {
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      if (R(i, j) != (i == j ? 1.0 : 0.0)) return false;
    }
  }
  return true;
}

// Distance and normal from the vector that leads from the nearest point of the core to a point outside.
CoreDistance outside(const Vector3d& v, double distance) { return {distance, (1 / distance) * v}; }

CoreDistance distance_to_box(const Vector3d& half, const Vector3d& p) {
  Vector3d v;
  for (int k = 0; k < 3; ++k) v[k] = p[k] - std::clamp(p[k], -half[k], half[k]);
  const double d = norm(v);
  if (d > 0) return outside(v, d);
  int k = 0;
  for (int i = 1; i < 3; ++i) {
    if (half[i] - std::abs(p[i]) < half[k] - std::abs(p[k])) k = i;
  }
  Vector3d n = Vector3d::zero();
  n[k] = p[k] < 0 ? -1 : 1;
  return {std::abs(p[k]) - half[k], n};
}

CoreDistance distance_to_cylinder(double radius, double half_length, const Vector3d& p) {
  const double rho = std::hypot(p[0], p[1]);
  const double radial = rho - radius, axial = std::abs(p[2]) - half_length;
  const Vector3d n_radial = rho > 0 ? Vector3d{p[0] / rho, p[1] / rho, 0} : Vector3d{1, 0, 0};
  const Vector3d n_axial{0, 0, p[2] < 0 ? -1.0 : 1.0};
  if (radial > 0 && axial > 0) return outside(radial * n_radial + axial * n_axial, std::hypot(radial, axial));
  if (radial > axial) return {radial, n_radial};
  return {axial, n_axial};
}

}  // namespace

ContactShape::ContactShape(const Geometry& geometry) : mesh_(geometry.mesh) {
  check(geometry);
  core_ = core_of(geometry);
  X_BC_ = core_pose(geometry);
  is_aligned_ = is_identity_matrix(X_BC_.R);
  half_extents_ = {std::abs(core_.half[0]), std::abs(core_.half[1]), std::abs(core_.half[2])};
  bounding_core_ = core_;
  switch (geometry.shape) {
    case Geometry::Shape::sphere:
      kind_ = Kind::sphere, thickness_ = core_.rounding;
      break;
    case Geometry::Shape::capsule:
      kind_ = Kind::capsule, thickness_ = core_.rounding;
      break;
    case Geometry::Shape::cylinder:
      kind_ = Kind::cylinder, thickness_ = std::min(core_.half[0], core_.half[2]);
      add_prism_faces();
      break;
    case Geometry::Shape::box:
      kind_ = Kind::polyhedron, thickness_ = *std::min_element(core_.half.e, core_.half.e + 3);
      add_box_faces();
      break;
    default:
      kind_ = Kind::polyhedron;
      add_hull_faces();
      break;
  }
  const Vector3d& h = half_extents_;
  reach_ = core_.rounding + (core_.round ? std::hypot(std::max(h[0], h[1]), h[2]) : norm(h));
}

ContactShape ContactShape::half_space(const Posed& X_BG) {
  ContactShape shape;
  shape.X_BC_ = X_BG;
  shape.is_aligned_ = is_identity_matrix(X_BG.R);
  shape.faces_ = {{{0, 0, 1}, 0}};
  shape.half_extents_ = {kInfinite, kInfinite, kInfinite};
  shape.reach_ = shape.thickness_ = kInfinite;
  return shape;
}

void ContactShape::add_box_faces() {
  for (int k = 0; k < 3; ++k) {
    faces_.push_back({Vector3d::unit(k), core_.half[k]});
    faces_.push_back({-Vector3d::unit(k), core_.half[k]});
  }
}

// The apothem gives the prism the area of the circle; its corners lie slightly outside of the cylinder.
void ContactShape::add_prism_faces() {
  constexpr double kStep = 2 * std::numbers::pi / kPrismFaces;
  const double apothem = core_.half[0] * std::sqrt(0.5 * kStep / std::tan(0.5 * kStep));
  for (int i = 0; i < kPrismFaces; ++i) {
    faces_.push_back({{std::cos(kStep * i), std::sin(kStep * i), 0}, apothem});
  }
  faces_.push_back({{0, 0, 1}, core_.half[2]});
  faces_.push_back({{0, 0, -1}, core_.half[2]});
  const double corner = apothem / std::cos(0.5 * kStep);
  bounding_core_.half[0] = bounding_core_.half[1] = corner;
  half_extents_[0] = half_extents_[1] = corner;
}

void ContactShape::add_hull_faces() {
  map_ = std::make_shared<SupportMap>(*core_.hull, core_.scale);
  core_.map = bounding_core_.map = map_.get();
  Vector3d mean = Vector3d::zero();
  for (const Vector3d& v : map_->vertices()) mean += (1.0 / static_cast<double>(map_->vertices().size())) * v;
  thickness_ = kInfinite;
  for (std::size_t i = 0; i < core_.hull->normals.size(); ++i) {
    const Vector3d n = core_.scaled_normal(core_.hull->normals[i]);
    const double length = norm(n);
    faces_.push_back({(1 / length) * n, core_.hull->offsets[i] / length});
    thickness_ = std::min(thickness_, faces_.back().offset - dot(faces_.back().normal, mean));
  }
}

CoreDistance ContactShape::distance_to_faces(const Vector3d& p) const {
  CoreDistance nearest{-kInfinite, {0, 0, 1}};
  for (const FacePlane& face : faces_) {
    const double d = dot(face.normal, p) - face.offset;
    if (d > nearest.distance) nearest = {d, face.normal};
  }
  return nearest;
}

CoreDistance ContactShape::distance(const Vector3d& p) const {
  if (kind_ == Kind::half_space) return {p[2], {0, 0, 1}};
  if (kind_ == Kind::cylinder) return distance_to_cylinder(core_.half[0], core_.half[2], p);
  if (!core_.hull) {
    if (core_.is_segment()) {
      const Vector3d v{p[0], p[1], p[2] - std::clamp(p[2], -core_.half[2], core_.half[2])};
      const double d = norm(v);
      return d > 0 ? outside(v, d) : CoreDistance{0, {1, 0, 0}};
    }
    return distance_to_box(core_.half, p);
  }
  const ConvexCore point;
  const ConvexDistance d = convex_distance({core_, point, {Rotationd::identity(), p}});
  if (!d.separated) return distance_to_faces(p);
  return outside(-d.difference, norm(d.difference));
}

}  // namespace grapnel
