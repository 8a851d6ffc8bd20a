#pragma once

/// @file
/// A capture from end to end: at once, or piece by piece, where somebody else integrates its motion.
/// Public, kept stable.

#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <string>

#include "grapnel/capture/conservation_monitor.hpp"
#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/problem/capture_system.hpp"
#include "grapnel/result/capture_result.hpp"
#include "grapnel/result/time_series.hpp"
#include "grapnel/simulate/simulate_phase.hpp"

namespace grapnel {

/// Approach, contact, impact and motion afterwards, with time series and ledger. A numerical failure is not thrown: the
/// result has status `failed`, says what happened where and when, and keeps all that was computed before.
/// With a sink its samples go there block by block; the result's series then holds the last block alone.
/// @throws CaptureProblemError or ModelError if the problem contradicts itself.
CaptureResult simulate_capture(const CaptureProblem& problem, const CaptureProgress& progress = {},
                               CaptureDetail detail = CaptureDetail::full, SeriesSink* sink = nullptr);

/// The impact at the end of the approach alone, for studies: the joints follow their plan exactly to the planned final
/// configuration, of which nothing is recorded, and nothing follows the impact. Tracking errors, envelopes on the way,
/// and grasps that close at other times than the approach's end do not show. @throws as simulate_capture().
CaptureResult simulate_impact_only(const CaptureProblem& problem, CaptureDetail detail = CaptureDetail::full,
                                   const CaptureProgress& progress = {});

/// One piece of motion, between two events.
struct MotionTask {
  std::string phase;             // its name, such as "approach", "post_impact_2"
  const Model* model = nullptr;  // this and the next live until the task is done
  const PhaseSetup* setup = nullptr;
  State start;                   // at `begin`; joints that follow a trajectory exactly are on it
  double begin = 0, end = 0;     // [s]
  IntegrationSetup integration;  // with the tolerances of this piece
  /// Why it must not be integrated elsewhere. Empty: it may be.
  std::string only_here;
  /// What looks at the motion while it happens; null: nothing does. Whoever integrates the piece elsewhere calls it
  /// with the state at `begin`, with later ones in order, no two further apart than longest_look, and with the last at
  /// `end`; efforts are the motors', per joint of the model [N m or N]. integrated() comes afterwards; next() without
  /// it begins the looking anew. Valid until then.
  std::function<void(double t, const State&, std::span<const double> motor)> watch;
  double longest_look = std::numeric_limits<double>::infinity();  // [s]
  /// What ends the motion before `end`, see StopCondition; null: nothing does. Whoever integrates the piece elsewhere
  /// stops, at the latest, at the beginning of the step in which this falls to zero or below; integrated_in_part() then
  /// looks into that step. Valid as `watch` is.
  StopCondition stop;
};

/// The same captures with their pieces of motion handed out, so that they may be integrated elsewhere, as in lanes with
/// those of other captures:
///
///     CaptureSteps steps(problem, CaptureDetail::columns);
///     while (const MotionTask* task = steps.next()) {
///       if (can be done elsewhere) steps.integrated(outcome, measures);  // else next() does it, or what is left of it
///     }
///     const CaptureResult result = steps.finish();
class CaptureSteps {
 public:
  /// Which part of the sequence: all of it, or the impact alone as simulate_impact_only() has it.
  enum class Part { whole, impact_only };

  /// The problem must outlive the object, and so must `sink`, which gets the samples as they come (null: they are kept
  /// in CaptureResult::series). @throws CaptureProblemError or ModelError if it contradicts itself.
  explicit CaptureSteps(const CaptureProblem& problem, CaptureDetail detail = CaptureDetail::full,
                        CaptureProgress progress = {}, Part part = Part::whole, SeriesSink* sink = nullptr);
  ~CaptureSteps();
  CaptureSteps(const CaptureSteps&) = delete;
  CaptureSteps& operator=(const CaptureSteps&) = delete;

  /// Goes on to the next piece of motion, which is valid until the next call: plans, lets grasps close and release. The
  /// piece before it is integrated first, unless that has been done elsewhere. Null: there is none left, or the run has
  /// failed. @throws CaptureProblemError as the constructor, and what progress throws.
  const MotionTask* next();
  /// The piece has been integrated elsewhere, as simulate_phase() would have done it. Of `outcome`: finished (else
  /// failure), end_time, end_state, integrals, and what the cost is made of. @throws std::logic_error if there is none,
  /// or it must not be.
  void integrated(PhaseOutcome outcome, const PhaseMeasures& measures);
  /// The same up to outcome.end_time alone, before `end` and before `stop` falls to zero: next() does the rest, by the
  /// steps that the whole would have had, of which the next is tried with `next_step` [s]. Sampled control is where it
  /// was then.
  void integrated_in_part(PhaseOutcome outcome, const PhaseMeasures& measures, double next_step);
  /// The result, once next() has returned null. @throws std::logic_error before that.
  CaptureResult finish();

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

}  // namespace grapnel
