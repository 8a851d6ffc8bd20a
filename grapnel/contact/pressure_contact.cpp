#include <algorithm>
#include <cmath>
#include <limits>

#include "grapnel/contact/contact_element.hpp"

namespace grapnel {

// The pressure of a polyhedron is the minimum of the fields of its faces (23.8). The surface of equal pressure consists
// of one polygon for each pair of faces i of A and j of B,
//
//   P_ij = {x : f_i(x) = f_j(x), 0 <= f_i(x) <= f_k(x) for all faces k of A and B}.
//
// The same cut with i and j of one body gives the walls between the cells of its faces, which the energy needs.

namespace {

// Two unit vectors perpendicular to the unit vector n and to each other.
void sides_of(const Vector3d& n, Vector3d& u, Vector3d& v) {
  u = cross(n, Vector3d::unit(std::abs(n[0]) < 0.6 ? 0 : 1));
  u *= 1 / norm(u);
  v = cross(n, u);
}

bool is_simple(const ContactShape& shape) { return shape.faces().size() <= 6; }

// Farthest distance along n of the posed shape B, in A's frame.
double reach_along(const ContactShape& b, const Posed& X_AB, const Vector3d& n) {
  const Vector3d n_B = transposed_times(X_AB.R, n);
  return dot(n, X_AB.p) + dot(n_B, b.support_point(n_B));
}
double reach_along(const ContactShape& a, const Vector3d& n) { return dot(n, a.support_point(n)); }

// Half extents along A's axes of the box around B.
Vector3d turned_extents(const Rotationd& R, const Vector3d& half) {
  Vector3d e;
  for (int i = 0; i < 3; ++i) {
    e[i] = std::abs(R(i, 0)) * half[0] + std::abs(R(i, 1)) * half[1] + std::abs(R(i, 2)) * half[2];
  }
  return e;
}

}  // namespace

PressureContact::PressureContact(const ContactShapes& shapes) {
  const std::size_t faces = shapes.a.faces().size() + shapes.b.faces().size();
  fields_.reserve(faces), cells_.reserve(faces), is_least_.reserve(faces);
  // Every cut adds one corner, except for rounding errors: by fields, the region's box, and bounds of the pressure.
  reserve_corners(2 * (faces + 16));
}

void PressureContact::reserve_corners(std::size_t corners) {
  polygon_.resize(corners), clipped_.resize(corners), inside_.resize(corners);
}

void PressureContact::offer(const Vector3d& n, double overlap) {
  if (overlap < overlap_) overlap_ = overlap, direction_ = n;
}

// Improves the direction of overlap: after a translation along it that separates both shapes, their nearest points give
// a better one. No step depends on an earlier call.
void PressureContact::descend(const ContactShapes& shapes, const Posed& X_AB) {
  const auto overlap_along = [&](const Vector3d& n) {
    return reach_along(shapes.a, n) + reach_along(shapes.b, X_AB, -n);
  };
  offer(direction_, overlap_along(direction_));
  CorePair apart{shapes.a.bounding_core(), shapes.b.bounding_core(), X_AB};
  const double gap = 1e-4 * apart.scale();
  for (int round = 0; round < 8 && overlap_ > 0; ++round) {
    apart.X_AB.p = X_AB.p + (1.1 * overlap_ + gap) * direction_;
    const ConvexDistance touch = convex_distance(apart);
    const double length = norm(touch.difference);
    if (!(length > 0)) return;
    const Vector3d n = (-1 / length) * touch.difference;
    const double before = overlap_;
    offer(n, overlap_along(n));
    if (!(overlap_ < 0.95 * before)) return;
  }
}

// Shapes => a direction from A to B along which they overlap little; false if one separates them.
bool PressureContact::find_direction(const ContactShapes& shapes, const Posed& X_AB) {
  overlap_ = std::numeric_limits<double>::infinity();
  const Rotationd& R = X_AB.R;
  if (shapes.b.kind() == ContactShape::Kind::half_space) {
    const Vector3d n = -R.column(2);
    offer(n, reach_along(shapes.a, n) - dot(n, X_AB.p));
    return overlap_ > 0;
  }
  const Vector3d &a = shapes.a.half_extents(), &b = shapes.b.half_extents();
  const auto offer_axis = [&](const Vector3d& axis, double extent) {
    const double along = dot(axis, X_AB.p);
    offer(along < 0 ? -axis : axis, extent - std::abs(along));
    return overlap_ > 0;
  };
  const Vector3d b_in_a = turned_extents(R, b), a_in_b = turned_extents(transpose(R), a);
  for (int i = 0; i < 3; ++i) {
    if (!offer_axis(Vector3d::unit(i), a[i] + b_in_a[i]) || !offer_axis(R.column(i), b[i] + a_in_b[i])) return false;
  }
  for (int i = 0; i < 9; ++i) {
    const Vector3d u = Vector3d::unit(i / 3), v = R.column(i % 3), n = cross(u, v);
    const double length = norm(n);
    if (!(length > 1e-6)) continue;
    const Vector3d axis = (1 / length) * n, axis_B = transposed_times(R, axis);
    double extent = 0;
    for (int k = 0; k < 3; ++k) extent += a[k] * std::abs(axis[k]) + b[k] * std::abs(axis_B[k]);
    if (!offer_axis(axis, extent)) return false;
  }
  if (!is_simple(shapes.a) || !is_simple(shapes.b)) descend(shapes, X_AB);
  return overlap_ > 0;
}

// Direction and overlap => a smaller sphere and, for shapes of many faces, a box around it: for each lateral direction
// t and any factor s >= 0, points x of the overlap satisfy dot(t, x) <= h_A(t + s n) - s (h_A(n) - overlap), and
// likewise for B.
void PressureContact::narrow(const ContactShapes& shapes, const Posed& X_AB) {
  const Vector3d& n = direction_;
  const bool plane = shapes.b.kind() == ContactShape::Kind::half_space;
  const double top_a = reach_along(shapes.a, n);
  const double top_b = plane ? 0 : reach_along(shapes.b, X_AB, -n);
  Vector3d side[2];
  sides_of(n, side[0], side[1]);
  Vector3d center = (top_a - 0.5 * overlap_) * n, half{0, 0, 0.5 * overlap_};
  for (int k = 0; k < 2; ++k) {
    const Vector3d& t = side[k];
    double limit[2];
    for (int sign = 0; sign < 2; ++sign) {
      const Vector3d d = sign ? -t : t;
      limit[sign] = std::numeric_limits<double>::infinity();
      for (const double s : {0.0, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0}) {
        limit[sign] = std::min(limit[sign], reach_along(shapes.a, d + s * n) - s * (top_a - overlap_));
        if (plane) continue;
        limit[sign] = std::min(limit[sign], reach_along(shapes.b, X_AB, d - s * n) - s * (top_b - overlap_));
      }
    }
    center += 0.5 * (limit[0] - limit[1]) * t;
    half[k] = 0.5 * (limit[0] + limit[1]);
  }
  half = 1.001 * half;  // faces of the shapes may lie in the box's sides
  const double radius = norm(half);
  if (boxed_ || radius < region_.radius) region_ = {center, radius, {side[0], side[1], n}, half};
}

// Shapes => the fields of the faces near the overlap, A's before B's; false if there is no overlap.
bool PressureContact::collect(const ContactShapes& shapes, const Posed& X_AB) {
  fields_.clear();
  if (!find_direction(shapes, X_AB)) return false;
  boxed_ = !is_simple(shapes.a) || !is_simple(shapes.b);
  const Vector3d& a = shapes.a.half_extents();
  region_ = {Vector3d::zero(), norm(a), {}, Vector3d::zero()};
  if (shapes.b.kind() != ContactShape::Kind::half_space) {
    const Vector3d b = turned_extents(X_AB.R, shapes.b.half_extents());
    Vector3d half;
    for (int k = 0; k < 3; ++k) {
      const double low = std::max(-a[k], X_AB.p[k] - b[k]), high = std::min(a[k], X_AB.p[k] + b[k]);
      region_.center[k] = 0.5 * (low + high), half[k] = 0.5 * (high - low);
    }
    region_.radius = norm(half);
  }
  narrow(shapes, X_AB);
  bound_ = shapes.pressure * overlap_ * (1 + 1e-9);
  const auto add = [&](double slope, const Vector3d& normal, double offset) {
    const Field field{slope * normal, slope * offset};
    if (field.at(region_.center) - slope * region_reach(normal, 0) <= bound_) fields_.push_back(field);
  };
  cells_.clear();
  for (const FacePlane& face : shapes.a.faces()) add(shapes.pressure_a, face.normal, face.offset);
  too_many_ = false;
  prune(0);
  count_a_ = fields_.size();
  for (const FacePlane& face : shapes.b.faces()) {
    const Vector3d n = X_AB.R * face.normal;
    add(shapes.pressure_b, n, face.offset + dot(n, X_AB.p));
  }
  prune(count_a_);
  lowest_a_ = 0, lowest_b_ = fields_.size() > count_a_ ? count_a_ : 0;
  for (std::size_t k = 0; k < fields_.size(); ++k) {
    std::size_t& lowest = k < count_a_ ? lowest_a_ : lowest_b_;
    if (fields_[k].at(region_.center) < fields_[lowest].at(region_.center)) lowest = k;
  }
  return true;
}

// The fields of one shape, from `first` on => those that are the least somewhere near the overlap. The nearest face of
// a point is that on which it projects, at most bound_ / slope away; a face without such points has no polygon here.
void PressureContact::prune(std::size_t first) {
  constexpr std::size_t kFew = 8, kMany = 400;
  if (fields_.size() <= first + kFew) {
    cells_.resize(fields_.size(), {Vector3d::zero(), std::numeric_limits<double>::infinity()});
    return;
  }
  const auto begin = fields_.begin() + static_cast<std::ptrdiff_t>(first);
  if (fields_.size() > first + kMany) {
    too_many_ = true;
    std::nth_element(begin, begin + kMany, fields_.end(),
                     [&](const Field& f, const Field& g) { return f.at(region_.center) < g.at(region_.center); });
    fields_.resize(first + kMany);
  }
  is_least_.assign(fields_.size(), 1);
  cells_.resize(fields_.size());
  std::size_t rejecting = first;  // the field that rejected the previous one often rejects the next one
  for (std::size_t i = first; i < fields_.size(); ++i) {
    const double slope = norm(fields_[i].gradient);
    const std::size_t tried = rejecting;
    is_least_[i] = begin_polygon((1 / slope) * fields_[i].gradient, fields_[i].constant / slope, bound_ / slope) &&
                   (tried == i || clip(fields_[tried]));
    for (std::size_t k = first; is_least_[i] && k < fields_.size(); ++k) {
      if (k != i && k != tried && !clip(fields_[k])) is_least_[i] = 0, rejecting = k;
    }
    if (is_least_[i]) cells_[i] = cell_of_polygon(bound_ / slope);
  }
  std::size_t kept = first;
  for (std::size_t i = first; i < fields_.size(); ++i) {
    if (is_least_[i]) cells_[kept] = cells_[i], fields_[kept++] = fields_[i];
  }
  fields_.resize(kept), cells_.resize(kept);
}

// The polygon of a face => a sphere around all points at most `margin` away from it.
PressureContact::Cell PressureContact::cell_of_polygon(double margin) const {
  Cell cell{Vector3d::zero(), 0};
  for (std::size_t i = 0; i < corners_; ++i) cell.center += polygon_[i];
  cell.center *= 1.0 / static_cast<double>(corners_);
  double square = 0;
  for (std::size_t i = 0; i < corners_; ++i) {
    const Vector3d r = polygon_[i] - cell.center;
    square = std::max(square, dot(r, r));
  }
  cell.radius = 1.001 * (std::sqrt(square) + margin);
  return cell;
}

// Farthest distance from the region's centre along a unit vector of points that polygons may have: of the box enlarged
// by a margin, or of a square around a section of the sphere, which reaches at most sqrt(3) of its radius.
double PressureContact::region_reach(const Vector3d& normal, double margin) const {
  if (!boxed_) return 1.7321 * region_.radius + margin;
  double reach = 0;
  for (int k = 0; k < 3; ++k) reach += std::abs(dot(normal, region_.axes[k])) * (region_.half[k] + margin);
  return reach;
}

// Keeps the part of the polygon where the field is not negative; false if there is none.
bool PressureContact::clip(const Field& field) {
  const std::size_t n = corners_;
  if (2 * n > clipped_.size()) reserve_corners(4 * n);
  double* const inside = inside_.data();
  const Vector3d* const from = polygon_.data();
  bool all = true, none = true;
  for (std::size_t i = 0; i < n; ++i) {
    inside[i] = field.at(from[i]);
    (inside[i] < 0 ? all : none) = false;
  }
  if (all) return true;
  if (none) return false;
  Vector3d* to = clipped_.data();
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t j = i + 1 < n ? i + 1 : 0;
    if (inside[i] >= 0) *to++ = from[i];
    if ((inside[i] >= 0) != (inside[j] >= 0)) {
      const double t = inside[i] / (inside[i] - inside[j]);
      *to++ = from[i] + t * (from[j] - from[i]);
    }
  }
  corners_ = static_cast<std::size_t>(to - clipped_.data());
  polygon_.swap(clipped_);
  return corners_ >= 3;
}

