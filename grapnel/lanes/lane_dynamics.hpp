#pragma once

/// @file
/// The right-hand side of one phase in packs: as many cases of one structure at once as a pack has lanes. What
/// PhaseDynamics is to one case, for phases on which nothing acts from outside; simulate/phase_dynamics.hpp has the
/// equations. State y = [q; v; motor work; friction work].
///
/// Roots' motion is integrated within a step and taken from the conserved momenta at its end (settle), so that nothing
/// drifts and the stages are spared the sweep that it takes.

#include "grapnel/lanes/lane_dynamics_loose.hpp"
#include "grapnel/lanes/lane_dynamics_noise.hpp"
#include "grapnel/lanes/lane_dynamics_tanh.hpp"
#include "grapnel/lanes/lane_kernels.hpp"
#include "grapnel/lanes/lane_phase_array.hpp"
#include "grapnel/lanes/lane_phase_tables.hpp"

namespace grapnel::lanes {

/// What drives a joint, and its friction.
template <class S>
struct LaneDriveValues {
  S kp, kd, effort, viscous, coulomb, inverse_transition;
};

template <class S>
class LaneDynamics {
 public:
  using Mask = typename S::Mask;

  explicit LaneDynamics(const PhaseTables& tables);

  int size() const { return tables_.coordinates + tables_.velocities + 2; }
  const PhaseTables& tables() const { return tables_; }
  const Tree<S>& tree() const { return tree_; }
  std::span<const S> coordinates(const S* y) const { return {y, static_cast<std::size_t>(tables_.coordinates)}; }
  std::span<const S> velocities(const S* y) const {
    return {y + tables_.coordinates, static_cast<std::size_t>(tables_.velocities)};
  }

  /// Takes a case's numbers into a lane.
  void load_case(int lane, const CaseRecord& record);
  /// Takes an interval's trajectories into a lane.
  void load_interval(int lane, const double* block);
  /// From now on the noise is that between t and t + step (a short step for a step of 0), and no other.
  void enter_step(const S& t, const S& step) { noise_.expand(t, step); }
  /// The longest step that a case's noise allows.
  static double longest_step(const PhaseTables& tables, const CaseRecord& record) {
    return LaneNoise<S>::longest_step(tables, record.noise);
  }
  /// Remembers, in the lanes of the mask, what the roots conserve in the state y at time t.
  void remember_momenta(const Mask& lanes, const S& t, S* y);
  /// Puts prescribed joints where they are prescribed, and roots where the conserved momenta have them.
  void settle(const S& t, S* y);
  /// dy/dt. Overwrites prescribed joints in y.
  void operator()(const S& t, S* y, S* dydt);
  /// What a link's motor does in the state evaluated last, whatever moves the joint; zero where none is driven.
  S motor_effort(int i) const {
    const LinkTable& link = tables_.links[i];
    return link.drive == LaneDrive::prescribed ? S(solved_[link.v] - friction_[i]) : motor_[i];
  }

 private:
  void load_link(int lane, const double* numbers, TreeLink<S>& link);
  void refer(const S& t);
  template <bool kSecond>
  void refer_joint(const LinkTable& link, const S& t, LaneReference<S>& reference) const;
  void impose(S* y);
  void actuate(const S* y);
  void solve(const S* y, const LaneArray<S, std::uint8_t>& prescribed);
  void command(const S* y);
  void coordinate_rates(const S* y, S* dydt) const;

