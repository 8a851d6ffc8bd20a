#include "grapnel/impact/compliant_stepper.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace grapnel {
namespace {

// Maximum shift of the end of a step that is repeated for an event, relative to its length; beyond: repeat again.
constexpr double kLanded = 1e-14;
constexpr int kMostLandings = 4, kMostLookups = 60;

}  // namespace

StiffSystem StiffIntegrator::stiff_system() {
  const int positions = system_.rate_offset(), coupled = system_.loss_offset(0);
  return {positions, coupled - positions, system_.size() - coupled,
          [this](std::span<const double> t, std::span<const double> y, std::span<double> dydt) {
            const bool stages = t.size() == static_cast<std::size_t>(RadauIIA::kStages);
            system_.rates(t, y, dydt, stages ? std::span(stage_loads_) : std::span<InterfaceLoad>());
          }};
}

StiffIntegrator::StiffIntegrator(CompliantSystem& system, std::span<const double> sizes,
                                 std::span<const double> tolerances, double first_step, double end)
    : system_(system),
      stage_loads_(static_cast<std::size_t>(RadauIIA::kStages * system.interfaces())),
      radau_(stiff_system(), std::vector<double>(system.size()), sizes, tolerances),
      first_step_(first_step),
      end_(end),
      stop_(end),
      at_(system.size()),
      crossed_(system.events()),
      directions_(system.events()),
      begin_(system.events()),
      before_(begin_),
      now_(begin_),
      there_(begin_) {
  restart();
}

void StiffIntegrator::values(double t, std::span<const double> y, std::vector<double>& g) {
  if (!g.empty()) system_.event_values(t, y, g);
}

bool StiffIntegrator::crosses(std::size_t index, double before, double now) const {
  return directions_[index] < 0 ? before > 0 && now <= 0 : before < 0 && now >= 0;
}

StiffIntegrator::Result StiffIntegrator::step() {
  if (!radau_.step(stop_)) return Result::failed;
  std::fill(crossed_.begin(), crossed_.end(), 0);
  if (begin_.empty()) return time() >= stop_ ? Result::end : Result::stepped;
  before_ = begin_;
  double from = radau_.begin();
  for (int i = 0; i < RadauIIA::kStages; ++i) {  // stages are closer than steps
    const double to = radau_.time_of_stage(i);
    system_.event_values(loads_at_stage(i), now_);
    // The first of the functions that cross between two stages.
    std::size_t first = now_.size();
    double when = to;
    for (std::size_t k = 0; k < now_.size(); ++k) {
      if (!crosses(k, before_[k], now_[k])) continue;
      const double t = crossing(k, from, to, before_[k], now_[k]);
      if (first == now_.size() || t < when) first = k, when = t;
    }
    if (first < now_.size()) return land(when, first) ? Result::event : Result::failed;
    before_.swap(now_);
    from = to;
  }
  begin_.swap(before_);
  return time() >= stop_ ? Result::end : Result::stepped;
}

// Zero of function `index` on the step's polynomial, by the Illinois method; the signs at a and b differ.
double StiffIntegrator::crossing(std::size_t index, double a, double b, double at_a, double at_b) {
  const double close = kLanded * (b - a);
  int side = 0;
  double last = a;
  for (int i = 0; i < kMostLookups && at_b != 0 && b - a > close; ++i) {
    const double t = std::clamp((a * at_b - b * at_a) / (at_b - at_a), std::min(a, b), std::max(a, b));
    const double value = value_at(index, t);
    if ((value > 0) == (at_b > 0) || value == 0) {
      b = t, at_b = value;
      if (side == 1) at_a *= 0.5;
      side = 1;
    } else {
      a = t, at_a = value;
      if (side == -1) at_b *= 0.5;
      side = -1;
    }
    if (std::abs(t - last) <= close) return t;
    last = t;
  }
  return b;
}

double StiffIntegrator::value_at(std::size_t index, double t) {
  values(t, at(t), there_);
  return there_[index];
}

// Repeats the step such that function `index` is zero at its end, near t: the polynomial is less accurate than the end.
bool StiffIntegrator::land(double t, std::size_t index) {
  for (int i = 0; i < kMostLandings; ++i) {
    if (!radau_.end_at(t)) return false;
    if (!(time() > radau_.begin())) check_at_begin();
    system_.event_values(loads_at_end(), now_);
    const double length = time() - radau_.begin(), back = 1e-3 * length;
    if (!(length > 0)) break;
    const double slope = (now_[index] - value_at(index, time() - back)) / back, miss = now_[index] / slope;
    if (!(std::abs(miss) > kLanded * length && std::abs(miss) < back)) break;
    t = std::min(time() - miss, stop_);
  }
  for (std::size_t k = 0; k < crossed_.size(); ++k) {
    if (k != index && !crosses(k, begin_[k], now_[k])) continue;
    crossed_[k] = directions_[k];
    // the event has occurred
    now_[k] = directions_[k] * std::max(std::abs(now_[k]), std::numeric_limits<double>::min());
  }
  begin_.swap(now_);
  return true;
}

std::span<const double> StiffIntegrator::at(double t) {
  radau_.at(t, at_);
  return at_;
}

std::span<const InterfaceLoad> StiffIntegrator::loads_at_stage(int stage) const {
  const auto count = static_cast<std::size_t>(system_.interfaces());
  return std::span(stage_loads_).subspan(static_cast<std::size_t>(stage) * count, count);
}

// A step of zero length has its stages at its beginning.
void StiffIntegrator::check_at_begin() {
  system_.load(time(), y());
  for (int i = 0; i < stages(); ++i) {
    const auto at = static_cast<std::ptrdiff_t>(i) * system_.interfaces();
    std::copy(system_.loads().begin(), system_.loads().end(), stage_loads_.begin() + at);
  }
}

void StiffIntegrator::restart() {
  radau_.restart(first_step_);
  if (directions_.empty()) return;
  system_.event_directions(directions_);
  values(time(), y(), begin_);
}

std::string StiffIntegrator::message() const { return fmt::format("at {:.6g} s: {}", time(), radau_.message()); }

}  // namespace grapnel
