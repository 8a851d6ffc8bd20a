// Base motion from momentum, (2.3)-(2.8), against the full equations.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "dynamics/random_case.hpp"
#include "grapnel/dynamics/free_floating.hpp"
#include "grapnel/dynamics/root_velocity.hpp"
#include "grapnel/spatial/decompositions.hpp"
#include "support/worst.hpp"

namespace grapnel {
namespace free_floating_test {

using namespace testing;

// The tree rooted at b0, and the columns of its velocities.
struct Tree0 {
  explicit Tree0(const Model& model) : root(model.body_index("b0")), joints(joint_velocities(model, root)) {
    if (model.has_free_root(root)) {
      for (int k = 0; k < 6; ++k) base.push_back(model.bodies()[root].v + k);
    }
    all = base;
    all.insert(all.end(), joints.begin(), joints.end());
  }
  int root;
  std::vector<int> joints, base, all;
};

TEST(FreeFloating, BaseTwistCarriesTheGivenMomentum) {
  Worst difference("momentum after base_twist_from_momentum");
  for (int i = 0; i < kRobots; ++i) {
    if (i % 4 == 3) continue;
    SCOPED_TRACE(seed_note(i));
    Case c = random_case(i);
    const Tree0 tree(c.model);
    Random random(100000 + i);
    const Momentumd given = i % 2 == 0 ? Momentumd::zero() : Momentumd{random.vector(10), random.vector(10)};
    set_root_twist(c.model, tree.root, base_twist_from_momentum(c.model, c.state, tree.root, given), c.state);
    const Kinematics kinematics = forward_kinematics(c.model, c.state);
    const int roots[] = {tree.root};
    const Momentumd total = momentum_about(c.model, kinematics, center_of_mass(c.model, kinematics, roots), roots);
    double scale = 1 + eigen(given).norm();  // magnitude of the terms of a vanishing sum
    for (std::size_t b = 0; b < c.model.bodies().size(); ++b) {
      if (c.model.bodies()[b].root == tree.root)
        scale += eigen(body_momentum(c.model, kinematics, static_cast<int>(b)).h).norm();
    }
    ASSERT_LT(difference.note((eigen(total) - eigen(given)).norm() / scale, i), 1e-11);  // measured 1.4e-14
  }
}

// The O(n) kernels of root_velocity.hpp: momenta of all trees against momentum_about, and recovery of the velocities.
TEST(RootVelocities, AreRecoveredFromMomenta) {
  Worst momenta("root_momenta against momentum_about"), back("recover_roots of root_momenta");
  for (int i = 0; i < kRobots; ++i) {
    if (i % 4 == 3) continue;
    SCOPED_TRACE(seed_note(i));
    const Case c = random_case(i);
    DynamicsWorkspace<double> workspace(c.model.tree());
    std::vector<RootMomentum<double>> h(free_root_count(c.model.tree()));
    root_momenta<double>(c.model.tree(), c.state.q, c.state.v, workspace, h);
    const Kinematics kinematics = forward_kinematics(c.model, c.state);
    std::vector<double> q = c.state.q, v = c.state.v;
    std::size_t next = 0;
    for (std::size_t b = 0; b < c.model.bodies().size(); ++b) {
      if (c.model.bodies()[b].parent >= 0) continue;
      const int roots[] = {static_cast<int>(b)};
      const Momentumd expected = momentum_about(c.model, kinematics, center_of_mass(c.model, kinematics, roots), roots);
      ASSERT_LT(momenta.note(relative_difference(eigen(h[next].h), eigen(expected)), i), 1e-12);  // measured 3.3e-15
      ++next;
      std::fill_n(q.begin() + c.model.bodies()[b].q, 3, 0.0);
      std::fill_n(v.begin() + c.model.bodies()[b].v, 6, 0.0);
    }
    ASSERT_EQ(next, h.size());
    recover_roots<double>(c.model.tree(), h, 0.0, workspace, q, v);
    ASSERT_LT(back.note(relative_difference(eigen(v), eigen(c.state.v)), i), 1e-11);  // measured 5.3e-15
    ASSERT_LT(back.note(relative_difference(eigen(q), eigen(c.state.q)), i), 1e-11);  // measured 5.3e-15 with v
  }
}

// (2.3): the twist of any frame is J_g rates + J_b I_b^-1 h, at zero momentum and at any other.
TEST(FreeFloating, GeneralizedJacobianYieldsTheFullTwist) {
  Worst difference("J_g rates + momentum twist against J v"), part("the part momentum has in the twist, at most");
  for (int i = 0; i < kRobots; ++i) {
    SCOPED_TRACE(seed_note(i));
    Case c = random_case(i);
    const Tree0 tree(c.model);
    Random random(100000 + i);
    const bool fixed = tree.base.empty();
    const Momentumd given = i % 2 == 0 || fixed ? Momentumd::zero() : Momentumd{random.vector(10), random.vector(10)};
    if (!fixed)
      set_root_twist(c.model, tree.root, base_twist_from_momentum(c.model, c.state, tree.root, given), c.state);
    const Kinematics kinematics = forward_kinematics(c.model, c.state);
    Eigen::VectorXd rates(tree.joints.size());
    for (std::size_t k = 0; k < tree.joints.size(); ++k) rates[k] = c.state.v[tree.joints[k]];
    for (std::size_t f = 0; f < c.model.frames().size(); ++f) {
      const Frame& frame = c.model.frames()[f];
      if (c.model.bodies()[frame.body].root != tree.root) continue;
      const Vector3d p = frame_pose(c.model, kinematics, static_cast<int>(f)).p;
      const Eigen::VectorXd V = eigen(frame_twist(c.model, kinematics, static_cast<int>(f)));
      const Eigen::VectorXd carried = momentum_twist(c.model, c.state, tree.root, frame.body, p, given);
      const Eigen::MatrixXd J_g = generalized_jacobian(c.model, c.state, tree.root, static_cast<int>(f));
      ASSERT_EQ(J_g, generalized_jacobian(c.model, c.state, tree.root, frame.body, p));
      ASSERT_LT(difference.note((J_g * rates + carried - V).norm() / (1 + V.norm()), i), 1e-11);  // measured 1.2e-14
      part.note(carried.norm(), i);
    }
  }
  EXPECT_GT(part.value(), 1e-2);
}

TEST(FreeFloating, GeneralizedInertiaIsTheInverseOfTheJointBlockOfTheInverse) {
  Worst difference("generalized inertia against inverse of block of inverse");
  for (int i = 0; i < kRobots; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Case c = random_case(i);
    const Tree0 tree(c.model);
    if (tree.joints.empty()) continue;
    const Eigen::MatrixXd M = mass_matrix(c.model, c.state)(tree.all, tree.all);
    const Eigen::Index n = static_cast<Eigen::Index>(tree.joints.size());
    const Eigen::MatrixXd block = M.inverse().bottomRightCorner(n, n);
    const Eigen::MatrixXd I = generalized_inertia(c.model, c.state, tree.root);
    ASSERT_LT(difference.note(relative_difference(I, Eigen::MatrixXd(block.inverse())), i), 1e-9);  // measured 4.1e-14
    ASSERT_LT(relative_difference(I, I.transpose()), 1e-13);
    // Blocks of (2.7).
    const MassBlocks blocks = mass_blocks(c.model, c.state, tree.root);
    ASSERT_EQ(blocks.I_m, M.bottomRightCorner(n, n));
    if (tree.base.empty()) continue;
    ASSERT_EQ(blocks.I_b, M.topLeftCorner(6, 6));
    ASSERT_EQ(blocks.I_bm, M.topRightCorner(6, n));
  }
}

// (2.8) gives the joint accelerations of the full equations; external wrenches enter through J_g^T.
TEST(FreeFloating, ReducedEquationYieldsTheSameJointAccelerations) {
  Worst difference("reduced equation against forward dynamics");
  for (int i = 0; i < kRobots; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Case c = random_case(i);
    const Tree0 tree(c.model);
    if (tree.joints.empty()) continue;
    const ReducedEquation reduced =
        reduced_equation(c.model, c.state, tree.root, c.forces.generalized, c.forces.gravity);
    Eigen::VectorXd rhs = reduced.tau - reduced.c;
    for (const ExternalWrench& e : c.forces.external) {
      if (c.model.bodies()[e.body].root != tree.root) continue;
      rhs += generalized_jacobian(c.model, c.state, tree.root, e.body, e.p_WP).transpose() * eigen(e.F_W);
    }
    const std::vector<double> vdot = forward_dynamics(c.model, c.state, c.forces);
    const Eigen::VectorXd a = eigen(vdot)(tree.joints);
    ASSERT_LT(difference.note(relative_difference(reduced.I.llt().solve(rhs).eval(), a), i), 1e-9);  // measured 4.5e-13
  }
}

TEST(FreeFloating, RejectsInvalidRoots) {
  const Model model = plain_robot(2), fixed = plain_robot(2, JointType::fixed);
  EXPECT_THAT([&] { mass_blocks(model, zero_state(model), 1); },
              ::testing::ThrowsMessage<std::invalid_argument>(::testing::HasSubstr("'root' must be a root body")));
  EXPECT_THAT([&] { base_twist_from_momentum(fixed, zero_state(fixed), 0, Momentumd::zero()); },
              ::testing::ThrowsMessage<std::invalid_argument>(::testing::HasSubstr("the root is fixed to the world")));
}

}  // namespace free_floating_test
}  // namespace grapnel
