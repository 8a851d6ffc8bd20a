#pragma once

/// @file
/// Small models for clearance tests.

#include <string>
#include <vector>

#include "grapnel/dynamics/state.hpp"

namespace grapnel::testing {

/// A body of 1 kg on a joint about z, 1 m along the parent's x.
inline BodyDescription body_on(const std::string& name, const std::string& parent, JointType joint,
                               const JointLimits& limits = {}) {
  BodyDescription b;
  b.name = name;
  b.parent = parent;
  b.X_PF.p = {1, 0, 0};
  b.joint.name = name + "_joint";
  b.joint.type = joint;
  b.joint.limits = limits;
  b.mass = 1;
  b.inertia = Symmetric3d::diagonal(1, 1, 1);
  return b;
}

/// Free bodies "a", "b", ….
inline Model free_bodies(int count) {
  ModelBuilder builder;
  for (int i = 0; i < count; ++i) builder.add(body_on(std::string(1, static_cast<char>('a' + i)), "", JointType::free));
  return builder.build();
}

/// State of free bodies in steady motion: positions p + v t, rotation about their z axes at rates w from zero.
struct SteadyBody {
  Vector3d p, v;
  double w = 0;
};
inline State steady_state(const Model& model, const std::vector<SteadyBody>& bodies, double t) {
  State state = zero_state(model);
  for (int i = 0; i < static_cast<int>(bodies.size()); ++i) {
    const SteadyBody& b = bodies[i];
    set_root_pose(model, i, {rotation_about({0, 0, 1}, b.w * t), b.p + t * b.v}, state);
    set_root_twist(model, i, {{0, 0, b.w}, b.v}, state);
  }
  return state;
}

}  // namespace grapnel::testing
