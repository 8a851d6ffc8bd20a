#include "grapnel/simulate/thruster_bank.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace grapnel {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
// Events are found to rounding: a share within this of a level has reached it.
constexpr double kAtLevel = 1e-9;
// A pulse that would leave less than this fraction of a period lasts the whole period.
constexpr double kWholePeriod = 1e-9;

}  // namespace

ThrusterBank::ThrusterBank(std::vector<Thruster> thrusters, const Vector3d& about)
    : thrusters_(std::move(thrusters)), about_(about), allocation_(thrusters_, about), valves_(thrusters_.size()) {
  for (const Thruster& t : thrusters_) {
    if (!(std::abs(norm(t.direction) - 1) < 1e-9) || !(t.force > 0) || !(t.specific_impulse > 0) ||
        !(t.min_on_time >= 0) || !(t.rise >= 0) || !(t.fall >= 0))
      throw std::invalid_argument(
          "ThrusterBank: directions must be unit vectors, forces and specific impulses positive, times not negative");
  }
}

double ThrusterBank::level(std::size_t i, double t) const {
  const Valve& valve = valves_[i];
  const double rise = thrusters_[i].rise, fall = thrusters_[i].fall;
  if (valve.open) return rise > 0 ? std::min(1.0, valve.level + (t - valve.since) / rise) : 1.0;
  return fall > 0 ? std::max(0.0, valve.level - (t - valve.since) / fall) : 0.0;
}

// Time until the force is constant [s].
double ThrusterBank::until_steady(const Valve& valve, const Thruster& thruster) const {
  return valve.since + (valve.open ? (1 - valve.level) * thruster.rise : valve.level * thruster.fall);
}

void ThrusterBank::begin(double t, double same) {
  if (begun_ && std::abs(t - time_) > same) {
    for (Valve& valve : valves_) valve.open = false, valve.level = 0, valve.since = t, valve.closes = kNever;
    mean_torque = Vector3d::zero();
  }
  time_ = t, begun_ = true;
}

ThrusterBank::Use ThrusterBank::use(std::size_t i, double t) const {
  Use use = valves_[i].use;
  const double dt = std::max(t - time_, 0.0);
  if (valves_[i].open) use.on_time += dt;
  // Between two edges, forces are linear in time.
  use.impulse += 0.5 * thrusters_[i].force * (level(i, time_) + level(i, time_ + dt)) * dt;
  return use;
}

double ThrusterBank::propellant(double t) const {
  double mass = 0;
  for (std::size_t i = 0; i < size(); ++i)
    mass += use(i, t).impulse / (thrusters_[i].specific_impulse * kStandardGravity);
  return mass;
}

void ThrusterBank::advance(double t, double same) {
  for (std::size_t i = 0; i < size(); ++i) valves_[i].use = use(i, t);
  time_ = t;
  for (std::size_t i = 0; i < size(); ++i) {
    Valve& valve = valves_[i];
    if (std::abs(until_steady(valve, thrusters_[i]) - t) <= same) valve.level = valve.open ? 1 : 0, valve.since = t;
    if (valve.open && valve.closes <= t + same) close(i);
  }
}

// Time t => first edge of any valve or end of a force ramp after t, at most `end`; edges within `same` of either count
// as equal.
double ThrusterBank::next_edge(double t, double end, double same) const {
  double next = end;
  const auto consider = [&](double edge) {
    if (edge > t + same && edge < next - same) next = edge;
  };
  for (std::size_t i = 0; i < size(); ++i) {
    const Valve& valve = valves_[i];
    consider(until_steady(valve, thrusters_[i]));
    if (!valve.open) continue;
    consider(valve.closes);
    consider(valve.opened + thrusters_[i].min_on_time);
  }
  return next;
}

void ThrusterBank::open(std::size_t i, double for_) {
  Valve& valve = valves_[i];
  if (!valve.open) {
    valve.level = level(i, time_);
    valve.open = true, valve.since = valve.opened = time_;
    ++valve.use.firings;
  }
  valve.closes = time_ + for_;
}

void ThrusterBank::close(std::size_t i) {
  Valve& valve = valves_[i];
  if (!valve.open) return;
  valve.level = level(i, time_);
  valve.open = false, valve.since = time_, valve.closes = kNever;
}

bool ThrusterBank::is_locked(std::size_t i) const {
  // Times are sums with rounding errors.
  const double left = valves_[i].opened + thrusters_[i].min_on_time - time_;
  return valves_[i].open && left > 1e-12 * std::max(1.0, std::abs(time_));
}

