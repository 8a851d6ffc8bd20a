#pragma once

/// @file
/// Reaction wheels as actuators: how a torque on the body that carries them is given by their motors, within the
/// motors' torques and the wheels' rates. The wheels themselves are bodies of the model on joints of their own, so that
/// their momentum, energy and gyroscopic coupling are the model's. Thread safety: one thread at a time.

#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "grapnel/spatial/vector3.hpp"

namespace grapnel {

/// One wheel in a model.
struct ReactionWheel {
  int joint = -1;                                           // position in Model::joints()
  int velocity = -1;                                        // of its rate relative to the carrying body, in State::v
  Vector3d axis{0, 0, 1};                                   // unit, in the carrying body's frame
  double torque = std::numeric_limits<double>::infinity();  // largest of its motor [N m]
  double rate = std::numeric_limits<double>::infinity();    // largest relative to the carrying body [rad/s]
  double inertia = 0;                                       // about the axis [kg m^2]; for their momentum alone
};

/// A torque tau on the carrying body, in its axes, takes motor torques u on the wheels with -A u = tau, where A has the
/// wheels' axes as columns:
///     u = -A^+ tau, times the largest factor up to 1 with which no motor exceeds its torque,           (1)
/// the least in the sum of squares; what lies outside the range of A is not given.
///
/// A wheel that has reached its largest rate, and would be driven beyond, is held at that rate by its motor (mode
/// held); the others then share the torque among themselves. It is free again once it would be slowed down if it shared
/// as well. A wheel that an impact has brought beyond its largest rate (mode beyond) is driven by its motor only where
/// that brakes it, and the others give the rest. Modes change at events, where a margin falls to zero.
class WheelArray {
 public:
  enum class Mode { free, held, beyond };

  WheelArray() = default;
  /// @throws std::invalid_argument if an axis is no unit vector or a limit is not positive.
  explicit WheelArray(std::vector<ReactionWheel> wheels);

  bool empty() const { return wheels_.empty(); }
  const std::vector<ReactionWheel>& wheels() const { return wheels_; }
  /// Free also while it is tried.
  Mode mode(std::size_t wheel) const { return tried_ == wheel ? Mode::free : modes_[wheel]; }
  bool any_held() const;
  /// Rows of A^+ of (1) with the wheels that are free; zero for the others.
  const std::vector<Vector3d>& shares() const { return shares_; }
  /// Whether modes can change at all.
  bool has_rate_limits() const;
  /// Its rate while it is held [rad/s].
  double held_rate(std::size_t wheel) const { return signs_[wheel] * wheels_[wheel].rate; }

  /// Modes by the rates alone: wheels at their largest rates are held for now. `v`: the velocities of the whole model.
  void take_modes(std::span<const double> v);
  void set_mode(std::size_t wheel, Mode mode);
  /// A held wheel is free until another is tried or none, to see what it would do.
  void try_free(std::optional<std::size_t> wheel) { tried_ = wheel; }

  /// (1): what the motors are told for a torque on the carrying body [N m]; those of held wheels are left as they are.
  /// `effort` per Model::joints().
  void drive(const Vector3d& torque, std::span<double> effort);
  /// Every motor is told its own torque (per wheel) [N m], cut at its largest; those of held wheels are left as they
  /// are, and a wheel beyond its largest rate is only braked.
  void drive_each(std::span<const double> torques, std::span<double> effort) const;
  /// Adds to the efforts of free wheels the part of these torques (per wheel) that gives none on the carrying body,
  ///     (1 - A^+ A) u, times the largest factor up to 1 with which no motor exceeds its torque.          (2)
  void add_in_null_space(std::span<const double> torques, std::span<double> effort) const;
  /// Momentum of the wheels relative to the carrying body, in its axes: sum of J a rate [N m s]. `rates`: per wheel
  /// [rad/s]; none: zero.
  Vector3d momentum(std::span<const double> rates) const;
  /// The torque on the carrying body that motors' efforts give.
  Vector3d torque_of(std::span<const double> effort) const;

  /// Of a wheel that is not held: positive while its mode may stay, its relative distance from its largest rate.
  double margin(std::size_t wheel, std::span<const double> v) const;
  /// How fast a wheel is driven on, in the sense in which it was turning at take_modes(), by the accelerations of the
  /// whole model, over its largest rate [1/s].
  double driving_on(std::size_t wheel, std::span<const double> acceleration) const;

 private:
  void share_among_free();
  double factor(const std::vector<Vector3d>& rows, const Vector3d& torque) const;

  std::vector<ReactionWheel> wheels_;
  std::vector<Mode> modes_;
  std::vector<double> signs_;     // of the rate, of wheels that are not free
  std::vector<Vector3d> shares_;  // rows of A^+ with the free ones; zero for the others
  /// Per wheel that is not free, the same with it among them.
  std::vector<std::vector<Vector3d>> with_it_;
  std::optional<std::size_t> tried_;
};

/// Whether wheels with these axes can give a torque about an axis, both in the carrying body's frame: how much of the
/// unit axis lies outside their range.
double lacking_torque(std::span<const Vector3d> wheel_axes, const Vector3d& axis);

}  // namespace grapnel
