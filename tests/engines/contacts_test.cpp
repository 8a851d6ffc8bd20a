// Contacts between shapes against MuJoCo: a free-floating robot of two arms and six bodies, seven pairs of shapes that
// touch, some at the same time. MuJoCo's collision detection, multibody dynamics and Runge-Kutta method are independent
// of Grapnel's; the laws are the same functions of the depth, either as user forces or by MuJoCo's own solver.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>

#include "engines/contact_scene.hpp"
#include "grapnel/simulate/simulate_phase.hpp"
#include "support/random_robot.hpp"
#include "support/worst.hpp"

namespace grapnel {
namespace contacts_test {

using namespace testing;

constexpr double kDuration = 2;

struct Motion {
  State end;
  std::vector<double> impulses;  // per pair [N s]
  std::vector<int> touches;
};

Motion by_grapnel(const ContactScene& scene) {
  const auto contacts = std::make_shared<ContactSet>(scene.contacts());
  PhaseSetup setup;
  setup.contacts = contacts;
  PhaseDynamics dynamics(scene.model, setup);
  IntegrationSetup integration;
  integration.relative_tolerance = integration.absolute_tolerance = 1e-12;
  const PhaseOutcome outcome = simulate_phase(dynamics, {scene.state, 0, kDuration}, integration, {});
  EXPECT_TRUE(outcome.finished) << outcome.failure;
  Motion motion{outcome.end_state, {}, {}};
  for (std::size_t g = 0; g < scene.pairs.size(); ++g) {
    motion.impulses.push_back(outcome.integrals.contacts[g].impulse);
    motion.touches.push_back(contacts->history(g).touches);
  }
  return motion;
}

Motion by_mujoco(const ContactScene& scene, const MujocoContacts::Settings& settings) {
  MujocoContacts engine(scene.model, scene.surfaces, scene.pairs, settings);
  engine.start(scene.state);
  engine.run(kDuration);
  Motion motion{engine.state(), {}, {}};
  for (std::size_t i = 0; i < scene.pairs.size(); ++i) motion.impulses.push_back(engine.impulse(i));
  if (engine.mesh_depth_error() > 0)
    std::printf("[ measured ] error of MuJoCo's depths of the ball in the hull: up to %.2g m\n",
                engine.mesh_depth_error());
  return motion;
}

// Differences are proportional to the impedance, here of the ratio 4.
Motion extrapolated(const Motion& soft, const Motion& hard) {
  const auto limit = [](const std::vector<double>& a, std::vector<double> b) {
    for (std::size_t i = 0; i < a.size(); ++i) b[i] += (b[i] - a[i]) / 3;
    return b;
  };
  Motion motion = hard;
  motion.end.q = limit(soft.end.q, hard.end.q), motion.end.v = limit(soft.end.v, hard.end.v);
  motion.impulses = limit(soft.impulses, hard.impulses);
  return motion;
}

// Largest differences of the coordinates [m, rad], velocities [m/s, rad/s] and impulses [N s].
struct Difference {
  double position = 0, velocity = 0, impulse = 0;
};
Difference between(const Motion& a, const Motion& b) {
  Difference d;
  for (std::size_t i = 0; i < a.end.q.size(); ++i) d.position = std::max(d.position, std::abs(a.end.q[i] - b.end.q[i]));
  for (std::size_t i = 0; i < a.end.v.size(); ++i) d.velocity = std::max(d.velocity, std::abs(a.end.v[i] - b.end.v[i]));
  for (std::size_t i = 0; i < a.impulses.size(); ++i)
    d.impulse = std::max(d.impulse, std::abs(a.impulses[i] - b.impulses[i]));
  return d;
}
void print(const char* name, const Difference& d) {
  std::printf("[ measured ] %s: coordinates %.2g, velocities %.2g, impulses %.2g N s\n", name, d.position, d.velocity,
              d.impulse);
}

// Distances of points from the hull against the triangles of all its vertices.
TEST(MujocoContacts, DistancesFromTheHullAreThoseOfItsTriangles) {
  const ContactScene scene = two_arm_scene(false);
  const EngineSurface& rock = scene.surfaces[scene.pairs[2].b];
  const ContactShape shape = rock.grapnel().shape;
  Worst error("distance from the hull");
  Random random(1);
  for (int i = 0; i < 2000; ++i) {
    const Vector3d p = random.uniform(0.2, 0.35) * random.direction();
    const CoreDistance ours = shape.distance(inverse(shape.X_BC()) * p);
    if (!(ours.distance > 0)) continue;
    const Vector3d to = to_hull(p, rock.geometry.mesh->vertices);
    ASSERT_LT(error.note(norm(to + ours.distance * (shape.X_BC().R * ours.normal)), i), 1e-13);
  }
}

// The side of the capsule is an integral along its axis here, and a sum over spheres there, which converges to it.
TEST(MujocoContacts, AgreeOnLawsAsUserForces) {
  const ContactScene scene = two_arm_scene(false);
  const Motion ours = by_grapnel(scene);
  for (std::size_t i = 0; i < scene.pairs.size(); ++i) {
    std::printf("[ measured ] pair %zu: touches %d, impulse %.4g N s\n", i, ours.touches[i], ours.impulses[i]);
    EXPECT_GE(ours.touches[i], 1) << i;
    EXPECT_GT(ours.impulses[i], 0.4) << i;
  }
  MujocoContacts::Settings settings;
  settings.step = 2e-4, settings.side_spheres = 75;
  const Difference coarse = between(by_mujoco(scene, settings), ours);
  settings.side_spheres = 300;
  const Difference fine = between(by_mujoco(scene, settings), ours);
  print("MuJoCo's collisions, 75 spheres", coarse), print("MuJoCo's collisions, 300 spheres", fine);
  EXPECT_LT(fine.position, 2e-6);
  EXPECT_LT(fine.velocity, 2e-5);
  EXPECT_LT(fine.impulse, 2e-5);
  EXPECT_LT(4 * fine.velocity, coarse.velocity);
}

// MuJoCo's solver of soft constraints differs by a term proportional to the impedance.
TEST(MujocoContacts, AgreeWithMujocosSolverInTheLimit) {
  const ContactScene scene = two_arm_scene(true);
  const Motion ours = by_grapnel(scene);
  for (std::size_t i = 0; i < scene.pairs.size(); ++i) EXPECT_GT(ours.impulses[i], 0.4) << i;
  MujocoContacts::Settings settings;
  settings.route = MujocoContacts::Route::solver, settings.step = 2e-4;
  settings.impedance = 4e-4;
  const Motion soft = by_mujoco(scene, settings);
  settings.impedance = 1e-4;
  const Motion hard = by_mujoco(scene, settings);
  const Difference with_soft = between(soft, ours), with_hard = between(hard, ours);
  const Difference with_limit = between(extrapolated(soft, hard), ours);
  print("MuJoCo's solver, impedance 4e-4", with_soft), print("MuJoCo's solver, impedance 1e-4", with_hard);
  print("MuJoCo's solver, extrapolated to impedance 0", with_limit);
  EXPECT_LT(with_limit.position, 1e-5);
  EXPECT_LT(with_limit.velocity, 2e-5);
  EXPECT_LT(with_limit.impulse, 2e-5);
  EXPECT_GT(with_soft.velocity, 3 * with_hard.velocity);
}

}  // namespace contacts_test
}  // namespace grapnel
