#include "grapnel/dynamics/articulated_body.hpp"

#include "grapnel/dynamics/recursion.hpp"
#include "grapnel/dynamics/symmetric_solve.hpp"

namespace grapnel {
namespace {

using namespace recursion;

// The inertia and bias wrench that the joint passes to the parent, still in the link's frame:
//   I_a = I - U D^-1 U^T,   p_a = p + I_a c + U D^-1 u,
// (Featherstone 2008, eqs. 7.25, 7.26; in the DeNOC's terms one step of the U D U^T factorization).
template <class S>
struct Transmitted {
  ArticulatedInertia<S> I;
  Wrench<S> p;
};

// I - U U^T / D for any structure of U.
template <class S>
GRAPNEL_INLINE void subtract_outer(ArticulatedInertia<S>& I, const Wrench<S>& U, const S& D_inverse) {
  const Vector3<S> a = D_inverse * U.angular, l = D_inverse * U.linear;
  I.J.xx -= a[0] * U.angular[0], I.J.yy -= a[1] * U.angular[1], I.J.zz -= a[2] * U.angular[2];
  I.J.xy -= a[0] * U.angular[1], I.J.xz -= a[0] * U.angular[2], I.J.yz -= a[1] * U.angular[2];
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) I.H[r][c] -= a[r] * U.linear[c];
  }
  I.M.xx -= l[0] * U.linear[0], I.M.yy -= l[1] * U.linear[1], I.M.zz -= l[2] * U.linear[2];
  I.M.xy -= l[0] * U.linear[1], I.M.xz -= l[0] * U.linear[2], I.M.yz -= l[1] * U.linear[2];
}

// A revolute joint without rotor: the moment row of the axis vanishes exactly, and so do its multiplications.
template <int K, class S>
GRAPNEL_INLINE Transmitted<S> eliminate_revolute(const LinkScratch<S>& w) {
  constexpr int i = (K + 1) % 3, j = (K + 2) % 3;
  Transmitted<S> t{w.I, w.p};
  ArticulatedInertia<S>& I = t.I;
  const S ai = w.D_inverse * w.U.angular[i], aj = w.D_inverse * w.U.angular[j];
  const Vector3<S>& l = w.U.linear;
  I.J(i, i) -= ai * w.U.angular[i], I.J(i, j) -= ai * w.U.angular[j], I.J(j, j) -= aj * w.U.angular[j];
  I.J(K, K) = I.J(i, K) = I.J(j, K) = S(0);
  for (int c = 0; c < 3; ++c) {
    I.H[K][c] = S(0);
    I.H[i][c] -= ai * l[c];
    I.H[j][c] -= aj * l[c];
  }
  const Vector3<S> s = w.D_inverse * l;
  I.M.xx -= s[0] * l[0], I.M.yy -= s[1] * l[1], I.M.zz -= s[2] * l[2];
  I.M.xy -= s[0] * l[1], I.M.xz -= s[0] * l[2], I.M.yz -= s[1] * l[2];
  // I_a c, where c has no component along the axis.
  const Vector3<S>& ca = w.bias.angular;
  const Vector3<S>& cl = w.bias.linear;
  t.p.angular[i] += I.J(i, i) * ca[i] + I.J(i, j) * ca[j] + I.H[i][i] * cl[i] + I.H[i][j] * cl[j];
  t.p.angular[j] += I.J(i, j) * ca[i] + I.J(j, j) * ca[j] + I.H[j][i] * cl[i] + I.H[j][j] * cl[j];
  for (int c = 0; c < 3; ++c) {
    t.p.linear[c] += I.M(c, i) * cl[i] + I.M(c, j) * cl[j] + I.H[i][c] * ca[i] + I.H[j][c] * ca[j];
  }
  t.p += (w.u * w.D_inverse) * w.U;
  return t;
}

