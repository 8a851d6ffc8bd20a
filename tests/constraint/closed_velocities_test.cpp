/// Closing of loops: the plastic impact on velocities and the projection of coordinates, both in the mass metric.

#include <gtest/gtest.h>

#include "constraint/closed_case.hpp"
#include "grapnel/dynamics/momentum.hpp"
#include "support/eigen_values.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace closed_velocities_test {

// Case `index` with velocities that open the loops, and sometimes prescribed ones.
struct Opening {
  ClosedCase c;
  std::vector<std::uint8_t> prescribed;
  std::vector<double> v;
};
Opening opening(int index) {
  Opening o{random_closed(index), {}, {}};
  if (index % 2 == 1) o.prescribed = with_prescribed(o.c, index).prescribed;
  Random random(6000 + index);
  o.v = random.values(o.c.model.velocities(), 1.5);
  return o;
}
// Momentum of everything about W's origin and energy at velocities v.
Eigen::Matrix<double, 6, 1> momentum(const ClosedCase& c, const std::vector<double>& v) {
  const State s{c.state.q, v};
  return eigen(momentum_about(c.model, forward_kinematics(c.model, s), {0, 0, 0}));
}
bool free_base(const Opening& o) {
  return o.c.model.has_free_root(0) && (o.prescribed.empty() || o.prescribed[0] == 0);
}

TEST(CloseVelocities, IsTheProjectionInTheMassMetric) {
  // Measured 2e-13, 4e-13 and 1e-15; 2e-13, 5e-15 and 3e-15. Over 25 seeds up to 6e-11 for the references.
  Worst dense_worst("against dense projection"), maximal_worst("against maximal coordinates"), slip("J v+");
  Worst impulse("M dv - J^T P"), energy("energy identity"), momentum_worst("momentum");
  int balanced = 0;
  for (int i = 0; i < kClosed; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Opening o = opening(i);
    const ClosedCase& c = o.c;
    const DenseLoops dense(c.model, c.state, c.closures, o.prescribed);
    LoopSolver solver(c.model, c.closures);
    Workspace workspace(c.model);
    std::vector<double> v = o.v;
    solver.close_velocities(c.state.q, o.prescribed, workspace, v);
    const Eigen::VectorXd before = eigen(o.v), after = eigen(v), change = after - before;
    EXPECT_GT((dense.J * before).norm(), 1e-2);
    EXPECT_LT(dense_worst.note(relative_difference(after, dense.closed(before)), i), 1e-9);
    const State open{c.state.q, o.v};
    const oracle::MaximalSolution expected =
        oracle::MaximalSystem(c.model, c.closures).close_velocities(oracle::maximal_state(c.model, open), o.prescribed);
    EXPECT_LT(maximal_worst.note(relative_difference(after, eigen(expected.joints)), i), 1e-9);
    EXPECT_LT(slip.note((dense.J * after).norm() / (dense.J.norm() * before.norm()), i), 1e-13);
    for (int k = 0; k < c.model.velocities(); ++k) {
      if (!o.prescribed.empty() && o.prescribed[k] != 0) {
        EXPECT_EQ(v[k], o.v[k]);
      }
    }
    // M dv = J^T P in what is free, and T- - T+ = dv^T M dv / 2 where nothing is prescribed.
    const std::span<const double> rows = solver.multipliers();
    const Eigen::VectorXd P = Eigen::Map<const Eigen::VectorXd>(rows.data(), static_cast<Eigen::Index>(rows.size()));
    const Eigen::VectorXd given = dense.J_free.transpose() * P;
    EXPECT_LT(impulse.note(relative_difference(Eigen::VectorXd(dense.M_free * change(dense.free)), given), i), 1e-9);
    EXPECT_EQ(solver.rank(), dense.rank);
    EXPECT_LT(solver.contradiction(), 1e-10);
    if (o.prescribed.empty()) {
      const auto kinetic = [&](const std::vector<double>& w) {
        const State s{c.state.q, w};
        return kinetic_energy(c.model, forward_kinematics(c.model, s), s);
      };
      const double lost = change.dot(dense.M * change) / 2;
      EXPECT_GT(lost, 0);
      EXPECT_LT(energy.note(std::abs(kinetic(o.v) - kinetic(v) - lost) / kinetic(o.v), i), 1e-12);
    }
    if (!free_base(o) || !o.prescribed.empty()) continue;
    ++balanced;
    EXPECT_GT(momentum(c, o.v).norm(), 1);
    EXPECT_LT(momentum_worst.note((momentum(c, v) - momentum(c, o.v)).norm() / momentum(c, o.v).norm(), i), 1e-12);
  }
  EXPECT_GT(balanced, kClosed / 5);
}

