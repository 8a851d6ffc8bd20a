#pragma once

/// @file
/// The equations of path_segment.hpp at its nodes in SIMD packs, one node per lane. Each panel is completed before the
/// next one, so that its data stays in the first-level cache.

#include "grapnel/plan/link_placement.hpp"
#include "grapnel/plan/segment_nodes.hpp"
#include "grapnel/spatial/rounded.hpp"

namespace grapnel {

template <class S>
class PackedNodes : public SegmentNodes {
 public:
  explicit PackedNodes(const NodeTables& tables)
      : tables_(tables),
        links_(tables.link_count),
        q_(tables.coordinates),
        V_(tables.link_count),
        h_(tables.link_count),
        dh_(tables.joints) {
    lanes = kLanes;
    for (int i = 0; i < tables.link_count; ++i) links_[i] = convert_link<S>(tables.links[i]);
  }
  ~PackedNodes() override { delete[] numbers_; }

  void reserve(int nodes) override {
    if (nodes <= reserved_) return;
    delete[] numbers_;
    numbers_ = nullptr, numbers = nullptr, reserved_ = 0;  // valid if the allocation throws
    numbers_ = new S[static_cast<unsigned long>(nodes / kLanes) * static_cast<unsigned long>(tables_.layout.size)];
    reserved_ = nodes;
    numbers = reinterpret_cast<const double*>(numbers_);
  }

  void place(NodePanel& panel) override {
    for (int c = 0; c < kChunks; ++c) {
      S* const at = chunk(panel, c);
      move_joints(panel, panel.first + c * kLanes, at);
      const PlacedNumbers<S> placed = placed_at(at);
      place_poses<S>(tree(), {q_.data(), static_cast<std::size_t>(q_.size())}, placed);
      place_inertias(tree(), panel.floats, panel.turns, placed);
      const NodeLayout& l = tables_.layout;
      if (panel.floats) vector(at, l.u) = momentum_of_rates(tables_.joints, placed.k, at + l.rate);
    }
  }

  bool turn(NodePanel& panel) override;
  void sensitivities(NodePanel& panel) override;

 private:
  static constexpr int kLanes = S::kWidth, kChunks = kPanelNodes / kLanes;
  static_assert(kChunks * kLanes == kPanelNodes && kSumParts % kLanes == 0 && kPanelNodes % kSumParts == 0);
  static constexpr int kMaxIterations = 40;  // iterations

  ServicerTree<S> tree() const {
    return {links_.data(), tables_.link_count, tables_.joint_link, tables_.link_joint, tables_.joints};
  }
  S* chunk(const NodePanel& panel, int c) {
    return numbers_ + (panel.storage_index / kLanes + c) * tables_.layout.size;
  }
  static GRAPNEL_INLINE Vector3<S>& vector(S* at, int offset) { return *reinterpret_cast<Vector3<S>*>(at + offset); }
  static GRAPNEL_INLINE Rotation<S>& rotation(S* at, int offset) {
    return *reinterpret_cast<Rotation<S>*>(at + offset);
  }
  GRAPNEL_INLINE Symmetric3<S>& H_inverse(S* at) const {
    return *reinterpret_cast<Symmetric3<S>*>(at + tables_.layout.H_inverse);
  }
  PlacedNumbers<S> placed_at(S* at) const {
    const NodeLayout& l = tables_.layout;
    return {reinterpret_cast<Pose<S>*>(at + l.X_BL),
            reinterpret_cast<Twist<S>*>(at + l.axis),
            reinterpret_cast<RigidBodyInertia<S>*>(at + l.composite),
            reinterpret_cast<RigidBodyInertia<S>*>(at + l.inertia),
            reinterpret_cast<Momentum<S>*>(at + l.joint_momentum),
            reinterpret_cast<Vector3<S>*>(at + l.k),
            reinterpret_cast<Vector3<S>*>(at + l.com),
            at + l.mass,
            reinterpret_cast<Symmetric3<S>*>(at + l.H_inverse)};
  }
  static GRAPNEL_INLINE Vector3<S> broadcast(const Vector3d& x) { return {S(x[0]), S(x[1]), S(x[2])}; }
  static GRAPNEL_INLINE Quaternion<S> normalized(const S (&q)[4]) {
    const S scale = S(1.0) / sqrt(S(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]));
    return {scale * q[0], scale * q[1], scale * q[2], scale * q[3]};
  }
  // Inverse of a general matrix by its minors, from columns x, y, z: rows of the result.
  static GRAPNEL_INLINE void invert(const Vector3<S>& x, const Vector3<S>& y, const Vector3<S>& z,
                                    Vector3<S> (&rows)[3]) {
    const Vector3<S> yz = cross(y, z), zx = cross(z, x), xy = cross(x, y);
    const S scale = S(1.0) / dot(x, yz);
    rows[0] = scale * yz, rows[1] = scale * zx, rows[2] = scale * xy;
  }

