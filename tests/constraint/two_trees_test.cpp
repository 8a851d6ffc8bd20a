/// Closures between bodies of different trees: end-effectors and targets with separate roots, free or fixed, against
/// dense matrices.

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "constraint/closed_case.hpp"
#include "grapnel/dynamics/mass_matrix.hpp"
#include "grapnel/dynamics/momentum.hpp"
#include "oracle/partitioned_dynamics.hpp"
#include "support/eigen_values.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace two_trees_test {

constexpr int kCases = 200;

TEST(TwoTrees, AgreeWithCoordinatePartitioning) {
  // Measured 2e-12, 1e-12 and 1e-13.
  Worst accelerations("accelerations"), force("J^T lambda"), inertia("J M^-1 J^T");
  int deficient = 0;
  for (int i = 0; i < kCases; ++i) {
    SCOPED_TRACE(seed_note(i));
    const ClosedCase c = random_trees(i);
    LoopSolver solver(c.model, c.closures);
    Workspace workspace(c.model);
    // Velocities that satisfy the closures; otherwise the accelerations of redundant rows contradict each other.
    State fitting = c.state;
    solver.close_velocities(c.state.q, {}, workspace, fitting.v);
    std::vector<double> vdot(c.model.velocities()), generalized(vdot);
    solver.accelerations(dynamics_input(c.model, fitting, c.loads, workspace), 0, workspace, vdot, generalized);
    const DenseLoops dense(c.model, fitting, c.closures);
    EXPECT_EQ(solver.rank(), dense.rank);
    EXPECT_LT(inertia.note(relative_difference(solver.contact_inertia(), dense.contact_inertia()), i), 1e-11);
    EXPECT_LT(solver.contradiction(), 1e-9);
    deficient += dense.rank < dense.J.rows();
    const PartitionedSolution expected =
        partitioned_dynamics(c.model, fitting, c.closures, c.loads.tau, c.loads.gravity);
    EXPECT_LT(accelerations.note(relative_difference(eigen(vdot), eigen(expected.vdot)), i), 1e-9);
    const std::span<const double> rows = solver.multipliers();
    const Eigen::VectorXd own =
        dense.J.transpose() * Eigen::Map<const Eigen::VectorXd>(rows.data(), static_cast<Eigen::Index>(rows.size()));
    const Eigen::VectorXd other = dense.J.transpose() * eigen(expected.multipliers);
    EXPECT_GT(other.norm(), 1e-3);
    EXPECT_LT(force.note(relative_difference(own, other), i), 1e-8);
  }
  EXPECT_GT(deficient, 5);
}

TEST(TwoTrees, CloseInVelocityAndConserveMomentum) {
  // Measured 1e-13 and 2e-15.
  Worst velocities("against the dense projection"), momentum("momentum, free roots");
  int free_roots = 0;
  for (int i = 0; i < kCases; ++i) {
    SCOPED_TRACE(seed_note(i));
    const ClosedCase c = random_trees(i);
    LoopSolver solver(c.model, c.closures);
    Workspace workspace(c.model);
    std::vector<double> v = c.state.v;
    solver.close_velocities(c.state.q, {}, workspace, v);
    const DenseLoops dense(c.model, c.state, c.closures);
    EXPECT_GT((dense.J * eigen(c.state.v)).norm(), 1e-2);
    EXPECT_LT(velocities.note(relative_difference(eigen(v), dense.closed(eigen(c.state.v))), i), 1e-9);
    if (i % 3 == 2) continue;
    ++free_roots;
    const auto total = [&](const std::vector<double>& at) {
      const State s{c.state.q, at};
      return eigen(momentum_about(c.model, forward_kinematics(c.model, s), {0, 0, 0}));
    };
    EXPECT_GT(total(c.state.v).norm(), 1);
    EXPECT_LT(momentum.note((total(v) - total(c.state.v)).norm() / total(c.state.v).norm(), i), 1e-12);
  }
  EXPECT_GT(free_roots, kCases / 2);
}

TEST(TwoTrees, AreProjectedTogether) {
  // Measured 2e-14 and 4e-8.
  Worst after("what a projection leaves open [m, rad]"), center("centre of mass, free roots [m]");
  for (int i = 0; i < kCases; ++i) {
    SCOPED_TRACE(seed_note(i));
    const ClosedCase c = random_trees(i);
    const DenseLoops dense(c.model, c.state, c.closures);
    if (dense.rank < dense.J.rows()) continue;
    Random random(7000 + i);
    const State off = moved(c.model, c.state, eigen(random.values(c.model.velocities(), 1)), 1e-4);
    LoopSolver solver(c.model, c.closures);
    Workspace workspace(c.model);
    State s = off;
    const ProjectionResult result = solver.project({}, workspace, s.q, s.v);
    EXPECT_TRUE(result.converged);
    EXPECT_GT(result.before.position, 1e-6);
    const Kinematics k = forward_kinematics(c.model, s);
    for (const LoopClosure& l : c.closures) {
      const ClosureDefect d = closure_defect(l, k);
      EXPECT_LT(after.note(std::max(d.position, d.angle), i), 1e-12);
    }
    if (i % 3 == 2) continue;
    const Vector3d com = center_of_mass(c.model, forward_kinematics(c.model, off));
    EXPECT_LT(center.note(norm(center_of_mass(c.model, k) - com), i), 1e-6);  // order of 1e-4 squared times metres
  }
}

// Two roots fixed to the world cannot be connected by a closure.
TEST(TwoTrees, RejectsTwoFixedRoots) {
  ModelBuilder builder;
  for (const char* name : {"post", "wall"}) {
    BodyDescription b;
    b.name = b.joint.name = name;
    b.joint.type = JointType::fixed;
    b.mass = 1;
    b.inertia = Symmetric3d::diagonal(1, 1, 1);
    builder.add(b);
  }
  const Model model = builder.build();
  const LoopClosure closure{"bolt", 0, Posed::identity(), 1, Posed::identity()};
  try {
    LoopSolver(model, std::span(&closure, 1));
    FAIL();
  } catch (const std::invalid_argument& e) {
    EXPECT_STREQ(e.what(), "loop closure 'bolt': bodies 'post' and 'wall' have no relative motion");
  }
}

}  // namespace two_trees_test
}  // namespace grapnel::testing
