#include "engines/simbody_contacts.hpp"

#include <cmath>

#include "engines/simbody_bodies.hpp"

namespace grapnel::testing {
namespace {

using SimTK::ContactGeometry;
using SimTK::Transform;
using SimTK::Vec3;

ContactGeometry::TriangleMesh mesh_of(const SimbodySurface& surface) {
  SimTK::Array_<Vec3> vertices;
  SimTK::Array_<int> faces;
  for (const auto& v : surface.vertices) vertices.push_back(vec3(v));
  for (const auto& face : surface.faces) {
    for (const int corner : face) faces.push_back(corner);
  }
  return ContactGeometry::TriangleMesh(vertices, faces);
}

// A sphere against a closed surface of triangles: the nearest point by Simbody, the law of (23.4) and (23.5).
class SphereOnTriangles : public SimTK::Force::Custom::Implementation {
 public:
  SphereOnTriangles(const SimTK::MobilizedBody& sphere, const SimbodySurface& a, const SimTK::MobilizedBody& other,
                    const SimbodySurface& b, const SimbodyContactLaw& law)
      : sphere_(sphere),
        other_(other),
        centre_(vec3(a.p_BG)),
        X_BG_(rotation(b.R_BG), vec3(b.p_BG)),
        mesh_(mesh_of(b)),
        radius_(a.radius),
        law_(law) {}

  void calcForce(const SimTK::State& state, SimTK::Vector_<SimTK::SpatialVec>& bodies, SimTK::Vector_<Vec3>&,
                 SimTK::Vector&) const override {
    const Vec3 p_W = sphere_.findStationLocationInGround(state, centre_);
    const Transform X_WG = other_.getBodyTransform(state) * X_BG_;
    const Vec3 p_G = X_WG.shiftBaseStationToFrame(p_W);
    bool inside = false;
    int face = 0;
    SimTK::Vec2 uv;
    const Vec3 nearest = mesh_.findNearestPoint(p_G, inside, face, uv);
    const double distance = (p_G - nearest).norm(), depth = radius_ - distance;
    if (inside) throw std::runtime_error("SphereOnTriangles: the centre is inside of the other body");
    if (!(depth > 0)) return;
    const Vec3 normal = X_WG.R() * ((p_G - nearest) / distance);  // towards the sphere
    const Vec3 at = X_WG * nearest;
    const auto velocity = [&](const SimTK::MobilizedBody& body) {
      return body.findStationVelocityInGround(state, body.findStationAtGroundPoint(state, at));
    };
    const double approach = -SimTK::dot(velocity(sphere_) - velocity(other_), normal);
    const double elastic = 4.0 / 3 * law_.modulus * std::sqrt(radius_ * depth) * depth;
    const Vec3 force = std::max(0.0, elastic * (1 + law_.dissipation * approach)) * normal;
    sphere_.applyForceToBodyPoint(state, sphere_.findStationAtGroundPoint(state, at), force, bodies);
    other_.applyForceToBodyPoint(state, other_.findStationAtGroundPoint(state, at), -force, bodies);
  }
  SimTK::Real calcPotentialEnergy(const SimTK::State&) const override { return 0; }

 private:
  const SimTK::MobilizedBody &sphere_, &other_;
  Vec3 centre_;
  Transform X_BG_;
  ContactGeometry::TriangleMesh mesh_;
  double radius_;
  SimbodyContactLaw law_;
};

// Simbody combines moduli by E^(2/3) in series, and its forces have 3/2 of the dissipation: two equal materials with
// these values have the law F = 4/3 E* sqrt(R) d^(3/2) (1 + a d').
SimTK::ContactMaterial material_of(const SimbodyContactLaw& law) {
  return SimTK::ContactMaterial(std::pow(2.0, 1.5) * law.modulus, law.dissipation / 1.5, law.friction, law.friction, 0);
}

}  // namespace

struct SimbodyContacts::Parts {
  std::vector<SimbodyBody> given;
  SimTK::MultibodySystem system;
  SimTK::SimbodyMatterSubsystem matter{system};
  SimTK::GeneralForceSubsystem forces{system};
  SimTK::ContactTrackerSubsystem tracker{system};
  SimTK::CompliantContactSubsystem contacts{system, tracker};
  std::vector<SimTK::MobilizedBodyIndex> bodies;
  SimTK::State state;

