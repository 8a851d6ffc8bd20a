// Closed loops against Simbody, whose loop constraints are exact like Grapnel's: accelerations with constraint forces,
// and the impulses that close loops. Cases: random servicers with two to four arms (tests/constraint), and two arms
// welded at their ends. Rotors are removed because Simbody has no reflected inertia.
#include <gtest/gtest.h>

#include "constraint/closed_case.hpp"
#include "engines/simbody_engine.hpp"
#include "support/eigen_values.hpp"
#include "support/worst.hpp"

namespace grapnel {
namespace closed_loops_test {

using namespace testing;

constexpr double kBound = 1e-8;

Model without_rotors(const Model& model) {
  ModelBuilder builder;
  for (const Body& b : model.bodies()) {
    BodyDescription description = b.description;
    description.joint.rotor_inertia = 0;
    builder.add(description);
  }
  return builder.build();
}

std::vector<double> accelerations(const ClosedCase& c) {
  LoopSolver solver(c.model, c.closures);
  Workspace workspace(c.model);
  std::vector<double> vdot(c.model.velocities()), force(vdot);
  solver.accelerations(dynamics_input(c.model, c.state, c.loads, workspace), 0, workspace, vdot, force);
  return vdot;
}

Forces forces_of(const ClosedCase& c) {
  Forces forces;
  forces.generalized = c.loads.tau, forces.external = c.loads.external, forces.gravity = c.loads.gravity;
  return forces;
}

void compare(const ClosedCase& c, int i, Worst& acceleration, Worst& impact) {
  SimbodyEngine engine(c.model, c.closures);
  const std::vector<double> a = accelerations(c), other = engine.acceleration(c.state, forces_of(c));
  EXPECT_LE(acceleration.note(relative_difference(eigen(other), eigen(a)), i), kBound);
  // measured 3.1e-13, two arms 1.9e-14; 1.0e-10 over 5 further seeds

  State open = c.state;
  Random random(i + 500'000);
  for (double& v : open.v) v += random.uniform(-1, 1);
  const std::vector<double> simbody = engine.closed_velocity(open);
  LoopSolver solver(c.model, c.closures);
  Workspace workspace(c.model);
  solver.close_velocities(open.q, {}, workspace, open.v);
  EXPECT_LE(impact.note(relative_difference(eigen(simbody), eigen(open.v)), i), kBound);
  // measured 2.0e-11, two arms 7.3e-15; 1.3e-11 over 5 further seeds
}

TEST(SimbodyLoops, AgreesOnRandomServicers) {
  Worst acceleration("closed loops, Simbody, |a - a'| / |a|"), impact("closing impact, Simbody, |v - v'| / |v|");
  for (int i = 0; i < kClosed; ++i) {
    SCOPED_TRACE(seed_note(i));
    ClosedCase c = random_closed(i);
    c.model = without_rotors(c.model);
    compare(c, i, acceleration, impact);
    if (HasFailure()) return;
  }
}

// The robots of docs/performance.md: two arms of 3 joints about z (the loop has rank 3 of 6) and of 7 about z and y.
TEST(SimbodyLoops, AgreesOnTwoArmsWeldedAtTheirEnds) {
  Worst acceleration("two arms, Simbody, |a - a'| / |a|"), impact("two arms, closing impact, Simbody");
  for (const int joints : {3, 7}) {
    for (int i = 0; i < 20; ++i) {
      Random random(1000 * joints + i);
      ModelBuilder builder;
      BodyDescription base;
      base.name = base.joint.name = "base", base.joint.type = JointType::free;
      base.mass = 500, base.inertia = Symmetric3d::diagonal(83.61, 83.61, 83.61);
      builder.add(base);
      for (int n = 0; n < 2 * joints; ++n) {
        const bool first = n % joints == 0;
        BodyDescription link;
        link.name = "link" + std::to_string(n), link.joint.name = "joint" + std::to_string(n);
        link.parent = first ? "base" : "link" + std::to_string(n - 1);
        link.X_PF.p = first ? Vector3d{n == 0 ? 0.5 : -0.5, 0, 0} : Vector3d{1, 0, 0};
        link.joint.type = JointType::revolute;
        link.joint.axis = joints == 7 && n % joints % 2 == 1 ? Vector3d{0, 1, 0} : Vector3d{0, 0, 1};
        link.mass = 10, link.com = {0.5, 0, 0}, link.inertia = Symmetric3d::diagonal(0.05, 1.05, 1.05);
        builder.add(link);
      }
      ClosedCase c{builder.build(), {}, {}, {}};
      c.state = random_state(c.model, random);
      LoopClosure weld;
      weld.name = "ends";
      weld.body_a = c.model.body_index("link" + std::to_string(joints - 1));
      weld.body_b = c.model.body_index("link" + std::to_string(2 * joints - 1));
      weld.X_AC = {Rotationd::identity(), {1, 0, 0}};
      const Kinematics k = forward_kinematics(c.model, c.state);
      weld.X_BD = inverse(k.X_WB[weld.body_b]) * (k.X_WB[weld.body_a] * weld.X_AC);
      c.closures = {weld};
      LoopSolver solver(c.model, c.closures);
      Workspace workspace(c.model);
      solver.close_velocities(c.state.q, {}, workspace, c.state.v);
      EXPECT_EQ(solver.rank(), joints == 3 ? 3 : 6);
      const Forces forces = random_forces(c.model, c.state, random);
      c.loads.tau = forces.generalized, c.loads.external = forces.external, c.loads.gravity = forces.gravity;
      compare(c, 1000 * joints + i, acceleration, impact);
    }
  }
}

}  // namespace closed_loops_test
}  // namespace grapnel
