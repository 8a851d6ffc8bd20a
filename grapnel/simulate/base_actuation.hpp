#pragma once

/// @file
/// What drives the base: the torque that laws ask for on a free root, and how it is given, from outside, by reaction
/// wheels, control moment gyros or by thrusters; and thrusters that take the wheels' momentum out. PhaseDynamics asks
/// it what it adds to efforts, forces and prescribed rates, and when its modes change. Thread safety: one thread at a
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

/// What gives the torque on the base beside its wheels (PhaseSetup::wheels), and how.
struct BaseActuators {
  /// Give the torque of attitude control, or take the wheels' momentum out (dumping); null: none. They belong to a run,
  /// as its clock does.
  std::shared_ptr<ThrusterBank> thrusters = {};
  ThrusterModulation modulation = {};
  /// By pulse widths, which need a clock. The wheels counter what the pulses give on the average.
  std::optional<MomentumDumping> dumping = {};
  /// Attitude control adds the torque that the joints' motion takes (arm_reaction), as far as the joints follow
  /// something and within the law's limit.
  bool feedforward = false;
  /// At which the wheels' rates go to `wheel_speeds` as far as that gives no torque on the base, (18.7) [1/s]; 0: not.
  double wheel_speed_rate = 0;
  std::vector<double> wheel_speeds = {};  // per wheel [rad/s]; empty: zero, so that their momenta become least
  /// Control moment gyros give the torque; absent: their gimbals stand still, or turn as a controller says.
  std::optional<GyroSteering> steering = {};
  /// Each actuator is told its own (ActuatorCommands), by the controller; no torque on the root is asked for.
  bool one_by_one = false;
};

/// Which numbers of the whole model are prescribed, per velocity.
struct PrescribedRates {
  std::span<double> rate;                // State::v
  std::span<std::uint8_t> prescribed;    // in the motion
  std::span<std::uint8_t> as_commanded;  // in the motion that laws ask for
  std::span<double> acceleration;        // of these
};

class BaseActuation {
 public:
  BaseActuation() = default;
  /// `commanded_root`: body index of the root on which a controller says the torque; -1: none. @throws
  /// std::invalid_argument if a wheel is faulty (see WheelArray).
  BaseActuation(const Model& model, const std::optional<AttitudeControl>& attitude, int commanded_root,
                std::vector<ReactionWheel> wheels, std::vector<MomentGyro> gyros, BaseActuators actuators,
                std::shared_ptr<ControlClock> clock);

  /// Body index of the root that is driven; -1: none.
  int root() const { return root_; }
  /// Whether its torque comes from outside, as such.
  bool acts_from_outside() const {
    return root_ >= 0 && wheels_.empty() && !has_thrusters() && !actuators_.steering && !actuators_.one_by_one;
  }
  bool has_thrusters() const { return actuators_.thrusters != nullptr; }
  std::size_t thruster_count() const { return has_thrusters() ? actuators_.thrusters->size() : 0; }
  bool feeds_forward() const { return actuators_.feedforward; }
  const GyroArray& gyros() const { return gyros_; }
  /// Rates of the wheels in a state's velocities [rad/s].
  std::vector<double> wheel_rates(std::span<const double> v) const;
  /// Whether the wheel with this velocity is held at its largest rate.
  bool holds_wheel(int velocity) const;
  /// What attitude control asks for in a state; zero without it [N m], in the root's axes. `ahead`: what is fed
  /// forward, within the law's limit.
  Vector3d attitude_torque_in(const State& state, const Vector3d& ahead = Vector3d::zero()) const;

  // --- In an evaluation, in this order ---

