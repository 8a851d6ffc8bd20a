#pragma once

/// @file
/// Efforts that couplings of joints transmit, as time series.

#include <string>
#include <vector>

#include "grapnel/capture/motion_observer.hpp"

namespace grapnel {

class CouplingMonitor : public MotionObserver {
 public:
  explicit CouplingMonitor(const CaptureProblem& problem);
  std::vector<Series> series() const override;
  void put(const CaptureSystem& system, const PhaseSample& sample, SeriesRow& row) const override;
  void write(CaptureResult&) const override {}

 private:
  std::vector<std::string> names_;  // dependent joints, in the robot's order
};

}  // namespace grapnel
