#pragma once

/// @file
/// Checks that closed loops stay closed, and what grasps pass on at samples.

#include <optional>

#include "grapnel/impact_report/internal_loads.hpp"
#include "grapnel/result/capture_result.hpp"

namespace grapnel {

/// One grasp of the problem at a sample.
struct GraspSample {
  bool holds = false;
  Wrenchd F_WC = Wrenchd::zero();       // on the robot at the grasp, in W
  std::optional<ClosureDefect> defect;  // of a grasp that closes a loop, from poses and twists
};

class LoopMonitor {
 public:
  /// `system` must live until the phase ends.
  void begin_phase(const std::string& name, const CaptureProblem& problem, const CaptureSystem& system);
  /// Per grasp of the problem. `motor` receives what is to be added to the efforts of prescribed joints so that they
  /// and the grasps' wrenches belong together; per Model::joints().
  std::vector<GraspSample> sample(const PhaseSample& sample, const Kinematics& kinematics, std::span<double> motor);
  void end_phase(const LoopOutcome& outcome);
  /// Reports, and the rows of the ledger.
  void write(CaptureResult& result) const;

 private:
  const CaptureProblem* problem_ = nullptr;
  const CaptureSystem* system_ = nullptr;
  bool any_ = false;
  ClosureDefect largest_, phase_largest_;
  std::vector<LoopReport> reports_;
};

}  // namespace grapnel
