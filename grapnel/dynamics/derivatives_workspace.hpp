#pragma once

/// @file
/// The sweeps and products behind dynamics_derivatives.hpp, in steps: section 28 of docs/theory. Private to this module
/// and grapnel/constraint, which adds closed loops.

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "grapnel/dynamics/dynamics_derivatives.hpp"
#include "grapnel/dynamics/motion_products.hpp"
#include "grapnel/dynamics/recursion.hpp"
#include "grapnel/dynamics/row_cholesky.hpp"

namespace grapnel {
namespace derivatives {

using namespace packed_rows;

// Variations of motions and of loads. All are at the origin of the tree's root, in the axes of the root.
using Motion = Twistd;
using Load = Wrenchd;
using Matrix3 = Rotationd;  // any 3 x 3 matrix

// The same for eight velocities at a time.
using Pack3 = Vector3<Pack>;
using PackMotion = Twist<Pack>;
using PackLoad = Wrench<Pack>;
using PackInertia = RigidBodyInertia<Pack>;

GRAPNEL_INLINE void add(Matrix3& A, const Matrix3& B) {
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) A(r, c) += B(r, c);
  }
}
// A - [a x].
GRAPNEL_INLINE void subtract_cross(Matrix3& A, const Vector3d& a) {
  A(0, 1) += a[2], A(0, 2) -= a[1], A(1, 0) -= a[2], A(1, 2) += a[0], A(2, 0) += a[1], A(2, 1) -= a[0];
}

// Rows of packs from D on.
GRAPNEL_INLINE Pack3 load(const double* D, int row) {
  return {pack_at(D + row * kPack), pack_at(D + (row + 1) * kPack), pack_at(D + (row + 2) * kPack)};
}
GRAPNEL_INLINE PackMotion load_motion(const double* D, int row) { return {load(D, row), load(D, row + 3)}; }
GRAPNEL_INLINE PackLoad load_load(const double* D, int row) { return {load(D, row), load(D, row + 3)}; }
GRAPNEL_INLINE PackInertia load_inertia(const double* D, int row) {
  const auto d = [&](int k) GRAPNEL_INLINE_LAMBDA { return Pack(pack_at(D + (row + k) * kPack)); };
  return {d(0), {d(1), d(2), d(3)}, {d(4), d(5), d(6), d(7), d(8), d(9)}};
}
GRAPNEL_INLINE void store(double* D, int row, const Pack3& x) {
  pack_at(D + row * kPack) = x[0], pack_at(D + (row + 1) * kPack) = x[1], pack_at(D + (row + 2) * kPack) = x[2];
}
template <SpatialKind kKind>
GRAPNEL_INLINE void store(double* D, int row, const SpatialVector<kKind, Pack>& x) {
  store(D, row, x.angular), store(D, row + 3, x.linear);
}
GRAPNEL_INLINE void store(double* D, int row, const PackInertia& I) {
  const Symmetric3<Pack>& J = I.rotational;
  pack_at(D + row * kPack) = I.mass;
  store(D, row + 1, I.first_moment), store(D, row + 4, Pack3{J.xx, J.yy, J.zz});
  store(D, row + 7, Pack3{J.xy, J.xz, J.yz});
}

// A link seen from the root of its tree.
struct LinkTerms {
  Rotationd R;               // of the link's frame
  Vector3d p;                // its origin
  Motion V, A;               // twist; acceleration, gravity counted as an acceleration of the root
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

}  // namespace derivatives

/// Steps of one evaluation, in the order of their declaration. Thread safety: one thread at a time.
class DerivativesWorkspace {
  using Motion = derivatives::Motion;
  using Load = derivatives::Load;
  using Block = derivatives::Block;
  using Range = derivatives::Range;
  using LinkTerms = derivatives::LinkTerms;
  using PackedNumbers = packed_rows::PackedNumbers;
  static constexpr int kPack = packed_rows::kPack;

 public:
  explicit DerivativesWorkspace(const Model& model);

  const Tree<double>& tree() const { return *tree_; }
  int size() const { return n_; }

  /// Outward and inward sweeps for given accelerations (empty: zero): everything that does not depend on others.
  void move(const Model& model, const State& state, const Forces& forces, std::span<const double> vdot);
  /// Rows of the mass matrix, and the forces at the given accelerations.
  void form_mass_matrix(std::span<const double> vdot, std::span<double> force);
  void read_mass_matrix(RowMatrix& to) const;

  /// The same for forward dynamics, and the accelerations vdot; all velocities have those afterwards.
  /// @throws std::invalid_argument if a size does not match the model; `function` is for the message.
  void accelerate_freely(const Model& model, const State& state, const Forces& forces, const PrescribedMotion& given,
                         const char* function, std::vector<double>& vdot);
  /// X <- M^-1 X, after accelerate_freely(), for rows of `stride` numbers, padded() to packs.
  void solve_rows(double* X, int stride, int columns) const { cholesky_.solve(X, stride, columns); }
  /// Adds accelerations to those of the links.
  void accelerate(std::span<const double> vdot);

