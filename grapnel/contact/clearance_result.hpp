#pragma once

/// @file
/// Results of the clearance and joint limit watches, as plain values with names.

#include <limits>
#include <optional>
#include <string>

#include "grapnel/spatial/vector3.hpp"

namespace grapnel {

/// The minimum distance of any two watched bodies in a phase. Infinite distance and empty names: no pair was watched.
struct MinimumClearance {
  double distance = std::numeric_limits<double>::infinity();  // [m]; negative: a depth of overlap
  std::string body_a;
  std::string body_b;
  Vector3d point_a = Vector3d::zero();  // nearest points, in W
  Vector3d point_b = Vector3d::zero();
  double time = 0;  // [s]
  std::string phase;
};

/// A time interval during which two bodies were closer to each other than required. It is truncated at the begin and
/// end of its phase.
struct ClearanceEvent {
  std::string phase;
  double begin_time = 0;     // [s]
  double end_time = 0;       // [s]
  double required = 0;       // [m]
  MinimumClearance minimum;  // of this pair in this time
  /// Begin of the overlap [s], which may be later than the begin of the event; absent: no overlap.
  std::optional<double> overlap_begin = {};
};

/// Violated limit of a joint. `effort_saturated`: the motor was saturated at its limit, which is no violation.
enum class LimitKind { position, rate, effort, effort_saturated };

/// A time interval during which a joint exceeded one of its limits (or was saturated). Units are the joint's: rad or m,
/// rad/s or m/s, N m or N.
struct LimitEvent {
  LimitKind kind = LimitKind::position;
  std::string joint;
  std::string phase;
  double begin_time = 0;  // [s]
  double end_time = 0;    // [s]
  double worst_value = 0;
  double worst_time = 0;  // [s]
  double limit = 0;       // signed: a rate of -0.3 against a limit of 0.2 has the limit -0.2
};

}  // namespace grapnel
