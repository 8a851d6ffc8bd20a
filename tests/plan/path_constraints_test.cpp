/// Paths of segments: splines, sensitivities at the nodes, efforts, and path constraints.

#include "grapnel/plan/path_constraints.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "grapnel/dynamics/free_floating.hpp"
#include "grapnel/plan/constrained_segment.hpp"
#include "grapnel/plan/joint_efforts.hpp"
#include "grapnel/plan/shooting.hpp"
#include "grapnel/simulate/simulate_phase.hpp"
#include "plan/plan_case.hpp"
#include "plan/tilted_arms.hpp"
#include "support/sanitizers.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace path_constraints_test {

constexpr int kKnots = 3;

TEST(JointSpline, IsSmoothAndAtRestAtItsEnds) {
  for (const int knots : {1, 2, 3, 7, 30}) {
    const JointSpline spline(knots);
    std::vector<JointPoint> at(knots), up(knots), down(knots);
    for (const double x : {0.0, 1.0}) {
      spline.evaluate(x, at);
      for (const JointPoint& N : at) {
        EXPECT_NEAR(N.position, 0, 1e-15);
        EXPECT_NEAR(N.rate, 0, 1e-13);
        EXPECT_NEAR(N.acceleration, 0, 1e-11);
      }
    }
    double largest = 0;
    const double h = 1e-5;
    for (double x = 0.01; x < 0.99; x += 0.0137) {
      spline.evaluate(x, at), spline.evaluate(x + h, up), spline.evaluate(x - h, down);
      for (int k = 0; k < knots; ++k) {
        largest = std::max(largest, at[k].position);
        EXPECT_GE(at[k].position, -1e-16);
        const double scale = std::pow(knots + 1, 3);
        EXPECT_NEAR((up[k].position - down[k].position) / (2 * h), at[k].rate, 1e-8 * scale);
        EXPECT_NEAR((up[k].rate - down[k].rate) / (2 * h), at[k].acceleration, 1e-7 * scale);
      }
    }
    EXPECT_GT(largest, 0.3);
  }
}

struct SegmentCase {
  Servicer servicer;
  SegmentStart start;
  std::vector<double> position, rate, coefficients;
};

SegmentCase random_case(int i) {
  constexpr JointProfile kProfiles[] = {JointProfile::quintic, JointProfile::cycloidal};
  SegmentCase f{random_servicer(i, i % 4 != 3), {}, {}, {}, {}};
  Random random(2000 + i);
  f.start = {1.0, 4.0, kProfiles[i % 2], f.servicer.theta(), f.servicer.rates(), f.servicer.X_WB(), kKnots};
  for (double x : f.start.position) {
    f.position.push_back(x + random.uniform(-1, 1));
    f.rate.push_back(random.uniform(-0.4, 0.4));
  }
  for (std::size_t k = 0; k < kKnots * f.position.size(); ++k) f.coefficients.push_back(random.uniform(-1, 1));
  return f;
}

FreeMotion motion_of(const SegmentCase& f) {
  return free_motion(f.servicer.model, f.servicer.state, f.start.begin, {0, 0, 0});
}

TEST(PathSegment, WithASplineAgreesWithForwardDynamics) {
  Worst worst("end of a segment with splines against the simulation");
  for (int i = 0; i < 12; ++i) {
    SCOPED_TRACE(seed_note(i));
    const SegmentCase f = random_case(i);
    if (i % 4 == 3) continue;
    FloatingBase base(f.servicer.model, true);
    PathSegment segment(base, f.start, motion_of(f));
    const SegmentEnd end = segment.integrate(f.position, f.rate, false, SegmentAccuracy::full, f.coefficients);
    ASSERT_TRUE(end.finished) << end.failure;
    PhaseSetup setup;
    for (std::size_t j = 0; j < f.position.size(); ++j) {
      JointDrive drive;
      drive.control = JointControl::prescribed;
      drive.trajectory.segments = segment.joint_segments(static_cast<int>(j), f.position[j], f.rate[j], f.coefficients);
      EXPECT_NO_THROW(validate(drive.trajectory));
      setup.drives.push_back(drive);
    }
    setup.recover_roots = false;
    PhaseDynamics dynamics(f.servicer.model, setup);
    const PhaseOutcome outcome = simulate_phase(dynamics, {f.servicer.state, f.start.begin, f.start.end});
    ASSERT_TRUE(outcome.finished) << outcome.failure;
    const Posed expected = root_pose(f.servicer.model, outcome.end_state, 0);
    EXPECT_LT(worst.note(norm(end.X_WB.p - expected.p), i), 1e-9);
    EXPECT_LT(worst.note(rotation_angle(transpose(end.X_WB.R) * expected.R), i), 1e-9);
  }
}

