#pragma once

/// @file
/// Impedance control of the end-effectors of a free-floating robot, through the generalized Jacobian (21.1)-(21.6),
/// after Masutani et al. (1989) and Yoshida et al. (2004). Effective masses at a contact, and the mass that stops a
/// target (21.7)-(21.9), after Yoshida et al. (2004) and Uyama et al. (2012).

#include <optional>
#include <span>
#include <vector>

#include "grapnel/control/joint_law.hpp"
#include "grapnel/impact/compliant_impact.hpp"

namespace grapnel {

/// Reference of an end-effector: a frame D in uniform translation in W, or a frame that moves to a pose on a body along
/// a straight line in the body's frame.
struct EndEffectorReference {
  int body = -1;                         // that carries it; -1: none, uniform translation
  Posed X_D = Posed::identity();         // in W at the time `begin`; on a body: final pose in its frame
  double begin = 0;                      // [s]
  Vector3d velocity = Vector3d::zero();  // in W [m/s]
  /// On a body: offset from the final pose, in the body's frame, where `way` is 1; `way` decreases to 0.
  Vector3d offset = Vector3d::zero();  // [m]
  Vector3d turn = Vector3d::zero();    // rotation vector in the axes of X_D [rad]
  JointTrajectory way = JointTrajectory::at_rest(0);
  /// On a body: velocity of D relative to it at `begin`, in its frame [m/s], and rate of its rotation vector then, in
  /// the axes of X_D [rad/s]. Both vanish at the end of the path.
  Vector3d departure = Vector3d::zero();
  Vector3d turn_rate = Vector3d::zero();
  /// Final velocity of D relative to its pose on the body, in W [m/s], and its time.
  Vector3d arrival = Vector3d::zero();
  double arrival_time = 0;
};

/// Pose and motion of D, in W.
struct EndEffectorState {
  Posed X_WD = Posed::identity();
  Twistd V = Twistd::zero();
  BodyAcceleration A = {Vector3d::zero(), Vector3d::zero()};
};
/// `accelerations`: of all bodies; that of a body that carries D must not depend on the efforts.
EndEffectorState hand_motion(const EndEffectorReference& reference, const Kinematics& kinematics,
                             std::span<const BodyAcceleration> accelerations, double time);

/// The rate of the rotation vector `phi` that corresponds to this angular velocity.
Vector3d rotation_vector_rate(const Vector3d& phi, const Vector3d& angular_velocity);

/// One end-effector.
struct ImpedanceHand {
  int body = -1;
  Posed X_BE = Posed::identity();  // the end-effector's frame on it
  EndEffectorReference reference;
  /// Direction in W with a separate apparent mass, matched to a target.
  std::optional<Vector3d> normal = {};
  double matched_mass = 0;  // [kg]
};

struct ImpedanceLaw {
  enum class Motion { pose, position, plane };
  Motion motion = Motion::pose;
  bool transpose = false;  // use (21.6) instead of (21.2)
  bool senses = true;      // contact forces are measured
  // Along and about the axes of D:
  Vector3d mass{1, 1, 1}, damping = Vector3d::zero(), stiffness = Vector3d::zero();
  Vector3d inertia{1, 1, 1}, angular_damping = Vector3d::zero(), angular_stiffness = Vector3d::zero();
  double null_rate = 1;  // [1/s]
  std::vector<ImpedanceHand> hands;
};

/// Indices of the controlled components of a twist [angular; linear] in W.
std::vector<int> controlled_rows(ImpedanceLaw::Motion motion);

/// The law: efforts with which every end-effector satisfies M (a - a_D) + D (v - v_D) + K e = F in the controlled
/// directions, exactly for the model. The remaining joint motion is damped. No closures. Its scale is the smallest
/// share of an effort that its limit allows.
class Impedance : public JointLaw {
 public:
  Impedance(const Model& model, ImpedanceLaw law, LawScope scope);
  const ImpedanceLaw& law() const { return law_; }
  JointLawCommand at(double time, const State& state, std::span<const double> force) override;
  Eigen::VectorXd efforts(double time, const State& state) override;
  void sense(std::span<const ExternalWrench> wrenches) override;

  /// Error of end-effector `h` relative to its reference [m], [rad].
  struct Deviation {
    double distance = 0, angle = 0;
  };
  Deviation deviation(std::size_t hand, double time, const State& state);
  /// The largest error over the end-effectors.
  Deviation deviation(double time, const State& state);

 private:
  struct Rows;
  Rows rows_of(double time);
  /// Computes all of the command except the condition. `J_t`: transposed generalized Jacobian of the controlled
  /// directions, weighted.
  JointLawCommand say(double time, const State& state, std::span<const double> force, Eigen::MatrixXd& J_t);

  ImpedanceLaw law_;
  std::vector<int> rows_;
  double length_;  // characteristic length that weights rotation against translation [m]
  std::vector<ExternalWrench> sensed_;
  Kinematics kinematics_;
};

// Effective mass at a contact.

/// m_e = (n^T J M^-1 J^T n)^-1 of a point of a body. For a free-floating robot J M^-1 J^T = J* H*^-1 J*^T + J_b H_b^-1
/// J_b^T (21.7): the contributions of the joints and of the whole robot.
double effective_mass(const Model& model, const State& state, int body, const Vector3d& p_W, const Vector3d& n_W);

/// Coefficient of restitution e of a central contact of two bodies with this reduced mass, at approach velocity `speed`
/// (21.8).
double restitution_of(const CompliantContact& contact, double reduced_mass, double speed);

/// The mass m with e(m) m = `target_mass` (21.9): a body of this mass, at `speed`, stops the target. Infinite if none
/// does.
double matching_mass(const CompliantContact& contact, double target_mass, double speed);

}  // namespace grapnel
