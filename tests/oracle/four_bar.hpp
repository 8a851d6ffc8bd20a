#pragma once

/// @file
/// A planar four-bar linkage in closed form, on the ground or floating freely. Independent of Grapnel.
///
/// Pivots on the base A = (0, 0) and D = (g, 0); crank A-B of length a at angle f, coupler B-C of length b at p, rocker
/// D-C of length c at r, all angles in the base's frame. The loop a e(f) + b e(p) = g e_x + c e(r) (1) is solved for p
/// and r as the intersection of two circles; differentiated by f once and twice and multiplied by e(r) and e(p), with
/// n(x) . e(y) = sin(y - x) and e(x) . e(y) = cos(x - y):
///   p' = -a sin(r - f) / (b sin(r - p)),  r' = a sin(p - f) / (c sin(p - r)), (2)
///   p'' = (a cos(f - r) + b p'^2 cos(p - r) - c r'^2) / (b sin(r - p)),
///   r'' = (c r'^2 cos(r - p) - a cos(f - p) - b p'^2) / (c sin(p - r)). (3)
/// So every centre of mass x_i and angle k_i is a function of f alone.
///
/// On the ground J(f) = sum m x'^2 + I k'^2 and J f'' + J' f'^2 / 2 = torque + sum m g . x' (4); with gravity alone
/// J f'^2 / 2 - sum m g . x is constant, and the time follows by quadrature of df / f' (5).
///
/// Floating, with d the distance from the common centre of mass and t the base's angle,
///   J_tt = sum I + m d^2,  J_tf = sum I k' + m d x d',  J_ff = sum I k'^2 + m d'^2, (6)
/// the angular momentum about the centre of mass h = J_tt t' + J_tf f' and the energy
///   E = (J_ff - J_tf^2 / J_tt) f'^2 / 2 + h^2 / (2 J_tt) (7)
/// are constant, which gives f' by f, then the time and the base's angle by quadrature.

#include <Eigen/LU>
#include <array>

#include "oracle/planar_linkage.hpp"

namespace grapnel::oracle {

struct FourBar {
  double ground;  // distance of the base's pivots [m]
  Bar base;       // length not read
  Bar crank, coupler, rocker;
  int side = 1;  // side of the line B-D on which C lies

  /// Angles of coupler and rocker and their first two derivatives by the crank's angle.
  struct Angles {
    double coupler, rocker, coupler1, rocker1, coupler2, rocker2;
  };
  Angles angles(double f) const {
    const double a = crank.length, b = coupler.length, c = rocker.length;
    const Vector2 B = a * along(f), D(ground, 0);
    const double p = apex_angle(B, D, b, c, side);
    const Vector2 from_D = B + b * along(p) - D;
    const double r = std::atan2(from_D[1], from_D[0]);
    const double p1 = -a * std::sin(r - f) / (b * std::sin(r - p));  // (2)
    const double r1 = a * std::sin(p - f) / (c * std::sin(p - r));
    const double p2 =
        (a * std::cos(f - r) + b * p1 * p1 * std::cos(p - r) - c * r1 * r1) / (b * std::sin(r - p));  // (3)
    const double r2 = (c * r1 * r1 * std::cos(r - p) - a * std::cos(f - p) - b * p1 * p1) / (c * std::sin(p - r));
    return {p, r, p1, r1, p2, r2};
  }

  /// Centre of mass in the base's frame with its derivatives by the crank's angle, and those of the bar's angle.
  struct BarMotion {
    Vector2 x, x1, x2;
    double k1, k2;
    const Bar* bar;
  };
  /// Base, crank, coupler, rocker.
  std::array<BarMotion, 4> motion(double f) const {
    const Angles g = angles(f);
    const auto turned = [](const Bar& bar, const Vector2& pivot, double k, double k1, double k2) {
      return BarMotion{
          pivot + bar.com(k), k1 * bar.com_slope(k), k2 * bar.com_slope(k) - k1 * k1 * bar.com(k), k1, k2, &bar};
    };
    const double a = crank.length;
    BarMotion third = turned(coupler, a * along(f), g.coupler, g.coupler1, g.coupler2);
    third.x1 += a * across(f), third.x2 -= a * along(f);
    return {turned(base, {0, 0}, 0, 0, 0), turned(crank, {0, 0}, f, 1, 0), third,
            turned(rocker, {ground, 0}, g.rocker, g.rocker1, g.rocker2)};
  }
};

/// On the ground, in a uniform field `gravity` [m/s^2] of the base's plane.
struct GroundedFourBar {
  FourBar bars;
  Vector2 gravity = Vector2::Zero();

