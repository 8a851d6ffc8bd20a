#include "grapnel/impact/impulse_measures.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "grapnel/dynamics/mass_matrix.hpp"
#include "grapnel/dynamics/momentum.hpp"
#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// Singular values below this fraction of the largest are zero: of Y as in solve_impulsive_constraint(), whose squares
// are those of W, and of the base's response.
constexpr double kRankTolerance = 1e-6;
constexpr double kBaseTolerance = 1e-10;
// A direction is rigid if its inverse inertia is below this fraction of the largest entry: rounding errors are about
// 1e-16.
constexpr double kRigid = 1e-13;

// Velocities that impulses can change, all except held ones, and the mass matrix over them. Modes of vibration that do
// not respond reduce them: the response to impulses is then projected, with L^-1 of their rows R as orthonormal columns
// Q.
class Response {
 public:
  Response(const Eigen::MatrixXd& M, std::span<const HeldRate> held) : velocities_(M.rows()) {
    std::vector<bool> is_held(static_cast<std::size_t>(M.rows()), false);
    Eigen::Index modes = 0;
    for (const HeldRate& h : held) {
      if (h.is_mode()) ++modes;
      if (!h.is_mode()) is_held.at(h.velocity) = true;
    }
    for (int i = 0; i < M.rows(); ++i) {
      if (!is_held[i]) free_.push_back(i);
    }
    const Eigen::MatrixXd M_free = M(free_, free_);
    if (!free_.empty()) factor_.compute(M_free);
    if (modes == 0 || free_.empty()) return;
    Eigen::MatrixXd R(M.rows(), modes);
    for (Eigen::Index i = 0; i < modes; ++i) R.col(i) = as_vector(held[static_cast<std::size_t>(i)].row);
    still_ = thin_qr(lower_solution(factor_, Eigen::MatrixXd(R(free_, Eigen::all)))).Q;
  }
  // M^-1 times the columns of F, zero for held velocities: the response to generalized impulses.
  Eigen::MatrixXd operator()(const Eigen::MatrixXd& F) const {
    Eigen::MatrixXd change = Eigen::MatrixXd::Zero(velocities_, F.cols());
    if (free_.empty() || F.cols() == 0) return change;
    const Eigen::MatrixXd F_free = F(free_, Eigen::all);
    const Eigen::MatrixXd change_free =
        still_.size() == 0 ? cholesky_solution(factor_, F_free) : upper_solution(factor_, half(F));
    change(free_, Eigen::all) = change_free;
    return change;
  }

  // L^-1 times the rows of F that are free, M = L L^T there: its columns' inner products are F^T M^-1 F.
  Eigen::MatrixXd half(const Eigen::MatrixXd& F) const {
    const Eigen::MatrixXd F_free = F(free_, Eigen::all);
    if (F_free.size() == 0) return F_free;
    Eigen::MatrixXd Y = lower_solution(factor_, F_free);
    if (still_.size() > 0) Y -= still_ * (still_.transpose() * Y);
    return Y;
  }

 private:
  Eigen::Index velocities_;
  std::vector<int> free_;
  Cholesky factor_;
  Eigen::MatrixXd still_;
};

// Velocities once the held rates have their prescribed values, before any grasp acts.
Eigen::VectorXd velocity_with_held(const Eigen::MatrixXd& M, const State& state, std::span<const HeldRate> held,
                                   const Response& response) {
  const Eigen::VectorXd v = Eigen::Map<const Eigen::VectorXd>(state.v.data(), M.rows());
  Eigen::VectorXd jump = Eigen::VectorXd::Zero(v.size());
  for (const HeldRate& h : held) {
    if (!h.is_mode()) jump[h.velocity] = h.after - v[h.velocity];
  }
  return v + jump - response(M * jump);
}

ImpulseEllipsoid ellipsoid(const Eigen::Matrix3d& inverse_inertia) {
  // Ascending eigenvalues, so descending impulses.
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(inverse_inertia);
  ImpulseEllipsoid e{eigen.eigenvectors(), {}};
  if (e.axes.determinant() < 0) e.axes.col(2) = -e.axes.col(2);
  const double largest = eigen.eigenvalues()[2];
  for (int k = 0; k < 3; ++k) {
    const double yields = eigen.eigenvalues()[k];
    e.semi_axes[k] = yields > kRigid * largest ? 1 / yields : kInfinity;
  }
  return e;
}

