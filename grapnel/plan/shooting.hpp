#pragma once

/// @file
/// One evaluation of the boundary value problem of reach.hpp: takes final joint values; computes the consistent final
/// rates, the goals' error and its total derivative.

#include <Eigen/Core>
#include <span>
#include <vector>

#include "grapnel/plan/reach.hpp"

namespace grapnel {

/// An iterate.
struct ShootingIterate {
  bool valid = false;  // the rates converged and all results are finite
  SegmentAccuracy accuracy = SegmentAccuracy::search;
  std::vector<double> position, rate;
  std::vector<double> coefficients;  // of the joint splines, if the segment has knots
  Posed X_WB = Posed::identity();
  Eigen::VectorXd error;  // of the goals
  Eigen::MatrixXd J;      // d error / d [position, coefficients], with rates by (2)
  Eigen::MatrixXd K;      // d rate / d [position, coefficients] (2)
  Matrix6Xd per_unknown;  // displacement of the base, in B, per [position, coefficient]
  double unmet = 0;       // largest unmet component of the demanded rates
  double size() const { return error.size() ? error.norm() : 0; }
  double largest_error() const { return error.size() ? error.lpNorm<Eigen::Infinity>() : 0; }
  /// Predicted rates at other final values (and coefficients), by K.
  std::vector<double> rate_at(const std::vector<double>& other, std::span<const double> others = {}) const;
};

/// X displaced by a small xi [angular; linear] in its own frame.
Posed displaced(const Posed& X, const Vector6d& xi);

class Shooting {
 public:
  Shooting(FloatingBase& base, const ReachProblem& problem);
  /// Evaluates at `position`; `rate` is the first guess of the final rates. The last iteration for the rates uses the
  /// linear prediction (2), which leaves an error of second order: about 1e-6 for a search, rounding error for full
  /// accuracy.
  ShootingIterate shoot(const std::vector<double>& position, const std::vector<double>& rate,
                        SegmentAccuracy accuracy = SegmentAccuracy::full, std::span<const double> coefficients = {});
  /// Segment of the last iterate; it stores its path if requested.
  PathSegment& segment() { return segment_; }
  long rhs_evaluations() const { return segment_.rhs_evaluations(); }
  /// Why the last failed integration stopped; empty if none failed.
  const std::string& failure() const { return failure_; }

 private:
  FloatingBase& base_;
  const ReachProblem& problem_;
  PathSegment segment_;
  std::string failure_;
};

// Local minimization of the objective subject to the goals.

/// Sequential quadratic programming (SLSQP) from `solution` with the goals' error as equality constraint, without
/// dependent rows, and the joint limits as bounds. The result is close to a solution; refine it with Newton's method.
/// Returns `solution` if no better one is found.
ShootingIterate best_near(FloatingBase& base, const ReachProblem& problem, Shooting& shooting,
                          const ShootingIterate& solution);

// Minimum-norm step towards e + J d = 0 within bounds.

/// A step, and the bounds and singularities it met.
struct NewtonStep {
  Eigen::VectorXd d;
  std::vector<int> at_bound;  // variables stopped by their bounds
  bool filtered = false;      // a direction was damped because of its small singular value
};

/// Minimum-norm d with e + J d = 0 in the least-squares sense and lower <= x + d <= upper. The variable that exceeds
/// its bound most is set to it, and the others are solved for again. Directions with a singular value s below `damping`
/// are damped by s^2/(s^2 + (damping - s)^2) (numerical filtering: Maciejewski and Klein 1988).
NewtonStep minimum_norm_step(const Eigen::MatrixXd& J, const Eigen::VectorXd& e, const std::vector<double>& x,
                             const std::vector<double>& lower, const std::vector<double>& upper, double damping);

/// Of J, without structural zeros (below 1e-9 of the largest); 0 for an empty matrix.
double smallest_singular_value(const Eigen::MatrixXd& J);

}  // namespace grapnel
