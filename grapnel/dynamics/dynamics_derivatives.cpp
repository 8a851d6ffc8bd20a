#include "grapnel/dynamics/dynamics_derivatives.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>

#include "grapnel/dynamics/modal_chains.hpp"
#include "grapnel/dynamics/recursion.hpp"
#include "grapnel/dynamics/row_cholesky.hpp"
#include "grapnel/model/tree.hpp"

namespace grapnel {
namespace {

using namespace recursion;
using namespace packed_rows;

// Variations of motions and of loads. All are at the origin of the tree's root, in the axes of the root.
using Motion = Twistd;
using Load = Wrenchd;
using Matrix3 = Rotationd;  // any 3 x 3 matrix

GRAPNEL_INLINE Motion cross(const Motion& V, const Motion& X) {
  return {cross(V.angular, X.angular), cross(V.angular, X.linear) + cross(V.linear, X.angular)};
}
GRAPNEL_INLINE Load cross_load(const Motion& V, const Load& F) {
  return {cross(V.angular, F.angular) + cross(V.linear, F.linear), cross(V.angular, F.linear)};
}
GRAPNEL_INLINE double product(const Motion& V, const Load& F) {
  return dot(V.angular, F.angular) + dot(V.linear, F.linear);
}
GRAPNEL_INLINE Load times(const RigidBodyInertiad& I, const Motion& X) {
  return {I.rotational * X.angular + cross(I.first_moment, X.linear),
          I.mass * X.linear + cross(X.angular, I.first_moment)};
}
// Number by number: a block copy of numbers just stored would wait for the store buffer.
GRAPNEL_INLINE void set(RigidBodyInertiad& I, const RigidBodyInertiad& from) {
  const Symmetric3d& J = from.rotational;
  I.mass = from.mass;
  for (int k = 0; k < 3; ++k) I.first_moment[k] = from.first_moment[k];
  I.rotational.xx = J.xx, I.rotational.yy = J.yy, I.rotational.zz = J.zz;
  I.rotational.xy = J.xy, I.rotational.xz = J.xz, I.rotational.yz = J.yz;
}
GRAPNEL_INLINE void set(Load& F, const Load& from) {
  for (int k = 0; k < 3; ++k) F.angular[k] = from.angular[k], F.linear[k] = from.linear[k];
}
GRAPNEL_INLINE void add(Matrix3& A, const Matrix3& B) {
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) A(r, c) += B(r, c);
  }
}
// A - [a x].
GRAPNEL_INLINE void subtract_cross(Matrix3& A, const Vector3d& a) {
  A(0, 1) += a[2], A(0, 2) -= a[1], A(1, 0) -= a[2], A(1, 2) += a[0], A(2, 0) += a[1], A(2, 1) -= a[0];
}

// A link seen from the root of its tree.
struct LinkTerms {
  Rotationd R;               // of the link's frame
  Vector3d p;                // its origin
  Motion V, A;               // twist; acceleration, gravity counted as an acceleration of the root
  RigidBodyInertiad own, I;  // of the link, of its subtree
  Load own_f, f;             // likewise the load that they require, I A + V x* I V - F
  Matrix3 K;                 // of the subtree: 2 B = [K 0; -2 l x, 0] of (28.6)
  Vector3d l;
  Vector3d rotor, gyration;  // of (28.10): rho and w_p x rho of the rotor on the parent, for its rate [1]
  Motion change;             // of the acceleration, accelerate()
  Load external;             // of the subtree: external wrenches, and the upper half of (28.9)
  Matrix3 E;
};

struct Range {
  int begin, end;
};

// Eight velocities, of which those with a mask are wanted.
struct alignas(64) Block {
  std::int64_t mask[kPack] = {};  // all bits, or none
  int first = 0;                  // velocity
};

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

class DerivativesWorkspace {
 public:
  explicit DerivativesWorkspace(const Model& model);

  const Tree<double>& tree() const { return *tree_; }
  int size() const { return n_; }

