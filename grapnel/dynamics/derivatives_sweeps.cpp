// Sweeps over the links, the mass matrix and the accelerations: (28.2) to (28.6).
#include <algorithm>
#include <stdexcept>

#include "grapnel/dynamics/derivatives_structure.hpp"
#include "grapnel/dynamics/derivatives_workspace.hpp"
#include "grapnel/dynamics/modal_chains.hpp"
#include "grapnel/model/tree.hpp"

namespace grapnel {

using namespace recursion;
using namespace derivatives;

namespace {

// In the order of load_inertia(), in one lane.
void put_inertia(const RigidBodyInertiad& I, double* lane) {
  const Symmetric3d& J = I.rotational;
  const Vector3d& h = I.first_moment;
  const double values[] = {I.mass, h[0], h[1], h[2], J.xx, J.yy, J.zz, J.xy, J.xz, J.yz};
  for (const double value : values) *lane = value, lane += kPack;
}

// The inertia about another origin, of which the present one is at p.
GRAPNEL_INLINE PackInertia moved(const PackInertia& I, const Pack3& p) {
  const Pack3 &h = I.first_moment, g = h + I.mass * p;  // g . p + h . p = 2 h . p + m p . p
  const Symmetric3<Pack>& J = I.rotational;
  const Pack x = (g[0] + h[0]) * p[0], y = (g[1] + h[1]) * p[1], z = (g[2] + h[2]) * p[2];
  return {I.mass,
          g,
          {J.xx + (y + z), J.yy + (x + z), J.zz + (x + y), J.xy - (h[0] * p[1] + g[1] * p[0]),
           J.xz - (h[0] * p[2] + g[2] * p[0]), J.yz - (h[1] * p[2] + g[2] * p[1])}};
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
      lanes_(kRows * stride_),
      M_(n_ * stride_),
      rows_(n_ * row_ + kPack),
      lines_(3 * stride_),
      required_(stride_),
      force_(static_cast<std::size_t>(n_)),
      start_(static_cast<std::size_t>(n_)),
      roots_(links_.size()),
      cholesky_(velocities_before(*tree_)) {
  for (std::size_t n = 0; n < links_.size(); ++n) {
    const int parent = tree_->links[n].parent;
    root_of_[n] = parent < 0 ? static_cast<int>(n) : root_of_[static_cast<std::size_t>(parent)];
    std::vector<Range>& ranges = ranges_[n];
    if (parent >= 0) ranges = ranges_[static_cast<std::size_t>(parent)];
    const Range mine = own(n);
    if (mine.begin == mine.end) continue;
    put_inertia(tree_->links[n].inertia, lane(kBody, mine.begin));
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

void DerivativesWorkspace::move_root(std::size_t n, const State& state, const Forces& forces,
                                     std::span<const double> vdot) {
  const TreeLink<double>& link = tree_->links[n];
  LinkTerms& t = links_[n];
  const std::span<const double> q = state.q, v = state.v;
  t.R = Rotationd::identity(), t.p = Vector3d::zero();
  t.V = root_velocity(link, v);
  t.A = {Vector3d::zero(), -gravity_in_root(link, q, forces.gravity)};
  if (link.joint == JointType::fixed) return;
  for (int k = 0; k < 6; ++k) {
    Motion S = Motion::zero();
    (k < 3 ? S.angular : S.linear)[k % 3] = 1;
    put(kS, link.v + k, S), put(kV, link.v + k, t.V);
    put(kParentV, link.v + k, Motion::zero()), put(kParentA, link.v + k, t.A);
  }
  for (int k = 0; k < 6 && !vdot.empty(); ++k) (k < 3 ? t.A.angular : t.A.linear)[k % 3] += vdot[link.v + k];
  put_link(n);
}

GRAPNEL_INLINE void DerivativesWorkspace::put_link(std::size_t n) {
  const LinkTerms& t = links_[n];
  const int v = tree_->links[n].v;
  put(kA, v, t.A), put(kOrigin, v, t.p);
  double* const R = lane(kR, v);
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) R[(3 * r + c) * kPack] = t.R(r, c);
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
        put(kS, link.v, S), put(kV, link.v, t.V), put(kParentV, link.v, parent.V);
        if (!vdot.empty()) t.A += vdot[link.v] * S;
      } else {
        Motion joint_twist = Motion::zero(), joint_acceleration = Motion::zero();
        for (int k = 0; k < Joint::kVelocities; ++k) {
          const Vector3d axis = t.R.column(k);
          const Motion S = {axis, cross(t.p, axis)};
          put(kS, link.v + k, S), put(kParentV, link.v + k, parent.V);
          joint_twist += v[link.v + k] * S;
          if (!vdot.empty()) joint_acceleration += vdot[link.v + k] * S;
        }
        t.V = parent.V + joint_twist;
        t.A = parent.A + cross(parent.V, joint_twist) + joint_acceleration;
        for (int k = 0; k < Joint::kVelocities; ++k) put(kV, link.v + k, t.V);
      }
      put_link(n);
    }
  });
}

