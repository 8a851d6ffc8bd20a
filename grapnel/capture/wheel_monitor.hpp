#pragma once

/// @file
/// Observes reaction wheels: rates, momentum, torque. Thread safety: one thread at a time.

#include <vector>

#include "grapnel/capture/motion_observer.hpp"

namespace grapnel {

class WheelMonitor final : public MotionObserver {
 public:
  explicit WheelMonitor(const CaptureProblem& problem);

  std::vector<Series> series() const override;
  void put(const CaptureSystem& system, const PhaseSample& sample, SeriesRow& row) const override;
  bool follows_states() const override { return !reports_.empty(); }
  void observe(const CaptureSystem& system, const State& state, std::span<const double> motor) override;
  void begin_phase(const CaptureSystem& system, const PhaseDynamics& dynamics) override;
  void restart_phase() override;
  /// Writes nothing without wheels or observations.
  void write(CaptureResult& result) const override;

 private:
  std::vector<WheelReport> reports_;
  bool any_ = false;
  std::vector<WheelReport> before_;  // without the current phase
  bool any_before_ = false;
};

}  // namespace grapnel