// Open valve => remaining time for which its minimum on-time keeps it open [s].
double ThrusterBank::locked_for(std::size_t i) const { return valves_[i].opened + thrusters_[i].min_on_time - time_; }

// Torque impulse of a period [N m s] => valves opened for the on-times of (18.2), scaled to the period; below the
// minimum on-time with the hysteresis of docs/theory, section 18. Returns the mean torque [N m].
Vector3d ThrusterBank::pulse(const Vector3d& torque_impulse, double period, const ThrusterModulation& modulation) {
  std::vector<double> times = allocation_.on_times(torque_impulse).value_or(std::vector<double>(size(), 0.0));
  const double longest = times.empty() ? 0 : *std::max_element(times.begin(), times.end());
  // The longest pulse is the period: less torque is given, in the same direction.
  const double share = longest > period ? period / longest : 1;
  Vector3d given = Vector3d::zero();
  for (std::size_t i = 0; i < size(); ++i) {
    double time = share * times[i];
    const double least = thrusters_[i].min_on_time;
    if (time < least) {
      const double ratio = time / least;
      const bool was_on = valves_[i].pulsed;
      const bool on = ratio >= modulation.level_on || (ratio > modulation.level_off && was_on);
      time = on ? least : 0;
    }
    valves_[i].pulsed = time > 0;
    if (time > 0) {
      open(i, time >= period * (1 - kWholePeriod) ? kNever : time);
    } else {
      close(i);
    }
    given += (std::min(time, period) / period) * allocation_.torque(i);
  }
  return given;
}

void ThrusterBank::pulse_each(std::span<const double> shares, double period) {
  for (std::size_t i = 0; i < size(); ++i) {
    const double share = shares.empty() ? 0 : shares[i];
    if (!(share > 0) && is_locked(i)) {
      open(i, locked_for(i));  // it closes as soon as permitted
    } else if (!(share > 0)) {
      close(i);
    } else {
      open(i, share >= 1 - kWholePeriod ? kNever : std::max(share * period, thrusters_[i].min_on_time));
    }
  }
}

void ThrusterBank::trigger(const Vector3d& torque, const ThrusterModulation& modulation) {
  const std::vector<double> shares = allocation_.on_times(torque).value_or(std::vector<double>(size(), 0.0));
  for (std::size_t i = 0; i < size(); ++i) {
    if (is_open(i)) {
      if (!is_locked(i) && shares[i] <= modulation.level_off * (1 + kAtLevel)) close(i);
    } else if (shares[i] >= modulation.level_on * (1 - kAtLevel)) {
      open(i);
    }
  }
}

double ThrusterBank::trigger_margin(const Vector3d& torque, const ThrusterModulation& modulation) const {
  const std::vector<double> shares = allocation_.on_times(torque).value_or(std::vector<double>(size(), 0.0));
  double least = 1;
  for (std::size_t i = 0; i < size(); ++i) {
    if (!is_open(i)) {
      least = std::min(least, modulation.level_on - shares[i]);
    } else if (!is_locked(i)) {
      least = std::min(least, shares[i] - modulation.level_off);
    }
  }
  return least;
}

bool ThrusterBank::dumps(double momentum, const MomentumDumping& dumping) {
  dumped_.largest_momentum = std::max(dumped_.largest_momentum, momentum);
  if (!dumped_.active && momentum > dumping.above) {
    if (dumped_.begun++ == 0) dumped_.first_begin = time_;
    dumped_.active = true, dumped_.since = time_;
  } else if (dumped_.active && momentum < dumping.below) {
    dumped_.active = false;
    dumped_.time += time_ - dumped_.since, dumped_.last_end = time_;
  }
  return dumped_.active;
}

// --- Thrusters as actuators of the base ---

ThrusterEffector::ThrusterEffector(std::shared_ptr<ThrusterBank> bank, ThrusterCommands commands,
                                   std::shared_ptr<ControlClock> clock)
    : bank_(std::move(bank)),
      commands_(std::move(commands)),
      dumped_(commands_.dumped),
      clock_(std::move(clock)),
      thrusts_(bank_->size(), 0.0) {
  const bool pulses = commands_.modulation.kind == ThrusterModulation::Kind::pulse_width;
  if (pulses && !clock_ && !commands_.one_by_one)
    throw std::invalid_argument("ThrusterEffector: pulse widths need a clock");
  if (commands_.dumping && !pulses) throw std::invalid_argument("ThrusterEffector: dumping needs pulse widths");
}

