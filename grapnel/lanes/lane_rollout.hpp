#pragma once

/// @file
/// Rollouts in lanes: cases of one model under given joint torques with a fixed step, one case per lane. No error
/// control and no conservation checks; any tree that the recursions support. Captures are integrated by
/// lane_stepper.hpp.

#include "grapnel/dynamics/articulated_body_kernel.hpp"
#include "grapnel/dynamics/link_motion_kernel.hpp"
#include "grapnel/lanes/lane_rollout_tables.hpp"
#include "grapnel/simulate/joint_control.hpp"
#include "grapnel/spatial/pack.hpp"

namespace grapnel::lanes {

template <class S>
class LaneRollout {
 public:
  static constexpr int kWidth = S::kWidth;

  explicit LaneRollout(const RolloutTables& tables);
  /// Computes cases `first` to `first` + kWidth - 1; lanes beyond cases.end repeat the last case and write nothing.
  void run(const RolloutCases& cases, std::int64_t first);

 private:
  static std::int64_t smaller(std::int64_t a, std::int64_t b) { return a < b ? a : b; }
  void load(const RolloutCases& cases, std::int64_t first);
  void read_control(const RolloutCases& cases, std::int64_t first, std::int64_t step);
  void write(double* to, std::int64_t stride, int count) const;
  void actuate(const S* v);
  void accelerate(const S* y);
  void derivative(const S* y, S* dydt);
  void normalize(S* y) const;
  void step_rk4();
  void step_euler();
  void turn_quaternion(S* q, const Vector3<S>& turn) const;
  std::span<const S> coordinates(const S* y) const { return {y, static_cast<std::size_t>(tables_.coordinates)}; }
  std::span<const S> velocities(const S* y) const {
    return {y + tables_.coordinates, static_cast<std::size_t>(tables_.velocities)};
  }

