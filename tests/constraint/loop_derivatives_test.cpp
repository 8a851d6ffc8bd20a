// Derivatives of the dynamics with closed loops: against dual numbers in the equations of motion and in the rows of the
// closures, with dense matrices, and against differences of LoopSolver.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "constraint/closed_case.hpp"
#include "dynamics/dual_dynamics.hpp"
#include "grapnel/constraint/loop_columns.hpp"
#include "grapnel/constraint/loop_derivatives.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace loop_derivatives_test {

Eigen::MatrixXd coupling_rows(const Model& model) {
  Eigen::MatrixXd C = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(model.couplings().size()), model.velocities());
  for (Eigen::Index row = 0; const JointCoupling& coupling : model.couplings()) {
    for (const auto& [body, factor] : coupling.joints) C(row, model.bodies()[body].v) = factor;
    ++row;
  }
  return C;
}

Case as_case(const ClosedCase& c) { return {c.model, c.state, {c.loads.tau, c.loads.external, c.loads.gravity}}; }
PrescribedMotion given_of(const oracle::MaximalLoads& loads) {
  if (loads.prescribed.empty()) return {};
  return {{loads.prescribed.begin(), loads.prescribed.end()}, loads.acceleration};
}

Vector3<Dual> dual(const Vector3d& a) { return {a[0], a[1], a[2]}; }
Pose<Dual> dual(const Posed& X) {
  Pose<Dual> Y;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) Y.R(i, j) = X.R(i, j);
    Y.p[i] = X.p[i];
  }
  return Y;
}

// Derivative of the residuals of the equations of motion, inverse dynamics - J^T lambda, and below them of the rows of
// relative accelerations, at fixed accelerations and multipliers.
Eigen::VectorXd residuals(const ClosedCase& c, DualDynamics& dynamics, const std::vector<double>& vdot,
                          const std::vector<double>& multipliers) {
  std::vector<LoopPath> paths;
  std::vector<Pose<Dual>> X_bC;
  const std::vector<LinkMotion<Dual>>& motion = dynamics.move();
  int row = 0;
  for (const LoopClosure& closure : c.closures) {
    const LoopPath& path = paths.emplace_back(make_loop_path(c.model, closure));
    const Pose<Dual> X_aC = dual(path.X_aC);
    X_bC.push_back(inverse(motion[path.link_b].X_WL) * (motion[path.link_a].X_WL * X_aC));
    Wrench<Dual> F = Wrench<Dual>::zero();
    for (int r = 0; r < path.angular_count; ++r) F.angular += Dual(multipliers[row + r]) * dual(path.angular_rows[r]);
    for (int r = 0; r < path.linear_count(); ++r) F.linear[r] = multipliers[row + path.angular_count + r];
    dynamics.add(path.link_a, shift(X_aC.R * F, -X_aC.p));
    dynamics.add(path.link_b, -shift(X_bC.back().R * F, -X_bC.back().p));
    row += path.rows;
  }
  const DynamicsInput<Dual> in = dynamics.input();
  std::vector<Dual> all = dynamics.required(in, vdot);
  for (std::size_t i = 0; i < all.size(); ++i) all[i] -= dynamics.force()[i];
  for (std::size_t k = 0; k < paths.size(); ++k) {
    const LoopPath& path = paths[k];
    const Pose<Dual> X_aC = dual(path.X_aC);
    const LinkScratch<Dual>&a = dynamics.link(path.link_a), &b = dynamics.link(path.link_b);
    const auto at_C = [](const Pose<Dual>& X, const auto& x) { return transposed_times(X.R, shift(x, X.p)); };
    const Twist<Dual> V_C = at_C(X_aC, a.V), V_D = at_C(X_bC[k], b.V);
    const auto rate = at_C(X_aC, a.A) - at_C(X_bC[k], b.A) + cross_motion(V_C, V_D);
    for (int r = 0; r < path.angular_count; ++r) all.push_back(dot(dual(path.angular_rows[r]), rate.angular));
    for (int r = 0; r < path.linear_count(); ++r) all.push_back(rate.linear[r]);
  }
  // Rows of couplings are linear in the accelerations alone.
  all.resize(all.size() + c.model.couplings().size());
  return DualDynamics::derivatives(all);
}

