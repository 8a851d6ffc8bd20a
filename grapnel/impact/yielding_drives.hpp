#pragma once

/// @file
/// Held rates that contradict the grasps: drives are overpowered, with minimum deviation (docs/theory, section 7).
///
/// A drive that holds a rate represents a rotor of infinite inertia. The limit k -> infinity of the plastic impact with
/// rotors k J_r at the prescribed rates is
///
///   s  = argmin |s - w_h|^2_Jr   over all rates s = H v with J_g v = w_g,                                       (7.17)
///   v+ = argmin |v - v-|^2_M     over all v with J_g v = w_g and H v = s,                                       (7.18)
///
/// of which the second is the impact with held rates s instead of the prescribed ones, w_h. With the self-stresses
/// S = [S_g; S_h] of all rows, which do no work on any admissible velocity,
///
///   s = w_h - J_r^-1 S_h (S_h^T J_r^-1 S_h)^+ (S_g^T w_g + S_h^T w_h).                                          (7.20)
///
/// Momentum and grasps are satisfied exactly. If the prescribed rates are consistent with the grasps, the bracket and
/// the change are zero.

#include <optional>

#include "grapnel/impact/plastic_impact.hpp"

namespace grapnel {

/// J_r of a held velocity: the contribution of its joint's rotor to the mass matrix [kg m^2 or kg]; 1 if the model
/// states no rotor, so that drives without data have equal weights.
double drive_inertia(const Model& model, int velocity);

/// s of (7.20), if it differs from the values `after` of the held rows, the last ones, by more than rounding; empty if
/// no drive is overpowered. `null_space`: the self-stresses of `rows`, as from solve_impulsive_constraint().
std::optional<Eigen::VectorXd> rates_that_grasps_allow(const BilateralRows& rows, const Eigen::VectorXd& after,
                                                       const Eigen::MatrixXd& null_space);

/// Per held rate, whether its drive is overpowered: whether it deviates from the prescribed value by more than
/// rounding. `velocity`: of the whole model, after the impact.
std::vector<bool> which_was_overpowered(const Model& model, std::span<const HeldRate> held,
                                        std::span<const double> velocity);

}  // namespace grapnel
