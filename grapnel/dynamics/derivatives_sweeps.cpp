// Sweeps over the links, the mass matrix and the accelerations: (28.2) to (28.6).
#include <algorithm>
#include <stdexcept>

#include "grapnel/dynamics/derivatives_workspace.hpp"
#include "grapnel/dynamics/modal_chains.hpp"
#include "grapnel/model/tree.hpp"

namespace grapnel {

using namespace recursion;
using namespace derivatives;

namespace {

// Velocities between the root of each velocity and itself, from the root outwards.
std::vector<std::vector<int>> ancestors_of(const Tree<double>& tree) {
  std::vector<std::vector<int>> on(static_cast<std::size_t>(tree.velocities));
  const bool dense = !tree.chains.empty();  // as projected mass matrices are
  std::vector<int> last;                    // velocity of each link or of its nearest ancestor with one
  for (const TreeLink<double>& link : tree.links) {
    int before = link.parent < 0 ? -1 : last[static_cast<std::size_t>(link.parent)];
    const int count = velocity_count(link.joint);
    for (int v = link.v; v < link.v + count; ++v) {
      std::vector<int>& list = on[static_cast<std::size_t>(v)];
      if (dense) before = v - 1;
      if (before >= 0) {
        list = on[static_cast<std::size_t>(before)];
        list.push_back(before);
      }
      before = v;
    }
    last.push_back(before);
  }
  return on;
}

}  // namespace

DerivativesWorkspace::DerivativesWorkspace(const Model& model)
    : tree_(std::make_shared<const Tree<double>>(model.tree())),
      n_(tree_->velocities),
      stride_(padded(n_)),
      row_(padded(3 * n_)),
      links_(tree_->links.size()),
      root_of_(links_.size()),
      blocks_(links_.size()),
      ranges_(links_.size()),
      directions_(kRows * stride_),
      P_(static_cast<std::size_t>(n_)),
      M_(n_ * stride_),
      rows_(n_ * row_ + kPack),
      lines_(3 * stride_),
      force_(static_cast<std::size_t>(n_)),
      start_(static_cast<std::size_t>(n_)),
      roots_(links_.size()),
      cholesky_(ancestors_of(*tree_)) {
  for (std::size_t n = 0; n < links_.size(); ++n) {
    const int parent = tree_->links[n].parent;
    root_of_[n] = parent < 0 ? static_cast<int>(n) : root_of_[static_cast<std::size_t>(parent)];
    std::vector<Range>& ranges = ranges_[n];
    if (parent >= 0) ranges = ranges_[static_cast<std::size_t>(parent)];
    const Range mine = own(n);
    if (mine.begin == mine.end) continue;
    if (!ranges.empty() && ranges.back().end > mine.begin)
      throw std::logic_error("dynamics_derivatives: the velocities of a joint precede those of its parent");
    if (!ranges.empty() && ranges.back().end == mine.begin) {
      ranges.back().end = mine.end;
    } else {
      ranges.push_back(mine);
    }
    for (int first = 0; first < mine.end; first += kPack) {
      Block block;
      block.first = first;
      for (const Range& range : ranges) {
        for (int j = std::max(range.begin, first); j < std::min(range.end, first + kPack); ++j)
          block.mask[j - first] = -1;
      }
      if (std::ranges::any_of(block.mask, [](std::int64_t m) { return m != 0; })) blocks_[n].push_back(block);
    }
  }
}

// The wrench that a link requires, (28.2), and its share of (28.6).
GRAPNEL_INLINE void DerivativesWorkspace::require_load(std::size_t n) {
  LinkTerms& t = links_[n];
  const RigidBodyInertiad& I = t.own;
  const Vector3d &w = t.V.angular, &u = t.V.linear, &h = I.first_moment;
  const Load momentum = times(I, t.V);
  t.own_f = times(I, t.A) + cross_load(t.V, momentum);
  set(t.I, I);
  t.l = momentum.linear;
  // K = 2 ([w x] (J - tr(J)/2) - u h^T + (h . u) 1).
  const Symmetric3d& J = I.rotational;
  const double half = 0.5 * (J.xx + J.yy + J.zz), hu = dot(h, u);
  const Vector3d columns[3] = {cross(w, Vector3d{J.xx - half, J.xy, J.xz}), cross(w, Vector3d{J.xy, J.yy - half, J.yz}),
                               cross(w, Vector3d{J.xz, J.yz, J.zz - half})};
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) t.K(r, c) = 2 * (columns[c][r] - u[r] * h[c]);
    t.K(r, r) += 2 * hu;
  }
}

