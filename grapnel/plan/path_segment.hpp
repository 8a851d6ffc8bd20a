#pragma once

/// @file
/// One segment of an approach. The joints follow a profile from their initial state to final values and rates, and the
/// base moves by conservation of momentum. Integrates (2.3) for the final base pose, with sensitivities to the final
/// values and rates.
///
/// The joint motion is given. Therefore everything in (5) and (6) of floating_base.hpp except the base's rotation R =
/// R_WB is a known function of time, and the motion of the centre of mass is known. The remaining differential equation
/// on SO(3),
///   R' = R [w x],   w = H^-1 (R^T L - u),   u = sum_j k_j theta_dot_j                                              (1)
/// is solved for the quaternion by Gauss-Legendre collocation. H and u are computed once per node; fixed-point
/// iteration gives the rotation at the nodes without further kinematics. The order is twice the number of nodes of a
/// panel. Panels are halved until the last Legendre coefficients of w show that the nodes resolve it.
///
/// With x = (final values, final rates) the joints move as theta(t) = ... + a(t) final + b(t) final_rate. A small
/// rotation eta of the base, in W, satisfies
///   d(deta/dx)/dt = N deta/dx - R H^-1 (g_j a + k_j a'),   N = R H^-1 R^T [L x],   deta/dx = 0 at the start        (2)
/// (b for a if x is a final rate). With Phi' = N Phi, Phi = 1 at the start, this is a quadrature at the same nodes,
///   deta/dx (T) = -Phi(T) integral Phi^-1 R H^-1 (g_j a + k_j a') dt.                                              (3)
/// The base's origin is at p_WB = p_WCom - R c(theta), so its displacement follows from eta and dc/dtheta. The
/// coefficients of joint splines (joint_spline.hpp) are further unknowns, with N_k for a. At an inner node, (3) is the
/// sum over the previous panels plus the collocation's integral within its panel.
///
/// Nodes are coupled only through the rotation. Everything else is computed in SIMD lanes, one node per lane
/// (segment_nodes.hpp), with identical bits on every machine.

#include <memory>
#include <string>

#include "grapnel/integrate/gauss_legendre.hpp"
#include "grapnel/plan/floating_base.hpp"
#include "grapnel/plan/joint_spline.hpp"
#include "grapnel/plan/segment_nodes.hpp"
#include "grapnel/spatial/dispatch.hpp"

namespace grapnel {

/// The unit quaternion q/|q|.
Quaterniond normalized(const Quaterniond& q);

/// Momentum and centre of mass of the servicer under uniform gravity alone.
struct FreeMotion {
  double time = 0;                      // time of the other members [s]
  Vector3d p_WCom = Vector3d::zero();   // centre of mass in W [m]
  Momentumd h = Momentumd::zero();      // [about the centre of mass; linear] in W
  double mass = 1;                      // [kg]
  Vector3d gravity = Vector3d::zero();  // in W [m/s^2]

  /// Position of the centre of mass at time t, in W.
  Vector3d com_at(double t) const;
  /// Momentum about B's origin in B, at time t, for a base at X_WB.
  Momentumd in_base(double t, const Posed& X_WB) const;
};
/// Momentum and centre of mass of a servicer's state.
FreeMotion free_motion(const Model& model, const State& state, double time, const Vector3d& gravity);

/// Initial state of a segment.
struct SegmentStart {
  double begin = 0, end = 0;  // [s]
  JointProfile profile = JointProfile::quintic;
  std::vector<double> position, rate;  // per joint
  Posed X_WB = Posed::identity();
  int knots = 0;  // inner knots of the joint splines
};

/// Final state of a segment.
struct SegmentEnd {
  bool finished = false;
  std::string failure;
  Posed X_WB = Posed::identity();
  Matrix6Xd per_position;     // displacement of the base, in B, per final joint value; only with sensitivities
  Matrix6Xd per_rate;         // per final joint rate
  Matrix6Xd per_coefficient;  // per coefficient of the splines
};

/// Accuracy of the base's rotation: search about 1e-8 rad, full to rounding error.
enum class SegmentAccuracy { search, full };

class PathSegment {
 public:
  /// `base` is shared scratch and must outlive the segment. `set`: instruction set; empty: one lane. Results do not
  /// depend on it. @throws std::runtime_error if GRAPNEL_LANES names an instruction set that this processor lacks.
  PathSegment(FloatingBase& base, SegmentStart start, FreeMotion motion,
              std::optional<lanes::InstructionSet> set = lanes::best_instruction_set());

