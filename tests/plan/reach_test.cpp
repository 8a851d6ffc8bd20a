/// Free-floating inverse kinematics: reference solutions, random robots with goals from a simulated motion, limits,
/// orientations, objectives, and messages for infeasible goals.

#include <gtest/gtest.h>

#include <cmath>

#include "grapnel/plan/reach.hpp"
#include "grapnel/plan/shooting.hpp"
#include "grapnel/spatial/decompositions.hpp"
#include "plan/plan_case.hpp"
#include "support/sanitizers.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace reach_test {

void expect_arrives(const ReachSolution& s) {
  ASSERT_TRUE(s.found) << s.failure;
  for (const GoalMiss& m : s.miss) {
    EXPECT_LT(m.distance, kArrived);
    EXPECT_LT(m.angle, kArrived);
  }
}

// Two independent models found these solutions from the published angles by minimum-norm Newton steps.
TEST(ThesisPlan, ReferenceSolutions) {
  const Servicer s = thesis_servicer();
  FloatingBase base(s.model, true);
  struct Reference {
    RateDemand demand;
    double theta[6], base[3];
  };
  const Reference references[] = {{RateDemand::velocity,
                                   {-0.801268, -1.254248, 0.019399, 2.381974, -1.260232, -0.049333},
                                   {0.000565, 0.021484, 0.808194}},
                                  {RateDemand::twist,
                                   {-0.627529, -1.324836, 0.008705, 2.555432, -1.343726, -0.031998},
                                   {0.000258, 0.021380, 0.690432}}};
  for (const Reference& r : references) {
    ReachProblem p = thesis_problem(s, r.demand);
    p.starts = 1;
    const ReachSolution found = plan_reach(base, p);
    expect_arrives(found);
    for (int j = 0; j < 6; ++j) EXPECT_NEAR(found.position[j], r.theta[j], 6e-7);
    EXPECT_NEAR(found.X_WB.p[0], r.base[0], 6e-7);
    EXPECT_NEAR(found.X_WB.p[1], r.base[1], 6e-7);
    EXPECT_NEAR(rotation_vector(found.X_WB.R)[2], r.base[2], 6e-7);
    EXPECT_LT(found.unmet_rate, 1e-12);
    EXPECT_LE(found.iterations, 6);
  }
}

TEST(ThesisPlan, JacobianAgreesWithFiniteDifferences) {
  const Servicer s = thesis_servicer();
  FloatingBase base(s.model, true);
  for (RateDemand demand : {RateDemand::given, RateDemand::velocity, RateDemand::twist, RateDemand::linear}) {
    const ReachProblem p = thesis_problem(s, demand);
    Shooting shooting(base, p);
    const ShootingIterate here = shooting.shoot(p.guess, std::vector<double>(6, 0.0));
    ASSERT_TRUE(here.valid);
    for (int j = 0; j < 6; ++j) {
      std::vector<double> up = p.guess, down = p.guess;
      up[j] += 1e-5, down[j] -= 1e-5;
      const Eigen::VectorXd d = (shooting.shoot(up, here.rate).error - shooting.shoot(down, here.rate).error) / 2e-5;
      EXPECT_LT((d - here.J.col(j)).norm(), 1e-8);  // measured 2e-10
    }
  }
}

TEST(ThesisPlan, ObjectivesSelectAmongSolutions) {
  const Servicer s = thesis_servicer();
  FloatingBase base(s.model, true);
  const auto distance = [](const std::vector<double>& a, const std::vector<double>& b) {
    double sum = 0;
    for (std::size_t j = 0; j < a.size(); ++j) sum += (a[j] - b[j]) * (a[j] - b[j]);
    return sum;
  };
  ReachProblem p = thesis_problem(s, RateDemand::twist);
  p.starts = 8;
  const ReachSolution as_found = plan_reach(base, p);
  set_measure(p, Objective::Kind::nearest);
  const ReachSolution nearest = plan_reach(base, p);
  set_measure(p, Objective::Kind::excursion);
  const ReachSolution excursion = plan_reach(base, p);
  for (const ReachSolution* r : {&as_found, &nearest, &excursion}) expect_arrives(*r);
  EXPECT_LT(distance(nearest.position, p.guess), distance(as_found.position, p.guess));
  EXPECT_LT(distance(excursion.position, p.start.position), 0.9 * distance(as_found.position, p.start.position));

  // Minimal within the freedom of the goals: the gradient is in the span of the goals' gradients.
  ReachProblem q = p;
  Shooting shooting(base, q);
  const ShootingIterate iterate = shooting.shoot(excursion.position, excursion.rate);
  // By finite differences over positions, with the corresponding rates.
  Eigen::VectorXd gradient(6);
  for (int j = 0; j < 6; ++j) {
    const auto value = [&](double h) {
      std::vector<double> x = excursion.position;
      x[j] += h;
      const ShootingIterate near = shooting.shoot(x, iterate.rate);
      return p.objective.value(base, p.goals, near.position, near.rate, nullptr);
    };
    gradient[j] = (value(1e-4) - value(-1e-4)) / 2e-4;
  }
  const Eigen::MatrixXd Jt = iterate.J.transpose();
  const Eigen::VectorXd multipliers = Jt.completeOrthogonalDecomposition().solve(gradient);
  EXPECT_LT((gradient - Jt * multipliers).norm(), 1e-5 * gradient.norm());  // measured 2e-8
}

