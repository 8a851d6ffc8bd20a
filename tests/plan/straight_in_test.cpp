/// Resolved-rate motion straight in: it arrives, at the speed asked for, on the line, in the tumbling frame.

#include <gtest/gtest.h>

#include "grapnel/plan/straight_in.hpp"
#include "grapnel/simulate/simulate_phase.hpp"
#include "plan/plan_case.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace straight_in_test {

// A base with an arm of seven joints, axes in turn about z and y.
Servicer seven_joints() {
  ModelBuilder builder;
  BodyDescription base;
  base.name = base.joint.name = "base";
  base.joint.type = JointType::free;
  base.mass = 800;
  base.inertia = Symmetric3d::diagonal(500, 600, 550);
  builder.add(base);
  for (int i = 0; i < 7; ++i) {
    BodyDescription b;
    b.name = "l" + std::to_string(i), b.joint.name = "j" + std::to_string(i);
    b.parent = i == 0 ? "base" : "l" + std::to_string(i - 1);
    b.joint.type = JointType::revolute;
    b.joint.axis = i % 2 == 0 ? Vector3d{0, 0, 1} : Vector3d{0, 1, 0};
    b.X_PF.p = {i == 0 ? 1.0 : 0.5, 0, 0};
    b.mass = 12;
    b.com = {0.25, 0.01, 0};
    b.inertia = Symmetric3d::diagonal(0.05, 0.3, 0.3);
    builder.add(b);
  }
  builder.add(FrameDescription{"hand", "l6", {Rotationd::identity(), {0.4, 0, 0}}});
  Servicer s{builder.build(), {}};
  s.state = zero_state(s.model);
  const double theta[] = {0.3, -0.7, 0.4, 1.1, -0.5, 0.6, 0.2};
  for (int j = 0; j < 7; ++j) s.state.q[s.model.bodies()[s.model.joints()[j]].q] = theta[j];
  set_root_twist(s.model, 0, {{0.004, -0.003, 0.005}, {0.01, 0.002, -0.004}}, s.state);
  return s;
}

StraightInProblem problem_for(const Servicer& s, FloatingBase& base, Goal::Orientation orientation) {
  StraightInProblem p;
  p.begin = 3, p.end = 8;
  p.position = s.theta();
  p.X_WB = s.X_WB();
  p.motion = free_motion(s.model, s.state, 3, {0, 0, 0});
  p.stand_off = 0.3, p.final_speed = 0.02;
  base.place(p.position);
  const Posed X_WE = p.X_WB * base.frame_pose(0);
  // A tumbling target whose stand-off point is where the hand is.
  FreeBody body;
  body.com = {0.1, -0.05, 0.02};
  body.inertia = {20, 30, 35, 1, -2, 0.5};
  StraightGoal goal;
  goal.name = "hand";
  goal.direction_T = {0.6, 0, 0.8};
  goal.X_TG.p = {-0.5, 0.2, 0.1};
  goal.orientation = orientation;
  const Rotationd R_WT = rotation_about({0.36, 0.48, 0.8}, 0.7);
  const Vector3d p_T = goal.X_TG.p - p.stand_off * goal.direction_T;
  body.X_WT = {R_WT, X_WE.p - R_WT * p_T};
  body.V_WT = {{0.03, -0.04, 0.05}, {-0.01, 0.005, 0.008}};
  goal.X_TG.R = transpose(R_WT) * X_WE.R;
  goal.axis_E = transposed_times(X_WE.R, R_WT * goal.direction_T);
  p.targets = {body};
  p.goals = {goal};
  return p;
}

TEST(StraightIn, ArrivesOnTheLineAtTheSpeedAskedFor) {
  Worst arrival("arrival of a straight-in motion, simulated [m]"), line("distance from the line on the way [m]");
  for (Goal::Orientation orientation : {Goal::Orientation::free, Goal::Orientation::axis, Goal::Orientation::pose}) {
    Servicer s = seven_joints();
    FloatingBase base(s.model, true);
    const StraightInProblem p = problem_for(s, base, orientation);
    const StraightInPath path = plan_straight_in(base, p);
    ASSERT_TRUE(path.finished) << path.failure;
    EXPECT_FALSE(path.damped);
    EXPECT_LT(path.fit_error, 1e-11);
    EXPECT_LT(path.unmet, 1e-12);

    // Flown by a simulation that knows the joint motion only, the target free beside it.
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
    const Momentumd h_B = p.motion.in_base(3, p.X_WB);
    base.move(path.rate_begin, h_B);
    set_root_pose(both, 0, p.X_WB, state);
    set_root_twist(both, 0, p.X_WB.R * twist_from(base.base_twist()), state);
    PhaseDynamics dynamics(both, setup);
    const StraightGoal& goal = p.goals[0];
    double end_distance = 1, end_speed = 0, spin = 0;
    const auto observe = [&](const PhaseSample& sample) {
      const Kinematics k = forward_kinematics(both, sample.state);
      const Posed X_WE = frame_pose(both, k, both.frame_index("hand"));
      const Posed X_WT = k.X_WB[t];
      const Vector3d off = inverse(X_WT) * X_WE.p - goal.X_TG.p;
      const double along = dot(off, goal.direction_T);
      line.note(norm(off - along * goal.direction_T), static_cast<int>(orientation));
      const Twistd V_E = frame_twist(both, k, both.frame_index("hand"));
      const Twistd V_T = shift(k.V_WB[t], X_WE.p - X_WT.p);
      end_distance = norm(off);
      end_speed = dot(transposed_times(X_WT.R, V_E.linear - V_T.linear), goal.direction_T);
      spin = norm(V_E.angular - V_T.angular);
    };
    ASSERT_TRUE(simulate_phase(dynamics, state, 3, 8, 0.25, {}, observe).finished);
    EXPECT_LT(arrival.note(end_distance, static_cast<int>(orientation)), 1e-9);
    EXPECT_NEAR(end_speed, 0.02, 1e-9);
    EXPECT_LT(line.value(), 1e-9);
    if (orientation == Goal::Orientation::pose) {
      EXPECT_LT(spin, 1e-9);
    } else {
      EXPECT_GT(spin, 1e-6);
    }
  }
}

TEST(StraightIn, DampsNearASingularityAndSaysSo) {
  Servicer s = seven_joints();
  for (int j = 0; j < 7; ++j)
    s.state.q[s.model.bodies()[s.model.joints()[j]].q] = j == 3 ? 0.06 : 0.01 * j;  // nearly stretched
  FloatingBase base(s.model, true);
  StraightInProblem p = problem_for(s, base, Goal::Orientation::free);
  base.place(p.position);
  // Straight out along the stretched arm, farther than it reaches.
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

}  // namespace straight_in_test
}  // namespace grapnel::testing
