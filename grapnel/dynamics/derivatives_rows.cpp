// Rows and columns of the derivatives: (28.7) to (28.13).
#include <algorithm>

#include "grapnel/dynamics/derivatives_workspace.hpp"
#include "grapnel/dynamics/modal_chains.hpp"
#include "grapnel/model/tree.hpp"

namespace grapnel {

using namespace derivatives;

// psi_ddot of (28.3), in a sweep before the packs that contain it are read.
void DerivativesWorkspace::accelerate_directions() {
  for (std::size_t n = 0; n < links_.size(); ++n) {
    if (tree_->links[n].parent < 0) continue;  // move_root()
    const LinkTerms& parent = links_[static_cast<std::size_t>(tree_->links[n].parent)];
    const Range mine = own(n);
    for (int i = mine.begin; i < mine.end; ++i)
      put(kPsi2, i, cross(parent.A, at(kS, i)) + cross(parent.V, at(kPsi, i)));
  }
}

// One velocity with eight velocities j. Rows: Q . psi_dot_j + P . psi_ddot_j for q, Q . S_j + P . (psi_dot + S_dot)_j
// for v. Columns: the products of S_j with the two loads of x.
GRAPNEL_INLINE void DerivativesWorkspace::project(const Products& x, const Block& block, double* row) {
  const double* const D = directions_.data() + block.first * kRows;
  const auto d = [&](int k) GRAPNEL_INLINE_LAMBDA -> const LoosePack& { return pack_at(D + k * kPack); };
  const Vector3d &Q = x.Q, &a = x.P.angular, &l = x.P.linear;
  const Load &q = x.q, &v = x.v;
  const Pack s0 = d(kS), s1 = d(kS + 1), s2 = d(kS + 2), s3 = d(kS + 3), s4 = d(kS + 4), s5 = d(kS + 5);
  const Pack by_q =
      (Q[0] * d(kPsi) + Q[1] * d(kPsi + 1) + Q[2] * d(kPsi + 2) + a[0] * d(kPsi2)) +
      (a[1] * d(kPsi2 + 1) + a[2] * d(kPsi2 + 2) + l[0] * d(kPsi2 + 3) + l[1] * d(kPsi2 + 4) + l[2] * d(kPsi2 + 5));
  const Pack by_v = (Q[0] * s0 + Q[1] * s1 + Q[2] * s2 + a[0] * d(kT)) +
                    (a[1] * d(kT + 1) + a[2] * d(kT + 2) + l[0] * d(kT + 3) + l[1] * d(kT + 4) + l[2] * d(kT + 5));
  const Mask& mask = *reinterpret_cast<const Mask*>(block.mask);
  double* const to = lines_.data() + block.first;
  pack_at(row + block.first) = reinterpret_cast<Pack>(reinterpret_cast<Mask>(by_q) & mask);
  pack_at(to) = reinterpret_cast<Pack>(reinterpret_cast<Mask>(by_v) & mask);
  pack_at(to + stride_) = (q.angular[0] * s0 + q.angular[1] * s1 + q.angular[2] * s2) +
                          (q.linear[0] * s3 + q.linear[1] * s4 + q.linear[2] * s5);
  pack_at(to + 2 * stride_) = (v.angular[0] * s0 + v.angular[1] * s1 + v.angular[2] * s2) +
                              (v.linear[0] * s3 + v.linear[1] * s4 + v.linear[2] * s5);
}

// Row i and, above it, column i of both blocks. The end of the row of q exceeds it into that of v, which comes last.
GRAPNEL_INLINE void DerivativesWorkspace::fill(std::size_t n, int i, const Products& x) {
  double* const lines = lines_.data();
  double* const row = rows_.data() + i * row_;
  int end = 0;
  for (const Block& block : blocks_[n]) {
    clear(row + end, row + block.first);
    clear(lines + end, lines + block.first);
    project(x, block, row);
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
  accelerate_directions();
  for (std::size_t n = 0; n < links_.size(); ++n) {
    const TreeLink<double>& link = tree_->links[n];
    const LinkTerms& t = links_[n];
    const Range mine = own(n);
    for (int i = mine.begin; i < mine.end; ++i) {
      const Motion S = at(kS, i), psi = at(kPsi, i), psi2 = at(kPsi2, i), T = at(kT, i);
      Products x;
      x.P = P_[i];
      x.Q = transposed_times(t.K, S.angular) + 2.0 * cross(t.l, S.linear);
      Load q_load = times(t.I, psi2) + cross_load(S, t.f), v_load = times(t.I, T);
      q_load += Load{t.K * psi.angular, 2.0 * cross(psi.angular, t.l)};
      v_load += Load{t.K * S.angular, 2.0 * cross(S.angular, t.l)};
      if (has_external_) q_load += Load{t.E * S.angular, cross(S.angular, t.external.linear)};
      const double own_q = dot(x.Q, psi.angular) + product(psi2, x.P);
      const double own_v = dot(x.Q, S.angular) + product(T, x.P);
      if (link.has_rotor) {  // (28.11)
        x.P.angular += t.rotor, x.Q += t.gyration, v_load.angular += t.gyration;
      }
      x.q = q_load, x.v = v_load;
      fill(n, i, x);
      if (link.has_rotor) rows_.data()[i * row_ + i] = own_q, rows_.data()[i * row_ + n_ + i] = own_v;
      if (has_external_) add_external_row(n, i, S);
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
