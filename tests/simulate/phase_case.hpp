#pragma once

/// @file
/// Random robots in a phase: models with friction, drives, and totals summed over bodies.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "grapnel/dynamics/momentum.hpp"
#include "grapnel/simulate/simulate_phase.hpp"
#include "support/random_robot.hpp"

namespace grapnel::testing {

/// Adds friction and an effort limit to every joint with one degree of freedom.
inline Model with_friction(const Model& model, double viscous, double coulomb,
                           double effort = std::numeric_limits<double>::infinity()) {
  ModelBuilder builder;
  for (const Body& b : model.bodies()) {
    BodyDescription d = b.description;
    d.joint.friction = {viscous, coulomb, 0.1};
    d.joint.limits.effort = effort;
    builder.add(d);
  }
  return builder.build();
}

/// Quintic paths from the joints' states to random ends, from the time `begin` on.
inline std::vector<JointDrive> random_drives(const Model& model, const State& state, JointControl control,
                                             double duration, Random& random, double begin = 0) {
  std::vector<JointDrive> drives;
  for (int b : model.joints()) {
    const Body& body = model.bodies()[b];
    JointDrive d;
    d.control = control;
    d.trajectory = {begin,
                    JointPath{JointProfile::quintic, duration, state.q[body.q], state.q[body.q] + random.uniform(-1, 1),
                              state.v[body.v], random.uniform(-0.3, 0.3)}};
    d.kp = 40, d.kd = 12;
    drives.push_back(d);
  }
  return drives;
}

struct Totals {
  Momentumd momentum;  // about the world's origin
  double energy;
  Vector3d com;
};
inline Totals totals(const Model& model, const State& state) {
  const Kinematics k = forward_kinematics(model, state);
  return {momentum_about(model, k, {0, 0, 0}), kinetic_energy(model, k, state), center_of_mass(model, k)};
}

/// How well the change of momentum and energy in a phase equals what external loads, motors and friction contribute,
/// relative to the largest values.
struct PhaseBalance {
  double momentum = 0, energy = 0;
};

/// Simulates 2 s from `start` at tight tolerances, and expects that external loads act.
inline PhaseBalance balance_under_loads(const Model& model, PhaseDynamics& dynamics, const State& start) {
  const Totals before = totals(model, start);
  const auto size = [](const Momentumd& h) { return norm(h.angular) + norm(h.linear); };
  double largest = size(before.momentum), most = before.energy, off = 0, lost = 0, work = 0, impulse = 0;
  IntegrationSetup integration;
  integration.relative_tolerance = 1e-14, integration.absolute_tolerance = 1e-15;
  const PhaseOutcome o =
      simulate_phase(dynamics, {start, 0, 2, 0.1}, integration, {.observe = [&](const PhaseSample& s) {
                       const Totals now = totals(model, s.state);
                       largest = std::max(largest, size(now.momentum));
                       most = std::max(most, now.energy);
                       off = std::max(off, size(now.momentum - before.momentum - s.integrals.external_impulse));
                       lost = std::max(lost, std::abs(now.energy - before.energy - s.integrals.motor_work -
                                                      s.integrals.friction_work - s.integrals.external_work));
                       work = std::max(work, std::abs(s.integrals.external_work));
                       impulse = std::max(impulse, size(s.integrals.external_impulse));
                     }});
  EXPECT_TRUE(o.finished) << o.failure;
  EXPECT_GT(work, 0.05);
  EXPECT_GT(impulse, 1);
  return {off / largest, lost / most};
}

/// Largest difference of two states, quaternions by value.
inline double difference(const State& a, const State& b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.q.size(); ++i) largest = std::max(largest, std::abs(a.q[i] - b.q[i]));
  for (std::size_t i = 0; i < a.v.size(); ++i) largest = std::max(largest, std::abs(a.v[i] - b.v[i]));
  return largest;
}

}  // namespace grapnel::testing
