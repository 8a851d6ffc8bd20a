#pragma once

/// @file
/// Derivatives of inverse and forward dynamics as a template on the scalar, for many states of one model in SIMD lanes:
/// the recursions of section 28 of docs/theory, in the frame of each tree's root. Modal joints are not supported.
///
/// dynamics_derivatives.hpp computes the same for one state, with velocities in packs instead of states.
/// Never allocates after construction. Thread safety: one thread at a time.

#include <cstdint>
#include <span>
#include <vector>

#include "grapnel/dynamics/articulated_body_kernel.hpp"
#include "grapnel/dynamics/derivatives_structure.hpp"
#include "grapnel/dynamics/motion_products.hpp"

namespace grapnel {
namespace derivatives {

/// A wrench on a link with constant components in W, at a point with constant coordinates in the link.
template <class S>
struct AppliedWrench {
  int link;
  Vector3<S> p_LP;
  Wrench<S> F_W;
};

/// The input of both functions. `motion.acceleration`: of all velocities for inverse dynamics. `motion.link_wrench` and
/// `motion.placed` are not read.
template <class S>
struct DerivativesInput {
  DynamicsInput<S> motion;
  std::span<const AppliedWrench<S>> external;
};

template <class S>
class DerivativesKernel {
  using Motion = Twist<S>;
  using Load = Wrench<S>;

 public:
  DerivativesKernel(const Tree<S>& tree, const DerivativesTables& tables);

  /// tau() and its derivatives.
  void inverse(const DerivativesInput<S>& in);
  /// vdot() as articulated_body() computes it, and its derivatives.
  void forward(const DerivativesInput<S>& in);

  const S* tau() const { return tau_.data(); }
  const S* vdot() const { return vdot_.data(); }
  const S& by_q(int i, int j) const { return rows_[i * stride_ + j]; }
  const S& by_v(int i, int j) const { return rows_[i * stride_ + n_ + j]; }
  /// Of tau by the accelerations, or of vdot by the forces.
  const S& by_other(int i, int j) const { return other_[i * n_ + j]; }
  /// d vdot / d F of an applied wrench, (28.12): six numbers of row i; of the last call, which was forward().
  void wrench_row(const AppliedWrench<S>& applied, int i, S* numbers) const;

 private:
  // A link seen from the root of its tree.
  struct Link {
    Rotation<S> R;
    Vector3<S> p;
    Motion V, A, V_parent, A_parent;  // gravity counted as an acceleration of the root
    Vector3<S> rotor, gyration;       // of (28.10), for its rate [1]
    // Of the link, then of its subtree: inertia, load, the terms of (28.6), external wrenches and those of (28.9).
    RigidBodyInertia<S> I;
    Load f;
    Rotation<S> K, E;
    Vector3<S> l;
    Load external;
    Rotation<S> R_WB;  // of a root on whose tree wrenches act
  };
  struct Direction {
    Motion S_j, psi, psi2, T;  // S, psi_dot, psi_ddot, psi_dot + S_dot
  };
  // Factors of the products of one velocity with others: P = I S and Q = (2 B)^T S of its row, external part of Q,
  // loads of its columns.
  struct Factors {
    Load P, column_q, column_v;
    Vector3<S> Q, E;
  };

  void locate(const DynamicsInput<S>& in);
  void apply(const DerivativesInput<S>& in);
  void accelerate(const DynamicsInput<S>& in, std::span<const S> vdot);
  void require_load(std::size_t n, std::span<const S> v, std::span<const S> vdot);
  void sum_subtrees();
  Factors factors_of(const Link& t, const Direction& d) const;
  void fill_rows(std::span<const S> vdot);
  void fill_row(std::size_t n, int i, std::span<const S> vdot);
  void differentiate(const DynamicsInput<S>& in, std::span<const S> vdot);
  void isolate(std::span<const std::uint8_t> prescribed);
  void factor();
  void solve_columns();
  void invert(std::span<const std::uint8_t> prescribed);

