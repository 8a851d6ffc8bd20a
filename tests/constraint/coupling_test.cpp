/// Coupled joints as rows of the loop solver, against dense matrices: accelerations, impulses, efforts of prescribed
/// joints and projection, alone and together with closed loops; and their faults in descriptions.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "constraint/closed_case.hpp"
#include "grapnel/dynamics/mass_matrix.hpp"
#include "grapnel/dynamics/newton_euler.hpp"
#include "grapnel/model/coupling.hpp"
#include "grapnel/spatial/decompositions.hpp"
#include "oracle/partitioned_dynamics.hpp"
#include "support/eigen_values.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace coupling_test {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

Eigen::MatrixXd coupling_rows(const Model& model) {
  Eigen::MatrixXd C = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(model.couplings().size()), model.velocities());
  for (Eigen::Index row = 0; const JointCoupling& coupling : model.couplings()) {
    for (const auto& [body, factor] : coupling.joints) C(row, model.bodies()[body].v) = factor;
    ++row;
  }
  return C;
}

// Closures' rows, then couplings', on the velocities that are not prescribed.
struct DenseRows {
  DenseLoops loops;
  Eigen::MatrixXd A;      // all velocities
  bool solvable = false;  // every coupling is independent of the other rows

  DenseRows(const ClosedCase& c, const oracle::MaximalLoads& loads)
      : loops(c.model, c.state, c.closures, loads.prescribed), A(loops.J.rows(), c.model.velocities()) {
    const Eigen::MatrixXd C = coupling_rows(c.model);
    A.conservativeResize(loops.J.rows() + C.rows(), Eigen::NoChange);
    A << loops.J, C;
    Eigen::MatrixXd Y = half();
    for (Eigen::Index i = 0; i < Y.cols(); ++i) {
      if (Y.col(i).norm() > 1e-9) Y.col(i).normalize();
    }
    const Eigen::VectorXd sigma = Eigen::JacobiSVD<Eigen::MatrixXd>(Y).singularValues();
    const auto rank = (sigma.array() > 1e-2).count(), small = (sigma.array() < 1e-10).count();
    solvable = rank + small == sigma.size() && rank == loops.rank + C.rows() &&
               rank < static_cast<Eigen::Index>(loops.free.size());
  }
  // L^-1 A^T with M = L L^T.
  Eigen::MatrixXd half() const {
    return Eigen::LLT<Eigen::MatrixXd>(loops.M_free).matrixL().solve(A(Eigen::all, loops.free).transpose());
  }
  // Velocities or accelerations nearest to x in the metric of M with A y = b, among those of `free`.
  Eigen::VectorXd nearest(const Eigen::VectorXd& x, const Eigen::VectorXd& b) const {
    Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> solver;
    solver.setThreshold(1e-8);
    solver.compute(half().transpose());
    Eigen::VectorXd y = x;
    y(loops.free) += Eigen::LLT<Eigen::MatrixXd>(loops.M_free)
                         .matrixU()
                         .solve(Eigen::VectorXd(solver.solve(Eigen::VectorXd(b - A * x))));
    return y;
  }
};

struct Found {
  std::vector<double> vdot, force;
};
Found accelerations(LoopSolver& solver, const ClosedCase& c, const oracle::MaximalLoads& loads) {
  Workspace workspace(c.model);
  Found found{std::vector<double>(c.model.velocities()), std::vector<double>(c.model.velocities())};
  solver.accelerations(dynamics_input(c.model, c.state, loads, workspace), 0, workspace, found.vdot, found.force);
  return found;
}

