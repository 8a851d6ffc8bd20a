#pragma once

/// @file
/// Closed loops in packs: accelerations with the closures' multipliers, and the projection that keeps loops closed,
/// section 8 of docs/theory.md. What constraint/constrained_dynamics.hpp is to one case, by the same equations; a text
/// of its own, since there the rows of a closure are the numbers of one vector, and here cases are.
///
/// Ways and rows are those of all lanes, pivots and ranks each lane's (lane_pivots.hpp). A case whose rank is in doubt,
/// or whose loops cannot be closed, leaves the lanes (LaneStatus::loops_in_doubt): rounding, which is not the same
/// here as there, would decide, or there is a failure whose cause only a run alone can say.

#include "grapnel/constraint/loop_limits.hpp"
#include "grapnel/dynamics/articulated_body_kernel.hpp"
#include "grapnel/lanes/lane_closure.hpp"
#include "grapnel/lanes/lane_pivots.hpp"

namespace grapnel::lanes {

/// What a projection did.
template <class S>
struct LaneProjection {
  LaneDefect<S> before = LaneDefect<S>::none();  // largest over the closures
  unsigned changed = 0;                          // lanes in which anything was moved
  unsigned failed = 0;                           // lanes whose loops are not closed
};

template <class S>
class LaneLoops {
 public:
  using Mask = typename S::Mask;

  /// `tree`: what is integrated; lay_out() comes when it is complete.
  LaneLoops(const PhaseTables& tables, const Tree<S>& tree);
  /// `place`: of a link of the tables in the tree.
  void lay_out(const LaneArray<S, int>& place);

  bool any() const { return tables_.loop_count > 0; }
  /// Takes a case's numbers into a lane.
  void load_case(int lane, const double* numbers) {
    for (int k = 0; k < tables_.loop_count; ++k) closures_[k].load(lane, numbers + k * kLoopNumbers);
  }
  const LaneClosure<S>& closure(int k) const { return closures_[k]; }

  /// As articulated_body(), with the closures' multipliers acting: (8.6).
  void accelerate(const DynamicsInput<S>& in, DynamicsWorkspace<S>& workspace, std::span<S> vdot, std::span<S> force);
  /// Lanes in which no motion keeps the closures of the last accelerate().
  const Mask& contradicted() const { return contradicted_; }
  /// Independent rows of the last one.
  const S& rank() const { return pivots_.rank(); }
  /// Lanes in which a rank has been in doubt since the last call.
  unsigned take_doubts() {
    const unsigned doubts = doubts_;
    doubts_ = 0;
    return doubts;
  }

  /// In these lanes, brings coordinates, then velocities onto the closures in the mass metric: (8.9), (8.10). Defects
  /// that are all up to `negligible` are left as they are. Prescribed velocities do not change.
  LaneProjection<S> project(const Mask& lanes, std::span<const std::uint8_t> prescribed,
                            DynamicsWorkspace<S>& workspace, std::span<S> q, std::span<S> v, double negligible);

 private:
  static constexpr int kMostRows = 6;
  // A projection goes on while more than this is left [m, rad, and these per second].
  static constexpr double kRounding = 3e-15;

  // A link on a closure's way, and where the closure's rows there begin: kMostRows numbers for every velocity.
  struct Step {
    int link, slot;
  };
  // In steps_: from a, from b, from where they meet, and the root.
  struct Way {
    int link_a, link_b;
    int first, end_a, end_b, root;
    int rows, first_row;
    int same_root;  // the first closure that has this root
  };
  struct SlotPair {
    int of_k, of_l;
  };
  // Closures that have links in common.
  struct Pair {
    int k, l;
    int first, end;  // in shared_
  };
  // L D L^T of a root's articulated inertia, and L^-1 (F - p).
  struct RootFactor {
    S L[6][6];
    S inverse[6];
    S y[6];
  };
  // How much room all ways to roots take.
  struct Room {
    int rows = 0, steps = 0, slots = 0;
    explicit Room(const PhaseTables& tables) {
      for (int k = 0; k < tables.loop_count; ++k) {
        rows += tables.loops[k].rows();
        count(tables, tables.loops[k].link_a), count(tables, tables.loops[k].link_b);
      }
    }
    void count(const PhaseTables& tables, int link) {
      for (int l = link; l >= 0; l = tables.links[l].parent) {
        ++steps;
        slots += tables.links[l].parent < 0 ? 6 : velocity_count(tables.links[l].joint);
      }
    }
  };
  using Links = std::vector<LinkScratch<S>>;

  int slots_of(const TreeLink<S>& link) const { return link.parent < 0 ? 6 : velocity_count(link.joint); }
  const TreeLink<S>& link_of(int n) const { return tree_.links[static_cast<std::size_t>(n)]; }
  static bool is_prescribed(std::span<const std::uint8_t> prescribed, const TreeLink<S>& link) {
    return !prescribed.empty() && prescribed[static_cast<std::size_t>(link.v)] != 0;
  }
  S* rows_at(LaneArray<S>& all, int slot) { return all.data() + slot * kMostRows; }
  const S* rows_at(const LaneArray<S>& all, int slot) const { return all.data() + slot * kMostRows; }

  void lay_out_pairs();
  template <class F>
  void for_shared_slots(F&& found) const;

