#pragma once

/// @file
/// Additional degrees of freedom of the joint motion on a segment: a spline that vanishes at both ends is added to the
/// profile.
///   theta_j(t) = profile(start, final, rates; x) + sum_k c_kj N_k(x),   x = (t - begin)/(end - begin) (1)
/// N_k are B-splines of degree 5 on equal spans with clamped ends (de Boor, A Practical Guide to Splines, 1978, chapter
/// IX). The first three and the last three are omitted: they alone have nonzero values, rates or accelerations at the
/// ends. K inner knots give K + 1 spans and K + 6 B-splines, of which K remain.

#include <span>
#include <vector>

#include "grapnel/simulate/joint_trajectory.hpp"

namespace grapnel {

class JointSpline {
 public:
  /// @throws std::invalid_argument unless 0 <= knots.
  explicit JointSpline(int knots);

  /// Number of inner knots, equal to the number of functions N_k.
  int knots() const { return knots_; }
  /// Values of all N_k at x in [0, 1], with first and second derivatives with respect to x.
  void evaluate(double x, std::span<JointPoint> values) const;

 private:
  int knots_;
  std::vector<double> t_;  // all knots, end knots with multiplicity six
};

/// The pieces of a joint's trajectory on a segment [begin, begin + path.duration]: the path alone without coefficients,
/// otherwise one series per span, equal to (1) up to rounding error. `coefficients`: c_kj of this joint, per N_k.
std::vector<JointPiece> pieces_of(double begin, const JointPath& path, std::span<const double> coefficients);

}  // namespace grapnel
