#pragma once

/// @file
/// A wrench on a body as a given function of time: thruster plumes, a docking mechanism's spring, a disturbance test.

#include <limits>
#include <vector>

#include "grapnel/spatial/pose.hpp"
#include "grapnel/spatial/spatial_vector.hpp"

namespace grapnel {

/// How a load varies in time. Zero outside [start, end).
struct LoadProfile {
  /// constant: 1. half_sine: sin(pi (t - start) / (end - start)). sine: sin(2 pi frequency (t - start) + phase).
  /// table: the wrench itself, linear between samples; zero before the first and after the last.
  enum class Shape { constant, half_sine, sine, table };
  Shape shape = Shape::constant;
  double start = 0;                                      // [s]
  double end = std::numeric_limits<double>::infinity();  // [s]; finite for half_sine
  double frequency = 0;                                  // sine [Hz]
  double phase = 0;                                      // sine [rad]
  std::vector<double> times;                             // table [s], strictly increasing
  std::vector<Wrenchd> values;                           // table
};

/// See the file comment.
struct ExternalLoad {
  int body = 0;                         // index in the model
  Vector3d p_BP = Vector3d::zero();     // point of attack, in the body's frame [m]
  bool in_body = false;                 // components turn with the body; else they are in W
  Wrenchd amplitude = Wrenchd::zero();  // about P [N m; N]; not read by table
  LoadProfile profile;
};

/// The wrench at time t, in the load's own components. At a start or a sample the later part speaks, at the last sample
/// of a table that sample.
Wrenchd wrench_at(const ExternalLoad& load, double t);
/// The same by the part of the profile (nothing, the shape, one line of the table) that speaks at the time `inside`: at
/// the ends of that part, where the load may jump, its own limits.
Wrenchd wrench_at(const ExternalLoad& load, double t, double inside);

/// Times at which the load is not smooth (start, end, samples of a table), increasing, finite ones only.
std::vector<double> break_times(const ExternalLoad& load);

/// @throws std::invalid_argument if the end does not come after the start, a half sine has no finite ends, a number is
/// not finite, or a table has fewer than two samples, other times than values, or times that do not increase.
void validate(const ExternalLoad& load);

}  // namespace grapnel