// A square on a plane around its section with the region enlarged by a margin, or that section if the region is a box
// => polygon_; false if the plane misses it.
bool PressureContact::begin_polygon(const Vector3d& normal, double offset, double margin) {
  const double height = dot(normal, region_.center) - offset;
  const double radius = region_.radius + 1.7321 * margin;
  if (!(std::abs(height) <= (boxed_ ? region_reach(normal, margin) : radius))) return false;
  const Vector3d foot = region_.center - height * normal;
  Vector3d u, v;
  sides_of(normal, u, v);
  corners_ = 4;
  polygon_[0] = foot + radius * (u + v), polygon_[1] = foot + radius * (v - u);
  polygon_[2] = foot - radius * (u + v), polygon_[3] = foot + radius * (u - v);
  if (!boxed_) return true;
  for (int k = 0; k < 3; ++k) {
    const Vector3d& axis = region_.axes[k];
    const double middle = dot(axis, region_.center), half = region_.half[k] + margin;
    if (!clip({axis, middle + half}) || !clip({-axis, half - middle})) return false;
  }
  return true;
}

// The part of a plane within the overlap where the pressure `base`, zero or one field's, is the least => polygon_. On
// the plane the fields i and j equal base.
bool PressureContact::cut(const Vector3d& normal, double offset, const Field& base, std::size_t i, std::size_t j) {
  if (!begin_polygon(normal, offset, 0)) return false;
  if (!clip(base) || !clip({-base.gradient, bound_ - base.constant})) return false;
  // Those first that probably leave nothing.
  const auto is_above = [&](std::size_t k) {
    if (k == i || k == j) return true;  // equal to base except for rounding errors
    const Field& field = fields_[k];
    return clip({field.gradient - base.gradient, field.constant - base.constant});
  };
  if (!is_above(lowest_a_) || !is_above(lowest_b_)) return false;
  for (std::size_t k = 0; k < fields_.size(); ++k) {
    if (k != lowest_a_ && k != lowest_b_ && !is_above(k)) return false;
  }
  return true;
}

