#pragma once

/// @file
/// What a run leaves behind of what its on-board computer knew: readings of sensors against the truth, estimates of
/// targets and replanning, identification. Part of CaptureResult. Public, kept stable.

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "grapnel/spatial/vector3.hpp"

namespace grapnel {

/// A sensor's readings against what they are of. Errors of all components and channels together.
struct SensorReport {
  std::string sensor;
  std::string unit;        // of the errors
  double sample_time = 0;  // between readings [s]
  long readings = 0;
  double mean_error = 0;     // of all
  double rms_error = 0;      // root of the mean square
  double largest_error = 0;  // of either sign
};

/// An estimate of a target on which an approach, or what is left of it, was planned, against the truth.
struct EstimateReport {
  std::string target;
  double position_error = 0;          // [m]
  double orientation_error = 0;       // [rad]
  double velocity_error = 0;          // [m/s]
  double angular_velocity_error = 0;  // [rad/s]
};

/// A plan of the approach, or of what is left of it.
struct NavigationReport {
  double time = 0;           // when [s]
  bool found = false;        // else the plan before stays
  long rhs_evaluations = 0;  // that it took
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

/// A held target that has been identified, or that could not be.
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
  std::vector<std::string> unseen;  // changes that no measurement shows
  std::string impossible;           // why no body has these parameters
  /// When laws began to work with it; absent: they did not.
  std::optional<double> used_from;
};

}  // namespace grapnel
