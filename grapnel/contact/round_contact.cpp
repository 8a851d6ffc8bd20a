#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "grapnel/contact/contact_element.hpp"
#include "grapnel/contact/contact_law.hpp"

namespace grapnel {

namespace {

// Gauss points and their weights on [-1, 1] (M. Abramowitz, I. A. Stegun, Handbook of Mathematical Functions, table
// 25.4): as many as a block has lanes.
constexpr int kGauss = ContactElements::kLanes;
constexpr double kAbscissas[kGauss] = {-0.9602898564975363, -0.7966664774136267, -0.5255324099163290,
                                       -0.1834346424956498, 0.1834346424956498,  0.5255324099163290,
                                       0.7966664774136267,  0.9602898564975363};
constexpr double kWeights[kGauss] = {0.1012285362903763, 0.2223810344533745, 0.3137066458778873, 0.3626837833783620,
                                     0.3626837833783620, 0.3137066458778873, 0.2223810344533745, 0.1012285362903763};

// Calls f(x, weight) at the Gauss points of [low, high].
template <class Function>
void at_gauss_points(double low, double high, Function&& f) {
  const double middle = 0.5 * (low + high), half = 0.5 * (high - low);
  for (int i = 0; i < kGauss; ++i) f(middle + half * kAbscissas[i], half * kWeights[i]);
}

// Two shapes in a given order, without copies.
struct RoundPair {
  const ContactShape& a;
  const ContactShape& b;
  const ContactLaw& law;
  double radius;
};

// A point of A's core with this distance from the core of B => whether the centre or axis of one shape is inside of the
// other one (23.14).
bool is_too_deep(const ContactShape& a, const ContactShape& b, double distance) {
  if (b.kind() == ContactShape::Kind::half_space) return false;
  return distance <= (b.core().rounding > 0 ? std::max(a.core().rounding, b.core().rounding) : 0.0);
}

// A sphere of shape A's radius about p => one element with the other shape at most, `weight` times.
void add_point(const RoundPair& shapes, const Posed& X_AB, const Vector3d& p, double weight,
               ContactElements& elements) {
  const double radius = shapes.a.core().rounding, rounding = shapes.b.core().rounding;
  const CoreDistance to = shapes.b.distance(transposed_times(X_AB.R, p - X_AB.p));
  const double depth = radius + rounding - to.distance;
  if (!(depth > 0)) return;
  const ContactLaw& law = shapes.law;
  const Vector3d n = -(X_AB.R * to.normal);
  const double elastic = law.hertz ? contact_law::hertz_force(law.elastic, shapes.radius, depth) : law.elastic * depth;
  elements.energy += weight * (law.hertz ? contact_law::hertz_energy(law.elastic, shapes.radius, depth)
                                         : 0.5 * law.elastic * depth * depth);
  const Vector3d middle = p + (0.5 * (radius + to.distance - rounding)) * n;
  elements.add({middle, n, weight * elastic, depth, weight, 0});
  if (is_too_deep(shapes.a, shapes.b, to.distance)) elements.beyond_model = true;
}

}  // namespace

void add_sphere_contact(const ContactShapes& shapes, const Posed& X_AB, ContactElements& elements) {
  add_point({shapes.a, shapes.b, shapes.law, shapes.radius}, X_AB, Vector3d::zero(), 1, elements);
}

namespace {

// Part of a capsule's axis, by the coordinate along it.
struct AxisPart {
  double low, high;
};

// Whether the squared distance from the core is quadratic between planes normal to its axes: a box, or a segment.
bool is_boxed(const ContactShape& shape) {
  return shape.kind() != ContactShape::Kind::half_space && !shape.core().hull && !shape.core().round;
}

// The distance of points of the axis of capsule A from the core of B.
struct AxisDistance {
  AxisDistance(const ContactShape& core_of, const Posed& X_AB, double half_length, double distance_in_touch)
      : b(core_of),
        p(-transposed_times(X_AB.R, X_AB.p)),
        d{X_AB.R(2, 0), X_AB.R(2, 1), X_AB.R(2, 2)},
        half(half_length),
        in_touch(distance_in_touch) {
    if (is_boxed(b)) find_crossings();
  }

