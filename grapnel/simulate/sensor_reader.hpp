#pragma once

/// @file
/// The interface of sensors read at the sample times of sampled control, and the noise and rounding of readings. Thread
/// safety: a reader belongs to one run, and to one thread at a time.

#include <cstdint>
#include <vector>

#include "grapnel/dynamics/state.hpp"
#include "grapnel/spatial/pose.hpp"
#include "grapnel/spatial/spatial_vector.hpp"

namespace grapnel {

struct PhaseSample;

/// Readings besides the state; NaN without a sensor or before the first reading.
struct SensorReadings {
  /// Per end-effector: the wrench on the robot, in the end-effector's axes, about its origin.
  std::vector<Wrenchd> wrists;
  struct Target {
    Posed X_BT;
    Twistd V_BT;  // the target's velocity less that of the base's origin and its angular velocity in W, in the base's
                  // axes
  };
  std::vector<Target> targets;  // in the problem's order
};

/// Reads the sensors at the sample times of a ControlClock.
class SensorReader {
 public:
  SensorReader() = default;
  SensorReader(const SensorReader&) = delete;
  SensorReader& operator=(const SensorReader&) = delete;
  virtual ~SensorReader() = default;

  /// Whether the sample needs the accelerations and efforts under the held commands just before the sample time.
  virtual bool needs_forces() const = 0;
  /// Reads at a sample time: the system's true state, and the state that the laws receive, which initially equals the
  /// true one.
  virtual void read(const PhaseSample& sample, State& seen) = 0;
  virtual const SensorReadings& readings() const = 0;
};

/// A number of the standard normal distribution: a function only of seed, sensor, channel and index of the reading
/// (Philox 4x32-10, Salmon et al. 2011; Box and Muller).
double normal_number(std::uint64_t seed, std::uint32_t sensor, std::uint32_t channel, std::uint64_t reading);

/// The nearest multiple of the quantum; x itself if the quantum is 0.
double quantized(double x, double quantum);

/// Rotation with this rotation vector [rad].
Rotationd rotation_by(const Vector3d& vector);

}  // namespace grapnel
