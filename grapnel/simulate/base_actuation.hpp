#pragma once

/// @file
/// Actuation of the base: the torque on a free root that laws command, given from outside, by reaction wheels, control
/// moment gyros or thrusters; and thrusters that dump the wheels' momentum. PhaseDynamics obtains from it the
/// contributions to efforts, forces and prescribed rates, and the changes of its modes. Thread safety: one thread at a
/// time.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "grapnel/dynamics/forward_dynamics.hpp"
#include "grapnel/dynamics/state.hpp"
#include "grapnel/model/model.hpp"
#include "grapnel/simulate/attitude_control.hpp"
#include "grapnel/simulate/controller.hpp"
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
  /// Rate at which the wheels' rates approach `wheel_speeds` in the null space of the torque on the base, (18.7) [1/s];
  /// 0: none.
  double wheel_speed_rate = 0;
  std::vector<double> wheel_speeds = {};  // per wheel [rad/s]; empty: zero, which minimizes their momenta
  /// Control moment gyros give the torque; absent: their gimbals are at rest, or turn as a controller commands.
  std::optional<GyroSteering> steering = {};
  /// The controller commands each actuator (ActuatorCommands); no torque on the root is commanded.
  bool one_by_one = false;
};

/// The prescribed quantities of the whole model, per velocity.
struct PrescribedRates {
  std::span<double> rate;                // State::v
  std::span<std::uint8_t> prescribed;    // in the motion
  std::span<std::uint8_t> as_commanded;  // in the motion that laws command
  std::span<double> acceleration;        // of these
};

class BaseActuation {
 public:
  BaseActuation() = default;
  /// `commanded_root`: body index of the root whose torque a controller commands; -1: none. @throws
  /// std::invalid_argument if a wheel is invalid (see WheelArray).
  BaseActuation(const Model& model, const std::optional<AttitudeControl>& attitude, int commanded_root,
                std::vector<ReactionWheel> wheels, std::vector<MomentGyro> gyros, BaseActuators actuators,
                std::shared_ptr<ControlClock> clock);

  /// Body index of the actuated root; -1: none.
  int root() const { return root_; }
  /// Whether its torque is external.
  bool acts_from_outside() const {
    return root_ >= 0 && wheels_.empty() && !has_thrusters() && !actuators_.steering && !actuators_.one_by_one;
  }
  bool has_thrusters() const { return actuators_.thrusters != nullptr; }
  std::size_t thruster_count() const { return has_thrusters() ? actuators_.thrusters->size() : 0; }
  bool feeds_forward() const { return actuators_.feedforward; }
  const GyroArray& gyros() const { return gyros_; }
  /// Rates of the wheels in a state's velocities [rad/s].
  std::vector<double> wheel_rates(std::span<const double> v) const;
  /// Whether the wheel with this velocity is held at its maximum rate.
  bool holds_wheel(int velocity) const;
  /// The torque that attitude control commands in a state, in the root's axes [N m]; zero without it. `ahead`:
  /// feedforward torque, within the law's limit.
  Vector3d attitude_torque_in(const State& state, const Vector3d& ahead = Vector3d::zero()) const;

  // --- In an evaluation, in this order ---

