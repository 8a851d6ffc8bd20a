#include "grapnel/plan/floating_base.hpp"

#include <stdexcept>

namespace grapnel {

// Validates the model and maps joints to links of the tree.
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
    throw std::invalid_argument("FloatingBase: every link except the root needs a joint with one degree of freedom");
  }
  q_.assign(model.coordinates(), 0.0);
  V_.resize(count), h_.resize(count), dh_.resize(joint_link_.size());
  per_angle_ = per_rate_ = Matrix6Xd::Zero(6, joints());
}

void PlacedLinks::resize(int links, int joints) {
  const auto n = static_cast<std::size_t>(links), m = static_cast<std::size_t>(joints);
  if (X_BL.size() == n && k.size() == m) return;
  X_BL.resize(n), axis.resize(n), composite.resize(n), inertia.resize(n);
  joint_momentum.resize(m), k.resize(m);
}

PlacedNumbers<double> PlacedLinks::numbers() {
  return {X_BL.data(), axis.data(), composite.data(), inertia.data(), joint_momentum.data(), k.data(),
          &com,        &mass,       &H_inverse};
}

ServicerTree<double> FloatingBase::tree() const {
  const auto& links = model_.tree().links;
  return {links.data(), static_cast<int>(links.size()), joint_link_.data(), link_joint_.data(), joints()};
}

void FloatingBase::place_links(std::span<const double> theta, PlacedLinks& placed) {
  count(1);
  const auto& links = model_.tree().links;
  placed.resize(static_cast<int>(links.size()), joints());
  for (int j = 0; j < joints(); ++j) q_[links[joint_link_[j]].q] = theta[j];
  place_poses<double>(tree(), q_, placed.numbers());
}

void FloatingBase::place_frames(std::span<const double> theta) { place_links(theta, placed_); }

void FloatingBase::place(std::span<const double> theta, PlacedLinks& placed) {
  place_links(theta, placed);
  place_inertias(tree(), floats_, turns(), placed.numbers());
}

void FloatingBase::place(std::span<const double> theta) {
  place(theta, placed_);
  if (!floats_) return;
  for (int j = 0; j < joints(); ++j) per_rate_.col(j) = -column(twist_of(placed_, placed_.joint_momentum[j]));
}

Twistd FloatingBase::twist_of(const PlacedLinks& links, const Momentumd& h) {
  const Vector3d w = links.H_inverse * (h.angular - cross(links.com, h.linear));
  return {w, (1 / links.mass) * h.linear - cross(w, links.com)};  // (4)
}

Vector3d FloatingBase::momentum_of_rates(const PlacedLinks& links, std::span<const double> rates) {
  return grapnel::momentum_of_rates(static_cast<int>(rates.size()), links.k.data(), rates.data());
}

void FloatingBase::angular_momentum_per_angle(const PlacedLinks& links, std::span<const double> rates,
                                              const Vector3d& w_B, std::span<Vector3d> g) {
  grapnel::angular_momentum_per_angle(tree(), links.numbers(), rates.data(), w_B, motion(), g.data());
}

Vector6d FloatingBase::momentum_part(const Momentumd& h_B) const {
  return floats_ ? column(twist_of(placed_, h_B)) : Vector6d::Zero();
}

Vector6d FloatingBase::twist_at(std::span<const double> rates, const Momentumd& h_B) const {
  Vector6d V_B = momentum_part(h_B);
  for (int j = 0; j < joints(); ++j) V_B += rates[j] * per_rate_.col(j);  // (1)
  return V_B;
}

void FloatingBase::move(std::span<const double> rates, const Momentumd& h_B) {
  V_B_ = twist_at(rates, h_B);
  momentum_per_angle(tree(), placed_.numbers(), rates.data(), twist_from(V_B_), motion());
  if (!floats_) return;
  for (int j = 0; j < joints(); ++j) per_angle_.col(j) = -column(twist_of(placed_, dh_[j]));  // (3)
}

Eigen::Matrix<double, 6, 6> FloatingBase::twist_per_displacement(const Momentumd& h_B) const {
  Eigen::Matrix<double, 6, 6> D = Eigen::Matrix<double, 6, 6>::Zero();
  if (!floats_) return D;
  for (int k = 0; k < 6; ++k) {
    const Wrenchd change = cross_force(twist_from(Vector6d::Unit(k)), h_B);
    D.col(k) = -column(twist_of(placed_, {change.angular, change.linear}));
  }
  return D;
}

Eigen::Matrix<double, 6, 6> FloatingBase::displacement_rate(const Momentumd& h_B) const {
  Eigen::Matrix<double, 6, 6> A = twist_per_displacement(h_B);
  if (!floats_) return A;
  const Twistd V = twist_from(V_B_);
  for (int k = 0; k < 6; ++k) A.col(k) -= column(cross_motion(V, twist_from(Vector6d::Unit(k))));
  return A;
}

Eigen::Matrix3d as_matrix(const Rotationd& R) {
  Eigen::Matrix3d M;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) M(i, j) = R(i, j);
  }
  return M;
}

Posed FloatingBase::frame_pose(int frame) const {
  const Frame& f = model_.frames()[frame];
  const BodyPlacement& placement = model_.bodies()[f.body].placement;
  return placed_.X_BL[placement.link] * placement.X_LB * f.X_BE;
}

Twistd FloatingBase::frame_twist(int frame) const {
  const int link = model_.bodies()[model_.frames()[frame].body].placement.link;
  return shift(V_[link], frame_pose(frame).p);
}

// Rates of the last move() => derivatives of the frame's twist with respect to joint values, by (2) and (3) along its
// chain.
void FloatingBase::frame_twist_per_angle(int frame, Matrix6Xd& D) const {
  const auto& links = model_.tree().links;
  const int link = model_.bodies()[model_.frames()[frame].body].placement.link;
  const Vector3d p = frame_pose(frame).p;
  D.resize(6, joints());
  for (int j = 0; j < joints(); ++j) D.col(j) = column(shift(twist_from(per_angle_.col(j)), p));
  // The subtree of a joint rotates with its axis: so do the part of the twist due to this joint and those beyond, and
  // the frame's origin.
  for (int i = link; i > 0; i = links[i].parent) {
    const Twistd& S = placed_.axis[i];
    const auto turned = cross_motion(S, V_[link] - V_[links[i].parent]);
    const Vector3d moved = S.linear + cross(S.angular, p);
    const Twistd change{turned.angular, turned.linear + cross(turned.angular, p) + cross(V_[link].angular, moved)};
    D.col(link_joint_[i]) += column(change);
  }
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
    J.col(link_joint_[i]) = column(shift(placed_.axis[i], p));
  }
}

void FloatingBase::generalized_jacobian(int frame, Matrix6Xd& J) const {
  frame_jacobian(frame, J);
  const Vector3d p = frame_pose(frame).p;
  for (int j = 0; j < joints(); ++j) {
    if (is_held(j))
      J.col(j).setZero();
    else if (floats_)
      J.col(j) += column(shift(twist_from(per_rate_.col(j)), p));
  }
}

}  // namespace grapnel
