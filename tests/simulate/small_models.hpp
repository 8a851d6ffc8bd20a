#pragma once

/// @file
/// One revolute joint on the ground and one free body, for closed forms.

#include <cmath>

#include "grapnel/dynamics/state.hpp"

namespace grapnel::testing {

/// A flywheel on the ground: 2 kg m^2 with its rotor's 0.1 * 3^2 = 0.9.
inline Model flywheel(JointFriction friction, double effort = std::numeric_limits<double>::infinity()) {
  BodyDescription ground, wheel;
  ground.name = ground.joint.name = "ground";
  ground.joint.type = JointType::fixed;
  ground.mass = 1;
  ground.inertia = Symmetric3d::diagonal(1, 1, 1);
  wheel.name = wheel.joint.name = "wheel";
  wheel.parent = "ground";
  wheel.joint.type = JointType::continuous;
  wheel.joint.friction = friction;
  wheel.joint.limits.effort = effort;
  wheel.joint.rotor_inertia = 0.1, wheel.joint.gear_ratio = 3;
  wheel.mass = 4;
  wheel.inertia = Symmetric3d::diagonal(1.5, 1.5, 2);
  return ModelBuilder().add(ground).add(wheel).build();
}
constexpr double kWheelInertia = 2.9;

inline State turning(const Model& model, double rate, double angle = 0) {
  State s = zero_state(model);
  s.q[0] = angle, s.v[0] = rate;
  return s;
}

/// Displacement from rest at `x0` of x'' + 2 damping x' + stiffness x = 0, less than critically damped.
inline double damped_oscillation(double x0, double damping, double stiffness, double t) {
  const double w = std::sqrt(stiffness - damping * damping);
  return x0 * std::exp(-damping * t) * (std::cos(w * t) + damping / w * std::sin(w * t));
}

/// One free body of mass 3.
inline Model one_body(const Symmetric3d& inertia, const Vector3d& com = {0, 0, 0}) {
  BodyDescription b;
  b.name = b.joint.name = "body";
  b.joint.type = JointType::free;
  b.mass = 3;
  b.com = com;
  b.inertia = inertia;
  return ModelBuilder().add(b).build();
}

}  // namespace grapnel::testing
