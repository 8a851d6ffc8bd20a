// Rigid-body inertia against explicit formulas with 3 x 3 matrices.
#include "grapnel/spatial/spatial_vector.hpp"

#include <gtest/gtest.h>

#include "support/eigen_values.hpp"
#include "support/random_robot.hpp"

namespace grapnel {
namespace inertia_test {

using namespace testing;

Eigen::Matrix3d skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v[2], v[1], v[2], 0, -v[0], -v[1], v[0], 0;
  return m;
}

struct Solid {
  double mass;
  Vector3d com;
  Symmetric3d central;
  RigidBodyInertiad inertia() const { return RigidBodyInertiad::about_com(mass, com, central); }
};
Solid random_solid(Random& random) {
  const double mass = random.uniform(0.5, 20);
  const Vector3d com = random.vector(1);
  return {mass, com, random_inertia(mass, 1, random)};
}

// The 6 x 6 matrix [I - m cx cx, m cx; -m cx, m].
Eigen::MatrixXd matrix(double mass, const Eigen::Vector3d& com, const Eigen::Matrix3d& central) {
  Eigen::MatrixXd M(6, 6);
  const Eigen::Matrix3d c = skew(com);
  M << central - mass * c * c, mass * c, -mass * c, mass * Eigen::Matrix3d::Identity();
  return M;
}
Eigen::MatrixXd matrix(const RigidBodyInertiad& I) {
  Eigen::MatrixXd M(6, 6);
  const Eigen::Matrix3d h = skew(eigen(I.first_moment));
  M << eigen(I.rotational), h, -h, I.mass * Eigen::Matrix3d::Identity();
  return M;
}

TEST(RigidBodyInertia, EqualsTheExplicitMatrix) {
  Random random(0);
  for (int i = 0; i < 200; ++i) {
    const Solid s = random_solid(random);
    const RigidBodyInertiad I = s.inertia();
    EXPECT_LT(relative_difference(matrix(I), matrix(s.mass, eigen(s.com), eigen(s.central))), 1e-15);
    const Vector3d w = random.vector(1);
    const Twistd V{w, random.vector(1)};
    EXPECT_LT((eigen(I * V) - matrix(I) * eigen(V)).norm(), 1e-13);
    const SpatialAccelerationd A{V.linear, V.angular};
    EXPECT_LT((eigen(I * A) - matrix(I) * eigen(A)).norm(), 1e-13);
    EXPECT_LT(norm(I.com() - s.com), 1e-14);
    EXPECT_LT(relative_difference(eigen(I.rotational_about_com()), eigen(s.central)), 1e-12);
  }
}

TEST(RigidBodyInertia, ShiftsAndRotates) {
  Random random(1);
  for (int i = 0; i < 200; ++i) {
    const Solid s = random_solid(random);
    const Posed X{random.rotation(), random.vector(2)};
    const Eigen::Matrix3d R = eigen(X.R);
    EXPECT_LT(relative_difference(matrix(shift_origin(s.inertia(), X.p)),
                                  matrix(s.mass, eigen(s.com + X.p), eigen(s.central))),
              1e-14);
    EXPECT_LT(relative_difference(matrix(X * s.inertia()),
                                  matrix(s.mass, eigen(X * s.com), R * eigen(s.central) * R.transpose())),
              1e-14);
    EXPECT_LT(relative_difference(eigen(rotate(X.R, s.central)), Eigen::Matrix3d(R * eigen(s.central) * R.transpose())),
              1e-14);
    // Energy is independent of the reference point: V . I V.
    const Vector3d w = random.vector(1);
    const Twistd V{w, random.vector(1)};
    const Twistd V_A = X.R * V, V_moved = shift(V_A, -X.p);
    const double energy = dot(s.inertia() * V, V);
    EXPECT_NEAR(dot((X * s.inertia()) * V_moved, V_moved), energy, 1e-12 * energy);
  }
}

TEST(RigidBodyInertia, AddsUp) {
  Random random(2);
  const Solid a = random_solid(random), b = random_solid(random);
  RigidBodyInertiad sum = RigidBodyInertiad::zero();
  sum += a.inertia();
  sum += b.inertia();
  EXPECT_LT(relative_difference(matrix(sum), Eigen::MatrixXd(matrix(a.inertia()) + matrix(b.inertia()))), 1e-15);
}

TEST(Symmetric3, IndexesItsEntries) {
  Symmetric3d A{1, 2, 3, 4, 5, 6};
  const Eigen::Matrix3d expected{{1, 4, 5}, {4, 2, 6}, {5, 6, 3}};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) EXPECT_EQ(A(i, j), expected(i, j));
  }
  EXPECT_EQ(eigen(A * Vector3d{1, -1, 2}), expected * Eigen::Vector3d(1, -1, 2));
}

// A point mass at p has the moment of inertia m |p x axis|^2.
TEST(PointMassInertia, KnownValues) {
  const Symmetric3d J = point_mass_inertia(2.0, Vector3d{1, 2, 3});
  EXPECT_EQ(eigen(J), (Eigen::Matrix3d{{26, -4, -6}, {-4, 20, -12}, {-6, -12, 10}}));
}

}  // namespace inertia_test
}  // namespace grapnel
