/// Base motion in response to the joints: against the mass matrix, and derivatives against finite differences.

#include <gtest/gtest.h>

#include "grapnel/dynamics/free_floating.hpp"
#include "grapnel/plan/floating_base.hpp"
#include "plan/plan_case.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace floating_base_test {

constexpr int kServicers = 60;

Posed displaced(const Posed& X, const Vector6d& xi) {
  const Vector3d w{xi[0], xi[1], xi[2]};
  return {X.R * rotation_about((1 / norm(w)) * w, norm(w)), X.p + X.R * Vector3d{xi[3], xi[4], xi[5]}};
}

// A random displacement, angular and linear.
Vector6d direction(Random& random) {
  Vector6d xi;
  for (int k = 0; k < 6; ++k) xi[k] = random.uniform(-1, 1);
  return xi;
}

TEST(FloatingBase, TwistAgreesWithTheMassMatrix) {
  Worst worst("base twist against base_twist_from_momentum");
  for (int i = 0; i < kServicers; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Servicer s = random_servicer(i);
    FloatingBase base(s.model, true);
    const FreeMotion motion = free_motion(s.model, s.state, 0, {0, 0, 0});
    base.place(s.theta());
    base.move(s.rates(), motion.in_base(0, s.X_WB()));
    const Twistd expected = transposed_times(s.X_WB().R, base_twist_from_momentum(s.model, s.state, 0, motion.h));
    ASSERT_GT(column(expected).norm(), 1e-3);
    EXPECT_LT(worst.note((base.base_twist() - column(expected)).norm(), i), 1e-12);  // measured 2.6e-14
    // The state's twist has that momentum.
    const Twistd own = transposed_times(s.X_WB().R, root_twist(s.model, s.state, 0));
    EXPECT_LT((base.base_twist() - column(own)).norm(), 1e-11);
  }
}

TEST(FloatingBase, GeneralizedJacobianAgreesWithDynamics) {
  Worst worst("generalized Jacobian");
  for (int i = 0; i < kServicers; ++i) {
    SCOPED_TRACE(seed_note(i));
    const bool free_root = i % 3 != 2;
    const Servicer s = random_servicer(i, free_root);
    FloatingBase base(s.model, free_root);
    base.place(s.theta());
    const Rotationd R = s.X_WB().R;
    for (int f = 0; f < static_cast<int>(s.model.frames().size()); ++f) {
      Matrix6Xd J;
      base.generalized_jacobian(f, J);
      const Eigen::MatrixXd expected = generalized_jacobian(s.model, s.state, 0, f);
      ASSERT_EQ(expected.cols(), base.joints());
      for (int j = 0; j < base.joints(); ++j) {
        const Vector6d in_world = column(R * twist_from(J.col(j)));
        EXPECT_LT(worst.note((in_world - expected.col(j)).norm(), i), 1e-12);  // measured 1.4e-14
      }
    }
  }
}

TEST(FloatingBase, DerivativesAgreeWithFiniteDifferences) {
  Worst per_angle("dV/dtheta"), per_rate("dV/drate"), per_displacement("displacement rate");
  for (int i = 0; i < kServicers; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Servicer s = random_servicer(i);
    FloatingBase base(s.model, true);
    const FreeMotion motion = free_motion(s.model, s.state, 0, {0, 0, 0});
    const Momentumd h_B = motion.in_base(0, s.X_WB());
    const std::vector<double> theta = s.theta(), rates = s.rates();
    base.place(theta);
    base.move(rates, h_B);
    const Matrix6Xd by_angle = base.per_angle(), by_rate = base.per_rate();
    const Eigen::Matrix<double, 6, 6> A = base.displacement_rate(h_B);
    const Vector6d V = base.base_twist();
    const double h = 1e-5;
    const auto twist_at = [&](const std::vector<double>& x, const std::vector<double>& r, const Posed& X) {
      base.place(x);
      base.move(r, motion.in_base(0, X));
      return Vector6d(base.base_twist());
    };
    for (int j = 0; j < base.joints(); ++j) {
      std::vector<double> up = theta, down = theta;
      up[j] += h, down[j] -= h;
      const Vector6d angle = (twist_at(up, rates, s.X_WB()) - twist_at(down, rates, s.X_WB())) / (2 * h);
      EXPECT_LT(per_angle.note((angle - by_angle.col(j)).norm(), i), 1e-8);  // measured 4.4e-10
      std::vector<double> fast = rates, slow = rates;
      fast[j] += h, slow[j] -= h;
      const Vector6d rate = (twist_at(theta, fast, s.X_WB()) - twist_at(theta, slow, s.X_WB())) / (2 * h);
      EXPECT_LT(per_rate.note((rate - by_rate.col(j)).norm(), i), 1e-8);  // measured 5.2e-10
    }
    // dV/dxi - V x xi: the first by differences.
    Random random(i);
    const Vector6d xi = direction(random);
    const Vector6d change =
        (twist_at(theta, rates, displaced(s.X_WB(), h * xi)) - twist_at(theta, rates, displaced(s.X_WB(), -h * xi))) /
        (2 * h);
    const Vector6d expected = change - column(cross_motion(twist_from(V), twist_from(xi)));
    EXPECT_LT(per_displacement.note((A * xi - expected).norm(), i), 1e-7);  // measured 3e-9
  }
}

TEST(FloatingBase, FrameTwistDerivativesAgreeWithFiniteDifferences) {
  Worst worst("change of a frame's twist with joint values");
  for (int i = 0; i < kServicers; ++i) {
    SCOPED_TRACE(seed_note(i));
    const bool free_root = i % 3 != 2;
    const Servicer s = random_servicer(i, free_root);
    FloatingBase base(s.model, free_root);
    const Momentumd h_B =
        free_root ? free_motion(s.model, s.state, 0, {0, 0, 0}).in_base(0, s.X_WB()) : Momentumd::zero();
    const std::vector<double> theta = s.theta(), rates = s.rates();
    const auto twist_at = [&](const std::vector<double>& x, int frame) {
      base.place(x);
      base.move(rates, h_B);
      return column(base.frame_twist(frame));
    };
    const double h = 1e-5;
    for (int f = 0; f < static_cast<int>(s.model.frames().size()); ++f) {
      base.place(theta);
      base.move(rates, h_B);
      Matrix6Xd D;
      base.frame_twist_per_angle(f, D);
      for (int j = 0; j < base.joints(); ++j) {
        std::vector<double> up = theta, down = theta;
        up[j] += h, down[j] -= h;
        const Vector6d expected = (twist_at(up, f) - twist_at(down, f)) / (2 * h);
        EXPECT_LT(worst.note((D.col(j) - expected).norm(), i), 1e-8);
      }
    }
  }
}

TEST(FloatingBase, HeldBaseHasZeroTwist) {
  const Servicer s = random_servicer(3);
  FloatingBase base(s.model, false);
  base.place(s.theta());
  base.move(s.rates(), Momentumd{{1, 2, 3}, {4, 5, 6}});
  EXPECT_EQ(base.base_twist().norm(), 0);
  EXPECT_EQ(base.per_rate().norm(), 0);
  Matrix6Xd J, J_g;
  base.frame_jacobian(0, J);
  base.generalized_jacobian(0, J_g);
  EXPECT_EQ((J - J_g).norm(), 0);
}

TEST(FloatingBase, RejectsAForest) {
  RobotOptions options;
  options.targets = 1;
  Random random(1);
  const Model model = random_model(options, random);
  EXPECT_THROW(FloatingBase(model, true), std::invalid_argument);
}

}  // namespace floating_base_test
}  // namespace grapnel::testing
