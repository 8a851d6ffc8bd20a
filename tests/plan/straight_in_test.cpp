/// Final straight approach by resolved rates: arrival, demanded speed, and straightness in the tumbling frame.

#include <gtest/gtest.h>

#include "grapnel/integrate/gauss_legendre.hpp"
#include "grapnel/plan/constrained_straight_in.hpp"
#include "grapnel/simulate/simulate_phase.hpp"
#include "plan/straight_in_case.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace straight_in_test {

// Results of a simulation of the joint motion with a free target.
struct Simulated {
  double line = 0;                           // maximum distance of the end-effector from the line [m]
  double distance = 1, speed = 0, spin = 0;  // of the end-effector from its grasp point, and relative to it, at the end
  double momentum = 0, drift = 0;            // of the servicer about its centre of mass, and its change
  std::vector<double> lowest, highest, fastest, strongest;  // per joint
  std::vector<double> fast_ends, strong_ends;               // at the begin and the end, without self-motion
};

// Index of the arm's joint among all joints of a model.
std::size_t joint_index(const Model& model, int joint) {
  const int body = model.body_index("l" + std::to_string(joint));
  return static_cast<std::size_t>(std::find(model.joints().begin(), model.joints().end(), body) -
                                  model.joints().begin());
}

Simulated simulated(const Servicer& s, FloatingBase& base, const StraightInProblem& p, const StraightInPath& path) {
  BodyDescription target;
  target.name = target.joint.name = "target";
  target.joint.type = JointType::free;
  target.mass = 30, target.com = p.targets[0].com, target.inertia = p.targets[0].inertia;
  const Model both = ModelBuilder(s.model).add(target).build();
  State state = zero_state(both);
  const int t = both.body_index("target");
  set_root_pose(both, t, p.targets[0].X_WT, state);
  set_root_twist(both, t, p.targets[0].V_WT, state);
  PhaseSetup setup;
  for (int j = 0; j < 7; ++j) {
    const Body& body = both.bodies()[both.body_index("l" + std::to_string(j))];
    state.q[body.q] = p.position[j], state.v[body.v] = path.rate_begin[j];
    JointDrive drive;
    drive.control = JointControl::prescribed;
    drive.trajectory = path.joints[j];
    setup.drives.push_back(drive);
  }
  base.place(p.position);
  const Momentumd h_B = p.motion.in_base(p.begin, p.X_WB);
  base.move(path.rate_begin, h_B);
  set_root_pose(both, 0, p.X_WB, state);
  set_root_twist(both, 0, p.X_WB.R * twist_from(base.base_twist()), state);
  PhaseDynamics dynamics(both, setup);
  const StraightGoal& goal = p.goals[0];
  Simulated f;
  f.lowest.assign(7, kNone), f.highest.assign(7, -kNone), f.fastest.assign(7, 0);
  f.strongest = f.fast_ends = f.strong_ends = f.fastest;
  f.momentum = norm(p.motion.h.angular);
  const auto observe = [&](const PhaseSample& sample) {
    const Kinematics k = forward_kinematics(both, sample.state);
    const Posed X_WE = frame_pose(both, k, both.frame_index("hand"));
    const Posed X_WT = k.X_WB[t];
    const Vector3d off = inverse(X_WT) * X_WE.p - goal.X_TG.p;
    const double along = dot(off, goal.direction_T);
    f.line = std::max(f.line, norm(off - along * goal.direction_T));
    const Twistd V_E = frame_twist(both, k, both.frame_index("hand"));
    const Twistd V_T = shift(k.V_WB[t], X_WE.p - X_WT.p);
    f.distance = norm(off);
    f.speed = dot(transposed_times(X_WT.R, V_E.linear - V_T.linear), goal.direction_T);
    f.spin = norm(V_E.angular - V_T.angular);
    State servicer = zero_state(s.model);
    set_root_pose(s.model, 0, root_pose(both, sample.state, 0), servicer);
    set_root_twist(s.model, 0, root_twist(both, sample.state, 0), servicer);
    for (int j = 0; j < 7; ++j) {
      const Body& body = both.bodies()[both.body_index("l" + std::to_string(j))];
      const Body& own = s.model.bodies()[s.model.body_index("l" + std::to_string(j))];
      servicer.q[own.q] = sample.state.q[body.q], servicer.v[own.v] = sample.state.v[body.v];
      f.lowest[j] = std::min(f.lowest[j], sample.state.q[body.q]);
      f.highest[j] = std::max(f.highest[j], sample.state.q[body.q]);
      const double rate = std::abs(sample.state.v[body.v]), effort = std::abs(sample.motor[joint_index(both, j)]);
      f.fastest[j] = std::max(f.fastest[j], rate), f.strongest[j] = std::max(f.strongest[j], effort);
      if (sample.time != p.begin && sample.time != p.end) continue;
      f.fast_ends[j] = std::max(f.fast_ends[j], rate), f.strong_ends[j] = std::max(f.strong_ends[j], effort);
    }
    const FreeMotion now = free_motion(s.model, servicer, sample.time, {0, 0, 0});
    f.drift = std::max(f.drift, norm(now.h.angular - p.motion.h.angular) + norm(now.h.linear - p.motion.h.linear));
  };
  EXPECT_TRUE(simulate_phase(dynamics, {state, p.begin, p.end, 0.02}, {}, {.observe = observe}).finished);
  return f;
}

