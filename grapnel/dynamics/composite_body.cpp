#include "grapnel/dynamics/composite_body.hpp"

#include <algorithm>

#include "grapnel/dynamics/composite_inertia.hpp"
#include "grapnel/dynamics/recursion.hpp"

namespace grapnel {
namespace {

using namespace recursion;

// Momentum of the composite body when joint direction k moves with unit rate: I_c S_k.
template <int K, class S>
GRAPNEL_INLINE Momentum<S> unit_momentum(Revolute<K>, const RigidBodyInertia<S>& I, int) {
  const Vector3<S>& h = I.first_moment;
  return {{I.rotational(0, K), I.rotational(1, K), I.rotational(2, K)}, cross(Vector3<S>::unit(K), h)};
}
template <int K, class S>
GRAPNEL_INLINE Momentum<S> unit_momentum(Prismatic<K>, const RigidBodyInertia<S>& I, int) {
  return {cross(I.first_moment, Vector3<S>::unit(K)), I.mass * Vector3<S>::unit(K)};
}
template <class S>
GRAPNEL_INLINE Momentum<S> unit_momentum(Spherical, const RigidBodyInertia<S>& I, int k) {
  return {{I.rotational(0, k), I.rotational(1, k), I.rotational(2, k)}, cross(Vector3<S>::unit(k), I.first_moment)};
}

// S^T h of one link for a momentum carried to it, written to the row and column the two velocities share.
template <class S>
GRAPNEL_INLINE void project(const TreeLink<S>& link, const Momentum<S>& h, int column, const S& sign, int size,
                            std::span<S> M) {
  const auto write = [&](int row, const S& value) { M[row * size + column] = M[column * size + row] = value; };
  visit_joint(link, [&](auto joint) {
    using Joint = decltype(joint);
    if constexpr (std::is_same_v<Joint, Root>) {
      if (link.joint != JointType::free) return;
      for (int k = 0; k < 3; ++k) write(link.v + k, sign * h.angular[k]), write(link.v + 3 + k, sign * h.linear[k]);
    } else if constexpr (std::is_same_v<Joint, Spherical>) {
      for (int k = 0; k < 3; ++k) write(link.v + k, sign * h.angular[k]);
    } else {
      write(link.v, sign * link.sign * along(joint, h));
    }
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

}  // namespace

template <class S>
void composite_body(const Tree<S>& tree, std::span<const S> q, DynamicsWorkspace<S>& workspace,
                    std::span<S> mass_matrix) {
  std::vector<LinkScratch<S>>& scratch = workspace.links;
  const int size = tree.velocities;
  std::fill(mass_matrix.begin(), mass_matrix.end(), S(0));
  for (std::size_t n = 0; n < tree.links.size(); ++n) {
    const TreeLink<S>& link = tree.links[n];
    scratch[n].composite = link.inertia;
    visit_joint(link, [&](auto joint) {
      if constexpr (!std::is_same_v<decltype(joint), Root>) place(joint, link, q, scratch[n]);
    });
  }
  for (std::size_t n = tree.links.size(); n-- > 0;) {
    const TreeLink<S>& link = tree.links[n];
    const LinkScratch<S>& w = scratch[n];
    visit_joint(link, [&](auto joint) {
      using Joint = decltype(joint);
      if constexpr (std::is_same_v<Joint, Root>) {
        write_root(link, w.composite, size, mass_matrix);
      } else {
        scratch[link.parent].composite += inertia_to_parent(joint, link, w, w.composite);
        constexpr int kColumns = std::is_same_v<Joint, Spherical> ? 3 : 1;
        for (int k = 0; k < kColumns; ++k) {
          Momentum<S> h = unit_momentum(joint, w.composite, k);
          const S sign(kColumns == 1 ? link.sign : 1.0);
          project(link, h, link.v + k, sign, size, mass_matrix);
          if (kColumns == 1) mass_matrix[link.v * size + link.v] += link.armature;
          // Carried down the branch, the momentum meets every ancestor's joint.
          for (int m = static_cast<int>(n); tree.links[m].parent >= 0; m = tree.links[m].parent) {
            const TreeLink<S>& carrier = tree.links[m];
            visit_joint(carrier, [&](auto step) {
              if constexpr (!std::is_same_v<decltype(step), Root>) h = force_to_parent(step, carrier, scratch[m], h);
            });
            project(tree.links[carrier.parent], h, link.v + k, sign, size, mass_matrix);
          }
        }
      }
    });
  }
}

template void composite_body<double>(const Tree<double>&, std::span<const double>, DynamicsWorkspace<double>&,
                                     std::span<double>);
template void composite_body<Dual>(const Tree<Dual>&, std::span<const Dual>, DynamicsWorkspace<Dual>&, std::span<Dual>);

}  // namespace grapnel
