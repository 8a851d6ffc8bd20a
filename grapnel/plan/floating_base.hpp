#pragma once

/// @file
/// Motion of a floating base in response to its joints, and its derivatives with respect to joint values and rates:
/// (2.3) in closed form, in O(n) operations.
///
/// All quantities are expressed in the base frame B about B's origin. With V_B the base's twist, S_j the axis of joint
/// j, I^c_j the inertia of all links that joint j carries, and h_B the momentum expressed in B,
///   I_c V_B + sum_j I^c_j S_j theta_dot_j = h_B                                                   (1), which is (2.3).
/// A small rotation of joint j moves its subtree rigidly. The twist of a body i of the subtree is the twist V_p of the
/// joint's parent, which is unchanged, plus a part that rotates with S_j. With h_j the momentum of the subtree,
///   dh/dtheta_j = sum_i [S_j x* (I_i V_i) - I_i (S_j x V_i) + I_i S_j x (V_i - V_p)] = S_j x* h_j - I^c_j (S_j x V_p)
///                                                                                                                (2)
/// at fixed V_B and rates, and from (1), with h_B fixed,
///   dV_B/dtheta_j = -I_c^-1 dh/dtheta_j,   dV_B/dtheta_dot_j = -I_c^-1 I^c_j S_j.                                (3)
///
/// I_c is the inertia of one rigid body. With m its mass, c its centre of mass and H its inertia about it,
///   I_c^-1 [n; p] = [w; p/m - w x c],   w = H^-1 (n - c x p),                                                     (4)
/// so the base's angular velocity depends only on momenta about the centre of mass. About the centre of mass, where the
/// linear momentum vanishes, (1) and (2) become
///   H w + sum_j k_j theta_dot_j = R_WB^T L,   k_j = n - c x p of [n; p] = I^c_j S_j                               (5)
///   H dw/dtheta_j = -g_j,   g_j = n - c x p of [n; p] = dh/dtheta_j                                               (6)
/// with L the angular momentum about the centre of mass in W.
///
/// If the axis of a joint's rotor is stated, the rotor's spin momentum r_j theta_dot_j (19.6) is added to I^c_j S_j in
/// (1), (3) and (5). In (2) it is added to the momentum h of the link that carries the rotor and rotates with it.
///
/// An attitude-controlled base is held by an internal torque on the base alone (reaction wheels, for example). Linear
/// momentum is conserved, angular momentum is not, and V_B is (4) with w = 0,
///   V_B = [0; (p_B - sum_j p_j theta_dot_j)/m],   p_j of [n_j; p_j] = I^c_j S_j                                    (7)
/// which is the limit of (1) to (6) for an infinite moment of inertia of the base, H^-1 = 0.

#include <Eigen/Core>
#include <functional>
#include <limits>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

#include "grapnel/dynamics/kinematics.hpp"
#include "grapnel/plan/link_placement.hpp"

namespace grapnel {

// Progress and limits of long computations. The limit is a number of evaluations rather than a time. Whether it is
// reached depends on the problem alone and is the same on every machine.

/// Thrown when the limit of evaluations is reached.
struct WorkLimit : std::runtime_error {
  WorkLimit() : std::runtime_error("the limit of evaluations is reached") {}
};

class WorkWatch {
 public:
  using Look = std::function<void(long done)>;
  static constexpr long kNoLimit = std::numeric_limits<long>::max();

  WorkWatch() = default;
  /// Calls `look` periodically with the number of evaluations so far. An exception from `look` ends the computation, as
  /// does WorkLimit after `most` evaluations. Optimizers may treat such an exception as a failed evaluation; therefore
  /// the next evaluation throws it again.
  explicit WorkWatch(long most, Look look = {}) : most_(most), look_(std::move(look)) {}

  void count(long evaluations = 1) {
    done_ += evaluations;
    if (done_ >= next_check_) look_up();
  }
  long done() const { return done_; }

 private:
  static constexpr long kBetweenChecks = 256;

