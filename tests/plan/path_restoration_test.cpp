/// Feasibility restoration: against the minimum peak rate that a spline can have, computed independently, and on random
/// arms.

#include "grapnel/plan/path_restoration.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "grapnel/plan/joint_spline.hpp"
#include "grapnel/plan/shooting.hpp"
#include "plan/plan_case.hpp"
#include "plan/tilted_arms.hpp"
#include "support/sanitizers.hpp"

namespace grapnel::testing {
namespace way_restoration_test {

// A fixed base with one joint that moves from 0 to `angle` in `duration`, to rest.
struct OneJoint {
  Model model;
  ReachProblem problem;
};
OneJoint one_joint(double angle, double duration) {
  ModelBuilder builder;
  BodyDescription base, arm;
  base.name = "base", base.mass = 10, base.inertia = {1, 1, 1, 0, 0, 0};
  base.joint.type = JointType::fixed;
  arm.name = "arm", arm.parent = "base", arm.mass = 1, arm.inertia = {0.1, 0.1, 0.1, 0, 0, 0};
  arm.joint.type = JointType::revolute, arm.joint.axis = {0, 0, 1};
  builder.add(base), builder.add(arm);
  builder.add(FrameDescription{"tip", "arm", {Rotationd::identity(), {1, 0, 0}}});
  OneJoint result{builder.build(), {}};
  ReachProblem& p = result.problem;
  p.start = {0, duration, JointProfile::quintic, {0}, {0}, Posed::identity()};
  p.motion = free_motion(result.model, zero_state(result.model), 0, Vector3d::zero());
  p.lower = {-3}, p.upper = {3}, p.guess = {0.9 * angle};
  Goal goal;
  goal.frame = result.model.frame_index("tip");
  goal.X_WG.p = {std::cos(angle), std::sin(angle), 0};
  p.goals = {goal};
  return result;
}

// The minimum peak rate of a quintic with these inner knots from 0 to 1 in one second: the Chebyshev approximation of
// its rate by those of the splines, with Lawson's weights (1961).
double least_peak_rate(int knots) {
  constexpr int kTimes = 801, kIterations = 2000;
  const JointSpline spline(knots);
  Eigen::MatrixXd A(kTimes, knots);
  Eigen::VectorXd b(kTimes), weight = Eigen::VectorXd::Constant(kTimes, 1.0 / kTimes);
  std::vector<JointPoint> N(static_cast<std::size_t>(knots));
  for (int i = 0; i < kTimes; ++i) {
    const double s = static_cast<double>(i) / (kTimes - 1);
    b[i] = evaluate(JointPath{JointProfile::quintic, 1, 0, 1, 0, 0}, s).rate;
    spline.evaluate(s, N);
    for (int k = 0; k < knots; ++k) A(i, k) = N[static_cast<std::size_t>(k)].rate;
  }
  if (knots == 0) return b.maxCoeff();
  double least = b.lpNorm<Eigen::Infinity>();
  for (int i = 0; i < kIterations; ++i) {
    const Eigen::MatrixXd weighted = weight.asDiagonal() * A;
    const Eigen::VectorXd c = (A.transpose() * weighted).ldlt().solve(-(weighted.transpose() * b));
    const Eigen::VectorXd rate = b + A * c;
    least = std::min(least, rate.lpNorm<Eigen::Infinity>());
    weight = weight.cwiseProduct(rate.cwiseAbs());
    weight /= weight.sum();
  }
  return least;
}

TEST(PathRestoration, MinimizesTheViolation) {
  constexpr double kAngle = 1.3, kDuration = 8, kLimit = 0.1;
  for (const int knots : {0, 1, 4}) {
    SCOPED_TRACE(knots);
    OneJoint one = one_joint(kAngle, kDuration);
    FloatingBase base(one.model, false);
    const ReachSolution solution = plan_reach(base, one.problem);
    ASSERT_TRUE(solution.found) << solution.failure;
    one.problem.rate_limit = {kLimit};
    one.problem.way.limits = true;
    Shooting shooting(base, one.problem);
    const ShootingIterate shot = shooting.shoot(solution.position, solution.rate);
    const ConstrainedSolution end = nearest_feasible_path(base, one.problem, shot, knots, 0, kTolerated);
    const double least = least_peak_rate(knots) * kAngle / kDuration / kLimit - 1;
    std::printf("[ measured ] %d knots: %.6f, least %.6f\n", knots, end.violation, least);
    EXPECT_NEAR(end.violation, least, 0.02 * least);
    EXPECT_NE(end.trouble.find("exceeds its rate limit"), std::string::npos) << end.trouble;
    ASSERT_TRUE(end.shot);
    EXPECT_LT(end.shot->largest_error(), 1e-3);
  }
}

// A limit slightly above the minimum peak rate is satisfied, one slightly below is not.
TEST(PathRestoration, DistinguishesFeasibleFromInfeasible) {
  constexpr double kAngle = 1.3, kDuration = 8;
  const double least = least_peak_rate(4) * kAngle / kDuration;
  for (const double share : {1.01, 0.97}) {
    SCOPED_TRACE(share);
    OneJoint one = one_joint(kAngle, kDuration);
    one.problem.rate_limit = {share * least};
    one.problem.way.limits = true;
    FloatingBase base(one.model, false);
    const ReachSolution solution = plan_reach(base, one.problem);
    EXPECT_EQ(solution.found, share > 1) << solution.failure;
    if (!solution.found) {
      EXPECT_LT(solution.rhs_evaluations, 20000);
      continue;
    }
    EXPECT_LE(solution.way->rate_share, 1 + 1e-6);
  }
}

class Restored : public ::testing::TestWithParam<unsigned> {};
INSTANTIATE_TEST_SUITE_P(Seeds, Restored, ::testing::Range(1u, 9u));

// Two arms on a floating base: rates and base rotation limited well below those of the first solution, with the
// end-effectors still close to their goals.
TEST_P(Restored, EnforcesRatesAndBaseRotation) {
  if (GetParam() > 1) SKIP_UNDER_SANITIZERS();
  TiltedArms arms = tilted_arms(GetParam());
  FloatingBase base(arms.model, true);
  const ReachSolution solution = plan_reach(base, arms.problem);
  ASSERT_TRUE(solution.found) << solution.failure;
  Shooting shooting(base, arms.problem);
  const ShootingIterate shot = shooting.shoot(solution.position, solution.rate);
  ReachProblem p = arms.problem;
  p.way.limits = true;
  p.way.base_turn = 1e-4, p.way.R_WB0 = p.start.X_WB.R;
  p.rate_limit.assign(static_cast<std::size_t>(base.joints()), 1e-3);
  // Both values of the solution itself.
  const ConstrainedSolution as_it_is = nearest_feasible_path(base, p, shot, 4, 0, 1e9);
  ASSERT_TRUE(as_it_is.shot);
  const double fastest = 1e-3 * (1 + as_it_is.violation);
  p.rate_limit.assign(static_cast<std::size_t>(base.joints()), 0.85 * fastest);
  p.way.base_turn = std::numeric_limits<double>::infinity();
  const ConstrainedSolution slower = nearest_feasible_path(base, p, shot, 4, 0, kTolerated);
  EXPECT_LE(slower.violation, kTolerated) << slower.trouble;
  EXPECT_LT(slower.shot->largest_error(), 1e-3);
  p.rate_limit.assign(static_cast<std::size_t>(base.joints()), std::numeric_limits<double>::infinity());
  p.way.base_turn = 1e-4;
  const double turn = nearest_feasible_path(base, p, shot, 4, 0, 1e9).violation + 1e-4;
  p.way.base_turn = 0.7 * turn;
  const ConstrainedSolution stiller = nearest_feasible_path(base, p, shot, 4, 0, kTolerated);
  EXPECT_LE(stiller.violation, kTolerated) << stiller.trouble;
  EXPECT_LT(stiller.shot->largest_error(), 1e-3);
}

// A light base rotates so far that integrations need different numbers of nodes from step to step.
TEST(PathRestoration, SupportsChangingNodes) {
  SKIP_UNDER_SANITIZERS();
  for (unsigned seed = 1; seed <= 8; ++seed) {
    SCOPED_TRACE(seed);
    TiltedArms arms = tilted_arms(seed, 30, 0.1);
    FloatingBase base(arms.model, true);
    const ReachSolution solution = plan_reach(base, arms.problem);
    if (!solution.found) continue;
    Shooting shooting(base, arms.problem);
    const ShootingIterate shot = shooting.shoot(solution.position, solution.rate);
    ReachProblem p = arms.problem;
    p.way.limits = true;
    p.way.base_turn = 0.2, p.way.R_WB0 = p.start.X_WB.R;
    p.rate_limit.assign(static_cast<std::size_t>(base.joints()), 0.1);
    for (int attempt = 0; attempt <= 3; ++attempt) {
      const ConstrainedSolution restored = nearest_feasible_path(base, p, shot, 4, attempt, kTolerated);
      EXPECT_TRUE(std::isfinite(restored.violation) || !restored.shot);
      const ConstrainedSolution kept = solve_with_path_constraints(base, p, shot, 4, attempt);
      EXPECT_TRUE(!kept.kept || kept.violation <= kTolerated);
    }
  }
}

}  // namespace way_restoration_test
}  // namespace grapnel::testing
