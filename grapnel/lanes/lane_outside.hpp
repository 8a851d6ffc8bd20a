#pragma once

/// @file
/// External loads in packs: gravity, the field near an orbit, loads, attitude control of a base, and the rates of the
/// integrals of the conservation checks. Equations as in simulate/{orbit,external_load,attitude_control,
/// phase_integrals}.hpp. PhaseDynamics evaluates them per body, lanes per link. The bodies of a link are rigidly
/// connected, so the wrenches of the field on them add up to that on the link.

#include "grapnel/dynamics/link_motion_kernel.hpp"
#include "grapnel/lanes/lane_free_bodies.hpp"
#include "grapnel/lanes/lane_phase_tables.hpp"
#include "grapnel/simulate/attitude_control.hpp"
#include "grapnel/simulate/orbit.hpp"
#include "grapnel/simulate/phase_integrals.hpp"
#include "grapnel/spatial/pack.hpp"

namespace grapnel::lanes {

/// The eccentric anomaly E of M = E - e sin E (14.1) for any M; see simulate/orbit.cpp. Converged lanes are unchanged
/// while others iterate.
template <class S>
S eccentric_anomaly(const S& any_M, const S& e) {
  constexpr double kTurn = 6.28318530717958647693, kRound = sine_cosine_detail::kRound;
  const S shifted = any_M * S(1 / kTurn) + S(kRound);
  const S M = any_M - S(shifted - S(kRound)) * S(kTurn);
  const S from_side = select(M < S(0.0), S(-0.5 * kTurn), S(0.5 * kTurn));
  S E = select(e < S(0.8), S(M + e * sine_cosine(M).sine), from_side);
  auto open = S::Mask::from_bits(S::Mask::kAllBits);
  constexpr int kMost = 30;
  for (int i = 0; i < kMost && any(open); ++i) {
    const SineCosine<S> at = sine_cosine(E);
    const S step = S(S(E - e * at.sine) - M) / S(S(1.0) - e * at.cosine);
    E = select(open, E - step, E);
    open = open & (abs(step) > S(1e-15));
  }
  return E;
}

template <class S>
class LaneOutside {
 public:
  /// `free`: links that are free bodies without children; used only here and in push().
  LaneOutside(const PhaseTables& tables, const LaneFreeBodies<S>& free);

  bool acts() const { return tables_.outside.acts(); }
  /// Loads a case's numbers into a lane.
  void load_case(int lane, const CaseRecord& record);

  /// Evaluates the attitude control law in a state; attitude_torque() holds the result.
  void steer(std::span<const S> q, std::span<const S> v) { attitude_torque_ = law_torque(q, v); }
  /// Places the links of a state and computes the external loads at time t, including the present attitude_torque().
  /// `block`: the interval's block. `thrust`: linear function of time for the thrusters' wrench (kLoadLine...), in the
  /// base's axes about its origin; not read without thrusters.
  void act(const Tree<S>& tree, const S& t, const S* block, const S* thrust, std::span<const S> q,
           std::span<const S> v);
  /// Torque of the attitude control, in the base's axes [N m].
  Vector3<S>& attitude_torque() { return attitude_torque_; }
  // The following refer to the state of the last act().
  /// Wrenches on the links that are not free bodies, in their order: about the link's origin, in its axes, without
  /// gravity.
  const Wrench<S>* on_jointed() const { return on_link_.data(); }
  Vector3<S> gravity() const { return vector(kGravity); }
  /// Adds to the accelerations of the free bodies without children.
  void push(const LaneFreeBodies<S>& free, S* vdot) const;
  /// Adds to the rates of phase_integral.
  void add_rates(const Tree<S>& tree, S* rates);
  /// Then adds the contribution of the wrench that holds a root's link: about the link's origin, in its axes.
  void add_ground(int link, const Wrench<S>& F_L, S* rates) const;
  /// Adds the magnitudes of both to the rates of TreeExchange, per tree.
  void add_exchange(S* rates) const;
  void add_ground_exchange(int link, const Wrench<S>& F_L, S* rates) const;

 private:
  using TreeMotion = phase_integral::TreeMotion<S>;

  GRAPNEL_INLINE Vector3<S> vector(int at) const { return {numbers_[at], numbers_[at + 1], numbers_[at + 2]}; }
  void mark(int link) { is_acted_on_[link] = 1; }
  OrbitConstants<S> orbit() const;
  BasicOrbitPoint<S> orbit_at(const S& t) const;
  void act_on_orbit(const Tree<S>& tree, const BasicOrbitPoint<S>& at);
  Wrench<S> on_line(const S* line, const S& t) const;
  Wrench<S> profile(const LoadTable& load, const S* n, const S* load_block, const S& t, S& factor) const;
  void act_by(const LoadTable& load, const S* n, const S* load_block, const S& t, const BasicOrbitPoint<S>& at);
  Vector3<S> stream_force(const LoadTable& load, const S* n, const Vector3<S>& direction,
                          const Vector3<S>& normal) const;
  Vector3<S> law_torque(std::span<const S> q, std::span<const S> v) const;
  void measure_trees(const Tree<S>& tree);

