#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "grapnel/contact/contact_element.hpp"
#include "grapnel/contact/contact_law.hpp"

namespace grapnel {

namespace {

constexpr int kGauss = 8;
// Abscissas and weights on [-1, 1] (M. Abramowitz, I. A. Stegun, Handbook of Mathematical Functions, table 25.4).
constexpr double kAbscissas[4] = {0.1834346424956498, 0.5255324099163290, 0.7966664774136267, 0.9602898564975363};
constexpr double kWeights[4] = {0.3626837833783620, 0.3137066458778873, 0.2223810344533745, 0.1012285362903763};

// Calls f(x, weight) at the Gauss points of [low, high].
template <class Function>
void at_gauss_points(double low, double high, Function&& f) {
  const double middle = 0.5 * (low + high), half = 0.5 * (high - low);
  for (int i = 0; i < kGauss; ++i) {
    const double x = i < 4 ? -kAbscissas[3 - i] : kAbscissas[i - 4];
    f(middle + half * x, half * kWeights[i < 4 ? 3 - i : i - 4]);
  }
}

// Two shapes in a given order, without copies.
struct RoundPair {
  const ContactShape& a;
  const ContactShape& b;
  const ContactLaw& law;
  double radius;
};

// A sphere of shape A's radius about p => one element with the other shape at most, `weight` times.
void add_point(const RoundPair& shapes, const Posed& X_AB, const Vector3d& p, double weight,
               ContactElements& elements) {
  const Posed X_BA = inverse(X_AB);
  const double radius = shapes.a.core().rounding, rounding = shapes.b.core().rounding;
  const CoreDistance to = shapes.b.distance(X_BA * p);
  const double depth = radius + rounding - to.distance;
  if (!(depth > 0)) return;
  const ContactLaw& law = shapes.law;
  const Vector3d n = -(X_AB.R * to.normal);
  const double elastic = law.hertz ? contact_law::hertz_force(law.elastic, shapes.radius, depth) : law.elastic * depth;
  elements.energy += weight * (law.hertz ? contact_law::hertz_energy(law.elastic, shapes.radius, depth)
                                         : 0.5 * law.elastic * depth * depth);
  const Vector3d middle = p + (0.5 * (radius + to.distance - rounding)) * n;
  elements.list.push_back({middle, n, weight * elastic, depth, weight, 0, elements.patches++});
  if (to.distance <= 0 && shapes.b.kind() != ContactShape::Kind::half_space) elements.beyond_model = true;
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

// The distance of points of the axis of capsule A from the core of B.
struct AxisDistance {
  const ContactShape& b;
  Posed X_BA;
  double half;      // length of the axis
  double in_touch;  // distance at which the surfaces touch
  CoreDistance at(double z) const { return b.distance(X_BA.p + z * X_BA.R.column(2)); }
  double depth(double z) const { return in_touch - at(z).distance; }
};

// The coordinates at which a line crosses the planes of a box's faces, clamped to the axis and sorted.
std::array<double, 8> crossings(const Vector3d& half, const AxisDistance& axis) {
  const Vector3d &p = axis.X_BA.p, d = axis.X_BA.R.column(2);
  std::array<double, 8> z;
  z[6] = -axis.half, z[7] = axis.half;
  for (int k = 0; k < 6; ++k) {
    const double at = ((k & 1 ? half[k / 2] : -half[k / 2]) - p[k / 2]) / d[k / 2];
    z[k] = at > -axis.half ? std::min(at, axis.half) : -axis.half;  // also if not a number
  }
  std::sort(z.begin(), z.end());
  return z;
}

// Coordinate of the point of the axis nearest to a box: a root of half the derivative of the squared distance, which
// is monotone, and linear between the crossings.
double nearest_to_box(const Vector3d& half, const AxisDistance& axis) {
  const Vector3d &p = axis.X_BA.p, d = axis.X_BA.R.column(2);
  const auto derivative = [&](double z) {
    double sum = 0;
    for (int k = 0; k < 3; ++k) {
      const double x = p[k] + z * d[k];
      sum += d[k] * (x - std::clamp(x, -half[k], half[k]));
    }
    return sum;
  };
  const std::array<double, 8> z = crossings(half, axis);
  double before = derivative(z[0]);
  if (before >= 0) return z[0];
  for (std::size_t i = 1; i < z.size(); ++i) {
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
    return to.distance * dot(to.normal, axis.X_BA.R.column(2));
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
  const double slope = axis.X_BA.R(2, 2);
  if (shapes.b.kind() == ContactShape::Kind::half_space) return slope > 0 ? -axis.half : axis.half;
  const ConvexCore& core = shapes.b.core();
  if (core.hull) {
    const ConvexDistance nearest = convex_distance({shapes.a.core(), core, X_AB});
    if (nearest.separated) return std::clamp(nearest.point_a[2], -axis.half, axis.half);
  } else {
    const double z = core.round ? nearest_to_cylinder(axis) : nearest_to_box(core.half, axis);
    if (axis.at(z).distance > 0) return z;
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
double end_of_contact_with_box(const Vector3d& half, const AxisDistance& axis, double inside, double end) {
  const Vector3d &p = axis.X_BA.p, d = axis.X_BA.R.column(2);
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
  const std::array<double, 8> z = crossings(half, axis);
  double from = inside;
  for (std::size_t i = 0; i < z.size(); ++i) {
    const double to = sense > 0 ? z[i] : z[z.size() - 1 - i];
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
  const ConvexCore& core = axis.b.core();
  if (axis.b.kind() == ContactShape::Kind::half_space) return inside + (end - inside) * (f_inside / (f_inside - f_end));
  if (!core.hull && !core.round) return end_of_contact_with_box(core.half, axis, inside, end);
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
  return {z, to.distance * dot(to.normal, axis.X_BA.R.column(2))};
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
  const Vector3d p = axis.X_BA.p, d = axis.X_BA.R.column(2);
  const ConvexCore& core = b.core();
  if (core.hull) {
    add_kinks(axis, part, slope_at(axis, part.low), slope_at(axis, part.high), 12, breaks);
  } else if (b.kind() != ContactShape::Kind::half_space) {
    for (int k = core.round || core.is_segment() ? 2 : 0; k < 3; ++k) {
      for (const double side : {-1.0, 1.0}) breaks.add(part, (side * core.half[k] - p[k]) / d[k]);
    }
  }
  if (core.round) {
    const double a = d[0] * d[0] + d[1] * d[1], h = d[0] * p[0] + d[1] * p[1];
    const double c = p[0] * p[0] + p[1] * p[1] - core.half[0] * core.half[0], square = h * h - a * c;
    for (const double side : {-1.0, 1.0}) breaks.add(part, (-h + side * std::sqrt(square)) / a);
  }
  breaks.at[breaks.count++] = part.high;
  std::sort(breaks.at.begin(), breaks.at.begin() + breaks.count);
  return breaks;
}

// The capsule A against B: its ends as spheres, and its side as a cylinder whose force per length is linear in the
// depth.
void add_one_capsule(const RoundPair& shapes, const Posed& X_AB, double weight, ContactElements& elements) {
  const double half = shapes.a.core().half[2], radius = shapes.a.core().rounding;
  for (const double z : {-half, half}) add_point(shapes, X_AB, {0, 0, z}, weight, elements);

  const double rounding = shapes.b.core().rounding;
  const AxisDistance axis{shapes.b, inverse(X_AB), half, radius + rounding};
  const double nearest = nearest_on_axis(shapes, X_AB, axis);
  if (!(axis.depth(nearest) > 0)) return;
  const AxisPart part{end_of_contact(axis, nearest, -half), end_of_contact(axis, nearest, half)};
  const AxisBreaks breaks = breaks_of(shapes.b, axis, part);
  const ContactLaw& law = shapes.law;
  const double stiffness = law.hertz ? 0.25 * std::numbers::pi * law.elastic : law.elastic / (2 * half);
  for (int i = 0; i + 1 < breaks.count; ++i) {
    at_gauss_points(breaks.at[i], breaks.at[i + 1], [&](double z, double length) {
      const CoreDistance to = axis.at(z);
      const double depth = axis.in_touch - to.distance, w = weight * length;
      if (!(depth > 0 && w > 0)) return;
      const Vector3d n = -(X_AB.R * to.normal);
      elements.energy += 0.5 * w * stiffness * depth * depth;
      elements.list.push_back({Vector3d{0, 0, z} + (0.5 * (radius + to.distance - rounding)) * n, n,
                               w * stiffness * depth, depth, w / (2 * half), 0, elements.patches});
      if (to.distance <= 0 && shapes.b.kind() != ContactShape::Kind::half_space) elements.beyond_model = true;
    });
  }
  ++elements.patches;
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
  const std::size_t first = elements.list.size();
  add_one_capsule({shapes.b, shapes.a, shapes.law, shapes.radius}, inverse(X_AB), 0.5, elements);
  for (std::size_t i = first; i < elements.list.size(); ++i) {
    ContactElement& e = elements.list[i];
    e.point = X_AB * e.point, e.normal = -(X_AB.R * e.normal);
  }
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
    elements.list.push_back({x * x_axis + y * y_axis + z * z_axis, down, shapes.pressure * volume,
                             std::min(2 * depth, lowest), 0, volume, elements.patches});
  };
  const double part_from = cylinder.meets(cylinder.half), part_to = cylinder.meets(-cylinder.half);
  if (part_to > part_from && cylinder.cosine > 0) cylinder.integrate(part_from, part_to, false, add);
  if (part_to < cylinder.radius) cylinder.integrate(part_to, cylinder.radius, true, add);
  // The area of the patch, from the mean depth of its columns.
  const double mean_depth = 2 * elements.energy / (shapes.pressure * total);
  for (ContactElement& e : elements.list) {
    e.area /= mean_depth;
    e.share = e.area / shapes.reference_area;
  }
  ++elements.patches;
  elements.beyond_model = lowest > shapes.a.thickness();
}

}  // namespace grapnel
