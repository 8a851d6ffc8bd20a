#pragma once

/// @file
/// A capture piece by piece, for callers that integrate its motion themselves. simulate_capture.hpp does it in one
/// call.

#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <string>

#include "grapnel/capture/conservation_monitor.hpp"
#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/simulate/simulate_phase.hpp"

namespace grapnel {

/// One motion segment, between two events.
struct MotionTask {
  std::string phase;             // its name, such as "approach", "post_impact_2"
  const Model* model = nullptr;  // model and setup live until the task is done
  const PhaseSetup* setup = nullptr;
  State start;                   // at `begin`; joints that follow a trajectory exactly are on it
  double begin = 0, end = 0;     // [s]
  IntegrationSetup integration;  // with the tolerances of this piece
  /// Why it must not be integrated elsewhere. Empty: it may be.
  std::string only_here;
  /// Observes the motion during integration; null: no observer. A caller that integrates the piece calls it with the
  /// state at `begin`, with later states in order, at most longest_look apart, and with the last at `end`; efforts are
  /// the motors', per joint of the model [N m or N]. integrated() follows; next() without it discards the observations.
  /// Valid until then.
  std::function<void(double t, const State&, std::span<const double> motor)> watch;
  double longest_look = std::numeric_limits<double>::infinity();  // [s]
  /// Stop condition before `end`, see StopCondition; null: none. A caller that integrates the piece stops, at the
  /// latest, at the beginning of the step in which this falls to zero or below; integrated_in_part() then evaluates
  /// that step. Valid as `watch` is.
  StopCondition stop;
};

/// The same captures, with their motion segments handed out for integration elsewhere, as in lanes with those of other
/// captures:
///
///     CaptureSteps steps(problem, CaptureDetail::columns);
///     while (const MotionTask* task = steps.next()) {
///       if (can be done elsewhere) steps.integrated(outcome, measures);  // else next() does it, or the rest of it
///     }
///     const CaptureResult result = steps.finish();
class CaptureSteps {
 public:
  /// The part of the sequence: all of it, or only the impact as in simulate_impact_only().
  enum class Part { whole, impact_only };

  /// The problem must outlive the object, as must `sink`, which receives the samples during the computation (null: they
  /// are kept in CaptureResult::series). @throws CaptureProblemError or ModelError if the problem contradicts itself.
  explicit CaptureSteps(const CaptureProblem& problem, CaptureDetail detail = CaptureDetail::full,
                        CaptureProgress progress = {}, Part part = Part::whole, SeriesSink* sink = nullptr);
  ~CaptureSteps();
  CaptureSteps(const CaptureSteps&) = delete;
  CaptureSteps& operator=(const CaptureSteps&) = delete;

  /// Ends a motion segment at this time, if one lasts longer: the next one begins there with the same drives and laws.
  /// Applies to segments that next() returns later. Further calls add further times.
  void pause_at(double time);
  /// Advances to the next motion segment, which is valid until the next call: plans, closes and releases grasps.
  /// Integrates the previous piece first, unless that has been done elsewhere. Null: none is left, or the run has
  /// failed. @throws CaptureProblemError as the constructor, and exceptions of progress.
  const MotionTask* next();
  /// The piece has been integrated elsewhere, as simulate_phase() would do. Reads from `outcome`: finished (else
  /// failure), end_time, end_state, integrals, and the cost. @throws std::logic_error if there is no piece, or it must
  /// not be integrated elsewhere.
  void integrated(PhaseOutcome outcome, const PhaseMeasures& measures);
  /// The same for the part up to outcome.end_time, before `end` and before `stop` falls to zero: next() integrates the
  /// rest with the steps of the whole, beginning with a trial step `next_step` [s]. The state of sampled control must
  /// be that at this time.
  void integrated_in_part(PhaseOutcome outcome, const PhaseMeasures& measures, double next_step);
  /// The result, once next() has returned null. @throws std::logic_error before that.
  CaptureResult finish();

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

}  // namespace grapnel
