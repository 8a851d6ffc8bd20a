#pragma once

/// @file
/// The pairs of bodies that may touch (CaptureProblem::contacts), with the laws of their surfaces.

#include <span>
#include <string>
#include <vector>

#include "grapnel/problem/capture_system.hpp"

namespace grapnel {

/// Two bodies that may touch.
struct ContactPair {
  BodyName a, b;
  ContactLaw law;
};

/// The law of the surfaces of two materials. `is_one`: a single material is stated for both surfaces; its linear
/// stiffness and damping are then those of the contact. @throws std::invalid_argument as combine() and
/// dissipation_for().
ContactLaw contact_law(const MaterialSetup& a, const MaterialSetup& b, bool is_one);

/// The pairs of all entries of CaptureProblem::contacts, each once, in their order; the last entry that contains a pair
/// states its law. `free`: the system with free targets. @throws std::invalid_argument if a material is unknown or
/// invalid.
std::vector<ContactPair> contact_pairs(const CaptureProblem& problem, const CaptureSystem& free);

/// The name of a body in results.
std::string contact_name(const CaptureProblem& problem, const BodyName& body);
/// The bodies of a system that have this name: several for a flexible link, none for an obstacle.
std::vector<int> bodies_named(const CaptureProblem& problem, const CaptureSystem& system, const BodyName& body);

}  // namespace grapnel