  const RolloutTables& tables_;
  int size_;
  Tree<S> tree_;
  DynamicsWorkspace<S> workspace_;
  LaneArray<S> y_, trial_, slope_, sum_;
  LaneArray<S> control_, force_, applied_, vdot_, zero_;
};

/// The entry point of an instruction set.
template <class S>
void run_lane_rollout(const RolloutTables& tables, const RolloutCases& cases) {
  LaneRollout<S> rollout(tables);
  for (std::int64_t first = cases.begin; first < cases.end; first += S::kWidth) rollout.run(cases, first);
}

template <class S>
LaneRollout<S>::LaneRollout(const RolloutTables& tables)
    : tables_(tables),
      size_(tables.coordinates + tables.velocities),
      y_(size_),
      trial_(size_),
      slope_(size_),
      sum_(size_),
      control_(tables.controls),
      force_(tables.velocities),
      applied_(tables.velocities),
      vdot_(tables.velocities),
      zero_(tables.velocities) {
  tree_.coordinates = tables.coordinates;
  tree_.velocities = tables.velocities;
  for (int i = 0; i < tables.link_count; ++i) tree_.links.push_back(convert_link<S>(tables.links[i]));
  workspace_ = DynamicsWorkspace<S>(tree_);
}

template <class S>
void LaneRollout<S>::run(const RolloutCases& cases, std::int64_t first) {
  constexpr std::int64_t kStepsBetweenChecks = 64;
  const int count = static_cast<int>(smaller(kWidth, cases.end - first));
  load(cases, first);
  std::int64_t done = 0;
  for (std::int64_t step = 0; step < cases.steps; ++step) {
    read_control(cases, first, step);
    for (int i = 0; i < tables_.substeps; ++i) {
      if (cases.stop != nullptr && done++ % kStepsBetweenChecks == 0 && cases.stop(cases.context)) return;
      if (tables_.is_euler) {
        step_euler();
      } else {
        step_rk4();
      }
    }
    if (cases.states != nullptr) write(cases.states + (first * cases.steps + step) * size_, cases.steps * size_, count);
  }
  if (cases.last != nullptr) write(cases.last + first * size_, size_, count);
}

// The numbers of lane l are `stride` after those of lane l - 1.
template <class S>
void LaneRollout<S>::write(double* to, std::int64_t stride, int count) const {
  double lanes[kWidth];
  for (int i = 0; i < size_; ++i) {
    y_[i].store(lanes);
    for (int l = 0; l < count; ++l) to[l * stride + i] = lanes[l];
  }
}

template <class S>
void LaneRollout<S>::load(const RolloutCases& cases, std::int64_t first) {
  double lanes[kWidth];
  for (int i = 0; i < size_; ++i) {
    for (int l = 0; l < kWidth; ++l) lanes[l] = cases.initial[smaller(first + l, cases.end - 1) * size_ + i];
    y_[i] = S::load(lanes);
  }
  normalize(y_.data());
}

template <class S>
void LaneRollout<S>::read_control(const RolloutCases& cases, std::int64_t first, std::int64_t step) {
  if (cases.control == nullptr) return;  // the controls are zero
  double lanes[kWidth];
  for (int j = 0; j < tables_.controls; ++j) {
    for (int l = 0; l < kWidth; ++l) {
      const std::int64_t k = smaller(first + l, cases.end - 1);
      lanes[l] = cases.control[(k * cases.steps + step) * tables_.controls + j];
    }
    control_[j] = control_law::within_limit(S::load(lanes), S(tables_.joints[j].effort));
  }
}

// Joint efforts: commands and friction.
template <class S>
void LaneRollout<S>::actuate(const S* v) {
  for (int j = 0; j < tables_.controls; ++j) {
    const RolloutJoint& joint = tables_.joints[j];
    S effort = control_[j];
    if (joint.is_viscous || joint.has_coulomb) {
      const S rate = v[joint.velocity];
      effort += control_law::friction(joint.is_viscous, S(joint.viscous), joint.has_coulomb, S(joint.coulomb), rate,
                                      [&] { return tanh(S(rate * S(joint.inverse_transition))); });
    }
    force_[joint.velocity] = effort;
  }
}

// Computes vdot_ of a state.
template <class S>
void LaneRollout<S>::accelerate(const S* y) {
  const std::size_t n = static_cast<std::size_t>(tables_.velocities);
  actuate(y + tables_.coordinates);
  DynamicsInput<S> in;
  in.q = coordinates(y), in.v = velocities(y);
  in.force = {force_.data(), n};
  in.gravity = {S(tables_.gravity[0]), S(tables_.gravity[1]), S(tables_.gravity[2])};
  if (tables_.held != nullptr) in.prescribed = {tables_.held, n}, in.acceleration = {zero_.data(), n};
  articulated_body<S>(tree_, in, workspace_, std::span<S>(vdot_.data(), n), std::span<S>(applied_.data(), n));
}

template <class S>
void LaneRollout<S>::derivative(const S* y, S* dydt) {
  accelerate(y);
  coordinate_rates<S>(tree_, coordinates(y), velocities(y), {dydt, static_cast<std::size_t>(tables_.coordinates)});
  for (int i = 0; i < tables_.velocities; ++i) dydt[tables_.coordinates + i] = vdot_[i];
}

template <class S>
void LaneRollout<S>::normalize(S* y) const {
  for (int k = 0; k < tables_.quaternion_count; ++k) {
    S* q = y + tables_.quaternions[k];
    const S inverse = S(1.0) / sqrt(S((q[0] * q[0] + q[1] * q[1]) + (q[2] * q[2] + q[3] * q[3])));
    for (int i = 0; i < 4; ++i) q[i] = q[i] * inverse;
  }
}

// The classical Runge-Kutta method of order 4, as in integrate/runge_kutta_4.hpp: quaternion components are integrated
// independently during a step and normalized after it.
template <class S>
void LaneRollout<S>::step_rk4() {
  const S h(tables_.step), half(0.5 * tables_.step), third(tables_.step / 3.0), sixth(tables_.step / 6.0);
  derivative(y_.data(), slope_.data());
  for (int i = 0; i < size_; ++i) {
    sum_[i] = y_[i] + sixth * slope_[i];
    trial_[i] = y_[i] + half * slope_[i];
  }
  derivative(trial_.data(), slope_.data());
  for (int i = 0; i < size_; ++i) {
    sum_[i] += third * slope_[i];
    trial_[i] = y_[i] + half * slope_[i];
  }
  derivative(trial_.data(), slope_.data());
  for (int i = 0; i < size_; ++i) {
    sum_[i] += third * slope_[i];
    trial_[i] = y_[i] + h * slope_[i];
  }
  derivative(trial_.data(), slope_.data());
  for (int i = 0; i < size_; ++i) y_[i] = sum_[i] + sixth * slope_[i];
  normalize(y_.data());
}

// q o exp(turn / 2), by sine and cosine, so that the quaternion's norm is preserved for any step size.
template <class S>
void LaneRollout<S>::turn_quaternion(S* q, const Vector3<S>& turn) const {
  const S angle = sqrt(S((turn[0] * turn[0] + turn[1] * turn[1]) + turn[2] * turn[2]));
  const SineCosine<S> at = sine_cosine(S(S(0.5) * angle));
  // sin(angle / 2) / angle, which is 1/2 for an angle whose square is negligible relative to 1.
  const S tiny(1e-12);
  const S factor = select(angle > tiny, S(at.sine / max(angle, tiny)), S(0.5));
  const Quaternion<S> by{at.cosine, S(factor * turn[0]), S(factor * turn[1]), S(factor * turn[2])};
  const Quaternion<S> result = Quaternion<S>{q[0], q[1], q[2], q[3]} * by;
  q[0] = result.w, q[1] = result.x, q[2] = result.y, q[3] = result.z;
}

// Updates velocities, then coordinates with the new velocities. The linear velocity of a free root is updated by its
// components in W, in which its acceleration is that of its origin. This matches the semi-implicit method of other
// engines.
template <class S>
void LaneRollout<S>::step_euler() {
  const S h(tables_.step);
  S* q = y_.data();
  S* v = y_.data() + tables_.coordinates;
  accelerate(y_.data());
  for (int n = 0; n < tables_.link_count; ++n) {
    const TreeLink<S>& link = tree_.links[static_cast<std::size_t>(n)];
    if (has_one_axis(link.joint)) {
      v[link.v] += h * vdot_[link.v];
      q[link.q] += h * v[link.v];
      continue;
    }
    if (link.joint == JointType::spherical) {
      Vector3<S> turn;
      for (int k = 0; k < 3; ++k) v[link.v + k] += h * vdot_[link.v + k], turn[k] = h * v[link.v + k];
      turn_quaternion(q + link.q, turn);
      continue;
    }
    if (link.joint != JointType::free) continue;
    S* const quaternion = q + link.q + 3;
    const auto rotation = [&] {
      return rotation_matrix(Quaternion<S>{quaternion[0], quaternion[1], quaternion[2], quaternion[3]});
    };
    const Vector3<S> w{v[link.v], v[link.v + 1], v[link.v + 2]}, u{v[link.v + 3], v[link.v + 4], v[link.v + 5]};
    const Vector3<S> udot{vdot_[link.v + 3], vdot_[link.v + 4], vdot_[link.v + 5]};
    const Rotation<S> R = rotation();
    const Vector3<S> change = R * Vector3<S>(udot + cross(w, u));
    Vector3<S> velocity = R * u, turn;
    for (int k = 0; k < 3; ++k) {
      v[link.v + k] += h * vdot_[link.v + k];
      velocity[k] += h * change[k];
      q[link.q + k] += h * velocity[k];
      turn[k] = h * v[link.v + k];
    }
    turn_quaternion(quaternion, turn);
    const Vector3<S> in_B = transposed_times(rotation(), velocity);
    for (int k = 0; k < 3; ++k) v[link.v + 3 + k] = in_B[k];
  }
  normalize(y_.data());
}

}  // namespace grapnel::lanes
