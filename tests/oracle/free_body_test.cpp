#include "oracle/free_body.hpp"

#include <gtest/gtest.h>

#include "dynamics/random_case.hpp"
#include "support/worst.hpp"

namespace grapnel {
namespace free_body_test {

using namespace testing;

oracle::SymmetricTop random_top(Random& random) {
  const double transverse = random.uniform(1, 5);
  return {transverse,
          random.uniform(0.2, 1.9) * transverse,
          {random.rotation(), random.vector(2)},
          random.vector(2),
          random.vector(1)};
}

// The closed form satisfies its kinematics and Euler's equations, in Grapnel's form, at any time.
TEST(SymmetricTop, ObeysGrapnelsEquationsOfMotion) {
  Worst kinematics("symmetric top, quaternion rates"), dynamics("symmetric top, accelerations");
  for (int i = 0; i < 100; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(i);
    const oracle::SymmetricTop top = random_top(random);
    BodyDescription b;
    b.name = "top", b.joint.type = JointType::free, b.mass = 3;
    b.inertia = Symmetric3d::diagonal(top.transverse, top.transverse, top.axial);
    const Model model = ModelBuilder().add(b).build();
    const double t = random.uniform(0, 20);
    const auto state_at = [&](double time) {
      State s = zero_state(model);
      set_root_pose(model, 0, top.pose(time), s);
      set_root_twist(model, 0, {top.pose(time).R * top.angular_velocity_B(time), top.v_W}, s);
      return s;
    };
    const State state = state_at(t);
    const Rotationd R = top.pose(t).R;
    const Eigen::Vector3d turn = derivative(
        [&](double h) -> Eigen::Vector3d { return eigen(rotation_vector(transpose(R) * top.pose(t + h).R)); }, 1e-3);
    ASSERT_LT(kinematics.note((turn - eigen(top.angular_velocity_B(t))).norm(), i),
              1e-9);  // measured 6.1e-12, of the stencil
    const std::vector<double> vdot = forward_dynamics(model, state);
    const Eigen::VectorXd expected =
        derivative([&](double h) -> Eigen::VectorXd { return eigen(state_at(t + h).v); }, 1e-3);
    ASSERT_LT(dynamics.note((eigen(vdot) - expected).norm(), i), 1e-9);  // measured 1.4e-11, of the stencil
  }
}

}  // namespace free_body_test
}  // namespace grapnel
