#pragma once

/// @file
/// How a floating base answers to its joints, and how that answer changes with joint values and rates: (2.3) with its
/// derivatives, in closed form and O(n).
///
/// Everything is expressed in the base frame B about B's origin. With V_B the base's twist, S_j the axis of joint j,
/// I^c_j the inertia of everything that joint j carries, and h_B the momentum seen from the base,
///   I_c V_B + sum_j I^c_j S_j theta_dot_j = h_B                                                   (1), which is (2.3).
/// Turning joint j by a small angle moves its subtree rigidly. The twist of a body i of it is the twist V_p of the
/// joint's parent, which stays, plus a part that turns with S_j; so with h_j the subtree's momentum
///   dh/dtheta_j = sum_i [S_j x* (I_i V_i) - I_i (S_j x V_i) + I_i S_j x (V_i - V_p)] = S_j x* h_j - I^c_j (S_j x V_p)
///                                                                                                                (2)
/// at fixed V_B and rates, and from (1), with h_B fixed,
///   dV_B/dtheta_j = -I_c^-1 dh/dtheta_j,   dV_B/dtheta_dot_j = -I_c^-1 I^c_j S_j.                                (3)
///
/// I_c is the inertia of one rigid body: with m its mass, c its centre of mass and H its inertia about it,
///   I_c^-1 [n; p] = [w; p/m - w x c],   w = H^-1 (n - c x p),                                                     (4)
/// so the base's angular velocity follows from momenta about the centre of mass alone. Seen from the centre of mass,
/// where the linear momentum vanishes, (1) and (2) become
///   H w + sum_j k_j theta_dot_j = R_WB^T L,   k_j = n - c x p of [n; p] = I^c_j S_j                               (5)
///   H dw/dtheta_j = -g_j,   g_j = n - c x p of [n; p] = dh/dtheta_j                                               (6)
/// with L the angular momentum about the centre of mass in W.
///
/// Where the axis of a joint's rotor is stated, the rotor's spin r_j theta_dot_j (19.6) adds to I^c_j S_j in (1), (3)
/// and (5), and to the momentum h of the link that carries it, with which it turns, in (2).
///
/// Where something on the base keeps its attitude, by a torque that turns with nothing else (wheels, say), linear
/// momentum is conserved and angular momentum is not: V_B is that of (4) with w = 0,
///   V_B = [0; (p_B - sum_j p_j theta_dot_j)/m],   p_j of [n_j; p_j] = I^c_j S_j                                    (7)
/// which is what (1) to (6) say of a base with an infinite moment of inertia, H^-1 = 0.

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

// Work that may take long, counted while it is done, so that somebody can follow and end it. The limit is a number of
// evaluations and no time: whether it is reached depends on the problem alone, on every machine.

/// Thrown where work reaches its limit.
struct WorkLimit : std::runtime_error {
  WorkLimit() : std::runtime_error("the limit of evaluations is reached") {}
};

class WorkWatch {
 public:
  using Look = std::function<void(long done)>;
  static constexpr long kNoLimit = std::numeric_limits<long>::max();

  WorkWatch() = default;
  /// `look` is called now and then with the evaluations so far; what it throws ends the work, as does WorkLimit from
  /// `most` evaluations on. Where somebody on the way takes such an exception for a failure of his own (optimizers
  /// do), the next evaluation throws again.
  explicit WorkWatch(long most, Look look = {}) : most_(most), look_(std::move(look)) {}

  void count(long evaluations = 1) {
    done_ += evaluations;
    if (done_ >= next_look_) look_up();
  }
  long done() const { return done_; }

 private:
  static constexpr long kBetweenLooks = 256;

  void look_up() {
    if (done_ >= most_) throw WorkLimit();
    if (look_) look_(done_);
    next_look_ = done_ + kBetweenLooks;
  }

  long most_ = kNoLimit, done_ = 0, next_look_ = 1;
  Look look_;
};

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6Xd = Eigen::Matrix<double, 6, Eigen::Dynamic>;

/// The links for one set of joint values, in B about B's origin, and what of (5) depends on them alone.
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

  /// Makes room for so many.
  void resize(int links, int joints);
  PlacedNumbers<double> numbers();
  /// To be read only.
  PlacedNumbers<double> numbers() const { return const_cast<PlacedLinks*>(this)->numbers(); }
};

/// See the file comment. Joints are counted as in Model::joints(); the model is one tree, the servicer.
class FloatingBase {
 public:
  /// `floats` false: the base is held or fixed, its twist is zero whatever the joints do.
  /// @throws std::invalid_argument unless the model is a single tree with joints of one degree of freedom.
  FloatingBase(const Model& model, bool floats);

