#pragma once

/// @file
/// Observes tendons: time series of tension and excursion, largest tension and work. Thread safety: one thread at a
/// time.

#include <vector>

#include "grapnel/capture/motion_observer.hpp"

namespace grapnel {

class TendonMonitor final : public MotionObserver {
 public:
  /// `problem` must outlive it.
  explicit TendonMonitor(const CaptureProblem& problem);

  std::vector<Series> series() const override;
  void put(const CaptureSystem& system, const PhaseSample& sample, SeriesRow& row) const override;
  void begin_phase(const CaptureSystem& system, const PhaseDynamics& dynamics) override;
  bool observes() const override { return !active_.empty(); }
  void step(const PhaseStep& step) override;
  void write(CaptureResult& result) const override;

 private:
  std::size_t report_of(const std::string& name);

  const CaptureProblem& problem_;
  std::vector<TendonReport> reports_;  // of tendons with commands so far
  std::vector<std::size_t> active_;    // index in reports_ per tendon of the current phase
};

}  // namespace grapnel
