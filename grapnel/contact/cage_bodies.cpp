#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "grapnel/contact/cage_poses.hpp"

namespace grapnel {
namespace {

using Shapes = std::vector<ContactShape>;
using Kind = ContactShape::Kind;

ContactShape ball(const Vector3d& center, double radius) {
  return ContactShape(Geometry{Geometry::Shape::sphere, {radius, 0, 0}, {Rotationd::identity(), center}, nullptr});
}

// The largest ball about a shape's centre inside of it.
ContactShape inner_ball(const ContactShape& shape) {
  return ball(shape.X_BC().p, shape.core().rounding - shape.distance(Vector3d::zero()).distance);
}

// A frame on the body, its z axis along a line, and the solids of revolution about it inside of the shapes.
struct Revolved {
  Posed X_MA;
  Shapes shapes;
  double content = 0;  // sum of their volumes [m^3]
};

// The largest solid about the line inside of a shape whose own axis or edge lies on it.
void revolve(const ContactShape& shape, Revolved& about) {
  const Vector3d axis = about.X_MA.R.column(2), p = shape.X_BC().p - about.X_MA.p;
  const double negligible = 1e-9 * shape.reach();
  if (shape.kind() == Kind::half_space || norm(cross(axis, p)) > negligible) return;
  const Vector3d center = about.X_MA.p + dot(axis, p) * axis;
  const Vector3d half = shape.half_extents();
  if (shape.kind() == Kind::sphere) {
    const double radius = shape.core().rounding;
    about.shapes.push_back(ball(center, radius)), about.content += 4 * radius * radius * radius;
    return;
  }
  if (shape.core().hull) return;
  for (int k = 0; k < 3; ++k) {
    if (norm(cross(axis, shape.X_BC().R.column(k))) > 1e-9) continue;
    if (shape.kind() != Kind::polyhedron && k != 2) return;
    const double rounding = shape.core().rounding;
    const double radius = shape.core().round ? shape.core().half[0] : std::min(half[(k + 1) % 3], half[(k + 2) % 3]);
    const auto kind = rounding > 0 ? Geometry::Shape::capsule : Geometry::Shape::cylinder;
    const Vector3d size{rounding > 0 ? rounding : radius, 2 * half[k], 0};
    about.shapes.push_back(ContactShape(Geometry{kind, size, {about.X_MA.R, center}, nullptr}));
    about.content += std::numbers::pi * size[0] * size[0] * size[1];
    return;
  }
}

// Bodies of revolution about the axes of the shapes; the largest first.
std::vector<Shapes> revolved_bodies(const Shapes& shapes) {
  constexpr std::size_t kMost = 3;
  std::vector<Revolved> all;
  for (const ContactShape& shape : shapes) {
    for (int k = 0; k < 3; ++k) {
      const Rotationd& R = shape.X_BC().R;
      const Vector3d x = R.column((k + 1) % 3), y = R.column((k + 2) % 3), z = R.column(k);
      const bool known = std::ranges::any_of(all, [&](const Revolved& other) {
        const Vector3d axis = other.X_MA.R.column(2), p = shape.X_BC().p - other.X_MA.p;
        return norm(cross(axis, z)) < 1e-9 && norm(cross(axis, p)) <= 1e-9 * shape.reach();
      });
      if (known) continue;
      Revolved about{{Rotationd{{{x[0], y[0], z[0]}, {x[1], y[1], z[1]}, {x[2], y[2], z[2]}}}, shape.X_BC().p}, {}, 0};
      for (const ContactShape& one : shapes) revolve(one, about);
      if (!about.shapes.empty()) all.push_back(std::move(about));
    }
  }
  std::ranges::stable_sort(all, std::ranges::greater{}, &Revolved::content);
  std::vector<Shapes> bodies;
  for (std::size_t i = 0; i < std::min(kMost, all.size()); ++i) bodies.push_back(all[i].shapes);
  return bodies;
}

// The shapes that are much smaller than all others, such as a ring on a tank: for each size below which a factor of two
// is free.
std::vector<Shapes> small_parts(Shapes shapes) {
  std::ranges::stable_sort(shapes, {}, &ContactShape::reach);
  std::vector<Shapes> parts;
  for (std::size_t i = 1; i < shapes.size(); ++i) {
    if (shapes[i].reach() > 2 * shapes[i - 1].reach())
      parts.emplace_back(shapes.begin(), shapes.begin() + static_cast<std::ptrdiff_t>(i));
  }
  return parts;
}

}  // namespace

std::vector<Shapes> inner_bodies(const std::vector<ContactShape>& moving, const RotationSpace& rotations) {
  constexpr std::size_t kMostBalls = 3;
  std::vector<Shapes> bodies;
  if (rotations.dims == 0) return bodies;
  const auto radius = [](const Shapes& shapes) { return shapes[0].core().rounding; };
  for (const ContactShape& shape : moving) bodies.push_back({inner_ball(shape)});
  std::ranges::stable_sort(bodies, std::ranges::greater{}, radius);
  if (bodies.size() > kMostBalls) bodies.resize(kMostBalls);
  if (rotations.dims == 2) return bodies;
  for (const Shapes& revolved : revolved_bodies(moving)) bodies.push_back(revolved);
  for (const Shapes& part : small_parts(moving)) bodies.push_back(part);
  return bodies;
}

}  // namespace grapnel
