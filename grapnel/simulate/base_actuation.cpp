#include "grapnel/simulate/base_actuation.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace grapnel {
namespace {

// Threshold of the relative acceleration of a wheel at its maximum rate; smaller values are rounding errors [1/s].
constexpr double kDrivenOn = 1e-9;

}  // namespace

BaseActuation::BaseActuation(const Model& model, const std::optional<AttitudeControl>& attitude, int commanded_root,
                             std::vector<ReactionWheel> wheels, std::vector<MomentGyro> gyros, BaseActuators actuators,
                             std::shared_ptr<ControlClock> clock)
    : attitude_(attitude),
      root_(attitude ? attitude->root : commanded_root),
      wheels_(std::move(wheels)),
      gyros_(std::move(gyros), actuators.steering.value_or(GyroSteering{})),
      actuators_(std::move(actuators)),
      clock_(std::move(clock)) {
  check_actuators();
  thrusts_.assign(thruster_count(), 0.0);
  if (root_ < 0) return;
  q_ = model.bodies().at(root_).q, v_ = model.bodies().at(root_).v;
}

// Members after construction => nothing; throws std::invalid_argument if the settings of thrusters, gyros, wheels,
// clock and attitude control contradict each other.
void BaseActuation::check_actuators() const {
  const BaseActuators& a = actuators_;
  if (a.one_by_one) {
    if (attitude_ || root_ < 0 || !clock_)
      throw std::invalid_argument("BaseActuation: commands of each actuator need a controller and a clock");
    return;
  }
  if (a.steering && (root_ < 0 || gyros_.gyros().size() < 3 || !wheels_.empty() || a.thrusters))
    throw std::invalid_argument(
        "BaseActuation: a torque by gyros needs at least three of them, and no other actuators");
  if ((a.thrusters || a.feedforward || a.wheel_speed_rate != 0) && !attitude_)
    throw std::invalid_argument("BaseActuation: thrusters, feedforward and wheel speeds need attitude control");
  if (a.thrusters && a.modulation.kind == ThrusterModulation::Kind::pulse_width && !clock_)
    throw std::invalid_argument("BaseActuation: pulse widths need a clock");
  if (a.thrusters && a.dumping.has_value() == wheels_.empty())
    throw std::invalid_argument(
        "BaseActuation: thrusters must either drive the base or dump the momentum of its wheels");
  if (a.dumping && (!a.thrusters || a.modulation.kind != ThrusterModulation::Kind::pulse_width))
    throw std::invalid_argument("BaseActuation: dumping needs thrusters and pulse widths");
  if (!a.wheel_speeds.empty() && a.wheel_speeds.size() != wheels_.wheels().size())
    throw std::invalid_argument("BaseActuation: one speed per wheel is needed");
}

