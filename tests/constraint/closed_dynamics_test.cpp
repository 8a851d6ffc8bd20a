/// Accelerations with closures: the range-space method against maximal coordinates and coordinate partitioning, the
/// contact-space inertia against dense matrices, Jacobians against finite differences.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "constraint/closed_case.hpp"
#include "grapnel/dynamics/mass_matrix.hpp"
#include "oracle/partitioned_dynamics.hpp"
#include "support/eigen_values.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace closed_dynamics_test {

struct Accelerations {
  std::vector<double> vdot, force;
};
Accelerations accelerate(LoopSolver& solver, const ClosedCase& c, const oracle::MaximalLoads& loads,
                         double feedback = 0) {
  Workspace workspace(c.model);
  Accelerations a{std::vector<double>(c.model.velocities()), std::vector<double>(c.model.velocities())};
  solver.accelerations(dynamics_input(c.model, c.state, loads, workspace), feedback, workspace, a.vdot, a.force);
  return a;
}

// Generalized forces of wrenches on bodies a at C, given in C's axes, and their opposites on bodies b.
Eigen::VectorXd closure_forces(const ClosedCase& c, const std::vector<oracle::Wrench6>& wrenches) {
  const Kinematics k = forward_kinematics(c.model, c.state);
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(c.model.velocities());
  Eigen::MatrixXd J(6, c.model.velocities());
  for (std::size_t i = 0; i < wrenches.size(); ++i) {
    const LoopClosure& closure = c.closures[i];
    const Posed X_WC = k.X_WB[closure.body_a] * closure.X_AC;
    oracle::Wrench6 F_W;
    F_W << eigen(X_WC.R) * wrenches[i].head<3>(), eigen(X_WC.R) * wrenches[i].tail<3>();
    point_jacobian(c.model, k, closure.body_a, X_WC.p, J);
    sum += J.transpose() * F_W;
    point_jacobian(c.model, k, closure.body_b, X_WC.p, J);
    sum -= J.transpose() * F_W;
  }
  return sum;
}

Eigen::VectorXd multipliers_of(const LoopSolver& solver) {
  const std::span<const double> rows = solver.multipliers();
  return Eigen::Map<const Eigen::VectorXd>(rows.data(), static_cast<Eigen::Index>(rows.size()));
}

TEST(ClosedCases, CoverLoopsOfEveryKind) {
  int redundant = 0, locked = 0, several = 0, fixed = 0, prescribed = 0, held = 0, own_target = 0, spherical = 0;
  for (int i = 0; i < kClosed; ++i) {
    const ClosedCase c = random_closed(i);
    const DenseLoops dense(c.model, c.state, c.closures);
    redundant += dense.rank < dense.J.rows();
    locked += dense.rank == c.model.velocities() - 6;
    several += c.closures.size() > 1;
    fixed += c.model.bodies()[0].description.joint.type == JointType::fixed;
    bool target_held[2] = {false, false};
    int targets = 0;
    for (const Body& b : c.model.bodies()) {
      targets += b.description.name.starts_with("target");
      spherical += b.description.joint.type == JointType::spherical;
    }
    for (const LoopClosure& l : c.closures) {
      target_held[c.model.bodies()[l.body_b].description.name == "target1"] = true;
    }
    own_target += targets == 2 && !(target_held[0] && target_held[1]);
    const oracle::MaximalLoads loads = with_prescribed(c, i);
    prescribed += !loads.prescribed.empty();
    held += !loads.prescribed.empty() && c.model.bodies()[0].description.joint.type == JointType::free &&
            loads.prescribed[0] != 0;
    EXPECT_GT(eigen(c.state.v).norm(), 0.1);
  }
  std::printf(
      "[ measured ] of %d: %d redundant, %d several closures, %d fixed base, %d prescribed, %d base held, "
      "%d with a separate target, %d spherical, %d locked\n",
      kClosed, redundant, several, fixed, prescribed, held, own_target, spherical, locked);
  EXPECT_GT(redundant, kClosed / 5);
  EXPECT_GT(several, kClosed / 4);
  EXPECT_GT(fixed, kClosed / 10);
  EXPECT_GT(prescribed, kClosed / 3);
  EXPECT_GT(held, kClosed / 20);
  EXPECT_GT(own_target, kClosed / 20);
  EXPECT_GT(spherical, kClosed / 10);
}