Grasp as_rigid(Grasp grasp) {
  grasp.model = GraspModel::rigid;
  return grasp;
}

// Grasp, response M^-1, velocities => inverse inertias at C in W (13.1), (13.2), impulse ellipsoids and index (13.4),
// effective masses along the relative velocity (13.3). The grasp counts as rigid; index and masses keep their defaults
// if the relative velocity is zero.
EndEffectorMeasures measure_end_effector(const Model& model, const Kinematics& kinematics, const Grasp& grasp,
                                         const Response& response, const Eigen::VectorXd& velocity) {
  Eigen::MatrixXd J_E(6, model.velocities());
  point_jacobian(model, kinematics, grasp.robot_body, grasp.p_WC, J_E);
  const Grasp rigid = as_rigid(grasp);
  const Eigen::MatrixXd J = grasp_jacobian(model, kinematics, {&rigid, 1});

  EndEffectorMeasures m;
  m.inverse_inertia = J_E * response(J_E.transpose());   // (13.1)
  m.pair_inverse_inertia = J * response(J.transpose());  // (13.2)
  m.angular = ellipsoid(m.pair_inverse_inertia.topLeftCorner<3, 3>());
  const Eigen::Matrix3d W = m.pair_inverse_inertia.bottomRightCorner<3, 3>();
  m.linear = ellipsoid(W);
  m.relative_velocity = (J * velocity).tail<3>();
  const double speed = m.relative_velocity.norm();
  if (speed == 0) return m;
  m.impulse_index = cholesky_solution(Cholesky(W), m.relative_velocity).norm() / speed;  // (13.4)
  const Vector3d u{m.relative_velocity[0], m.relative_velocity[1], m.relative_velocity[2]};
  m.robot_effective_mass = effective_mass(m.inverse_inertia, u);
  m.pair_effective_mass = effective_mass(m.pair_inverse_inertia, u);
  return m;
}

// D of (7.8) over all grasps, block by block.
Eigen::MatrixXd grasp_metric(const Model& model, const Kinematics& kinematics, std::span<const Grasp> grasps,
                             Eigen::Index rows) {
  Eigen::MatrixXd D = Eigen::MatrixXd::Zero(rows, rows);
  for (Eigen::Index row = 0; const Grasp& g : grasps) {
    D.block(row, row, row_count(g.model), row_count(g.model)) = target_mobility(model, kinematics, g);
    row += row_count(g.model);
  }
  return D;
}

// Singular values of W^+ in the targets' metric and the index of the present motion: (13.5), (13.6). From Y of (7.5),
// whose singular values are the roots of W's: W itself has lost half of the small ones' digits.
CoupledImpulse measure_coupled(const Eigen::MatrixXd& half, const Eigen::VectorXd& u, const Cholesky& metric) {
  CoupledImpulse m;
  if (half.rows() == 0) return m;  // all velocities are held: impulses have no effect
  const Eigen::MatrixXd Y = lower_solution(metric, half.transpose()).transpose();
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(Y, Eigen::ComputeThinV);
  const Eigen::VectorXd& sigma = svd.singularValues();
  while (m.rank < sigma.size() && sigma[m.rank] > kRankTolerance * sigma[0]) ++m.rank;
  if (m.rank == 0) return m;
  const Eigen::VectorXd yields = sigma.head(m.rank).cwiseAbs2();
  m.smallest_impulse = 1 / yields[0];
  m.largest_impulse = 1 / yields[m.rank - 1];
  m.mean_impulse = yields.cwiseInverse().mean();
  const Eigen::VectorXd motion = lower_solution(metric, u);
  if (motion.norm() == 0) return m;
  const Eigen::VectorXd along = svd.matrixV().leftCols(m.rank).transpose() * motion;
  const Eigen::VectorXd impulse = along.cwiseQuotient(yields);
  m.coupled_index = impulse.norm() / motion.norm();
  m.energy = 0.5 * impulse.squaredNorm();
  return m;
}

