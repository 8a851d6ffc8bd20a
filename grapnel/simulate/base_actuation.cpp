#include "grapnel/simulate/base_actuation.hpp"

#include <algorithm>
#include <cmath>

namespace grapnel {
namespace {

// A wheel at its largest rate that is driven on by less, relative to that rate, is driven on by rounding [1/s].
constexpr double kDrivenOn = 1e-9;

}  // namespace

BaseActuation::BaseActuation(const Model& model, const std::optional<AttitudeControl>& attitude, int commanded_root,
                             std::vector<ReactionWheel> wheels)
    : attitude_(attitude), root_(attitude ? attitude->root : commanded_root), wheels_(std::move(wheels)) {
  if (root_ < 0) return;
  q_ = model.bodies().at(root_).q, v_ = model.bodies().at(root_).v;
}

Vector3d BaseActuation::attitude_torque_in(const State& state) const {
  if (!attitude_) return Vector3d::zero();
  const double* q = state.q.data() + q_ + 3;
  const double* w = state.v.data() + v_;
  return attitude_torque(*attitude_, {q[0], q[1], q[2], q[3]}, {w[0], w[1], w[2]});
}

void BaseActuation::prescribe(const PrescribedRates& rates) const {
  for (std::size_t i = 0; i < wheels_.wheels().size(); ++i) {
    const int v = wheels_.wheels()[i].velocity;
    const bool held = wheels_.mode(i) == WheelArray::Mode::held;
    rates.prescribed[v] = rates.as_commanded[v] = held;
    rates.acceleration[v] = 0;
    if (held) rates.rate[v] = wheels_.held_rate(i);
  }
}

void BaseActuation::drive(const Vector3d& torque, std::span<double> effort, std::span<double> force) {
  asked_ = torque;
  if (!wheels_.empty()) return wheels_.drive(torque, effort);
  given_ = torque;
  for (int k = 0; k < 3; ++k) force[v_ + k] = given_[k];
}

void BaseActuation::conclude(std::span<const double> force, std::span<const double> friction,
                             std::span<double> effort) {
  if (wheels_.empty()) return;
  for (std::size_t i = 0; i < wheels_.wheels().size(); ++i) {
    const ReactionWheel& wheel = wheels_.wheels()[i];
    if (wheels_.mode(i) == WheelArray::Mode::held) effort[wheel.joint] = force[wheel.velocity] - friction[wheel.joint];
  }
  given_ = wheels_.torque_of(effort);
}

void BaseActuation::add_beside(const State& state, std::span<double> effort, std::span<double> beside) const {
  if (!attitude_) return;
  const Vector3d torque = attitude_torque_in(state);
  if (wheels_.empty()) {
    for (int k = 0; k < 3; ++k) beside[v_ + k] = torque[k];
    return;
  }
  wheels_.drive(torque, effort);
  for (std::size_t i = 0; i < wheels_.wheels().size(); ++i) {
    const ReactionWheel& wheel = wheels_.wheels()[i];
    if (wheels_.mode(i) != WheelArray::Mode::held) beside[wheel.velocity] += effort[wheel.joint];
  }
}

std::optional<std::pair<int, double>> BaseActuation::tried_rate() const {
  if (!tried_) return {};
  return std::pair{wheels_.wheels()[*tried_].velocity, wheels_.held_rate(*tried_)};
}

// Of a wheel that is held: how it would go on if it were free.
double BaseActuation::driving_on(std::size_t wheel, const Evaluation& evaluate) {
  tried_ = wheel;
  wheels_.try_free(wheel);
  const std::span<const double> acceleration = evaluate();
  tried_.reset();
  wheels_.try_free({});
  return wheels_.driving_on(wheel, acceleration);
}

double BaseActuation::margin(std::span<const double> v, const Evaluation& evaluate) {
  double least = 1;
  for (std::size_t i = 0; i < wheels_.wheels().size(); ++i) {
    if (std::isfinite(wheels_.wheels()[i].rate) && wheels_.mode(i) != WheelArray::Mode::held)
      least = std::min(least, wheels_.margin(i, v));
  }
  for (std::size_t i = 0; i < wheels_.wheels().size(); ++i) {
    if (wheels_.mode(i) == WheelArray::Mode::held && !stays_held_[i]) least = std::min(least, driving_on(i, evaluate));
  }
  return least;
}

// By the rates, then by what the wheels at their largest rates would do if they were free. Each is freed at most once,
// and held again if another one's being free drives it on: then it stays held until modes are chosen again, as one that
// rounding leaves in doubt does.
void BaseActuation::choose_modes(std::span<const double> v, const Evaluation& evaluate) {
  const std::size_t count = wheels_.wheels().size();
  wheels_.take_modes(v);
  stays_held_.assign(count, 0);
  if (!wheels_.any_held()) return;
  std::vector<std::uint8_t> freed(count, 0);
  for (bool changed = true; changed;) {
    changed = false;
    for (std::size_t i = 0; i < count && !changed; ++i) {
      if (wheels_.mode(i) != WheelArray::Mode::held || freed[i] || driving_on(i, evaluate) > 0) continue;
      wheels_.set_mode(i, WheelArray::Mode::free);
      freed[i] = 1, changed = true;
    }
    if (changed) continue;
    const std::span<const double> acceleration = evaluate();
    for (std::size_t i = 0; i < count && !changed; ++i) {
      if (!freed[i] || wheels_.mode(i) == WheelArray::Mode::held || !(wheels_.driving_on(i, acceleration) > kDrivenOn))
        continue;
      wheels_.set_mode(i, WheelArray::Mode::held);
      changed = true;
    }
  }
  for (std::size_t i = 0; i < count; ++i)
    stays_held_[i] = wheels_.mode(i) == WheelArray::Mode::held && !(driving_on(i, evaluate) > 0);
}

}  // namespace grapnel
