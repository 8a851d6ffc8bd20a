/// Jumps of prescribed joint rates in phases with contacts between shapes: impulses in the joints, which the other
/// velocities follow.

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "grapnel/contact/contact_set.hpp"
#include "grapnel/dynamics/mass_matrix.hpp"
#include "simulate/phase_case.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace rate_jumps_test {

constexpr double kJump = 0.4;  // [s]

// A robot whose joints with an even index move as prescribed, with a jump of the rates; the others are free.
struct Jumping {
  Model model;
  State start;
  PhaseSetup setup;
};
// A contact of a body with a ball fixed far away, so that nothing touches.
std::shared_ptr<ContactSet> far_contact() {
  const auto ball = [](const Vector3d& center) {
    Geometry g;
    g.shape = Geometry::Shape::sphere, g.size = {0.01, 0, 0}, g.X_BG.p = center;
    return ContactShape(g);
  };
  ContactMaterial material;
  material.stiffness = 1e3;
  const std::vector<ContactSurface> surfaces{{0, ball(Vector3d::zero())}, {-1, ball({500, 0, 0})}};
  return std::make_shared<ContactSet>(surfaces, std::vector<SurfacePair>{{0, 1, combine(material, material), 0}}, 1);
}
Jumping jumping_robot(int i, const Vector3d& gravity) {
  Random random(i);
  RobotOptions options;
  options.min_bodies = 5, options.max_bodies = 8;
  Jumping r{random_model(options, random), {}, {}};
  r.start = random_state(r.model, random, 0.3);
  r.setup.gravity = gravity;
  r.setup.contacts = far_contact();
  r.setup.drives.resize(r.model.joints().size());
  for (std::size_t j = 0; j < r.setup.drives.size(); j += 2) {
    const Body& body = r.model.joint_body(j);
    const double q = r.start.q[body.q], middle = q + random.uniform(-0.2, 0.2);
    JointDrive& drive = r.setup.drives[j];
    drive.control = JointControl::prescribed;
    drive.trajectory = {0, JointPath{JointProfile::quintic, kJump, q, middle, r.start.v[body.v], 0.3}};
    drive.trajectory.segments.push_back(
        {kJump, 1, JointPath{JointProfile::quintic, 1 - kJump, middle, q, random.uniform(-0.5, 0.2), 0.1}});
  }
  return r;
}
const Vector3d kNoGravity{0, 0, 0}, kGravity{0.1, 0.2, -0.3};

Eigen::VectorXd as_vector(const std::vector<double>& v) {
  return Eigen::Map<const Eigen::VectorXd>(v.data(), static_cast<Eigen::Index>(v.size()));
}

// M change is not zero at the jumping joints only, and their work is the change of the kinetic energy.
TEST(RateJumps, AreImpulsesInTheJointsAlone) {
  Worst elsewhere("impulse outside of the jumping joints"), rate("rate after the jump"), work("work of the impulses");
  for (int i = 0; i < 20; ++i) {
    SCOPED_TRACE(seed_note(i));
    Jumping r = jumping_robot(i, i % 2 == 0 ? kNoGravity : kGravity);
    PhaseDynamics dynamics(r.model, r.setup);
    const PhaseOutcome first = simulate_phase(dynamics, {r.start, 0, kJump});
    ASSERT_TRUE(first.finished) << first.failure;
    const State& before = first.end_state;
    std::vector<double> y = dynamics.initial(before, kJump);
    dynamics.enter_interval(0, kJump);
    ASSERT_TRUE(dynamics.cross_break(kJump, 1, y));
    State after = before;
    std::copy_n(y.begin() + static_cast<std::ptrdiff_t>(before.q.size()), before.v.size(), after.v.begin());
    Eigen::VectorXd impulse = mass_matrix(r.model, before) * (as_vector(after.v) - as_vector(before.v));
    const double size = impulse.norm();
    EXPECT_GT(size, 1e-3);
    for (std::size_t j = 0; j < r.setup.drives.size(); j += 2) {
      const int v = r.model.joint_body(j).v;
      impulse[v] = 0;
      const double wanted = evaluate(r.setup.drives[j].trajectory, kJump).rate;
      EXPECT_LT(rate.note(std::abs(after.v[static_cast<std::size_t>(v)] - wanted), i), 1e-13);
    }
    EXPECT_LT(elsewhere.note(impulse.norm() / size, i), 1e-11);
    const double gained = totals(r.model, after).energy - totals(r.model, before).energy;
    EXPECT_GT(std::abs(gained), 1e-4);
    EXPECT_LT(work.note(std::abs(gained - dynamics.integrals(y).motor_work) / totals(r.model, before).energy, i),
              1e-11);
  }
}