// Behind a link whose joint gives way: fills U, D^-1, u and sends inertia and bias wrench to the parent.
template <int K, class S>
GRAPNEL_INLINE void send(Revolute<K> joint, const TreeLink<S>& link, const S& force, LinkScratch<S>& w, LinkScratch<S>& parent) {
  const S H_row[3] = {w.I.H[K][0], w.I.H[K][1], w.I.H[K][2]};
  w.U = {{w.I.J(0, K), w.I.J(1, K), w.I.J(2, K)}, {H_row[0], H_row[1], H_row[2]}};
  w.D_inverse = S(1) / (w.I.J(K, K) + link.armature);
  w.u = link.sign * force - w.p.angular[K];
  Transmitted<S> t;
  if (link.armature == S(0)) {
    t = eliminate_revolute<K>(w);
    rotate_behind_joint<K>(w.angle, t.I);
  } else {
    t = {w.I, w.p};
    subtract_outer(t.I, w.U, w.D_inverse);
    t.p += t.I * w.bias;
    t.p += (w.u * w.D_inverse) * w.U;
    rotate_about<K>(w.angle, t.I);
  }
  if (link.rotated) rotate_general(t.I, link.X_PF.R);
  shift_origin(t.I, w.p_PL);
  parent.I += t.I;
  parent.p += force_to_parent(joint, link, w, t.p);
}

template <int K, class S>
GRAPNEL_INLINE void send(Prismatic<K> joint, const TreeLink<S>& link, const S& force, LinkScratch<S>& w, LinkScratch<S>& parent) {
  w.U = {{w.I.H[0][K], w.I.H[1][K], w.I.H[2][K]}, {w.I.M(0, K), w.I.M(1, K), w.I.M(2, K)}};
  w.D_inverse = S(1) / (w.I.M(K, K) + link.armature);
  w.u = link.sign * force - w.p.linear[K];
  Transmitted<S> t{w.I, w.p};
  subtract_outer(t.I, w.U, w.D_inverse);
  t.p += t.I * w.bias;
  t.p += (w.u * w.D_inverse) * w.U;
  if (link.rotated) rotate_general(t.I, link.X_PF.R);
  shift_origin(t.I, w.p_PL);
  parent.I += t.I;
  parent.p += force_to_parent(joint, link, w, t.p);
}

// A spherical joint takes all moment: with I = [J H; H^T M], I_a = [0 0; 0 M - H^T J^-1 H].
template <class S>
GRAPNEL_INLINE void send(Spherical joint, const TreeLink<S>& link, const Vector3<S>& torque, LinkScratch<S>& w,
                         LinkScratch<S>& parent) {
  const SymmetricFactor3<S> J(w.I.J);
  const Vector3<S> u = torque - w.p.angular;
  Transmitted<S> t;
  t.I.J = Symmetric3<S>::zero();
  for (auto& row : t.I.H) row[0] = row[1] = row[2] = S(0);
  Vector3<S> X[3];  // columns of J^-1 H
  for (int c = 0; c < 3; ++c) X[c] = J.solve({w.I.H[0][c], w.I.H[1][c], w.I.H[2][c]});
  const auto HtX = [&](int r, int c) {
    return w.I.H[0][r] * X[c][0] + w.I.H[1][r] * X[c][1] + w.I.H[2][r] * X[c][2];
  };
  const Symmetric3<S>& M = w.I.M;
  t.I.M = {M.xx - HtX(0, 0), M.yy - HtX(1, 1), M.zz - HtX(2, 2), M.xy - HtX(0, 1), M.xz - HtX(0, 2), M.yz - HtX(1, 2)};
  // p_a = p + I_a c + U D^-1 u; its moment is p.angular + u = torque.
  t.p.angular = torque;
  t.p.linear = w.p.linear + t.I.M * w.bias.linear;
  for (int c = 0; c < 3; ++c) t.p.linear[c] += dot(X[c], u);
  t.I.M = rotate(w.R_FL, t.I.M);
  if (link.rotated) rotate_general(t.I, link.X_PF.R);
  shift_origin(t.I, w.p_PL);
  parent.I += t.I;
  parent.p += force_to_parent(joint, link, w, t.p);
}

