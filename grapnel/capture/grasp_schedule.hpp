#pragma once

/// @file
/// Which grasps close when, and what became of each.

#include "grapnel/impact_report/contact.hpp"
#include "grapnel/result/capture_result.hpp"
#include "grapnel/simulate/simulate_phase.hpp"

namespace grapnel {

class GraspSchedule {
 public:
  /// The problem must outlive the schedule. Grasps are named by their position in it.
  explicit GraspSchedule(const CaptureProblem& problem);

  /// Undecided grasps whose stated time has come, within rounding.
  std::vector<std::size_t> due_at(double now) const;
  /// At the approach's end: all that is left to close together, and what is stated for that time.
  std::vector<std::size_t> due_together(double now) const;
  /// Undecided grasps that close on arrival and whose end-effectors are within their envelopes.
  std::vector<std::size_t> arrived(const CaptureSystem& system, const State& state) const;
  /// Whether there are undecided grasps that close together, and all are within their envelopes.
  bool together_in_envelopes(const CaptureSystem& system, const State& state) const;
  /// Falls to zero as soon as an end-effector arrives, or, with `together`, all of those that close together are in
  /// their envelopes; empty if nothing is waited for. `system` must outlive it.
  StopCondition stop_condition(const CaptureSystem& system, bool together) const;
  /// Stated times of undecided grasps.
  std::vector<double> stated_times() const;
  /// Whether grasps are left that close at stated times or on arrival.
  bool any_left() const;

  /// Decides on undecided grasps at the present state. Those that close.
  std::vector<std::size_t> decide(const std::vector<std::size_t>& grasps, const CaptureSystem& system,
                                  const State& state, double time);
  /// Takes it back: there is no contact, for this reason.
  void refuse(const std::vector<std::size_t>& grasps, const std::string& reason);
  void release(std::size_t grasp, double time);
  /// contact.gap: translate_target moved its target by a distance [m].
  void moved(std::size_t grasp, double distance);

  /// What became of every grasp, in a run that was last looked at at the time `last_look`; nothing if the run did not
  /// come so far. `system` and `state`: at the run's end.
  void write(double last_look, const CaptureSystem& system, const State& state, CaptureResult& result) const;

  /// Whether a time is `now` within rounding.
  static bool is_now(double t, double now);

 private:
  std::vector<std::size_t> undecided(GraspSetup::Closes how) const;
  GraspOutcome outcome(std::size_t grasp, bool captured, const std::string& reason, double time,
                       const GraspDeviation& deviation) const;
  GraspOutcome undecided_outcome(std::size_t grasp, double end, const GraspDecision& at_end) const;

  const CaptureProblem& problem_;
  std::vector<std::optional<GraspOutcome>> outcomes_;  // per grasp, once decided
  std::optional<double> first_time_;                   // of a decision
};

}  // namespace grapnel
