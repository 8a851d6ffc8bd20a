#pragma once

/// @file
/// A planar five-bar linkage (two degrees of freedom) on the ground, by Lagrange's equations in its two crank angles.
/// Independent of Grapnel.
///
/// Pivots on the base A = (0, 0) and E = (g, 0); cranks of length a, c at angles x = (x_1, x_2), couplers of length b,
/// d at y = (y_1, y_2) from their ends, joined at P: a e(x_1) + b e(y_1) = g e_x + c e(x_2) + d e(y_2) (1). Its rates
/// times e(y_2) and e(y_1), as in four_bar.hpp:
///   y_1' = (c x_2' sin(y_2 - x_2) - a x_1' sin(y_2 - x_1)) / (b sin(y_2 - y_1)),
///   y_2' = (a x_1' sin(y_1 - x_1) - c x_2' sin(y_1 - x_2)) / (d sin(y_1 - y_2)), (2)
/// so y' = K x', and again, for what remains of y'' at x'' = 0:
///   k_1 = (a x_1'^2 cos(x_1 - y_2) + b y_1'^2 cos(y_1 - y_2) - c x_2'^2 cos(x_2 - y_2) - d y_2'^2) / (b sin(y_2 -
///   y_1)), k_2 = (c x_2'^2 cos(x_2 - y_1) + d y_2'^2 cos(y_1 - y_2) - a x_1'^2 cos(x_1 - y_1) - b y_1'^2) / (d sin(y_1
///   - y_2)). (3)
/// With the Jacobians G of the centres of mass and K of the angles by x, Lagrange's equations are
///   (sum m G^T G + I K^T K) x'' + sum m G^T (G' x') + I K^T k = torque + sum m G^T gravity. (4)

#include <Eigen/LU>
#include <array>

#include "oracle/planar_linkage.hpp"

namespace grapnel::oracle {

struct FiveBar {
  double ground;               // distance of the base's pivots [m]
  std::array<Bar, 2> crank;    // from A and from E
  std::array<Bar, 2> coupler;  // from the cranks' ends
  int side = 1;                // side of the line between the cranks' ends on which P lies
  Vector2 gravity = Vector2::Zero();

  Vector2 pivot(int arm) const { return {arm * ground, 0}; }
  Vector2 crank_end(const Vector2& x, int arm) const { return pivot(arm) + crank[arm].length * along(x[arm]); }
  /// Angles of the couplers.
  Vector2 coupler_angles(const Vector2& x) const {
    const Vector2 B = crank_end(x, 0), F = crank_end(x, 1);
    const double y = apex_angle(B, F, coupler[0].length, coupler[1].length, side);
    const Vector2 from_F = B + coupler[0].length * along(y) - F;
    return {y, std::atan2(from_F[1], from_F[0])};
  }
  /// K of (2).
  Eigen::Matrix2d coupler_slopes(const Vector2& x, const Vector2& y) const {
    const double a = crank[0].length, b = coupler[0].length, c = crank[1].length, d = coupler[1].length;
    Eigen::Matrix2d K;
    K.row(0) << -a * std::sin(y[1] - x[0]), c * std::sin(y[1] - x[1]);
    K.row(1) << a * std::sin(y[0] - x[0]), -c * std::sin(y[0] - x[1]);
    K.row(0) /= b * std::sin(y[1] - y[0]);
    K.row(1) /= d * std::sin(y[0] - y[1]);
    return K;
  }
  /// k of (3).
  Vector2 coupler_bias(const Vector2& x, const Vector2& y, const Vector2& rate, const Vector2& yrate) const {
    const double a = crank[0].length, b = coupler[0].length, c = crank[1].length, d = coupler[1].length;
    const Vector2 x2 = rate.cwiseAbs2(), y2 = yrate.cwiseAbs2();
    const double between = std::cos(y[0] - y[1]);
    return {(a * x2[0] * std::cos(x[0] - y[1]) + b * y2[0] * between - c * x2[1] * std::cos(x[1] - y[1]) - d * y2[1]) /
                (b * std::sin(y[1] - y[0])),
            (c * x2[1] * std::cos(x[1] - y[0]) + d * y2[1] * between - a * x2[0] * std::cos(x[0] - y[0]) - b * y2[0]) /
                (d * std::sin(y[0] - y[1]))};
  }
  /// M and the other terms of (4) without the torque: M x'' = torque - c.
  void equations(const Vector2& x, const Vector2& rate, Eigen::Matrix2d& M, Vector2& c) const {
    const Vector2 y = coupler_angles(x);
    const Eigen::Matrix2d K = coupler_slopes(x, y);
    const Vector2 yrate = K * rate, k = coupler_bias(x, y, rate, yrate);
    M.setZero(), c.setZero();
    for (int arm = 0; arm < 2; ++arm) {
      const double r2 = rate[arm] * rate[arm];
      Eigen::Matrix2d G = Eigen::Matrix2d::Zero();
      G.col(arm) = crank[arm].com_slope(x[arm]);
      Eigen::RowVector2d turn = Eigen::RowVector2d::Unit(arm);
      add(crank[arm], G, turn, -r2 * crank[arm].com(x[arm]), 0, M, c);
      turn = K.row(arm);
      G = coupler[arm].com_slope(y[arm]) * turn;
      G.col(arm) += crank[arm].length * across(x[arm]);
      const Vector2 bias = -crank[arm].length * r2 * along(x[arm]) + k[arm] * coupler[arm].com_slope(y[arm]) -
                           yrate[arm] * yrate[arm] * coupler[arm].com(y[arm]);
      add(coupler[arm], G, turn, bias, k[arm], M, c);
    }
  }
  Vector2 acceleration(const Vector2& x, const Vector2& rate, const Vector2& torque = Vector2::Zero()) const {
    Eigen::Matrix2d M;
    Vector2 c;
    equations(x, rate, M, c);
    return M.inverse() * (torque - c);
  }
  double kinetic_energy(const Vector2& x, const Vector2& rate) const {
    Eigen::Matrix2d M;
    Vector2 c;
    equations(x, rate, M, c);
    return rate.dot(M * rate) / 2;
  }
  /// Classical Runge-Kutta on (4) without torque.
  void integrate(Vector2& x, Vector2& rate, double duration, int steps) const {
    const double h = duration / steps;
    for (int i = 0; i < steps; ++i) {
      const Vector2 a1 = acceleration(x, rate), v2 = rate + h / 2 * a1;
      const Vector2 a2 = acceleration(x + h / 2 * rate, v2), v3 = rate + h / 2 * a2;
      const Vector2 a3 = acceleration(x + h / 2 * v2, v3), v4 = rate + h * a3;
      const Vector2 a4 = acceleration(x + h * v3, v4);
      x += h / 6 * (rate + 2 * v2 + 2 * v3 + v4);
      rate += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
    }
  }

 private:
  // A bar with the Jacobians of its centre and its angle, and their accelerations at x'' = 0.
  void add(const Bar& bar, const Eigen::Matrix2d& G, const Eigen::RowVector2d& turn, const Vector2& bias, double k,
           Eigen::Matrix2d& M, Vector2& c) const {
    M += bar.mass * G.transpose() * G + bar.inertia * turn.transpose() * turn;
    c += bar.mass * G.transpose() * (bias - gravity) + bar.inertia * k * turn.transpose();
  }
};

}  // namespace grapnel::oracle
