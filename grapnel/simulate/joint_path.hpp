#pragma once

/// @file
/// Motion of one joint from one angle to another in a given time.

namespace grapnel {

/// quartic: the thesis's (3.1)-(3.2), a fourth-order polynomial of the rate, starting from rest.
/// quintic: the fifth-order polynomial of position that also starts with a given rate (from rest it is the quartic).
/// cycloidal: a sine's integral, the final and initial rates added as in the quintic.
/// All have zero acceleration at both ends.
enum class JointProfile { quartic, cycloidal, quintic };

/// Where a joint is at one instant, and how it moves; S: double, or packs of SIMD lanes.
template <class S>
struct BasicJointPoint {
  S position = S(0.0);      // [rad or m]
  S rate = S(0.0);          // [rad/s or m/s]
  S acceleration = S(0.0);  // [rad/s^2 or m/s^2]
};
using JointPoint = BasicJointPoint<double>;

struct JointPath {
  JointProfile profile = JointProfile::quintic;
  double duration = 1;  // T [s], positive
  double start = 0;     // [rad or m]
  double end = 0;
  double start_rate = 0;  // [rad/s or m/s]; not read by quartic
  double end_rate = 0;
};

/// The path at time t; before 0 and after T it stays at the end points' values (rate included, as the thesis's
/// reference does), with zero acceleration.
JointPoint evaluate(const JointPath& path, double t);

}  // namespace grapnel
