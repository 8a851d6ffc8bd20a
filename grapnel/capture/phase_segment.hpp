#pragma once

/// @file
/// One piece of a run's motion, between two events: its drives, its observers, and its integration.

#include <coroutine>
#include <exception>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "grapnel/capture/capture_run.hpp"
#include "grapnel/capture/capture_steps.hpp"
#include "grapnel/capture/simulate_capture.hpp"

namespace grapnel {

// A computation that suspends when it needs an input, and resumes once the input is available: a coroutine whose
// `co_await` hands out the request.

/// Return type of such a coroutine. Its body does not run before the first next(). It awaits objects that derive from
/// Resumable<Needed>::Stop, named variables of the body; the value of the `co_await` expression is the result of their
/// await_resume().
///
///     Resumable<Question> computation() { Question question(...); const int answer = co_await question; ... }
///
///     Resumable<Question> running = computation();
///     while (Question* question = running.next()) question->answer = ...;
///
/// The destructor frees the coroutine frame, with all its objects, wherever the body is suspended. Arguments of the
/// coroutine should be references to objects that outlive it.
template <class Needed>
class Resumable {
 public:
  struct promise_type {
    Needed* needed = nullptr;
    std::exception_ptr error = {};

    Resumable get_return_object() { return Resumable(std::coroutine_handle<promise_type>::from_promise(*this)); }
    std::suspend_always initial_suspend() noexcept { return {}; }
    std::suspend_always final_suspend() noexcept { return {}; }
    void return_void() noexcept {}
    void unhandled_exception() noexcept { error = std::current_exception(); }
  };

  /// Base of awaitable objects: `class Needed : public Resumable<Needed>::Stop`, with an await_resume().
  class Stop {
   public:
    bool await_ready() const noexcept { return false; }
    void await_suspend(std::coroutine_handle<promise_type> body) noexcept {
      body.promise().needed = static_cast<Needed*>(this);
    }

   protected:
    Stop() = default;
    ~Stop() = default;
  };

  Resumable(Resumable&& other) noexcept : body_(std::exchange(other.body_, nullptr)) {}
  Resumable& operator=(Resumable&&) = delete;
  ~Resumable() {
    if (body_) body_.destroy();
  }

  /// Runs the body to its next `co_await`; the awaited object is valid until the next call. Null: the body has ended.
  /// An exception that leaves the body ends it and is rethrown here.
  Needed* next() {
    if (body_.done()) return nullptr;
    body_.promise().needed = nullptr;
    body_.resume();
    if (std::exception_ptr error = std::exchange(body_.promise().error, nullptr)) std::rethrow_exception(error);
    return body_.done() ? nullptr : body_.promise().needed;
  }
  bool done() const { return body_.done(); }

 private:
  explicit Resumable(std::coroutine_handle<promise_type> body) : body_(body) {}
  std::coroutine_handle<promise_type> body_;
};

/// A part of the run in which joints follow one plan: the approach, or a phase after the impact.
struct MotionPhase {
  std::string name;
  double begin = 0, end = 0;  // [s]
  std::size_t released = 0;   // of PostImpactSetup::releases, in the order of time
};

/// Whether the approach ends as soon as all grasps that close together are within their envelopes.
bool ends_in_envelopes(const CaptureRun& run);

/// Awaited by the run, it transfers the final state to the run's bodies and notifies the monitor. The value of the
/// await expression: whether the piece reached its end; false: an end-effector's arrival, a load at the limits of a
/// grasp (CaptureRun::overloads), the end of a law or the phase's end condition (CaptureRun::condition_met) stopped it
/// before. @throws RunFailure if the integration fails.
class PhaseSegment : public Resumable<PhaseSegment>::Stop {
 public:
  /// From now to the next event of the phase, or until an end-effector that closes on arrival arrives.
  PhaseSegment(CaptureRun& run, const MotionPhase& phase);
  /// The whole approach in one piece, followed exactly and without observers.
  static PhaseSegment unobserved_approach(CaptureRun& run) { return PhaseSegment(run); }
  PhaseSegment(const PhaseSegment&) = delete;
  PhaseSegment& operator=(const PhaseSegment&) = delete;

  const MotionTask& task() const { return task_; }
  /// Takes the result of an integration elsewhere. @throws std::logic_error if that is not allowed.
  void take(PhaseOutcome outcome, const PhaseMeasures& measures);
  /// The same for its first part, up to outcome.end_time; see CaptureSteps::integrated_in_part().
  void take_part(PhaseOutcome outcome, const PhaseMeasures& measures, double next_step);

  /// Resumes the run: integrates here unless the piece was integrated elsewhere.
  bool await_resume();

 private:
  explicit PhaseSegment(CaptureRun& run);
  void describe(const std::string& name, double end, bool controlled);
  void note(const PhaseOutcome& outcome, const PhaseMeasures& measures);
  PhaseOutcome integrate();
  PhaseInterval remaining_interval(const OutputGrid& outputs) const;
  PhaseOutcome integrate_between_checks();
  PhaseOutcome integrate_with_samples();
  std::function<void(double)> each_step() const;
  StepProbe probe();
  LoadCondition load_condition();
  void note_events(const PhaseOutcome& outcome);

  CaptureRun& run_;
  const bool observed_;
  PhaseDynamics dynamics_;
  HoldWatch holds_;          // of grasps with limits, and slips
  StopCondition arrival_;    // of an end-effector
  StopCondition condition_;  // end condition of the phase
  StopCondition stop_;       // the earliest of these and the end of the law that moves the joints
  MotionTask task_;
  bool watched_elsewhere_ = false;          // MotionTask::watch has been called
  std::optional<PhaseOutcome> elsewhere_;   // of the whole, or of a part
  std::optional<PhaseResumption> resumed_;  // after that part
};

}  // namespace grapnel