  const ContactShape& b;
  Vector3d p, d;    // the axis's middle and direction in B
  double half;      // length of the axis
  double in_touch;  // distance at which the surfaces touch
  /// Of a box or segment: the coordinates at which the axis crosses the planes of its faces, clamped to the axis, and
  /// the axis's ends; sorted.
  std::array<double, 8> crossings;
  int crossing_count = 0;

  CoreDistance at(double z) const { return b.distance(p + z * d); }
  double depth(double z) const { return in_touch - at(z).distance; }

 private:
  void find_crossings() {
    const ConvexCore& core = b.core();
    crossings[0] = -half, crossings[1] = half, crossing_count = 2;
    for (int k = core.is_segment() ? 2 : 0; k < 3; ++k) {
      const double inverse = 1 / d[k];
      for (const double side : {-core.half[k], core.half[k]}) {
        const double z = (side - p[k]) * inverse;
        crossings[crossing_count++] = z > -half ? std::min(z, half) : -half;  // also if not a number
      }
    }
    std::sort(crossings.begin(), crossings.begin() + crossing_count);
  }
};

// Coordinate of the point of the axis nearest to a box: a root of half the derivative of the squared distance, which
// is monotone, and linear between the crossings.
double nearest_to_box(const AxisDistance& axis) {
  const Vector3d& size = axis.b.core().half;
  const auto derivative = [&](double z) {
    double sum = 0;
    for (int k = 0; k < 3; ++k) {
      const double x = axis.p[k] + z * axis.d[k];
      sum += axis.d[k] * (x - std::clamp(x, -size[k], size[k]));
    }
    return sum;
  };
  const std::array<double, 8>& z = axis.crossings;
  double before = derivative(z[0]);
  if (before >= 0) return z[0];
  for (int i = 1; i < axis.crossing_count; ++i) {
    const double now = derivative(z[i]);
    if (now >= 0) return now > before ? z[i - 1] - (z[i] - z[i - 1]) * before / (now - before) : z[i];
    before = now;
  }
  return axis.half;
}

// Coordinate of the point of the axis nearest to a cylinder, to a relative 1e-12: a root of half the derivative of the
// squared distance, which is monotone outside. Regula falsi with the Illinois rule.
double nearest_to_cylinder(const AxisDistance& axis) {
  const auto derivative = [&](double z) {
    const CoreDistance to = axis.at(z);
    return to.distance * dot(to.normal, axis.d);
  };
  double low = -axis.half, high = axis.half, f_low = derivative(low), f_high = derivative(high);
  if (f_low >= 0) return low;
  if (f_high <= 0) return high;
  double z = 0;
  for (int step = 0, side = 0; step < 60 && high - low > 1e-12 * axis.half; ++step) {
    z = (low * f_high - high * f_low) / (f_high - f_low);
    const double f = derivative(z);
    if (f == 0) break;
    if (f > 0) {
      high = z, f_high = f;
      if (side == 1) f_low *= 0.5;
      side = 1;
    } else {
      low = z, f_low = f;
      if (side == -1) f_high *= 0.5;
      side = -1;
    }
  }
  return z;
}

// Coordinate of the point of the axis nearest to the core of B; inside of a core the deepest.
double nearest_on_axis(const RoundPair& shapes, const Posed& X_AB, const AxisDistance& axis) {
  const double slope = axis.d[2];
  if (shapes.b.kind() == ContactShape::Kind::half_space) return slope > 0 ? -axis.half : axis.half;
  const ConvexCore& core = shapes.b.core();
  if (core.hull) {
    const ConvexDistance nearest = convex_distance({shapes.a.core(), core, X_AB});
    if (nearest.separated) return std::clamp(nearest.point_a[2], -axis.half, axis.half);
  } else {
    // Where the axis enters B, the derivative is zero too, and the distance a rounding error.
    constexpr double kOutside = 1e-9;
    const double z = core.round ? nearest_to_cylinder(axis) : nearest_to_box(axis);
    if (axis.at(z).distance > kOutside * axis.in_touch) return z;
  }
  double low = -axis.half, high = axis.half;  // the distance is convex, inside of B too
  for (int step = 0; step < 60; ++step) {
    const double third = (high - low) / 3;
    if (axis.depth(low + third) > axis.depth(high - third))
      high -= third;
    else
      low += third;
  }
  return 0.5 * (low + high);
}

// As end_of_contact() for a box: the squared distance is quadratic between the crossings.
double end_of_contact_with_box(const AxisDistance& axis, double inside, double end) {
  const Vector3d &p = axis.p, &d = axis.d, &half = axis.b.core().half;
  const double sense = end > inside ? 1 : -1, touching = axis.in_touch * axis.in_touch;
  // Half the derivatives and the value, less that of touching surfaces, at `from`, of the quadratic polynomial of the
  // part that contains `middle`; the distance along the sense at which it vanishes.
  const auto root = [&](double from, double middle) {
    double a = 0, b = 0, c = -touching;
    for (int k = 0; k < 3; ++k) {
      const double side = p[k] + middle * d[k] < 0 ? -half[k] : half[k];
      if (!(std::abs(p[k] + middle * d[k]) > half[k])) continue;
      const double x = p[k] + from * d[k] - side;
      a += d[k] * d[k], b += sense * d[k] * x, c += x * x;
    }
    const double r = std::sqrt(std::max(0.0, b * b - a * c));
    return b > 0 ? -c / (b + r) : a > 0 ? (r - b) / a : 0.0;
  };
  double from = inside;
  for (int i = 0; i < axis.crossing_count; ++i) {
    const double to = axis.crossings[sense > 0 ? i : axis.crossing_count - 1 - i];
    if (!(sense * (to - from) > 0)) continue;
    if (axis.depth(to) < 0) return from + sense * std::clamp(root(from, 0.5 * (from + to)), 0.0, sense * (to - from));
    from = to;
  }
  return end;
}

// Between a point in contact and the end of the axis: where contact ends. Regula falsi with the Illinois rule.
double end_of_contact(const AxisDistance& axis, double inside, double end) {
  double f_inside = axis.depth(inside), f_end = axis.depth(end);
  if (f_end >= 0 || inside == end) return end;
  if (axis.b.kind() == ContactShape::Kind::half_space) return inside + (end - inside) * (f_inside / (f_inside - f_end));
  if (is_boxed(axis.b)) return end_of_contact_with_box(axis, inside, end);
  double x = end;
  for (int step = 0, side = 0; step < 60 && std::abs(end - inside) > 1e-15 * axis.half; ++step) {
    x = (inside * f_end - end * f_inside) / (f_end - f_inside);
    const double f = axis.depth(x);
    if (std::abs(f) < 1e-15 * axis.in_touch) break;
    if (f > 0) {
      inside = x, f_inside = f;
      if (side == 1) f_end *= 0.5;
      side = 1;
    } else {
      end = x, f_end = f;
      if (side == -1) f_inside *= 0.5;
      side = -1;
    }
  }
  return x;
}

// Coordinates within the part at which the nearest feature of B changes, in order, between the part's ends.
struct AxisBreaks {
  static constexpr int kMax = 64;
  std::array<double, kMax> at;
  int count = 0;