  void locate_all(const Links& links);
  Pose<S> pose_along(int first, int end, const Links& links) const;
  template <bool kMoving>
  void prepare(const DynamicsInput<S>& in, const Links& links);
  template <bool kMoving>
  void carry(int k, const DynamicsInput<S>& in, const Links& links);
  void begin_bundle(int k, const Pose<S>& X_LC, bool opposite);
  template <bool kMoving>
  void climb(int first, int end, int rows, const DynamicsInput<S>& in, const Links& links);
  template <bool kMoving, recursion::OneAxis Joint>
  void pass(Joint joint, const TreeLink<S>& link, const LinkScratch<S>& w, bool rigid, int rows, S* K, S* z);
  template <bool kMoving>
  void pass(recursion::Spherical joint, const TreeLink<S>& link, std::span<const S> force, const LinkScratch<S>& w,
            int rows, S* K, S* z);
  void go_on(const TreeLink<S>& link, const LinkScratch<S>& w, int rows);
  void factor_root(RootFactor& root, const TreeLink<S>& link, const LinkScratch<S>& w, const DynamicsInput<S>& in);
  template <bool kMoving>
  void arrive(int k);
  void weigh();

  void take_rows(int k, const Vector3<S>& angular, const Vector3<S>& linear, S* rows) const;
  Twist<S> at_C(int k, const LinkScratch<S>& a) const;
  Twist<S> at_D(int k, const LinkScratch<S>& b) const;
  S acceleration_rows(const Links& links, S* u);
  S acceleration_size(const Links& links) const;
  S velocity_rows(const Links& links, S* u);
  void place_rows(S* e) const;
  LaneDefect<S> defects(const Links& links);
  S scaled_size(const S* u) const;

  void solve(const S* u);
  void impose(std::span<const std::uint8_t> prescribed, Links& links) const;
  void release(Links& links) const;
  DynamicsInput<S> at_rest(std::span<const S> q, std::span<const std::uint8_t> prescribed) const;
  void respond(const DynamicsInput<S>& rest, DynamicsWorkspace<S>& workspace);
  void move_all(std::span<const S> q, std::span<const S> v, Links& links);
  void step_coordinates(S* q) const;
  void close_places(Mask active, const DynamicsInput<S>& rest, DynamicsWorkspace<S>& workspace, std::span<S> q,
                    std::span<S> v, LaneProjection<S>& result);
  void close_motion(Mask active, const DynamicsInput<S>& rest, DynamicsWorkspace<S>& workspace, std::span<S> q,
                    std::span<S> v, LaneProjection<S>& result);

