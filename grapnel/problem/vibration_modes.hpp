#pragma once

/// @file
/// Modes of vibration that a file states for a body, as masses and rotors on springs; (22.9) to (22.9b) of
/// docs/theory. Internal to this module, except for modes_fault() of flexible_bodies.hpp.

#include <vector>

#include "grapnel/model/description.hpp"

namespace grapnel {

/// The bodies that flexible_robot() adds to a link for its modes: NAME:mode-K with a spring for each mode, and
/// NAME:modes, which subtracts the masses that would otherwise count twice. The link itself remains one body.
std::vector<BodyDescription> bodies_of_modes(const BodyDescription& link);

}  // namespace grapnel
