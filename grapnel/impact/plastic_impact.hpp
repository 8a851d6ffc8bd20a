#pragma once

/// @file
/// Plastic impact of all grasps at once: the end-effectors and the targets move as one afterwards.
///
/// M (v+ - v-) = J^T P,  J v+ = 0  =>  W P = -u-,  W = J M^-1 J^T,  u- = J v-   (docs/theory.md, section 7), over robot
/// and targets together, valid for any momentum, any number of arms, shared targets and non-square Jacobians. The
/// thesis's (3.9)-(3.13) drop the robot's momentum after the impact; see published_impact.hpp. Limitations:
/// instantaneous, no restitution, no friction; configuration unchanged; finite forces do nothing.

#include <vector>

#include "grapnel/constraint/grasp.hpp"
#include "grapnel/dynamics/state.hpp"
#include "grapnel/impact/impact_checks.hpp"

namespace grapnel {

/// A velocity (index into State::v) that a drive or a brake makes what it is to be, whatever impulse that takes (a rate
/// that is kept, or zero). If the grasps do not allow all of them drives give way, least of all (yielding_drives.hpp).
struct HeldRate {
  int velocity;
  double after = 0;  // [rad/s or m/s]
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

/// Solves the impact. If rows are redundant the impulse with the least sum over grasps of P^T (J_t M_t^-1 J_t^T) P is
/// returned: the energy each grasp's impulse alone would give the free target, independent of units, frame and
/// reference point. Grasps that are closed already may be among the grasps: they pass on what the new ones bring. With
/// held rates and no new grasp it is the impact of brakes. With neither nothing changes. Rows count grasps and held
/// rates.
/// @throws std::invalid_argument if the state has another model's size.
ImpactSolution plastic_impact(const Model& model, const State& state, std::span<const Grasp> grasps,
                              std::span<const HeldRate> held = {});

}  // namespace grapnel
