#include "grapnel/capture/grip_loads.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <cmath>

#include "grapnel/capture/captured_model.hpp"
#include "grapnel/dynamics/body_acceleration.hpp"

namespace grapnel {
namespace {

// As the solver of loops has it: squares of what a direction gives way, against a free target.
constexpr double kRankTolerance = 1e-12;

Eigen::VectorXd as_eigen(const Wrenchd& F) {
  Eigen::VectorXd x(6);
  x << F.angular[0], F.angular[1], F.angular[2], F.linear[0], F.linear[1], F.linear[2];
  return x;
}
Wrenchd as_wrench(const Eigen::VectorXd& x) { return {{x[0], x[1], x[2]}, {x[3], x[4], x[5]}}; }

// The wrench that a target needs besides gravity and loads to move as it does, about p_W, in W.
Wrenchd needed_wrench(const Model& model, const Kinematics& k, const BodyAcceleration& A, int body,
                      const PhaseDynamics& dynamics, const Vector3d& p_W) {
  const BodyDescription& d = model.bodies()[body].description;
  const Vector3d arm = k.X_WB[body].R * d.com;
  const Vector3d& w = k.V_WB[body].angular;
  const Vector3d p_com = k.X_WB[body].p + arm;
  const Symmetric3d I = rotate(k.X_WB[body].R, d.inertia);
  const Vector3d a_com = A.linear + cross(A.angular, arm) + cross(w, cross(w, arm));
  const Wrenchd about_com{I * A.angular + cross(w, I * w), d.mass * (a_com - dynamics.gravity())};
  Wrenchd F = shift(about_com, p_W - p_com);
  for (const ExternalWrench& e : dynamics.external_wrenches()) {
    if (e.body == body) F -= shift(e.F_W, p_W - e.p_WP);
  }
  return F;
}

// All grips of one target.
struct TargetGrips {
  const CaptureSystem& system;
  const Kinematics& k;
  std::vector<std::size_t> grips;  // in system.grips; the first carries the target
  std::vector<Grasp> grasps;
  std::vector<Eigen::MatrixXd> directions, D;

