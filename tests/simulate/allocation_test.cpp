/// No heap allocation per evaluation of the right-hand side, with all features enabled.

#include <gtest/gtest.h>

#include <cmath>

#include "simulate/phase_case.hpp"
#include "support/allocation_trap.hpp"

namespace grapnel::testing {
namespace {

TEST(PhaseDynamics, AllocatesNothingPerEvaluation) {
  if (!kTrapWorks) GTEST_SKIP() << "the sanitizer has its own allocator";
  Random random(2);
  RobotOptions options;
  options.min_bodies = 9, options.max_bodies = 9;
  options.targets = 1;
  const Model model = with_friction(random_model(options, random), 0.2, 0.1, 1);
  const State start = random_state(model, random, 0.3);
  PhaseSetup setup;
  setup.drives = random_drives(model, start, JointControl::computed_torque, 2, random);
  ASSERT_GE(setup.drives.size(), 4u);
  setup.drives[1].control = JointControl::pd;
  setup.drives[2].control = JointControl::prescribed;
  setup.drives[3].trajectory = interpolate_samples(std::vector<double>{0, 0.5, 2}, std::vector<double>{0, 1, 0});
  for (JointDrive& d : setup.drives) d.noise = NoiseSignal({0.01, 5, 1}, 2);
  setup.gravity = {0, 0, -1};
  setup.attitude = {model.body_index("b0"), Rotationd::identity(), {1, 1, 1}, {1, 1, 1}};
  ExternalLoad load;
  load.amplitude.linear = {1, 2, 3};
  setup.loads = {load, load};
  setup.loads[1].body = model.body_index("t0");
  setup.loads[1].profile = {LoadProfile::Shape::table, 0, 3, 0, 0, {0, 1, 3}, {3, load.amplitude}};
  PhaseDynamics dynamics(model, setup);
  const std::vector<double> y = dynamics.initial(start, 0);
  std::vector<double> rates(y.size()), motor(model.joints().size()), friction(motor.size());
  AllocationTrap trap;
  dynamics.enter_interval(0, 1);
  dynamics(0.5, y, rates);
  dynamics.state(0.6, y);
  dynamics.efforts(0.7, y, motor, friction);
  EXPECT_EQ(trap.stop(), 0);
  EXPECT_NE(rates.back(), 0);
}

}  // namespace
}  // namespace grapnel::testing
