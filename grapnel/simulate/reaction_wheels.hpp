#pragma once

/// @file
/// Reaction wheels as actuators: how a torque on the body that carries them is given by their motors, within the
/// motors' torques and the wheels' rates. The wheels themselves are bodies of the model on joints of their own, so that
/// their momentum, energy and gyroscopic coupling are the model's. Thread safety: one thread at a time.

#include <limits>
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
};

/// A torque tau on the carrying body, in its axes, takes motor torques u on the wheels with -A u = tau, where A has the
/// wheels' axes as columns:
///     u = -A^+ tau, times the largest factor up to 1 with which no motor exceeds its torque,           (1)
/// the least in the sum of squares; what lies outside the range of A is not given.
///
/// A wheel that has reached its largest rate, and whose motor is asked to drive it on, is held at that rate by its
/// motor (mode held); the others then share the torque among themselves. It is free again once (1), with it among those
/// that share, asks for less than holding it takes. A wheel that an impact has brought beyond its largest rate (mode
/// beyond) is driven by its motor only where that brakes it. Modes change at events: margin() falls to zero where one
/// has to.
class WheelArray {
 public:
  enum class Mode { free, held, beyond };

  WheelArray() = default;
  /// @throws std::invalid_argument if an axis is no unit vector or a limit is not positive.
  explicit WheelArray(std::vector<ReactionWheel> wheels);

  bool empty() const { return wheels_.empty(); }
  const std::vector<ReactionWheel>& wheels() const { return wheels_; }
  Mode mode(std::size_t wheel) const { return modes_[wheel]; }
  bool any_held() const;
  /// Whether modes can change at all.
  bool has_rate_limits() const;
  /// Its rate while it is held [rad/s].
  double held_rate(std::size_t wheel) const { return signs_[wheel] * wheels_[wheel].rate; }

  /// Modes by the rates alone: wheels at their largest rates are held for now. `v`: the velocities of the whole model.
  void take_modes(std::span<const double> v);
  /// After take_modes() and an evaluation with these modes: frees one wheel that is held and asked for less than what
  /// holds it, `holding` per Model::joints() [N m], or holds one that is free and driven on, by `acceleration` of the
  /// whole model [rad/s^2]. Whether it did: then another evaluation is due.
  bool settle_one(std::span<const double> holding, std::span<const double> acceleration);

  /// (1): what the motors are told for a torque on the carrying body [N m]; those of held wheels are left as they are.
  /// `effort` per Model::joints().
  void drive(const Vector3d& torque, std::span<double> effort);
  /// The torque on the carrying body that motors' efforts give.
  Vector3d torque_of(std::span<const double> effort) const;

  /// Positive while all modes may stay as they are: relative distances from the largest rates, and for held wheels what
  /// is asked beyond what holds them, `holding` per Model::joints(), over the motor's torque.
  double margin(std::span<const double> v, std::span<const double> holding) const;

 private:
  void share_among_free();
  double factor(const std::vector<Vector3d>& rows, const Vector3d& torque) const;

  std::vector<ReactionWheel> wheels_;
  std::vector<Mode> modes_;
  std::vector<double> signs_;     // of the rate, of wheels that are not free
  std::vector<bool> at_limit_;    // at the last take_modes(),
  std::vector<bool> settled_;     // and since then held for good
  std::vector<Vector3d> shares_;  // rows of A^+ with the free ones; zero for the others
  /// Per wheel that is not free, the same with it among them.
  std::vector<std::vector<Vector3d>> with_it_;
  std::vector<double> asked_;  // by (1) if it were free, at the last drive() [N m]
};

/// Whether wheels with these axes can give a torque about an axis, both in the carrying body's frame: how much of the
/// unit axis lies outside their range.
double lacking_torque(std::span<const Vector3d> wheel_axes, const Vector3d& axis);

}  // namespace grapnel
