#pragma once

/// @file
/// Held rates that the grips do not allow: drives give way, as little as they can (docs/theory.md, section 7).
///
/// A drive that holds a rate stands for a rotor of infinite inertia. The limit k -> infinity of the plastic impact with
/// rotors k J_r that come in at the rates told is
///
///   s  = argmin |s - w_h|^2_Jr   over all rates s = H v with J_g v = w_g,                                       (7.17)
///   v+ = argmin |v - v-|^2_M     over all v with J_g v = w_g and H v = s,                                       (7.18)
///
/// of which the second is the impact with held rates s instead of those told, w_h. By the self-stresses S = [S_g; S_h]
/// of all rows, which do no work on any velocity that these allow,
///
///   s = w_h - J_r^-1 S_h (S_h^T J_r^-1 S_h)^+ (S_g^T w_g + S_h^T w_h).                                          (7.20)
///
/// Momentum and grips are kept exactly. Where the rates told agree with the grips the bracket is zero, and so is the
/// change.

#include <optional>

#include "grapnel/constraint/pivoted_cholesky.hpp"
#include "grapnel/impact/bilateral_rows.hpp"

namespace grapnel {

/// J_r of a held velocity: what its joint's rotor adds to the mass matrix [kg m^2 or kg]; 1 where the model states no
/// rotor, so that drives of which nothing is known have equal weights.
double drive_inertia(const Model& model, int velocity);

/// s of (7.20), where it differs from what `after` asks of the held rows, the last ones, by more than rounding; nothing
/// where no drive has to give way. `null_space`: the self-stresses of `rows`, as of solve_impulsive_constraint().
std::optional<Eigen::VectorXd> rates_that_grips_allow(const BilateralRows& rows, const Eigen::VectorXd& after,
                                                      const Eigen::MatrixXd& null_space);

/// Per held rate, whether its drive gave way: whether it is off what it was told by more than rounding. `velocity`: of
/// the whole model, after the impact.
std::vector<bool> which_gave_way(const Model& model, std::span<const HeldRate> held, std::span<const double> velocity);

/// (7.20) for self-stresses of grips by a pivoted factor of W, where the joints held have no row (ImpactSolver).
/// Nothing allocates after construction.
class YieldingDrives {
 public:
  YieldingDrives(const Model& model, int rows);

  /// Per velocity, to be filled by the caller for every row: what impulse the held velocities take if an impulse of
  /// unit size acts in that row, in the units of the factor.
  std::span<double> response(int row) { return std::span(response_).subspan(row * velocities_, velocities_); }

  /// Changes `after`, rates of the velocities that are `held`, by (7.20), with w_g = 0. Whether any changed.
  bool give_way(const PivotedCholesky& factor, std::span<const std::uint8_t> held, std::span<double> after);

 private:
  std::size_t rows_, velocities_;
  std::vector<double> inertia_;   // J_r, per velocity
  std::vector<double> response_;  // rows x velocities
  std::vector<double> stress_;    // S_h, self-stresses x velocities, of unit size in J_r^-1
  std::vector<double> null_, right_, z_, ignored_;
  PivotedCholesky small_;
};

}  // namespace grapnel
