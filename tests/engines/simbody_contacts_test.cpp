// Contacts between shapes against Simbody: its multibody dynamics, its integrator, its contact forces of spheres and
// half-spaces, and its nearest points of triangle meshes are independent of Grapnel's.
#include <gtest/gtest.h>

#include <cstdio>
#include <memory>

#include "engines/contact_scene.hpp"
#include "engines/simbody_contacts.hpp"
#include "engines/simbody_engine.hpp"
#include "grapnel/simulate/simulate_phase.hpp"

namespace grapnel {
namespace simbody_contacts_test {

using namespace testing;
using Shape = Geometry::Shape;

// Triangles of the hull of a few points: those that have all points on one side, with normals outwards.
std::vector<std::array<int, 3>> hull_faces(const std::vector<Vector3d>& points) {
  std::vector<std::array<int, 3>> faces;
  const int n = static_cast<int>(points.size());
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      for (int k = 0; k < n; ++k) {
        if (i >= j || i >= k || j == k) continue;  // each cyclic order once
        const Vector3d normal = cross(points[j] - points[i], points[k] - points[i]);
        bool outside = true;
        for (int l = 0; l < n; ++l)
          outside = outside && (l == i || l == j || l == k || dot(normal, points[l] - points[i]) < 0);
        if (outside) faces.push_back({i, j, k});
      }
    }
  }
  return faces;
}

// Two triangles of each side of a box. The bits of a corner's index are the signs of its coordinates.
std::vector<std::array<int, 3>> box_faces() {
  const int sides[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  std::vector<std::array<int, 3>> faces;
  for (const auto& side : sides) {
    faces.push_back({side[0], side[1], side[2]});
    faces.push_back({side[0], side[2], side[3]});
  }
  return faces;
}

SimbodySurface surface_of(const EngineSurface& s) {
  using Kind = SimbodySurface::Kind;
  const Geometry& g = s.geometry;
  const Kind kind = s.half_space ? Kind::half_space : g.shape == Shape::sphere ? Kind::sphere : Kind::triangles;
  SimbodySurface result{s.body, kind, plain(g.X_BG.R), plain(g.X_BG.p), g.size[0], {}, {}};
  if (kind != Kind::triangles) return result;
  if (g.shape == Shape::box) {
    for (int corner = 0; corner < 8; ++corner) {
      const auto half = [&](int axis) { return (corner >> axis & 1 ? 0.5 : -0.5) * g.size[axis]; };
      result.vertices.push_back({half(0), half(1), half(2)});
    }
    result.faces = box_faces();
  } else {
    for (const Vector3d& v : g.mesh->vertices) result.vertices.push_back(plain(v));
    result.faces = hull_faces(g.mesh->vertices);
  }
  return result;
}

std::vector<SimbodyMotion> by_simbody(const ContactScene& scene, double duration, double accuracy) {
  std::vector<SimbodySurface> surfaces;
  for (const EngineSurface& s : scene.surfaces) surfaces.push_back(surface_of(s));
  std::vector<SimbodyContactPair> pairs;
  for (const SurfacePair& p : scene.pairs) {
    const bool own = surfaces[p.b].kind != SimbodySurface::Kind::triangles;
    pairs.push_back({p.a, p.b, {p.law.elastic, p.law.dissipation, p.law.kinetic_friction}, own});
  }
  std::vector<SimbodySpring> springs;
  for (std::size_t i = 0; i < scene.model.bodies().size(); ++i) {
    if (const auto& spring = scene.model.bodies()[i].description.joint.spring)
      springs.push_back({static_cast<int>(i), spring->stiffness, spring->damping, spring->rest});
  }
  SimbodyContacts engine(plain_bodies(scene.model), surfaces, pairs, springs, 1e-3);
  std::vector<SimbodyMotion> motion = engine.run(scene.state.q, scene.state.v, duration, accuracy);
  std::printf("[ measured ] Simbody, accuracy %.0e: %ld evaluations\n", accuracy, engine.evaluations());
  return motion;
}

struct Outcome {
  std::vector<SimbodyMotion> motion;
  std::vector<double> impulses;
};

Outcome by_grapnel(const ContactScene& scene, double duration) {
  const auto contacts = std::make_shared<ContactSet>(scene.contacts());
  PhaseSetup setup;
  setup.contacts = contacts;
  PhaseDynamics dynamics(scene.model, setup);
  IntegrationSetup integration;
  integration.relative_tolerance = integration.absolute_tolerance = 1e-12;
  const PhaseOutcome outcome = simulate_phase(dynamics, {scene.state, 0, duration}, integration, {});
  EXPECT_TRUE(outcome.finished) << outcome.failure;
  const Kinematics k = forward_kinematics(scene.model, outcome.end_state);
  Outcome result;
  for (std::size_t i = 0; i < scene.model.bodies().size(); ++i) {
    const Twistd& V = k.V_WB[i];
    result.motion.push_back({plain(k.X_WB[i].R),
                             plain(k.X_WB[i].p),
                             {V.angular[0], V.angular[1], V.angular[2], V.linear[0], V.linear[1], V.linear[2]}});
  }
  for (std::size_t g = 0; g < scene.pairs.size(); ++g) {
    result.impulses.push_back(outcome.integrals.contacts[g].impulse);
    std::printf("[ measured ] pair %zu: touches %d, impulse %.4g N s\n", g, contacts->history(g).touches,
                result.impulses.back());
  }
  return result;
}

// Largest differences of positions [m], entries of rotation matrices, velocities [m/s] and angular velocities [rad/s].
struct Difference {
  double position = 0, rotation = 0, velocity = 0, angular_velocity = 0;
};
Difference between(const std::vector<SimbodyMotion>& a, const std::vector<SimbodyMotion>& b, const char* name) {
  Difference d;
  const auto raise = [](double& largest, double x, double y) { largest = std::max(largest, std::abs(x - y)); };
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (int k = 0; k < 9; ++k) raise(d.rotation, a[i].R_WB[k], b[i].R_WB[k]);
    for (int k = 0; k < 3; ++k) {
      raise(d.position, a[i].p_WB[k], b[i].p_WB[k]);
      raise(d.angular_velocity, a[i].twist[k], b[i].twist[k]);
      raise(d.velocity, a[i].twist[3 + k], b[i].twist[3 + k]);
    }
  }
  std::printf("[ measured ] %s: %.2g m, rotations %.2g, %.2g m/s, %.2g rad/s\n", name, d.position, d.rotation,
              d.velocity, d.angular_velocity);
  return d;
}