TEST(LoopSolver, AgreesWithMaximalCoordinates) {
  // Measured 1e-12, 6e-12 and 1e-11; wrenches 1e-10, contradictions 2e-15. Ten times that over 25 seeds.
  Worst accelerations("accelerations"), force("generalized forces of the closures"), bias("with nothing acting");
  Worst wrench("wrenches at the closures, all rows independent"), contradiction("contradiction");
  for (int i = 0; i < kClosed; ++i) {
    SCOPED_TRACE(seed_note(i));
    const ClosedCase c = random_closed(i);
    const oracle::MaximalSystem reference(c.model, c.closures);
    const oracle::MaximalState at = oracle::maximal_state(c.model, c.state);
    const oracle::MaximalSolution expected = reference.accelerations(at, c.loads);
    ASSERT_LT(expected.residual, 1e-10);
    LoopSolver solver(c.model, c.closures);
    const Accelerations found = accelerate(solver, c, c.loads);
    EXPECT_LT(accelerations.note(relative_difference(eigen(found.vdot), eigen(expected.joints)), i), 1e-9);
    EXPECT_EQ(eigen(found.force), eigen(c.loads.tau));
    const DenseLoops dense(c.model, c.state, c.closures);
    EXPECT_EQ(solver.rows(), dense.J.rows());
    EXPECT_EQ(solver.rank(), dense.rank);
    EXPECT_LT(contradiction.note(solver.contradiction(), i), 1e-10);
    const Eigen::VectorXd lambda = multipliers_of(solver);
    const Eigen::VectorXd generalized = closure_forces(c, expected.closures);
    EXPECT_LT(force.note(relative_difference(Eigen::VectorXd(dense.J.transpose() * lambda), generalized), i), 1e-9);
    // Directions of a hinge's rows are the library's choice; those of the others are C's axes.
    Eigen::Index row = 0;
    for (std::size_t k = 0; k < c.closures.size(); ++k) {
      const int rows = row_count(c.closures[k].model);
      const Eigen::VectorXd same_rows = expected.closures[k].tail(c.closures[k].model == GraspModel::rigid ? 6 : 3);
      const Eigen::VectorXd own = lambda.segment(row + rows - same_rows.size(), same_rows.size());
      if (dense.rank == dense.J.rows()) {
        EXPECT_LT(wrench.note(relative_difference(own, same_rows), i), 1e-8);
      }
      row += rows;
    }
    // The velocities' part alone, at three times the speed.
    ClosedCase fast = c;
    for (double& v : fast.state.v) v *= 3;
    const oracle::MaximalSolution free = reference.accelerations(oracle::maximal_state(c.model, fast.state));
    oracle::MaximalLoads nothing;
    nothing.tau.assign(c.model.velocities(), 0);
    EXPECT_LT(bias.note(relative_difference(eigen(accelerate(solver, fast, nothing).vdot), eigen(free.joints)), i),
              1e-9);
  }
}

