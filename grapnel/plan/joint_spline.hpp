#pragma once

/// @file
/// More freedom for the joints on a segment than its profile leaves: to the profile a spline is added that ends where
/// it begins.
///   theta_j(t) = profile(start, final, rates; x) + sum_k c_kj N_k(x),   x = (t - begin)/(end - begin) (1)
/// N_k are B-splines of degree 5 on equal spans between clamped ends (de Boor, A Practical Guide to Splines, 1978,
/// chapter IX), without the first three and the last three, which alone have a value, a rate or an acceleration at the
/// ends. K inner knots make K + 1 spans and K + 6 B-splines, of which K are left.

#include <span>
#include <vector>

#include "grapnel/simulate/joint_trajectory.hpp"

namespace grapnel {

class JointSpline {
 public:
  /// @throws std::invalid_argument unless 0 <= knots.
  explicit JointSpline(int knots);

  /// Inner knots, and as many functions N_k.
  int knots() const { return knots_; }
  /// Values of all N_k at x in [0, 1], with the first and second derivative for x.
  void evaluate(double x, std::span<JointPoint> values) const;

 private:
  int knots_;
  std::vector<double> t_;  // all knots, the ends six times
};

/// The pieces of a joint's motion on a segment [begin, begin + path.duration]: the path alone where there are no
/// coefficients, else a series per span, which holds (1) to rounding. `coefficients`: c_kj of this joint, per N_k.
std::vector<JointPiece> pieces_of(double begin, const JointPath& path, std::span<const double> coefficients);

}  // namespace grapnel
