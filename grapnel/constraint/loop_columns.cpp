#include "grapnel/constraint/loop_columns.hpp"

#include <algorithm>
#include <cmath>

#include "grapnel/dynamics/recursion.hpp"
#include "grapnel/dynamics/symmetric_solve.hpp"

namespace grapnel {
namespace {

using namespace recursion;
using Pack = ClosureRow::Pack;

// Wrenches of all rows of one closure at one link, about its origin in its frame: [moment; force] by component.
struct Bundle {
  Pack f[6];
};

GRAPNEL_INLINE void turn(Bundle& b, int i, int j, double sine, double cosine) {
  const Pack x = b.f[i], y = b.f[j];
  b.f[i] = cosine * x - sine * y;
  b.f[j] = sine * x + cosine * y;
}

GRAPNEL_INLINE void rotate_all(Bundle& b, const Rotationd& R) {
  for (int first : {0, 3}) {
    const Pack x = b.f[first], y = b.f[first + 1], z = b.f[first + 2];
    for (int k = 0; k < 3; ++k) b.f[first + k] = R.m[k][0] * x + R.m[k][1] * y + R.m[k][2] * z;
  }
}

GRAPNEL_INLINE void shift_to(Bundle& b, const Vector3d& p) {
  const Pack x = b.f[3], y = b.f[4], z = b.f[5];
  b.f[0] += p[1] * z - p[2] * y;
  b.f[1] += p[2] * x - p[0] * z;
  b.f[2] += p[0] * y - p[1] * x;
}

// Transforms `unit` from frame C to the link's frame; the opposite acts on body b.
GRAPNEL_INLINE Bundle unit_wrenches(const ClosureRow (&unit)[6], const Posed& X_LC, double sign) {
  Bundle b;
  for (int k = 0; k < 6; ++k) b.f[k] = sign * unit[k].r;
  rotate_all(b, X_LC.R);
  shift_to(b, X_LC.p);
  return b;
}

// F.A of all rows.
GRAPNEL_INLINE void dot_all(const Bundle& b, const SpatialAccelerationd& A, Pack& sum) {
  for (int k = 0; k < 3; ++k) sum += A.angular[k] * b.f[k] + A.linear[k] * b.f[3 + k];
}

template <OneAxis Joint>
GRAPNEL_INLINE void rotate_behind(Joint, const LinkScratch<double>& w, Bundle& b) {
  if constexpr (Joint::kTurns) {
    constexpr int i = (Joint::kAxis + 1) % 3, j = (Joint::kAxis + 2) % 3;
    turn(b, i, j, w.angle.sine, w.angle.cosine);
    turn(b, 3 + i, 3 + j, w.angle.sine, w.angle.cosine);
  }
}

// A joint through which wrenches pass, its efforts, and its columns of Y.
struct JointColumns {
  const TreeLink<double>& link;
  const LinkScratch<double>& w;
  std::span<const double> force;  // of all joints
  bool rigid;                     // its acceleration is prescribed
  double effort;                  // on the joint itself, along the coordinate axis, in the first row
  ClosureRow* y;                  // L^-1 K, one row per degree of freedom
  ClosureRow* raw;                // K
  double& inverse_root;           // 1 / L
  Pack& free;                     // contribution of the link's own motion to F.A, zero before
};

// Through a joint with one degree of freedom: F - G K is passed on.
template <OneAxis Joint>
GRAPNEL_INLINE void pass(Joint joint, const JointColumns& at, Bundle& b) {
  const auto& [link, w, unused, rigid, effort, y, raw, inverse_root, free] = at;
  Pack K = b.f[Joint::kTurns ? Joint::kAxis : 3 + Joint::kAxis];
  K[0] += effort;
  if (rigid) {
    raw->r = K;
    y->r = Pack{};
  } else {
    inverse_root = 1 / std::sqrt(joint_inertia(joint, link, w));
    y->r = inverse_root * K;
    free = w.g * K;
    for (int k = 0; k < 3; ++k) b.f[k] -= w.G.angular[k] * K, b.f[3 + k] -= w.G.linear[k] * K;
  }
  dot_all(b, w.bias, free);
  rotate_behind(joint, w, b);
}

// Through a spherical joint, which transmits no moment: with J = L L^T, Y = L^-1 K, and H^T J^-1 K is subtracted from
// the force. The joint's own acceleration is J^-1 (torque - (I A' + p).angular).
GRAPNEL_INLINE void pass(Spherical, const JointColumns& at, Bundle& b) {
  const auto& [link, w, force, rigid, none, y, raw, unused, free] = at;
  for (int k = 0; k < 3; ++k) raw[k].r = b.f[k];
  if (rigid) {
    for (int k = 0; k < 3; ++k) y[k].r = Pack{};
  } else {
    const Symmetric3d& J = w.I.J;
    const double l00 = std::sqrt(J.xx), l10 = J.xy / l00, l20 = J.xz / l00, l11 = std::sqrt(J.yy - l10 * l10);
    const double l21 = (J.yz - l20 * l10) / l11, l22 = std::sqrt(J.zz - l20 * l20 - l21 * l21);
    y[0].r = raw[0].r / l00;
    y[1].r = (raw[1].r - l10 * y[0].r) / l11;
    y[2].r = (raw[2].r - l20 * y[0].r - l21 * y[1].r) / l22;
    const Pack x2 = y[2].r / l22, x1 = (y[1].r - l21 * x2) / l11, x0 = (y[0].r - l10 * x1 - l20 * x2) / l00;
    const Vector3d torque{force[link.v], force[link.v + 1], force[link.v + 2]};
    const Vector3d u = torque - w.p.angular;
    free = u[0] * x0 + u[1] * x1 + u[2] * x2;
    for (int k = 0; k < 3; ++k) {
      b.f[k] = Pack{};
      b.f[3 + k] -= w.I.H[0][k] * x0 + w.I.H[1][k] * x1 + w.I.H[2][k] * x2;
    }
  }
  dot_all(b, w.bias, free);
  rotate_all(b, w.R_FL);
}

// Through a modal joint: the work of the wrenches on the modes is summed in `shares`. At the innermost joint of the
// chain F - G Y is passed on, Y = L^-1 shares, and the modes' own acceleration -L^-T (y + G^T A') adds -Y y to F.A.
template <OneAxis Joint>
GRAPNEL_INLINE void pass_modal(Joint joint, const JointColumns& at, const ModalChain& chain, const ChainScratch& c,
                               std::span<ClosureRow> shares, Bundle& b) {
  const auto& [link, w, force, rigid, none, y, raw, inverse_root, free] = at;
  const auto m = static_cast<std::size_t>(chain.modes);
  const Pack K = link.sign * b.f[Joint::kTurns ? Joint::kAxis : 3 + Joint::kAxis];
  const double* shape = chain.row(link.member);
  for (std::size_t i = 0; i < m; ++i) shares[i].r += shape[i] * K;
  dot_all(b, w.bias, free);
  if (link.member == 0) {
    for (std::size_t i = 0; i < m; ++i) {
      Pack x = shares[i].r;
      for (std::size_t k = 0; k < i; ++k) x -= c.D[i * m + k] * y[k].r;
      y[i].r = x / c.D[i * m + i];
      shares[i].r = Pack{};
      free -= c.y[i] * y[i].r;
      for (int k = 0; k < 3; ++k) b.f[k] -= c.U[i].angular[k] * y[i].r, b.f[3 + k] -= c.U[i].linear[k] * y[i].r;
    }
  }
  rotate_behind(joint, w, b);
}

// Adds products of two closures' rows: block(r, :) += a(r) b.
GRAPNEL_INLINE void add_product(const ClosureRow& a, const ClosureRow& b, Pack (&block)[6]) {
  for (int r = 0; r < 6; ++r) block[r] += a.r[r] * b.r;
}

double weighted(const ClosureRow& row, const double (&rows)[8]) {
  double sum = row.r[0] * rows[0];
  for (int c = 1; c < 8; ++c) sum += row.r[c] * rows[c];
  return sum;
}

}  // namespace

// Tree, closure paths and couplings => storage for all unit wrenches and efforts; finds common links of rows and the
// roots with loops.
LoopColumns::LoopColumns(const Tree<double>& tree, std::span<const LoopPath> paths,
                         std::span<const CouplingPath> couplings)
    : tree_(tree),
      sums_(paths.size() + couplings.size()),
      closures_(paths.size()),
      inverse_root_(tree.links.size()),
      root_factor_of_(tree.links.size(), -1) {
  int slot = 0;
  for (const LoopPath& path : paths) add_closure(path, slot);
  for (const CouplingPath& coupling : couplings) add_coupling(coupling, slot);
  for (std::vector<CoupledJoint>& coupling : coupled_) {
    for (CoupledJoint& joint : coupling) {
      for (Step& step : joint.chain) step.slot = slot, slot += slots_of(step.link);
    }
  }
  for (const Step& step : steps_) {
    const TreeLink<double>& root = tree.links[step.link];
    if (root.parent >= 0 || root.joint != JointType::free || root_factor_of_[step.link] >= 0) continue;
    root_factor_of_[step.link] = static_cast<int>(roots_.size());
    roots_.push_back(step.link);
  }
  root_factor_.resize(roots_.size());
  y_.resize(slot), raw_.resize(slot);
  std::size_t modes = 0;
  for (const ModalChain& chain : tree.chains) modes = std::max(modes, static_cast<std::size_t>(chain.modes));
  shares_.resize(modes), shares_of_b_.resize(modes);
  find_pairs();
}

void LoopColumns::add_closure(const LoopPath& path, int& slot) {
  const auto add = [&](int link) {
    steps_.push_back({link, slot});
    slot += slots_of(link);
  };
  LinkSequence sequence{};
  sequence.first_step = static_cast<int>(steps_.size()), sequence.first_slot = slot;
  sequence.first_row = path.first_row, sequence.rows = path.rows;
  for (int r = 0; r < path.angular_count; ++r) {
    for (int k = 0; k < 3; ++k) sequence.unit[k].r[r] = path.angular_rows[r][k];
  }
  for (int k = 0; k < path.linear_count(); ++k) sequence.unit[3 + k].r[path.angular_count + k] = 1;
  for (int link : path.from_a) add(link);
  sequence.end_a = static_cast<int>(steps_.size());
  for (int link : path.from_b) add(link);
  sequence.end_b = static_cast<int>(steps_.size());
  for (int link : path.trunk) {
    if (tree_.links[link].parent >= 0) add(link);
  }
  sequence.first_root = static_cast<int>(steps_.size());
  add(path.root_a);
  if (!path.one_tree()) add(path.root_b);
  sequence.end = static_cast<int>(steps_.size());
  sequence.end_slot = slot;
  sequences_.push_back(sequence);
}

// The links from all joints of a coupling to their roots, each once.
void LoopColumns::add_coupling(const CouplingPath& coupling, int& slot) {
  LinkSequence sequence{};
  sequence.first_step = static_cast<int>(steps_.size()), sequence.first_slot = slot;
  sequence.first_row = coupling.row, sequence.rows = 1;
  std::vector<CoupledJoint>& joints = coupled_.emplace_back();
  for (const CouplingPath::Joint& joint : coupling.joints) {
    CoupledJoint& coupled = joints.emplace_back(CoupledJoint{joint.factor, {}, {}});
    for (int link = joint.link; link >= 0; link = tree_.links[link].parent) {
      const auto known = std::find_if(steps_.begin() + sequence.first_step, steps_.end(),
                                      [&](const Step& step) { return step.link == link; });
      coupled.slots.push_back(known == steps_.end() ? slot : known->slot);
      coupled.chain.push_back({link, 0});  // its slots follow those of all sequences
      if (known != steps_.end()) continue;
      steps_.push_back({link, slot});
      slot += slots_of(link);
    }
  }
  sequence.end_a = sequence.end_b = sequence.first_root = sequence.end = static_cast<int>(steps_.size());
  sequence.end_slot = slot;
  sequences_.push_back(sequence);
}

void LoopColumns::find_pairs() {
  for (std::size_t k = 0; k < sequences_.size(); ++k) {
    for (std::size_t l = 0; l < k; ++l) {
      Pair pair{static_cast<int>(k), static_cast<int>(l), {}};
      for (int s = sequences_[k].first_step; s < sequences_[k].end; ++s) {
        for (int t = sequences_[l].first_step; t < sequences_[l].end; ++t) {
          if (steps_[s].link != steps_[t].link) continue;
          for (int i = 0; i < slots_of(steps_[s].link); ++i) {
            pair.slots.push_back({steps_[s].slot + i, steps_[t].slot + i});
          }
        }
      }
      if (!pair.slots.empty()) pairs_.push_back(std::move(pair));
    }
  }
}

// Number of slots: six for a root, one per degree of freedom of a joint. The innermost joint of a chain has those of
// the chain's modes; the others have one for the case that they are prescribed.
int LoopColumns::slots_of(int link) const {
  const TreeLink<double>& l = tree_.links[link];
  if (l.parent < 0) return 6;
  return l.chain >= 0 && l.member == 0 ? tree_.chains[l.chain].modes : velocity_count(l.joint);
}

// Factors I = L D L^T of a free root's articulated inertia.
void LoopColumns::factor_root(int link, const LinkScratch<double>& w, const DynamicsInput<double>& in) {
  RootFactor& root = root_factor_[root_factor_of_[link]];
  const ArticulatedInertia<double>& I = w.I;
  double A[6][6];  // below the diagonal: the remaining Schur complement of I
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) {
      A[r][c] = I.J(r, c), A[3 + r][3 + c] = I.M(r, c);
      A[3 + c][r] = I.H[r][c];
    }
  }
  const int v = tree_.links[link].v;
  for (int k = 0; k < 3; ++k) {
    root.y[k] = in.force[v + k] - w.p.angular[k], root.y[3 + k] = in.force[v + 3 + k] - w.p.linear[k];
  }
  for (int j = 0; j < 6; ++j) {
    root.inverse[j] = 1 / A[j][j];
    root.inverse_root[j] = std::sqrt(root.inverse[j]);
    for (int i = j + 1; i < 6; ++i) root.L[i][j] = A[i][j] * root.inverse[j];
    for (int i = j + 1; i < 6; ++i) {
      for (int k = j + 1; k <= i; ++k) A[i][k] -= root.L[i][j] * A[k][j];
      root.y[i] -= root.L[i][j] * root.y[j];
    }
  }
}

