#pragma once

/// @file
/// Impacts of two free planar bodies in closed form. Body 1 receives the impulse, body 2 its opposite at the same
/// point.

#include <Eigen/Core>

namespace grapnel::oracle {

struct PlanarBody {
  double mass;               // [kg]
  double inertia;            // about the centre of mass [kg m^2]
  Eigen::Vector2d com;       // [m]
  Eigen::Vector2d velocity;  // of the centre of mass [m/s]
  double rate;               // [rad/s]
};

struct PlanarImpact {
  Eigen::Vector2d impulse;  // on body 1 [N s]
  double angular_impulse;   // on body 1 about the contact point [N m s]
  Eigen::Vector2d velocity1, velocity2;
  double rate1, rate2;  // after
};

inline double cross2(const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a[0] * b[1] - a[1] * b[0]; }
inline Eigen::Vector2d turn2(double rate, const Eigen::Vector2d& r) { return {-rate * r[1], rate * r[0]}; }

/// Central impact on a line: P = -(1 + e) (v1 - v2) / (1/m1 + 1/m2) on body 1.
inline double central_impulse(double m1, double v1, double m2, double v2, double restitution) {
  return -(1 + restitution) * (v1 - v2) / (1 / m1 + 1 / m2);
}

/// Eccentric impact at point c along the unit normal n without friction. With r_i = c - com_i, the effective mass along
/// the normal is 1/mu = 1/m1 + 1/m2 + (r1 x n)^2/I1 + (r2 x n)^2/I2, and P = -(1 + e) mu (relative normal velocity).
inline PlanarImpact frictionless_impact(const PlanarBody& a, const PlanarBody& b, const Eigen::Vector2d& c,
                                        const Eigen::Vector2d& n, double restitution) {
  const Eigen::Vector2d r1 = c - a.com, r2 = c - b.com;
  const double x1 = cross2(r1, n), x2 = cross2(r2, n);
  const double approach = (a.velocity + turn2(a.rate, r1) - b.velocity - turn2(b.rate, r2)).dot(n);
  const double P =
      -(1 + restitution) * approach / (1 / a.mass + 1 / b.mass + x1 * x1 / a.inertia + x2 * x2 / b.inertia);
  return {P * n,
          0,
          a.velocity + P / a.mass * n,
          b.velocity - P / b.mass * n,
          a.rate + P * x1 / a.inertia,
          b.rate - P * x2 / b.inertia};
}

/// Perfectly plastic impact at c with rigid connection: momentum alone determines the motion. About the common centre
/// of mass, with the reduced mass mu = m1 m2/(m1 + m2) and d = com2 - com1, w = (I1 w1 + I2 w2 + mu d x (v2 - v1)) /
/// (I1 + I2 + mu |d|^2). The impulse depends on c only through the reference point of its angular part.
inline PlanarImpact rigid_grasp(const PlanarBody& a, const PlanarBody& b, const Eigen::Vector2d& c) {
  const double m = a.mass + b.mass, mu = a.mass * b.mass / m;
  const Eigen::Vector2d d = b.com - a.com, common = (a.mass * a.velocity + b.mass * b.velocity) / m;
  const Eigen::Vector2d center = (a.mass * a.com + b.mass * b.com) / m;
  const double rate = (a.inertia * a.rate + b.inertia * b.rate + mu * cross2(d, b.velocity - a.velocity)) /
                      (a.inertia + b.inertia + mu * d.squaredNorm());
  const Eigen::Vector2d v1 = common + turn2(rate, a.com - center), v2 = common + turn2(rate, b.com - center);
  const Eigen::Vector2d P = a.mass * (v1 - a.velocity);
  return {P, a.inertia * (rate - a.rate) - cross2(c - a.com, P), v1, v2, rate, rate};
}

}  // namespace grapnel::oracle