// Dense solution of M da - J^T dlambda = -r, J da = -s for the velocities that are not prescribed.
class DenseSolution {
 public:
  DenseSolution(const ClosedCase& c, const oracle::MaximalLoads& loads)
      : loops_(c.model, c.state, c.closures, loads.prescribed), n_(c.model.velocities()) {
    const Eigen::MatrixXd C = coupling_rows(c.model);
    J_.resize(loops_.J.rows() + C.rows(), n_);
    J_ << loops_.J, C;
    A_ =
        Eigen::LLT<Eigen::MatrixXd>(loops_.M_free).matrixL().solve(J_(Eigen::all, loops_.free).transpose()).transpose();
    scale_.setOnes(J_.rows());
    for (Eigen::Index i = 0; i < A_.rows(); ++i) {
      if (A_.row(i).norm() > 1e-9) scale_[i] = 1 / A_.row(i).norm();
    }
    A_ = scale_.asDiagonal() * A_;
    svd_.compute(A_, Eigen::ComputeThinU | Eigen::ComputeThinV);
    svd_.setThreshold(1e-7);
    for (const double s : svd_.singularValues()) clear_ = clear_ && (s > 1e-3 || s < 1e-10);
  }
  /// Couplings are independent of the closures: no velocities of the cases satisfy them.
  bool is_clear() const {
    return clear_ && svd_.rank() < static_cast<Eigen::Index>(loops_.free.size()) &&
           svd_.rank() == loops_.rank + J_.rows() - loops_.J.rows();
  }
  bool is_independent() const { return svd_.rank() == J_.rows(); }
  Eigen::Index rank() const { return svd_.rank(); }
  const Eigen::MatrixXd& J() const { return J_; }

  // Columns of [r; s] => da, and J^T dlambda at all velocities (zero where prescribed).
  void solve(const Eigen::MatrixXd& residual, Eigen::MatrixXd& da, Eigen::MatrixXd& force) const {
    const Eigen::MatrixXd r = residual.topRows(n_)(loops_.free, Eigen::all);
    const Eigen::MatrixXd s = residual.bottomRows(J_.rows());
    const Eigen::LLT<Eigen::MatrixXd> mass(loops_.M_free);
    const Eigen::MatrixXd y = mass.matrixL().solve(r);
    Eigen::MatrixXd x = -y;  // L^T da
    x += svd_.solve(Eigen::MatrixXd(-(scale_.asDiagonal() * s) - A_ * x));
    da.setZero(n_, residual.cols()), force.setZero(n_, residual.cols());
    da(loops_.free, Eigen::all) = Eigen::MatrixXd(mass.matrixU().solve(x));
    force(loops_.free, Eigen::all) = Eigen::MatrixXd(mass.matrixL() * x) + r;
  }
  // J^T of multipliers, without prescribed velocities.
  Eigen::MatrixXd force_of(const RowMatrix& multipliers) const {
    Eigen::MatrixXd force = Eigen::MatrixXd::Zero(n_, multipliers.cols());
    force(loops_.free, Eigen::all) = J_(Eigen::all, loops_.free).transpose() * multipliers;
    return force;
  }

 private:
  DenseLoops loops_;
  Eigen::Index n_;
  Eigen::MatrixXd J_, A_;
  Eigen::VectorXd scale_;
  Eigen::JacobiSVD<Eigen::MatrixXd> svd_;
  bool clear_ = true;
};

// Errors relative to the norm of a matrix; measured: at most 3e-11, near singular configurations.
constexpr double kBound = 3e-10;

double error(const Eigen::MatrixXd& value, const Eigen::MatrixXd& expected) {
  return (value - expected).norm() / (1 + expected.norm());
}

struct Measured {
  Worst vdot{"vdot against LoopSolver"}, force{"J^T lambda against LoopSolver"};
  Worst dq{"d vdot / d q"}, dv{"d vdot / d v"}, dtau{"d vdot / d tau"};
  Worst reaction{"derivatives of J^T lambda"}, contradiction{"contradiction of derivatives"};
  int redundant = 0, compared = 0;
};