  S& mass(int i, int j) { return mass_[i * n_ + j]; }
  const S& mass(int i, int j) const { return mass_[i * n_ + j]; }
  int end_of(const TreeLink<S>& link) const { return link.v + velocity_count(link.joint); }

  const Tree<S>& tree_;
  const DerivativesTables lists_;
  int n_, stride_;  // a row of rows_: by q, by v, zeros
  bool has_external_ = false;
  DynamicsWorkspace<S> workspace_;
  std::vector<Link> links_;
  std::vector<Direction> directions_;
  std::vector<Load> link_wrench_;        // per link, in its frame
  std::vector<S> tau_, vdot_, applied_;  // applied_: forces, with the required ones
  std::vector<S> rows_;
  std::vector<S> mass_;     // rows of the lower triangle; then L of M = L^T D L below the diagonal
  std::vector<S> inverse_;  // of D
  std::vector<S> other_, column_;
};

template <class S>
DerivativesKernel<S>::DerivativesKernel(const Tree<S>& tree, const DerivativesTables& tables)
    : tree_(tree),
      lists_(tables),
      n_(tree.velocities),
      stride_((2 * n_ + kDerivativeColumns - 1) / kDerivativeColumns * kDerivativeColumns),
      workspace_(tree),
      links_(tree.links.size()),
      directions_(static_cast<std::size_t>(n_)),
      link_wrench_(tree.links.size()),
      tau_(static_cast<std::size_t>(n_), S(0)),
      vdot_(tau_),
      applied_(tau_),
      rows_(static_cast<std::size_t>(n_ * stride_), S(0)),
      mass_(static_cast<std::size_t>(n_ * n_), S(0)),
      inverse_(tau_),
      other_(mass_),
      column_(tau_) {}

// Poses in the frame of the root, twists, and all directions but psi_ddot: (28.3), (28.4).
template <class S>
void DerivativesKernel<S>::locate(const DynamicsInput<S>& in) {
  using namespace recursion;
  place_links(tree_, in.q, workspace_.links);
  for (std::size_t n = 0; n < links_.size(); ++n) {
    const TreeLink<S>& link = tree_.links[n];
    Link& t = links_[n];
    if (link.parent < 0) {
      t.R = Rotation<S>::identity(), t.p = Vector3<S>::zero();
      t.V = root_velocity(link, in.v);
      t.V_parent = Motion::zero();
      t.A_parent = {Vector3<S>::zero(), -gravity_in_root(link, in.q, in.gravity)};
      for (int k = 0; link.joint == JointType::free && k < 6; ++k) {
        Direction& d = directions_[link.v + k];
        d.S_j = Motion::zero();
        (k < 3 ? d.S_j.angular : d.S_j.linear)[k % 3] = S(1);
        d.psi = Motion::zero(), d.T = derivatives::cross(t.V, d.S_j);
      }
      continue;
    }
    const Link& parent = links_[link.parent];
    visit_joint(link, [&](auto joint) GRAPNEL_INLINE_LAMBDA {
      using Joint = decltype(joint);
      if constexpr (!kIsRoot<Joint>) {
        const LinkScratch<S>& w = workspace_.links[n];
        t.R = joint_rotation(joint, w, link.rotated ? parent.R * link.X_PF.R : parent.R);
        t.p = parent.p + parent.R * w.p_PL;
        t.V_parent = t.V = parent.V;
        for (int k = 0; k < Joint::kVelocities; ++k) {
          Direction& d = directions_[link.v + k];
          Vector3<S> axis;
          if constexpr (OneAxis<Joint>) {
            axis = S(link.sign) * t.R.column(Joint::kAxis);
            d.S_j = Joint::kTurns ? Motion{axis, grapnel::cross(t.p, axis)} : Motion{Vector3<S>::zero(), axis};
          } else {
            axis = t.R.column(k);
            d.S_j = {axis, grapnel::cross(t.p, axis)};
          }
          d.psi = derivatives::cross(parent.V, d.S_j);
          t.V += in.v[link.v + k] * d.S_j;
        }
        for (int k = 0; k < Joint::kVelocities; ++k) {
          Direction& d = directions_[link.v + k];
          d.T = d.psi + derivatives::cross(t.V, d.S_j);
        }
      }
    });
  }
}

// External wrenches on the links, and the part of their derivatives by which they differ from wrenches fixed in their
// body: (28.9).
template <class S>
void DerivativesKernel<S>::apply(const DerivativesInput<S>& in) {
  has_external_ = !in.external.empty();
  if (!has_external_) return;
  for (Link& t : links_) {
    t.external = Load::zero();
    for (auto& row : t.E.m) row[0] = row[1] = row[2] = S(0);
  }
  for (const AppliedWrench<S>& applied : in.external) {
    int root = applied.link;
    while (tree_.links[root].parent >= 0) root = tree_.links[root].parent;
    const TreeLink<S>& base = tree_.links[root];
    const S* q = in.motion.q.data() + base.q;
    Rotation<S>& R_WB = links_[root].R_WB;
    R_WB = base.joint == JointType::fixed ? base.X_PF.R : rotation_matrix(Quaternion<S>{q[3], q[4], q[5], q[6]});
    Link& t = links_[applied.link];
    const Load F = transposed_times(R_WB, applied.F_W);
    const Vector3<S> p = t.p + t.R * applied.p_LP;
    t.external += Load{F.angular + grapnel::cross(p, F.linear), F.linear};
    const S pf = dot(p, F.linear);
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) t.E.m[r][c] -= F.linear[r] * p[c];
      t.E.m[r][r] += pf;
    }
    const Vector3<S>& m = F.angular;
    t.E.m[0][1] += m[2], t.E.m[0][2] -= m[1], t.E.m[1][0] -= m[2];
    t.E.m[1][2] += m[0], t.E.m[2][0] += m[1], t.E.m[2][1] -= m[0];
  }
  for (std::size_t n = 0; n < links_.size(); ++n) {
    const Link& t = links_[n];
    link_wrench_[n] = transposed_times(t.R, shift(t.external, t.p));
  }
}

