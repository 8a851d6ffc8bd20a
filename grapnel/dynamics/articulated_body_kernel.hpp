#pragma once

/// @file
/// The three sweeps of articulated_body.hpp, as templates on the scalar.
/// Included by the translation units that instantiate it: articulated_body.cpp for doubles, grapnel/lanes/ for packs.
/// Thread safety: as articulated_body.hpp says.

#include "grapnel/dynamics/articulated_body.hpp"

#include "grapnel/dynamics/recursion.hpp"
#include "grapnel/dynamics/symmetric_solve.hpp"

namespace grapnel {
namespace articulated_body_steps {

using namespace recursion;

// The inertia and bias wrench that the joint passes to the parent, still in the link's frame:
//   I_a = I - U D^-1 U^T,   p_a = p + I_a c + U D^-1 u,
// the terms of (4.8) and (4.11) of docs/theory.md; c is the bias acceleration (Featherstone 2008, eqs. 7.25, 7.26).
template <class S>
struct Transmitted {
  ArticulatedInertia<S> I;
  Wrench<S> p;
};

// The sums of (4.8) and (4.11). The first child to arrive brings the carrier's own inertia in: its structure is still
// known there, and the first sweep need not write it out.
template <class S>
GRAPNEL_INLINE void receive(const TreeLink<S>& carrier, const ArticulatedInertia<S>& I, const Wrench<S>& p,
                            LinkScratch<S>& parent) {
  if (parent.carries) {
    parent.I += I;
  } else {
    set_sum(parent.I, carrier.inertia, I);
    parent.carries = true;
  }
  parent.p += p;
}

// One column of the factorization (4.9).
template <class S>
struct Column {
  Wrench<S> U;  // I S: what unit acceleration of the joint takes
  S u;          // force - S^T p
};
// D = S^T I S + armature divides once: the third sweep, a chain of dependent steps, only multiplies and adds.
template <class S>
GRAPNEL_INLINE void store_gain(const Column<S>& column, const S& D, LinkScratch<S>& w) {
  const S D_inverse = S(1) / D;
  w.G = D_inverse * column.U;
  w.g = D_inverse * column.u;
}

// I_a = I - G U^T, p_a = p + I_a c + G u, for any structure; t holds I and p. Changed in place: with packs, structures
// of this size returned or assigned as a whole go through memory (a sixth of the time).
template <class S>
GRAPNEL_INLINE void eliminate(const Column<S>& column, const LinkScratch<S>& w, Transmitted<S>& t) {
  const Vector3<S>&a = w.G.angular, &l = w.G.linear, &Ua = column.U.angular, &Ul = column.U.linear;
  t.I.J.xx -= a[0] * Ua[0], t.I.J.yy -= a[1] * Ua[1], t.I.J.zz -= a[2] * Ua[2];
  t.I.J.xy -= a[0] * Ua[1], t.I.J.xz -= a[0] * Ua[2], t.I.J.yz -= a[1] * Ua[2];
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) t.I.H[r][c] -= a[r] * Ul[c];
  }
  t.I.M.xx -= l[0] * Ul[0], t.I.M.yy -= l[1] * Ul[1], t.I.M.zz -= l[2] * Ul[2];
  t.I.M.xy -= l[0] * Ul[1], t.I.M.xz -= l[0] * Ul[2], t.I.M.yz -= l[1] * Ul[2];
  t.p += t.I * w.bias;
  t.p += column.u * w.G;
}

// The same for a revolute joint without rotor: the moment row of the axis vanishes exactly, and so do its products;
// c has no component along the axis.
template <int K, class S>
GRAPNEL_INLINE void eliminate_revolute(const Column<S>& column, const LinkScratch<S>& w, Transmitted<S>& t) {
  constexpr int i = (K + 1) % 3, j = (K + 2) % 3;
  ArticulatedInertia<S>& I = t.I;
  const Vector3<S>&a = w.G.angular, &l = w.G.linear, &Ua = column.U.angular, &Ul = column.U.linear;
  I.J(i, i) -= a[i] * Ua[i], I.J(i, j) -= a[i] * Ua[j], I.J(j, j) -= a[j] * Ua[j];
  I.J(K, K) = I.J(i, K) = I.J(j, K) = S(0);
  for (int c = 0; c < 3; ++c) {
    I.H[K][c] = S(0);
    I.H[i][c] -= a[i] * Ul[c];
    I.H[j][c] -= a[j] * Ul[c];
  }
  I.M.xx -= l[0] * Ul[0], I.M.yy -= l[1] * Ul[1], I.M.zz -= l[2] * Ul[2];
  I.M.xy -= l[0] * Ul[1], I.M.xz -= l[0] * Ul[2], I.M.yz -= l[1] * Ul[2];
  const Vector3<S>&ca = w.bias.angular, &cl = w.bias.linear;
  t.p.angular[i] += I.J(i, i) * ca[i] + I.J(i, j) * ca[j] + I.H[i][i] * cl[i] + I.H[i][j] * cl[j];
  t.p.angular[j] += I.J(i, j) * ca[i] + I.J(j, j) * ca[j] + I.H[j][i] * cl[i] + I.H[j][j] * cl[j];
  for (int c = 0; c < 3; ++c) {
    t.p.linear[c] += I.M(c, i) * cl[i] + I.M(c, j) * cl[j] + I.H[i][c] * ca[i] + I.H[j][c] * ca[j];
  }
  t.p += column.u * w.G;
}

