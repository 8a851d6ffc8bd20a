/// The thesis's four open-loop cases, from their files.

#include <gtest/gtest.h>

#include "capture/capture_case.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "support/sanitizers.hpp"

namespace grapnel::testing {
namespace thesis_capture_test {

class OpenLoop : public ::testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Cases, OpenLoop, ::testing::Values(1, 2, 3, 4));

CaptureProblem open_loop(int number) {
  return load_scenario(std::string(GRAPNEL_SOURCE_DIR) + "/scenarios/thesis/open-loop-case-" + std::to_string(number) +
                       ".yaml");
}

TEST_P(OpenLoop, LedgerPasses) {
  if (GetParam() > 1) SKIP_UNDER_SANITIZERS();
  const CaptureResult r = simulate_capture(open_loop(GetParam()));
  expect_passes(r);
  EXPECT_EQ(r.post_impact_end->time, 70);
  EXPECT_EQ(r.impact()->rank, 12);
  ASSERT_TRUE(r.impact()->as_published);
  // The total momentum is that of the targets alone, zero in case 2; the exchanged momentum is not zero.
  EXPECT_GT(norm(vector_at(r, "targets/target-1/linear_momentum", first_sample(r, "post_impact"))), 0.01);
  EXPECT_GT(r.impact()->as_published->angular_momentum_error, 1e-3);  // the published formulas do not conserve it
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_GT(r.impact()->grasps[i].impulse_magnitude, 0.01);
    EXPECT_LT(r.impact()->grasps[i].impulse_magnitude, 0.5);
    EXPECT_NEAR(norm(r.impact()->grasps[i].target_displacement), r.impact()->grasps[i].gap, 1e-15);
  }
  std::printf("[ measured ] case %d: %.4f, %.4f N s; gaps %.4f, %.4f m\n", GetParam(),
              r.impact()->grasps[0].impulse_magnitude, r.impact()->grasps[1].impulse_magnitude,
              r.impact()->grasps[0].gap, r.impact()->grasps[1].gap);
}

// thesis-facts: orders of magnitude with PD lag, a rigid grasp and the linear velocity matched.
TEST(OpenLoopCase1, ImpulseHasThesisOrderOfMagnitude) {
  SKIP_UNDER_SANITIZERS();
  const CaptureResult r = simulate_capture(open_loop(1));
  EXPECT_NEAR(r.impact()->grasps[0].impulse_magnitude, 0.12, 0.015);
  EXPECT_NEAR(r.approach_end->end_effectors[0].miss_distance, 0.10, 0.01);
  EXPECT_NEAR(r.approach_end->end_effectors[1].miss_distance, 0.06, 0.01);
}

// The scenario file equals the problem built in this test.
TEST(OpenLoopCase1, FileEqualsTestProblem) {
  SKIP_UNDER_SANITIZERS();
  CaptureProblem written = thesis_case_pd();
  written.contact.gap = ContactSetup::Gap::translate_target;
  const CaptureResult a = simulate_capture(written), b = simulate_capture(open_loop(1));
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_LT(norm(a.impact()->grasps[i].impulse - b.impact()->grasps[i].impulse), 1e-12);
  }
}

}  // namespace thesis_capture_test
}  // namespace grapnel::testing
