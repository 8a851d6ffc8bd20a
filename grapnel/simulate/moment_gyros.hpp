#pragma once

/// @file
/// Control moment gyros with one gimbal each as actuators: how a torque on the body that carries them is given by
/// turning their gimbals, and what the motors of gimbals and rotors do. Gimbals and rotors are bodies of the model on
/// joints of their own, so that their momentum, energy and gyroscopic coupling are the model's. Thread safety: one
/// thread at a time.

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "grapnel/spatial/vector3.hpp"

namespace grapnel {

/// One gyro in a model. Both motors keep rates, (17.6): the rotor's its spin rate in the gimbal, the gimbal's the one
/// that is commanded, with the accelerations
///     bandwidth (rate wanted - rate),
/// and with the torque that this takes: the rotor's whatever it is, the gimbal's up to its largest, beyond which the
/// gimbal turns as the largest lets it.
struct MomentGyro {
  int gimbal = -1, rotor = -1;                              // positions in Model::joints()
  int gimbal_coordinate = -1;                               // of its angle, in State::q
  int gimbal_velocity = -1;                                 // of its rate relative to the carrying body, in State::v
  int rotor_velocity = -1;                                  // relative to the gimbal
  Vector3d gimbal_axis{0, 0, 1};                            // unit, in the carrying body's frame
  Vector3d spin_axis{1, 0, 0};                              // unit, perpendicular to it; there, at gimbal angle zero
  double inertia = 0;                                       // of the rotor, about its axis [kg m^2]
  double spin_rate = 0;                                     // [rad/s]
  double torque = std::numeric_limits<double>::infinity();  // largest of the gimbal's motor [N m]
  double rate = std::numeric_limits<double>::infinity();    // largest that is commanded to the gimbal [rad/s]
  double bandwidth = 20;                                    // [1/s]
  double momentum() const { return inertia * spin_rate; }   // [N m s]
};

/// How gimbal rates are found for a torque, near singular configurations. The measure of singularity is
/// m = sqrt(det(A A^T)), A with the momenta's derivatives by the gimbal angles as columns, over the largest momentum.
struct GyroSteering {
  double near = 0.2;      // m below which the array counts as near a singularity
  double damping = 0.01;  // lambda_0
  double dither = 0.01;   // epsilon_0; less than 1/2
};

/// A torque tau on the carrying body that turns at w, both in its axes, takes gimbal rates d with A d = -(tau + w x h),
/// h the sum of the momenta of the rotors in their gimbals, (17.8). With B = A over the largest momentum h_m,
///     d = -B^T (B B^T + lambda E)^-1 (tau + w x h) / h_m,   lambda = lambda_0 (1 - m/near)^2 for m < near, else 0,
///     E = [[1, e_3, e_2], [e_3, 1, e_1], [e_2, e_1, 1]],    e_i = epsilon_0 sin(pi/2 t + (i - 1) pi/2),
/// times the largest factor up to 1 with which no gimbal exceeds its largest rate. Away from singularities that is the
/// pseudo-inverse, and gives all of the torque; near one it gives less, which lacking() says, and E turns the rates out
/// of the singular direction (Wie, Bailey and Heiberg 2001; lambda after Nakamura and Hanafusa 1986).
class GyroArray {
 public:
  GyroArray() = default;
  /// @throws std::invalid_argument if axes are no unit vectors or not perpendicular, a limit, inertia or bandwidth is
  /// not positive, a spin rate is zero, or a number of the steering is out of range.
  explicit GyroArray(std::vector<MomentGyro> gyros, const GyroSteering& steering = {});

  bool empty() const { return gyros_.empty(); }
  const std::vector<MomentGyro>& gyros() const { return gyros_; }
  const GyroSteering& steering() const { return steering_; }

  // --- In an evaluation, in this order ---

  /// Takes the gimbals' angles. `q`: of the whole model. Until something is commanded gimbals are to stand still.
  void take(std::span<const double> q);
  /// The torque is to be given, on the carrying body, which turns at w_B, in its axes, at the time t.
  void steer(const Vector3d& torque, const Vector3d& w_B, double t);
  /// Gimbals are to turn at these rates, each within its largest (per gyro).
  void command(std::span<const double> rates);
  /// The accelerations that both motors are to give (per velocity of the whole model), all of them prescribed.
  void prescribe(std::span<const double> v, std::span<std::uint8_t> prescribed, std::span<std::uint8_t> as_commanded,
                 std::span<double> acceleration);
  /// Forces that prescribed motions take (per velocity) are known. Whether gimbals' motors would need more than they
  /// have: these now give their largest (`effort`, per Model::joints()), are no longer prescribed, and the motion has
  /// to be found again.
  bool cut(std::span<const double> force, std::span<std::uint8_t> prescribed, std::span<double> effort);
  /// Efforts of all motors that are not cut.
  void conclude(std::span<const double> force, std::span<double> effort) const;

  // --- Of the angles taken ---

  /// m, zero with fewer than three gyros.
  double singularity_measure() const { return measure_; }
  /// h, in the carrying body's axes [N m s].
  Vector3d momentum() const;
  /// What was commanded to the gimbals, per gyro [rad/s].
  std::span<const double> commanded() const { return commanded_; }
  /// What the commanded rates leave of the torque that was to be given [N m].
  const Vector3d& lacking() const { return lacking_; }
  /// The torque on the carrying body by turning the momenta, -A d - w x h, with the gimbal rates of the whole model's
  /// v.
  Vector3d torque_of(std::span<const double> v, const Vector3d& w_B) const;

 private:
  std::vector<MomentGyro> gyros_;
  GyroSteering steering_;
  double largest_ = 1;             // momentum
  std::vector<Vector3d> h_, dh_;   // momenta and their derivatives by the angles
  std::vector<double> commanded_;  // per gyro
  std::vector<std::uint8_t> cut_;  // likewise
  double measure_ = 0;
  Vector3d lacking_ = Vector3d::zero();
};

/// Momentum of a gyro's rotor in its gimbal at an angle, in the carrying body's axes [N m s]: at its spin rate, which
/// the law assumes, and at another rate of the rotor relative to its gimbal [rad/s].
Vector3d momentum_of(const MomentGyro& gyro, double angle);
Vector3d momentum_of(const MomentGyro& gyro, double angle, double rotor_rate);
/// m of an array at gimbal angles (per gyro).
double singularity_measure(std::span<const MomentGyro> gyros, std::span<const double> angles);

}  // namespace grapnel