  void look_up() {
    if (done_ >= most_) throw WorkLimit();
    if (look_) look_(done_);
    next_check_ = done_ + kBetweenChecks;
  }

  long most_ = kNoLimit, done_ = 0, next_check_ = 1;
  Look look_;
};

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6Xd = Eigen::Matrix<double, 6, Eigen::Dynamic>;

/// The links for one set of joint values, in B about B's origin, and the quantities of (5) that depend on these values
/// alone.
struct PlacedLinks {
  std::vector<Posed> X_BL;                   // per link
  std::vector<Twistd> axis;                  // S, per link
  std::vector<RigidBodyInertiad> composite;  // I^c, per link
  std::vector<RigidBodyInertiad> inertia;    // of the link alone
  std::vector<Momentumd> joint_momentum;     // I^c_j S_j, with the spin of the joint's rotor, per joint
  std::vector<Vector3d> k;                   // per joint, (5)
  Vector3d com = Vector3d::zero();           // of all links [m]
  double mass = 0;                           // [kg]
  Symmetric3d H_inverse = Symmetric3d::zero();

  /// Resizes all arrays.
  void resize(int links, int joints);
  PlacedNumbers<double> numbers();
  /// Read-only access.
  PlacedNumbers<double> numbers() const { return const_cast<PlacedLinks*>(this)->numbers(); }
};

/// See the file comment. Joints are numbered as in Model::joints(). The model is a single tree, the servicer.
class FloatingBase {
 public:
  /// `floats` false: the base is held or fixed, and its twist is zero for all joint motions. @throws
  /// std::invalid_argument unless the model is a single tree whose joints have one degree of freedom.
  FloatingBase(const Model& model, bool floats);

  int joints() const { return static_cast<int>(joint_link_.size()); }
  bool floats() const { return floats_; }
  /// Makes a floating base attitude-controlled, (7). No effect if the base does not float.
  void keep_attitude() { keeps_attitude_ = true; }
  bool turns() const { return floats_ && !keeps_attitude_; }
  const Model& model() const { return model_; }
  /// The model in the form of link_placement.hpp.
  ServicerTree<double> tree() const;

  /// Counts every placement in `watch`; an exception from `watch` ends the planning. `watch` must outlive the object;
  /// null: no counting.
  void be_watched_by(WorkWatch* watch) { watch_ = watch; }
  /// Counts placements made elsewhere (PathSegment's nodes).
  void count(int placements) const {
    if (watch_) watch_->count(placements);
  }

  /// Joints that no demand may move: their columns of generalized_jacobian() are zero. One entry per joint; empty:
  /// none.
  void hold(std::vector<bool> joints) { held_ = std::move(joints); }
  bool is_held(int joint) const { return !held_.empty() && held_[static_cast<std::size_t>(joint)]; }

  /// Places the links for these joint values (one per joint).
  void place(std::span<const double> theta);
  /// The links' poses alone, for frame_pose() and frame_jacobian(), at a third of the cost.
  void place_frames(std::span<const double> theta);
  /// As place(), but writes to `links` and leaves the results of the last place() unchanged.
  void place(std::span<const double> theta, PlacedLinks& links);
  /// Angular momentum about the centre of mass of these joint rates for a base that does not rotate: the sum in (5).
  static Vector3d momentum_of_rates(const PlacedLinks& links, std::span<const double> rates);
  /// g_j of (6), per joint, at these joint rates and the base's angular velocity w_B (in B).
  void angular_momentum_per_angle(const PlacedLinks& links, std::span<const double> rates, const Vector3d& w_B,
                                  std::span<Vector3d> g);
  /// Base twist V_B for joint rates and momentum about B's origin in B, by (1); after place().
  void move(std::span<const double> rates, const Momentumd& h_B);
  const Vector6d& base_twist() const { return V_B_; }
  /// The same twist without the quantities that require move(), at a fifth of the cost.
  Vector6d twist_at(std::span<const double> rates, const Momentumd& h_B) const;
  /// The base twist for zero joint rates, I_c^-1 h_B; after place().
  Vector6d momentum_part(const Momentumd& h_B) const;

