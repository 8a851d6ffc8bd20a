#pragma once

/// @file
/// Final straight approach: every end-effector moves along the approach direction of its grasp point, in the frame of
/// the tumbling target, from a stand-off distance to contact. Uses resolved-rate motion control through the generalized
/// Jacobian (Umetani and Yoshida 1989), the application of (2.5):
///   J_g theta_dot = V_d - (momentum's part, (2.3)) - k e                                             (1)
/// with V_d the grasp point's twist and e the remaining error (without the roll, which has no reference value). It is
/// solved by singular value decomposition with damped small singular values. The result are the minimum-norm rates, or
/// the rates closest to a self-motion z(t), which enforces joint limits during the approach
/// (constrained_straight_in.hpp). The joint trajectory is stored as Chebyshev series, which a simulation can follow
/// exactly.

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "grapnel/plan/goal.hpp"
#include "grapnel/plan/path_segment.hpp"
#include "grapnel/simulate/joint_trajectory.hpp"

namespace grapnel {

/// State of a free rigid body.
struct FreeBody {
  Posed X_WT = Posed::identity();
  Twistd V_WT = Twistd::zero();               // at T's origin, in W
  Vector3d com = Vector3d::zero();            // in T [m]
  Symmetric3d inertia = Symmetric3d::zero();  // about the centre of mass, in T [kg m^2]
};

/// Motion of the servicer and the targets under loads other than uniform gravity, during the approach.
struct StraightInSurroundings {
  /// Momentum and centre of mass of the servicer at FreeMotion::time.
  std::function<FreeMotion(double time)> motion;
  /// Residual angular velocity of an attitude-controlled base, in B [rad/s].
  std::function<Vector3d(double time)> w_B;
  /// Per target; empty: free motion.
  std::function<std::vector<FreeBody>(double time)> targets;
};

/// Goal of a final straight approach.
struct StraightGoal {
  int frame = 0;
  std::string name;
  int target = 0;                  // index of its FreeBody
  Posed X_TG = Posed::identity();  // grasp point in the target's frame
  Vector3d direction_T{1, 0, 0};   // unit vector of the end-effector's approach direction
  Goal::Orientation orientation = Goal::Orientation::free;
  Vector3d axis_E{1, 0, 0};
  std::string target_name = {}, point = {};  // for messages, as in Goal
  bool roll = false;                         // the end-effector follows the target's rotation about the direction
  // Corrections, opposite to the final errors of a forward simulation. With them the simulated trajectory reaches the
  // intended state. In the target's frame.
  Vector3d turn_T = Vector3d::zero();      // of the demanded orientation, a rotation vector [rad]
  Vector3d velocity_T = Vector3d::zero();  // at the end, added to the grasp point's velocity and final_speed [m/s]
  Vector3d spin_T = Vector3d::zero();      // at the end, added to the target's angular velocity [rad/s]
};

/// A self-motion: joint rates that are applied as far as they move no end-effector,
///   z(t) = sum_k c_k phi_k(x),   x = (t - begin)/(end - begin)                                                     (2)
/// with phi_k the polynomials of degree k + 4 with double zeros at both ends that are orthonormal on [0, 1]: x^2 (1 -
/// x)^2 times Gegenbauer polynomials of order 9/2. The approach therefore begins and ends with the minimum-norm rates
/// and their accelerations.
struct SelfMotion {
  std::vector<double> coefficients = {};  // c_kj, all joints of phi_0 first [rad/s or m/s]; empty: no self-motion
};
/// Writes phi_0(x), phi_1(x), ... to `phi`.
void self_motion_basis(double x, std::span<double> phi);

/// Smaller singular values, relative to the largest, are damped.
inline constexpr double kDampedBelow = 0.02;

struct StraightInProblem {
  double begin = 0, end = 0;       // [s]
  std::vector<double> position;    // joint values at `begin`
  Posed X_WB = Posed::identity();  // base pose at `begin`
  FreeMotion motion;
  Vector3d gravity = Vector3d::zero();
  std::vector<FreeBody> targets;  // at `begin`
  std::vector<StraightGoal> goals;
  double stand_off = 0;                  // [m]
  double final_speed = 0;                // [m/s]
  std::int64_t most_steps = 10'000'000;  // step limit of one integration
  SelfMotion self_motion;
  /// Initial joint rates if known from a forward simulation; empty: those of (1). Their difference from (1) decays as e
  /// does.
  std::vector<double> rate_begin;
  std::shared_ptr<const StraightInSurroundings> surroundings;  // null: `motion`, and free targets
};

/// State of the servicer during the approach.
struct StraightInPoint {
  double time = 0;
  std::vector<double> position;  // joint values
  Posed X_WB = Posed::identity();
};

struct StraightInPath {
  bool finished = false;
  std::string failure;
  std::vector<JointTrajectory> joints;  // over [begin, end]
  std::vector<double> rate_begin, rate_end;
  double fit_error = 0;  // largest last coefficient of the series [rad or m]
  double unmet = 0;      // largest component of (1) left unmet [m/s or rad/s], and its time
  double unmet_time = 0;
  bool damped = false;  // near a singularity: the time interval and the smallest singular value
  double damped_begin = 0, damped_end = 0, smallest_singular_value = 0;
  std::vector<GoalGap> gaps;            // per goal, at the end
  std::vector<StraightInPoint> points;  // at least two hundred samples, including both ends
  long rhs_evaluations = 0;
};

/// Goals of all end-effectors at a time of the approach, for the given target states.
std::vector<Goal> goals_at(const StraightInProblem& problem, std::span<const FreeBody> targets, double time);

/// The target states at increasing times from `begin` on.
std::vector<std::vector<FreeBody>> targets_on_the_way(const StraightInProblem& problem, std::span<const double> times);

StraightInPath plan_straight_in(FloatingBase& base, const StraightInProblem& problem);

}  // namespace grapnel
