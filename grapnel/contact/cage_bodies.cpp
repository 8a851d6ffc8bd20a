#include <algorithm>
#include <cmath>

#include "grapnel/contact/cage_poses.hpp"

namespace grapnel {
namespace {

bool is_sphere(const ContactShape& shape) { return shape.kind() == ContactShape::Kind::sphere; }

bool is_round(const ContactShape& shape) {
  return is_sphere(shape) || shape.kind() == ContactShape::Kind::capsule ||
         shape.kind() == ContactShape::Kind::cylinder;
}

// The largest ball about a shape's centre inside of it.
ContactShape inner_ball(const ContactShape& shape) {
  const double radius = shape.core().rounding - shape.distance(Vector3d::zero()).distance;
  const Posed X_MG{Rotationd::identity(), shape.X_BC().p};
  return ContactShape(Geometry{Geometry::Shape::sphere, {radius, 0, 0}, X_MG, nullptr});
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

RotationSpace rotation_space(const std::vector<ContactShape>& shapes, const Vector3d& center) {
  RotationSpace space;
  if (!std::ranges::all_of(shapes, is_round)) return space;
  double size = 0;
  for (const ContactShape& shape : shapes) size = std::max(size, norm(shape.X_BC().p - center) + shape.reach());
  const double negligible = 1e-12 * size;
  const auto axial = std::ranges::find_if_not(shapes, is_sphere);
  if (axial == shapes.end()) {
    const auto is_central = [&](const ContactShape& shape) { return norm(shape.X_BC().p - center) <= negligible; };
    if (std::ranges::all_of(shapes, is_central)) space.dims = 0;
    return space;
  }
  const Rotationd R = axial->X_BC().R;
  const auto is_coaxial = [&](const ContactShape& shape) {
    if (norm(cross(R.column(2), shape.X_BC().p - center)) > negligible) return false;
    return is_sphere(shape) || norm(cross(R.column(2), shape.X_BC().R.column(2))) <= 1e-12;
  };
  if (std::ranges::all_of(shapes, is_coaxial)) space.dims = 2, space.axes = {R.column(0), R.column(1), R.column(2)};
  return space;
}

std::vector<ContactShape> inner_balls(const std::vector<ContactShape>& moving) {
  constexpr std::size_t kMost = 3;
  std::vector<ContactShape> balls;
  for (const ContactShape& shape : moving) balls.push_back(inner_ball(shape));
  std::ranges::stable_sort(balls, std::ranges::greater{},
                           [](const ContactShape& ball) { return ball.core().rounding; });
  if (balls.size() > kMost) balls.erase(balls.begin() + kMost, balls.end());
  return balls;
}

}  // namespace grapnel
