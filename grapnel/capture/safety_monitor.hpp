#pragma once

/// @file
/// Checks besides conservation: clearance of all bodies with shapes, joint limits, and closure of loops, in every
/// phase.

#include <map>
#include <optional>

#include "grapnel/capture/internal_loads.hpp"
#include "grapnel/contact/motion_watch.hpp"
#include "grapnel/problem/problem_clearance.hpp"
#include "grapnel/result/capture_result.hpp"
#include "grapnel/simulate/simulate_phase.hpp"

namespace grapnel {

class SafetyMonitor {
 public:
  explicit SafetyMonitor(const CaptureProblem& problem);
  /// `system` must live until the phase ends. `efforts_are_cut`: the drives saturate at the effort limits. `opened`:
  /// per grasp, whether it has been decided on and does not hold, so that its end-effector is checked against its
  /// target.
  void begin_phase(const std::string& name, const CaptureSystem& system, bool efforts_are_cut,
                   std::vector<bool> opened);
  /// Whether the phase has clearances or limits to check.
  bool watching() const { return any_limit() || !model_.pairs().empty(); }
  bool watches_efforts() const { return any_effort_limit_; }
  /// Discards the evaluations of the current phase, which is integrated again.
  void restart_phase();
  /// Adds a state, in the order of time, with the motors' efforts per joint [N m or N]. Returns the minimum clearance
  /// of all pairs [m]; NaN if none is checked.
  double sample(double time, const State& state, std::span<const double> motor);
  /// Adds the next step, before the samples in it: joint limits are evaluated on its dense output; if rates jump
  /// between two steps, the clearance is sampled on both sides of the jump.
  void step(const PhaseStep& step);
  /// The minimum clearance at an instant outside any phase, as at an impact.
  double instant(const CaptureSystem& system, const Kinematics& kinematics) const;
  void end_phase();
  /// Adds events found elsewhere.
  void add(const std::vector<LimitEvent>& events);
  /// Writes minimum clearances, events, the first violation, and the rows of the ledger, including those not checked.
  /// Ends a phase that a failure interrupted.
  void write(CaptureResult& result);

 private:
  void begin();
  bool any_limit() const { return any_position_limit_ || any_rate_limit_ || any_effort_limit_; }
  void write_events(CaptureResult& result);
  void write_rows(CaptureResult& result) const;

  const CaptureProblem& problem_;
  // The current phase:
  std::string name_;
  const Model* system_ = nullptr;
  bool efforts_are_cut_ = false;
  ClearanceModel model_;
  std::vector<bool> opened_;  // grasps
  std::vector<int> parting_;  // pairs of the model: their end-effectors and targets
  ClearanceWatch clearance_;
  std::optional<LimitWatch> limits_;
  std::vector<LimitEvent> limit_events_;
  std::optional<State> step_end_;             // of the last step
  std::map<std::string, std::string> shown_;  // names of bodies in results, by those in models
  bool open_ = false;
  bool any_pair_ = false, any_phase_ = false;
  bool any_position_limit_ = false, any_rate_limit_ = false, any_effort_limit_ = false;
};

// Checks that closed loops stay closed, and computes the loads of grasps at samples.

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
  /// Per grasp of the problem. `motor` receives the correction of the efforts of prescribed joints that makes them
  /// consistent with the grasps' wrenches; per Model::joints().
  std::vector<GraspSample> sample(const PhaseSample& sample, const Kinematics& kinematics, std::span<double> motor);
  /// The largest defects found elsewhere, instead of all samples of a phase.
  void take(const ClosureDefect& largest) { phase_largest_.raise(largest); }
  void end_phase(const LoopOutcome& outcome);
  /// Writes reports, and the rows of the ledger.
  void write(CaptureResult& result) const;

 private:
  const CaptureProblem* problem_ = nullptr;
  const CaptureSystem* system_ = nullptr;
  bool any_ = false;
  ClosureDefect largest_, phase_largest_;
  std::vector<LoopReport> reports_;
};

}  // namespace grapnel
