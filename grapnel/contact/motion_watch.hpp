#pragma once

/// @file
/// Monitors of a simulated motion at and between its samples: the clearance of a model's bodies, and its joint limits.

#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "grapnel/contact/clearance_model.hpp"
#include "grapnel/contact/clearance_result.hpp"
#include "grapnel/dynamics/state.hpp"

namespace grapnel {

// Motion between two samples of a state.

// Zero and minimum of a function of one variable.

/// The sign change of f between `low` and `high`, to about 1e-13 of their distance; `low_value` is f(low). Calls
/// f(double) -> double.
template <class Function>
double crossing(Function&& f, double low, double high, double low_value) {
  for (int step = 0; step < 44; ++step) {
    const double middle = 0.5 * (low + high);
    ((f(middle) < 0) == (low_value < 0) ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

/// The minimum of a unimodal f between `low` and `high`, to about 1e-8 of their distance (the limit due to rounding
/// error of function values). Golden section search. Calls f(double) -> double.
template <class Function>
double golden_minimum(Function&& f, double low, double high) {
  constexpr double kGolden = 0.6180339887498949;
  double x1 = high - kGolden * (high - low), x2 = low + kGolden * (high - low);
  double f1 = f(x1), f2 = f(x2);
  for (int step = 0; step < 38; ++step) {
    if (f1 < f2) {
      high = x2, x2 = x1, f2 = f1;
      x1 = high - kGolden * (high - low), f1 = f(x1);
    } else {
      low = x1, x1 = x2, f1 = f2;
      x2 = low + kGolden * (high - low), f2 = f(x2);
    }
  }
  return 0.5 * (low + high);
}

/// Cubic Hermite interpolation of a quantity, from values x and rates r at both ends of an interval of length h: value
/// at the fraction s of the interval, and time derivative.
struct HermiteCubic {
  double x0, r0, x1, r1, h;

  double value(double s) const {
    const double t = 1 - s;
    return t * t * ((1 + 2 * s) * x0 + s * h * r0) + s * s * ((1 + 2 * t) * x1 - t * h * r1);
  }
  double rate(double s) const {
    const double t = 1 - s;
    return 6 * s * t * (x1 - x0) / h + t * (t - 2 * s) * r0 + s * (s - 2 * t) * r1;
  }
};

/// Coordinates q(t) of a model between two samples: a cubic per coordinate, with quaternions normalized afterwards. For
/// a smooth motion the error is of order h^4 in the interval h.
class MotionSegment {
 public:
  explicit MotionSegment(const Model& model);

  /// From `begin` at t0 to `end` at t1 > t0.
  void set(double t0, const State& begin, double t1, const State& end);
  /// Writes q at the time t to `state`, which has the model's size; its v is unchanged.
  void interpolate(double t, State& state) const;

 private:
  const Model* model_;
  double t0_ = 0;
  std::vector<HermiteCubic> cubics_;
  std::vector<double> rates_begin_, rates_end_;
};

/// Receives consecutive samples of a phase; records the minimum clearance of each phase and the intervals in which two
/// bodies are closer than required.
///
/// Between samples the motion is interpolated (MotionSegment). A pair is searched if its speed allows it to come below
/// the required clearance or the minimum so far. The search locates the minimum distance, if the pair approaches at the
/// first sample and separates at the second, and the times at which it crosses the required clearance. Samples must
/// therefore be close enough that a pair approaches and separates at most once between two of them, and rotates no
/// faster than 1.5 times its rates at the samples.
class ClearanceWatch {
 public:
  /// `required`: the clearance [m] below which a pair creates an event. @throws std::invalid_argument if it is NaN.
  explicit ClearanceWatch(double required = 0);

  /// Starts a phase. Both models must live until it ends. @throws std::logic_error during a phase.
  ///
  /// `parting`: pairs (indices into ClearanceModel::pairs()) that touched or overlapped by design until this phase or
  /// an earlier one in which they were named: an end-effector and its released target. Until such a pair has reached
  /// the required clearance, only an overlap deeper than the minimum depth since its release creates an event, and the
  /// pair counts for minima() only during such an overlap.
  void begin_phase(std::string name, const Model& model, const ClearanceModel& clearance,
                   std::span<const int> parting = {});
  /// Adds a sample. A sample at the time of the previous one replaces it (a jump of the rates). Returns the clearance
  /// at the sample. @throws std::logic_error outside a phase; std::invalid_argument if the time decreases or the state
  /// does not match the model.
  Clearance sample(double time, const State& state);
  /// Ends the phase and the events in it. @throws std::logic_error outside a phase.
  void end_phase();
  /// Discards the present phase. @throws std::logic_error outside a phase.
  void forget_phase();

  /// One per phase, in order, including the present phase.
  const std::vector<MinimumClearance>& minima() const { return minima_; }
  /// Events of completed phases, ordered by their begin. Two bodies share one event as long as any of their shapes are
  /// too close.
  std::vector<ClearanceEvent> events() const;

 private:
  struct Sample {
    double time = 0;
    State state;
    Kinematics kinematics;
    std::vector<double> bound;  // per pair: lower bound of its distance [m]
    std::vector<double> speed;  // per pair: upper bound of the rate of its distance [m/s]
  };
  // Scratch and state of a phase.
  struct Phase {
    std::string name;
    const Model* model;
    const ClearanceModel* clearance;
    Sample last, next;
    bool has_sample = false;
    MotionSegment segment;
    State between;  // scratch of distance_at
    Kinematics between_kinematics;
    std::vector<int> open_event;   // per pair: index of the open event, or -1
    std::size_t events_before;     // of other phases
    std::vector<double> required;  // per pair: distance below which an event is created [m]
    std::vector<int> parting;      // pairs
    std::vector<bool> left_out;    // per pair: excluded from the minimum distance
    std::map<std::pair<int, int>, double> reached_before;
  };

  std::pair<int, int> shapes_of(int pair) const;
  void require(int pair, double reached);
  void follow_parting();
  void fill(double time, const State& state, Sample& sample) const;
  ShapeDistance distance_at(int pair, double time);
  void watch_first();
  void watch_between();
  void watch_pair(int pair, const ShapeDistance& at_last, const ShapeDistance& at_next);
  void watch_interval(int pair, double begin, const ShapeDistance& at_begin, double end, const ShapeDistance& at_end);
  void note_event(int pair, double time, const ShapeDistance& d);
  void note_overlap(int pair, double time);
  void note_minimum(int pair, double time, const ShapeDistance& d, MinimumClearance& minimum) const;

  double required_;
  std::optional<Phase> phase_;
  // Of parting pairs, by their shapes: the maximum distance since their release.
  std::map<std::pair<int, int>, double> reached_;
  std::vector<MinimumClearance> minima_;
  std::vector<ClearanceEvent> events_;
};

// Monitors the joints of a model against their limits along the samples of a simulation.

/// Receives the steps of a phase, or consecutive samples if no steps are available; records the intervals in which
/// joints (Model::joints()) exceed their limits of position, rate or effort.
///
/// Steps provide positions and rates of the motion itself. The part of a step in which a joint can come near a limit is
/// divided into kParts; reversals, maximum rates and crossings are located in these parts.
///
/// Without steps, positions between samples are cubics that match positions and rates at the samples, and rates are
/// their derivatives. A joint that exceeds a limit and reverses between two samples is found by the sign change of its
/// rate, and crossings of limits are located. Rates beyond a limit only between samples are not found (the derivative
/// of the cubic overshoots if the acceleration jumps). Nor are efforts, whose events begin and end at samples. A value
/// counts as beyond a limit if it exceeds it by more than 1e-9 of it (positions: of the larger of both limits). Motions
/// planned to end on a limit and efforts clipped at a limit are therefore no violations.
class LimitWatch {
 public:
  /// `efforts_are_cut`: motors saturate at their limits; such intervals are recorded as `effort_saturated`.
  explicit LimitWatch(bool efforts_are_cut = false) : efforts_are_cut_(efforts_are_cut) {}

  /// Starts a phase. The model must live until it ends. @throws std::logic_error during a phase.
  void begin_phase(std::string name, const Model& model);
  /// Adds a sample, with the motors' efforts per joint in the order of Model::joints(), or none. A sample at the time
  /// of the previous one replaces it. @throws std::logic_error outside a phase; std::invalid_argument if the time
  /// decreases or a size does not match the model.
  void sample(double time, const State& state, std::span<const double> efforts = {});
  /// The motion inside a step; valid until the next call.
  using StateAt = std::function<const State&(double t)>;
  /// Adds a step in which the motion is smooth. `fresh`: rates may have jumped at `begin`. After the first step,
  /// samples of the phase are used for efforts only. @throws std::logic_error outside a phase.
  void step(double begin, double end, bool fresh, const StateAt& at);
  /// Ends the phase and the events in it. @throws std::logic_error outside a phase.
  void end_phase();

  /// Ordered by their begin.
  std::vector<LimitEvent> events() const;

 private:
  static constexpr int kParts = 8;
  // One limit of one joint.
  struct Monitor {
    LimitKind kind;
    int joint;         // index into Model::joints()
    double sign;       // +1: values above the limit violate it; -1: values below
    double limit;      // signed
    double threshold;  // the limit with its tolerance
    int open_event = -1;

    bool beyond(double value) const { return sign * (value - threshold) > 0; }
  };
  // A value and its time.
  struct Point {
    double time;
    double value;
  };
  struct Phase {
    std::string name;
    const Model* model;
    std::vector<Monitor> monitors;
    bool has_sample = false;
    double time = 0;
    State state;
    bool by_steps = false;
  };
  // A joint at an instant of a step.
  struct Instant {
    double time, position, rate;
  };

  std::vector<Monitor> monitors_of(const Model& model) const;
  void watch_motion(Monitor& monitor, double time, const State& state);
  Instant instant_of(const Monitor& monitor, double time, const State& state) const;
  static bool may_pass(const Monitor& monitor, const Instant& a, const Instant& b);
  void watch_parts(Monitor& monitor, std::span<const Instant> instants, const StateAt& at);
  void watch_positions(Monitor& monitor, const Instant& a, const Instant& b, const StateAt& at);
  void watch_rates(Monitor& monitor, std::span<const Instant> instants, std::size_t part, const StateAt& at);
  template <class Function>
  void watch_interval(Monitor& monitor, const Point& begin, const Point& end, Function&& value);
  void watch_sample(Monitor& monitor, const Point& point);
  void note_event(Monitor& monitor, const Point& point);

  bool efforts_are_cut_;
  std::optional<Phase> phase_;
  std::vector<LimitEvent> events_;
};

}  // namespace grapnel
