#include "grapnel/simulate/controller.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace grapnel {
namespace {

// Times that differ only by rounding are equal.
double resolution_at(double t) { return 64 * std::numeric_limits<double>::epsilon() * std::abs(t); }

}  // namespace

ControlClock::ControlClock(const ControlTiming& timing, std::size_t channels) : timing_(timing) {
  if (!(timing.period > 0) || !std::isfinite(timing.period))
    throw std::invalid_argument("ControlClock: the period must be positive and finite");
  if (!(timing.delay >= 0) || !std::isfinite(timing.delay))
    throw std::invalid_argument("ControlClock: the delay must be finite and not negative");
  held_.effort.assign(channels, 0.0);
}

// Interval t0 to t1 => sample times and, with a delay, the times at which commands take effect (6.14), strictly
// between. The two series are concatenated, not merged. Throws std::invalid_argument above 1e8 periods.
std::vector<double> ControlClock::break_times(double t0, double t1) const {
  constexpr double kMost = 1e8;  // maximum number of sample times of a phase
  if (!((t1 - t0) / timing_.period < kMost))
    throw std::invalid_argument("ControlClock: too many sample times in a phase; the period is too short");
  std::vector<double> times;
  const auto add = [&](double offset) {
    const double first = std::max(0.0, std::floor((t0 - offset) / timing_.period));
    for (auto k = static_cast<std::int64_t>(first);; ++k) {
      const double t = tick_time(k) + offset;
      if (t >= t1) break;
      if (t > t0) times.push_back(t);
    }
  };
  add(0);
  if (timing_.delay > 0) add(timing_.delay);
  return times;
}

void ControlClock::let_act(double until) {
  while (!pending_.empty() && pending_.front().acts_from <= until) {
    held_ = std::move(pending_.front().command);
    pending_.pop_front();
  }
}

bool ControlClock::tick(double t, double same) {
  const double within = std::max(same, resolution_at(t)), now = t + within;
  let_act(now);
  if (tick_time(next_tick_) > now) return false;
  // The latest sample time up to t; it is due if it equals t.
  auto k = std::max(next_tick_, static_cast<std::int64_t>(std::floor(t / timing_.period)));
  while (tick_time(k + 1) <= now) ++k;
  while (k > next_tick_ && tick_time(k) > now) --k;
  next_tick_ = k + 1;
  tick_ = tick_time(k);
  return tick_ >= t - within;
}

std::vector<ControlClock::Command> ControlClock::commands() const {
  std::vector<Command> all{held_};
  for (const Pending& one : pending_) all.push_back(one.command);
  return all;
}

void ControlClock::put(std::vector<Command> commands) {
  if (commands.size() != 1 + pending_.size())
    throw std::invalid_argument("ControlClock: the number of commands must not change");
  held_ = std::move(commands.front());
  for (std::size_t i = 0; i < pending_.size(); ++i) pending_[i].command = std::move(commands[i + 1]);
}

void ControlClock::command(Command said, double t, double same) {
  pending_.push_back({tick_ + timing_.delay, std::move(said)});
  let_act(t + std::max(same, resolution_at(t)));
}

}  // namespace grapnel
