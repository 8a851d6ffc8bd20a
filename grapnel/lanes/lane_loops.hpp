#pragma once

/// @file
/// Closed loops in packs: accelerations with the closures' multipliers, and the projection that keeps loops closed,
/// section 8 of docs/theory. Corresponds to constraint/constrained_dynamics.hpp for single cases, with the same
/// equations. All lanes share the rows (lane_columns.hpp); pivots and ranks are per lane (lane_pivots.hpp). A case with
/// a doubtful rank or loops that cannot be closed leaves the lanes (LaneStatus::loops_in_doubt). Rounding errors, which
/// differ from those of single cases, would decide the rank, and only a single run reports the cause of a failure.

#include "grapnel/constraint/loop_limits.hpp"
#include "grapnel/dynamics/articulated_body_kernel.hpp"
#include "grapnel/lanes/lane_closure.hpp"
#include "grapnel/lanes/lane_columns.hpp"
#include "grapnel/lanes/lane_pivots.hpp"

namespace grapnel::lanes {

/// Result of a projection.
template <class S>
struct LaneProjection {
  LaneDefect<S> before = LaneDefect<S>::none();  // maximum over the closures
  unsigned changed = 0;                          // lanes in which anything changed
  unsigned failed = 0;                           // lanes whose loops are not closed
};

template <class S>
class LaneLoops {
 public:
  using Mask = typename S::Mask;

  /// `tree`: the integrated tree; call lay_out() once it is complete.
  LaneLoops(const PhaseTables& tables, const Tree<S>& tree);
  /// `place`: index in the tree of each link of the tables.
  void lay_out(const LaneArray<S, int>& place) { columns_.lay_out(place); }

  bool any() const { return tables_.loop_count > 0; }
  /// Loads a case's numbers into a lane.
  void load_case(int lane, const double* numbers) { columns_.load_case(lane, numbers); }
  const LaneClosure<S>& closure(int k) const { return columns_.closure(k); }

  /// As articulated_body(), with the closures' multipliers: (8.6).
  void accelerate(const DynamicsInput<S>& in, DynamicsWorkspace<S>& workspace, std::span<S> vdot, std::span<S> force);
  /// Lanes in which no motion satisfies the closures of the last accelerate().
  const Mask& contradicted() const { return contradicted_; }
  /// Number of independent rows of the last accelerate().
  const S& rank() const { return pivots_.rank(); }
  /// Lanes with a doubtful rank since the last call.
  unsigned take_doubts() {
    const unsigned doubts = doubts_;
    doubts_ = 0;
    return doubts;
  }

  /// In these lanes, projects coordinates, then velocities onto the closures in the mass metric: (8.9), (8.10). Leaves
  /// lanes unchanged whose defects are all at most `negligible`. Prescribed velocities do not change.
  LaneProjection<S> project(const Mask& lanes, std::span<const std::uint8_t> prescribed,
                            DynamicsWorkspace<S>& workspace, std::span<S> q, std::span<S> v, double negligible);

 private:
  // A projection continues while a defect exceeds this value [m, rad, and these per second].
  static constexpr double kRounding = 3e-15;

  using Links = typename LaneColumns<S>::Links;

  template <bool kMoving>
  void prepare(const DynamicsInput<S>& in, const Links& links);
  void take_rows(int k, const Vector3<S>& angular, const Vector3<S>& linear, S* rows) const;
  Twist<S> at_C(int k, const LinkScratch<S>& a) const;
  Twist<S> at_D(int k, const LinkScratch<S>& b) const;
  S acceleration_rows(const Links& links, S* u);
  S acceleration_size(const Links& links) const;
  S velocity_rows(const Links& links, S* u);
  Vector3<S> turn_apart(int k, const Rotation<S>& R_CD) const;
  LaneDefect<S> defects(const Links& links);
  S scaled_size(const S* u) const;

  void solve(const S* u);
  void sweep_outward(const DynamicsInput<S>& in, DynamicsWorkspace<S>& workspace, std::span<S> vdot,
                     std::span<S> force);
  DynamicsInput<S> at_rest(std::span<const S> q, std::span<const std::uint8_t> prescribed) const;
  void inertias_at_rest(const DynamicsInput<S>& rest, DynamicsWorkspace<S>& workspace);
  void respond(const DynamicsInput<S>& rest, DynamicsWorkspace<S>& workspace);
  void move_all(std::span<const S> q, std::span<const S> v, Links& links);
  void step_coordinates(S* q) const;
  void close_places(Mask active, const DynamicsInput<S>& rest, DynamicsWorkspace<S>& workspace, std::span<S> q,
                    std::span<S> v, LaneProjection<S>& result);
  void close_motion(Mask active, const DynamicsInput<S>& rest, DynamicsWorkspace<S>& workspace, std::span<S> q,
                    std::span<S> v, LaneProjection<S>& result);

