/// Two arms on one target: redundant rows, what is determined and what is chosen.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "grapnel/dynamics/momentum.hpp"
#include "impact/impact_case.hpp"
#include "impact/maximal_coordinates.hpp"
#include "impact/thesis_robot.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace shared_target_test {

// thesis-facts, the closed loop that closes: target centre (0, 1.35), grasps at (+-0.5, 1.35), 0.5 m along the third
// links. The target also moves out of the plane, or all self-stress would be zero.
ImpactCase thesis_loop(const Units& units = {}) {
  ModelBuilder builder;
  for (const BodyDescription& b : thesis_robot(1, units)) builder.add(b);
  for (const FrameDescription& f : thesis_tips(0.5, units)) builder.add(f);
  builder.add(thesis_target("target", units));
  ImpactCase c{builder.build(), {}, {}};
  c.state = zero_state(c.model);
  const double l = 1 / units.length;
  const int base = c.model.body_index("base"), target = c.model.body_index("target");
  set_root_pose(c.model, base, {rotation_about({0, 0, 1}, 0.094227), {-0.000786 * l, -0.054439 * l, 0}}, c.state);
  const double angles[] = {0.360186, 1.523012, 1.164168, 2.504549, -1.390707, -1.208070};
  const double rates[] = {0.02, -0.05, 0.08, -0.03, 0.04, 0.06};
  for (int j = 0; j < 6; ++j) {
    const Body& body = c.model.bodies()[c.model.joints()[j]];
    c.state.q[body.q] = angles[j], c.state.v[body.v] = rates[j];
  }
  set_root_twist(c.model, base, {{0.01, -0.02, 0.03}, {0.02 * l, 0.01 * l, -0.03 * l}}, c.state);
  set_root_pose(c.model, target, {rotation_about({0, 0, 1}, 0.3), {0, 1.35 * l, 0}}, c.state);
  set_root_twist(c.model, target, {{0.1, 0.05, 0.2}, {0.02 * l, -0.03 * l, 0.07 * l}}, c.state);
  const Kinematics k = forward_kinematics(c.model, c.state);
  for (const char* tip : {"tip-1", "tip-2"}) {
    const int frame = c.model.frame_index(tip);
    c.grasps.push_back(
        {c.model.frames()[frame].body, target, GraspModel::rigid, frame_pose(c.model, k, frame).p, {0, 0, 1}});
  }
  return c;
}

Eigen::MatrixXd metric(const ImpactCase& c) {
  const Kinematics k = forward_kinematics(c.model, c.state);
  Eigen::Index rows = 0;
  for (const Grasp& g : c.grasps) rows += row_count(g.model);
  Eigen::MatrixXd D = Eigen::MatrixXd::Zero(rows, rows);
  for (Eigen::Index row = 0; const Grasp& g : c.grasps) {
    D.block(row, row, row_count(g.model), row_count(g.model)) = target_mobility(c.model, k, g);
    row += row_count(g.model);
  }
  return D;
}

TEST(SharedTarget, PlanarLoopHasTwelveRowsOfRankNine) {
  const ImpactCase c = thesis_loop();
  EXPECT_NEAR(c.grasps[0].p_WC[0], 0.5, 1e-6);  // the loop closes
  EXPECT_NEAR(c.grasps[0].p_WC[1], 1.35, 1e-6);
  EXPECT_NEAR(c.grasps[1].p_WC[0], -0.5, 1e-6);
  const ImpactSolution s = plastic_impact(c.model, c.state, c.grasps);
  EXPECT_EQ(s.rows, 12);
  EXPECT_EQ(s.rank, 9);
  EXPECT_EQ(s.null_space.cols(), 3);
  for (const ContactImpulse& contact : s.contacts) {
    // In the plane: moment about z, forces along x and y. The rest may circulate through the loop.
    EXPECT_THAT(contact.determined, ::testing::ElementsAre(false, false, true, true, true, false));
  }
}

TEST(SharedTarget, SelfStressesChangeNothing) {
  const ImpactCase c = thesis_loop();
  const ImpactSolution s = plastic_impact(c.model, c.state, c.grasps);
  const Eigen::MatrixXd J = grasp_jacobian(c.model, forward_kinematics(c.model, c.state), c.grasps);
  EXPECT_LT((J.transpose() * s.null_space).norm(), 1e-12 * s.null_space.norm());
}

TEST(SharedTarget, VelocitiesAreUnique) {
  const ImpactCase c = thesis_loop();
  const ImpactSolution s = plastic_impact(c.model, c.state, c.grasps);
  const MaximalSolution m = maximal_impact(c.model, c.state, c.grasps);
  const Kinematics k = forward_kinematics(c.model, with_velocity(c.state, s.velocity));
  for (std::size_t b = 0; b < k.V_WB.size(); ++b) {
    EXPECT_LT(norm(k.V_WB[b].linear - m.V_WB[b].linear) + norm(k.V_WB[b].angular - m.V_WB[b].angular), 1e-13);
  }  // measured 6.19e-15
  // Determined components agree whatever picks the rest (there: the least norm of all multipliers).
  double undetermined = 0;
  for (std::size_t i = 0; i < 2; ++i) {
    const Impulsed difference = s.contacts[i].P_WC - m.contact[i];
    EXPECT_LT(std::abs(difference.angular[2]) + std::abs(difference.linear[0]) + std::abs(difference.linear[1]), 1e-12);
    undetermined += norm(difference.angular) + norm(difference.linear);
  }
  EXPECT_GT(undetermined, 1e-3);  // the others do depend on it
}

