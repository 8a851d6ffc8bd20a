/// Integrations of the self-motion search: few steps, error estimates, and their consequences if the target rotates
/// several times during the approach.

#include "grapnel/plan/self_motions.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "plan/straight_in_case.hpp"
#include "support/random_robot.hpp"
#include "support/sanitizers.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace self_motions_test {

// The target rotates this many times during the approach, about any axis or, with an axis orientation, about the
// approach direction; the grasp point is up to 0.1 m from that axis.
StraightInProblem turning(const Servicer& s, FloatingBase& base, Goal::Orientation orientation, double turns,
                          int seed) {
  Random random(100 + seed);
  StraightInProblem p = problem_for(s, base, orientation);
  FreeBody& body = p.targets[0];
  const StraightGoal& goal = p.goals[0];
  body.inertia = Symmetric3d::diagonal(30, 30, 30);
  const Vector3d axis = orientation == Goal::Orientation::free ? random.direction() : body.X_WT.R * goal.direction_T;
  body.com = goal.X_TG.p + random.vector(0.15);
  body.V_WT.angular = (2 * std::numbers::pi * turns / (p.end - p.begin)) * axis;
  body.V_WT.linear = Vector3d{0.01, -0.01, 0.005} - cross(body.V_WT.angular, body.X_WT.R * body.com);
  p.max_steps = 2000;
  return p;
}

// Limits that the minimum-norm rates satisfy with a small margin.
ReachProblem with_tight_limits(const Servicer& s, const StraightInProblem& p, const StraightInPath& path) {
  ReachProblem reach = without_limits(s, p);
  constexpr double kSpare = 2e-3;  // [rad], and as a share of the rates
  for (std::size_t j = 0; j < path.joints.size(); ++j) {
    double lowest = kNone, highest = -kNone, fastest = 0;
    for (const StraightInPoint& point : path.points) {
      const JointPoint at = evaluate(path.joints[j], point.time);
      lowest = std::min(lowest, at.position), highest = std::max(highest, at.position);
      fastest = std::max(fastest, std::abs(at.rate));
    }
    reach.lower[j] = lowest - kSpare, reach.upper[j] = highest + kSpare;
    reach.rate_limit[j] = (1 + kSpare) * fastest;
  }
  return reach;
}

constexpr Goal::Orientation kOrientations[] = {Goal::Orientation::free, Goal::Orientation::axis};

// Forty steps are too few for a target that rotates several times, so that coarse results violate limits that exact
// ones satisfy. Without error estimates 10 of these 43 cases were rejected.
TEST(SelfMotions, CoarseStepsRejectNoFeasibleCase) {
  SKIP_UNDER_SANITIZERS();
  int cases = 0;
  for (const double turns : {2.0, 4.0, 6.0}) {
    for (int seed = 0; seed < test::repetitions(12); ++seed) {
      for (const Goal::Orientation orientation : kOrientations) {
        SCOPED_TRACE(::testing::Message() << turns << " turns, seed " << seed);
        const Servicer s = seven_joints();
        FloatingBase base(s.model, true);
        const StraightInProblem p = turning(s, base, orientation, turns, seed);
        const StraightInPath path = plan_straight_in(base, p);
        if (!path.finished || path.damped || path.unmet > 1e-9) continue;
        ++cases;
        const ConstrainedStraightIn result = constrain_straight_in(base, p, with_tight_limits(s, p, path));
        EXPECT_TRUE(result.feasible) << result.failure;
        EXPECT_TRUE(result.self_motion.coefficients.empty());
      }
    }
  }
  std::printf("[ measured ] %d cases\n", cases);
  EXPECT_GT(cases, test::repetitions(12));
}

// The estimate exceeds the integration error, but not by much, and both decrease with the steps.
TEST(SelfMotions, ErrorEstimateBoundsTheError) {
  Worst below("error of an integration over the estimate"), above("the estimate over the error");
  int cases = 0;
  for (const double turns : {1.0, 3.0, 6.0}) {
    for (int seed = 0; seed < test::repetitions(10); ++seed) {
      const Servicer s = seven_joints();
      FloatingBase base(s.model, true);
      const StraightInProblem p = turning(s, base, Goal::Orientation::free, turns, seed);
      const StraightInPath path = plan_straight_in(base, p);
      if (!path.finished || path.damped || path.unmet > 1e-9) continue;
      ++cases;
      SelfMotions motions(base, p, nullptr);
      const auto integrated = [&] {
        const std::vector<SelfMotions::Node> nodes =
            motions.integrate(Eigen::VectorXd::Zero(motions.unknowns()), SelfMotions::Derivatives::none);
        double off = 0, fastest = 0, rate_off = 0;
        for (const SelfMotions::Node& node : nodes) {
          for (std::size_t j = 0; j < node.position.size(); ++j) {
            const JointPoint at = evaluate(path.joints[j], node.time);
            off = std::max(off, std::abs(node.position[j] - at.position));
            rate_off = std::max(rate_off, std::abs(node.rate[j] - at.rate));
            fastest = std::max(fastest, std::abs(at.rate));
          }
        }
        return std::max(off, rate_off / fastest);
      };
      const double off = integrated(), estimate = motions.error();
      if (off > 1e-9) {
        below.note(off / estimate, seed), above.note(estimate / off, seed);
      }
      ASSERT_TRUE(motions.refine());
      const double off_then = integrated(), estimate_then = motions.error();
      if (off < 0.05) {
        EXPECT_LT(off_then, 0.2 * off) << turns << " turns, seed " << seed;
        EXPECT_LT(estimate_then, 0.2 * estimate) << turns << " turns, seed " << seed;
      }
    }
  }
  EXPECT_GT(cases, test::repetitions(15));
  EXPECT_LT(below.value(), 1);
  EXPECT_LT(above.value(), 50);
}

}  // namespace self_motions_test
}  // namespace grapnel::testing
