// Linear models of the equations of motion: closed forms, finite differences, and the motion that they predict.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "dynamics/random_case.hpp"
#include "grapnel/dynamics/linearization.hpp"
#include "support/worst.hpp"

namespace grapnel {
namespace linearization_test {

using namespace testing;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

BodyDescription body_on(const std::string& name, const std::string& parent, JointType joint) {
  BodyDescription b;
  b.name = name, b.parent = parent, b.joint.name = name + "-joint", b.joint.type = joint;
  b.mass = 3, b.inertia = Symmetric3d::diagonal(2, 3, 4);
  return b;
}

// About an angle a against the vertical: I a'' = -m g l sin(a) + u with I = I_zz + m l^2.
TEST(Linearization, OfAPendulumIsItsClosedForm) {
  BodyDescription bob = body_on("bob", "ground", JointType::revolute);
  bob.com = {0.7, 0, 0};
  const Model model = ModelBuilder().add(body_on("ground", "", JointType::fixed)).add(bob).build();
  State state = zero_state(model);
  state.q = {0.4}, state.v = {0.9};
  Forces forces;
  forces.gravity = {9.81, 0, 0};  // along x: the angle is measured from it
  const Linearization linear = linearize(model, state, forces);
  const double inertia = 4 + 3 * 0.7 * 0.7;
  Eigen::MatrixXd A(2, 2);
  A << 0, 1, -3 * 9.81 * 0.7 * std::cos(0.4) / inertia, 0;
  EXPECT_LT((linear.A - A).norm(), 1e-14) << linear.A;
  EXPECT_LT((linear.B - Eigen::Vector2d(0, 1 / inertia)).norm(), 1e-15) << linear.B;
}

// Euler's equations about any rotation: I dw' = (I w) x dw - w x (I dw), independent of the attitude.
TEST(Linearization, OfAFreeBodyIsThatOfEulersEquations) {
  const Model model = ModelBuilder().add(body_on("body", "", JointType::free)).build();
  Random random(0);
  const State state = random_state(model, random);
  const Linearization linear = linearize(model, state);
  const Eigen::Matrix3d I = Eigen::Vector3d(2, 3, 4).asDiagonal();
  const Eigen::Vector3d w(state.v[0], state.v[1], state.v[2]);
  const auto cross = [](const Eigen::Vector3d& a) {
    Eigen::Matrix3d m;
    m << 0, -a[2], a[1], a[2], 0, -a[0], -a[1], a[0], 0;
    return m;
  };
  const Eigen::Matrix3d expected = I.inverse() * (cross(I * w) - cross(w) * I);
  EXPECT_LT((linear.A.block<3, 3>(6, 6) - expected).norm(), 1e-14);
  EXPECT_LT((linear.A.block<3, 3>(0, 0) + cross(w)).norm(), 1e-15);
  EXPECT_LT(linear.A.block(6, 0, 6, 6).norm(), 1e-14);  // without forces, no place and no attitude is special
  EXPECT_LT((linear.B.block<3, 3>(6, 0) - I.inverse()).norm(), 1e-15);
}

// The forces at a displaced state: wrenches keep the point of their body.
Forces displaced(const Case& c, const State& state) {
  const Kinematics before = forward_kinematics(c.model, c.state), after = forward_kinematics(c.model, state);
  Forces forces = c.forces;
  for (ExternalWrench& e : forces.external) e.p_WP = after.X_WB[e.body] * (inverse(before.X_WB[e.body]) * e.p_WP);
  return forces;
}

TEST(Linearization, AgreesWithFiniteDifferences) {
  Worst state_error("d vdot / d state"), force_error("d vdot / d force");
  for (int i = 0; i < kRobots / 4; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Case c = random_case(i);
    const Linearization linear = linearize(c.model, c.state, c.forces);
    ASSERT_EQ(linear.vdot, forward_dynamics(c.model, c.state, c.forces));
    const int n = c.model.velocities();
    const std::vector<double> zero(n);
    for (int j = 0; j < n; ++j) {
      std::vector<double> direction(n);
      direction[j] = 1;
      const std::vector<double> qdot = rates_of(c.model, c.state.q, direction);
      const Eigen::VectorXd by_q = derivative([&](double h) {
        const State moved = advance(c.model, c.state, qdot, zero, h);
        return Eigen::VectorXd(eigen(forward_dynamics(c.model, moved, displaced(c, moved))));
      });
      const Eigen::VectorXd by_v = derivative([&](double h) {
        const State faster = advance(c.model, c.state, {}, direction, h);
        return Eigen::VectorXd(eigen(forward_dynamics(c.model, faster, c.forces)));
      });
      const double size = 1 + linear.A.bottomRows(n).norm();
      ASSERT_LT(state_error.note((linear.A.col(j).tail(n) - by_q).norm() / size, i), 1e-9);  // measured 7e-11
      ASSERT_LT(state_error.note((linear.A.col(n + j).tail(n) - by_v).norm() / size, i), 1e-9);
    }
    const Eigen::MatrixXd one = mass_matrix(c.model, c.state) * linear.B.bottomRows(n);
    ASSERT_LT(force_error.note((one - Eigen::MatrixXd::Identity(n, n)).norm(), i), 1e-11);  // measured 6e-13
  }
}

// d/dt of coordinates and velocities without forces.
State rates(const Model& model, const State& at) { return {rates_of(model, at.q, at.v), forward_dynamics(model, at)}; }

State runge_kutta_step(const Model& model, const State& at, double h) {
  const auto moved = [&](const State& rate, double step) { return advance(model, at, rate.q, rate.v, step); };
  const State a = rates(model, at), b = rates(model, moved(a, h / 2)), c = rates(model, moved(b, h / 2)),
              d = rates(model, moved(c, h));
  State mean = a;
  for (std::size_t i = 0; i < mean.q.size(); ++i) mean.q[i] = (a.q[i] + 2 * b.q[i] + 2 * c.q[i] + d.q[i]) / 6;
  for (std::size_t i = 0; i < mean.v.size(); ++i) mean.v[i] = (a.v[i] + 2 * b.v[i] + 2 * c.v[i] + d.v[i]) / 6;
  return moved(mean, h);
}

// x = [xi; dv] from a reference to a neighbouring state.
Eigen::VectorXd difference(const Model& model, const State& from, const State& to) {
  const int n = model.velocities();
  Eigen::VectorXd x(2 * n);
  const auto turn = [&](int q, int v) {
    const Quaterniond a{from.q[q], -from.q[q + 1], -from.q[q + 2], -from.q[q + 3]};
    const Quaterniond turned = a * Quaterniond{to.q[q], to.q[q + 1], to.q[q + 2], to.q[q + 3]};
    x.segment<3>(v) << 2 * turned.x, 2 * turned.y, 2 * turned.z;
  };
  for (const Body& body : model.bodies()) {
    switch (body.description.joint.type) {
      case JointType::fixed:
        break;
      case JointType::spherical:
        turn(body.q, body.v);
        break;
      case JointType::free: {
        turn(body.q + 3, body.v);
        const int root = body.root;
        const Posed X = root_pose(model, from, root);
        x.segment<3>(body.v + 3) = eigen(transpose(X.R) * (root_pose(model, to, root).p - X.p));
        break;
      }
      default:
        x[body.v] = to.q[body.q] - from.q[body.q];
    }
  }
  for (int i = 0; i < n; ++i) x[n + i] = to.v[i] - from.v[i];
  return x;
}

// x' = A(t) x along the reference motion predicts the difference of two neighbouring motions.
TEST(Linearization, PredictsNeighbouringMotions) {
  constexpr int kSteps = 200;
  constexpr double kStep = 1e-3, kSize = 1e-4;
  Worst error("relative error of the prediction");
  for (int i = 0; i < 12; ++i) {
    SCOPED_TRACE(seed_note(i));
    RobotOptions options;
    options.max_bodies = 5, options.spherical_joints = true, options.free_root = i % 3 != 2;
    Random random(i);
    const Model model = random_model(options, random);
    State reference = random_state(model, random, 0.5);
    const std::vector<double> direction = random.values(model.velocities(), 1);
    const std::vector<double> qdot = rates_of(model, reference.q, direction);
    State ahead = advance(model, reference, qdot, direction, kSize),
          behind = advance(model, reference, qdot, direction, -kSize);
    Eigen::VectorXd x = (difference(model, reference, ahead) - difference(model, reference, behind)) / (2 * kSize);
    for (int k = 0; k < kSteps; ++k) {
      const State half = runge_kutta_step(model, reference, kStep / 2);
      const State next = runge_kutta_step(model, half, kStep / 2);
      const Eigen::MatrixXd A0 = linearize(model, reference).A, A1 = linearize(model, half).A,
                            A2 = linearize(model, next).A;
      const Eigen::VectorXd a = A0 * x, b = A1 * (x + kStep / 2 * a), c = A1 * (x + kStep / 2 * b),
                            d = A2 * (x + kStep * c);
      x += kStep / 6 * (a + 2 * b + 2 * c + d);
      reference = next;
      ahead = runge_kutta_step(model, runge_kutta_step(model, ahead, kStep / 2), kStep / 2);
      behind = runge_kutta_step(model, runge_kutta_step(model, behind, kStep / 2), kStep / 2);
    }
    const Eigen::VectorXd moved =
        (difference(model, reference, ahead) - difference(model, reference, behind)) / (2 * kSize);
    ASSERT_GT(moved.norm(), 0.1);
    ASSERT_LT(error.note((moved - x).norm() / moved.norm(), i), 1e-7);  // measured 4e-9
  }
}

TEST(Linearization, RejectsStatesOfOtherModels) {
  const Model model = plain_robot(2);
  State state = zero_state(model);
  state.v.pop_back();
  EXPECT_THAT([&] { linearize(model, state); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("the state has another model's size")));
}

}  // namespace linearization_test
}  // namespace grapnel
