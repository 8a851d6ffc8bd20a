/// Impacts of hard contacts with closed loops, joints and random shapes.

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "contact/contact_cases.hpp"
#include "simulate/hard_scene.hpp"
#include "support/random_robot.hpp"
#include "support/sanitizers.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace hard_bodies_test {

// ---- Closed loops and joints ----

// Two bodies joined by a rigid closure, which a third one strikes off centre, move as one body of both.
TEST(HardBodies, AClosedLoopTransmitsTheImpact) {
  const Vector3d size{0.2, 0.2, 0.2}, apart{0.3, 0, 0};
  const auto strike = [&](HardScene& s, int body, int ball) {
    s.shape(body, hard_shape(Geometry::Shape::box, size)), s.shape(ball, sphere_of(0.1));
    s.pair(body, ball, hard_law(0.6, 0.25));
    s.place(ball, {0.05, 0.03, 0.6}, {0.1, 0.2, -1});
  };
  HardScene loop({hard_box("a", 4, size), hard_box("b", 3, size), hard_ball("ball", 2, 0.1)});
  loop.place(0, Vector3d::zero()), loop.place(1, apart);
  strike(loop, 0, 2);
  LoopClosure weld;
  weld.name = "weld", weld.body_a = 0, weld.body_b = 1;
  weld.X_AC = {Rotationd::identity(), 0.5 * apart}, weld.X_BD = {Rotationd::identity(), -0.5 * apart};
  loop.setup.closures = {weld};

  BodyDescription second = hard_box("b", 3, size);
  second.parent = "a", second.joint.type = JointType::fixed, second.X_PF.p = apart;
  HardScene rigid({hard_box("a", 4, size), second, hard_ball("ball", 2, 0.1)});
  rigid.place(0, Vector3d::zero());
  strike(rigid, 0, 2);

  const PhaseOutcome one = loop.run(1), other = rigid.run(1);
  ASSERT_TRUE(one.finished) << one.failure;
  ASSERT_TRUE(other.finished) << other.failure;
  ASSERT_EQ(loop.history().impacts, 1);
  Worst worst("velocity after an impact on a closed loop");
  for (int body = 0; body < 3; ++body) {
    const Twistd difference = loop.twist(one.end_state, body) - rigid.twist(other.end_state, body);
    EXPECT_LT(worst.note(norm(difference.linear), body), 1e-10);
    EXPECT_LT(worst.note(norm(difference.angular), body), 1e-10);
  }
  EXPECT_GT(norm(loop.twist(one.end_state, 1).angular), 0.1);
  EXPECT_LT(std::abs(loop.history().impact_work + loop.history().impact_loss + loop.history().impact_friction_loss),
            1e-12);
}

// A paddle on the ground strikes a ball. `hold`: how its joint behaves in the impact.
enum class Hold { free, prescribed, driven, braked };
HardScene paddle(Hold hold) {
  const Symmetric3d I = Symmetric3d::diagonal(1, 1, 1);
  HardScene s({hard_body("ground", 1, I, JointType::fixed), hard_body("paddle", 3, I, JointType::prismatic, "ground"),
               hard_ball("ball", 2, 0.1)});
  s.shape(1, hard_shape(Geometry::Shape::box, {0.1, 1, 1})), s.shape(2, sphere_of(0.1));
  s.pair(1, 2, hard_law(0.5));
  const Body& joint = s.model.joint_body(0);
  s.state.v[joint.v] = 0.4;
  s.place(2, {0.5, 0, 0}, {-0.2, 0, 0});
  if (hold == Hold::driven) s.setup.driven_in_impacts = {joint.v};
  if (hold == Hold::braked) s.setup.braked_in_impacts = {joint.v};
  if (hold == Hold::prescribed) {
    s.setup.drives.resize(1);
    s.setup.drives[0].control = JointControl::prescribed;
    s.setup.drives[0].trajectory = interpolate_samples(std::array{0.0, 2.0}, std::array{0.0, 0.8});
  }
  return s;
}

