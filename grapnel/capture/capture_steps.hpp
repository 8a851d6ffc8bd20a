#pragma once

/// @file
/// A capture step by step: the sequence of simulate_capture(), with its pieces of motion handed out, so that they may
/// be integrated here or elsewhere, as in lanes with those of other captures.
///
///     CaptureSteps steps(problem, CaptureDetail::columns);
///     while (const MotionTask* task = steps.next()) {
///       if (can be done elsewhere) steps.moved(outcome, measures); else steps.move();
///     }
///     const CaptureResult result = steps.finish();
///
/// Thread safety: one thread at a time.

#include <functional>
#include <memory>
#include <span>
#include <string>

#include "grapnel/capture/bookkeeper.hpp"
#include "grapnel/capture/capture_detail.hpp"
#include "grapnel/capture/capture_problem.hpp"
#include "grapnel/capture/capture_progress.hpp"
#include "grapnel/result/capture_result.hpp"
#include "grapnel/result/series_sink.hpp"
#include "grapnel/simulate/simulate_phase.hpp"

namespace grapnel {

/// One piece of motion, between two events.
struct MotionTask {
  std::string phase;             // its name, such as "approach", "post_impact_2"
  const Model* model = nullptr;  // this and the next live until the task is done
  const PhaseSetup* setup = nullptr;
  State start;                   // at `begin`; joints that follow a trajectory exactly are on it
  double begin = 0, end = 0;     // [s]
  IntegrationSetup integration;  // with the tolerances of this piece
  /// Why it has to be done by move(). Empty: it may be done elsewhere.
  std::string only_here;
  /// What looks at the motion while it happens; null: nothing does. Whoever integrates the piece elsewhere calls it
  /// with the state at `begin`, with later ones in order, no two further apart than longest_look, and with the last at
  /// `end`; efforts are the motors', per joint of the model [N m or N]. moved() comes afterwards; move() instead of it
  /// begins the looking anew. Valid until then.
  std::function<void(double t, const State&, std::span<const double> motor)> watch;
  double longest_look = 0;  // [s]
};

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

  /// Goes on to the next piece of motion: plans, lets grips meet and let go. Null: there is none left, or the run has
  /// failed. Valid until the next call. @throws CaptureProblemError as the constructor.
  const MotionTask* next();
  /// Integrates the piece.
  void move();
  /// It has been integrated elsewhere, as simulate_phase() would have done it. Of `outcome`: finished (else failure),
  /// end_time, end_state, integrals, and what the cost is made of. @throws std::logic_error if the piece is one that
  /// has to be done here.
  void moved(const PhaseOutcome& outcome, const PhaseMeasures& measures);
  /// Closes the books. Once, at the end.
  CaptureResult finish();

 private:
  class Sequence;
  CaptureResult result_;
  std::unique_ptr<const CaptureProblem> seen_;  // in the frame in which it is computed; null: the problem itself
  std::unique_ptr<Sequence> sequence_;
};

}  // namespace grapnel
