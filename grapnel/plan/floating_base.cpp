#include "grapnel/plan/floating_base.hpp"

#include <stdexcept>

namespace grapnel {

FloatingBase::FloatingBase(const Model& model, bool floats) : model_(model), floats_(floats) {
  const auto& links = model.tree().links;
  const std::size_t count = links.size();
  link_joint_.assign(count, -1);
  for (std::size_t i = 1; i < count; ++i) {
    if (links[i].parent < 0) throw std::invalid_argument("FloatingBase: the model must be one tree");
  }
  for (int body : model.joints()) {
    const int link = model.bodies()[body].placement.link;
    link_joint_[link] = static_cast<int>(joint_link_.size());
    joint_link_.push_back(link);
  }
  if (count == 0 || joint_link_.size() + 1 != count) {
    throw std::invalid_argument("FloatingBase: every link but the root needs a joint of one degree of freedom");
  }
  q_.assign(model.coordinates(), 0.0);
  if (links[0].joint == JointType::free) q_[links[0].q + 3] = 1;
  motion_.resize(count);
  axis_.resize(count), composite_.resize(count), inertia_.resize(count), V_.resize(count), h_.resize(count);
  per_angle_ = per_rate_ = Matrix6Xd::Zero(6, joints());
}

void FloatingBase::place(std::span<const double> theta) {
  if (watch_) watch_->count();
  const auto& links = model_.tree().links;
  for (int j = 0; j < joints(); ++j) q_[links[joint_link_[j]].q] = theta[j];
  link_motion<double>(model_.tree(), q_, {}, motion_);
  // A fixed root stands at X_PF in the world; here only what is relative to it matters.
  const Posed X_BW = inverse(motion_[0].X_WL);
  for (std::size_t i = 0; i < links.size(); ++i) {
    if (links[0].joint == JointType::fixed) motion_[i].X_WL = X_BW * motion_[i].X_WL;
    const Posed& X = motion_[i].X_WL;
    inertia_[i] = composite_[i] = X * links[i].inertia;
    if (i == 0) continue;
    const Vector3d a = links[i].sign * X.R.column(links[i].axis);
    axis_[i] = slides_along_axis(links[i].joint) ? Twistd{Vector3d::zero(), a} : Twistd{a, cross(X.p, a)};
  }
  for (std::size_t i = links.size(); i-- > 1;) composite_[links[i].parent] += composite_[i];
  if (!floats_) return;
  Eigen::Matrix<double, 6, 6> I_c;
  for (int k = 0; k < 6; ++k) I_c.col(k) = column(composite_[0] * twist_from(Vector6d::Unit(k)));
  I_c_.compute(I_c);
  for (int j = 0; j < joints(); ++j) {
    const int i = joint_link_[j];
    per_rate_.col(j) = -I_c_.solve(column(composite_[i] * axis_[i]));
  }
}

Vector6d FloatingBase::momentum_part(const Momentumd& h_B) const {
  return floats_ ? Vector6d(I_c_.solve(column(h_B))) : Vector6d::Zero();
}

void FloatingBase::move(std::span<const double> rates, const Momentumd& h_B) {
  if (!floats_) return;
  const auto& links = model_.tree().links;
  V_B_ = momentum_part(h_B);
  for (int j = 0; j < joints(); ++j) V_B_ += rates[j] * per_rate_.col(j);  // (1)
  V_[0] = twist_from(V_B_);
  h_[0] = inertia_[0] * V_[0];
  for (std::size_t i = 1; i < links.size(); ++i) {
    V_[i] = V_[links[i].parent] + rates[link_joint_[i]] * axis_[i];
    h_[i] = inertia_[i] * V_[i];
  }
  for (std::size_t i = links.size(); i-- > 1;) h_[links[i].parent] += h_[i];
  for (int j = 0; j < joints(); ++j) {
    const int i = joint_link_[j];
    const Wrenchd dh =
        cross_force(axis_[i], h_[i]) - composite_[i] * cross_motion(axis_[i], V_[links[i].parent]);  // (2)
    per_angle_.col(j) = -I_c_.solve(column(dh));
  }
}

Eigen::Matrix<double, 6, 6> FloatingBase::displacement_rate(const Momentumd& h_B) const {
  Eigen::Matrix<double, 6, 6> A = Eigen::Matrix<double, 6, 6>::Zero();
  if (!floats_) return A;
  const Twistd V = twist_from(V_B_);
  for (int k = 0; k < 6; ++k) {
    const Twistd xi = twist_from(Vector6d::Unit(k));
    A.col(k) = -I_c_.solve(column(cross_force(xi, h_B))) - column(cross_motion(V, xi));
  }
  return A;
}

Posed FloatingBase::frame_pose(int frame) const {
  const Frame& f = model_.frames()[frame];
  const BodyPlacement& placement = model_.bodies()[f.body].placement;
  return motion_[placement.link].X_WL * placement.X_LB * f.X_BE;
}

bool FloatingBase::carries(int joint, int frame) const {
  const auto& links = model_.tree().links;
  for (int i = model_.bodies()[model_.frames()[frame].body].placement.link; i >= 0; i = links[i].parent) {
    if (i == joint_link_[joint]) return true;
  }
  return false;
}

void FloatingBase::frame_jacobian(int frame, Matrix6Xd& J) const {
  const auto& links = model_.tree().links;
  const Vector3d p = frame_pose(frame).p;
  J.setZero(6, joints());
  for (int i = model_.bodies()[model_.frames()[frame].body].placement.link; i > 0; i = links[i].parent) {
    J.col(link_joint_[i]) = column(shift(axis_[i], p));
  }
}

void FloatingBase::generalized_jacobian(int frame, Matrix6Xd& J) const {
  frame_jacobian(frame, J);
  if (!floats_) return;
  const Vector3d p = frame_pose(frame).p;
  for (int j = 0; j < joints(); ++j) J.col(j) += column(shift(twist_from(per_rate_.col(j)), p));
}

}  // namespace grapnel