constexpr Goal::Orientation kOrientations[] = {Goal::Orientation::free, Goal::Orientation::axis,
                                               Goal::Orientation::pose};

TEST(StraightIn, ArrivesOnTheLineAtTheDemandedSpeed) {
  Worst arrival("arrival of a straight-in motion, simulated [m]"),
      line("distance from the line during the approach [m]");
  for (Goal::Orientation orientation : kOrientations) {
    Servicer s = seven_joints();
    FloatingBase base(s.model, true);
    const StraightInProblem p = problem_for(s, base, orientation);
    const StraightInPath path = plan_straight_in(base, p);
    ASSERT_TRUE(path.finished) << path.failure;
    EXPECT_FALSE(path.damped);
    EXPECT_LT(path.fit_error, 1e-11);
    EXPECT_LT(path.unmet, 1e-12);
    const Simulated f = simulated(s, base, p, path);
    EXPECT_LT(line.note(f.line, static_cast<int>(orientation)), 1e-9);
    EXPECT_LT(arrival.note(f.distance, static_cast<int>(orientation)), 1e-9);
    EXPECT_NEAR(f.speed, 0.02, 1e-9);
    if (orientation == Goal::Orientation::pose) {
      EXPECT_LT(f.spin, 1e-9);
    } else {
      EXPECT_GT(f.spin, 1e-6);
    }
  }
}

TEST(StraightIn, DampsAndReportsASingularity) {
  Servicer s = seven_joints();
  for (int j = 0; j < 7; ++j)
    s.state.q[s.model.bodies()[s.model.joints()[j]].q] = j == 3 ? 0.06 : 0.01 * j;  // nearly fully extended
  FloatingBase base(s.model, true);
  StraightInProblem p = problem_for(s, base, Goal::Orientation::free);
  base.place(p.position);
  // Along the extended arm, beyond its reach.
  p.goals[0].direction_T = transposed_times(p.targets[0].X_WT.R, (p.X_WB * base.frame_pose(0)).R * Vector3d{1, 0, 0});
  p.goals[0].X_TG.p =
      inverse(p.targets[0].X_WT) * (p.X_WB * base.frame_pose(0)).p + p.stand_off * p.goals[0].direction_T;
  const StraightInPath path = plan_straight_in(base, p);
  ASSERT_TRUE(path.finished) << path.failure;
  EXPECT_TRUE(path.damped);
  EXPECT_GT(path.unmet, 1e-3);
  EXPECT_GE(path.damped_end, path.damped_begin);
  for (const JointTrajectory& j : path.joints) EXPECT_LT(std::abs(evaluate(j, 7.9).rate), 20);
}

// --- Limits enforced by self-motion

