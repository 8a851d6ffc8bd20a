// Rollouts against MuJoCo's steps with the same methods on random robots: a free or fixed base, branches, rotors, and a
// free target.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "engines/mujoco_rollout.hpp"
#include "grapnel/dynamics/state.hpp"
#include "grapnel/lanes/rollout.hpp"
#include "support/random_robot.hpp"
#include "support/worst.hpp"

namespace grapnel {
namespace rollouts_test {

using namespace testing;

struct Difference {
  double largest = 0;  // of the states at the end
  double moved = 0;    // by how much the states changed
};

// Difference between Grapnel and MuJoCo after `steps` steps.
Difference difference(const Model& model, const State& state, lanes::RolloutMethod method, double step, int steps,
                      Random& random) {
  const std::size_t controls = model.joints().size();
  std::vector<double> initial = state.q, control(static_cast<std::size_t>(steps) * controls);
  initial.insert(initial.end(), state.v.begin(), state.v.end());
  for (double& x : control) x = random.uniform(-1, 1);
  std::vector<double> ours(static_cast<std::size_t>(steps) * initial.size()), theirs(ours);
  lanes::RolloutSetup setup;
  setup.step = step, setup.method = method, setup.friction = false;
  lanes::RolloutData data;
  data.cases = 1, data.steps = steps;
  data.initial = initial, data.control = control, data.states = ours;
  lanes::Rollout(model, setup).run(data, 1);
  MujocoRollout(model, step, method == lanes::RolloutMethod::rk4).run(initial, control, theirs);
  Difference found;
  const std::size_t last = ours.size() - initial.size();
  for (std::size_t i = 0; i < initial.size(); ++i) {
    found.largest = std::max(found.largest, std::abs(ours[last + i] - theirs[last + i]));
    found.moved = std::max(found.moved, std::abs(ours[last + i] - initial[i]));
  }
  return found;
}

Model robot_without_friction(int i, Random& random) {
  RobotOptions options;
  options.free_root = i % 5 != 4;
  options.targets = i % 3 == 2 ? 1 : 0;
  ModelBuilder builder;
  const Model model = random_model(options, random);
  for (const Body& body : model.bodies()) {
    BodyDescription description = body.description;
    description.joint.limits = {};  // efforts are not cut in MuJoCo
    builder.add(description);
  }
  return builder.build();
}

TEST(Rollouts, SemiImplicitEulerEqualsMujoco) {
  Worst worst("MuJoCo's Euler, after 20 steps");
  for (int i = 0; i < 100; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(i);
    const Model model = robot_without_friction(i, random);
    if (model.joints().empty()) continue;
    const State state = random_state(model, random);
    const Difference d = difference(model, state, lanes::RolloutMethod::euler, 1e-4, 20, random);
    EXPECT_GT(d.moved, 1e-6);
    EXPECT_LE(worst.note(d.largest / std::max(1.0, d.moved), i), 1e-12);  // measured 2.3e-14
  }
}

// MuJoCo's RK4 turns quaternions by weighted sums of angular velocities in a body's axes, ours are numbers during a
// step: both tend to the same motion.
TEST(Rollouts, RungeKuttaConvergesToMujoco) {
  Worst worst("MuJoCo's RK4, after 0.01 s");
  for (int i = 0; i < 50; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(i);
    const Model model = robot_without_friction(i, random);
    if (model.joints().empty()) continue;
    const State state = random_state(model, random);
    const Difference fine = difference(model, state, lanes::RolloutMethod::rk4, 1e-4, 100, random);
    EXPECT_GT(fine.moved, 1e-4);
    EXPECT_LE(worst.note(fine.largest / std::max(1.0, fine.moved), i), 1e-8);  // measured 7.2e-11
  }
}

}  // namespace rollouts_test
}  // namespace grapnel