void compare(const ClosedCase& c, const oracle::MaximalLoads& loads, int index, Measured& measured) {
  const DenseSolution dense(c, loads);
  if (!dense.is_clear()) return;
  ++measured.compared;
  measured.redundant += !dense.is_independent();
  const PrescribedMotion given = given_of(loads);
  LoopDynamicsDerivatives d;
  LoopDerivatives(c.model, c.closures).evaluate(c.state, as_case(c).forces, given, 0, d);

  LoopSolver solver(c.model, c.closures);
  Workspace workspace(c.model);
  std::vector<double> vdot(c.model.velocities()), force(vdot);
  solver.accelerations(dynamics_input(c.model, c.state, loads, workspace), 0, workspace, vdot, force);
  const std::span<const double> rows = solver.multipliers();
  ASSERT_EQ(d.rank, solver.rank());
  ASSERT_EQ(d.rank, dense.rank());
  const auto count = static_cast<Eigen::Index>(rows.size());
  ASSERT_LT(measured.vdot.note(relative_difference(eigen(d.motion.vdot), eigen(vdot)), index), kBound);
  const RowMatrix own = Eigen::VectorXd::Map(d.multipliers.value.data(), count);
  const RowMatrix theirs = Eigen::VectorXd::Map(rows.data(), count);
  ASSERT_LT(measured.force.note(error(dense.force_of(own), dense.force_of(theirs)), index), kBound);

  const Case plain = as_case(c);
  DualDynamics dual_numbers(plain, given);
  const auto check = [&](By by, const RowMatrix& derivative, const RowMatrix& multipliers, Worst& worst) {
    const Eigen::MatrixXd residual = columns(
        plain, dual_numbers, by, [&] { return residuals(c, dual_numbers, d.motion.vdot, d.multipliers.value); });
    Eigen::MatrixXd expected, reaction;
    dense.solve(residual, expected, reaction);
    EXPECT_GT(expected.norm(), 1e-3);
    EXPECT_LT(worst.note(error(derivative, expected), index), kBound);
    EXPECT_LT(measured.reaction.note(error(dense.force_of(multipliers), reaction), index), kBound);
  };
  check(By::q, d.motion.dq, d.multipliers.dq, measured.dq);
  check(By::v, d.motion.dv, d.multipliers.dv, measured.dv);
  check(By::force, d.motion.dtau, d.multipliers.dtau, measured.dtau);
  EXPECT_LT(measured.contradiction.note(d.contradiction_of_derivatives, index), 1e-9);
}

TEST(LoopDerivatives, AgreeWithDualNumbers) {
  Measured measured;
  for (int i = 0; i < kClosed; ++i) {
    SCOPED_TRACE(seed_note(i));
    const ClosedCase c = random_closed(i);
    compare(c, c.loads, i, measured);
  }
  EXPECT_GT(measured.compared, kClosed / 2);
  EXPECT_GT(measured.redundant, kClosed / 5);
}

TEST(LoopDerivatives, AgreeWithDualNumbersWherePrescribed) {
  Measured measured;
  for (int i = 0; i < kClosed; ++i) {
    SCOPED_TRACE(seed_note(i));
    const ClosedCase c = random_closed(i);
    const oracle::MaximalLoads loads = with_prescribed(c, i);
    if (!loads.prescribed.empty()) compare(c, loads, i, measured);
  }
  EXPECT_GT(measured.compared, kClosed / 4);
  EXPECT_GT(measured.redundant, kClosed / 20);
}

TEST(LoopDerivatives, AgreeWithDualNumbersForCoupledJoints) {
  Measured measured;
  for (int i = 0; i < kClosed; ++i) {
    SCOPED_TRACE(seed_note(i));
    const ClosedCase c = coupled_case(i);
    compare(c, c.loads, i, measured);
  }
  EXPECT_GT(measured.compared, kClosed / 4);
}

TEST(LoopDerivatives, AgreeWithDualNumbersBetweenTrees) {
  Measured measured;
  for (int i = 0; i < kClosed; ++i) {
    SCOPED_TRACE(seed_note(i));
    ClosedCase c = random_trees(i);
    LoopSolver solver(c.model, c.closures);
    Workspace workspace(c.model);
    solver.close_velocities(c.state.q, {}, workspace, c.state.v);
    compare(c, c.loads, i, measured);
  }
  EXPECT_GT(measured.compared, kClosed / 2);
  EXPECT_GT(measured.redundant, 3);
}