  /// J of (4) and its derivative.
  Vector2 inertia(double f) const {
    Vector2 J = Vector2::Zero();
    for (const FourBar::BarMotion& b : bars.motion(f)) {
      J[0] += b.bar->mass * b.x1.squaredNorm() + b.bar->inertia * b.k1 * b.k1;
      J[1] += 2 * (b.bar->mass * b.x1.dot(b.x2) + b.bar->inertia * b.k1 * b.k2);
    }
    return J;
  }
  double potential(double f) const {
    double U = 0;
    for (const FourBar::BarMotion& b : bars.motion(f)) U -= b.bar->mass * gravity.dot(b.x);
    return U;
  }
  /// f'' by (4), with a torque on the crank.
  double acceleration(double f, double rate, double torque = 0) const {
    const Vector2 J = inertia(f);
    double Q = torque;
    for (const FourBar::BarMotion& b : bars.motion(f)) Q += b.bar->mass * gravity.dot(b.x1);
    return (Q - J[1] * rate * rate / 2) / J[0];
  }
  /// f' at f, positive, for the motion that starts at `start` with `rate`.
  double rate_at(double f, double start, double rate) const {
    return std::sqrt((inertia(start)[0] * rate * rate + 2 * (potential(start) - potential(f))) / inertia(f)[0]);
  }
  /// (5): the time from `start` to `f`.
  double time(double f, double start, double rate) const {
    return integral([&](double x) { return 1 / rate_at(x, start, rate); }, start, f);
  }
  /// Inverse of time(), by Newton's method; f' > 0 throughout.
  double angle_at(double t, double start, double rate) const {
    const double f = start + rate * t;
    return inverse(f, [&](double x) { return (time(x, start, rate) - t) * rate_at(x, start, rate); });
  }
  /// Force of the rocker on the coupler at C, in the base's axes, from the moments about B and about D:
  ///   (x_2 - B) x m (a_2 - g) + I p'' = (C - B) x F,  (x_3 - D) x m (a_3 - g) + I r'' = -(C - D) x F.
  Vector2 force_at_C(double f, double rate, double torque = 0) const {
    const FourBar::Angles g = bars.angles(f);
    const auto motion = bars.motion(f);
    const double f2 = acceleration(f, rate, torque);
    const Vector2 B = bars.crank.length * along(f), D(bars.ground, 0);
    const auto moment = [&](const FourBar::BarMotion& b, const Vector2& pivot) {
      const Vector2 a = b.x1 * f2 + b.x2 * rate * rate - gravity;
      return b.bar->mass * cross(b.x - pivot, a) + b.bar->inertia * (b.k1 * f2 + b.k2 * rate * rate);
    };
    const Vector2 BC = bars.coupler.length * along(g.coupler), DC = bars.rocker.length * along(g.rocker);
    Eigen::Matrix2d A;
    A << -BC[1], BC[0], DC[1], -DC[0];
    return A.inverse() * Vector2(moment(motion[2], B), moment(motion[3], D));
  }
};

/// Floating freely with the base as a fourth moving bar; centre of mass at rest.
struct FloatingFourBar {
  FourBar bars;

  /// Sums of (6) with their derivatives by f, and the centre of mass in the base's frame.
  struct Sums {
    double tt = 0, tf = 0, ff = 0, tt1 = 0, tf1 = 0, ff1 = 0;
    Vector2 com = Vector2::Zero();
    double reduced() const { return ff - tf * tf / tt; }
    double reduced1() const { return ff1 - 2 * tf * tf1 / tt + tf * tf * tt1 / (tt * tt); }
  };
  Sums sums(double f) const {
    Sums s;
    double mass = 0;
    Vector2 com1 = Vector2::Zero(), com2 = Vector2::Zero();
    const auto motion = bars.motion(f);
    for (const auto& b : motion) {
      mass += b.bar->mass;
      s.com += b.bar->mass * b.x, com1 += b.bar->mass * b.x1, com2 += b.bar->mass * b.x2;
    }
    s.com /= mass, com1 /= mass, com2 /= mass;
    for (const auto& b : motion) {
      const double m = b.bar->mass, I = b.bar->inertia;
      const Vector2 d = b.x - s.com, d1 = b.x1 - com1, d2 = b.x2 - com2;
      s.tt += I + m * d.squaredNorm(), s.tt1 += 2 * m * d.dot(d1);
      s.tf += I * b.k1 + m * cross(d, d1), s.tf1 += I * b.k2 + m * cross(d, d2);
      s.ff += I * b.k1 * b.k1 + m * d1.squaredNorm(), s.ff1 += 2 * (I * b.k1 * b.k2 + m * d1.dot(d2));
    }
    return s;
  }
  double energy(double f, double rate, double h) const {  // (7)
    const Sums s = sums(f);
    return s.reduced() * rate * rate / 2 + h * h / (2 * s.tt);
  }
  /// Derivative of (7): f''.
  double acceleration(double f, double rate, double h) const {
    const Sums s = sums(f);
    return (h * h * s.tt1 / (s.tt * s.tt) - s.reduced1() * rate * rate) / (2 * s.reduced());
  }
  double rate_at(double f, double E, double h) const {
    const Sums s = sums(f);
    return std::sqrt((2 * E - h * h / s.tt) / s.reduced());
  }
  double base_rate(double f, double rate, double h) const {
    const Sums s = sums(f);
    return (h - s.tf * rate) / s.tt;
  }
  double time(double f, double start, double E, double h) const {
    return integral([&](double x) { return 1 / rate_at(x, E, h); }, start, f);
  }
  double angle_at(double t, double start, double E, double h) const {
    const double f = start + rate_at(start, E, h) * t;
    return inverse(f, [&](double x) { return (time(x, start, E, h) - t) * rate_at(x, E, h); });
  }
  /// Rotation of the base while the crank moves from `start` to `f`.
  double base_turn(double f, double start, double E, double h) const {
    return integral(
        [&](double x) {
          const double r = rate_at(x, E, h);
          return base_rate(x, r, h) / r;
        },
        start, f);
  }
};

}  // namespace grapnel::oracle
