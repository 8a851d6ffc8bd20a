#pragma once

/// @file
/// One segment with path constraints: evaluates the violations, their instants and the objective, and the derivatives
/// of both with respect to the final joint values and the spline coefficients; (1) and (2) of path_constraints.hpp.

#include "grapnel/plan/path_constraint_check.hpp"
#include "grapnel/plan/shooting.hpp"

namespace grapnel {

class ConstrainedSegment {
 public:
  using Instant = PathConstraintCheck::Instant;
  using Found = PathConstraintCheck::Found;

  /// `base` is shared scratch and must outlive the object. `panels`: minimum number of panels of 16 nodes to evaluate.
  ConstrainedSegment(FloatingBase& base, const ReachProblem& problem, int knots, int panels);
  ConstrainedSegment(const ConstrainedSegment&) = delete;
  ConstrainedSegment& operator=(const ConstrainedSegment&) = delete;

  const ReachProblem& problem() const { return problem_; }
  int joints() const { return n_; }
  bool is_held(int joint) const { return base_.is_held(joint); }
  int unknowns() const { return n_ * (1 + problem_.start.knots); }
  long rhs_evaluations() const { return shooting_.rhs_evaluations(); }

  // Evaluates for [theta_f, c]; `like` provides the expected final rates.
  const ShootingIterate& shoot(std::span<const double> y, const ShootingIterate& like, SegmentAccuracy accuracy);
  const ShootingIterate& iterate() const { return iterate_; }
  /// Number of nodes of the latest iterate. Instants refer to the same times only for equal numbers of nodes.
  int nodes() { return segment().path_points(); }

  // --- Path constraints, as in PathConstraintCheck

  /// Violation at an instant, and its gradient with respect to [theta_f, c] unless null.
  double value(const Instant& at, Eigen::VectorXd* gradient);
  bool may_touch(const Instant& at) { return check_.may_touch(at, segment().path_point(at.node)); }
  // Distance of a pair, and its gradient.
  double distance(int pair, int node, Eigen::VectorXd* gradient);
  std::vector<Found> scan(double band, double wanted, PathFigures* figures);
  std::string describe(const Found& f) { return check_.describe(f, segment().path_point(f.at.node)); }

  // --- The objective

  // Value of all terms except clearance, and its gradient with respect to [theta_f, c].
  double objective(Eigen::VectorXd* gradient, std::vector<double>* terms = nullptr);

 private:
  using PerMotion = PathConstraintCheck::PerMotion;

  static ReachProblem with_knots(const ReachProblem& problem, int knots);

  PathSegment& segment() { return shooting_.segment(); }

  // Converts derivatives with respect to the motion at a node to derivatives with respect to [theta_f, c].
  Eigen::VectorXd per_unknown(const PerMotion& d, const PathSegment::SegmentPoint& w, int node);
  // Adds the dependence through the final rates, which follow from the unknowns.
  Eigen::VectorXd through_rates(const Eigen::VectorXd& all) const;

  // --- Terms of the objective

  double end_term(const Objective::Term& term, Eigen::VectorXd* gradient);

  // PathConstraints::end_measure, by finite differences.
  double measure_term(const Objective::Term& term, Eigen::VectorXd* gradient);

  double attitude_term(double weight, Eigen::VectorXd* gradient);

  double motion_term(double weight, Eigen::VectorXd* gradient);

  double effort_term(double weight, Eigen::VectorXd* gradient);

  double wheel_term(double weight, Eigen::VectorXd* gradient);

  FloatingBase& base_;
  ReachProblem problem_;
  const PathConstraints& setup_;
  Shooting shooting_;
  PathConstraintCheck check_;
  int n_;
  ShootingIterate iterate_;
};

}  // namespace grapnel