// Articulated inertias in the workspace => columns Y of (8.7) and free relative accelerations, by carrying the unit
// wrenches of each closure from both sides to the root, and the unit efforts of each coupling from its joints.
void LoopColumns::carry(std::span<const LoopPath> paths, std::span<const LoopPlace> places,
                        const DynamicsWorkspace<double>& workspace, const DynamicsInput<double>& in) {
  for (int root : roots_) {
    if (!is_prescribed(in.prescribed, root)) factor_root(root, workspace.links[root], in);
  }
  for (std::size_t k = 0; k < sequences_.size(); ++k) {
    Climb sums{workspace, in};
    if (k < paths.size()) {
      carry_closure(k, paths[k], places[k], sums);
    } else {
      carry_coupling(k, sums);
    }
    sums_[k].acceleration.r = sums.sum;
    sums_[k].squares.r = sums.squares;
  }
}

// Carries wrenches from link to link; `effort` acts on the first joint, in the first row.
template <class Bundle>
void LoopColumns::climb(Bundle& b, std::span<const Step> steps, std::span<ClosureRow> shares, double effort,
                        Climb& sums) {
  const DynamicsWorkspace<double>& workspace = sums.workspace;
  const DynamicsInput<double>& in = sums.in;
  for (const Step& step : steps) {
    const int n = step.link, slot = step.slot;
    const TreeLink<double>& link = tree_.links[n];
    const LinkScratch<double>& w = workspace.links[n];
    const bool rigid = is_prescribed(in.prescribed, n);
    Pack free{};
    if (rigid && effort != 0) free[0] = effort * link.sign * in.acceleration[link.v];
    const JointColumns at{link, w, in.force, rigid, effort, &y_[slot], &raw_[slot], inverse_root_[n], free};
    effort = 0;
    visit_joint(link, [&](auto joint) {
      if constexpr (OneAxis<decltype(joint)>) {
        if (link.chain >= 0 && !rigid) {
          for (int i = 0; i < slots_of(n); ++i) y_[slot + i].r = Pack{};
          pass_modal(joint, at, tree_.chains[link.chain], workspace.chains[link.chain], shares, b);
          return;
        }
      }
      if constexpr (!kIsRoot<decltype(joint)>) pass(joint, at, b);
    });
    sums.sum += free;
    sums.squares += free * free;
    if (link.rotated) rotate_all(b, link.X_PF.R);
    shift_to(b, w.p_PL);
  }
}

