#pragma once

/// @file
/// Unit wrenches of loop closures carried through the articulated tree, in packs: (8.7) of docs/theory. Corresponds
/// to constraint/loop_columns.hpp for single cases. There, a vector holds the rows of a closure; here, a pack holds
/// cases. All lanes share the chains from closures to roots.

#include "grapnel/dynamics/articulated_body_kernel.hpp"
#include "grapnel/lanes/lane_closure.hpp"
#include "grapnel/lanes/lane_pivots.hpp"

namespace grapnel::lanes {

template <class S>
class LaneColumns {
 public:
  using Links = std::vector<LinkScratch<S>>;
  static constexpr int kMostRows = 6;  // of a closure

  /// `tree`: the integrated tree; call lay_out() once it is complete.
  LaneColumns(const PhaseTables& tables, const Tree<S>& tree);
  /// `place`: index in the tree of each link of the tables.
  void lay_out(const LaneArray<S, int>& place);
  /// Loads a case's numbers into a lane.
  void load_case(int lane, const double* numbers) {
    for (int k = 0; k < tables_.loop_count; ++k) closures_[k].load(lane, numbers + k * kLoopNumbers);
  }

  int rows() const { return room_.rows; }  // total over all closures
  int first_row(int k) const { return chains_[k].first_row; }
  const LaneClosure<S>& closure(int k) const { return closures_[k]; }
  const LinkScratch<S>& link_a(int k, const Links& links) const {
    return links[static_cast<std::size_t>(chains_[k].link_a)];
  }
  const LinkScratch<S>& link_b(int k, const Links& links) const {
    return links[static_cast<std::size_t>(chains_[k].link_b)];
  }
  /// Scale of a row such that body b, alone and free, has unit mobility.
  const S& scale(int row) const { return scale_[row]; }

  /// Computes the poses of the frames C in links b from the links' angles and offsets.
  void locate_all(const Links& links);
  const Pose<S>& X_bC(int k) const { return place_[k]; }

  /// Carries all unit wrenches to the roots. `links`: the result of articulated_inertias() for `in`. kMoving: for the
  /// present velocities and forces; otherwise at rest without forces.
  template <bool kMoving>
  void carry_all(const DynamicsInput<S>& in, const Links& links);
  /// Writes the lower triangle of the scaled W to the factorization.
  void weigh(LanePivots<S>& pivots) const;
  /// After carry_all<true>(), per row: relative acceleration of C and D due to the forces alone, without V_C x V_D, and
  /// the sum of the squares of its terms.
  const S& free_acceleration(int row) const { return sums_[row]; }
  const S& free_acceleration_squares(int row) const { return square_sums_[row]; }

  /// Solves I A = F at a free root; uses the factor of carry_all() if available.
  SpatialAcceleration<S> solve_root(std::size_t link, const ArticulatedInertia<S>& I, const Wrench<S>& F) const;

  /// Applies wrenches or impulses `rows` in the third sweep.
  void impose(const S* rows, std::span<const std::uint8_t> prescribed, Links& links) const;
  /// Removes the effect of impose() from links that articulated_inertias() computed at rest without forces.
  void release(Links& links) const;

 private:
  // A link on a closure's chain, and the offset of the closure's rows there: kMostRows numbers per velocity.
  struct Step {
    int link, slot;
  };
  // Ranges in steps_: from a, from b, from their common ancestor, and the root.
  struct Chain {
    int link_a, link_b;
    int first, end_a, end_b, root;
    int rows, first_row;
    int same_root;  // the first closure with this root
  };
  struct SlotPair {
    int of_k, of_l;
  };
  // Closures with common links.
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
  // Storage required by all chains to roots.
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
  int slots_of(const TreeLink<S>& link) const { return link.parent < 0 ? 6 : velocity_count(link.joint); }
  const TreeLink<S>& link_of(int n) const { return tree_.links[static_cast<std::size_t>(n)]; }
  static bool is_prescribed(std::span<const std::uint8_t> prescribed, const TreeLink<S>& link) {
    return !prescribed.empty() && prescribed[static_cast<std::size_t>(link.v)] != 0;
  }
  // The rows of one closure at a slot of K_ and z_.
  struct SlotRows {
    int rows;
    S *K, *z;
  };
  S* rows_at(LaneArray<S>& all, int slot) { return all.data() + slot * kMostRows; }
  const S* rows_at(const LaneArray<S>& all, int slot) const { return all.data() + slot * kMostRows; }

