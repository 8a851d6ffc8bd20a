#pragma once

/// @file
/// The thesis's own impact estimate, (3.8)-(3.13), for comparison only: it uses J thetadot as the end-effectors' twist,
/// which is valid only for zero momentum of the robot, so it does not conserve momentum through an impact.

#include "grapnel/impact/plastic_impact.hpp"

namespace grapnel {

/// Velocities: the joints' (3.11), the base's (3.13), the targets' (3.10); impulses (3.8) with (J^T)^+; checks, which
/// show the violated balances. `root` is the robot's base. Fails if a grasp is not rigid, the base is fixed, or
/// I (thetadot_f - thetadot_i) is not in the range of J^T. If several arms grasp one target, J and J_t of its grasps
/// are stacked, and J_t^-1 in (3.10) and (3.12) is the least-squares inverse; the thesis does not cover this case.
ImpactSolution published_impact(const Model& model, const State& state, int root, std::span<const Grasp> grasps);

}  // namespace grapnel