TEST(LoopSolver, FollowsPrescribedJoints) {
  // Measured 9e-12 for both; over 25 seeds 2e-10.
  Worst accelerations("accelerations"), force("forces at prescribed joints");
  int tried = 0;
  for (int i = 0; i < kClosed; ++i) {
    SCOPED_TRACE(seed_note(i));
    const ClosedCase c = random_closed(i);
    const oracle::MaximalLoads loads = with_prescribed(c, i);
    if (loads.prescribed.empty()) continue;
    ++tried;
    const oracle::MaximalSolution expected =
        oracle::MaximalSystem(c.model, c.closures).accelerations(oracle::maximal_state(c.model, c.state), loads);
    ASSERT_LT(expected.residual, 1e-10);
    LoopSolver solver(c.model, c.closures);
    const Accelerations found = accelerate(solver, c, loads);
    EXPECT_LT(accelerations.note(relative_difference(eigen(found.vdot), eigen(expected.joints)), i), 1e-9);
    EXPECT_LT(force.note(relative_difference(eigen(found.force), eigen(expected.force)), i), 1e-9);
    EXPECT_LT(solver.contradiction(), 1e-10);
    for (int k = 0; k < c.model.velocities(); ++k) {
      if (loads.prescribed[k] != 0) {
        EXPECT_NEAR(found.vdot[k], loads.acceleration[k], 1e-14);  // a root's passes through - g + g
      }
    }
    // The same solver without anything prescribed, then again: nothing is left behind.
    accelerate(solver, c, c.loads);
    EXPECT_EQ(accelerate(solver, c, loads).vdot, found.vdot);
  }
  EXPECT_GT(tried, kClosed / 3);
}

TEST(LoopSolver, AgreesWithCoordinatePartitioning) {
  // Measured 1e-12 and 5e-12; over 25 seeds 1e-10.
  Worst accelerations("accelerations"), force("J^T lambda");
  for (int i = 0; i < kClosed; ++i) {
    SCOPED_TRACE(seed_note(i));
    ClosedCase c = random_closed(i);
    c.loads.external.clear();
    LoopSolver solver(c.model, c.closures);
    const Accelerations found = accelerate(solver, c, c.loads);
    const PartitionedSolution expected =
        partitioned_dynamics(c.model, c.state, c.closures, c.loads.tau, c.loads.gravity);
    EXPECT_LT(accelerations.note(relative_difference(eigen(found.vdot), eigen(expected.vdot)), i), 1e-9);
    const DenseLoops dense(c.model, c.state, c.closures);
    EXPECT_EQ(static_cast<int>(expected.independent.size()), c.model.velocities() - dense.rank);
    const Eigen::VectorXd own = dense.J.transpose() * multipliers_of(solver);
    const Eigen::VectorXd other = dense.J.transpose() * eigen(expected.multipliers);
    EXPECT_LT(force.note(relative_difference(own, other), i), 1e-9);
  }
}

TEST(LoopSolver, ContactInertiaAgreesWithDenseMatrices) {
  Worst worst("J M^-1 J^T");  // measured 2e-14; over 25 seeds 2e-13
  for (int i = 0; i < kClosed; ++i) {
    SCOPED_TRACE(seed_note(i));
    const ClosedCase c = random_closed(i);
    const oracle::MaximalLoads prescribed = with_prescribed(c, i);
    LoopSolver solver(c.model, c.closures);
    for (const oracle::MaximalLoads& loads : {c.loads, prescribed}) {
      accelerate(solver, c, loads);
      const Eigen::MatrixXd W = DenseLoops(c.model, c.state, c.closures, loads.prescribed).contact_inertia();
      EXPECT_LT(worst.note(relative_difference(solver.contact_inertia(), W), i), 1e-11);
    }
  }
}

