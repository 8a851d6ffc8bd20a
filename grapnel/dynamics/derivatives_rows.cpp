// Rows and columns of the derivatives: (28.7) to (28.13).
#include <algorithm>

#include "grapnel/dynamics/derivatives_workspace.hpp"
#include "grapnel/dynamics/modal_chains.hpp"
#include "grapnel/model/tree.hpp"

namespace grapnel {

using namespace derivatives;

// psi_ddot of (28.3), and the factors of (28.7) and (28.8).
void DerivativesWorkspace::form_factors() {
  for (std::size_t n = 0; n < links_.size(); ++n) {
    if (tree_->links[n].parent < 0) continue;  // move_root()
    const Motion& A = links_[static_cast<std::size_t>(tree_->links[n].parent)].A;
    const Range mine = own(n);
    for (int i = mine.begin; i < mine.end; ++i) put(kParentA, i, A);
  }
  for (int b = 0; b < pack_count(); ++b) {
    double* const D = lane(0, b * kPack);
    const PackMotion S = load_motion(D, kS), psi = load_motion(D, kPsi), T = load_motion(D, kT);
    const PackMotion psi2 = cross(load_motion(D, kParentA), S) + cross(load_motion(D, kParentV), psi);
    store(D, kPsi2, psi2);
    const PackInertia I = load_inertia(D, kTree);
    const auto K = [&](int k) GRAPNEL_INLINE_LAMBDA { return Pack(pack_at(D + (kK + k) * kPack)); };
    const Pack3 &w = S.angular, &p = psi.angular;
    const Pack3 half = load(D, kL), l = half + half, f = cross(w, l);
    store(D, kQ,
          Pack3{K(0) * w[0] + K(3) * w[1] + K(6) * w[2], K(1) * w[0] + K(4) * w[1] + K(7) * w[2],
                K(2) * w[0] + K(5) * w[1] + K(8) * w[2]} +
              cross(l, S.linear));
    PackLoad by_q = times(I, psi2) + cross_load(S, load_load(D, kLoad)), by_v = times(I, T);
    by_q += PackLoad{{K(0) * p[0] + K(1) * p[1] + K(2) * p[2], K(3) * p[0] + K(4) * p[1] + K(5) * p[2],
                      K(6) * p[0] + K(7) * p[1] + K(8) * p[2]},
                     cross(p, l)};
    by_v += PackLoad{{K(0) * w[0] + K(1) * w[1] + K(2) * w[2], K(3) * w[0] + K(4) * w[1] + K(5) * w[2],
                      K(6) * w[0] + K(7) * w[1] + K(8) * w[2]},
                     f};
    store(D, kColumnQ, by_q), store(D, kColumnV, by_v);
  }
}

// One velocity with eight velocities j. Rows: Q . psi_dot_j + P . psi_ddot_j for q, Q . S_j + P . (psi_dot + S_dot)_j
// for v. Columns: the products of S_j with the two loads. Factors: from P on.
GRAPNEL_INLINE void DerivativesWorkspace::project(const Block& block, const double* factors, double* row) {
  const double* const D = lane(0, block.first);
  const auto d = [&](int k) GRAPNEL_INLINE_LAMBDA -> const LoosePack& { return pack_at(D + k * kPack); };
  const auto x = [&](int k) GRAPNEL_INLINE_LAMBDA { return factors[(k - kP) * kPack]; };
  const Pack s0 = d(kS), s1 = d(kS + 1), s2 = d(kS + 2), s3 = d(kS + 3), s4 = d(kS + 4), s5 = d(kS + 5);
  const Pack by_q = (x(kQ) * d(kPsi) + x(kQ + 1) * d(kPsi + 1) + x(kQ + 2) * d(kPsi + 2) + x(kP) * d(kPsi2)) +
                    (x(kP + 1) * d(kPsi2 + 1) + x(kP + 2) * d(kPsi2 + 2) + x(kP + 3) * d(kPsi2 + 3) +
                     x(kP + 4) * d(kPsi2 + 4) + x(kP + 5) * d(kPsi2 + 5));
  const Pack by_v = (x(kQ) * s0 + x(kQ + 1) * s1 + x(kQ + 2) * s2 + x(kP) * d(kT)) +
                    (x(kP + 1) * d(kT + 1) + x(kP + 2) * d(kT + 2) + x(kP + 3) * d(kT + 3) + x(kP + 4) * d(kT + 4) +
                     x(kP + 5) * d(kT + 5));
  const Mask& mask = *reinterpret_cast<const Mask*>(block.mask);
  double* const to = lines_.data() + block.first;
  pack_at(row + block.first) = reinterpret_cast<Pack>(reinterpret_cast<Mask>(by_q) & mask);
  pack_at(to) = reinterpret_cast<Pack>(reinterpret_cast<Mask>(by_v) & mask);
  const auto with = [&](int k) GRAPNEL_INLINE_LAMBDA {
    return Pack((x(k) * s0 + x(k + 1) * s1 + x(k + 2) * s2) + (x(k + 3) * s3 + x(k + 4) * s4 + x(k + 5) * s5));
  };
  pack_at(to + stride_) = with(kColumnQ);
  pack_at(to + 2 * stride_) = with(kColumnV);
}

// Row i and, above it, column i of both blocks. The end of the row of q exceeds it into that of v, which comes last.
GRAPNEL_INLINE void DerivativesWorkspace::fill(std::size_t n, int i) {
  double* const lines = lines_.data();
  double* const row = rows_.data() + i * row_;
  const double* const factors = lane(kP, i);
  int end = 0;
  for (const Block& block : blocks_[n]) {
    clear(row + end, row + block.first);
    clear(lines + end, lines + block.first);
    project(block, factors, row);
    end = block.first + kPack;
  }
  clear(row + end, row + n_);
  clear(lines + end, lines + n_);
  for (int j = 0; j < n_; j += kPack) pack_at(row + n_ + j) = Pack(pack_at(lines + j));
  const int first = tree_->links[n].v;
  for (const Range& range : ranges_[n]) {
    double* to = rows_.data() + range.begin * row_ + i;
    for (int j = range.begin; j < std::min(range.end, first); ++j, to += row_)
      to[0] = lines[stride_ + j], to[n_] = lines[2 * stride_ + j];
  }
}

// Derivatives of inverse dynamics, (28.7) and (28.8), in ascending order: a row overwrites what follows in it.
void DerivativesWorkspace::differentiate() {
  form_factors();
  for (std::size_t n = 0; n < links_.size(); ++n) {
    const TreeLink<double>& link = tree_->links[n];
    const LinkTerms& t = links_[n];
    const Range mine = own(n);
    for (int i = mine.begin; i < mine.end; ++i) {
      if (has_external_) {
        const Motion S = at(kS, i);
        increase(kColumnQ, i, t.E * S.angular), increase(kColumnQ + 3, i, cross(S.angular, t.external.linear));
      }
      double own_q = 0, own_v = 0;
      if (link.has_rotor) {  // (28.11)
        const Motion factor = at(kP, i);
        const Load P = {factor.angular, factor.linear};
        const double* const x = lane(kQ, i);
        const Vector3d Q = {x[0], x[kPack], x[2 * kPack]};
        own_q = dot(Q, at(kPsi, i).angular) + product(at(kPsi2, i), P);
        own_v = dot(Q, at(kS, i).angular) + product(at(kT, i), P);
        increase(kP, i, t.rotor), increase(kQ, i, t.gyration), increase(kColumnV, i, t.gyration);
      }
      fill(n, i);
      if (link.has_rotor) rows_.data()[i * row_ + i] = own_q, rows_.data()[i * row_ + n_ + i] = own_v;
      if (has_external_) add_external_row(n, i, at(kS, i));
    }
  }
}

// (28.9) in row i.
void DerivativesWorkspace::add_external_row(std::size_t n, int i, const Motion& S) {
  const LinkTerms& t = links_[n];
  const Vector3d Q = transposed_times(t.E, S.angular) + cross(t.external.linear, S.linear);
  for (const Range& range : ranges_[n]) {
    for (int j = range.begin; j < range.end; ++j) rows_.data()[i * row_ + j] += dot(Q, at(kS, j).angular);
  }
}

void DerivativesWorkspace::invert(std::span<const std::uint8_t> prescribed) {
  if (!tree_->chains.empty()) {
    Eigen::MatrixXd columns(2 * n_, n_);
    for (int i = 0; i < n_; ++i) {
      for (int j = 0; j < 2 * n_; ++j) columns(j, i) = rows_.data()[i * row_ + j];
    }
    project_columns(*tree_, columns);
    for (int i = 0; i < n_; ++i) {
      for (int j = 0; j < 2 * n_; ++j) rows_.data()[i * row_ + j] = columns(j, i);
    }
  }
  Eigen::MatrixXd unit;
  if (!tree_->chains.empty()) {
    unit.setIdentity(n_, n_);
    project_columns(*tree_, unit);
  }
  for (int i = 0; i < n_; ++i) {
    double* const row = rows_.data() + i * row_;
    clear(row + 2 * n_, row + 3 * n_);
    row[2 * n_ + i] = -1;
    for (int j = 0; unit.size() > 0 && j < n_; ++j) row[2 * n_ + j] = -unit(i, j);
    if (!prescribed.empty() && prescribed[i]) std::fill(row, row + row_, 0.0);
  }
  cholesky_.solve(rows_.data(), row_, 3 * n_);
}

void DerivativesWorkspace::read(int block, double factor, RowMatrix& to) const {
  to.resize(n_, n_);
  for (int i = 0; i < n_; ++i) {
    const double* const from = rows_.data() + i * row_ + block * n_;
    double* const row = to.data() + i * n_;
    // The end of a row exceeds it into the next one, if there is room.
    const int whole = (n_ - i) * n_ >= padded(n_) ? n_ : n_ / kPack * kPack;
    for (int j = 0; j < whole; j += kPack) pack_at(row + j) = factor * pack_at(from + j);
    for (int j = whole; j < n_; ++j) row[j] = factor * from[j];
  }
}

void DerivativesWorkspace::wrench_columns(const Model& model, const std::vector<ExternalWrench>& external,
                                          const RowMatrix& dtau, RowMatrix& dwrench) const {
  dwrench.setZero(dtau.rows(), static_cast<Eigen::Index>(6 * external.size()));
  for (std::size_t e = 0; e < external.size(); ++e) {
    const auto n =
        static_cast<std::size_t>(model.bodies().at(static_cast<std::size_t>(external[e].body)).placement.link);
    const Posed& X_WB = root_of(static_cast<int>(n));
    const Vector3d p = transposed_times(X_WB.R, external[e].p_WP - X_WB.p);
    for (const Range& range : ranges_[n]) {
      for (int j = range.begin; j < range.end; ++j) {
        const Motion J = X_WB.R * shift(at(kS, j), p);
        for (Eigen::Index i = 0; i < dtau.rows(); ++i) {
          for (int k = 0; k < 3; ++k) {
            dwrench(i, static_cast<Eigen::Index>(6 * e) + k) += dtau(i, j) * J.angular[k];
            dwrench(i, static_cast<Eigen::Index>(6 * e) + 3 + k) += dtau(i, j) * J.linear[k];
          }
        }
      }
    }
  }
}

// Columns of inverse dynamics, which is linear in the inertial parameters: (28.13).
void DerivativesWorkspace::inertial_columns(const Model& model, RowMatrix& dphi) const {
  dphi.setZero(n_, static_cast<Eigen::Index>(kRegressorColumns * model.bodies().size()));
  for (std::size_t b = 0; b < model.bodies().size(); ++b) {
    const BodyPlacement& placement = model.bodies()[b].placement;
    const auto n = static_cast<std::size_t>(placement.link);
    const LinkTerms& t = links_[n];
    const Posed X = Posed{t.R, t.p} * placement.X_LB;  // of the body in the root's frame
    const Motion V = transposed_times(X.R, shift(t.V, X.p)), A = transposed_times(X.R, shift(t.A, X.p));
    for (int k = 0; k < kRegressorColumns; ++k) {
      RigidBodyInertiad I = RigidBodyInertiad::zero();
      Symmetric3d& J = I.rotational;
      double* const rotational[] = {&J.xx, &J.yy, &J.zz, &J.xy, &J.xz, &J.yz};
      *(k == 0 ? &I.mass : k < 4 ? &I.first_moment[k - 1] : rotational[k - 4]) = 1;
      const Load f = shift(X.R * (times(I, A) + cross_load(V, times(I, V))), -X.p);
      for (const Range& range : ranges_[n]) {
        for (int j = range.begin; j < range.end; ++j)
          dphi(j, static_cast<Eigen::Index>(kRegressorColumns * b) + k) = product(at(kS, j), f);
      }
    }
  }
}

}  // namespace grapnel
