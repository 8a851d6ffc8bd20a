#pragma once

/// @file
/// The sweeps of composite_body.hpp, as a template on the scalar.
/// Included by the translation units that instantiate it: composite_body.cpp for doubles, grapnel/lanes/ for packs.

#include "grapnel/dynamics/composite_body.hpp"

#include <algorithm>

#include "grapnel/dynamics/recursion.hpp"

namespace grapnel {
namespace composite_body_steps {

using namespace recursion;

// S^T h of one link for a momentum transformed to it, written to the row and column of the two velocities.
template <class S>
GRAPNEL_INLINE void project(const TreeLink<S>& link, const Momentum<S>& h, int column, const S& sign, int size,
                            std::span<S> M) {
  visit_joint(link, [&](auto joint) {
    put_forces(joint, link, h,
               [&](int row, const S& value) { M[row * size + column] = M[column * size + row] = sign * value; });
  });
}

// The 6 x 6 block of a free root: its composite inertia.
template <class S>
void write_root(const TreeLink<S>& link, const RigidBodyInertia<S>& I, int size, std::span<S> M) {
  if (link.joint != JointType::free) return;
  const ArticulatedInertia<S> A = articulated(I);
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) {
      M[(link.v + r) * size + link.v + c] = A.J(r, c);
      M[(link.v + 3 + r) * size + link.v + 3 + c] = A.M(r, c);
      M[(link.v + r) * size + link.v + 3 + c] = A.H[r][c];
      M[(link.v + 3 + c) * size + link.v + r] = A.H[r][c];
    }
  }
}

}  // namespace composite_body_steps

// q => mass matrix (B.8), row-major: accumulates composite inertias inwards; each joint's momentum per unit rate gives
// its entries with all ancestors.
template <class S>
void composite_body(const Tree<S>& tree, std::span<const S> q, DynamicsWorkspace<S>& workspace,
                    std::span<S> mass_matrix) {
  using namespace composite_body_steps;
  std::vector<LinkScratch<S>>& scratch = workspace.links;
  const int size = tree.velocities;
  std::fill(mass_matrix.begin(), mass_matrix.end(), S(0));
  for (std::size_t n = 0; n < tree.links.size(); ++n) {
    const TreeLink<S>& link = tree.links[n];
    scratch[n].composite = link.inertia;
    visit_joint(link, [&](auto joint) {
      if constexpr (!kIsRoot<decltype(joint)>) place(joint, link, q, scratch[n]);
    });
  }
  for (std::size_t n = tree.links.size(); n-- > 0;) {
    const TreeLink<S>& link = tree.links[n];
    const LinkScratch<S>& w = scratch[n];
    visit_joint(link, [&](auto joint) {
      using Joint = decltype(joint);
      if constexpr (kIsRoot<Joint>) {
        write_root(link, w.composite, size, mass_matrix);
      } else {
        scratch[link.parent].composite += inertia_to_parent(joint, link, w, w.composite);
        for (int k = 0; k < Joint::kVelocities; ++k) {
          Momentum<S> h = unit_momentum(joint, w.composite, k);
          const S sign(OneAxis<Joint> ? link.sign : 1.0);
          project(link, h, link.v + k, sign, size, mass_matrix);
          if (OneAxis<Joint>) mass_matrix[link.v * size + link.v] += link.armature;
          // The momentum is transformed down the branch to the joints of all ancestors.
          for (int m = static_cast<int>(n); tree.links[m].parent >= 0; m = tree.links[m].parent) {
            const TreeLink<S>& carrier = tree.links[m];
            visit_joint(carrier, [&](auto step) {
              if constexpr (!kIsRoot<decltype(step)>) h = force_to_parent(step, carrier, scratch[m], h);
            });
            if (link.has_rotor && m == static_cast<int>(n)) h.angular += link.rotor;
            project(tree.links[carrier.parent], h, link.v + k, sign, size, mass_matrix);
          }
        }
      }
    });
  }
}

}  // namespace grapnel
