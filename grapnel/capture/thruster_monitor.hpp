#pragma once

/// @file
/// What thrusters do in a run: what they use, and what comes into their plumes. Thread safety: one thread at a time.

#include <memory>
#include <string>
#include <vector>

#include "grapnel/problem/capture_system.hpp"
#include "grapnel/result/capture_result.hpp"
#include "grapnel/simulate/simulate_phase.hpp"

namespace grapnel {

class ThrusterMonitor {
 public:
  /// The problem must outlive this.
  explicit ThrusterMonitor(const CaptureProblem& problem) : problem_(problem) {}

  /// A piece of motion begins; both live until it ends.
  void begin_phase(const CaptureSystem& system, const PhaseDynamics& dynamics);
  /// Whether steps are to be looked into: thrusters with plumes may fire.
  bool looks() const { return !watched_.empty(); }
  void step(const PhaseStep& step);
  /// The piece took this time [s].
  void end_phase(double duration) { at_work_ += fires_ ? duration : 0; }
  /// What each thruster has given until a time of the piece at hand, or so far [N s]; empty until a phase has thrusters
  /// at work.
  std::vector<double> impulses(double time) const;
  /// Nothing without thrusters.
  void write(CaptureResult& result) const;

 private:
  // A point of a body that no plume should meet.
  struct Point {
    int body;
    Vector3d p_B;
    std::string name;
  };
  bool meets(std::size_t thruster, const Vector3d& p_base) const;

  const CaptureProblem& problem_;
  const CaptureSystem* system_ = nullptr;
  std::shared_ptr<const ThrusterBank> bank_;  // null until a phase has thrusters
  std::vector<Point> watched_;
  Kinematics kinematics_;
  std::vector<PlumeHazard> hazards_;
  bool dumps_ = false;
  bool fires_ = false;  // thrusters are at work in the piece
  double at_work_ = 0;  // [s]
};

}  // namespace grapnel
