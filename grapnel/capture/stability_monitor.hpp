#pragma once

/// @file
/// Stability of control loops, evaluated from the oscillation of the controlled rates, and rest of the motion after the
/// impact. Thread safety: one thread at a time.

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "grapnel/problem/capture_system.hpp"
#include "grapnel/result/capture_result.hpp"
#include "grapnel/simulate/simulate_phase.hpp"

namespace grapnel {

/// A signal as half-cycles between its sign changes, and its envelope over time. The memory is bounded: half-cycles are
/// merged by threes, time bins by twos.
class Oscillation {
 public:
  /// A step of the signal. `limit`: 1 or -1 if its actuators were at their upper or lower limit, else 0; `energy`: of
  /// the motion [J]; `excited`: something else reversed in the step, or is noise.
  struct Step {
    double begin = 0, end = 0;  // [s]
    double value = 0;           // at the end
    int limit = 0;
    double energy = 0;
    bool excited = false;
  };
  void add(const Step& step);

  /// What half-cycles have in common.
  struct Content {
    double begin = 0;             // [s]
    double peak = 0, energy = 0;  // largest
    double saturated = 0;         // time at a limit [s]
    long count = 0;               // half-cycles
    long reversals = 0;           // of the limit, from one to the other
    long excited = 0;             // steps
    void append(const Content& later);
  };
  struct Third : Content {
    double duration = 0;  // [s]
  };
  /// The thirds of all half-cycles; empty if there are fewer than `least`, or if the oscillation has ended: the last
  /// half-cycle is longer than three previous ones.
  std::vector<Third> thirds(std::size_t least) const;
  /// Growth over the last `count` complete half-cycles, if each peak exceeds the previous one by the factor.
  struct Growth {
    double first = 0, last = 0;  // peaks
    double energy_factor = 0, period = 0;
    double begin = 0;  // [s]
  };
  std::optional<Growth> growth(std::size_t count, double factor) const;
  /// Whether the maximum grows by more than the factor from each of the parts of equal duration to the next.
  bool diverges(int parts, double factor) const;
  /// The start of the last unbroken sequence of complete half-cycles that saturate [s]; there is one.
  double saturated_since() const;
  /// The time of the first value [s].
  double start() const { return start_; }
  /// Maximum in the first and in the last third of the time, and overall.
  bool empty() const { return halves_.empty(); }
  double first() const { return in_bins(0, 1.0 / 3); }
  double last() const { return in_bins(2.0 / 3, 1); }
  double largest() const { return in_bins(0, 1); }

 private:
  struct Half : Content {
    double end = 0;
  };
  void merge_halves();
  void bin(double t, double value);
  double in_bins(double from, double to) const;

  std::vector<Half> halves_;
  int sign_ = 0, limit_ = 0;  // the last ones
  double start_ = std::numeric_limits<double>::quiet_NaN(), end_ = 0, width_ = 0;
  std::vector<double> bins_;
};

/// The verdict on a rate that control drives to zero. `noise`: standard deviation of its sensor [rad/s or m/s];
/// `stores_energy`: springs or free joints exchange energy with it, so that it grows only if the total energy does.
/// Unstable: it oscillates, and its peaks grow, or do not decay while the actuators are at their limits; or it
/// grows exponentially without oscillation. Stable: it has decayed.
///
/// `forced`: something else excites the oscillation, such as joints that follow a reference. Decay is then no evidence.
/// Unstable is only large growth, and an oscillation in which the actuators alternate between their limits, more often
/// than the excitation reverses.
StabilityReport evaluate_oscillation(const Oscillation& oscillation, double noise, bool stores_energy,
                                     bool forced = false);

class StabilityMonitor {
 public:
  explicit StabilityMonitor(const CaptureProblem& problem);

  /// Begins a motion segment; both arguments live until it ends. `moved_by_law`: a law moves joints together, whose
  /// rates are not errors.
  void begin_phase(const std::string& name, const CaptureSystem& system, const PhaseDynamics& dynamics,
                   bool moved_by_law, bool after_impact);
  /// Whether the phase has signals to observe.
  bool observes() const { return !signals_.empty(); }
  /// Whether rest is observed: with any level of detail.
  bool monitors_rest() const { return seeks_rest_; }
  /// `reached`: the system at the end of the step.
  void step(double begin, const PhaseSample& reached, bool base_is_saturated);
  void step_to_rest(double begin, const PhaseSample& reached);
  void end_phase();
  /// Writes reports, and warnings of instability and of motion that has not come to rest.
  void write(CaptureResult& result) const;

 private:
  struct Signal {
    std::string of;
    int velocity = -1;  // in State::v
    int joint = -1;     // in Model::joints(); -1: of the base, about `axis`
    int axis = 0;
    double limit = 0;  // of the drive [N m or N]; of base control about the axis
    double noise = 0;  // of the sensor [rad/s or m/s]
    /// A law that moves joints together commands it: the rate is no error, and decides only if it is unstable.
    bool of_law = false;
    double last_rate = 0;  // of a joint that a law moves, not zero
    Oscillation oscillation;
    Oscillation forced;  // in steps in which joints follow a moving reference, or noise
    // Before the last contact began:
    std::optional<StabilityReport> unstable = {};
    double largest = 0;  // magnitude of the rate [rad/s or m/s]
  };
  StabilityReport judge(const Signal& signal) const;
  void forget_before_contact();
  double energy(const State& state) const;
  bool is_forced(double begin, double end);

  const CaptureProblem& problem_;
  std::string name_;
  const CaptureSystem* system_ = nullptr;
  const PhaseDynamics* dynamics_ = nullptr;
  bool stores_energy_ = false, moved_by_law_ = false;
  std::vector<double> pulls_;        // per joint of the robot: the last acceleration of its reference that is not zero
  bool reference_reverses_ = false;  // in the current step, or a joint follows noise
  long touches_ = 0;                 // contacts between shapes that have begun, impacts included
  bool disturbed_ = false;           // one has begun in this phase
  std::vector<Signal> signals_;
  std::vector<StabilityReport> reports_;
  bool seeks_rest_ = false;
  std::optional<RestReport> rest_;
};

}  // namespace grapnel
