#include "engines/simbody_bridge.hpp"

#include "engines/simbody_bodies.hpp"

namespace grapnel::testing {
namespace {

using SimTK::Vec3;

void write(const Vec3& v, std::vector<double>& values, int first) {
  for (int k = 0; k < 3; ++k) values[first + k] = v[k];
}

}  // namespace

struct SimbodyBridge::Parts {
  std::vector<SimbodyBody> given;
  SimTK::MultibodySystem system;
  SimTK::SimbodyMatterSubsystem matter{system};
  std::vector<SimTK::MobilizedBodyIndex> bodies;
  SimTK::State state;
  bool closed = false;
};

SimbodyBridge::SimbodyBridge(std::vector<SimbodyBody> given, const std::vector<SimbodyClosure>& closures)
    : parts_(std::make_unique<Parts>()) {
  using SimTK::MobilizedBody;
  using SimTK::Transform;
  parts_->given = std::move(given);
  parts_->bodies = add_bodies(parts_->given, parts_->matter);
  for (const SimbodyClosure& c : closures) {
    MobilizedBody& a = parts_->matter.updMobilizedBody(parts_->bodies[c.a]);
    MobilizedBody& b = parts_->matter.updMobilizedBody(parts_->bodies[c.b]);
    const Transform X_AC(rotation(c.R_AC), vec3(c.p_AC)), X_BD(rotation(c.R_BD), vec3(c.p_BD));
    if (c.kind == SimbodyClosureKind::weld) {
      SimTK::Constraint::Weld(a, X_AC, b, X_BD);
      continue;
    }
    SimTK::Constraint::Ball(a, X_AC.p(), b, X_BD.p());
    if (c.kind == SimbodyClosureKind::ball) continue;
    for (const auto& normal : c.normals_C) {
      SimTK::Constraint::ConstantAngle(a, SimTK::UnitVec3(X_AC.R() * vec3(normal)), b,
                                       SimTK::UnitVec3(X_BD.R() * vec3(c.axis_C)), SimTK::Pi / 2);
    }
  }
  parts_->closed = !closures.empty();
  parts_->state = parts_->system.realizeTopology();
}

SimbodyBridge::~SimbodyBridge() = default;

void SimbodyBridge::place(const std::vector<double>& q, const std::vector<double>& v) {
  place_bodies(parts_->given, parts_->bodies, parts_->matter, q, v, parts_->state);
}

std::vector<double> SimbodyBridge::acceleration(const std::vector<double>& q, const std::vector<double>& v,
                                                const std::vector<double>& force,
                                                const std::vector<SimbodyWrench>& wrenches,
                                                const std::array<double, 3>& gravity) {
  SimTK::State& state = parts_->state;
  const SimTK::SimbodyMatterSubsystem& matter = parts_->matter;
  place(q, v);
  SimTK::Vector mobility(matter.getNumMobilities(), 0.0);
  for (std::size_t i = 0; i < parts_->bodies.size(); ++i) {
    const SimbodyBody& b = parts_->given[i];
    if (b.joint == SimbodyJoint::weld) continue;
    const int u = matter.getMobilizedBody(parts_->bodies[i]).getFirstUIndex(state);
    const auto put = [&](int first, const Vec3& f) {
      for (int k = 0; k < 3; ++k) mobility[u + first + k] = f[k];
    };
    if (b.joint == SimbodyJoint::free) {
      const SimTK::Rotation R = rotation_at(q, b.q + 3);
      put(0, R * vec3(force, b.v)), put(3, R * vec3(force, b.v + 3));
    } else if (b.joint == SimbodyJoint::ball) {
      put(0, rotation_at(q, b.q) * vec3(force, b.v));
    } else {
      mobility[u] = force[b.v];
    }
  }
  parts_->system.realize(state, SimTK::Stage::Dynamics);

  // Weights and wrenches, in W at the bodies' origins.
  SimTK::Vector_<SimTK::SpatialVec> loads(matter.getNumBodies(), SimTK::SpatialVec(Vec3(0), Vec3(0)));
  for (const SimTK::MobilizedBodyIndex index : parts_->bodies) {
    const SimTK::MobilizedBody& body = matter.getMobilizedBody(index);
    const Vec3 weight = body.getBodyMass(state) * vec3(gravity);
    loads[index] +=
        SimTK::SpatialVec((body.getBodyRotation(state) * body.getBodyMassCenterStation(state)) % weight, weight);
  }
  for (const SimbodyWrench& w : wrenches) {
    const SimTK::MobilizedBodyIndex index = parts_->bodies[w.body];
    const Vec3 arm = vec3(w.point) - matter.getMobilizedBody(index).getBodyOriginLocation(state);
    loads[index] += SimTK::SpatialVec(vec3(w.moment) + arm % vec3(w.force), vec3(w.force));
  }
  SimTK::Vector udot;
  SimTK::Vector_<SimTK::SpatialVec> A;
  if (parts_->closed) {
    matter.calcAcceleration(state, mobility, loads, udot, A);
  } else {
    matter.calcAccelerationIgnoringConstraints(state, mobility, loads, udot, A);
  }

  std::vector<double> vdot(v.size());
  for (std::size_t i = 0; i < parts_->bodies.size(); ++i) {
    const SimbodyBody& b = parts_->given[i];
    if (b.joint == SimbodyJoint::weld) continue;
    const int u = matter.getMobilizedBody(parts_->bodies[i]).getFirstUIndex(state);
    const auto part = [&](int first) { return Vec3(udot[first], udot[first + 1], udot[first + 2]); };
    if (b.joint == SimbodyJoint::free) {
      const SimTK::Rotation R = rotation_at(q, b.q + 3);
      write(~R * part(u), vdot, b.v);
      write(~R * part(u + 3) - vec3(v, b.v) % vec3(v, b.v + 3), vdot, b.v + 3);
    } else if (b.joint == SimbodyJoint::ball) {
      write(~rotation_at(q, b.q) * part(u), vdot, b.v);
    } else {
      vdot[b.v] = udot[u];
    }
  }
  return vdot;
}

std::vector<double> SimbodyBridge::closed_velocity(const std::vector<double>& q, const std::vector<double>& v) {
  SimTK::State& state = parts_->state;
  const SimTK::SimbodyMatterSubsystem& matter = parts_->matter;
  place(q, v);
  parts_->system.realize(state, SimTK::Stage::Velocity);
  const SimTK::Vector before = state.getU();
  SimTK::Vector slip, impulse, loads, change;
  matter.multiplyByG(state, before, slip);
  matter.solveForConstraintImpulses(state, slip, impulse);
  matter.multiplyByGTranspose(state, impulse, loads);
  matter.multiplyByMInv(state, loads, change);
  const SimTK::Vector after = before - change;
  std::vector<double> result(v.size());
  for (std::size_t i = 0; i < parts_->bodies.size(); ++i) {
    const SimbodyBody& b = parts_->given[i];
    if (b.joint == SimbodyJoint::weld) continue;
    const int u = matter.getMobilizedBody(parts_->bodies[i]).getFirstUIndex(state);
    const auto part = [&](int first) { return Vec3(after[first], after[first + 1], after[first + 2]); };
    if (b.joint == SimbodyJoint::free) {
      const SimTK::Rotation R = rotation_at(q, b.q + 3);
      write(~R * part(u), result, b.v);
      write(~R * part(u + 3), result, b.v + 3);
    } else if (b.joint == SimbodyJoint::ball) {
      write(~rotation_at(q, b.q) * part(u), result, b.v);
    } else {
      result[b.v] = after[u];
    }
  }
  return result;
}

}  // namespace grapnel::testing
