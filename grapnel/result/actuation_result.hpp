#pragma once

/// @file
/// Reports on actuators and control loops: saturation, stability, and rest. Part of CaptureResult. actuation_fields.cpp
/// describes the fields. Public, kept stable.

#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace grapnel {

/// A saturated actuator.
struct SaturationReport {
  enum class Actuator { wheel, gyro, gyros, thruster, joint, base_control };
  /// singularity: of an array of gyros that is steered.
  enum class Quantity { rate, torque, effort, duty, singularity };
  Actuator actuator = Actuator::wheel;
  std::string name;
  Quantity quantity = Quantity::rate;
  double limit = 0;
  double first_time = 0;
  double duration = 0;
  double share = 0;
  bool at_end = false;
};

/// An actuator of the base of a kind without its own report.
struct ActuatorUse {
  std::string quantity;  // path of its time series
  std::string name;
  std::string unit;
  double largest = 0, limit = 0;  // magnitudes
  double saturated = 0;           // time at the limit [s]
  double first_saturated = 0;     // start of the first saturation [s]; 0 without any
};

/// A tendon, over all phases.
struct TendonReport {
  std::string name;
  double largest_tension = 0;   // [N]
  double work = 0;              // on the joints [J]
  double excursion_before = 0;  // at the first instant with the tendon's command [m]
  double excursion_after = 0;   // at the last one [m]
};

enum class Stability { unstable, not_evaluated, stable };

/// The control loops of one phase.
struct StabilityReport {
  std::string phase;
  Stability verdict = Stability::not_evaluated;
  std::string reason;
  std::string of;  // decisive rate; empty: none
  double period = 0;
  double amplitude_before = 0, amplitude_after = 0;
  double saturated_share = 0;
  double since = std::numeric_limits<double>::quiet_NaN();  // unstable since this time [s]
};

/// Margins of one channel of the controllers, while all others are closed.
struct LoopMargin {
  std::string channel, unit;
  std::optional<double> gain_maximum, gain_minimum;  // factors on the channel's gains; absent: no limit
  std::optional<double> gain_frequency;              // of the limit that is nearest to 1 [rad/s]
  std::optional<double> phase, phase_frequency;      // [rad], [rad/s]; absent: the loop gain never is 1
  std::optional<double> delay;                       // [s]; absent: no added delay destabilizes
};

/// Verdict of the eigenvalues of a linear model.
enum class LinearStability { stable, marginal, unstable, undecided };

/// The linear model of the scenario's controllers at a time.
struct ControlLoopReport {
  double time = 0;
  std::string phase;
  std::vector<std::string> laws;
  LinearStability verdict = LinearStability::undecided;
  std::string reason;
  bool sampled = false;
  std::vector<LoopMargin> margins;
  std::string margins_absent;  // why there are none; empty: there are
};

/// Whether the motion after the impact came to rest within stated rates.
struct RestReport {
  bool at_rest = false;
  double time = std::numeric_limits<double>::quiet_NaN();
  double angular_velocity = 0, angular_velocity_limit = 0;
  std::string joint;
  double joint_rate = 0, joint_rate_limit = std::numeric_limits<double>::infinity();
};

}  // namespace grapnel