  void add(const AxisPart& part, double z) {
    if (z > part.low && z < part.high && count + 1 < kMax) at[count++] = z;
  }
};

// A coordinate and half the derivative of the squared distance there. As a function of the coordinate it is continuous,
// and linear while the nearest feature of a polyhedron is the same.
struct AxisSlope {
  double z, value;
};
AxisSlope slope_at(const AxisDistance& axis, double z) {
  const CoreDistance to = axis.at(z);
  return {z, to.distance * dot(to.normal, axis.d)};
}

// Adds the kinks of AxisSlope between two coordinates: where the lines through the ends intersect, if the function
// has that value there; otherwise those of both parts.
void add_kinks(const AxisDistance& axis, const AxisPart& whole, const AxisSlope& low, const AxisSlope& high, int level,
               AxisBreaks& breaks) {
  const double length = high.z - low.z, tolerance = 1e-11 * (axis.half + axis.in_touch);
  if (!(length > 1e-9 * axis.half) || level == 0) return;
  const double beside = length / 64;
  const double rise_low = (slope_at(axis, low.z + beside).value - low.value) / beside;
  const double rise_high = (high.value - slope_at(axis, high.z - beside).value) / beside;
  if (std::abs(rise_low - rise_high) * length < tolerance &&
      std::abs(high.value - low.value - rise_low * length) < tolerance) {
    return;
  }
  const double z = low.z + (high.value - low.value - rise_high * length) / (rise_low - rise_high);
  const bool inside = z > low.z + beside && z < high.z - beside;
  const AxisSlope middle = slope_at(axis, inside ? z : 0.5 * (low.z + high.z));
  // The intersection has the function's value also if it is beyond other kinks, so points halfway are added.
  const auto on_lines = [&](double x) {
    const double line = x <= z ? low.value + rise_low * (x - low.z) : high.value + rise_high * (x - high.z);
    return std::abs(slope_at(axis, x).value - line) < tolerance;
  };
  if (inside && std::abs(middle.value - low.value - rise_low * (z - low.z)) < tolerance &&
      on_lines(0.5 * (low.z + z)) && on_lines(0.5 * (z + high.z))) {
    breaks.add(whole, z);
    return;
  }
  add_kinks(axis, whole, low, middle, level - 1, breaks);
  breaks.add(whole, middle.z);
  add_kinks(axis, whole, middle, high, level - 1, breaks);
}

AxisBreaks breaks_of(const ContactShape& b, const AxisDistance& axis, const AxisPart& part) {
  AxisBreaks breaks;
  breaks.at[breaks.count++] = part.low;
  const Vector3d &p = axis.p, &d = axis.d;
  const ConvexCore& core = b.core();
  if (is_boxed(b)) {
    for (int i = 0; i < axis.crossing_count; ++i) breaks.add(part, axis.crossings[i]);
    breaks.at[breaks.count++] = part.high;
    return breaks;
  }
  if (core.hull) {
    add_kinks(axis, part, slope_at(axis, part.low), slope_at(axis, part.high), 12, breaks);
  } else if (core.round) {
    for (const double side : {-1.0, 1.0}) breaks.add(part, (side * core.half[2] - p[2]) / d[2]);
    const double a = d[0] * d[0] + d[1] * d[1], h = d[0] * p[0] + d[1] * p[1];
    const double c = p[0] * p[0] + p[1] * p[1] - core.half[0] * core.half[0], square = h * h - a * c;
    for (const double side : {-1.0, 1.0}) breaks.add(part, (-h + side * std::sqrt(square)) / a);
  }
  breaks.at[breaks.count++] = part.high;
  std::sort(breaks.at.begin(), breaks.at.begin() + breaks.count);
  return breaks;
}

// Eight points' distances from a core, and the gradients of the distance.
struct EightDistances {
  double distance[kGauss];
  ContactElements::Vectors normal;
};
EightDistances distances_from(const ContactShape& b, const ContactElements::Vectors& p) {
  EightDistances to;
  if (is_boxed(b)) {
    const auto beyond = [](double x, double half) { return x > half ? x - half : x < -half ? x + half : 0.0; };
    const Vector3d& half = b.core().half;
    double nearest = 1;
    for (int i = 0; i < kGauss; ++i) {
      const double x = beyond(p.x[i], half[0]), y = beyond(p.y[i], half[1]), z = beyond(p.z[i], half[2]);
      const double distance = std::sqrt(x * x + y * y + z * z), inverse = 1 / distance;
      to.distance[i] = distance;
      to.normal.x[i] = inverse * x, to.normal.y[i] = inverse * y, to.normal.z[i] = inverse * z;
    }
    for (int i = 0; i < kGauss; ++i) nearest = std::min(nearest, to.distance[i]);
    if (nearest > 0) return to;
  }
  for (int i = 0; i < kGauss; ++i) {
    const CoreDistance one = b.distance(p[i]);
    to.distance[i] = one.distance, to.normal.set(i, one.normal);
  }
  return to;
}

// The side of capsule A, as a cylinder whose force per length is linear in the depth, along a part of its axis.
void add_part_of_side(const RoundPair& shapes, const Posed& X_AB, const AxisDistance& axis, const AxisPart& part,
                      double weight, ContactElements& elements) {
  const double radius = shapes.a.core().rounding, rounding = shapes.b.core().rounding;
  const ContactLaw& law = shapes.law;
  const double stiffness = law.hertz ? 0.25 * std::numbers::pi * law.elastic : law.elastic / (2 * axis.half);
  const double middle = 0.5 * (part.low + part.high), half = 0.5 * (part.high - part.low);
  double z[kGauss];
  ContactElements::Vectors p;
  for (int i = 0; i < kGauss; ++i) {
    z[i] = middle + half * kAbscissas[i];
    p.x[i] = axis.p[0] + z[i] * axis.d[0], p.y[i] = axis.p[1] + z[i] * axis.d[1];
    p.z[i] = axis.p[2] + z[i] * axis.d[2];
  }
  const EightDistances to = distances_from(shapes.b, p);
  for (int i = 0; i < kGauss; ++i) {
    const double depth = axis.in_touch - to.distance[i], w = weight * (half * kWeights[i]);
    if (!(depth > 0 && w > 0)) continue;
    const Vector3d n = -(X_AB.R * to.normal[i]);
    elements.energy += 0.5 * w * stiffness * depth * depth;
    elements.add({Vector3d{0, 0, z[i]} + (0.5 * (radius + to.distance[i] - rounding)) * n, n, w * stiffness * depth,
                  depth, w / (2 * axis.half), 0});
  }
}

// The capsule A against B: its ends as spheres, and its side.
void add_one_capsule(const RoundPair& shapes, const Posed& X_AB, double weight, ContactElements& elements) {
  const double half = shapes.a.core().half[2];
  for (const double z : {-half, half}) add_point(shapes, X_AB, {0, 0, z}, weight, elements);
  const AxisDistance axis(shapes.b, X_AB, half, shapes.a.core().rounding + shapes.b.core().rounding);
  const double nearest = nearest_on_axis(shapes, X_AB, axis);
  const double deepest = axis.depth(nearest);
  if (!(deepest > 0)) return;
  if (is_too_deep(shapes.a, shapes.b, axis.in_touch - deepest)) elements.beyond_model = true;
  const AxisPart part{end_of_contact(axis, nearest, -half), end_of_contact(axis, nearest, half)};
  const AxisBreaks breaks = breaks_of(shapes.b, axis, part);
  for (int i = 0; i + 1 < breaks.count; ++i)
    add_part_of_side(shapes, X_AB, axis, {breaks.at[i], breaks.at[i + 1]}, weight, elements);
}

}  // namespace

void add_capsule_contact(const ContactShapes& shapes, const Posed& X_AB, ContactElements& elements) {
  const RoundPair pair{shapes.a, shapes.b, shapes.law, shapes.radius};
  if (shapes.b.kind() != ContactShape::Kind::capsule) {
    add_one_capsule(pair, X_AB, 1, elements);
    return;
  }
  // Half of each capsule against the other.
  add_one_capsule(pair, X_AB, 0.5, elements);
  const std::size_t first = elements.size();
  add_one_capsule({shapes.b, shapes.a, shapes.law, shapes.radius}, inverse(X_AB), 0.5, elements);
  elements.change_from(first, [&](ContactElements::Block& block, std::size_t lane) {
    block.point.set(lane, X_AB * block.point[lane]), block.normal.set(lane, -(X_AB.R * block.normal[lane]));
  });
}

namespace {

// The submerged part of a cylinder. x: in the cross-section, downwards; z: along the axis, downwards or horizontal. The
// depth below the plane of a point is center + x sine + z cosine.
struct SubmergedCylinder {
  double radius, half, center, sine, cosine;

