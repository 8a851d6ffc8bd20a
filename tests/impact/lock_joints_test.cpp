/// Joints stopped instantaneously by a separate impulse.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "grapnel/dynamics/momentum.hpp"
#include "impact/impact_case.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace lock_joints_test {

// Impulse of brakes on these velocities, without grasps.
ImpactSolution lock_joints(const Model& model, const State& state, const std::vector<int>& velocities,
                           std::vector<double>& impulse) {
  std::vector<HeldRate> held;
  for (int v : velocities) held.push_back({v, 0});
  ImpactSolution solution = plastic_impact(model, state, {}, held);
  impulse = solution.held_impulses;
  return solution;
}

std::vector<int> some_joints(const Model& model, Random& random, double share) {
  std::vector<int> chosen;
  for (int b : model.joints()) {
    if (random.chance(share)) chosen.push_back(model.bodies()[b].v);
  }
  return chosen;
}

TEST(LockJoints, Identities) {
  Worst momentum("|M dv - J^T P| over |M dv|"), energy("|dT - P^T (rates before)/2| over T"), total("total momentum");
  int stopped = 0;
  for (int i = 0; i < kImpacts; ++i) {
    SCOPED_TRACE(seed_note(i));
    const ImpactCase c = random_open_impact(i);
    Random random(20000 + i);
    const std::vector<int> joints = some_joints(c.model, random, 0.6);
    if (joints.empty()) continue;
    std::vector<double> P;
    const ImpactSolution s = lock_joints(c.model, c.state, joints, P);
    ASSERT_EQ(P.size(), joints.size());
    Eigen::VectorXd expected = Eigen::VectorXd::Zero(c.model.velocities());
    double work = 0;
    for (std::size_t j = 0; j < joints.size(); ++j) {
      EXPECT_EQ(s.velocity[joints[j]], 0);  // exactly
      expected[joints[j]] = P[j];
      work += 0.5 * P[j] * c.state.v[joints[j]];  // impulse times the mean rate
    }
    const Eigen::VectorXd change = mass_matrix(c.model, c.state) * (eigen(s.velocity) - eigen(c.state.v));
    EXPECT_LT(momentum.note((change - expected).norm() / change.norm(), i), 1e-10);
    const State after = with_velocity(c.state, s.velocity);
    const Kinematics k0 = forward_kinematics(c.model, c.state), k1 = forward_kinematics(c.model, after);
    const double T0 = kinetic_energy(c.model, k0, c.state), T1 = kinetic_energy(c.model, k1, after);
    EXPECT_LT(energy.note(std::abs(T1 - T0 - work) / T0, i), 1e-10);
    EXPECT_LT(T1, T0);
    EXPECT_LT(s.energy_identity_residual, 1e-10);
    const Vector3d com = center_of_mass(c.model, k0);
    const Momentumd h0 = momentum_about(c.model, k0, com), h1 = momentum_about(c.model, k1, com);
    ASSERT_GT(norm(h0.linear), 1e-2);
    EXPECT_LT(total.note(norm(h1.linear - h0.linear) / norm(h0.linear), i), 1e-11);
    EXPECT_LT(total.note(norm(h1.angular - h0.angular) / norm(h0.angular), i), 1e-10);
    ++stopped;
  }
  EXPECT_GT(stopped, 250);
}

// A robot with all joints locked moves as one rigid body with its composite inertia, without a mass matrix.
TEST(LockJoints, AllLockedIsOneRigidBody) {
  Worst worst("base twist against the composite body's");
  for (int i = 0; i < kImpacts; ++i) {
    SCOPED_TRACE(seed_note(i));
    const ImpactCase c = random_open_impact(i);
    Random random(i);
    std::vector<double> P;
    const ImpactSolution s = lock_joints(c.model, c.state, some_joints(c.model, random, 1), P);
    const int base = c.model.body_index("b0");
    const int roots[] = {base};
    const Kinematics k = forward_kinematics(c.model, c.state);
    const Vector3d com = center_of_mass(c.model, k, roots);
    const Momentumd h = momentum_about(c.model, k, com, roots);
    Eigen::Matrix3d I = Eigen::Matrix3d::Zero();
    double mass = 0;
    for (std::size_t b = 0; b < c.model.bodies().size(); ++b) {
      if (c.model.bodies()[b].root != base) continue;
      const BodyDescription& d = c.model.bodies()[b].description;
      const Eigen::Matrix3d R = eigen(k.X_WB[b].R);
      const Eigen::Vector3d r = eigen(k.X_WB[b] * d.com - com);
      I += R * eigen(d.inertia) * R.transpose() +
           d.mass * (r.squaredNorm() * Eigen::Matrix3d::Identity() - r * r.transpose());
      mass += d.mass;
    }
    const Eigen::Vector3d w = I.inverse() * eigen(h.angular);
    const Twistd V = root_twist(c.model, with_velocity(c.state, s.velocity), base);
    const Eigen::Vector3d v = eigen(h.linear) / mass + w.cross(eigen(k.X_WB[base].p - com));
    const double size = w.norm() + v.norm();
    EXPECT_LT(worst.note(((eigen(V.angular) - w).norm() + (eigen(V.linear) - v).norm()) / size, i), 1e-10);
  }
}

TEST(LockJoints, NoJointsChangeNothing) {
  const ImpactCase c = random_open_impact(3);
  std::vector<double> P{1, 2, 3};
  const ImpactSolution s = lock_joints(c.model, c.state, {}, P);
  EXPECT_TRUE(P.empty());
  EXPECT_LT(relative_difference(eigen(s.velocity), eigen(c.state.v)), 1e-12);
}

}  // namespace lock_joints_test
}  // namespace grapnel::testing
