#pragma once

/// @file
/// The right-hand side of one phase in packs: one case per lane, all of one structure. Corresponds to PhaseDynamics for
/// single cases; the equations are in simulate/phase_dynamics.hpp. The state is y = [q; v; integrals]: the work of
/// motors and of friction, and all other integrals if external loads act. Both share the templates for control laws,
/// friction, external loads and kernels (simulate/{joint_control,attitude_control,orbit,external_load,
/// phase_integrals}.hpp, dynamics/*_kernel.hpp). The order of evaluation is implemented separately: PhaseDynamics
/// handles events in between, and lanes skip the features that no case has. Closed loops are in lane_loops.hpp.
///
/// A Tree<Pack> has one structure for all lanes (parents, kinds of joints, axes, which frames are rotated, which joints
/// have rotors) and numbers per lane.
///
/// Root motion is integrated within a step and recomputed from the conserved momenta at its end (settle). This prevents
/// drift and saves one sweep per stage.

#include "grapnel/dynamics/articulated_body_kernel.hpp"
#include "grapnel/dynamics/link_motion_kernel.hpp"
#include "grapnel/dynamics/root_velocity_kernel.hpp"
#include "grapnel/lanes/lane_free_bodies.hpp"
#include "grapnel/lanes/lane_loops.hpp"
#include "grapnel/lanes/lane_outside.hpp"
#include "grapnel/lanes/lane_phase_tables.hpp"
#include "grapnel/lanes/lane_wheels.hpp"
#include "grapnel/spatial/pack.hpp"

namespace grapnel::lanes {

// Joint sensor noise (simulate/tracking_noise.hpp) in packs. Implemented separately, since 24 cosines per stage would
// cost more than the dynamics. Within one step the noise is its Taylor series about the step's middle, whose
// coefficients need one sine and cosine per tone and step.

template <class S>
class LaneNoise {
 public:
  explicit LaneNoise(const PhaseTables& tables)
      : tables_(tables), tones_(tables.noise_numbers), series_(tables.link_count * kOrder) {}

  /// Maximum step for which the series is exact to rounding error: half of the step advances the fastest tone by
  /// kLargestTurn, and the remainder is 3^24 / 24! = 5e-13 of the amplitude, itself a small angle.
  static double longest_step(const PhaseTables& tables, const double* noise) {
    double fastest = 0;
    for (int i = 0; i < tables.link_count; ++i) {
      if (tables.links[i].tones < 0) continue;
      for (int k = 0; k < kTones; ++k) {
        const double w = noise[tables.links[i].tones + 1 + 2 * k];
        if (w > fastest) fastest = w;
      }
    }
    return fastest > 0 ? 2 * kLargestTurn / fastest : __builtin_inf();
  }

  void load_case(int lane, const double* noise) {
    for (int i = 0; i < tables_.noise_numbers; ++i) tones_[i].set(lane, noise[i]);
  }

  /// Sets the interval of validity to t ... t + step.
  void expand(const S& t, const S& step) {
    if (tables_.noise_numbers == 0) return;
    half_ = select(step > S(0.0), S(S(0.5) * step), S(1e-3));
    inverse_half_ = S(1.0) / half_;
    middle_ = t + S(0.5) * step;
    for (int i = 0; i < tables_.link_count; ++i) {
      if (tables_.links[i].tones >= 0)
        expand_joint(tones_.data() + tables_.links[i].tones, series_.data() + i * kOrder);
    }
  }

  /// Noise n, n' and, if kSecond, n'' of a joint.
  template <bool kSecond>
  GRAPNEL_INLINE BasicJointPoint<S> at(const LinkTable& link, const S& t) const {
    const S* a = series_.data() + (&link - tables_.links) * kOrder;
    const S x = (t - middle_) * inverse_half_;
    S n(0.0), d(0.0), e(0.0);  // value, derivative, half the second
    for (int m = kOrder; m-- > 0;) {
      if constexpr (kSecond) e = e * x + d;
      d = d * x + n;
      n = n * x + a[m];
    }
    return {n, S(d * inverse_half_), S(S((e + e) * inverse_half_) * inverse_half_)};
  }

 private:
  static constexpr int kOrder = 24;
  static constexpr double kLargestTurn = 3;

