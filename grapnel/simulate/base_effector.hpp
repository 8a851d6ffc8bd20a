#pragma once

/// @file
/// One kind of actuators of the base, as PhaseDynamics and its users see it: bodies, contribution to the motion,
/// events, impact behaviour, external impulse and signals. Wheels are WheelEffector (reaction_wheels.hpp), control
/// moment gyros GyroEffector (moment_gyros.hpp), thrusters ThrusterEffector (thruster_bank.hpp), an external torque
/// ExternalTorque (base_actuation.hpp). Other kinds are in PhaseSetup::effectors. Thread safety: one thread at a time.

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "grapnel/dynamics/forward_dynamics.hpp"
#include "grapnel/dynamics/state.hpp"
#include "grapnel/model/model.hpp"
#include "grapnel/simulate/controller.hpp"

namespace grapnel {

/// The prescribed quantities of the whole model, per velocity.
struct PrescribedRates {
  std::span<double> rate;                // State::v
  std::span<std::uint8_t> prescribed;    // in the motion
  std::span<std::uint8_t> as_commanded;  // in the motion that laws command
  std::span<double> acceleration;        // of these
};

/// The base in an evaluation.
struct BaseMoment {
  double time;
  const State& state;
  int q, v;  // of the actuated root, in State; -1: no root is actuated

  /// Attitude (quaternion of any norm) and angular velocity in the root's axes [rad/s]; only with an actuated root.
  Quaterniond attitude() const { return {state.q[q + 3], state.q[q + 4], state.q[q + 5], state.q[q + 6]}; }
  Rotationd R_WB() const;
  Vector3d rate() const { return {state.v[v], state.v[v + 1], state.v[v + 2]}; }
};

/// The commands of the laws for the base.
struct BaseCommand {
  Vector3d torque;                      // on the root's body, in its axes; zero if each actuator is commanded [N m]
  const ActuatorCommands& each;         // empty if a torque is commanded
  std::span<const double> wheel_rates;  // as the laws know them; empty: unknown [rad/s]
};

/// Velocities of an effector's own bodies: indices in State::v.
struct EffectorVelocities {
  std::vector<int> all;              // no law drives them
  std::vector<int> rate_controlled;  // prescribed by motors; these give no impulses
  std::vector<int> fast;             // may exceed kRunaway
};

/// A signal of an effector's units in results: a time series and, with limits, the largest value and the saturation.
struct ActuatorSignal {
  std::string path, unit, text;  // of the time series
  std::vector<std::string> components;
  std::vector<double> limits;  // per component: maximum magnitude; empty: none
};

class BaseEffector {
 public:
  BaseEffector() = default;
  BaseEffector(const BaseEffector&) = delete;
  BaseEffector& operator=(const BaseEffector&) = delete;
  virtual ~BaseEffector() = default;

  // --- Structure ---

  /// `is_free`: per Model::joints(), whether no other law drives the joint. @throws std::invalid_argument if the
  /// effector does not match the model.
  virtual void check(const Model& model, int root, std::span<const std::uint8_t> is_free) const;
  virtual EffectorVelocities velocities() const { return {}; }
  /// Whether it gives the commanded torque; of several, the last one does.
  virtual bool drives() const = 0;
  /// Whether given() is an external torque: its impulse and work enter the conservation checks.
  virtual bool is_external() const { return false; }
  /// Number of its wrenches on the root, for push().
  virtual std::size_t wrench_count() const { return 0; }
  /// Why SIMD lanes cannot integrate a phase with it; empty: they can.
  virtual std::string lane_obstacle() const { return {}; }

  // --- In an evaluation, in this order ---

  /// Writes prescribed rates of its bodies.
  virtual void prescribe(const PrescribedRates& rates) const;
  /// Writes wrench_count() wrenches on the root in this pose.
  virtual void push(double t, int root, const Posed& X_WB, std::span<ExternalWrench> wrenches);
  /// Converts the command to efforts of its motors (per Model::joints()) or forces (per velocity). Not called without
  /// an actuated root.
  virtual void drive(const BaseMoment& at, const BaseCommand& command, std::span<double> effort,
                     std::span<double> force) = 0;
  /// Writes the accelerations that its motors prescribe. `torque`: last commanded [N m].
  virtual void turn(const BaseMoment& at, const Vector3d& torque, const ActuatorCommands& each,
                    const PrescribedRates& rates);
  /// See GyroArray::cut().
  virtual bool cut(std::span<const double> force, std::span<std::uint8_t> prescribed, std::span<double> effort);
  /// Called when the forces of prescribed rates are known (per velocity; friction per joint): efforts of its motors.
  virtual void conclude(std::span<const double> force, std::span<const double> friction, std::span<double> effort);
  /// Adds the generalized forces, per velocity, that it gives for a torque of attitude control, as laws know them.
  /// `effort`: scratch, per joint.
  virtual void add_beside(const BaseMoment& at, const Vector3d& torque, std::span<double> effort,
                          std::span<double> beside);

  /// The torque on the root's body in the last evaluation, in its axes [N m].
  virtual const Vector3d& given() const = 0;
  /// The first part of its signals' paths; empty: it has none.
  virtual std::string_view name() const { return {}; }
  /// Values of all components of its signals in the last evaluation, in the order of their description.
  virtual std::span<const double> signals() const { return {}; }

  // --- Time: see BaseActuation ---

  virtual void begin(double t, double same);
  virtual void reach(double t);
  virtual double next_edge(double t, double end) const;

  // --- Modes ---

  /// Evaluates the phase at a fixed state with the current modes: the accelerations of the whole model, valid until the
  /// next call. The velocity of a tried effector is that at which it is held.
  using Evaluation = std::function<std::span<const double>()>;
  virtual std::optional<std::pair<int, double>> tried_rate() const { return {}; }
  virtual bool switches() const { return false; }
  virtual double margin(std::span<const double> v, const Evaluation& evaluate);
  virtual void choose_modes(double t, std::span<const double> v, const Evaluation& evaluate);
};

}  // namespace grapnel