  SimTK::MobilizedBody& body(int index) {
    return index < 0 ? static_cast<SimTK::MobilizedBody&>(matter.Ground()) : matter.updMobilizedBody(bodies[index]);
  }
};

SimbodyContacts::SimbodyContacts(const std::vector<SimbodyBody>& bodies, const std::vector<SimbodySurface>& surfaces,
                                 const std::vector<SimbodyContactPair>& pairs,
                                 const std::vector<SimbodySpring>& springs, double transition_speed)
    : parts_(std::make_unique<Parts>()) {
  Parts& p = *parts_;
  p.given = bodies;
  p.bodies = add_bodies(bodies, p.matter);
  p.contacts.setTransitionVelocity(transition_speed);
  std::vector<bool> added(surfaces.size(), false);
  const auto add = [&](int index, const SimbodyContactLaw& law) {
    if (added[index]) return;
    added[index] = true;
    const SimbodySurface& s = surfaces[index];
    const Transform X_BG(rotation(s.R_BG), vec3(s.p_BG));
    if (s.kind == SimbodySurface::Kind::sphere) {
      p.body(s.body).updBody().addContactSurface(
          X_BG, SimTK::ContactSurface(ContactGeometry::Sphere(s.radius), material_of(law)));
      return;
    }
    // Simbody's half-space is x >= 0.
    const Transform to_x(SimTK::Rotation(SimTK::Pi / 2, SimTK::YAxis));
    p.body(s.body).updBody().addContactSurface(X_BG * to_x,
                                               SimTK::ContactSurface(ContactGeometry::HalfSpace(), material_of(law)));
  };
  for (const SimbodyContactPair& pair : pairs) {
    if (pair.by_simbody) {
      add(pair.a, pair.law), add(pair.b, pair.law);
      continue;
    }
    const SimbodySurface &a = surfaces[pair.a], &b = surfaces[pair.b];
    SimTK::Force::Custom(p.forces, new SphereOnTriangles(p.body(a.body), a, p.body(b.body), b, pair.law));
  }
  for (const SimbodySpring& s : springs) {
    const SimTK::MobilizedBody& body = p.body(s.body);
    SimTK::Force::MobilityLinearSpring(p.forces, body, SimTK::MobilizerQIndex(0), s.stiffness, s.rest);
    SimTK::Force::MobilityLinearDamper(p.forces, body, SimTK::MobilizerUIndex(0), s.damping);
  }
  p.state = p.system.realizeTopology();
}

SimbodyContacts::~SimbodyContacts() = default;

std::vector<SimbodyMotion> SimbodyContacts::run(const std::vector<double>& q, const std::vector<double>& v,
                                                double duration, double accuracy) {
  Parts& p = *parts_;
  place_bodies(p.given, p.bodies, p.matter, q, v, p.state);
  SimTK::RungeKuttaMersonIntegrator integrator(p.system);
  integrator.setAccuracy(accuracy);
  SimTK::TimeStepper stepper(p.system, integrator);
  stepper.initialize(p.state);
  stepper.stepTo(duration);
  evaluations_ = integrator.getNumRealizations();
  const SimTK::State& end = stepper.getState();
  p.system.realize(end, SimTK::Stage::Velocity);
  std::vector<SimbodyMotion> motions;
  for (const SimTK::MobilizedBodyIndex index : p.bodies) {
    const SimTK::MobilizedBody& body = p.matter.getMobilizedBody(index);
    const Transform& X = body.getBodyTransform(end);
    const SimTK::SpatialVec& V = body.getBodyVelocity(end);
    SimbodyMotion motion{};
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) motion.R_WB[3 * i + j] = X.R()[i][j];
      motion.p_WB[i] = X.p()[i];
      motion.twist[i] = V[0][i], motion.twist[3 + i] = V[1][i];
    }
    motions.push_back(motion);
  }
  return motions;
}

}  // namespace grapnel::testing
