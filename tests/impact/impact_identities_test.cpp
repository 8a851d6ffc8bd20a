/// Laws of every plastic impact, on random robots, targets and grasps.

#include <gtest/gtest.h>

#include "grapnel/dynamics/momentum.hpp"
#include "grapnel/spatial/decompositions.hpp"
#include "impact/impact_case.hpp"
#include "impact/maximal_coordinates.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace impact_identities_test {

TEST(PlasticImpact, GeneralizedMomentum) {
  Worst worst("|M dv - J^T P| over |M dv|"), own("reported generalized momentum residual");
  for (int i = 0; i < kImpacts; ++i) {
    SCOPED_TRACE(seed_note(i));
    const ImpactCase c = random_impact(i);
    const ImpactSolution s = plastic_impact(c.model, c.state, c.grasps);
    const Eigen::MatrixXd M = mass_matrix(c.model, c.state);
    const Eigen::MatrixXd J = grasp_jacobian(c.model, forward_kinematics(c.model, c.state), c.grasps);
    const Eigen::VectorXd change = M * (eigen(s.velocity) - eigen(c.state.v));
    ASSERT_GT(change.norm(), 0);
    EXPECT_LT(worst.note((change - J.transpose() * stacked_impulse(c, s)).norm() / change.norm(), i), 1e-10);
    EXPECT_LT(own.note(s.generalized_momentum_residual, i), 1e-10);
    EXPECT_EQ(s.rows, J.rows());
  }
}

TEST(PlasticImpact, GraspsHoldAfterwards) {
  Worst worst("relative velocity in constrained directions, from poses and twists, over the fastest");
  for (int i = 0; i < kImpacts; ++i) {
    SCOPED_TRACE(seed_note(i));
    const ImpactCase c = random_impact(i);
    const ImpactSolution s = plastic_impact(c.model, c.state, c.grasps);
    const Kinematics k = forward_kinematics(c.model, with_velocity(c.state, s.velocity));
    double fastest = 0;  // before the impact: afterwards all velocities may vanish
    for (const Twistd& V : forward_kinematics(c.model, c.state).V_WB)
      fastest = std::max(fastest, norm(V.linear) + norm(V.angular));
    for (const Grasp& g : c.grasps) {
      const auto at = [&](int b) { return shift(k.V_WB[b], g.p_WC - k.X_WB[b].p); };
      const Twistd u = at(g.robot_body) - at(g.target_body);
      EXPECT_LT(worst.note(norm(u.linear) / fastest, i), 1e-11);
      if (g.model == GraspModel::rigid) {
        EXPECT_LT(worst.note(norm(u.angular) / fastest, i), 1e-11);
      }
      if (g.model == GraspModel::hinge) {
        EXPECT_LT(worst.note(norm(cross(u.angular, g.hinge_W)) / fastest, i), 1e-11);
      }
    }
    EXPECT_LT(s.constraint_residual, 1e-11);
  }
}

TEST(PlasticImpact, EnergyIdentity) {
  Worst worst("|dT + u^T W^+ u / 2| over T before, energies body by body");
  int deficient = 0;
  for (int i = 0; i < kImpacts; ++i) {
    SCOPED_TRACE(seed_note(i));
    const ImpactCase c = random_impact(i);
    const ImpactSolution s = plastic_impact(c.model, c.state, c.grasps);
    const State after = with_velocity(c.state, s.velocity);
    const double before = kinetic_energy(c.model, forward_kinematics(c.model, c.state), c.state);
    const double change = kinetic_energy(c.model, forward_kinematics(c.model, after), after) - before;
    const Eigen::MatrixXd J = grasp_jacobian(c.model, forward_kinematics(c.model, c.state), c.grasps);
    const Eigen::MatrixXd W = J * mass_matrix(c.model, c.state).llt().solve(J.transpose());
    const Eigen::VectorXd u = J * eigen(c.state.v);
    Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> pseudo_inverse;
    pseudo_inverse.setThreshold(1e-11);
    const double lost = 0.5 * u.dot(pseudo_inverse.compute(W).solve(u));
    EXPECT_LT(change, 0);
    EXPECT_LT(worst.note(std::abs(change + lost) / before, i), 1e-9);
    EXPECT_LT(s.energy_identity_residual, 1e-10);
    EXPECT_NEAR(s.kinetic_energy_before, before, 1e-10 * before);
    EXPECT_NEAR(s.kinetic_energy_after, before + change, 1e-10 * before);
    EXPECT_EQ(s.rank, pseudo_inverse.rank());
    deficient += s.rank < s.rows;
  }
  EXPECT_GT(deficient, 20);  // both kinds occur
  EXPECT_LT(deficient, kImpacts - 100);
}

TEST(PlasticImpact, ConservesTotalMomentum) {
  Worst worst("total momentum, link by link, after against before");
  int free_roots = 0;
  for (int i = 0; i < kImpacts; ++i) {
    SCOPED_TRACE(seed_note(i));
    const ImpactCase c = random_impact(i);
    if (c.model.bodies()[c.model.body_index("b0")].description.joint.type != JointType::free) continue;
    ++free_roots;
    const ImpactSolution s = plastic_impact(c.model, c.state, c.grasps);
    const Kinematics k0 = forward_kinematics(c.model, c.state);
    const Kinematics k1 = forward_kinematics(c.model, with_velocity(c.state, s.velocity));
    const Vector3d com = center_of_mass(c.model, k0);
    const Momentumd h0 = momentum_about(c.model, k0, com), h1 = momentum_about(c.model, k1, com);
    ASSERT_GT(norm(h0.linear), 1e-3);
    ASSERT_GT(norm(h0.angular), 1e-3);
    double linear = 0, angular = 0;  // scales that cannot vanish
    for (std::size_t b = 0; b < c.model.bodies().size(); ++b) {
      const BodyMomentum m = body_momentum(c.model, k0, static_cast<int>(b));
      linear += norm(m.h.linear), angular += norm(m.h.angular) + norm(cross(m.p_WC - com, m.h.linear));
    }
    EXPECT_LT(worst.note(norm(h1.linear - h0.linear) / linear, i), 1e-11);
    EXPECT_LT(worst.note(norm(h1.angular - h0.angular) / angular, i), 1e-11);
  }
  EXPECT_GT(free_roots, 200);
}