// Also where the closures are open: D's body then counts with its point that is at C.
TEST(ClosureJacobian, IsTheRateOfTheRelativePose) {
  Worst worst("J v against finite differences");  // measured 8e-10; over 25 seeds 3e-9
  for (int i = 0; i < kClosed; ++i) {
    SCOPED_TRACE(seed_note(i));
    const ClosedCase c = random_closed(i);
    Random random(2000 + i);
    const State state = random_state(c.model, random);
    const Eigen::VectorXd v = eigen(state.v);
    const Kinematics k = forward_kinematics(c.model, state);
    const Eigen::MatrixXd J = closure_jacobian(c.model, k, c.closures);
    const auto central = [&](auto&& f) {
      const double h = 1e-3;
      const auto at = [&](double step) { return f(forward_kinematics(c.model, moved(c.model, state, v, step))); };
      const Eigen::MatrixXd near = at(h) - at(-h), far = at(2 * h) - at(-2 * h);
      return Eigen::MatrixXd((8 * near - far) / (12 * h));
    };
    Eigen::Index row = 0;
    for (const LoopClosure& l : c.closures) {
      const Posed X_WC = k.X_WB[l.body_a] * l.X_AC, X_bC = inverse(k.X_WB[l.body_b]) * X_WC;
      const Eigen::Vector3d slip = central([&](const Kinematics& m) {
        return Eigen::MatrixXd(eigen(m.X_WB[l.body_a] * l.X_AC.p) - eigen(m.X_WB[l.body_b] * X_bC.p));
      });
      const Eigen::Matrix3d spin = central([&](const Kinematics& m) {
        return Eigen::MatrixXd(eigen(m.X_WB[l.body_b].R * X_bC.R).transpose() * eigen(m.X_WB[l.body_a].R * l.X_AC.R));
      });
      const Eigen::Vector3d w(spin(2, 1), spin(0, 2), spin(1, 0)), u = eigen(X_WC.R).transpose() * slip;
      const int rows = row_count(l.model);
      const Eigen::VectorXd own = J.middleRows(row, rows) * v;
      EXPECT_LT(worst.note((own.tail(3) - u).norm(), i), 1e-8);
      if (l.model == GraspModel::rigid) {
        EXPECT_LT(worst.note((own.head(3) - w).norm(), i), 1e-8);
      }
      if (l.model == GraspModel::hinge) {
        const Eigen::Vector3d h = eigen(l.hinge_C);
        EXPECT_LT(worst.note(std::abs(own.head(2).norm() - (w - h.dot(w) * h).norm()), i), 1e-8);
      }
      row += rows;
    }
    EXPECT_EQ(row, J.rows());
  }
}

// u' + 2 u / T + e / T^2 = 0, each part alone.
TEST(LoopSolver, FeedbackReducesClosureDefects) {
  constexpr double kRate = 7, kStep = 1e-7;
  // Measured 2e-14 and 2e-7, the step's own error.
  Worst velocity("2 u / T"), position("e / T^2");
  for (int i = 0; i < kClosed / 3; ++i) {
    SCOPED_TRACE(seed_note(i));
    ClosedCase c = random_closed(i);
    Random random(3000 + i);
    const Eigen::VectorXd d = eigen(random.values(c.model.velocities(), 1));
    LoopSolver solver(c.model, c.closures);
    const DenseLoops dense(c.model, c.state, c.closures);
    const std::vector<double> v = c.state.v;
    c.state.v = values(eigen(v) + d);
    const Eigen::VectorXd slowed =
        eigen(accelerate(solver, c, c.loads, kRate).vdot) - eigen(accelerate(solver, c, c.loads).vdot);
    const Eigen::VectorXd u = dense.J * d;
    EXPECT_LT(velocity.note(relative_difference(Eigen::VectorXd(dense.J * slowed), Eigen::VectorXd(-2 * kRate * u)), i),
              1e-6);
    // Off by kStep d in position, on the closures (there) in velocity.
    c.state.v = v;
    c.state = moved(c.model, c.state, d, kStep);
    const DenseLoops beside(c.model, c.state, c.closures);
    c.state.v = values(beside.closed(eigen(v)));
    const Eigen::VectorXd pulled =
        eigen(accelerate(solver, c, c.loads, kRate).vdot) - eigen(accelerate(solver, c, c.loads).vdot);
    const Eigen::VectorXd e = kStep * (dense.J * d);
    EXPECT_LT(
        position.note(relative_difference(Eigen::VectorXd(beside.J * pulled), Eigen::VectorXd(-kRate * kRate * e)), i),
        1e-4);
  }
}

