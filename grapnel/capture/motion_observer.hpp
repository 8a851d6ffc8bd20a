#pragma once

/// @file
/// Observers of the motion, one per kind: actuators, couplings, contacts and stages. Each has time series, checks of
/// steps and states, and a report. Thread safety: one thread at a time.

#include <memory>
#include <span>
#include <vector>

#include "grapnel/problem/captured_model.hpp"
#include "grapnel/result/capture_result.hpp"
#include "grapnel/result/time_series.hpp"
#include "grapnel/simulate/simulate_phase.hpp"

namespace grapnel {

/// Writes the values of one sample, series by series in their order.
class SeriesRow {
 public:
  explicit SeriesRow(TimeSeries& series) : series_(&series) {}
  void put(double value) { series_->series[next_++].data.push_back(value); }
  void put(const Vector3d& v) { put_all(v.e); }
  template <class Values>
  void put_all(const Values& values) {
    for (const double x : values) series_->series[next_].data.push_back(x);
    ++next_;
  }
  /// value(i) for i = 0, 1, ..., count - 1.
  template <class Value>
  void put_each(std::size_t count, Value&& value) {
    for (std::size_t i = 0; i < count; ++i) series_->series[next_].data.push_back(value(i));
    ++next_;
  }

 private:
  TimeSeries* series_;
  std::size_t next_ = 0;
};

class ContactMonitor;
class StageMonitor;

class MotionObserver {
 public:
  MotionObserver() = default;
  MotionObserver(const MotionObserver&) = delete;
  MotionObserver& operator=(const MotionObserver&) = delete;
  virtual ~MotionObserver() = default;

  /// Its time series, without values.
  virtual std::vector<Series> series() const = 0;
  /// Writes their values at a sample, also between phases (PhaseSample::dynamics).
  virtual void put(const CaptureSystem& system, const PhaseSample& sample, SeriesRow& row) const = 0;

  /// Begins a motion segment; both arguments live until it ends.
  virtual void begin_phase(const CaptureSystem& system, const PhaseDynamics& dynamics);
  /// Whether steps must be evaluated.
  virtual bool observes() const { return false; }
  virtual void step(const PhaseStep& step);
  /// Whether states must be observed also where lanes integrate the phase.
  virtual bool follows_states() const { return false; }
  /// Adds a state of the system. `motor`: efforts per Model::joints(); empty if not computed.
  virtual void observe(const CaptureSystem& system, const State& state, std::span<const double> motor);
  /// Discards the states observed since begin_phase().
  virtual void restart_phase() {}
  /// Ends a segment of this duration [s].
  virtual void end_phase(double duration);
  /// Writes the report; nothing without bodies or actuators of this kind.
  virtual void write(CaptureResult& result) const = 0;
};

/// All observers of a problem.
struct MotionObservers {
  /// `problem` must outlive them; `free` is its system with free targets.
  MotionObservers(const CaptureProblem& problem, const CaptureSystem& free, const MovingFrame& frame);

  std::vector<std::unique_ptr<MotionObserver>> all;
  StageMonitor* stages;                // one of them
  ContactMonitor* contacts = nullptr;  // likewise; null: no contacts between shapes
};

}  // namespace grapnel
