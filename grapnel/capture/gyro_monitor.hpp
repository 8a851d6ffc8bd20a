#pragma once

/// @file
/// Observes control moment gyros: angles, rates, torques, and intervals near singularities of the array. Thread safety:
/// one thread at a time.

#include <span>
#include <vector>

#include "grapnel/capture/motion_observer.hpp"

namespace grapnel {

class GyroMonitor final : public MotionObserver {
 public:
  /// The problem must outlive this.
  explicit GyroMonitor(const CaptureProblem& problem);

  std::vector<Series> series() const override;
  void put(const CaptureSystem& system, const PhaseSample& sample, SeriesRow& row) const override;
  void begin_phase(const CaptureSystem& system, const PhaseDynamics& dynamics) override;
  bool observes() const override { return steered_; }
  void step(const PhaseStep& step) override;
  void observe(const CaptureSystem& system, const State& state, std::span<const double> motor) override;
  /// Writes nothing without gyros or samples. Warns of intervals near singularities.
  void write(CaptureResult& result) const override;

 private:
  // The array in a state.
  struct Posture {
    std::vector<MomentGyro> gyros;
    std::vector<double> angles;
  };
  Posture posture(const CaptureSystem& system, const State& state) const;

  const CaptureProblem& problem_;
  GyrosReport report_;
  bool steered_ = false;
  bool any_ = false;
};

}  // namespace grapnel
