#pragma once

/// @file
/// Minimum-propellant on-times of thrusters for a torque. Thread safety: pure functions and an immutable object.

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "grapnel/spatial/vector3.hpp"

namespace grapnel {

/// A thruster on a body. It pushes the body along its direction.
struct Thruster {
  Vector3d position = Vector3d::zero();      // point of its force, in the body's frame [m]
  Vector3d direction{1, 0, 0};               // unit, of its force, in the body's frame, as known to the controller
  Vector3d misalignment = Vector3d::zero();  // rotation vector from it to the true direction [rad]
  double force = 0;                          // [N]
  double specific_impulse = 0;               // of its propellant [s]
  double min_on_time = 0;                    // [s]
  double rise = 0, fall = 0;                 // of its force, from zero to full and back, linear [s]
};
/// Standard gravity, which relates specific impulses in seconds to exhaust velocities [m/s^2].
inline constexpr double kStandardGravity = 9.80665;
/// The true direction of thrust, in the body's frame.
Vector3d thrust_direction(const Thruster& thruster);
/// Propellant at full force, F / (I_sp g_0) [kg/s].
double mass_flow(const Thruster& thruster);

/// min c x under A x = b, x >= 0, by the two-phase simplex method with Bland's rule, which ensures termination;
/// redundant rows of A are dropped. Of equally cheap solutions the choice is deterministic. Empty: no x satisfies the
/// equations (to 1e-9 of b). [Bland 1977] @throws std::invalid_argument if sizes do not match or a cost is negative.
std::optional<Eigen::VectorXd> least_cost(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, const Eigen::VectorXd& c);

/// On-times t >= 0 with minimum propellant with which thrusters give an impulse of torque, (18.2):
///
///     min sum m_i t_i,    sum (r_i - p) x F_i t_i = torque impulse,    and sum F_i t_i = 0,
///
/// the last if the array, without a net force, can give torques about all axes that it can give with one. Directions
/// are those known to the controller.
class ThrusterAllocation {
 public:
  ThrusterAllocation() = default;
  /// `about`: the point p of the torques, in the body's frame.
  ThrusterAllocation(std::span<const Thruster> thrusters, const Vector3d& about);

  /// Whether on-times give no net force.
  bool is_pure() const { return A_.rows() == 6; }
  /// For an impulse of torque in the body's axes [N m s], or on-times per second for a torque. Empty: infeasible.
  std::optional<std::vector<double>> on_times(const Vector3d& torque) const;
  /// Whether a torque along this direction can be given.
  bool can_give(const Vector3d& direction) const { return on_times(direction).has_value(); }
  /// Torque about p of a thruster at full force, as known to the controller [N m].
  Vector3d torque(std::size_t thruster) const;

 private:
  Eigen::MatrixXd A_;  // torque rows, then force rows if is_pure()
  Eigen::VectorXd cost_;
};

}  // namespace grapnel