TEST(HardBodies, JointsAreFreeDrivenOrBraked) {
  for (const Hold hold : {Hold::free, Hold::prescribed, Hold::driven, Hold::braked}) {
    SCOPED_TRACE(static_cast<int>(hold));
    HardScene s = paddle(hold);
    const PhaseOutcome outcome = s.run(1);
    ASSERT_TRUE(outcome.finished) << outcome.failure;
    ASSERT_EQ(s.history().impacts, 1);
    // Approach: of the paddle's rate in the impact and the ball; masses 3 and 2, or a heavy paddle.
    const double paddle_rate = hold == Hold::braked ? 0 : 0.4, approach = paddle_rate + 0.2;
    const double reduced = hold == Hold::free ? 3.0 * 2 / 5 : 2.0, P = 1.5 * reduced * approach;
    const Twistd ball = s.twist(outcome.end_state, 2), after = s.twist(outcome.end_state, 1);
    EXPECT_NEAR(ball.linear[0], -0.2 + P / 2, 1e-12);
    EXPECT_NEAR(after.linear[0], hold == Hold::free ? 0.4 - P / 3 : paddle_rate, 1e-12);
    // The motor gives what the bodies gain and the contact loses.
    const double gain = s.energy(outcome.end_state) - s.energy(s.state);
    const double lost = s.history().impact_loss + s.history().impact_friction_loss;
    EXPECT_NEAR(outcome.integrals.motor_work, gain + lost, 1e-12);
    EXPECT_NEAR(s.history().impact_work, -lost, 1e-12);
    // The trees' integrals contain the impulses.
    ASSERT_EQ(outcome.integrals.trees.size(), 2U);
    EXPECT_NEAR(outcome.integrals.trees[1].impulse.linear[0], P, 1e-12);
  }
}

// ---- Random shapes ----

// Free bodies of random shapes, masses and materials meet: momentum is conserved, and kinetic with elastic energy never
// increases.
TEST(HardBodies, RandomShapesConserveMomentumAndNeverGainEnergy) {
  Worst momentum("momentum, relative"), in_impacts("the same without contact that lasts"),
      gain("energy gained, relative"), balance("energy balance, relative");
  int struck = 0, lasting = 0;
  for (int k = 0; k < test::repetitions(1000); ++k) {
    Random random(1000 + k);
    constexpr CaseShape kKinds[] = {CaseShape::sphere, CaseShape::capsule, CaseShape::cylinder, CaseShape::box,
                                    CaseShape::hull};
    const auto mass = [&] { return random.log_uniform(0.5, 20); };
    HardScene s({hard_box("a", mass(), {0.3, 0.2, 0.25}), hard_box("b", mass(), {0.2, 0.3, 0.2})});
    for (int body = 0; body < 2; ++body) {
      s.surfaces.push_back({body, random_contact_shape(kKinds[random.integer(0, 4)], random)});
      s.surface_of.push_back(body + 1);
    }
    s.pair(0, 1, hard_law(random.uniform(0, 1), random.uniform(0, 1), 2e4));
    const Vector3d side = random.direction();
    s.place(0, Vector3d::zero(), random.vector(0.2), random.vector(1), random.rotation());
    s.place(1, 1.5 * side, -1.0 * side + random.vector(0.2), random.vector(1), random.rotation());
    const PhaseOutcome outcome = s.run(1.2);
    ASSERT_TRUE(outcome.finished) << k << ": " << outcome.failure;
    struck += s.history().impacts > 0, lasting += s.history().persistent_since.has_value();
    const Momentumd before = s.momentum(s.state), after = s.momentum(outcome.end_state);
    Worst& drift = s.history().persistent_since ? momentum : in_impacts;
    drift.note(norm(after.linear - before.linear) / norm(before.linear), k);
    drift.note(norm(after.angular - before.angular) / (norm(before.angular) + norm(before.linear)), k);
    const double T = s.energy(s.state), left = s.energy(outcome.end_state);
    gain.note(std::max(0.0, left - T) / T, k);
    const ContactIntegrals& forces = outcome.integrals.contacts[0];
    const double work = s.history().impact_work + forces.work;
    balance.note(std::abs(left - T - work) / T, k);
    balance.note(std::abs(s.history().impact_work + s.history().impact_loss + s.history().impact_friction_loss) / T, k);
  }
  std::printf("[ measured ] %d struck, %d with lasting contact\n", struck, lasting);
  EXPECT_GT(struck, test::repetitions(1000) / 3);
  EXPECT_LT(momentum.value(), 1e-10);    // measured 1.1e-11
  EXPECT_LT(in_impacts.value(), 1e-10);  // measured 9.9e-12, of the free motion
  EXPECT_LT(gain.value(), 1e-11);        // measured 4e-15
  EXPECT_LT(balance.value(), 1e-10);     // measured 4e-12
}

}  // namespace hard_bodies_test
}  // namespace grapnel::testing
