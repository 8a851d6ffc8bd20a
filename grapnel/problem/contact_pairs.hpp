#pragma once

/// @file
/// The pairs of bodies that may touch (CaptureProblem::contacts), with the laws of their surfaces.

#include <string>
#include <vector>

#include "grapnel/problem/capture_system.hpp"

namespace grapnel {

/// Two bodies that may touch.
struct ContactPair {
  BodyName a, b;
  ContactLaw law;
};

/// Whether a body of the problem has a shape; a half-space is one.
bool has_shape(const CaptureProblem& problem, const BodyName& body);
/// Why two bodies cannot be a pair: they are one body, have no relative motion, or are connected by a joint, where
/// their shapes overlap. The end of a sentence: "are ..."; empty: they can be one. Both must exist.
std::string contact_pair_fault(const CaptureProblem& problem, const BodyName& a, const BodyName& b);

/// Minimum restitution from which the dissipation of persistent contact between hard surfaces follows.
inline constexpr double kLeastRestitutionAtRest = 0.1;
/// The surface of a material, with the dissipation of its coefficient of restitution. `on_hard`: on a hard surface,
/// where a hard material has impacts with this restitution, and in persistent contact the dissipation at its rest
/// speed.
/// @throws std::invalid_argument as dissipation_for().
ContactMaterial surface_of(const MaterialSetup& material, bool on_hard = false);
/// The law of two materials, in series. `same`: one material states the law of the contact, so that a linear stiffness
/// and a damping are those of both surfaces together (ContactPairsSetup::materials). @throws std::invalid_argument as
/// combine() and dissipation_for().
ContactLaw contact_law_of(const MaterialSetup& a, const MaterialSetup& b, bool same);

/// The pairs of all entries of CaptureProblem::contacts, each once, in their order; the last entry that contains a pair
/// states its law. Groups leave out pairs that contact_pair_fault() rejects; bodies without shapes are left out.
/// `free`: the system with free targets. @throws std::out_of_range for an unknown name, std::invalid_argument as
/// contact_law_of(); problem_conflicts() finds both before.
std::vector<ContactPair> contact_pairs(const CaptureProblem& problem, const CaptureSystem& free);

/// The name of a body in results.
std::string contact_name(const CaptureProblem& problem, const BodyName& body);
/// The bodies of a system that have this name: several for a flexible link, none for an obstacle.
std::vector<int> bodies_named(const CaptureProblem& problem, const CaptureSystem& system, const BodyName& body);

}  // namespace grapnel
