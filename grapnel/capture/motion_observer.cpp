#include "grapnel/capture/motion_observer.hpp"

#include "grapnel/capture/contact_monitor.hpp"
#include "grapnel/capture/coupling_monitor.hpp"
#include "grapnel/capture/effector_monitor.hpp"
#include "grapnel/capture/gyro_monitor.hpp"
#include "grapnel/capture/stage_monitor.hpp"
#include "grapnel/capture/tendon_monitor.hpp"
#include "grapnel/capture/thruster_monitor.hpp"
#include "grapnel/capture/wheel_monitor.hpp"

namespace grapnel {

// A monitor without these observations.
void MotionObserver::begin_phase(const CaptureSystem&, const PhaseDynamics&) {}
void MotionObserver::step(const PhaseStep&) {}
void MotionObserver::observe(const CaptureSystem&, const State&, std::span<const double>) {}
void MotionObserver::end_phase(double) {}

MotionObservers::MotionObservers(const CaptureProblem& problem, const CaptureSystem& free, const MovingFrame& frame) {
  all.push_back(std::make_unique<WheelMonitor>(problem));
  all.push_back(std::make_unique<GyroMonitor>(problem));
  all.push_back(std::make_unique<ThrusterMonitor>(problem));
  all.push_back(std::make_unique<EffectorMonitor>(problem));
  all.push_back(std::make_unique<CouplingMonitor>(problem));
  all.push_back(std::make_unique<TendonMonitor>(problem));
  if (!problem.contacts.empty()) {
    auto observer = std::make_unique<ContactMonitor>(problem, free, frame);
    contacts = observer.get();
    all.push_back(std::move(observer));
  }
  auto observer = std::make_unique<StageMonitor>(problem, free);
  stages = observer.get();
  all.push_back(std::move(observer));
}

}  // namespace grapnel
