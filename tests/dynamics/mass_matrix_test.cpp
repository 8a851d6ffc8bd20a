// The mass matrix, momentum and kinetic energy by independent computations.
#include <gtest/gtest.h>

#include "dynamics/random_case.hpp"
#include "grapnel/dynamics/momentum.hpp"
#include "grapnel/spatial/decompositions.hpp"
#include "support/worst.hpp"

namespace grapnel {
namespace mass_matrix_test {

using namespace testing;

TEST(MassMatrix, ColumnsAreInverseDynamicsOfUnitAccelerations) {
  Worst difference("mass matrix against inverse-dynamics columns");
  for (int i = 0; i < kRobots; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Case c = random_case(i);
    const int n = c.model.velocities();
    if (n == 0) continue;
    State rest = c.state;
    rest.v.assign(n, 0.0);
    const Eigen::MatrixXd M = mass_matrix(c.model, c.state);
    const Eigen::VectorXd h = bias_of(c);
    for (int k = 0; k < n; ++k) {
      std::vector<double> unit(n, 0.0);
      unit[k] = 1;
      const Eigen::VectorXd column = eigen(inverse_dynamics(c.model, rest, unit));
      ASSERT_LT(difference.note((column - M.col(k)).norm() / M.norm(), i), 1e-13);  // measured 7.0e-16
      // Velocities and gravity add the bias.
      const Eigen::VectorXd moving = eigen(inverse_dynamics(c.model, c.state, unit, {{}, {}, c.forces.gravity}));
      ASSERT_LT((moving - h - M.col(k)).norm() / (M.norm() + h.norm()), 1e-13);
    }
    ASSERT_EQ(M, M.transpose());
    ASSERT_EQ(M.llt().info(), Eigen::Success) << "not positive definite";
  }
}

// M = sum over bodies of J^T diag(I, m) J at their centres of mass, plus the reflected rotor inertias.
TEST(MassMatrix, IsTheSumOverBodiesOfJtIJ) {
  Worst difference("mass matrix against sum of J^T I J");
  for (int i = 0; i < kRobots; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Case c = random_case(i);
    const int n = c.model.velocities();
    if (n == 0) continue;
    const Kinematics kinematics = forward_kinematics(c.model, c.state);
    Eigen::MatrixXd expected = Eigen::MatrixXd::Zero(n, n), J(6, n);
    for (std::size_t b = 0; b < c.model.bodies().size(); ++b) {
      const BodyDescription& d = c.model.bodies()[b].description;
      const Posed& X = kinematics.X_WB[b];
      point_jacobian(c.model, kinematics, static_cast<int>(b), X * d.com, J);
      const Eigen::Matrix3d I = eigen(X.R) * eigen(d.inertia) * eigen(X.R).transpose();
      expected += J.topRows(3).transpose() * I * J.topRows(3) + d.mass * J.bottomRows(3).transpose() * J.bottomRows(3);
      if (velocity_count(d.joint.type) == 1) {
        expected(c.model.bodies()[b].v, c.model.bodies()[b].v) +=
            d.joint.gear_ratio * d.joint.gear_ratio * d.joint.rotor_inertia;
      }
    }
    const Eigen::MatrixXd M = mass_matrix(c.model, c.state);
    ASSERT_LT(difference.note(relative_difference(M, expected), i), 1e-13);  // measured 3.5e-15
  }
}

TEST(Momentum, IsTheBaseRowsOfTheMassMatrixTimesVelocities) {
  Worst difference("momentum against base rows of M v");
  for (int i = 0; i < kRobots; ++i) {
    if (i % 4 == 3) continue;  // a fixed root has no rows
    SCOPED_TRACE(seed_note(i));
    const Case c = random_case(i);
    const Kinematics kinematics = forward_kinematics(c.model, c.state);
    const Eigen::VectorXd h = mass_matrix(c.model, c.state) * eigen(c.state.v);
    for (std::size_t b = 0; b < c.model.bodies().size(); ++b) {
      const Body& body = c.model.bodies()[b];
      if (body.parent >= 0) continue;
      const int roots[] = {static_cast<int>(b)};
      const Posed& X = kinematics.X_WB[b];
      const Momentumd h_W =
          X.R * Momentumd{{h[body.v], h[body.v + 1], h[body.v + 2]}, {h[body.v + 3], h[body.v + 4], h[body.v + 5]}};
      const Momentumd total = momentum_about(c.model, kinematics, X.p, roots);
      ASSERT_GT(eigen(total).norm(), 0);
      ASSERT_LT(difference.note(relative_difference(eigen(h_W), eigen(total)), i), 1e-12);  // measured 2.5e-15
    }
  }
}

TEST(Momentum, IsTheSumOfInertiaTimesTwist) {
  Worst difference("momentum against sum of I V");
  for (int i = 0; i < kRobots; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Case c = random_case(i);
    const Kinematics kinematics = forward_kinematics(c.model, c.state);
    const Vector3d p{-2, 0.5, 1};
    Momentumd sum = Momentumd::zero();
    Vector3d first_moment = Vector3d::zero();
    for (std::size_t b = 0; b < c.model.bodies().size(); ++b) {
      const RigidBodyInertiad I_W = world_inertia(c.model, kinematics, static_cast<int>(b));
      sum += shift(I_W * kinematics.V_WB[b], p - kinematics.X_WB[b].p);
      first_moment += I_W.first_moment + I_W.mass * kinematics.X_WB[b].p;
    }
    if (c.model.velocities() == 0) continue;
    const Momentumd total = momentum_about(c.model, kinematics, p);
    ASSERT_LT(difference.note(relative_difference(eigen(total), eigen(sum)), i), 1e-12);  // measured 1.1e-15
    const Vector3d com = center_of_mass(c.model, kinematics);
    ASSERT_LT(norm(c.model.mass() * com - first_moment), 1e-12 * c.model.mass() * (1 + norm(com)));
  }
}

TEST(KineticEnergy, IsHalfVtMv) {
  Worst difference("kinetic energy against v^T M v / 2");
  for (int i = 0; i < kRobots; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Case c = random_case(i);
    if (c.model.velocities() == 0) continue;
    const Eigen::VectorXd v = eigen(c.state.v);
    const double expected = 0.5 * v.dot(mass_matrix(c.model, c.state) * v);
    const double T = kinetic_energy(c.model, forward_kinematics(c.model, c.state), c.state);
    ASSERT_GT(expected, 0);
    ASSERT_LT(difference.note(std::abs(T - expected) / expected, i), 1e-12);  // measured 2.5e-15
  }
}

}  // namespace mass_matrix_test
}  // namespace grapnel
