#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "grapnel/contact/cage_poses.hpp"

namespace grapnel {
namespace {

// Angle between two orientations, accurate near zero.
double angle_between(const Quaterniond& a, const Quaterniond& b) {
  const auto distance = [&](double sign) {
    const double w = a.w - sign * b.w, x = a.x - sign * b.x, y = a.y - sign * b.y, z = a.z - sign * b.z;
    return std::sqrt(w * w + x * x + y * y + z * z);
  };
  return 4 * std::asin(std::min(1.0, 0.5 * std::min(distance(1), distance(-1))));
}

Vector3d turned(const Quaterniond& q, const Vector3d& v) { return rotation_matrix(q) * v; }

double angle_of_directions(const Vector3d& a, const Vector3d& b) { return std::atan2(norm(cross(a, b)), dot(a, b)); }

bool is_sphere(const ContactShape& shape) { return shape.kind() == ContactShape::Kind::sphere; }

bool is_round(const ContactShape& shape) {
  return is_sphere(shape) || shape.kind() == ContactShape::Kind::capsule ||
         shape.kind() == ContactShape::Kind::cylinder;
}

// How far the points of a shape are from those of another one of the same kind and size, after a rotation about a
// centre.
double mismatch(const ContactShape& from, const ContactShape& to, const Vector3d& center, const Rotationd& rotation) {
  if (from.kind() != to.kind() || from.core().hull != to.core().hull) return kFarApart;
  if (std::abs(from.core().rounding - to.core().rounding) > 1e-12 * from.reach()) return kFarApart;
  const Vector3d& a = from.half_extents();
  const Vector3d& b = to.half_extents();
  const double shift = norm(center + rotation * (from.X_BC().p - center) - to.X_BC().p);
  if (is_sphere(from)) return shift;
  const Rotationd R = transpose(to.X_BC().R) * rotation * from.X_BC().R;
  double turn = 0;  // bound of the angle after the nearest symmetry of the shape itself
  if (is_round(from)) {
    if (std::abs(a[0] - b[0]) + std::abs(a[2] - b[2]) > 1e-12 * from.reach()) return kFarApart;
    turn = std::hypot(R.column(2)[0], R.column(2)[1]);
    return shift + 2 * turn * from.reach();
  }
  if (from.core().hull) {
    for (int k = 0; k < 3; ++k) {
      if (from.core().scale[k] != to.core().scale[k]) return kFarApart;
      turn = std::max(turn, norm(R.column(k) - Vector3d::unit(k)));
    }
    return shift + 3 * turn * from.reach();
  }
  for (int k = 0; k < 3; ++k) {
    const Vector3d axis = R.column(k);
    const int along = std::abs(axis[0]) > 0.7 ? 0 : std::abs(axis[1]) > 0.7 ? 1 : 2;
    if (std::abs(a[k] - b[along]) > 1e-12 * from.reach()) return kFarApart;
    turn = std::max(turn, norm(axis - (axis[along] < 0 ? -1.0 : 1.0) * Vector3d::unit(along)));
  }
  return shift + 3 * turn * from.reach();
}

// How far the points of all shapes are from each other before and after a rotation, unless more than `tolerance`.
double mismatch(const std::vector<ContactShape>& shapes, const Vector3d& center, const Quaterniond& rotation,
                double tolerance) {
  const Rotationd R = rotation_matrix(rotation);
  double most = 0;
  for (const ContactShape& from : shapes) {
    double least = kFarApart;
    for (const ContactShape& to : shapes) least = std::min(least, mismatch(from, to, center, R));
    most = std::max(most, least);
    if (most > tolerance) return kFarApart;
  }
  return most;
}

// Directions about which the shapes may be symmetric. Axes of shapes come before their positions, which files round.
class CandidateAxes {
 public:
  explicit CandidateAxes(const std::vector<ContactShape>& shapes, const Vector3d& center) {
    constexpr std::size_t kMostPairs = 24;
    for (const ContactShape& shape : shapes) offer_axes(shape.X_BC().R);
    const Rotationd& R = shapes[0].X_BC().R;
    for (std::size_t i = 1; i < std::min(kMostPairs, shapes.size()); ++i) {
      const Rotationd& other = shapes[i].X_BC().R;
      for (int k = 0; k < 3; ++k) {
        offer(cross(R.column(k), other.column(k)));
        offer(R.column(k) + other.column(k)), offer(R.column(k) - other.column(k));
      }
    }
    for (const ContactShape& shape : shapes) offer((1 / shape.reach()) * (shape.X_BC().p - center));
  }
  const std::vector<Vector3d>& axes() const { return axes_; }

