#include "grapnel/capture/effector_monitor.hpp"

#include <algorithm>
#include <cmath>

namespace grapnel {

EffectorMonitor::EffectorMonitor(const CaptureProblem& problem) {
  for (const OtherActuatorKind* kind : kOtherActuators) {
    for (ActuatorSignal& signal : kind->signals(problem.robot.actuators)) signals_.push_back(std::move(signal));
  }
  for (const ActuatorSignal& signal : signals_) {
    for (std::size_t i = 0; i < signal.limits.size(); ++i)
      uses_.push_back({signal.path, signal.components[i], signal.unit, 0, signal.limits[i], 0, 0});
  }
}

// The values of all signals in the last evaluation; zero of kinds that are not active.
std::vector<double> EffectorMonitor::values(const PhaseDynamics* dynamics) const {
  std::vector<double> values;
  std::string_view kind;
  std::span<const double> left;  // of the kind
  for (const ActuatorSignal& signal : signals_) {
    const std::string_view name = std::string_view(signal.path).substr(0, signal.path.find('/'));
    if (name != kind) {
      kind = name, left = {};
      for (std::size_t i = 0; dynamics && i < dynamics->setup().effectors.size(); ++i) {
        const BaseEffector& effector = *dynamics->setup().effectors[i];
        if (effector.name() == kind) left = effector.signals();
      }
    }
    for (std::size_t i = 0; i < signal.components.size(); ++i) {
      values.push_back(left.empty() ? 0.0 : left.front());
      if (!left.empty()) left = left.subspan(1);
    }
  }
  return values;
}

std::vector<Series> EffectorMonitor::series() const {
  std::vector<Series> all;
  for (const ActuatorSignal& s : signals_) all.push_back({s.path, s.unit, s.text, s.components, {}});
  return all;
}

void EffectorMonitor::put(const CaptureSystem&, const PhaseSample& sample, SeriesRow& row) const {
  const std::vector<double> all = values(sample.dynamics);
  std::span<const double> left = all;
  for (const ActuatorSignal& signal : signals_) {
    row.put_all(left.first(signal.components.size()));
    left = left.subspan(signal.components.size());
  }
}

// Step => largest values, and the time at the limit: a step counts if its end is there.
void EffectorMonitor::step(const PhaseStep& step) {
  constexpr double kAtLimit = 1e-9;  // relative distance from a limit below which an actuator is at it
  const std::vector<double> all = values(step.at(step.end).dynamics);
  std::size_t value = 0, use = 0;
  for (const ActuatorSignal& signal : signals_) {
    for (std::size_t i = 0; i < signal.components.size(); ++i, ++value) {
      if (signal.limits.empty()) continue;
      ActuatorUse& one = uses_[use++];
      const double size = std::abs(all[value]);
      one.largest = std::max(one.largest, size);
      if (size < one.limit * (1 - kAtLimit)) continue;
      if (!(one.saturated > 0)) one.first_saturated = step.begin;
      one.saturated += step.end - step.begin;
    }
  }
}

}  // namespace grapnel
