#pragma once

/// @file
/// Observes thrusters: their use of propellant, and bodies in their plumes. Thread safety: one thread at a time.

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

  /// Begins a motion segment; both arguments live until it ends.
  void begin_phase(const CaptureSystem& system, const PhaseDynamics& dynamics);
  /// Whether steps must be evaluated: thrusters with plumes may fire.
  bool looks() const { return !watched_.empty(); }
  void step(const PhaseStep& step);
  /// Adds the duration of the piece [s].
  void end_phase(double duration) { at_work_ += fires_ ? duration : 0; }
  /// The impulse of each thruster up to a time of the current piece, or so far [N s]; empty before the first phase with
  /// thrusters.
  std::vector<double> impulses(double time) const;
  /// Writes nothing without thrusters.
  void write(CaptureResult& result) const;

 private:
  // A point of a body that plumes should not hit.
  struct Point {
    int body;
    Vector3d p_B;
    std::string name;
  };
  bool meets(std::size_t thruster, const Vector3d& p_base) const;

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
