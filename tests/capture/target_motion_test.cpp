/// Free targets: closed-form propagate_target() against the general integration.

#include "grapnel/problem/target_motion.hpp"

#include <gtest/gtest.h>

namespace grapnel::testing {
namespace target_motion_test {

// A tumbling triaxial body; its centre of mass is not at the origin of its frame.
TargetSetup tumbler() {
  TargetSetup t;
  t.name = "tumbler";
  t.mass = 12;
  t.com = {0.1, -0.2, 0.05};
  t.inertia = Symmetric3d{1.0, 1.6, 2.1, 0.1, -0.05, 0.2};
  return t;
}
TargetMotion start() {
  const Vector3d axis{0.36, 0.48, 0.8};
  return {{rotation_about(axis, 1.1), {1, -2, 0.5}}, {{0.3, -0.5, 0.4}, {0.02, 0.1, -0.03}}};
}

double difference(const TargetMotion& a, const TargetMotion& b) {
  double most = std::max(norm(a.X_WT.p - b.X_WT.p), rotation_angle(transpose(a.X_WT.R) * b.X_WT.R));
  most = std::max(most, norm(a.V_WT.angular - b.V_WT.angular));
  return std::max(most, norm(a.V_WT.linear - b.V_WT.linear));
}

TEST(TargetMotion, FreeMotionMatchesIntegration) {
  const Vector3d gravity{0.01, -0.02, 0.005};
  LoadSetup nothing;  // a load of zero force selects the general integration
  IntegrationSetup tight;
  tight.relative_tolerance = 1e-13, tight.absolute_tolerance = 1e-14;
  for (const double until : {20.0, -20.0, 0.01}) {
    const TargetMotion free = propagate_target(tumbler(), start(), 0, until, {.gravity = gravity});
    const TargetMotion integrated = propagate_target(
        tumbler(), start(), 0, until, {.gravity = gravity, .loads = {&nothing, 1}, .integration = tight});
    EXPECT_GT(difference(free, start()), 1e-3);
    EXPECT_LT(difference(free, integrated), 1e-10);
    std::printf("[ measured ] after %g s they differ by %.2g\n", until, difference(free, integrated));
  }
}

TEST(TargetMotion, ForwardAndBackwardForAnyTolerance) {
  IntegrationSetup coarse;
  coarse.relative_tolerance = coarse.absolute_tolerance = 1e-3;
  const TargetMotion there = propagate_target(tumbler(), start(), 0, 30, {.integration = coarse});
  const TargetMotion back = propagate_target(tumbler(), there, 30, 0, {.integration = coarse});
  EXPECT_LT(difference(back, start()), 1e-12);
  std::printf("[ measured ] there and back: %.2g\n", difference(back, start()));
  // Angular momentum and energy equal those at the start.
  const auto momentum = [](const TargetMotion& m) {
    return m.X_WT.R * (tumbler().inertia * transposed_times(m.X_WT.R, m.V_WT.angular));
  };
  EXPECT_GT(norm(momentum(start())), 0.1);
  EXPECT_LT(norm(momentum(there) - momentum(start())), 1e-13);
  const auto energy = [&](const TargetMotion& m) { return 0.5 * dot(momentum(m), m.V_WT.angular); };
  EXPECT_NEAR(energy(there), energy(start()), 1e-13);
}

}  // namespace target_motion_test
}  // namespace grapnel::testing
