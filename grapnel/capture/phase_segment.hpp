#pragma once

/// @file
/// One piece of a run's motion, between two events: what drives it, who observes it, and how it is integrated.

#include <functional>
#include <optional>
#include <span>
#include <string>

#include "grapnel/capture/capture_run.hpp"
#include "grapnel/capture/resumable.hpp"
#include "grapnel/capture/simulate_capture.hpp"

namespace grapnel {

/// A part of the run in which joints follow one plan: the approach, or what follows the impact.
struct MotionPhase {
  std::string name;
  double begin = 0, end = 0;  // [s]
  std::size_t released = 0;   // of PostImpactSetup::releases, in the order of time
};

/// Whether the approach ends as soon as all that close together are within their envelopes.
bool ends_in_envelopes(const CaptureRun& run);

/// Awaited by the run, it gives the state at its end to the run's bodies and tells the monitor. The awaiting
/// expression's value: whether its end was reached; false: an end-effector's arrival stopped it before. @throws
/// RunFailure if the integration fails.
class PhaseSegment : public Resumable<PhaseSegment>::Stop {
 public:
  /// From now on to the next event of the phase, or until an end-effector that closes on arrival arrives.
  PhaseSegment(CaptureRun& run, const MotionPhase& phase);
  /// The whole approach in one go, followed exactly and observed by nobody.
  static PhaseSegment unobserved_approach(CaptureRun& run) { return PhaseSegment(run); }
  PhaseSegment(const PhaseSegment&) = delete;
  PhaseSegment& operator=(const PhaseSegment&) = delete;

  const MotionTask& task() const { return task_; }
  /// It has been integrated elsewhere. @throws std::logic_error if it must not be.
  void take(PhaseOutcome outcome, const PhaseMeasures& measures);

  /// What resumes the run: integrates here, if nobody has done so elsewhere.
  bool await_resume();

 private:
  explicit PhaseSegment(CaptureRun& run);
  void describe(const std::string& name, double end, bool controlled);
  PhaseOutcome integrate();
  PhaseOutcome integrate_between_looks();
  PhaseOutcome integrate_with_samples();
  std::function<void(double)> each_step() const;

  CaptureRun& run_;
  const bool observed_;
  PhaseDynamics dynamics_;
  StopCondition stop_;
  MotionTask task_;
  bool watched_elsewhere_ = false;  // MotionTask::watch has been called
  std::optional<PhaseOutcome> elsewhere_;
};

}  // namespace grapnel