// Computes the thrusters' forces at a time, and their resultant.
void ThrusterEffector::evaluate_thrusts(double t) {
  thrust_torque_ = Vector3d::zero(), thrust_ = thrust_at(t);
  for (std::size_t i = 0; i < thrusts_.size(); ++i) {
    const Thruster& thruster = bank_->thrusters()[i];
    thrusts_[i] = thruster.force * bank_->level(i, t);
    const Vector3d F = thrusts_[i] * thrust_direction(thruster);
    thrust_torque_ += cross(thruster.position - bank_->about(), F);
  }
}

Wrenchd ThrusterEffector::thrust_at(double t) const {
  Wrenchd sum = Wrenchd::zero();
  for (std::size_t i = 0; i < bank_->size(); ++i) {
    const Thruster& thruster = bank_->thrusters()[i];
    const Vector3d F = (thruster.force * bank_->level(i, t)) * thrust_direction(thruster);
    sum.angular += cross(thruster.position, F);
    sum.linear += F;
  }
  return sum;
}

void ThrusterEffector::push(double t, int root, const Posed& X_WB, std::span<ExternalWrench> wrenches) {
  evaluate_thrusts(t);
  for (std::size_t i = 0; i < thrusts_.size(); ++i) {
    const Thruster& thruster = bank_->thrusters()[i];
    const Vector3d F = thrusts_[i] * thrust_direction(thruster);
    wrenches[i] = {root, X_WB * thruster.position, {Vector3d::zero(), X_WB.R * F}};
  }
}

// Commands act through the valves, which switch in choose_modes().
void ThrusterEffector::drive(const BaseMoment&, const BaseCommand& command, std::span<double>, std::span<double>) {
  torque_ = command.torque, given_ = thrust_torque_;
}

void ThrusterEffector::add_beside(const BaseMoment& at, const Vector3d&, std::span<double>, std::span<double> beside) {
  evaluate_thrusts(at.time);
  for (int k = 0; k < 3; ++k) beside[at.v + k] += thrust_.angular[k], beside[at.v + 3 + k] += thrust_.linear[k];
}

void ThrusterEffector::begin(double t, double same) {
  same_time_ = same;
  bank_->begin(t, same);
}

// Distance from the levels at which thrusters switch by the state, at any time; 1 under a clock.
double ThrusterEffector::margin(std::span<const double>, const Evaluation& evaluate) {
  if (commands_.modulation.kind != ThrusterModulation::Kind::schmitt || clock_) return 1;
  evaluate();
  return bank_->trigger_margin(torque_, commands_.modulation);
}

// Switches thrusters when a command of the clock begins to act, or, without a clock, by the state.
void ThrusterEffector::choose_modes(double t, std::span<const double>, const Evaluation& evaluate) {
  if (!clock_) {
    evaluate();
    return bank_->trigger(torque_, commands_.modulation);
  }
  const double period = clock_->timing().period, delay = clock_->timing().delay;
  const double number = std::round((t - delay) / period);
  const bool begins = number >= 0 && std::abs(number * period + delay - t) <= 2 * same_time_;
  if (!begins || static_cast<long>(number) == bank_->last_period) return;
  bank_->last_period = static_cast<long>(number);
  pulse_in_period(period);
}

// Held command => pulses of the period that begins (18.2), or, for dumping, pulses against the wheels' momentum (18.5).
void ThrusterEffector::pulse_in_period(double period) {
  if (commands_.one_by_one) return bank_->pulse_each(clock_->held().actuators.thruster, period);
  Vector3d torque = clock_->held().base_torque;
  if (commands_.dumping) {
    // From the readings at the sample time. At most the remaining momentum.
    const Vector3d h = dumped_.momentum(clock_->held().wheel_rates);
    const double size = norm(h);
    const bool dumps = bank_->dumps(size, *commands_.dumping);
    torque = dumps && size > 0 ? (-std::min(commands_.dumping->torque, size / period) / size) * h : Vector3d::zero();
  }
  if (commands_.modulation.kind == ThrusterModulation::Kind::schmitt)
    return bank_->trigger(torque, commands_.modulation);
  bank_->mean_torque = bank_->pulse(period * torque, period, commands_.modulation);
}

}  // namespace grapnel