  /// Outward and inward sweeps for given accelerations (empty: zero): everything that does not depend on others.
  void move(const Model& model, const State& state, const Forces& forces, std::span<const double> vdot);
  /// Rows of the mass matrix, and the forces at the given accelerations.
  void form_mass_matrix(std::span<const double> vdot, std::span<double> force);
  /// Replaces M by Pi M Pi + alpha (1 - Pi), and vectors x by Pi x: modal_chains.hpp.
  void project_modes(std::span<double> force);
  /// Separates velocities with given accelerations from the others.
  void isolate(std::span<const std::uint8_t> prescribed);
  /// force <- M^-1 force.
  void solve(std::span<double> force) {
    cholesky_.factor(M_.data(), stride_);
    cholesky_.solve(force.data());
  }
  /// Adds accelerations to those of move().
  void accelerate(std::span<const double> vdot);
  /// Derivatives of inverse dynamics in the rows.
  void accelerate_directions();
  void differentiate();
  /// Replaces these derivatives by minus those of forward dynamics, and appends -M^-1.
  void invert(std::span<const std::uint8_t> prescribed);
  void wrench_columns(const Model& model, const std::vector<ExternalWrench>& external, const RowMatrix& dtau,
                      RowMatrix& dwrench) const;

  void inertial_columns(const Model& model, RowMatrix& dphi) const;

