/// Captures whose joints stick in closed loops: friction in the summary and in the conservation checks.

#include <gtest/gtest.h>

#include <algorithm>

#include "capture/capture_case.hpp"
#include "grapnel/scenario/scenario.hpp"

namespace grapnel::testing {
namespace stuck_structure_test {

CaptureProblem scene() {
  return load_scenario(std::string(GRAPNEL_SOURCE_DIR) + "/tests/capture/data/two-arms-without-mobility.yaml");
}

// A torque turns the whole; the loads of the structure do not depend on the friction, which the loop leaves open.
TEST(StuckStructure, ReportsUndeterminedFrictionWithinBreakaway) {
  const CaptureResult r = simulate_capture(scene());
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  const LedgerEntry& share = row(r, "joint_friction_share");
  EXPECT_TRUE(share.applies);
  EXPECT_LE(share.value, 1);
  EXPECT_NE(share.note.find("undetermined"), std::string::npos);
  expect_passes(r);
  ASSERT_EQ(r.joints.size(), 1U);
  EXPECT_EQ(r.joints[0].mode, JointReport::Mode::stuck);
  EXPECT_FALSE(r.joints[0].friction_determined);
  const Series& friction = series(r, "joints/friction");
  for (std::size_t i = first_sample(r, "post_impact"); i < r.series.time.size(); ++i)
    EXPECT_LE(std::abs(value_at(r, "joints/friction", i, friction.width() - 1)), 0.02);
}

// A joint without friction at rest is no stuck joint.
TEST(StuckStructure, ZeroFrictionHoldsNothing) {
  CaptureProblem p = scene();
  for (BodyDescription& body : p.robot.bodies) {
    if (body.joint.name == "right-joint") body.joint.friction.coulomb = 0;
  }
  const CaptureResult r = simulate_capture(p);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  expect_passes(r);
  ASSERT_EQ(r.joints.size(), 1U);
  EXPECT_EQ(r.joints[0].mode, JointReport::Mode::moving);
  EXPECT_FALSE(r.joints[0].friction_share);
  EXPECT_TRUE(std::none_of(r.ledger.entries.begin(), r.ledger.entries.end(),
                           [](const LedgerEntry& e) { return e.name == "joint_friction_share"; }));
}

}  // namespace stuck_structure_test
}  // namespace grapnel::testing