// At the end and at the nodes, with respect to all unknowns.
TEST(PathSegment, NodeSensitivitiesAgreeWithFiniteDifferences) {
  Worst at_end("at the end"), turn("turn of the base at nodes"), spin("its angular velocity at nodes");
  for (int i = 0; i < 8; ++i) {
    SCOPED_TRACE(seed_note(i));
    const SegmentCase f = random_case(i);
    const bool floats = i % 4 != 3;
    FloatingBase base(f.servicer.model, floats);
    PathSegment segment(base, f.start, motion_of(f));
    segment.solve_with_path_constraints(8);
    const int n = base.joints(), unknowns = n * (2 + kKnots);
    std::vector<double> x = f.position;
    x.insert(x.end(), f.rate.begin(), f.rate.end());
    x.insert(x.end(), f.coefficients.begin(), f.coefficients.end());
    const auto integrate = [&](const std::vector<double>& y) {
      const std::span<const double> all(y);
      return segment.integrate(all.first(n), all.subspan(n, n), true, SegmentAccuracy::full, all.subspan(2 * n));
    };
    const SegmentEnd end = integrate(x);
    ASSERT_TRUE(end.finished);
    const std::vector<int> nodes = {5, 40, segment.path_points() - 3};
    std::vector<Eigen::Matrix3Xd> turns, spins;
    std::vector<PathSegment::SegmentPoint> points;
    for (int node : nodes) {
      turns.push_back(segment.turn_per_unknown(node));
      spins.push_back(segment.w_per_unknown(node));
      points.push_back(segment.path_point(node));
    }
    Matrix6Xd all(6, unknowns);
    all << end.per_position, end.per_rate, end.per_coefficient;
    const double h = 1e-4;
    for (int u = 0; u < unknowns; ++u) {
      std::vector<double> up = x, down = x;
      up[u] += h, down[u] -= h;
      const Posed X1 = integrate(up).X_WB;
      std::vector<PathSegment::SegmentPoint> above, below;
      for (int node : nodes) above.push_back(segment.path_point(node));
      const Posed X0 = integrate(down).X_WB;
      for (int node : nodes) below.push_back(segment.path_point(node));
      const Vector3d w = rotation_vector(transpose(X0.R) * X1.R), p = transposed_times(end.X_WB.R, X1.p - X0.p);
      const Vector6d d = (Vector6d() << w[0], w[1], w[2], p[0], p[1], p[2]).finished() / (2 * h);
      EXPECT_LT(at_end.note((d - all.col(u)).norm(), i), 1e-6);
      for (std::size_t k = 0; k < nodes.size(); ++k) {
        ASSERT_EQ(above[k].time, points[k].time);
        const Vector3d eta = rotation_vector(above[k].X_WB.R * transpose(below[k].X_WB.R));
        EXPECT_LT(turn.note((column(eta) / (2 * h) - turns[k].col(u)).norm(), i), 1e-6);
        EXPECT_LT(spin.note((column(above[k].w_B - below[k].w_B) / (2 * h) - spins[k].col(u)).norm(), i), 1e-5);
      }
    }
  }
}

// For robots whose rotors have no stated axes, with floating and fixed bases.
TEST(JointEfforts, DerivativesAgreeWithFiniteDifferences) {
  Worst worst("derivatives of a sum of efforts against differences, relative");
  constexpr double kStep = 1e-5;
  for (int i = 0; i < 30; i += 2) {
    SCOPED_TRACE(seed_note(i));
    const bool floats = i % 6 != 4;
    const Servicer s = random_servicer(i, floats);
    Random random(i);
    FloatingBase base(s.model, floats);
    JointEfforts efforts(base, random.vector(5));
    const Vector3d L = random.vector(3);
    std::vector<double> q = s.theta(), r = s.rates(), a = random.values(base.joints(), 1),
                        weights = random.values(base.joints(), 1), effort(q.size());
    Posed X = s.X_WB();
    const auto sum = [&] {
      efforts.evaluate(q, r, a, X, {transposed_times(X.R, L), Vector3d::zero()}, effort);
      double total = 0;
      for (std::size_t j = 0; j < effort.size(); ++j) total += weights[j] * effort[j];
      return total;
    };
    JointEfforts::Gradient gradient;
    efforts.differentiate(q, r, a, X, {transposed_times(X.R, L), Vector3d::zero()}, weights, gradient);
    double scale = 0;
    std::vector<double> apart;
    const auto compare = [&](double derivative, double& x) {
      const double original = x;
      x = original + kStep;
      const double up = sum();
      x = original - kStep;
      const double down = sum();
      x = original;
      apart.push_back(derivative - (up - down) / (2 * kStep));
      scale = std::max(scale, std::abs(derivative));
    };
    for (std::size_t j = 0; j < q.size(); ++j) {
      compare(gradient.position[j], q[j]), compare(gradient.rate[j], r[j]), compare(gradient.acceleration[j], a[j]);
    }
    for (int k = 0; floats && k < 3; ++k) {
      const Posed original = X;
      const auto turned = [&](double angle) {
        X.R = rotation_about(Vector3d::unit(k), angle) * original.R;
        return sum();
      };
      apart.push_back(gradient.turn[k] - (turned(kStep) - turned(-kStep)) / (2 * kStep));
      X = original;
    }
    for (double x : apart) EXPECT_LT(worst.note(std::abs(x) / scale, i), 1e-7);
  }
}