  void read(int block, double factor, RowMatrix& to) const {
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
  void read_mass_matrix(RowMatrix& to) const;
  std::span<double> force() { return {force_.data(), static_cast<std::size_t>(n_)}; }
  std::span<double> start() { return {start_.data(), static_cast<std::size_t>(n_)}; }

 private:
  // Rows of directions_: S, psi_dot, psi_ddot and psi_dot + S_dot of (28.3) and (28.4).
  enum Row { kS = 0, kPsi = 6, kPsi2 = 12, kT = 18, kRows = 24 };
  // Eight velocities together: kRows packs for each eight.
  static int place_of(int v) { return v / kPack * (kRows * kPack) + v % kPack; }
  GRAPNEL_INLINE void put(int row, int v, const Motion& X) {
    double* to = directions_.data() + place_of(v) + row * kPack;
    for (int k = 0; k < 3; ++k) to[k * kPack] = X.angular[k], to[(k + 3) * kPack] = X.linear[k];
  }
  GRAPNEL_INLINE Motion at(int row, int v) const {
    const double* from = directions_.data() + place_of(v) + row * kPack;
    return {{from[0], from[kPack], from[2 * kPack]}, {from[3 * kPack], from[4 * kPack], from[5 * kPack]}};
  }
  void move_root(std::size_t n, const State& state, const Forces& forces, std::span<const double> vdot);
  void move_link(std::size_t n, std::span<const double> q, std::span<const double> v, std::span<const double> vdot);
  void require_load(std::size_t n);
  void carry_rotor(std::size_t n, double rate, double acceleration);
  void apply_external(const Model& model, const State& state, const std::vector<ExternalWrench>& external);
  void sum_subtrees();
  void sum_loads();
  // Factors of one velocity: of rows, and of columns with respect to q and v.
  struct Products {
    Vector3d Q;
    Load P, q, v;
  };
  void project(const Products& x, const Block& block, double* row);
  void fill(std::size_t n, int i, const Products& x);
  void add_external_row(std::size_t n, int i, const Motion& S);
  Range own(std::size_t n) const {
    return {tree_->links[n].v, tree_->links[n].v + velocity_count(tree_->links[n].joint)};
  }

  std::shared_ptr<const Tree<double>> tree_;
  int n_, stride_, row_;
  std::vector<LinkTerms> links_;
  std::vector<int> root_of_;                // per link
  std::vector<std::vector<Block>> blocks_;  // per link: the same velocities in eights
  std::vector<std::vector<Range>> ranges_;  // per link: velocities of its ancestors and itself, ascending
  PackedNumbers directions_;                // for each eight velocities, kRows packs
  std::vector<Load> P_;                     // per velocity: I S of the subtree
  PackedNumbers M_;                         // rows of the lower triangle
  PackedNumbers rows_;                      // n x row_: [d/dq, d/dv, -1]
  PackedNumbers lines_;                     // of one velocity: its row of v, its columns of q and v
  std::vector<double> force_, start_;
  std::vector<Pose<double>> roots_;  // X_WB of the root of each link's tree, at its root
  bool has_external_ = false;
  RowCholesky cholesky_;
};

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

// External wrenches, and the part of their derivatives by which they differ from wrenches fixed in their body: (28.9).
void DerivativesWorkspace::apply_external(const Model& model, const State& state,
                                          const std::vector<ExternalWrench>& external) {
  for (LinkTerms& t : links_) t.external = Load::zero(), t.E = Matrix3{};
  for (std::size_t n = 0; n < links_.size(); ++n) {
    const TreeLink<double>& link = tree_->links[n];
    if (link.parent >= 0) continue;
    const double* q = state.q.data() + link.q;
    roots_[n] = link.joint == JointType::fixed
                    ? link.X_PF
                    : Posed{rotation_matrix(Quaterniond{q[3], q[4], q[5], q[6]}), {q[0], q[1], q[2]}};
  }
  for (const ExternalWrench& e : external) {
    const auto n = static_cast<std::size_t>(model.bodies().at(static_cast<std::size_t>(e.body)).placement.link);
    const Posed& X_WB = roots_[static_cast<std::size_t>(root_of_[n])];
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

// dvdot/dF = M^-1 J^T, J the Jacobian of the wrench's point.
void DerivativesWorkspace::wrench_columns(const Model& model, const std::vector<ExternalWrench>& external,
                                          const RowMatrix& dtau, RowMatrix& dwrench) const {
  dwrench.setZero(n_, static_cast<Eigen::Index>(6 * external.size()));
  for (std::size_t e = 0; e < external.size(); ++e) {
    const auto n =
        static_cast<std::size_t>(model.bodies().at(static_cast<std::size_t>(external[e].body)).placement.link);
    const Posed& X_WB = roots_[static_cast<std::size_t>(root_of_[n])];
    const Vector3d p = transposed_times(X_WB.R, external[e].p_WP - X_WB.p);
    for (const Range& range : ranges_[n]) {
      for (int j = range.begin; j < range.end; ++j) {
        const Motion J = X_WB.R * shift(at(kS, j), p);
        for (int i = 0; i < n_; ++i) {
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

namespace {

void check(const Model& model, const State& state, const DerivativesWorkspace& workspace, const char* function) {
  const auto fail = [&](const char* text) { throw std::invalid_argument(std::string(function) + ": " + text); };
  if (static_cast<int>(state.q.size()) != model.coordinates() || static_cast<int>(state.v.size()) != model.velocities())
    fail("the state has another model's size");
  if (workspace.tree().links.size() != model.tree().links.size() || workspace.size() != model.velocities())
    fail("the workspace was made for another model");
}

void check_size(const Model& model, std::size_t size, const char* function, const char* what) {
  if (static_cast<int>(size) == model.velocities()) return;
  throw std::invalid_argument(std::string(function) + ": " + what + " have another model's size");
}

}  // namespace

std::shared_ptr<DerivativesWorkspace> make_derivatives_workspace(const Model& model) {
  return std::make_shared<DerivativesWorkspace>(model);
}

// State, accelerations => tau and its derivatives, (28.7) and (28.8).
void inverse_dynamics_derivatives(const Model& model, const State& state, const std::vector<double>& vdot,
                                  const Forces& forces, DerivativesWorkspace& workspace,
                                  InverseDynamicsDerivatives& result) {
  check(model, state, workspace, "inverse_dynamics_derivatives");
  check_size(model, vdot.size(), "inverse_dynamics_derivatives", "the accelerations");
  result.tau.resize(vdot.size());
  workspace.move(model, state, forces, vdot);
  workspace.form_mass_matrix(vdot, result.tau);
  workspace.read_mass_matrix(result.dvdot);
  workspace.accelerate_directions();
  workspace.differentiate();
  workspace.read(0, 1, result.dq);
  workspace.read(1, 1, result.dv);
}

InverseDynamicsDerivatives inverse_dynamics_derivatives(const Model& model, const State& state,
                                                        const std::vector<double>& vdot, const Forces& forces) {
  DerivativesWorkspace workspace(model);
  InverseDynamicsDerivatives result;
  inverse_dynamics_derivatives(model, state, vdot, forces, workspace, result);
  return result;
}

// State => the forces of (22.1) at the joints, and their slopes: zero within the backlash.
SpringForces spring_forces(const Model& model, const State& state) {
  if (static_cast<int>(state.q.size()) != model.coordinates() || static_cast<int>(state.v.size()) != model.velocities())
    throw std::invalid_argument("spring_forces: the state has another model's size");
  const auto n = static_cast<std::size_t>(model.velocities());
  SpringForces result{std::vector<double>(n), std::vector<double>(n), std::vector<double>(n)};
  for (const int b : model.springs()) {
    const Body& body = model.bodies()[static_cast<std::size_t>(b)];
    const JointSpring& spring = *body.description.joint.spring;
    const double q = state.q[body.q];
    const bool acts = spring.backlash == 0 || spring.deflection(q) != 0;
    result.force[body.v] = spring.effort(q) - spring.damping * state.v[body.v];
    result.dq[body.v] = acts ? -spring.stiffness : 0;
    result.dv[body.v] = -spring.damping;
  }
  return result;
}

// State, accelerations => d tau / d phi (28.13).
RowMatrix inertial_regressor(const Model& model, const State& state, const std::vector<double>& vdot,
                             const Vector3d& gravity) {
  DerivativesWorkspace workspace(model);
  check(model, state, workspace, "inertial_regressor");
  check_size(model, vdot.size(), "inertial_regressor", "the accelerations");
  workspace.move(model, state, {{}, {}, gravity}, vdot);
  RowMatrix dphi;
  workspace.inertial_columns(model, dphi);
  return dphi;
}

// State, forces => vdot of (2.7) and its derivatives (28.12): at these accelerations, -M^-1 times those of the inverse
// dynamics.
void forward_dynamics_derivatives(const Model& model, const State& state, const Forces& forces,
                                  DerivativesWorkspace& workspace, ForwardDynamicsDerivatives& result,
                                  const PrescribedMotion& given) {
  constexpr const char* kName = "forward_dynamics_derivatives";
  check(model, state, workspace, kName);
  if (!forces.generalized.empty()) check_size(model, forces.generalized.size(), kName, "generalized forces");
  if (!given.prescribed.empty()) {
    check_size(model, given.prescribed.size(), kName, "prescribed velocities");
    check_size(model, given.vdot.size(), kName, "prescribed accelerations");
  }
  const auto n = static_cast<std::size_t>(model.velocities());
  const std::span<const std::uint8_t> prescribed = given.prescribed;
  const std::span<double> start = workspace.start(), force = workspace.force();
  std::fill(start.begin(), start.end(), 0.0);
  for (std::size_t i = 0; i < prescribed.size(); ++i) start[i] = prescribed[i] ? given.vdot[i] : 0;

  // The missing accelerations: M vdot = tau - c.
  workspace.move(model, state, forces, prescribed.empty() ? std::span<const double>{} : start);
  workspace.form_mass_matrix(start, force);
  for (std::size_t i = 0; i < n; ++i) force[i] = (forces.generalized.empty() ? 0 : forces.generalized[i]) - force[i];
  workspace.project_modes(force);
  workspace.isolate(prescribed);
  for (std::size_t i = 0; i < prescribed.size(); ++i) force[i] = prescribed[i] ? 0 : force[i];
  workspace.solve(force);
  workspace.accelerate(force);
  result.vdot.resize(n);
  for (std::size_t i = 0; i < n; ++i) result.vdot[i] = start[i] + force[i];

  workspace.accelerate_directions();
  workspace.differentiate();
  workspace.invert(prescribed);
  workspace.read(0, -1, result.dq);
  workspace.read(1, -1, result.dv);
  workspace.read(2, -1, result.dtau);
  workspace.wrench_columns(model, forces.external, result.dtau, result.dwrench);
}

ForwardDynamicsDerivatives forward_dynamics_derivatives(const Model& model, const State& state, const Forces& forces,
                                                        const PrescribedMotion& given) {
  DerivativesWorkspace workspace(model);
  ForwardDynamicsDerivatives result;
  forward_dynamics_derivatives(model, state, forces, workspace, result, given);
  return result;
}

}  // namespace grapnel
