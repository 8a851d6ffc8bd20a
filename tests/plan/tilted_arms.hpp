#pragma once

/// @file
/// Two random arms with seven joints and tilted axes on a floating base, and grasp points that are known to be
/// reachable. A hard case for planning: no two axes are parallel, and the base rotates about all axes.

#include <cmath>
#include <random>
#include <stdexcept>

#include "grapnel/plan/reach.hpp"

namespace grapnel::testing {

struct TiltedArms {
  Model model;
  State state;
  ReachProblem problem;  // to be read with `model` in place
};

/// Drawn from `seed`: a base of about 400 kg; per arm seven joints with axes tilted against each other by up to 1.2
/// rad, links of 0.1 to 0.5 m and 2 to 12 kg, joints within 2.8 rad. The goals are moving poses that the tips reach
/// after `duration` by joint motions of up to 1.2 rad. Four initial guesses, the first at the initial joint values;
/// objective: excursion. `base_share`: scales the base's mass, for lighter bases.
inline TiltedArms tilted_arms(unsigned seed, double duration = 30, double base_share = 1) {
  std::mt19937 generator(seed);
  // The distributions of the standard library differ between implementations.
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * (static_cast<double>(generator()) * 0x1p-32);
  };
  const auto vector = [&](double size) {
    return Vector3d{uniform(-size, size), uniform(-size, size), uniform(-size, size)};
  };
  const auto turned = [&](double most) {
    const Vector3d w = vector(1);
    return rotation_about((1 / norm(w)) * w, uniform(0.3 * most, most));
  };
  ModelBuilder builder;
  BodyDescription base;
  base.name = "base";
  base.joint.type = JointType::free;
  base.mass = uniform(300, 500);
  base.com = vector(0.05);
  base.inertia = {uniform(80, 120), uniform(80, 120), uniform(80, 120), uniform(-5, 5), uniform(-5, 5), uniform(-5, 5)};
  base.mass *= base_share, base.com = base_share * base.com;
  Symmetric3d& I = base.inertia;
  for (double* x : {&I.xx, &I.yy, &I.zz, &I.xy, &I.xz, &I.yz}) *x *= base_share;
  builder.add(base);
  for (int arm = 1; arm <= 2; ++arm) {
    std::string parent = "base";
    double length = 0;
    for (int j = 1; j <= 7; ++j) {
      BodyDescription link;
      link.name = "arm-" + std::to_string(arm) + "-link-" + std::to_string(j);
      link.parent = parent;
      link.X_PF = j == 1 ? Posed{turned(1), {arm == 1 ? 0.6 : -0.6, uniform(-0.3, 0.3), uniform(-0.3, 0.3)}}
                         : Posed{turned(1.2), {0, 0, length}};
      link.joint.type = JointType::revolute;
      link.joint.name = "arm-" + std::to_string(arm) + "-joint-" + std::to_string(j);
      link.joint.axis = {0, 0, 1};
      if (j % 2 == 0) link.joint.axis = {1, 0, 0};
      link.joint.limits.lower = -2.8, link.joint.limits.upper = 2.8;
      link.mass = uniform(2, 12);
      length = uniform(0.1, 0.5);
      link.com = {0, 0, 0.5 * length};
      const double across = link.mass * (0.004 + length * length / 12);
      link.inertia = Symmetric3d::diagonal(across, across, link.mass * 0.004);
      builder.add(link);
      parent = link.name;
    }
    FrameDescription tip;
    tip.name = "tip-" + std::to_string(arm);
    tip.body = parent;
    tip.X_BE.p = {0, 0, length};
    builder.add(tip);
  }
  TiltedArms result{builder.build(), {}, {}};
  result.state = zero_state(result.model);
  ReachProblem& p = result.problem;
  std::vector<double> flown;
  for (int b : result.model.joints()) {
    const double at = uniform(-1.2, 1.2);
    result.state.q[result.model.bodies()[b].q] = at;
    p.start.position.push_back(at);
    flown.push_back(at + uniform(-1.2, 1.2));
  }
  const std::size_t n = flown.size();
  p.start.begin = 0, p.start.end = duration;
  p.start.rate.assign(n, 0.0);
  p.start.X_WB = root_pose(result.model, result.state, 0);
  p.motion = free_motion(result.model, result.state, 0, {0, 0, 0});
  p.lower.assign(n, -2.8), p.upper.assign(n, 2.8);
  p.guess = p.start.position;
  p.starts = 4;
  p.objective = Objective(Objective::Kind::excursion, p.start, p.guess, p.lower, p.upper);
  FloatingBase floating(result.model, true);
  PathSegment segment(floating, p.start, p.motion);
  const SegmentEnd end = segment.fly(flown, std::vector<double>(n, 0.0), false);
  if (!end.finished) throw std::runtime_error(end.failure);
  floating.place(flown);
  for (int arm = 1; arm <= 2; ++arm) {
    Goal g;
    g.name = "tip-" + std::to_string(arm);
    g.frame = result.model.frame_index(g.name);
    g.X_WG = end.X_WB * floating.frame_pose(g.frame);
    g.orientation = Goal::Orientation::pose;
    g.V_WG = {vector(0.02), vector(0.02)};
    p.goals.push_back(g);
  }
  return result;
}

}  // namespace grapnel::testing
