#pragma once

/// @file
/// Arrays of single-gimbal control moment gyros as actuators: gimbal rates that give a torque on the carrying body, and
/// the motors of gimbals and rotors. Gimbals and rotors are bodies of the model with their own joints, so that the
/// model includes their momentum, energy and gyroscopic coupling. Thread safety: one thread at a time.

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "grapnel/simulate/base_effector.hpp"
#include "grapnel/simulate/control_setup.hpp"

namespace grapnel {

/// One gyro in a model. Both motors control rates, (17.6): the rotor's its spin rate in the gimbal, the gimbal's the
/// commanded rate, with the accelerations
///
///     bandwidth (commanded rate - rate),
///
/// and with the required torque: unlimited for the rotor's motor, up to its maximum for the gimbal's, beyond which the
/// gimbal moves under the maximum torque.
struct MomentGyro {
  int gimbal = -1, rotor = -1;  // indices in Model::joints()
  int gimbal_coordinate = -1;   // index of its angle in State::q
  // index of its rate relative to the carrying body in State::v
  int gimbal_velocity = -1;
  int rotor_velocity = -1;                                  // relative to the gimbal
  Vector3d gimbal_axis{0, 0, 1};                            // unit, in the carrying body's frame
  Vector3d spin_axis{1, 0, 0};                              // unit, perpendicular to it; there, at gimbal angle zero
  double inertia = 0;                                       // of the rotor, about its axis [kg m^2]
  double spin_rate = 0;                                     // [rad/s]
  double torque = std::numeric_limits<double>::infinity();  // maximum of the gimbal's motor [N m]
  double rate = std::numeric_limits<double>::infinity();    // maximum commanded rate of the gimbal [rad/s]
  double bandwidth = 20;                                    // [1/s]
  double momentum() const { return inertia * spin_rate; }   // [N m s]
};

/// A torque tau on the carrying body, which rotates at w, both in its axes, needs gimbal rates d with A d = -(tau + w x
/// h), h the sum of the momenta of the rotors in their gimbals, (17.8). With B = A over the largest momentum h_m,
///
///     d = -B^T (B B^T + lambda E)^-1 (tau + w x h) / h_m,
///     lambda = lambda_0 (1 - m/near)^2 for m < near, else 0,
///     E = [[1, e_3, e_2], [e_3, 1, e_1], [e_2, e_1, 1]],
///     e_i = epsilon_0 sin(pi/2 t + (i - 1) pi/2),
///
/// times the largest factor up to 1 with which no gimbal exceeds its maximum rate. Away from singularities this is the
/// pseudo-inverse and gives the full torque. Near one it gives less (see lacking()), and E moves the rates out of the
/// singular direction (Wie, Bailey and Heiberg 2001; lambda after Nakamura and Hanafusa 1986).
class GyroArray {
 public:
  GyroArray() = default;
  /// @throws std::invalid_argument if axes are not unit vectors or not perpendicular, a limit, inertia or bandwidth is
  /// not positive, a spin rate is zero, or a parameter of the steering is out of range.
  explicit GyroArray(std::vector<MomentGyro> gyros, const GyroSteering& steering = {});

  bool empty() const { return gyros_.empty(); }
  const std::vector<MomentGyro>& gyros() const { return gyros_; }
  const GyroSteering& steering() const { return steering_; }

  // --- In an evaluation, in this order ---

  /// Reads the gimbals' angles. `q`: of the whole model. Gimbals are at rest until a command.
  void take(std::span<const double> q);
  /// Commands the torque on the carrying body, which rotates at w_B, in its axes, at the time t.
  void steer(const Vector3d& torque, const Vector3d& w_B, double t);
  /// Commands gimbal rates, each limited to its maximum (per gyro).
  void command(std::span<const double> rates);
  /// Prescribes the accelerations that both motors are to give (per velocity of the whole model).
  void prescribe(std::span<const double> v, std::span<std::uint8_t> prescribed, std::span<std::uint8_t> as_commanded,
                 std::span<double> acceleration);
  /// Called when the forces of prescribed motions (per velocity) are known. Returns whether gimbals' motors would
  /// exceed their torque: these now give their maximum (`effort`, per Model::joints()), are no longer prescribed, and
  /// the motion must be computed again.
  bool cut(std::span<const double> force, std::span<std::uint8_t> prescribed, std::span<double> effort);
  /// Efforts of all motors that are not at their limit.
  void conclude(std::span<const double> force, std::span<double> effort) const;

  // --- Of the angles taken ---

  /// m, zero with fewer than three gyros.
  double singularity_measure() const { return measure_; }
  /// h, in the carrying body's axes [N m s].
  Vector3d momentum() const;
  /// What was commanded to the gimbals, per gyro [rad/s].
  std::span<const double> commanded() const { return commanded_; }
  /// The part of the commanded torque that the gimbal rates do not give [N m].
  const Vector3d& lacking() const { return lacking_; }
  /// The torque of the turning momenta on the carrying body, -A d - w x h, with the gimbal rates of the whole model's
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

/// Gyros as actuators of the base. Their motors are always active: without steering or commands the gimbals are at
/// rest.
class GyroEffector final : public BaseEffector {
 public:
  /// `steering`: the gyros give the commanded torque. `one_by_one`: a controller commands each gimbal's rate. @throws
  /// std::invalid_argument if a gyro is invalid (see GyroArray), or fewer than three are steered.
  GyroEffector(std::vector<MomentGyro> gyros, const std::optional<GyroSteering>& steering, bool one_by_one);

  const GyroArray& array() const { return gyros_; }

  void check(const Model& model, int root, std::span<const std::uint8_t> is_free) const override;
  EffectorVelocities velocities() const override;
  bool drives() const override { return steers_; }
  std::string lane_obstacle() const override { return "control moment gyros"; }
  void drive(const BaseMoment& at, const BaseCommand& command, std::span<double> effort,
             std::span<double> force) override;
  void turn(const BaseMoment& at, const Vector3d& torque, const ActuatorCommands& each,
            const PrescribedRates& rates) override;
  bool cut(std::span<const double> force, std::span<std::uint8_t> prescribed, std::span<double> effort) override {
    return gyros_.cut(force, prescribed, effort);
  }
  void conclude(std::span<const double> force, std::span<const double> friction, std::span<double> effort) override;
  const Vector3d& given() const override { return turned_; }

 private:
  GyroArray gyros_;
  bool steers_, one_by_one_;
  Vector3d turned_ = Vector3d::zero();  // torque of the turning gyros
};

/// Momentum of a gyro's rotor in its gimbal at an angle, in the carrying body's axes [N m s]: at its nominal spin rate,
/// which the law assumes, and at another rate of the rotor relative to its gimbal [rad/s].
Vector3d momentum_of(const MomentGyro& gyro, double angle);
Vector3d momentum_of(const MomentGyro& gyro, double angle, double rotor_rate);
/// m of an array at gimbal angles (per gyro).
double singularity_measure(std::span<const MomentGyro> gyros, std::span<const double> angles);

}  // namespace grapnel
