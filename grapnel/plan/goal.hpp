#pragma once

/// @file
/// What an end-effector is to be and do at the end of a segment, as an error that vanishes there, and the joint rates
/// that give it the motion asked for; and the objective, which of many solutions is the better one. Thread safety:
/// plain values; functions use the FloatingBase they are given as scratch.

#include <algorithm>

#include "grapnel/plan/floating_base.hpp"
#include "grapnel/plan/objective_kind.hpp"
#include "grapnel/plan/path_segment.hpp"

namespace grapnel {

/// Goal of one end-effector.
struct Goal {
  int frame = 0;                   // of the model
  std::string name;                // for messages: "tip-1"
  std::string target = {};         // likewise; goals with the same one are places on one rigid body; empty: none
  std::string point = {};          // name of the place on the target, for messages
  Posed X_WG = Posed::identity();  // where the frame is to be
  Twistd V_WG = Twistd::zero();    // of the place, at its origin, in W
  /// free: position only. axis: `axis_E` of the frame along `direction_W`. pose: R_WE = R_WG.
  enum class Orientation { free, axis, pose };
  Orientation orientation = Orientation::free;
  Vector3d axis_E{1, 0, 0};
  Vector3d direction_W{1, 0, 0};
  /// RateDemand::task asks for the spin about `direction_W` as well.
  bool roll = false;
  /// Where no exact solution is found, the closest attempt will do if it leaves no more than this; 0: it will not.
  double accepted_distance = 0;  // [m]
  double accepted_angle = 0;     // [rad]
};

/// What the end-effectors' motion at the end is to be, as rows of a twist relation J_g theta_dot = demand.
/// given: the rates are prescribed. velocity: the place's velocity, without spin. twist: the place's whole twist.
/// linear: the place's velocity alone. task: the velocity, and as much of the spin as the orientation asks for, with
/// that about the direction if Goal::roll.
enum class RateDemand { given, velocity, twist, linear, task };

/// Number of rows of one goal's error, and of that of all.
int rows_of(const Goal& goal);
int error_rows(std::span<const Goal> goals);

/// Error of all goals for a base at X_WB and joints as placed in `base`: per goal p_E - p_G [m], then for axis the two
/// components of the smallest rotation from direction_W to the axis, across the direction [rad], for pose the rotation
/// vector of R_WE R_WG^T [rad]; all in W. `J_joint` (rows x joints) and `J_base` (rows x 6): how it changes with joint
/// values at a fixed base, and with a displacement of the base in B (exact where the error vanishes).
void goal_error(const FloatingBase& base, const Posed& X_WB, std::span<const Goal> goals, Eigen::VectorXd& error,
                Eigen::MatrixXd& J_joint, Eigen::MatrixXd& J_base);
/// The error alone.
void goal_error(const FloatingBase& base, const Posed& X_WB, std::span<const Goal> goals, Eigen::VectorXd& error);

/// The two components of an axis goal's error in goal_error() as the rotation that they stand for, in W [rad].
Eigen::Vector3d across_in_world(const Goal& goal, const Eigen::Vector2d& error);

/// How an end-effector stands and moves against its goal, of what the goal and RateDemand::task ask for: zeros of what
/// they leave free. All in W.
struct GoalGap {
  Vector3d position = Vector3d::zero();  // p_E - p_G [m]
  Vector3d turn = Vector3d::zero();      // the rotation of goal_error() [rad]
  Vector3d velocity = Vector3d::zero();  // of E, less that of the place [m/s]
  Vector3d spin = Vector3d::zero();      // likewise [rad/s]
  /// The largest of the four sizes, each in its unit.
  double largest() const { return std::max({norm(position), norm(turn), norm(velocity), norm(spin)}); }
  friend GoalGap operator-(const GoalGap& a, const GoalGap& b) {
    return {a.position - b.position, a.turn - b.turn, a.velocity - b.velocity, a.spin - b.spin};
  }
};
GoalGap goal_gap(const Goal& goal, const Posed& X_WE, const Twistd& V_WE);

/// Least-squares joint rates of least norm that meet the demand at this configuration, through the generalized Jacobian
/// (2.5) and the part of the twist that momentum carries (2.3), and what they leave unmet.
struct DemandedRates {
  Eigen::VectorXd rates;
  double unmet = 0;              // largest component [m/s or rad/s]
  Eigen::MatrixXd G, G_inverse;  // of demand_rows(), and its pseudo-inverse
  Eigen::VectorXd unmet_part;    // b - G rates
  Eigen::VectorXd added;         // z of add_self_motion(); empty: none
};
/// `h_B`: momentum about B's origin in B. `w_B`: with which the base turns about the centre of mass beside, where it is
/// one that keeps its attitude and does not quite [rad/s]. Base must be placed. Not for RateDemand::given.
DemandedRates demanded_rates(const FloatingBase& base, const Posed& X_WB, const Momentumd& h_B,
                             std::span<const Goal> goals, RateDemand demand, const Vector3d& w_B = Vector3d::zero());

/// Adds of rates z as much as moves no end-effector of the demand: rates = G^+ b + (1 - G^+ G) z, those that meet it
/// and are nearest to z.
void add_self_motion(const Eigen::VectorXd& z, DemandedRates& demanded);

/// How the demanded rates change: with joint values at a base that stays where it is (joints x joints), and with a
/// displacement of the base in B (joints x 6). With G of demand_rows(), G^+ its pseudo-inverse, rho = G^+ b,
///   d rho = -G^+ d(G rho - b) + (1 - G^+ G) dG^T G^+T rho + G^+ G^+T dG^T (b - G rho)                              (1)
/// where d(G rho - b) holds rho fixed (Golub and Pereyra 1973); the last two terms are what redundant joints and
/// demands that cannot be met add; rho - z for rho in G^+T rho where z was added, since G^+ then solves for b - G z.
/// Moves the base.
struct RateSensitivity {
  Eigen::MatrixXd per_angle, per_displacement;
};
RateSensitivity rate_sensitivity(FloatingBase& base, const Posed& X_WB, const Momentumd& h_B,
                                 std::span<const Goal> goals, RateDemand demand, const DemandedRates& demanded);

/// The rows of the demand: G theta_dot = b. `w_B` as above.
void demand_rows(const FloatingBase& base, const Posed& X_WB, const Momentumd& h_B, std::span<const Goal> goals,
                 RateDemand demand, Eigen::MatrixXd& G, Eigen::VectorXd& b, const Vector3d& w_B = Vector3d::zero());

// What makes one of many solutions the better one. Thread safety: plain values; values use the FloatingBase they are
// given as scratch.

/// A number that is to be least, of a segment's motion: a weighted sum.
class Objective {
 public:
  using Kind = ObjectiveKind;
  struct Term {
    Kind kind = Kind::as_found;
    double weight = 1;
  };