// Against (2.8); its mass matrix does not use the recursion.
TEST(JointEfforts, AgreeWithTheReducedEquation) {
  Worst worst("efforts against the reduced equation, relative");
  for (int i = 0; i < 30; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Servicer s = random_servicer(i);
    Random random(i);
    FloatingBase base(s.model, true);
    const Vector3d gravity = random.vector(5);
    const FreeMotion motion = free_motion(s.model, s.state, 0, gravity);
    const std::vector<double> acceleration = random.values(base.joints(), 1);
    std::vector<double> effort(acceleration.size());
    JointEfforts(base, gravity)
        .evaluate(s.theta(), s.rates(), acceleration, s.X_WB(), motion.in_base(0, s.X_WB()), effort);
    const ReducedEquation eq = reduced_equation(s.model, s.state, 0, {}, gravity);
    // Its joints are in the order of velocities.
    const std::vector<int> order = joint_velocities(s.model, 0);
    Eigen::VectorXd a(base.joints()), expected(base.joints());
    std::vector<int> place(base.joints());
    for (int j = 0; j < base.joints(); ++j) {
      const int v = s.model.bodies()[s.model.joints()[j]].v;
      place[j] = static_cast<int>(std::find(order.begin(), order.end(), v) - order.begin());
      a[place[j]] = acceleration[j];
    }
    expected = eq.I * a + eq.c - eq.tau;
    double scale = 1;
    for (double x : expected) scale = std::max(scale, std::abs(x));
    for (int j = 0; j < base.joints(); ++j) {
      EXPECT_LT(worst.note(std::abs(effort[j] - expected[place[j]]) / scale, i), 1e-10);
    }
  }
}

// --- Path constraints

// Maximum of a quantity along the path of a solution.
template <class Of>
double largest_on(const Model& model, const ReachProblem& p, const ReachSolution& r, Of&& of) {
  FloatingBase base(model, true);
  SegmentStart start = p.start;
  start.knots = r.knots;
  PathSegment segment(base, start, p.motion);
  segment.solve_with_path_constraints(60);
  EXPECT_TRUE(segment.integrate(r.position, r.rate, false, SegmentAccuracy::full, r.coefficients).finished);
  double largest = -kNone;
  for (int i = 0; i < segment.path_points(); ++i) largest = std::max(largest, of(segment.path_point(i)));
  return largest;
}

double fastest(const PathSegment::SegmentPoint& w) {
  double rate = 0;
  for (double x : w.rate) rate = std::max(rate, std::abs(x));
  return rate;
}

void expect_arrival(const Model& model, const ReachProblem& p, const ReachSolution& r) {
  FloatingBase base(model, true);
  SegmentStart start = p.start;
  start.knots = r.knots;
  PathSegment segment(base, start, p.motion);
  const SegmentEnd end = segment.integrate(r.position, r.rate, false, SegmentAccuracy::full, r.coefficients);
  base.place(r.position);
  Eigen::VectorXd error;
  Eigen::MatrixXd unused, unused_too;
  goal_error(base, end.X_WB, p.goals, error, unused, unused_too);
  EXPECT_LT(error.lpNorm<Eigen::Infinity>(), kArrived);
}

class PathLimits : public ::testing::TestWithParam<unsigned> {};
INSTANTIATE_TEST_SUITE_P(Seeds, PathLimits, ::testing::Values(1u, 2u, 3u));