// From the link's frame at its joint to the parent's, then to the parent's origin.
template <class S>
GRAPNEL_INLINE void shift_to_parent(const TreeLink<S>& link, const Vector3<S>& p_PL, ArticulatedInertia<S>& I) {
  if (link.rotated) rotate_general(I, link.X_PF.R);
  shift_origin(I, p_PL);
}

// Behind a link whose joint gives way: sends inertia and bias wrench to the parent.
template <int K, class S>
GRAPNEL_INLINE void send(Revolute<K> joint, const TreeLink<S>& link, const S& force, LinkScratch<S>& w,
                         const TreeLink<S>& carrier, LinkScratch<S>& parent) {
  const Column<S> column{{{w.I.J(0, K), w.I.J(1, K), w.I.J(2, K)}, {w.I.H[K][0], w.I.H[K][1], w.I.H[K][2]}},
                         link.sign * force - w.p.angular[K]};
  store_gain(column, w.I.J(K, K) + link.armature, w);
  Transmitted<S> t{loaded(w.I), loaded(w.p)};
  if (!link.has_armature) {
    eliminate_revolute<K>(column, w, t);
    rotate_behind_joint<K>(w.angle, t.I);
    if (link.rotated) {
      shift_to_parent(link, w.p_PL, t.I);
    } else {
      shift_behind_joint<K>(t.I, w.p_PL);
    }
  } else {
    eliminate(column, w, t);
    rotate_about<K>(w.angle, t.I);
    shift_to_parent(link, w.p_PL, t.I);
  }
  receive(carrier, t.I, force_to_parent(joint, link, w, t.p), parent);
}

template <int K, class S>
GRAPNEL_INLINE void send(Prismatic<K> joint, const TreeLink<S>& link, const S& force, LinkScratch<S>& w,
                         const TreeLink<S>& carrier, LinkScratch<S>& parent) {
  const Column<S> column{{{w.I.H[0][K], w.I.H[1][K], w.I.H[2][K]}, {w.I.M(0, K), w.I.M(1, K), w.I.M(2, K)}},
                         link.sign * force - w.p.linear[K]};
  store_gain(column, w.I.M(K, K) + link.armature, w);
  Transmitted<S> t{loaded(w.I), loaded(w.p)};
  eliminate(column, w, t);
  shift_to_parent(link, w.p_PL, t.I);
  receive(carrier, t.I, force_to_parent(joint, link, w, t.p), parent);
}

// A spherical joint takes all moment: with I = [J H; H^T M], I_a = [0 0; 0 M - H^T J^-1 H].
template <class S>
GRAPNEL_INLINE void send(Spherical joint, const TreeLink<S>& link, const Vector3<S>& torque, LinkScratch<S>& w,
                         const TreeLink<S>& carrier, LinkScratch<S>& parent) {
  const SymmetricFactor3<S> J(w.I.J);
  const Vector3<S> u = torque - w.p.angular;
  Transmitted<S> t;
  t.I.J = Symmetric3<S>::zero();
  for (auto& row : t.I.H) row[0] = row[1] = row[2] = S(0);
  Vector3<S> X[3];  // columns of J^-1 H
  for (int c = 0; c < 3; ++c) X[c] = J.solve({w.I.H[0][c], w.I.H[1][c], w.I.H[2][c]});
  const auto HtX = [&](int r, int c) { return w.I.H[0][r] * X[c][0] + w.I.H[1][r] * X[c][1] + w.I.H[2][r] * X[c][2]; };
  const Symmetric3<S>& M = w.I.M;
  t.I.M = {M.xx - HtX(0, 0), M.yy - HtX(1, 1), M.zz - HtX(2, 2), M.xy - HtX(0, 1), M.xz - HtX(0, 2), M.yz - HtX(1, 2)};
  // p_a = p + I_a c + U D^-1 u; its moment is p.angular + u = torque.
  t.p.angular = torque;
  t.p.linear = w.p.linear + t.I.M * w.bias.linear;
  for (int c = 0; c < 3; ++c) t.p.linear[c] += dot(X[c], u);
  t.I.M = rotate(w.R_FL, t.I.M);
  shift_to_parent(link, w.p_PL, t.I);
  receive(carrier, t.I, force_to_parent(joint, link, w, t.p), parent);
}