  Objective() = default;
  /// For a segment that begins as `start` says. `guess` is read by nearest, limits by limits. Terms of kind as_found
  /// count nothing.
  Objective(std::vector<Term> terms, const SegmentStart& start, std::vector<double> guess, std::vector<double> lower,
            std::vector<double> upper);
  Objective(Kind kind, const SegmentStart& start, std::vector<double> guess, std::vector<double> lower,
            std::vector<double> upper)
      : Objective(std::vector<Term>{{kind, 1}}, start, std::move(guess), std::move(lower), std::move(upper)) {}

  /// Without those that count nothing; empty: the first solution will do.
  const std::vector<Term>& terms() const { return terms_; }
  bool is_empty() const { return terms_.empty(); }
  /// Whether final values and rates are all that it depends on; else keep_way() (way.hpp) knows the rest.
  bool depends_on_end_alone() const;
  static bool depends_on_end_alone(Kind kind);
  /// The same for a segment with so many knots.
  Objective with_knots(int knots) const;

  /// Derivatives with final values and rates, one per joint each, and with the coefficients of the splines.
  struct Gradient {
    std::vector<double> position, rate, coefficients;
  };
  /// Sum of the terms that final values and rates are enough for, and its gradient unless null. `rate` may be empty:
  /// zero; `coefficients`: as in PathSegment::fly.
  /// excursion: how much the joints move on the way,
  ///   1/2 sum_j integral_0^1 (d theta_j/dx)^2 dx / integral_0^1 s'(x)^2 dx,   x = (t - begin)/(end - begin)
  /// with s of (6.1): half the sum of squares of the ways from rest to rest, more where the rates at the ends make the
  /// joints swing. nearest: half the sum of squares of the distances from the guess. limits: the same from the middles
  /// of the ranges, over the ranges, of joints with two finite limits. manipulability: -log sqrt det(J_g J_g^T) summed
  /// over goals, of the rows that a goal constrains, dependent rows left out; its gradient by central differences.
  double value(FloatingBase& base, std::span<const Goal> goals, std::span<const double> position,
               std::span<const double> rate, Gradient* gradient, std::span<const double> coefficients = {}) const;
  /// A symmetric matrix that is positive definite, near to its Hessian for final values and coefficients, K being how
  /// final rates change with them: as excursion, nearest and limits have it, weights of manipulability, and a little.
  Eigen::MatrixXd curvature(const Eigen::MatrixXd& K) const;
  /// One term of it, without its weight; the gradient is added to, with the weight.
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
