#pragma once

/// @file
/// Arrays of reaction wheels as actuators: motor torques that give a torque on the carrying body, within the motors'
/// torques and the wheels' rates. The wheels are bodies of the model with their own joints, so that the model includes
/// their momentum, energy and gyroscopic coupling. Thread safety: one thread at a time.

#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "grapnel/simulate/base_effector.hpp"
#include "grapnel/spatial/vector3.hpp"

namespace grapnel {

/// One wheel in a model.
struct ReactionWheel {
  int joint = -1;                                           // position in Model::joints()
  int velocity = -1;                                        // of its rate relative to the carrying body, in State::v
  Vector3d axis{0, 0, 1};                                   // unit, in the carrying body's frame
  double torque = std::numeric_limits<double>::infinity();  // maximum of its motor [N m]
  double rate = std::numeric_limits<double>::infinity();    // maximum, relative to the carrying body [rad/s]
  double inertia = 0;                                       // about the axis [kg m^2]; used for the momentum only
};

/// A torque tau on the carrying body, in its axes, needs motor torques u on the wheels with -A u = tau, with the
/// wheels' axes as columns of A:
///
///     u = -A^+ tau, times the largest factor up to 1 with which no motor exceeds its torque,           (1)
///
/// the minimum-norm solution; components outside the range of A are not given.
///
/// A wheel that has reached its maximum rate, and would be accelerated further, is held at that rate by its motor (mode
/// held); the others then share the torque. It becomes free again as soon as it would be slowed down if it
/// participated. A wheel that an impact has accelerated beyond its maximum rate (mode beyond) is driven by its motor
/// only to brake it, and the others give the rest. Modes change at events, at which a margin falls to zero.
class WheelArray {
 public:
  enum class Mode { free, held, beyond };

  WheelArray() = default;
  /// @throws std::invalid_argument if an axis is not a unit vector or a limit is not positive.
  explicit WheelArray(std::vector<ReactionWheel> wheels);

  bool empty() const { return wheels_.empty(); }
  const std::vector<ReactionWheel>& wheels() const { return wheels_; }
  /// Also free while it is tried.
  Mode mode(std::size_t wheel) const { return tried_ == wheel ? Mode::free : modes_[wheel]; }
  bool any_held() const;
  /// Rows of A^+ of (1) with the wheels that are free; zero for the others.
  const std::vector<Vector3d>& shares() const { return shares_; }
  /// Whether modes can change at all.
  bool has_rate_limits() const;
  /// Its rate while it is held [rad/s].
  double held_rate(std::size_t wheel) const { return signs_[wheel] * wheels_[wheel].rate; }

  /// Sets modes by the rates alone: wheels at their maximum rates are held for now. `v`: the velocities of the whole
  /// model.
  void take_modes(std::span<const double> v);
  void set_mode(std::size_t wheel, Mode mode);
  /// Treats a held wheel as free until the next call, to compute its acceleration.
  void try_free(std::optional<std::size_t> wheel) { tried_ = wheel; }

  /// (1): the commands of the motors for a torque on the carrying body [N m]; those of held wheels are unchanged.
  /// `effort` per Model::joints().
  void drive(const Vector3d& torque, std::span<double> effort);
  /// Commands a torque of each motor (per wheel) [N m], limited to its maximum; those of held wheels are unchanged, and
  /// a wheel beyond its maximum rate is only braked.
  void drive_each(std::span<const double> torques, std::span<double> effort) const;
  /// Adds to the efforts of free wheels the part of these torques (per wheel) that gives no torque on the carrying
  /// body,
  ///
  ///     (1 - A^+ A) u, times the largest factor up to 1 with which no motor exceeds its torque.          (2)
  void add_in_null_space(std::span<const double> torques, std::span<double> effort) const;
  /// Momentum of the wheels relative to the carrying body, in its axes: sum of J a rate [N m s]. `rates`: per wheel
  /// [rad/s]; none: zero.
  Vector3d momentum(std::span<const double> rates) const;
  /// The torque on the carrying body that motors' efforts give.
  Vector3d torque_of(std::span<const double> effort) const;

  /// For a wheel that is not held: positive while its mode is valid, its relative distance from its maximum rate.
  double margin(std::size_t wheel, std::span<const double> v) const;
  /// The acceleration of a wheel in the sense of its rotation at take_modes(), by the accelerations of the whole model,
  /// over its maximum rate [1/s].
  double driving_on(std::size_t wheel, std::span<const double> acceleration) const;

 private:
  void share_among_free();
  double factor(const std::vector<Vector3d>& rows, const Vector3d& torque) const;

  std::vector<ReactionWheel> wheels_;
  std::vector<Mode> modes_;
  std::vector<double> signs_;     // of the rate, for wheels that are not free
  std::vector<Vector3d> shares_;  // rows of A^+ of the free ones; zero for the others
  /// Per wheel that is not free, the same rows with it included.
  std::vector<std::vector<Vector3d>> with_it_;
  std::optional<std::size_t> tried_;
};

class ThrusterBank;

/// How wheels are commanded.
struct WheelCommands {
  bool one_by_one = false;  // a controller commands each motor
  /// Rate at which the wheels' rates approach `speeds` in the null space of the torque on the base, (18.7) [1/s]; 0:
  /// none.
  double speed_rate = 0;
  std::vector<double> speeds = {};  // per wheel [rad/s]; empty: zero
  /// Thrusters that dump the wheels' momentum, whose mean torque the wheels compensate; null: none.
  std::shared_ptr<const ThrusterBank> dumped_by = {};
};

/// Wheels as actuators of the base. Wheels at their maximum rates are held there by their motors; modes change at
/// events.
class WheelEffector final : public BaseEffector {
 public:
  /// @throws std::invalid_argument if a wheel is invalid (see WheelArray).
  WheelEffector(std::vector<ReactionWheel> wheels, WheelCommands commands);

  const WheelArray& array() const { return wheels_; }
  /// Whether the wheel with this velocity is held at its maximum rate.
  bool holds(int velocity) const;

  void check(const Model& model, int root, std::span<const std::uint8_t> is_free) const override;
  EffectorVelocities velocities() const override;
  bool drives() const override { return true; }
  void prescribe(const PrescribedRates& rates) const override;
  void drive(const BaseMoment& at, const BaseCommand& command, std::span<double> effort,
             std::span<double> force) override;
  void conclude(std::span<const double> force, std::span<const double> friction, std::span<double> effort) override;
  void add_beside(const BaseMoment& at, const Vector3d& torque, std::span<double> effort,
                  std::span<double> beside) override;
  const Vector3d& given() const override { return given_; }
  std::optional<std::pair<int, double>> tried_rate() const override;
  bool switches() const override { return wheels_.has_rate_limits(); }
  double margin(std::span<const double> v, const Evaluation& evaluate) override;
  void choose_modes(double t, std::span<const double> v, const Evaluation& evaluate) override;

 private:
  double driving_on(std::size_t wheel, const Evaluation& evaluate);
  Vector3d countered() const;

  WheelArray wheels_;
  WheelCommands commands_;
  std::vector<std::uint8_t> stays_held_;  // per wheel: until the next choice of modes
  std::optional<std::size_t> tried_;
  Vector3d given_ = Vector3d::zero();
};

/// Whether wheels with these axes can give a torque about an axis, both in the carrying body's frame: the part of the
/// unit axis outside their range.
double lacking_torque(std::span<const Vector3d> wheel_axes, const Vector3d& axis);

}  // namespace grapnel
