#pragma once

/// @file
/// Path constraints of a planned segment: joint limits, minimum distances between bodies and a maximum rotation of the
/// base. A planned segment satisfies them and minimizes an objective of the whole path.
///
/// Unknowns are the final joint values theta_f and the coefficients c of the joint splines (joint_spline.hpp); final
/// rates follow from (2) of reach.hpp. The problem is
///   min f(theta_f, c)   with   e = 0   and   g_i(theta_f, c; t) <= 0 for all t                                     (1)
/// a semi-infinite program. It is solved by sequential quadratic programming (sequential_quadratic.hpp) with exchange
/// (Hettich and Kortanek, SIAM Review 35 (1993) 380-429). The g_i are linearized at those instants at which an iterate
/// nearly violates them; acceptance of a step considers all instants. The instants are the nodes of the segment's
/// quadrature. The path between them is checked at four times as many instants. If a violation there exceeds the
/// tolerance, the constraints are tightened by that amount.
///
/// A distance d of two bodies with nearest points p_a, p_b and normal n changes by n . (dp_b - dp_a). A point at r in
/// B, carried by the joints J, moves with its position p_WCom + R (r - c) in W:
///   dp = eta x R (r - c) + R [sum_J (S_j x r) dtheta_j - sum_j dc/dtheta_j dtheta_j]                               (2)
/// with eta of (3) of path_segment.hpp; efforts are those of (4) of joint_efforts.hpp.

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "grapnel/contact/clearance_model.hpp"
#include "grapnel/plan/goal.hpp"
#include "grapnel/plan/wheel_momentum.hpp"

namespace grapnel {

struct ReachProblem;
struct ShootingIterate;

/// The bodies of distance constraints: a model of the servicer and of all other bodies. Planning itself uses a model of
/// the servicer alone.
struct ConstraintBodies {
  ClearanceModel model;
  std::vector<std::string> names;  // per body of that model, its name in messages
  std::vector<int> link;  // per body: the link of the servicer's model that carries it; -1: not carried by the servicer
  std::vector<Posed> X_LB;  // per body: its pose on that link
  /// Writes the poses in W of the bodies that the servicer does not carry.
  std::function<void(double time, std::vector<Posed>& X_WB)> place_others;
  /// An end-effector may touch its target while its frame is within `near` of the grasp point.
  struct EndEffector {
    int frame = 0;   // of the servicer's model
    int target = 0;  // body
    Vector3d p_TG = Vector3d::zero();
    double near = 0;  // [m]
  };
  std::vector<EndEffector> end_effectors;
  std::vector<int> end_effector;  // per pair of `model`: index of its end-effector; -1: none
};

/// A larger violation is reported; the search aims at the smaller value [rad, m or 1].
inline constexpr double kTolerated = 1e-6, kAimed = 5e-7;

/// Path constraints of a ReachProblem.
struct PathConstraints {
  bool limits = false;  // enforce the limits of ReachProblem on positions, rates and efforts during the segment
  std::vector<double> effort_limit;                            // per joint; infinite: no limit
  double base_turn = std::numeric_limits<double>::infinity();  // maximum rotation from R_WB0 [rad]
  Rotationd R_WB0 = Rotationd::identity();
  std::optional<WheelMomentum> wheels;  // of an attitude-controlled base, for wheel_share or the objective
  double wheel_share =
      std::numeric_limits<double>::infinity();     // maximum momentum of each wheel as a share of its capacity
  std::optional<double> clearance;                 // minimum distance [m]
  std::shared_ptr<const ConstraintBodies> bodies;  // for clearance as a constraint or an objective
  /// Value of Objective::Kind::impulse or impulse_index for final joint values, rates and base pose.
  std::function<double(Objective::Kind kind, std::span<const double> position, std::span<const double> rate,
                       const Posed& X_WB)>
      end_measure;
  std::optional<int> knots;  // absent: none first, then kKnots if no solution without knots exists
  static constexpr int kKnots = 4;
  bool has_constraints() const {
    constexpr double kAny = std::numeric_limits<double>::infinity();
    return limits || base_turn < kAny || wheel_share < kAny || clearance.has_value();
  }
};

/// Properties of a path.
struct PathFigures {
  double position_margin = std::numeric_limits<double>::infinity();  // minimum over all joints with limits [rad or m]
  double rate_share = 0;                                             // maximum over all joints with limits
  std::optional<double> effort_share;                                // likewise, if evaluated
  Clearance clearance;                                               // minimum, if evaluated
  double clearance_time = 0;                                         // [s]
  double base_turn = 0;                                              // maximum [rad]
  std::vector<double> wheel_share;                                   // maximum per wheel of PathConstraints::wheels
};

/// A solution that satisfies the path constraints, or the one closest to satisfying them.
struct ConstrainedSolution {
  bool feasible = false;
  std::string failure;  // if not: the largest violation, its value and time
  double violation = 0;
  bool obstructed = false;   // by nearest_feasible_path(): a distance between bodies is among the largest violations
  bool may_improve = false;  // the step limit ended the search before the objective converged
  int knots = 0;
  std::vector<double> position, rate, coefficients;
  double objective = 0;
  std::vector<double> terms;  // of the objective, in the order of Objective::terms(), without weights
  PathFigures figures;
  std::shared_ptr<ShootingIterate> iterate;
  long rhs_evaluations = 0;
};

/// Starts from a solution of the goals without a spline (or with zero coefficients). Returns a solution on a segment
/// with `knots` that satisfies the path constraints and is a local minimum of the objective. `attempt`: 0 starts with
/// the coefficients of `solution`, or zero if it has none; positive values start with random coefficients. kAsItIs:
/// `solution` is only evaluated and refined. kAtAllNodes: the search uses all nodes that are otherwise checked only at
/// the end. kOnwards: as 0.
inline constexpr int kAsItIs = -1, kAtAllNodes = -2, kOnwards = -3;
/// Step limit of each run of sequential quadratic programming.
inline constexpr int kMaxSearchSteps = 150;
ConstrainedSolution solve_with_path_constraints(FloatingBase& base, const ReachProblem& problem,
                                                const ShootingIterate& solution, int knots, int attempt,
                                                int steps = kMaxSearchSteps);

/// Initial coefficients of an attempt.
std::vector<double> coefficients_to_begin_with(const FloatingBase& base, const ReachProblem& problem,
                                               const ShootingIterate& solution, int knots, int attempt);

/// Whether the problem has path constraints or an objective that depends on the path.
bool depends_on_path(const ReachProblem& problem);
/// Whether the minimum distance is a term of the objective.
bool wants_clearance(const ReachProblem& problem);

}  // namespace grapnel