Vector3d BaseActuation::attitude_torque_in(const State& state, const Vector3d& ahead) const {
  if (!attitude_) return Vector3d::zero();
  const double* q = state.q.data() + q_ + 3;
  const double* w = state.v.data() + v_;
  Vector3d torque = attitude_torque(*attitude_, {q[0], q[1], q[2], q[3]}, {w[0], w[1], w[2]});
  if (!actuators_.feedforward) return torque;
  for (int k = 0; k < 3; ++k) torque[k] = control_law::within_limit(torque[k] + ahead[k], attitude_->limit[k]);
  return torque;
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

// Computes the thrusters' forces at a time, and their resultant.
void BaseActuation::check_thrusts(double t) {
  thrust_torque_ = Vector3d::zero(), thrust_ = thrust_at(t);
  for (std::size_t i = 0; i < thrusts_.size(); ++i) {
    const Thruster& thruster = actuators_.thrusters->thrusters()[i];
    thrusts_[i] = thruster.force * actuators_.thrusters->level(i, t);
    const Vector3d F = thrusts_[i] * thrust_direction(thruster);
    thrust_torque_ += cross(thruster.position - actuators_.thrusters->about(), F);
  }
}

Wrenchd BaseActuation::thrust_at(double t) const {
  Wrenchd sum = Wrenchd::zero();
  for (std::size_t i = 0; i < thruster_count(); ++i) {
    const Thruster& thruster = actuators_.thrusters->thrusters()[i];
    const Vector3d F = (thruster.force * actuators_.thrusters->level(i, t)) * thrust_direction(thruster);
    sum.angular += cross(thruster.position, F);
    sum.linear += F;
  }
  return sum;
}

void BaseActuation::push(double t, const Posed& X_WB, std::span<ExternalWrench> wrenches) {
  check_thrusts(t);
  for (std::size_t i = 0; i < thrusts_.size(); ++i) {
    const Thruster& thruster = actuators_.thrusters->thrusters()[i];
    const Vector3d F = thrusts_[i] * thrust_direction(thruster);
    wrenches[i] = {root_, X_WB * thruster.position, {Vector3d::zero(), X_WB.R * F}};
  }
}

// The torque of the wheels that compensates the thrusters.
Vector3d BaseActuation::countered() const {
  return actuators_.dumping ? actuators_.thrusters->mean_torque : Vector3d::zero();
}

std::vector<double> BaseActuation::wheel_rates(std::span<const double> v) const {
  std::vector<double> rates;
  for (const ReactionWheel& wheel : wheels_.wheels()) rates.push_back(v[wheel.velocity]);
  return rates;
}

bool BaseActuation::holds_wheel(int velocity) const {
  for (std::size_t i = 0; i < wheels_.wheels().size(); ++i) {
    if (wheels_.wheels()[i].velocity == velocity) return wheels_.mode(i) == WheelArray::Mode::held;
  }
  return false;
}

// Commanded torque or actuator commands => motor efforts of the wheels, or forces on the root without actuators. Wheels
// share the torque by (17.2), less that of dumping thrusters (18.5), and approach their stated rates in the null space
// (18.7).
void BaseActuation::drive(const Vector3d& torque, const ActuatorCommands& commands, std::span<const double> wheel_rates,
                          std::span<double> effort, std::span<double> force) {
  if (actuators_.one_by_one) {
    asked_ = Vector3d::zero(), given_ = thrust_torque_;
    if (!wheels_.empty()) wheels_.drive_each(commands.wheel_torque, effort);
    return;
  }
  asked_ = torque;
  if (actuators_.steering) return;  // done by turn_gyros()
  if (!wheels_.empty()) {
    wheels_.drive(torque - countered(), effort);
    if (!(actuators_.wheel_speed_rate > 0) || wheel_rates.empty()) return;
    std::vector<double> torques;
    for (std::size_t i = 0; i < wheels_.wheels().size(); ++i) {
      const double wanted = actuators_.wheel_speeds.empty() ? 0 : actuators_.wheel_speeds[i];
      torques.push_back(actuators_.wheel_speed_rate * wheels_.wheels()[i].inertia * (wanted - wheel_rates[i]));
    }
    return wheels_.add_in_null_space(torques, effort);
  }
  if (has_thrusters()) {
    given_ = thrust_torque_;
    return;
  }
  given_ = torque;
  for (int k = 0; k < 3; ++k) force[v_ + k] = given_[k];
}

// State and the torque of drive() or commanded gimbal rates => prescribed accelerations of gimbals and rotors (17.6),
// by the steering law (17.9); remembers the resulting torque (17.7).
void BaseActuation::turn_gyros(double t, const State& state, const ActuatorCommands& commands,
                               const PrescribedRates& rates) {
  if (gyros_.empty()) return;
  gyros_.take(state.q);
  Vector3d w_B = Vector3d::zero();
  if (v_ >= 0) w_B = {state.v[v_], state.v[v_ + 1], state.v[v_ + 2]};
  if (actuators_.steering) {
    gyros_.steer(asked_, w_B, t);
  } else if (actuators_.one_by_one && !commands.gimbal_rate.empty()) {
    gyros_.command(commands.gimbal_rate);
  }
  gyros_.prescribe(state.v, rates.prescribed, rates.as_commanded, rates.acceleration);
  turned_ = gyros_.torque_of(state.v, w_B);
}

// Forces of the prescribed rates, per velocity => efforts of gyro motors and of motors that hold wheels (force less
// friction), and the torque on the base from wheels, gyros and thrusters.
void BaseActuation::conclude(std::span<const double> force, std::span<const double> friction,
                             std::span<double> effort) {
  if (!gyros_.empty()) {
    gyros_.conclude(force, effort);
    if (actuators_.steering) given_ = turned_;
    if (actuators_.one_by_one) given_ = thrust_torque_ + turned_;
  }
  if (wheels_.empty()) return;
  for (std::size_t i = 0; i < wheels_.wheels().size(); ++i) {
    const ReactionWheel& wheel = wheels_.wheels()[i];
    if (wheels_.mode(i) == WheelArray::Mode::held) effort[wheel.joint] = force[wheel.velocity] - friction[wheel.joint];
  }
  given_ = wheels_.torque_of(effort);
  if (actuators_.one_by_one) given_ += thrust_torque_ + turned_;
}

// State => generalized forces added to `beside`: thrusts on the root, the torque of attitude control (6.13) on the root
// or, by (17.2), at the wheels that are not held. Adds nothing under gyro steering.
void BaseActuation::add_beside(double t, const State& state, std::span<double> effort, std::span<double> beside) {
  if (!attitude_ || actuators_.steering) return;
  if (has_thrusters()) {
    check_thrusts(t);
    for (int k = 0; k < 3; ++k) beside[v_ + k] += thrust_.angular[k], beside[v_ + 3 + k] += thrust_.linear[k];
  }
  const Vector3d torque = attitude_torque_in(state);
  if (wheels_.empty()) {
    for (int k = 0; k < 3 && !has_thrusters(); ++k) beside[v_ + k] += torque[k];
    return;
  }
  wheels_.drive(torque - countered(), effort);
  for (std::size_t i = 0; i < wheels_.wheels().size(); ++i) {
    const ReactionWheel& wheel = wheels_.wheels()[i];
    if (wheels_.mode(i) != WheelArray::Mode::held) beside[wheel.velocity] += effort[wheel.joint];
  }
}

std::optional<std::pair<int, double>> BaseActuation::tried_rate() const {
  if (!tried_) return {};
  return std::pair{wheels_.wheels()[*tried_].velocity, wheels_.held_rate(*tried_)};
}

// The acceleration that a held wheel would have if it were free.
double BaseActuation::driving_on(std::size_t wheel, const Evaluation& evaluate) {
  tried_ = wheel;
  wheels_.try_free(wheel);
  const std::span<const double> acceleration = evaluate();
  tried_.reset();
  wheels_.try_free({});
  return wheels_.driving_on(wheel, acceleration);
}

// Whether thrusters switch by the state, at any time.
bool BaseActuation::triggers_by_state() const {
  return has_thrusters() && actuators_.modulation.kind == ThrusterModulation::Kind::schmitt && !clock_;
}

// Velocities => smallest margin of all modes, at most 1: thruster trigger levels, relative distance of free wheels from
// their maximum rates, and the acceleration (17.3) of held wheels.
double BaseActuation::margin(std::span<const double> v, const Evaluation& evaluate) {
  double least = 1;
  if (triggers_by_state()) {
    evaluate();
    least = actuators_.thrusters->trigger_margin(asked_, actuators_.modulation);
  }
  for (std::size_t i = 0; i < wheels_.wheels().size(); ++i) {
    if (std::isfinite(wheels_.wheels()[i].rate) && wheels_.mode(i) != WheelArray::Mode::held)
      least = std::min(least, wheels_.margin(i, v));
  }
  for (std::size_t i = 0; i < wheels_.wheels().size(); ++i) {
    if (wheels_.mode(i) == WheelArray::Mode::held && !stays_held_[i]) least = std::min(least, driving_on(i, evaluate));
  }
  return least;
}

void BaseActuation::begin(double t, double same) {
  same_time_ = same;
  if (has_thrusters()) actuators_.thrusters->begin(t, same);
}

void BaseActuation::reach(double t) {
  if (has_thrusters()) actuators_.thrusters->advance(t, same_time_);
}

double BaseActuation::next_edge(double t, double end) const {
  return has_thrusters() ? actuators_.thrusters->next_edge(t, end, same_time_) : end;
}

void BaseActuation::choose_modes(double t, std::span<const double> v, const Evaluation& evaluate) {
  reach(t);
  if (has_thrusters()) choose_thrusters(t, evaluate);
  if (wheels_.has_rate_limits()) choose_wheels(v, evaluate);
}

// Switches thrusters when a command of the clock begins to act, or, without a clock, by the state.
void BaseActuation::choose_thrusters(double t, const Evaluation& evaluate) {
  ThrusterBank& bank = *actuators_.thrusters;
  if (!clock_) {
    evaluate();
    return bank.trigger(asked_, actuators_.modulation);
  }
  const double period = clock_->timing().period, delay = clock_->timing().delay;
  const double number = std::round((t - delay) / period);
  const bool begins = number >= 0 && std::abs(number * period + delay - t) <= 2 * same_time_;
  if (!begins || static_cast<long>(number) == bank.last_period) return;
  bank.last_period = static_cast<long>(number);
  if (actuators_.one_by_one) return bank.pulse_each(clock_->held().actuators.thruster, period);
  Vector3d torque = clock_->held().base_torque;
  if (actuators_.dumping) {
    // From the readings at the sample time. At most the remaining momentum.
    const Vector3d h = wheels_.momentum(clock_->held().wheel_rates);
    const double size = norm(h);
    const bool dumps = bank.dumps(size, *actuators_.dumping);
    torque = dumps && size > 0 ? (-std::min(actuators_.dumping->torque, size / period) / size) * h : Vector3d::zero();
  }
  if (actuators_.modulation.kind == ThrusterModulation::Kind::schmitt)
    return bank.trigger(torque, actuators_.modulation);
  bank.mean_torque = bank.pulse(period * torque, period, actuators_.modulation);
}

// Chooses modes by the rates, then by the accelerations that wheels at their maximum rates would have if they were
// free. Each is freed at most once. It is held again if freeing another one accelerates it further; then it stays held
// until the next choice, as does a wheel in doubt due to rounding.
void BaseActuation::choose_wheels(std::span<const double> v, const Evaluation& evaluate) {
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