TEST(LoopSolver, WithoutClosuresEqualsTheRecursion) {
  for (int i = 0; i < 10; ++i) {
    SCOPED_TRACE(seed_note(i));
    ClosedCase c = random_closed(i);
    LoopSolver solver(c.model, {});
    Workspace workspace(c.model);
    std::vector<double> vdot(c.model.velocities()), force(vdot);
    articulated_body<double>(c.model.tree(), dynamics_input(c.model, c.state, c.loads, workspace), workspace.kernel,
                             vdot, force);
    EXPECT_EQ(accelerate(solver, c, c.loads).vdot, vdot);
    EXPECT_EQ(solver.rows(), 0);
    EXPECT_EQ(solver.rank(), 0);
    EXPECT_EQ(solver.least_pivot(), 0);
    EXPECT_EQ(solver.contradiction(), 0);
    const std::vector<double> v = c.state.v, q = c.state.q;
    solver.close_velocities(c.state.q, {}, workspace, c.state.v);
    EXPECT_TRUE(solver.project({}, workspace, c.state.q, c.state.v).converged);
    EXPECT_EQ(c.state.v, v);
    EXPECT_EQ(c.state.q, q);
  }
}

TEST(LoopSolver, ReportsContradictingPrescribedJoints) {
  for (int i = 0; i < 30; ++i) {
    SCOPED_TRACE(seed_note(i));
    const ClosedCase c = random_closed(i);
    oracle::MaximalLoads loads = c.loads;
    Random random(4000 + i);
    loads.prescribed.assign(c.model.velocities(), 1);
    loads.acceleration = random.values(c.model.velocities(), 2);
    LoopSolver solver(c.model, c.closures);
    accelerate(solver, c, loads);
    EXPECT_EQ(solver.rank(), 0);
    EXPECT_GT(solver.contradiction(), 1e-3);
    bool named = false;
    for (const LoopClosure& l : c.closures) named = named || solver.contradicting_row().starts_with(l.name);
    EXPECT_TRUE(named) << solver.contradicting_row();
  }
}

TEST(LoopSolver, RejectsInvalidLoops) {
  ModelBuilder builder;
  const auto add = [&](const char* name, const char* parent, JointType type) {
    BodyDescription b;
    b.name = name, b.parent = parent, b.joint.name = std::string(name) + "_joint", b.joint.type = type;
    b.mass = 1, b.inertia = Symmetric3d::diagonal(1, 1, 1);
    builder.add(b);
  };
  add("base", "", JointType::free);
  add("arm", "base", JointType::revolute);
  add("hand", "arm", JointType::fixed);
  add("target", "", JointType::free);
  const Model model = builder.build();
  const auto message = [&](int a, int b) -> std::string {
    const LoopClosure c{"grasp", a, Posed::identity(), b, Posed::identity(), GraspModel::rigid, {0, 0, 1}};
    try {
      LoopSolver solver(model, {&c, 1});
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "accepted";
  };
  const int base = model.body_index("base"), arm = model.body_index("arm"), hand = model.body_index("hand"),
            target = model.body_index("target");
  EXPECT_EQ(message(base, hand), "accepted");
  EXPECT_THAT(message(arm, hand), ::testing::AllOf(::testing::HasSubstr("grasp"), ::testing::HasSubstr("hand"),
                                                   ::testing::HasSubstr("arm")));
  EXPECT_THAT(message(hand, hand), ::testing::HasSubstr("grasp"));
  EXPECT_EQ(message(hand, target), "accepted");  // two trees: two_trees_test.cpp
  EXPECT_THAT(message(-1, hand), ::testing::HasSubstr("grasp"));
  EXPECT_THAT(message(hand, 4), ::testing::HasSubstr("grasp"));
}

}  // namespace closed_dynamics_test
}  // namespace grapnel::testing
