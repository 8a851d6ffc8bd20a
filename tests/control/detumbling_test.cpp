/// Detumbling through the grasp: the exact motion, the bound on the torque, effort limits, known and unknown forces.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "control/arm_case.hpp"
#include "grapnel/capture/internal_loads.hpp"
#include "grapnel/control/detumbling.hpp"
#include "grapnel/dynamics/momentum.hpp"

namespace grapnel::testing {
namespace detumbling_test {

constexpr double kTorque = 0.4;  // [N m]

std::shared_ptr<Detumbling> detumbling(const Model& model) {
  DetumblingLaw law{{model.body_index("target")}, kTorque, {}};
  LawScope scope{arm_joints(model)};
  for (std::size_t j = 0; j < scope.joints.size(); ++j) law.damping.push_back(20 + 5.0 * static_cast<double>(j));
  return std::make_shared<Detumbling>(model, std::move(law), std::move(scope));
}

struct Target {
  Rotationd R;
  Vector3d w, L, v;
};
Target target_of(const Model& model, const State& state) {
  const Kinematics k = forward_kinematics(model, state);
  const int body = model.body_index("target");
  const int bodies[] = {body};
  const TargetMotion3d motion = target_motion(model, k, bodies);
  return {k.X_WB[body].R, k.V_WB[body].angular, motion.angular_momentum, motion.velocity};
}

// Angular velocity of the free target at the time `t`, from a separate integration.
Vector3d free_rate(const Model& model, const Target& start, double t) {
  BodyDescription alone = model.bodies()[model.body_index("target")].description;
  alone.parent = "", alone.joint = {}, alone.X_PF = Posed::identity(), alone.com = {0, 0, 0};
  alone.joint.name = "alone", alone.joint.type = JointType::free;
  const Model one = ModelBuilder().add(alone).build();
  State s = zero_state(one);
  set_root_pose(one, 0, {start.R, {0, 0, 0}}, s);
  set_root_twist(one, 0, {start.w, {0, 0, 0}}, s);
  PhaseDynamics dynamics(one, {});
  IntegrationSetup integration;
  integration.relative_tolerance = integration.absolute_tolerance = 1e-13;
  const PhaseOutcome o = simulate_phase(dynamics, {s, 0, t}, integration);
  return root_twist(one, o.end_state, 0).angular;
}

// omega(t) = (1 - t/t_f) omega_free(t - t^2/(2 t_f)), |L| decreases linearly, and the centre of mass comes to rest at
// the same time.
void expect_exact_motion(const Model& model, const PhaseSetup& setup, const State& start) {
  const Target first = target_of(model, start);
  const double t_f = norm(first.L) / kTorque;
  ASSERT_GT(t_f, 8);
  PhaseDynamics dynamics(model, setup);
  IntegrationSetup integration;
  integration.relative_tolerance = integration.absolute_tolerance = 1e-12;
  double rate_error = 0, momentum_error = 0, speed_error = 0, turned = 0;
  const PhaseOutcome o =
      simulate_phase(dynamics, {start, 0, 0.99 * t_f, 0.11 * t_f}, integration, {.observe = [&](const auto& s) {
                       const Target now = target_of(model, s.state);
                       const double left = 1 - s.time / t_f;
                       const Vector3d expected = left * free_rate(model, first, s.time - s.time * s.time / (2 * t_f));
                       rate_error = std::max(rate_error, norm(now.w - expected));
                       momentum_error = std::max(momentum_error, norm(now.L - left * first.L));
                       speed_error = std::max(speed_error, norm(now.v - left * first.v));
                       turned = std::max(turned, norm(now.w - left * first.w));
                     }});
  ASSERT_TRUE(o.finished) << o.failure;
  std::printf("  joints %zu: rate %.2g rad/s, momentum %.2g N m s, speed %.2g m/s\n", model.joints().size(), rate_error,
              momentum_error, speed_error);
  EXPECT_LT(rate_error, 1e-10);
  EXPECT_LT(momentum_error, 1e-9);  // of 4
  EXPECT_LT(speed_error, 1e-10);
  EXPECT_GT(turned, 1e-4);  // its axis varies, as for a free triaxial body
}

TEST(Detumbling, FollowsTheExactMotionWithSixAndSevenJoints) {
  for (int joints : {6, 7}) {
    SCOPED_TRACE(joints);
    const Model model = arm_with_target({.joints = joints});
    const State start = moving_state(model, 0.03);
    ASSERT_GT(norm(target_of(model, start).v), 1e-3);
    expect_exact_motion(model, with_law(model, detumbling(model)), start);
  }
}

// The law's model includes friction, attitude control and a driven wheel.
TEST(Detumbling, CompensatesKnownForces) {
  const Model model = arm_with_target({.joints = 7, .friction = {3, 0, 1e-3}, .wheel = true});
  State start = moving_state(model, 0.03);
  start.v[model.bodies()[model.body_index("wheel")].v] = 200;
  PhaseSetup setup = with_law(model, detumbling(model));
  setup.attitude = AttitudeControl{model.body_index("base"), Rotationd::identity(), {2, 2, 2}, {40, 40, 40}};
  setup.drives[0] = {.control = JointControl::pd, .trajectory = JointTrajectory::at_rest(0), .kp = 0, .kd = 1e-3};
  expect_exact_motion(model, setup, start);
}

// With weak drives the torque is scaled: no effort exceeds its limit, L keeps its direction.
TEST(Detumbling, ScalesTheTorqueToTheJointsEfforts) {
  const Model strong = arm_with_target({.joints = 7});
  const State start = moving_state(strong, 0.03);
  EffortResponse response(strong, arm_joints(strong), {});
  const auto law = detumbling(strong);
  const DetumblingCommand full = detumbling_command(law->law(), start, {}, {0, 0, 0}, response);
  EXPECT_EQ(full.scale, 1);
  const double limit = 0.8 * full.effort.cwiseAbs().maxCoeff();
  const Model model = arm_with_target({.joints = 7, .effort = limit});
  const Target first = target_of(model, start);
  const double t_f = norm(first.L) / kTorque;
  PhaseDynamics dynamics(model, with_law(model, detumbling(model)));
  const auto evaluation = detumbling(model);
  double least = 1, largest = 0, direction = 0;
  const PhaseOutcome o =
      simulate_phase(dynamics, {start, 0, 0.9 * t_f, 0.05 * t_f}, {}, {.observe = [&](const PhaseSample& s) {
                       const JointLawCommand command = evaluation->at(s.time, s.state, {});
                       EXPECT_TRUE(command.within_limits);
                       least = std::min(least, command.scale);
                       for (double effort : s.motor) largest = std::max(largest, std::abs(effort));
                       const Target now = target_of(model, s.state);
                       direction = std::max(direction, norm(cross(now.L, first.L)) / (norm(now.L) * norm(first.L)));
                     }});
  ASSERT_TRUE(o.finished) << o.failure;
  std::printf("  least scale %.3g, largest effort %.6g of %.6g, direction %.2g\n", least, largest, limit, direction);
  EXPECT_LT(least, 0.999);
  EXPECT_GT(least, 0.01);
  EXPECT_LE(largest, limit * (1 + 1e-12));
  EXPECT_LT(direction, 1e-8);
  EXPECT_GT(norm(target_of(model, o.end_state).L), 0.1 * norm(first.L) * (1 + 1e-6));  // the motion takes longer
}

// The gripper's rating: neither force nor moment at the grasp exceeds it, and the torque is scaled accordingly.
TEST(Detumbling, ScalesTheTorqueToTheGripper) {
  const Model model = arm_with_target({.joints = 7});
  const int target = model.body_index("target");
  const State start = moving_state(model, 0.03);
  const auto grasp_wrench = [&](const State& state, std::span<const double> acceleration) {
    const Kinematics k = forward_kinematics(model, state);
    return joint_wrenches(model, k, acceleration, {})[target];
  };
  const auto simulate = [&](double force, double moment) {
    auto law_of = [&] {
      DetumblingLaw law = detumbling(model)->law();
      const BodyDescription& body = model.bodies()[target].description;
      const LoopClosure frames{"grasp", model.bodies()[target].parent, body.X_PF, target, Posed::identity()};
      law.holds = {{frames, -1, force, moment}};
      return std::make_shared<Detumbling>(model, std::move(law), LawScope{arm_joints(model)});
    };
    PhaseDynamics dynamics(model, with_law(model, law_of()));
    const auto evaluation = law_of();
    struct {
      double force = 0, moment = 0, least = 1;
    } found;
    const double t_f = norm(target_of(model, start).L) / kTorque;
    const PhaseOutcome o = simulate_phase(
        dynamics, {start, 0, 0.5 * t_f, 0.02 * t_f}, {}, {.observe = [&](const PhaseSample& s) {
          const Wrenchd F = grasp_wrench(s.state, s.dynamics->acceleration());
          found.force = std::max(found.force, norm(F.linear)), found.moment = std::max(found.moment, norm(F.angular));
          const JointLawCommand command = evaluation->at(s.time, s.state, {});
          EXPECT_TRUE(command.within_limits);
          found.least = std::min(found.least, command.scale);
        }});
    EXPECT_TRUE(o.finished) << o.failure;
    return found;
  };
  const auto free = simulate(1e9, 1e9);
  EXPECT_EQ(free.least, 1);
  for (const bool by_force : {true, false}) {
    const double limit = 0.8 * (by_force ? free.force : free.moment);
    const auto limited = by_force ? simulate(limit, 1e9) : simulate(1e9, limit);
    std::printf("  %s %.6g of %.6g, without limit %.6g; least scale %.3g\n", by_force ? "force" : "moment",
                by_force ? limited.force : limited.moment, limit, by_force ? free.force : free.moment, limited.least);
    EXPECT_LT(limited.least, 0.999);
    EXPECT_LE(by_force ? limited.force : limited.moment, limit * (1 + 1e-9));
  }
}

// Limits that even the slowest motion exceeds: everything is scaled down, no limit is exceeded, and the excess is
// reported. The efforts are continuous, so the number of steps does not increase.
TEST(Detumbling, ReportsInsufficientLimits) {
  const Model strong = arm_with_target({.joints = 7});
  const State start = moving_state(strong, 0.5);  // fast: even free rotation of the target requires efforts
  const DetumblingCommand full = [&] {
    EffortResponse response(strong, arm_joints(strong), {});
    return detumbling_command(detumbling(strong)->law(), start, {}, {0, 0, 0}, response);
  }();
  EXPECT_EQ(full.demand, 0);  // without limits
  EXPECT_EQ(full.limiting, -1);
  const double limit = 0.02 * full.effort.cwiseAbs().maxCoeff();
  const Model weak = arm_with_target({.joints = 7, .effort = limit});
  EffortResponse response(weak, arm_joints(weak), {});
  const DetumblingCommand cut = detumbling_command(detumbling(weak)->law(), start, {}, {0, 0, 0}, response);
  EXPECT_FALSE(cut.within_limits);
  EXPECT_GT(cut.demand, 3);
  EXPECT_GE(cut.limiting, 0);
  EXPECT_LE(cut.effort.cwiseAbs().maxCoeff(), limit);
  PhaseDynamics dynamics(weak, with_law(weak, detumbling(weak)));
  const PhaseOutcome o = simulate_phase(dynamics, {start, 0, 2});
  ASSERT_TRUE(o.finished) << o.failure;
  std::printf("  %.3g times the limit; %ld steps, %ld rejected\n", cut.demand, o.steps, o.rejected);
  EXPECT_LT(o.steps, 5000);
}

// Random postures of six joints, some close to a singular one: the weak direction is ignored, and the efforts stay
// within those of other postures. The plain inverse would require up to 1/condition.
TEST(Detumbling, ContinuesWithReducedRank) {
  const Model model = arm_with_target({.joints = 6});
  const auto law = detumbling(model);
  EXPECT_TRUE(law->continues_at_reduced_rank());
  EffortResponse response(model, arm_joints(model), {});
  State state = moving_state(model, 0.03);
  std::vector<double> largest;
  double least = 1;
  Random random(3);
  for (int i = 0; i < 4000; ++i) {
    for (int j : arm_joints(model)) state.q[model.bodies()[model.joints()[j]].q] = random.uniform(-2.5, 2.5);
    const DetumblingCommand c = detumbling_command(law->law(), state, {}, {0, 0, 0}, response);
    largest.push_back(c.effort.cwiseAbs().maxCoeff());
    least = std::min(least, c.condition);
  }
  std::sort(largest.begin(), largest.end());
  const double median = largest[largest.size() / 2];
  std::printf("  least condition %.2g; efforts: median %.4g, largest %.4g N m\n", least, median, largest.back());
  EXPECT_LT(least, 1e-3);  // below the former limit of the law
  EXPECT_LT(largest.back(), 100 * median);
}

// Sampled with zero-order hold: the deviation from the exact motion is proportional to the period.
TEST(Detumbling, SampledLawConvergesToTheContinuousOne) {
  const Model model = arm_with_target({.joints = 7});
  const State start = moving_state(model, 0.03);
  const Target first = target_of(model, start);
  const double t_f = norm(first.L) / kTorque;
  double error[2] = {};
  for (int i = 0; i < 2; ++i) {
    PhaseSetup setup = with_law(model, detumbling(model));
    setup.clock = std::make_shared<ControlClock>(ControlTiming{i == 0 ? 0.04 : 0.02, 0}, model.joints().size());
    PhaseDynamics dynamics(model, setup);
    const PhaseOutcome o = simulate_phase(dynamics, {start, 0, 0.5 * t_f});
    ASSERT_TRUE(o.finished) << o.failure;
    error[i] = norm(target_of(model, o.end_state).L - 0.5 * first.L) / norm(first.L);
  }
  std::printf("  deviation %.3g, %.3g\n", error[0], error[1]);
  EXPECT_LT(error[0], 0.01);
  EXPECT_NEAR(error[0] / error[1], 2, 0.1);
}

// Independent check: forward dynamics under random efforts, with the loop solver of the phases.
TEST(EffortResponse, AgreesWithForwardDynamics) {
  double worst = 0;
  for (int i = 0; i < 10; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(i);
    RobotOptions options;
    options.min_bodies = 3, options.max_bodies = 10;
    const Model model = random_model(options, random);
    const State state = random_state(model, random, 0.5);
    std::vector<int> joints;
    for (std::size_t j = 0; j < model.joints().size(); ++j) joints.push_back(static_cast<int>(j));
    EffortResponse response(model, joints, {});
    Forces forces;
    forces.gravity = random.vector(2);
    forces.generalized.assign(model.velocities(), 0.0);
    response.update(state, {}, forces.gravity);
    Eigen::VectorXd effort = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(joints.size()));
    for (std::size_t j = 0; j < joints.size(); ++j) {
      effort[static_cast<Eigen::Index>(j)] = random.uniform(-5, 5);
      forces.generalized[response.velocity(j)] = effort[static_cast<Eigen::Index>(j)];
    }
    const std::vector<double> expected = forward_dynamics(model, state, forces);
    const Eigen::VectorXd got = response.free() + response.response() * effort;
    const Eigen::Map<const Eigen::VectorXd> e(expected.data(), got.size());
    worst = std::max(worst, (got - e).norm() / e.norm());
  }
  std::printf("  largest difference %.2g\n", worst);
  EXPECT_LT(worst, 1e-10);
}

}  // namespace detumbling_test
}  // namespace grapnel::testing
