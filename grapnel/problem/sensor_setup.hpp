#pragma once

/// @file
/// Knowledge of the on-board computer: its sensors, the estimate of a target with which an approach is planned, and the
/// assumed mass properties of a held target. Plain data, part of CaptureProblem. Public API, kept stable.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "grapnel/spatial/pose.hpp"
#include "grapnel/spatial/spatial_vector.hpp"

namespace grapnel {

// A reading is q round((x + bias + n) / q): x the true value, n Gaussian with the standard deviation `noise`, q the
// quantum (0: no rounding), (20.1). If sample_time is not 0 it is a multiple of the clock's period, and a reading holds
// until the next one. Standard deviations apply to each component of a reading.

/// Encoders of all moving joints.
struct JointSensors {
  double noise = 0;            // [rad or m]
  std::vector<double> bias;    // per joint [rad or m]; empty: none
  double quantum = 0;          // [rad or m]
  double counts_per_turn = 0;  // instead of quantum: quantum = 2 pi / counts; 0: not given
  double sample_time = 0;      // [s]; 0: every sample time of the clock
  enum class Rate { difference, sensor, exact };
  /// Source of rates. difference: of the last two position readings, over the time between them (0 at the first).
  /// sensor: a separate sensor. exact: the true rate.
  Rate rate = Rate::difference;
  double rate_noise = 0;    // of the separate sensor [rad/s or m/s]
  double rate_bias = 0;     // likewise, of all joints
  double rate_quantum = 0;  // likewise
  double position_quantum() const;
};

/// The base's angular velocity, in the base's axes.
struct GyroSensor {
  double noise = 0;                  // [rad/s]
  double angle_random_walk = 0;      // instead of noise: noise = angle_random_walk / sqrt(sample time) [rad/sqrt(s)]
  Vector3d bias = Vector3d::zero();  // [rad/s]
  double quantum = 0;                // [rad/s]
  double sample_time = 0;            // [s]
  /// Standard deviation of a reading for a clock with this `period`.
  double deviation(double period) const;
};

/// The base's attitude: R_WB exp([bias + n]), both rotation vectors in the base's axes; rounding applies to the
/// components of the total rotation vector.
struct AttitudeSensor {
  double noise = 0;                  // [rad]
  Vector3d bias = Vector3d::zero();  // [rad]
  double quantum = 0;                // [rad]
  double sample_time = 0;            // [s]
};

/// Tachometers of all reaction wheels: rates relative to the base.
struct WheelSensors {
  double noise = 0;        // [rad/s]
  double bias = 0;         // [rad/s]
  double quantum = 0;      // [rad/s]
  double sample_time = 0;  // [s]
};

/// A force and torque sensor between an end-effector and the grasped target: the wrench on the robot, in the
/// end-effector's axes, about its origin.
struct WristSensor {
  std::string end_effector;
  double force_noise = 0, torque_noise = 0;                                // [N], [N m]
  Vector3d force_bias = Vector3d::zero(), torque_bias = Vector3d::zero();  // [N], [N m]
  double force_quantum = 0, torque_quantum = 0;                            // [N], [N m]
  double sample_time = 0;                                                  // [s]
};

/// A target's pose and motion relative to the base: p_BT, R_BT exp([bias + n]) and, in the base's axes, the velocity of
/// the target's origin less that of the base's origin, and the target's angular velocity in W.
struct RelativePoseSensor {
  std::string target;
  double position_noise = 0, orientation_noise = 0;                                // [m], [rad]
  double velocity_noise = 0, angular_velocity_noise = 0;                           // [m/s], [rad/s]
  Vector3d position_bias = Vector3d::zero(), orientation_bias = Vector3d::zero();  // [m], [rad]
  double sample_time = 0;                                                          // [s]
  double delay = 0;                                                                // until a reading is available [s]
};

/// All sensors are read at sample times of the clock (ControlSetup). Controllers receive true values for quantities
/// without a sensor.
struct SensorSetup {
  std::uint64_t seed = 0;  // determines the noise, together with sensor, channel and index of the reading
  std::optional<JointSensors> joints;
  std::optional<GyroSensor> gyro;
  std::optional<AttitudeSensor> attitude;
  std::optional<WheelSensors> wheels;
  std::vector<WristSensor> wrists;
  std::vector<RelativePoseSensor> relative_poses;
};

/// Error of the target's estimate with which an approach is planned, at the time of its given state.
struct TargetEstimate {
  Vector3d position_error = Vector3d::zero();          // in W [m]
  Vector3d orientation_error = Vector3d::zero();       // rotation vector, in W: R_estimate = exp(.) R [rad]
  Vector3d velocity_error = Vector3d::zero();          // of the target frame's origin, in W [m/s]
  Vector3d angular_velocity_error = Vector3d::zero();  // in W [rad/s]
};

/// The rest of the approach is replanned at intervals, from the readings of the relative pose sensors.
struct ReplanSetup {
  double every = 0;  // [s]
  double until = 0;  // [s], from the start; 0: to the end of the approach
};

/// Mass properties of a held target that the laws assume before it has been identified. They know the true value of
/// absent ones.
struct AssumedTarget {
  std::string target;  // empty: the only one that is grasped
  std::optional<double> mass;
  std::optional<Vector3d> com;         // in the target's frame [m]
  std::optional<Symmetric3d> inertia;  // about the centre of mass, target's axes [kg m^2]
};

/// Joints move about their held positions to excite an identification: joint j moves to amplitude and minus amplitude,
/// `swings` + j mod 3 times, and back (20.7).
struct ExcitationSetup {
  std::vector<double> amplitude;  // per joint [rad or m]
  int swings = 2;
};

/// Identification of mass, centre of mass and inertia of a held target from sensor readings at the clock's sample
/// times.
struct IdentifySetup {
  std::string target;      // empty: the only one that is grasped
  double from = 0;         // since post_impact began [s]
  double duration = 0;     // [s]
  double sample_time = 0;  // between samples, a multiple of the clock's period; 0: every sample time [s]
  enum class Base { twist, rotation };
  Base base = Base::twist;      // the measured quantity of the base's motion: MeasuredBase
  bool momentum_known = false;  // the total momentum at the first sample is known, exactly
  std::optional<ExcitationSetup> excitation;
};

/// The inertia of a held target that model-based laws use.
enum class LawModel { truth, assumed, estimated };

}  // namespace grapnel