  const PhaseTables& tables_;
  Tree<S> tree_;
  DynamicsWorkspace<S> workspace_;
  LaneLooseBodies<S> loose_;  // roots that carry nothing,
  Tree<S> jointed_;           // and the others with what they carry
  DynamicsWorkspace<S> jointed_workspace_;
  LaneArray<S, LaneDriveValues<S>> drives_;  // per link, as what follows
  LaneArray<S, LaneReference<S>> references_;
  LaneArray<S> motor_, friction_;
  LaneArray<S> pieces_;  // the interval's
  LaneNoise<S> noise_;
  LaneArray<S> force_, given_, vdot_;  // per velocity: applied forces, prescribed accelerations, accelerations
  LaneArray<S> solved_;                // per velocity: forces, those that prescribed accelerations take included
  LaneArray<S, std::uint8_t> prescribed_, commanded_;
  LaneArray<S, RootMomentum<S>> momenta_, fresh_;
  int roots_ = 0;
  bool any_driven_ = false, any_computed_ = false;
  S momenta_time_ = S(0.0);
};

template <class S>
LaneDynamics<S>::LaneDynamics(const PhaseTables& tables)
    : tables_(tables),
      loose_(tables),
      drives_(tables.link_count),
      references_(tables.link_count),
      motor_(tables.link_count),
      friction_(tables.link_count),
      pieces_(tables.piece_numbers),
      noise_(tables),
      force_(tables.velocities),
      given_(tables.velocities),
      vdot_(tables.velocities),
      solved_(tables.velocities),
      prescribed_(tables.velocities),
      commanded_(tables.velocities),
      momenta_(tables.link_count),
      fresh_(tables.link_count) {
  tree_.coordinates = tables.coordinates;
  tree_.velocities = tables.velocities;
  for (int i = 0; i < tables.link_count; ++i) {
    const LinkTable& l = tables.links[i];
    tree_.links.push_back({l.parent, l.joint, l.axis, l.rotated, l.q, l.v, l.sign, Pose<S>::identity(),
                           RigidBodyInertia<S>::zero(), S(0.0), l.has_armature});
    roots_ += l.joint == LinkJoint::root_free;
    const bool is_prescribed = l.drive == LaneDrive::prescribed, is_computed = l.drive == LaneDrive::computed_torque;
    any_driven_ = any_driven_ || l.drive != LaneDrive::free;
    any_computed_ = any_computed_ || is_computed;
    if (l.joint != LinkJoint::revolute && l.joint != LinkJoint::prismatic) continue;
    prescribed_[l.v] = is_prescribed;
    commanded_[l.v] = is_prescribed || is_computed;
  }
  workspace_ = DynamicsWorkspace<S>(tree_);
  jointed_.coordinates = tables.coordinates;
  jointed_.velocities = tables.velocities;
  LaneArray<S, int> place(tables.link_count);  // of a link in jointed_
  for (int i = 0; i < tables.link_count; ++i) {
    if (loose_.holds(i)) continue;
    place[i] = static_cast<int>(jointed_.links.size());
    jointed_.links.push_back(tree_.links[static_cast<std::size_t>(i)]);
    if (tables.links[i].parent >= 0) jointed_.links.back().parent = place[tables.links[i].parent];
  }
  jointed_workspace_ = DynamicsWorkspace<S>(jointed_);
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
    if (loose_.holds(i)) {
      loose_.load(lane, n, i);
    } else {
      load_link(lane, n, jointed_.links[jointed++]);
    }
    LaneDriveValues<S>& d = drives_[i];
    S* values[6] = {&d.kp, &d.kd, &d.effort, &d.viscous, &d.coulomb, &d.inverse_transition};
    for (int k = 0; k < 6; ++k) values[k]->set(lane, n[kLinkKp + k]);
  }
  noise_.load_case(lane, record.noise);
}

template <class S>
void LaneDynamics<S>::load_interval(int lane, const double* block) {
  for (int i = 0; i < tables_.piece_numbers; ++i) pieces_[i].set(lane, block[1 + i]);
}

// References of all driven joints.
template <class S>
void LaneDynamics<S>::refer(const S& t) {
  for (int i = 0; i < tables_.link_count; ++i) {
    const LinkTable& link = tables_.links[i];
    if (link.drive == LaneDrive::free) continue;
    if (link.drive == LaneDrive::pd) {
      refer_joint<false>(link, t, references_[i]);
    } else {
      refer_joint<true>(link, t, references_[i]);
    }
  }
}

// One joint's; PD does not read accelerations.
template <class S>
template <bool kSecond>
GRAPNEL_INLINE void LaneDynamics<S>::refer_joint(const LinkTable& link, const S& t, LaneReference<S>& r) const {
  const S* piece = pieces_.data() + link.piece;
  const S* c = piece + kPieceSeries;
  const S inverse_half = piece[kPieceInverseHalf];
  const S x = max(S(-1.0), min(S(1.0), S((t - piece[kPieceMiddle]) * inverse_half)));
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
    const S travel = piece[kPieceTravel];
    const SineCosine<S> turn = sine_cosine(S(S(kPi) * x));
    r.position += travel * S(S(0.5) + (S(0.5) * x + S(0.5 / kPi) * turn.sine));
    slope += travel * S(S(0.5) + S(0.5) * turn.cosine);
    curvature -= travel * S(S(0.5 * kPi) * turn.sine);
  }
  r.rate = slope * inverse_half + piece[kPieceRate];
  r.acceleration = S(curvature * inverse_half) * inverse_half;
  if (link.tones < 0) return;
  const LaneReference<S> n = noise_.template at<kSecond>(link, t);
  r.position -= n.position;
  r.rate -= n.rate;
  // Computed torque commands the trajectory's own acceleration: no sensor reads that.
  if (link.drive == LaneDrive::prescribed) r.acceleration -= n.acceleration;
}