  const PhaseTables& tables_;
  const Tree<S>& tree_;
  LaneArray<S, LaneClosure<S>> closures_;
  LaneArray<S, Pose<S>> place_;  // of C in link b, per closure
  LaneArray<S, Way> ways_;
  const Room room_;
  int row_count_ = 0, step_count_ = 0, slot_count_ = 0, pair_count_ = 0, shared_count_ = 0;
  LaneArray<S, Step> steps_;
  LaneArray<S, Pair> pairs_;
  LaneArray<S, SlotPair> shared_;
  LaneArray<S> K_;            // S^T F of the closure's unit wrenches at its links, L^-1 F at roots
  LaneArray<S> z_;            // D^-1 of that; zero where prescribed
  LaneArray<S> root_wrench_;  // F at roots: six components per closure
  LaneArray<S, RootFactor> root_factor_;
  S bundle_[kMostRows][6];  // unit wrenches on their way: [moment; force]
  S acceleration_[kMostRows], squares_[kMostRows];
  LaneArray<S> sums_, square_sums_;  // per row: the relative acceleration without multipliers, less V_C x V_D
  LanePivots<S> pivots_;
  LaneArray<S> scale_, u_, rhs_, residual_, solution_, rows_;  // per row
  LaneArray<S> zero_, step_, ignored_, trial_q_;
  LaneArray<S> last_v_;
  Mask contradicted_ = Mask::from_bits(0);
  unsigned doubts_ = 0;
};

// --- The ways, which all lanes have. --------------------------------------------------------------------------------

template <class S>
LaneLoops<S>::LaneLoops(const PhaseTables& tables, const Tree<S>& tree)
    : tables_(tables),
      tree_(tree),
      closures_(tables.loop_count),
      place_(tables.loop_count),
      ways_(tables.loop_count),
      room_(tables),
      row_count_(room_.rows),
      steps_(room_.steps),
      pairs_(tables.loop_count * tables.loop_count),
      shared_(tables.loop_count * room_.slots),
      K_(room_.slots * kMostRows),
      z_(room_.slots * kMostRows),
      root_wrench_(tables.loop_count * 6 * kMostRows),
      root_factor_(tables.loop_count),
      sums_(row_count_),
      square_sums_(row_count_),
      pivots_(row_count_),
      scale_(row_count_),
      u_(row_count_),
      rhs_(row_count_),
      residual_(row_count_),
      solution_(row_count_),
      rows_(row_count_),
      zero_(any() ? tables.velocities : 0),
      step_(any() ? tables.velocities : 0),
      ignored_(any() ? tables.velocities : 0),
      trial_q_(any() ? tables.coordinates : 0),
      last_v_(any() ? tables.velocities : 0) {}

template <class S>
void LaneLoops<S>::lay_out(const LaneArray<S, int>& place) {
  int row = 0;
  for (int k = 0; k < tables_.loop_count; ++k) {
    const LoopTable& table = tables_.loops[k];
    Way& way = ways_[k];
    way.link_a = place[table.link_a], way.link_b = place[table.link_b];
    way.rows = table.rows(), way.first_row = row;
    row += way.rows;
    const auto depth = [&](int link) {
      int d = 0;
      for (int l = link; l >= 0; l = link_of(l).parent) ++d;
      return d;
    };
    // Where the ways from both sides meet.
    int a = way.link_a, b = way.link_b;
    while (depth(a) > depth(b)) a = link_of(a).parent;
    while (depth(b) > depth(a)) b = link_of(b).parent;
    while (a != b) a = link_of(a).parent, b = link_of(b).parent;
    const auto add = [&](int link) {
      steps_[step_count_++] = {link, slot_count_};
      slot_count_ += slots_of(link_of(link));
    };
    way.first = step_count_;
    for (int l = way.link_a; l != a; l = link_of(l).parent) add(l);
    way.end_a = step_count_;
    for (int l = way.link_b; l != a; l = link_of(l).parent) add(l);
    way.end_b = step_count_;
    for (int l = a; l >= 0; l = link_of(l).parent) add(l);
    way.root = step_count_ - 1;
    way.same_root = k;
    for (int l = k; l-- > 0;) {
      if (steps_[ways_[l].root].link == steps_[way.root].link) way.same_root = l;
    }
  }
  lay_out_pairs();
}

// Slots that closures k > l have in common: found(k, l, slot of k, slot of l).
template <class S>
template <class F>
void LaneLoops<S>::for_shared_slots(F&& found) const {
  for (int k = 0; k < tables_.loop_count; ++k) {
    for (int l = 0; l < k; ++l) {
      for (int s = ways_[k].first; s <= ways_[k].root; ++s) {
        for (int t = ways_[l].first; t <= ways_[l].root; ++t) {
          if (steps_[s].link != steps_[t].link) continue;
          for (int i = 0; i < slots_of(link_of(steps_[s].link)); ++i)
            found(k, l, steps_[s].slot + i, steps_[t].slot + i);
        }
      }
    }
  }
}

template <class S>
void LaneLoops<S>::lay_out_pairs() {
  for_shared_slots([&](int k, int l, int of_k, int of_l) {
    if (pair_count_ == 0 || pairs_[pair_count_ - 1].k != k || pairs_[pair_count_ - 1].l != l)
      pairs_[pair_count_++] = {k, l, shared_count_, shared_count_};
    shared_[shared_count_++] = {of_k, of_l};
    pairs_[pair_count_ - 1].end = shared_count_;
  });
}

// --- W and the relative acceleration: unit wrenches carried to the root, (8.7). --------------------------------------

// The pose of the end of a way's part in the frame where it begins.
template <class S>
Pose<S> LaneLoops<S>::pose_along(int first, int end, const Links& links) const {
  using namespace recursion;
  Pose<S> X = Pose<S>::identity();
  for (int s = end; s-- > first;) {
    const TreeLink<S>& link = link_of(steps_[s].link);
    const LinkScratch<S>& w = links[static_cast<std::size_t>(steps_[s].link)];
    X.p += X.R * w.p_PL;
    if (link.rotated) X.R = X.R * link.X_PF.R;
    visit_joint(link, [&](auto joint) {
      if constexpr (!kIsRoot<decltype(joint)>) X.R = joint_rotation(joint, w, X.R);
    });
  }
  return X;
}

// X_bC of all closures, from the links' angles and offsets.
template <class S>
void LaneLoops<S>::locate_all(const Links& links) {
  for (int k = 0; k < tables_.loop_count; ++k) {
    const Way& way = ways_[k];
    const Pose<S> X_LC = pose_along(way.first, way.end_a, links) * closures_[k].X_aC;
    place_[k] = inverse(pose_along(way.end_a, way.end_b, links)) * X_LC;
  }
}

// Unit wrenches of the closure's rows at C, on link a or, the opposite, on b.
template <class S>
void LaneLoops<S>::begin_bundle(int k, const Pose<S>& X_LC, bool opposite) {
  const LoopTable& table = tables_.loops[k];
  for (int r = 0; r < table.rows(); ++r) {
    Vector3<S> moment, force;
    if (r < table.turns) {
      moment = X_LC.R * closures_[k].turn_C[r];
      force = Vector3<S>::zero();
    } else {
      force = X_LC.R.column(r - table.turns);
      moment = cross(X_LC.p, force);
    }
    for (int c = 0; c < 3; ++c) {
      bundle_[r][c] = opposite ? S(-moment[c]) : moment[c];
      bundle_[r][3 + c] = opposite ? S(-force[c]) : force[c];
    }
  }
}

// From a link's frame at its joint to its parent's.
template <class S>
GRAPNEL_INLINE void LaneLoops<S>::go_on(const TreeLink<S>& link, const LinkScratch<S>& w, int rows) {
  const Vector3<S>& p = w.p_PL;
  for (int r = 0; r < rows; ++r) {
    S* F = bundle_[r];
    Vector3<S> moment{F[0], F[1], F[2]}, force{F[3], F[4], F[5]};
    if (link.rotated) moment = link.X_PF.R * moment, force = link.X_PF.R * force;
    moment += cross(p, force);
    for (int c = 0; c < 3; ++c) F[c] = moment[c], F[3 + c] = force[c];
  }
}

// Through a joint with one degree of freedom: F - G K goes on.
template <class S>
template <bool kMoving, recursion::OneAxis Joint>
GRAPNEL_INLINE void LaneLoops<S>::pass(Joint joint, const TreeLink<S>& link, const LinkScratch<S>& w, bool rigid,
                                       int rows, S* K, S* z) {
  constexpr int axis = Joint::kTurns ? Joint::kAxis : 3 + Joint::kAxis;
  const S inverse = rigid ? S(0.0) : S(S(1.0) / recursion::joint_inertia(joint, link, w));
  for (int r = 0; r < rows; ++r) {
    S* F = bundle_[r];
    const S k = F[axis];
    K[r] = k;
    z[r] = inverse * k;
    Vector3<S> moment{F[0], F[1], F[2]}, force{F[3], F[4], F[5]};
    S free(0.0);
    if (!rigid) {
      if constexpr (kMoving) free = w.g * k;
      for (int c = 0; c < 3; ++c) moment[c] -= w.G.angular[c] * k, force[c] -= w.G.linear[c] * k;
    }
    if constexpr (kMoving) {
      for (int c = 0; c < 3; ++c) free += w.bias.angular[c] * moment[c], free += w.bias.linear[c] * force[c];
      acceleration_[r] += free;
      squares_[r] += free * free;
    }
    moment = recursion::joint_forth(joint, w, moment), force = recursion::joint_forth(joint, w, force);
    for (int c = 0; c < 3; ++c) F[c] = moment[c], F[3 + c] = force[c];
  }
  go_on(link, w, rows);
}

// Through a spherical joint, which takes all moment: H^T J^-1 K is taken from the force. The joint's own acceleration
// is J^-1 (torque - (I A' + p).angular).
template <class S>
template <bool kMoving>
GRAPNEL_INLINE void LaneLoops<S>::pass(recursion::Spherical joint, const TreeLink<S>& link, std::span<const S> force,
                                       const LinkScratch<S>& w, int rows, S* K, S* z) {
  const SymmetricFactor3<S> J(w.I.J);
  const std::size_t v = static_cast<std::size_t>(link.v);
  const Vector3<S> torque{force[v], force[v + 1], force[v + 2]};
  const Vector3<S> own = torque - w.p.angular;
  for (int r = 0; r < rows; ++r) {
    S* F = bundle_[r];
    const Vector3<S> x = J.solve({F[0], F[1], F[2]});
    for (int c = 0; c < 3; ++c) K[c * kMostRows + r] = F[c], z[c * kMostRows + r] = x[c];
    Vector3<S> f{F[3], F[4], F[5]};
    for (int c = 0; c < 3; ++c) f[c] -= w.I.H[0][c] * x[0] + w.I.H[1][c] * x[1] + w.I.H[2][c] * x[2];
    if constexpr (kMoving) {
      const S free = dot(own, x) + dot(w.bias.linear, f);
      acceleration_[r] += free;
      squares_[r] += free * free;
    }
    f = recursion::joint_forth(joint, w, f);
    for (int c = 0; c < 3; ++c) F[c] = S(0.0), F[3 + c] = f[c];
  }
  go_on(link, w, rows);
}

template <class S>
template <bool kMoving>
void LaneLoops<S>::climb(int first, int end, int rows, const DynamicsInput<S>& in, const Links& links) {
  using namespace recursion;
  for (int s = first; s < end; ++s) {
    const TreeLink<S>& link = link_of(steps_[s].link);
    const LinkScratch<S>& w = links[static_cast<std::size_t>(steps_[s].link)];
    S *K = rows_at(K_, steps_[s].slot), *z = rows_at(z_, steps_[s].slot);
    const bool rigid = is_prescribed(in.prescribed, link);
    visit_joint(link, [&](auto joint) {
      if constexpr (std::is_same_v<decltype(joint), Spherical>) {
        pass<kMoving>(joint, link, in.force, w, rows, K, z);  // which nothing prescribes
      } else if constexpr (!kIsRoot<decltype(joint)>) {
        pass<kMoving>(joint, link, w, rigid, rows, K, z);
      }
    });
  }
}

template <class S>
void LaneLoops<S>::factor_root(RootFactor& root, const TreeLink<S>& link, const LinkScratch<S>& w,
                               const DynamicsInput<S>& in) {
  S A[6][6];  // below the diagonal: what is left of I
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) A[r][c] = w.I.J(r, c), A[3 + r][3 + c] = w.I.M(r, c), A[3 + c][r] = w.I.H[r][c];
  }
  const std::size_t v = static_cast<std::size_t>(link.v);
  for (std::size_t k = 0; k < 3; ++k) {
    root.y[k] = in.force[v + k] - w.p.angular[static_cast<int>(k)];
    root.y[3 + k] = in.force[v + 3 + k] - w.p.linear[static_cast<int>(k)];
  }
  for (int j = 0; j < 6; ++j) {
    root.inverse[j] = S(1.0) / A[j][j];
    for (int i = j + 1; i < 6; ++i) root.L[i][j] = A[i][j] * root.inverse[j];
    for (int i = j + 1; i < 6; ++i) {
      for (int k = j + 1; k <= i; ++k) A[i][k] -= root.L[i][j] * A[k][j];
      root.y[i] -= root.L[i][j] * root.y[j];
    }
  }
}

