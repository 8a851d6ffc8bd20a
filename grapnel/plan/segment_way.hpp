#pragma once

/// @file
/// One segment with path constraints: evaluates the violations, their instants and the objective, and the derivatives
/// of both with respect to the final joint values and the spline coefficients; (1) and (2) of way.hpp.

#include "grapnel/plan/shooting.hpp"
#include "grapnel/plan/way_look.hpp"

namespace grapnel {

class SegmentWay {
 public:
  using Instant = WayLook::Instant;
  using Found = WayLook::Found;

  /// `base` is shared scratch and must outlive the object. `panels`: minimum number of panels of 16 nodes to evaluate.
  SegmentWay(FloatingBase& base, const ReachProblem& problem, int knots, int panels);
  SegmentWay(const SegmentWay&) = delete;
  SegmentWay& operator=(const SegmentWay&) = delete;

  const ReachProblem& problem() const { return problem_; }
  int joints() const { return n_; }
  bool is_held(int joint) const { return base_.is_held(joint); }
  int unknowns() const { return n_ * (1 + problem_.start.knots); }
  long rhs_evaluations() const { return shooting_.rhs_evaluations(); }

  // Evaluates for [theta_f, c]; `like` provides the expected final rates.
  const Shot& shoot(std::span<const double> y, const Shot& like, SegmentAccuracy accuracy);
  const Shot& shot() const { return shot_; }
  /// Number of nodes of the latest shot. Instants refer to the same times only for equal numbers of nodes.
  int nodes() { return segment().way_points(); }

  // --- Path constraints, as in WayLook

  /// Violation at an instant, and its gradient with respect to [theta_f, c] unless null.
  double value(const Instant& at, Eigen::VectorXd* gradient);
  bool may_touch(const Instant& at) { return look_.may_touch(at, segment().way_point(at.node)); }
  // Distance of a pair, and its gradient.
  double distance(int pair, int node, Eigen::VectorXd* gradient);
  std::vector<Found> scan(double band, double wanted, WayFigures* figures);
  std::string describe(const Found& f) { return look_.describe(f, segment().way_point(f.at.node)); }

  // --- The objective

  // Value of all terms except clearance, and its gradient with respect to [theta_f, c].
  double objective(Eigen::VectorXd* gradient, std::vector<double>* terms = nullptr);

 private:
  using PerMotion = WayLook::PerMotion;

  static ReachProblem with_knots(const ReachProblem& problem, int knots);

  PathSegment& segment() { return shooting_.segment(); }

  // Converts derivatives with respect to the motion at a node to derivatives with respect to [theta_f, c].
  Eigen::VectorXd per_unknown(const PerMotion& d, const PathSegment::WayPoint& w, int node);
  // Adds the dependence through the final rates, which follow from the unknowns.
  Eigen::VectorXd through_rates(const Eigen::VectorXd& all) const;

  // --- Terms of the objective

  double end_term(const Objective::Term& term, Eigen::VectorXd* gradient);

  // WaySetup::end_measure, by finite differences.
  double measure_term(const Objective::Term& term, Eigen::VectorXd* gradient);

  double attitude_term(double weight, Eigen::VectorXd* gradient);

  double motion_term(double weight, Eigen::VectorXd* gradient);

  double effort_term(double weight, Eigen::VectorXd* gradient);

  double wheel_term(double weight, Eigen::VectorXd* gradient);

  FloatingBase& base_;
  ReachProblem problem_;
  const WaySetup& setup_;
  Shooting shooting_;
  WayLook look_;
  int n_;
  Shot shot_;
};

}  // namespace grapnel
