/// Grasps: constrained directions, Jacobian, and the target's share of the contact-space inertia.

#include <gtest/gtest.h>

#include "grapnel/constraint/grasp.hpp"
#include "grapnel/dynamics/mass_matrix.hpp"
#include "grapnel/spatial/decompositions.hpp"
#include "support/eigen_values.hpp"
#include "support/random_robot.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace grasp_test {

constexpr int kCases = 200;
constexpr GraspModel kModels[] = {GraspModel::rigid, GraspModel::hinge, GraspModel::point};

TEST(ConstrainedDirections, AreOrthonormalAndLeaveTheRightMotionFree) {
  EXPECT_EQ(row_count(GraspModel::rigid), 6);
  EXPECT_EQ(row_count(GraspModel::hinge), 5);
  EXPECT_EQ(row_count(GraspModel::point), 3);
  for (int i = 0; i < kCases; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(i);
    // Also along and against every coordinate axis.
    const Vector3d axis = i < 6 ? (i % 2 == 0 ? 1.0 : -1.0) * Vector3d::unit(i / 2) : random.direction();
    for (GraspModel model : kModels) {
      const Eigen::MatrixXd A = constrained_directions({0, 1, model, {0, 0, 0}, axis});
      ASSERT_EQ(A.rows(), row_count(model));
      EXPECT_LT((A * A.transpose() - Eigen::MatrixXd::Identity(A.rows(), A.rows())).norm(), 1e-14);
      const Eigen::VectorXd turn = eigen(Twistd{axis, {0, 0, 0}});
      if (model != GraspModel::rigid) {
        EXPECT_LT((A * turn).norm(), 1e-15);
      }
      if (model == GraspModel::rigid) {
        EXPECT_NEAR((A * turn).norm(), 1, 1e-15);
      }
      if (model == GraspModel::point) {
        EXPECT_EQ(A.leftCols(3).norm(), 0);
      }
      EXPECT_EQ(A.rightCols(3).norm(), std::sqrt(3.0));  // all linear motion is constrained
    }
  }
}

struct Grasps {
  Model model;
  State state;
  std::vector<Grasp> grasps;
};
Grasps random_grasps(int index) {
  RobotOptions options;
  options.targets = 2;
  Random random(index);
  Model model = random_model(options, random);
  State state = random_state(model, random);
  Grasps g{std::move(model), std::move(state), {}};
  const int bodies = static_cast<int>(g.model.bodies().size());
  for (int i = 0; i < 4; ++i) {
    int body = random.integer(0, bodies - 1);
    const int target = g.model.body_index(i % 2 == 0 ? "t0" : "t1");
    if (body == target) body = g.model.body_index("b0");
    g.grasps.push_back({body, target, kModels[random.integer(0, 2)], random.vector(5), random.direction()});
  }
  return g;
}

TEST(GraspJacobian, MatchesTheRelativeTwistOfPosesAndTwists) {
  Worst worst("J v against twists of forward kinematics");
  for (int i = 0; i < kCases; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Grasps g = random_grasps(i);
    const Kinematics k = forward_kinematics(g.model, g.state);
    const Eigen::VectorXd u = grasp_jacobian(g.model, k, g.grasps) * eigen(g.state.v);
    Eigen::Index row = 0;
    for (const Grasp& grasp : g.grasps) {
      const auto at = [&](int b) { return shift(k.V_WB[b], grasp.p_WC - k.X_WB[b].p); };
      const int rows = row_count(grasp.model);
      const Eigen::VectorXd expected =
          constrained_directions(grasp) * eigen(at(grasp.robot_body) - at(grasp.target_body));
      ASSERT_GT(expected.norm(), 1e-3);
      EXPECT_LT(worst.note(relative_difference(u.segment(row, rows), expected), i), 1e-12);
      row += rows;
    }
    EXPECT_EQ(row, u.size());
  }
}

// (2.15) written about the centre of mass, against the mass matrix and Jacobian of the target's own frame.
TEST(TargetMobility, IsTheTargetsPartOfTheContactInertia) {
  Worst worst("target mobility against J M^-1 J^T of the target alone");
  for (int i = 0; i < kCases; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Grasps g = random_grasps(i);
    const Kinematics k = forward_kinematics(g.model, g.state);
    const Eigen::MatrixXd M = mass_matrix(g.model, g.state);
    for (const Grasp& grasp : g.grasps) {
      const Eigen::Index v = g.model.bodies()[grasp.target_body].v;
      const Eigen::MatrixXd J = grasp_jacobian(g.model, k, {&grasp, 1}).middleCols(v, 6);
      const Eigen::MatrixXd expected = J * M.block(v, v, 6, 6).inverse() * J.transpose();
      const Eigen::MatrixXd own = target_mobility(g.model, k, grasp);
      EXPECT_LT(worst.note(relative_difference(own, expected), i), 1e-11);
      EXPECT_GT(own.ldlt().vectorD().minCoeff(), 0);
    }
  }
}

}  // namespace grasp_test
}  // namespace grapnel::testing
