#pragma once

/// @file
/// The reaction torque of moving arms on their base. Thread safety: pure functions.

#include <span>

#include "grapnel/dynamics/state.hpp"
#include "grapnel/model/model.hpp"
#include "grapnel/spatial/vector3.hpp"

namespace grapnel {

/// (18.6): the rate of the angular momentum that the joints' motion adds about the centre of mass of the root's tree,
/// for a root without acceleration. It is the torque on the root that compensates the arms' motion, in the root's axes
/// [N m]. `acceleration`: per velocity, of the joints [rad/s^2 or m/s^2]; others are not read. `idle`: per velocity,
/// joints that are excluded (wheels): they keep their rates.
Vector3d arm_reaction(const Model& model, const State& state, int root, std::span<const double> acceleration,
                      std::span<const std::uint8_t> idle);

}  // namespace grapnel
