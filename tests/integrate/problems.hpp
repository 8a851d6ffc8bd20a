#pragma once

/// @file
/// Differential equations with known solutions, for the tests of the steppers.

#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "grapnel/integrate/manifold.hpp"

namespace grapnel::problems {

using Vector = std::vector<double>;

inline double largest_difference(std::span<const double> a, std::span<const double> b) {
  double largest = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, std::abs(a[i] - b[i]));
  return largest;
}

/// Nonlinear and non-autonomous, solution y = (exp(sin t), 1/(1 + t)): y0' = y0 cos t, y1' = −y1², coupled so that
/// every elementary differential contributes: y0' = cos t · y0 · (1 + t) y1, y1' = −y1² + y0 − exp(sin t).
struct Coupled {
  static constexpr int kSize = 2;
  void operator()(double t, std::span<const double> y, std::span<double> dydt) const {
    dydt[0] = std::cos(t) * y[0] * (1.0 + t) * y[1];
    dydt[1] = -y[1] * y[1] + y[0] - std::exp(std::sin(t));
  }
  static Vector exact(double t) { return {std::exp(std::sin(t)), 1.0 / (1.0 + t)}; }
};

/// Two-body motion in a plane with gravitational parameter 1 and semi-major axis 1, from the pericentre: y = (x, y, vx,
/// vy).
struct Kepler {
  static constexpr int kSize = 4;
  void operator()(double, std::span<const double> y, std::span<double> dydt) const {
    const double r2 = y[0] * y[0] + y[1] * y[1];
    const double r3 = r2 * std::sqrt(r2);
    dydt[0] = y[2];
    dydt[1] = y[3];
    dydt[2] = -y[0] / r3;
    dydt[3] = -y[1] / r3;
  }
  /// By Kepler's equation E − e sin E = t.
  static Vector exact(double t, double e) {
    double anomaly = t;
    for (int i = 0; i < 50; ++i) anomaly -= (anomaly - e * std::sin(anomaly) - t) / (1.0 - e * std::cos(anomaly));
    const double root = std::sqrt(1.0 - e * e);
    const double rate = 1.0 / (1.0 - e * std::cos(anomaly));
    return {std::cos(anomaly) - e, root * std::sin(anomaly), -std::sin(anomaly) * rate,
            root * std::cos(anomaly) * rate};
  }
};

/// Torque-free rigid body with principal moments of inertia [kg m²]: y = (quaternion_wxyz of R_WB, ω in B [rad/s]).
struct RigidBody {
  std::array<double, 3> inertia;

  static constexpr int kSize = 7;
  static Manifold manifold() { return {.size = kSize, .quaternions = {0}}; }

  void operator()(double, std::span<const double> y, std::span<double> dydt) const {
    const double *q = y.data(), *w = y.data() + 4;
    dydt[0] = 0.5 * (-q[1] * w[0] - q[2] * w[1] - q[3] * w[2]);
    dydt[1] = 0.5 * (q[0] * w[0] + q[2] * w[2] - q[3] * w[1]);
    dydt[2] = 0.5 * (q[0] * w[1] + q[3] * w[0] - q[1] * w[2]);
    dydt[3] = 0.5 * (q[0] * w[2] + q[1] * w[1] - q[2] * w[0]);
    dydt[4] = (inertia[1] - inertia[2]) / inertia[0] * w[1] * w[2];
    dydt[5] = (inertia[2] - inertia[0]) / inertia[1] * w[2] * w[0];
    dydt[6] = (inertia[0] - inertia[1]) / inertia[2] * w[0] * w[1];
  }

  /// In W [kg m²/s].
  std::array<double, 3> angular_momentum(std::span<const double> y) const {
    const double *q = y.data(), *w = y.data() + 4;
    const std::array<double, 3> h = {inertia[0] * w[0], inertia[1] * w[1], inertia[2] * w[2]};
    // h + 2 q_w (q_v × h) + 2 q_v × (q_v × h)
    const std::array<double, 3> c = {q[2] * h[2] - q[3] * h[1], q[3] * h[0] - q[1] * h[2], q[1] * h[1] - q[2] * h[0]};
    return {h[0] + 2.0 * (q[0] * c[0] + q[2] * c[2] - q[3] * c[1]),
            h[1] + 2.0 * (q[0] * c[1] + q[3] * c[0] - q[1] * c[2]),
            h[2] + 2.0 * (q[0] * c[2] + q[1] * c[1] - q[2] * c[0])};
  }
  double kinetic_energy(std::span<const double> y) const {
    return 0.5 * (inertia[0] * y[4] * y[4] + inertia[1] * y[5] * y[5] + inertia[2] * y[6] * y[6]);
  }
};

/// p ⊗ q for quaternions (w, x, y, z).
inline std::array<double, 4> multiply(const std::array<double, 4>& p, const std::array<double, 4>& q) {
  return {p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3], p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2],
          p[0] * q[2] + p[2] * q[0] + p[3] * q[1] - p[1] * q[3], p[0] * q[3] + p[3] * q[0] + p[1] * q[2] - p[2] * q[1]};
}

/// Jacobi's elliptic functions by descending Landen transformation (Abramowitz & Stegun 16.4).
struct Elliptic {
  double sn, cn, dn;
};
inline Elliptic jacobi_elliptic(double u, double parameter_m) {
  std::array<double, 16> a{}, c{};
  a[0] = 1.0;
  c[0] = std::sqrt(parameter_m);
  double b = std::sqrt(1.0 - parameter_m);
  int n = 0;
  while (c[n] > 1e-17 && n < 15) {
    a[n + 1] = 0.5 * (a[n] + b);
    c[n + 1] = 0.5 * (a[n] - b);
    b = std::sqrt(a[n] * b);
    ++n;
  }
  double phi = std::ldexp(a[n] * u, n);
  for (; n > 0; --n) phi = 0.5 * (phi + std::asin(c[n] * std::sin(phi) / a[n]));
  const double sn = std::sin(phi);
  return {sn, std::cos(phi), std::sqrt(1.0 - parameter_m * sn * sn)};
}

}  // namespace grapnel::problems
