/// Closed loops for one hour: conserved quantities and loop closures stay constant.

#include <gtest/gtest.h>

#include "capture/loop_case.hpp"

namespace grapnel::testing {
namespace long_loop_test {

void expect_an_hour(const CaptureProblem& p) {
  const CaptureResult r = simulate_capture(p);
  expect_passes(r);
  expect_finite(r);
  ASSERT_TRUE(r.post_impact_end);
  EXPECT_GE(r.post_impact_end->time, 3600);
  EXPECT_LE(row(r, "linear_momentum_drift").value, 1e-11);   // measured 3.8e-15
  EXPECT_LE(row(r, "angular_momentum_drift").value, 1e-11);  // measured 1.6e-13
  EXPECT_LE(row(r, "energy_drift").value, 1e-10);            // measured 2.4e-11
  EXPECT_LE(row(r, "loop_closure_position").value, 1e-12);   // measured 1.9e-13, about 100 m away
  EXPECT_LE(row(r, "unprojected_defect").value, 1e-10);      // measured 7.8e-13
  const Opening o = opening(p, r, "post_impact");
  EXPECT_LT(o.position, 1e-12);
  EXPECT_LT(o.angle, 1e-12);
  EXPECT_GT(r.ledger.scale.angular_momentum, 1);
  std::printf(
      "[ measured ] momenta %.2g, %.2g; energy %.2g; closure %.2g m, %.2g rad; step %.2g; corrections %.2g of "
      "%.2g; %ld steps, %ld evaluations\n",
      row(r, "linear_momentum_drift").value, row(r, "angular_momentum_drift").value, row(r, "energy_drift").value,
      o.position, o.angle, row(r, "unprojected_defect").value, row(r, "correction_total").value,
      row(r, "correction_total").bound, r.cost.back().steps, r.cost.back().rhs_evaluations);
}

TEST(AnHour, OfTheThesissClosedLoop) {
  CaptureProblem p = scenario("thesis/closed-loop.yaml");
  p.post_impact->duration = 3600;
  p.output_interval = 1;
  p.clearance.enabled = false;
  expect_an_hour(p);
}

TEST(AnHour, OfTwoArmsInSpace) {
  CaptureProblem p = random_loops({{0, 0}, {}, 7, 0.2, 3600}, 0);
  p.output_interval = 2;
  expect_an_hour(p);
}

TEST(AnHour, OfThreeArmsWithMixedGrasps) {
  CaptureProblem p =
      random_loops({{0, 0, 0}, {GraspModel::rigid, GraspModel::hinge, GraspModel::point}, 6, 0.2, 3600}, 2);
  p.output_interval = 2;
  expect_an_hour(p);
}

}  // namespace long_loop_test
}  // namespace grapnel::testing