  /// Rates of what is held, as they are prescribed.
  void prescribe(const PrescribedRates& rates) const;
  /// Wrenches of the thrusters, one each, on the root in this pose.
  void push(double t, const Posed& X_WB, std::span<ExternalWrench> wrenches);
  /// A torque is asked for, on the root's body, in its axes [N m]: motors' efforts (per Model::joints()) or forces on
  /// the root (per velocity). `commands`: in its place, where actuators are told one by
  /// one. `wheel_rates`: as the laws know them, empty if they do not yet [rad/s].
  void drive(const Vector3d& torque, const ActuatorCommands& commands, std::span<const double> wheel_rates,
             std::span<double> effort, std::span<double> force);
  /// What motors of control moment gyros do: accelerations of gimbals and rotors, prescribed. After drive(), where a
  /// torque is asked for; `commands`: what a controller says to each actuator, where it does.
  void turn_gyros(double t, const State& state, const ActuatorCommands& commands, const PrescribedRates& rates);
  /// See GyroArray::cut().
  bool cut_gimbals(std::span<const double> force, std::span<std::uint8_t> prescribed, std::span<double> effort) {
    return !gyros_.empty() && gyros_.cut(force, prescribed, effort);
  }
  /// The forces that prescribed rates take are known (per velocity, friction per joint among them): efforts of motors
  /// that hold, and what has been given of the torque.
  void conclude(std::span<const double> force, std::span<const double> friction, std::span<double> effort);
  /// Generalized forces, per velocity, that attitude control and thrusters add in a state; what holds wheels follows
  /// from the motion, and no law knows it. `effort`: scratch, per joint.
  void add_beside(double t, const State& state, std::span<double> effort, std::span<double> beside);

  /// What was asked for last, and what was given of it, on the root's body, in its axes [N m].
  const Vector3d& asked() const { return asked_; }
  const Vector3d& given() const { return given_; }
  /// All thrusters' wrench about the root's origin, in its axes, at a time from reach() to the next edge, between which
  /// it is linear in time; zero without any.
  Wrenchd thrust_at(double t) const;
  /// Forces of the thrusters then [N], and the bank; null without any.
  std::span<const double> thrusts() const { return thrusts_; }
  const ThrusterBank* thrusters() const { return actuators_.thrusters.get(); }

  // --- Time ---

  /// A piece of motion begins; times nearer than `same` are one [s].
  void begin(double t, double same);
  /// It has come to the time t.
  void reach(double t);
  /// When, after t and before `end`, something is to switch by the time alone; else `end`.
  double next_edge(double t, double end) const;

  // --- Modes: which wheels are held at their largest rates, which thrusters are on ---

  /// Evaluates the phase at one and the same state with the modes as they are: the accelerations of the whole model,
  /// valid until the next call. The velocity of a wheel that is tried is the one at which it is held.
  using Evaluation = std::function<std::span<const double>()>;
  /// Where the wheel that is tried free is among velocities, and its rate; empty: none is tried.
  std::optional<std::pair<int, double>> tried_rate() const;

  /// Whether modes can change.
  bool switches() const { return wheels_.has_rate_limits() || has_thrusters(); }
  /// Positive while the modes may stay: distances from largest rates, and how fast held wheels would go on. `v`: of the
  /// state at hand.
  double margin(std::span<const double> v, const Evaluation& evaluate);
  /// Modes from now on, at the time t. `v`: of the state at hand.
  void choose_modes(double t, std::span<const double> v, const Evaluation& evaluate);

 private:
  void check_actuators() const;
  void choose_wheels(std::span<const double> v, const Evaluation& evaluate);
  void choose_thrusters(double t, const Evaluation& evaluate);
  bool triggers_by_state() const;
  Vector3d countered() const;
  void look_at_thrusts(double t);
  double driving_on(std::size_t wheel, const Evaluation& evaluate);

  std::optional<AttitudeControl> attitude_;
  int root_ = -1;
  int q_ = -1, v_ = -1;  // of the root
  mutable WheelArray wheels_;
  GyroArray gyros_;
  std::vector<std::uint8_t> stays_held_;  // per wheel: until modes are chosen again
  std::optional<std::size_t> tried_;
  BaseActuators actuators_;
  std::shared_ptr<ControlClock> clock_;
  double same_time_ = 0;
  std::vector<double> thrusts_;
  Vector3d thrust_torque_ = Vector3d::zero();  // about the bank's point, as it is
  Wrenchd thrust_ = Wrenchd::zero();           // about the root's origin, in its axes
  Vector3d asked_ = Vector3d::zero(), given_ = Vector3d::zero();
  Vector3d turned_ = Vector3d::zero();  // torque of the gyros, as they turn
};

}  // namespace grapnel
