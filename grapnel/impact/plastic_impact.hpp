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
#include "grapnel/impact/impact_solution.hpp"
#include "grapnel/model/model.hpp"

namespace grapnel {

/// Per velocity: one if rows `J` (rows x velocities) act on the tree that it belongs to, zero otherwise.
Eigen::VectorXd taking_part(const Model& model, const Eigen::MatrixXd& J);

/// Checks of the impact that changes the velocities `before` to `after` under the generalized impulse `impulse` (J^T
/// P). `factor` is M's. `work` [J]: of the impulses, P^T (u- + u+) / 2. `part` is taking_part() of all rows.
ImpactChecks impact_checks(const Eigen::MatrixXd& M, const Cholesky& factor, const Eigen::VectorXd& part,
                           const Eigen::VectorXd& before, const Eigen::VectorXd& after, const Eigen::VectorXd& impulse,
                           double work);

/// Solves the impact. For redundant rows returns the impulse with the minimum sum over grasps of P^T (J_t M_t^-1 J_t^T)
/// P: the energy that each grasp's impulse alone would give the free target, independent of units, frame and reference
/// point. Already closed grasps may be included: they transmit the impulses of the new ones. With held rates and no new
/// grasp it is the impact of brakes. With neither nothing changes. Rows count grasps and held rates. @throws
/// std::invalid_argument if the state's size is not the model's.
ImpactSolution plastic_impact(const Model& model, const State& state, std::span<const Grasp> grasps,
                              std::span<const HeldRate> held = {});

/// The rows of a model's couplings (Model::couplings()), whose rates are zero after an impact: every impact of a model
/// with couplings needs them, before its other held rates. Their impulses act on the dependent joints, and -ratio times
/// these on the others.
std::vector<HeldRate> coupling_rates(const Model& model);

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
