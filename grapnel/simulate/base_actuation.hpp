#pragma once

/// @file
/// Actuation of the base: its effectors (BaseEffector), and the torque on a free root that laws command. PhaseDynamics
/// obtains from it the contributions to efforts, forces and prescribed rates, and the changes of modes. Thread safety:
/// one thread at a time.

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "grapnel/simulate/attitude_control.hpp"
#include "grapnel/simulate/base_effector.hpp"
#include "grapnel/simulate/moment_gyros.hpp"
#include "grapnel/simulate/reaction_wheels.hpp"
#include "grapnel/simulate/thruster_bank.hpp"

namespace grapnel {

/// The actuators of the base besides its wheels (PhaseSetup::wheels), and their control.
struct BaseActuators {
  /// They give the torque of attitude control, or dump the wheels' momentum; null: none. They belong to a run, like its
  /// clock.
  std::shared_ptr<ThrusterBank> thrusters = {};
  ThrusterModulation modulation = {};
  /// Dumping by pulse widths, which needs a clock. The wheels compensate the mean torque of the pulses.
  std::optional<MomentumDumping> dumping = {};
  /// Attitude control adds the reaction torque of the joints' motion (arm_reaction) for joints with a reference, within
  /// the law's limit.
  bool feedforward = false;
  /// See WheelCommands.
  double wheel_speed_rate = 0;
  std::vector<double> wheel_speeds = {};
  /// Control moment gyros give the torque; absent: their gimbals are at rest, or turn as a controller commands.
  std::optional<GyroSteering> steering = {};
  /// The controller commands each actuator (ActuatorCommands); no torque on the root is commanded.
  bool one_by_one = false;
};

/// A torque on the root from outside.
class ExternalTorque final : public BaseEffector {
 public:
  bool drives() const override { return true; }
  bool is_external() const override { return true; }
  void drive(const BaseMoment& at, const BaseCommand& command, std::span<double> effort,
             std::span<double> force) override;
  void add_beside(const BaseMoment& at, const Vector3d& torque, std::span<double> effort,
                  std::span<double> beside) override;
  const Vector3d& given() const override { return given_; }

 private:
  Vector3d given_ = Vector3d::zero();
};

class BaseActuation {
 public:
  /// Effectors besides the external torque, in the order of their evaluation. They belong to a run or a phase.
  using Effectors = std::vector<std::shared_ptr<BaseEffector>>;

  BaseActuation() = default;
  /// `commanded_root`: body index of the root whose torque a controller commands; -1: none. `others`: see
  /// PhaseSetup::effectors. @throws std::invalid_argument if an effector is invalid or the settings contradict each
  /// other.
  BaseActuation(const Model& model, const std::optional<AttitudeControl>& attitude, int commanded_root,
                const std::vector<ReactionWheel>& wheels, const std::vector<MomentGyro>& gyros,
                const BaseActuators& actuators, const std::shared_ptr<ControlClock>& clock, const Effectors& others);

  /// Body index of the actuated root; -1: none.
  int root() const { return root_; }
  const Effectors& effectors() const { return effectors_; }
  /// The effector of this kind; null: none.
  template <class Effector>
  const Effector* find() const {
    for (const auto& effector : effectors_) {
      if (const auto* found = dynamic_cast<const Effector*>(effector.get())) return found;
    }
    return nullptr;
  }
  /// See BaseEffector::check().
  void check(const Model& model, std::span<const std::uint8_t> is_free) const;
  /// Of all effectors.
  const EffectorVelocities& velocities() const { return velocities_; }
  /// Whether its torque is external.
  bool acts_from_outside() const { return driver_ && driver_->is_external(); }
  /// Number of the effectors' wrenches.
  std::size_t wrench_count() const;
  bool feeds_forward() const { return feedforward_; }
  /// Whether the wheel with this velocity is held at its maximum rate.
  bool holds_wheel(int velocity) const;
  /// Rates of the wheels in a state's velocities [rad/s].
  std::vector<double> wheel_rates(std::span<const double> v) const;
  /// The torque that attitude control commands in a state, in the root's axes [N m]; zero without it. `ahead`:
  /// feedforward torque, within the law's limit.
  Vector3d attitude_torque_in(const State& state, const Vector3d& ahead = Vector3d::zero()) const;

  // --- In an evaluation, in this order: see BaseEffector ---

  void prescribe(const PrescribedRates& rates) const;
  /// Wrenches on the root in this pose, wrench_count() of them.
  void push(double t, const Posed& X_WB, std::span<ExternalWrench> wrenches);
  /// A torque on the root's body is commanded, in its axes [N m]. `each`: instead of the torque, if each actuator is
  /// commanded. `wheel_rates`: as the laws know them, empty if unknown [rad/s].
  void drive(double t, const State& state, const BaseCommand& command, std::span<double> effort,
             std::span<double> force);
  /// Call after drive(), if a torque is commanded.
  void turn(double t, const State& state, const ActuatorCommands& each, const PrescribedRates& rates);
  bool cut(std::span<const double> force, std::span<std::uint8_t> prescribed, std::span<double> effort);
  void conclude(std::span<const double> force, std::span<const double> friction, std::span<double> effort);
  /// Generalized forces, per velocity, that attitude control and thrusters add in a state. The forces that hold wheels
  /// follow from the motion and are unknown to the laws. `effort`: scratch, per joint.
  void add_beside(double t, const State& state, std::span<double> effort, std::span<double> beside);

  /// The torque last commanded and the torque given, on the root's body, in its axes [N m].
  const Vector3d& commanded_torque() const { return commanded_torque_; }
  Vector3d given() const;
  /// The resultant wrench of all thrusters about the root's origin, in its axes, at a time from reach() to the next
  /// edge, linear in time between them; zero without thrusters.
  Wrenchd thrust_at(double t) const;
  /// Forces of the thrusters at that time [N], and the bank; null without thrusters.
  std::span<const double> thrusts() const;
  const ThrusterBank* thrusters() const;

  // --- Time ---

  /// Begins a motion segment; times that differ by less than `same` are equal [s].
  void begin(double t, double same);
  /// Advances to the time t.
  void reach(double t);
  /// The first time after t and before `end` at which an actuator switches by time alone; otherwise `end`.
  double next_edge(double t, double end) const;

  // --- Modes: wheels held at their maximum rates, thrusters that are on ---

  using Evaluation = BaseEffector::Evaluation;
  /// The index of the velocity of the wheel that is tried free, and its rate; empty: none.
  std::optional<std::pair<int, double>> tried_rate() const;
  /// Whether modes can change.
  bool switches() const;
  /// Positive while the modes are valid: distances from maximum rates, and accelerations that held wheels would have.
  /// `v`: of the current state.
  double margin(std::span<const double> v, const Evaluation& evaluate);
  /// Chooses the modes at the time t. `v`: of the current state.
  void choose_modes(double t, std::span<const double> v, const Evaluation& evaluate);

 private:
  BaseMoment moment(double t, const State& state) const { return {t, state, q_, v_}; }

  std::optional<AttitudeControl> attitude_;
  int root_ = -1;
  int q_ = -1, v_ = -1;  // of the root
  bool feedforward_ = false, one_by_one_ = false;
  Effectors effectors_;
  EffectorVelocities velocities_;
  const BaseEffector* driver_ = nullptr;  // gives the commanded torque; null: none, or each actuator is commanded
  Vector3d commanded_torque_ = Vector3d::zero();
};

}  // namespace grapnel
