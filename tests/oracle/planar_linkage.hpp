#pragma once

/// @file
/// Common functions of the hand-written planar linkages. Independent of Grapnel (nothing of it is included).

#include <Eigen/Core>
#include <cmath>
#include <vector>

namespace grapnel::oracle {

using Vector2 = Eigen::Vector2d;

/// Unit vector at an angle, and the one a quarter turn ahead: e' = n, n' = -e.
inline Vector2 along(double angle) { return {std::cos(angle), std::sin(angle)}; }
inline Vector2 across(double angle) { return {-std::sin(angle), std::cos(angle)}; }
/// z component of a x b.
inline double cross(const Vector2& a, const Vector2& b) { return a[0] * b[1] - a[1] * b[0]; }

/// A bar: mass, inertia about its centre of mass, and where that is, along the bar from its first pivot and across it.
struct Bar {
  double length;      // [m]
  double mass;        // [kg]
  double inertia;     // about the axis normal to the plane [kg m^2]
  double com_along;   // [m]
  double com_across;  // [m]
  /// Centre of mass from the first pivot, and its derivative by the bar's angle.
  Vector2 com(double angle) const { return com_along * along(angle) + com_across * across(angle); }
  Vector2 com_slope(double angle) const { return com_along * across(angle) - com_across * along(angle); }
};

/// Angle of the line from `from` to the point that is `first` away from it and `second` away from `to`: of the two
/// points the one to the left of the line from -> to for side 1, to the right for -1.
inline double apex_angle(const Vector2& from, const Vector2& to, double first, double second, int side) {
  const Vector2 d = to - from;
  const double cosine = (first * first + d.squaredNorm() - second * second) / (2 * first * d.norm());
  return std::atan2(d[1], d[0]) + side * std::acos(cosine);
}

/// Integral of a smooth function from a to b: Gauss-Legendre with five points on each of `panels` equal panels.
template <class F>
double integral(F&& f, double a, double b, int panels = 200) {
  const double near = std::sqrt(5 - 2 * std::sqrt(10.0 / 7)) / 3, far = std::sqrt(5 + 2 * std::sqrt(10.0 / 7)) / 3;
  const double near_weight = (322 + 13 * std::sqrt(70.0)) / 900, far_weight = (322 - 13 * std::sqrt(70.0)) / 900;
  const double half = (b - a) / (2 * panels);
  double sum = 0;
  for (int i = 0; i < panels; ++i) {
    const double middle = a + (2 * i + 1) * half;
    sum += 128.0 / 225 * f(middle) + near_weight * (f(middle - near * half) + f(middle + near * half)) +
           far_weight * (f(middle - far * half) + f(middle + far * half));
  }
  return half * sum;
}

/// Newton's method from x, with `step` the residual over its slope.
template <class F>
double inverse(double x, F&& step) {
  for (int i = 0; i < 30; ++i) {
    const double change = step(x);
    x -= change;
    if (std::abs(change) < 1e-13) break;
  }
  return x;
}

}  // namespace grapnel::oracle