// Accelerations of the links, psi_ddot, and the loads of the links.
template <class S>
void DerivativesKernel<S>::accelerate(const DynamicsInput<S>& in, std::span<const S> vdot) {
  for (std::size_t n = 0; n < links_.size(); ++n) {
    const TreeLink<S>& link = tree_.links[n];
    Link& t = links_[n];
    if (link.parent >= 0) t.A_parent = links_[link.parent].A;
    t.A = t.A_parent;
    for (int i = link.v; i < end_of(link); ++i) {
      Direction& d = directions_[i];
      d.psi2 = derivatives::cross(t.A_parent, d.S_j) + derivatives::cross(t.V_parent, d.psi);
      t.A += vdot[i] * d.S_j;
      if (link.parent >= 0) t.A += in.v[i] * d.psi;
    }
    require_load(n, in.v, vdot);
  }
}

// The load (28.2) of a link, its inertia in the frame of the root, and its share of (28.6).
template <class S>
void DerivativesKernel<S>::require_load(std::size_t n, std::span<const S> v, std::span<const S> vdot) {
  const TreeLink<S>& link = tree_.links[n];
  Link& t = links_[n];
  t.I = shift_origin(
      RigidBodyInertia<S>{link.inertia.mass, t.R * link.inertia.first_moment, rotate(t.R, link.inertia.rotational)},
      t.p);
  const Load momentum = times(t.I, t.V);
  t.f = times(t.I, t.A) + cross_load(t.V, momentum);
  if (has_external_) t.f -= t.external;
  t.l = momentum.linear + momentum.linear;
  // K = 2 ([w x] (J - tr(J)/2) - u h^T + (h . u) 1), by columns.
  const Symmetric3<S>& J = t.I.rotational;
  const Vector3<S>&w = t.V.angular, &u = t.V.linear;
  const Vector3<S> h = t.I.first_moment + t.I.first_moment;
  const S trace = J.xx + J.yy + J.zz, hu = dot(h, u);
  const Vector3<S> columns[3] = {grapnel::cross(w, Vector3<S>{J.xx + J.xx - trace, J.xy + J.xy, J.xz + J.xz}),
                                 grapnel::cross(w, Vector3<S>{J.xy + J.xy, J.yy + J.yy - trace, J.yz + J.yz}),
                                 grapnel::cross(w, Vector3<S>{J.xz + J.xz, J.yz + J.yz, J.zz + J.zz - trace})};
  GRAPNEL_UNROLL
  for (int r = 0; r < 3; ++r) {
    GRAPNEL_UNROLL
    for (int c = 0; c < 3; ++c) t.K.m[r][c] = columns[c][r] - u[r] * h[c];
    t.K.m[r][r] += hu;
  }
  if (!link.has_rotor) return;
  // A rotor adds its spin to the momentum of the parent: (28.10).
  Link& parent = links_[link.parent];
  t.rotor = S(link.sign) * (parent.R * link.rotor);
  t.gyration = grapnel::cross(parent.V.angular, t.rotor);
  parent.f.angular += v[link.v] * t.gyration + vdot[link.v] * t.rotor;
  const Vector3<S> a = v[link.v] * t.rotor;  // K - [a x]
  auto& K = parent.K.m;
  K[0][1] += a[2], K[0][2] -= a[1], K[1][0] -= a[2], K[1][2] += a[0], K[2][0] += a[1], K[2][1] -= a[0];
}

