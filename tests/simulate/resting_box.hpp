#pragma once

/// @file
/// A heavy box that comes to rest on a floor, in a stiff contact.

#include <memory>

#include "grapnel/simulate/simulate_phase.hpp"

namespace grapnel::testing {

/// A box of 1000 kg and 1 x 1 x 0.9 m that falls on the floor z <= 0 from some millimetres, tilted, with a lateral
/// velocity and a spin. The contact has 1e7 N/m, 2e5 N s/m and friction.
struct RestingBox {
  static constexpr double kMass = 1000, kStiffness = 1e7, kGravity = 9.81;

  RestingBox() : model(make_model()), state(zero_state(model)) {
    set_root_pose(model, 0, {rotation_about({1, 0, 0}, 2e-3), {0, 0, 0.4532}}, state);
    set_root_twist(model, 0, {{0, 0, 0.02}, {0.05, 0, 0}}, state);
  }
  static Model make_model() {
    BodyDescription box;
    box.name = "box", box.mass = kMass, box.inertia = Symmetric3d::diagonal(150, 150, 160);
    box.joint.type = JointType::free, box.joint.name = "box_root";
    return ModelBuilder().add(box).build();
  }
  /// Samples at multiples of `interval` [s], unless it is 0.
  PhaseOutcome run(double duration, IntegrationSetup::Method method, double tolerance,
                   const PhaseObservers& observers = {}, double interval = 0) const {
    Geometry shape;
    shape.shape = Geometry::Shape::box, shape.size = {1, 1, 0.9};
    ContactMaterial material;
    material.stiffness = 2 * kStiffness, material.damping = 2 * 2e5;
    material.static_friction = 0.5, material.kinetic_friction = 0.4;
    const std::vector<ContactSurface> surfaces = {{0, ContactShape(shape)},
                                                  {-1, ContactShape::half_space(Posed::identity())}};
    const std::vector<SurfacePair> pairs = {{0, 1, combine(material, material), 0}};
    PhaseSetup setup;
    setup.gravity = {0, 0, -kGravity};
    setup.contacts = std::make_shared<ContactSet>(surfaces, pairs, 1);
    PhaseDynamics dynamics(model, setup);
    IntegrationSetup integration;
    integration.method = method;
    integration.relative_tolerance = integration.absolute_tolerance = tolerance;
    return simulate_phase(dynamics, {state, 0, duration, interval}, integration, observers);
  }

  Model model;
  State state;
};

}  // namespace grapnel::testing