  const PhaseTables& tables_;
  LaneArray<S> numbers_;  // the cases' numbers
  LaneArray<S, std::uint8_t> is_acted_on_;
  LaneArray<S, int> slot_;               // of a link in on_link_; links that are not free bodies come first
  LaneArray<S, Vector3<S>> com_;         // per link, in its frame,
  LaneArray<S, Symmetric3<S>> central_;  // and its inertia about that
  LaneArray<S, LinkMotion<S>> motion_;   // per link
  LaneArray<S, Wrench<S>> wrench_;       // per link, about its origin, in W
  LaneArray<S, Wrench<S>> on_link_;      // per slot, in the link's axes
  LaneArray<S, TreeMotion> trees_;
  LaneArray<S> inverse_mass_;  // per tree
  Vector3<S> attitude_torque_ = Vector3<S>::zero();
};

template <class S>
LaneOutside<S>::LaneOutside(const PhaseTables& tables, const LaneFreeBodies<S>& free)
    : tables_(tables),
      numbers_(tables.outside_numbers),
      is_acted_on_(tables.link_count),
      slot_(tables.link_count),
      com_(tables.link_count),
      central_(tables.link_count),
      motion_(tables.link_count),
      wrench_(tables.link_count),
      on_link_(tables.link_count),
      trees_(tables.tree_count),
      inverse_mass_(tables.tree_count) {
  int next = 0;
  for (int i = 0; i < tables.link_count; ++i) {
    if (!free.holds(i)) slot_[i] = next++;
  }
  for (int i = 0; i < tables.link_count; ++i) {
    if (free.holds(i)) slot_[i] = next++;
    if (tables.outside.has_orbit) mark(i);
  }
  for (int k = 0; k < tables.outside.load_count; ++k) mark(tables.loads[k].link);
  if (tables.outside.has_outer_torque || tables.outside.has_thrusters) mark(tables.outside.attitude_link);
}

template <class S>
void LaneOutside<S>::load_case(int lane, const CaseRecord& record) {
  for (int i = 0; i < tables_.outside_numbers; ++i) numbers_[i].set(lane, record.outside[i]);
  if (!acts()) return;
  for (int t = 0; t < tables_.tree_count; ++t) trees_[t].mass.set(lane, 0.0);
  for (int i = 0; i < tables_.link_count; ++i) {
    const double* n = record.links + static_cast<long>(i) * kLinkNumbers;
    const CentralInertia<S> I(n);
    for (int k = 0; k < 3; ++k) com_[i][k].set(lane, I.com[k]);
    set_lane(lane, central_[i], I.J);
    S& mass = trees_[tables_.tree_of[i]].mass;
    mass.set(lane, mass.get(lane) + n[kLinkMass]);
  }
  for (int t = 0; t < tables_.tree_count; ++t) inverse_mass_[t].set(lane, 1 / trees_[t].mass.get(lane));
}

// --- The field near an orbit -----------------------------------------------------------------------------------------

template <class S>
OrbitConstants<S> LaneOutside<S>::orbit() const {
  const auto n = [&](int i) { return numbers_[kOrbit + i]; };
  return {n(0),
          n(1),
          n(2),
          n(3),
          n(4),
          n(5),
          n(6),
          n(7),
          vector(kOrbit + 8),
          vector(kOrbit + 11),
          vector(kOrbit + 14),
          vector(kOrbit + 17)};
}

template <class S>
BasicOrbitPoint<S> LaneOutside<S>::orbit_at(const S& t) const {
  const OrbitConstants<S> constants = orbit();
  const S M = constants.mean_anomaly + constants.mean_motion * t;
  const S E = tables_.outside.is_circular ? M : eccentric_anomaly(M, constants.eccentricity);
  return orbit_point(constants, t, sine_cosine(E));
}

// Field on every link at its centre of mass: (14.2), (14.3).
template <class S>
void LaneOutside<S>::act_on_orbit(const Tree<S>& tree, const BasicOrbitPoint<S>& at) {
  for (int i = 0; i < tables_.link_count; ++i) {
    const Pose<S>& X_WL = motion_[i].X_WL;
    const Vector3<S> arm = X_WL.R * com_[i];
    const Vector3<S> force =
        tree.links[static_cast<std::size_t>(i)].inertia.mass * tidal_acceleration<S>(at, X_WL.p + arm);
    wrench_[i] += Wrench<S>{gravity_gradient_torque<S>(at, X_WL.R, central_[i]) + cross(arm, force), force};
  }
}

// --- Loads -----------------------------------------------------------------------------------------------------------

// Linear interpolation in time.
template <class S>
GRAPNEL_INLINE Wrench<S> LaneOutside<S>::on_line(const S* line, const S& t) const {
  const S since = t - line[kLoadLineStart];
  const auto now = [&](int k) -> S { return line[kLoadLineWrench + k] + since * line[kLoadLineRate + k]; };
  return {{now(0), now(1), now(2)}, {now(3), now(4), now(5)}};
}

// A load's wrench in its own components, see wrench_at(); `factor`: see factor_at().
template <class S>
Wrench<S> LaneOutside<S>::profile(const LoadTable& load, const S* n, const S* load_block, const S& t, S& factor) const {
  if (load.kind == LoadTable::Kind::line) return on_line(load_block, t);
  factor = load_block[kLoadActs];
  if (load.kind == LoadTable::Kind::sine) {
    const S angle = load_block[kLoadFrequency] * S(t - load_block[kLoadStart]) + load_block[kLoadPhase];
    factor *= sine_cosine(angle).sine;
  }
  const S* a = n + kLoadAmplitude;
  return {factor * Vector3<S>{a[0], a[1], a[2]}, factor * Vector3<S>{a[3], a[4], a[5]}};
}

// See stream_force(Stream, ...).
template <class S>
Vector3<S> LaneOutside<S>::stream_force(const LoadTable& load, const S* n, const Vector3<S>& direction,
                                        const Vector3<S>& normal) const {
  const S incidence = -dot(direction, normal);
  const S facing = load.both_sides ? abs(incidence) : max(incidence, S(0.0));
  const S side = select(incidence < S(0.0), S(-1.0), S(1.0));
  return force_on_facing_side<S>(n[kLoadReach], n[kLoadSpecular], n[kLoadDiffuse], facing, direction, side * normal);
}

template <class S>
void LaneOutside<S>::act_by(const LoadTable& load, const S* n, const S* load_block, const S& t,
                            const BasicOrbitPoint<S>& at) {
  const Rotation<S>& R_WL = motion_[load.link].X_WL.R;
  S factor(1.0);
  Wrench<S> F = profile(load, n, load_block, t, factor);
  if (load.frame == LoadFrame::body) F = R_WL * F;
  if (load.frame == LoadFrame::orbit) F = at.R_WO * F;
  if (load.has_stream) {
    const Vector3<S> d{n[kLoadDirection], n[kLoadDirection + 1], n[kLoadDirection + 2]};
    const Vector3<S> normal{n[kLoadNormal], n[kLoadNormal + 1], n[kLoadNormal + 2]};
    const Vector3<S> direction = load.frame == LoadFrame::orbit ? at.R_WO * d : d;
    F.linear += factor * stream_force(load, n, direction, R_WL * normal);
  }
  const Vector3<S> arm = R_WL * Vector3<S>{n[kLoadPoint], n[kLoadPoint + 1], n[kLoadPoint + 2]};
  wrench_[load.link] += Wrench<S>{F.angular + cross(arm, F.linear), F.linear};
}

// --- Attitude control ------------------------------------------------------------------------------------------------

template <class S>
Vector3<S> LaneOutside<S>::law_torque(std::span<const S> q, std::span<const S> v) const {
  const int i = tables_.outside.attitude_link;
  const S* o = q.data() + tables_.links[i].q + 3;
  const S* w = v.data() + tables_.links[i].v;
  const S* n = numbers_.data() + kAttitude;
  const control_law::AttitudeLaw<S> law{
      {n[0], n[1], n[2], n[3]}, {n[4], n[5], n[6]}, {n[7], n[8], n[9]}, {n[10], n[11], n[12]}};
  return control_law::attitude_torque<S>(law, {o[0], o[1], o[2], o[3]}, {w[0], w[1], w[2]},
                                         [](const S& sine, const S& cosine) { return turn_per_sine(sine, cosine); });
}

// --- All external loads
// ------------------------------------------------------------------------------------------------

template <class S>
void LaneOutside<S>::act(const Tree<S>& tree, const S& t, const S* block, const S* thrust, std::span<const S> q,
                         std::span<const S> v) {
  link_motion<S>(tree, q, v, std::span<LinkMotion<S>>(motion_.data(), tree.links.size()));
  for (int i = 0; i < tables_.link_count; ++i) wrench_[i] = Wrench<S>::zero();
  BasicOrbitPoint<S> at;
  if (tables_.outside.has_orbit) {
    at = orbit_at(t);
    act_on_orbit(tree, at);
  }
  for (int k = 0; k < tables_.outside.load_count; ++k) {
    const LoadTable& load = tables_.loads[k];
    act_by(load, numbers_.data() + kLoads + k * kLoadNumbers, block + load.block_offset, t, at);
  }
  if (tables_.outside.has_thrusters) {
    const Rotation<S>& R_WL = motion_[tables_.outside.attitude_link].X_WL.R;
    wrench_[tables_.outside.attitude_link] += R_WL * on_line(thrust, t);
  }
  if (tables_.outside.has_outer_torque) {
    const int base = tables_.outside.attitude_link;
    wrench_[base].angular += motion_[base].X_WL.R * attitude_torque_;
  }
  for (int i = 0; i < tables_.link_count; ++i) {
    if (is_acted_on_[i] != 0) on_link_[slot_[i]] = transposed_times(motion_[i].X_WL.R, wrench_[i]);
  }
}

template <class S>
void LaneOutside<S>::push(const LaneFreeBodies<S>& free, S* vdot) const {
  for (int i = 0; i < tables_.link_count; ++i) {
    if (!free.holds(i) || (is_acted_on_[i] == 0 && !tables_.outside.has_gravity)) continue;
    const Vector3<S> weight =
        tables_.outside.has_gravity ? transposed_times(motion_[i].X_WL.R, gravity()) : Vector3<S>::zero();
    free.push(i, on_link_[slot_[i]], weight, vdot);
  }
}

// Centres of mass of the trees, and their velocities: of the root, plus the mean difference from it, as
// PhaseDynamics::measure_trees().
template <class S>
void LaneOutside<S>::measure_trees(const Tree<S>& tree) {
  for (int i = 0; i < tables_.link_count; ++i) {
    const RigidBodyInertia<S>& I = tree.links[static_cast<std::size_t>(i)].inertia;
    const LinkMotion<S>& m = motion_[i];
    const Vector3<S> arm = m.X_WL.R * I.first_moment;  // times the mass
    TreeMotion& one = trees_[tables_.tree_of[i]];
    if (tree.links[static_cast<std::size_t>(i)].parent < 0)
      one.com = one.velocity = Vector3<S>::zero(), one.of_root = m.V_WL.linear;
    one.com += I.mass * m.X_WL.p + arm;
    one.velocity += I.mass * (m.V_WL.linear - one.of_root) + cross(m.V_WL.angular, arm);
  }
  for (int t = 0; t < tables_.tree_count; ++t) {
    trees_[t].com *= inverse_mass_[t];
    trees_[t].velocity = trees_[t].of_root + inverse_mass_[t] * trees_[t].velocity;
  }
}

template <class S>
void LaneOutside<S>::add_rates(const Tree<S>& tree, S* rates) {
  measure_trees(tree);
  if (tables_.outside.has_gravity) {
    for (int t = 0; t < tables_.tree_count; ++t) phase_integral::add_weight<S>(rates, t, trees_[t], gravity());
  }
  for (int i = 0; i < tables_.link_count; ++i) {
    if (is_acted_on_[i] == 0) continue;
    const int t = tables_.tree_of[i];
    phase_integral::add_wrench<S>(rates, t, trees_[t], wrench_[i].linear, motion_[i].X_WL.p, wrench_[i].angular,
                                  dot(wrench_[i], motion_[i].V_WL));
  }
}

template <class S>
void LaneOutside<S>::add_ground(int link, const Wrench<S>& F_L, S* rates) const {
  const int t = tables_.tree_of[link];
  const Pose<S>& X_WL = motion_[link].X_WL;
  const Wrench<S> F = X_WL.R * F_L;
  phase_integral::add_wrench<S>(rates, t, trees_[t], F.linear, X_WL.p, F.angular, S(0.0));
}

template <class S>
void LaneOutside<S>::add_exchange(S* rates) const {
  using namespace phase_integral;
  for (int t = 0; tables_.outside.has_gravity && t < tables_.tree_count; ++t)
    rates[kExchangeCount * t + kExchangedImpulse] += trees_[t].mass * norm(gravity());
  for (int i = 0; i < tables_.link_count; ++i) {
    if (is_acted_on_[i] == 0) continue;
    const int t = tables_.tree_of[i];
    phase_integral::add_exchange<S>(rates + kExchangeCount * t, trees_[t], wrench_[i].linear, motion_[i].X_WL.p,
                                    wrench_[i].angular, dot(wrench_[i], motion_[i].V_WL));
  }
}

template <class S>
void LaneOutside<S>::add_ground_exchange(int link, const Wrench<S>& F_L, S* rates) const {
  using namespace phase_integral;
  const int t = tables_.tree_of[link];
  const Pose<S>& X_WL = motion_[link].X_WL;
  const Wrench<S> F = X_WL.R * F_L;
  phase_integral::add_exchange<S>(rates + kExchangeCount * t, trees_[t], F.linear, X_WL.p, F.angular, S(0.0));
}

}  // namespace grapnel::lanes