TEST(CoupledJoints, AccelerateAsDenseMatricesDemand) {
  Worst alone("accelerations"), looped("with loops"), force("motor efforts"), inertia("J M^-1 J^T");
  int tried = 0, with_loops = 0, with_prescribed_joints = 0;
  for (int i = 0; i < kClosed; ++i) {
    SCOPED_TRACE(seed_note(i));
    ClosedCase c = coupled_case(i);
    const std::vector<LoopClosure> closures = c.closures;
    for (const bool closed : {false, true}) {
      c.closures = closed ? closures : std::vector<LoopClosure>{};
      const oracle::MaximalLoads loads = i % 2 == 0 ? c.loads : with_prescribed(c, i);
      const DenseRows dense(c, loads);
      if (!dense.solvable) continue;
      ++tried, with_loops += closed, with_prescribed_joints += !loads.prescribed.empty();
      // The same system without couplings gives J vdot = -Jdot v, and the accelerations nearest to which it moves.
      const ClosedCase uncoupled = random_closed(i);
      LoopSolver loops(uncoupled.model, c.closures), open(uncoupled.model, {});
      const Eigen::VectorXd of_loops = eigen(accelerations(loops, uncoupled, loads).vdot);
      const Eigen::VectorXd free = eigen(accelerations(open, uncoupled, loads).vdot);
      Eigen::VectorXd b = Eigen::VectorXd::Zero(dense.A.rows());
      b.head(dense.loops.J.rows()) = dense.loops.J * of_loops;
      const Eigen::VectorXd expected = dense.nearest(free, b);

      LoopSolver solver(c.model, c.closures);
      const Found found = accelerations(solver, c, loads);
      EXPECT_LT((closed ? looped : alone).note(relative_difference(eigen(found.vdot), expected), i), 1e-9);
      EXPECT_LT((dense.A * eigen(found.vdot) - b).tail(coupling_rows(c.model).rows()).norm(), 1e-9);
      EXPECT_EQ(solver.rank(), dense.loops.rank + static_cast<int>(c.model.couplings().size()));
      EXPECT_LT(solver.contradiction(), 1e-9);
      // Inverse dynamics: forces of the motion less those of the rows, M dv = f + A^T lambda.
      const Eigen::VectorXd rows = Eigen::Map<const Eigen::VectorXd>(solver.multipliers().data(), dense.A.rows());
      const Eigen::VectorXd change = dense.loops.M * (eigen(found.vdot) - free) - dense.A.transpose() * rows;
      const Eigen::VectorXd motors = eigen(accelerations(open, uncoupled, loads).force) + change;
      EXPECT_LT(force.note(relative_difference(eigen(found.force), motors), i), 1e-9);
      EXPECT_LT(inertia.note(relative_difference(solver.contact_inertia(),
                                                 Eigen::MatrixXd(dense.half().transpose() * dense.half())),
                             i),
                1e-11);
    }
  }
  std::printf("[ measured ] %d systems, %d with loops, %d with prescribed motion\n", tried, with_loops,
              with_prescribed_joints);
  EXPECT_GT(tried, kClosed);
  EXPECT_GT(with_loops, kClosed / 4);
  EXPECT_GT(with_prescribed_joints, kClosed / 4);
}

TEST(CoupledJoints, TakePartInImpulses) {
  Worst worst("velocities"), impulse("M dv - A^T P");
  for (int i = 0; i < kClosed; ++i) {
    SCOPED_TRACE(seed_note(i));
    const ClosedCase c = coupled_case(i);
    const DenseRows dense(c, {});
    if (!dense.solvable) continue;
    const Eigen::VectorXd before = eigen(c.state.v);
    const Eigen::VectorXd expected = dense.nearest(before, Eigen::VectorXd::Zero(dense.A.rows()));
    LoopSolver solver(c.model, c.closures);
    Workspace workspace(c.model);
    std::vector<double> v = c.state.v;
    solver.close_velocities(c.state.q, {}, workspace, v);
    EXPECT_LT(worst.note(relative_difference(eigen(v), expected), i), 1e-9);
    const Eigen::VectorXd rows = Eigen::Map<const Eigen::VectorXd>(solver.multipliers().data(), dense.A.rows());
    EXPECT_LT(impulse.note(relative_difference(Eigen::VectorXd(dense.loops.M * (eigen(v) - before)),
                                               Eigen::VectorXd(dense.A.transpose() * rows)),
                           i),
              1e-9);
    for (const JointCoupling& coupling : c.model.couplings())
      EXPECT_LT(std::abs(coupling_rate(c.model, coupling, v)), 1e-12);
  }
}

