#pragma once

/// @file
/// One segment of an approach: the joints follow a profile from where they are to final values and rates, the base
/// answers by conservation of momentum, and where it ends depends on those values: the integral of (2.3) with its
/// sensitivities.
///
/// The joints' motion is given, so everything in FloatingBase's (5) and (6) but the base's rotation R = R_WB is a known
/// function of time, and where the centre of mass is stands fixed. What is left is a differential equation on SO(3),
///   R' = R [w x],   w = H^-1 (R^T L - u),   u = sum_j k_j theta_dot_j                                              (1)
/// solved for the quaternion by Gauss-Legendre collocation: H and u are worked out once at each node, the rotation at
/// the nodes follows by fixed-point iteration, which costs no kinematics. The order is twice the number of nodes of a
/// panel, and panels are halved until the last Legendre coefficients of w say that the nodes resolve it.
///
/// With x = (final values, final rates) the joints move as theta(t) = ... + a(t) final + b(t) final_rate. A small
/// rotation eta of the base, in W, obeys
///   d(deta/dx)/dt = N deta/dx - R H^-1 (g_j a + k_j a'),   N = R H^-1 R^T [L x],   deta/dx = 0 at the start        (2)
/// (b for a where x is a final rate), so that with Phi' = N Phi, Phi = 1 at the start, it is a quadrature at the same
/// nodes,
///   deta/dx (T) = -Phi(T) integral Phi^-1 R H^-1 (g_j a + k_j a') dt.                                              (3)
/// The base's origin is at p_WB = p_WCom - R c(theta), so its displacement follows from eta and dc/dtheta. Where a
/// spline gives the joints more freedom (joint_spline.hpp) its coefficients stand beside final values and rates, with
/// N_k for a. At a node on the way (3) is the sum over the panels before and the collocation's own integral in its
/// panel.
///
/// What nodes need of each other is the rotation alone, so the rest is worked out in SIMD lanes, a node in each
/// (segment_nodes.hpp), with the same bits on every machine.

#include <memory>
#include <string>

#include "grapnel/integrate/gauss_legendre.hpp"
#include "grapnel/pack/dispatch.hpp"
#include "grapnel/plan/floating_base.hpp"
#include "grapnel/plan/joint_spline.hpp"
#include "grapnel/plan/segment_nodes.hpp"

namespace grapnel {

/// q over its length.
Quaterniond normalized(const Quaterniond& q);

/// What the servicer's momentum and centre of mass do while nothing but uniform gravity acts from outside.
struct FreeMotion {
  double time = 0;                      // when the rest was taken [s]
  Vector3d p_WCom = Vector3d::zero();   // centre of mass in W [m]
  Momentumd h = Momentumd::zero();      // [about the centre of mass; linear] in W
  double mass = 1;                      // [kg]
  Vector3d gravity = Vector3d::zero();  // in W [m/s^2]

  /// Where the centre of mass is at time t, in W.
  Vector3d com_at(double t) const;
  /// Momentum about B's origin in B, at time t, for a base at X_WB.
  Momentumd in_base(double t, const Posed& X_WB) const;
};
/// Of a servicer's state.
FreeMotion free_motion(const Model& model, const State& state, double time, const Vector3d& gravity);

/// Where a segment begins.
struct SegmentStart {
  double begin = 0, end = 0;  // [s]
  JointProfile profile = JointProfile::quintic;
  std::vector<double> position, rate;  // per joint
  Posed X_WB = Posed::identity();
  int knots = 0;  // inner knots of the joints' splines
};

/// Where it ends.
struct SegmentEnd {
  bool finished = false;
  std::string failure;
  Posed X_WB = Posed::identity();
  Matrix6Xd per_position;     // displacement of the base, in B, per final joint value; with sensitivities only
  Matrix6Xd per_rate;         // per final joint rate
  Matrix6Xd per_coefficient;  // per coefficient of the splines
};

/// How well the base's rotation is integrated: search to some 1e-8 rad, full to rounding.
enum class SegmentAccuracy { search, full };

class PathSegment {
 public:
  /// `base` is shared scratch and must outlive the segment. `set`: of the lanes, one lane where it is empty; no bit
  /// depends on it. @throws std::runtime_error where GRAPNEL_LANES names no instruction set that runs here.
  PathSegment(FloatingBase& base, SegmentStart start, FreeMotion motion,
              std::optional<lanes::InstructionSet> set = lanes::best_instruction_set());

  /// Flies it to these final values and rates (one per joint), where it leaves `base` placed, unless it does not
  /// finish. `coefficients`: c_kj of (1) of joint_spline.hpp, those of N_0 for all joints first; empty: zero.
  SegmentEnd fly(std::span<const double> position, std::span<const double> rate, bool sensitivities,
                 SegmentAccuracy accuracy = SegmentAccuracy::full, std::span<const double> coefficients = {});

