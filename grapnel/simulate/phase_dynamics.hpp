#pragma once

/// @file
/// A model under joint controllers and gravity as a differential equation, with the integrals that its books need.
///
/// State vector y = [q; v; integrals]. The integrals are the work of motors, of friction and of external forces, and
/// the external impulse. They are under error control: where joints move as prescribed, little else limits the step.
/// Joints are free, driven by PD (4.1), or move as prescribed; a root may be held by an ideal wrench. Thread safety:
/// one thread at a time (it owns a workspace).

#include <span>
#include <vector>

#include "grapnel/dynamics/forward_dynamics.hpp"
#include "grapnel/dynamics/root_velocity.hpp"
#include "grapnel/integrate/manifold.hpp"
#include "grapnel/simulate/joint_path.hpp"

namespace grapnel {

enum class JointControl { free, pd, prescribed };

/// How one joint is driven. PD: tau = kp (theta_d - theta) + kd (rate_d - rate) (4.1), cut at the joint's effort limit.
struct JointDrive {
  JointControl control = JointControl::free;
  JointPath path;  // reference; time counts from the phase's start
  double kp = 0;   // [N m/rad or N/m]
  double kd = 0;   // [N m s/rad or N s/m]
};

struct PhaseSetup {
  std::vector<JointDrive> drives;  // per entry of Model::joints(); empty: all free
  int held_root = -1;              // body index of a free root that is held at its pose; -1: none
  Vector3d gravity = Vector3d::zero();
  double start_time = 0;  // [s]
  /// Take the velocities of free roots from the momentum that initial() saw (2.3), and their positions from the uniform
  /// motion of the centre of mass, where no gravity, ground or holding wrench changes them; else they are integrated.
  bool recover_roots = true;
};

/// Integrals since the phase's start.
struct PhaseIntegrals {
  double motor_work = 0;                           // [J]; of drives, prescribed joints included
  double friction_work = 0;                        // [J]; negative
  double external_work = 0;                        // [J]; of gravity and of the wrench that holds a root
  Momentumd external_impulse = Momentumd::zero();  // gravity, holding wrench, ground; about the world's origin, in W
};

/// Sizes of a momentum's two parts.
struct MomentumDefect {
  double linear = 0;   // [N s]
  double angular = 0;  // about a tree's centre of mass [N m s]
};

class PhaseDynamics {
 public:
  /// @throws std::invalid_argument if drives do not match the model's joints or held_root is no free root.
  PhaseDynamics(const Model& model, PhaseSetup setup);

  const Model& model() const { return model_; }
  int size() const { return model_.coordinates() + model_.velocities() + kIntegrals; }
  Manifold manifold() const;
  /// y for a state at time t, with zero integrals; remembers its momenta.
  std::vector<double> initial(const State& state, double t);

  /// dy/dt.
  void operator()(double t, std::span<const double> y, std::span<double> dydt);

  /// The state in y; prescribed joints are put exactly where they are prescribed, and roots' velocities are those of
  /// the conserved momenta.
  State state(double t, std::span<const double> y);
  /// What recovering roots' velocities has mended: the largest deviation, over the trees, of the momentum that the
  /// integrated velocities in y have. Zero where they are not recovered.
  MomentumDefect momentum_mended(std::span<const double> y);
  PhaseIntegrals integrals(std::span<const double> y) const;
  /// Motor effort of every joint (per Model::joints()) at this instant, the friction beside it.
  void efforts(double t, std::span<const double> y, std::span<double> motor, std::span<double> friction);

 private:
  static constexpr int kIntegrals = 9;
  bool recovers() const { return setup_.recover_roots && !has_external_ && !momenta_.empty(); }
  void load(double t, std::span<const double> y);
  void accelerate(double t);
  void add_external(std::span<double> integrals);

  const Model& model_;
  PhaseSetup setup_;
  Workspace workspace_;
  State now_;                          // state at the evaluation
  std::vector<JointPoint> reference_;  // per joint
  std::vector<double> motor_, friction_;
  std::vector<double> force_;  // generalized forces given
  std::vector<std::uint8_t> prescribed_;
  std::vector<double> acceleration_;  // prescribed
  std::vector<double> vdot_;
  double momenta_time_ = 0;                    // when the momenta were taken
  std::vector<RootMomentum<double>> momenta_;  // per free root, as the phase began
  std::vector<RootMomentum<double>> drifted_;  // scratch of momentum_mended
  bool any_prescribed_ = false;
  bool has_external_ = false;  // gravity, a held root or a fixed one
};

}  // namespace grapnel
