#pragma once

/// @file
/// Restitution at bilateral grasps, u+ = -E u-: the grasps' relative velocities rebound row by row. dT = -1/2
/// u-^T (1 + E) W^+ (1 - E) u-  (docs/theory, section 11).

#include "grapnel/impact/plastic_impact.hpp"

namespace grapnel {

/// `restitution`: per grasp its coefficients, one per row of constrained_directions() in order, each from 0 to 1.
/// @throws std::invalid_argument if sizes do not fit or a coefficient is out of range.
ImpactSolution bilateral_restitution(const Model& model, const State& state, std::span<const Grasp> grasps,
                                     std::span<const std::vector<double>> restitution,
                                     std::span<const HeldRate> held = {});

}  // namespace grapnel