TEST(SelfMotion, TermsAreOrthonormalAndVanishTwiceAtTheEnds) {
  constexpr int kCount = 12;
  const GaussLegendre rule(20);  // exact to degree 39
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(kCount, kCount);
  for (int i = 0; i < rule.stages(); ++i) {
    Eigen::VectorXd phi(kCount);
    self_motion_basis(rule.node(i), {phi.data(), kCount});
    gram += rule.weight(i) * phi * phi.transpose();
  }
  EXPECT_LT((gram - Eigen::MatrixXd::Identity(kCount, kCount)).lpNorm<Eigen::Infinity>(), 1e-12);
  for (const double end : {0.0, 1.0}) {
    Eigen::VectorXd at(kCount), near(kCount);
    self_motion_basis(end, {at.data(), kCount}), self_motion_basis(std::abs(end - 1e-6), {near.data(), kCount});
    EXPECT_EQ(at.lpNorm<Eigen::Infinity>(), 0);
    EXPECT_LT(near.lpNorm<Eigen::Infinity>(), 1e-7);
  }
}

// The joint with the largest displacement from its initial value, its direction and the displacement.
std::pair<int, double> farthest(const StraightInProblem& p, const Simulated& f) {
  std::pair<int, double> result{0, 0};
  for (int j = 0; j < 7; ++j) {
    const double up = f.highest[j] - p.position[j], down = f.lowest[j] - p.position[j];
    const double excursion = up > -down ? up : down;
    if (std::abs(excursion) > std::abs(result.second)) result = {j, excursion};
  }
  return result;
}

TEST(ConstrainedStraightInCase, SelfMotionEnforcesPositionLimits) {
  Worst line("distance from the line, of joints that keep their limits [m]"),
      drift("drift of momentum during the approach");
  for (Goal::Orientation orientation : kOrientations) {
    Servicer s = seven_joints();
    FloatingBase base(s.model, true);
    StraightInProblem p = problem_for(s, base, orientation);
    const StraightInPath simple = plan_straight_in(base, p);
    const auto [joint, excursion] = farthest(p, simulated(s, base, p, simple));
    ReachProblem reach = without_limits(s, p);
    // Inactive limits: the minimum-norm rates, bit for bit.
    const ConstrainedStraightIn free = constrain_straight_in(base, p, reach);
    EXPECT_TRUE(free.feasible);
    EXPECT_TRUE(free.self_motion.coefficients.empty());
    EXPECT_EQ(free.path.rate_end, simple.rate_end);

    const double limit = p.position[joint] + 0.7 * excursion;
    (excursion > 0 ? reach.upper : reach.lower)[joint] = limit;
    const ConstrainedStraightIn end = constrain_straight_in(base, p, reach);
    ASSERT_TRUE(end.feasible) << end.failure;
    EXPECT_EQ(end.self_motions, orientation == Goal::Orientation::free   ? 4
                                : orientation == Goal::Orientation::axis ? 2
                                                                         : 1);
    std::printf("[ measured ] orientation %d: joint %d, %.3g rad instead of %.3g, %ld evaluations\n",
                static_cast<int>(orientation), joint, 0.7 * excursion, excursion, end.rhs_evaluations);
    p.self_motion = end.self_motion;
    const Simulated f = simulated(s, base, p, end.path);
    if (excursion > 0) {
      EXPECT_LT(f.highest[joint], limit + 1e-6);
      EXPECT_GT(f.highest[joint], limit - 1e-3);
    } else {
      EXPECT_GT(f.lowest[joint], limit - 1e-6);
      EXPECT_LT(f.lowest[joint], limit + 1e-3);
    }
    EXPECT_LT(line.note(f.line, static_cast<int>(orientation)), 1e-9);
    EXPECT_LT(f.distance, 1e-9);
    EXPECT_NEAR(f.speed, 0.02, 1e-9);
    EXPECT_EQ(f.spin < 1e-9, orientation == Goal::Orientation::pose);
    EXPECT_GT(f.momentum, 1);
    EXPECT_LT(drift.note(f.drift / f.momentum, static_cast<int>(orientation)), 1e-11);
    EXPECT_EQ(end.path.rate_begin, simple.rate_begin);
  }
}

// The joint with the largest ratio of its maximum to its end values; the end values are those of minimum norm.
int busiest(const std::vector<double>& peak, const std::vector<double>& at_ends) {
  int joint = 0;
  for (int j = 0; j < 7; ++j) {
    if (peak[j] - at_ends[j] > peak[joint] - at_ends[joint]) joint = j;
  }
  return joint;
}

