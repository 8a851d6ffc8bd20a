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
  V_.resize(count), h_.resize(count), dh_.resize(joint_link_.size());
  per_angle_ = per_rate_ = Matrix6Xd::Zero(6, joints());
}

void FloatingBase::place_links(std::span<const double> theta, PlacedLinks& placed) {
  if (watch_) watch_->count();
  const auto& links = model_.tree().links;
  const std::size_t count = links.size();
  if (placed.motion.size() != count) {
    placed.motion.resize(count), placed.axis.resize(count);
    placed.composite.resize(count), placed.inertia.resize(count);
    placed.joint_momentum.resize(joint_link_.size()), placed.k.resize(joint_link_.size());
  }
  for (int j = 0; j < joints(); ++j) q_[links[joint_link_[j]].q] = theta[j];
  link_motion<double>(model_.tree(), q_, {}, placed.motion);
  if (links[0].joint == JointType::fixed) {
    // A fixed root stands at X_PF in the world; here only what is relative to it matters.
    const Posed X_BW = inverse(placed.motion[0].X_WL);
    for (LinkMotion<double>& motion : placed.motion) motion.X_WL = X_BW * motion.X_WL;
  }
  for (std::size_t i = 1; i < count; ++i) {
    const Posed& X = placed.motion[i].X_WL;
    const Vector3d a = links[i].sign * X.R.column(links[i].axis);
    placed.axis[i] = slides_along_axis(links[i].joint) ? Twistd{Vector3d::zero(), a} : Twistd{a, cross(X.p, a)};
  }
}

void FloatingBase::place_frames(std::span<const double> theta) { place_links(theta, placed_); }

void FloatingBase::place(std::span<const double> theta, PlacedLinks& placed) {
  place_links(theta, placed);
  const auto& links = model_.tree().links;
  const std::size_t count = links.size();
  for (std::size_t i = 0; i < count; ++i) {
    placed.inertia[i] = placed.composite[i] = placed.motion[i].X_WL * links[i].inertia;
  }
  for (std::size_t i = count; i-- > 1;) placed.composite[links[i].parent] += placed.composite[i];
  const RigidBodyInertiad& all = placed.composite[0];
  placed.mass = all.mass;
  placed.com = all.com();
  if (!floats_) return;
  placed.H_inverse = Symmetric3d::zero();  // (7)
  if (!keeps_attitude_) {
    const SymmetricFactor3<double> H(all.rotational_about_com());
    const Vector3d x = H.solve({1, 0, 0}), y = H.solve({0, 1, 0}), z = H.solve({0, 0, 1});
    placed.H_inverse = {x[0], y[1], z[2], y[0], z[0], z[1]};
  }
  for (int j = 0; j < joints(); ++j) {
    const int i = joint_link_[j];
    Momentumd F = placed.composite[i] * placed.axis[i];
    if (links[i].has_rotor) F.angular += rotor_momentum(placed, i);
    placed.joint_momentum[j] = F;
    placed.k[j] = F.angular - cross(placed.com, F.linear);
  }
}

Vector3d FloatingBase::rotor_momentum(const PlacedLinks& placed, int link) const {
  const TreeLink<double>& l = model_.tree().links[link];
  return placed.motion[l.parent].X_WL.R * (l.sign * l.rotor);
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
  Vector3d sum = Vector3d::zero();
  for (std::size_t j = 0; j < rates.size(); ++j) sum += rates[j] * links.k[j];
  return sum;
}

void FloatingBase::momentum_per_angle(const PlacedLinks& placed, std::span<const double> rates, const Twistd& V_B,
                                      std::span<Momentumd> dh) {
  const auto& links = model_.tree().links;
  V_[0] = V_B;
  h_[0] = placed.inertia[0] * V_[0];
  for (std::size_t i = 1; i < links.size(); ++i) {
    V_[i] = V_[links[i].parent] + rates[link_joint_[i]] * placed.axis[i];
    h_[i] = placed.inertia[i] * V_[i];
  }
  // A rotor turns with the link that carries it, and so does its spin.
  for (std::size_t i = 1; i < links.size(); ++i) {
    if (!links[i].has_rotor) continue;
    h_[links[i].parent].angular += rates[link_joint_[i]] * rotor_momentum(placed, static_cast<int>(i));
  }
  for (std::size_t i = links.size(); i-- > 1;) h_[links[i].parent] += h_[i];
  for (int j = 0; j < joints(); ++j) {
    const int i = joint_link_[j];
    const Wrenchd change =
        cross_force(placed.axis[i], h_[i]) - placed.composite[i] * cross_motion(placed.axis[i], V_[links[i].parent]);
    dh[j] = {change.angular, change.linear};  // (2)
  }
}

void FloatingBase::angular_momentum_per_angle(const PlacedLinks& links, std::span<const double> rates,
                                              const Vector3d& w_B, std::span<Vector3d> g) {
  // The base's velocity with which the centre of mass stays where it is: then the way that it moves as a joint turns
  // does not count.
  Vector3d p = Vector3d::zero();
  for (std::size_t j = 0; j < rates.size(); ++j) p += rates[j] * links.joint_momentum[j].linear;
  momentum_per_angle(links, rates, {w_B, (-1 / links.mass) * p - cross(w_B, links.com)}, dh_);
  for (int j = 0; j < joints(); ++j) g[j] = dh_[j].angular - cross(links.com, dh_[j].linear);
}

Vector6d FloatingBase::momentum_part(const Momentumd& h_B) const {
  return floats_ ? column(twist_of(placed_, h_B)) : Vector6d::Zero();
}

void FloatingBase::move(std::span<const double> rates, const Momentumd& h_B) {
  V_B_ = momentum_part(h_B);
  for (int j = 0; j < joints(); ++j) V_B_ += rates[j] * per_rate_.col(j);  // (1)
  momentum_per_angle(placed_, rates, twist_from(V_B_), dh_);
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
  return placed_.motion[placement.link].X_WL * placement.X_LB * f.X_BE;
}

Twistd FloatingBase::frame_twist(int frame) const {
  const int link = model_.bodies()[model_.frames()[frame].body].placement.link;
  return shift(V_[link], frame_pose(frame).p);
}

void FloatingBase::frame_twist_per_angle(int frame, Matrix6Xd& D) const {
  const auto& links = model_.tree().links;
  const int link = model_.bodies()[model_.frames()[frame].body].placement.link;
  const Vector3d p = frame_pose(frame).p;
  D.resize(6, joints());
  for (int j = 0; j < joints(); ++j) D.col(j) = column(shift(twist_from(per_angle_.col(j)), p));
  // What a joint carries turns with its axis: the part of the twist that stems from it and those beyond, and the
  // frame's origin.
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
