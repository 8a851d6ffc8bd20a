#pragma once

/// @file
/// What is watched along the samples of a simulation, and between them: the clearance of a model's bodies, and its
/// joints against their limits.

#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "grapnel/clearance/clearance_model.hpp"
#include "grapnel/clearance/clearance_result.hpp"
#include "grapnel/dynamics/state.hpp"

namespace grapnel {

// Motion between two samples of a state.

// Zero and minimum of a function of one variable.

/// Where f changes sign between `low` and `high`, to about 1e-13 of their distance; `low_value` is f(low). Calls
/// f(double) -> double.
template <class Function>
double crossing(Function&& f, double low, double high, double low_value) {
  for (int step = 0; step < 44; ++step) {
    const double middle = 0.5 * (low + high);
    ((f(middle) < 0) == (low_value < 0) ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

/// Where f is least between `low` and `high`, if it has one minimum there, to about 1e-8 of their distance (rounding
/// lets no search of values see more). Golden section. Calls f(double) -> double.
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

/// HermiteCubic Hermite interpolation of a quantity from values x and rates r at both ends of an interval of length h,
/// at the fraction s of it, and its derivative with respect to time.
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

/// Coordinates q(t) of a model between two samples: each coordinate by its cubic, quaternions normalized afterwards.
/// With an interval h the error is of order h^4 of a smooth motion.
class MotionSegment {
 public:
  explicit MotionSegment(const Model& model);

  /// From `begin` at t0 to `end` at t1 > t0.
  void set(double t0, const State& begin, double t1, const State& end);
  /// Writes q at the time t; `state` has the model's size, its v are left alone.
  void interpolate(double t, State& state) const;

 private:
  const Model* model_;
  double t0_ = 0;
  std::vector<HermiteCubic> cubics_;
  std::vector<double> rates_begin_, rates_end_;
};

/// Fed with consecutive samples of a phase, keeps the minimum clearance of each phase and the times in which two bodies
/// are nearer than required.
///
/// Between samples the motion is interpolated (MotionSegment). It is searched where the samples say it matters: for
/// each pair that can, by its speed, come below the required clearance or the least one so far in between, the least
/// distance where the pair approaches at the first sample and parts at the second, and the times at which it crosses
/// the required clearance. So samples must be close enough that a pair does not approach and part twice between two of
/// them, nor turn faster than its rates at the samples (times 1.5) tell.
class ClearanceWatch {
 public:
  /// `required`: the clearance [m] below which a pair makes an event. @throws std::invalid_argument if it is NaN.
  explicit ClearanceWatch(double required = 0);

  /// Starts a phase. Both models must live until it ends. @throws std::logic_error if a phase is under way.
  ///
  /// `parting`: pairs (indices into ClearanceModel::pairs()) that touched or overlapped by design until this phase or
  /// an earlier one in which they were named, too: an end-effector and the target that it let go. Until such
  /// a pair has reached the required clearance, only an overlap deeper than the least depth since it was let go makes
  /// an event, and the pair counts for least() only while it does.
  void begin_phase(std::string name, const Model& model, const ClearanceModel& clearance,
                   std::span<const int> parting = {});
  /// The next sample. A sample at the time of the one before replaces it (a jump of the rates). Returns the clearance
  /// at the sample. @throws std::logic_error outside a phase; std::invalid_argument if the time goes backwards or the
  /// state is another model's.
  Clearance sample(double time, const State& state);
  /// Ends the phase and the events in it. @throws std::logic_error outside a phase.
  void end_phase();
  /// Leaves the phase under way as if it had not begun. @throws std::logic_error outside a phase.
  void forget_phase();

  /// One per phase, in order, the phase under way included.
  const std::vector<MinimumClearance>& least() const { return least_; }
  /// In order of their begins. Of phases that have ended, two bodies are in one event as long as any of their shapes
  /// are too near to each other.
  std::vector<ClearanceEvent> events() const;

 private:
  struct Sample {
    double time = 0;
    State state;
    Kinematics kinematics;
    std::vector<double> bound;  // per pair: not above its distance [m]
    std::vector<double> speed;  // per pair: not below the rate of its distance [m/s]
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
    std::vector<int> open_event;   // per pair: index of the event under way, or -1
    std::size_t events_before;     // of other phases
    std::vector<double> required;  // per pair: of which less is an event [m]
    std::vector<int> parting;      // pairs
    std::vector<bool> left_out;    // per pair: not counted for the least distance
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
  void watch_piece(int pair, double begin, const ShapeDistance& at_begin, double end, const ShapeDistance& at_end);
  void note_event(int pair, double time, const ShapeDistance& d);
  void note_overlap(int pair, double time);
  void note_least(int pair, double time, const ShapeDistance& d, MinimumClearance& least) const;

  double required_;
  std::optional<Phase> phase_;
  // Of parting pairs, by their shapes: the largest distance since they were let go.
  std::map<std::pair<int, int>, double> reached_;
  std::vector<MinimumClearance> least_;
  std::vector<ClearanceEvent> events_;
};

// Watches the joints of a model against their limits along the samples of a simulation.

/// Fed with the steps of a phase, or with consecutive samples where no steps are at hand, keeps the times in which
/// joints (Model::joints()) are beyond their limits of position, rate or effort.
///
/// Steps give positions and rates of the motion itself. The part of a step in which a joint can come near a limit is
/// divided into kParts; turns, largest rates and crossings are located in these parts.
///
/// Without steps, positions between samples are cubics that meet positions and rates at the samples, rates are their
/// derivatives: a joint that passes a limit and turns back between two samples is found where its rate changes sign,
/// and times at which limits are crossed are located. Rates beyond a limit only between samples are not found (the
/// derivative of the cubic overshoots where an acceleration jumps), nor are efforts, whose events begin and end at
/// samples. A value counts as beyond a limit when it exceeds it by more than 1e-9 of it (positions: of the larger of
/// both limits), so that motions planned to end on a limit and efforts cut at a limit are no violation.
class LimitWatch {
 public:
  /// `efforts_are_cut`: motors saturate at their limits; times in which they do are kept as `effort_saturated`.
  explicit LimitWatch(bool efforts_are_cut = false) : efforts_are_cut_(efforts_are_cut) {}

  /// Starts a phase. The model must live until it ends. @throws std::logic_error if a phase is under way.
  void begin_phase(std::string name, const Model& model);
  /// The next sample, with the motors' efforts per joint in the order of Model::joints(), or none. A sample at the time
  /// of the one before replaces it. @throws std::logic_error outside a phase; std::invalid_argument if the time goes
  /// backwards or a size is another model's.
  void sample(double time, const State& state, std::span<const double> efforts = {});
  /// The motion inside a step; valid until the next call.
  using StateAt = std::function<const State&(double t)>;
  /// The next step, in which the motion is smooth. `fresh`: rates may have jumped at `begin`. From the first step on,
  /// samples of the phase serve the efforts only. @throws std::logic_error outside a phase.
  void step(double begin, double end, bool fresh, const StateAt& at);
  /// Ends the phase and the events in it. @throws std::logic_error outside a phase.
  void end_phase();

  /// In order of their begins.
  std::vector<LimitEvent> events() const;

 private:
  static constexpr int kParts = 8;
  // One limit of one joint.
  struct Monitor {
    LimitKind kind;
    int joint;         // index into Model::joints()
    double sign;       // +1: values above the limit are beyond it; -1: below
    double limit;      // signed
    double threshold;  // the limit with its tolerance
    int open_event = -1;

    bool beyond(double value) const { return sign * (value - threshold) > 0; }
  };
  // A value and when it is taken on.
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
  void watch_piece(Monitor& monitor, const Point& begin, const Point& end, Function&& value);
  void watch_sample(Monitor& monitor, const Point& point);
  void note_event(Monitor& monitor, const Point& point);

  bool efforts_are_cut_;
  std::optional<Phase> phase_;
  std::vector<LimitEvent> events_;
};

}  // namespace grapnel