TEST(ConstrainedStraightInCase, SelfMotionEnforcesRateAndEffortLimits) {
  int rates = 0;
  for (Goal::Orientation orientation : kOrientations) {
    SCOPED_TRACE(static_cast<int>(orientation));
    Servicer s = seven_joints();
    FloatingBase base(s.model, true);
    StraightInProblem p = problem_for(s, base, orientation);
    ReachProblem reach = without_limits(s, p);
    const ConstrainedStraightIn simple = constrain_straight_in(base, p, reach);
    const Simulated before = simulated(s, base, p, simple.path);
    int joint = busiest(before.fastest, before.fast_ends);
    if (before.fastest[joint] > 1.02 * before.fast_ends[joint]) {
      const double rate = 0.5 * (before.fastest[joint] + before.fast_ends[joint]);
      reach.rate_limit[joint] = rate;
      const ConstrainedStraightIn slower = constrain_straight_in(base, p, reach);
      ASSERT_TRUE(slower.feasible) << slower.failure;
      const Simulated slow = simulated(s, base, p, slower.path);
      std::printf("[ measured ] joint %d %.4g instead of %.4g rad/s\n", joint, slow.fastest[joint],
                  before.fastest[joint]);
      EXPECT_LT(slow.fastest[joint], rate * (1 + 1e-6));
      EXPECT_LT(slow.distance, 1e-9);
      EXPECT_LT(slow.line, 1e-9);
      ++rates;
    }

    joint = busiest(before.strongest, before.strong_ends);
    const double effort = 0.5 * (before.strongest[joint] + before.strong_ends[joint]);
    reach.rate_limit.assign(7, kNone);
    reach.constraints.effort_limit[joint] = effort;
    const ConstrainedStraightIn weaker = constrain_straight_in(base, p, reach);
    ASSERT_TRUE(weaker.feasible) << weaker.failure;
    const Simulated weak = simulated(s, base, p, weaker.path);
    std::printf("[ measured ] joint %d %.4g instead of %.4g N m, %.4g at the ends\n", joint, weak.strongest[joint],
                before.strongest[joint], before.strong_ends[joint]);
    EXPECT_LT(weak.strongest[joint], effort * (1 + 1e-6));
    EXPECT_NEAR(weak.strongest[joint], effort * *weaker.figures.effort_share, 1e-3 * effort);
    EXPECT_LT(weak.distance, 1e-9);
    EXPECT_LT(weak.line, 1e-9);
  }
  EXPECT_GE(rates, 1);
}

// A limit on the base rotation; violations that self-motion cannot remove are reported with joint, side and time.
TEST(ConstrainedStraightInCase, BaseRotationIsLimitedAndViolationsAreReported) {
  Servicer s = seven_joints();
  FloatingBase base(s.model, true);
  StraightInProblem p = problem_for(s, base, Goal::Orientation::free);
  ReachProblem reach = without_limits(s, p);
  reach.constraints.R_WB0 = p.X_WB.R;
  const double turn = constrain_straight_in(base, p, reach).figures.base_turn;
  reach.constraints.base_turn = 0.97 * turn;
  const ConstrainedStraightIn less = constrain_straight_in(base, p, reach);
  ASSERT_TRUE(less.feasible) << less.failure;
  std::printf("[ measured ] %.5g rad instead of %.5g, self-motion of %zu numbers\n", less.figures.base_turn, turn,
              less.self_motion.coefficients.size());
  EXPECT_LT(less.figures.base_turn, reach.constraints.base_turn + 1e-6);
  EXPECT_LT(simulated(s, base, p, less.path).line, 1e-9);

  reach.constraints.base_turn = kNone;
  reach.upper[4] = p.position[4] - 0.01;  // exceeded at the start of the approach
  const ConstrainedStraightIn none = constrain_straight_in(base, p, reach);
  EXPECT_FALSE(none.feasible);
  EXPECT_NE(none.failure.find("joint 'j4' moves 0.01"), std::string::npos) << none.failure;
  EXPECT_NE(none.failure.find("beyond its upper limit of -0.51 at t = "), std::string::npos) << none.failure;
  EXPECT_GE(none.violation, 0.01 - 1e-9);
}

}  // namespace straight_in_test
}  // namespace grapnel::testing
