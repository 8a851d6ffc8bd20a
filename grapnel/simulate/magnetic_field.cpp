#include "grapnel/simulate/magnetic_field.hpp"

#include <cmath>

namespace grapnel {

// Position, time => field of the dipole g, which rotates about the Earth's axis: B = (a/r)^3 (3 (g . u) u - g), u =
// p/r.
Vector3d magnetic_field(const MagneticField& field, const Vector3d& p, double t) {
  const Vector3d east = cross(field.axis, field.greenwich);
  const double c = std::cos(kEarthRate * t), s = std::sin(kEarthRate * t);
  const Vector3d to_greenwich = c * field.greenwich + s * east, to_east = c * east - s * field.greenwich;
  const Vector3d g = kDipole[0] * to_greenwich + kDipole[1] * to_east + kDipole[2] * field.axis;
  const double r = norm(p), shrink = kDipoleRadius / r;
  const Vector3d u = (1 / r) * p;
  return (shrink * shrink * shrink) * (3 * dot(g, u) * u - g);
}

Vector3d magnetic_field(const MagneticField& field, const ReferenceOrbit& orbit, double t) {
  const OrbitPoint at = orbit_point(orbit, t);
  return magnetic_field(field, at.radius * at.radial(), t);
}

std::string fault_of(const MagneticField& field) {
  constexpr double kSquare = 1e-9;
  if (!(std::abs(norm(field.axis) - 1) < kSquare && std::abs(norm(field.greenwich) - 1) < kSquare))
    return "axis and greenwich must be unit vectors";
  if (!(std::abs(dot(field.axis, field.greenwich)) < kSquare))
    return "axis and greenwich must be perpendicular to each other";
  return {};
}

}  // namespace grapnel