TEST(CoupledJoints, AreProjectedWithTheLoops) {
  Worst defect("defect after the projection");
  int closed = 0;
  for (int i = 0; i < kClosed; ++i) {
    SCOPED_TRACE(seed_note(i));
    ClosedCase c = coupled_case(i);
    if (!DenseRows(c, {}).solvable) continue;
    // A small violation: the coupling holds a little beside the present values.
    ModelBuilder builder(c.model);
    for (const JointCoupling& coupling : c.model.couplings()) {
      const BodyDescription& body = c.model.bodies()[dependent_body(coupling)].description;
      JointDescription joint = body.joint;
      for (CouplingTerm& term : joint.mimic) term.offset = 0;
      joint.mimic.front().offset = coupling_defect(c.model, coupling, c.state.q) + coupling.offset + 1e-4;
      builder.attach(body.name, body.parent, body.X_PF, joint);
    }
    const Model model = builder.build();
    LoopSolver solver(model, c.closures);
    Workspace workspace(model);
    const ClosureDefect before = coupling_defects(model, c.state);
    EXPECT_NEAR(std::max(before.position, before.angle), 1e-4, 1e-10);
    const ProjectionResult result = solver.project({}, workspace, c.state.q, c.state.v);
    EXPECT_GE(std::max(result.before.position, result.before.angle), 1e-4 - 1e-10);
    if (!result.converged) continue;  // a loop that cannot reach this place
    ++closed;
    const ClosureDefect after = coupling_defects(model, c.state);
    EXPECT_LT(defect.note(std::max({after.position, after.angle, after.velocity, after.angular_velocity}), i), 1e-12);
    EXPECT_LE(std::max(after.position, after.angle), std::max(result.after.position, result.after.angle) + 1e-14);
  }
  EXPECT_GT(closed, kClosed / 3);
}

// Two wheels on a fixed base, geared: theta_2 = -r theta_1. The effort tau on the first gives it the acceleration
// tau / (I_1 + r^2 I_2), and the teeth transmit I_2 r times that.
Model geared_wheels(double I_1, double I_2, double ratio) {
  const auto wheel = [](const char* name, double inertia, double at) {
    BodyDescription b;
    b.name = name, b.parent = "base", b.joint.name = name, b.joint.type = JointType::continuous;
    b.X_PF.p = {at, 0, 0};
    b.mass = 1, b.inertia = {inertia, inertia, inertia, 0, 0, 0};
    return b;
  };
  BodyDescription base = wheel("base", 1, 0);
  base.parent.clear(), base.joint.type = JointType::fixed;
  BodyDescription second = wheel("second", I_2, 1);
  second.joint.mimic = {{"first", -ratio, 0}};
  return ModelBuilder().add(base).add(wheel("first", I_1, 0)).add(second).build();
}

TEST(CoupledJoints, ReflectTheInertiaOfAGear) {
  constexpr double kFirst = 0.3, kSecond = 0.05, kRatio = 4, kEffort = 2;
  const Model model = geared_wheels(kFirst, kSecond, kRatio);
  ASSERT_EQ(model.couplings().size(), 1u);
  LoopSolver solver(model, {});
  Workspace workspace(model);
  const State state = zero_state(model);
  const std::vector<double> effort{kEffort, 0};
  DynamicsInput<double> in;
  in.q = state.q, in.v = state.v, in.force = effort;
  std::vector<double> vdot(2), force(2);
  solver.accelerations(in, 0, workspace, vdot, force);
  const double expected = kEffort / (kFirst + kRatio * kRatio * kSecond);
  EXPECT_NEAR(vdot[0], expected, 1e-14);
  EXPECT_NEAR(vdot[1], -kRatio * expected, 1e-14);
  EXPECT_NEAR(solver.coupling_multipliers()[0], -kRatio * kSecond * expected, 1e-14);
  // Prescribed: the motor of the first moves both.
  const std::vector<std::uint8_t> prescribed{1, 0};
  const std::vector<double> wanted{3, 0};
  in.prescribed = prescribed, in.acceleration = wanted;
  solver.accelerations(in, 0, workspace, vdot, force);
  EXPECT_NEAR(vdot[1], -3 * kRatio, 1e-13);
  EXPECT_NEAR(force[0], 3 * (kFirst + kRatio * kRatio * kSecond), 1e-13);
}