TEST_P(PathLimits, RatesStayWithinTheirLimits) {
  if (GetParam() > 1) SKIP_UNDER_SANITIZERS();
  TiltedArms arms = tilted_arms(GetParam());
  FloatingBase base(arms.model, true);
  const ReachSolution free = plan_reach(base, arms.problem);
  ASSERT_TRUE(free.found) << free.failure;
  const double before = largest_on(arms.model, arms.problem, free, fastest);
  arms.problem.rate_limit.assign(base.joints(), 0.85 * before);
  arms.problem.constraints.limits = true;
  const ReachSolution constrained = plan_reach(base, arms.problem);
  ASSERT_TRUE(constrained.found) << constrained.failure;
  expect_arrival(arms.model, arms.problem, constrained);
  EXPECT_LE(largest_on(arms.model, arms.problem, constrained, fastest), 0.85 * before * (1 + 2e-6));
  EXPECT_LE(constrained.figures->rate_share, 1 + 1e-6);
  EXPECT_GE(constrained.figures->rate_share, 0.99);  // the limit is used fully
}

TEST_P(PathLimits, EffortsStayWithinTheirLimits) {
  if (GetParam() > 1) SKIP_UNDER_SANITIZERS();
  TiltedArms arms = tilted_arms(GetParam());
  FloatingBase base(arms.model, true);
  ReachProblem& p = arms.problem;
  p.constraints.limits = true;
  p.constraints.effort_limit.assign(base.joints(), 1.0);
  p.constraints.effort_limit[0] = 1e6;
  const ReachSolution free = plan_reach(base, p);
  JointEfforts efforts(base, {0, 0, 0});
  std::vector<double> effort(base.joints());
  const auto strongest = [&](const PathSegment::SegmentPoint& w) {
    efforts.evaluate(w.position, w.rate, w.acceleration, w.X_WB, p.motion.in_base(w.time, w.X_WB), effort);
    double result = 0;
    for (std::size_t j = 1; j < effort.size(); ++j) result = std::max(result, std::abs(effort[j]));
    return result;
  };
  p.constraints.limits = false;
  const ReachSolution simple = plan_reach(base, p);
  ASSERT_TRUE(simple.found);
  const double before = largest_on(arms.model, p, simple, strongest);
  p.constraints.limits = true;
  p.constraints.effort_limit.assign(base.joints(), 0.8 * before);
  const ReachSolution constrained = plan_reach(base, p);
  ASSERT_TRUE(constrained.found) << constrained.failure;
  expect_arrival(arms.model, p, constrained);
  EXPECT_LE(largest_on(arms.model, p, constrained, strongest), 0.8 * before * (1 + 1e-5));
  (void)free;
}

TEST_P(PathLimits, BaseRotationStaysWithinItsLimit) {
  if (GetParam() > 1) SKIP_UNDER_SANITIZERS();
  TiltedArms arms = tilted_arms(GetParam());
  FloatingBase base(arms.model, true);
  ReachProblem& p = arms.problem;
  const Rotationd R = p.start.X_WB.R;
  const auto turn = [&](const PathSegment::SegmentPoint& w) { return rotation_angle(transpose(R) * w.X_WB.R); };
  const ReachSolution free = plan_reach(base, p);
  ASSERT_TRUE(free.found);
  const double before = largest_on(arms.model, p, free, turn);
  p.constraints.R_WB0 = R;
  p.constraints.base_turn = 0.7 * before;
  const ReachSolution constrained = plan_reach(base, p);
  ASSERT_TRUE(constrained.found) << constrained.failure;
  expect_arrival(arms.model, p, constrained);
  EXPECT_LE(largest_on(arms.model, p, constrained, turn), p.constraints.base_turn + 2e-6);
  EXPECT_LE(constrained.figures->base_turn, p.constraints.base_turn + 1e-6);
}

