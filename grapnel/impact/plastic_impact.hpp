#pragma once

/// @file
/// Simultaneous plastic impact of all grasps: the end-effectors and the targets move together afterwards.
///
/// M (v+ - v-) = J^T P,  J v+ = 0  =>  W P = -u-,  W = J M^-1 J^T,  u- = J v-
///
/// (docs/theory, section 7), over robot and targets together, valid for any momentum, any number of arms, shared
/// targets and non-square Jacobians. The thesis's (3.9)-(3.13) drop the robot's momentum after the impact; see
/// published_impact.hpp. Limitations: instantaneous, no restitution, no friction; configuration unchanged; finite
/// forces are neglected.

#include <Eigen/Core>
#include <vector>

#include "grapnel/constraint/grasp.hpp"
#include "grapnel/constraint/impulsive_constraint.hpp"
#include "grapnel/dynamics/state.hpp"
#include "grapnel/model/model.hpp"

namespace grapnel {

// Checks of one instantaneous impact, for every law: (9.5) and (9.6) of docs/theory. They are relative to the bodies
// in the impact, so that a heavy body elsewhere hides nothing.

struct ImpactChecks {
  double kinetic_energy_before = 0;  // [J], by the mass matrix, of the whole model
  double kinetic_energy_after = 0;
  double energy_identity_residual = 0;       // |dT - work of the impulses|, over T before or after of what takes part
  double generalized_momentum_residual = 0;  // (3.6): |M dv - J^T P| in the energy norm, over that of M v, likewise
};

/// Per velocity: one if rows `J` (rows x velocities) act on the tree that it belongs to, zero otherwise.
Eigen::VectorXd taking_part(const Model& model, const Eigen::MatrixXd& J);

/// Checks of the impact that changes the velocities `before` to `after` under the generalized impulse `impulse` (J^T
/// P). `factor` is M's. `work` [J]: of the impulses, P^T (u- + u+) / 2. `part` is taking_part() of all rows.
ImpactChecks impact_checks(const Eigen::MatrixXd& M, const Cholesky& factor, const Eigen::VectorXd& part,
                           const Eigen::VectorXd& before, const Eigen::VectorXd& after, const Eigen::VectorXd& impulse,
                           double work);

/// A velocity (index into State::v) that a drive or a brake sets to a prescribed value with any impulse (a kept rate,
/// or zero). If the grasps contradict some of them, drives are overpowered, with minimum deviation
/// (yielding_drives.hpp).
struct HeldRate {
  int velocity;
  double after = 0;  // [rad/s or m/s]
  /// Per velocity. Not empty: the quantity with the value `after` is the sum of these times the velocities, the rate of
  /// a mode of vibration that does not respond, and `velocity` is -1. Such rates come before all others.
  std::vector<double> row = {};

  bool is_mode() const { return !row.empty(); }
};

/// An impulse at a grasp, on the robot at the contact point, in W.
struct ContactImpulse {
  Impulsed P_WC;                 // [N m s; N s]
  std::vector<bool> determined;  // per component [angular; linear]: the same in every solution
};

struct ImpactSolution : ImpactChecks {
  std::vector<double> velocity;          // v+ of the whole model
  std::vector<ContactImpulse> contacts;  // per grasp
  std::vector<double> held_impulses;     // per held rate [N m s or N s]
  int rank = 0;
  int rows = 0;
  Eigen::MatrixXd null_space;      // self-stresses, rows x (rows - rank): constrained directions, then held rates
  double constraint_residual = 0;  // (9.7): largest |J v+ - u+| over the largest |u-| or rate of what takes part
};

/// Solves the impact. For redundant rows returns the impulse with the minimum sum over grasps of P^T (J_t M_t^-1 J_t^T)
/// P: the energy that each grasp's impulse alone would give the free target, independent of units, frame and reference
/// point. Already closed grasps may be included: they transmit the impulses of the new ones. With held rates and no new
/// grasp it is the impact of brakes. With neither nothing changes. Rows count grasps and held rates. @throws
/// std::invalid_argument if the state's size is not the model's.
ImpactSolution plastic_impact(const Model& model, const State& state, std::span<const Grasp> grasps,
                              std::span<const HeldRate> held = {});

// Bilateral rows of an impact: those of grasps, then held rates; and the solution of any impact that prescribes their
// velocities afterwards.

struct BilateralRows {
  Eigen::MatrixXd J;             // rows x velocities: grasp_jacobian(), rows of modes, a unit entry per held velocity
  Eigen::MatrixXd D;             // rows x rows: metric (7.8) of docs/theory; held rates the diagonal of J M^-1 J^T
  Eigen::VectorXd held_after;    // rows: zero for grasps, HeldRate::after for held rates
  Eigen::VectorXd held_inertia;  // per held velocity: drive_inertia(), its resistance to grasps that contradict it
  std::vector<int> held;         // their indices in State::v
  Eigen::VectorXd part;          // per velocity: taking_part() of these rows
};

/// `kinematics` of the state at which `M` is the mass matrix.
BilateralRows bilateral_rows(const Model& model, const Kinematics& kinematics, const Eigen::MatrixXd& M,
                             std::span<const Grasp> grasps, std::span<const HeldRate> held);

/// M (v+ - v-) = J^T P, J v+ = `u_after` as far as redundant rows permit. Held velocities are eliminated, so that they
/// are exact and the minimum singular value of the rest is that of the grasps: (7.21) of docs/theory. Otherwise as
/// solve_impulsive_constraint(). `factor` is M's. @throws std::invalid_argument if M is not positive definite.
ImpulsiveSolution solve_bilateral(const Eigen::MatrixXd& M, const Cholesky& factor, const BilateralRows& rows,
                                  const Eigen::VectorXd& v, const Eigen::VectorXd& u_after);

/// M (v+ - v-) = J^T P, J v+ = `u_after` as far as redundant rows permit (docs/theory, equations (7.5)-(7.7)), with
/// its checks; drives whose rates contradict the grasps are overpowered, (7.20). `rows` are those of `grasps` and
/// `held`.
ImpactSolution solve_rows(const Eigen::MatrixXd& M, const BilateralRows& rows, const State& before,
                          const Eigen::VectorXd& u_after, std::span<const Grasp> grasps,
                          std::span<const HeldRate> held);

// Effects of the impulses at the grasps inside the robot: the impulse that every joint transmits, driving and
// constraint components alike.

/// Per body: the impulse that its joint transmits from the parent to it, in W, about the body frame's origin (the
/// joint). From momentum differences of the bodies beyond the joint, less the external impulses on them; independent of
/// the mass matrix. For a free root it is zero up to rounding, for one fixed to the world it is the impulse of the
/// ground. `external[i]` acts on body i at point p_WC[i]: pass each grasp twice, on the robot and, reversed, on the
/// target.
struct ExternalImpulse {
  int body;
  Vector3d p_WC;
  Impulsed P_WC;
};
std::vector<Impulsed> joint_impulses(const Model& model, const State& before, const State& after,
                                     std::span<const ExternalImpulse> external);

}  // namespace grapnel