// At the free root: F moves it, I A = F.
template <class S>
template <bool kMoving>
void LaneLoops<S>::arrive(int k) {
  const Way& way = ways_[k];
  const RootFactor& root = root_factor_[way.same_root];
  const int slot = steps_[way.root].slot;
  S* wrench = root_wrench_.data() + k * 6 * kMostRows;
  for (int r = 0; r < way.rows; ++r) {
    const S* F = bundle_[r];
    S x[6];  // L^-1 F
    S free(0.0);
    for (int i = 0; i < 6; ++i) {
      wrench[i * kMostRows + r] = F[i];
      x[i] = F[i];
      for (int j = 0; j < i; ++j) x[i] -= root.L[i][j] * x[j];
      const S z = root.inverse[i] * x[i];
      rows_at(K_, slot + i)[r] = x[i];
      rows_at(z_, slot + i)[r] = z;
      if constexpr (kMoving) free += root.y[i] * z;
    }
    if constexpr (kMoving) {
      acceleration_[r] += free;
      squares_[r] += free * free;
    }
  }
}

template <class S>
template <bool kMoving>
void LaneLoops<S>::carry(int k, const DynamicsInput<S>& in, const Links& links) {
  const Way& way = ways_[k];
  for (int r = 0; r < way.rows; ++r) acceleration_[r] = squares_[r] = S(0.0);
  begin_bundle(k, closures_[k].X_aC, false);
  climb<kMoving>(way.first, way.end_a, way.rows, in, links);
  S from_a[kMostRows][6];
  for (int r = 0; r < way.rows; ++r) {
    for (int c = 0; c < 6; ++c) from_a[r][c] = bundle_[r][c];
  }
  begin_bundle(k, place_[k], true);
  climb<kMoving>(way.end_a, way.end_b, way.rows, in, links);
  for (int r = 0; r < way.rows; ++r) {
    for (int c = 0; c < 6; ++c) bundle_[r][c] += from_a[r][c];
  }
  climb<kMoving>(way.end_b, way.root, way.rows, in, links);
  if (way.same_root == k) {
    const int root = steps_[way.root].link;
    factor_root(root_factor_[k], link_of(root), links[static_cast<std::size_t>(root)], in);
  }
  arrive<kMoving>(k);
  for (int r = 0; r < way.rows; ++r) {
    sums_[way.first_row + r] = acceleration_[r];
    square_sums_[way.first_row + r] = squares_[r];
  }
}

