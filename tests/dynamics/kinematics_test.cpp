// Poses from the descriptions, Jacobians and twists by finite differences of poses.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "dynamics/random_case.hpp"
#include "support/worst.hpp"

namespace grapnel {
namespace kinematics_test {

using namespace testing;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

// X_WB = X_WP X_PF joint(q), directly from the body's description, independent of merged links and aligned frames.
Posed described_pose(const Model& model, const State& state, int body) {
  const Body& b = model.bodies()[body];
  const BodyDescription& d = b.description;
  const double* q = state.q.data() + b.q;
  Posed joint = Posed::identity();
  switch (d.joint.type) {
    case JointType::free:
      return {rotation_matrix(Quaterniond{q[3], q[4], q[5], q[6]}), {q[0], q[1], q[2]}};
    case JointType::spherical:
      joint.R = rotation_matrix(Quaterniond{q[0], q[1], q[2], q[3]});
      break;
    case JointType::prismatic:
      joint.p = q[0] * d.joint.axis;
      break;
    case JointType::fixed:
      break;
    default:
      joint.R = rotation_about(d.joint.axis, q[0]);
      break;
  }
  return (b.parent < 0 ? Posed::identity() : described_pose(model, state, b.parent)) * d.X_PF * joint;
}

TEST(ForwardKinematics, PlacesBodiesAsDescribed) {
  Worst position("body positions [m]"), orientation("body orientations");
  for (int i = 0; i < kRobots; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Case c = random_case(i);
    const Kinematics kinematics = forward_kinematics(c.model, c.state);
    for (std::size_t b = 0; b < c.model.bodies().size(); ++b) {
      const Posed expected = described_pose(c.model, c.state, static_cast<int>(b));
      // Chains of 20 links and positions of 10 m.
      ASSERT_LT(position.note(norm(kinematics.X_WB[b].p - expected.p), i), 1e-12);  // measured 1.3e-14
      ASSERT_LT(orientation.note((eigen(kinematics.X_WB[b].R) - eigen(expected.R)).norm(), i),
                1e-13);  // measured 4.4e-15
    }
    for (std::size_t f = 0; f < c.model.frames().size(); ++f) {
      const Frame& frame = c.model.frames()[f];
      const Posed X_WE = frame_pose(c.model, kinematics, static_cast<int>(f));
      const Posed expected = described_pose(c.model, c.state, frame.body) * frame.X_BE;
      ASSERT_LT(norm(X_WE.p - expected.p) + (eigen(X_WE.R) - eigen(expected.R)).norm(), 1e-12);
    }
  }
}

// Column k of the Jacobian is the frame's twist when velocity k alone is one.
TEST(FrameJacobian, ColumnsAreDerivativesOfThePose) {
  Worst angular("Jacobian by finite differences, angular"), linear("Jacobian by finite differences, linear");
  for (int i = 0; i < kRobots; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Case c = random_case(i);
    const Kinematics kinematics = forward_kinematics(c.model, c.state);
    const int n = c.model.velocities();
    for (std::size_t f = 0; f < c.model.frames().size(); ++f) {
      const int frame = static_cast<int>(f);
      const Rotationd R0 = frame_pose(c.model, kinematics, frame).R;
      const Eigen::MatrixXd J = frame_jacobian(c.model, kinematics, frame);
      for (int k = 0; k < n; ++k) {
        std::vector<double> unit(n, 0.0);
        unit[k] = 1;
        const std::vector<double> qdot = rates_of(c.model, c.state.q, unit);
        const Eigen::VectorXd twist = derivative(
            [&](double step) -> Eigen::Matrix<double, 6, 1> {
              const State s = advance(c.model, c.state, qdot, {}, step);
              const Posed X = frame_pose(c.model, forward_kinematics(c.model, s), frame);
              Eigen::Matrix<double, 6, 1> value;
              value << eigen(rotation_vector(X.R * transpose(R0))), eigen(X.p);
              return value;
            },
            1e-3);
        ASSERT_LT(angular.note((twist.head(3) - J.col(k).head(3)).norm(), i), 1e-10);  // measured 5.1e-13
        ASSERT_LT(linear.note((twist.tail(3) - J.col(k).tail(3)).norm(), i), 1e-10);   // measured 5.7e-12
      }
      const Eigen::VectorXd V = eigen(frame_twist(c.model, kinematics, frame));
      ASSERT_LT((J * eigen(c.state.v) - V).norm(), 1e-12 * (1 + V.norm()));
    }
  }
}

TEST(Kinematics, TwistsAreJacobianTimesVelocities) {
  Worst difference("body twists against J v");
  for (int i = 0; i < kRobots; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Case c = random_case(i);
    const Kinematics kinematics = forward_kinematics(c.model, c.state);
    Eigen::MatrixXd J(6, c.model.velocities());
    for (std::size_t b = 0; b < c.model.bodies().size(); ++b) {
      point_jacobian(c.model, kinematics, static_cast<int>(b), kinematics.X_WB[b].p, J);
      const Eigen::VectorXd V = eigen(kinematics.V_WB[b]);
      ASSERT_LT(difference.note((J * eigen(c.state.v) - V).norm() / (1 + V.norm()), i), 1e-12);  // measured 1.6e-15
    }
  }
}

TEST(RootState, RoundTrips) {
  for (int i = 0; i < 100; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Case c = random_case(i);
    Random random(200000 + i);
    State s = c.state;
    for (std::size_t b = 0; b < c.model.bodies().size(); ++b) {
      const int body = static_cast<int>(b);
      if (c.model.bodies()[b].description.joint.type != JointType::free) continue;
      const Posed X{random.rotation(), random.vector(5)};
      const Twistd V{random.vector(1), random.vector(1)};
      set_root_pose(c.model, body, X, s);
      set_root_twist(c.model, body, V, s);
      EXPECT_LT((eigen(root_pose(c.model, s, body).R) - eigen(X.R)).norm(), 1e-14);
      EXPECT_EQ(eigen(root_pose(c.model, s, body).p), eigen(X.p));
      EXPECT_LT((eigen(root_twist(c.model, s, body)) - eigen(V)).norm(), 1e-14);
      const Kinematics kinematics = forward_kinematics(c.model, s);
      EXPECT_LT((eigen(kinematics.V_WB[b]) - eigen(V)).norm(), 1e-14);
    }
  }
}

TEST(RootState, OfAFixedRootIsRejected) {
  const Model model = plain_robot(2, JointType::fixed);
  State s = zero_state(model);
  EXPECT_EQ(eigen(root_pose(model, s, 0).p), eigen(model.bodies()[0].description.X_PF.p));
  EXPECT_EQ(eigen(root_twist(model, s, 0)).norm(), 0);
  EXPECT_THAT([&] { set_root_pose(model, 0, Posed::identity(), s); },
              ThrowsMessage<std::invalid_argument>(
                  HasSubstr("root 'b0' is fixed to the world: its pose belongs to the model")));
  EXPECT_THAT([&] { set_root_twist(model, 0, Twistd::zero(), s); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("root 'b0' is fixed to the world: it has no twist")));
  EXPECT_THAT([&] { root_pose(model, s, 1); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("body 'b1' is not a root")));
}

TEST(ZeroState, HasUnitQuaternions) {
  const Model model = random_case(7).model;
  const State s = zero_state(model);
  EXPECT_EQ(eigen(s.v).norm(), 0);
  for (int offset : model.quaternions()) EXPECT_EQ(s.q[offset], 1);
  EXPECT_TRUE(eigen(forward_kinematics(model, s).X_WB[0].R).isUnitary(1e-14));
}

TEST(KinematicsArguments, RejectSizesOfAnotherModel) {
  const Model model = plain_robot(3), other = plain_robot(5);
  Kinematics kinematics(model), foreign(other);
  EXPECT_THAT(
      [&] { forward_kinematics(model, zero_state(other), kinematics); },
      ThrowsMessage<std::invalid_argument>(HasSubstr("forward_kinematics: the state has another model's size")));
  EXPECT_THAT(
      [&] { forward_kinematics(model, zero_state(model), foreign); },
      ThrowsMessage<std::invalid_argument>(HasSubstr("forward_kinematics: the output has another model's size")));
  Eigen::MatrixXd J(5, model.velocities());
  EXPECT_THAT([&] { point_jacobian(model, kinematics, 0, Vector3d::zero(), J); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("J must be 6 x velocities")));
}

// The frames of a long chain must stay orthonormal: with frames aligned to their parents an error could double per
// link.
TEST(ForwardKinematics, StaysOrthonormalOverLongChains) {
  Random random(0);
  ModelBuilder builder;
  for (int i = 0; i < 225; ++i) {
    BodyDescription b;
    b.name = "b" + std::to_string(i), b.joint.name = "j" + std::to_string(i), b.mass = 1;
    b.inertia = Symmetric3d::diagonal(1, 1.2, 0.9);
    b.joint.type = i == 0 ? JointType::free : i % 7 == 3 ? JointType::spherical : JointType::revolute;
    if (i > 0) b.parent = "b" + std::to_string(i - 1), b.X_PF = {random.rotation(), random.vector(0.3)};
    b.joint.axis = i % 3 == 0 ? random.direction() : Vector3d::unit(i % 3);
    builder.add(b);
  }
  const Model model = builder.build();
  const State state = random_state(model, random);
  const Kinematics kinematics = forward_kinematics(model, state);
  const Eigen::Matrix3d R = eigen(kinematics.X_WB.back().R);
  EXPECT_LT((R * R.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-12);  // measured 1.2e-14; 1e50 if it doubles
  EXPECT_LT((R - eigen(described_pose(model, state, 224).R)).norm(), 1e-12);
}

}  // namespace kinematics_test
}  // namespace grapnel