TEST(CloseVelocities, LeavesConsistentVelocitiesUnchanged) {
  Worst worst("change of velocities that fit");  // measured 4e-13; 1e-12 and more at -O1
  for (int i = 0; i < kClosed; ++i) {
    SCOPED_TRACE(seed_note(i));
    const ClosedCase c = random_closed(i);
    LoopSolver solver(c.model, c.closures);
    Workspace workspace(c.model);
    std::vector<double> v = c.state.v;
    solver.close_velocities(c.state.q, {}, workspace, v);
    EXPECT_LT(worst.note(relative_difference(eigen(v), eigen(c.state.v)), i), 1e-10);
  }
}

// Maximum defects, computed independently from poses and twists.
ClosureDefect defects(const ClosedCase& c, const State& state) {
  const Kinematics k = forward_kinematics(c.model, state);
  ClosureDefect most;
  for (const LoopClosure& l : c.closures) {
    const Posed X_WC = k.X_WB[l.body_a] * l.X_AC, X_WD = k.X_WB[l.body_b] * l.X_BD;
    const Eigen::Vector3d w = eigen(k.V_WB[l.body_a].angular - k.V_WB[l.body_b].angular);
    const Eigen::Vector3d slip = eigen(shift(k.V_WB[l.body_a], X_WC.p - k.X_WB[l.body_a].p).linear -
                                       shift(k.V_WB[l.body_b], X_WC.p - k.X_WB[l.body_b].p).linear);
    most.position = std::max(most.position, (eigen(X_WC.p) - eigen(X_WD.p)).norm());
    most.velocity = std::max(most.velocity, slip.norm());
    if (l.model == GraspModel::point) continue;
    const Eigen::Vector3d h = eigen(X_WC.R * l.hinge_C), h_D = eigen(X_WD.R * l.hinge_C);
    const bool rigid = l.model == GraspModel::rigid;
    const double angle =
        rigid ? rotation_angle(transpose(X_WC.R) * X_WD.R) : std::atan2(h.cross(h_D).norm(), h.dot(h_D));
    most.angle = std::max(most.angle, angle);
    most.angular_velocity = std::max(most.angular_velocity, rigid ? w.norm() : (w - w.dot(h) * h).norm());
  }
  return most;
}

TEST(Project, RestoresCoordinatesAndVelocities) {
  // Measured 1e-14, 1e-15, 4e-14, 1e-14.
  Worst position("position"), angle("angle"), velocity("velocity"), angular("angular velocity"),
      own("reported defects");
  for (int i = 0; i < kClosed; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Opening o = opening(i);
    const ClosedCase& c = o.c;
    // From much larger to much smaller than an integrator's errors; smaller if a loop is near a singular configuration
    // and could not be closed from there (prescribed joints do not move).
    const double size = std::pow(10, -2 - 2 * (i % 5)) * DenseLoops(c.model, c.state, c.closures, o.prescribed).least;
    LoopSolver solver(c.model, c.closures);
    Workspace workspace(c.model);
    State state = moved(c.model, c.state, eigen(o.v), size);
    state.v = values(eigen(c.state.v) + size * eigen(o.v));
    const ClosureDefect before = defects(c, state);
    const ProjectionResult r = solver.project(o.prescribed, workspace, state.q, state.v);
    // Small angles may be reported as their sines.
    const auto same = [&](double reported, double measured) {
      EXPECT_LT(own.note(std::abs(reported - measured) / (measured + 1e-7), i), 1e-5 + measured * measured / 5);
    };
    same(r.before.position, before.position), same(r.before.angle, before.angle);
    same(r.before.velocity, before.velocity), same(r.before.angular_velocity, before.angular_velocity);
    EXPECT_TRUE(r.converged);
    const ClosureDefect after = defects(c, state);
    EXPECT_LT(position.note(after.position, i), 1e-13);
    EXPECT_LT(angle.note(after.angle, i), 1e-13);
    EXPECT_LT(velocity.note(after.velocity, i), 1e-12);
    EXPECT_LT(angular.note(after.angular_velocity, i), 1e-12);
    EXPECT_LT(r.after.position, 1e-13);
    EXPECT_LT(r.after.angle, 1e-13);
  }
}

