/// Motion and internal force of a target held by two arms are decoupled.

#include "grapnel/control/grasp_force.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "control/arm_case.hpp"
#include "grapnel/dynamics/momentum.hpp"
#include "support/sanitizers.hpp"

namespace grapnel::testing {
namespace grasp_force_test {

struct TwoArms {
  Model model;
  State state;
  std::vector<LoopClosure> closures;
};

// Two arms hold a target; the first carries it in the tree. At rest relative to each other, while the whole system
// drifts and rotates.
TwoArms two_arms(int joints, double effort, GraspModel second) {
  ModelBuilder builder;
  BodyDescription base;
  base.name = base.joint.name = "base", base.joint.type = JointType::free;
  base.mass = 600, base.inertia = Symmetric3d::diagonal(160, 190, 140);
  builder.add(base);
  const Vector3d axes[] = {{0, 0, 1}, {0, 1, 0}, {1, 0, 0}};
  for (int arm = 0; arm < 2; ++arm) {
    std::string parent = "base";
    for (int j = 0; j < joints; ++j) {
      BodyDescription link;
      link.name = link.joint.name = std::to_string(arm + 1) + "-" + std::to_string(j + 1);
      link.parent = parent;
      link.X_PF.p = j == 0 ? Vector3d{0.6, arm == 0 ? 0.5 : -0.5, 0.2} : Vector3d{0.5, 0, 0};
      link.joint.type = JointType::revolute, link.joint.axis = axes[j % 3], link.joint.limits.effort = effort;
      link.mass = 20, link.com = {0.25, 0, 0.02}, link.inertia = Symmetric3d::diagonal(0.1, 0.5, 0.5);
      builder.add(link);
      parent = link.name;
    }
    if (arm == 1) continue;
    BodyDescription target;
    target.name = target.joint.name = "target", target.parent = parent, target.X_PF.p = {0.3, 0, 0};
    target.mass = 300, target.com = {0.1, -0.4, -0.1}, target.inertia = {60, 90, 110, 4, -6, 3};
    builder.add(target);
  }
  TwoArms t{builder.build(), {}, {}};
  t.state = zero_state(t.model);
  const double bent[] = {0.4, -0.7, 0.3, 1.1, -0.9, 0.5, 0.8};
  for (std::size_t j = 0; j < t.model.joints().size(); ++j) {
    const Body& body = t.model.bodies()[t.model.joints()[j]];
    const int number = static_cast<int>(j) % joints;
    t.state.q[body.q] = (body.description.name[0] == '2' && number % 3 != 1 ? -1 : 1) * bent[number];
  }
  const double drift[] = {0.02, -0.01, 0.03, 0.01, 0.02, -0.01};
  std::copy(std::begin(drift), std::end(drift), t.state.v.begin());
  const Kinematics k = forward_kinematics(t.model, t.state);
  LoopClosure closure;
  closure.name = "second", closure.model = second;
  closure.body_a = t.model.body_index("2-" + std::to_string(joints)),
  closure.X_AC = {Rotationd::identity(), {0.3, 0, 0}};
  closure.body_b = t.model.body_index("target");
  closure.X_BD = inverse(k.X_WB[closure.body_b]) * (k.X_WB[closure.body_a] * closure.X_AC);
  t.closures = {closure};
  return t;
}

GraspForceLaw law_of(const TwoArms& t, double force, double begin, double ramp) {
  GraspForceLaw law;
  law.target = t.model.body_index("target"), law.base = 0;
  const Kinematics k = forward_kinematics(t.model, t.state);
  law.X_BT = inverse(k.X_WB[0]) * k.X_WB[law.target];
  law.X_BT.p += Vector3d{0.01, -0.02, 0.015};  // a nonzero initial error
  law.holds = {{-1, Posed::identity(), GraspModel::rigid, {0, 0, 1}},
               {0, t.closures[0].X_BD, t.closures[0].model, t.closures[0].hinge_C}};
  if (force != 0) law.pairs = {{0, 1, force, begin, ramp}};
  for (std::size_t j = 0; j < t.model.joints().size(); ++j) law.damping.push_back(20 + static_cast<double>(j));
  return law;
}

std::shared_ptr<GraspForce> law_for(const TwoArms& t, const GraspForceLaw& law) {
  return std::make_shared<GraspForce>(t.model, law, LawScope{arm_joints(t.model), t.closures});
}

struct ForceRun {
  std::vector<Posed> target;  // relative to the base
  std::vector<double> squeeze, time;
  double others = 0;  // other components of the internal wrench
  Momentumd change = Momentumd::zero();
  PhaseOutcome outcome;
  double work_error = 0;
};

ForceRun run_law(const TwoArms& t, const GraspForceLaw& law) {
  PhaseSetup setup = with_law(t.model, law_for(t, law));
  setup.closures = t.closures;
  PhaseDynamics dynamics(t.model, setup);
  IntegrationSetup integration;
  integration.relative_tolerance = integration.absolute_tolerance = 1e-12;
  ForceRun f;
  const Kinematics first = forward_kinematics(t.model, t.state);
  const double energy = kinetic_energy(t.model, first, t.state);
  f.outcome = simulate_phase(
      dynamics, {t.state, 0, 6, 0.5}, integration, {.observe = [&](const PhaseSample& s) {
        const Kinematics k = forward_kinematics(t.model, s.state);
        f.target.push_back(inverse(k.X_WB[0]) * k.X_WB[law.target]);
        f.time.push_back(s.time);
        // The solver's wrench on the second arm, and therefore on the target, in W.
        const LoopClosure& c = t.closures[0];
        const Posed X_WC = k.X_WB[c.body_a] * c.X_AC;
        const Wrenchd F = X_WC.R * closure_wrench(c, s.dynamics->loops()->multipliers());
        // The first arm's wrench from the target's motion.
        const auto A = body_accelerations(t.model, k, s.dynamics->acceleration())[law.target];
        const BodyDescription& body = t.model.bodies()[law.target].description;
        const Vector3d w = k.V_WB[law.target].angular, arm = k.X_WB[law.target].R * body.com;
        const Symmetric3d I = rotate(k.X_WB[law.target].R, body.inertia);
        const Vector3d force = body.mass * (A.linear + cross(A.angular, arm) + cross(w, cross(w, arm)));
        const Vector3d com = k.X_WB[law.target].p + arm, moment = I * A.angular + cross(w, I * w);
        const Vector3d p_1 = k.X_WB[law.target].p;
        const Vector3d F_1 = force + F.linear;
        const Vector3d N_1 = moment + F.angular + cross(X_WC.p - com, F.linear) - cross(p_1 - com, F_1);
        Eigen::VectorXd stacked(12);
        for (int i = 0; i < 3; ++i) {
          stacked[i] = N_1[i] / law.moment_length, stacked[3 + i] = F_1[i];
          stacked[6 + i] = -F.angular[i] / law.moment_length, stacked[9 + i] = -F.linear[i];
        }
        GraspForceLaw with_pair = law;
        with_pair.pairs = {{0, 1, 1, 0, 0}};
        const GraspMap map = grasp_map(with_pair, t.model, k);
        const Eigen::VectorXd inside = map.internal_part(stacked), unit = map.pairs.col(0);
        const double squeeze = unit.dot(inside) / unit.squaredNorm();
        f.squeeze.push_back(squeeze);
        f.others = std::max(f.others, (inside - squeeze * unit).norm());
        f.work_error =
            std::max(f.work_error, std::abs(kinetic_energy(t.model, k, s.state) - energy - s.integrals.motor_work));
      }});
  const Kinematics last = forward_kinematics(t.model, f.outcome.end_state);
  f.change = momentum_about(t.model, last, Vector3d::zero()) - momentum_about(t.model, first, Vector3d::zero());
  return f;
}

TEST(GraspForce, ForceStepsDoNotMoveTheTarget) {
  SKIP_UNDER_SANITIZERS();
  constexpr double kForce = 40;
  for (int joints : {6, 7}) {
    SCOPED_TRACE(joints);
    const TwoArms t = two_arms(joints, std::numeric_limits<double>::infinity(), GraspModel::rigid);
    const ForceRun without = run_law(t, law_of(t, 0, 0, 0)), step = run_law(t, law_of(t, kForce, 0, 0)),
                   ramp = run_law(t, law_of(t, -kForce, 1, 3));
    ASSERT_TRUE(without.outcome.finished && step.outcome.finished && ramp.outcome.finished)
        << without.outcome.failure << step.outcome.failure << ramp.outcome.failure;
    double moved = 0, went = 0, error = 0, ramp_error = 0;
    for (std::size_t i = 0; i < without.target.size(); ++i) {
      moved =
          std::max({moved, norm(step.target[i].p - without.target[i].p), norm(ramp.target[i].p - without.target[i].p)});
      went = std::max(went, norm(without.target[i].p - without.target[0].p));
      error = std::max(error, std::abs(step.squeeze[i] - kForce));
      const GraspForceLaw::Pair pair{0, 1, -kForce, 1, 3};
      ramp_error = std::max(ramp_error, std::abs(ramp.squeeze[i] - squeeze_at(pair, ramp.time[i])));
    }
    std::printf("  moved by %.2g of %.3g m; squeeze off by %.2g, %.2g N, others %.2g N; work %.2g J, momentum %.2g\n",
                moved, went, error, ramp_error, std::max(step.others, without.others), step.work_error,
                norm(step.change.angular));
    EXPECT_LT(moved, 1e-10);
    EXPECT_GT(went, 5e-3);
    EXPECT_LT(error, 1e-7);
    EXPECT_LT(ramp_error, 1e-7);
    EXPECT_LT(std::max({step.others, ramp.others, without.others}), 1e-7);
    EXPECT_LT(step.work_error, 1e-9);
    EXPECT_LT(norm(step.change.angular), 1e-9);
  }
}

// Held with critical damping relative to the base, which the arms accelerate.
TEST(GraspForce, HoldsTheTargetRelativeToTheBase) {
  const TwoArms t = two_arms(7, std::numeric_limits<double>::infinity(), GraspModel::rigid);
  const GraspForceLaw law = law_of(t, 25, 0, 2);
  const ForceRun f = run_law(t, law);
  ASSERT_TRUE(f.outcome.finished) << f.outcome.failure;
  const Vector3d com = t.model.bodies()[law.target].description.com;
  const Vector3d first = f.target[0] * com - law.X_BT * com;
  double error = 0;
  for (std::size_t i = 0; i < f.target.size(); ++i) {
    const double x = law.rate * f.time[i], left = (1 + x) * std::exp(-x);
    error = std::max(error, norm((f.target[i] * com - law.X_BT * com) - left * first));
  }
  std::printf("  off critical damping by %.2g m\n", error);
  EXPECT_LT(error, 1e-9);
  EXPECT_GT(norm(first), 0.01);
}

// G (1 - G_M^+ G) = 0: internal wrenches cause no motion, and the distribution is minimal in the metric.
TEST(GraspForce, InternalWrenchesCauseNoMotion) {
  for (const GraspModel second : {GraspModel::rigid, GraspModel::hinge, GraspModel::point}) {
    const TwoArms t = two_arms(7, std::numeric_limits<double>::infinity(), second);
    const GraspForceLaw law = law_of(t, 1, 0, 0);
    const Kinematics k = forward_kinematics(t.model, t.state);
    const GraspMap map = grasp_map(law, t.model, k);
    const Eigen::VectorXd inside = map.passes * (map.internal * Eigen::VectorXd::LinSpaced(map.internal.cols(), -1, 2));
    const Vector3d com = k.X_WB[law.target] * t.model.bodies()[law.target].description.com;
    Vector3d force = Vector3d::zero(), moment = Vector3d::zero();
    for (int g = 0; g < 2; ++g) {
      const Vector3d N{inside[6 * g], inside[6 * g + 1], inside[6 * g + 2]},
          F{inside[6 * g + 3], inside[6 * g + 4], inside[6 * g + 5]};
      const Vector3d p = k.X_WB[law.target] * law.holds[static_cast<std::size_t>(g)].X_TC.p;
      force += F, moment += law.moment_length * N + cross(p - com, F);
    }
    EXPECT_LT(norm(force) + norm(moment), 1e-12);
    EXPECT_GT(inside.norm(), 0.1);
    EXPECT_LT((map.internal * map.pairs - map.pairs).norm(), 1e-12);  // a squeeze is internal
    const int free = second == GraspModel::rigid ? 6 : second == GraspModel::hinge ? 5 : 3;
    EXPECT_NEAR(map.internal.trace(), free, 1e-9);
  }
}

// Effort limits reduce the internal force, not the motion.
TEST(GraspForce, EffortLimitsReduceTheInternalForce) {
  const TwoArms strong = two_arms(7, std::numeric_limits<double>::infinity(), GraspModel::rigid);
  const JointLawCommand motion = law_for(strong, law_of(strong, 0, 0, 0))->at(0, strong.state, {});
  const double limit = 3 * motion.effort.cwiseAbs().maxCoeff();
  const TwoArms weak = two_arms(7, limit, GraspModel::rigid);
  const JointLawCommand cut = law_for(weak, law_of(weak, 500, 0, 0))->at(0, weak.state, {});
  EXPECT_TRUE(cut.within_limits);
  EXPECT_LT(cut.scale, 0.9);
  EXPECT_GT(cut.scale, 0.001);
  EXPECT_NEAR(cut.effort.cwiseAbs().maxCoeff(), limit, 1e-9 * limit);
}

}  // namespace grasp_force_test
}  // namespace grapnel::testing
