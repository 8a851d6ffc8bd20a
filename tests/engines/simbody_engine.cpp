#include "engines/simbody_engine.hpp"

namespace grapnel::testing {
namespace {

std::array<double, 3> plain(const Vector3d& v) { return {v[0], v[1], v[2]}; }

SimbodyJoint joint(JointType type) {
  switch (type) {
    case JointType::free:
      return SimbodyJoint::free;
    case JointType::spherical:
      return SimbodyJoint::ball;
    case JointType::prismatic:
      return SimbodyJoint::slider;
    case JointType::fixed:
      return SimbodyJoint::weld;
    default:
      return SimbodyJoint::pin;
  }
}

std::vector<SimbodyBody> plain_bodies(const Model& model) {
  std::vector<SimbodyBody> bodies;
  for (const Body& b : model.bodies()) {
    const BodyDescription& d = b.description;
    SimbodyBody plain_body{b.parent,
                           joint(d.joint.type),
                           {},
                           plain(d.X_PF.p),
                           plain(d.joint.axis),
                           plain(d.com),
                           d.mass,
                           {d.inertia.xx, d.inertia.yy, d.inertia.zz, d.inertia.xy, d.inertia.xz, d.inertia.yz},
                           b.q,
                           b.v};
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) plain_body.R_PF[3 * i + j] = d.X_PF.R(i, j);
    }
    bodies.push_back(plain_body);
  }
  return bodies;
}

}  // namespace

SimbodyEngine::SimbodyEngine(const Model& model) : bridge_(plain_bodies(model)) {}

std::vector<double> SimbodyEngine::acceleration(const State& state, const Forces& forces) {
  std::vector<double> force = forces.generalized;
  force.resize(state.v.size());
  std::vector<SimbodyWrench> wrenches;
  for (const ExternalWrench& e : forces.external) {
    wrenches.push_back({e.body, plain(e.p_WP), plain(e.F_W.angular), plain(e.F_W.linear)});
  }
  return bridge_.acceleration(state.q, state.v, force, wrenches, plain(forces.gravity));
}

}  // namespace grapnel::testing
