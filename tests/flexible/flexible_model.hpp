#pragma once

/// @file
/// Flexible robots for tests against closed forms: a base, beam links, joints.

#include <string>

#include "grapnel/dynamics/momentum.hpp"
#include "grapnel/problem/flexible_bodies.hpp"

namespace grapnel::testing {

inline RobotSetup only_base(double mass, double inertia, bool fixed = false) {
  RobotSetup robot;
  robot.name = "robot", robot.base = "base";
  robot.base_mode = fixed ? RobotSetup::Base::fixed : RobotSetup::Base::free;
  BodyDescription base;
  base.name = "base";
  base.joint.type = fixed ? JointType::fixed : JointType::free;
  base.mass = mass, base.inertia = Symmetric3d::diagonal(inertia, inertia, inertia);
  robot.bodies.push_back(base);
  return robot;
}

/// A slender link along its x axis that consists of a beam of length `length`; it bends about z unless the test changes
/// it.
inline BodyDescription slender_link(const std::string& name, const std::string& parent, JointType type, double length,
                                    double mass_per_length, double EI, int segments) {
  BodyDescription link;
  link.name = name, link.parent = parent;
  link.joint.name = name + "-joint", link.joint.type = type;
  link.mass = mass_per_length * length;
  link.com = {0.5 * length, 0, 0};
  const double across = link.mass * length * length / 12;
  link.inertia = Symmetric3d::diagonal(1e-9 * across, across, across);
  BeamDescription beam;
  beam.to = {length, 0, 0};
  beam.bending_stiffness_z = EI;
  beam.segments = segments;
  link.beam = beam;
  return link;
}

inline Model model_of(const RobotSetup& robot) {
  ModelBuilder builder;
  for (BodyDescription body : flexible_robot(robot).bodies) {
    body.beam.reset();
    builder.add(std::move(body));
  }
  return builder.build();
}

inline std::vector<int> velocities_of(const Model& model, const std::string& body) {
  const Body& b = model.bodies()[model.body_index(body)];
  std::vector<int> velocities;
  for (int k = 0; k < velocity_count(b.description.joint.type); ++k) velocities.push_back(b.v + k);
  return velocities;
}

/// Total inertia in the zero posture, about the world's origin.
inline RigidBodyInertiad total_of(const Model& model) {
  const Kinematics k = forward_kinematics(model, zero_state(model));
  RigidBodyInertiad total = RigidBodyInertiad::zero();
  for (std::size_t i = 0; i < model.bodies().size(); ++i)
    total += shift_origin(world_inertia(model, k, static_cast<int>(i)), k.X_WB[i].p);
  return total;
}

}  // namespace grapnel::testing