TEST(ThesisPlan, SameSeedSameBits) {
  const Servicer s = thesis_servicer();
  FloatingBase base(s.model, true), other(s.model, true);
  ReachProblem p = thesis_problem(s, RateDemand::twist);
  p.guess = p.start.position;
  set_measure(p, Objective::Kind::excursion);
  const ReachSolution a = plan_reach(base, p), b = plan_reach(other, p);
  expect_arrives(a);
  EXPECT_EQ(a.position, b.position);
  EXPECT_EQ(a.rate, b.rate);
}

TEST(ThesisPlan, StaysWithinLimits) {
  const Servicer s = thesis_servicer();
  FloatingBase base(s.model, true);
  ReachProblem p = thesis_problem(s, RateDemand::twist);
  const ReachSolution without = plan_reach(base, p);
  // A limit that excludes the previous solution.
  p.upper[1] = without.position[1] - 0.05;
  for (Objective::Kind kind : {Objective::Kind::as_found, Objective::Kind::excursion}) {
    set_measure(p, kind);
    const ReachSolution within = plan_reach(base, p);
    expect_arrives(within);
    EXPECT_LE(within.position[1], p.upper[1]);
  }
}

TEST(ThesisPlan, ReportsAnArmThatIsTooShort) {
  SKIP_UNDER_SANITIZERS();
  const Servicer s = thesis_servicer();
  FloatingBase base(s.model, true);
  ReachProblem p = thesis_problem(s, RateDemand::twist);
  p.goals[0].X_WG.p = {5.2, -2, 0};
  p.starts = 4;
  const ReachSolution r = plan_reach(base, p);
  EXPECT_FALSE(r.found);
  EXPECT_NE(r.failure.find("end-effector 'tip-1' comes no closer than"), std::string::npos) << r.failure;
  EXPECT_NE(r.failure.find("the arm is at most 3 m long"), std::string::npos) << r.failure;
  EXPECT_EQ(r.failure.find("tip-2"), std::string::npos) << r.failure;
  EXPECT_GT(r.miss[0].distance, 1.5);
  EXPECT_LT(r.miss[0].distance, 2.6);
}

TEST(ThesisPlan, NamesTheActiveLimit) {
  const Servicer s = thesis_servicer();
  FloatingBase base(s.model, true);
  ReachProblem p = thesis_problem(s, RateDemand::twist);
  p.lower[3] = 2.3, p.upper[3] = 2.6, p.lower[4] = 1.4, p.upper[4] = 1.7, p.lower[5] = -1.2, p.upper[5] = -0.9;
  p.starts = 4;
  const ReachSolution r = plan_reach(base, p);
  EXPECT_FALSE(r.found);
  EXPECT_NE(r.failure.find("end-effector 'tip-2' comes no closer than"), std::string::npos) << r.failure;
  EXPECT_NE(r.failure.find("joint 'arm-2-joint-"), std::string::npos) << r.failure;
  EXPECT_NE(r.failure.find(" limit "), std::string::npos) << r.failure;
}

