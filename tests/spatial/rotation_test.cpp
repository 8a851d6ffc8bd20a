// Rotations, quaternions and poses at identity, close to it, close to half turns and at random.
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "grapnel/spatial/pose.hpp"
#include "support/eigen_values.hpp"
#include "support/random_robot.hpp"

namespace grapnel {
namespace rotation_test {

using namespace testing;

// Critical angles, about random axes and the coordinate axes.
struct AxisAngle {
  Vector3d axis;
  double angle;
};
std::vector<AxisAngle> axes_and_angles() {
  std::vector<AxisAngle> result;
  Random random(0);
  for (double angle :
       {0.0, 1e-300, 1e-16, 1e-8, 1e-4, 0.3, 1.0, M_PI / 2, 2.0, M_PI - 1e-4, M_PI - 1e-8, M_PI - 1e-15}) {
    for (int k = 0; k < 3; ++k)
      result.push_back({Vector3d::unit(k), angle}), result.push_back({-Vector3d::unit(k), angle});
    for (int i = 0; i < 50; ++i) result.push_back({random.direction(), angle});
  }
  for (int i = 0; i < 500; ++i) result.push_back({random.direction(), random.uniform(0, M_PI)});
  return result;
}

Eigen::Matrix3d expected_matrix(const AxisAngle& x) {
  return Eigen::AngleAxisd(x.angle, eigen(x.axis)).toRotationMatrix();
}

TEST(Rotation, AboutAnAxisIsRodriguesFormula) {
  for (const AxisAngle& x : axes_and_angles()) {
    const Eigen::Matrix3d R = eigen(rotation_about(x.axis, x.angle));
    EXPECT_LT((R - expected_matrix(x)).norm(), 4e-15);  // measured 1e-15
    EXPECT_LT((R * R.transpose() - Eigen::Matrix3d::Identity()).norm(), 4e-15);
  }
  // A quarter turn about z maps x to y.
  const Vector3d y = rotation_about({0, 0, 1}, M_PI / 2) * Vector3d{1, 0, 0};
  EXPECT_NEAR(y[0], 0, 1e-15);
  EXPECT_NEAR(y[1], 1, 1e-15);
}

TEST(Rotation, VectorAndAngleRoundTrip) {
  for (const AxisAngle& x : axes_and_angles()) {
    const Rotationd R = rotation_about(x.axis, x.angle);
    SCOPED_TRACE(x.angle);
    const Eigen::Vector3d v = eigen(rotation_vector(R)), expected = x.angle * eigen(x.axis);
    // At half a turn both signs of the axis are valid.
    const double error =
        x.angle > M_PI - 1e-7 ? std::min((v - expected).norm(), (v + expected).norm()) : (v - expected).norm();
    EXPECT_LT(error, 2e-15 + 1e-15 * x.angle);  // measured 1e-15
    if (x.angle > 0 && x.angle < 1e-3) {
      EXPECT_LT(error, 1e-11 * x.angle) << "small angles keep their digits";
    }
    EXPECT_NEAR(rotation_angle(R), x.angle, 3e-15);
  }
}

TEST(Quaternion, RoundTripsThroughTheMatrix) {
  for (const AxisAngle& x : axes_and_angles()) {
    SCOPED_TRACE(x.angle);
    const Rotationd R = rotation_about(x.axis, x.angle);
    const Quaterniond q = quaternion_from(R);
    EXPECT_GE(q.w, 0);
    EXPECT_NEAR(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z, 1, 1e-15);
    EXPECT_LT((eigen(rotation_matrix(q)) - eigen(R)).norm(), 4e-15);  // measured 1e-15
    const Eigen::Quaterniond expected(Eigen::AngleAxisd(x.angle, eigen(x.axis)));
    const Eigen::Vector4d got(q.w, q.x, q.y, q.z), other(expected.w(), expected.x(), expected.y(), expected.z());
    EXPECT_LT(std::min((got - other).norm(), (got + other).norm()), 4e-15);
  }
}

TEST(Quaternion, ProductIsTheProductOfMatrices) {
  Random random(1);
  for (int i = 0; i < 200; ++i) {
    const Rotationd A = random.rotation(), B = random.rotation();
    EXPECT_LT((eigen(rotation_matrix(quaternion_from(A) * quaternion_from(B))) - eigen(A) * eigen(B)).norm(), 4e-15);
    EXPECT_LT((eigen(A * B) - eigen(A) * eigen(B)).norm(), 1e-15);
    EXPECT_EQ(eigen(transpose(A)), eigen(A).transpose());
    const Vector3d v = random.vector(2);
    EXPECT_LT((eigen(transposed_times(A, v)) - eigen(A).transpose() * eigen(v)).norm(), 2e-15);
  }
}

// q' = q o (0, w)/2 with w in the body: R' = R [w x].
TEST(Quaternion, RateMatchesTheAngularVelocity) {
  Random random(2);
  for (int i = 0; i < 200; ++i) {
    const Quaterniond q = quaternion_from(random.rotation());
    const Vector3d w = random.vector(2);
    const Quaterniond r = quaternion_rate(q, w);
    const auto at = [&](double h) {
      return eigen(rotation_matrix(Quaterniond{q.w + h * r.w, q.x + h * r.x, q.y + h * r.y, q.z + h * r.z}));
    };
    // The matrix is quadratic in the quaternion, so the central difference is exact except for the norm's scale, which
    // is even.
    const Eigen::Matrix3d rate = (at(0.5) - at(-0.5));
    Eigen::Matrix3d cross_w;
    cross_w << 0, -w[2], w[1], w[2], 0, -w[0], -w[1], w[0], 0;
    EXPECT_LT((rate - eigen(rotation_matrix(q)) * cross_w).norm(), 1e-14);
    EXPECT_NEAR(q.w * r.w + q.x * r.x + q.y * r.y + q.z * r.z, 0, 1e-15);
  }
}

TEST(Rotation, FromRollPitchYawMatchesUrdf) {
  Random random(3);
  for (int i = 0; i < 100; ++i) {
    const double r = random.uniform(-3, 3), p = random.uniform(-3, 3), y = random.uniform(-3, 3);
    const Eigen::Matrix3d expected =
        (Eigen::AngleAxisd(y, Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(p, Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(r, Eigen::Vector3d::UnitX()))
            .toRotationMatrix();
    EXPECT_LT((eigen(rotation_from_rpy(r, p, y)) - expected).norm(), 4e-15);
  }
}

TEST(Rotation, BetweenDirectionsIsTheSmallestRotation) {
  Random random(4);
  const auto check = [](const Vector3d& from, const Vector3d& to) {
    const Rotationd R = rotation_between(from, to);
    EXPECT_LT(norm(R * from - to), 4e-15);  // measured 1e-15
    EXPECT_LT((eigen(R) * eigen(R).transpose() - Eigen::Matrix3d::Identity()).norm(), 4e-15);
    EXPECT_NEAR(rotation_angle(R), std::atan2(norm(cross(from, to)), dot(from, to)), 1e-14);
  };
  for (int i = 0; i < 300; ++i) {
    const Vector3d a = random.direction();
    check(a, random.direction());
    check(a, a);
    check(a, -a);
    for (double off : {1e-15, 1e-9, 1e-4, 0.1}) {
      Vector3d near = -a + off * random.direction();
      check(a, (1 / norm(near)) * near);
    }
  }
}

TEST(Rotation, BetweenNaNsIsNaN) { EXPECT_TRUE(std::isnan(rotation_between({NAN, 0, 0}, {1, 0, 0})(0, 0))); }

TEST(Pose, ComposesAndInverts) {
  Random random(5);
  for (int i = 0; i < 100; ++i) {
    const Posed X{random.rotation(), random.vector(3)}, Y{random.rotation(), random.vector(3)};
    const Vector3d p = random.vector(2);
    EXPECT_LT(norm((X * Y) * p - X * (Y * p)), 1e-14);
    const Posed I = X * inverse(X);
    EXPECT_LT(norm(I.p) + (eigen(I.R) - Eigen::Matrix3d::Identity()).norm(), 1e-14);
    EXPECT_LT(norm(inverse(X) * (X * p) - p), 1e-14);
  }
}

}  // namespace rotation_test
}  // namespace grapnel