// Wrenches of closed systems act by their generalized forces.
TEST(LoopDerivatives, OfWrenchesAreThoseOfTheirGeneralizedForces) {
  Worst accelerations("d vdot / d wrench"), multipliers("d lambda / d wrench");
  int compared = 0;
  for (int i = 0; i < kClosed; ++i) {
    SCOPED_TRACE(seed_note(i));
    const ClosedCase c = random_closed(i);
    if (c.loads.external.empty()) continue;
    ++compared;
    LoopDynamicsDerivatives d;
    LoopDerivatives(c.model, c.closures).evaluate(c.state, as_case(c).forces, {}, 0, d);
    const Kinematics kinematics = forward_kinematics(c.model, c.state);
    Eigen::MatrixXd J(6, c.model.velocities());
    for (std::size_t e = 0; e < c.loads.external.size(); ++e) {
      const ExternalWrench& w = c.loads.external[e];
      point_jacobian(c.model, kinematics, w.body, w.p_WP, J);
      const auto first = static_cast<Eigen::Index>(6 * e);
      const Eigen::MatrixXd block = d.motion.dwrench.middleCols(first, 6);
      const Eigen::MatrixXd reaction = d.multipliers.dwrench.middleCols(first, 6);
      EXPECT_LT(accelerations.note(error(block, d.motion.dtau * J.transpose()), i), 1e-12);
      EXPECT_LT(multipliers.note(error(reaction, d.multipliers.dtau * J.transpose()), i), 1e-12);
    }
  }
  EXPECT_GT(compared, 20);
}