// Behind a joint whose acceleration is prescribed: nothing yields, and S times the acceleration joins the bias.
template <class Joint, class S>
GRAPNEL_INLINE void send_rigid(Joint joint, const TreeLink<S>& link, std::span<const S> acceleration, LinkScratch<S>& w,
                               LinkScratch<S>& parent) {
  add_joint_motion(joint, link, acceleration, w.bias);
  ArticulatedInertia<S> I = w.I;
  const Wrench<S> p = w.p + I * w.bias;
  if constexpr (std::is_same_v<Joint, Spherical>) {
    rotate_general(I, w.R_FL);
  } else if constexpr (Joint::kTurns) {
    rotate_about<Joint::kAxis>(w.angle, I);
  }
  if (link.rotated) rotate_general(I, link.X_PF.R);
  shift_origin(I, w.p_PL);
  parent.I += I;
  parent.p += force_to_parent(joint, link, w, p);
}

template <class S>
bool is_prescribed(const DynamicsInput<S>& in, int v) {
  return !in.prescribed.empty() && in.prescribed[v] != 0;
}

// First sweep, root to tips: velocities, bias accelerations, rigid inertias and bias wrenches V x* I V - F.
template <class S>
void outward_velocities(const Tree<S>& tree, const DynamicsInput<S>& in, std::vector<LinkScratch<S>>& scratch) {
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
          place(joint, link, in.q, w);
          w.V = motion_to_link(joint, link, w, parent.V);
          add_joint_motion(joint, link, in.v, w.V);
          w.bias = joint_bias(joint, link, in.v, w.V);
        }
      });
    }
    w.I = articulated(link.inertia);
    w.p = cross_force(w.V, link.inertia * w.V);
    if (!in.link_wrench.empty()) w.p -= in.link_wrench[n];
  }
}

// Second sweep, tips to root: articulated inertias.
template <class S>
void inward_inertias(const Tree<S>& tree, const DynamicsInput<S>& in, std::vector<LinkScratch<S>>& scratch) {
  for (std::size_t n = tree.links.size(); n-- > 0;) {
    const TreeLink<S>& link = tree.links[n];
    if (link.parent < 0) continue;
    LinkScratch<S>& w = scratch[n];
    LinkScratch<S>& parent = scratch[link.parent];
    const bool rigid = is_prescribed(in, link.v);
    visit_joint(link, [&](auto joint) {
      using Joint = decltype(joint);
      if constexpr (std::is_same_v<Joint, Root>) {
      } else if (rigid) {
        send_rigid(joint, link, in.acceleration, w, parent);
      } else if constexpr (std::is_same_v<Joint, Spherical>) {
        send(joint, link, Vector3<S>{in.force[link.v], in.force[link.v + 1], in.force[link.v + 2]}, w, parent);
      } else {
        send(joint, link, in.force[link.v], w, parent);
      }
    });
  }
}

// Root: solves I A' = F - p for A' = A - gravity, or takes the prescribed acceleration and returns the wrench it needs.
template <class S>
void solve_root(const TreeLink<S>& link, const DynamicsInput<S>& in, LinkScratch<S>& w, std::span<S> vdot,
                std::span<S> force) {
  const Vector3<S> g = gravity_in_root(link, in.q, in.gravity);
  if (link.joint == LinkJoint::root_fixed) {
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
            for (int k = 0; k < 3; ++k) vdot[link.v + k] = in.acceleration[link.v + k], force[link.v + k] = F.angular[k];
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
          const S rate = w.D_inverse * (w.u - dot(w.U.angular, w.A.angular) - dot(w.U.linear, w.A.linear));
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

}  // namespace

template <class S>
void articulated_body(const Tree<S>& tree, const DynamicsInput<S>& in, DynamicsWorkspace<S>& workspace, std::span<S> vdot,
                      std::span<S> force) {
  outward_velocities(tree, in, workspace.links);
  inward_inertias(tree, in, workspace.links);
  outward_accelerations(tree, in, workspace.links, vdot, force);
}

template void articulated_body<double>(const Tree<double>&, const DynamicsInput<double>&, DynamicsWorkspace<double>&,
                                       std::span<double>, std::span<double>);

}  // namespace grapnel