double PressureContact::area_and_centroid(const Vector3d& normal, Vector3d& centroid) const {
  const Vector3d& origin = polygon_[0];
  double twice = 0;
  Vector3d moment = Vector3d::zero();
  for (std::size_t i = 1; i + 1 < corners_; ++i) {
    const Vector3d p = polygon_[i] - origin, q = polygon_[i + 1] - origin;
    const double part = dot(normal, cross(p, q));
    twice += part;
    moment += (part / 3) * (p + q);
  }
  centroid = twice > 0 ? origin + (1 / twice) * moment : origin;
  return 0.5 * twice;
}

// A polygon => elements at the middles of all edges of the triangles that its centroid forms with its edges: exact for
// the force and the moment of a linear pressure, and continuous when vertices merge.
void PressureContact::add_polygon(const ContactShapes& shapes, const Field& field, const Vector3d& normal,
                                  ContactElements& elements) {
  Vector3d centroid;
  if (!(area_and_centroid(normal, centroid) > 0)) return;
  const auto add = [&](const Vector3d& x, double area) {
    const double p = field.at(x);
    if (!(p * area > 0)) return;
    elements.list.push_back(
        {x, normal, p * area, p / shapes.pressure, area / shapes.reference_area, area, elements.patches});
  };
  const auto triangle = [&](std::size_t i) {
    const Vector3d &p = polygon_[i], &q = polygon_[i + 1 < corners_ ? i + 1 : 0];
    return std::max(0.0, dot(normal, cross(p - centroid, q - centroid)) / 6);  // a third of its area
  };
  double before = triangle(corners_ - 1);
  for (std::size_t i = 0; i < corners_; ++i) {
    const double after = triangle(i);
    const Vector3d& next = polygon_[i + 1 < corners_ ? i + 1 : 0];
    add(0.5 * (centroid + polygon_[i]), before + after);
    add(0.5 * (polygon_[i] + next), after);
    before = after;
  }
  ++elements.patches;
}