void DerivativesWorkspace::move_root(std::size_t n, const State& state, const Forces& forces,
                                     std::span<const double> vdot) {
  const TreeLink<double>& link = tree_->links[n];
  LinkTerms& t = links_[n];
  const std::span<const double> q = state.q, v = state.v;
  t.R = Rotationd::identity(), t.p = Vector3d::zero();
  t.V = root_velocity(link, v);
  t.own = link.inertia;
  const Vector3d g = gravity_in_root(link, q, forces.gravity);
  t.A = {Vector3d::zero(), -g};
  if (link.joint == JointType::fixed) return;
  const Motion start = t.A;
  for (int k = 0; k < 6; ++k) {
    Motion S = Motion::zero();
    (k < 3 ? S.angular : S.linear)[k % 3] = 1;
    put(kS, link.v + k, S);
    put(kPsi, link.v + k, Motion::zero());
    put(kPsi2, link.v + k, cross(start, S));
    put(kT, link.v + k, cross(t.V, S));
    if (!vdot.empty()) (k < 3 ? t.A.angular : t.A.linear)[k % 3] += vdot[link.v + k];
  }
}

GRAPNEL_INLINE void DerivativesWorkspace::move_link(std::size_t n, std::span<const double> q, std::span<const double> v,
                                                    std::span<const double> vdot) {
  const TreeLink<double>& link = tree_->links[n];
  LinkTerms& t = links_[n];
  const LinkTerms& parent = links_[static_cast<std::size_t>(link.parent)];
  visit_joint(link, [&](auto joint) GRAPNEL_INLINE_LAMBDA {
    using Joint = decltype(joint);
    if constexpr (!kIsRoot<Joint>) {
      LinkScratch<double> w;
      place(joint, link, q, w);
      t.R = joint_rotation(joint, w, link.rotated ? parent.R * link.X_PF.R : parent.R);
      t.p = parent.p + parent.R * w.p_PL;
      if constexpr (OneAxis<Joint>) {
        const Vector3d axis = link.sign * t.R.column(Joint::kAxis);
        const Motion S = Joint::kTurns ? Motion{axis, cross(t.p, axis)} : Motion{Vector3d::zero(), axis};
        const Motion psi = cross(parent.V, S);  // = S_dot of (28.4), since S x S = 0
        t.V = parent.V + v[link.v] * S;
        t.A = parent.A + v[link.v] * psi;
        put(kS, link.v, S), put(kPsi, link.v, psi), put(kT, link.v, 2.0 * psi);
        if (!vdot.empty()) t.A += vdot[link.v] * S;
      } else {
        Motion joint_twist = Motion::zero(), joint_acceleration = Motion::zero();
        Motion S[Joint::kVelocities];
        for (int k = 0; k < Joint::kVelocities; ++k) {
          const Vector3d axis = t.R.column(k);
          S[k] = {axis, cross(t.p, axis)};
          joint_twist += v[link.v + k] * S[k];
          if (!vdot.empty()) joint_acceleration += vdot[link.v + k] * S[k];
        }
        t.V = parent.V + joint_twist;
        t.A = parent.A + cross(parent.V, joint_twist) + joint_acceleration;
        for (int k = 0; k < Joint::kVelocities; ++k) {
          const Motion psi = cross(parent.V, S[k]);
          put(kS, link.v + k, S[k]), put(kPsi, link.v + k, psi), put(kT, link.v + k, psi + cross(t.V, S[k]));
        }
      }
      t.own = shift_origin(
          RigidBodyInertiad{link.inertia.mass, t.R * link.inertia.first_moment, rotate(t.R, link.inertia.rotational)},
          t.p);
    }
  });
}

// A rotor on the parent adds its spin to the parent's momentum: (28.10).
void DerivativesWorkspace::carry_rotor(std::size_t n, double rate, double acceleration) {
  const TreeLink<double>& link = tree_->links[n];
  LinkTerms &t = links_[n], &parent = links_[static_cast<std::size_t>(link.parent)];
  t.rotor = link.sign * (parent.R * link.rotor);
  t.gyration = cross(parent.V.angular, t.rotor);
  parent.own_f.angular += rate * t.gyration + acceleration * t.rotor;
  subtract_cross(parent.K, rate * t.rotor);
}