// Null space of a response to impulses, D-orthonormal (13.9). `response` has rows that may be compared.
Eigen::MatrixXd without_effect(const Eigen::MatrixXd& response, const Cholesky& metric) {
  // B N = 0 with N = G^-T Z: Z the null space of B G^-T.
  const Eigen::MatrixXd scaled = lower_solution(metric, response.transpose()).transpose();
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(scaled, Eigen::ComputeFullV);
  const Eigen::VectorXd& sigma = svd.singularValues();
  Eigen::Index rank = 0;
  while (rank < sigma.size() && sigma[rank] > kBaseTolerance * sigma[0]) ++rank;
  if (rank == response.cols()) return Eigen::MatrixXd(response.cols(), 0);  // Eigen's solve needs at least one column
  return upper_solution(metric, svd.matrixV().rightCols(response.cols() - rank));
}

// The base's response to impulses in the rows of J; J_robot is the robot's part of J.
void measure_base(const Model& model, const Kinematics& kinematics, int root, const Eigen::MatrixXd& M,
                  const Eigen::MatrixXd& change, const Cholesky& metric, ImpulseMeasures& m) {
  const Eigen::Index rows = change.cols();
  m.base_response = Eigen::MatrixXd::Zero(6, rows);
  Eigen::MatrixXd comparable = Eigen::MatrixXd::Zero(6, rows);
  if (model.has_free_root(root)) {
    const int v = model.bodies()[root].v;
    const Rotationd& R = kinematics.X_WB[root].R;
    for (Eigen::Index column = 0; column < rows; ++column) {
      for (int part = 0; part < 6; part += 3) {
        const auto x = change.col(column).segment<3>(v + part);
        const Vector3d in_W = R * Vector3d{x[0], x[1], x[2]};
        for (int k = 0; k < 3; ++k) m.base_response(part + k, column) = in_W[k];
      }
    }
    // Rows in the metric of the base inertia, so that rotation and translation compare by their energy.
    const Eigen::LLT<Matrix6d> I_b(M.block<6, 6>(v, v));
    comparable = I_b.matrixU() * change.middleRows<6>(v);
  }
  m.zero_disturbance = without_effect(comparable, metric);
  m.zero_base_angular_velocity = without_effect(m.base_response.topRows<3>(), metric);
}

// (13.7) for all grasps and their resultant, relative to the robot's and the systems' centres of mass.
void measure_lines(const Model& model, const Kinematics& kinematics, int root, std::span<const Grasp> grasps,
                   std::span<const Impulsed> impulses, ImpulseMeasures& m) {
  const Vector3d robot = center_of_mass(model, kinematics, {&root, 1});
  std::vector<int> all{root};
  Impulsed resultant = Impulsed::zero();  // about the world's origin
  for (std::size_t i = 0; i < grasps.size(); ++i) {
    const Grasp& g = grasps[i];
    const int target = model.bodies()[g.target_body].root;
    const int pair[] = {root, target};
    // A target that already hangs on the robot is part of it.
    const Vector3d both = target == root ? robot : center_of_mass(model, kinematics, pair);
    m.robot_line.push_back(impulse_line(impulses[i], g.p_WC, robot));
    m.system_line.push_back(impulse_line(impulses[i], g.p_WC, both));
    if (std::find(all.begin(), all.end(), target) == all.end()) all.push_back(target);
    resultant = resultant + shift(impulses[i], -g.p_WC);
  }
  if (grasps.empty()) return;
  m.robot_line.push_back(impulse_line(resultant, Vector3d::zero(), robot));
  m.system_line.push_back(impulse_line(resultant, Vector3d::zero(), center_of_mass(model, kinematics, all)));
}

}  // namespace

double effective_mass(const Matrix6d& inverse_inertia, const Vector3d& n_W) {
  const Eigen::Vector3d n(n_W[0], n_W[1], n_W[2]);
  const Eigen::Matrix3d L = inverse_inertia.bottomRightCorner<3, 3>();
  const double yields = n.dot(L * n) / n.squaredNorm();
  return yields > kRigid * L.cwiseAbs().maxCoeff() ? 1 / yields : kInfinity;
}

