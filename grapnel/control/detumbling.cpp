#include "grapnel/control/detumbling.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "grapnel/dense/decompositions.hpp"
#include "grapnel/dynamics/momentum.hpp"

namespace grapnel {
namespace {

// Singular values below this part of the largest are directions in which efforts cannot accelerate the target.
constexpr double kOutOfReach = 1e-12;

using Vector6d = Eigen::Matrix<double, 6, 1>;

Vector6d stacked(const Vector3d& angular, const Vector3d& linear) {
  Vector6d v;
  v << angular[0], angular[1], angular[2], linear[0], linear[1], linear[2];
  return v;
}

}  // namespace

TargetMotion3d target_motion(const Model& model, const Kinematics& kinematics, int target) {
  const Body& body = model.bodies()[target];
  const BodyMomentum own = body_momentum(model, kinematics, target);
  TargetMotion3d motion{own.h.angular, (1 / body.description.mass) * own.h.linear};
  if (!model.has_free_root(target)) return motion;  // relative to the ground
  double mass = 0;
  for (const Body& b : model.bodies()) {
    if (b.root == body.root) mass += b.description.mass;
  }
  const int roots[] = {body.root};
  motion.velocity -= (1 / mass) * momentum_about(model, kinematics, own.p_WC, roots).linear;
  return motion;
}

double detumbling_time(const Vector3d& angular_momentum, double torque) { return norm(angular_momentum) / torque; }

DetumblingCommand detumbling_command(const DetumblingLaw& law, const State& state, std::span<const double> force,
                                     const Vector3d& gravity, EffortResponse& response) {
  response.update(state, force, gravity);
  const Model& model = response.model();
  const Kinematics& k = response.kinematics();
  const auto n = static_cast<Eigen::Index>(response.joints().size());
  const BodyDescription& target = model.bodies()[law.target].description;
  const Posed& X_WT = k.X_WB[law.target];
  const Vector3d w = k.V_WB[law.target].angular, arm = X_WT.R * target.com;
  const TargetMotion3d motion = target_motion(model, k, law.target);
  const Vector3d& L = motion.angular_momentum;

  // The target's acceleration at its centre of mass: A tau + a, angular rows times its radius of gyration.
  const double trace = target.inertia.xx + target.inertia.yy + target.inertia.zz;
  const double radius = std::sqrt(trace / (2 * target.mass));
  Vector6d size = Vector6d::Ones();
  size.head<3>().setConstant(radius);
  Eigen::MatrixXd J(6, model.velocities());
  point_jacobian(model, k, law.target, X_WT.p + arm, J);
  const BodyAcceleration& terms = response.velocity_terms()[law.target];
  const Vector6d a =
      J * response.free() + stacked(terms.angular, terms.linear + cross(terms.angular, arm) + cross(w, cross(w, arm)));
  const Eigen::VectorXd root = as_vector(law.damping).cwiseSqrt();
  const Eigen::MatrixXd A = size.asDiagonal() * (J * response.response()) * root.asDiagonal();

  // It turns freely and falls: (15.5) with k = 0; and what each unit of k adds: -[w; v].
  const Vector3d w_T = transposed_times(X_WT.R, w);
  const Vector3d gyroscopic = cross(w_T, target.inertia * w_T);
  const Eigen::Matrix3d inertia{{target.inertia.xx, target.inertia.xy, target.inertia.xz},
                                {target.inertia.xy, target.inertia.yy, target.inertia.yz},
                                {target.inertia.xz, target.inertia.yz, target.inertia.zz}};
  const Eigen::Vector3d turning = inertia.llt().solve(Eigen::Vector3d(gyroscopic[0], gyroscopic[1], gyroscopic[2]));
  const bool floats = model.has_free_root(law.target);
  const Vector6d kept =
      stacked(X_WT.R * Vector3d{-turning[0], -turning[1], -turning[2]}, floats ? gravity : Vector3d::zero());
  const Vector6d falling = -stacked(w, motion.velocity);

  // Least sum of tau^2/damping; the rest of the efforts damps: tau = D^1/2 (V S^+ U^T b - (1 - V V^T) D^1/2 rates).
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(A, Eigen::ComputeThinU | Eigen::ComputeThinV);
  const Eigen::VectorXd& s = svd.singularValues();
  DetumblingCommand command;
  command.condition = n >= 6 && s[0] > 0 ? s[5] / s[0] : 0;
  const auto shared = [&](const Vector6d& b) -> Eigen::VectorXd {
    Eigen::VectorXd along = svd.matrixU().transpose() * (size.asDiagonal() * b);
    for (Eigen::Index i = 0; i < s.size(); ++i) along[i] = s[i] > kOutOfReach * s[0] ? along[i] / s[i] : 0;
    return svd.matrixV() * along;
  };
  Eigen::VectorXd damping(n);
  for (Eigen::Index j = 0; j < n; ++j) damping[j] = -root[j] * state.v[response.velocity(static_cast<std::size_t>(j))];
  damping -= svd.matrixV() * (svd.matrixV().transpose() * damping);
  const Eigen::VectorXd fixed = root.cwiseProduct(shared(kept - a)), still = root.cwiseProduct(damping);
  const Eigen::VectorXd slope = root.cwiseProduct(shared(falling));

  const double wanted = norm(L) > 0 ? law.torque / std::max(norm(L), law.torque * law.shortest) : 0;  // (15.3)
  const std::optional<double> rate = largest_share(fixed, slope, response.limits(), wanted);
  command.within_limits = rate.has_value();
  command.rate = rate.value_or(0);
  command.scale = wanted > 0 ? command.rate / wanted : 0;
  command.effort = fixed + command.rate * slope;
  // Damping gets what the limits leave.
  if (rate) command.effort += largest_share(command.effort, still, response.limits(), 1).value_or(0) * still;
  for (Eigen::Index j = 0; j < n; ++j) {  // rounding, where it is within them
    const double limit = response.limits()[static_cast<std::size_t>(j)];
    command.effort[j] = std::clamp(command.effort[j], -limit, limit);
  }
  return command;
}

JointLawCommand Detumbling::at(double, const State& state, std::span<const double> force) {
  DetumblingCommand c = detumbling_command(law_, state, force, gravity_, response_);
  return {std::move(c.effort), c.scale, c.within_limits, c.condition};
}

}  // namespace grapnel