void LoopColumns::carry_closure(std::size_t k, const LoopPath& path, const LoopPlace& place, Climb& sums) {
  const LinkSequence& sequence = sequences_[k];
  Bundle b = unit_wrenches(sequence.unit, path.X_aC, 1);
  climb(b, steps(sequence.first_step, sequence.end_a), shares_, 0, sums);
  Bundle other = unit_wrenches(sequence.unit, place.X_bC, -1);
  climb(other, steps(sequence.end_a, sequence.end_b), shares_of_b_, 0, sums);
  if (sequence.end - sequence.first_root == 1) {
    for (int i = 0; i < 6; ++i) b.f[i] += other.f[i];
    // If the common ancestor is a link of a chain, the sums over its modes are combined.
    for (std::size_t i = 0; i < shares_.size(); ++i) shares_[i].r += shares_of_b_[i].r, shares_of_b_[i].r = Pack{};
    climb(b, steps(sequence.end_b, sequence.first_root), shares_, 0, sums);
  } else {
    Pack at_root_b;
    arrive(steps_[sequence.first_root + 1], other.f, sums.in, at_root_b);
    sums.sum += at_root_b;
    sums.squares += at_root_b * at_root_b;
  }
  Pack at_root;
  arrive(steps_[sequence.first_root], b.f, sums.in, at_root);
  sums.sum += at_root;
  sums.squares += at_root * at_root;
}

