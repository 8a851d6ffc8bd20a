#include "engines/simbody_bodies.hpp"

namespace grapnel::testing {
namespace {

using SimTK::Vec3;

SimTK::Body::Rigid rigid_body(const SimbodyBody& b) {
  const auto& I = b.inertia;
  const SimTK::Inertia central(I[0], I[1], I[2], I[3], I[4], I[5]);
  return SimTK::Body::Rigid(
      SimTK::MassProperties(b.mass, vec3(b.com), central.shiftFromMassCenter(-vec3(b.com), b.mass)));
}

}  // namespace

std::vector<SimTK::MobilizedBodyIndex> add_bodies(const std::vector<SimbodyBody>& given,
                                                  SimTK::SimbodyMatterSubsystem& matter) {
  using SimTK::MobilizedBody;
  using SimTK::Transform;
  std::vector<SimTK::MobilizedBodyIndex> bodies;
  for (const SimbodyBody& b : given) {
    MobilizedBody& parent = matter.updMobilizedBody(b.parent < 0 ? SimTK::GroundIndex : bodies[b.parent]);
    const Transform X_PF(rotation(b.R_PF), vec3(b.p_PF));
    const SimTK::Body::Rigid body = rigid_body(b);
    // A pin rotates about z, a slider moves along x of the joint's frames; both frames are rotated to align with the
    // axis.
    const auto along = [&](SimTK::CoordinateAxis axis) {
      return Transform(SimTK::Rotation(SimTK::UnitVec3(vec3(b.axis)), axis));
    };
    switch (b.joint) {
      case SimbodyJoint::free:
        bodies.push_back(MobilizedBody::Free(parent, Transform(), body, Transform()));
        break;
      case SimbodyJoint::ball:
        bodies.push_back(MobilizedBody::Ball(parent, X_PF, body, Transform()));
        break;
      case SimbodyJoint::weld:
        bodies.push_back(MobilizedBody::Weld(parent, X_PF, body, Transform()));
        break;
      case SimbodyJoint::pin: {
        const Transform A = along(SimTK::ZAxis);
        bodies.push_back(MobilizedBody::Pin(parent, X_PF * A, body, A));
        break;
      }
      case SimbodyJoint::slider: {
        const Transform A = along(SimTK::XAxis);
        bodies.push_back(MobilizedBody::Slider(parent, X_PF * A, body, A));
        break;
      }
    }
  }
  return bodies;
}

void place_bodies(const std::vector<SimbodyBody>& given, const std::vector<SimTK::MobilizedBodyIndex>& bodies,
                  const SimTK::SimbodyMatterSubsystem& matter, const std::vector<double>& q,
                  const std::vector<double>& v, SimTK::State& state) {
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const SimbodyBody& b = given[i];
    const SimTK::MobilizedBody& body = matter.getMobilizedBody(bodies[i]);
    if (b.joint == SimbodyJoint::weld) continue;
    if (b.joint == SimbodyJoint::free) {
      // Simbody: quaternion, position; [angular; linear] in W.
      const SimTK::Rotation R = rotation_at(q, b.q + 3);
      SimTK::Vector coordinates(7);
      for (int k = 0; k < 4; ++k) coordinates[k] = q[b.q + 3 + k];
      for (int k = 0; k < 3; ++k) coordinates[4 + k] = q[b.q + k];
      body.setQFromVector(state, coordinates);
      for (int half = 0; half < 2; ++half) {
        const Vec3 rate = R * vec3(v, b.v + 3 * half);
        for (int k = 0; k < 3; ++k) body.setOneU(state, 3 * half + k, rate[k]);
      }
    } else if (b.joint == SimbodyJoint::ball) {
      // Simbody: the angular velocity in the parent's joint frame.
      const Vec3 rate = rotation_at(q, b.q) * vec3(v, b.v);
      for (int k = 0; k < 4; ++k) body.setOneQ(state, k, q[b.q + k]);
      for (int k = 0; k < 3; ++k) body.setOneU(state, k, rate[k]);
    } else {
      body.setOneQ(state, 0, q[b.q]), body.setOneU(state, 0, v[b.v]);
    }
  }
}

}  // namespace grapnel::testing