template <class S>
void DerivativesKernel<S>::sum_subtrees() {
  for (std::size_t n = links_.size(); n-- > 0;) {
    if (tree_.links[n].parent < 0) continue;
    const Link& t = links_[n];
    Link& parent = links_[tree_.links[n].parent];
    parent.I += t.I, parent.f += t.f, parent.l += t.l;
    const auto add = [](Rotation<S>& A, const Rotation<S>& B) GRAPNEL_INLINE_LAMBDA {
      GRAPNEL_UNROLL
      for (int r = 0; r < 3; ++r) {
        GRAPNEL_UNROLL
        for (int c = 0; c < 3; ++c) A.m[r][c] += B.m[r][c];
      }
    };
    add(parent.K, t.K);
    if (!has_external_) continue;
    parent.external += t.external;
    add(parent.E, t.E);
  }
}

// The factors of (28.7) and (28.8), of (28.9) with external wrenches.
template <class S>
GRAPNEL_INLINE typename DerivativesKernel<S>::Factors DerivativesKernel<S>::factors_of(const Link& t,
                                                                                       const Direction& d) const {
  const Vector3<S>& w = d.S_j.angular;
  Factors x;
  x.P = times(t.I, d.S_j);
  x.Q = transposed_times(t.K, w) + grapnel::cross(t.l, d.S_j.linear);
  x.column_q =
      times(t.I, d.psi2) + cross_load(d.S_j, t.f) + Load{t.K * d.psi.angular, grapnel::cross(d.psi.angular, t.l)};
  x.column_v = times(t.I, d.T) + Load{t.K * w, grapnel::cross(w, t.l)};
  if (has_external_) {
    x.E = transposed_times(t.E, w) + grapnel::cross(t.external.linear, d.S_j.linear);
    x.column_q += Load{t.E * w, grapnel::cross(w, t.external.linear)};
  }
  return x;
}

