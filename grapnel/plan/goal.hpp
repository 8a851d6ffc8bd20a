#pragma once

/// @file
/// Goals of end-effectors at the end of a segment, as an error that vanishes there; the joint rates that produce the
/// demanded motion; and the objective that ranks solutions. Thread safety: plain values; functions use the given
/// FloatingBase as scratch.

#include <algorithm>

#include "grapnel/plan/floating_base.hpp"
#include "grapnel/plan/objective_kind.hpp"
#include "grapnel/plan/path_segment.hpp"

namespace grapnel {

/// Goal of one end-effector.
struct Goal {
  int frame = 0;            // of the model
  std::string name;         // for messages: "tip-1"
  std::string target = {};  // likewise; goals with the same target are grasp points on one rigid body; empty: none
  std::string point = {};   // name of the grasp point, for messages
  Posed X_WG = Posed::identity();  // desired pose of the frame
  Twistd V_WG = Twistd::zero();    // twist of the grasp point, at its origin, in W
  /// free: position only. axis: `axis_E` of the frame along `direction_W`. pose: R_WE = R_WG.
  enum class Orientation { free, axis, pose };
  Orientation orientation = Orientation::free;
  Vector3d axis_E{1, 0, 0};
  Vector3d direction_W{1, 0, 0};
  /// RateDemand::task also demands the angular velocity about `direction_W`.
  bool roll = false;
  /// If no exact solution exists, the closest attempt is accepted within these bounds; 0: never.
  double accepted_distance = 0;  // [m]
  double accepted_angle = 0;     // [rad]
};

/// Demanded final motion of the end-effectors, as rows of a twist relation J_g theta_dot = demand. given: the rates are
/// prescribed. velocity: the velocity of the grasp point and zero angular velocity. twist: the twist of the grasp
/// point. linear: the velocity of the grasp point only. task: the velocity, and the angular velocity about the axes
/// that the orientation constrains, plus that about the direction if Goal::roll.
enum class RateDemand { given, velocity, twist, linear, task };

/// Number of rows of one goal's error, and of all goals.
int rows_of(const Goal& goal);
int error_rows(std::span<const Goal> goals);

/// Error of all goals for a base at X_WB and the joint values placed in `base`. Per goal: p_E - p_G [m]; then for axis
/// the two components of the smallest rotation from direction_W to the axis, across the direction [rad]; for pose the
/// rotation vector of R_WE R_WG^T [rad]. All in W. `J_joint` (rows x joints) and `J_base` (rows x 6): derivatives with
/// respect to joint values at a fixed base, and to a displacement of the base in B (exact where the error vanishes).
void goal_error(const FloatingBase& base, const Posed& X_WB, std::span<const Goal> goals, Eigen::VectorXd& error,
                Eigen::MatrixXd& J_joint, Eigen::MatrixXd& J_base);
/// The error alone.
void goal_error(const FloatingBase& base, const Posed& X_WB, std::span<const Goal> goals, Eigen::VectorXd& error);

/// The two components of an axis goal's error in goal_error() as a rotation vector in W [rad].
Eigen::Vector3d across_in_world(const Goal& goal, const Eigen::Vector2d& error);

/// Difference between an end-effector's state and its goal in the components that the goal and RateDemand::task
/// constrain; zero in the others. All in W.
struct GoalGap {
  Vector3d position = Vector3d::zero();  // p_E - p_G [m]
  Vector3d turn = Vector3d::zero();      // rotation of goal_error() [rad]
  Vector3d velocity = Vector3d::zero();  // velocity of E minus that of the grasp point [m/s]
  Vector3d spin = Vector3d::zero();      // likewise [rad/s]
  /// The largest of the four norms, each in its unit.
  double largest() const { return std::max({norm(position), norm(turn), norm(velocity), norm(spin)}); }
  friend GoalGap operator-(const GoalGap& a, const GoalGap& b) {
    return {a.position - b.position, a.turn - b.turn, a.velocity - b.velocity, a.spin - b.spin};
  }
};
GoalGap goal_gap(const Goal& goal, const Posed& X_WE, const Twistd& V_WE);

/// Minimum-norm least-squares joint rates for the demand at this configuration, through the generalized Jacobian (2.5)
/// and the momentum part of the twist (2.3), and the unmet remainder.
struct DemandedRates {
  Eigen::VectorXd rates;
  double unmet = 0;              // largest component [m/s or rad/s]
  Eigen::MatrixXd G, G_inverse;  // of demand_rows(), and its pseudo-inverse
  Eigen::VectorXd unmet_part;    // b - G rates
  Eigen::VectorXd added;         // z of add_self_motion(); empty: none
};
/// `h_B`: momentum about B's origin in B. `w_B`: residual angular velocity of an attitude-controlled base about the
/// centre of mass [rad/s]. Requires place(). Not for RateDemand::given.
DemandedRates demanded_rates(const FloatingBase& base, const Posed& X_WB, const Momentumd& h_B,
                             std::span<const Goal> goals, RateDemand demand, const Vector3d& w_B = Vector3d::zero());

/// Adds the part of the rates z that moves no end-effector of the demand: rates = G^+ b + (1 - G^+ G) z, the solution
/// closest to z.
void add_self_motion(const Eigen::VectorXd& z, DemandedRates& demanded);

/// Derivatives of the demanded rates with respect to joint values at a fixed base pose (joints x joints) and to a
/// displacement of the base in B (joints x 6). With G of demand_rows(), G^+ its pseudo-inverse, rho = G^+ b,
///   d rho = -G^+ d(G rho - b) + (1 - G^+ G) dG^T G^+T rho + G^+ G^+T dG^T (b - G rho)                              (1)
/// where d(G rho - b) holds rho fixed (Golub and Pereyra 1973). The last two terms apply to redundant joints and to
/// infeasible demands. If z was added, rho - z replaces rho in G^+T rho, since G^+ then solves for b - G z. Moves the
/// base.
struct RateSensitivity {
  Eigen::MatrixXd per_angle, per_displacement;
};
RateSensitivity rate_sensitivity(FloatingBase& base, const Posed& X_WB, const Momentumd& h_B,
                                 std::span<const Goal> goals, RateDemand demand, const DemandedRates& demanded);

/// The rows of the demand: G theta_dot = b. `w_B` as above.
void demand_rows(const FloatingBase& base, const Posed& X_WB, const Momentumd& h_B, std::span<const Goal> goals,
                 RateDemand demand, Eigen::MatrixXd& G, Eigen::VectorXd& b, const Vector3d& w_B = Vector3d::zero());

// Objective of the choice among solutions. Thread safety: plain values; evaluation uses the given FloatingBase as
// scratch.

/// An objective to minimize: a weighted sum of functions of a segment's motion.
class Objective {
 public:
  using Kind = ObjectiveKind;
  struct Term {
    Kind kind = Kind::as_found;
    double weight = 1;
  };