  /// Derivatives of inverse dynamics with respect to q and v, at the present accelerations.
  void differentiate();
  double& by_q(int row, int column) { return rows_.data()[row * row_ + column]; }
  void read_inverse(RowMatrix& dq, RowMatrix& dv) const { read(0, 1, dq), read(1, 1, dv); }
  /// Replaces them by those of forward dynamics.
  void invert(std::span<const std::uint8_t> prescribed);
  void read_forward(RowMatrix& dq, RowMatrix& dv, RowMatrix& dtau) const {
    read(0, -1, dq), read(1, -1, dv), read(2, -1, dtau);
  }
  /// dtau J^T, J the Jacobian of the wrenches' points.
  void wrench_columns(const Model& model, const std::vector<ExternalWrench>& external, const RowMatrix& dtau,
                      RowMatrix& dwrench) const;
  void inertial_columns(const Model& model, RowMatrix& dphi) const;

  /// S, psi_dot, psi_ddot and psi_dot + S_dot of (28.3) and (28.4), by the number of their first row in lanes_.
  enum Direction { kS = 0, kPsi = 6, kPsi2 = 12, kT = 18 };
  GRAPNEL_INLINE Motion at(int row, int v) const {
    const double* from = lane(row, v);
    return {{from[0], from[kPack], from[2 * kPack]}, {from[3 * kPack], from[4 * kPack], from[5 * kPack]}};
  }
  const LinkTerms& link(int n) const { return links_[static_cast<std::size_t>(n)]; }
  /// Poses of the roots in W: of a link's tree.
  void locate_roots(std::span<const double> q);
  const Posed& root_of(int link) const {
    return roots_[static_cast<std::size_t>(root_of_[static_cast<std::size_t>(link)])];
  }

 private:
  // Further rows of lanes_. Of the link of each velocity: twist, acceleration, those of its parent, orientation,
  // origin; mass, first moment and rotational inertia in its own axes, and in the root's. From kTree on of its subtree:
  // inertia, load I A + V x* I V - F, K and l of 2 B = [K 0; -2 l x, 0] (28.6). Then factors of the products of each
  // velocity with others: P = I S and Q = (2 B)^T S in its row, loads in its columns of q and v; and a change of the
  // load.
  enum Row {
    kV = 24,
    kA = 30,
    kParentV = 36,
    kParentA = 42,
    kR = 48,
    kOrigin = 57,
    kBody = 60,
    kOwn = 70,
    kTree = 80,
    kLoad = 90,
    kK = 96,
    kL = 105,
    kP = 108,
    kQ = 114,
    kColumnQ = 117,
    kColumnV = 123,
    kChange = 129,
    kRows = 136
  };
  static constexpr int kSums = kP - kTree;
  // Eight velocities together: kRows packs for each eight.
  GRAPNEL_INLINE double* lane(int row, int v) { return lanes_.data() + (v / kPack * kRows + row) * kPack + v % kPack; }
  GRAPNEL_INLINE const double* lane(int row, int v) const {
    return lanes_.data() + (v / kPack * kRows + row) * kPack + v % kPack;
  }
  GRAPNEL_INLINE void put(int row, int v, const Vector3d& x) {
    double* to = lane(row, v);
    to[0] = x[0], to[kPack] = x[1], to[2 * kPack] = x[2];
  }
  GRAPNEL_INLINE void put(int row, int v, const Motion& X) { put(row, v, X.angular), put(row + 3, v, X.linear); }
  GRAPNEL_INLINE void increase(int row, int v, const Vector3d& x) {
    double* to = lane(row, v);
    to[0] += x[0], to[kPack] += x[1], to[2 * kPack] += x[2];
  }
  int pack_count() const { return (n_ + kPack - 1) / kPack; }
  // Replaces M by Pi M Pi + alpha (1 - Pi), and vectors x by Pi x: modal_chains.hpp.
  void project_modes(std::span<double> force);
  // Separates velocities with given accelerations from the others.
  void isolate(std::span<const std::uint8_t> prescribed);
  void read(int block, double factor, RowMatrix& to) const;
  void move_root(std::size_t n, const State& state, const Forces& forces, std::span<const double> vdot);
  void move_link(std::size_t n, std::span<const double> q, std::span<const double> v, std::span<const double> vdot);
  void put_link(std::size_t n);
  void require_loads();
  void carry_rotor(std::size_t n, double rate, double acceleration);
  void apply_external(const Model& model, const State& state, const std::vector<ExternalWrench>& external);
  void sum_subtrees(int row, int count);
  void form_factors();
  void project(const Block& block, const double* factors, double* row);
  void fill(std::size_t n, int i);
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
  PackedNumbers lanes_;                     // for each eight velocities, kRows packs
  PackedNumbers M_;                         // rows of the lower triangle
  PackedNumbers rows_;                      // n x row_: [d/dq, d/dv, -1]
  PackedNumbers lines_;                     // of one velocity: its row of v, its columns of q and v
  PackedNumbers required_;                  // per velocity: S . f
  std::vector<double> force_, start_;
  std::vector<Pose<double>> roots_;  // X_WB of the root of each link's tree, at its root
  bool has_external_ = false;
  packed_rows::RowCholesky cholesky_;
};

namespace derivatives {

/// @throws std::invalid_argument unless sizes match the model.
void check_size(const Model& model, const State& state, const DerivativesWorkspace& workspace, const char* function);
void check_size(const Model& model, std::size_t size, const char* function, const char* what);

}  // namespace derivatives
}  // namespace grapnel
