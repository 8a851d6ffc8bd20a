#pragma once

/// @file
/// Results about the knowledge of the on-board computer: sensor readings compared with true values, estimates of
/// targets, replanning, identification. Part of CaptureResult. Public, kept stable.

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "grapnel/spatial/vector3.hpp"

namespace grapnel {

/// Errors of a sensor's readings, over all components and channels.
struct SensorReport {
  std::string sensor;
  std::string unit;        // of the errors
  double sample_time = 0;  // between readings [s]
  long readings = 0;
  double mean_error = 0;     // over all readings
  double rms_error = 0;      // root of the mean square
  double largest_error = 0;  // of either sign
};

/// Error of an estimate of a target that a plan of the approach uses.
struct EstimateReport {
  std::string target;
  double position_error = 0;          // [m]
  double orientation_error = 0;       // [rad]
  double velocity_error = 0;          // [m/s]
  double angular_velocity_error = 0;  // [rad/s]
};

/// A plan of the approach, or of its remainder.
struct NavigationReport {
  double time = 0;           // when [s]
  bool found = false;        // false: the previous plan continues
  long rhs_evaluations = 0;  // while planning
  std::vector<EstimateReport> estimates;
  std::string failure;  // why not found
};

/// One of the ten parameters of an identified target, in its frame.
struct IdentifiedParameter {
  std::string name;
  std::string unit;
  std::optional<double> value;      // empty: not determined
  std::optional<double> deviation;  // standard; empty without noise
  double truth = 0;
  std::optional<double> error() const { return value ? std::optional(*value - truth) : std::nullopt; }
};

enum class IdentificationEnd { running, done, released };

/// Identification of a held target.
struct IdentificationReport {
  std::string target;
  double begin = 0, end = 0;  // of the samples [s]
  IdentificationEnd ended = IdentificationEnd::running;
  long samples = 0;
  bool converged = false;
  int rank = 0;  // of ten
  double condition = 0;
  double residual = 0;
  std::string mass, com, inertia;  // determined, ratio_only or not_determined
  std::vector<IdentifiedParameter> parameters;
  std::vector<std::string> unseen;  // changes that no measurement detects
  std::string impossible;           // why no body has these parameters
  /// Time from which control laws used the estimate; absent: they did not.
  std::optional<double> used_from;
};

}  // namespace grapnel