// Each objective against its values for the other solutions; optimality: no small change improves it.
TEST(PathObjective, IsMinimized) {
  SKIP_UNDER_SANITIZERS();
  using Kind = Objective::Kind;
  TiltedArms arms = tilted_arms(4);
  FloatingBase base(arms.model, true);
  ReachProblem& p = arms.problem;
  p.constraints.R_WB0 = p.start.X_WB.R;
  const auto solve = [&](Kind kind, int knots) {
    p.objective = Objective(kind, p.start, p.guess, p.lower, p.upper);
    p.constraints.knots = knots;
    return plan_reach(base, p);
  };
  for (const Kind kind : {Kind::base_attitude, Kind::base_motion, Kind::effort}) {
    SCOPED_TRACE(static_cast<int>(kind));
    const ReachSolution one = solve(kind, 0), three = solve(kind, kind == Kind::effort ? 1 : 3);
    ASSERT_TRUE(one.found) << one.failure;
    ASSERT_TRUE(three.found) << three.failure;
    expect_arrival(arms.model, p, three);
    ASSERT_EQ(one.terms.size(), 1u);
    EXPECT_EQ(one.terms[0], one.objective);
    EXPECT_LT(three.objective, one.objective * (1 + 1e-6) + 1e-9);
    p.objective = Objective(Kind::excursion, p.start, p.guess, p.lower, p.upper);
    p.constraints.knots = 0;
    const ReachSolution min_excursion = plan_reach(base, p);
    // The same term of the plan with minimum excursion.
    p.objective = Objective(std::vector<Objective::Term>{{Kind::excursion, 1}, {kind, 1e-12}}, p.start, p.guess,
                            p.lower, p.upper);
    const ReachSolution measured = plan_reach(base, p);
    ASSERT_EQ(measured.terms.size(), 2u);
    EXPECT_NEAR(measured.terms[0], min_excursion.objective, 1e-6 * min_excursion.objective);
    EXPECT_LT(three.objective, 0.9 * measured.terms[1]);
  }
}

// --- Wheels that hold the base's attitude

// Shares and their integral against finite differences.
TEST(PlannedWheels, DerivativesAgreeWithFiniteDifferences) {
  Worst worst("shares of wheels against differences");
  TiltedArms arms = tilted_arms(2);
  FloatingBase base(arms.model, true);
  base.hold_attitude();
  ReachProblem& p = arms.problem;
  WheelMomentum wheels;
  wheels.wheels = {{"a", {0.3, -0.1, 0.2}, 0.1, 0.2}, {"b", {-0.2, 0.4, 0.1}, 0, -0.1}};
  wheels.H = {1, -2, 0.5}, wheels.begin = p.start.begin, wheels.rate = 0.1;
  p.constraints.wheels = wheels, p.constraints.wheel_share = 0.5;
  p.objective = Objective(Objective::Kind::wheel_momentum, p.start, p.guess, p.lower, p.upper);
  constexpr int kKnotsHere = 2;
  ConstrainedSegment segment(base, p, kKnotsHere, 2);
  Random random(77);
  std::vector<double> y = p.guess;
  for (double& x : y) x += random.uniform(-0.2, 0.2);
  for (int k = 0; k < kKnotsHere * base.joints(); ++k) y.push_back(random.uniform(-0.3, 0.3));
  ShootingIterate like;
  like.position = p.guess, like.rate.assign(p.guess.size(), 0.0);
  like.coefficients.assign(static_cast<std::size_t>(kKnotsHere * base.joints()), 0.0);
  ASSERT_TRUE(segment.shoot(y, like, SegmentAccuracy::full).valid);
  like = segment.iterate();
  like.K.resize(0, 0);
  const std::vector<ConstrainedSegment::Instant> instants = {{PathConstraintCheck::Kind::wheel, 0, 1, 3},
                                                             {PathConstraintCheck::Kind::wheel, 1, -1, 20}};
  std::vector<Eigen::VectorXd> gradients(instants.size());
  for (std::size_t i = 0; i < instants.size(); ++i) segment.value(instants[i], &gradients[i]);
  Eigen::VectorXd of_objective;
  segment.objective(&of_objective);
  constexpr double h = 1e-5;
  for (std::size_t u = 0; u < y.size(); ++u) {
    std::vector<double> above(instants.size() + 1), below(above.size());
    for (const double sign : {1.0, -1.0}) {
      std::vector<double> moved = y;
      moved[u] += sign * h;
      ASSERT_TRUE(segment.shoot(moved, like, SegmentAccuracy::full).valid);
      std::vector<double>& values = sign > 0 ? above : below;
      for (std::size_t i = 0; i < instants.size(); ++i) values[i] = segment.value(instants[i], nullptr);
      values.back() = segment.objective(nullptr);
    }
    for (std::size_t i = 0; i < above.size(); ++i) {
      const auto k = static_cast<Eigen::Index>(u);
      const double expected = (above[i] - below[i]) / (2 * h);
      const double got = i < instants.size() ? gradients[i][k] : of_objective[k];
      EXPECT_LT(worst.note(std::abs(got - expected), static_cast<int>(u)), 1e-6 * std::max(1.0, std::abs(expected)));
    }
  }
  EXPECT_GT(gradients[0].norm(), 1e-2);
}

}  // namespace path_constraints_test
}  // namespace grapnel::testing
