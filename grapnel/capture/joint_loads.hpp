#pragma once

/// @file
/// What joints pass on at an instant of a motion: d'Alembert's principle body by body, from accelerations in the world.
/// Thread safety: pure functions.

#include <vector>

#include "grapnel/dynamics/forward_dynamics.hpp"

namespace grapnel {

/// Per body: the wrench that its joint transmits from the parent to it, in W, about the body frame's origin (the
/// joint), driving and constraint components alike. `vdot`: accelerations of the velocities; `external`: what acts on
/// the bodies from outside the tree.
std::vector<Wrenchd> joint_wrenches(const Model& model, const State& state, std::span<const double> vdot,
                                    std::span<const ExternalWrench> external);

}  // namespace grapnel
