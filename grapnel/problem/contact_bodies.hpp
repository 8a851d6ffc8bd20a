#pragma once

/// @file
/// The pairs of bodies of a problem that may touch, and the laws of their surfaces.

#include <string>
#include <vector>

#include "grapnel/contact/contact_material.hpp"
#include "grapnel/problem/capture_system.hpp"

namespace grapnel {

/// Index of an obstacle where bodies of a model are expected, and the obstacle at such an index.
constexpr int obstacle_body(std::size_t obstacle) { return -1 - static_cast<int>(obstacle); }
constexpr bool is_obstacle(int body) { return body < 0; }
constexpr std::size_t obstacle_at(int body) { return static_cast<std::size_t>(-1 - body); }

/// Two bodies that may touch, and the law of their surfaces.
struct ContactBodies {
  int body_a, body_b;  // indices in CaptureSystem::model, or obstacle_body()
  ContactLaw law;      // of body_a with body_b
};

/// All pairs of CaptureProblem::contacts in a system of the problem, before or after captures. Each pair is listed
/// once; a later rule replaces the law of an earlier one. A flexible link or panel stands for all its pieces. Left out:
/// bodies without shapes; pairs of two groups that contact_pair_fault() rejects; and pairs that are one rigid body in
/// this system, such as a target in a rigid grasp with its gripper. @throws std::out_of_range for an unknown name,
/// std::invalid_argument as contact_law_of(); problem_conflicts() finds both before.
std::vector<ContactBodies> contact_bodies(const CaptureProblem& problem, const CaptureSystem& system);

/// Whether a body of the problem has a shape; a half-space is one.
bool has_shape(const CaptureProblem& problem, const BodyName& body);
/// Why two bodies cannot be a pair: they are one body, have no relative motion, or are connected by a joint, where
/// their shapes overlap. The end of a sentence: "are ..."; empty: they can be one. Both must exist.
std::string contact_pair_fault(const CaptureProblem& problem, const BodyName& a, const BodyName& b);

/// The surface of a material, with the dissipation of its coefficient of restitution. @throws std::invalid_argument as
/// dissipation_for().
ContactMaterial surface_of(const MaterialSetup& material);
/// The law of two materials, in series. `same`: one material states the law of the contact, so that a linear stiffness
/// and a damping are those of both surfaces together (ContactPairsSetup::materials). @throws std::invalid_argument as
/// combine() and dissipation_for().
ContactLaw contact_law_of(const MaterialSetup& a, const MaterialSetup& b, bool same);

}  // namespace grapnel