template <class S>
void LaneDynamics<S>::impose(S* y) {
  for (int i = 0; i < tables_.link_count; ++i) {
    const LinkTable& link = tables_.links[i];
    if (link.drive != LaneDrive::prescribed) continue;
    y[link.q] = references_[i].position;
    y[tables_.coordinates + link.v] = references_[i].rate;
    given_[link.v] = references_[i].acceleration;
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
void LaneDynamics<S>::settle(const S& t, S* y) {
  if (any_driven_) {
    refer(t);
    impose(y);
  }
  if (!tables_.recovers || roots_ == 0) return;
  const S elapsed = t - momenta_time_;
  recover_roots<S>(tree_, std::span<const RootMomentum<S>>(momenta_.data(), static_cast<std::size_t>(roots_)), elapsed,
                   workspace_, std::span<S>(y, static_cast<std::size_t>(tables_.coordinates)),
                   std::span<S>(y + tables_.coordinates, static_cast<std::size_t>(tables_.velocities)));
}

// Friction, and the efforts of PD.
template <class S>
void LaneDynamics<S>::actuate(const S* y) {
  const S* v = y + tables_.coordinates;
  for (int i = 0; i < tables_.link_count; ++i) {
    const LinkTable& link = tables_.links[i];
    if (link.joint != LinkJoint::revolute && link.joint != LinkJoint::prismatic) continue;
    const LaneDriveValues<S>& drive = drives_[i];
    const S rate = v[link.v];
    S resistance(0.0);
    if (link.is_viscous) resistance = drive.viscous * rate;
    if (link.has_coulomb) resistance += drive.coulomb * lane_tanh(S(rate * drive.inverse_transition));
    friction_[i] = -resistance;
    motor_[i] = S(0.0);
    if (link.drive != LaneDrive::pd && link.drive != LaneDrive::computed_torque) continue;
    const LaneReference<S>& r = references_[i];
    const S correction = drive.kp * S(r.position - y[link.q]) + drive.kd * S(r.rate - rate);
    if (link.drive == LaneDrive::pd) {
      motor_[i] = min(drive.effort, max(-drive.effort, correction));  // in this order a NaN stays
    } else {
      given_[link.v] = r.acceleration + correction;
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
  articulated_body<S>(jointed_, in, jointed_workspace_, std::span<S>(vdot_.data(), n), std::span<S>(solved_.data(), n));
}

// Efforts of computed torque: what the commanded accelerations take without friction, cut at the limits.
template <class S>
void LaneDynamics<S>::command(const S* y) {
  for (int i = 0; i < tables_.link_count; ++i) {
    const LinkTable& link = tables_.links[i];
    if (link.joint == LinkJoint::revolute || link.joint == LinkJoint::prismatic) force_[link.v] = motor_[i];
  }
  solve(y, commanded_);
  for (int i = 0; i < tables_.link_count; ++i) {
    const LinkTable& link = tables_.links[i];
    if (link.drive != LaneDrive::computed_torque) continue;
    const S effort = drives_[i].effort;
    motor_[i] = min(effort, max(-effort, solved_[link.v]));
  }
}

template <class S>
void LaneDynamics<S>::coordinate_rates(const S* y, S* dydt) const {
  const S* v = y + tables_.coordinates;
  const auto quaternion_part = [&](int offset, int at) {
    const Quaternion<S> rate = quaternion_rate(Quaternion<S>{y[offset], y[offset + 1], y[offset + 2], y[offset + 3]},
                                               Vector3<S>{v[at], v[at + 1], v[at + 2]});
    dydt[offset] = rate.w, dydt[offset + 1] = rate.x, dydt[offset + 2] = rate.y, dydt[offset + 3] = rate.z;
  };
  for (int i = 0; i < tables_.link_count; ++i) {
    const LinkTable& link = tables_.links[i];
    if (link.joint == LinkJoint::root_free) {
      const S* q = y + link.q;
      const Vector3<S> velocity = rotation_matrix(Quaternion<S>{q[3], q[4], q[5], q[6]}) *
                                  Vector3<S>{v[link.v + 3], v[link.v + 4], v[link.v + 5]};
      for (int k = 0; k < 3; ++k) dydt[link.q + k] = velocity[k];
      quaternion_part(link.q + 3, link.v);
    } else if (link.joint == LinkJoint::spherical) {
      quaternion_part(link.q, link.v);
    } else {
      dydt[link.q] = v[link.v];
    }
  }
}

template <class S>
void LaneDynamics<S>::operator()(const S& t, S* y, S* dydt) {
  const int nq = tables_.coordinates, nv = tables_.velocities;
  if (any_driven_) {
    refer(t);
    impose(y);
  }
  actuate(y);
  if (any_computed_) command(y);
  for (int i = 0; i < tables_.link_count; ++i) {
    const LinkTable& link = tables_.links[i];
    if (link.joint == LinkJoint::revolute || link.joint == LinkJoint::prismatic)
      force_[link.v] = motor_[i] + friction_[i];
  }
  solve(y, prescribed_);
  loose_.accelerate(y + nq, vdot_.data());
  coordinate_rates(y, dydt);
  for (int i = 0; i < nv; ++i) dydt[nq + i] = vdot_[i];
  S motor_power(0.0), friction_power(0.0);
  for (int i = 0; i < tables_.link_count; ++i) {
    const LinkTable& link = tables_.links[i];
    if (link.joint != LinkJoint::revolute && link.joint != LinkJoint::prismatic) continue;
    const S rate = y[nq + link.v];
    motor_power += motor_effort(i) * rate;
    friction_power += friction_[i] * rate;
  }
  dydt[nq + nv] = motor_power;
  dydt[nq + nv + 1] = friction_power;
}

}  // namespace grapnel::lanes