// Row i and, in the rows of its ancestors, column i.
template <class S>
void DerivativesKernel<S>::fill_row(std::size_t n, int i, std::span<const S> vdot) {
  const TreeLink<S>& link = tree_.links[n];
  const Link& t = links_[n];
  const Direction& own = directions_[i];
  Factors x = factors_of(t, own);
  S* const row = rows_.data() + i * stride_;
  const auto fill = [&](int j) GRAPNEL_INLINE_LAMBDA {
    const Direction& d = directions_[j];
    row[j] = dot(x.Q, d.psi.angular) + product(d.psi2, x.P);
    if (has_external_) row[j] += dot(x.E, d.S_j.angular);
    row[n_ + j] = dot(x.Q, d.S_j.angular) + product(d.T, x.P);
  };
  const bool one_axis = end_of(link) == link.v + 1;  // others have no rotor
  tau_[i] = product(own.S_j, t.f);
  if (one_axis) tau_[i] += link.armature * vdot[i];
  if (link.has_rotor) tau_[i] += dot(t.rotor, t.A_parent.angular);
  for (int j = link.v; j < end_of(link); ++j) fill(j);
  for (int j = link.v; j <= i; ++j) mass(i, j) = product(directions_[j].S_j, x.P);
  if (one_axis) mass(i, i) += link.armature;
  if (link.has_rotor) x.P.angular += t.rotor, x.Q += t.gyration, x.column_v.angular += t.gyration;  // (28.11)
  for (int e = lists_.before_begin[link.v]; e < lists_.before_begin[link.v + 1]; ++e) {
    const int j = lists_.before[e];
    const Motion& S_j = directions_[j].S_j;
    fill(j);
    mass(i, j) = product(S_j, x.P);
    rows_[j * stride_ + i] = product(S_j, x.column_q);
    rows_[j * stride_ + n_ + i] = product(S_j, x.column_v);
  }
}

// Derivatives of inverse dynamics at the accelerations vdot, (28.7) and (28.8), tau and the mass matrix. Entries of
// velocities on different branches remain zero, or are those that solve_columns() has left there.
template <class S>
void DerivativesKernel<S>::differentiate(const DynamicsInput<S>& in, std::span<const S> vdot) {
  accelerate(in, vdot);
  sum_subtrees();
  for (S& x : rows_) x = S(0);
  for (std::size_t n = 0; n < links_.size(); ++n) {
    for (int i = tree_.links[n].v; i < end_of(tree_.links[n]); ++i) fill_row(n, i, vdot);
  }
}

template <class S>
void DerivativesKernel<S>::inverse(const DerivativesInput<S>& in) {
  locate(in.motion);
  apply(in);
  differentiate(in.motion, in.motion.acceleration);
  for (S& x : other_) x = S(0);
  for (int i = 0; i < n_; ++i) {
    other_[i * n_ + i] = mass(i, i);
    for (int e = lists_.before_begin[i]; e < lists_.before_begin[i + 1]; ++e) {
      const int j = lists_.before[e];
      other_[i * n_ + j] = other_[j * n_ + i] = mass(i, j);
    }
  }
}

// vdot of (2.7) and its derivatives (28.12).
template <class S>
void DerivativesKernel<S>::forward(const DerivativesInput<S>& in) {
  locate(in.motion);
  apply(in);
  DynamicsInput<S> motion = in.motion;
  motion.placed = true;
  motion.link_wrench = {};
  if (has_external_) motion.link_wrench = {link_wrench_.data(), link_wrench_.size()};
  articulated_body<S>(tree_, motion, workspace_, vdot_, applied_);
  differentiate(in.motion, vdot_);
  isolate(in.motion.prescribed);
  factor();
  solve_columns();
  invert(in.motion.prescribed);
}

// Separates velocities with given accelerations from the others; their rows are zero.
template <class S>
void DerivativesKernel<S>::isolate(std::span<const std::uint8_t> prescribed) {
  if (prescribed.empty()) return;
  for (int i = 0; i < n_; ++i) {
    for (int e = lists_.before_begin[i]; e < lists_.before_begin[i + 1]; ++e) {
      const int j = lists_.before[e];
      if (prescribed[i] || prescribed[j]) mass(i, j) = S(0);
    }
    if (!prescribed[i]) continue;
    mass(i, i) = S(1);
    for (int j = 0; j < stride_; ++j) rows_[i * stride_ + j] = S(0);
  }
}

// In place: M = L^T D L with the zeros of M ([Featherstone 2008], section 6.5).
template <class S>
void DerivativesKernel<S>::factor() {
  for (int k = n_; k-- > 0;) {
    const S inverse = S(1) / mass(k, k);
    inverse_[k] = inverse;
    const int *const begin = lists_.before + lists_.before_begin[k], *const end =
                                                                         lists_.before + lists_.before_begin[k + 1];
    for (const int* a = begin; a != end; ++a) {
      const S share = inverse * mass(k, *a);
      for (const int* b = begin; b <= a; ++b) mass(*a, *b) -= share * mass(k, *b);
    }
    for (const int* a = begin; a != end; ++a) mass(k, *a) = inverse * mass(k, *a);
  }
}