  double depth(double x, double z) const { return center + x * sine + z * cosine; }
  /// x at which the plane meets the points with this z; an end of the diameter if outside of it.
  double meets(double z) const {
    const double level = center + z * cosine;
    return level + radius * sine <= 0 ? radius : level - radius * sine >= 0 ? -radius : -level / sine;
  }
  /// Calls f(x, y, z, volume) at points of the slices between two x, which are submerged in full or in part.
  template <class Function>
  void integrate(double from, double to, bool full, Function&& f) const {
    const auto angle = [&](double x) { return std::acos(std::clamp(-x / radius, -1.0, 1.0)); };
    const double start = angle(from), end = angle(to), middle = 0.5 * (start + end);
    const auto at_angle = [&](double phi, double weight) {
      const double x = -radius * std::cos(phi), chord = radius * std::sin(phi);
      const double low = full ? -half : std::clamp(-(center + x * sine) / cosine, -half, half);
      const double length = half - low, volume = weight * chord * 2 * chord * length;
      for (const double s : {-1.0, 1.0}) {
        for (const double t : {-1.0, 1.0}) {
          f(x, s * chord / std::numbers::sqrt3, low + 0.5 * length * (1 + t / std::numbers::sqrt3), 0.25 * volume);
        }
      }
    };
    at_gauss_points(start, middle, at_angle), at_gauss_points(middle, end, at_angle);
  }
};

}  // namespace

// Cylinder and half-space => Gauss points of the submerged volume, each with a force along the plane's normal: the
// force is the pressure's slope times the volume, the energy the same times the depth (23.13).
void add_cylinder_on_plane(const ContactShapes& shapes, const Posed& X_AB, ContactElements& elements) {
  const Vector3d down = -X_AB.R.column(2);
  const double sine = std::hypot(down[0], down[1]), sign = down[2] < 0 ? -1 : 1;
  const Vector3d x_axis = sine > 0 ? Vector3d{down[0] / sine, down[1] / sine, 0} : Vector3d{1, 0, 0};
  const Vector3d z_axis{0, 0, sign}, y_axis = cross(z_axis, x_axis);
  const Vector3d& half = shapes.a.core().half;
  const SubmergedCylinder cylinder{half[0], half[2], -dot(down, X_AB.p), sine, std::abs(down[2])};
  const double lowest = cylinder.depth(half[0], half[2]);
  if (!(lowest > 0)) return;
  double total = 0;  // volume
  const auto add = [&](double x, double y, double z, double volume) {
    const double depth = cylinder.depth(x, z);
    if (!(volume > 0 && depth > 0)) return;
    elements.energy += shapes.pressure * depth * volume;
    total += volume;
    elements.add(
        {x * x_axis + y * y_axis + z * z_axis, down, shapes.pressure * volume, std::min(2 * depth, lowest), 0, volume});
  };
  const double part_from = cylinder.meets(cylinder.half), part_to = cylinder.meets(-cylinder.half);
  if (part_to > part_from && cylinder.cosine > 0) cylinder.integrate(part_from, part_to, false, add);
  if (part_to < cylinder.radius) cylinder.integrate(part_to, cylinder.radius, true, add);
  // The area of the patch, from the mean depth of its columns.
  const double mean_depth = 2 * elements.energy / (shapes.pressure * total);
  elements.change_from(0, [&](ContactElements::Block& block, std::size_t lane) {
    block.area[lane] /= mean_depth;
    block.share[lane] = block.area[lane] / shapes.reference_area;
  });
  elements.beyond_model = lowest > shapes.a.thickness();
}

}  // namespace grapnel
