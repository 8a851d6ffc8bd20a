#pragma once

/// @file
/// The differential equations of a compliant impact (docs/theory.md, section 12).

#include <limits>

#include "grapnel/dynamics/forward_dynamics.hpp"
#include "grapnel/dynamics/kinematics.hpp"
#include "grapnel/dynamics/root_velocity.hpp"
#include "grapnel/impact/compliant_impact.hpp"

namespace grapnel {

// Normal force of a compliant contact over its deformation.

struct NormalForce {
  double elastic = 0;  // of the spring alone [N]
  double total = 0;    // with the damper, signed: where it is negative the surfaces do not touch [N]
  double energy = 0;   // of the spring [J]
};

/// (12.4)-(12.6). `deformation` d [m], zero force for d <= 0 (but for kelvin_voigt's damper, which knows no d);
/// `rate` d' [m/s].
NormalForce normal_force(const CompliantContact& contact, double deformation, double rate);

/// Largest deformation of a lossless central impact at `speed` between bodies that the spring feels as `mass`, (12.15).
double largest_deformation(const CompliantContact& contact, double mass, double speed);

// How far bodies have moved since an instant, without cancellation: a deformation of micrometres is the difference of
// two displacements, not of two positions of several metres.

/// The motion x -> x + (turn - 1)(x - o) + move of all points of a body in W, o a reference point common to all bodies.
struct Displacement {
  Quaterniond turn = Quaterniond::identity();  // in W, unit; its vector part keeps its digits near zero
  Vector3d move = Vector3d::zero();            // of the point at o
};

/// (turn - 1) x without cancellation for small turns.
inline Vector3d turned_by(const Quaterniond& turn, const Vector3d& x) {
  const Vector3d v{turn.x, turn.y, turn.z};
  const Vector3d t = 2.0 * cross(v, x);
  return turn.w * t + cross(v, t);
}

/// What displacements need of the beginning.
class StartPose {
 public:
  /// `origin_W`: the reference point o. `by_com` says per free root (index: body) whether its translation is given by
  /// the centre of mass of its tree.
  StartPose(const Model& model, const State& state, const Vector3d& origin_W, std::vector<std::uint8_t> by_com);

  /// `change`: per coordinate, in the layout of State::q, how it differs from the start: for joints the difference; for
  /// quaternions those of conj(start) o now from (1, 0, 0, 0); for a free root the displacement in W of its tree's
  /// centre of mass, or of its origin where it is not by_com. (12.2)
  void displacements(std::span<const double> change, std::span<Displacement> of_bodies) const;

  const Vector3d& origin() const { return origin_W_; }

 private:
  struct Start {
    JointType type;
    int parent, root, q;
    Vector3d axis;  // of the joint, in W
    Vector3d arm;   // from o to the body's origin, in W
    Vector3d com;   // from o to the centre of mass, in W
    Rotationd R_WB;
    double share;  // mass over that of its tree
  };
  Displacement own_motion(const Start& start, std::span<const double> change) const;

  std::vector<Start> bodies_;
  std::vector<std::uint8_t> by_com_;
  Vector3d origin_W_;
};

/// apart: no deformation. pressing: the force law holds. relaxing: the surface is dented, nothing touches it.
enum class ContactPhase { apart, pressing, relaxing };

/// What one contact or grasp does at an instant, in W, on the robot's body at `point`.
struct InterfaceLoad {
  Vector3d point = Vector3d::zero();  // on the robot's body: action and reaction are taken here
  Wrenchd F = Wrenchd::zero();        // about `point`
  Twistd u = Twistd::zero();          // of the robot's body against the target's, at `point`
  double deformation = 0;             // [m]
  double rate = 0;                    // of it, for contacts [m/s]
  double signed_force = 0;            // what the law of a contact would give if it could pull [N]
  double angle = 0;                   // of a grasp's rotational spring [rad]
  double energy = 0;                  // of springs [J]
  double loss = 0;                    // power of dampers and friction, >= 0 [W]
};

/// Integrated numbers y: how coordinates differ from the start (StartPose), of free uniform motion for trees moved by
/// their centres of mass; how the velocities differ that are neither held nor follow from momentum; per interface
/// (contacts, then grasps) the impulse about its point at the start; per interface the energy lost; per held velocity
/// its impulse; the work of held velocities; with a drive its work; with springs at joints (JointDescription::spring)
/// the energy that their dampers have taken. All zero at the start.
class CompliantSystem {
 public:
  CompliantSystem(const Model& model, const State& state, std::span<const CompliantContact> contacts,
                  std::span<const CompliantGrasp> grasps, std::span<const int> held, ImpactDrive* drive = nullptr);

