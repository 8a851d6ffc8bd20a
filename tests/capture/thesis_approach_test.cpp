/// Approaches with reference values from tools written before this project (thesis-facts).

#include <gtest/gtest.h>

#include <cmath>

#include "capture/capture_case.hpp"

namespace grapnel::testing {
namespace thesis_approach_test {

double angle(const Quaterniond& q) { return 2 * std::atan2(q.z, q.w); }

// ReDySim: one planar arm at (+0.5, 0), cycloidal, PD 49/14, all at rest, ode45 with rtol 1e-5.
TEST(ThesisApproach, ReDySimStates) {
  CaptureProblem p = thesis_case();
  p.robot.bodies.resize(4);  // base and arm 1
  p.robot.end_effectors.resize(1);
  p.targets.clear(), p.grasps.clear(), p.impact.reset();
  p.joint_position = {0.3803, -0.6198, 1.2867};
  p.approach->final_position = {-M_PI / 2, -M_PI / 2, -M_PI / 2};
  p.approach->match.reset();
  p.approach->profile = JointProfile::cycloidal;
  use_pd(p, 49, 14);
  p.output_interval = 5;
  const CaptureResult r = simulate_capture(p);
  expect_passes(r);
  ASSERT_EQ(r.series.time.size(), 5u);
  const double expected[][7] = {{5, -2.356391e-3, 4.845258e-3, 9.348048e-2, 2.379143e-1, -6.849741e-1, 1.033464},
                                {10, 1.619842e-2, 3.322785e-2, 6.326813e-1, -5.901564e-1, -1.076253, -1.359696e-1},
                                {20, 7.206364e-2, 3.795083e-2, 1.043793, -1.577186, -1.575492, -1.571369}};
  double worst = 0;
  for (const auto& e : expected) {
    const std::size_t sample = static_cast<std::size_t>(e[0] / 5);
    ASSERT_EQ(r.series.time[sample], e[0]);
    const Vector3d position = vector_at(r, "base/position", sample);
    const double own[] = {
        position[0],
        position[1],
        2 * std::atan2(value_at(r, "base/quaternion_wxyz", sample, 3), value_at(r, "base/quaternion_wxyz", sample, 0)),
        value_at(r, "joints/position", sample, 0),
        value_at(r, "joints/position", sample, 1),
        value_at(r, "joints/position", sample, 2)};
    for (int k = 0; k < 6; ++k) {
      EXPECT_NEAR(own[k], e[k + 1], 2e-6) << "t = " << e[0] << ", component " << k;
      worst = std::max(worst, std::abs(own[k] - e[k + 1]));
    }
  }
  std::printf("[ measured ] largest difference from ReDySim %.3g\n", worst);
}

TEST(ThesisApproach, IdealTrackingMatchesThesisEnd) {
  CaptureProblem p = thesis_case();
  p.approach->match.reset();  // zero final rates
  p.impact.reset();
  const CaptureResult r = simulate_capture(p);
  expect_passes(r);
  const PhaseEnd& end = *r.approach_end;
  EXPECT_NEAR(end.base.position[0], 0.0000, 0.6e-4);
  EXPECT_NEAR(end.base.position[1], 0.0194, 0.6e-4);
  EXPECT_NEAR(angle(end.base.quaternion_wxyz), 0.6762, 0.6e-4);
  EXPECT_NEAR(end.end_effectors[0].position[0], 1.9932, 0.6e-4);
  EXPECT_NEAR(end.end_effectors[0].position[1], -1.4189, 0.6e-4);
  EXPECT_NEAR(end.end_effectors[1].position[0], -1.9939, 0.6e-4);
  EXPECT_NEAR(end.end_effectors[1].position[1], 1.4571, 0.6e-4);
  EXPECT_EQ(end.time, 20);
  EXPECT_LT(norm(end.base.velocity) + norm(end.base.angular_velocity), 1e-12);  // at rest again
  // Table 4.4: initial positions.
  EXPECT_NEAR(r.approach_start->end_effectors[0].position[0], 2.894, 0.6e-3);
  EXPECT_NEAR(r.approach_start->end_effectors[1].position[0], -2.894, 0.6e-3);
}

struct Planned {
  const char* name;
  RateMatch match;
  std::vector<double> angles;
  double x, y, turn;
};
void PrintTo(const Planned& planned, std::ostream* out) { *out << planned.name; }
class FixedPoint : public ::testing::TestWithParam<Planned> {};
INSTANTIATE_TEST_SUITE_P(Thesis, FixedPoint,
                         ::testing::Values(Planned{"velocity",
                                                   RateMatch::velocity,
                                                   {-0.801268, -1.254248, 0.019399, 2.381974, -1.260232, -0.049333},
                                                   0.000565,
                                                   0.021484,
                                                   0.808194},
                                           Planned{"twist",
                                                   RateMatch::twist,
                                                   {-0.627529, -1.324836, 0.008705, 2.555432, -1.343726, -0.031998},
                                                   0.000258,
                                                   0.021380,
                                                   0.690432}),
                         [](const auto& test) { return test.param.name; });

// With these angles and the computed rates the tips reach the grasp points at their velocities.
TEST_P(FixedPoint, ReachesGraspPoints) {
  const Planned& planned = GetParam();
  CaptureProblem p = thesis_case();
  p.approach->final_position = planned.angles;
  p.approach->match = planned.match;
  const CaptureResult r = simulate_capture(p);
  expect_passes(r);
  EXPECT_TRUE(r.warnings.empty());
  const PhaseEnd& end = *r.approach_end;
  EXPECT_NEAR(end.base.position[0], planned.x, 2e-6);
  EXPECT_NEAR(end.base.position[1], planned.y, 2e-6);
  EXPECT_NEAR(angle(end.base.quaternion_wxyz), planned.turn, 2e-6);
  for (int i = 0; i < 2; ++i) {
    const EndEffectorMotion& e = end.end_effectors[i];
    const double side = i == 0 ? 1 : -1;
    EXPECT_LT(norm(e.position - Vector3d{2 * side, -1.5 * side, 0}), 2e-6);
    EXPECT_LT(e.miss_distance, 2e-6);
    EXPECT_LT(norm(e.velocity - Vector3d{-0.1 * side, 0, 0}), 1e-11);
    EXPECT_LT(norm(e.relative_velocity), 1e-11);  // measured 1.4e-13
    const double spin = planned.match == RateMatch::twist ? 0.2 : 0;
    EXPECT_NEAR(e.angular_velocity[2], spin, 1e-11);
    EXPECT_NEAR(e.relative_angular_velocity[2], spin - 0.2, 1e-11);
    std::printf("[ measured ] miss %.3g, relative velocity %.3g\n", e.miss_distance, norm(e.relative_velocity));
  }
  for (std::size_t j = 0; j < 6; ++j) EXPECT_EQ(end.joints.velocity[j], r.plan->final_rates[j]);
  // Matched twists give no impulse; matched velocities leave the impulse of the target's spin.
  for (const GraspImpulse& g : r.impact()->grasps) {
    if (planned.match == RateMatch::twist) {
      EXPECT_LT(g.impulse_magnitude, 3e-6);  // due to the six digits of the angles; measured 1.3e-06
    } else {
      EXPECT_GT(g.impulse_magnitude, 0.05);
    }
  }
}

}  // namespace thesis_approach_test
}  // namespace grapnel::testing
