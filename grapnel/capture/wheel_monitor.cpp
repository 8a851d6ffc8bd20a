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

void WheelMonitor::begin_phase() { before_ = reports_, any_before_ = any_; }

void WheelMonitor::restart_phase() { reports_ = before_, any_ = any_before_; }

void WheelMonitor::write(CaptureResult& result) const {
  if (any_) result.wheels = reports_;
}

}  // namespace grapnel
