// The hand-derived planar robot against itself (Lagrange's equations by finite differences of the kinetic energy) and
// Grapnel against it.
#include "oracle/planar_dual_arm.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "dynamics/random_case.hpp"
#include "grapnel/dynamics/free_floating.hpp"
#include "oracle/random_planar.hpp"
#include "support/worst.hpp"

namespace grapnel {
namespace planar_dual_arm_test {

using namespace testing;
using namespace oracle;

constexpr int kStates = 300;

// The same robot in Grapnel, with out-of-plane inertia that is not coupled to the plane.
Model grapnel_model(const PlanarDualArm& r, Random& random) {
  const auto body = [&](const char* name, const char* parent, JointType type, double mount, double mass, double com,
                        double I) {
    BodyDescription b;
    b.name = name, b.parent = parent, b.X_PF.p = {mount, 0, 0};
    b.joint.name = name, b.joint.type = type;
    b.mass = mass, b.com = {com, 0, 0};
    b.inertia = Symmetric3d::diagonal(random.uniform(0.55, 0.9) * I, random.uniform(0.55, 0.9) * I, I);
    return b;
  };
  ModelBuilder builder;
  builder.add(body("base", "", JointType::free, 0, r.m0, 0, r.I0))
      .add(body("link1", "base", JointType::revolute, r.b1, r.m1, r.d1, r.I1))
      .add(body("link2", "link1", JointType::continuous, r.a1, r.m2, r.d2, r.I2))
      .add(body("link3", "base", JointType::revolute, r.b2, r.m3, r.d3, r.I3))
      .add(FrameDescription{"tip1", "link2", {Rotationd::identity(), {r.a2, 0, 0}}})
      .add(FrameDescription{"tip2", "link3", {Rotationd::identity(), {r.a3, 0, 0}}});
  return builder.build();
}

State grapnel_state(const Model& model, const PlanarState& s) {
  State state = zero_state(model);
  set_root_pose(model, 0, {rotation_about({0, 0, 1}, s.q[2]), {s.q[0], s.q[1], 0}}, state);
  set_root_twist(model, 0, {{0, 0, s.rate[2]}, {s.rate[0], s.rate[1], 0}}, state);
  for (int i = 0; i < 3; ++i) state.q[7 + i] = s.q[3 + i], state.v[6 + i] = s.rate[3 + i];
  return state;
}

// Grapnel's velocities from planar rates, v = T rate: the base's velocity is expressed in the base.
Eigen::MatrixXd velocity_map(const Vector6& q) {
  Eigen::MatrixXd T = Eigen::MatrixXd::Zero(9, 6);
  const double c = std::cos(q[2]), s = std::sin(q[2]);
  T(2, 2) = 1;
  T.block<2, 2>(3, 0) << c, s, -s, c;
  T.block<3, 3>(6, 3).setIdentity();
  return T;
}
// (dT/dt) rate.
Eigen::VectorXd velocity_turn(const PlanarState& s) {
  Eigen::VectorXd result = Eigen::VectorXd::Zero(9);
  const double c = std::cos(s.q[2]), sn = std::sin(s.q[2]);
  result.segment<2>(3) << s.rate[2] * (-sn * s.rate[0] + c * s.rate[1]), s.rate[2] * (-c * s.rate[0] - sn * s.rate[1]);
  return result;
}

TEST(PlanarOracle, ObeysLagrangesEquations) {
  Worst energy("planar oracle, T"), equation("planar oracle, Lagrange's equations by finite differences");
  for (int i = 0; i < kStates; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(i);
    const PlanarDualArm robot = random_planar_robot(random);
    const PlanarState s = random_planar_state(random);
    const Matrix6 M = oracle::mass_matrix(robot, s.q);
    const double T = oracle::kinetic_energy(robot, s);
    ASSERT_LT(energy.note(std::abs(0.5 * s.rate.dot(M * s.rate) - T) / T, i), 1e-12);  // measured 9.4e-16
    // T is quadratic in the rates, so its Hessian is exact by differences: dT/drate(q) = M(q) rate from T alone.
    const auto conjugate = [&](const Vector6& q) {
      Vector6 p;
      for (int k = 0; k < 6; ++k) {
        p[k] = (oracle::kinetic_energy(robot, {q, s.rate + Vector6::Unit(k)}) -
                oracle::kinetic_energy(robot, {q, s.rate - Vector6::Unit(k)})) /
               2;
      }
      return p;
    };
    ASSERT_LT((conjugate(s.q) - M * s.rate).norm(), 1e-12 * (1 + (M * s.rate).norm()));
    // c = d/dt (dT/drate) at zero acceleration - dT/dq.
    const Vector6 turned = derivative([&](double h) -> Vector6 { return conjugate(s.q + h * s.rate); }, 1e-3);
    Vector6 gradient;
    for (int k = 0; k < 6; ++k) {
      gradient[k] = derivative(
          [&](double h) {
            return oracle::kinetic_energy(robot, {s.q + h * Vector6::Unit(k), s.rate});
          },
          1e-3);
    }
    const Vector6 c = oracle::bias(robot, s);
    ASSERT_LT(equation.note((turned - gradient - c).norm() / (1 + T), i), 1e-9);  // measured 1.6e-11, of the stencil
  }
}

TEST(PlanarRobot, HasTheDerivedMassMatrixAndBias) {
  Worst matrix("planar robot, mass matrix"), vector("planar robot, bias");
  for (int i = 0; i < kStates; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(i);
    const PlanarDualArm robot = random_planar_robot(random);
    const Model model = grapnel_model(robot, random);
    const PlanarState s = random_planar_state(random);
    const State state = grapnel_state(model, s);
    const Eigen::MatrixXd M = mass_matrix(model, state), T = velocity_map(s.q);
    const Matrix6 expected = oracle::mass_matrix(robot, s.q);
    ASSERT_LT(matrix.note(relative_difference(Matrix6(T.transpose() * M * T), expected), i),
              1e-12);  // measured 4.4e-16
    // M (T a + T' rate) + c = f.
    const Eigen::VectorXd c = T.transpose() * (bias_of(model, state, Vector3d::zero()) + M * velocity_turn(s));
    const Vector6 c_expected = oracle::bias(robot, s);
    ASSERT_LT(vector.note((c - c_expected).norm() / (1 + c_expected.norm()), i), 1e-12);  // measured 9.1e-15
  }
}

TEST(PlanarRobot, HasTheDerivedMomentumAndEnergy) {
  Worst momenta("planar robot, momentum"), energy("planar robot, kinetic energy");
  for (int i = 0; i < kStates; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(i);
    const PlanarDualArm robot = random_planar_robot(random);
    const Model model = grapnel_model(robot, random);
    const PlanarState s = random_planar_state(random);
    const State state = grapnel_state(model, s);
    const Kinematics kinematics = forward_kinematics(model, state);
    const Eigen::Vector3d expected = oracle::momentum(robot, s);
    const Momentumd h = momentum_about(model, kinematics, kinematics.X_WB[0].p);
    const Eigen::Vector3d got{h.linear[0], h.linear[1], h.angular[2]};
    ASSERT_LT(momenta.note(relative_difference(got, expected), i), 1e-12);  // measured 1.7e-15
    ASSERT_LT((oracle::mass_matrix(robot, s.q).topRows(3) * s.rate - expected).norm(), 1e-12 * (1 + expected.norm()));
    const double T = oracle::kinetic_energy(robot, s);
    ASSERT_LT(energy.note(std::abs(kinetic_energy(model, kinematics, state) - T) / T, i), 1e-12);  // measured 2.0e-15
    // p = (contribution of the base) + J_Tg rates.
    PlanarState joints_only = s;
    joints_only.rate.head(3).setZero();
    const Eigen::Vector2d by_joints = oracle::joint_momentum(robot, s.q) * s.rate.tail(3);
    ASSERT_LT((by_joints - oracle::momentum(robot, joints_only).head(2)).norm(), 1e-12);
  }
}

TEST(PlanarRobot, HasTheDerivedTipsAndGeneralizedJacobian) {
  Worst tips("planar robot, tips [m, rad]"), jacobian("planar robot, Jacobian"),
      generalized("planar robot, generalized Jacobian");
  for (int i = 0; i < kStates; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(i);
    const PlanarDualArm robot = random_planar_robot(random);
    const Model model = grapnel_model(robot, random);
    const PlanarState s = random_planar_state(random);
    const State state = grapnel_state(model, s);
    const Kinematics kinematics = forward_kinematics(model, state);
    const Matrix6 M = oracle::mass_matrix(robot, s.q);
    const Eigen::Matrix3d X = M.topLeftCorner<3, 3>().inverse() * M.topRightCorner<3, 3>();
    for (int arm = 1; arm <= 2; ++arm) {
      const Posed X_WE = frame_pose(model, kinematics, arm - 1);
      const Eigen::Vector3d expected = oracle::tip(robot, s.q, arm);
      const double turn = rotation_angle(rotation_about({0, 0, 1}, -expected[2]) * X_WE.R);
      ASSERT_LT(tips.note(std::hypot(X_WE.p[0] - expected[0], X_WE.p[1] - expected[1]) + turn, i),
                1e-12);  // measured 2.1e-15
      const std::vector<int> rows{3, 4, 2};
      const Eigen::MatrixXd J = (frame_jacobian(model, kinematics, arm - 1) * velocity_map(s.q))(rows, Eigen::all);
      const Eigen::MatrixXd J_expected = oracle::tip_jacobian(robot, s.q, arm);
      ASSERT_LT(jacobian.note(relative_difference(J, J_expected), i), 1e-12);  // measured 7.4e-16
      // (A.4): J_m - J_b I_b^-1 I_bm.
      const Eigen::MatrixXd J_g = generalized_jacobian(model, state, 0, arm - 1)(rows, Eigen::all);
      const Eigen::MatrixXd J_g_expected = J_expected.rightCols(3) - J_expected.leftCols(3) * X;
      ASSERT_LT(generalized.note((J_g - J_g_expected).norm() / (1 + J_g_expected.norm()), i),
                1e-12);  // measured 1.0e-15
    }
    // (2.8)'s inertia: three joints in the plane.
    const Eigen::Matrix3d I = M.bottomRightCorner<3, 3>() - M.bottomLeftCorner<3, 3>() * X;
    ASSERT_LT(relative_difference(Eigen::Matrix3d(generalized_inertia(model, state, 0)), I), 1e-12);
  }
}

}  // namespace planar_dual_arm_test
}  // namespace grapnel
