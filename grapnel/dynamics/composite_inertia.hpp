#pragma once

/// @file
/// The step of every sweep over composite rigid bodies.

#include "grapnel/dynamics/recursion.hpp"

namespace grapnel::recursion {

/// A rigid inertia seen from the parent's frame.
template <class Joint, class S>
GRAPNEL_INLINE RigidBodyInertia<S> inertia_to_parent(Joint joint, const TreeLink<S>& link, const LinkScratch<S>& w,
                                                     const RigidBodyInertia<S>& I) {
  Symmetric3<S> J = I.rotational;
  Vector3<S> h = joint_forth(joint, w, I.first_moment);
  if constexpr (std::is_same_v<Joint, Spherical>) {
    J = rotate(w.R_FL, J);
  } else if constexpr (Joint::kTurns) {
    constexpr int K = Joint::kAxis, i = (K + 1) % 3, j = (K + 2) % 3;
    const S ji = J(i, K), jj = J(j, K);
    rotate_block_about<K>(w.angle, J);
    J(i, K) = w.angle.cosine * ji - w.angle.sine * jj;
    J(j, K) = w.angle.sine * ji + w.angle.cosine * jj;
  }
  if (link.rotated) {
    J = rotate(link.X_PF.R, J);
    h = link.X_PF.R * h;
  }
  return shift_origin(RigidBodyInertia<S>{I.mass, h, J}, w.p_PL);
}

}  // namespace grapnel::recursion