// For all links: inertia in the root's frame, the wrench that they require (28.2), and their share of (28.6). For all
// velocities: psi_dot, and psi_dot + S_dot.
void DerivativesWorkspace::require_loads() {
  for (int b = 0; b < pack_count(); ++b) {
    double* const D = lane(0, b * kPack);
    const PackMotion V = load_motion(D, kV), A = load_motion(D, kA), S = load_motion(D, kS);
    const PackMotion psi = cross(load_motion(D, kParentV), S);
    store(D, kPsi, psi);
    store(D, kT, psi + cross(V, S));

    const auto d = [&](int k) GRAPNEL_INLINE_LAMBDA { return Pack(pack_at(D + k * kPack)); };
    const Rotation<Pack> R{
        {{d(kR), d(kR + 1), d(kR + 2)}, {d(kR + 3), d(kR + 4), d(kR + 5)}, {d(kR + 6), d(kR + 7), d(kR + 8)}}};
    const PackInertia body = load_inertia(D, kBody);
    const PackInertia I = moved({body.mass, R * body.first_moment, rotate(R, body.rotational)}, load(D, kOrigin));
    store(D, kOwn, I), store(D, kTree, I);
    const PackLoad momentum = times(I, V);
    store(D, kLoad, times(I, A) + cross_load(V, momentum));
    store(D, kL, momentum.linear);
    // K = 2 ([w x] (J - tr(J)/2) - u h^T + (h . u) 1).
    const Symmetric3<Pack>& J = I.rotational;
    const Pack3 &w = V.angular, &u = V.linear, h = I.first_moment + I.first_moment;
    const Pack trace = J.xx + J.yy + J.zz, hu = dot(h, u);
    const Pack3 x = cross(w, Pack3{J.xx + J.xx - trace, J.xy + J.xy, J.xz + J.xz});
    const Pack3 y = cross(w, Pack3{J.xy + J.xy, J.yy + J.yy - trace, J.yz + J.yz});
    const Pack3 z = cross(w, Pack3{J.xz + J.xz, J.yz + J.yz, J.zz + J.zz - trace});
    const auto put_K = [&](int k, const Pack& value) GRAPNEL_INLINE_LAMBDA { pack_at(D + (kK + k) * kPack) = value; };
    put_K(0, x[0] - u[0] * h[0] + hu), put_K(1, y[0] - u[0] * h[1]), put_K(2, z[0] - u[0] * h[2]);
    put_K(3, x[1] - u[1] * h[0]), put_K(4, y[1] - u[1] * h[1] + hu), put_K(5, z[1] - u[1] * h[2]);
    put_K(6, x[2] - u[2] * h[0]), put_K(7, y[2] - u[2] * h[1]), put_K(8, z[2] - u[2] * h[2] + hu);
  }
}

// A rotor on the parent adds its spin to the parent's momentum: (28.10).
void DerivativesWorkspace::carry_rotor(std::size_t n, double rate, double acceleration) {
  const TreeLink<double>& link = tree_->links[n];
  LinkTerms& t = links_[n];
  const LinkTerms& parent = links_[static_cast<std::size_t>(link.parent)];
  t.rotor = link.sign * (parent.R * link.rotor);
  t.gyration = cross(parent.V.angular, t.rotor);
  const Range of_parent = own(static_cast<std::size_t>(link.parent));
  if (of_parent.begin == of_parent.end) return;
  increase(kLoad, of_parent.begin, rate * t.gyration + acceleration * t.rotor);
  const Vector3d a = rate * t.rotor;  // K - [a x]
  double* const K = lane(kK, of_parent.begin);
  K[kPack] += a[2], K[2 * kPack] -= a[1], K[3 * kPack] -= a[2], K[5 * kPack] += a[0];
  K[6 * kPack] += a[1], K[7 * kPack] -= a[0];
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
  for (std::size_t n = 0; n < links_.size(); ++n) {
    const Range mine = own(n);
    if (mine.begin == mine.end) continue;
    increase(kLoad, mine.begin, -links_[n].external.angular);
    increase(kLoad + 3, mine.begin, -links_[n].external.linear);
  }
  for (std::size_t n = links_.size(); n-- > 0;) {
    if (tree_->links[n].parent < 0) continue;
    LinkTerms& parent = links_[static_cast<std::size_t>(tree_->links[n].parent)];
    parent.external += links_[n].external;
    add(parent.E, links_[n].E);
  }
}

