#include "engines/simbody_engine.hpp"

namespace grapnel::testing {
namespace {

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

}  // namespace

std::array<double, 3> plain(const Vector3d& v) { return {v[0], v[1], v[2]}; }

std::array<double, 9> plain(const Rotationd& R) {
  std::array<double, 9> result{};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) result[3 * i + j] = R(i, j);
  }
  return result;
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
    plain_body.R_PF = plain(d.X_PF.R);
    bodies.push_back(plain_body);
  }
  return bodies;
}

namespace {

std::vector<SimbodyClosure> plain_closures(std::span<const LoopClosure> closures) {
  std::vector<SimbodyClosure> result;
  for (const LoopClosure& c : closures) {
    const Rotationd to_axis = rotation_between({0, 0, 1}, c.hinge_C);
    result.push_back({c.body_a,
                      c.body_b,
                      c.model == GraspModel::rigid   ? SimbodyClosureKind::weld
                      : c.model == GraspModel::hinge ? SimbodyClosureKind::hinge
                                                     : SimbodyClosureKind::ball,
                      plain(c.X_AC.R),
                      plain(c.X_BD.R),
                      plain(c.X_AC.p),
                      plain(c.X_BD.p),
                      plain(c.hinge_C),
                      {plain(to_axis.column(0)), plain(to_axis.column(1))}});
  }
  return result;
}

}  // namespace

SimbodyEngine::SimbodyEngine(const Model& model, std::span<const LoopClosure> closures)
    : bridge_(plain_bodies(model), plain_closures(closures)) {}

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
