/// Reactionless motion and distributed momentum control: the base keeps its attitude, joint rates are those of the
/// published law.

#include <gtest/gtest.h>

#include <cmath>

#include "control/arm_case.hpp"
#include "grapnel/control/base_keeping.hpp"
#include "grapnel/dynamics/free_floating.hpp"
#include "grapnel/spatial/decompositions.hpp"
#include "support/sanitizers.hpp"

namespace grapnel::testing {
namespace base_keeping_test {

std::shared_ptr<BaseKeeping> base_law(const Model& model, std::vector<double> posture, double posture_rate,
                                      double rate = 0.5) {
  BaseKeepingLaw law{model.body_index("base"), Rotationd::identity(), rate, std::move(posture), posture_rate};
  return std::make_shared<BaseKeeping>(model, std::move(law), LawScope{arm_joints(model)});
}

IntegrationSetup tight() {
  IntegrationSetup integration;
  integration.relative_tolerance = integration.absolute_tolerance = 1e-13;
  return integration;
}

double base_angle(const Model& model, const BaseKeeping& law, const State& state) {
  return norm(attitude_deviation(law.law(), root_pose(model, state, 0).R));
}

// Four of the arm's seven degrees of freedom do not rotate the base: motion towards a posture within them, for two
// minutes.
TEST(BaseKeeping, ReactionlessMotionMaintainsTheBaseAttitude) {
  SKIP_UNDER_SANITIZERS();
  const Model model = arm_with_target({.joints = 7});
  const State start = moving_state(model, 0);
  std::vector<double> posture;
  const std::vector<int> joints = arm_joints(model);
  for (int j : joints) posture.push_back(start.q[model.bodies()[model.joints()[j]].q] + (j % 2 ? 0.5 : -0.4));
  const auto law = base_law(model, posture, 0.06, 3);
  PhaseDynamics dynamics(model, with_law(model, law));
  double largest = 0, moved = 0;
  const PhaseOutcome o = simulate_phase(dynamics, {start, 0, 120, 1}, tight(), {.observe = [&](const PhaseSample& s) {
                                          largest = std::max(largest, base_angle(model, *law, s.state));
                                          double now = 0;
                                          for (int j : joints) {
                                            const int q = model.bodies()[model.joints()[j]].q;
                                            now = std::max(now, std::abs(s.state.q[q] - start.q[q]));
                                          }
                                          moved = std::max(moved, now);
                                        }});
  ASSERT_TRUE(o.finished) << o.failure;
  std::printf("  base turned by %.2g rad, a joint moved by %.3g rad\n", largest, moved);
  EXPECT_LT(largest, 1e-12);
  EXPECT_GT(moved, 0.2);
}

// H_wq and h_w: angular momentum about the centre of mass, independent of the base's translation, column by column from
// momentum_about(); computed independently of the law.
struct AngularPart {
  Eigen::MatrixXd of_joints;
  Eigen::Vector3d wheel;
};
Eigen::Vector3d momentum_of(const Model& model, State s, const std::vector<double>& v) {
  s.v = v;
  const Kinematics moving = forward_kinematics(model, s);
  const Vector3d com = center_of_mass(model, moving);
  const Momentumd h = momentum_about(model, moving, com);
  return {h.angular[0], h.angular[1], h.angular[2]};
}
AngularPart angular_part(const Model& model, const State& s, const std::vector<int>& joints) {
  AngularPart part;
  part.of_joints.resize(3, static_cast<Eigen::Index>(joints.size()));
  std::vector<double> v(model.velocities(), 0.0);
  for (std::size_t j = 0; j < joints.size(); ++j) {
    const int at = model.bodies()[model.joints()[joints[j]]].v;
    v[at] = 1, part.of_joints.col(static_cast<Eigen::Index>(j)) = momentum_of(model, s, v), v[at] = 0;
  }
  const int wheel = model.bodies()[model.body_index("wheel")].v;
  v[wheel] = s.v[wheel], part.wheel = momentum_of(model, s, v);
  return part;
}

// With momentum in the system and a rotating wheel: the base comes to rest at its desired attitude, while the joints
// continue with q' = H_wq^+ (L - h_w) (and a damped null-space part).
TEST(BaseKeeping, ArmsAbsorbTheRemainingMomentum) {
  const Model model = arm_with_target({.joints = 7, .wheel = true});
  State start = moving_state(model, 0.004);
  start.v[model.bodies()[model.body_index("wheel")].v] = 8;
  const auto law = base_law(model, {}, 0.5);
  PhaseDynamics dynamics(model, with_law(model, law));
  const PhaseOutcome o = simulate_phase(dynamics, {start, 0, 60}, tight());
  ASSERT_TRUE(o.finished) << o.failure;
  const State& end = o.end_state;
  const double angle = base_angle(model, *law, end), rate = norm(root_twist(model, end, 0).angular);
  const std::vector<int> joints = arm_joints(model);
  const AngularPart part = angular_part(model, end, joints);
  const Eigen::Vector3d L = momentum_of(model, end, end.v);
  const Eigen::VectorXd expected = least_norm_solution(part.of_joints, Eigen::VectorXd(L - part.wheel));
  Eigen::VectorXd rates(expected.size());
  for (std::size_t j = 0; j < joints.size(); ++j)
    rates[static_cast<Eigen::Index>(j)] = end.v[model.bodies()[model.joints()[joints[j]]].v];
  const Eigen::VectorXd held = part.of_joints * rates - (L - part.wheel);
  std::printf("  base %.2g rad, %.2g rad/s; L %.3g, wheel %.3g; not held %.2g; rates %.3g, off the law by %.2g\n",
              angle, rate, L.norm(), part.wheel.norm(), held.norm(), rates.norm(), (rates - expected).norm());
  EXPECT_LT(angle, 1e-8);
  EXPECT_LT(rate, 1e-9);
  EXPECT_GT(L.norm(), 0.1);
  EXPECT_GT(part.wheel.norm(), 0.1);
  EXPECT_LT(held.norm(), 1e-7);
  EXPECT_GT(rates.norm(), 1e-4);
  EXPECT_LT((rates - expected).norm(), 0.05 * rates.norm());  // the null-space part lags behind the posture's demand
}

// A saturated joint reduces the reactionless motion, not the base control.
TEST(BaseKeeping, EffortLimitsReduceTheReactionlessMotion) {
  const Model strong = arm_with_target({.joints = 7});
  const State start = moving_state(strong, 0);
  std::vector<double> posture(7, 1.5);
  const auto law = base_law(strong, posture, 0.5);
  EffortResponse response(strong, law->joints(), {});
  const BaseKeepingLaw& setup = law->law();
  const BaseKeepingCommand full = base_keeping_command(setup, start, {}, {0, 0, 0}, response);
  EXPECT_EQ(full.share, 1);
  const Model weak = arm_with_target({.joints = 7, .effort = 0.25 * full.effort.cwiseAbs().maxCoeff()});
  EffortResponse weaker(weak, law->joints(), {});
  const BaseKeepingCommand cut = base_keeping_command(setup, start, {}, {0, 0, 0}, weaker);
  EXPECT_NEAR(cut.share, 0.25, 1e-12);
  EXPECT_TRUE(cut.within_limits);
  EXPECT_LT((weaker.free() + weaker.response() * cut.effort).head<3>().norm(), 1e-12);
}

}  // namespace base_keeping_test
}  // namespace grapnel::testing