 private:
  // Axes of a box and of a cube: through faces, edges and corners.
  void offer_axes(const Rotationd& R) {
    for (int k = 0; k < 3; ++k) offer(R.column(k));
    for (int k = 0; k < 3; ++k) {
      const Vector3d u = R.column(k), v = R.column((k + 1) % 3);
      offer(u + v), offer(u - v);
    }
    for (const double x : {-1.0, 1.0}) {
      for (const double y : {-1.0, 1.0}) offer(R.column(0) + x * R.column(1) + y * R.column(2));
    }
  }
  void offer(const Vector3d& v) {
    constexpr std::size_t kMost = 200;
    constexpr double kSame = 1e-2;  // [rad]
    const double length = norm(v);
    if (!(length > kSame) || axes_.size() == kMost) return;
    const Vector3d unit = (1 / length) * v;
    if (std::ranges::none_of(axes_, [&](const Vector3d& a) { return norm(cross(a, unit)) < kSame; }))
      axes_.push_back(unit);
  }

  std::vector<Vector3d> axes_;
};

// Rotations => the group that they generate, without its identity; nothing if it is large, or if they are inexact, so
// that products nearly repeat elements.
std::optional<std::vector<Quaterniond>> group_of(const std::vector<Quaterniond>& generators) {
  constexpr std::size_t kMost = 60;
  constexpr double kNear = 1e-2, kSame = 1e-9;  // [rad]
  std::vector<Quaterniond> all{Quaterniond::identity()};
  for (std::size_t i = 0; i < all.size(); ++i) {
    for (const Quaterniond& generator : generators) {
      const Quaterniond next = all[i] * generator;
      double nearest = kFarApart;
      for (const Quaterniond& q : all) nearest = std::min(nearest, angle_between(q, next));
      if (nearest <= kSame) continue;
      if (nearest < kNear || all.size() == kMost) return {};
      all.push_back(next);
    }
  }
  all.erase(all.begin());
  return all;
}

// Adds the symmetries of shapes to their rotations.
void add_symmetries(const std::vector<ContactShape>& shapes, const Vector3d& center, double tolerance,
                    RotationSpace& space) {
  constexpr int kMostFold = 12;
  std::vector<Quaterniond> generators;
  const auto offer = [&](const Vector3d& axis, int fold) {
    const double half = std::numbers::pi / fold, s = std::sin(half);
    const Quaterniond q{std::cos(half), s * axis[0], s * axis[1], s * axis[2]};
    if (!(mismatch(shapes, center, q, tolerance) <= tolerance)) return false;
    generators.push_back(q);
    return true;
  };
  if (space.dims == 2) {
    offer(space.axes[0], 2);
  } else {
    const CandidateAxes candidates(shapes, center);
    for (const Vector3d& axis : candidates.axes()) {
      for (int fold = kMostFold; fold > 1 && !offer(axis, fold); --fold) {
      }
    }
  }
  const auto group = group_of(generators);
  if (!group) return;
  double error = 0;
  for (const Quaterniond& q : *group) error = std::max(error, mismatch(shapes, center, q, tolerance));
  if (error <= tolerance) space.symmetries = *group, space.error = error;
}

}  // namespace

Quaterniond RotationSpace::rotation(const std::array<double, 3>& vector) const {
  Vector3d turn = Vector3d::zero();
  for (int k = 0; k < dims; ++k) turn = turn + vector[k] * axes[k];
  const double angle = norm(turn);
  if (!(angle > 0)) return Quaterniond::identity();
  const double s = std::sin(0.5 * angle) / angle;
  return {std::cos(0.5 * angle), s * turn[0], s * turn[1], s * turn[2]};
}

double RotationSpace::angle(const Quaterniond& a, const Quaterniond& b, bool with_identity) const {
  double least = kFarApart;
  if (dims == 2) {
    const double between = angle_of_directions(turned(a, axes[2]), turned(b, axes[2]));
    if (with_identity) least = between;
    if (!symmetries.empty()) least = std::min(least, std::numbers::pi - between);
    return least;
  }
  if (with_identity) least = angle_between(a, b);
  for (const Quaterniond& g : symmetries) least = std::min(least, angle_between(a * g, b));
  return least;
}

RotationSpace rotation_space(const std::vector<ContactShape>& shapes, const Vector3d& center, double tolerance) {
  double size = 0;
  for (const ContactShape& shape : shapes) size = std::max(size, norm(shape.X_BC().p - center) + shape.reach());
  const double negligible = 1e-12 * size;
  RotationSpace space;
  const bool round = std::ranges::all_of(shapes, is_round);
  const auto axial = std::ranges::find_if_not(shapes, is_sphere);
  const auto is_central = [&](const ContactShape& s) { return norm(s.X_BC().p - center) <= negligible; };
  if (round && axial == shapes.end() && std::ranges::all_of(shapes, is_central)) {
    space.dims = 0;
    return space;
  }
  if (round) {
    Rotationd R = axial == shapes.end() ? Rotationd::identity() : axial->X_BC().R;
    const auto coaxial = [&](const ContactShape& shape) {
      if (norm(cross(R.column(2), shape.X_BC().p - center)) > negligible) return false;
      return is_sphere(shape) || norm(cross(R.column(2), shape.X_BC().R.column(2))) <= 1e-12;
    };
    if (axial != shapes.end() && std::ranges::all_of(shapes, coaxial))
      space.dims = 2, space.axes = {R.column(0), R.column(1), R.column(2)};
  }
  add_symmetries(shapes, center, tolerance, space);
  return space;
}

}  // namespace grapnel
