#pragma once

/// @file
/// Observes thrusters: their use of propellant, and bodies in their plumes. Thread safety: one thread at a time.

#include <memory>
#include <string>
#include <vector>

#include "grapnel/capture/motion_observer.hpp"

namespace grapnel {

class ThrusterMonitor final : public MotionObserver {
 public:
  /// The problem must outlive this.
  explicit ThrusterMonitor(const CaptureProblem& problem) : problem_(problem) {}

  std::vector<Series> series() const override;
  void put(const CaptureSystem& system, const PhaseSample& sample, SeriesRow& row) const override;
  void begin_phase(const CaptureSystem& system, const PhaseDynamics& dynamics) override;
  /// Thrusters with plumes may fire.
  bool observes() const override { return !watched_.empty(); }
  void step(const PhaseStep& step) override;
  void end_phase(double duration) override { at_work_ += fires_ ? duration : 0; }
  /// Writes nothing without thrusters.
  void write(CaptureResult& result) const override;

 private:
  // A point of a body that plumes should not hit.
  struct Point {
    int body;
    Vector3d p_B;
    std::string name;
  };
  bool plume_hits(std::size_t thruster, const Vector3d& p_base) const;
  double impulse(std::size_t thruster, const PhaseSample& sample) const;

  const CaptureProblem& problem_;
  const CaptureSystem* system_ = nullptr;
  std::shared_ptr<const ThrusterBank> bank_;  // null before the first phase with thrusters
  std::vector<Point> watched_;
  Kinematics kinematics_;
  std::vector<PlumeHazard> hazards_;
  bool dumps_ = false;
  bool fires_ = false;  // thrusters are active in the piece
  double at_work_ = 0;  // [s]
};

}  // namespace grapnel