// With Baumgarte's terms, in states that violate the closures: against differences of the solver.
TEST(LoopDerivatives, AgreeWithDifferencesOfOpenLoopsWithFeedback) {
  constexpr double kFeedback = 3;
  Worst dq("d vdot / d q, against differences"), dv("d vdot / d v, against differences");
  Worst by_q("d lambda / d q, against differences"), closing("closing velocities, against differences");
  int compared = 0;
  for (int i = 0; i < kClosed; ++i) {
    SCOPED_TRACE(seed_note(i));
    ClosedCase c = i % 2 == 0 ? random_closed(i) : random_trees(i);
    Random random(900'000 + i);
    const int n = c.model.velocities();
    c.state = moved(c.model, c.state, eigen(random.values(n, 0.1)), 1);
    c.state.v = random.values(n, 0.5);
    c.loads.external.clear();  // whose points would have to follow their bodies
    const DenseSolution dense(c, c.loads);
    if (!dense.is_clear() || !dense.is_independent()) continue;
    ++compared;
    LoopDynamicsDerivatives d;
    LoopDerivatives derivatives(c.model, c.closures);
    derivatives.evaluate(c.state, as_case(c).forces, {}, kFeedback, d);
    LoopSolver solver(c.model, c.closures);
    Workspace workspace(c.model);
    const int rows = solver.rows();
    const auto evaluate = [&](const State& state) {
      std::vector<double> vdot(n), force(n);
      solver.accelerations(dynamics_input(c.model, state, c.loads, workspace), kFeedback, workspace, vdot, force);
      Eigen::VectorXd both(n + rows);
      both << eigen(vdot), Eigen::VectorXd::Map(solver.multipliers().data(), rows);
      return both;
    };
    Eigen::MatrixXd of_q(n + rows, n), of_v(n + rows, n);
    for (int j = 0; j < n; ++j) {
      const Eigen::VectorXd e = Eigen::VectorXd::Unit(n, j);
      of_q.col(j) = derivative([&](double h) { return evaluate(moved(c.model, c.state, e, h)); });
      of_v.col(j) = derivative([&](double h) {
        State state = c.state;
        state.v[static_cast<std::size_t>(j)] += h;
        return evaluate(state);
      });
    }
    EXPECT_LT(dq.note(error(d.motion.dq, of_q.topRows(n)), i), 1e-7);
    EXPECT_LT(dv.note(error(d.motion.dv, of_v.topRows(n)), i), 1e-7);
    EXPECT_LT(by_q.note(error(d.multipliers.dq, of_q.bottomRows(rows)), i), 1e-7);
    // A velocity that satisfies the closures, displaced.
    solver.close_velocities(c.state.q, {}, workspace, c.state.v);
    derivatives.evaluate(c.state, as_case(c).forces, {}, 0, d);
    Eigen::MatrixXd closed(n, n);
    for (int j = 0; j < n; ++j) {
      closed.col(j) = derivative([&](double h) {
        std::vector<double> v = c.state.v;
        solver.close_velocities(moved(c.model, c.state, Eigen::VectorXd::Unit(n, j), h).q, {}, workspace, v);
        return Eigen::VectorXd(eigen(v));
      });
    }
    EXPECT_LT(closing.note(error(d.closing_dq, closed), i), 1e-7);
  }
  EXPECT_GT(compared, kClosed / 3);
}

// Without closures and couplings they are those of the tree.
TEST(LoopDerivatives, OfATreeAreThoseOfForwardDynamics) {
  const Case c = random_case(0);
  LoopDynamicsDerivatives d;
  LoopDerivatives derivatives(c.model, {});
  derivatives.evaluate(c.state, c.forces, {}, 0, d);
  const ForwardDynamicsDerivatives expected = forward_dynamics_derivatives(c.model, c.state, c.forces);
  EXPECT_EQ(derivatives.rows(), 0);
  EXPECT_EQ(d.motion.vdot, expected.vdot);
  EXPECT_EQ(d.motion.dq, expected.dq);
  EXPECT_EQ(d.motion.dv, expected.dv);
  EXPECT_EQ(d.motion.dwrench, expected.dwrench);
}

// Two arms stretched along a line: the rank drops there only, so accelerations have no derivatives.
TEST(LoopDerivatives, ReportSingularConfigurations) {
  ModelBuilder builder;
  const auto add = [&](const std::string& name, const std::string& parent, double x) {
    BodyDescription b;
    b.name = name, b.parent = parent, b.joint.name = name + "_joint", b.mass = 1;
    b.inertia = Symmetric3d::diagonal(1, 1.2, 0.9), b.X_PF.p = {x, 0, 0};
    b.joint.type = parent.empty() ? JointType::fixed : JointType::revolute, b.joint.axis = {0, 0, 1};
    builder.add(b);
  };
  add("base", "", 0), add("a1", "base", 0), add("a2", "a1", 1), add("b1", "base", 4), add("b2", "b1", -1);
  const Model model = std::move(builder).build();
  LoopClosure closure;
  closure.name = "pin", closure.body_a = model.body_index("a2"), closure.body_b = model.body_index("b2");
  closure.X_AC = {Rotationd::identity(), {1, 0, 0}}, closure.X_BD = {Rotationd::identity(), {-1, 0, 0}};
  closure.model = GraspModel::point;
  const std::vector<LoopClosure> closures{closure};
  LoopDerivatives derivatives(model, closures);
  State state = zero_state(model);
  state.v[0] = 0.3, state.v[1] = -0.2, state.v[2] = 0.1, state.v[3] = 0.4;
  LoopDynamicsDerivatives d;
  derivatives.evaluate(state, {{1, 2, -1, 0.5}, {}, Vector3d::zero()}, {}, 0, d);
  EXPECT_EQ(d.rank, 1);
  EXPECT_GT(d.contradiction_of_derivatives, 0.1);
}

TEST(LoopDerivatives, RejectSizesOfAnotherModel) {
  const ClosedCase c = random_closed(0);
  LoopDerivatives derivatives(c.model, c.closures);
  LoopDynamicsDerivatives d;
  EXPECT_THAT([&] { derivatives.evaluate(zero_state(plain_robot(1)), {}, {}, 0, d); },
              ::testing::ThrowsMessage<std::invalid_argument>(
                  ::testing::HasSubstr("LoopDerivatives::evaluate: the state has another model's size")));
}

}  // namespace loop_derivatives_test
}  // namespace grapnel::testing
