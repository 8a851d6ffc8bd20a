#pragma once

/// @file
/// Modes of vibration that a file states for a body, as masses and rotors on springs; (22.9) to (22.9b) of
/// docs/theory. Internal to this module, but for modes_fault() of flexible_bodies.hpp.

#include <vector>

#include "grapnel/model/description.hpp"

namespace grapnel {

/// What flexible_robot() hangs on a link for its modes: a body NAME:mode-K with a spring for each, and NAME:modes,
/// which takes back what of the link's mass the modes' masses count a second time. The link itself stays whole.
std::vector<BodyDescription> bodies_of_modes(const BodyDescription& link);

}  // namespace grapnel
