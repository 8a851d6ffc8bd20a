#pragma once

/// @file
/// Effects of impulses at the grasps, and impulses of a given motion: measures of a configuration, for r arms coupled
/// through a floating base (the extended inverse inertia, impulse ellipsoid and impulse index are due to Yoshida and
/// Sashida 1993; docs/theory, section 13).
///
/// Angular and linear parts have different units and are never summed: an ellipsoid is of one or the other, and rows
/// taken together are scaled by the response of the free target, (7.8), so that numbers are dimensionless. Held rates
/// (HeldRate) are rigid here: impulses do not change them. Limitations: configuration unchanged; finite forces are
/// neglected.

#include <Eigen/Core>
#include <vector>

#include "grapnel/impact/plastic_impact.hpp"

namespace grapnel {

using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// Effective mass of a contact in the three directions of space, from a symmetric 3 x 3 inverse inertia: the set of
/// impulses for unit relative velocities of all directions.
struct ImpulseEllipsoid {
  Eigen::Matrix3d axes;       // columns: unit vectors in W, right-handed
  Eigen::Vector3d semi_axes;  // impulse per velocity along each, descending [kg, or kg m^2]; infinite where rigid
};

/// Of one grasp, at its contact point, with the other arms (and their targets) free.
struct EndEffectorMeasures {
  /// Extended inverse inertia of the robot alone, J_E M^-1 J_E^T (13.1): the change of the end-effector's twist
  /// [angular; linear] at the contact point in W for a unit impulse [angular; linear] on it there
  /// [1/(kg m^2), 1/(kg m); 1/(kg m), 1/kg].
  Matrix6d inverse_inertia;
  /// The same for robot and free target relative to each other (13.2): for the relative twist.
  Matrix6d pair_inverse_inertia;
  /// Of the pair, for a point contact (no angular impulse), inverse of the linear block [kg]. At most the target's
  /// mass.
  ImpulseEllipsoid linear;
  /// Of the pair, for a pure angular impulse, inverse of the angular block [kg m^2].
  ImpulseEllipsoid angular;
  /// Relative velocity of the contact point that the impact must stop, end-effector minus target, in W [m/s]. With held
  /// rates: once they have their prescribed values.
  Eigen::Vector3d relative_velocity;
  /// Impulse of a point contact that stops the relative velocity, per speed, |(W_linear)^-1 u| / |u| [kg] (13.4); 0 if
  /// u is 0.
  double impulse_index = 0;
  /// Along u: impulse of a frictionless contact with its normal along u, per speed, 1 / (n^T W_linear n) [kg] (13.3);
  /// of the robot alone and of the pair. At most the impulse index (of the pair). 0 if u is 0; infinite if rigid.
  double robot_effective_mass = 0, pair_effective_mass = 0;
};

/// The line of an impulse relative to a centre of mass c (13.7).
struct ImpulseLine {
  /// Distance of c from the impulse's central axis, the line along which it is an impulse and a parallel couple [m].
  /// Infinite for a pure couple, 0 for no impulse at all.
  double miss = 0;
  double couple = 0;         // that parallel couple, its sign along the linear impulse [N m s]
  Vector3d angular_impulse;  // about c, in W [N m s]: the change of angular momentum about c. Zero if and only if
                             // miss and couple are
};

/// All grasps together, in their constrained directions (rows): quantities that need only W = J M^-1 J^T of (7.4) and D
/// = G G^T of (7.8).
struct CoupledImpulse {
  int rank = 0;  // of W
  /// Largest and smallest singular value of (G^-1 W G^-T)^+ over its range: maximum and minimum impulse per relative
  /// motion, 1 for an immovable robot and a target with one grasp; and their mean [1] (13.5).
  double largest_impulse = 0, smallest_impulse = 0, mean_impulse = 0;
  /// The same for the current relative motion u of all grasps: sqrt(P^T D P / u^T D^-1 u), P = -W^+ u (13.6) [1].
  double coupled_index = 0;
  double energy = 0;  // P^T D P / 2: energy that the impulses, grasp by grasp, would give the free targets [J]
};

struct ImpulseMeasures : CoupledImpulse {
  std::vector<EndEffectorMeasures> end_effectors;  // per grasp
  /// W: relative velocity per impulse [1/(kg m^2), 1/(kg m), 1/kg].
  Eigen::MatrixXd contact_inertia;
  /// Change of the base's twist [angular; linear] at B's origin, in W, per impulse on the robot in each row, 6 x rows
  /// (13.8): [rad/s, m/s per N m s, N s]. Zero for a base that is fixed or held.
  Eigen::MatrixXd base_response;
  /// Impulses that do not change the base's twist, and those that do not change its angular velocity: columns in the
  /// constrained directions, orthonormal in D (N^T D N = 1; D's unit is that of energy per impulse squared).
  Eigen::MatrixXd zero_disturbance;            // rows x k
  Eigen::MatrixXd zero_base_angular_velocity;  // rows x k', contains the former
  /// Lines of `impulses` relative to the robot's centre of mass, one entry per grasp, and last their resultant. An
  /// impulse with zero miss and couple does not change the robot's angular momentum about its centre of mass or, with
  /// all joints locked, the base's angular velocity.
  std::vector<ImpulseLine> robot_line;
  /// The same relative to the centre of mass of robot and this grasp's target; last: of robot and all grasped targets.
  std::vector<ImpulseLine> system_line;
};

/// `root`: the robot's base. `impulses`: on the robot at each grasp, in W, of the solved impact; empty: no lines.
/// `held`: as for plastic_impact(). @throws std::invalid_argument if the size of `impulses` differs from that of
/// `grasps`, or the state belongs to another model.
ImpulseMeasures impulse_measures(const Model& model, const State& state, int root, std::span<const Grasp> grasps,
                                 std::span<const Impulsed> impulses, std::span<const HeldRate> held = {});

/// CoupledImpulse::mean_impulse and energy, without singular values if the rank is full: plans evaluate them
/// repeatedly.
struct PlannedImpulse {
  double mean_impulse = 0;  // [1]
  double energy = 0;        // [J]
};
PlannedImpulse planned_impulse(const Model& model, const State& state, std::span<const Grasp> grasps,
                               std::span<const HeldRate> held = {});

/// Effective mass of a frictionless contact along a direction n of W (of any length): |n|^2 / (n^T L n) with L the
/// linear block of an inverse inertia [kg] (13.3). Infinite if rigid.
double effective_mass(const Matrix6d& inverse_inertia, const Vector3d& n_W);

/// The line of an impulse `P_WC` at the point C relative to the point `p_W` (13.7).
ImpulseLine impulse_line(const Impulsed& P_WC, const Vector3d& p_WC, const Vector3d& p_W);

}  // namespace grapnel
