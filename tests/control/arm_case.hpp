#pragma once

/// @file
/// A floating base with one arm that holds a target.

#include <string>

#include "grapnel/control/joint_law.hpp"
#include "grapnel/simulate/simulate_phase.hpp"
#include "support/random_robot.hpp"

namespace grapnel::testing {

struct ArmOptions {
  int joints = 7;
  double effort = std::numeric_limits<double>::infinity();
  JointFriction friction = {};
  bool wheel = false;  // the base has a wheel, whose joint comes first
};

/// Axes alternately z, y, x; links of 0.5 m along x with 20 kg; base of 600 kg; triaxial target of 300 kg whose centre
/// of mass is off the arm's line.
inline Model arm_with_target(const ArmOptions& options) {
  ModelBuilder builder;
  BodyDescription base;
  base.name = base.joint.name = "base";
  base.joint.type = JointType::free;
  base.mass = 600, base.inertia = Symmetric3d::diagonal(160, 190, 140), base.com = {0.05, -0.02, 0.03};
  builder.add(base);
  if (options.wheel) {
    BodyDescription wheel;
    wheel.name = wheel.joint.name = "wheel", wheel.parent = "base";
    wheel.joint.type = JointType::continuous, wheel.joint.axis = {0.6, 0, 0.8};
    wheel.mass = 5, wheel.inertia = Symmetric3d::diagonal(0.06, 0.06, 0.06);
    builder.add(wheel);
  }
  std::string parent = "base";
  const Vector3d axes[] = {{0, 0, 1}, {0, 1, 0}, {1, 0, 0}};
  for (int j = 0; j < options.joints; ++j) {
    BodyDescription link;
    link.name = "link-" + std::to_string(j + 1), link.joint.name = "joint-" + std::to_string(j + 1);
    link.parent = parent;
    link.X_PF.p = j == 0 ? Vector3d{0.6, 0.1, 0.2} : Vector3d{0.5, 0, 0};
    link.joint.type = JointType::revolute, link.joint.axis = axes[j % 3];
    link.joint.friction = options.friction, link.joint.limits.effort = options.effort;
    link.mass = 20, link.com = {0.25, 0, 0.02}, link.inertia = Symmetric3d::diagonal(0.1, 0.5, 0.5);
    builder.add(link);
    parent = link.name;
  }
  BodyDescription target;
  target.name = target.joint.name = "target", target.parent = parent;
  target.X_PF.p = {0.3, 0, 0};
  target.mass = 300, target.com = {0.7, 0.2, -0.1};
  target.inertia = {60, 90, 110, 4, -6, 3};
  builder.add(target);
  return builder.build();
}

inline std::vector<int> arm_joints(const Model& model) {
  std::vector<int> joints;
  for (std::size_t j = 0; j < model.joints().size(); ++j) {
    if (model.bodies()[model.joints()[j]].description.name != "wheel") joints.push_back(static_cast<int>(j));
  }
  return joints;
}

/// A state away from singular configurations, with all joints moving.
inline State moving_state(const Model& model, double rates) {
  State s = zero_state(model);
  const double bent[] = {0.4, -0.7, 0.3, 1.1, -0.9, 0.5, 0.8}, moving[] = {1, -0.6, 0.8, -0.9, 0.5, 0.7, -0.4};
  const std::vector<int> joints = arm_joints(model);
  for (std::size_t j = 0; j < joints.size(); ++j) {
    const Body& body = model.bodies()[model.joints()[joints[j]]];
    s.q[body.q] = bent[j], s.v[body.v] = rates * moving[j];
  }
  const double base[] = {0.3, -0.2, 0.4, 0.1, 0.2, -0.3};
  for (int k = 0; k < 6; ++k) s.v[k] = rates * base[k];
  return s;
}

/// A phase in which the law drives its joints; others are free.
inline PhaseSetup with_law(const Model& model, const std::shared_ptr<JointLaw>& law) {
  PhaseSetup setup;
  setup.drives.resize(model.joints().size());
  for (int j : law->joints()) setup.drives[j].control = JointControl::controller;
  setup.controller = std::make_shared<JointLawController>(law);
  return setup;
}

}  // namespace grapnel::testing
