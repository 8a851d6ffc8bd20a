#pragma once

/// @file
/// Evaluates the path constraints of a PathConstraints: joint limits, distances of bodies, rotation of the base, wheel
/// momenta. Reports violations, their instants and their derivatives with respect to the motion there. The parameters
/// of the motion are the caller's: final values and splines in ConstrainedSegment, a self-motion in
/// ConstrainedStraightIn.

#include <functional>
#include <map>

#include "grapnel/plan/joint_efforts.hpp"
#include "grapnel/plan/reach.hpp"

namespace grapnel {

class PathConstraintCheck {
 public:
  /// Kinds of path constraints. Values are positive if violated: positions [rad or m], rates and efforts as a share of
  /// their limits minus one, distances [m], rotation of the base [rad], wheel momenta as a share of the wheel's
  /// capacity.
  enum class Kept { position, rate, effort, clearance, base_turn, wheel };
  struct Instant {
    Kept kept = Kept::position;
    int index = 0;    // joint, pair or wheel
    double sign = 1;  // +1: upper limit, -1: lower limit
    int node = 0;
    bool operator==(const Instant&) const = default;
  };
  struct Found {
    Instant at;
    double value = 0;
  };
  /// State of the servicer at a node; the parameters of the motion are not read.
  using PointAt = std::function<PathSegment::SegmentPoint(int node)>;

  /// Derivatives with respect to the motion at a node.
  struct PerMotion {
    Eigen::VectorXd position, rate, acceleration;    // of the joints
    Eigen::Vector3d turn = Eigen::Vector3d::Zero();  // rotation of the base, a small rotation in W

    explicit PerMotion(int n)
        : position(Eigen::VectorXd::Zero(n)), rate(Eigen::VectorXd::Zero(n)), acceleration(Eigen::VectorXd::Zero(n)) {}
  };

  /// `base` is shared scratch; both arguments must outlive the object. Reads the limits, the motion and the path
  /// constraints of the problem.
  PathConstraintCheck(FloatingBase& base, const ReachProblem& problem);
  PathConstraintCheck(const PathConstraintCheck&) = delete;
  PathConstraintCheck& operator=(const PathConstraintCheck&) = delete;

  /// All instants with a violation above -`band`: local maxima over the nodes. Pairs closer than `wanted` are included
  /// even without a distance constraint; their violation is wanted - band - distance if that is larger.
  std::vector<Found> scan(int nodes, const PointAt& point_at, double band, double wanted, PathFigures* figures);

  /// Violation at an instant; adds its derivatives to `d` unless null.
  double violation(const Instant& at, const PathSegment::SegmentPoint& w, PerMotion* d);

  /// Message for the user.
  std::string describe(const Found& f, const PathSegment::SegmentPoint& w) const;

  /// Whether the instant concerns the distance of an end-effector from its target near the grasp point, which is
  /// unconstrained.
  bool may_touch(const Instant& at, const PathSegment::SegmentPoint& w);

  /// Distance of a pair, and its derivatives.
  double distance(int pair, const PathSegment::SegmentPoint& w, PerMotion* d);

  void evaluate_efforts(const std::vector<double>& position, const std::vector<double>& rate,
                        const std::vector<double>& acceleration, const Posed& X_WB, double time,
                        std::span<double> effort);
  /// Derivatives of a weighted sum of efforts; by finite differences if rotors have stated axes.
  void add_effort_change(const PathSegment::SegmentPoint& w, const std::vector<double>& effort,
                         const Eigen::VectorXd& weights, PerMotion& d);

  double wheel_share(int wheel, const PathSegment::SegmentPoint& w) const;
  /// Derivatives of a weighted sum of wheel shares, (3) of wheel_momentum.hpp.
  void add_wheel_change(const PathSegment::SegmentPoint& w, std::span<const double> weights, PerMotion& d);

 private:
  bool checks_efforts() const;
  double effort_violation(const Instant& at, const PathSegment::SegmentPoint& w, PerMotion* d);

  // Calls at(kept, sign, violation) for both limits of a joint's position and rate.
  template <class At>
  void check_joint_limits(int joint, const PathSegment::SegmentPoint& w, PathFigures* figures, At&& at);

  void place(const PathSegment::SegmentPoint& w, Kinematics& at);
  bool may_touch(int pair, const PathSegment::SegmentPoint& w, const Kinematics& at) const;
  template <class Note>
  void check_distances(int node, const PathSegment::SegmentPoint& w, const Kinematics& at, double band, double wanted,
                       PathFigures* figures, Note&& note);
  // (2) of path_constraints.hpp along n, for a point at p_W of a body.
  void add_point(int body, const Vector3d& p_W, const Vector3d& n, const PathSegment::SegmentPoint& w, PerMotion& d);

  FloatingBase& base_;
  const ReachProblem& problem_;
  const PathConstraints& setup_;
  JointEfforts efforts_;
  JointEfforts::Gradient effort_change_;
  int n_;
  std::map<double, std::vector<Posed>>
      others_;  // at the times of the nodes: poses of bodies not carried by the servicer
};

}  // namespace grapnel