// The scaled W, lower triangle, where it is factored.
template <class S>
void LaneLoops<S>::weigh() {
  const auto put = [&](int row, int column, const S& sum) {
    pivots_.at(row, column) = S(scale_[row] * scale_[column]) * sum;
  };
  for (int k = 0; k < tables_.loop_count; ++k) {
    const Way& way = ways_[k];
    const int first = steps_[way.first].slot, end = steps_[way.root].slot + 6;
    for (int r = 0; r < way.rows; ++r) {
      for (int c = 0; c <= r; ++c) {
        S sum(0.0);
        for (int s = first; s < end; ++s) sum += rows_at(z_, s)[r] * rows_at(K_, s)[c];
        put(way.first_row + r, way.first_row + c, sum);
      }
    }
  }
  for (int p = 0; p < pair_count_; ++p) {
    const Pair& pair = pairs_[p];
    const Way &k = ways_[pair.k], &l = ways_[pair.l];
    for (int r = 0; r < k.rows; ++r) {
      for (int c = 0; c < l.rows; ++c) {
        S sum(0.0);
        for (int s = pair.first; s < pair.end; ++s)
          sum += rows_at(z_, shared_[s].of_k)[r] * rows_at(K_, shared_[s].of_l)[c];
        put(k.first_row + r, l.first_row + c, sum);
      }
    }
  }
}

// Factors the scaled W for what articulated_inertias() left in `links`.
template <class S>
template <bool kMoving>
void LaneLoops<S>::prepare(const DynamicsInput<S>& in, const Links& links) {
  for (int k = 0; k < tables_.loop_count; ++k) {
    for (int r = 0; r < ways_[k].rows; ++r) scale_[ways_[k].first_row + r] = closures_[k].scale(tables_.loops[k], r);
  }
  // Closures on different trees have no block between them.
  for (int i = 0; i < row_count_; ++i) {
    for (int j = 0; j < i; ++j) pivots_.at(i, j) = S(0.0);
  }
  for (int k = 0; k < tables_.loop_count; ++k) carry<kMoving>(k, in, links);
  weigh();
  pivots_.factor();
}

// --- Motion of C against D, as rows. --------------------------------------------------------------------------------

template <class S>
GRAPNEL_INLINE void LaneLoops<S>::take_rows(int k, const Vector3<S>& angular, const Vector3<S>& linear, S* rows) const {
  const LoopTable& table = tables_.loops[k];
  for (int r = 0; r < table.turns; ++r) rows[r] = dot(closures_[k].turn_C[r], angular);
  for (int c = 0; c < 3; ++c) rows[table.turns + c] = linear[c];
}

// Twists of both sides at C, in its axes.
template <class S>
GRAPNEL_INLINE Twist<S> LaneLoops<S>::at_C(int k, const LinkScratch<S>& a) const {
  return transposed_times(closures_[k].X_aC.R, shift(a.V, closures_[k].X_aC.p));
}
template <class S>
GRAPNEL_INLINE Twist<S> LaneLoops<S>::at_D(int k, const LinkScratch<S>& b) const {
  return transposed_times(place_[k].R, shift(b.V, place_[k].p));
}