  const PhaseTables& tables_;
  const Tree<S>& tree_;
  LaneColumns<S> columns_;
  LanePivots<S> pivots_;
  LaneArray<S> u_, rhs_, residual_, solution_, rows_;  // per row
  LaneArray<S> zero_, step_, ignored_, trial_q_;
  LaneArray<S> last_v_;
  Mask contradicted_ = Mask::from_bits(0);
  unsigned doubts_ = 0;
};

template <class S>
LaneLoops<S>::LaneLoops(const PhaseTables& tables, const Tree<S>& tree)
    : tables_(tables),
      tree_(tree),
      columns_(tables, tree),
      pivots_(columns_.rows()),
      u_(columns_.rows()),
      rhs_(columns_.rows()),
      residual_(columns_.rows()),
      solution_(columns_.rows()),
      rows_(columns_.rows()),
      zero_(any() ? tables.velocities : 0),
      step_(any() ? tables.velocities : 0),
      ignored_(any() ? tables.velocities : 0),
      trial_q_(any() ? tables.coordinates : 0),
      last_v_(any() ? tables.velocities : 0) {}

// --- Accelerations. -------------------------------------------------------------------------------------------------

// Factors the scaled W for the articulated inertias in `links`.
template <class S>
template <bool kMoving>
void LaneLoops<S>::prepare(const DynamicsInput<S>& in, const Links& links) {
  columns_.template carry_all<kMoving>(in, links);
  columns_.weigh(pivots_);
  pivots_.factor();
}

// --- Relative motion of C and D, as rows. ---------------------------------------------------------------------------

template <class S>
GRAPNEL_INLINE void LaneLoops<S>::take_rows(int k, const Vector3<S>& angular, const Vector3<S>& linear, S* rows) const {
  const LoopTable& table = tables_.loops[k];
  for (int r = 0; r < table.turn_rows; ++r) rows[r] = dot(columns_.closure(k).turn_C[r], angular);
  for (int c = 0; c < table.push_rows; ++c) rows[table.turn_rows + c] = linear[c];
}

// Twists of both sides at C, in its axes.
template <class S>
GRAPNEL_INLINE Twist<S> LaneLoops<S>::at_C(int k, const LinkScratch<S>& a) const {
  return transposed_times(columns_.closure(k).X_aC.R, shift(a.V, columns_.closure(k).X_aC.p));
}
template <class S>
GRAPNEL_INLINE Twist<S> LaneLoops<S>::at_D(int k, const LinkScratch<S>& b) const {
  return transposed_times(columns_.X_bC(k).R, shift(b.V, columns_.X_bC(k).p));
}

// Rows of the relative acceleration due to forces alone, and, for redundant rows, the size of its terms.
template <class S>
S LaneLoops<S>::acceleration_rows(const Links& links, S* u) {
  const bool sizes = !pivots_.all_independent();
  S most(0.0);
  for (int k = 0; k < tables_.loop_count; ++k) {
    const Twist<S> V_C = at_C(k, columns_.link_a(k, links)), V_D = at_D(k, columns_.link_b(k, links));
    // The components of V_D in C change by A_D - V_C x V_D.                                               (8.5)
    const SpatialAcceleration<S> cross = cross_motion(V_C, V_D);
    S turning[LaneColumns<S>::kMostRows];
    take_rows(k, cross.angular, cross.linear, turning);
    for (int r = 0; r < tables_.loops[k].rows(); ++r) {
      const int row = columns_.first_row(k) + r;
      u[row] = columns_.free_acceleration(row) + turning[r];
      if (!sizes) continue;
      const S terms = columns_.free_acceleration_squares(row) + turning[r] * turning[r];
      most = max(most, S(S(columns_.scale(row) * columns_.scale(row)) * terms));
    }
  }
  return sqrt(most);
}

// Scaled magnitude of the accelerations of the closures' bodies, gravity included, bounded below by the negligible
// acceleration.
template <class S>
S LaneLoops<S>::acceleration_size(const Links& links) const {
  const S unnoticed(loop_limits::kUnnoticed);
  S size(0.0);
  for (int k = 0; k < tables_.loop_count; ++k) {
    const SpatialAcceleration<S>&A = columns_.link_a(k, links).A, &B = columns_.link_b(k, links).A;
    const S angular = max(max(norm(A.angular), norm(B.angular)), unnoticed);
    const S linear = max(max(norm(A.linear), norm(B.linear)), unnoticed);
    size = max(size, S(columns_.closure(k).angular_scale * angular));
    size = max(size, S(columns_.closure(k).linear_scale * linear));
  }
  return size;
}

// Rows of the relative twist, and the size of its terms.
template <class S>
S LaneLoops<S>::velocity_rows(const Links& links, S* u) {
  S size(0.0);
  for (int k = 0; k < tables_.loop_count; ++k) {
    const LinkScratch<S>&a = columns_.link_a(k, links), &b = columns_.link_b(k, links);
    const Twist<S> V_C = at_C(k, a), V_D = at_D(k, b);
    take_rows(k, V_C.angular - V_D.angular, V_C.linear - V_D.linear, u + columns_.first_row(k));
    size = max(size, S(columns_.closure(k).angular_scale * S(norm(a.V.angular) + norm(b.V.angular))));
    size = max(size, S(columns_.closure(k).linear_scale * S(norm(a.V.linear) + norm(b.V.linear))));
  }
  return size;
}

// Rotation of D relative to C in the directions that the grasp constrains, in C, (8.4). Rotations close to pi give NaN
// or wrong values; projection does not close loops with defects of that size.
template <class S>
Vector3<S> LaneLoops<S>::turn_apart(int k, const Rotation<S>& R_CD) const {
  const LoopTable& table = tables_.loops[k];
  const S one(1.0), half(0.5);
  if (table.turns == 3) {
    // The vector part of the quaternion is half the skew part over w.
    const Rotation<S>& R = R_CD;
    const S w = half * sqrt(S(one + (S(R(0, 0) + R(1, 1)) + R(2, 2))));
    const S f = S(0.25) / w;
    const Vector3<S> vector{S(f * S(R(2, 1) - R(1, 2))), S(f * S(R(0, 2) - R(2, 0))), S(f * S(R(1, 0) - R(0, 1)))};
    return turn_per_sine(norm(vector), w) * vector;
  }
  if (table.turns == 2) {
    // From one axis to the other: the cross product is twice the sine and the cosine of half the angle.
    const Vector3<S>& hinge_C = columns_.closure(k).hinge_C;
    const Vector3<S> axis = R_CD * hinge_C;
    const Vector3<S> cross_product = cross(hinge_C, axis);
    const S w = sqrt(S(half + half * dot(hinge_C, axis)));
    const S f = half / w;
    return S(f * turn_per_sine(S(f * norm(cross_product)), w)) * cross_product;
  }
  return Vector3<S>::zero();
}

// Maximum defects over the closures from poses and twists, also in directions without a row. Leaves the position
// defects in u_, as rows of C minus D.
template <class S>
LaneDefect<S> LaneLoops<S>::defects(const Links& links) {
  LaneDefect<S> largest = LaneDefect<S>::none();
  for (int k = 0; k < tables_.loop_count; ++k) {
    const Pose<S> X_CD = inverse(columns_.X_bC(k)) * columns_.closure(k).X_bD;
    const Vector3<S> turn = turn_apart(k, X_CD.R);
    take_rows(k, -turn, -X_CD.p, u_.data() + columns_.first_row(k));
    const Twist<S> V_C = at_C(k, columns_.link_a(k, links)), V_D = at_D(k, columns_.link_b(k, links));
    Vector3<S> spin = V_C.angular - V_D.angular;
    const int turns = tables_.loops[k].turns;
    if (turns == 2) spin -= dot(spin, columns_.closure(k).hinge_C) * columns_.closure(k).hinge_C;
    if (turns == 0) spin = Vector3<S>::zero();
    largest.raise({norm(X_CD.p), norm(turn), norm(Vector3<S>(V_C.linear - V_D.linear)), norm(spin)});
  }
  return largest;
}

template <class S>
S LaneLoops<S>::scaled_size(const S* u) const {
  S most(0.0);
  for (int i = 0; i < columns_.rows(); ++i) most = max(most, abs(S(columns_.scale(i) * u[i])));
  return most;
}

// --- Accelerations. -------------------------------------------------------------------------------------------------

// Solves W rows = -u for rows_; residual_ receives the inconsistency of redundant rows.
template <class S>
void LaneLoops<S>::solve(const S* u) {
  for (int i = 0; i < columns_.rows(); ++i) rhs_[i] = -(columns_.scale(i) * u[i]);
  pivots_.solve(rhs_.data(), solution_.data(), residual_.data());
  for (int i = 0; i < columns_.rows(); ++i) rows_[i] = columns_.scale(i) * solution_[i];
}

// The third sweep, reusing the factors of the roots.
template <class S>
void LaneLoops<S>::sweep_outward(const DynamicsInput<S>& in, DynamicsWorkspace<S>& workspace, std::span<S> vdot,
                                 std::span<S> force) {
  articulated_body_steps::outward_accelerations<S>(
      tree_, in, workspace, {vdot, force},
      [this](std::size_t n, const TreeLink<S>&, const LinkScratch<S>& w, const Wrench<S>& F) {
        return columns_.solve_root(n, w.I, F);
      });
}

template <class S>
void LaneLoops<S>::accelerate(const DynamicsInput<S>& in, DynamicsWorkspace<S>& workspace, std::span<S> vdot,
                              std::span<S> force) {
  using namespace loop_limits;
  Links& links = workspace.links;
  articulated_inertias<S>(tree_, in, workspace);
  columns_.locate_all(links);
  prepare<true>(in, links);
  doubts_ |= pivots_.doubtful();
  const S size = acceleration_rows(links, u_.data());  // J M^-1 phi + Jdot v
  solve(u_.data());                                    // (8.6)
  columns_.impose(rows_.data(), in.prescribed, links);
  sweep_outward(in, workspace, vdot, force);
  contradicted_ = Mask::from_bits(0);
  if (pivots_.all_independent()) return;  // no redundant row, therefore no inconsistency
  S worst(0.0);
  for (int i = 0; i < columns_.rows(); ++i) worst = max(worst, abs(residual_[i]));
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

// articulated_inertias() at rest without forces: all velocities and biases are zero.
template <class S>
void LaneLoops<S>::inertias_at_rest(const DynamicsInput<S>& rest, DynamicsWorkspace<S>& workspace) {
  articulated_body_steps::place_links(tree_, rest.q, workspace.links);
  for (LinkScratch<S>& w : workspace.links) {
    w.carries = false;
    w.p = Wrench<S>::zero(), w.bias = SpatialAcceleration<S>::zero();
  }
  articulated_body_steps::inward_inertias(tree_, rest, workspace);
}

// Velocity change step_ due to impulses rows_, after articulated_inertias() at rest.
template <class S>
void LaneLoops<S>::respond(const DynamicsInput<S>& rest, DynamicsWorkspace<S>& workspace) {
  const std::size_t n = static_cast<std::size_t>(tables_.velocities);
  columns_.release(workspace.links);
  columns_.impose(rows_.data(), rest.prescribed, workspace.links);
  sweep_outward(rest, workspace, std::span<S>(step_.data(), n), std::span<S>(ignored_.data(), n));
}

// Twists of links at v, with q also their angles and offsets, and the poses of the closures. Articulated inertias are
// unchanged.
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
  if (!q.empty()) columns_.locate_all(links);
}

// Moves q by step_; positions move along their body's axes.
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
      GRAPNEL_UNROLL
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

// Newton's method with the present factor.                                                                      (8.9)
template <class S>
void LaneLoops<S>::close_places(Mask active, const DynamicsInput<S>& rest, DynamicsWorkspace<S>& workspace,
                                std::span<S> q, std::span<S> v, LaneProjection<S>& result) {
  using namespace loop_limits;
  S defect = result.before.largest_of_place();
  active = active & (defect > S(kRounding));
  bool returned = false;
  for (int i = 0; i < kMaxIterations && active.bits() != 0; ++i) {
    // Small defects need one factor for all iterations; lanes with large defects are excluded.
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
    // Converged or stalled: the defect is not halved.
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
  for (int i = 0; i < kMaxIterations && active.bits() != 0; ++i) {
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
  // Prescribed joints may leave no compatible velocity; rounding errors of their trajectories do not count.
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
  inertias_at_rest(rest, workspace);
  move_all({}, v, workspace.links);
  columns_.locate_all(workspace.links);
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
