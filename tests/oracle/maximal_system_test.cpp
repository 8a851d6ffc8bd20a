/// The maximal-coordinate model on open chains, for which Grapnel's dynamics are verified separately, and its
/// integrator.

#include "oracle/maximal_system.hpp"

#include <gtest/gtest.h>

#include "grapnel/dynamics/momentum.hpp"
#include "support/eigen_values.hpp"
#include "support/random_robot.hpp"
#include "support/worst.hpp"

namespace grapnel::oracle {
namespace maximal_system_test {

using namespace grapnel::testing;

constexpr int kCases = 80;

struct Open {
  Model model;
  State state;
  Forces forces;
};
Open random_open(int index) {
  RobotOptions options;
  options.least_bodies = 1, options.most_bodies = 12;
  options.free_root = index % 4 != 3;
  options.spherical_joints = index % 3 == 1;
  options.targets = index % 5 == 2 ? 1 : 0;
  Random random(index);
  Model model = random_model(options, random);
  State state = random_state(model, random);
  Forces forces = random_forces(model, state, random);
  return {std::move(model), std::move(state), std::move(forces)};
}
MaximalLoads loads_of(const Forces& forces) { return {forces.generalized, forces.external, forces.gravity, {}, {}}; }

TEST(MaximalSystem, BodyPosesAgreeWithForwardKinematics) {
  Worst pose("poses"), twist("twists");
  for (int i = 0; i < kCases; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Open c = random_open(i);
    const Kinematics k = forward_kinematics(c.model, c.state);
    const MaximalState s = maximal_state(c.model, c.state);
    for (int b = 0; b < static_cast<int>(c.model.bodies().size()); ++b) {
      const Eigen::Vector3d w = s.V.segment<3>(6 * b), v = s.V.segment<3>(6 * b + 3), p = s.origin(c.model, b);
      EXPECT_LT(pose.note((s.R[b].toRotationMatrix() - eigen(k.X_WB[b].R)).norm(), i), 1e-13);  // measured 1e-14
      EXPECT_LT(pose.note((p - eigen(k.X_WB[b].p)).norm(), i), 1e-13);
      EXPECT_LT(twist.note((w - eigen(k.V_WB[b].angular)).norm(), i), 1e-12);
      EXPECT_LT(twist.note((v + w.cross(p - s.com[b]) - eigen(k.V_WB[b].linear)).norm(), i), 1e-12);
    }
  }
}

TEST(MaximalSystem, OpenTreesAgreeWithTheRecursion) {
  Worst worst("accelerations");  // measured 2e-14
  for (int i = 0; i < kCases; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Open c = random_open(i);
    const std::vector<double> expected = forward_dynamics(c.model, c.state, c.forces);
    const MaximalSolution s =
        MaximalSystem(c.model, {}).accelerations(maximal_state(c.model, c.state), loads_of(c.forces));
    EXPECT_LT(worst.note(relative_difference(eigen(s.joints), eigen(expected)), i), 1e-9);
    EXPECT_LT(s.residual, 1e-9);
  }
}

TEST(MaximalSystem, PrescribedMotionForcesAgreeWithTheRecursion) {
  Worst accelerations("accelerations"), forces("forces");  // measured 9e-14, 1e-13
  for (int i = 0; i < kCases; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Open c = random_open(i);
    Random random(1000 + i);
    MaximalLoads loads = loads_of(c.forces);
    loads.prescribed.assign(c.model.velocities(), 0);
    loads.acceleration = random.values(c.model.velocities(), 2);
    for (const Body& b : c.model.bodies()) {
      const bool chosen = random.chance(0.4);
      for (int k = 0; k < velocity_count(b.description.joint.type); ++k) loads.prescribed[b.v + k] = chosen;
    }
    Workspace workspace(c.model);
    forward_kinematics(c.model, c.state, workspace.kinematics);
    gather_external(c.model, loads.external, workspace);
    DynamicsInput<double> in;
    in.q = c.state.q, in.v = c.state.v, in.force = loads.tau, in.prescribed = loads.prescribed;
    in.acceleration = loads.acceleration, in.gravity = loads.gravity, in.link_wrench = workspace.link_wrench;
    std::vector<double> vdot(c.model.velocities()), force(c.model.velocities());
    articulated_body<double>(c.model.tree(), in, workspace.kernel, vdot, force);
    const MaximalSolution s = MaximalSystem(c.model, {}).accelerations(maximal_state(c.model, c.state), loads);
    EXPECT_LT(accelerations.note(relative_difference(eigen(s.joints), eigen(vdot)), i), 1e-9);
    EXPECT_LT(forces.note(relative_difference(eigen(s.force), eigen(force)), i), 1e-9);
  }
}

TEST(MaximalSystem, IntegrationHasOrderFourAndConservesMomentum) {
  RobotOptions options;
  options.least_bodies = options.most_bodies = 5;
  Random random(3);
  const Model model = random_model(options, random);
  const State state = random_state(model, random, 0.7);
  const MaximalSystem system(model, {});
  const MaximalState start = maximal_state(model, state), fine = system.integrate(start, {}, 0.5, 400);
  const auto error = [&](int steps) {
    const MaximalState s = system.integrate(start, {}, 0.5, steps);
    double worst = 0;
    for (std::size_t i = 0; i < s.com.size(); ++i) {
      worst = std::max({worst, (s.com[i] - fine.com[i]).norm(), s.R[i].angularDistance(fine.R[i])});
    }
    return worst;
  };
  const auto momentum = [&](const MaximalState& s) {
    Wrench6 h = Wrench6::Zero();
    for (std::size_t i = 0; i < s.com.size(); ++i) {
      const BodyDescription& d = model.bodies()[i].description;
      const Eigen::Matrix3d R = s.R[i].toRotationMatrix();
      const Eigen::Vector3d w = s.V.segment<3>(6 * static_cast<Eigen::Index>(i)),
                            v = s.V.segment<3>(6 * static_cast<Eigen::Index>(i) + 3);
      h.head<3>() += R * eigen(d.inertia) * R.transpose() * w + d.mass * s.com[i].cross(v);
      h.tail<3>() += d.mass * v;
    }
    return h;
  };
  const double coarse = error(25), half = error(50);
  std::printf("[ measured ] integration error %.3g with 25 steps, %.3g with 50\n", coarse, half);
  EXPECT_NEAR(std::log2(coarse / half), 4, 0.5);
  EXPECT_GT(momentum(start).norm(), 1);
  EXPECT_LT((momentum(fine) - momentum(start)).norm(), 1e-9 * momentum(start).norm());
}

}  // namespace maximal_system_test
}  // namespace grapnel::oracle