TEST(SharedTarget, ReportedImpulseMinimizesMetric) {
  Worst worst("slope of P^T D P along self-stresses");
  int loops = 0;
  for (int i = -1; i < kImpacts; ++i) {
    const ImpactCase c = i < 0 ? thesis_loop() : random_impact(i);
    const ImpactSolution s = plastic_impact(c.model, c.state, c.grasps);
    if (s.rank == s.rows) continue;
    SCOPED_TRACE(seed_note(i));
    ++loops;
    const Eigen::MatrixXd D = metric(c);
    const Eigen::VectorXd P = stacked_impulse(c, s);
    for (Eigen::Index n = 0; n < s.null_space.cols(); ++n) {
      const Eigen::VectorXd N = s.null_space.col(n);
      const double slope = std::abs(N.dot(D * P)) / std::sqrt(N.dot(D * N) * P.dot(D * P));
      EXPECT_LT(worst.note(slope, i), 1e-8);
      for (double step : {-0.1, 0.1}) {
        const Eigen::VectorXd other = P + step * P.norm() / N.norm() * N;
        EXPECT_GT(other.dot(D * other), P.dot(D * P));
      }
    }
  }
  EXPECT_GT(loops, 20);
}

TEST(SharedTarget, ImpulseDoesNotDependOnTheFrame) {
  Worst worst("impulse in a moved and turned world");
  const Posed X_VW{rotation_about({0.48, 0.6, 0.64}, 1.1), {3, -7, 11}};  // world W seen from world V
  for (int i = -1; i < kImpacts; ++i) {
    SCOPED_TRACE(seed_note(i));
    const ImpactCase c = i < 0 ? thesis_loop() : random_impact(i);
    if (!c.model.has_free_root(0) ||
        c.model.bodies()[c.model.body_index(i < 0 ? "base" : "b0")].description.joint.type != JointType::free)
      continue;
    ImpactCase moved = c;
    for (std::size_t b = 0; b < c.model.bodies().size(); ++b) {
      const int body = static_cast<int>(b);
      if (c.model.bodies()[b].parent >= 0) continue;
      set_root_pose(c.model, body, X_VW * root_pose(c.model, c.state, body),
                    moved.state);  // v is in the body: unchanged
    }
    for (Grasp& g : moved.grasps) g.p_WC = X_VW * g.p_WC, g.hinge_W = X_VW.R * g.hinge_W;
    const ImpactSolution s = plastic_impact(c.model, c.state, c.grasps);
    const ImpactSolution t = plastic_impact(moved.model, moved.state, moved.grasps);
    EXPECT_EQ(s.rank, t.rank);
    double scale = 0;
    for (const ContactImpulse& P : s.contacts) scale = std::max(scale, norm(P.P_WC.linear) + norm(P.P_WC.angular));
    for (std::size_t g = 0; g < c.grasps.size(); ++g) {
      const Impulsed difference = X_VW.R * s.contacts[g].P_WC - t.contacts[g].P_WC;
      EXPECT_LT(worst.note((norm(difference.linear) + norm(difference.angular)) / scale, i), 1e-8);
    }
  }
}

TEST(SharedTarget, ImpulseDoesNotDependOnUnits) {
  const ImpactSolution si = plastic_impact(thesis_loop().model, thesis_loop().state, thesis_loop().grasps);
  const Units units{0.001, 0.25};  // millimetres, and a mass of 250 g
  const ImpactCase c = thesis_loop(units);
  const ImpactSolution s = plastic_impact(c.model, c.state, c.grasps);
  EXPECT_EQ(s.rank, si.rank);
  for (std::size_t i = 0; i < 2; ++i) {
    const Vector3d P = units.mass * units.length * s.contacts[i].P_WC.linear;
    const Vector3d L = units.mass * units.length * units.length * s.contacts[i].P_WC.angular;
    EXPECT_LT(norm(P - si.contacts[i].P_WC.linear), 1e-12 * norm(P));   // measured 4.8e-16
    EXPECT_LT(norm(L - si.contacts[i].P_WC.angular), 1e-12 * norm(L));  // measured 3.1e-16
    EXPECT_EQ(s.contacts[i].determined, si.contacts[i].determined);
    EXPECT_GT(norm(L), 1e-3);
  }
}

TEST(SharedTarget, LoopConservesNonzeroMomentum) {
  const ImpactCase c = thesis_loop();
  const ImpactSolution s = plastic_impact(c.model, c.state, c.grasps);
  const Kinematics k0 = forward_kinematics(c.model, c.state);
  const Kinematics k1 = forward_kinematics(c.model, with_velocity(c.state, s.velocity));
  const Momentumd h0 = momentum_about(c.model, k0, {0, 0, 0}), h1 = momentum_about(c.model, k1, {0, 0, 0});
  ASSERT_GT(norm(h0.linear), 1);
  ASSERT_GT(norm(h0.angular), 1);
  EXPECT_LT(norm(h1.linear - h0.linear), 1e-13 * norm(h0.linear));     // measured 4e-15
  EXPECT_LT(norm(h1.angular - h0.angular), 1e-13 * norm(h0.angular));  // measured 8.9e-16
}

}  // namespace shared_target_test
}  // namespace grapnel::testing