// Behind a joint whose acceleration is prescribed: nothing yields, and S times the acceleration joins the bias.
template <class Joint, class S>
GRAPNEL_INLINE void send_rigid(Joint joint, const TreeLink<S>& link, std::span<const S> acceleration, LinkScratch<S>& w,
                               const TreeLink<S>& carrier, LinkScratch<S>& parent) {
  add_joint_motion(joint, link, acceleration, w.bias);
  ArticulatedInertia<S> I = loaded(w.I);
  const Wrench<S> p = w.p + I * w.bias;
  if constexpr (std::is_same_v<Joint, Spherical>) {
    rotate_general(I, w.R_FL);
  } else if constexpr (Joint::kTurns) {
    rotate_about<Joint::kAxis>(w.angle, I);
  }
  shift_to_parent(link, w.p_PL, I);
  receive(carrier, I, force_to_parent(joint, link, w, p), parent);
}

template <class S>
bool is_prescribed(const DynamicsInput<S>& in, int v) {
  return !in.prescribed.empty() && in.prescribed[v] != 0;
}

// Whether place_links() goes before the first sweep. Faster for doubles too (a tenth), but there -march=native then
// fuses other products and sums than before, which moves the last bits of every result.
template <class S>
inline constexpr bool kPlacesFirst = !std::is_same_v<S, double>;

// Where the links are on their joints. In a sweep of its own because sines and cosines are long chains of operations
// that do not wait for each other.
template <class S>
void place_links(const Tree<S>& tree, std::span<const S> q, std::vector<LinkScratch<S>>& scratch) {
  const std::size_t count = tree.links.size();
  for (std::size_t n = 0; n < count; ++n) {
    const TreeLink<S>& link = tree.links[n];
    visit_joint(link, [&](auto joint) {
      if constexpr (!std::is_same_v<decltype(joint), Root>) place(joint, link, q, scratch[n]);
    });
  }
}

// First sweep, root to tips: velocities, bias accelerations, rigid inertias and bias wrenches V x* I V - F.
template <class S>
void outward_velocities(const Tree<S>& tree, const DynamicsInput<S>& in, std::vector<LinkScratch<S>>& scratch) {
  if constexpr (kPlacesFirst<S>) place_links(tree, in.q, scratch);
  const std::size_t count = tree.links.size();
  for (std::size_t n = 0; n < count; ++n) {
    const TreeLink<S>& link = tree.links[n];
    LinkScratch<S>& w = scratch[n];
    if (link.parent < 0) {
      w.V = root_velocity(link, in.v);
    } else {
      const LinkScratch<S>& parent = scratch[link.parent];
      visit_joint(link, [&](auto joint) {
        if constexpr (!std::is_same_v<decltype(joint), Root>) {
          if constexpr (!kPlacesFirst<S>) place(joint, link, in.q, w);
          move(joint, link, in.v, parent.V, w);
          w.bias = joint_bias(joint, link, in.v, w.V);
        }
      });
    }
    w.carries = false;
    w.p = cross_force(w.V, link.inertia * w.V);
    if (!in.link_wrench.empty()) w.p -= in.link_wrench[n];
  }
}

// Second sweep, tips to root: articulated inertias.
template <class S>
void inward_inertias(const Tree<S>& tree, const DynamicsInput<S>& in, std::vector<LinkScratch<S>>& scratch) {
  for (std::size_t n = tree.links.size(); n-- > 0;) {
    const TreeLink<S>& link = tree.links[n];
    LinkScratch<S>& w = scratch[n];
    if (!w.carries) set_rigid(w.I, link.inertia);
    if (link.parent < 0) continue;
    const TreeLink<S>& carrier = tree.links[link.parent];
    LinkScratch<S>& parent = scratch[link.parent];
    const bool rigid = is_prescribed(in, link.v);
    visit_joint(link, [&](auto joint) {
      using Joint = decltype(joint);
      if constexpr (std::is_same_v<Joint, Root>) {
      } else if (rigid) {
        send_rigid(joint, link, in.acceleration, w, carrier, parent);
      } else if constexpr (std::is_same_v<Joint, Spherical>) {
        send(joint, link, Vector3<S>{in.force[link.v], in.force[link.v + 1], in.force[link.v + 2]}, w, carrier, parent);
      } else {
        send(joint, link, in.force[link.v], w, carrier, parent);
      }
    });
  }
}