  /// dV_B/dtheta_j (6 x joints) by (3); after move().
  const Matrix6Xd& per_angle() const { return per_angle_; }
  /// dV_B/dtheta_dot_j; after place().
  const Matrix6Xd& per_rate() const { return per_rate_; }
  /// A of d(xi)' = A d(xi) + (terms of the joints): growth of a small displacement xi of the base, in B; after move().
  /// With X' = X V_B and h_B = Ad*(X) h: A = -I_c^-1 [. x* h_B] - [V_B x .].
  Eigen::Matrix<double, 6, 6> displacement_rate(const Momentumd& h_B) const;

  /// Derivative of the base's twist with respect to a small displacement xi of the base alone, in B: -I_c^-1 [. x*
  /// h_B]; after place().
  Eigen::Matrix<double, 6, 6> twist_per_displacement(const Momentumd& h_B) const;

  /// The links at the last place().
  const PlacedLinks& placed() const { return placed_; }
  /// Total centre of mass and mass; after place().
  Vector3d com() const { return placed_.com; }
  double mass() const { return placed_.mass; }
  /// Derivative of com() with respect to a joint value, with a fixed base [m/rad or 1]; after place().
  Vector3d com_per_angle(int joint) const { return (1 / placed_.mass) * placed_.joint_momentum[joint].linear; }

  /// Pose of a model's frame in B; after place().
  Posed frame_pose(int frame) const;
  /// Twists per joint rate of the frame's origin relative to B, in B, at the frame's origin: the columns of J_m.
  void frame_jacobian(int frame, Matrix6Xd& J) const;
  /// As frame_jacobian(), with the motion of the base at constant momentum: the generalized Jacobian J_g (2.5), in B.
  void generalized_jacobian(int frame, Matrix6Xd& J) const;

  /// Twist of the frame relative to W, in B, at the frame's origin; after move().
  Twistd frame_twist(int frame) const;
  /// Derivative of frame_twist() with respect to joint values (6 x joints) at these rates and a fixed base pose, with
  /// the base twist following (3); after move().
  void frame_twist_per_angle(int frame, Matrix6Xd& D) const;

  /// The joint that moves the link.
  int joint_of_link(int link) const { return link_joint_[static_cast<std::size_t>(link)]; }
  /// Whether joint j carries the frame.
  bool carries(int joint, int frame) const;

 private:
  // Poses and axes.
  void place_links(std::span<const double> theta, PlacedLinks& placed);
  // V_B of (4) for a momentum about B's origin.
  static Twistd twist_of(const PlacedLinks& links, const Momentumd& h);
  MotionNumbers<double> motion() { return {V_.data(), h_.data(), dh_.data()}; }

  const Model& model_;
  bool floats_, keeps_attitude_ = false;
  WorkWatch* watch_ = nullptr;
  std::vector<bool> held_;       // per joint, if any
  std::vector<int> joint_link_;  // per joint: its link in the tree
  std::vector<int> link_joint_;  // per link: its joint, -1 for the root
  std::vector<double> q_;        // coordinates
  PlacedLinks placed_;
  std::vector<Twistd> V_;      // per link
  std::vector<Momentumd> h_;   // of the subtree, per link
  std::vector<Momentumd> dh_;  // per joint
  Vector6d V_B_ = Vector6d::Zero();
  Matrix6Xd per_angle_, per_rate_;
};

/// [angular; linear] as a column.
template <SpatialKind kKind>
Vector6d column(const SpatialVector<kKind, double>& x) {
  Vector6d result;
  result << x.angular[0], x.angular[1], x.angular[2], x.linear[0], x.linear[1], x.linear[2];
  return result;
}
inline Eigen::Vector3d column(const Vector3d& v) { return {v[0], v[1], v[2]}; }
/// The same entries as an Eigen matrix.
Eigen::Matrix3d as_matrix(const Rotationd& R);
inline Twistd twist_from(const Vector6d& x) { return {{x[0], x[1], x[2]}, {x[3], x[4], x[5]}}; }

}  // namespace grapnel
