#pragma once

/// @file
/// One evaluation of the boundary value problem of reach.hpp: final joint values in, settled rates, error of the goals
/// and its total derivative out.

#include <Eigen/Core>
#include <span>
#include <vector>

#include "grapnel/plan/reach.hpp"

namespace grapnel {

/// An iterate.
struct Shot {
  bool valid = false;  // the rates were settled and everything is finite
  SegmentAccuracy accuracy = SegmentAccuracy::search;
  std::vector<double> position, rate;
  std::vector<double> coefficients;  // of the joints' splines, if the segment has knots
  Posed X_WB = Posed::identity();
  Eigen::VectorXd error;  // of the goals
  Eigen::MatrixXd J;      // d error / d [position, coefficients], rates following (2)
  Eigen::MatrixXd K;      // d rate / d [position, coefficients] (2)
  Matrix6Xd per_unknown;  // displacement of the base, in B, likewise
  double unmet = 0;       // of the demanded rates
  double size() const { return error.size() ? error.norm() : 0; }
  double largest_error() const { return error.size() ? error.lpNorm<Eigen::Infinity>() : 0; }
  /// Rates to expect at other final values (and coefficients), by K.
  std::vector<double> rate_at(const std::vector<double>& other, std::span<const double> others = {}) const;
};

/// X displaced by xi [angular; linear], a small one, in its own frame.
Posed displaced(const Posed& X, const Vector6d& xi);

class Shooting {
 public:
  Shooting(FloatingBase& base, const ReachProblem& problem);
  /// Evaluates at `position`; `rate` is where settling begins. The last step of settling is taken by (2)'s linear
  /// prediction, which leaves its square: some 1e-6 for a search, rounding for full accuracy.
  Shot shoot(const std::vector<double>& position, const std::vector<double>& rate,
             SegmentAccuracy accuracy = SegmentAccuracy::full, std::span<const double> coefficients = {});
  /// Of the last shot, whose way it keeps if told to.
  PathSegment& segment() { return segment_; }
  long rhs_evaluations() const { return segment_.rhs_evaluations(); }
  /// Why the latest integration that did not reach its end stopped; empty if all did.
  const std::string& trouble() const { return trouble_; }

 private:
  FloatingBase& base_;
  const ReachProblem& problem_;
  PathSegment segment_;
  std::string trouble_;
};

// The best solution near a given one: the objective made least while the goals stay met.

/// Sequential quadratic programming (SLSQP) from `solution` with the goals' error as equality constraint, its dependent
/// rows left out, and the joints' limits as bounds. Ends near a solution; Newton's method has to polish it. Returns
/// `solution` where nothing better is found.
Shot best_near(FloatingBase& base, const ReachProblem& problem, Shooting& shooting, const Shot& solution);

// The step of least norm towards e + J d = 0 within bounds.

/// What a step does and what it met.
struct NewtonStep {
  Eigen::VectorXd d;
  std::vector<int> at_bound;  // variables that the bounds stopped
  bool filtered = false;      // a singular value was so small that its direction was damped
};

/// Least-norm d with e + J d = 0 in the least-squares sense and lower <= x + d <= upper: the variable that goes
/// farthest beyond its bound is put on it, and the others are solved for again. Directions whose singular value s is
/// below `damping` are damped by s^2/(s^2 + (damping - s)^2) (numerical filtering: Maciejewski and Klein 1988).
NewtonStep least_norm_step(const Eigen::MatrixXd& J, const Eigen::VectorXd& e, const std::vector<double>& x,
                           const std::vector<double>& lower, const std::vector<double>& upper, double damping);

/// Of J, structural zeros (below 1e-9 of the largest) left out; 0 of a matrix without entries.
double smallest_singular_value(const Eigen::MatrixXd& J);

}  // namespace grapnel
