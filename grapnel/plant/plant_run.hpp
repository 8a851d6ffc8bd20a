#pragma once

/// @file
/// A plant that goes on by steps: the run of a capture whose commands come from outside, sample by sample.
///
/// simulate_capture() asks its controller at every tick of the control clock, from deep inside the integration. Here it
/// runs on a thread of its own, which waits at every tick: between two calls of step() the run stands at a sample, its
/// outputs are those of the sample's time, and the commands of the next step() act from that time on. There is no delay
/// in between: who computes commands from the outputs at t and steps on has what a controller inside the run would
/// have, to the last bit.

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "grapnel/plant/plant_variables.hpp"
#include "grapnel/problem/capture_problem.hpp"

namespace grapnel {

struct CaptureResult;

/// Thread safety: one thread at a time; different objects are independent of each other.
class PlantRun {
 public:
  /// `plant`: as plant_of() returns it, `variables` of it.
  PlantRun(CaptureProblem plant, PlantVariables variables);
  /// Ends the run wherever it is, within an integration step.
  ~PlantRun();
  PlantRun(const PlantRun&) = delete;
  PlantRun& operator=(const PlantRun&) = delete;

  double period() const;
  /// Goes on to the first sample. @throws PlantError with what happened, if the run does not come so far.
  void begin();
  /// Goes on to the time `until`, or to the run's end if that is before it. `inputs`: as PlantVariables lists them, at
  /// all samples before `until`. @throws PlantError if the run fails; outputs are then those of the last sample.
  void step(double until, const std::vector<double>& inputs);

  /// Where it stands [s]: the `until` of the last step, or the run's end.
  double time() const { return time_; }
  bool has_ended() const { return outputs_.end.ended; }
  /// Of the last sample that came at or before time(), as during an impact in time no samples are taken.
  const PlantOutputs& outputs() const { return outputs_; }

 private:
  class Told;    // the controller
  class Source;  // makes it
  struct Cancelled {};
  enum class At { nothing, work, sample, end };

  void work();
  void go_on();
  void await();
  void take_events(double until);
  void arrive(const PlantOutputs& outputs, double time, std::vector<double>& inputs);
  void conclude(const CaptureResult& result);

  CaptureProblem plant_;
  const PlantVariables variables_;
  double time_ = 0;
  PlantOutputs outputs_;

  std::mutex mutex_;
  std::condition_variable changed_;
  // Guarded by mutex_.
  At at_ = At::nothing;
  bool cancelled_ = false;
  double event_time_ = 0;       // of the sample, or of the end
  PlantOutputs event_outputs_;  // then
  std::vector<double> inputs_;  // for the sample at hand
  std::string failure_;         // at the end; empty: it came to its end
  int phase_ = 0;               // of the worker alone

  std::thread worker_;
};

}  // namespace grapnel