// Unit efforts => columns, joint by joint, since they are linear in the efforts.                            (8.14)
void LoopColumns::carry_coupling(std::size_t k, Climb& sums) {
  const LinkSequence& sequence = sequences_[k];
  for (int slot = sequence.first_slot; slot < sequence.end_slot; ++slot) y_[slot].r = raw_[slot].r = Pack{};
  for (const CoupledJoint& joint : coupled_[k - closures_]) {
    Bundle b{};
    const std::span<const Step> chain = joint.chain;
    const double sign = tree_.links[chain.front().link].sign;
    climb(b, chain.first(chain.size() - 1), shares_, sign * joint.factor, sums);
    Pack at_root;
    arrive(chain.back(), b.f, sums.in, at_root);
    sums.sum += at_root;
    sums.squares += at_root * at_root;
    for (std::size_t i = 0; i < chain.size(); ++i) {
      for (int s = 0; s < slots_of(chain[i].link); ++s) {
        y_[joint.slots[i] + s].r += y_[chain[i].slot + s].r;
        raw_[joint.slots[i] + s].r += raw_[chain[i].slot + s].r;
      }
    }
  }
}

// At the root: a free root accelerates by I A = F.
void LoopColumns::arrive(const Step& step, const Pack (&F)[6], const DynamicsInput<double>& in, Pack& free) {
  const auto [n, slot] = step;
  const TreeLink<double>& link = tree_.links[n];
  for (int i = 0; i < 6; ++i) raw_[slot + i].r = F[i];
  free = Pack{};
  if (link.joint == JointType::free && !is_prescribed(in.prescribed, n)) {
    const RootFactor& root = root_factor_[root_factor_of_[n]];
    Pack x[6];  // L^-1 F
    for (int i = 0; i < 6; ++i) {
      x[i] = F[i];
      for (int j = 0; j < i; ++j) x[i] -= root.L[i][j] * x[j];
      y_[slot + i].r = root.inverse_root[i] * x[i];
      free += root.inverse[i] * root.y[i] * x[i];
    }
    return;
  }
  for (int i = 0; i < 6; ++i) y_[slot + i].r = Pack{};
  const Vector3d g = gravity_in_root(link, in.q, in.gravity);
  SpatialAccelerationd A{Vector3d::zero(), -g};
  if (link.joint == JointType::free) {
    for (int k = 0; k < 3; ++k)
      A.angular[k] += in.acceleration[link.v + k], A.linear[k] += in.acceleration[link.v + 3 + k];
  }
  for (int k = 0; k < 3; ++k) free += A.angular[k] * F[k] + A.linear[k] * F[3 + k];
}

