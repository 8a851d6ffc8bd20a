/// Joint wrenches: at an instant against inverse dynamics, over an impact against its impulses.

#include <gtest/gtest.h>

#include <cmath>

#include "capture/impact_case.hpp"
#include "grapnel/capture/internal_loads.hpp"
#include "grapnel/dynamics/forward_dynamics.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace joint_loads_test {

TEST(JointWrenches, MatchInverseDynamics) {
  Worst driving("driving component"), root("free root");
  for (int i = 0; i < 30; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(i);
    RobotOptions options;
    options.max_bodies = 14;
    const Model model = random_model(options, random);
    const State state = random_state(model, random);
    Forces forces = random_forces(model, state, random);
    std::vector<double> vdot(state.v.size());
    for (double& a : vdot) a = random.uniform(-2, 2);
    // Inverse dynamics with gravity and joint friction would not be comparable.
    forces.gravity = Vector3d::zero();
    const std::vector<Wrenchd> through = joint_wrenches(model, forward_kinematics(model, state), vdot, forces.external);
    const std::vector<double> tau = inverse_dynamics(model, state, vdot, forces);
    const Kinematics k = forward_kinematics(model, state);
    double scale = 0;
    for (double t : tau) scale = std::max(scale, std::abs(t));
    for (int body : model.joints()) {
      const Body& b = model.bodies()[body];
      if (velocity_count(b.description.joint.type) != 1) continue;
      const Vector3d axis = k.X_WB[body].R * b.description.joint.axis;
      const Wrenchd& F = through[body];
      const bool slides = b.description.joint.type == JointType::prismatic;
      // The joint's wrench excludes the rotor, which is on the drive's side.
      const double rotor = b.description.joint.reflected_inertia() * vdot[b.v];
      EXPECT_LT(driving.note(std::abs(dot(axis, slides ? F.linear : F.angular) + rotor - tau[b.v]) / scale, i),
                1e-12);  // 4e-15
    }
  }
}

// The shorter the impact, the closer the joint impulses are to those of an instantaneous impact.
TEST(JointWrenches, ShortImpactMatchesImpulses) {
  double previous = 0;
  for (double stiffness : {1e7, 1e9}) {
    CaptureProblem p = yielding_case(stiffness, 1);
    const CaptureResult r = simulate_impact_only(p);
    ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
    // The peak force is at least the mean force, which is the impulse divided by the duration.
    for (const JointImpulse& j : r.impact()->joints) {
      EXPECT_GE(j.peak_force * r.impact()->duration, norm(j.impulse));
      EXPECT_GT(j.peak_moment, 0);
    }
    double axis = 0, size = 0;
    for (const JointImpulse& j : r.impact()->joints)
      axis = std::max(axis, std::abs(j.along_axis)), size = std::max(size, norm(j.angular_impulse));
    // Free joints transmit nothing along their axes, except for the rotation of the axes during the impact.
    std::printf("[ measured ] along the axes %.3g of %.3g N m s\n", axis, size);
    EXPECT_LT(axis, 2e-2 * size);  // measured 4e-3, 4e-5
    if (previous > 0) {
      EXPECT_LT(axis, 0.2 * previous);
    }
    previous = axis;
  }
}

}  // namespace joint_loads_test
}  // namespace grapnel::testing
