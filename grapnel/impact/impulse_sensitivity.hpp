#pragma once

/// @file
/// Sensitivities of impulses and base rate of a plastic impact: derivatives of plastic_impact() by dual numbers through
/// the kernels and implicit differentiation of its equations (docs/theory, section 13). Limitations: first order, at
/// this configuration; effects of replanning the approach are not included.

#include <Eigen/Core>
#include <string>
#include <vector>

#include "grapnel/impact/plastic_impact.hpp"

namespace grapnel {

/// One parameter and the derivatives with respect to it.
struct ImpulseSensitivity {
  std::string parameter;  // see impulse_sensitivities()
  std::string unit;       // of the parameter: "m/s", "rad/s", "rad", "kg", "kg m^2", "m"
  int grasp = 0;          // whose motion, approach, contact or target changes; of a shared target the first
  /// Why derivatives do not exist (NaN): the rank of the constraints changes with the parameter, or held rates
  /// contradict the grasps. Empty: they are valid.
  std::string undefined;
  /// d P / d parameter, per grasp, on the robot at its contact point (which moves with "contact offset"), in W. For
  /// redundant rows: of the minimum-norm impulse in D, which plastic_impact() returns.
  std::vector<Impulsed> impulse;
  Twistd base = Twistd::zero();  // d (V+ - V-) / d parameter of the base at B's origin, in W
};

/// The parameters, in this order, for every grasp:
/// - "relative velocity x", y, z [m/s] and "relative angular velocity x", y, z [rad/s]: of the end-effector relative
///   to the target at the contact point, in W; the target's twist changes (of a shared target at all its grasps).
/// - "angle of attack x", y, z [rad]: the relative velocity rotates about these axes of W with constant magnitude;
/// likewise
///   by the target's velocity.
/// - "approach angle x", y, z [rad]: the end-effector rotates about the contact point, about these axes of W. Contact
///   point, base and all targets, their motion, and the motion of all end-effectors are unchanged. With J the Jacobians
///   of all grasping bodies by the joints between them and the base, these move by dq = J^+ [axis; 0] (zero for the
///   other grasps) and their rates follow by J^+ (-dJ v), the minimum-norm solution [rad, m] if redundant. A hinge's
///   axis rotates with the end-effector. Axes that the arm cannot follow are omitted (planar arm: x and y).
/// - "contact offset x", y, z [m]: the contact point moves in W, equally on both bodies.
/// Then, for every target, with its motion unchanged: "target mass" [kg], with its centre of mass and its inertia about
/// it unchanged, and "target inertia xx", yy, zz [kg m^2], about the centre of mass, in the target's axes.
///
/// `root`: the robot's base. `held`: as for plastic_impact(). The value after the impact is a constant (a brake's); but
/// if it equals the current rate and is not zero, the drive keeps any initial rate of the joint.
/// @throws std::invalid_argument if a grasp's target is not a free body, or the state belongs to another model.
std::vector<ImpulseSensitivity> impulse_sensitivities(const Model& model, const State& state, int root,
                                                      std::span<const Grasp> grasps,
                                                      std::span<const HeldRate> held = {});

// The matrices of an impact and their derivatives along a change of the problem, from one pass of dual numbers through
// the kernels.

/// A direction of change of the problem of an impact: derivatives with respect to one parameter.
struct ImpactVariation {
  std::vector<double> configuration;          // of the coordinates, as velocities (State::v's meaning); targets: zero
  std::vector<double> velocity;               // of State::v
  int grasp = -1;                             // grasp whose contact point and hinge axis move
  Vector3d contact = Vector3d::zero();        // of its contact point, in W [m]
  Vector3d turn = Vector3d::zero();           // rotation of its hinge axis, in W [rad]
  int target = -1;                            // body whose mass and inertia change
  double mass = 0;                            // [kg]
  Symmetric3d inertia = Symmetric3d::zero();  // about its centre of mass, in its axes [kg m^2]

  explicit ImpactVariation(const Model& model)
      : configuration(model.velocities(), 0.0), velocity(model.velocities(), 0.0) {}
};

/// A matrix and its derivative.
struct DualMatrix {
  Eigen::MatrixXd value, derivative;
};

/// M, J and D of docs/theory, equations (7.1), (7.2) and (7.8), rows of grasps first, then of held rates.
struct VariedImpact {
  DualMatrix M;  // mass matrix
  DualMatrix J;  // relative Jacobian
  DualMatrix D;  // metric of impulses
  /// Selects constrained components of each grasp's relative twist, rows x 6; its derivative rotates with the hinge.
  std::vector<DualMatrix> directions;
};

VariedImpact vary_impact(const Model& model, const State& state, std::span<const Grasp> grasps,
                         std::span<const HeldRate> held, const ImpactVariation& variation);

/// Jacobians of the grasping bodies alone at the contact points, stacked, 6 rows per grasp, in W, for a change of
/// configuration by `configuration` with fixed contact points.
DualMatrix vary_end_effectors(const Model& model, const State& state, std::span<const Grasp> grasps,
                              const std::vector<double>& configuration);

}  // namespace grapnel
