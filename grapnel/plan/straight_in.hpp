#pragma once

/// @file
/// Straight in: every end-effector moves along the approach direction of its grasp point, in the tumbling target's
/// frame, from a stand-off distance to contact. Resolved-rate motion control through the generalized Jacobian
/// (Umetani and Yoshida 1989), which is what (2.5) is for:
///   J_g theta_dot = V_d - (momentum's part, (2.3)) - k e                                             (1)
/// with V_d the place's twist and e what is left of the error (none of the roll, which has no value to keep); solved by
/// singular values, small ones damped, for the rates of least norm, or for those nearest to a self-motion z(t), which
/// is how joints keep limits on the way (straight_way.hpp). The joint motion that comes out is kept as Chebyshev
/// series, so that it can be followed exactly by a simulation that knows nothing of its origin.

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "grapnel/plan/goal.hpp"
#include "grapnel/plan/path_segment.hpp"
#include "grapnel/simulate/joint_trajectory.hpp"

namespace grapnel {

/// A free rigid body at one instant.
struct FreeBody {
  Posed X_WT = Posed::identity();
  Twistd V_WT = Twistd::zero();               // at T's origin, in W
  Vector3d com = Vector3d::zero();            // in T [m]
  Symmetric3d inertia = Symmetric3d::zero();  // about the centre of mass, in T [kg m^2]
};

/// What moves the servicer and the targets where more acts on them than uniform gravity, over the piece.
struct StraightInSurroundings {
  /// Of the servicer: its momentum and centre of mass at that time, FreeMotion::time.
  std::function<FreeMotion(double time)> motion;
  /// With which a base that keeps its attitude turns all the same, in B [rad/s].
  std::function<Vector3d(double time)> w_B;
  /// Per target; empty: they move freely.
  std::function<std::vector<FreeBody>(double time)> targets;
};

/// A grasp point to come in to.
struct StraightGoal {
  int frame = 0;
  std::string name;
  int target = 0;                  // index of its FreeBody
  Posed X_TG = Posed::identity();  // grasp point in the target's frame
  Vector3d direction_T{1, 0, 0};   // unit: in which the end-effector comes in
  Goal::Orientation orientation = Goal::Orientation::free;
  Vector3d axis_E{1, 0, 0};
  std::string target_name = {}, point = {};  // for messages, as in Goal
  bool roll = false;                         // the end-effector turns about the direction as the target does
  // What flights miss in the end, the other way: with it the plan asks for other things than are meant, and flights
  // come to these. In the target's frame.
  Vector3d turn_T = Vector3d::zero();      // of the orientation asked for, a rotation vector [rad]
  Vector3d velocity_T = Vector3d::zero();  // in the end, beside the place's and final_speed [m/s]
  Vector3d spin_T = Vector3d::zero();      // in the end, beside the target's [rad/s]
};

/// Rates that the joints take as far as they move no end-effector,
///   z(t) = sum_k c_k phi_k(x),   x = (t - begin)/(end - begin)                                                     (2)
/// with phi_k the polynomials of degree k + 4 with double zeros at both ends that are orthonormal on [0, 1]:
/// x^2 (1 - x)^2 times Gegenbauer's of order 9/2. So the piece begins and ends with rates of least norm, and with their
/// accelerations.
struct SelfMotion {
  std::vector<double> coefficients = {};  // c_kj, those of phi_0 for all joints first [rad/s or m/s]; empty: none
};
/// phi_0(x), phi_1(x), ... into `phi`.
void self_motion_basis(double x, std::span<double> phi);

/// Singular values below, relative to the largest, are damped.
inline constexpr double kDampedBelow = 0.02;

struct StraightInProblem {
  double begin = 0, end = 0;       // [s]
  std::vector<double> position;    // joints at `begin`
  Posed X_WB = Posed::identity();  // base at `begin`
  FreeMotion motion;
  Vector3d gravity = Vector3d::zero();
  std::vector<FreeBody> targets;  // at `begin`
  std::vector<StraightGoal> goals;
  double stand_off = 0;                  // [m]
  double final_speed = 0;                // [m/s]
  std::int64_t most_steps = 10'000'000;  // of one integration
  SelfMotion self_motion;
  /// With which the joints come to the begin, where that is known only as well as flights are; empty: those of (1).
  /// What they differ by fades as e does.
  std::vector<double> rate_begin;
  std::shared_ptr<const StraightInSurroundings> surroundings;  // null: `motion`, and targets that move freely
};

/// Where the servicer is on the piece.
struct StraightInPoint {
  double time = 0;
  std::vector<double> position;  // of the joints
  Posed X_WB = Posed::identity();
};

struct StraightInPath {
  bool finished = false;
  std::string failure;
  std::vector<JointTrajectory> joints;  // over [begin, end]
  std::vector<double> rate_begin, rate_end;
  double fit_error = 0;  // largest last coefficient of the series [rad or m]
  double unmet = 0;      // largest component of (1) left unmet [m/s or rad/s], and when
  double unmet_time = 0;
  bool damped = false;  // near a singularity: over which time, and the smallest singular value
  double damped_begin = 0, damped_end = 0, smallest_singular_value = 0;
  std::vector<GoalGap> gaps;            // per goal, at the end
  std::vector<StraightInPoint> points;  // some two hundred and more, the ends among them
  long rhs_evaluations = 0;
};

/// Goals of all end-effectors at a time of the piece, for the targets as given.
std::vector<Goal> goals_at(const StraightInProblem& problem, std::span<const FreeBody> targets, double time);

/// The targets at increasing times from `begin` on.
std::vector<std::vector<FreeBody>> targets_on_the_way(const StraightInProblem& problem, std::span<const double> times);

StraightInPath plan_straight_in(FloatingBase& base, const StraightInProblem& problem);

}  // namespace grapnel