  // sum_k A cos(angle_k + w_k half x) = sum_m x^m / m! (A sum_k (w_k half)^m cos^(m)(angle_k)).
  void expand_joint(const S* tone, S* series) const {
    S sum[kOrder];
    for (int m = 0; m < kOrder; ++m) sum[m] = S(0.0);
    for (int k = 0; k < kTones; ++k) {
      const S w = tone[1 + 2 * k];
      const SineCosine<S> angle = sine_cosine(S(w * middle_ + tone[2 + 2 * k]));
      const S turn = w * half_;
      const S square = -(turn * turn);
      S even = angle.cosine, odd = -(turn * angle.sine);
#pragma GCC unroll 12
      for (int m = 0; m < kOrder; m += 2) {
        sum[m] += even;
        sum[m + 1] += odd;
        even = even * square;
        odd = odd * square;
      }
    }
    S factor = tone[0];
    for (int m = 0; m < kOrder; ++m) {
      series[m] = sum[m] * factor;
      factor = factor * S(1.0 / (m + 1));
    }
  }

  const PhaseTables& tables_;
  LaneArray<S> tones_;
  LaneArray<S> series_;  // kOrder per link
  S middle_ = S(0.0), half_ = S(1.0), inverse_half_ = S(1.0);
};

/// Held and delayed commands of sampled control: the clock of simulate/controller.hpp, with ticks given as intervals.
template <class S>
class LaneCommands {
 public:
  explicit LaneCommands(const PhaseTables& tables)
      : numbers_(tables.control.command_numbers()),
        most_(tables.control.is_sampled ? tables.control.max_delayed_count : 0),
        held_(numbers_),
        computed_(numbers_),
        held_before_(numbers_),
        queue_(most_ * numbers_) {}

  /// Sets the held command of a lane.
  void hold(int lane, const double* command) {
    for (int i = 0; i < numbers_; ++i) held_[i].set(lane, command[i]);
  }
  /// Loads a case's commands into a lane: the active one, then `delayed_count` delayed ones.
  void load(int lane, const double* commands, int delayed_count) {
    hold(lane, commands);
    for (int i = 0; i < delayed_count * numbers_; ++i) queue_[i].set(lane, commands[numbers_ + i]);
    first_[lane] = 0, waiting_[lane] = delayed_count;
  }
  /// Zeros the commands of an idle lane.
  void clear(int lane) {
    for (int i = 0; i < numbers_; ++i) held_[i].set(lane, 0.0);
    first_[lane] = waiting_[lane] = 0;
  }
  /// A command's numbers: newly computed in all lanes, and active.
  S& computed(int number) { return computed_[number]; }
  const S& held(int number) const { return held_[number]; }
  const S* held_from(int number) const { return held_.data() + number; }

  /// Applies the changes at an interval's begin in a lane; the new commands must have been computed.
  void enter(int lane, const LaneInterval& interval) {
    for (int i = 0; i < numbers_; ++i) held_before_[i].set(lane, held_[i].get(lane));
    first_before_[lane] = first_[lane], waiting_before_[lane] = waiting_[lane];
    for (int k = 0; k < interval.due; ++k) act(lane);
    if (!interval.samples) return;
    const int at = (first_[lane] + waiting_[lane]++) % most_ * numbers_;
    for (int i = 0; i < numbers_; ++i) queue_[at + i].set(lane, computed_[i].get(lane));
    if (interval.acts_at_once) act(lane);
  }

  /// Reverts the last enter(); the delayed commands are still in the ring buffer.
  void take_back(int lane) {
    for (int i = 0; i < numbers_; ++i) held_[i].set(lane, held_before_[i].get(lane));
    first_[lane] = first_before_[lane], waiting_[lane] = waiting_before_[lane];
  }

  int delayed_count(int lane) const { return waiting_[lane]; }
  /// Writes the commands in the format of load().
  void write(int lane, double* out) const {
    for (int i = 0; i < numbers_; ++i) *out++ = held_[i].get(lane);
    for (int k = 0; k < waiting_[lane]; ++k) {
      const int at = (first_[lane] + k) % most_ * numbers_;
      for (int i = 0; i < numbers_; ++i) *out++ = queue_[at + i].get(lane);
    }
  }

 private:
  void act(int lane) {
    const int at = first_[lane] * numbers_;
    for (int i = 0; i < numbers_; ++i) held_[i].set(lane, queue_[at + i].get(lane));
    first_[lane] = (first_[lane] + 1) % most_, --waiting_[lane];
  }

