#include "oracle/planar_dual_arm.hpp"

#include <cmath>

namespace grapnel::oracle {
namespace {

Eigen::Vector2d e(double f) { return {std::cos(f), std::sin(f)}; }
Eigen::Vector2d n(double f) { return {-std::sin(f), std::cos(f)}; }

// Absolute angles (1); also of rates.
Eigen::Vector4d absolute(const Vector6& x) { return {x[2], x[2] + x[3], x[2] + x[3] + x[4], x[2] + x[5]}; }

}  // namespace

Eigen::Vector4d PlanarDualArm::k() const { return {b1 * (m1 + m2) + b2 * m3, m1 * d1 + m2 * a1, m2 * d2, m3 * d3}; }

Eigen::Matrix4d PlanarDualArm::K() const {
  const Eigen::Vector4d c = k();
  Eigen::Matrix4d result = Eigen::Matrix4d::Zero();
  result(0, 0) = I0 + b1 * b1 * (m1 + m2) + b2 * b2 * m3;
  result(1, 1) = I1 + m1 * d1 * d1 + m2 * a1 * a1;
  result(2, 2) = I2 + m2 * d2 * d2;
  result(3, 3) = I3 + m3 * d3 * d3;
  result(0, 1) = result(1, 0) = b1 * c[1];
  result(0, 2) = result(2, 0) = b1 * c[2];
  result(1, 2) = result(2, 1) = a1 * c[2];
  result(0, 3) = result(3, 0) = b2 * c[3];
  return result;
}

Matrix6 mass_matrix(const PlanarDualArm& robot, const Vector6& q) {
  const Eigen::Vector4d k = robot.k(), f = absolute(q);
  const Eigen::Matrix4d K = robot.K();
  const double c1 = std::cos(q[3]), c2 = std::cos(q[4]), c12 = std::cos(q[3] + q[4]), c3 = std::cos(q[5]);
  Matrix6 M = Matrix6::Zero();
  M(0, 0) = M(1, 1) = robot.mass();
  // Columns of k_j n(f_j), summed over all angles that each joint changes.
  const Eigen::Vector2d link1 = k[1] * n(f[1]), link2 = k[2] * n(f[2]), link3 = k[3] * n(f[3]);
  M.block<2, 1>(0, 2) = k[0] * n(f[0]) + link1 + link2 + link3;
  M.block<2, 1>(0, 3) = link1 + link2;
  M.block<2, 1>(0, 4) = link2;
  M.block<2, 1>(0, 5) = link3;
  M(2, 2) = K.trace() + 2 * (K(0, 1) * c1 + K(0, 2) * c12 + K(1, 2) * c2 + K(0, 3) * c3);
  M(2, 3) = K(1, 1) + K(2, 2) + K(0, 1) * c1 + K(0, 2) * c12 + 2 * K(1, 2) * c2;
  M(2, 4) = K(2, 2) + K(0, 2) * c12 + K(1, 2) * c2;
  M(2, 5) = K(3, 3) + K(0, 3) * c3;
  M(3, 3) = K(1, 1) + K(2, 2) + 2 * K(1, 2) * c2;
  M(3, 4) = K(2, 2) + K(1, 2) * c2;
  M(4, 4) = K(2, 2);
  M(5, 5) = K(3, 3);
  M.triangularView<Eigen::StrictlyLower>() = M.transpose();
  return M;
}

Vector6 bias(const PlanarDualArm& robot, const PlanarState& state) {
  const Vector6& q = state.q;
  const Eigen::Vector4d k = robot.k(), f = absolute(q), w2 = absolute(state.rate).cwiseAbs2();
  const Eigen::Matrix4d K = robot.K();
  const double s1 = std::sin(q[3]), s2 = std::sin(q[4]), s12 = std::sin(q[3] + q[4]), s3 = std::sin(q[5]);
  Vector6 c = Vector6::Zero();
  for (int j = 0; j < 4; ++j) c.head<2>() -= k[j] * w2[j] * e(f[j]);
  const double g0 = -K(0, 1) * w2[1] * s1 - K(0, 2) * w2[2] * s12 - K(0, 3) * w2[3] * s3;
  const double g1 = K(0, 1) * w2[0] * s1 - K(1, 2) * w2[2] * s2;
  const double g2 = K(0, 2) * w2[0] * s12 + K(1, 2) * w2[1] * s2;
  const double g3 = K(0, 3) * w2[0] * s3;
  c.tail<4>() << g0 + g1 + g2 + g3, g1 + g2, g2, g3;
  return c;
}

double kinetic_energy(const PlanarDualArm& robot, const PlanarState& state) {
  const Eigen::Vector4d f = absolute(state.q), w = absolute(state.rate);
  const Eigen::Vector2d v0 = state.rate.head<2>();
  const Eigen::Vector2d v1 = v0 + robot.b1 * w[0] * n(f[0]) + robot.d1 * w[1] * n(f[1]);
  const Eigen::Vector2d v2 = v0 + robot.b1 * w[0] * n(f[0]) + robot.a1 * w[1] * n(f[1]) + robot.d2 * w[2] * n(f[2]);
  const Eigen::Vector2d v3 = v0 + robot.b2 * w[0] * n(f[0]) + robot.d3 * w[3] * n(f[3]);
  const double linear = robot.m0 * v0.squaredNorm() + robot.m1 * v1.squaredNorm() + robot.m2 * v2.squaredNorm() +
                        robot.m3 * v3.squaredNorm();
  const double angular =
      robot.I0 * w[0] * w[0] + robot.I1 * w[1] * w[1] + robot.I2 * w[2] * w[2] + robot.I3 * w[3] * w[3];
  return (linear + angular) / 2;
}

Eigen::Vector3d momentum(const PlanarDualArm& robot, const PlanarState& state) {
  const Eigen::Vector4d k = robot.k(), f = absolute(state.q), w = absolute(state.rate);
  const Eigen::Vector2d v0 = state.rate.head<2>();
  Eigen::Vector2d p = robot.mass() * v0;
  // l = dT/dt0' of (3): every absolute angle contains t0.
  double l = 0;
  for (int j = 0; j < 4; ++j) {
    p += k[j] * w[j] * n(f[j]);
    l += k[j] * v0.dot(n(f[j]));
    for (int i = 0; i < 4; ++i) l += robot.K()(j, i) * w[i] * std::cos(f[j] - f[i]);
  }
  return {p[0], p[1], l};
}

Eigen::Matrix<double, 2, 3> joint_momentum(const PlanarDualArm& robot, const Vector6& q) {
  const Eigen::Vector4d k = robot.k(), f = absolute(q);
  Eigen::Matrix<double, 2, 3> J;
  J << k[1] * n(f[1]) + k[2] * n(f[2]), k[2] * n(f[2]), k[3] * n(f[3]);
  return J;
}

Eigen::Vector3d tip(const PlanarDualArm& robot, const Vector6& q, int arm) {
  const Eigen::Vector4d f = absolute(q);
  Eigen::Vector3d result;
  if (arm == 1) {
    result << q.head<2>() + robot.b1 * e(f[0]) + robot.a1 * e(f[1]) + robot.a2 * e(f[2]), f[2];
  } else {
    result << q.head<2>() + robot.b2 * e(f[0]) + robot.a3 * e(f[3]), f[3];
  }
  return result;
}

Eigen::Matrix<double, 3, 6> tip_jacobian(const PlanarDualArm& robot, const Vector6& q, int arm) {
  const Eigen::Vector4d f = absolute(q);
  Eigen::Matrix<double, 3, 6> J = Eigen::Matrix<double, 3, 6>::Zero();
  J.topLeftCorner<2, 2>().setIdentity();
  if (arm == 1) {
    const Eigen::Vector2d second = robot.a2 * n(f[2]), first = robot.a1 * n(f[1]) + second;
    J.col(2) << robot.b1 * n(f[0]) + first, 1;
    J.col(3) << first, 1;
    J.col(4) << second, 1;
  } else {
    const Eigen::Vector2d link = robot.a3 * n(f[3]);
    J.col(2) << robot.b2 * n(f[0]) + link, 1;
    J.col(5) << link, 1;
  }
  return J;
}

}  // namespace grapnel::oracle
