#pragma once

/// @file
/// What drives the base: the torque that laws ask for on a free root, and how it is given, from outside or by reaction
/// wheels. PhaseDynamics asks it what it adds to efforts, forces and prescribed rates, and when its modes change.
/// Thread safety: one thread at a time.

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "grapnel/dynamics/state.hpp"
#include "grapnel/model/model.hpp"
#include "grapnel/simulate/attitude_control.hpp"
#include "grapnel/simulate/reaction_wheels.hpp"

namespace grapnel {

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
                std::vector<ReactionWheel> wheels);

  /// Body index of the root that is driven; -1: none.
  int root() const { return root_; }
  /// Whether its torque comes from outside.
  bool acts_from_outside() const { return root_ >= 0 && wheels_.empty(); }
  /// What attitude control asks for in a state; zero without it [N m], in the root's axes.
  Vector3d attitude_torque_in(const State& state) const;

  // --- In an evaluation, in this order ---

  /// Rates of what is held, as they are prescribed.
  void prescribe(const PrescribedRates& rates) const;
  /// A torque is asked for, on the root's body, in its axes [N m]: motors' efforts (per Model::joints()) or forces on
  /// the root (per velocity).
  void drive(const Vector3d& torque, std::span<double> effort, std::span<double> force);
  /// The forces that prescribed rates take are known (per velocity, friction per joint among them): efforts of motors
  /// that hold, and what has been given of the torque.
  void conclude(std::span<const double> force, std::span<const double> friction, std::span<double> effort);
  /// Generalized forces, per velocity, that attitude control adds in a state; what holds wheels at their rates follows
  /// from the motion, and no law knows it. `effort`: scratch, per joint.
  void add_beside(const State& state, std::span<double> effort, std::span<double> beside) const;

  /// What was asked for last, and what was given of it, on the root's body, in its axes [N m].
  const Vector3d& asked() const { return asked_; }
  const Vector3d& given() const { return given_; }

  // --- Modes: which wheels are held at their largest rates ---

  /// Evaluates the phase at one and the same state with the modes as they are: the accelerations of the whole model,
  /// valid until the next call. The velocity of a wheel that is tried is the one at which it is held.
  using Evaluation = std::function<std::span<const double>()>;
  /// Where the wheel that is tried free is among velocities, and its rate; empty: none is tried.
  std::optional<std::pair<int, double>> tried_rate() const;

  /// Whether modes can change.
  bool switches() const { return wheels_.has_rate_limits(); }
  /// Positive while the modes may stay: distances from largest rates, and how fast held wheels would go on. `v`: of the
  /// state at hand.
  double margin(std::span<const double> v, const Evaluation& evaluate);
  /// Modes from now on. `v`: of the state at hand.
  void choose_modes(std::span<const double> v, const Evaluation& evaluate);

 private:
  double driving_on(std::size_t wheel, const Evaluation& evaluate);

  std::optional<AttitudeControl> attitude_;
  int root_ = -1;
  int q_ = -1, v_ = -1;  // of the root
  mutable WheelArray wheels_;
  std::vector<std::uint8_t> stays_held_;  // per wheel: until modes are chosen again
  std::optional<std::size_t> tried_;
  Vector3d asked_ = Vector3d::zero(), given_ = Vector3d::zero();
};

}  // namespace grapnel
