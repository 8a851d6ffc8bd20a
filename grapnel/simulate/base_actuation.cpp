#include "grapnel/simulate/base_actuation.hpp"

#include <algorithm>
#include <stdexcept>

namespace grapnel {
namespace {

// Settings => nothing; throws std::invalid_argument if they contradict each other.
void check_settings(const std::optional<AttitudeControl>& attitude, int root, bool has_wheels, bool has_clock,
                    const BaseActuators& a) {
  if (a.one_by_one) {
    if (attitude || root < 0 || !has_clock)
      throw std::invalid_argument("BaseActuation: commands of each actuator need a controller and a clock");
    return;
  }
  if (a.steering && (root < 0 || has_wheels || a.thrusters))
    throw std::invalid_argument("BaseActuation: a torque by gyros needs a root, and no other actuators");
  if ((a.thrusters || a.feedforward || a.wheel_speed_rate != 0) && !attitude)
    throw std::invalid_argument("BaseActuation: thrusters, feedforward and wheel speeds need attitude control");
  if (a.thrusters && a.dumping.has_value() == !has_wheels)
    throw std::invalid_argument(
        "BaseActuation: thrusters must either drive the base or dump the momentum of its wheels");
  if (a.dumping && !a.thrusters) throw std::invalid_argument("BaseActuation: dumping needs thrusters");
}

void append(const std::vector<int>& more, std::vector<int>& all) { all.insert(all.end(), more.begin(), more.end()); }

}  // namespace

// --- External torque ---

void ExternalTorque::drive(const BaseMoment& at, const BaseCommand& command, std::span<double>,
                           std::span<double> force) {
  given_ = command.torque;
  for (int k = 0; k < 3; ++k) force[at.v + k] = given_[k];
}

void ExternalTorque::add_beside(const BaseMoment& at, const Vector3d& torque, std::span<double>,
                                std::span<double> beside) {
  for (int k = 0; k < 3; ++k) beside[at.v + k] += torque[k];
}

// --- All effectors ---

// Settings => effectors in the order of their evaluation; the last one that can give the commanded torque gives it, an
// external torque if there is no other.
BaseActuation::BaseActuation(const Model& model, const std::optional<AttitudeControl>& attitude, int commanded_root,
                             const std::vector<ReactionWheel>& wheels, const std::vector<MomentGyro>& gyros,
                             const BaseActuators& actuators, const std::shared_ptr<ControlClock>& clock,
                             const Effectors& others)
    : attitude_(attitude),
      root_(attitude ? attitude->root : commanded_root),
      feedforward_(actuators.feedforward),
      one_by_one_(actuators.one_by_one) {
  check_settings(attitude, root_, !wheels.empty(), clock != nullptr, actuators);
  if (root_ >= 0) q_ = model.bodies().at(root_).q, v_ = model.bodies().at(root_).v;
  if (actuators.thrusters) {
    effectors_.push_back(std::make_shared<ThrusterEffector>(
        actuators.thrusters, ThrusterCommands{actuators.modulation, actuators.dumping, wheels, one_by_one_}, clock));
  }
  if (!gyros.empty() || actuators.steering)
    effectors_.push_back(std::make_shared<GyroEffector>(gyros, actuators.steering, one_by_one_));
  if (!wheels.empty()) {
    effectors_.push_back(std::make_shared<WheelEffector>(
        wheels, WheelCommands{one_by_one_, actuators.wheel_speed_rate, actuators.wheel_speeds,
                              actuators.dumping ? actuators.thrusters : nullptr}));
  } else if (!actuators.wheel_speeds.empty()) {
    throw std::invalid_argument("BaseActuation: speeds of wheels need wheels");
  }
  effectors_.insert(effectors_.end(), others.begin(), others.end());
  const auto drives = [](const auto& effector) { return effector->drives(); };
  if (root_ >= 0 && !one_by_one_ && std::none_of(effectors_.begin(), effectors_.end(), drives))
    effectors_.push_back(std::make_shared<ExternalTorque>());
  for (const auto& effector : effectors_) {
    if (root_ >= 0 && !one_by_one_ && effector->drives()) driver_ = effector.get();
    const EffectorVelocities own = effector->velocities();
    append(own.all, velocities_.all);
    append(own.rate_controlled, velocities_.rate_controlled);
    append(own.fast, velocities_.fast);
  }
}

void BaseActuation::check(const Model& model, std::span<const std::uint8_t> is_free) const {
  for (const auto& effector : effectors_) effector->check(model, root_, is_free);
}

std::size_t BaseActuation::wrench_count() const {
  std::size_t count = 0;
  for (const auto& effector : effectors_) count += effector->wrench_count();
  return count;
}

bool BaseActuation::holds_wheel(int velocity) const {
  const auto* wheels = find<WheelEffector>();
  return wheels && wheels->holds(velocity);
}

std::vector<double> BaseActuation::wheel_rates(std::span<const double> v) const {
  std::vector<double> rates;
  if (const auto* wheels = find<WheelEffector>()) {
    for (const ReactionWheel& wheel : wheels->array().wheels()) rates.push_back(v[wheel.velocity]);
  }
  return rates;
}

Vector3d BaseActuation::attitude_torque_in(const State& state, const Vector3d& ahead) const {
  if (!attitude_) return Vector3d::zero();
  const BaseMoment at = moment(0, state);
  Vector3d torque = attitude_torque(*attitude_, at.attitude(), at.rate());
  if (!feedforward_) return torque;
  for (int k = 0; k < 3; ++k) torque[k] = control_law::within_limit(torque[k] + ahead[k], attitude_->limit[k]);
  return torque;
}

void BaseActuation::prescribe(const PrescribedRates& rates) const {
  for (const auto& effector : effectors_) effector->prescribe(rates);
}

void BaseActuation::push(double t, const Posed& X_WB, std::span<ExternalWrench> wrenches) {
  for (const auto& effector : effectors_) {
    const std::size_t count = effector->wrench_count();
    if (count == 0) continue;
    effector->push(t, root_, X_WB, wrenches.first(count));
    wrenches = wrenches.subspan(count);
  }
}

void BaseActuation::drive(double t, const State& state, const BaseCommand& command, std::span<double> effort,
                          std::span<double> force) {
  commanded_torque_ = one_by_one_ ? Vector3d::zero() : command.torque;
  const BaseMoment at = moment(t, state);
  for (const auto& effector : effectors_) effector->drive(at, command, effort, force);
}

void BaseActuation::turn(double t, const State& state, const ActuatorCommands& each, const PrescribedRates& rates) {
  const BaseMoment at = moment(t, state);
  for (const auto& effector : effectors_) effector->turn(at, commanded_torque_, each, rates);
}

bool BaseActuation::cut(std::span<const double> force, std::span<std::uint8_t> prescribed, std::span<double> effort) {
  bool any = false;
  for (const auto& effector : effectors_) any = effector->cut(force, prescribed, effort) || any;
  return any;
}

void BaseActuation::conclude(std::span<const double> force, std::span<const double> friction,
                             std::span<double> effort) {
  for (const auto& effector : effectors_) effector->conclude(force, friction, effort);
}

void BaseActuation::add_beside(double t, const State& state, std::span<double> effort, std::span<double> beside) {
  if (!attitude_) return;
  const Vector3d torque = attitude_torque_in(state);
  const BaseMoment at = moment(t, state);
  for (const auto& effector : effectors_) effector->add_beside(at, torque, effort, beside);
}

Vector3d BaseActuation::given() const {
  if (driver_) return driver_->given();
  Vector3d sum = Vector3d::zero();
  for (const auto& effector : effectors_) sum += effector->given();
  return one_by_one_ ? sum : Vector3d::zero();
}

Wrenchd BaseActuation::thrust_at(double t) const {
  const auto* effector = find<ThrusterEffector>();
  return effector ? effector->thrust_at(t) : Wrenchd::zero();
}

std::span<const double> BaseActuation::thrusts() const {
  const auto* effector = find<ThrusterEffector>();
  return effector ? effector->thrusts() : std::span<const double>();
}

const ThrusterBank* BaseActuation::thrusters() const {
  const auto* effector = find<ThrusterEffector>();
  return effector ? &effector->bank() : nullptr;
}

// --- Time and modes ---

void BaseActuation::begin(double t, double same) {
  for (const auto& effector : effectors_) effector->begin(t, same);
}

void BaseActuation::reach(double t) {
  for (const auto& effector : effectors_) effector->reach(t);
}

double BaseActuation::next_edge(double t, double end) const {
  for (const auto& effector : effectors_) end = effector->next_edge(t, end);
  return end;
}

std::optional<std::pair<int, double>> BaseActuation::tried_rate() const {
  for (const auto& effector : effectors_) {
    if (const auto tried = effector->tried_rate()) return tried;
  }
  return {};
}

bool BaseActuation::switches() const {
  return std::any_of(effectors_.begin(), effectors_.end(), [](const auto& effector) { return effector->switches(); });
}

double BaseActuation::margin(std::span<const double> v, const Evaluation& evaluate) {
  double least = 1;
  for (const auto& effector : effectors_) {
    if (effector->switches()) least = std::min(least, effector->margin(v, evaluate));
  }
  return least;
}

void BaseActuation::choose_modes(double t, std::span<const double> v, const Evaluation& evaluate) {
  reach(t);
  for (const auto& effector : effectors_) {
    if (effector->switches()) effector->choose_modes(t, v, evaluate);
  }
}

}  // namespace grapnel