TEST(Project, IsMinimalInTheMassMetricToFirstOrder) {
  // Measured 1e-4, 2e-5, 6e-7 and 6e-7, all of second order; over 17 seeds 1e-3, 3e-5, 1e-6 and 6e-6.
  Worst coordinates("coordinates against the dense projection"), velocities("velocities"), center("centre of mass"),
      changed_momentum("momentum");
  int free_roots = 0;
  for (int i = 0; i < kClosed; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Opening o = opening(i);
    const ClosedCase& c = o.c;
    LoopSolver solver(c.model, c.closures);
    Workspace workspace(c.model);
    const DenseLoops dense(c.model, c.state, c.closures, o.prescribed);
    const double size = 1e-6 * dense.least;  // neglected: its ratio to the square of `least`
    const State start = moved(c.model, c.state, eigen(o.v), size);
    State state{start.q, values(eigen(c.state.v) + size * eigen(o.v))};
    const std::vector<double> v = state.v;
    solver.project(o.prescribed, workspace, state.q, state.v);
    // From the closed state d away: (1 - P) d is left of it.
    const Eigen::VectorXd left = dense.closed(eigen(o.v));
    const Eigen::VectorXd found = displacement(c.model, c.state, state) / size;
    EXPECT_LT(coordinates.note((found - left).norm() / eigen(o.v).norm(), i), 1e-2);
    const Eigen::VectorXd expected = DenseLoops(c.model, state, c.closures, o.prescribed).closed(eigen(v));
    EXPECT_LT(velocities.note((eigen(state.v) - expected).norm() / (eigen(v) - expected).norm(), i), 1e-2);
    for (int k = 0; k < c.model.velocities(); ++k) {
      if (!o.prescribed.empty() && o.prescribed[k] != 0) {
        EXPECT_EQ(state.v[k], v[k]);
      }
    }
    for (const Body& b : c.model.bodies()) {
      if (o.prescribed.empty() || velocity_count(b.description.joint.type) == 0 || o.prescribed[b.v] == 0) continue;
      for (int k = 0; k < coordinate_count(b.description.joint.type); ++k) {
        EXPECT_NEAR(state.q[b.q + k], start.q[b.q + k], 1e-15);
      }
    }
    if (!free_base(o) || !o.prescribed.empty()) continue;
    ++free_roots;
    // What is moved is of order size, what the centre of mass moves of its square; momentum is kept by the velocities'
    // projection at the coordinates found.
    const auto com = [&](const State& s) { return eigen(center_of_mass(c.model, forward_kinematics(c.model, s))); };
    EXPECT_LT(center.note((com(state) - com(start)).norm() / size, i), 1e-4);
    EXPECT_GT((displacement(c.model, start, state)).norm(), size / 1000);
    const ClosedCase at{c.model, state, c.closures, {}};
    changed_momentum.note((momentum(at, state.v) - momentum(at, v)).norm() / (size * momentum(at, v).norm()), i);
    EXPECT_LT(changed_momentum.value(), 1e-4);
  }
  EXPECT_GT(free_roots, kClosed / 5);
}

TEST(Project, ReportsLoopsThatCannotClose) {
  // Two links of one metre each whose ends should meet at three metres.
  ModelBuilder builder;
  const char* names[] = {"base", "one", "two"};
  for (int i = 0; i < 3; ++i) {
    BodyDescription b;
    b.name = names[i], b.parent = i > 0 ? names[i - 1] : "", b.joint.name = b.name + "_joint";
    b.joint.type = i > 0 ? JointType::revolute : JointType::fixed;
    if (i > 1) b.X_PF.p = {1, 0, 0};
    b.mass = 1, b.inertia = Symmetric3d::diagonal(0.1, 0.1, 0.1);
    builder.add(b);
  }
  const Model model = builder.build();
  const LoopClosure c{
      "reach",           2,        {Rotationd::identity(), {1, 0, 0}}, 0, {Rotationd::identity(), {3, 0, 0}},
      GraspModel::point, {0, 0, 1}};
  LoopSolver solver(model, {&c, 1});
  Workspace workspace(model);
  State state = zero_state(model);
  state.q = {0.3, -0.5};
  const ProjectionResult r = solver.project({}, workspace, state.q, state.v);
  EXPECT_FALSE(r.converged);
  EXPECT_GT(r.after.position, 0.999);
  for (double q : state.q) EXPECT_TRUE(std::isfinite(q));
}

// A rotation by half a turn has a vanishing sine.
TEST(Project, HalfTurnIsNotClosed) {
  for (int i = 0; i < 20; ++i) {
    SCOPED_TRACE(seed_note(i));
    ClosedCase c = random_closed(i);
    bool turned = false;
    for (LoopClosure& l : c.closures) {
      // About any axis for a rigid closure, about a normal of the hinge's for a hinge.
      const Vector3d other = std::abs(l.hinge_C[0]) < 0.6 ? Vector3d{1, 0, 0} : Vector3d{0, 1, 0};
      const Vector3d normal = cross(l.hinge_C, other);
      l.X_BD.R = l.X_BD.R * rotation_about((1 / norm(normal)) * normal, M_PI);
      turned = turned || l.model != GraspModel::point;
    }
    if (!turned) continue;
    LoopSolver solver(c.model, c.closures);
    Workspace workspace(c.model);
    const ProjectionResult r = solver.project({}, workspace, c.state.q, c.state.v);
    EXPECT_GT(r.before.angle, 3);
    EXPECT_TRUE(!r.converged || defects(c, c.state).angle < 1e-12) << "angle " << defects(c, c.state).angle;
  }
}

}  // namespace closed_velocities_test
}  // namespace grapnel::testing