// Rows of links => of their subtrees, for every velocity.
void DerivativesWorkspace::sum_subtrees(int row, int count) {
  for (std::size_t n = links_.size(); n-- > 0;) {
    const Range mine = own(n);
    if (mine.begin == mine.end) continue;
    const double* const from = lane(row, mine.begin);
    const int parent = tree_->links[n].parent;
    if (parent >= 0 && velocity_count(tree_->links[static_cast<std::size_t>(parent)].joint) > 0) {
      double* const to = lane(row, tree_->links[static_cast<std::size_t>(parent)].v);
      for (int k = 0; k < count; ++k) to[k * kPack] += from[k * kPack];
    }
    for (int v = mine.begin + 1; v < mine.end; ++v) {
      double* const to = lane(row, v);
      for (int k = 0; k < count; ++k) to[k * kPack] = from[k * kPack];
    }
  }
}

void DerivativesWorkspace::move(const Model& model, const State& state, const Forces& forces,
                                std::span<const double> vdot) {
  const std::size_t count = links_.size();
  bool has_rotors = false;
  for (std::size_t n = 0; n < count; ++n) {
    if (tree_->links[n].parent < 0) {
      move_root(n, state, forces, vdot);
    } else {
      move_link(n, state.q, state.v, vdot);
    }
    has_rotors = has_rotors || tree_->links[n].has_rotor;
  }
  require_loads();
  for (std::size_t n = 0; has_rotors && n < count; ++n) {
    const TreeLink<double>& link = tree_->links[n];
    if (link.has_rotor) carry_rotor(n, state.v[link.v], vdot.empty() ? 0 : vdot[link.v]);
  }
  has_external_ = !forces.external.empty();
  if (has_external_) apply_external(model, state, forces.external);
  sum_subtrees(kTree, kSums);
}

// M_ij = S_j . P_i (28.8) and the generalized forces at the accelerations of move().
void DerivativesWorkspace::form_mass_matrix(std::span<const double> vdot, std::span<double> force) {
  for (int b = 0; b < pack_count(); ++b) {
    double* const D = lane(0, b * kPack);
    const PackMotion S = load_motion(D, kS);
    store(D, kP, times(load_inertia(D, kTree), S));
    pack_at(required_.data() + b * kPack) = product(S, load_load(D, kLoad));
  }
  for (std::size_t n = 0; n < links_.size(); ++n) {
    const TreeLink<double>& link = tree_->links[n];
    const Range mine = own(n);
    for (int i = mine.begin; i < mine.end; ++i) {
      const double* const P = lane(kP, i);
      const Vector3d upper{P[0], P[kPack], P[2 * kPack]}, lower{P[3 * kPack], P[4 * kPack], P[5 * kPack]};
      const Vector3d moment = link.has_rotor ? upper + links_[n].rotor : upper;
      double* const row = M_.data() + i * stride_;
      for (const Block& block : blocks_[n]) {
        const double* const s = lane(kS, block.first);
        pack_at(row + block.first) =
            (moment[0] * pack_at(s) + moment[1] * pack_at(s + kPack) + moment[2] * pack_at(s + 2 * kPack)) +
            (lower[0] * pack_at(s + 3 * kPack) + lower[1] * pack_at(s + 4 * kPack) + lower[2] * pack_at(s + 5 * kPack));
      }
      force[i] = required_.data()[i];
      if (mine.end - mine.begin > 1) continue;
      force[i] += link.armature * vdot[i];
      if (!link.has_rotor) {
        row[i] += link.armature;
        continue;
      }
      const Motion S = at(kS, i);  // without the rotor's spin, which the parent carries
      row[i] = dot(S.angular, upper) + dot(S.linear, lower) + link.armature;
      force[i] += dot(links_[n].rotor, links_[static_cast<std::size_t>(link.parent)].A.angular);
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
    if (mine.begin < mine.end) put(kChange, mine.begin, t.change);
  }
  for (int b = 0; b < pack_count(); ++b) {
    double* const D = lane(0, b * kPack);
    store(D, kChange, times(load_inertia(D, kOwn), load_motion(D, kChange)));
  }
  for (std::size_t n = 0; n < links_.size(); ++n) {
    const TreeLink<double>& link = tree_->links[n];
    if (!link.has_rotor) continue;
    const Range of_parent = own(static_cast<std::size_t>(link.parent));
    if (of_parent.begin < of_parent.end) increase(kChange, of_parent.begin, vdot[link.v] * links_[n].rotor);
  }
  sum_subtrees(kChange, 6);
  for (int b = 0; b < pack_count(); ++b) {
    double* const D = lane(0, b * kPack);
    store(D, kLoad, load_load(D, kLoad) + load_load(D, kChange));
  }
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