TEST(PlasticImpact, AgreesWithMaximalCoordinates) {
  Worst velocities("velocities against maximal coordinates"), impulses("impulses against maximal coordinates");
  int unique = 0;
  for (int i = 0; i < kImpacts; ++i) {
    SCOPED_TRACE(seed_note(i));
    const ImpactCase c = random_impact(i);
    const ImpactSolution s = plastic_impact(c.model, c.state, c.grasps);
    const MaximalSolution m = maximal_impact(c.model, c.state, c.grasps);
    const Kinematics k = forward_kinematics(c.model, with_velocity(c.state, s.velocity));
    const Kinematics before = forward_kinematics(c.model, c.state);
    double fastest = 0, error = 0;
    for (std::size_t b = 0; b < k.V_WB.size(); ++b) {
      fastest = std::max(fastest, norm(before.V_WB[b].linear) + norm(before.V_WB[b].angular));
      error = std::max(error, norm(m.V_WB[b].linear - k.V_WB[b].linear) + norm(m.V_WB[b].angular - k.V_WB[b].angular));
    }
    EXPECT_LT(velocities.note(error / fastest, i), 1e-9);
    if (s.rank < s.rows) continue;
    ++unique;
    double largest = 0, off = 0;
    for (std::size_t g = 0; g < c.grasps.size(); ++g) {
      const Impulsed difference = m.contact[g] - s.contacts[g].P_WC;
      largest = std::max(largest, norm(m.contact[g].linear) + norm(m.contact[g].angular));
      off = std::max(off, norm(difference.linear) + norm(difference.angular));
    }
    EXPECT_LT(impulses.note(off / largest, i), 1e-8);
  }
  EXPECT_GT(unique, 100);
}

TEST(PlasticImpact, ImpulseDependsOnlyOnRelativeVelocity) {
  Worst worst("P(a u1 + b u2 + motion without u) against a P(u1) + b P(u2)");
  for (int i = 0; i < 100; ++i) {
    SCOPED_TRACE(seed_note(i));
    const ImpactCase c = random_impact(i);
    Random random(10000 + i);
    const std::vector<double> other = random.values(c.model.velocities(), 1.5);
    const ImpactSolution s1 = plastic_impact(c.model, c.state, c.grasps);
    const ImpactSolution s2 = plastic_impact(c.model, with_velocity(c.state, other), c.grasps);
    // s1.velocity satisfies the grasps: it adds motion but no relative velocity.
    const Eigen::VectorXd v = -1.7 * eigen(c.state.v) + 0.6 * eigen(other) + 3.0 * eigen(s1.velocity);
    const ImpactSolution s = plastic_impact(c.model, with_velocity(c.state, values(v)), c.grasps);
    const Eigen::VectorXd expected = -1.7 * stacked_impulse(c, s1) + 0.6 * stacked_impulse(c, s2);
    ASSERT_GT(expected.norm(), 0);
    EXPECT_LT(worst.note(relative_difference(stacked_impulse(c, s), expected), i), 1e-8);
  }
}

TEST(PlasticImpact, NoChangeWithoutGraspsOrOnRepeat) {
  const ImpactCase c = random_impact(7);
  const ImpactSolution none = plastic_impact(c.model, c.state, {});
  EXPECT_EQ(none.rows, 0);
  EXPECT_LT(relative_difference(eigen(none.velocity), eigen(c.state.v)), 1e-12);
  const ImpactSolution once = plastic_impact(c.model, c.state, c.grasps);
  const ImpactSolution twice = plastic_impact(c.model, with_velocity(c.state, once.velocity), c.grasps);
  EXPECT_LT(relative_difference(eigen(twice.velocity), eigen(once.velocity)), 1e-11);
  EXPECT_LT(stacked_impulse(c, twice).norm(), 1e-10 * stacked_impulse(c, once).norm());
}

// Without relative motion the impact changes nothing: residuals are small although dv is of the order of rounding.
TEST(PlasticImpact, ChecksPassForMatchedVelocities) {
  Worst worst("residuals of an impact that changes nothing");
  for (int i = 0; i < 100; ++i) {
    SCOPED_TRACE(seed_note(i));
    const ImpactCase c = random_open_impact(i);
    const ImpactSolution once = plastic_impact(c.model, c.state, c.grasps);
    const ImpactSolution s = plastic_impact(c.model, with_velocity(c.state, once.velocity), c.grasps);
    ASSERT_GT(s.kinetic_energy_before, 0);
    EXPECT_LT(worst.note(s.generalized_momentum_residual, i), 1e-10);
    EXPECT_LT(worst.note(s.energy_identity_residual, i), 1e-10);
    EXPECT_LT(worst.note(s.constraint_residual, i), 1e-10);
  }
}

TEST(PlasticImpact, RejectsStateOfOtherModel) {
  const ImpactCase c = random_impact(7);
  State wrong = c.state;
  wrong.v.pop_back();
  EXPECT_THROW(plastic_impact(c.model, wrong, c.grasps), std::invalid_argument);
}

}  // namespace impact_identities_test
}  // namespace grapnel::testing