// rows_ <- -M^-1 rows_, several columns at a time: L^T Y = X, D Z = -Y, L X = Z. In the first step, rows that no column
// of the group reaches remain zero.
template <class S>
void DerivativesKernel<S>::solve_columns() {
  constexpr int kCount = kDerivativeColumns;
  for (int first = 0; first < stride_; first += kCount) {
    S* const X = rows_.data() + first;
    S sum[kCount];
    const int g = first / kCount;
    for (int e = lists_.group_begin[g]; e < lists_.group_begin[g + 1]; ++e) {
      const int i = lists_.group[e];
      S* const row = X + i * stride_;
      for (int k = 0; k < kCount; ++k) sum[k] = row[k];
      for (int b = lists_.beyond_begin[i]; b < lists_.beyond_begin[i + 1]; ++b) {
        const int j = lists_.beyond[b];
        const S& L = mass(j, i);
        for (int k = 0; k < kCount; ++k) sum[k] = sum[k] - L * X[j * stride_ + k];
      }
      for (int k = 0; k < kCount; ++k) row[k] = sum[k];
    }
    for (int i = 0; i < n_; ++i) {
      S* const row = X + i * stride_;
      const S factor = -inverse_[i];
      for (int k = 0; k < kCount; ++k) sum[k] = factor * row[k];
      for (int e = lists_.before_begin[i]; e < lists_.before_begin[i + 1]; ++e) {
        const int j = lists_.before[e];
        const S& L = mass(i, j);
        for (int k = 0; k < kCount; ++k) sum[k] = sum[k] - L * X[j * stride_ + k];
      }
      for (int k = 0; k < kCount; ++k) row[k] = sum[k];
    }
  }
}

// other_ <- M^-1. Only the velocities before c are not zero in column c of L^-T, and the result is symmetric.
template <class S>
void DerivativesKernel<S>::invert(std::span<const std::uint8_t> prescribed) {
  for (int c = 0; c < n_; ++c) {
    const bool none = !prescribed.empty() && prescribed[c];
    for (int i = 0; i <= c; ++i) column_[i] = S(0);
    const int *const begin = lists_.before + lists_.before_begin[c], *const end =
                                                                         lists_.before + lists_.before_begin[c + 1];
    column_[c] = S(none ? 0 : 1);
    for (const int* a = end; a-- != begin;) {
      S sum = mass(c, *a) * column_[c];
      for (const int* b = a + 1; b != end; ++b) sum = sum + mass(*b, *a) * column_[*b];
      column_[*a] = -sum;
    }
    for (int i = 0; i <= c; ++i) {
      S sum = inverse_[i] * column_[i];
      for (int e = lists_.before_begin[i]; e < lists_.before_begin[i + 1]; ++e)
        sum = sum - mass(i, lists_.before[e]) * column_[lists_.before[e]];
      column_[i] = sum;
      other_[i * n_ + c] = other_[c * n_ + i] = sum;
    }
  }
}

template <class S>
void DerivativesKernel<S>::wrench_row(const AppliedWrench<S>& applied, int i, S* numbers) const {
  int link = applied.link;
  const Vector3<S> p = links_[link].p + links_[link].R * applied.p_LP;
  Motion sum = Motion::zero();  // J (M^-1)_i in the axes of the root
  while (true) {
    const TreeLink<S>& carrier = tree_.links[link];
    for (int j = carrier.v; j < end_of(carrier); ++j) sum += by_other(i, j) * shift(directions_[j].S_j, p);
    if (carrier.parent < 0) break;
    link = carrier.parent;
  }
  sum = links_[link].R_WB * sum;
  for (int k = 0; k < 3; ++k) numbers[k] = sum.angular[k], numbers[3 + k] = sum.linear[k];
}

}  // namespace derivatives
}  // namespace grapnel
