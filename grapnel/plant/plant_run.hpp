#pragma once

/// @file
/// Stepwise execution of a plant: a run of a capture whose commands are supplied externally, sample by sample.
///
/// simulate_capture() calls its controller at every tick of the control clock, from inside the integration. PlantRun
/// executes it on a separate thread, which waits at every tick. Between two calls of step() the run is at a sample: its
/// outputs are those of the sample's time, and the commands of the next step() act from that time on. There is no
/// delay. Commands computed from the outputs at t have exactly the effect of a controller inside the run, bit for bit.

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
  /// `plant`: result of plant_of(); `variables`: of this plant.
  PlantRun(CaptureProblem plant, PlantVariables variables);
  /// Ends the run at any time, within an integration step.
  ~PlantRun();
  PlantRun(const PlantRun&) = delete;
  PlantRun& operator=(const PlantRun&) = delete;

  double period() const;
  /// Continues to the first sample. @throws PlantError with the cause if the run ends before it.
  void begin();
  /// Continues to the time `until`, or to the run's end if that is earlier. `inputs`: in the order of PlantVariables,
  /// for all samples before `until`. @throws PlantError if the run fails; outputs are then those of the last sample.
  void step(double until, const std::vector<double>& inputs);

  /// Present time [s]: the `until` of the last step, or the run's end.
  double time() const { return time_; }
  bool has_ended() const { return outputs_.end.ended; }
  /// Outputs of the last sample at or before time(); during a compliant impact there are no samples.
  const PlantOutputs& outputs() const { return outputs_; }

 private:
  class Told;    // the controller
  class Source;  // creates it
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
  double event_time_ = 0;       // time of the sample, or of the end
  PlantOutputs event_outputs_;  // outputs at that time
  std::vector<double> inputs_;  // for the present sample
  std::string failure_;         // at the end; empty: the run completed
  int phase_ = 0;               // used by the worker thread only

  std::thread worker_;
};

}  // namespace grapnel
