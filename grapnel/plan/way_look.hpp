#pragma once

/// @file
/// What is violated on a way, and where, and how that changes with the motion there: limits of joints, distances of
/// bodies, the base's turn, wheels' momenta, as WaySetup asks for them. What the motion is made of is another's matter:
/// SegmentWay's final values and splines, StraightWay's self-motion.

#include <functional>
#include <map>

#include "grapnel/plan/joint_efforts.hpp"
#include "grapnel/plan/reach.hpp"

namespace grapnel {

class WayLook {
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
  /// Where the servicer is at a node; what the motion is made of is not read.
  using PointAt = std::function<PathSegment::WayPoint(int node)>;

  /// Derivatives with what a node's motion is made of.
  struct PerMotion {
    Eigen::VectorXd position, rate, acceleration;    // of the joints
    Eigen::Vector3d turn = Eigen::Vector3d::Zero();  // of the base, a small rotation in W

    explicit PerMotion(int n)
        : position(Eigen::VectorXd::Zero(n)), rate(Eigen::VectorXd::Zero(n)), acceleration(Eigen::VectorXd::Zero(n)) {}
  };

  /// `base` is shared scratch; both must outlive the object. Of the problem its limits, motion and way are read.
  WayLook(FloatingBase& base, const ReachProblem& problem);
  WayLook(const WayLook&) = delete;
  WayLook& operator=(const WayLook&) = delete;

  /// All instants at which something is violated by more than -`band`: the local maxima over the nodes. `wanted`: a
  /// distance below which pairs count whatever is asked, as violated by wanted - band - distance where that is more.
  std::vector<Found> scan(int nodes, const PointAt& point_at, double band, double wanted, WayFigures* figures);

  /// By how much something is violated there; adds the derivatives to `d` unless null.
  double violation(const Instant& at, const PathSegment::WayPoint& w, PerMotion* d);

  /// In words, for users.
  std::string describe(const Found& f, const PathSegment::WayPoint& w) const;

  /// Whether it is the distance of a hand from its target near the grasp point, of which nothing is asked.
  bool may_touch(const Instant& at, const PathSegment::WayPoint& w);

  /// Distance of a pair, and its derivatives.
  double distance(int pair, const PathSegment::WayPoint& w, PerMotion* d);

  void evaluate_efforts(const std::vector<double>& position, const std::vector<double>& rate,
                        const std::vector<double>& acceleration, const Posed& X_WB, double time,
                        std::span<double> effort);
  /// Derivatives of a weighted sum of efforts; by differences where rotors have axes of their own.
  void add_effort_change(const PathSegment::WayPoint& w, const std::vector<double>& effort,
                         const Eigen::VectorXd& weights, PerMotion& d);

  double wheel_share(int wheel, const PathSegment::WayPoint& w) const;
  /// Derivatives of a weighted sum of shares, (3) of wheel_momentum.hpp.
  void add_wheel_change(const PathSegment::WayPoint& w, std::span<const double> weights, PerMotion& d);

 private:
  bool looks_at_efforts() const;
  double effort_violation(const Instant& at, const PathSegment::WayPoint& w, PerMotion* d);

  // Calls at(kept, sign, violation) for both sides of a joint's position and rate.
  template <class At>
  void look_at_joint(int joint, const PathSegment::WayPoint& w, WayFigures* figures, At&& at);

  void place(const PathSegment::WayPoint& w, Kinematics& at);
  bool may_touch(int pair, const PathSegment::WayPoint& w, const Kinematics& at) const;
  template <class Note>
  void look_at_distances(int node, const PathSegment::WayPoint& w, const Kinematics& at, double band, double wanted,
                         WayFigures* figures, Note&& note);
  // (2) of way.hpp along n, for a point at p_W of a body.
  void add_point(int body, const Vector3d& p_W, const Vector3d& n, const PathSegment::WayPoint& w, PerMotion& d);

  FloatingBase& base_;
  const ReachProblem& problem_;
  const WaySetup& setup_;
  JointEfforts efforts_;
  JointEfforts::Gradient effort_change_;
  int n_;
  std::map<double, std::vector<Posed>> others_;  // at the nodes' times, where the servicer does not carry them
};

}  // namespace grapnel
