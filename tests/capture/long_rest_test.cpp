/// Targets at rest between fingers for 1,000 s: they neither drift nor jitter, the ledger passes, and steps are long.

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "capture/capture_case.hpp"
#include "grapnel/scenario/scenario.hpp"

namespace grapnel::testing {
namespace long_rest_test {

constexpr double kSettled = 100, kEnd = 1000;  // [s]

CaptureResult rest(const std::string& file, std::vector<Override> overrides) {
  overrides.push_back({"motion.duration", "1000"});
  overrides.push_back({"output.interval", "10"});
  CaptureResult result =
      simulate_capture(load_scenario(std::string(GRAPNEL_SOURCE_DIR) + "/scenarios/" + file, overrides));
  expect_passes(result);
  return result;
}

// Motion of a target relative to the base after kSettled.
struct Motion {
  double position = 0, angle = 0;  // largest change of the relative pose [m, rad]
  double velocity = 0,
         rate = 0;  // largest relative velocity, of the target's origin, and angular velocity [m/s, rad/s]
};

Motion motion_of(const CaptureResult& r, const std::string& target) {
  const std::vector<double>& time = r.series.time;
  const auto pose = [&](std::size_t s) { return inverse(pose_at(r, "base", s)) * pose_at(r, "targets/" + target, s); };
  const auto settled = static_cast<std::size_t>(std::ranges::lower_bound(time, kSettled) - time.begin());
  const Posed first = pose(settled);
  Motion largest;
  for (std::size_t s = settled; s < time.size(); ++s) {
    const Posed X = pose(s);
    const Vector3d w_B = vector_at(r, "base/angular_velocity", s);
    const Vector3d arm = pose_at(r, "targets/" + target, s).p - pose_at(r, "base", s).p;
    const Vector3d v = vector_at(r, "targets/" + target + "/velocity", s) - vector_at(r, "base/velocity", s);
    const Vector3d w = vector_at(r, "targets/" + target + "/angular_velocity", s) - w_B;
    largest.position = std::max(largest.position, norm(X.p - first.p));
    largest.angle = std::max(largest.angle, rotation_angle(transpose(first.R) * X.R));
    largest.velocity = std::max(largest.velocity, norm(v - cross(w_B, arm)));
    largest.rate = std::max(largest.rate, norm(w));
  }
  return largest;
}

void expect_rest(const CaptureResult& r, const std::string& target) {
  const Motion motion = motion_of(r, target);
  const PhaseCost& cost = r.cost.back();
  std::printf(
      "[ measured ] drift %.2g m, %.2g rad; jitter %.2g m/s, %.2g rad/s; work %.2g, contacts %.2g; %ld steps, implicit "
      "%ld in %zu spans, %ld evaluations\n",
      motion.position, motion.angle, motion.velocity, motion.rate, row(r, "work_energy_residual").value,
      row(r, "contact_energy_residual").value, cost.steps, cost.implicit_steps, cost.implicit_spans.size(),
      cost.rhs_evaluations);
  EXPECT_LT(motion.position, 1e-9);
  EXPECT_LT(motion.angle, 1e-9);
  EXPECT_LT(motion.velocity, 1e-9);
  EXPECT_LT(motion.rate, 1e-9);
  ASSERT_FALSE(cost.implicit_spans.empty());
  EXPECT_EQ(cost.implicit_spans.back()[1], kEnd);
}

// The fingers of the shipped scenario leave its box room to drift from one to the other. Closed further, they press on
// its edges; the base's attitude control removes the rotation of the whole, whose changing loads would move the
// fingers. With smaller tolerances the rounding errors of the forces limit all steps: accelerations of 4e-11
// m/s^2, since positions of 1 m are rounded to 2e-16 m and 1e5 N/m act on fingers of some kilograms.
TEST(LongRest, TargetLiesInACageOfFourFingers) {
  const CaptureResult r =
      rest("four-arm-cage.yaml", {{"motion.move.joints", "[-0.55, 0.15, -0.55, 0.15, -0.55, 0.15, -0.55, 0.15]"},
                                  {"motion.base_control", "{kp: 100, kd: 200}"},
                                  {"materials[0].stiffness", "1e5"},
                                  {"materials[0].damping", "300"},
                                  {"integration.absolute_tolerance", "5e-12"}});
  expect_rest(r, "stage");
  EXPECT_EQ(std::ranges::count_if(r.contacts, &ContactPairReport::touches_at_end), 4);
}

// The motor presses with 20 N all the time; the coupling of the fingers transmits half of it.
TEST(LongRest, CubeSatIsHeldByAGripper) {
  const CaptureResult r = rest("parallel-gripper.yaml", {});
  expect_rest(r, "cubesat");
  EXPECT_LT(row(r, "work_energy_residual").value, 1e-10);
}

}  // namespace long_rest_test
}  // namespace grapnel::testing