  /// Sets the rates of held wheels as prescribed.
  void prescribe(const PrescribedRates& rates) const;
  /// Wrenches of the thrusters, one each, on the root in this pose.
  void push(double t, const Posed& X_WB, std::span<ExternalWrench> wrenches);
  /// A torque on the root's body is commanded, in its axes [N m]: converts it to motors' efforts (per Model::joints())
  /// or forces on the root (per velocity). `commands`: instead of the torque, if each actuator is commanded.
  /// `wheel_rates`: as the laws know them, empty if unknown [rad/s].
  void drive(const Vector3d& torque, const ActuatorCommands& commands, std::span<const double> wheel_rates,
             std::span<double> effort, std::span<double> force);
  /// The motors of control moment gyros: prescribed accelerations of gimbals and rotors. Call after drive(), if a
  /// torque is commanded; `commands`: of a controller for each actuator, if any.
  void turn_gyros(double t, const State& state, const ActuatorCommands& commands, const PrescribedRates& rates);
  /// See GyroArray::cut().
  bool cut_gimbals(std::span<const double> force, std::span<std::uint8_t> prescribed, std::span<double> effort) {
    return !gyros_.empty() && gyros_.cut(force, prescribed, effort);
  }
  /// Called when the forces of prescribed rates are known (per velocity, including friction per joint): computes the
  /// efforts of holding motors, and the torque given.
  void conclude(std::span<const double> force, std::span<const double> friction, std::span<double> effort);
  /// Generalized forces, per velocity, that attitude control and thrusters add in a state. The forces that hold wheels
  /// follow from the motion and are unknown to the laws. `effort`: scratch, per joint.
  void add_beside(double t, const State& state, std::span<double> effort, std::span<double> beside);

  /// The torque last commanded and the torque given, on the root's body, in its axes [N m].
  const Vector3d& asked() const { return asked_; }
  const Vector3d& given() const { return given_; }
  /// The resultant wrench of all thrusters about the root's origin, in its axes, at a time from reach() to the next
  /// edge, linear in time between them; zero without thrusters.
  Wrenchd thrust_at(double t) const;
  /// Forces of the thrusters at that time [N], and the bank; null without thrusters.
  std::span<const double> thrusts() const { return thrusts_; }
  const ThrusterBank* thrusters() const { return actuators_.thrusters.get(); }

  // --- Time ---

  /// Begins a motion segment; times that differ by less than `same` are equal [s].
  void begin(double t, double same);
  /// Advances to the time t.
  void reach(double t);
  /// The first time after t and before `end` at which an actuator switches by time alone; otherwise `end`.
  double next_edge(double t, double end) const;

  // --- Modes: wheels held at their maximum rates, thrusters that are on ---

  /// Evaluates the phase at a fixed state with the current modes: the accelerations of the whole model, valid until the
  /// next call. The velocity of a tried wheel is that at which it is held.
  using Evaluation = std::function<std::span<const double>()>;
  /// The index of the velocity of the wheel that is tried free, and its rate; empty: none.
  std::optional<std::pair<int, double>> tried_rate() const;

  /// Whether modes can change.
  bool switches() const { return wheels_.has_rate_limits() || has_thrusters(); }
  /// Positive while the modes are valid: distances from maximum rates, and accelerations that held wheels would have.
  /// `v`: of the current state.
  double margin(std::span<const double> v, const Evaluation& evaluate);
  /// Chooses the modes at the time t. `v`: of the current state.
  void choose_modes(double t, std::span<const double> v, const Evaluation& evaluate);

 private:
  void check_actuators() const;
  void choose_wheels(std::span<const double> v, const Evaluation& evaluate);
  void choose_thrusters(double t, const Evaluation& evaluate);
  bool triggers_by_state() const;
  Vector3d countered() const;
  void check_thrusts(double t);
  double driving_on(std::size_t wheel, const Evaluation& evaluate);

  std::optional<AttitudeControl> attitude_;
  int root_ = -1;
  int q_ = -1, v_ = -1;  // of the root
  mutable WheelArray wheels_;
  GyroArray gyros_;
  std::vector<std::uint8_t> stays_held_;  // per wheel: until the next choice of modes
  std::optional<std::size_t> tried_;
  BaseActuators actuators_;
  std::shared_ptr<ControlClock> clock_;
  double same_time_ = 0;
  std::vector<double> thrusts_;
  Vector3d thrust_torque_ = Vector3d::zero();  // about the bank's point
  Wrenchd thrust_ = Wrenchd::zero();           // about the root's origin, in its axes
  Vector3d asked_ = Vector3d::zero(), given_ = Vector3d::zero();
  Vector3d turned_ = Vector3d::zero();  // torque of the turning gyros
};

}  // namespace grapnel