// Rows of the relative acceleration that the forces alone would give, and the size of its terms.
template <class S>
S LaneLoops<S>::acceleration_rows(const Links& links, S* u) {
  S most(0.0);
  for (int k = 0; k < tables_.loop_count; ++k) {
    const Way& way = ways_[k];
    const Twist<S> V_C = at_C(k, links[static_cast<std::size_t>(way.link_a)]),
                   V_D = at_D(k, links[static_cast<std::size_t>(way.link_b)]);
    // The components of V_D in C change by A_D - V_C x V_D.                                               (8.5)
    const SpatialAcceleration<S> cross = cross_motion(V_C, V_D);
    S turning[kMostRows];
    take_rows(k, cross.angular, cross.linear, turning);
    for (int r = 0; r < way.rows; ++r) {
      const int row = way.first_row + r;
      u[row] = sums_[row] + turning[r];
      const S terms = square_sums_[row] + turning[r] * turning[r];
      most = max(most, S(S(scale_[row] * scale_[row]) * terms));
    }
  }
  return sqrt(most);
}

// Scaled size of the accelerations of the closures' bodies, gravity included; not below what nobody would notice.
template <class S>
S LaneLoops<S>::acceleration_size(const Links& links) const {
  const S unnoticed(loop_limits::kUnnoticed);
  S size(0.0);
  for (int k = 0; k < tables_.loop_count; ++k) {
    const int sides[] = {ways_[k].link_a, ways_[k].link_b};
    for (int link : sides) {
      const SpatialAcceleration<S>& A = links[static_cast<std::size_t>(link)].A;
      size = max(size, S(closures_[k].angular_scale * max(norm(A.angular), unnoticed)));
      size = max(size, S(closures_[k].linear_scale * max(norm(A.linear), unnoticed)));
    }
  }
  return size;
}

// Rows of the relative twist, and the size of its terms.
template <class S>
S LaneLoops<S>::velocity_rows(const Links& links, S* u) {
  S size(0.0);
  for (int k = 0; k < tables_.loop_count; ++k) {
    const Way& way = ways_[k];
    const LinkScratch<S>&a = links[static_cast<std::size_t>(way.link_a)],
          &b = links[static_cast<std::size_t>(way.link_b)];
    const Twist<S> V_C = at_C(k, a), V_D = at_D(k, b);
    take_rows(k, V_C.angular - V_D.angular, V_C.linear - V_D.linear, u + way.first_row);
    size = max(size, S(closures_[k].angular_scale * S(norm(a.V.angular) + norm(b.V.angular))));
    size = max(size, S(closures_[k].linear_scale * S(norm(a.V.linear) + norm(b.V.linear))));
  }
  return size;
}

// Defects of position as rows of C minus D, (8.4). Turns near half a turn become no numbers, or wrong ones: loops that
// are so far open are not closed by a projection.
template <class S>
void LaneLoops<S>::place_rows(S* e) const {
  const S one(1.0), half(0.5);
  for (int k = 0; k < tables_.loop_count; ++k) {
    const LoopTable& table = tables_.loops[k];
    const LaneClosure<S>& closure = closures_[k];
    const Pose<S> X_CD = inverse(place_[k]) * closure.X_bD;
    Vector3<S> turn = Vector3<S>::zero();
    if (table.turns == 3) {
      // The vector part of the quaternion is half the skew part over w.
      const Rotation<S>& R = X_CD.R;
      const S w = half * sqrt(S(one + (S(R(0, 0) + R(1, 1)) + R(2, 2))));
      const S f = S(0.25) / w;
      const Vector3<S> vector{S(f * S(R(2, 1) - R(1, 2))), S(f * S(R(0, 2) - R(2, 0))), S(f * S(R(1, 0) - R(0, 1)))};
      turn = turn_per_sine(norm(vector), w) * vector;
    } else if (table.turns == 2) {
      // From one axis to the other: the cross product is twice the sine and the cosine of half the angle.
      const Vector3<S> axis = X_CD.R * closure.hinge_C;
      const Vector3<S> cross_product = cross(closure.hinge_C, axis);
      const S w = sqrt(S(half + half * dot(closure.hinge_C, axis)));
      const S f = half / w;
      turn = S(f * turn_per_sine(S(f * norm(cross_product)), w)) * cross_product;
    }
    take_rows(k, -turn, -X_CD.p, e + ways_[k].first_row);
  }
}

// Largest defects over the closures from places and twists. Leaves the defects of places in u_.
template <class S>
LaneDefect<S> LaneLoops<S>::defects(const Links& links) {
  LaneDefect<S> largest = LaneDefect<S>::none();
  const auto size = [](const S* x, int count) {
    S sum(0.0);
    for (int i = 0; i < count; ++i) sum += x[i] * x[i];
    return sqrt(sum);
  };
  velocity_rows(links, rhs_.data());
  place_rows(u_.data());
  for (int k = 0; k < tables_.loop_count; ++k) {
    const int turns = tables_.loops[k].turns;
    const S *e = u_.data() + ways_[k].first_row, *slip = rhs_.data() + ways_[k].first_row;
    largest.raise({size(e + turns, 3), size(e, turns), size(slip + turns, 3), size(slip, turns)});
  }
  return largest;
}

template <class S>
S LaneLoops<S>::scaled_size(const S* u) const {
  S most(0.0);
  for (int i = 0; i < row_count_; ++i) most = max(most, abs(S(scale_[i] * u[i])));
  return most;
}

// --- Accelerations. -------------------------------------------------------------------------------------------------

// rows_ with W rows = -u, in residual_ what redundant rows do not agree with.
template <class S>
void LaneLoops<S>::solve(const S* u) {
  for (int i = 0; i < row_count_; ++i) rhs_[i] = -(scale_[i] * u[i]);
  pivots_.solve(rhs_.data(), solution_.data(), residual_.data());
  for (int i = 0; i < row_count_; ++i) rows_[i] = scale_[i] * solution_[i];
}