// Columns Y => W = Y^T Y (8.7), rows x rows; only common links of two closures contribute.
void LoopColumns::contact_inertia(std::span<double> W) const {
  const int size = sequences_.empty() ? 0 : sequences_.back().first_row + sequences_.back().rows;
  if (sequences_.size() > 1) std::fill(W.begin(), W.end(), 0.0);
  const auto put = [&](const LinkSequence& k, const LinkSequence& l, const Pack(&block)[6]) {
    for (int r = 0; r < k.rows; ++r) {
      for (int c = 0; c < l.rows; ++c) {
        W[(k.first_row + r) * size + l.first_row + c] = block[r][c];
      }
    }
  };
  for (const LinkSequence& sequence : sequences_) {
    Pack block[6] = {};
    for (int s = sequence.first_slot; s < sequence.end_slot; ++s) add_product(y_[s], y_[s], block);
    put(sequence, sequence, block);
  }
  for (const Pair& pair : pairs_) {
    Pack block[6] = {};
    for (const auto& [s, t] : pair.slots) add_product(y_[s], y_[t], block);
    const LinkSequence &k = sequences_[pair.closure_k], &l = sequences_[pair.closure_l];
    put(k, l, block);
    for (int r = 0; r < k.rows; ++r) {
      for (int c = 0; c < l.rows; ++c) {
        W[(l.first_row + c) * size + k.first_row + r] = block[r][c];
      }
    }
  }
}