  int size() const { return spring_offset() + (springs_.empty() ? 0 : 1); }
  int interfaces() const { return contact_count() + grasp_count(); }
  int contact_count() const { return static_cast<int>(contacts_.size()); }
  int grasp_count() const { return static_cast<int>(grasps_.size()); }

  /// Offsets in y.
  int rate_offset() const { return rate_at_; }
  int impulse_offset(int interface) const { return impulse_at_ + 6 * interface; }
  int loss_offset(int interface) const { return loss_at_ + interface; }
  int held_offset(int held) const { return held_at_ + held; }
  int work_offset() const { return work_at_; }
  int drive_offset() const { return work_at_ + 1; }                  // of the drive's work, with one
  int spring_offset() const { return work_at_ + (drive_ ? 2 : 1); }  // of what dampers at sprung joints have taken
  /// Velocities (indices into State::v) that y holds, in order.
  std::span<const int> integrated_rates() const { return rates_; }
  bool is_held(int velocity) const { return prescribed_[velocity] != 0; }

  /// Takes the state out of y and evaluates all interfaces; now() and loads() then have them.
  void load(double t, std::span<const double> y);
  const State& now() const { return now_; }
  std::span<const InterfaceLoad> loads() const { return loads_; }
  /// What contacts and grasps do to both their bodies.
  std::span<const ExternalWrench> wrenches_now();
  double kinetic_energy_now() const;
  /// Of the trees that an interface or a held velocity acts on [J].
  double kinetic_energy_taking_part_now() const;
  /// Of the springs at their joints [J].
  double spring_energy_now() const;
  bool has_springs() const { return !springs_.empty(); }
  /// Rates of all velocities under the present loads, per State::v; held ones zero.
  const std::vector<double>& accelerations_now();
  /// A grasp's relative twist in the axes that its target had at the start.
  Twistd in_target_axes(int grasp) const;

  /// Right-hand side. Never throws.
  void rates(double t, std::span<const double> y, std::span<double> dydt);

  /// Two event functions per contact, whose meaning depends on its phase, and their directions of interest (-1, 1).
  int events() const { return 2 * contact_count(); }
  void event_values(double t, std::span<const double> y, std::span<double> g);
  void event_directions(std::span<int> directions) const;
  /// What a contact does after event function `which` (0 or 1) has crossed zero; load() must be current.
  ContactPhase phase_after(int contact, int which) const;

  std::vector<ContactPhase> phase;  // per contact; the caller's to change, between steps

 private:
  void recover_roots_at(double t, std::span<const double> y);
  bool takes_part(int body) const;
  void load_contact(std::size_t index);
  void load_grasp(std::size_t index);
  Vector3d apart_by(int robot_body, int target_body, const Vector3d& arm) const;
  Twistd relative_twist(int robot_body, int target_body, const Vector3d& point) const;
  int body_of(int interface, bool robot) const;
  void coordinate_changes(std::span<const double> y, std::span<double> dydt) const;

  const Model& model_;
  std::vector<CompliantContact> contacts_;
  std::vector<CompliantGrasp> grasps_;
  std::vector<int> held_;
  std::vector<int> springs_;      // bodies on joints with springs
  std::vector<int> taking_part_;  // roots of the trees that an interface or a held velocity acts on
  State start_, now_;
  std::vector<std::uint8_t> prescribed_, by_momentum_;
  std::vector<int> rates_;
  int rate_at_, impulse_at_, loss_at_, held_at_, work_at_;

  // Of all free trees, in the order of their links.
  struct FreeTree {
    int body;
    int link_q, link_v;
    Momentumd h;   // about its centre of mass, at the start
    Vector3d com;  // in W, at the start
    double mass;
  };
  std::vector<FreeTree> trees_;
  Vector3d drift_ = Vector3d::zero();  // velocity common to all, which displacements leave out
  StartPose pose_;
  std::vector<double> change_;  // coordinates against the start, as `pose_` wants them
  std::vector<Displacement> displacement_;
  std::vector<RootMomentum<double>> momenta_;
  std::vector<Vector3d> point_;  // per interface, at the start
  double elapsed_ = 0;

  Workspace workspace_;
  std::vector<InterfaceLoad> loads_;
  std::vector<ExternalWrench> wrenches_;
  std::vector<double> zero_, vdot_, qdot_, effort_, force_;  // effort_: of the drive
  ImpactDrive* drive_;
};

}  // namespace grapnel