  // Values and rates of the joints.
  void move_joints(const NodePanel& panel, int node, S* at) {
    const double* const basis = panel.basis + node;
    const auto row = [&](int i) GRAPNEL_INLINE_LAMBDA { return S::load(basis + i * panel.nodes); };
    const int n = tables_.joints;
    S* const rate = at + tables_.layout.rate;
    for (int j = 0; j < n; ++j) {
      const double from = panel.start[j];
      const S travel(panel.final[j] - from), last(panel.final_rate[j]), first(panel.start_rate[j]);
      S theta = S(from) + travel * row(0) + last * row(2) + first * row(4);
      S r = travel * row(1) + last * row(3) + first * row(5);
      for (int i = j, k = 3; i < panel.coefficient_count; i += n, ++k) {
        const S c(panel.coefficients[i]);
        theta += c * row(2 * k), r += c * row(2 * k + 1);
      }
      q_[links_[tables_.joint_link[j]].q] = theta;
      rate[j] = r;
    }
  }

  // begin + h sum_j a_ij rate_j for a pack of nodes i, with `rate` already multiplied by h; `size` numbers, of `N`
  // rows.
  template <int N>
  GRAPNEL_INLINE void integrate(const double (&rate)[N][kPanelNodes], const double* begin, int c, double scale,
                                S (&next)[N]) const {
    for (int k = 0; k < N; ++k) next[k] = S(begin[k]);
    for (int j = 0; j < kPanelNodes; ++j) {
      const S a = S(scale) * S::load(tables_.a + j * kPanelNodes + c * kLanes);
      for (int k = 0; k < N; ++k) next[k] += a * S(rate[k][j]);
    }
  }
  static GRAPNEL_INLINE double largest(const S& x) {
    double lanes[kLanes], result = 0;
    x.store(lanes);
    for (int l = 0; l < kLanes; ++l) result = lanes[l] > result ? lanes[l] : result;
    return result;
  }

  void propagate_phi(NodePanel& panel);
  void add(NodePanel& panel, int c, S* at);

  const NodeTables tables_;
  lanes::LaneArray<S, TreeLink<S>> links_;
  lanes::LaneArray<S> q_;
  lanes::LaneArray<S, Twist<S>> V_;
  lanes::LaneArray<S, Momentum<S>> h_, dh_;
  S* numbers_ = nullptr;
  int reserved_ = 0;
};

// (1)
template <class S>
bool PackedNodes<S>::turn(NodePanel& panel) {
  constexpr double kSettled = 4e-16;
  const NodeLayout& l = tables_.layout;
  const Vector3<S> L = broadcast(panel.L);
  const S h(panel.h);
  S q[kChunks][4];
  for (int c = 0; c < kChunks; ++c) {
    S* const at = chunk(panel, c);
    for (int k = 0; k < 4; ++k) q[c][k] = S(panel.q[k]);
    vector(at, l.w_B) = H_inverse(at) * -vector(at, l.u);
  }
  double change = 1, before = 2;
  for (int iteration = 0;; ++iteration) {
    for (int c = 0; c < kChunks; ++c) {
      S* const at = chunk(panel, c);
      Vector3<S>& w = vector(at, l.w_B);
      if (panel.driven) {
        const Rotation<S> R = rotation_matrix(normalized(q[c]));
        w = H_inverse(at) * (transposed_times(R, L) - vector(at, l.u));
      }
      const Quaternion<S> r = quaternion_rate(Quaternion<S>{q[c][0], q[c][1], q[c][2], q[c][3]}, w);
      S(h * r.w).store(panel.q_rate[0] + c * kLanes), S(h * r.x).store(panel.q_rate[1] + c * kLanes);
      S(h * r.y).store(panel.q_rate[2] + c * kLanes), S(h * r.z).store(panel.q_rate[3] + c * kLanes);
    }
    // Converged: changes are rounding errors.
    if (change <= kSettled || (change <= 1e-14 && change >= before)) break;
    if (iteration == kMaxIterations) return false;
    before = change;
    S worst(0.0);
    bool finite = true;
    for (int c = 0; c < kChunks; ++c) {
      S next[4];
      integrate(panel.q_rate, panel.q, c, 1.0, next);
      for (int k = 0; k < 4; ++k) {
        const S moved = abs(next[k] - q[c][k]);
        finite = finite && all(moved <= S(1e300));
        worst = max(worst, moved);
        q[c][k] = next[k];
      }
    }
    if (!finite) return false;
    change = largest(worst);
  }
  for (int c = 0; c < kChunks; ++c) {
    S* const at = chunk(panel, c);
    rotation(at, l.R) = rotation_matrix(normalized(q[c]));
    for (int k = 0; k < 3; ++k) vector(at, l.w_B)[k].store(panel.w_B[k] + c * kLanes);
  }
  return true;
}

