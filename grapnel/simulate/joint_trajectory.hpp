#pragma once

/// @file
/// Motion of one joint over a whole phase: consecutive pieces in time, each a profile between two points or a
/// polynomial.

#include <span>
#include <variant>
#include <vector>

namespace grapnel {

// Motion of one joint from one angle to another in a given time.

/// quartic: the thesis's (3.1)-(3.2), a fourth-order polynomial of the rate, starting from rest. quintic: the
/// fifth-order polynomial of position with a given initial rate (from rest it equals the quartic). cycloidal: the
/// integral of a sine, plus terms for the final and initial rates as in the quintic. All have zero acceleration at both
/// ends.
enum class JointProfile { quartic, cycloidal, quintic };

/// Position, rate and acceleration of a joint at one instant; S: double, or packs of SIMD lanes.
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

/// The path at time t; before 0 and after T, position and rate keep the values of the end points (as the thesis's
/// reference does), with zero acceleration.
JointPoint evaluate(const JointPath& path, double t);

/// A polynomial on [begin, end] as a series in Chebyshev polynomials of the first kind of
/// x = (2 t - begin - end) / (end - begin): position = sum_k coefficients[k] T_k(x).
struct ChebyshevPiece {
  std::vector<double> coefficients;  // at least one [rad or m]
};

/// One piece. The time of a JointPath is relative to `begin`, and its duration is end - begin.
struct JointPiece {
  double begin = 0;  // [s], absolute
  double end = 0;
  std::variant<JointPath, ChebyshevPiece> shape;
};

/// Pieces in the order of time; each begins where the previous one ends. Before the first and after the last piece,
/// position and rate keep the values of that end (as the thesis's reference does), with zero acceleration. A trajectory
/// without pieces is zero.
struct JointTrajectory {
  std::vector<JointPiece> pieces;

  JointTrajectory() = default;
  /// One profile that begins at `begin`.
  JointTrajectory(double begin, const JointPath& path) : pieces{{begin, begin + path.duration, path}} {}
  /// A joint at rest at `position`.
  static JointTrajectory at_rest(double position);
};

/// Position, rate and acceleration at time t. At a common end of two pieces the later piece applies.
JointPoint evaluate(const JointTrajectory& trajectory, double t);
/// The same by the piece that contains the time `inside`: at the ends of the piece, where the acceleration may jump,
/// the limit from inside. Beyond its ends a piece keeps its end values.
JointPoint evaluate(const JointTrajectory& trajectory, double t, double inside);

/// Times at which the trajectory is not smooth: the ends of all pieces, except the outer ends of a constant.
/// Increasing.
std::vector<double> break_times(const JointTrajectory& trajectory);

/// @throws std::invalid_argument if a piece does not end after it begins or does not begin where the previous one ends,
/// a path has another duration than its piece, or a series has no coefficients.
void validate(const JointTrajectory& trajectory);

/// The series that interpolates values given at the Chebyshev-Lobatto points t_k = middle + half cos(pi (n - k) / n),
/// k = 0 ... n (increasing in time), n >= 1. Lloyd N. Trefethen, Approximation Theory and Approximation Practice
/// (2013), chapters 2 and 3.
ChebyshevPiece chebyshev_interpolant(std::span<const double> values);

/// The k-th of n + 1 Chebyshev-Lobatto points of [begin, end], increasing; exact at the ends.
double chebyshev_point(double begin, double end, int k, int n);

/// A trajectory through samples at strictly increasing times: a cubic spline with continuous acceleration ("not a knot"
/// at the ends; a line for two samples, a parabola for three). With rates, the cubic through position and rate of every
/// sample (its acceleration jumps there). @throws std::invalid_argument if sizes differ, there are fewer than two
/// samples, times do not increase, or a number is not finite.
JointTrajectory interpolate_samples(std::span<const double> times, std::span<const double> positions,
                                    std::span<const double> rates = {});

}  // namespace grapnel
