#pragma once

/// @file
/// Watches the joints of a model against their limits along the samples of a simulation.

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "grapnel/clearance/clearance_result.hpp"
#include "grapnel/dynamics/state.hpp"

namespace grapnel {

/// Fed with consecutive samples of a phase, keeps the times in which joints (Model::joints()) are beyond their limits
/// of position, rate or effort.
///
/// Positions between samples are cubics that meet positions and rates at the samples, rates are their derivatives: a
/// joint that passes a limit and turns back between two samples is found where its rate changes sign, and times at
/// which limits are crossed are located. Rates beyond a limit only between samples are not found (the derivative of the
/// cubic overshoots where an acceleration jumps), nor are efforts, whose events begin and end at samples. A value
/// counts as beyond a limit when it exceeds it by more than 1e-9 of it (positions: of the larger of both limits), so
/// that motions planned to end on a limit and efforts cut at a limit are no violation.
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
  /// Ends the phase and the events in it. @throws std::logic_error outside a phase.
  void end_phase();

  /// In order of their begins.
  std::vector<LimitEvent> events() const;

 private:
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
  };

  std::vector<Monitor> monitors_of(const Model& model) const;
  void watch_motion(Monitor& monitor, double time, const State& state);
  template <class Function>
  void watch_piece(Monitor& monitor, const Point& begin, const Point& end, Function&& value);
  void watch_sample(Monitor& monitor, const Point& point);
  void note_event(Monitor& monitor, const Point& point);

  bool efforts_are_cut_;
  std::optional<Phase> phase_;
  std::vector<LimitEvent> events_;
};

}  // namespace grapnel
