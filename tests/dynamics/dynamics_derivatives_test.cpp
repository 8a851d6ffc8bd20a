// Analytical derivatives of the dynamics against dual numbers on random systems of all kinds of joints and roots; modal
// joints, which the kernels support for doubles only, against finite differences.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "dynamics/dual_dynamics.hpp"
#include "dynamics/random_case.hpp"
#include "grapnel/dynamics/dynamics_derivatives.hpp"
#include "grapnel/dynamics/modal_chains.hpp"
#include "support/worst.hpp"

namespace grapnel {
namespace dynamics_derivatives_test {

using namespace testing;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr double kBound = 1e-10;

double error(const RowMatrix& value, const Eigen::MatrixXd& expected) {
  return (value - expected).norm() / (1 + expected.norm());
}

TEST(InverseDynamicsDerivatives, AgreeWithDualNumbers) {
  Worst dq("d tau / d q"), dv("d tau / d v"), dvdot("d tau / d vdot"), tau("tau");
  for (int i = 0; i < kRobots / 2; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Case c = case_with_rotors(i);
    const int n = c.model.velocities();
    Random random(100000 + i);
    const std::vector<double> vdot = random.values(n, 5);
    const InverseDynamicsDerivatives d = inverse_dynamics_derivatives(c.model, c.state, vdot, c.forces);
    DualDynamics dual(c, {});
    const auto evaluate = [&] { return dual.inverse_of(vdot); };
    const std::vector<double> expected = inverse_dynamics(c.model, c.state, vdot, c.forces);
    ASSERT_LT(tau.note((eigen(d.tau) - eigen(expected)).norm() / (1 + eigen(expected).norm()), i), kBound);
    ASSERT_LT(dq.note(error(d.dq, columns(c, dual, By::q, evaluate)), i), kBound);
    ASSERT_LT(dv.note(error(d.dv, columns(c, dual, By::v, evaluate)), i), kBound);
    ASSERT_LT(dvdot.note(error(d.dvdot, mass_matrix(c.model, c.state)), i), kBound);
  }
}

TEST(ForwardDynamicsDerivatives, AgreeWithDualNumbers) {
  Worst dq("d vdot / d q"), dv("d vdot / d v"), dtau("d vdot / d tau"), value("vdot");
  for (int i = 0; i < kRobots / 2; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Case c = case_with_rotors(i);
    const PrescribedMotion given = some_prescribed(c, i);
    const ForwardDynamicsDerivatives d = forward_dynamics_derivatives(c.model, c.state, c.forces, given);
    DualDynamics dual(c, given);
    const auto evaluate = [&] { return dual.forward(); };
    if (given.prescribed.empty()) {
      const std::vector<double> vdot = forward_dynamics(c.model, c.state, c.forces);
      ASSERT_LT(value.note((eigen(d.vdot) - eigen(vdot)).norm() / (1 + eigen(vdot).norm()), i), kBound);
    }
    ASSERT_LT(dq.note(error(d.dq, columns(c, dual, By::q, evaluate)), i), kBound);
    ASSERT_LT(dv.note(error(d.dv, columns(c, dual, By::v, evaluate)), i), kBound);
    ASSERT_LT(dtau.note(error(d.dtau, columns(c, dual, By::force, evaluate)), i), kBound);
  }
}

// A wrench acts by its Jacobian.
TEST(ForwardDynamicsDerivatives, OfWrenchesAreThoseOfTheirGeneralizedForces) {
  Worst difference("d vdot / d wrench");
  for (int i = 0; i < kRobots / 4; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Case c = random_case(i);
    if (c.model.velocities() == 0) continue;
    const ForwardDynamicsDerivatives d = forward_dynamics_derivatives(c.model, c.state, c.forces);
    const Kinematics kinematics = forward_kinematics(c.model, c.state);
    const auto M = mass_matrix(c.model, c.state).llt();
    ASSERT_EQ(d.dwrench.cols(), static_cast<Eigen::Index>(6 * c.forces.external.size()));
    Eigen::MatrixXd J(6, c.model.velocities());
    for (std::size_t e = 0; e < c.forces.external.size(); ++e) {
      const ExternalWrench& w = c.forces.external[e];
      point_jacobian(c.model, kinematics, w.body, w.p_WP, J);
      const Eigen::MatrixXd expected = M.solve(J.transpose());
      const RowMatrix block = d.dwrench.middleCols(static_cast<Eigen::Index>(6 * e), 6);
      ASSERT_LT(difference.note(error(block, expected), i), kBound);
    }
  }
}

// A free base with a boom of four joints in two modes, and an arm of one joint on its tip.
Model modal_model() {
  ModelBuilder builder;
  const double rates[4][2] = {{1, 0.2}, {0.8, -0.5}, {0.5, 0.9}, {0.3, -0.4}};
  for (int i = 0; i < 6; ++i) {
    BodyDescription b;
    b.name = "b" + std::to_string(i), b.joint.name = "j" + std::to_string(i), b.mass = 2 + i;
    b.inertia = Symmetric3d::diagonal(1, 1.5, 0.8), b.com = {0.2, 0.1, -0.1};
    if (i > 0) b.parent = "b" + std::to_string(i - 1), b.X_PF.p = {0.7, 0.1, 0.2};
    b.joint.type = i > 0 ? JointType::revolute : JointType::free;
    if (i > 0) b.joint.axis = Vector3d::unit(i % 3);
    if (i > 0 && i < 5) b.joint.modal = ModalJoint{"boom", {rates[i - 1][0], rates[i - 1][1]}};
    builder.add(b);
  }
  return builder.build();
}

TEST(ForwardDynamicsDerivatives, OfModalJointsAgreeWithFiniteDifferences) {
  const Model model = modal_model();
  const int n = model.velocities();
  Worst worst("modal joints, against finite differences");
  for (int i = 0; i < 5; ++i) {
    Random random(i);
    Case c{model, random_state(model, random), {}};
    c.forces = random_forces(model, c.state, random);
    Eigen::MatrixXd v = eigen(c.state.v).transpose();
    project_columns(model.tree(), v);
    c.state.v.assign(v.data(), v.data() + n);
    const ForwardDynamicsDerivatives d = forward_dynamics_derivatives(model, c.state, c.forces);
    const Kinematics before = forward_kinematics(model, c.state);
    const double size = 1 + d.dq.norm() + d.dv.norm();
    for (int j = 0; j < n; ++j) {
      std::vector<double> direction(n), zero(n);
      direction[j] = 1;
      const std::vector<double> qdot = rates_of(model, c.state.q, direction);
      const Eigen::VectorXd by_q = derivative([&](double h) {
        const State moved = advance(model, c.state, qdot, zero, h);
        const Kinematics after = forward_kinematics(model, moved);
        Forces forces = c.forces;
        for (ExternalWrench& e : forces.external) e.p_WP = after.X_WB[e.body] * (inverse(before.X_WB[e.body]) * e.p_WP);
        return Eigen::VectorXd(eigen(forward_dynamics(model, moved, forces)));
      });
      const Eigen::VectorXd by_v = derivative([&](double h) {
        return Eigen::VectorXd(eigen(forward_dynamics(model, advance(model, c.state, {}, direction, h), c.forces)));
      });
      const Eigen::VectorXd by_force = derivative([&](double h) {
        Forces forces = c.forces;
        forces.generalized[j] += h;
        return Eigen::VectorXd(eigen(forward_dynamics(model, c.state, forces)));
      });
      ASSERT_LT(worst.note((d.dq.col(j) - by_q).norm() / size, i), 1e-8);
      ASSERT_LT(worst.note((d.dv.col(j) - by_v).norm() / size, i), 1e-8);
      ASSERT_LT(worst.note((d.dtau.col(j) - by_force).norm() / size, i), 1e-8);
    }
  }
}

// Mass, first moment and rotational inertia about the origin, in the order of inertial_regressor().
void append_parameters(const BodyDescription& b, std::vector<double>& phi) {
  const RigidBodyInertiad I = RigidBodyInertiad::about_com(b.mass, b.com, b.inertia);
  phi.push_back(I.mass);
  for (int k = 0; k < 3; ++k) phi.push_back(I.first_moment[k]);
  for (const double x : {I.rotational.xx, I.rotational.yy, I.rotational.zz}) phi.push_back(x);
  for (const double x : {I.rotational.xy, I.rotational.xz, I.rotational.yz}) phi.push_back(x);
}

// A second model with other masses: inverse dynamics differ by exactly the regressor times the difference.
TEST(InertialRegressor, IsTheDifferenceOfTwoModels) {
  Worst inverse("d tau / d phi");
  for (int i = 0; i < kRobots / 4; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Case c = case_with_rotors(i);
    if (c.model.velocities() == 0) continue;
    Random random(400000 + i);
    std::vector<double> before, after;
    std::vector<BodyDescription> bodies;
    for (const Body& body : c.model.bodies()) {
      append_parameters(body.description, before);
      BodyDescription b = body.description;
      b.mass *= random.uniform(0.9, 1.1);
      b.com += random.vector(0.05);
      b.inertia = random_inertia(b.mass, 0.3, random);
      append_parameters(b, after);
      bodies.push_back(b);
    }
    const Eigen::VectorXd change = eigen(after) - eigen(before);
    ModelBuilder builder;
    for (const BodyDescription& b : bodies) builder.add(b);
    const Model other = builder.build();
    const std::vector<double> vdot = random.values(c.model.velocities(), 5);
    const Vector3d& g = c.forces.gravity;
    const Eigen::VectorXd difference = eigen(inverse_dynamics(other, c.state, vdot, {{}, {}, g})) -
                                       eigen(inverse_dynamics(c.model, c.state, vdot, {{}, {}, g}));
    const RowMatrix regressor = inertial_regressor(c.model, c.state, vdot, g);
    const double size = 1 + regressor.norm() * change.norm();
    ASSERT_GT((regressor * change).norm(), 1e-3);
    ASSERT_LT(inverse.note((regressor * change - difference).norm() / size, i), 1e-12);
  }
}

// A chain with springs of which one has backlash: the derivatives of the sprung system by the chain rule.
TEST(SpringForces, EnterByTheChainRule) {
  ModelBuilder builder;
  for (int i = 0; i < 4; ++i) {
    BodyDescription b;
    b.name = "b" + std::to_string(i), b.joint.name = "j" + std::to_string(i), b.mass = 1 + i;
    b.inertia = Symmetric3d::diagonal(1, 1.2, 0.9), b.com = {0.1, 0.3, 0.2};
    if (i > 0) b.parent = "b" + std::to_string(i - 1), b.X_PF.p = {1, 0.1, 0};
    b.joint.type = i > 0 ? JointType::revolute : JointType::free;
    if (i > 0) b.joint.spring = JointSpring{10.0 * i, 0.5 * i, 0.1, i == 1 ? 0.0 : 0.4};
    builder.add(b);
  }
  const Model model = builder.build();
  Random random(0);
  State state = random_state(model, random);
  state.q[7] = 0.7, state.q[8] = 0.2, state.q[9] = -0.6;  // the second one is within its backlash
  const int n = model.velocities();
  const auto accelerations = [&](const State& at) {
    return Eigen::VectorXd(eigen(forward_dynamics(model, at, {spring_forces(model, at).force, {}, {0, 0, -1}})));
  };
  const SpringForces spring = spring_forces(model, state);
  ASSERT_EQ(spring.dq, (std::vector<double>{0, 0, 0, 0, 0, 0, -10, 0, -30}));
  ASSERT_EQ(spring.force[7], -1.0 * state.v[7]);
  const ForwardDynamicsDerivatives d = forward_dynamics_derivatives(model, state, {spring.force, {}, {0, 0, -1}});
  const Eigen::MatrixXd dq = d.dq + d.dtau * eigen(spring.dq).asDiagonal();
  const Eigen::MatrixXd dv = d.dv + d.dtau * eigen(spring.dv).asDiagonal();
  Worst worst("springs, against finite differences");
  for (int j = 0; j < n; ++j) {
    std::vector<double> direction(n);
    direction[j] = 1;
    const std::vector<double> qdot = rates_of(model, state.q, direction), zero(n);
    const Eigen::VectorXd by_q =
        derivative([&](double h) { return accelerations(advance(model, state, qdot, zero, h)); });
    const Eigen::VectorXd by_v =
        derivative([&](double h) { return accelerations(advance(model, state, {}, direction, h)); });
    ASSERT_LT(worst.note((dq.col(j) - by_q).norm() / (1 + dq.norm()), j), 1e-8);
    ASSERT_LT(worst.note((dv.col(j) - by_v).norm() / (1 + dv.norm()), j), 1e-8);
  }
}

// Derivatives are the same at any distance of a base from the world's origin.
TEST(ForwardDynamicsDerivatives, DoNotDependOnThePlaceOfTheBase) {
  Worst difference("derivatives 1e6 m away");
  for (int i = 0; i < 20; ++i) {
    SCOPED_TRACE(seed_note(i));
    Case c = random_case(4 * i);
    c.forces.external.clear();
    const ForwardDynamicsDerivatives here = forward_dynamics_derivatives(c.model, c.state, c.forces);
    for (const Body& body : c.model.bodies()) {
      if (body.parent < 0) c.state.q[body.q] += 1e6;
    }
    const ForwardDynamicsDerivatives there = forward_dynamics_derivatives(c.model, c.state, c.forces);
    EXPECT_EQ(difference.note((here.dq - there.dq).norm() + (here.dv - there.dv).norm(), i), 0);
  }
}

TEST(DynamicsDerivatives, RejectSizesOfAnotherModel) {
  const Model model = plain_robot(3), other = plain_robot(5);
  const State state = zero_state(model), other_state = zero_state(other);
  const auto foreign = make_derivatives_workspace(other);
  ForwardDynamicsDerivatives out;
  EXPECT_THAT([&] { forward_dynamics_derivatives(model, other_state); },
              ThrowsMessage<std::invalid_argument>(
                  HasSubstr("forward_dynamics_derivatives: the state has another model's size")));
  EXPECT_THAT([&] { forward_dynamics_derivatives(model, state, {}, *foreign, out); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("the workspace was made for another model")));
  EXPECT_THAT(
      [&] {
        forward_dynamics_derivatives(model, state, {other_state.v, {}});
      },
      ThrowsMessage<std::invalid_argument>(HasSubstr("generalized forces have another model's size")));
  EXPECT_THAT(
      [&] {
        forward_dynamics_derivatives(model, state, {}, {{1}, {0}});
      },
      ThrowsMessage<std::invalid_argument>(HasSubstr("prescribed velocities have another model's size")));
  EXPECT_THAT([&] { inverse_dynamics_derivatives(model, state, other_state.v); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("the accelerations have another model's size")));
}

}  // namespace dynamics_derivatives_test
}  // namespace grapnel
