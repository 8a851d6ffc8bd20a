#pragma once

/// @file
/// What the impulses at the grasps do inside the robot: the impulse every joint passes on, driving and constraint
/// components alike.

#include "grapnel/impact/plastic_impact.hpp"

namespace grapnel {

/// Per body: the impulse its joint transmits from the parent to it, in W, about the body frame's origin (the joint).
/// From momentum differences of the bodies beyond the joint, less the external impulses on them; independent of the
/// mass matrix. For a free root it is zero up to rounding, for one fixed to the world it is what the ground gives.
/// `external[i]` acts on body i at point p_WC[i]: pass each grasp twice, on the robot and, reversed, on the target.
struct ExternalImpulse {
  int body;
  Vector3d p_WC;
  Impulsed P_WC;
};
std::vector<Impulsed> joint_impulses(const Model& model, const State& before, const State& after,
                                     std::span<const ExternalImpulse> external);

}  // namespace grapnel