  /// The way at the nodes is kept by each flight from now on, sensitivities too where the flight has them; there are at
  /// least so many panels.
  void keep_way(int least_panels);
  /// Where the servicer is at a node of the last flight.
  struct WayPoint {
    double time = 0, weight = 0;                       // [s]; weights add up to the segment's duration
    std::vector<double> position, rate, acceleration;  // of the joints
    Posed X_WB = Posed::identity();
    Vector3d w_B = Vector3d::zero();  // of the base, in B
    JointPoint a, b;                  // of (2), per final value and final rate
    std::span<const JointPoint> N;    // per coefficient
    const PathSegment* of = nullptr;  // whose node it is, unless
    int node = 0;
    const PlacedLinks* placed = nullptr;  // says where the links are

    /// Put together when somebody asks.
    const PlacedLinks& links() const { return placed ? *placed : of->links_at(node); }
  };
  /// Of the last flight; none if it did not come to its end. Other flights may have other numbers of them.
  int way_points() const { return way_points_; }
  WayPoint way_point(int node) const;
  /// The links there, until the next flight.
  const PlacedLinks& links_at(int node) const;
  /// eta of (3) at a node, 3 x [final values, final rates, coefficients].
  Eigen::Matrix3Xd turn_per_unknown(int node) const;
  /// How w_B changes with them there, 3 x the same; of a flight with sensitivities.
  Eigen::Matrix3Xd w_per_unknown(int node);

  const SegmentStart& start() const { return start_; }
  const FreeMotion& motion() const { return motion_; }
  FloatingBase& base() const { return base_; }
  /// The path of joint j for these final values.
  JointPath path(int j, double position, double rate) const;
  /// The same with the spline.
  std::vector<JointPiece> pieces(int j, double position, double rate, std::span<const double> coefficients) const;
  /// Nodes so far, at each of which the links were placed once.
  long rhs_evaluations() const { return evaluations_; }

 private:
  // One node of the quadrature.
  struct Node {
    double time = 0;     // [s]
    JointPoint a, b, c;  // theta = start + a (final - start) + b final_rate + c start_rate
  };

  int joints() const { return base_.joints(); }
  int unknowns() const { return joints() * (2 + spline_.knots()); }
  int nodes() const { return static_cast<int>(nodes_.size()); }
  bool driven() const { return dot(motion_.h.angular, motion_.h.angular) > 0; }

  void lay_panels(int panels);
  NodePanel panel_of(std::span<const double> position, std::span<const double> rate,
                     std::span<const double> coefficients) const;
  // Rotation at the nodes and at the end; how badly the nodes resolve it [rad]. Infinite where the fixed-point
  // iteration does not converge. With `sensitivities` phi_ and sums_ too, where that is no more than `tolerance`.
  double turn(NodePanel& panel, double tolerance, bool sensitivities, Quaterniond& end);
  void add_sensitivities(const Quaterniond& q, SegmentEnd& end);
  Eigen::Matrix3Xd summed() const;
  // Numbers of a node, see SegmentNodes::numbers.
  double number(int node, int index) const {
    const int lanes = lanes_->lanes;
    return lanes_->numbers[(static_cast<std::ptrdiff_t>(node / lanes) * layout_.size + index) * lanes + node % lanes];
  }
  Vector3d vector_at(int node, int index) const {
    return {number(node, index), number(node, index + 1), number(node, index + 2)};
  }
  // At a node, per unknown of basis function times g and k: f(unknown, basis, joint).
  template <class F>
  void for_each_unknown(int node, F f) const;
  const Eigen::Matrix3Xd& turning_at(int node) const;
  void forget_nodes();

  FloatingBase& base_;
  SegmentStart start_;
  FreeMotion motion_;
  JointSpline spline_;
  NodeLayout layout_;
  std::unique_ptr<SegmentNodes> lanes_;
  bool keeps_way_ = false;
  int least_panels_;  // a multiple of the spline's pieces, as are all numbers of panels
  std::vector<double> position_, rate_, coefficients_;  // of the last flight
  std::vector<Eigen::Matrix3Xd> turned_;                // integral of (3) up to the begin of each panel
  int panels_[2];                                       // to begin with, per SegmentAccuracy
  int laid_ = 0;                                        // panels of nodes_
  int way_points_ = 0;
  std::vector<Node> nodes_;
  std::vector<JointPoint> N_;            // of the spline, per node
  std::vector<double> basis_, weights_;  // as NodePanel has them
  Eigen::Matrix3d phi_;                  // of (3), where a panel begins, and in the end at the segment's end
  std::vector<double> sums_;             // as NodePanel has them
  // Per node, where somebody has asked since the last flight: its links and the integrand of (3).
  mutable std::vector<PlacedLinks> placed_;
  mutable std::vector<Eigen::Matrix3Xd> turning_;
  mutable std::vector<bool> is_placed_, has_turning_;
  long evaluations_ = 0;
};

}  // namespace grapnel