void DerivativesWorkspace::locate_roots(std::span<const double> q) {
  for (std::size_t n = 0; n < links_.size(); ++n) {
    const TreeLink<double>& link = tree_->links[n];
    if (link.parent >= 0) continue;
    const double* x = q.data() + link.q;
    roots_[n] = link.joint == JointType::fixed
                    ? link.X_PF
                    : Posed{rotation_matrix(Quaterniond{x[3], x[4], x[5], x[6]}), {x[0], x[1], x[2]}};
  }
}

// External wrenches, and the part of their derivatives by which they differ from wrenches fixed in their body: (28.9).
void DerivativesWorkspace::apply_external(const Model& model, const State& state,
                                          const std::vector<ExternalWrench>& external) {
  for (LinkTerms& t : links_) t.external = Load::zero(), t.E = Matrix3{};
  locate_roots(state.q);
  for (const ExternalWrench& e : external) {
    const auto n = static_cast<std::size_t>(model.bodies().at(static_cast<std::size_t>(e.body)).placement.link);
    const Posed& X_WB = root_of(static_cast<int>(n));
    const Load F = transposed_times(X_WB.R, e.F_W);
    const Vector3d p = transposed_times(X_WB.R, e.p_WP - X_WB.p);
    LinkTerms& t = links_[n];
    t.external += Load{F.angular + cross(p, F.linear), F.linear};
    const double pf = dot(p, F.linear);
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) t.E(r, c) -= F.linear[r] * p[c];
      t.E(r, r) += pf;
    }
    subtract_cross(t.E, F.angular);
  }
  for (LinkTerms& t : links_) t.own_f -= t.external;
}

void DerivativesWorkspace::sum_loads() {
  for (LinkTerms& t : links_) set(t.f, t.own_f);
  for (std::size_t n = links_.size(); n-- > 0;) {
    const int parent = tree_->links[n].parent;
    if (parent >= 0) links_[static_cast<std::size_t>(parent)].f += links_[n].f;
  }
}

void DerivativesWorkspace::sum_subtrees() {
  for (std::size_t n = links_.size(); n-- > 0;) {
    if (tree_->links[n].parent < 0) continue;
    const LinkTerms& t = links_[n];
    LinkTerms& parent = links_[static_cast<std::size_t>(tree_->links[n].parent)];
    parent.I += t.I, parent.l += t.l;
    add(parent.K, t.K);
    if (!has_external_) continue;
    parent.external += t.external;
    add(parent.E, t.E);
  }
}

void DerivativesWorkspace::move(const Model& model, const State& state, const Forces& forces,
                                std::span<const double> vdot) {
  const std::size_t count = links_.size();
  for (std::size_t n = 0; n < count; ++n) {
    if (tree_->links[n].parent < 0) {
      move_root(n, state, forces, vdot);
    } else {
      move_link(n, state.q, state.v, vdot);
    }
    require_load(n);
    const TreeLink<double>& link = tree_->links[n];
    if (link.has_rotor) carry_rotor(n, state.v[link.v], vdot.empty() ? 0 : vdot[link.v]);
  }
  has_external_ = !forces.external.empty();
  if (has_external_) apply_external(model, state, forces.external);
  sum_subtrees();
  sum_loads();
}

// M_ij = S_j . P_i (28.8) and the generalized forces at the accelerations of move().
void DerivativesWorkspace::form_mass_matrix(std::span<const double> vdot, std::span<double> force) {
  for (std::size_t n = 0; n < links_.size(); ++n) {
    const TreeLink<double>& link = tree_->links[n];
    const LinkTerms& t = links_[n];
    const Range mine = own(n);
    for (int i = mine.begin; i < mine.end; ++i) {
      const Motion S = at(kS, i);
      const Load P = P_[i] = times(t.I, S);
      Load F = P;
      if (link.has_rotor) F.angular += t.rotor;
      double* const row = M_.data() + i * stride_;
      for (const Block& block : blocks_[n]) {
        const double* const s = directions_.data() + block.first * kRows;
        pack_at(row + block.first) = F.angular[0] * pack_at(s) + F.angular[1] * pack_at(s + kPack) +
                                     F.angular[2] * pack_at(s + 2 * kPack) + F.linear[0] * pack_at(s + 3 * kPack) +
                                     F.linear[1] * pack_at(s + 4 * kPack) + F.linear[2] * pack_at(s + 5 * kPack);
      }
      force[i] = product(S, t.f);
      if (mine.end - mine.begin > 1) continue;
      row[i] = product(S, P) + link.armature;  // without the rotor's spin, which the parent carries
      force[i] += link.armature * vdot[i];
      if (link.has_rotor) force[i] += dot(t.rotor, links_[static_cast<std::size_t>(link.parent)].A.angular);
    }
  }
}