  int numbers_, most_;
  LaneArray<S> held_, computed_, held_before_;
  LaneArray<S> queue_;  // a ring buffer per lane
  int first_[S::kWidth] = {}, waiting_[S::kWidth] = {};
  int first_before_[S::kWidth] = {}, waiting_before_[S::kWidth] = {};
};

/// Parameters of a joint's drive, its friction, and its spring with damper.
template <class S>
struct LaneDriveValues {
  S kp, kd, effort, viscous, coulomb, inverse_transition, stiffness, damping, rest;
};

template <class S>
class LaneDynamics {
 public:
  using Mask = typename S::Mask;

  explicit LaneDynamics(const PhaseTables& tables);

  int size() const { return tables_.coordinates + tables_.velocities + tables_.integral_count; }
  const PhaseTables& tables() const { return tables_; }
  const Tree<S>& tree() const { return tree_; }
  std::span<const S> coordinates(const S* y) const { return {y, static_cast<std::size_t>(tables_.coordinates)}; }
  std::span<const S> velocities(const S* y) const {
    return {y + tables_.coordinates, static_cast<std::size_t>(tables_.velocities)};
  }

  /// Loads a case's numbers into a lane.
  void load_case(int lane, const CaseRecord& record);
  /// Loads a block's trajectories into a lane.
  void load_block(int lane, const double* block);
  /// Evaluates the control laws in the state y at time t in all lanes; commands().enter() selects the lanes that apply
  /// the result. Overwrites prescribed joints in y.
  void sample(const S& t, S* y);
  LaneCommands<S>& commands() { return commands_; }
  /// Energy of the spring at a link's joint.
  S spring_energy(int i, std::span<const S> q) const {
    const S deflection = q[static_cast<std::size_t>(tables_.links[i].q)] - drives_[i].rest;
    return S(0.5) * S(S(drives_[i].stiffness * deflection) * deflection);
  }
  const LaneWheels<S>& wheels() const { return wheels_; }
  LaneLoops<S>& loops() { return loops_; }
  /// Whether a velocity is a wheel's rate.
  bool is_wheel(int velocity) const { return is_wheel_[velocity] != 0; }
  /// Prepares the noise between t and t + step only (a short step for a step of 0).
  void enter_step(const S& t, const S& step) { noise_.expand(t, step); }
  /// The longest step that a case's noise allows.
  static double longest_step(const PhaseTables& tables, const CaseRecord& record) {
    return LaneNoise<S>::longest_step(tables, record.noise);
  }
  /// Stores the conserved momenta of the roots in the state y at time t, in the lanes of the mask.
  void remember_momenta(const Mask& lanes, const S& t, S* y);
  /// Sets prescribed joints to their prescribed values.
  void put_prescribed(const S& t, S* y);
  /// Projects the loops of these lanes onto closure; defects up to `negligible` remain.
  LaneProjection<S> close_loops(const Mask& lanes, S* y, double negligible);
  /// Recomputes the roots' motion from the conserved momenta; closures are relative and stay closed.
  void recover(const S& t, S* y);
  /// dy/dt. Overwrites prescribed joints in y.
  void operator()(const S& t, S* y, S* dydt);
  /// Rates of TreeExchange of the state y evaluated last, phase_integral::kExchangeCount per tree.
  void exchange_rates(const S* y, S* rates);
  /// Motor effort at a link in the state evaluated last, for any joint control; zero for an undriven joint.
  S motor_effort(int i) const {
    const LinkTable& link = tables_.links[i];
    return link.output == ControlOutput::motion ? S(solved_[link.v] - friction_[i] - spring_[i]) : motor_[i];
  }

 private:
  void load_link(int lane, const double* numbers, TreeLink<S>& link);
  void refer(const S& t);
  template <bool kSecond>
  void refer_joint(const LinkTable& link, const S& t, BasicJointPoint<S>& reference) const;
  void impose(S* y);
  void actuate(const S* y);
  S beside_motor(int i) const {  // nonzero if friction or a spring acts
    return S((tables_.links[i].is_viscous ? drives_[i].viscous : S(0.0)) +
             (tables_.links[i].has_coulomb ? drives_[i].coulomb : S(0.0)) +
             (tables_.links[i].has_spring ? drives_[i].stiffness : S(0.0)));
  }
  void solve(const S* y, const LaneArray<S, std::uint8_t>& prescribed);
  void command(const S* y);
  void drive(const S& t, S* y);
  const S* thrust() const {
    return tables_.control.has_thrusters ? commands_.held_from(tables_.control.channels + 3) : nullptr;
  }
  void add_ground(S* rates);
  // Otherwise the held command of sampled control is applied.
  bool laws_command() const { return !tables_.control.is_sampled || is_sampling_; }