  TargetGrips(const CaptureSystem& s, const Kinematics& kinematics, int body) : system(s), k(kinematics) {
    for (std::size_t i = 0; i < s.grips.size(); ++i) {
      if (s.grips[i].frames.body_b != body) continue;
      grips.push_back(i);
      grasps.push_back(grasp_of(s.grips[i], k));
      directions.push_back(constrained_directions(grasps.back()));
      D.push_back(target_mobility(s.model, k, grasps.back()));
    }
  }
  int rows() const {
    int count = 0;
    for (const Eigen::MatrixXd& A : directions) count += static_cast<int>(A.rows());
    return count;
  }
};

// First row of every closure in the solver.
std::vector<int> first_rows(const CaptureSystem& system) {
  std::vector<int> first{0};
  for (const LoopClosure& c : system.closures) first.push_back(first.back() + row_count(c.model));
  return first;
}

// Multipliers of a closure, in C's axes, as a wrench in W: rows as LoopSolver orders them.
Wrenchd closure_wrench(const LoopClosure& c, const Rotationd& R_WC, const double* rows) {
  Wrenchd F = Wrenchd::zero();
  const int angular = row_count(c.model) - 3;
  if (c.model == GraspModel::hinge) {
    const Rotationd R = rotation_between({0, 0, 1}, c.hinge_C);
    for (int r = 0; r < 2; ++r) F.angular += rows[r] * R.column(r);
  } else {
    for (int r = 0; r < angular; ++r) F.angular[r] = rows[r];
  }
  for (int r = 0; r < 3; ++r) F.linear[r] = rows[angular + r];
  return R_WC * F;
}

// Null space of W with the metric D of every closure: columns are multipliers that change no motion.
Eigen::MatrixXd self_stresses(const CaptureSystem& system, const Kinematics& k, const LoopSolver& solver) {
  const Eigen::Index size = solver.rows();
  Eigen::MatrixXd scale = Eigen::MatrixXd::Zero(size, size);
  Eigen::Index row = 0;
  for (const HeldGrip& grip : system.grips) {
    if (grip.closure < 0) continue;
    // Means over the directions commensurate the rows; any metric finds the same null space.
    const Eigen::MatrixXd D = target_mobility(system.model, k, grasp_of(grip, k));
    const Eigen::Index count = D.rows();
    const double linear = D.bottomRightCorner(3, 3).trace() / 3;
    const double angular =
        count > 3 ? D.topLeftCorner(count - 3, count - 3).trace() / static_cast<double>(count - 3) : 1;
    for (Eigen::Index r = 0; r < count; ++r) scale(row + r, row + r) = 1 / std::sqrt(r < count - 3 ? angular : linear);
    row += count;
  }
  const Eigen::MatrixXd W = scale * solver.contact_inertia() * scale;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(W);
  const double threshold = kRankTolerance * std::max(1.0, eigen.eigenvalues().maxCoeff());
  Eigen::Index null = 0;
  while (null < size && eigen.eigenvalues()[null] <= threshold) ++null;
  return scale * eigen.eigenvectors().leftCols(null);
}

}  // namespace

std::vector<GripWrench> grip_wrenches(const CaptureSystem& system, const Kinematics& k, const PhaseSample& sample,
                                      bool with_determined) {
  std::vector<GripWrench> result(system.grips.size(), GripWrench{Wrenchd::zero(), {}, Wrenchd::zero()});
  if (system.grips.empty() || !sample.dynamics) return result;
  const Model& model = system.model;
  const std::vector<BodyAcceleration> A = body_accelerations(model, k, sample.dynamics->acceleration());
  const LoopSolver* solver = sample.dynamics->loops();
  const std::vector<int> first = first_rows(system);
  Eigen::MatrixXd null(0, 0);
  if (solver) null = self_stresses(system, k, *solver);

  // One solution, and what each self-stress adds to every grip.
  std::vector<Wrenchd> F(system.grips.size(), Wrenchd::zero());
  std::vector<std::vector<Wrenchd>> stress(static_cast<std::size_t>(null.cols()), F);
  const std::vector<Wrenchd> nothing = F;
  Eigen::Index rows = 0;
  std::vector<TargetGrips> targets;
  for (int frame : system.target_frames) {
    TargetGrips t(system, k, model.frames()[frame].body);
    if (t.grips.empty()) continue;
    const Vector3d p_1 = t.grasps[0].p_WC;
    const int body = t.grasps[0].target_body;
    Wrenchd& carried = F[t.grips[0]];
    carried = -needed_wrench(model, k, A[body], body, *sample.dynamics, p_1);
    for (std::size_t i = 1; i < t.grips.size(); ++i) {
      const HeldGrip& grip = system.grips[t.grips[i]];
      const Vector3d to_first = p_1 - t.grasps[i].p_WC;
      if (grip.closure == HeldGrip::kRedundant) {
        // Whatever it carries, the first grip carries less.
        for (Eigen::Index row = 0; row < t.directions[i].rows(); ++row) {
          stress.push_back(nothing);
          stress.back()[t.grips[i]] = as_wrench(t.directions[i].row(row).transpose());
          stress.back()[t.grips[0]] = -shift(stress.back()[t.grips[i]], to_first);
        }
        continue;
      }
      if (!solver) continue;  // loops are cut
      const Rotationd R_WC = (k.X_WB[grip.frames.body_a] * grip.frames.X_AC).R;
      const int row = first[grip.closure];
      F[t.grips[i]] = closure_wrench(grip.frames, R_WC, solver->multipliers().data() + row);
      carried -= shift(F[t.grips[i]], to_first);
      for (Eigen::Index s = 0; s < null.cols(); ++s) {
        const Eigen::VectorXd column = null.col(s).segment(row, row_count(grip.frames.model));
        stress[s][t.grips[i]] = closure_wrench(grip.frames, R_WC, column.data());
        stress[s][t.grips[0]] -= shift(stress[s][t.grips[i]], to_first);
      }
    }
    rows += t.rows();
    targets.push_back(std::move(t));
  }
  const std::vector<Wrenchd> of_solver = F;
  // Least sum of f^T D f = |G^T f|^2, D = G G^T.
  if (!stress.empty()) {
    const Eigen::Index stresses = static_cast<Eigen::Index>(stress.size());
    Eigen::MatrixXd B(rows, stresses);
    Eigen::VectorXd f(rows);
    Eigen::Index row = 0;
    for (const TargetGrips& t : targets) {
      for (std::size_t i = 0; i < t.grips.size(); ++i) {
        const Eigen::Index count = t.directions[i].rows();
        const Eigen::MatrixXd map = t.D[i].llt().matrixU() * t.directions[i];
        f.segment(row, count) = map * as_eigen(F[t.grips[i]]);
        for (Eigen::Index s = 0; s < stresses; ++s)
          B.col(s).segment(row, count) = map * as_eigen(stress[s][t.grips[i]]);
        row += count;
      }
    }
    const Eigen::HouseholderQR<Eigen::MatrixXd> qr(B);
    const Eigen::VectorXd z = qr.solve(-f);
    // Stresses of unit size in the metric, for the question what is determined: B = Q R.
    const Eigen::MatrixXd R = qr.matrixQR().topRows(stresses).triangularView<Eigen::Upper>();
    for (const TargetGrips& t : targets) {
      for (std::size_t i = 0; i < t.grips.size(); ++i) {
        const std::size_t g = t.grips[i];
        Eigen::MatrixXd N(6, stresses);
        for (Eigen::Index s = 0; s < stresses; ++s) N.col(s) = as_eigen(stress[s][g]);
        F[g] = as_wrench(as_eigen(F[g]) + N * z);
        if (!with_determined) continue;
        const Eigen::MatrixXd unit = R.transpose().triangularView<Eigen::Lower>().solve(N.transpose()).transpose();
        const Eigen::MatrixXd largest = t.directions[i].transpose() * t.D[i].llt().solve(t.directions[i]);
        for (int c = 0; c < 6; ++c)
          result[g].determined.push_back(unit.row(c).norm() <= 1e-6 * std::sqrt(largest(c, c)));
      }
    }
  }
  for (std::size_t g = 0; g < F.size(); ++g) {
    result[g].F_WC = F[g];
    result[g].beyond_solver = F[g] - of_solver[g];
    if (with_determined && result[g].determined.empty()) result[g].determined.assign(6, true);
  }
  return result;
}

void add_self_stress(const CaptureSystem& system, const Kinematics& k, std::span<const GripWrench> wrenches,
                     std::span<double> motor) {
  const Model& model = system.model;
  Eigen::MatrixXd J_a(6, model.velocities()), J_b(6, model.velocities());
  for (std::size_t g = 0; g < system.grips.size(); ++g) {
    if (system.grips[g].closure < 0) continue;
    const Grasp grasp = grasp_of(system.grips[g], k);
    point_jacobian(model, k, grasp.robot_body, grasp.p_WC, J_a);
    point_jacobian(model, k, grasp.target_body, grasp.p_WC, J_b);
    // Zero at joints that yield.
    const Eigen::VectorXd at_joints = (J_a - J_b).transpose() * as_eigen(wrenches[g].beyond_solver);
    for (std::size_t j = 0; j < model.joints().size(); ++j) motor[j] -= at_joints[model.bodies()[model.joints()[j]].v];
  }
}

}  // namespace grapnel
