#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "grapnel/contact/contact_element.hpp"
#include "grapnel/contact/few_corners.hpp"

namespace grapnel {

// The pressure of a polyhedron is the minimum of the fields of its faces (23.8). The surface of equal pressure consists
// of one polygon for each pair of faces i of A and j of B,
//
//   P_ij = {x : f_i(x) = f_j(x), 0 <= f_i(x) <= f_k(x) for all faces k of A and B}.
//
// All of them are cut in coordinates relative to a point in the middle of the overlap, so that fields and corners have
// rounding errors in the order of the overlap's size.

namespace {

// Two unit vectors perpendicular to the unit vector n and to each other.
void sides_of(const Vector3d& n, Vector3d& u, Vector3d& v) {
  u = cross(n, Vector3d::unit(std::abs(n[0]) < 0.6 ? 0 : 1));
  u *= 1 / norm(u);
  v = cross(n, u);
}

constexpr double kWider = 1.001;  // faces of the shapes may lie in the sides of the region's box

bool is_simple(const ContactShape& shape) { return shape.faces().size() <= 6; }

// Farthest distance along n of the posed shape B, in A's frame.
double reach_along(const ContactShape& b, const Posed& X_AB, const Vector3d& n) {
  const Vector3d n_B = transposed_times(X_AB.R, n);
  return dot(n, X_AB.p) + dot(n_B, b.support_point(n_B));
}
double reach_along(const ContactShape& a, const Vector3d& n) { return dot(n, a.support_point(n)); }

// The factors s of PressureContact::narrow().
constexpr double kFactors[8] = {0, 1, 3, 10, 30, 100, 300, 300};

// The least of h(d + s n) - s top over all factors s, with the support function h of a shape. d and n in its frame.
double least_reach(const ContactShape& shape, const Vector3d& d, const Vector3d& n, double top) {
  double reach[8];
  const ConvexCore& core = shape.bounding_core();
  if (core.hull || core.round) {
    for (int i = 0; i < 8; ++i) reach[i] = reach_along(shape, d + kFactors[i] * n) - kFactors[i] * top;
  } else {
    for (int i = 0; i < 8; ++i) {
      const double s = kFactors[i];
      reach[i] = core.half[0] * std::abs(d[0] + s * n[0]) + core.half[1] * std::abs(d[1] + s * n[1]) +
                 core.half[2] * std::abs(d[2] + s * n[2]) - s * top;
    }
  }
  return *std::min_element(reach, reach + 8);
}

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
  fields_.reserve(faces), cells_.reserve(faces), rises_.reserve(faces), is_least_.reserve(faces), least_.reserve(faces);
  for (std::vector<double>& numbers : lines_) numbers.reserve(faces);
  apex_.reserve(faces), has_apex_.reserve(faces), volume_.reserve(faces);
  // Every cut adds one corner, except for rounding errors: by fields, the region's box, and bounds of the pressure.
  reserve_corners(2 * (faces + 16));
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

// Shapes => a direction from A to B along which they overlap little; false if one separates them. The direction
// found last is reused if the relative pose has the same bits.
bool PressureContact::find_direction(const ContactShapes& shapes, const Posed& X_AB) {
  if (!has_direction_ || std::memcmp(&X_AB, &directed_, sizeof directed_) != 0) {
    search_direction(shapes, X_AB);
    directed_ = X_AB, has_direction_ = true;
  }
  return overlap_ > 0;
}

void PressureContact::search_direction(const ContactShapes& shapes, const Posed& X_AB) {
  overlap_ = std::numeric_limits<double>::infinity();
  const Rotationd& R = X_AB.R;
  if (shapes.b.kind() == ContactShape::Kind::half_space) {
    const Vector3d n = -R.column(2);
    offer(n, reach_along(shapes.a, n) - dot(n, X_AB.p));
    return;
  }
  const Vector3d &a = shapes.a.half_extents(), &b = shapes.b.half_extents();
  const auto offer_axis = [&](const Vector3d& axis, double extent) {
    const double along = dot(axis, X_AB.p);
    offer(along < 0 ? -axis : axis, extent - std::abs(along));
    return overlap_ > 0;
  };
  const Vector3d b_in_a = turned_extents(R, b), a_in_b = turned_extents(transpose(R), a);
  for (int i = 0; i < 3; ++i) {
    if (!offer_axis(Vector3d::unit(i), a[i] + b_in_a[i]) || !offer_axis(R.column(i), b[i] + a_in_b[i])) return;
  }
  for (int i = 0; i < 9; ++i) {
    const Vector3d u = Vector3d::unit(i / 3), v = R.column(i % 3), n = cross(u, v);
    const double length = norm(n);
    if (!(length > 1e-6)) continue;
    const Vector3d axis = (1 / length) * n, axis_B = transposed_times(R, axis);
    double extent = 0;
    for (int k = 0; k < 3; ++k) extent += a[k] * std::abs(axis[k]) + b[k] * std::abs(axis_B[k]);
    if (!offer_axis(axis, extent)) return;
  }
  if (!is_simple(shapes.a) || !is_simple(shapes.b)) descend(shapes, X_AB);
}

bool PressureContact::has_overlap(const ContactShapes& shapes) {
  const auto is_polyhedron = [](const ContactShape& s) { return s.kind() == ContactShape::Kind::polyhedron; };
  if (!is_polyhedron(shapes.a)) return false;
  if (shapes.b.kind() == ContactShape::Kind::half_space) return true;
  return is_polyhedron(shapes.b) && !shapes.a.core().hull && !shapes.b.core().hull;
}

double PressureContact::overlap(const ContactShapes& shapes, const Posed& X_AB) {
  find_direction(shapes, X_AB);
  return overlap_;
}

// Shapes => the sphere and the box around what boxes around both have in common, or those of narrow().
void PressureContact::find_region(const ContactShapes& shapes, const Posed& X_AB) {
  const Vector3d& a = shapes.a.half_extents();
  boxed_ = !is_simple(shapes.a) || !is_simple(shapes.b);
  origin_ = Vector3d::zero();
  region_ = {norm(a), {Vector3d::unit(0), Vector3d::unit(1), Vector3d::unit(2)}, a};
  if (shapes.b.kind() != ContactShape::Kind::half_space) {
    const Vector3d b = turned_extents(X_AB.R, shapes.b.half_extents());
    Vector3d half;
    for (int k = 0; k < 3; ++k) {
      const double low = std::max(-a[k], X_AB.p[k] - b[k]), high = std::min(a[k], X_AB.p[k] + b[k]);
      origin_[k] = 0.5 * (low + high), half[k] = 0.5 * (high - low);
    }
    region_.radius = norm(half), region_.half = half;
  }
  narrow(shapes, X_AB);
}

// Direction and overlap => a smaller sphere and a box around it, always for shapes of many faces: for each lateral
// direction t and any factor s >= 0, points x of the overlap satisfy dot(t, x) <= h_A(t + s n) - s (h_A(n) - overlap),
// and likewise for B.
void PressureContact::narrow(const ContactShapes& shapes, const Posed& X_AB) {
  const Vector3d& n = direction_;
  const bool plane = shapes.b.kind() == ContactShape::Kind::half_space;
  const double top_a = reach_along(shapes.a, n);
  const double top_b = plane ? 0 : reach_along(shapes.b, X_AB, -n);
  // Of B, h_B(d - s n) = d.p - s n.p + h(R^T (d - s n)) with its position p.
  const double limit_a = top_a - overlap_, limit_b = top_b - overlap_ + dot(n, X_AB.p);
  const Vector3d n_B = -transposed_times(X_AB.R, n);
  Vector3d side[2];
  sides_of(n, side[0], side[1]);
  Vector3d center = (top_a - 0.5 * overlap_) * n, half{0, 0, 0.5 * overlap_};
  for (int k = 0; k < 2; ++k) {
    double limit[2];
    for (int sign = 0; sign < 2; ++sign) {
      const Vector3d d = sign ? -side[k] : side[k];
      limit[sign] = least_reach(shapes.a, d, n, limit_a);
      if (plane) continue;
      const double of_b = dot(d, X_AB.p) + least_reach(shapes.b, transposed_times(X_AB.R, d), n_B, limit_b);
      limit[sign] = std::min(limit[sign], of_b);
    }
    center += 0.5 * (limit[0] - limit[1]) * side[k];
    half[k] = 0.5 * (limit[0] + limit[1]);
  }
  // Faces of the shapes may lie in the box's sides, and limits have rounding errors of up to 300 times those of
  // positions.
  const double rounding = 1e-12 * (norm(shapes.a.half_extents()) + (plane ? 0.0 : norm(shapes.b.half_extents())));
  half = 1.001 * half + Vector3d{rounding, rounding, rounding};
  const double radius = norm(half);
  if (boxed_ || radius < region_.radius) origin_ = center, region_ = {radius, {side[0], side[1], n}, half};
}

// Shapes => the fields of the faces near the overlap, A's before B's; false if there is no overlap. A field that
// exceeds the greatest pressure in the region is the least one nowhere, and bounds no part of the overlap.
bool PressureContact::collect(const ContactShapes& shapes, const Posed& X_AB) {
  fields_.resize(0);
  if (!find_direction(shapes, X_AB)) return false;
  find_region(shapes, X_AB);
  bound_ = shapes.pressure * overlap_ * (1 + 1e-9);
  const auto add = [&](double slope, const Vector3d& normal, double offset) {
    const Field field{slope * normal, slope * offset};
    const Vector3d rises = region_.rises(normal);
    const double reach = std::abs(rises[0]) + std::abs(rises[1]) + std::abs(rises[2]);
    if (field.constant - kWider * slope * reach <= bound_) fields_.push_back(field);
  };
  cells_.clear();
  for (const FacePlane& face : shapes.a.faces())
    add(shapes.pressure_a, face.normal, face.offset - dot(face.normal, origin_));
  too_many_ = false;
  prune(0);
  count_a_ = fields_.size();
  const Vector3d from_origin = X_AB.p - origin_;
  for (const FacePlane& face : shapes.b.faces()) {
    const Vector3d n = X_AB.R * face.normal;
    add(shapes.pressure_b, n, face.offset + dot(n, from_origin));
  }
  prune(count_a_);
  find_lowest();
  rises_.resize(fields_.size());
  for (std::size_t k = 0; k < fields_.size(); ++k) rises_[k] = region_.rises(fields_[k].gradient);
  return true;
}

// The least fields at the origin.
void PressureContact::find_lowest() {
  lowest_a_ = 0, lowest_b_ = fields_.size() > count_a_ ? count_a_ : 0;
  for (std::size_t k = 0; k < fields_.size(); ++k) {
    std::size_t& lowest = k < count_a_ ? lowest_a_ : lowest_b_;
    if (fields_.constant[k] < fields_.constant[lowest]) lowest = k;
  }
}

// Keeps at most `count` fields from `first` on: the least ones at the origin.
void PressureContact::keep_lowest(std::size_t first, std::size_t count) {
  if (fields_.size() <= first + count) return;
  too_many_ = true;
  const auto begin = fields_.constant.begin() + static_cast<std::ptrdiff_t>(first);
  least_.assign(begin, fields_.constant.end());
  const auto last = least_.begin() + static_cast<std::ptrdiff_t>(count - 1);
  std::nth_element(least_.begin(), last, least_.end());
  std::size_t kept = first;
  for (std::size_t i = first; i < fields_.size() && kept < first + count; ++i) {
    if (fields_.constant[i] <= *last) fields_.set(kept++, fields_[i]);
  }
  fields_.resize(kept);
}

namespace {

// Parts of a few corners' polygon: corners, areas and the centroid, as add_polygon() uses them.
struct Fan {
  few_corners::Numbers s, t, after_s, after_t;  // of corners and of those after them
  few_corners::Numbers area, area_before;  // a third of the triangles of the centroid with the edges after and before
  double centroid_s, centroid_t;
};

// Corners behind the last one are the first one, so that they add no area. False without an area.
GRAPNEL_INLINE bool make_fan(const double* pairs, std::size_t corners, double stretch, Fan& fan) {
  using few_corners::Numbers;
  const few_corners::Neighbors& order = few_corners::kNeighbors[corners];
  few_corners::load(pairs, corners, fan.s, fan.t);
  few_corners::permute(fan.s, order.after, fan.after_s);
  few_corners::permute(fan.t, order.after, fan.after_t);
  const double first_s = fan.s[0], first_t = fan.t[0];
  const Numbers p_s = fan.s - first_s, p_t = fan.t - first_t, q_s = fan.after_s - first_s, q_t = fan.after_t - first_t;
  const Numbers part = p_s * q_t - p_t * q_s;
  const double twice = few_corners::total(part);
  if (!(twice > 0)) return false;
  fan.centroid_s = first_s + few_corners::total(part * (p_s + q_s)) / (3 * twice);
  fan.centroid_t = first_t + few_corners::total(part * (p_t + q_t)) / (3 * twice);
  const Numbers area = ((fan.s - fan.centroid_s) * (fan.after_t - fan.centroid_t) -
                        (fan.t - fan.centroid_t) * (fan.after_s - fan.centroid_s)) *
                       (stretch / 6);
  const Numbers zero = {};
  fan.area = area > zero ? area : zero;
  few_corners::permute(fan.area, order.before, fan.area_before);
  return true;
}

}  // namespace

// A polygon => elements at the middles of all edges of the triangles that its centroid forms with its edges: exact for
// the force and the moment of a linear pressure, and continuous when vertices merge. The area of an edge without
// pressure, which has no element, counts at the middle beside it.
void PressureContact::add_polygon(const ContactShapes& shapes, const Field& field, ContactElements& elements) {
  const double length = norm(plane_.across), stretch = plane_.stretch();
  const Vector3d normal = (1 / length) * plane_.across;
  const Line pressure = plane_.restricted(field);
  const double per_pressure = 1 / shapes.pressure, per_area = 1 / shapes.reference_area;

  using few_corners::Numbers;
  constexpr std::size_t kFew = few_corners::kFew;
  if (corners_ <= kFew) {
    Fan fan;
    if (!make_fan(&polygon_[0].s, corners_, stretch, fan)) return;
    alignas(64) double at[2][3][kFew], elastic[2][kFew], depth[2][kFew], share[2][kFew], area[2][kFew];
    const auto put = [](const Numbers& numbers, double* to)
                         GRAPNEL_INLINE_LAMBDA { std::memcpy(to, &numbers, sizeof numbers); };
    const auto set = [&](int side, const Numbers& s, const Numbers& t, const Numbers& a) GRAPNEL_INLINE_LAMBDA {
      const Numbers p = pressure.constant + pressure.along_s * s + pressure.along_t * t, force = p * a;
      const Line& height = plane_.height;
      put(s + origin_[plane_.s], at[side][plane_.s]), put(t + origin_[plane_.t], at[side][plane_.t]);
      put(height.constant + height.along_s * s + height.along_t * t + origin_[plane_.h], at[side][plane_.h]);
      put(force, elastic[side]), put(p * per_pressure, depth[side]);
      put(a * per_area, share[side]), put(a, area[side]);
    };
    set(0, 0.5 * (fan.s + fan.centroid_s), 0.5 * (fan.t + fan.centroid_t), fan.area_before + fan.area);
    set(1, 0.5 * (fan.s + fan.after_s), 0.5 * (fan.t + fan.after_t), fan.area);
    for (std::size_t i = 0; i < corners_; ++i) {
      if (!(elastic[1][i] > 0)) area[0][i] += area[1][i];
      for (int side = 0; side < 2; ++side) {
        const double force = elastic[side][i];
        if (!(force > 0)) continue;
        const Vector3d point{at[side][0][i], at[side][1][i], at[side][2][i]};
        elements.add({point, normal, force, depth[side][i], share[side][i], area[side][i]});
      }
    }
    return;
  }

  Corner centroid;
  if (!(area_and_centroid(centroid) > 0)) return;
  const auto add = [&](const Corner& x, double area, double beside) {
    const double p = pressure.at(x);
    if (!(p * area > 0)) return;
    elements.add({origin_ + plane_.point(x), normal, p * area, p * per_pressure, area * per_area, area + beside});
  };
  const auto middle = [](const Corner& p, const Corner& q) { return Corner{0.5 * (p.s + q.s), 0.5 * (p.t + q.t)}; };
  const auto triangle = [&](const Corner& p, const Corner& q) {  // a third of its area
    const double twice = (p.s - centroid.s) * (q.t - centroid.t) - (p.t - centroid.t) * (q.s - centroid.s);
    return std::max(0.0, twice * (stretch / 6));
  };
  double before = triangle(polygon_[corners_ - 1], polygon_[0]);
  for (std::size_t i = 0; i < corners_; ++i) {
    const Corner& next = polygon_[i + 1 < corners_ ? i + 1 : 0];
    const double after = triangle(polygon_[i], next);
    const Corner edge = middle(polygon_[i], next);
    add(middle(centroid, polygon_[i]), before + after, pressure.at(edge) * after > 0 ? 0.0 : after);
    add(edge, after, 0);
    before = after;
  }
}

// Whether two fields may be equal and at most the greatest pressure somewhere in the region's box.
bool PressureContact::may_meet(std::size_t i, std::size_t j) const {
  const Vector3d sum = rises_[i] + rises_[j], difference = rises_[i] - rises_[j];
  const double least = std::abs(sum[0]) + std::abs(sum[1]) + std::abs(sum[2]);
  const double apart = std::abs(difference[0]) + std::abs(difference[1]) + std::abs(difference[2]);
  const double at_i = fields_.constant[i], at_j = fields_.constant[j];
  return at_i + at_j - kWider * least <= 2 * bound_ && std::abs(at_i - at_j) <= kWider * apart;
}

void PressureContact::add(const ContactShapes& shapes, const Posed& X_AB, ContactElements& elements) {
  if (!collect(shapes, X_AB)) return;
  const double parallel = 1e-12 * shapes.pressure;
  for (std::size_t i = 0; i < count_a_; ++i) {
    const Field a = fields_[i];
    for (std::size_t j = count_a_; j < fields_.size(); ++j) {
      if (!may_meet(i, j)) continue;
      const double apart = cells_[i].radius + cells_[j].radius;
      const Vector3d between = cells_[i].center - cells_[j].center;
      if (dot(between, between) > apart * apart) continue;
      const Field across = a - fields_[j];
      if (!(dot(across.gradient, across.gradient) > parallel * parallel)) continue;
      if (cut(across, a, i, j)) add_polygon(shapes, a, elements);
    }
  }
  // Without a surface of equal pressure one shape may be inside of the other.
  const double deepest = elements.empty() ? overlap_ : elements.largest_depth();
  elements.beyond_model = too_many_ || deepest > std::min(shapes.a.thickness(), shapes.b.thickness());
}

}  // namespace grapnel