  Objective() = default;
  /// For a segment that begins at `start`. `guess` is used by nearest, limits by limits. Terms of kind as_found
  /// contribute nothing.
  Objective(std::vector<Term> terms, const SegmentStart& start, std::vector<double> guess, std::vector<double> lower,
            std::vector<double> upper);
  Objective(Kind kind, const SegmentStart& start, std::vector<double> guess, std::vector<double> lower,
            std::vector<double> upper)
      : Objective(std::vector<Term>{{kind, 1}}, start, std::move(guess), std::move(lower), std::move(upper)) {}

  /// Terms that contribute; empty: the first solution is accepted.
  const std::vector<Term>& terms() const { return terms_; }
  bool is_empty() const { return terms_.empty(); }
  /// Whether the objective depends on final values and rates alone; otherwise solve_with_path_constraints()
  /// (path_constraints.hpp) evaluates it.
  bool depends_on_end_alone() const;
  static bool depends_on_end_alone(Kind kind);
  /// The same objective for a segment with this number of knots.
  Objective with_knots(int knots) const;

  /// Derivatives with respect to final values and rates, one per joint each, and to the coefficients of the splines.
  struct Gradient {
    std::vector<double> position, rate, coefficients;
  };
  /// Sum of the terms that depend on final values and rates alone, and its gradient unless null. `rate` may be empty:
  /// zero; `coefficients`: as in PathSegment::fly.
  /// - excursion: the amount of joint motion,
  ///   1/2 sum_j integral_0^1 (d theta_j/dx)^2 dx / integral_0^1 s'(x)^2 dx,   x = (t - begin)/(end - begin)
  /// with s of (6.1): half the sum of squared joint displacements for motions from rest to rest, more if the end rates
  /// cause overshoot.
  /// - nearest: half the sum of squared distances from the guess.
  /// - limits: half the sum of squared distances from the middles of the ranges, relative to the ranges, for joints
  /// with two finite limits.
  /// - manipulability: -log sqrt det(J_g J_g^T) summed over goals, with the rows that a goal constrains and without
  /// dependent rows; its gradient by central differences.
  double value(FloatingBase& base, std::span<const Goal> goals, std::span<const double> position,
               std::span<const double> rate, Gradient* gradient, std::span<const double> coefficients = {}) const;
  /// A symmetric positive definite approximation of the Hessian with respect to final values and coefficients: the
  /// terms excursion, nearest and limits, the weights of manipulability, and a small regularization. K: derivatives of
  /// the final rates with respect to these unknowns.
  Eigen::MatrixXd curvature(const Eigen::MatrixXd& K) const;
  /// One term without its weight; its weighted gradient is added to the given gradient.
  double term(const Term& term, FloatingBase& base, std::span<const Goal> goals, std::span<const double> position,
              std::span<const double> rate, Gradient* gradient, std::span<const double> coefficients = {}) const;

 private:
  double excursion(std::span<const double> position, std::span<const double> rate, std::span<const double> coefficients,
                   double weight, Gradient* gradient) const;

  std::vector<Term> terms_;
  SegmentStart start_;
  std::vector<double> guess_, lower_, upper_;
  // Integrals of products of s', e', b' of (6.1) and the N_k' over that of s'^2.
  Eigen::MatrixXd excursion_;
};

}  // namespace grapnel
