#pragma once

/// @file
/// The sweeps of root_velocity.hpp, as templates on the scalar. Included by the translation units that instantiate it:
/// root_velocity.cpp for doubles, grapnel/lanes/ for packs. Thread safety: as in root_velocity.hpp.

#include "grapnel/dynamics/root_velocity.hpp"

#include "grapnel/dynamics/recursion.hpp"
#include "grapnel/dynamics/symmetric_solve.hpp"

namespace grapnel {
namespace root_velocity_steps {

using namespace recursion;

// Sums composite inertias into the roots, and into LinkScratch::momentum the momenta of velocities v, with the roots'
// own motion (`moving_root`) or without it.
template <class S>
void sum_momenta(const Tree<S>& tree, std::span<const S> q, std::span<const S> v, bool moving_root,
                 std::vector<LinkScratch<S>>& scratch) {
  place_links(tree, q, scratch);
  const std::size_t count = tree.links.size();
  for (std::size_t n = 0; n < count; ++n) {
    const TreeLink<S>& link = tree.links[n];
    LinkScratch<S>& w = scratch[n];
    if (link.parent < 0) {
      w.V = moving_root ? root_velocity(link, v) : Twist<S>::zero();
    } else {
      visit_joint(link, [&](auto joint) {
        if constexpr (!kIsRoot<decltype(joint)>) {
          move(joint, link, v, scratch[link.parent].V, w);
        }
      });
    }
    w.composite = link.inertia;
    w.momentum = link.inertia * w.V;
  }
  for (std::size_t n = count; n-- > 0;) {
    const TreeLink<S>& link = tree.links[n];
    const LinkScratch<S>& w = scratch[n];
    visit_joint(link, [&](auto joint) {
      if constexpr (!kIsRoot<decltype(joint)>) {
        scratch[link.parent].composite += inertia_to_parent(joint, link, w, w.composite);
        scratch[link.parent].momentum += force_to_parent(joint, link, w, w.momentum);
        if (link.has_rotor) scratch[link.parent].momentum.angular += S(link.sign * v[link.v]) * link.rotor;
      }
    });
  }
}

template <class S>
GRAPNEL_INLINE Rotation<S> root_rotation(const TreeLink<S>& link, std::span<const S> q) {
  return rotation_matrix(Quaternion<S>{q[link.q + 3], q[link.q + 4], q[link.q + 5], q[link.q + 6]});
}

}  // namespace root_velocity_steps

// Conserved momenta, joint coordinates and rates => positions and velocities of the free roots, V_B = I_c^-1 (h_B -
// h_joints).
template <class S>
void recover_roots(const Tree<S>& tree, std::span<const RootMomentum<S>> momentum, const S& elapsed,
                   DynamicsWorkspace<S>& workspace, std::span<S> q, std::span<S> v) {
  using namespace root_velocity_steps;
  sum_momenta<S>(tree, q, v, false, workspace.links);
  int next = 0;
  for (std::size_t n = 0; n < tree.links.size(); ++n) {
    const TreeLink<S>& link = tree.links[n];
    if (link.joint != JointType::free) continue;
    const LinkScratch<S>& w = workspace.links[n];
    const RootMomentum<S>& m = momentum[next++];
    const Rotation<S> R_WB = root_rotation<S>(link, q);
    const Vector3<S> com_B = w.composite.com();
    // The momentum in B about B's origin.
    const Momentum<S> h = shift(transposed_times(R_WB, m.h), -com_B);
    const Wrench<S> rest{h.angular - w.momentum.angular, h.linear - w.momentum.linear};
    const SpatialAcceleration<S> V = solve_rigid(w.composite, rest);
    const Vector3<S> p_WB = m.p_WCom + (elapsed / m.mass) * m.h.linear - R_WB * com_B;
    for (int k = 0; k < 3; ++k) {
      v[link.v + k] = V.angular[k], v[link.v + 3 + k] = V.linear[k];
      q[link.q + k] = p_WB[k];
    }
  }
}

// q and v => conserved momentum, centre of mass and mass of every free root's tree.
template <class S>
void root_momenta(const Tree<S>& tree, std::span<const S> q, std::span<const S> v, DynamicsWorkspace<S>& workspace,
                  std::span<RootMomentum<S>> momentum) {
  using namespace root_velocity_steps;
  sum_momenta<S>(tree, q, v, true, workspace.links);
  int next = 0;
  for (std::size_t n = 0; n < tree.links.size(); ++n) {
    const TreeLink<S>& link = tree.links[n];
    if (link.joint != JointType::free) continue;
    const LinkScratch<S>& w = workspace.links[n];
    const Rotation<S> R_WB = root_rotation(link, q);
    const Vector3<S> com_B = w.composite.com();
    momentum[next++] = {R_WB * shift(w.momentum, com_B),
                        Vector3<S>{q[link.q], q[link.q + 1], q[link.q + 2]} + R_WB * com_B, w.composite.mass};
  }
}

}  // namespace grapnel