// Root: solves I A' = F - p for A' = A - gravity, or takes the prescribed acceleration and returns the wrench it needs.
template <class S>
void solve_root(const TreeLink<S>& link, const DynamicsInput<S>& in, LinkScratch<S>& w, std::span<S> vdot,
                std::span<S> force) {
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
    w.A = solve_articulated(w.I, F);
    for (int k = 0; k < 6; ++k) force[link.v + k] = in.force[link.v + k];
  }
  for (int k = 0; k < 3; ++k) vdot[link.v + k] = w.A.angular[k], vdot[link.v + 3 + k] = w.A.linear[k] + g[k];
}

// Third sweep, root to tips: accelerations.
template <class S>
void outward_accelerations(const Tree<S>& tree, const DynamicsInput<S>& in, std::vector<LinkScratch<S>>& scratch,
                           std::span<S> vdot, std::span<S> force) {
  const std::size_t count = tree.links.size();
  for (std::size_t n = 0; n < count; ++n) {
    const TreeLink<S>& link = tree.links[n];
    LinkScratch<S>& w = scratch[n];
    if (link.parent < 0) {
      solve_root(link, in, w, vdot, force);
      continue;
    }
    const bool rigid = is_prescribed(in, link.v);
    visit_joint(link, [&](auto joint) {
      using Joint = decltype(joint);
      if constexpr (!std::is_same_v<Joint, Root>) {
        w.A = motion_to_link(joint, link, w, scratch[link.parent].A) + w.bias;
        if constexpr (std::is_same_v<Joint, Spherical>) {
          if (rigid) {
            const Wrench<S> F = w.I * w.A + w.p;
            for (int k = 0; k < 3; ++k)
              vdot[link.v + k] = in.acceleration[link.v + k], force[link.v + k] = F.angular[k];
          } else {
            const Wrench<S> F = w.I * w.A + w.p;
            const Vector3<S> torque{in.force[link.v], in.force[link.v + 1], in.force[link.v + 2]};
            const Vector3<S> rate = SymmetricFactor3<S>(w.I.J).solve(torque - F.angular);
            w.A.angular += rate;
            for (int k = 0; k < 3; ++k) vdot[link.v + k] = rate[k], force[link.v + k] = torque[k];
          }
        } else if (rigid) {
          vdot[link.v] = in.acceleration[link.v];
          force[link.v] = link.sign * along(joint, w.I * w.A + w.p) + link.armature * vdot[link.v];
        } else {
          const S rate = w.g - dot(w.G.angular, w.A.angular) - dot(w.G.linear, w.A.linear);
          if constexpr (Joint::kTurns) {
            w.A.angular[Joint::kAxis] += rate;
          } else {
            w.A.linear[Joint::kAxis] += rate;
          }
          vdot[link.v] = link.sign * rate;
          force[link.v] = in.force[link.v];
        }
      }
    });
  }
}

}  // namespace articulated_body_steps

template <class S>
void articulated_inertias(const Tree<S>& tree, const DynamicsInput<S>& in, DynamicsWorkspace<S>& workspace) {
  articulated_body_steps::outward_velocities(tree, in, workspace.links);
  articulated_body_steps::inward_inertias(tree, in, workspace.links);
}

template <class S>
void articulated_accelerations(const Tree<S>& tree, const DynamicsInput<S>& in, DynamicsWorkspace<S>& workspace,
                               std::span<S> vdot, std::span<S> force) {
  articulated_body_steps::outward_accelerations(tree, in, workspace.links, vdot, force);
}

template <class S>
void articulated_body(const Tree<S>& tree, const DynamicsInput<S>& in, DynamicsWorkspace<S>& workspace,
                      std::span<S> vdot, std::span<S> force) {
  articulated_body_steps::outward_velocities(tree, in, workspace.links);
  articulated_body_steps::inward_inertias(tree, in, workspace.links);
  articulated_body_steps::outward_accelerations(tree, in, workspace.links, vdot, force);
}

}  // namespace grapnel
