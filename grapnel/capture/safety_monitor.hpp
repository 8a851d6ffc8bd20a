#pragma once

/// @file
/// What is watched besides conservation: clearance of all bodies with shapes, joint limits, and that loops stay closed,
/// in every phase.

#include <optional>

#include "grapnel/approach/way_setup.hpp"
#include "grapnel/clearance/motion_watch.hpp"
#include "grapnel/impact_report/internal_loads.hpp"
#include "grapnel/problem/capture_system.hpp"
#include "grapnel/result/capture_result.hpp"
#include "grapnel/simulate/simulate_phase.hpp"

namespace grapnel {

class SafetyMonitor {
 public:
  explicit SafetyMonitor(const CaptureProblem& problem);
  /// `system` must live until the phase ends. `efforts_are_cut`: the drives saturate at the effort limits. `opened`:
  /// per grasp, whether it has been decided on and does not hold (any more), so that its end-effector is checked
  /// against its target.
  void begin_phase(const std::string& name, const CaptureSystem& system, bool efforts_are_cut,
                   std::vector<bool> opened);
  /// Whether there is anything to watch in the phase.
  bool watching() const { return any_limit() || !model_.pairs().empty(); }
  bool watches_efforts() const { return any_effort_limit_; }
  /// Forgets what has been seen of the phase under way, for one that is integrated once more.
  void restart_phase();
  /// The state at a time, later ones after earlier ones, with the motors' efforts per joint [N m or N]. Returns the
  /// minimum clearance of all pairs there [m]; NaN where nothing is watched.
  double sample(double time, const State& state, std::span<const double> motor);
  /// The next step, before the samples in it: joint limits are judged on its dense output; where rates jump between two
  /// steps, the clearance is sampled on both sides of the jump.
  void step(const PhaseStep& step);
  /// The same at an instant outside any phase, as at an impact.
  double instant(const CaptureSystem& system, const Kinematics& kinematics) const;
  void end_phase();
  /// Events that somebody else has found.
  void add(const std::vector<LimitEvent>& events);
  /// Minimum clearances, events, what of them is first, and the rows of the ledger, with what nobody looked at. Ends a
  /// phase that a failure has left open.
  void write(CaptureResult& result);

 private:
  void begin();
  bool any_limit() const { return any_position_limit_ || any_rate_limit_ || any_effort_limit_; }
  void write_events(CaptureResult& result);
  void write_rows(CaptureResult& result) const;

  const CaptureProblem& problem_;
  // The phase under way:
  std::string name_;
  const Model* system_ = nullptr;
  bool efforts_are_cut_ = false;
  ClearanceModel model_;
  std::vector<bool> opened_;  // grasps
  std::vector<int> parting_;  // pairs of the model: their end-effectors and targets
  ClearanceWatch clearance_;
  std::optional<LimitWatch> limits_;
  std::vector<LimitEvent> limit_events_;
  std::optional<State> step_end_;  // of the last step
  bool open_ = false;
  bool any_pair_ = false, any_phase_ = false;
  bool any_position_limit_ = false, any_rate_limit_ = false, any_effort_limit_ = false;
};

// Checks that closed loops stay closed, and what grasps pass on at samples.

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
  /// Instead of all samples of a phase: the largest defects that somebody else has found.
  void take(const ClosureDefect& largest) { phase_largest_.raise(largest); }
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