  int joints() const { return static_cast<int>(joint_link_.size()); }
  bool floats() const { return floats_; }
  /// From now on a base that floats keeps its attitude, (7); one that does not keeps it anyway.
  void keep_attitude() { keeps_attitude_ = true; }
  bool turns() const { return floats_ && !keeps_attitude_; }
  const Model& model() const { return model_; }
  /// As the equations see it.
  ServicerTree<double> tree() const;

  /// Everything that plans places the base for each of its evaluations: `watch` counts them, and what it throws ends
  /// the planning. It must outlive the object; null: nobody watches.
  void be_watched_by(WorkWatch* watch) { watch_ = watch; }
  /// So many placements were made elsewhere (PathSegment's nodes).
  void count(int placements) const {
    if (watch_) watch_->count(placements);
  }

  /// Joints that no demand may move: generalized_jacobian() has zeros there. One entry per joint; empty: none.
  void hold(std::vector<bool> joints) { held_ = std::move(joints); }
  bool is_held(int joint) const { return !held_.empty() && held_[static_cast<std::size_t>(joint)]; }

  /// Places the links for these joint values (one per joint).
  void place(std::span<const double> theta);
  /// The links' poses alone, for frame_pose() and frame_jacobian(): a third of the work.
  void place_frames(std::span<const double> theta);
  /// The same as place() into `links`; what follows place() below does not see it.
  void place(std::span<const double> theta, PlacedLinks& links);
  /// Angular momentum about the centre of mass that these joint rates have while the base does not turn: the sum in
  /// (5).
  static Vector3d momentum_of_rates(const PlacedLinks& links, std::span<const double> rates);
  /// g_j of (6), per joint, at these joint rates and the base's angular velocity w_B (in B).
  void angular_momentum_per_angle(const PlacedLinks& links, std::span<const double> rates, const Vector3d& w_B,
                                  std::span<Vector3d> g);
  /// Base twist V_B for joint rates and momentum about B's origin in B, by (1); after place().
  void move(std::span<const double> rates, const Momentumd& h_B);
  const Vector6d& base_twist() const { return V_B_; }
  /// The same twist alone, without what follows move(): a fifth of the work.
  Vector6d twist_at(std::span<const double> rates, const Momentumd& h_B) const;
  /// The twist that momentum alone gives the base, I_c^-1 h_B; after place().
  Vector6d momentum_part(const Momentumd& h_B) const;

  /// dV_B/dtheta_j (6 x joints) by (3); after move().
  const Matrix6Xd& per_angle() const { return per_angle_; }
  /// dV_B/dtheta_dot_j; after place().
  const Matrix6Xd& per_rate() const { return per_rate_; }
  /// A of d(xi)' = A d(xi) + (what the joints add): how a small displacement xi of the base, in B, goes on; after
  /// move(). With X' = X V_B and h_B = Ad*(X) h: A = -I_c^-1 [. x* h_B] - [V_B x .].
  Eigen::Matrix<double, 6, 6> displacement_rate(const Momentumd& h_B) const;

  /// How the base's twist changes with a small displacement xi of the base alone, in B: -I_c^-1 [. x* h_B]; after
  /// place().
  Eigen::Matrix<double, 6, 6> twist_per_displacement(const Momentumd& h_B) const;

  /// What place() placed.
  const PlacedLinks& placed() const { return placed_; }
  /// Total centre of mass and mass; after place().
  Vector3d com() const { return placed_.com; }
  double mass() const { return placed_.mass; }
  /// How com() changes with a joint, the base kept still [m/rad or 1]; after place().
  Vector3d com_per_angle(int joint) const { return (1 / placed_.mass) * placed_.joint_momentum[joint].linear; }

  /// Pose of a model's frame in B; after place().
  Posed frame_pose(int frame) const;
  /// Twists per joint rate of the frame's origin relative to B, in B, at the frame's origin: the columns of J_m.
  void frame_jacobian(int frame, Matrix6Xd& J) const;
  /// The same with the base's answer at constant momentum: the generalized Jacobian J_g (2.5), in B.
  void generalized_jacobian(int frame, Matrix6Xd& J) const;

  /// Twist of the frame relative to W, in B, at the frame's origin; after move().
  Twistd frame_twist(int frame) const;
  /// How it changes with joint values (6 x joints) at these rates and at a base that stays where it is, its twist
  /// following by (3); after move().
  void frame_twist_per_angle(int frame, Matrix6Xd& D) const;

  /// The joint whose link it is.
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
