#include "grapnel/control/effort_response.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "grapnel/dynamics/mass_matrix.hpp"
#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {
namespace {

// Eigenvalues of the closures' inertia below this part of the largest indicate redundant rows.
constexpr double kRedundant = 1e-10;

Vector3d point_acceleration(const BodyAcceleration& body, const Vector3d& w, const Vector3d& arm) {
  return body.linear + cross(body.angular, arm) + cross(w, cross(w, arm));
}

Eigen::RowVector3d row(const Vector3d& v) { return {v[0], v[1], v[2]}; }

}  // namespace

EffortResponse::EffortResponse(const Model& model, std::vector<int> joints, std::vector<LoopClosure> closures,
                               const std::vector<int>& steady)
    : model_(model),
      joints_(std::move(joints)),
      steady_(static_cast<std::size_t>(model.velocities())),
      closures_(std::move(closures)),
      workspace_(model),
      inertia_(model),
      zero_(steady_.size()),
      vdot_(steady_.size()),
      mass_(model.velocities(), model.velocities()),
      rows_(closure_rows(closures_) + static_cast<Eigen::Index>(model.couplings().size()), model.velocities()),
      row_terms_(rows_.rows()) {
  for (int j : joints_) {
    if (j < 0 || j >= static_cast<int>(model.joints().size()))
      throw std::invalid_argument("EffortResponse: a joint that the model does not have");
    velocities_.push_back(model.joint_body(j).v);
    coordinates_.push_back(model.joint_body(j).q);
    limits_.push_back(model.joint_body(j).description.joint.limits.effort);
  }
  unit_ = Eigen::MatrixXd::Zero(model.velocities(), static_cast<Eigen::Index>(joints_.size()));
  for (std::size_t j = 0; j < joints_.size(); ++j) unit_(velocities_[j], static_cast<Eigen::Index>(j)) = 1;
  for (int j : steady) steady_[model.bodies()[model.joints().at(j)].v] = 1;
}

// State and forces => vdot = free + response tau (15.1) from the factored mass matrix; closed loops by (2.10).
void EffortResponse::update(const State& state, std::span<const double> force, const Vector3d& gravity,
                            std::span<const ExternalWrench> wrenches) {
  forward_kinematics(model_, state, workspace_.kinematics);
  velocity_terms_ = body_accelerations(model_, workspace_.kinematics, {});
  // M vdot = force - c + S^T tau (2.7)
  gather_external(model_, wrenches, workspace_);
  beside_.assign(force.begin(), force.end());
  beside_.resize(zero_.size());
  DynamicsInput<double> in;
  in.q = state.q, in.v = state.v, in.force = beside_, in.gravity = gravity, in.link_wrench = workspace_.link_wrench;
  in.prescribed = steady_, in.acceleration = zero_;
  articulated_body<double>(model_.tree(), in, workspace_.kernel, vdot_, workspace_.force);
  free_ = as_vector(vdot_);
  mass_matrix(model_, state, workspace_, mass_);
  // Steady joints have zero acceleration: their rows and columns are removed.
  for (int v = 0; v < model_.velocities(); ++v) {
    if (steady_[v] != 0) mass_.row(v).setZero(), mass_.col(v).setZero(), mass_(v, v) = 1;
  }
  inertia_.factor(mass_);
  inertia_.solve(unit_, response_);
  if (rows_.rows() == 0) return;

  // With the closures' J vdot + Jdot v = 0: vdot - M^-1 J^T W^+ (J vdot + Jdot v), W = J M^-1 J^T (2.10).
  close_loops();
  Eigen::MatrixXd spread;
  inertia_.solve(rows_.transpose(), spread);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> W(Eigen::MatrixXd(rows_ * spread));
  Eigen::VectorXd inverse = W.eigenvalues();
  const double least = kRedundant * inverse.maxCoeff();
  for (double& value : inverse) value = value > least ? 1 / value : 0;
  const Eigen::MatrixXd back = spread * W.eigenvectors() * inverse.asDiagonal() * W.eigenvectors().transpose();
  const Eigen::MatrixXd solved = W.eigenvectors() * inverse.asDiagonal() * W.eigenvectors().transpose();
  free_multipliers_ = -(solved * (rows_ * free_ + row_terms_));
  multiplier_response_ = -(solved * (rows_ * response_));
  free_ -= back * (rows_ * free_ + row_terms_);
  response_ -= back * (rows_ * response_);
}

// J and Jdot v of all closures, in the frames C, and of couplings.
void EffortResponse::close_loops() {
  const int nv = model_.velocities();
  const Kinematics& kinematics = workspace_.kinematics;
  Eigen::MatrixXd J_a(6, nv), J_b(6, nv);
  Eigen::Index next = 0;
  for (const LoopClosure& closure : closures_) {
    const auto &X_WA = kinematics.X_WB[closure.body_a], &X_WB = kinematics.X_WB[closure.body_b];
    const Posed X_WC = X_WA * closure.X_AC;
    const Vector3d w_a = kinematics.V_WB[closure.body_a].angular, w_b = kinematics.V_WB[closure.body_b].angular;
    const auto &a = velocity_terms_[closure.body_a], &b = velocity_terms_[closure.body_b];
    point_jacobian(model_, kinematics, closure.body_a, X_WC.p, J_a);
    point_jacobian(model_, kinematics, closure.body_b, X_WC.p, J_b);
    J_b -= J_a;
    Vector3d axes[3];
    const int turns = forbidden_turns(closure, axes);
    for (int k = 0; k < turns; ++k) {
      const Vector3d n = X_WC.R * axes[k];  // rotates with body a
      rows_.row(next) = row(n) * J_b.topRows<3>();
      row_terms_[next++] = dot(n, b.angular - a.angular) + dot(cross(w_a, n), w_b - w_a);
    }
    const Vector3d apart = point_acceleration(b, w_b, X_WC.p - X_WB.p) - point_acceleration(a, w_a, X_WC.p - X_WA.p);
    for (int k = 0; k < 3; ++k) {
      const Vector3d n = X_WC.R.column(k);
      rows_.row(next) = row(n) * J_b.bottomRows<3>();
      row_terms_[next++] = dot(n, apart);
    }
  }
  for (const JointCoupling& coupling : model_.couplings()) {  // (8.13)
    rows_.row(next).setZero();
    for (const auto& [body, factor] : coupling.joints) rows_(next, model_.bodies()[body].v) = factor;
    row_terms_[next++] = 0;
  }
}

// Affine efforts and limits => largest admissible share, as the intersection of one interval per joint.
std::optional<double> largest_share(const Eigen::VectorXd& fixed, const Eigen::VectorXd& varied,
                                    std::span<const double> limits, double most) {
  double least = 0;
  for (std::size_t j = 0; j < limits.size(); ++j) {
    const double f = fixed[j], v = varied[j], limit = limits[j];
    if (!std::isfinite(limit)) continue;
    if (v == 0) {
      if (std::abs(f) > limit) return {};
      continue;
    }
    const double one = (limit - f) / v, other = (-limit - f) / v;
    most = std::min(most, std::max(one, other));
    least = std::max(least, std::min(one, other));
  }
  if (most < least) return {};
  return most;
}

}  // namespace grapnel
