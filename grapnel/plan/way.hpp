#pragma once

/// @file
/// What a planned segment does on its way, and what it is to keep there: joints within their limits, bodies clear of
/// each other, the base within an angle of its attitude, while an objective of the whole way becomes least.
///
/// Unknowns are the final joint values theta_f and the coefficients c of the joints' splines (joint_spline.hpp); final
/// rates follow by (2) of reach.hpp. Wanted is
///   min f(theta_f, c)   with   e = 0   and   g_i(theta_f, c; t) <= 0 for all t                                     (1)
/// a semi-infinite program. It is solved by sequential quadratic programming (sequential_quadratic.hpp) with exchange
/// (Hettich and Kortanek, SIAM Review 35 (1993) 380-429): of the g_i those instants are made linear at which an iterate
/// has come near to violating them, and whether a step is a good one is decided by all instants. These are the nodes of
/// the segment's quadrature. What happens between them is looked at on four times as many; where more than a tolerance
/// is missing there, that much more is asked for.
///
/// A distance d of two bodies with nearest points p_a, p_b and normal n changes by n . (dp_b - dp_a). A point at r in
/// B, carried by the joints J, moves as its place in W is p_WCom + R (r - c):
///   dp = eta x R (r - c) + R [sum_J (S_j x r) dtheta_j - sum_j dc/dtheta_j dtheta_j]                               (2)
/// with eta of (3) of path_segment.hpp, efforts by (4) of joint_efforts.hpp.

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "grapnel/clearance/clearance_model.hpp"
#include "grapnel/plan/goal.hpp"
#include "grapnel/plan/wheel_momentum.hpp"

namespace grapnel {

struct ReachProblem;
struct Shot;

/// The bodies whose distances are looked at: a model of the servicer and everything else, against the servicer's own
/// model, which is planned with.
struct WayBodies {
  ClearanceModel model;
  std::vector<std::string> names;  // per body of that model, as users know them
  std::vector<int> link;           // per body: the servicer's link that carries it; -1: none, it is somewhere else
  std::vector<Posed> X_LB;         // per body: on that link
  /// Places those that the servicer does not carry, in W.
  std::function<void(double time, std::vector<Posed>& X_WB)> place_others;
  /// A hand may touch its target where its frame is within `near` of the grasp point.
  struct Hand {
    int frame = 0;   // of the servicer's model
    int target = 0;  // body
    Vector3d p_TG = Vector3d::zero();
    double near = 0;  // [m]
  };
  std::vector<Hand> hands;
  std::vector<int> hand;  // per pair of `model`: which; -1: none
};

/// More than this is a violation, and within it that much is aimed at [rad, m or 1].
inline constexpr double kTolerated = 1e-6, kAimed = 5e-7;

/// What is asked of the way, of a ReachProblem.
struct WaySetup {
  bool limits = false;               // positions, rates and efforts keep within the limits of ReachProblem
  std::vector<double> effort_limit;  // per joint; infinite where there is none
  double base_turn = std::numeric_limits<double>::infinity();  // from R_WB0 [rad]
  Rotationd R_WB0 = Rotationd::identity();
  std::optional<WheelMomentum> wheels;  // of a base that keeps its attitude, for wheel_share or the objective
  double wheel_share = std::numeric_limits<double>::infinity();  // largest of each, of the most that it can hold
  std::optional<double> clearance;                               // least distance [m]
  std::shared_ptr<const WayBodies> bodies;                       // for clearance, kept or wanted
  /// Value of Objective::Kind::impulse or impulse_index for final joint values, rates and base pose.
  std::function<double(Objective::Kind kind, std::span<const double> position, std::span<const double> rate,
                       const Posed& X_WB)>
      end_measure;
  std::optional<int> knots;  // absent: none, and where that does not do, kKnots
  static constexpr int kKnots = 4;
  bool keeps_something() const {
    constexpr double kAny = std::numeric_limits<double>::infinity();
    return limits || base_turn < kAny || wheel_share < kAny || clearance.has_value();
  }
};

/// How a way turns out.
struct WayFigures {
  double position_margin = std::numeric_limits<double>::infinity();  // least, of all joints with limits [rad or m]
  double rate_share = 0;                                             // largest, of those with limits
  std::optional<double> effort_share;                                // likewise, where it was looked at
  Clearance clearance;                                               // the least, where it was looked at
  double clearance_time = 0;                                         // [s]
  double base_turn = 0;                                              // largest [rad]
  std::vector<double> wheel_share;                                   // largest, per wheel of WaySetup::wheels
};

/// A solution that keeps what is asked, or the nearest to it.
struct WayEnd {
  bool kept = false;
  std::string trouble;  // if not: what is violated most, by how much and when
  double violation = 0;
  bool obstructed = false;   // by nearest_way(): bodies too near to each other are of what is violated most
  bool may_improve = false;  // the steps were too few to say that the objective is least
  int knots = 0;
  std::vector<double> position, rate, coefficients;
  double objective = 0;
  std::vector<double> terms;  // of it, in the order of Objective::terms(), without weights
  WayFigures figures;
  std::shared_ptr<Shot> shot;
  long rhs_evaluations = 0;
};

/// From a solution of the goals without a spline (or with zero coefficients) to one that keeps the problem's way and
/// has the least objective near it, on a segment with `knots`. `attempt`: 0 begins with the solution's coefficients, or
/// zero where it has none, higher ones with random coefficients. kAsItIs: the solution is looked at and polished, no
/// more. kAtAllNodes: it is made better with all the nodes that are otherwise looked at in the end only. kOnwards: as
/// 0.
inline constexpr int kAsItIs = -1, kAtAllNodes = -2, kOnwards = -3;
/// Of sequential quadratic programming, each time that it is asked.
inline constexpr int kMostSteps = 150;
WayEnd keep_way(FloatingBase& base, const ReachProblem& problem, const Shot& solution, int knots, int attempt,
                int steps = kMostSteps);

/// The coefficients with which an attempt begins.
std::vector<double> coefficients_to_begin_with(const FloatingBase& base, const ReachProblem& problem,
                                               const Shot& solution, int knots, int attempt);

/// Whether the problem asks anything of the way, or has an objective that depends on it.
bool asks_of_way(const ReachProblem& problem);
/// Whether the least distance is part of its objective.
bool wants_clearance(const ReachProblem& problem);

}  // namespace grapnel