// Makes wrenches or impulses rows_ act in the third sweep.
template <class S>
void LaneLoops<S>::impose(std::span<const std::uint8_t> prescribed, Links& links) const {
  for (int k = 0; k < tables_.loop_count; ++k) {
    const Way& way = ways_[k];
    const S* x = rows_.data() + way.first_row;
    const auto weighted = [&](const S* of_rows) {
      S sum(0.0);
      for (int r = 0; r < way.rows; ++r) sum += of_rows[r] * x[r];
      return sum;
    };
    for (int s = way.first; s < way.root; ++s) {
      const TreeLink<S>& link = link_of(steps_[s].link);
      LinkScratch<S>& w = links[static_cast<std::size_t>(steps_[s].link)];
      const int slot = steps_[s].slot;
      if (!has_one_axis(link.joint)) {
        for (int c = 0; c < 3; ++c) w.p.angular[c] -= weighted(rows_at(K_, slot + c));
      } else if (is_prescribed(prescribed, link)) {
        (turns_about_axis(link.joint) ? w.p.angular : w.p.linear)[link.axis] -= weighted(rows_at(K_, slot));
      } else {
        w.g += weighted(rows_at(z_, slot));
      }
    }
    LinkScratch<S>& root = links[static_cast<std::size_t>(steps_[way.root].link)];
    const S* wrench = root_wrench_.data() + k * 6 * kMostRows;
    for (int c = 0; c < 3; ++c) {
      root.p.angular[c] -= weighted(wrench + c * kMostRows);
      root.p.linear[c] -= weighted(wrench + (3 + c) * kMostRows);
    }
  }
}

// Takes away what impose() did to links that articulated_inertias() left at rest with no force acting.
template <class S>
void LaneLoops<S>::release(Links& links) const {
  for (int s = 0; s < step_count_; ++s) {
    LinkScratch<S>& w = links[static_cast<std::size_t>(steps_[s].link)];
    w.g = S(0.0), w.p = Wrench<S>::zero();
  }
}

template <class S>
void LaneLoops<S>::accelerate(const DynamicsInput<S>& in, DynamicsWorkspace<S>& workspace, std::span<S> vdot,
                              std::span<S> force) {
  using namespace loop_limits;
  Links& links = workspace.links;
  articulated_inertias<S>(tree_, in, workspace);
  locate_all(links);
  prepare<true>(in, links);
  doubts_ |= pivots_.doubtful();
  const S size = acceleration_rows(links, u_.data());  // J M^-1 phi + Jdot v
  solve(u_.data());                                    // (8.6)
  impose(in.prescribed, links);
  articulated_accelerations<S>(tree_, in, workspace, vdot, force);
  S worst(0.0);
  for (int i = 0; i < row_count_; ++i) worst = max(worst, abs(residual_[i]));
  const S allowed = S(kContradiction) * max(S(kSmallest), max(size, acceleration_size(links)));
  contradicted_ = !(worst <= allowed);
}

// --- Projection. ----------------------------------------------------------------------------------------------------

template <class S>
DynamicsInput<S> LaneLoops<S>::at_rest(std::span<const S> q, std::span<const std::uint8_t> prescribed) const {
  const std::span<const S> zeros(zero_.data(), static_cast<std::size_t>(tables_.velocities));
  DynamicsInput<S> in;
  in.q = q, in.v = zeros, in.force = zeros, in.prescribed = prescribed, in.acceleration = zeros;
  return in;
}

// Change of velocities step_ by impulses rows_, after articulated_inertias() at rest.
template <class S>
void LaneLoops<S>::respond(const DynamicsInput<S>& rest, DynamicsWorkspace<S>& workspace) {
  const std::size_t n = static_cast<std::size_t>(tables_.velocities);
  release(workspace.links);
  impose(rest.prescribed, workspace.links);
  articulated_accelerations<S>(tree_, rest, workspace, std::span<S>(step_.data(), n), std::span<S>(ignored_.data(), n));
}

// Twists of links at v, with q also their angles and offsets, and where the closures are. Articulated inertias stay.
template <class S>
void LaneLoops<S>::move_all(std::span<const S> q, std::span<const S> v, Links& links) {
  using namespace recursion;
  for (std::size_t n = 0; n < tree_.links.size(); ++n) {
    const TreeLink<S>& link = tree_.links[n];
    LinkScratch<S>& w = links[n];
    visit_joint(link, [&](auto joint) {
      if constexpr (kIsRoot<decltype(joint)>) {
        w.V = root_velocity(link, v);
      } else {
        const Twist<S>& V_parent = links[static_cast<std::size_t>(link.parent)].V;
        if (q.empty()) {
          move(joint, link, v, V_parent, w);
        } else {
          follow(joint, link, q, v, V_parent, w);
        }
      }
    });
  }
  if (!q.empty()) locate_all(links);
}

