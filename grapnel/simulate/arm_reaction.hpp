#pragma once

/// @file
/// The torque by which moving arms turn their base. Thread safety: pure functions.

#include <span>

#include "grapnel/dynamics/state.hpp"
#include "grapnel/model/model.hpp"
#include "grapnel/spatial/vector3.hpp"

namespace grapnel {

/// (18.6): the rate of the angular momentum, about the centre of mass of the root's tree, that the joints' motion adds
/// to it while the root does not accelerate: what a torque on the root has to give so that the arms do not turn it, in
/// the root's axes [N m]. `acceleration`: per velocity, of the joints [rad/s^2 or m/s^2]; others are not read. `idle`:
/// per velocity, of joints that do not count (wheels): they turn as they do, without acceleration.
Vector3d arm_reaction(const Model& model, const State& state, int root, std::span<const double> acceleration,
                      std::span<const std::uint8_t> idle);

}  // namespace grapnel