// Impulse about the point p_WC => angular impulse about p_W, its couple along the linear impulse and the distance of
// p_W from the central axis (13.7); infinite for a pure couple.
ImpulseLine impulse_line(const Impulsed& P_WC, const Vector3d& p_WC, const Vector3d& p_W) {
  ImpulseLine line;
  line.angular_impulse = shift(P_WC, p_W - p_WC).angular;
  const double size = norm(P_WC.linear);
  if (size == 0) {
    line.miss = norm(line.angular_impulse) > 0 ? kInfinity : 0;
    return line;
  }
  // The part of the angular impulse normal to the linear one is due to the distance of the axis (13.7).
  const Vector3d along = (1 / size) * P_WC.linear;
  line.couple = dot(along, line.angular_impulse);
  line.miss = norm(cross(along, line.angular_impulse)) / size;
  return line;
}

// State, grasps, impulses (or none), held rates => measures of each end-effector (13.1) to (13.4), of all grasps
// (13.5), (13.6), of the base (13.8), (13.9), and lines of impulse (13.7). Throws std::invalid_argument unless there is
// one impulse per grasp or none.
ImpulseMeasures impulse_measures(const Model& model, const State& state, int root, std::span<const Grasp> grasps,
                                 std::span<const Impulsed> impulses, std::span<const HeldRate> held) {
  if (!impulses.empty() && impulses.size() != grasps.size())
    throw std::invalid_argument("impulse_measures: one impulse per grasp is needed, or none");
  const Kinematics kinematics = forward_kinematics(model, state);
  const Eigen::MatrixXd M = mass_matrix(model, state);
  const Response response(M, held);
  const Eigen::VectorXd velocity = velocity_with_held(M, state, held, response);

  ImpulseMeasures m;
  for (const Grasp& g : grasps)
    m.end_effectors.push_back(measure_end_effector(model, kinematics, g, response, velocity));
  const Eigen::MatrixXd J = grasp_jacobian(model, kinematics, grasps);
  const Eigen::MatrixXd change = response(J.transpose());
  m.contact_inertia = J * change;
  if (J.rows() > 0) {
    const Cholesky metric(grasp_metric(model, kinematics, grasps, J.rows()));
    static_cast<CoupledImpulse&>(m) = measure_coupled(response.half(J.transpose()), J * velocity, metric);
    measure_base(model, kinematics, root, M, change, metric, m);
  } else {
    m.base_response = m.zero_disturbance = m.zero_base_angular_velocity = Eigen::MatrixXd(6, 0);
  }
  if (!impulses.empty()) measure_lines(model, kinematics, root, grasps, impulses, m);
  return m;
}

// State, grasps, held rates => mean of the singular values (13.5) and energy P^T D P / 2 of the impulse (13.6), the
// quantities that a plan minimizes. By the QR decomposition of Y where its rank is certainly full, otherwise by the
// singular values.
PlannedImpulse planned_impulse(const Model& model, const State& state, std::span<const Grasp> grasps,
                               std::span<const HeldRate> held) {
  const Kinematics kinematics = forward_kinematics(model, state);
  const Eigen::MatrixXd M = mass_matrix(model, state), J = grasp_jacobian(model, kinematics, grasps);
  if (J.rows() == 0) return {};
  const Response response(M, held);
  const Eigen::VectorXd velocity = velocity_with_held(M, state, held, response);
  const Cholesky metric(grasp_metric(model, kinematics, grasps, J.rows()));
  const Eigen::MatrixXd half = response.half(J.transpose());
  if (half.rows() >= half.cols()) {
    // Y = Q R. No singular value is below 1/|R^-1| or above |R|: for certainly independent rows, W^-1 = R^-1 R^-T in
    // the metric, and the mean of its singular values is |R^-1|^2 over their number.
    const Eigen::MatrixXd R = thin_qr(lower_solution(metric, half.transpose()).transpose()).R;
    const Eigen::MatrixXd inverse =
        R.triangularView<Eigen::Upper>().solve(Eigen::MatrixXd::Identity(R.rows(), R.cols()));
    const double size = inverse.norm();
    if (kRankTolerance * size * R.norm() < 1) {
      const Eigen::VectorXd motion = lower_solution(metric, J * velocity);
      const Eigen::VectorXd impulse = inverse * (inverse.transpose() * motion);
      return {size * size / static_cast<double>(R.rows()), 0.5 * impulse.squaredNorm()};
    }
  }
  const CoupledImpulse m = measure_coupled(half, J * velocity, metric);
  return {m.mean_impulse, m.energy};
}

}  // namespace grapnel