// q moved by step_, positions along their body's axes.
template <class S>
void LaneLoops<S>::step_coordinates(S* q) const {
  for (const TreeLink<S>& link : tree_.links) {
    const S* dq = step_.data() + link.v;
    if (has_one_axis(link.joint)) {
      q[link.q] += dq[0];
      continue;
    }
    S* at = q + link.q;
    if (link.joint == JointType::free) {
      const Vector3<S> p = rotation_matrix(Quaternion<S>{at[3], at[4], at[5], at[6]}) * Vector3<S>{dq[3], dq[4], dq[5]};
      for (int c = 0; c < 3; ++c) at[c] += p[c];
      at += 3;
    }
    const Vector3<S> turn{dq[0], dq[1], dq[2]};
    const S angle = norm(turn), tiny(1e-8);
    const SineCosine<S> half = sine_cosine(S(S(0.5) * angle));
    // sin(a/2)/a without division by zero.
    const S f = select(angle > tiny, S(half.sine / max(angle, tiny)), S(0.5));
    const Quaternion<S> p = Quaternion<S>{at[0], at[1], at[2], at[3]} *
                            Quaternion<S>{half.cosine, S(f * turn[0]), S(f * turn[1]), S(f * turn[2])};
    const S inverse = S(1.0) / sqrt(S((p.w * p.w + p.x * p.x) + (p.y * p.y + p.z * p.z)));
    at[0] = p.w * inverse, at[1] = p.x * inverse, at[2] = p.y * inverse, at[3] = p.z * inverse;
  }
}

// Newton's method with the factor at hand.                                                                    (8.9)
template <class S>
void LaneLoops<S>::close_places(Mask active, const DynamicsInput<S>& rest, DynamicsWorkspace<S>& workspace,
                                std::span<S> q, std::span<S> v, LaneProjection<S>& result) {
  using namespace loop_limits;
  S defect = result.before.largest_of_place();
  active = active & (defect > S(kRounding));
  bool returned = false;
  for (int i = 0; i < kMostIterations && active.bits() != 0; ++i) {
    // One factor serves all iterations while defects are small; lanes in which it does not are none.
    if (i > 0) {
      const Mask open = active & (defect > S(kRefactorBeyond));
      result.failed |= open.bits();
      active = active & !open;
    }
    solve(u_.data());
    respond(rest, workspace);
    for (int c = 0; c < tables_.coordinates; ++c) trial_q_[c] = q[static_cast<std::size_t>(c)];
    step_coordinates(trial_q_.data());
    for (int c = 0; c < tables_.coordinates; ++c)
      trial_q_[c] = select(active, trial_q_[c], q[static_cast<std::size_t>(c)]);
    move_all(std::span<const S>(trial_q_.data(), q.size()), v, workspace.links);
    const S next = defects(workspace.links).largest_of_place();
    const Mask better = active & (next < defect);
    returned = returned || (active & !better).bits() != 0;
    for (int c = 0; c < tables_.coordinates; ++c)
      q[static_cast<std::size_t>(c)] = select(better, trial_q_[c], q[static_cast<std::size_t>(c)]);
    // Rounding, or no way on, where it is not halved.
    active = better & (next < S(S(0.5) * defect)) & (next > S(kRounding));
    defect = select(better, next, defect);
  }
  if (returned) move_all(q, v, workspace.links);
  result.failed |= (!(defect <= S(kClosed))).bits();
}

// The plastic impact that closes the loops.                                                                  (8.10)
template <class S>
void LaneLoops<S>::close_motion(Mask active, const DynamicsInput<S>& rest, DynamicsWorkspace<S>& workspace,
                                std::span<S> q, std::span<S> v, LaneProjection<S>& result) {
  using namespace loop_limits;
  static_cast<void>(q);
  const int count = tables_.velocities;
  const S size = velocity_rows(workspace.links, u_.data());
  S defect = scaled_size(u_.data());
  active = active & (defect > S(S(kRounding) * size));
  for (int i = 0; i < kMostIterations && active.bits() != 0; ++i) {
    solve(u_.data());
    respond(rest, workspace);
    for (int c = 0; c < count; ++c) {
      S& velocity = v[static_cast<std::size_t>(c)];
      last_v_[c] = velocity;
      velocity = select(active, velocity + step_[c], velocity);
    }
    move_all({}, v, workspace.links);
    velocity_rows(workspace.links, u_.data());
    const S next = scaled_size(u_.data());
    const Mask better = active & (next < defect);
    for (int c = 0; c < count; ++c) {
      S& velocity = v[static_cast<std::size_t>(c)];
      velocity = select(active & !better, last_v_[c], velocity);
    }
    active = better & (next < S(S(0.5) * defect)) & (next > S(S(kRounding) * size));
    defect = select(better, next, defect);
  }
  // Joints that are prescribed may leave no velocity that fits; rounding in their trajectories is no such thing.
  const Mask misfits = !(defect <= S(S(kContradiction) * size));
  if (misfits.bits() != 0)
    result.failed |= (misfits & !(defects(workspace.links).largest_of_motion() <= S(kClosed))).bits();
}

template <class S>
LaneProjection<S> LaneLoops<S>::project(const Mask& lanes, std::span<const std::uint8_t> prescribed,
                                        DynamicsWorkspace<S>& workspace, std::span<S> q, std::span<S> v,
                                        double negligible) {
  LaneProjection<S> result;
  const DynamicsInput<S> rest = at_rest(q, prescribed);
  articulated_inertias<S>(tree_, rest, workspace);
  move_all({}, v, workspace.links);
  locate_all(workspace.links);
  result.before = defects(workspace.links);
  const Mask wanted = lanes & !(result.before.largest() <= S(negligible));
  result.changed = wanted.bits();
  if (result.changed == 0) return result;
  prepare<false>(rest, workspace.links);
  doubts_ |= pivots_.doubtful() & result.changed;
  close_places(wanted, rest, workspace, q, v, result);
  close_motion(wanted, rest, workspace, q, v, result);
  result.failed &= result.changed;
  return result;
}

}  // namespace grapnel::lanes