// Row values => changes of bias terms g, y and p in the workspace, so that the third sweep includes these wrenches or
// impulses.
void LoopColumns::impose(std::span<const double> rows, std::span<const std::uint8_t> prescribed,
                         DynamicsWorkspace<double>& workspace) const {
  const std::span<LinkScratch<double>> links = workspace.links;
  for (const LinkSequence& sequence : sequences_) {
    double x[8] = {};
    std::copy_n(rows.begin() + sequence.first_row, sequence.rows, x);
    for (int s = sequence.first_step; s < sequence.end; ++s) {
      const auto [n, slot] = steps_[s];
      const TreeLink<double>& link = tree_.links[n];
      LinkScratch<double>& w = links[n];
      if (link.parent < 0) {
        for (int k = 0; k < 3; ++k) {
          w.p.angular[k] -= weighted(raw_[slot + k], x);
          w.p.linear[k] -= weighted(raw_[slot + 3 + k], x);
        }
      } else if (!has_one_axis(link.joint)) {
        for (int k = 0; k < 3; ++k) w.p.angular[k] -= weighted(raw_[slot + k], x);
      } else if (is_prescribed(prescribed, n)) {
        (turns_about_axis(link.joint) ? w.p.angular : w.p.linear)[link.axis] -= weighted(raw_[slot], x);
      } else if (link.chain >= 0) {
        if (link.member > 0) continue;
        ChainScratch& c = workspace.chains[link.chain];
        for (std::size_t i = 0; i < c.y.size(); ++i) c.y[i] -= weighted(y_[slot + static_cast<int>(i)], x);
      } else {
        w.g += inverse_root_[n] * weighted(y_[slot], x);
      }
    }
  }
}

void LoopColumns::release(DynamicsWorkspace<double>& workspace) const {
  for (const Step& step : steps_) {
    workspace.links[step.link].g = 0, workspace.links[step.link].p = Wrenchd::zero();
    if (const int chain = tree_.links[step.link].chain; chain >= 0) {
      for (double& y : workspace.chains[chain].y) y = 0;
    }
  }
}

}  // namespace grapnel
