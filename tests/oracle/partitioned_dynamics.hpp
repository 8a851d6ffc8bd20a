#pragma once

/// @file
/// Accelerations of closed loops by coordinate partitioning, and the Jacobian of closures: an independent route to
/// those of LoopSolver.

#include <Eigen/Core>
#include <span>
#include <vector>

#include "grapnel/constraint/loop_closure.hpp"
#include "grapnel/dynamics/state.hpp"

namespace grapnel {

/// Jacobian of all closures, stacked in order: rows x velocities. u = J v is the twist of C minus that of D, both at C,
/// in C's axes, in the forbidden directions, angular rows first. Dense.
Eigen::MatrixXd closure_jacobian(const Model& model, const Kinematics& kinematics,
                                 std::span<const LoopClosure> closures);

/// Accelerations by coordinate partitioning, dense: the closures determine some velocities from the others
/// ("determinate" and "indeterminate"; Chaudhary and Saha 2008), v = T v_i, T^T M T vdot_i = T^T (tau - c - M Tdot
/// v_i). An independent method, O(n^3). `tau`: generalized forces in addition to gravity (empty: zero).
struct PartitionedSolution {
  std::vector<double> vdot;
  std::vector<double> multipliers;  // least squares of J^T lambda = M vdot + c - tau
  std::vector<int> independent;     // velocities chosen as independent
};
PartitionedSolution partitioned_dynamics(const Model& model, const State& state, std::span<const LoopClosure> closures,
                                         const std::vector<double>& tau = {},
                                         const Vector3d& gravity = Vector3d::zero());

}  // namespace grapnel
