// Optimization variables: contact patches and postures.
#include "grapnel/campaign/optimization.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "campaign/study_case.hpp"
#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/scenario/scenario.hpp"

namespace grapnel {
namespace optimization_moves_test {

CaptureProblem closed() { return load_scenario(test::shipped("scenarios/thesis/closed-loop.yaml")); }
CaptureProblem handles() {
  const Override quick[] = {{"approach.plan.starts", "1"}};
  return load_scenario(test::shipped("scenarios/dual-arm-satellite-handles.yaml"), quick);
}

TEST(Patch, OnASphereThePointStaysOnItAndTheNormalTurnsAlong) {
  CaptureProblem problem = closed();
  ContactPatch patch{"sphere", "right", {0, 1, 0}, {0, 0, 1}, 0.1, 0.1, false};
  move_on_patch(patch, 0.06, -0.03, problem);
  const GraspPoint& point = problem.targets[0].grasp_points[0];
  EXPECT_NEAR(norm(point.X_TG.p), 0.5, 1e-15);
  EXPECT_LT(norm(0.5 * *point.approach_direction + point.X_TG.p), 1e-15);  // still radial
  EXPECT_NEAR(point.X_TG.p[1] / point.X_TG.p[0], 0.06 / 0.5, 1e-15);
  EXPECT_LT(norm(point.X_TG.R * Vector3d{1, 0, 0} - 2.0 * point.X_TG.p), 1e-15);
  EXPECT_EQ(problem.targets[0].grasp_points[1].X_TG.p[0], -0.5);
}

// Of several shapes, the sphere that contains the point is used.
TEST(Patch, OnASphereAmongOtherShapes) {
  CaptureProblem problem = closed(), alone = closed();
  const Geometry sphere = problem.targets[0].geometry.at(0);
  problem.targets[0].geometry = {{Geometry::Shape::box, {1, 1, 1}}, {Geometry::Shape::sphere, {0.1, 0, 0}}, sphere};
  ContactPatch patch{"sphere", "right", {0, 1, 0}, {0, 0, 1}, 0.1, 0.1, false};
  move_on_patch(patch, 0.06, -0.03, problem);
  move_on_patch(patch, 0.06, -0.03, alone);
  const GraspPoint &a = problem.targets[0].grasp_points[0], &b = alone.targets[0].grasp_points[0];
  EXPECT_EQ(norm(a.X_TG.p - b.X_TG.p), 0);
  problem.targets[0].geometry.pop_back();
  move_on_patch(patch, 0.06, -0.03, problem);
  EXPECT_GT(norm(a.X_TG.p), 0.5);  // a plane without the sphere
}

TEST(Patch, ElsewhereItIsAPlane) {
  CaptureProblem problem = handles();
  const GraspPoint before = problem.targets[0].grasp_points[0];
  move_on_patch({"satellite", "right-handle", {0, 1, 0}, {0, 0, 1}, 0.1, 0.1, false}, 0.04, 0.01, problem);
  const GraspPoint& after = problem.targets[0].grasp_points[0];
  EXPECT_LT(norm(after.X_TG.p - before.X_TG.p - Vector3d{0, 0.04, 0.01}), 1e-16);
  EXPECT_EQ(norm(*after.approach_direction - *before.approach_direction), 0);
}

TEST(Patch, TheSquareFillsTheDisc) {
  const ContactPatch disc{"", "", {1, 0, 0}, {0, 1, 0}, 0.2, 0.2, true};
  for (double s = -1; s <= 1; s += 0.125) {
    const auto [x, y] = on_patch(disc, 0.2, 0.2 * s);  // an edge of the square maps to the circle
    EXPECT_NEAR(std::hypot(x, y), 0.2, 1e-15);
  }
  const auto [x, y] = on_patch(disc, 0.05, 0);
  EXPECT_EQ(x, 0.05);
  EXPECT_EQ(y, 0);
}

// 14 joints and 5 rows per end-effector leave 4 directions. The planner moves along them and still reaches the grasp
// points.
TEST(Posture, TheNullSpaceLeadsToOtherSolutions) {
  const CaptureProblem problem = handles();
  const PostureSpace space = posture_space(problem);
  ASSERT_EQ(space.configuration.size(), 14u);
  ASSERT_EQ(space.directions.size(), 4u);
  CaptureProblem moved = problem;
  set_posture(space, {0.2, 0, 0, 0}, moved);
  const CaptureResult r = simulate_impact_only(moved);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  double along = 0, square = 0;
  for (std::size_t j = 0; j < 14; ++j) {
    const double d = r.plan->final_position[j] - space.configuration[j];
    along += d * space.directions[0][j];
    square += d * d;
  }
  EXPECT_NEAR(along, 0.2, 0.05);
  // The base's rotation depends on the whole joint motion, not only on its last segment as in the Jacobian. Therefore
  // the solution closest to the moved guess differs from it to first order. Measured 0.18.
  EXPECT_LT(std::sqrt(square - along * along), 0.25);
  for (const PlannedMiss& miss : r.plan->miss) EXPECT_LT(miss.distance, 1e-9);
}

TEST(Posture, ANonRedundantRobotHasOne) { EXPECT_TRUE(posture_space(closed()).directions.empty()); }

}  // namespace optimization_moves_test
}  // namespace grapnel