void PressureContact::add(const ContactShapes& shapes, const Posed& X_AB, ContactElements& elements) {
  if (!collect(shapes, X_AB)) return;
  for (std::size_t i = 0; i < count_a_; ++i) {
    for (std::size_t j = count_a_; j < fields_.size(); ++j) {
      const double apart = cells_[i].radius + cells_[j].radius;
      const Vector3d between = cells_[i].center - cells_[j].center;
      if (dot(between, between) > apart * apart) continue;
      const Field &a = fields_[i], &b = fields_[j];
      Vector3d n = a.gradient - b.gradient;
      const double length = norm(n);
      if (!(length > 1e-12 * shapes.pressure)) continue;
      n *= 1 / length;
      if (cut(n, (a.constant - b.constant) / length, a, i, j)) add_polygon(shapes, a, n, elements);
    }
  }
  // Without a surface of equal pressure one shape may be inside of the other.
  double deepest = elements.list.empty() ? overlap_ : 0;
  for (const ContactElement& e : elements.list) deepest = std::max(deepest, e.depth);
  elements.beyond_model = too_many_ || deepest > std::min(shapes.a.thickness(), shapes.b.thickness());
}

// The overlap with height min f over it is a polytope in four dimensions whose volume is the energy. Its faces' faces
// are the polygons between cells and those on the shapes' faces (23.12).
double PressureContact::energy(const ContactShapes& shapes, const Posed& X_AB) {
  if (!collect(shapes, X_AB)) return 0;
  double energy = 0;
  Vector3d centroid;
  const Vector3d& c = region_.center;
  for (std::size_t i = 0; i < fields_.size(); ++i) {
    const Field& f = fields_[i];
    const double slope = norm(f.gradient), value = f.at(c);
    const Vector3d n = (1 / slope) * f.gradient;
    if (cut(n, f.constant / slope, {Vector3d::zero(), 0}, i, i)) {
      energy += value * value * area_and_centroid(n, centroid) / slope;
    }
    for (std::size_t j = i + 1; j < fields_.size(); ++j) {
      const Field& g = fields_[j];
      const Vector3d across = f.gradient - g.gradient;
      const double length = norm(across), difference = value - g.at(c);
      if (!(length > 1e-12 * shapes.pressure)) continue;
      const Vector3d normal = (1 / length) * across;
      if (!cut(normal, (f.constant - g.constant) / length, f, i, j)) continue;
      energy -= difference * difference * area_and_centroid(normal, centroid) / length;
    }
  }
  return energy / 12;
}

}  // namespace grapnel