TEST(SimbodyContacts, AgreeOnSpheresWithSpheresHalfSpacesBoxesAndHulls) {
  const ContactScene scene = sphere_scene();
  const Outcome ours = by_grapnel(scene, 2);
  for (std::size_t i = 0; i < scene.pairs.size(); ++i) EXPECT_GT(ours.impulses[i], 0.4) << i;
  const Difference d = between(by_simbody(scene, 2, 1e-11), ours.motion, "two arms and six bodies");
  EXPECT_LT(d.position, 1e-8);
  EXPECT_LT(d.rotation, 1e-8);
  EXPECT_LT(d.velocity, 1e-8);
  EXPECT_LT(d.angular_velocity, 1e-8);
}

// While contact slides, both laws of friction are Coulomb's. Before, the deformation of Grapnel's law grows over the
// stiction displacement.
TEST(SimbodyContacts, AgreeOnSlidingFriction) {
  double last = INFINITY;
  for (const double displacement : {1e-3, 1e-4, 1e-5}) {
    const ContactScene scene = sliding_balls(displacement);
    const Outcome ours = by_grapnel(scene, 0.4);
    for (const double impulse : ours.impulses) EXPECT_GT(impulse, 0.3);
    const Difference d = between(by_simbody(scene, 0.4, 1e-11), ours.motion, "sliding balls");
    EXPECT_LT(d.angular_velocity, 0.2 * last) << displacement;
    last = d.angular_velocity;
  }
  EXPECT_LT(last, 2e-6);
}

}  // namespace simbody_contacts_test
}  // namespace grapnel