  /// Integrates to these final values and rates (one per joint) and leaves `base` placed there, unless the integration
  /// fails. `coefficients`: c_kj of (1) of joint_spline.hpp, all joints of N_0 first; empty: zero.
  SegmentEnd integrate(std::span<const double> position, std::span<const double> rate, bool sensitivities,
                       SegmentAccuracy accuracy = SegmentAccuracy::full, std::span<const double> coefficients = {});

  /// Each following integration stores the motion at its nodes, including sensitivities if computed. Sets the minimum
  /// number of panels.
  void solve_with_path_constraints(int min_panels);
  /// State of the servicer at a node of the last integration.
  struct SegmentPoint {
    double time = 0, weight = 0;                       // [s]; weights add up to the segment's duration
    std::vector<double> position, rate, acceleration;  // of the joints
    Posed X_WB = Posed::identity();
    Vector3d w_B = Vector3d::zero();  // of the base, in B
    JointPoint a, b;                  // of (2), per final value and final rate
    std::span<const JointPoint> N;    // per coefficient
    const PathSegment* of = nullptr;  // segment of the node, unless
    int node = 0;
    const PlacedLinks* placed = nullptr;  // provides the links' poses

    /// Evaluated on demand.
    const PlacedLinks& links() const { return placed ? *placed : of->links_at(node); }
  };
  /// Number of nodes of the last integration, 0 if it failed. It may differ from one integration to the next.
  int path_points() const { return path_points_; }
  SegmentPoint path_point(int node) const;
  /// The links there, valid until the next integration.
  const PlacedLinks& links_at(int node) const;
  /// eta of (3) at a node, 3 x [final values, final rates, coefficients].
  Eigen::Matrix3Xd turn_per_unknown(int node) const;
  /// Derivatives of w_B, same shape; requires an integration with sensitivities.
  Eigen::Matrix3Xd w_per_unknown(int node);

  const SegmentStart& start() const { return start_; }
  const FreeMotion& motion() const { return motion_; }
  FloatingBase& base() const { return base_; }
  /// The path of joint j for these final values.
  JointPath path(int j, double position, double rate) const;
  /// The same with the spline.
  std::vector<JointSegment> joint_segments(int j, double position, double rate,
                                           std::span<const double> coefficients) const;
  /// Number of nodes evaluated so far; each places the links once.
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
  // Rotation at the nodes and at the end => estimated error of the collocation [rad]; infinite if the fixed-point
  // iteration does not converge. With `sensitivities` also phi_ and sums_, if the error is at most `tolerance`.
  double turn(NodePanel& panel, double tolerance, bool sensitivities, Quaterniond& end);
  void add_sensitivities(const Quaterniond& q, SegmentEnd& end);
  Eigen::Matrix3Xd summed() const;
  // Value `index` of a node, see SegmentNodes::numbers.
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
  bool has_path_constraints_ = false;
  int min_panels_;  // a multiple of the spline's spans, as are all numbers of panels
  std::vector<double> position_, rate_, coefficients_;  // of the last integration
  std::vector<Eigen::Matrix3Xd> turned_;                // integral of (3) up to the begin of each panel
  int panels_[2];                                       // initial number, per SegmentAccuracy
  int laid_ = 0;                                        // panels of nodes_
  int path_points_ = 0;
  std::vector<Node> nodes_;
  std::vector<JointPoint> N_;            // of the spline, per node
  std::vector<double> basis_, weights_;  // layout as in NodePanel
  Eigen::Matrix3d phi_;                  // of (3), at the begin of the current panel; finally at the segment's end
  std::vector<double> sums_;             // layout as in NodePanel
  // Cache per node since the last integration: its links and the integrand of (3).
  mutable std::vector<PlacedLinks> placed_;
  mutable std::vector<Eigen::Matrix3Xd> turning_;
  mutable std::vector<bool> is_placed_, has_turning_;
  long evaluations_ = 0;
};

}  // namespace grapnel
