#include "oracle/partitioned_dynamics.hpp"

#include "grapnel/dynamics/kinematics.hpp"
#include "grapnel/dynamics/mass_matrix.hpp"
#include "grapnel/dynamics/workspace.hpp"
#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {
namespace {

// Jdot v of all closures: the velocity-dependent accelerations of the rows, from the accelerations of all bodies in W
// at zero vdot; independent of LoopSolver.
Eigen::VectorXd velocity_dependent_rows(const Model& model, const State& state, std::span<const LoopClosure> closures) {
  const Kinematics k = forward_kinematics(model, state);
  const std::vector<BodyAcceleration> A = body_accelerations(model, k, {});
  Eigen::VectorXd bias(closure_rows(closures));
  Eigen::Index row = 0;
  for (const LoopClosure& c : closures) {
    const Posed& X_A = k.X_WB[c.body_a];
    const Posed& X_B = k.X_WB[c.body_b];
    const Posed X_WC = X_A * c.X_AC;
    const Vector3d r_a = X_WC.p - X_A.p, r_b = X_WC.p - X_B.p;
    const Vector3d &w_a = k.V_WB[c.body_a].angular, &w_b = k.V_WB[c.body_b].angular;
    // Both at the point C, which moves with a.
    const Vector3d v_a = k.V_WB[c.body_a].linear + cross(w_a, r_a);
    const Vector3d v_b = k.V_WB[c.body_b].linear + cross(w_b, r_b);
    const Vector3d a_a = A[c.body_a].linear + cross(A[c.body_a].angular, r_a) + cross(w_a, cross(w_a, r_a));
    const Vector3d a_b =
        A[c.body_b].linear + cross(A[c.body_b].angular, r_b) + cross(w_b, v_a - k.V_WB[c.body_b].linear);
    // Components in C of a vector x in W change by xdot - w_a x x.
    const Vector3d angular = A[c.body_a].angular - A[c.body_b].angular - cross(w_a, w_a - w_b);
    const Vector3d linear = a_a - a_b - cross(w_a, v_a - v_b);
    Vector3d turns[3];
    const int count = forbidden_turns(c, turns);
    for (int j = 0; j < count; ++j) bias[row++] = dot(X_WC.R * turns[j], angular);
    for (int j = 0; j < 3; ++j) bias[row++] = dot(X_WC.R.column(j), linear);
  }
  return bias;
}

}  // namespace

Eigen::MatrixXd closure_jacobian(const Model& model, const Kinematics& kinematics,
                                 std::span<const LoopClosure> closures) {
  Eigen::MatrixXd J(closure_rows(closures), model.velocities());
  Eigen::MatrixXd J_a(6, model.velocities()), J_b(6, model.velocities());
  Eigen::Index row = 0;
  for (const LoopClosure& closure : closures) {
    Vector3d turns[3];
    const int count = forbidden_turns(closure, turns);
    const Posed X_WC = kinematics.X_WB[closure.body_a] * closure.X_AC;
    point_jacobian(model, kinematics, closure.body_a, X_WC.p, J_a);
    point_jacobian(model, kinematics, closure.body_b, X_WC.p, J_b);
    const Eigen::MatrixXd relative = J_a - J_b;  // in W
    const auto put = [&](const Vector3d& direction_C, Eigen::Index first) {
      const Vector3d d = X_WC.R * direction_C;
      J.row(row++) = d[0] * relative.row(first) + d[1] * relative.row(first + 1) + d[2] * relative.row(first + 2);
    };
    for (int r = 0; r < count; ++r) put(turns[r], 0);
    for (int r = 0; r < 3; ++r) put(Vector3d::unit(r), 3);
  }
  return J;
}

PartitionedSolution partitioned_dynamics(const Model& model, const State& state, std::span<const LoopClosure> closures,
                                         const std::vector<double>& tau, const Vector3d& gravity) {
  const Eigen::Index n = model.velocities();
  const Eigen::MatrixXd M = mass_matrix(model, state);
  Workspace workspace(model);
  std::vector<double> c;
  bias(model, state, gravity, workspace, c);
  Eigen::VectorXd phi = -Eigen::Map<const Eigen::VectorXd>(c.data(), n);
  if (!tau.empty()) phi += Eigen::Map<const Eigen::VectorXd>(tau.data(), n);

  PartitionedSolution result;
  Eigen::VectorXd vdot(n);
  Eigen::MatrixXd J(0, n);
  if (closures.empty()) {
    vdot = M.llt().solve(phi);
    for (Eigen::Index i = 0; i < n; ++i) result.independent.push_back(static_cast<int>(i));
  } else {
    const Kinematics kinematics = forward_kinematics(model, state);
    J = closure_jacobian(model, kinematics, closures);
    const Eigen::VectorXd jdot = velocity_dependent_rows(model, state, closures);
    // J P = Q [R1 R2; 0 0]: the first r velocities in the order of P follow from the others,
    // x_d = -R1^-1 R2 x_i, and with the accelerations R1 x_d + R2 x_i = -(Q^T Jdot v)_r.                       (8.8)
    Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(J);
    qr.setThreshold(1e-9);
    const Eigen::Index r = qr.rank();
    const Eigen::MatrixXd R = qr.matrixR().topRows(r);
    const auto R1 = R.leftCols(r).triangularView<Eigen::Upper>();
    const Eigen::VectorXd d = -R1.solve((qr.householderQ().transpose() * jdot).head(r));
    Eigen::MatrixXd T(n, n - r);
    T.topRows(r) = -R1.solve(R.rightCols(n - r));
    T.bottomRows(n - r).setIdentity();
    T = (qr.colsPermutation() * T).eval();
    Eigen::VectorXd offset = Eigen::VectorXd::Zero(n);
    offset.head(r) = d;
    offset = (qr.colsPermutation() * offset).eval();
    const Eigen::MatrixXd reduced = T.transpose() * M * T;
    vdot = offset;
    if (n > r) vdot += T * reduced.llt().solve(T.transpose() * (phi - M * offset));
    for (Eigen::Index i = r; i < n; ++i) result.independent.push_back(qr.colsPermutation().indices()[i]);
    const Eigen::VectorXd lambda = J.transpose().completeOrthogonalDecomposition().solve(M * vdot - phi);
    result.multipliers.assign(lambda.begin(), lambda.end());
  }
  result.vdot.assign(vdot.begin(), vdot.end());
  return result;
}

}  // namespace grapnel
