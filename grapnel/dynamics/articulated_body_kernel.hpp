#pragma once

/// @file
/// The three sweeps of articulated_body.hpp, as templates on the scalar. Included by the translation units that
/// instantiate it: articulated_body.cpp for doubles, grapnel/lanes/ for packs. Thread safety: as in
/// articulated_body.hpp.

#include "grapnel/dynamics/articulated_body.hpp"

#include "grapnel/dynamics/recursion.hpp"

namespace grapnel {
namespace articulated_body_steps {

using namespace recursion;

template <class S>
bool is_prescribed(const DynamicsInput<S>& in, int v) {
  return !in.prescribed.empty() && in.prescribed[v] != 0;
}

// Whether modal joints are supported for this scalar.
template <class S>
inline constexpr bool kHasChains = std::is_same_v<S, double>;

// First sweep, root to tips: velocities, bias accelerations, rigid inertias and bias wrenches V x* I V - F.
template <class S>
void outward_velocities(const Tree<S>& tree, const DynamicsInput<S>& in, std::vector<LinkScratch<S>>& scratch) {
  if (!in.placed) place_links(tree, in.q, scratch);
  const std::size_t count = tree.links.size();
  for (std::size_t n = 0; n < count; ++n) {
    const TreeLink<S>& link = tree.links[n];
    LinkScratch<S>& w = scratch[n];
    if (link.parent < 0) {
      w.V = root_velocity(link, in.v);
    } else {
      const LinkScratch<S>& parent = scratch[link.parent];
      visit_joint(link, [&](auto joint) GRAPNEL_INLINE_LAMBDA {
        if constexpr (!kIsRoot<decltype(joint)>) {
          move(joint, link, in.v, parent.V, w);
          w.bias = joint_bias(joint, link, in.v, w.V);
        }
      });
    }
    w.carries = false;
    w.p = cross_force(w.V, link.inertia * w.V);
    if (!in.link_wrench.empty()) w.p -= in.link_wrench[n];
    if (link.has_rotor) scratch[link.parent].p.angular += gyroscopic_moment(link, in.v, scratch[link.parent].V.angular);
  }
}

// The second sweep's step. One function per kind of joint; a single function for all kinds spills more registers.
template <class Joint, class S>
__attribute__((noinline)) void pass_inertia(Joint joint, const TreeLink<S>& link, const DynamicsInput<S>& in,
                                            LinkScratch<S>& w, const TreeLink<S>& carrier, LinkScratch<S>& parent) {
  if (is_prescribed(in, link.v)) {
    send_rigid(joint, link, in.acceleration, w, carrier, parent);
  } else {
    send(joint, link, in.force, w, carrier, parent);
  }
}

// Second sweep, tips to root: articulated inertias.
template <class S>
void inward_inertias(const Tree<S>& tree, const DynamicsInput<S>& in, DynamicsWorkspace<S>& workspace) {
  std::vector<LinkScratch<S>>& scratch = workspace.links;
  for (std::size_t n = tree.links.size(); n-- > 0;) {
    const TreeLink<S>& link = tree.links[n];
    LinkScratch<S>& w = scratch[n];
    if (!w.carries) set_rigid(w.I, link.inertia);
    if (link.parent < 0) continue;
    const TreeLink<S>& carrier = tree.links[link.parent];
    LinkScratch<S>& parent = scratch[link.parent];
    visit_joint(link, [&](auto joint) GRAPNEL_INLINE_LAMBDA {
      if constexpr (kHasChains<S>) {
        if constexpr (OneAxis<decltype(joint)>) {
          if (link.chain >= 0 && !is_prescribed(in, link.v)) {
            const ChainPlace modes{tree.chains[link.chain], workspace.chains[link.chain]};
            send_modal(joint, LinkPlace{link, w}, modes, in.force, LinkPlace{carrier, parent});
            return;
          }
        }
      }
      if constexpr (!kIsRoot<decltype(joint)>) pass_inertia(joint, link, in, w, carrier, parent);
    });
  }
}

// Solves I A' = F at free root number n. A caller with a factored inertia passes another functor.
struct SolveArticulated {
  template <class S>
  GRAPNEL_INLINE SpatialAcceleration<S> operator()(std::size_t, const TreeLink<S>& link, const LinkScratch<S>& w,
                                                   const Wrench<S>& F) const {
    return w.carries ? solve_articulated(w.I, F) : solve_rigid(link.inertia, F);
  }
};

// Root number n: solves I A' = F - p for A' = A - gravity, or takes the prescribed acceleration and returns the
// required wrench.
template <class S, class Solve>
void solve_root(std::size_t n, const TreeLink<S>& link, const DynamicsInput<S>& in, LinkScratch<S>& w,
                const DynamicsOutput<S>& out, const Solve& solve) {
  const auto [vdot, force] = out;
  const Vector3<S> g = gravity_in_root(link, in.q, in.gravity);
  if (link.joint == JointType::fixed) {
    w.A = {Vector3<S>::zero(), -g};
    return;
  }
  if (is_prescribed(in, link.v)) {
    for (int k = 0; k < 3; ++k) {
      w.A.angular[k] = in.acceleration[link.v + k];
      w.A.linear[k] = in.acceleration[link.v + 3 + k] - g[k];
    }
    const Wrench<S> F = w.I * w.A + w.p;
    for (int k = 0; k < 3; ++k) force[link.v + k] = F.angular[k], force[link.v + 3 + k] = F.linear[k];
  } else {
    const Wrench<S> F{{in.force[link.v] - w.p.angular[0], in.force[link.v + 1] - w.p.angular[1],
                       in.force[link.v + 2] - w.p.angular[2]},
                      {in.force[link.v + 3] - w.p.linear[0], in.force[link.v + 4] - w.p.linear[1],
                       in.force[link.v + 5] - w.p.linear[2]}};
    w.A = solve(n, link, w, F);
    for (int k = 0; k < 6; ++k) force[link.v + k] = in.force[link.v + k];
  }
  for (int k = 0; k < 3; ++k) vdot[link.v + k] = w.A.angular[k], vdot[link.v + 3 + k] = w.A.linear[k] + g[k];
}

// Third sweep, root to tips: accelerations.
template <class S, class Solve = SolveArticulated>
void outward_accelerations(const Tree<S>& tree, const DynamicsInput<S>& in, DynamicsWorkspace<S>& workspace,
                           const DynamicsOutput<S>& out, const Solve& solve = {}) {
  std::vector<LinkScratch<S>>& scratch = workspace.links;
  const std::size_t count = tree.links.size();
  for (std::size_t n = 0; n < count; ++n) {
    const TreeLink<S>& link = tree.links[n];
    LinkScratch<S>& w = scratch[n];
    if (link.parent < 0) {
      solve_root(n, link, in, w, out, solve);
      continue;
    }
    const bool rigid = is_prescribed(in, link.v);
    visit_joint(link, [&](auto joint) GRAPNEL_INLINE_LAMBDA {
      if constexpr (!kIsRoot<decltype(joint)>) {
        if constexpr (kHasChains<S>) {
          if constexpr (OneAxis<decltype(joint)>) {
            if (link.chain >= 0 && !rigid) {
              w.A = motion_to_link(joint, link, w, scratch[link.parent].A);
              const ChainPlace modes{tree.chains[link.chain], workspace.chains[link.chain]};
              accelerate_modal(joint, LinkPlace{link, w}, modes, in, out);
              return;
            }
          }
        }
        w.A = motion_to_link(joint, link, w, scratch[link.parent].A) + w.bias;
        accelerate(joint, link, in, rigid, w, out);
      }
    });
  }
}

}  // namespace articulated_body_steps

template <class S>
void articulated_inertias(const Tree<S>& tree, const DynamicsInput<S>& in, DynamicsWorkspace<S>& workspace) {
  articulated_body_steps::outward_velocities(tree, in, workspace.links);
  articulated_body_steps::inward_inertias(tree, in, workspace);
}

template <class S>
void articulated_accelerations(const Tree<S>& tree, const DynamicsInput<S>& in, DynamicsWorkspace<S>& workspace,
                               std::span<S> vdot, std::span<S> force) {
  articulated_body_steps::outward_accelerations(tree, in, workspace, DynamicsOutput<S>{vdot, force});
}

template <class S>
void articulated_body(const Tree<S>& tree, const DynamicsInput<S>& in, DynamicsWorkspace<S>& workspace,
                      std::span<S> vdot, std::span<S> force) {
  articulated_body_steps::outward_velocities(tree, in, workspace.links);
  articulated_body_steps::inward_inertias(tree, in, workspace);
  articulated_body_steps::outward_accelerations(tree, in, workspace, DynamicsOutput<S>{vdot, force});
}

}  // namespace grapnel