void DerivativesWorkspace::read_mass_matrix(RowMatrix& to) const {
  to.setZero(n_, n_);
  for (std::size_t n = 0; n < links_.size(); ++n) {
    const Range mine = own(n);
    for (int i = mine.begin; i < mine.end; ++i) {
      for (const Range& range : ranges_[n]) {
        for (int j = range.begin; j < range.end; ++j) to(i, j) = to(j, i) = M_.data()[i * stride_ + j];
      }
    }
  }
}

void DerivativesWorkspace::project_modes(std::span<double> force) {
  if (tree_->chains.empty()) return;
  RowMatrix sparse;
  read_mass_matrix(sparse);
  Eigen::MatrixXd M = sparse;
  project_mass_matrix(*tree_, M);
  for (int i = 0; i < n_; ++i) {
    for (int j = 0; j < n_; ++j) M_.data()[i * stride_ + j] = M(i, j);
  }
  Eigen::MatrixXd row = Eigen::Map<Eigen::RowVectorXd>(force.data(), n_);
  project_columns(*tree_, row);
  for (int i = 0; i < n_; ++i) force[i] = row(0, i);
}

void DerivativesWorkspace::isolate(std::span<const std::uint8_t> prescribed) {
  if (prescribed.empty()) return;
  for (int i = 0; i < n_; ++i) {
    for (int j = 0; j < i; ++j) {
      if (prescribed[i] || prescribed[j]) M_.data()[i * stride_ + j] = 0;
    }
    if (prescribed[i]) M_.data()[i * stride_ + i] = 1;
  }
}

void DerivativesWorkspace::accelerate(std::span<const double> vdot) {
  for (std::size_t n = 0; n < links_.size(); ++n) {
    const TreeLink<double>& link = tree_->links[n];
    LinkTerms& t = links_[n];
    const Range mine = own(n);
    t.change = link.parent < 0 ? Motion::zero() : links_[static_cast<std::size_t>(link.parent)].change;
    for (int i = mine.begin; i < mine.end; ++i) t.change += vdot[i] * at(kS, i);
    t.A += t.change;
    t.own_f += times(t.own, t.change);
    if (link.has_rotor) links_[static_cast<std::size_t>(link.parent)].own_f.angular += vdot[link.v] * t.rotor;
  }
  sum_loads();
}

void DerivativesWorkspace::accelerate_freely(const Model& model, const State& state, const Forces& forces,
                                             const PrescribedMotion& given, const char* function,
                                             std::vector<double>& vdot) {
  check_size(model, state, *this, function);
  if (!forces.generalized.empty()) check_size(model, forces.generalized.size(), function, "generalized forces");
  if (!given.prescribed.empty()) {
    check_size(model, given.prescribed.size(), function, "prescribed velocities");
    check_size(model, given.vdot.size(), function, "prescribed accelerations");
  }
  const auto n = static_cast<std::size_t>(n_);
  const std::span<const std::uint8_t> prescribed = given.prescribed;
  std::fill(start_.begin(), start_.end(), 0.0);
  for (std::size_t i = 0; i < prescribed.size(); ++i) start_[i] = prescribed[i] ? given.vdot[i] : 0;

  // The missing accelerations: M vdot = tau - c.
  move(model, state, forces, prescribed.empty() ? std::span<const double>{} : start_);
  form_mass_matrix(start_, force_);
  for (std::size_t i = 0; i < n; ++i) force_[i] = (forces.generalized.empty() ? 0 : forces.generalized[i]) - force_[i];
  project_modes(force_);
  isolate(prescribed);
  for (std::size_t i = 0; i < prescribed.size(); ++i) force_[i] = prescribed[i] ? 0 : force_[i];
  cholesky_.factor(M_.data(), stride_);
  cholesky_.solve(force_.data());
  accelerate(force_);
  vdot.resize(n);
  for (std::size_t i = 0; i < n; ++i) vdot[i] = start_[i] + force_[i];
}

}  // namespace grapnel
