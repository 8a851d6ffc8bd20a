#include "grapnel/capture/actuator_monitor.hpp"

#include "grapnel/capture/coupling_monitor.hpp"
#include "grapnel/capture/effector_monitor.hpp"
#include "grapnel/capture/gyro_monitor.hpp"
#include "grapnel/capture/thruster_monitor.hpp"
#include "grapnel/capture/wheel_monitor.hpp"

namespace grapnel {

// A monitor without these observations.
void ActuatorMonitor::begin_phase(const CaptureSystem&, const PhaseDynamics&) {}
void ActuatorMonitor::step(const PhaseStep&) {}
void ActuatorMonitor::observe(const CaptureSystem&, const State&, std::span<const double>) {}
void ActuatorMonitor::end_phase(double) {}

std::vector<std::unique_ptr<ActuatorMonitor>> actuator_monitors(const CaptureProblem& problem) {
  std::vector<std::unique_ptr<ActuatorMonitor>> monitors;
  monitors.push_back(std::make_unique<WheelMonitor>(problem));
  monitors.push_back(std::make_unique<GyroMonitor>(problem));
  monitors.push_back(std::make_unique<ThrusterMonitor>(problem));
  monitors.push_back(std::make_unique<EffectorMonitor>(problem));
  monitors.push_back(std::make_unique<CouplingMonitor>(problem));
  return monitors;
}

}  // namespace grapnel
