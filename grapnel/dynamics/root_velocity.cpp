#include "grapnel/dynamics/root_velocity.hpp"

#include "grapnel/dynamics/composite_inertia.hpp"
#include "grapnel/dynamics/recursion.hpp"
#include "grapnel/dynamics/symmetric_solve.hpp"

namespace grapnel {
namespace {

using namespace recursion;

// Sums composite inertias into the roots, and into LinkScratch::momentum the momenta of velocities v with the roots'
// own motion (`moving_root`) or without it.
template <class S>
void sum_momenta(const Tree<S>& tree, std::span<const S> q, std::span<const S> v, bool moving_root,
                 std::vector<LinkScratch<S>>& scratch) {
  const std::size_t count = tree.links.size();
  for (std::size_t n = 0; n < count; ++n) {
    const TreeLink<S>& link = tree.links[n];
    LinkScratch<S>& w = scratch[n];
    if (link.parent < 0) {
      w.V = moving_root ? root_velocity(link, v) : Twist<S>::zero();
    } else {
      visit_joint(link, [&](auto joint) {
        if constexpr (!std::is_same_v<decltype(joint), Root>) {
          place(joint, link, q, w);
          w.V = motion_to_link(joint, link, w, scratch[link.parent].V);
          add_joint_motion(joint, link, v, w.V);
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
      if constexpr (!std::is_same_v<decltype(joint), Root>) {
        scratch[link.parent].composite += inertia_to_parent(joint, link, w, w.composite);
        scratch[link.parent].momentum += force_to_parent(joint, link, w, w.momentum);
      }
    });
  }
}

template <class S>
GRAPNEL_INLINE Rotation<S> root_rotation(const TreeLink<S>& link, std::span<const S> q) {
  return rotation_matrix(Quaternion<S>{q[link.q + 3], q[link.q + 4], q[link.q + 5], q[link.q + 6]});
}

}  // namespace

template <class S>
void recover_root_velocities(const Tree<S>& tree, std::span<const S> q, std::span<const Momentum<S>> momentum,
                             DynamicsWorkspace<S>& workspace, std::span<S> v) {
  sum_momenta<S>(tree, q, v, false, workspace.links);
  int next = 0;
  for (std::size_t n = 0; n < tree.links.size(); ++n) {
    const TreeLink<S>& link = tree.links[n];
    if (link.joint != LinkJoint::root_free) continue;
    const LinkScratch<S>& w = workspace.links[n];
    // The momentum in B about B's origin.
    const Momentum<S> h = shift(transposed_times(root_rotation(link, q), momentum[next++]), -w.composite.com());
    const Wrench<S> rest{h.angular - w.momentum.angular, h.linear - w.momentum.linear};
    const SpatialAcceleration<S> V = solve_articulated(articulated(w.composite), rest);
    for (int k = 0; k < 3; ++k) v[link.v + k] = V.angular[k], v[link.v + 3 + k] = V.linear[k];
  }
}

template <class S>
void root_momenta(const Tree<S>& tree, std::span<const S> q, std::span<const S> v, DynamicsWorkspace<S>& workspace,
                  std::span<Momentum<S>> momentum) {
  sum_momenta<S>(tree, q, v, true, workspace.links);
  int next = 0;
  for (std::size_t n = 0; n < tree.links.size(); ++n) {
    const TreeLink<S>& link = tree.links[n];
    if (link.joint != LinkJoint::root_free) continue;
    const LinkScratch<S>& w = workspace.links[n];
    momentum[next++] = root_rotation(link, q) * shift(w.momentum, w.composite.com());
  }
}

template void recover_root_velocities<double>(const Tree<double>&, std::span<const double>,
                                              std::span<const Momentum<double>>, DynamicsWorkspace<double>&,
                                              std::span<double>);
template void root_momenta<double>(const Tree<double>&, std::span<const double>, std::span<const double>,
                                   DynamicsWorkspace<double>&, std::span<Momentum<double>>);

}  // namespace grapnel
