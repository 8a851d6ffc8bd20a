#pragma once

/// @file
/// Impedance at the hands of a free-floating robot, through the generalized Jacobian (21.1)-(21.6), after Masutani et
/// al. (1989) and Yoshida et al. (2004); the masses that a contact meets, and the one with which it stops a target
/// (21.7)-(21.9), after Yoshida et al. (2004) and Uyama et al. (2012).

#include <optional>
#include <span>
#include <vector>

#include "grapnel/control/joint_law.hpp"
#include "grapnel/impact/compliant_impact.hpp"

namespace grapnel {

/// What a hand is to follow: a frame D that moves uniformly in W without turning, or that goes to a place on a body,
/// straight in the body's frame.
struct HandReference {
  int body = -1;                         // that carries it; -1: none, it moves uniformly
  Posed X_D = Posed::identity();         // in W at the time `begin`; on a body: in its frame, at the way's end
  double begin = 0;                      // [s]
  Vector3d velocity = Vector3d::zero();  // in W [m/s]
  /// On a body: by how much it is off its end, in the body's frame, where `way` is 1; `way` goes to 0.
  Vector3d offset = Vector3d::zero();  // [m]
  Vector3d turn = Vector3d::zero();    // rotation vector in the axes of X_D [rad]
  JointTrajectory way = JointTrajectory::at_rest(0);
  /// On a body: how D moves relative to it at `begin`, in its frame [m/s], and how its rotation vector changes then, in
  /// the axes of X_D [rad/s]. Both are gone at the way's end.
  Vector3d departure = Vector3d::zero();
  Vector3d turn_rate = Vector3d::zero();
  /// With which velocity D arrives, relative to the place, in W [m/s], and when.
  Vector3d arrival = Vector3d::zero();
  double arrival_time = 0;
};

/// Where D is, and how it moves, in W.
struct HandMotion {
  Posed X_WD = Posed::identity();
  Twistd V = Twistd::zero();
  BodyAcceleration A = {Vector3d::zero(), Vector3d::zero()};
};
/// `accelerations`: of all bodies (of a body that carries D they must not depend on the efforts).
HandMotion hand_motion(const HandReference& reference, const Kinematics& kinematics,
                       std::span<const BodyAcceleration> accelerations, double time);

/// The rate of the rotation vector `phi` at which what is turned by it has that angular velocity.
Vector3d rotation_vector_rate(const Vector3d& phi, const Vector3d& angular_velocity);

/// One hand.
struct ImpedanceHand {
  int body = -1;
  Posed X_BE = Posed::identity();  // the end-effector's frame on it
  HandReference reference;
  /// Along this direction in W the apparent mass is another one, whatever `mass` is: matched to a target.
  std::optional<Vector3d> normal = {};
  double matched_mass = 0;  // [kg]
};

struct ImpedanceLaw {
  enum class Motion { pose, position, plane };
  Motion motion = Motion::pose;
  bool transpose = false;  // (21.6) in place of (21.2)
  bool senses = true;      // forces of contact are known
  // Along and about the axes of D:
  Vector3d mass{1, 1, 1}, damping = Vector3d::zero(), stiffness = Vector3d::zero();
  Vector3d inertia{1, 1, 1}, angular_damping = Vector3d::zero(), angular_stiffness = Vector3d::zero();
  double null_rate = 1;  // [1/s]
  std::vector<ImpedanceHand> hands;
};

/// Directions that are controlled of a twist [angular; linear] in W.
std::vector<int> controlled_rows(ImpedanceLaw::Motion motion);

/// The law: efforts with which every hand moves by M (a - a_D) + D (v - v_D) + K e = F in the directions that are
/// controlled, exactly for the model; what joints move besides is damped. Without closures. Its scale is the least part
/// of an effort that a limit lets pass.
class Impedance : public JointLaw {
 public:
  Impedance(const Model& model, ImpedanceLaw law, LawScope scope);
  const ImpedanceLaw& law() const { return law_; }
  JointLawCommand at(double time, const State& state, std::span<const double> force) override;
  Eigen::VectorXd efforts(double time, const State& state) override;
  void sense(std::span<const ExternalWrench> wrenches) override;

  /// How far hand `h` is from its reference at a state [m], [rad].
  struct Deviation {
    double distance = 0, angle = 0;
  };
  Deviation deviation(std::size_t hand, double time, const State& state);
  /// The largest over the hands.
  Deviation deviation(double time, const State& state);

 private:
  struct Rows;
  Rows rows_of(double time);
  /// All but the condition. `J_t`: the controlled directions' transposed generalized Jacobian, weighted.
  JointLawCommand say(double time, const State& state, std::span<const double> force, Eigen::MatrixXd& J_t);

  ImpedanceLaw law_;
  std::vector<int> rows_;
  double length_;  // that weighs turning against translation [m]
  std::vector<ExternalWrench> sensed_;
  Kinematics kinematics_;
};

// What a contact meets.

/// m_e = (n^T J M^-1 J^T n)^-1 of a point of a body; of a free-floating robot J M^-1 J^T = J* H*^-1 J*^T + J_b H_b^-1
/// J_b^T (21.7): what joints give way, and what the whole does.
double effective_mass(const Model& model, const State& state, int body, const Vector3d& p_W, const Vector3d& n_W);

/// e of a central contact of two bodies with that reduced mass, which meet at `speed` (21.8).
double restitution_of(const CompliantContact& contact, double reduced_mass, double speed);

/// The mass m with e(m) m = `target_mass` (21.9): a body of it, at `speed`, stops the target. Infinite where none does.
double matching_mass(const CompliantContact& contact, double target_mass, double speed);

}  // namespace grapnel
