#include "grapnel/control/base_keeping.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {

Vector3d attitude_deviation(const BaseKeepingLaw& law, const Rotationd& R_WB) {
  const Quaterniond q = quaternion_from(transpose(law.R_WD) * R_WB);
  const double sign = q.w < 0 ? -1 : 1;
  const Vector3d v{sign * q.x, sign * q.y, sign * q.z};
  const double s = norm(v), w = std::abs(q.w);
  return s < 1e-150 ? (2 / w) * v : (2 * std::atan2(s, w) / s) * v;
}

// State and forces => efforts for the attitude law (15.12) with minimum-norm joint accelerations, by the singular value
// decomposition of B (15.11), plus the largest admissible share of the reactionless motion.
BaseKeepingCommand base_keeping_command(const BaseKeepingLaw& law, const State& state, std::span<const double> force,
                                        const Vector3d& gravity, EffortResponse& response) {
  response.update(state, force, gravity);
  const auto n = static_cast<Eigen::Index>(response.joints().size());
  const int base = response.model().bodies()[law.root].v;
  const Eigen::VectorXd& free = response.free();

  // Accelerations of the driven joints, q'' = free + R tau, and of the base, w' = free + B (q'' - free), (15.11).
  Eigen::MatrixXd R(n, n);
  Eigen::VectorXd free_joints(n), towards(n);
  for (Eigen::Index j = 0; j < n; ++j) {
    const auto joint = static_cast<std::size_t>(j);
    R.row(j) = response.response().row(response.velocity(joint));
    free_joints[j] = free[response.velocity(joint)];
    const double r = law.posture_rate, rate = state.v[response.velocity(joint)];
    towards[j] = -2 * r * rate;
    if (!law.posture.empty()) towards[j] += r * r * (law.posture[joint] - state.q[response.coordinate(joint)]);
  }
  const Cholesky joints(R);
  const Eigen::MatrixXd B =
      cholesky_solution(joints, Eigen::MatrixXd(response.response().middleRows(base, 3).transpose())).transpose();

  // Restoring motion of the base: (15.12).
  const Vector3d phi = attitude_deviation(law, response.kinematics().X_WB[law.root].R);
  Eigen::Vector3d wanted;
  for (int k = 0; k < 3; ++k) wanted[k] = -2 * law.rate * state.v[base + k] - law.rate * law.rate * phi[k];
  const Eigen::VectorXd missing = wanted - free.segment<3>(base) + B * free_joints;
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(B, Eigen::ComputeThinU | Eigen::ComputeThinV);
  const Eigen::VectorXd& s = svd.singularValues();
  Eigen::VectorXd along = svd.matrixU().transpose() * missing;
  const Eigen::Index rank = std::min<Eigen::Index>(law.rank, s.size());
  for (Eigen::Index i = 0; i < s.size(); ++i) along[i] = i < rank && s[i] > 0 ? along[i] / s[i] : 0;
  const Eigen::VectorXd holding = svd.matrixV() * along;
  const Eigen::MatrixXd turning = svd.matrixV().leftCols(rank);
  const Eigen::VectorXd reactionless = towards - turning * (turning.transpose() * towards);

  BaseKeepingCommand command;
  for (Eigen::Index i = 0; i < s.size(); ++i) command.singular_values[static_cast<int>(i)] = s[i];
  command.condition = law.rank >= 1 && rank == law.rank && s[0] > 0 ? s[rank - 1] / s[0] : 0;
  const Eigen::VectorXd fixed = cholesky_solution(joints, Eigen::VectorXd(holding - free_joints));
  const Eigen::VectorXd varied = cholesky_solution(joints, reactionless);
  const std::optional<double> share = largest_share(fixed, varied, response.limits(), 1);
  command.within_limits = share.has_value();
  command.share = share.value_or(0);
  command.effort = fixed + command.share * varied;
  for (Eigen::Index j = 0; j < n; ++j) {
    const double limit = response.limits()[j];
    command.effort[j] = std::clamp(command.effort[j], -limit, limit);
  }
  return command;
}

JointLawCommand BaseKeeping::at(double, const State& state, std::span<const double> force) {
  BaseKeepingCommand c = base_keeping_command(law_, state, force, gravity_, response_);
  return {std::move(c.effort), c.share, c.within_limits, c.condition};
}

}  // namespace grapnel
