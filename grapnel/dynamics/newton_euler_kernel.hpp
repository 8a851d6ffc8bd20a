#pragma once

/// @file
/// The sweeps of newton_euler.hpp, as a template on the scalar. Included by the translation units that instantiate it:
/// newton_euler.cpp for doubles, grapnel/lanes/ for packs. Thread safety: as in newton_euler.hpp.

#include "grapnel/dynamics/newton_euler.hpp"

#include "grapnel/dynamics/recursion.hpp"

namespace grapnel {

// Accelerations => generalized forces and transmitted wrenches (B.6), by an outward and an inward sweep.
template <class S>
void newton_euler(const Tree<S>& tree, const DynamicsInput<S>& in, DynamicsWorkspace<S>& workspace,
                  std::span<S> force) {
  using namespace recursion;
  std::vector<LinkScratch<S>>& scratch = workspace.links;
  const bool moving = !in.acceleration.empty();
  const std::size_t count = tree.links.size();
  // Outward sweep: velocities, accelerations, and the wrench that each link requires: I A + V x* I V - F.
  for (std::size_t n = 0; n < count; ++n) {
    const TreeLink<S>& link = tree.links[n];
    LinkScratch<S>& w = scratch[n];
    if (link.parent < 0) {
      const Vector3<S> g = gravity_in_root(link, in.q, in.gravity);
      w.V = root_velocity(link, in.v);
      w.A = {Vector3<S>::zero(), -g};
      if (moving && link.joint == JointType::free) {
        for (int k = 0; k < 3; ++k) {
          w.A.angular[k] += in.acceleration[link.v + k];
          w.A.linear[k] += in.acceleration[link.v + 3 + k];
        }
      }
    } else {
      const LinkScratch<S>& parent = scratch[link.parent];
      visit_joint(link, [&](auto joint) {
        if constexpr (!kIsRoot<decltype(joint)>) {
          follow(joint, link, in.q, in.v, parent.V, w);
          w.A = motion_to_link(joint, link, w, parent.A) + joint_bias(joint, link, in.v, w.V);
          if (moving) add_joint_motion(joint, link, in.acceleration, w.A);
        }
      });
    }
    w.p = link.inertia * w.A + cross_force(w.V, link.inertia * w.V);
    if (!in.link_wrench.empty()) w.p -= in.link_wrench[n];
    if (!link.has_rotor) continue;
    Vector3<S>& moment = scratch[link.parent].p.angular;
    moment += gyroscopic_moment(link, in.v, scratch[link.parent].V.angular);
    if (moving) moment += S(link.sign * in.acceleration[link.v]) * link.rotor;
  }
  // Inward sweep: the wrench transmitted by each joint, and its component along the joint.
  for (std::size_t n = count; n-- > 0;) {
    const TreeLink<S>& link = tree.links[n];
    LinkScratch<S>& w = scratch[n];
    visit_joint(link, [&](auto joint) {
      using Joint = decltype(joint);
      put_forces(joint, link, w.p, [&](int v, const S& value) { force[v] = value; });
      if constexpr (!kIsRoot<Joint>) {
        if constexpr (OneAxis<Joint>) {
          if (moving) force[link.v] += link.armature * in.acceleration[link.v];
          if (link.has_rotor) force[link.v] += link.sign * dot(link.rotor, scratch[link.parent].A.angular);
        }
        scratch[link.parent].p += force_to_parent(joint, link, w, w.p);
      }
    });
  }
}

}  // namespace grapnel
