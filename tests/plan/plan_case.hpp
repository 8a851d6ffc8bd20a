#pragma once

/// @file
/// Random servicers for planning, and the thesis's two arms.

#include <limits>

#include "grapnel/plan/reach.hpp"
#include "impact/thesis_robot.hpp"
#include "support/random_robot.hpp"

namespace grapnel::testing {

/// A random branched servicer of one tree, its base free or fixed, and a state. Rotors spin in every second one.
struct Servicer {
  Model model;
  State state;
  std::vector<double> theta() const {
    std::vector<double> values;
    for (int b : model.joints()) values.push_back(state.q[model.bodies()[b].q]);
    return values;
  }
  std::vector<double> rates() const {
    std::vector<double> values;
    for (int b : model.joints()) values.push_back(state.v[model.bodies()[b].v]);
    return values;
  }
  Posed X_WB() const { return root_pose(model, state, 0); }
};

/// The model with axes of rotors where joints have rotors, so that their spins carry momentum.
inline Model with_spinning_rotors(const Model& model, Random& random) {
  ModelBuilder builder;
  for (const Body& b : model.bodies()) {
    BodyDescription d = b.description;
    if (d.joint.rotor_inertia > 0) d.joint.rotor_axis = random.direction();
    builder.add(d);
  }
  for (const Frame& f : model.frames())
    builder.add(FrameDescription{f.name, model.bodies()[f.body].description.name, f.X_BE});
  return builder.build();
}

inline Servicer random_servicer(int index, bool free_root = true) {
  RobotOptions options;
  options.least_bodies = 3, options.most_bodies = 12;
  options.free_root = free_root;
  Random random(index);
  Model model = random_model(options, random);
  State state = random_state(model, random, 0.5);
  if (index % 2 == 1) model = with_spinning_rotors(model, random);
  return {std::move(model), std::move(state)};
}

inline constexpr double kNone = std::numeric_limits<double>::infinity();

/// A segment from `start` without limits and without an objective.
inline ReachProblem reach_problem(const Servicer& s, double duration, JointProfile profile, const Vector3d& gravity) {
  ReachProblem p;
  const std::size_t n = s.model.joints().size();
  p.start = {2.0, 2.0 + duration, profile, s.theta(), s.rates(), s.X_WB()};
  p.motion = free_motion(s.model, s.state, 2.0, gravity);
  p.lower.assign(n, -kNone), p.upper.assign(n, kNone);
  p.guess = p.start.position;
  return p;
}

/// The thesis's robot at the initial angles of Table 4.3, and its case 1 as a planning problem from the published final
/// angles.
inline Servicer thesis_servicer() {
  ModelBuilder builder;
  for (const BodyDescription& b : thesis_robot()) builder.add(b);
  for (const FrameDescription& f : thesis_tips()) builder.add(f);
  Servicer s{builder.build(), {}};
  s.state = zero_state(s.model);
  const double initial[] = {0.698, -1.571, 1.047, 2.444, 1.571, -1.047};
  for (int j = 0; j < 6; ++j) s.state.q[s.model.bodies()[s.model.joints()[j]].q] = initial[j];
  return s;
}

/// Sets the objective of a problem from its start, guess and limits.
inline void set_measure(ReachProblem& p, Objective::Kind kind) {
  p.objective = Objective(kind, p.start, p.guess, p.lower, p.upper);
}

inline ReachProblem thesis_problem(const Servicer& s, RateDemand demand) {
  ReachProblem p = reach_problem(s, 20, JointProfile::quartic, {0, 0, 0});
  p.start.begin = 0, p.start.end = 20;
  p.motion.time = 0;
  p.demand = demand;
  p.guess = {-0.524, -1.393, -0.035, 2.618, -1.393, -0.035};
  for (int i = 0; i < 2; ++i) {
    const double sign = i == 0 ? 1 : -1;
    Goal g;
    g.name = "tip-" + std::to_string(i + 1);
    g.frame = s.model.frame_index(g.name);
    const Vector3d r{0, 0.5 * sign, 0}, spin{0, 0, 0.2};
    g.X_WG = {Rotationd::identity(), Vector3d{2 * sign, -2 * sign, 0} + r};
    g.V_WG = {spin, cross(spin, r)};
    p.goals.push_back(g);
  }
  return p;
}

}  // namespace grapnel::testing
