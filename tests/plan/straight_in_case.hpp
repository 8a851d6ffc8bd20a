#pragma once

/// @file
/// An arm with seven joints on a final straight approach to a grasp point of a tumbling target.

#include "grapnel/plan/constrained_straight_in.hpp"
#include "plan/plan_case.hpp"

namespace grapnel::testing {

// A base with an arm with seven joints, axes alternately z and y.
inline Servicer seven_joints() {
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

inline StraightInProblem problem_for(const Servicer& s, FloatingBase& base, Goal::Orientation orientation) {
  StraightInProblem p;
  p.begin = 3, p.end = 8;
  p.position = s.theta();
  p.X_WB = s.X_WB();
  p.motion = free_motion(s.model, s.state, 3, {0, 0, 0});
  p.stand_off = 0.3, p.final_speed = 0.02;
  base.place(p.position);
  const Posed X_WE = p.X_WB * base.frame_pose(0);
  // A tumbling target whose stand-off point is at the end-effector.
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

// A problem without path constraints.
inline ReachProblem nothing_kept(const Servicer& s, const StraightInProblem& p) {
  ReachProblem kept = reach_problem(s, p.end - p.begin, JointProfile::quintic, {0, 0, 0});
  kept.motion = p.motion;
  kept.rate_limit.assign(7, kNone);
  kept.way.effort_limit.assign(7, kNone);
  kept.way.limits = true;
  return kept;
}

}  // namespace grapnel::testing
