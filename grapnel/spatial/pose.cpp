#include "grapnel/spatial/pose.hpp"

#include <cmath>

namespace grapnel {

// Rotation matrix => unit quaternion with w >= 0; evaluates the formula of its largest component, in which no digits
// cancel.
Quaterniond quaternion_from(const Rotationd& R) {
  const double trace = R(0, 0) + R(1, 1) + R(2, 2);
  Quaterniond q;
  if (trace >= R(0, 0) && trace >= R(1, 1) && trace >= R(2, 2)) {
    q = {1 + trace, R(2, 1) - R(1, 2), R(0, 2) - R(2, 0), R(1, 0) - R(0, 1)};
  } else if (R(0, 0) >= R(1, 1) && R(0, 0) >= R(2, 2)) {
    q = {R(2, 1) - R(1, 2), 1 + 2 * R(0, 0) - trace, R(0, 1) + R(1, 0), R(0, 2) + R(2, 0)};
  } else if (R(1, 1) >= R(2, 2)) {
    q = {R(0, 2) - R(2, 0), R(0, 1) + R(1, 0), 1 + 2 * R(1, 1) - trace, R(1, 2) + R(2, 1)};
  } else {
    q = {R(1, 0) - R(0, 1), R(0, 2) + R(2, 0), R(1, 2) + R(2, 1), 1 + 2 * R(2, 2) - trace};
  }
  const double n = std::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
  const double s = (q.w < 0 ? -1.0 : 1.0) / n;
  return {s * q.w, s * q.x, s * q.y, s * q.z};
}

Rotationd rotation_about(const Vector3d& axis, double angle) {
  const double h = 0.5 * angle;
  const double s = std::sin(h);
  return rotation_matrix(Quaterniond{std::cos(h), s * axis[0], s * axis[1], s * axis[2]});
}

Rotationd rotation_from_rpy(double roll, double pitch, double yaw) {
  return rotation_about({0, 0, 1}, yaw) * (rotation_about({0, 1, 0}, pitch) * rotation_about({1, 0, 0}, roll));
}

// Two unit vectors => smallest rotation that takes the first onto the second; for opposite vectors about an arbitrary
// normal. NaN gives NaN.
Rotationd rotation_between(const Vector3d& from, const Vector3d& to) {
  const double c = dot(from, to);
  if (!(c <= -0.5)) {  // so that NaN comes through instead of recursing for ever
    // Half-way quaternion: (1 + cos, sin * axis), normalized.
    const Vector3d v = cross(from, to);
    const double w = 1 + c;
    const double n = std::sqrt(w * w + dot(v, v));
    return rotation_matrix(Quaterniond{w / n, v[0] / n, v[1] / n, v[2] / n});
  }
  // More than 120 degrees: first half a turn about the normal of both (any normal of `from` where they leave it open),
  // then the small rest, which has the same axis.
  Vector3d normal = cross(from, to);
  if (norm(normal) < 1e-15) normal = cross(from, std::abs(from[0]) < 0.6 ? Vector3d{1, 0, 0} : Vector3d{0, 1, 0});
  normal *= 1 / norm(normal);
  normal -= dot(normal, from) * from;  // rounding, of nearly parallel vectors
  normal *= 1 / norm(normal);
  return rotation_between(-from, to) * rotation_about(normal, M_PI);
}

Vector3d rotation_vector(const Rotationd& R) {
  const Quaterniond q = quaternion_from(R);
  const Vector3d v{q.x, q.y, q.z};
  const double s = norm(v);
  if (s < 1e-150) return {2 * v[0], 2 * v[1], 2 * v[2]};
  return (2 * std::atan2(s, q.w) / s) * v;
}

double rotation_angle(const Rotationd& R) { return norm(rotation_vector(R)); }

}  // namespace grapnel
