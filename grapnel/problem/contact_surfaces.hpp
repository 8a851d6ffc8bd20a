#pragma once

/// @file
/// The contacts of a problem's pairs between the bodies of one of its systems.

#include <memory>
#include <span>

#include "grapnel/contact/contact_set.hpp"
#include "grapnel/problem/contact_pairs.hpp"

namespace grapnel {

/// The contacts of `pairs`, one group per pair, in a system of the problem that has their bodies. All modes are
/// unknown.
/// @throws std::invalid_argument as ContactSet.
std::shared_ptr<ContactSet> make_contact_set(const CaptureProblem& problem, const CaptureSystem& system,
                                             std::span<const ContactPair> pairs);

}  // namespace grapnel
