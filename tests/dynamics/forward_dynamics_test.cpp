// Forward dynamics against equivalent computations: mass matrix and bias, inverse dynamics, the partitioned equations
// for prescribed joints, changes of frame, and energy.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "dynamics/random_case.hpp"
#include "grapnel/dynamics/momentum.hpp"
#include "grapnel/spatial/decompositions.hpp"
#include "support/worst.hpp"

namespace grapnel {
namespace forward_dynamics_test {

using namespace testing;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

TEST(ForwardDynamics, SolvesTheMassMatrixEquation) {
  Worst residual("|M a + c - tau - J^T F| / (|M||a| + |c| + |tau|)"), difference("|ABA - M^-1(...)| / |...|");
  for (int i = 0; i < kRobots; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Case c = random_case(i);
    if (c.model.velocities() == 0) continue;
    const Eigen::MatrixXd M = mass_matrix(c.model, c.state);
    const Eigen::VectorXd h = bias_of(c), tau = eigen(c.forces.generalized);
    const Eigen::VectorXd rhs = tau + external_forces(c) - h;
    const std::vector<double> vdot = forward_dynamics(c.model, c.state, c.forces);
    const Eigen::VectorXd a = eigen(vdot);
    const double scale = M.norm() * a.norm() + h.norm() + tau.norm();
    ASSERT_LT(residual.note((M * a - rhs).norm() / scale, i), 2e-14);                         // measured 8.1e-16
    ASSERT_LT(difference.note(relative_difference(a, M.llt().solve(rhs).eval()), i), 1e-10);  // measured 2.7e-13
  }
}

TEST(ForwardDynamics, InvertsInverseDynamics) {
  Worst difference("inverse dynamics of forward dynamics, forces");
  for (int i = 0; i < kRobots; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Case c = random_case(i);
    const std::vector<double> vdot = forward_dynamics(c.model, c.state, c.forces);
    const std::vector<double> tau = inverse_dynamics(c.model, c.state, vdot, c.forces);
    const Eigen::VectorXd given = eigen(c.forces.generalized);
    const double scale = mass_matrix(c.model, c.state).norm() * eigen(vdot).norm() + given.norm() + 1;
    ASSERT_LT(difference.note((eigen(tau) - given).norm() / scale, i), 1e-14);  // measured 2.5e-16
  }
}

TEST(ForwardDynamics, EmptyForcesAreZero) {
  const Case c = random_case(2);
  Forces zero;
  zero.generalized.assign(c.model.velocities(), 0.0);
  EXPECT_EQ(forward_dynamics(c.model, c.state), forward_dynamics(c.model, c.state, zero));
}

// Joints and roots with given accelerations, against the partitioned mass matrix:
//   M_ff a_f = tau_f - c_f - M_fp a_p,   tau_p = M_p a + c_p.
TEST(ForwardDynamics, PrescribedJointsFollowThePartitionedEquations) {
  Worst accelerations("hybrid dynamics, accelerations"), forces("hybrid dynamics, forces");
  for (int i = 0; i < kRobots; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Case c = random_case(i);
    Random random(100000 + i);
    const int n = c.model.velocities();
    std::vector<std::uint8_t> prescribed(n, 0);
    std::vector<int> given, free;
    for (const Body& b : c.model.bodies()) {
      const bool chosen = random.chance(b.parent < 0 ? 0.3 : 0.4);
      for (int k = 0; k < velocity_count(b.description.joint.type); ++k) {
        prescribed[b.v + k] = chosen;
        (chosen ? given : free).push_back(b.v + k);
      }
    }
    const std::vector<double> a_given = random.values(n, 5);
    DynamicsInput<double> in;
    in.q = c.state.q, in.v = c.state.v, in.force = c.forces.generalized, in.prescribed = prescribed;
    in.acceleration = a_given, in.gravity = c.forces.gravity;
    DynamicsWorkspace<double> workspace(c.model.tree());
    std::vector<double> vdot(n, NAN), force(n, NAN);
    articulated_body<double>(c.model.tree(), in, workspace, vdot, force);

    const Eigen::MatrixXd M = mass_matrix(c.model, c.state);
    const Eigen::VectorXd h = bias_of(c);
    Eigen::VectorXd a = eigen(a_given), tau = eigen(c.forces.generalized);
    if (!free.empty()) {
      const Eigen::VectorXd rhs = tau(free) - h(free) - M(free, given) * a(given);
      a(free) = Eigen::MatrixXd(M(free, free)).llt().solve(rhs).eval();
    }
    if (!given.empty()) tau(given) = M(given, Eigen::all) * a + h(given);
    const double force_scale = M.norm() * a.norm() + h.norm() + 1;
    ASSERT_LT(accelerations.note(relative_difference(eigen(vdot), a), i), 1e-10);  // measured 7.6e-13
    ASSERT_LT(forces.note((eigen(force) - tau).norm() / force_scale, i), 1e-13);   // measured 2.7e-16
  }
}

// In a frame that drifts at constant velocity u, nothing but d(v_B)/dt = R^T a - w x v_B changes.
TEST(ForwardDynamics, IsGalileanInvariant) {
  Worst difference("Galilean invariance");
  for (int i = 0; i < kRobots; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Case c = random_case(i);
    Random random(100000 + i);
    State drifting = c.state;
    std::vector<double> expected = forward_dynamics(c.model, c.state, c.forces);
    for (std::size_t b = 0; b < c.model.bodies().size(); ++b) {
      const Body& body = c.model.bodies()[b];
      if (body.description.joint.type != JointType::free) continue;
      Twistd V = root_twist(c.model, c.state, static_cast<int>(b));
      const Vector3d u = random.vector(3);
      V.linear += u;
      set_root_twist(c.model, static_cast<int>(b), V, drifting);
      const Rotationd R = root_pose(c.model, c.state, static_cast<int>(b)).R;
      const Vector3d turn = transposed_times(R, cross(V.angular, u));
      for (int k = 0; k < 3; ++k) expected[body.v + 3 + k] -= turn[k];
    }
    const std::vector<double> vdot = forward_dynamics(c.model, drifting, c.forces);
    ASSERT_LT(difference.note((eigen(vdot) - eigen(expected)).norm() / (eigen(expected).norm() + 1), i), 1e-11);
    // measured 5.1e-15
  }
}

// Free fall: gravity accelerates the roots and no joint.
TEST(ForwardDynamics, FallsFreely) {
  Worst difference("free fall"), joint_rates("joint accelerations in free fall from rest [rad/s^2, m/s^2]");
  for (int i = 0; i < kRobots; ++i) {
    if (i % 4 == 3) continue;  // a fixed root does not fall
    SCOPED_TRACE(seed_note(i));
    const Case c = random_case(i);
    Forces without = c.forces;
    without.gravity = Vector3d::zero();
    std::vector<double> expected = forward_dynamics(c.model, c.state, without);
    for (std::size_t b = 0; b < c.model.bodies().size(); ++b) {
      const Body& body = c.model.bodies()[b];
      if (body.parent >= 0) continue;
      const Vector3d g = transposed_times(root_pose(c.model, c.state, static_cast<int>(b)).R, c.forces.gravity);
      for (int k = 0; k < 3; ++k) expected[body.v + 3 + k] += g[k];
    }
    const std::vector<double> vdot = forward_dynamics(c.model, c.state, c.forces);
    ASSERT_LT(difference.note(relative_difference(eigen(vdot), eigen(expected)), i), 1e-13);  // measured 7.8e-17

    // At rest no joint force is needed, and the roots accelerate by g.
    State rest = c.state;
    rest.v.assign(c.model.velocities(), 0.0);
    const std::vector<double> fall = forward_dynamics(c.model, rest, {{}, {}, c.forces.gravity});
    double joint_part = 0;
    for (const Body& body : c.model.bodies()) {
      if (body.parent < 0) continue;
      for (int k = 0; k < velocity_count(body.description.joint.type); ++k) {
        joint_part = std::max(joint_part, std::abs(fall[body.v + k]));
      }
    }
    ASSERT_LT(joint_rates.note(joint_part, i), 1e-10);  // measured 0: gravity is an acceleration of the root
  }
}

// Static equilibrium of a robot on the ground: minus the sum of J_c^T m g over its bodies.
TEST(InverseDynamics, HoldsAgainstGravity) {
  Worst difference("static gravity torques");
  for (int i = 0; i < kRobots; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Case c = random_case(i);
    if (c.model.velocities() == 0) continue;  // a single fixed body
    State rest = c.state;
    rest.v.assign(c.model.velocities(), 0.0);
    const std::vector<double> tau = inverse_dynamics(c.model, rest, rest.v, {{}, {}, c.forces.gravity});
    const Kinematics kinematics = forward_kinematics(c.model, rest);
    Eigen::VectorXd expected = Eigen::VectorXd::Zero(c.model.velocities());
    Eigen::MatrixXd J(6, c.model.velocities());
    for (std::size_t b = 0; b < c.model.bodies().size(); ++b) {
      const BodyDescription& d = c.model.bodies()[b].description;
      point_jacobian(c.model, kinematics, static_cast<int>(b), kinematics.X_WB[b] * d.com, J);
      expected -= J.bottomRows(3).transpose() * (d.mass * eigen(c.forces.gravity));
    }
    ASSERT_LT(difference.note(relative_difference(eigen(tau), expected), i),
              1e-11);  // measured 3.5e-14, relative to small torques
  }
}

// dT/dt = power of the generalized forces, the external wrenches and gravity.
TEST(ForwardDynamics, BalancesPower) {
  Worst difference("power balance");
  for (int i = 0; i < kRobots; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Case c = random_case(i);
    const std::vector<double> vdot = forward_dynamics(c.model, c.state, c.forces);
    const std::vector<double> qdot = rates_of(c.model, c.state.q, c.state.v);
    const double rate = derivative([&](double step) {
      const State s = advance(c.model, c.state, qdot, vdot, step);
      return kinetic_energy(c.model, forward_kinematics(c.model, s), s);
    });
    const Kinematics kinematics = forward_kinematics(c.model, c.state);
    const Eigen::VectorXd f = eigen(c.forces.generalized) + external_forces(c);
    const double gravity_power = dot(c.forces.gravity, momentum_about(c.model, kinematics, Vector3d::zero()).linear);
    const double power = f.dot(eigen(c.state.v)) + gravity_power;
    const double scale = kinetic_energy(c.model, kinematics, c.state) + f.norm() * eigen(c.state.v).norm() + 1;
    ASSERT_LT(difference.note(std::abs(rate - power) / scale, i), 1e-8);  // measured 1.1e-11, of the stencil
  }
}

// The rate of total momentum about a point of W is the external moment and force about it, gravity included.
TEST(ForwardDynamics, ChangesMomentumByExternalWrenches) {
  Worst difference("rate of momentum");
  for (int i = 0; i < kRobots; ++i) {
    if (i % 4 == 3) continue;  // a fixed root passes wrenches to the world
    SCOPED_TRACE(seed_note(i));
    Case c = random_case(i);
    // A root's generalized force is an external wrench too: leave only the joints'.
    for (const Body& b : c.model.bodies()) {
      if (b.parent < 0) std::fill_n(c.forces.generalized.begin() + b.v, 6, 0.0);
    }
    const std::vector<double> vdot = forward_dynamics(c.model, c.state, c.forces);
    const std::vector<double> qdot = rates_of(c.model, c.state.q, c.state.v);
    const Vector3d p{0.3, -1.2, 0.7};
    const Eigen::VectorXd rate = derivative([&](double step) -> Eigen::Matrix<double, 6, 1> {
      const State s = advance(c.model, c.state, qdot, vdot, step);
      return eigen(momentum_about(c.model, forward_kinematics(c.model, s), p));
    });
    const Kinematics kinematics = forward_kinematics(c.model, c.state);
    const Wrenchd weight{Vector3d::zero(), c.model.mass() * c.forces.gravity};
    Wrenchd total = shift(weight, p - center_of_mass(c.model, kinematics));
    for (const ExternalWrench& e : c.forces.external) total += shift(e.F_W, p - e.p_WP);
    const double scale = eigen(momentum_about(c.model, kinematics, p)).norm() + eigen(total).norm();
    ASSERT_LT(difference.note((rate - eigen(total)).norm() / scale, i), 1e-8);  // measured 5.2e-12, of the stencil
  }
}

TEST(DynamicsArguments, RejectSizesOfAnotherModel) {
  const Model model = plain_robot(3), other = plain_robot(5);
  const State state = zero_state(model), other_state = zero_state(other);
  Workspace workspace(model), foreign(other);
  std::vector<double> out;
  EXPECT_THAT([&] { forward_dynamics(model, other_state, {}, workspace, out); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("forward_dynamics: the state has another model's size")));
  EXPECT_THAT([&] { forward_dynamics(model, state, {}, foreign, out); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("the workspace was made for another model")));
  EXPECT_THAT(
      [&] {
        forward_dynamics(model, state, {other_state.v, {}}, workspace, out);
      },
      ThrowsMessage<std::invalid_argument>(HasSubstr("generalized forces have another model's size")));
  EXPECT_THAT([&] { inverse_dynamics(model, state, other_state.v, {}, workspace, out); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("the accelerations have another model's size")));
}

}  // namespace forward_dynamics_test
}  // namespace grapnel
