/// Derivatives of the demanded rates with respect to the configuration, against finite differences: arms with as many
/// joints as the demand has rows, with more, and with fewer; and planning of arms with tilted axes.

#include <gtest/gtest.h>

#include "grapnel/simulate/simulate_phase.hpp"
#include "grapnel/spatial/decompositions.hpp"
#include "plan/plan_case.hpp"
#include "plan/tilted_arms.hpp"
#include "support/sanitizers.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace rate_sensitivity_test {

// One end-effector of a random servicer, with a moving grasp point.
Goal random_goal(const Servicer& s, Random& random) {
  Goal g;
  g.frame = static_cast<int>(s.model.frames().size()) - 1;
  g.orientation = random.chance(0.5) ? Goal::Orientation::axis : Goal::Orientation::pose;
  g.direction_W = random.direction();
  g.V_WG = {random.vector(0.3), random.vector(0.3)};
  return g;
}

Posed displaced(const Posed& X, int k, double h) {
  Vector3d axis = Vector3d::zero();
  axis[k % 3] = 1;
  return k < 3 ? Posed{X.R * rotation_about(axis, h), X.p} : Posed{X.R, X.p + X.R * (h * axis)};
}

TEST(RateSensitivity, AgreesWithFiniteDifferences) {
  Worst worst("change of demanded rates, relative");
  int redundant = 0, short_of = 0;
  for (int i = 0; i < 40; ++i) {
    SCOPED_TRACE(seed_note(i));
    const bool free_root = i % 4 != 3;
    const Servicer s = random_servicer(i, free_root);
    Random random(700 + i);
    FloatingBase base(s.model, free_root);
    const FreeMotion motion = free_motion(s.model, s.state, 0, {0, 0, 0});
    const std::vector<Goal> goals = {random_goal(s, random)};
    for (RateDemand demand : {RateDemand::velocity, RateDemand::twist, RateDemand::linear, RateDemand::task}) {
      const auto rates_at = [&](const std::vector<double>& theta, const Posed& X) {
        base.place(theta);
        return demanded_rates(base, X, motion.in_base(0, X), goals, demand);
      };
      const std::vector<double> theta = s.theta();
      const DemandedRates here = rates_at(theta, s.X_WB());
      // Close to a singularity finite differences are inaccurate.
      const Eigen::VectorXd sigma = Eigen::JacobiSVD<Eigen::MatrixXd>(here.G).singularValues();
      if (sigma.minCoeff() < 0.05 * sigma[0]) continue;
      redundant += here.G.cols() > here.G.rows();
      short_of += here.unmet > 1e-3;
      const RateSensitivity D = rate_sensitivity(base, s.X_WB(), motion.in_base(0, s.X_WB()), goals, demand, here);
      const double h = 1e-5, scale = 1 + D.per_angle.norm() + D.per_displacement.norm();
      for (int j = 0; j < base.joints(); ++j) {
        std::vector<double> up = theta, down = theta;
        up[j] += h, down[j] -= h;
        const Eigen::VectorXd expected = (rates_at(up, s.X_WB()).rates - rates_at(down, s.X_WB()).rates) / (2 * h);
        EXPECT_LT(worst.note((D.per_angle.col(j) - expected).norm() / scale, i), 1e-7);
      }
      for (int k = 0; free_root && k < 6; ++k) {
        const Eigen::VectorXd expected =
            (rates_at(theta, displaced(s.X_WB(), k, h)).rates - rates_at(theta, displaced(s.X_WB(), k, -h)).rates) /
            (2 * h);
        EXPECT_LT(worst.note((D.per_displacement.col(k) - expected).norm() / scale, i), 1e-7);
      }
    }
  }
  EXPECT_GT(redundant, 5);
  EXPECT_GT(short_of, 5);
}

// Final end-effector errors of a forward dynamics simulation with exact joint tracking, independent of planning.
double simulated_miss(const TiltedArms& arms, const ReachSolution& plan) {
  const ReachProblem& p = arms.problem;
  PhaseSetup setup;
  for (std::size_t j = 0; j < plan.position.size(); ++j) {
    JointDrive drive;
    drive.control = JointControl::prescribed;
    drive.trajectory = {p.start.begin, JointPath{p.start.profile, p.start.end - p.start.begin, p.start.position[j],
                                                 plan.position[j], p.start.rate[j], plan.rate[j]}};
    setup.drives.push_back(drive);
  }
  setup.recover_roots = false;
  PhaseDynamics dynamics(arms.model, setup);
  const PhaseOutcome outcome = simulate_phase(dynamics, {arms.state, p.start.begin, p.start.end});
  EXPECT_TRUE(outcome.finished) << outcome.failure;
  const Kinematics k = forward_kinematics(arms.model, outcome.end_state);
  double worst = 0;
  for (const Goal& g : p.goals) worst = std::max(worst, norm(frame_pose(arms.model, k, g.frame).p - g.X_WG.p));
  return worst;
}

TEST(TiltedArms, AreAllPlannedAndArrive) {
  Worst worst("miss of two planned arms with tilted axes, flown [m]");
  for (unsigned seed = 0; seed < static_cast<unsigned>(test::repetitions(50)); ++seed) {
    SCOPED_TRACE(seed);
    const TiltedArms arms = tilted_arms(seed);
    FloatingBase base(arms.model, true);
    const ReachSolution plan = plan_reach(base, arms.problem);
    ASSERT_TRUE(plan.found) << plan.failure;
    for (const GoalMiss& m : plan.miss) {
      EXPECT_LT(m.distance, kArrived);
      EXPECT_LT(m.angle, kArrived);
    }
    if (seed % 10 == 0) {
      EXPECT_LT(worst.note(simulated_miss(arms, plan), static_cast<int>(seed)), 1e-10);
    }
  }
}

}  // namespace rate_sensitivity_test
}  // namespace grapnel::testing