TEST(ThesisPlan, ReportsTheSingularDirection) {
  const Servicer s = thesis_servicer();
  FloatingBase base(s.model, true);
  ReachProblem p = thesis_problem(s, RateDemand::velocity);
  p.goals[1].X_WG.p[2] = 0.02;  // out of the arm's plane
  p.starts = 3;
  const ReachSolution r = plan_reach(base, p);
  EXPECT_FALSE(r.found);
  EXPECT_NEAR(r.miss[1].distance, 0.02, 1e-6);
  EXPECT_NE(r.failure.find("end-effector 'tip-2' comes no closer than 0.02 m: no joint moves it closer"),
            std::string::npos)
      << r.failure;
}

// An end-effector goal 0.02 m outside its arm's plane: no solution, but the closest attempt is accepted by a goal with
// this tolerance.
TEST(ThesisPlan, UsesTheAcceptedErrorsOfAGoal) {
  const Servicer s = thesis_servicer();
  FloatingBase base(s.model, true);
  ReachProblem p = thesis_problem(s, RateDemand::velocity);
  p.goals[1].X_WG.p[2] = 0.02;
  p.starts = 1;
  p.goals[1].accepted_distance = 0.0199;
  EXPECT_FALSE(plan_reach(base, p).found);
  p.goals[0].accepted_distance = p.goals[1].accepted_distance = 0.2;
  const ReachSolution r = plan_reach(base, p);
  EXPECT_TRUE(r.found);
  EXPECT_TRUE(r.approximate);
  EXPECT_LE(r.miss[1].distance, 0.2);
  EXPECT_GE(r.miss[1].distance, 0.02);
}

// Goals from a simulated motion, so that a solution exists; the search starts at a perturbed or random configuration.
TEST(RandomPlan, ReachesGoalsOfASimulation) {
  Worst worst("position error of planned random robots [m]");
  int solved = 0, tried = 0;
  for (int i = 0; i < 30; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Servicer s = random_servicer(i);
    Random random(500 + i);
    FloatingBase base(s.model, true);
    ReachProblem p = reach_problem(s, 3, i % 2 ? JointProfile::quintic : JointProfile::cycloidal,
                                   i % 3 ? Vector3d{0, 0, 0} : random.vector(0.1));
    std::vector<double> position = p.start.position, rate(position.size());
    for (double& x : position) x += random.uniform(-0.7, 0.7);
    for (double& x : rate) x = random.uniform(-0.2, 0.2);
    PathSegment segment(base, p.start, p.motion);
    const SegmentEnd end = segment.integrate(position, rate, false);
    base.place(position);
    const Momentumd h_B = p.motion.in_base(p.start.end, end.X_WB);
    base.move(rate, h_B);
    const int frame = static_cast<int>(s.model.frames().size()) - 1;
    Goal g;
    g.frame = frame, g.name = "e";
    g.X_WG = end.X_WB * base.frame_pose(frame);
    g.orientation = i % 3 == 0   ? Goal::Orientation::free
                    : i % 3 == 1 ? Goal::Orientation::axis
                                 : Goal::Orientation::pose;
    g.axis_E = random.direction();
    g.direction_W = g.X_WG.R * g.axis_E;
    p.goals = {g};
    p.demand = RateDemand::given;
    p.given_rates = rate;
    ++tried;
    const ReachSolution r = plan_reach(base, p);
    if (!r.found) continue;
    ++solved;
    const SegmentEnd check = segment.integrate(r.position, r.rate, false);
    base.place(r.position);
    const Posed X_WE = check.X_WB * base.frame_pose(frame);
    EXPECT_LT(worst.note(norm(X_WE.p - g.X_WG.p), i), 1e-9);
    if (g.orientation == Goal::Orientation::pose) {
      EXPECT_LT(rotation_angle(transpose(X_WE.R) * g.X_WG.R), 1e-9);
    }
    if (g.orientation == Goal::Orientation::axis) {
      EXPECT_LT(norm(X_WE.R * g.axis_E - g.direction_W), 1e-9);
    }
  }
  std::printf("[ measured ] %d of %d random robots planned\n", solved, tried);
  EXPECT_GE(solved, 27);  // a solution exists; a search may miss it
}

TEST(Plan, RejectsWrongSizes) {
  const Servicer s = thesis_servicer();
  FloatingBase base(s.model, true);
  ReachProblem p = thesis_problem(s, RateDemand::twist);
  p.guess.pop_back();
  EXPECT_THROW(plan_reach(base, p), std::invalid_argument);
}

}  // namespace reach_test
}  // namespace grapnel::testing
