#include "grapnel/capture/wheel_monitor.hpp"

#include <algorithm>
#include <cmath>

namespace grapnel {

WheelMonitor::WheelMonitor(const CaptureProblem& problem) {
  for (const WheelSetup& wheel : problem.robot.wheels) {
    WheelReport& report = reports_.emplace_back();
    report.name = wheel.name, report.inertia = wheel.inertia;
    report.rate_limit = wheel.rate, report.torque_limit = wheel.torque;
  }
}

std::vector<Series> WheelMonitor::series() const {
  if (reports_.empty()) return {};
  std::vector<std::string> names;
  for (const WheelReport& report : reports_) names.push_back(report.name);
  return {{"wheels/rate", "rad/s", "rates of the reaction wheels relative to the base", names, {}},
          {"wheels/momentum", "N m s", "their moments of inertia times these rates", names, {}},
          {"wheels/torque", "N m", "of their motors, on the wheels", names, {}}};
}

void WheelMonitor::put(const CaptureSystem& system, const PhaseSample& s, SeriesRow& row) const {
  if (reports_.empty()) return;
  const std::size_t count = system.wheels.size();
  const auto rate = [&](std::size_t w) {
    return s.state.v[system.model.bodies()[system.model.joints()[system.wheels[w]]].v];
  };
  row.put_each(count, rate);
  row.put_each(count, [&](std::size_t w) { return reports_[w].inertia * rate(w); });
  row.put_each(count, [&](std::size_t w) { return s.motor[system.wheels[w]]; });
}

void WheelMonitor::observe(const CaptureSystem& system, const State& state, std::span<const double> motor) {
  for (std::size_t w = 0; w < system.wheels.size(); ++w) {
    WheelReport& report = reports_[w];
    const int joint = system.wheels[w];
    report.rate_after = state.v[system.model.bodies()[system.model.joints()[joint]].v];
    if (!any_) report.rate_before = report.rate_after;
    report.largest_rate = std::max(report.largest_rate, std::abs(report.rate_after));
    if (motor.empty()) continue;
    if (!(std::abs(motor[joint]) <= report.largest_torque)) report.largest_torque = std::abs(motor[joint]);
  }
  any_ = true;
}

void WheelMonitor::begin_phase(const CaptureSystem&, const PhaseDynamics&) { before_ = reports_, any_before_ = any_; }

void WheelMonitor::restart_phase() { reports_ = before_, any_ = any_before_; }

void WheelMonitor::write(CaptureResult& result) const {
  if (any_) result.wheels = reports_;
}

}  // namespace grapnel