  const PhaseTables& tables_;
  Tree<S> tree_;
  DynamicsWorkspace<S> workspace_;
  LaneFreeBodies<S> free_;   // roots that carry nothing
  Tree<S> jointed_;          // the other roots and their subtrees
  LaneArray<S, int> place_;  // of a link in jointed_
  DynamicsWorkspace<S> jointed_workspace_;
  LaneLoops<S> loops_;  // in them
  LaneOutside<S> outside_;
  LaneWheels<S> wheels_;
  LaneArray<S, LaneDriveValues<S>> drives_;  // per link, as what follows
  LaneArray<S, BasicJointPoint<S>> references_;
  LaneArray<S> motor_, friction_, spring_;  // friction_: includes dampers parallel to springs
  LaneArray<S> block_;                      // the interval's
  LaneNoise<S> noise_;
  LaneCommands<S> commands_;
  bool is_sampling_ = false;
  LaneArray<S> force_, given_, vdot_;  // per velocity: applied forces, prescribed accelerations, accelerations
  LaneArray<S> solved_;                // per velocity: forces, including those required by prescribed accelerations
  LaneArray<S, std::uint8_t> prescribed_, commanded_, is_wheel_;
  LaneArray<S, RootMomentum<S>> momenta_, fresh_;
  int roots_ = 0;
  int held_ = -1;                                   // offset of the velocities of a held root; none: -1
  bool any_driven_ = false, any_computed_ = false;  // any_driven_ also if a root is held
  Mask contradicted_ = Mask::from_bits(0);          // lanes in which closed loops and prescribed motion contradict
  S momenta_time_ = S(0.0);
};

template <class S>
LaneDynamics<S>::LaneDynamics(const PhaseTables& tables)
    : tables_(tables),
      free_(tables),
      place_(tables.link_count),
      loops_(tables, jointed_),
      outside_(tables, free_),
      wheels_(tables),
      drives_(tables.link_count),
      references_(tables.link_count),
      motor_(tables.link_count),
      friction_(tables.link_count),
      spring_(tables.link_count),
      block_(tables.block_size),
      noise_(tables),
      commands_(tables),
      force_(tables.velocities),
      given_(tables.velocities),
      vdot_(tables.velocities),
      solved_(tables.velocities),
      prescribed_(tables.velocities),
      commanded_(tables.velocities),
      is_wheel_(tables.velocities),
      momenta_(tables.link_count),
      fresh_(tables.link_count) {
  tree_.coordinates = tables.coordinates;
  tree_.velocities = tables.velocities;
  for (int i = 0; i < tables.link_count; ++i) {
    const LinkTable& l = tables.links[i];
    tree_.links.push_back({l.parent, l.joint, l.axis, l.rotated, l.q, l.v, l.sign, Pose<S>::identity(),
                           RigidBodyInertia<S>::zero(), S(0.0), l.has_armature});
    roots_ += l.joint == JointType::free;
    if (l.joint == JointType::free && l.is_grounded) {
      held_ = l.v;
      for (int k = 0; k < 6; ++k) prescribed_[l.v + k] = commanded_[l.v + k] = 1;
    }
    const bool is_prescribed = l.output == ControlOutput::motion, is_computed = l.output == ControlOutput::acceleration;
    any_driven_ = any_driven_ || l.output != ControlOutput::none || held_ >= 0;
    any_computed_ = any_computed_ || is_computed;
    if (!has_one_axis(l.joint)) continue;
    prescribed_[l.v] = is_prescribed;
    commanded_[l.v] = is_prescribed || is_computed;
    is_wheel_[l.v] = l.wheel >= 0;
  }
  workspace_ = DynamicsWorkspace<S>(tree_);
  jointed_.coordinates = tables.coordinates;
  jointed_.velocities = tables.velocities;
  for (int i = 0; i < tables.link_count; ++i) {
    if (free_.holds(i)) continue;
    place_[i] = static_cast<int>(jointed_.links.size());
    jointed_.links.push_back(tree_.links[static_cast<std::size_t>(i)]);
    if (tables.links[i].parent >= 0) jointed_.links.back().parent = place_[tables.links[i].parent];
  }
  jointed_workspace_ = DynamicsWorkspace<S>(jointed_);
  loops_.lay_out(place_);
}

template <class S>
void LaneDynamics<S>::load_link(int lane, const double* n, TreeLink<S>& link) {
  RigidBodyInertia<S>& I = link.inertia;
  I.mass.set(lane, n[kLinkMass]);
  S* J[6] = {&I.rotational.xx, &I.rotational.yy, &I.rotational.zz,
             &I.rotational.xy, &I.rotational.xz, &I.rotational.yz};
  for (int k = 0; k < 6; ++k) J[k]->set(lane, n[kLinkRotational + k]);
  for (int k = 0; k < 3; ++k) {
    I.first_moment[k].set(lane, n[kLinkFirstMoment + k]);
    link.X_PF.p[k].set(lane, n[kLinkPosition + k]);
    for (int c = 0; c < 3; ++c) link.X_PF.R.m[k][c].set(lane, n[kLinkRotation + 3 * k + c]);
  }
  link.armature.set(lane, n[kLinkArmature]);
}

template <class S>
void LaneDynamics<S>::load_case(int lane, const CaseRecord& record) {
  std::size_t jointed = 0;
  for (int i = 0; i < tables_.link_count; ++i) {
    const double* n = record.links + static_cast<long>(i) * kLinkNumbers;
    load_link(lane, n, tree_.links[static_cast<std::size_t>(i)]);
    if (free_.holds(i)) {
      free_.load(lane, n, i);
    } else {
      load_link(lane, n, jointed_.links[jointed++]);
    }
    LaneDriveValues<S>& d = drives_[i];
    S* values[9] = {&d.kp,        &d.kd,      &d.effort, &d.viscous, &d.coulomb, &d.inverse_transition,
                    &d.stiffness, &d.damping, &d.rest};
    for (int k = 0; k < 9; ++k) values[k]->set(lane, n[kLinkKp + k]);
  }
  noise_.load_case(lane, record.noise);
  outside_.load_case(lane, record);
  wheels_.load_case(lane, record);
  loops_.load_case(lane, record.loops);
  if (record.commands != nullptr) {
    commands_.load(lane, record.commands, record.delayed_count);
  } else {
    commands_.clear(lane);
  }
}

template <class S>
void LaneDynamics<S>::load_block(int lane, const double* block) {
  for (int i = 0; i < tables_.block_size; ++i) block_[i].set(lane, block[i]);
}

// References of all driven joints read by control laws.
template <class S>
void LaneDynamics<S>::refer(const S& t) {
  for (int i = 0; i < tables_.link_count; ++i) {
    const LinkTable& link = tables_.links[i];
    if (link.output == ControlOutput::none || (link.output != ControlOutput::motion && !laws_command())) continue;
    if (link.reads_acceleration) {
      refer_joint<true>(link, t, references_[i]);
    } else {
      refer_joint<false>(link, t, references_[i]);
    }
  }
}

// Reference of one joint. Not evaluate(JointTrajectory): here the segments of all cases are series of equal length, so
// one instruction serves all lanes. The order of summation differs, and therefore the last bits.
template <class S>
template <bool kSecond>
GRAPNEL_INLINE void LaneDynamics<S>::refer_joint(const LinkTable& link, const S& t, BasicJointPoint<S>& r) const {
  const S* segment = block_.data() + link.block_offset;
  const S* c = segment + kSegmentSeries;
  const S inverse_half = segment[kSegmentInverseHalf];
  const S x = max(S(-1.0), min(S(1.0), S((t - segment[kSegmentMiddle]) * inverse_half)));
  const S x2 = x + x;
  // Clenshaw's recurrence and its derivatives, see joint_trajectory.cpp.
  S b1(0.0), b2(0.0), d1(0.0), d2(0.0), e1(0.0), e2(0.0);
  for (int k = link.series; k-- > 1;) {
    const S b = x2 * b1 + (c[k] - b2);
    const S d = x2 * d1 + ((b1 + b1) - d2);
    if constexpr (kSecond) {
      const S twice = d1 + d1;
      const S e = x2 * e1 + ((twice + twice) - e2);
      e2 = e1, e1 = e;
    }
    b2 = b1, b1 = b, d2 = d1, d1 = d;
  }
  r.position = x * b1 + (c[0] - b2);
  S slope = x * d1 + (b1 - d2);
  S curvature = x * e1 + ((d1 + d1) - e2);
  if (link.is_cycloidal) {
    // travel (u - sin(2 pi u) / (2 pi)) with u = (1 + x) / 2, where the sine is -sin(pi x).
    constexpr double kPi = 3.14159265358979323846;
    const S travel = segment[kSegmentTravel];
    const SineCosine<S> turn = sine_cosine(S(S(kPi) * x));
    r.position += travel * S(S(0.5) + (S(0.5) * x + S(0.5 / kPi) * turn.sine));
    slope += travel * S(S(0.5) + S(0.5) * turn.cosine);
    curvature -= travel * S(S(0.5 * kPi) * turn.sine);
  }
  r.rate = slope * inverse_half + segment[kSegmentRate];
  r.acceleration = S(curvature * inverse_half) * inverse_half;
  if (link.tones < 0) return;
  r = control_law::reference(link.output, r, noise_.template at<kSecond>(link, t));
}

template <class S>
void LaneDynamics<S>::impose(S* y) {
  for (int i = 0; i < tables_.link_count; ++i) {
    const LinkTable& link = tables_.links[i];
    if (link.output != ControlOutput::motion) continue;
    y[link.q] = references_[i].position;
    y[tables_.coordinates + link.v] = references_[i].rate;
    given_[link.v] = references_[i].acceleration;
  }
  for (int k = 0; held_ >= 0 && k < 6; ++k) {
    y[tables_.coordinates + held_ + k] = S(0.0);
    given_[held_ + k] = S(0.0);
  }
}

template <class S>
void LaneDynamics<S>::remember_momenta(const Mask& lanes, const S& t, S* y) {
  if (!tables_.recovers || roots_ == 0) return;
  const std::size_t count = static_cast<std::size_t>(roots_);
  root_momenta<S>(tree_, coordinates(y), velocities(y), workspace_, std::span<RootMomentum<S>>(fresh_.data(), count));
  for (int i = 0; i < roots_; ++i) {
    for (int k = 0; k < 3; ++k) {
      momenta_[i].h.angular[k] = select(lanes, fresh_[i].h.angular[k], momenta_[i].h.angular[k]);
      momenta_[i].h.linear[k] = select(lanes, fresh_[i].h.linear[k], momenta_[i].h.linear[k]);
      momenta_[i].p_WCom[k] = select(lanes, fresh_[i].p_WCom[k], momenta_[i].p_WCom[k]);
    }
    momenta_[i].mass = select(lanes, fresh_[i].mass, momenta_[i].mass);
  }
  momenta_time_ = select(lanes, t, momenta_time_);
}

template <class S>
void LaneDynamics<S>::put_prescribed(const S& t, S* y) {
  if (!any_driven_) return;
  refer(t);
  impose(y);
}

template <class S>
LaneProjection<S> LaneDynamics<S>::close_loops(const Mask& lanes, S* y, double negligible) {
  const std::size_t n = static_cast<std::size_t>(tables_.velocities);
  return loops_.project(lanes, {prescribed_.data(), n}, jointed_workspace_,
                        {y, static_cast<std::size_t>(tables_.coordinates)}, {y + tables_.coordinates, n}, negligible);
}

template <class S>
void LaneDynamics<S>::recover(const S& t, S* y) {
  if (!tables_.recovers || roots_ == 0) return;
  const S elapsed = t - momenta_time_;
  recover_roots<S>(tree_, std::span<const RootMomentum<S>>(momenta_.data(), static_cast<std::size_t>(roots_)), elapsed,
                   workspace_, std::span<S>(y, static_cast<std::size_t>(tables_.coordinates)),
                   std::span<S>(y + tables_.coordinates, static_cast<std::size_t>(tables_.velocities)));
}

// Friction, springs, and the control laws' outputs: efforts or accelerations.
template <class S>
void LaneDynamics<S>::actuate(const S* y) {
  const S* v = y + tables_.coordinates;
  for (int i = 0; i < tables_.link_count; ++i) {
    const LinkTable& link = tables_.links[i];
    if (!has_one_axis(link.joint)) continue;
    const LaneDriveValues<S>& drive = drives_[i];
    const S rate = v[link.v];
    friction_[i] = control_law::friction(link.is_viscous, drive.viscous, link.has_coulomb, drive.coulomb, rate,
                                         [&] { return tanh(S(rate * drive.inverse_transition)); });
    spring_[i] = S(0.0);
    if (link.has_spring) {  // (22.1)
      spring_[i] = drive.stiffness * (drive.rest - y[link.q]);
      friction_[i] = friction_[i] - drive.damping * rate;
    }
    motor_[i] = S(0.0);
    if (tables_.control.by_case) {  // also for wheels, and limited
      if (link.channel >= 0) motor_[i] = commands_.held(link.channel);
      continue;
    }
    if (!works_by_effort(link.output)) continue;
    if (!laws_command()) {
      if (link.channel >= 0) motor_[i] = control_law::within_limit(commands_.held(link.channel), drive.effort);
      continue;
    }
    const S commanded = control_law::command(link.control, drive.kp, drive.kd, references_[i], y[link.q], rate);
    if (link.output == ControlOutput::effort) {
      motor_[i] = control_law::within_limit(commanded, drive.effort);
    } else {
      given_[link.v] = commanded;
    }
  }
}

template <class S>
void LaneDynamics<S>::solve(const S* y, const LaneArray<S, std::uint8_t>& prescribed) {
  const std::size_t n = static_cast<std::size_t>(tables_.velocities);
  DynamicsInput<S> in;
  in.q = coordinates(y), in.v = velocities(y);
  in.force = {force_.data(), n};
  in.acceleration = {given_.data(), n};
  if (any_driven_) in.prescribed = {prescribed.data(), n};
  if (outside_.acts()) {
    in.link_wrench = {outside_.on_jointed(), jointed_.links.size()};
    in.gravity = outside_.gravity();
  }
  const std::span<S> vdot(vdot_.data(), n), forces(solved_.data(), n);
  if (loops_.any()) {
    loops_.accelerate(in, jointed_workspace_, vdot, forces);
  } else {
    articulated_body<S>(jointed_, in, jointed_workspace_, vdot, forces);
  }
}

// Efforts of laws that command accelerations: the required efforts without friction, clipped at the limits.
template <class S>
void LaneDynamics<S>::command(const S* y) {
  for (int i = 0; i < tables_.link_count; ++i) {
    const LinkTable& link = tables_.links[i];
    if (has_one_axis(link.joint)) force_[link.v] = motor_[i] + spring_[i];
  }
  solve(y, commanded_);
  // Without friction, springs and clipping, joints move as commanded unless loops prevent it.
  Mask as_commanded = Mask::from_bits(Mask::kAllBits);
  for (int i = 0; i < tables_.link_count; ++i) {
    const LinkTable& link = tables_.links[i];
    if (has_one_axis(link.joint) && link.output != ControlOutput::motion)
      as_commanded = as_commanded & (beside_motor(i) == S(0.0));
    if (link.output != ControlOutput::acceleration) continue;
    const S taken = solved_[link.v] - spring_[i];
    motor_[i] = control_law::within_limit(taken, drives_[i].effort);
    as_commanded = as_commanded & (motor_[i] == taken);
  }
  if (loops_.any()) contradicted_ = loops_.contradicted() & as_commanded;
}

// External loads and motor efforts.
template <class S>
void LaneDynamics<S>::drive(const S& t, S* y) {
  if (any_driven_) {
    refer(t);
    impose(y);
  }
  if (tables_.outside.attitude_link >= 0) {
    if (laws_command()) {
      outside_.steer(coordinates(y), velocities(y));
    } else {
      for (int k = 0; k < 3; ++k) outside_.attitude_torque()[k] = commands_.held(tables_.control.channels + k);
    }
  }
  if (outside_.acts()) outside_.act(tree_, t, block_.data(), thrust(), coordinates(y), velocities(y));
  actuate(y);
  if (wheels_.any() && !tables_.control.by_case) wheels_.distribute(outside_.attitude_torque(), motor_.data());
  if (any_computed_ && laws_command()) command(y);
}

// Ground reaction at fixed roots and the held root for the accelerations just computed. A root's articulated equation
// gives the wrench that holds it; gravity is contained in A and therefore not in the wrench.
template <class S>
void LaneDynamics<S>::add_ground(S* rates) {
  for (int i = 0; i < tables_.link_count; ++i) {
    if (!tables_.links[i].is_grounded) continue;
    const LinkScratch<S>& root = jointed_workspace_.links[static_cast<std::size_t>(place_[i])];
    outside_.add_ground(i, root.I * root.A + root.p, rates);
  }
}

template <class S>
void LaneDynamics<S>::exchange_rates(const S* y, S* rates) {
  constexpr int kCount = phase_integral::kExchangeCount;
  for (int i = 0; i < kCount * tables_.tree_count; ++i) rates[i] = S(0.0);
  for (int i = 0; i < tables_.link_count; ++i) {
    const LinkTable& link = tables_.links[i];
    if (!has_one_axis(link.joint)) continue;
    S& power = rates[kCount * tables_.tree_of[i] + phase_integral::kExchangedWork];
    power += (abs(motor_effort(i)) + abs(friction_[i])) * abs(y[tables_.coordinates + link.v]);
  }
  if (!outside_.acts()) return;
  outside_.add_exchange(rates);
  for (int i = 0; tables_.outside.has_ground && i < tables_.link_count; ++i) {
    if (!tables_.links[i].is_grounded) continue;
    const LinkScratch<S>& root = jointed_workspace_.links[static_cast<std::size_t>(place_[i])];
    outside_.add_ground_exchange(i, root.I * root.A + root.p, rates);
  }
}

template <class S>
void LaneDynamics<S>::sample(const S& t, S* y) {
  is_sampling_ = true;
  drive(t, y);
  is_sampling_ = false;
  const int channels = tables_.control.channels;
  for (int c = 0; c < tables_.control.command_numbers(); ++c) commands_.computed(c) = S(0.0);
  for (int i = 0; i < tables_.link_count; ++i) {
    const LinkTable& link = tables_.links[i];
    if (link.channel >= 0 && works_by_effort(link.output)) commands_.computed(link.channel) = motor_[i];
    if (link.wheel >= 0) commands_.computed(channels + 3 + link.wheel) = y[tables_.coordinates + link.v];
  }
  if (tables_.outside.attitude_link < 0) return;
  for (int k = 0; k < 3; ++k) commands_.computed(channels + k) = outside_.attitude_torque()[k];
}

template <class S>
void LaneDynamics<S>::operator()(const S& t, S* y, S* dydt) {
  const int nq = tables_.coordinates, nv = tables_.velocities;
  contradicted_ = Mask::from_bits(0);
  drive(t, y);
  for (int i = 0; i < tables_.link_count; ++i) {
    const LinkTable& link = tables_.links[i];
    if (has_one_axis(link.joint)) force_[link.v] = motor_[i] + friction_[i] + spring_[i];
  }
  solve(y, prescribed_);
  free_.accelerate(y + nq, vdot_.data());
  if (outside_.acts()) outside_.push(free_, vdot_.data());
  coordinate_rates<S>(tree_, coordinates(y), velocities(y), {dydt, static_cast<std::size_t>(nq)});
  for (int i = 0; i < nv; ++i) dydt[nq + i] = vdot_[i];
  if (loops_.any()) {
    // No motion satisfies the closures: the step is rejected, and a shorter one may avoid this state.
    contradicted_ = contradicted_ | loops_.contradicted();
    if (any(contradicted_)) dydt[nq] = select(contradicted_, S(__builtin_nan("")), dydt[nq]);
  }
  S motor_power(0.0), friction_power(0.0);
  for (int i = 0; i < tables_.link_count; ++i) {
    const LinkTable& link = tables_.links[i];
    if (!has_one_axis(link.joint)) continue;
    const S rate = y[nq + link.v];
    motor_power += motor_effort(i) * rate;
    friction_power += friction_[i] * rate;
  }
  S* rates = dydt + nq + nv;
  for (int i = 0; i < tables_.integral_count; ++i) rates[i] = S(0.0);
  rates[phase_integral::kMotorWork] = motor_power;
  rates[phase_integral::kFrictionWork] = friction_power;
  if (!outside_.acts()) return;
  outside_.add_rates(tree_, rates);
  if (tables_.outside.has_ground) add_ground(rates);
}

}  // namespace grapnel::lanes