// Phi of (3) at the nodes by the same collocation: N x = (R H^-1 R^T) (L x x).
template <class S>
void PackedNodes<S>::propagate_phi(NodePanel& panel) {
  const NodeLayout& l = tables_.layout;
  const Vector3<S> L = broadcast(panel.L);
  Symmetric3<S> A[kChunks];
  for (int c = 0; c < kChunks; ++c) {
    S* const at = chunk(panel, c);
    A[c] = rotate(rotation(at, l.R), H_inverse(at));
    for (int k = 0; k < 9; ++k) at[l.Phi + k] = S(panel.Phi[k]);
  }
  double size = 0;
  for (const double x : panel.Phi) size = __builtin_fabs(x) > size ? __builtin_fabs(x) : size;
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    for (int c = 0; c < kChunks; ++c) {
      S* const at = chunk(panel, c);
      for (int column = 0; column < 3; ++column) {
        const Vector3<S> r = A[c] * cross(L, vector(at, l.Phi + 3 * column));
        for (int k = 0; k < 3; ++k) r[k].store(panel.Phi_rate[3 * column + k] + c * kLanes);
      }
    }
    S worst(0.0);
    for (int c = 0; c < kChunks; ++c) {
      S* const at = chunk(panel, c);
      S next[9];
      integrate(panel.Phi_rate, panel.Phi, c, panel.h, next);
      for (int k = 0; k < 9; ++k) {
        worst = max(worst, abs(next[k] - at[l.Phi + k]));
        at[l.Phi + k] = next[k];
      }
    }
    if (largest(worst) <= 1e-15 * size) break;
  }
}

// Contribution of the nodes of a pack to the integral of (3).
template <class S>
void PackedNodes<S>::add(NodePanel& panel, int c, S* at) {
  const NodeLayout& l = tables_.layout;
  Vector3<S>* const g = reinterpret_cast<Vector3<S>*>(at + l.g);
  const Vector3<S>* const k = reinterpret_cast<const Vector3<S>*>(at + l.k);
  angular_momentum_per_angle(tree(), placed_at(at), static_cast<const S*>(at + l.rate), vector(at, l.w_B),
                             {V_.data(), h_.data(), dh_.data()}, g);
  // Rows of -Phi^-1 R H^-1: R's rows times the symmetric H^-1.
  const Rotation<S>& R = rotation(at, l.R);
  Vector3<S> M[3];
  for (int i = 0; i < 3; ++i) M[i] = -(H_inverse(at) * Vector3<S>{R.m[i][0], R.m[i][1], R.m[i][2]});
  if (panel.driven) {
    Vector3<S> inverse[3];
    invert(vector(at, l.Phi), vector(at, l.Phi + 3), vector(at, l.Phi + 6), inverse);
    const Vector3<S> x = M[0], y = M[1], z = M[2];
    for (int i = 0; i < 3; ++i) M[i] = inverse[i][0] * x + inverse[i][1] * y + inverse[i][2] * z;
  }
  const int n = tables_.joints, node = panel.first + c * kLanes, part = c * kLanes % kSumParts;
  const S weight = S::load(panel.weight + node);
  for (int j = 0; j < n; ++j) {
    Vector3<S>&of_g = vector(at, l.g_turned + 3 * j), &of_k = vector(at, l.k_turned + 3 * j);
    of_g = {dot(M[0], g[j]), dot(M[1], g[j]), dot(M[2], g[j])};
    of_k = {dot(M[0], k[j]), dot(M[1], k[j]), dot(M[2], k[j])};
  }
  // Final values with a, final rates with b, coefficients with N; c belongs to the initial rates.
  for (int b = 0; b < 2 + tables_.knots; ++b) {
    const double* const basis = panel.basis + 2 * (b < 2 ? b : b + 1) * panel.nodes + node;
    const S position = weight * S::load(basis), rate = weight * S::load(basis + panel.nodes);
    double* sum = panel.sums + 3 * b * n * kSumParts + part;
    for (int j = 0; j < n; ++j) {
      const Vector3<S>&of_g = vector(at, l.g_turned + 3 * j), &of_k = vector(at, l.k_turned + 3 * j);
      for (int i = 0; i < 3; ++i, sum += kSumParts) {
        S(S::load(sum) + position * of_g[i] + rate * of_k[i]).store(sum);
      }
    }
  }
}

template <class S>
void PackedNodes<S>::sensitivities(NodePanel& panel) {
  const int Phi = tables_.layout.Phi;
  if (panel.driven) {
    propagate_phi(panel);
  } else {
    for (int c = 0; c < kChunks; ++c) {
      for (int k = 0; k < 9; ++k) chunk(panel, c)[Phi + k] = S(panel.Phi[k]);
    }
  }
  for (int c = 0; c < kChunks; ++c) add(panel, c, chunk(panel, c));
}

}  // namespace grapnel