  void lay_out_pairs();
  template <class F>
  void for_shared_slots(F&& found) const;

  template <class Joint>
  static void see_from_parent(Joint joint, const TreeLink<S>& link, const LinkScratch<S>& w, Pose<S>& X);
  template <class Joint>
  static void see_from_link(Joint joint, const TreeLink<S>& link, const LinkScratch<S>& w, Pose<S>& X);
  template <bool kMoving>
  void carry(int k, const DynamicsInput<S>& in, const Links& links);
  void begin_bundle(int k, const Pose<S>& X_LC, bool opposite);
  template <bool kMoving>
  void climb(int first, int end, int rows, const DynamicsInput<S>& in, const Links& links);
  template <bool kMoving, bool kBare, recursion::OneAxis Joint>
  void pass(Joint joint, const TreeLink<S>& link, const LinkScratch<S>& w, bool rigid, const SlotRows& slot);
  template <bool kMoving>
  void pass(recursion::Spherical joint, const TreeLink<S>& link, std::span<const S> force, const LinkScratch<S>& w,
            const SlotRows& slot);
  void go_on(const TreeLink<S>& link, const LinkScratch<S>& w, Vector3<S> moment, Vector3<S> force, S* F);
  void factor_root(RootFactor& root, const TreeLink<S>& link, const LinkScratch<S>& w, const DynamicsInput<S>& in);
  template <bool kMoving>
  void arrive(int k);