// ---- Descriptions ----

std::vector<std::string> faults_of(std::vector<BodyDescription> bodies) {
  std::vector<std::string> texts;
  for (const CouplingFault& fault : coupling_faults(bodies)) texts.push_back(fault.text);
  return texts;
}

std::vector<BodyDescription> three_joints() {
  std::vector<BodyDescription> bodies(4);
  const char* names[] = {"base", "a", "b", "c"};
  for (int i = 0; i < 4; ++i) {
    bodies[i].name = bodies[i].joint.name = names[i];
    bodies[i].mass = 1, bodies[i].inertia = {1, 1, 1, 0, 0, 0};
    if (i > 0) bodies[i].parent = "base", bodies[i].joint.type = JointType::revolute;
  }
  bodies[0].joint.type = JointType::free;
  return bodies;
}

TEST(CouplingFaults, NameTheJointsAndTheCause) {
  auto bodies = three_joints();
  bodies[1].joint.mimic = {{"d", 1, 0}};
  EXPECT_THAT(faults_of(bodies), ElementsAre("mimic names the unknown joint 'd'"));
  bodies[1].joint.mimic = {{"a", 1, 0}};
  EXPECT_THAT(faults_of(bodies), ElementsAre("mimic: a joint cannot follow itself"));
  bodies[1].joint.mimic = {{"base", 0, INFINITY}};
  EXPECT_THAT(faults_of(bodies),
              ElementsAre(HasSubstr("ratio is 0"), HasSubstr("offset is inf"), HasSubstr("it has no axis")));
  bodies[1].joint.mimic = {{"b", 1, 0}, {"b", 2, 0}};
  EXPECT_THAT(faults_of(bodies), ElementsAre("mimic names joint 'b' twice; add the ratios"));
  bodies[1].joint.mimic = {{"b", 1, 0}};
  bodies[1].joint.spring = JointSpring{1, 0, 0, 0};
  EXPECT_THAT(faults_of(bodies), ElementsAre("mimic: this joint cannot follow another: it has a spring"));
}

TEST(CouplingFaults, FindCycles) {
  auto bodies = three_joints();
  bodies[1].joint.mimic = {{"b", 1, 0}};
  bodies[2].joint.mimic = {{"c", 1, 0}};
  EXPECT_THAT(faults_of(bodies), ElementsAre());
  bodies[3].joint.mimic = {{"a", 1, 0}};
  EXPECT_THAT(faults_of(bodies), ElementsAre("mimic forms a cycle: 'a' -> 'b' -> 'c' -> 'a'"));
  ModelBuilder builder;
  for (const BodyDescription& body : bodies) builder.add(body);
  EXPECT_THROW(builder.build(), ModelError);
}

TEST(FollowCouplings, SettlesChains) {
  auto bodies = three_joints();
  bodies[1].joint.mimic = {{"b", 2, 0.5}};
  bodies[2].joint.mimic = {{"c", -3, 0}};
  ModelBuilder builder;
  for (const BodyDescription& body : bodies) builder.add(body);
  const Model model = builder.build();
  State state = zero_state(model);
  state.q[9] = 0.1, state.v[8] = 1;
  follow_couplings(model, state.q, state.v);
  EXPECT_NEAR(state.q[8], -0.3, 1e-15);
  EXPECT_NEAR(state.q[7], -0.1, 1e-15);
  EXPECT_NEAR(state.v[6], -6, 1e-15);
  EXPECT_TRUE(follows_others(model.bodies()[1]) && !follows_others(model.bodies()[3]));
  EXPECT_TRUE(is_coupled(model, 3));
}

}  // namespace coupling_test
}  // namespace grapnel::testing
