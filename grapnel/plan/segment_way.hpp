#pragma once

/// @file
/// One segment whose way is looked at and improved: what is violated on it and where, the objective, and how both
/// change with the final joint values and the coefficients of the splines; (1) and (2) of way.hpp.

#include <map>

#include "grapnel/plan/joint_efforts.hpp"
#include "grapnel/plan/reach.hpp"
#include "grapnel/plan/shooting.hpp"

namespace grapnel {

class SegmentWay {
 public:
  /// What may be violated. Positive where it is: positions [rad or m], rates and efforts as a share of their limits
  /// less one, distances [m], the base's turn [rad], wheels' momenta as a share of the most that they can hold.
  enum class Kept { position, rate, effort, clearance, base_turn, wheel };
  struct Instant {
    Kept kept = Kept::position;
    int index = 0;    // joint, pair or wheel
    double sign = 1;  // of the limit
    int node = 0;
    bool operator==(const Instant&) const = default;
  };
  struct Found {
    Instant at;
    double value = 0;
  };

  /// `base` is shared scratch and must outlive it. At least so many panels of 16 nodes are looked at.
  SegmentWay(FloatingBase& base, const ReachProblem& problem, int knots, int panels);
  SegmentWay(const SegmentWay&) = delete;
  SegmentWay& operator=(const SegmentWay&) = delete;

  const ReachProblem& problem() const { return problem_; }
  int joints() const { return n_; }
  bool is_held(int joint) const { return base_.is_held(joint); }
  int unknowns() const { return n_ * (1 + problem_.start.knots); }
  long rhs_evaluations() const { return shooting_.rhs_evaluations(); }

  // Evaluates for [theta_f, c]; `like` knows the rates to expect.
  const Shot& shoot(std::span<const double> y, const Shot& like, SegmentAccuracy accuracy);
  const Shot& shot() const { return shot_; }

  // --- What is kept, at one instant

  /// By how much something is violated there, and the gradient for [theta_f, c] unless null.
  double value(const Instant& at, Eigen::VectorXd* gradient);

  // Whether it is the distance of a hand from its target near the grasp point, of which nothing is asked.
  bool may_touch(const Instant& at);

  // Distance of a pair, and how it changes.
  double distance(int pair, int node, Eigen::VectorXd* gradient);

  // --- The whole way

  // All instants at which something is violated by more than -`band`: the local maxima over the nodes. `wanted`: a
  // distance below which pairs count whatever is asked, as violated by wanted - band - distance where that is more.
  std::vector<Found> scan(double band, double wanted, WayFigures* figures);

  // In words, for users.
  std::string describe(const Found& f);

  // --- The objective

  // Value of all terms but the clearance's, and its gradient for [theta_f, c].
  double objective(Eigen::VectorXd* gradient, std::vector<double>* terms = nullptr);

 private:
  // Derivatives with what a node's motion is made of.
  struct PerMotion {
    Eigen::VectorXd position, rate, acceleration;  // of the joints
    Eigen::Vector3d turn = Eigen::Vector3d::Zero();

    explicit PerMotion(int n)
        : position(Eigen::VectorXd::Zero(n)), rate(Eigen::VectorXd::Zero(n)), acceleration(Eigen::VectorXd::Zero(n)) {}
  };

  static ReachProblem with_knots(const ReachProblem& problem, int knots);

  PathSegment& segment() { return shooting_.segment(); }

  bool looks_at_efforts() const;

  void evaluate_efforts(const std::vector<double>& position, const std::vector<double>& rate,
                        const std::vector<double>& acceleration, const Posed& X_WB, double time,
                        std::span<double> effort);

  // From derivatives with the motion at a node to those with [theta_f, c].
  Eigen::VectorXd per_unknown(const PerMotion& d, const PathSegment::WayPoint& w, int node);
  // Final rates follow from the unknowns.
  Eigen::VectorXd through_rates(const Eigen::VectorXd& all) const;

  double violation(const Instant& at, const PathSegment::WayPoint& w, PerMotion* d);

  // Calls at(kept, sign, violation) for both sides of a joint's position and rate.
  template <class At>
  void look_at_joint(int joint, const PathSegment::WayPoint& w, WayFigures* figures, At&& at);

  double effort_violation(const Instant& at, const PathSegment::WayPoint& w, PerMotion* d);

  // Derivatives of a weighted sum of efforts; by differences where rotors have axes of their own.
  void add_effort_change(const PathSegment::WayPoint& w, const std::vector<double>& effort,
                         const Eigen::VectorXd& weights, PerMotion& d);

  double wheel_share(int wheel, const PathSegment::WayPoint& w) const;
  // Derivatives of a weighted sum of shares, (3) of wheel_momentum.hpp.
  void add_wheel_change(const PathSegment::WayPoint& w, std::span<const double> weights, PerMotion& d);

  // --- Distances

  void place(const PathSegment::WayPoint& w, Kinematics& at);

  bool may_touch(int pair, const PathSegment::WayPoint& w, const Kinematics& at) const;

  template <class Note>
  void look_at_distances(int node, const PathSegment::WayPoint& w, const Kinematics& at, double band, double wanted,
                         WayFigures* figures, Note&& note);

  double distance(int pair, const PathSegment::WayPoint& w, PerMotion* d);

  // (2) along n, for a point at p_W of a body.
  void add_point(int body, const Vector3d& p_W, const Vector3d& n, const PathSegment::WayPoint& w, PerMotion& d);

  // --- Terms of the objective

  double end_term(const Objective::Term& term, Eigen::VectorXd* gradient);

  // WaySetup::end_measure, by differences.
  double measure_term(const Objective::Term& term, Eigen::VectorXd* gradient);

  double attitude_term(double weight, Eigen::VectorXd* gradient);

  double motion_term(double weight, Eigen::VectorXd* gradient);

  double effort_term(double weight, Eigen::VectorXd* gradient);

  double wheel_term(double weight, Eigen::VectorXd* gradient);

  FloatingBase& base_;
  ReachProblem problem_;
  const WaySetup& setup_;
  Shooting shooting_;
  JointEfforts efforts_;
  JointEfforts::Gradient effort_change_;
  int n_;
  Shot shot_;
  std::map<double, std::vector<Posed>> others_;  // at the nodes' times, where the servicer does not carry them
};

}  // namespace grapnel