// In a whole phase, with momenta that are recovered or integrated.
TEST(RateJumps, KeepTheBalancesOfAPhase) {
  Worst momentum("momentum across a jump of rates"), energy("energy across a jump of rates");
  for (int i = 0; i < 20; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Jumping r = jumping_robot(i, i % 2 == 0 ? kNoGravity : kGravity);
    PhaseDynamics dynamics(r.model, r.setup);
    const Totals before = totals(r.model, r.start);
    IntegrationSetup integration;
    integration.relative_tolerance = 1e-13, integration.absolute_tolerance = 1e-14;
    double off = 0, lost = 0, largest = 0, most = 0;
    const auto size = [](const Momentumd& h) { return norm(h.angular) + norm(h.linear); };
    const PhaseOutcome o =
        simulate_phase(dynamics, {r.start, 0, 1, 0.05}, integration, {.observe = [&](const PhaseSample& s) {
                         const Totals now = totals(r.model, s.state);
                         largest = std::max(largest, size(now.momentum)), most = std::max(most, now.energy);
                         off = std::max(off, size(now.momentum - before.momentum - s.integrals.external_impulse));
                         lost = std::max(lost, std::abs(now.energy - before.energy - s.integrals.motor_work -
                                                        s.integrals.friction_work - s.integrals.external_work));
                       }});
    ASSERT_TRUE(o.finished) << o.failure;
    EXPECT_LT(momentum.note(off / largest, i), 1e-11);
    EXPECT_LT(energy.note(lost / most, i), 1e-11);
  }
}

// Joints that begin with other rates than prescribed: as in a jump.
TEST(RateJumps, AtTheBeginOfAPhaseKeepMomentum) {
  Worst momentum("momentum at the begin of a phase");
  for (int i = 0; i < 20; ++i) {
    SCOPED_TRACE(seed_note(i));
    Jumping r = jumping_robot(i, i % 2 == 0 ? kNoGravity : kGravity);
    for (const int body : r.model.joints()) r.start.v[static_cast<std::size_t>(r.model.bodies()[body].v)] += 0.2;
    PhaseDynamics dynamics(r.model, r.setup);
    const Totals before = totals(r.model, r.start);
    const State begun = dynamics.on_references(r.start, 0);
    const Momentumd change = totals(r.model, begun).momentum - before.momentum;
    EXPECT_LT(momentum.note((norm(change.angular) + norm(change.linear)) / norm(before.momentum.linear), i), 1e-12);
    const Body& joint = r.model.joint_body(0);
    EXPECT_EQ(begun.v[static_cast<std::size_t>(joint.v)], evaluate(r.setup.drives[0].trajectory, 0).rate);
    const PhaseOutcome o = simulate_phase(dynamics, {r.start, 0, 0.1});
    ASSERT_TRUE(o.finished) << o.failure;
    const Momentumd later = totals(r.model, o.end_state).momentum - before.momentum - o.integrals.external_impulse;
    EXPECT_LT((norm(later.angular) + norm(later.linear)) / norm(before.momentum.linear), 1e-9);
  }
}

}  // namespace rate_jumps_test
}  // namespace grapnel::testing
