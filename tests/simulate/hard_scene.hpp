#pragma once

/// @file
/// Scenes of hard bodies with one shape each, for the tests of their impacts in a phase.

#include <algorithm>
#include <memory>
#include <vector>

#include "grapnel/dynamics/momentum.hpp"
#include "grapnel/simulate/simulate_phase.hpp"

namespace grapnel::testing {

inline BodyDescription hard_body(const std::string& name, double mass, const Symmetric3d& inertia,
                                 JointType joint = JointType::free, const std::string& parent = {}) {
  BodyDescription d;
  d.name = name, d.parent = parent, d.mass = mass, d.inertia = inertia;
  d.joint.type = joint, d.joint.name = name + "_joint", d.joint.axis = {1, 0, 0};
  return d;
}
inline BodyDescription hard_ball(const std::string& name, double mass, double radius) {
  const double I = 0.4 * mass * radius * radius;
  return hard_body(name, mass, Symmetric3d::diagonal(I, I, I));
}
inline BodyDescription hard_box(const std::string& name, double mass, const Vector3d& s) {
  const auto I = [&](double a, double b) { return mass * (a * a + b * b) / 12; };
  return hard_body(name, mass, Symmetric3d::diagonal(I(s[1], s[2]), I(s[0], s[2]), I(s[0], s[1])));
}
inline Geometry hard_shape(Geometry::Shape shape, const Vector3d& size) {
  Geometry g;
  g.shape = shape, g.size = size;
  return g;
}
inline Geometry sphere_of(double radius) { return hard_shape(Geometry::Shape::sphere, {radius, 0, 0}); }

/// Of two equal hard materials.
inline ContactLaw hard_law(double restitution, double friction = 0, double stiffness = 1e6) {
  ContactMaterial m;
  m.stiffness = 2 * stiffness, m.hard = true, m.restitution = restitution;
  m.static_friction = m.kinetic_friction = friction;
  m.dissipation = dissipation_for(std::max(0.1, restitution), m.rest_speed);
  return combine(m, m);
}

/// Free bodies, or of another model; surface -1 of add_pair() is the floor z <= 0.
struct HardScene {
  explicit HardScene(const std::vector<BodyDescription>& bodies) : model(built(bodies)), state(zero_state(model)) {
    surfaces.push_back({-1, ContactShape::half_space(Posed::identity())});
  }
  static Model built(const std::vector<BodyDescription>& bodies) {
    ModelBuilder builder;
    for (const BodyDescription& body : bodies) builder.add(body);
    return builder.build();
  }

  void shape(int body, const Geometry& shape) {
    while (surface_of.size() <= static_cast<std::size_t>(body)) surface_of.push_back(0);
    surface_of[body] = static_cast<int>(surfaces.size());
    surfaces.push_back({body, ContactShape(shape)});
  }
  void pair(int a, int b, const ContactLaw& law) {
    const auto surface = [&](int body) { return body < 0 ? 0 : surface_of[body]; };
    pairs.push_back({surface(a), surface(b), law, static_cast<int>(pairs.size())});
  }
  void place(int body, const Vector3d& p, const Vector3d& v = Vector3d::zero(), const Vector3d& w = Vector3d::zero(),
             const Rotationd& R = Rotationd::identity()) {
    set_root_pose(model, body, {R, p}, state);
    set_root_twist(model, body, {w, v}, state);
  }
  PhaseOutcome run(double duration, const PhaseObservers& observers = {}) {
    contacts = std::make_shared<ContactSet>(surfaces, pairs, static_cast<int>(pairs.size()));
    setup.contacts = contacts;
    dynamics = std::make_unique<PhaseDynamics>(model, setup);
    IntegrationSetup integration;
    integration.relative_tolerance = integration.absolute_tolerance = 1e-13;
    return simulate_phase(*dynamics, {state, 0, duration}, integration, observers);
  }
  const GroupHistory& history(std::size_t pair = 0) const { return contacts->history(pair); }

  Vector3d position(const State& s, int body) const { return forward_kinematics(model, s).X_WB[body].p; }
  Twistd twist(const State& s, int body) const { return forward_kinematics(model, s).V_WB[body]; }
  double energy(const State& s) const { return kinetic_energy(model, forward_kinematics(model, s), s); }
  Momentumd momentum(const State& s) const {
    return momentum_about(model, forward_kinematics(model, s), Vector3d::zero());
  }

  Model model;
  State state;
  PhaseSetup setup;
  std::vector<ContactSurface> surfaces;
  std::vector<int> surface_of;
  std::vector<SurfacePair> pairs;
  std::shared_ptr<ContactSet> contacts;
  std::unique_ptr<PhaseDynamics> dynamics;
};

}  // namespace grapnel::testing
