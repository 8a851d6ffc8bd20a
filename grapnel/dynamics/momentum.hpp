#pragma once

/// @file
/// Momentum, centre of mass and kinetic energy, body by body from poses and twists: independent of the mass matrix and
/// of what an integrator carries, so that a ledger can trust it.

#include <span>

#include "grapnel/dynamics/kinematics.hpp"

namespace grapnel {

/// Inertia of one body about the world's axes at its frame's origin.
RigidBodyInertiad world_inertia(const Model& model, const Kinematics& kinematics, int body);

/// Momentum of one body about its own centre of mass, in W, and where that centre is.
struct BodyMomentum {
  Momentumd h;    // [angular about the body's centre of mass; linear] in W
  Vector3d p_WC;  // centre of mass in W
};
BodyMomentum body_momentum(const Model& model, const Kinematics& kinematics, int body);

/// Centre of mass, in W, of the trees rooted at `roots` (empty: of everything).
Vector3d center_of_mass(const Model& model, const Kinematics& kinematics, std::span<const int> roots = {});

/// Total momentum [l; p] about a point of W, in W (2.2), of the trees rooted at `roots` (empty: of everything). Rotors
/// count through the mass matrix's diagonal only (their spin is not in l), as everywhere in Grapnel.
Momentumd momentum_about(const Model& model, const Kinematics& kinematics, const Vector3d& p_W,
                         std::span<const int> roots = {});

/// Kinetic energy [J], rotors included: sum of V . I V / 2 over bodies plus reflected inertia times rate squared / 2,
/// of the trees rooted at `roots` (empty: of everything).
double kinetic_energy(const Model& model, const Kinematics& kinematics, const State& state,
                      std::span<const int> roots = {});

}  // namespace grapnel