  const PhaseTables& tables_;
  const Tree<S>& tree_;
  LaneArray<S, LaneClosure<S>> closures_;
  LaneArray<S, Pose<S>> place_;  // of C in link b, per closure
  LaneArray<S, Chain> chains_;
  const Room room_;
  int step_count_ = 0, slot_count_ = 0, pair_count_ = 0, shared_count_ = 0;
  LaneArray<S, Step> steps_;
  LaneArray<S, Pair> pairs_;
  LaneArray<S, SlotPair> shared_;
  LaneArray<S> K_;            // S^T F of the closures' unit wrenches at their links, L^-1 F at roots
  LaneArray<S> z_;            // D^-1 K; zero if prescribed
  LaneArray<S> root_wrench_;  // F at roots: six components per closure
  LaneArray<S, RootFactor> root_factor_;
  S bundle_[kMostRows][6];  // unit wrenches being carried: [moment; force]
  S acceleration_[kMostRows], squares_[kMostRows];
  LaneArray<S> sums_, square_sums_, scale_;  // per row
};

template <class S>
LaneColumns<S>::LaneColumns(const PhaseTables& tables, const Tree<S>& tree)
    : tables_(tables),
      tree_(tree),
      closures_(tables.loop_count),
      place_(tables.loop_count),
      chains_(tables.loop_count),
      room_(tables),
      steps_(room_.steps),
      pairs_(tables.loop_count * tables.loop_count),
      shared_(tables.loop_count * room_.slots),
      K_(room_.slots * kMostRows),
      z_(room_.slots * kMostRows),
      root_wrench_(tables.loop_count * 6 * kMostRows),
      root_factor_(tables.loop_count),
      sums_(room_.rows),
      square_sums_(room_.rows),
      scale_(room_.rows) {}

// --- Chains from closures to roots. ---------------------------------------------------------------------------------

template <class S>
void LaneColumns<S>::lay_out(const LaneArray<S, int>& place) {
  int row = 0;
  for (int k = 0; k < tables_.loop_count; ++k) {
    const LoopTable& table = tables_.loops[k];
    Chain& chain = chains_[k];
    chain.link_a = place[table.link_a], chain.link_b = place[table.link_b];
    chain.rows = table.rows(), chain.first_row = row;
    row += chain.rows;
    const auto depth = [&](int link) {
      int d = 0;
      for (int l = link; l >= 0; l = link_of(l).parent) ++d;
      return d;
    };
    // Common ancestor of both sides.
    int a = chain.link_a, b = chain.link_b;
    while (depth(a) > depth(b)) a = link_of(a).parent;
    while (depth(b) > depth(a)) b = link_of(b).parent;
    while (a != b) a = link_of(a).parent, b = link_of(b).parent;
    const auto add = [&](int link) {
      steps_[step_count_++] = {link, slot_count_};
      slot_count_ += slots_of(link_of(link));
    };
    chain.first = step_count_;
    for (int l = chain.link_a; l != a; l = link_of(l).parent) add(l);
    chain.end_a = step_count_;
    for (int l = chain.link_b; l != a; l = link_of(l).parent) add(l);
    chain.end_b = step_count_;
    for (int l = a; l >= 0; l = link_of(l).parent) add(l);
    chain.root = step_count_ - 1;
    chain.same_root = k;
    for (int l = k; l-- > 0;) {
      if (steps_[chains_[l].root].link == steps_[chain.root].link) chain.same_root = l;
    }
  }
  lay_out_pairs();
}

// Slots common to closures k > l: found(k, l, slot of k, slot of l).
template <class S>
template <class F>
void LaneColumns<S>::for_shared_slots(F&& found) const {
  for (int k = 0; k < tables_.loop_count; ++k) {
    for (int l = 0; l < k; ++l) {
      for (int s = chains_[k].first; s <= chains_[k].root; ++s) {
        for (int t = chains_[l].first; t <= chains_[l].root; ++t) {
          if (steps_[s].link != steps_[t].link) continue;
          for (int i = 0; i < slots_of(link_of(steps_[s].link)); ++i)
            found(k, l, steps_[s].slot + i, steps_[t].slot + i);
        }
      }
    }
  }
}

template <class S>
void LaneColumns<S>::lay_out_pairs() {
  for_shared_slots([&](int k, int l, int of_k, int of_l) {
    if (pair_count_ == 0 || pairs_[pair_count_ - 1].k != k || pairs_[pair_count_ - 1].l != l)
      pairs_[pair_count_++] = {k, l, shared_count_, shared_count_};
    shared_[shared_count_++] = {of_k, of_l};
    pairs_[pair_count_ - 1].end = shared_count_;
  });
}

// --- W and the relative acceleration: unit wrenches carried to the root, (8.7). --------------------------------------

// A pose expressed in the parent's frame from the link's frame, and the inverse.
template <class S>
template <class Joint>
__attribute__((noinline)) void LaneColumns<S>::see_from_parent(Joint joint, const TreeLink<S>& link,
                                                               const LinkScratch<S>& w, Pose<S>& X) {
  GRAPNEL_UNROLL
  for (int c = 0; c < 3; ++c) {
    const Vector3<S> x = recursion::to_parent(joint, link, w, X.R.column(c));
    X.R.m[0][c] = x[0], X.R.m[1][c] = x[1], X.R.m[2][c] = x[2];
  }
  X.p = recursion::to_parent(joint, link, w, X.p) + w.p_PL;
}
template <class S>
template <class Joint>
__attribute__((noinline)) void LaneColumns<S>::see_from_link(Joint joint, const TreeLink<S>& link,
                                                             const LinkScratch<S>& w, Pose<S>& X) {
  GRAPNEL_UNROLL
  for (int c = 0; c < 3; ++c) {
    const Vector3<S> x = recursion::to_link(joint, link, w, X.R.column(c));
    X.R.m[0][c] = x[0], X.R.m[1][c] = x[1], X.R.m[2][c] = x[2];
  }
  X.p = recursion::to_link(joint, link, w, X.p - w.p_PL);
}

// Transforms C from link a up to the common ancestor and down to link b.
template <class S>
void LaneColumns<S>::locate_all(const Links& links) {
  using namespace recursion;
  for (int k = 0; k < tables_.loop_count; ++k) {
    const Chain& chain = chains_[k];
    // Copied number by number: copying the whole structure goes through memcpy and stalls the following reads.
    Pose<S>& X = place_[k];
    const Pose<S>& X_aC = closures_[k].X_aC;
    GRAPNEL_UNROLL
    for (int r = 0; r < 3; ++r) {
      X.p[r] = X_aC.p[r];
      GRAPNEL_UNROLL
      for (int c = 0; c < 3; ++c) X.R.m[r][c] = X_aC.R.m[r][c];
    }
    const auto at_step = [&](int s, auto&& see) {
      const TreeLink<S>& link = link_of(steps_[s].link);
      visit_joint(link, [&](auto joint) {
        if constexpr (!kIsRoot<decltype(joint)>) see(joint, link, links[static_cast<std::size_t>(steps_[s].link)]);
      });
    };
    for (int s = chain.first; s < chain.end_a; ++s)
      at_step(
          s, [&](auto joint, const TreeLink<S>& link, const LinkScratch<S>& w) { see_from_parent(joint, link, w, X); });
    for (int s = chain.end_b; s-- > chain.end_a;)
      at_step(s,
              [&](auto joint, const TreeLink<S>& link, const LinkScratch<S>& w) { see_from_link(joint, link, w, X); });
  }
}

// Unit wrenches of the closure's rows at C, on link a or, the opposite, on b.
template <class S>
void LaneColumns<S>::begin_bundle(int k, const Pose<S>& X_LC, bool opposite) {
  const LoopTable& table = tables_.loops[k];
  for (int r = 0; r < table.rows(); ++r) {
    Vector3<S> moment, force;
    if (r < table.turn_rows) {
      moment = X_LC.R * closures_[k].turn_C[r];
      force = Vector3<S>::zero();
    } else {
      force = X_LC.R.column(r - table.turn_rows);
      moment = cross(X_LC.p, force);
    }
    GRAPNEL_UNROLL
    for (int c = 0; c < 3; ++c) {
      bundle_[r][c] = opposite ? S(-moment[c]) : moment[c];
      bundle_[r][3 + c] = opposite ? S(-force[c]) : force[c];
    }
  }
}

// Transforms a row's wrench from a link's frame at its joint to its parent's frame.
template <class S>
GRAPNEL_INLINE void LaneColumns<S>::go_on(const TreeLink<S>& link, const LinkScratch<S>& w, Vector3<S> moment,
                                          Vector3<S> force, S* F) {
  if (link.rotated) moment = link.X_PF.R * moment, force = link.X_PF.R * force;
  moment += cross(w.p_PL, force);
  GRAPNEL_UNROLL
  for (int c = 0; c < 3; ++c) F[c] = moment[c], F[3 + c] = force[c];
}

// Through a joint with one degree of freedom: F - G K is passed on. kBare: a revolute joint, not prescribed, without
// rotor. Then no moment about its axis remains, and its bias acceleration has no component along the axis. One function
// per kind of joint, as in the second sweep's step; a single function for all kinds spills more registers.
template <class S>
template <bool kMoving, bool kBare, recursion::OneAxis Joint>
__attribute__((noinline)) void LaneColumns<S>::pass(Joint joint, const TreeLink<S>& link, const LinkScratch<S>& w,
                                                    bool rigid, const SlotRows& slot) {
  const auto [rows, K, z] = slot;
  constexpr int axis = Joint::kTurns ? Joint::kAxis : 3 + Joint::kAxis;
  const S inverse = rigid ? S(0.0) : S(S(1.0) / recursion::joint_inertia(joint, link, w));
  for (int r = 0; r < rows; ++r) {
    S* F = bundle_[r];
    const S k = F[axis];
    K[r] = k;
    z[r] = inverse * k;
    Vector3<S> moment{F[0], F[1], F[2]}, force{F[3], F[4], F[5]};
    if constexpr (kBare) {
      constexpr int i = (Joint::kAxis + 1) % 3, j = (Joint::kAxis + 2) % 3;
      moment[i] -= w.G.angular[i] * k, moment[j] -= w.G.angular[j] * k;
      moment[Joint::kAxis] = S(0.0);
      GRAPNEL_UNROLL
      for (int c = 0; c < 3; ++c) force[c] -= w.G.linear[c] * k;
      if constexpr (kMoving) {
        S free = w.g * k;
        free += w.bias.angular[i] * moment[i], free += w.bias.angular[j] * moment[j];
        free += w.bias.linear[i] * force[i], free += w.bias.linear[j] * force[j];
        acceleration_[r] += free;
        squares_[r] += free * free;
      }
    } else {
      S free(0.0);
      if (!rigid) {
        if constexpr (kMoving) free = w.g * k;
        GRAPNEL_UNROLL
        for (int c = 0; c < 3; ++c) moment[c] -= w.G.angular[c] * k, force[c] -= w.G.linear[c] * k;
      }
      if constexpr (kMoving) {
        GRAPNEL_UNROLL
        for (int c = 0; c < 3; ++c) free += w.bias.angular[c] * moment[c], free += w.bias.linear[c] * force[c];
        acceleration_[r] += free;
        squares_[r] += free * free;
      }
    }
    go_on(link, w, recursion::joint_forth(joint, w, moment), recursion::joint_forth(joint, w, force), F);
  }
}

// Through a spherical joint, which transmits no moment: H^T J^-1 K is subtracted from the force. The joint's own
// acceleration is J^-1 (torque - (I A' + p).angular).
template <class S>
template <bool kMoving>
__attribute__((noinline)) void LaneColumns<S>::pass(recursion::Spherical joint, const TreeLink<S>& link,
                                                    std::span<const S> force, const LinkScratch<S>& w,
                                                    const SlotRows& slot) {
  const auto [rows, K, z] = slot;
  const SymmetricFactor3<S> J(w.I.J);
  const std::size_t v = static_cast<std::size_t>(link.v);
  const Vector3<S> torque{force[v], force[v + 1], force[v + 2]};
  const Vector3<S> own = torque - w.p.angular;
  for (int r = 0; r < rows; ++r) {
    S* F = bundle_[r];
    const Vector3<S> x = J.solve({F[0], F[1], F[2]});
    GRAPNEL_UNROLL
    for (int c = 0; c < 3; ++c) K[c * kMostRows + r] = F[c], z[c * kMostRows + r] = x[c];
    Vector3<S> f{F[3], F[4], F[5]};
    GRAPNEL_UNROLL
    for (int c = 0; c < 3; ++c) f[c] -= w.I.H[0][c] * x[0] + w.I.H[1][c] * x[1] + w.I.H[2][c] * x[2];
    if constexpr (kMoving) {
      const S free = dot(own, x) + dot(w.bias.linear, f);
      acceleration_[r] += free;
      squares_[r] += free * free;
    }
    go_on(link, w, Vector3<S>::zero(), recursion::joint_forth(joint, w, f), F);
  }
}

template <class S>
template <bool kMoving>
void LaneColumns<S>::climb(int first, int end, int rows, const DynamicsInput<S>& in, const Links& links) {
  using namespace recursion;
  for (int s = first; s < end; ++s) {
    const TreeLink<S>& link = link_of(steps_[s].link);
    const LinkScratch<S>& w = links[static_cast<std::size_t>(steps_[s].link)];
    const SlotRows slot{rows, rows_at(K_, steps_[s].slot), rows_at(z_, steps_[s].slot)};
    const bool rigid = is_prescribed(in.prescribed, link);
    visit_joint(link, [&](auto joint) {
      if constexpr (std::is_same_v<decltype(joint), Spherical>) {
        pass<kMoving>(joint, link, in.force, w, slot);  // never prescribed
      } else if constexpr (!kIsRoot<decltype(joint)>) {
        if constexpr (decltype(joint)::kTurns) {
          if (!rigid && !link.has_armature) return pass<kMoving, true>(joint, link, w, false, slot);
        }
        pass<kMoving, false>(joint, link, w, rigid, slot);
      }
    });
  }
}

template <class S>
void LaneColumns<S>::factor_root(RootFactor& root, const TreeLink<S>& link, const LinkScratch<S>& w,
                                 const DynamicsInput<S>& in) {
  S A[6][6];  // below the diagonal: the remaining Schur complement of I
  GRAPNEL_UNROLL
  for (int r = 0; r < 3; ++r) {
    GRAPNEL_UNROLL
    for (int c = 0; c < 3; ++c) A[r][c] = w.I.J(r, c), A[3 + r][3 + c] = w.I.M(r, c), A[3 + c][r] = w.I.H[r][c];
  }
  const std::size_t v = static_cast<std::size_t>(link.v);
  for (std::size_t k = 0; k < 3; ++k) {
    root.y[k] = in.force[v + k] - w.p.angular[static_cast<int>(k)];
    root.y[3 + k] = in.force[v + 3 + k] - w.p.linear[static_cast<int>(k)];
  }
#pragma GCC unroll 6
  for (int j = 0; j < 6; ++j) {
    root.inverse[j] = S(1.0) / A[j][j];
#pragma GCC unroll 6
    for (int i = j + 1; i < 6; ++i) root.L[i][j] = A[i][j] * root.inverse[j];
#pragma GCC unroll 6
    for (int i = j + 1; i < 6; ++i) {
#pragma GCC unroll 6
      for (int k = j + 1; k <= i; ++k) A[i][k] -= root.L[i][j] * A[k][j];
      root.y[i] -= root.L[i][j] * root.y[j];
    }
  }
}

template <class S>
SpatialAcceleration<S> LaneColumns<S>::solve_root(std::size_t link, const ArticulatedInertia<S>& I,
                                                  const Wrench<S>& F) const {
  int k = 0;
  while (k < tables_.loop_count && static_cast<std::size_t>(steps_[chains_[k].root].link) != link) ++k;
  if (k == tables_.loop_count) return solve_articulated(I, F);
  const RootFactor& root = root_factor_[k];
  S x[6] = {F.angular[0], F.angular[1], F.angular[2], F.linear[0], F.linear[1], F.linear[2]};
#pragma GCC unroll 6
  for (int i = 1; i < 6; ++i) {
#pragma GCC unroll 6
    for (int j = 0; j < i; ++j) x[i] -= root.L[i][j] * x[j];
  }
#pragma GCC unroll 6
  for (int i = 5; i >= 0; --i) {
    x[i] = x[i] * root.inverse[i];
#pragma GCC unroll 6
    for (int j = i + 1; j < 6; ++j) x[i] -= root.L[j][i] * x[j];
  }
  return {{x[0], x[1], x[2]}, {x[3], x[4], x[5]}};
}

// At the free root, whose acceleration satisfies I A = F.
template <class S>
template <bool kMoving>
void LaneColumns<S>::arrive(int k) {
  const Chain& chain = chains_[k];
  const RootFactor& root = root_factor_[chain.same_root];
  const int slot = steps_[chain.root].slot;
  S* wrench = root_wrench_.data() + k * 6 * kMostRows;
  for (int r = 0; r < chain.rows; ++r) {
    const S* F = bundle_[r];
    S x[6];  // L^-1 F
    S free(0.0);
#pragma GCC unroll 6
    for (int i = 0; i < 6; ++i) {
      wrench[i * kMostRows + r] = F[i];
      x[i] = F[i];
#pragma GCC unroll 6
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
void LaneColumns<S>::carry(int k, const DynamicsInput<S>& in, const Links& links) {
  const Chain& chain = chains_[k];
  // Factored before the chains are carried; it is a chain of dependent divisions that other operations can overlap.
  if (chain.same_root == k) {
    const int root = steps_[chain.root].link;
    factor_root(root_factor_[k], link_of(root), links[static_cast<std::size_t>(root)], in);
  }
  for (int r = 0; r < chain.rows; ++r) acceleration_[r] = squares_[r] = S(0.0);
  begin_bundle(k, closures_[k].X_aC, false);
  climb<kMoving>(chain.first, chain.end_a, chain.rows, in, links);
  S from_a[kMostRows][6];
  for (int r = 0; r < chain.rows; ++r) {
    for (int c = 0; c < 6; ++c) from_a[r][c] = bundle_[r][c];
  }
  begin_bundle(k, place_[k], true);
  climb<kMoving>(chain.end_a, chain.end_b, chain.rows, in, links);
  for (int r = 0; r < chain.rows; ++r) {
    for (int c = 0; c < 6; ++c) bundle_[r][c] += from_a[r][c];
  }
  climb<kMoving>(chain.end_b, chain.root, chain.rows, in, links);
  arrive<kMoving>(k);
  for (int r = 0; r < chain.rows; ++r) {
    sums_[chain.first_row + r] = acceleration_[r];
    square_sums_[chain.first_row + r] = squares_[r];
  }
}

template <class S>
template <bool kMoving>
void LaneColumns<S>::carry_all(const DynamicsInput<S>& in, const Links& links) {
  for (int k = 0; k < tables_.loop_count; ++k) {
    for (int r = 0; r < chains_[k].rows; ++r)
      scale_[chains_[k].first_row + r] = closures_[k].scale(tables_.loops[k], r);
    carry<kMoving>(k, in, links);
  }
}

template <class S>
void LaneColumns<S>::weigh(LanePivots<S>& pivots) const {
  const auto put = [&](int row, int column, const S& sum) {
    pivots.at(row, column) = S(scale_[row] * scale_[column]) * sum;
  };
  // Closures on different trees have zero blocks between them.
  for (int i = 0; i < room_.rows && tables_.loop_count > 1; ++i) {
    for (int j = 0; j < i; ++j) pivots.at(i, j) = S(0.0);
  }
  for (int k = 0; k < tables_.loop_count; ++k) {
    const Chain& chain = chains_[k];
    const int first = steps_[chain.first].slot, end = steps_[chain.root].slot + 6;
    // Computes all columns of a row together, so that loaded values are reused.
    const auto weigh_row = [&]<int r>(std::integral_constant<int, r>) {
      if (r >= chain.rows) return;
      S sums[r + 1];
#pragma GCC unroll 6
      for (int c = 0; c <= r; ++c) sums[c] = S(0.0);
      for (int s = first; s < end; ++s) {
        const S z = rows_at(z_, s)[r];
        const S* K = rows_at(K_, s);
#pragma GCC unroll 6
        for (int c = 0; c <= r; ++c) sums[c] += z * K[c];
      }
#pragma GCC unroll 6
      for (int c = 0; c <= r; ++c) put(chain.first_row + r, chain.first_row + c, sums[c]);
    };
    [&]<int... r>(std::integer_sequence<int, r...>) { (weigh_row(std::integral_constant<int, r>{}), ...); }
    (std::make_integer_sequence<int, kMostRows>{});
  }
  for (int p = 0; p < pair_count_; ++p) {
    const Pair& pair = pairs_[p];
    const Chain &k = chains_[pair.k], &l = chains_[pair.l];
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

template <class S>
void LaneColumns<S>::impose(const S* rows, std::span<const std::uint8_t> prescribed, Links& links) const {
  for (int k = 0; k < tables_.loop_count; ++k) {
    const Chain& chain = chains_[k];
    const S* x = rows + chain.first_row;
    const auto weighted = [&](const S* of_rows) {
      S sum(0.0);
      for (int r = 0; r < chain.rows; ++r) sum += of_rows[r] * x[r];
      return sum;
    };
    for (int s = chain.first; s < chain.root; ++s) {
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
    LinkScratch<S>& root = links[static_cast<std::size_t>(steps_[chain.root].link)];
    const S* wrench = root_wrench_.data() + k * 6 * kMostRows;
    GRAPNEL_UNROLL
    for (int c = 0; c < 3; ++c) {
      root.p.angular[c] -= weighted(wrench + c * kMostRows);
      root.p.linear[c] -= weighted(wrench + (3 + c) * kMostRows);
    }
  }
}

template <class S>
void LaneColumns<S>::release(Links& links) const {
  for (int s = 0; s < step_count_; ++s) {
    LinkScratch<S>& w = links[static_cast<std::size_t>(steps_[s].link)];
    w.g = S(0.0), w.p = Wrench<S>::zero();
  }
}

}  // namespace grapnel::lanes
