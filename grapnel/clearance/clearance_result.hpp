#pragma once

/// @file
/// What the watches of clearances and joint limits find, as plain values with names.

#include <limits>
#include <optional>
#include <string>

#include "grapnel/spatial/vector3.hpp"

namespace grapnel {

/// The minimum distance of any two watched bodies in a phase. An infinite distance and empty names: no pair was
/// watched.
struct MinimumClearance {
  double distance = std::numeric_limits<double>::infinity();  // [m]; negative: a depth of overlap
  std::string body_a;
  std::string body_b;
  Vector3d point_a = Vector3d::zero();  // nearest points, in W
  Vector3d point_b = Vector3d::zero();
  double time = 0;  // [s]
  std::string phase;
};

/// A time during which two bodies were nearer to each other than required. One that is under way when its phase begins
/// or ends has that instant as its begin or end.
struct ClearanceEvent {
  std::string phase;
  double begin_time = 0;   // [s]
  double end_time = 0;     // [s]
  double required = 0;     // [m]
  MinimumClearance least;  // of this pair in this time
  /// When the two begin to overlap, which may be later than when they come too near [s]; absent: they do not.
  std::optional<double> overlap_begin = {};
};

/// Which limit of a joint was passed. `effort_saturated`: a motor that is cut at its limit ran at it, no violation.
enum class LimitKind { position, rate, effort, effort_saturated };

/// A time during which a joint was beyond one of its limits (or, saturated, at it). Units are the joint's: rad or m,
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
