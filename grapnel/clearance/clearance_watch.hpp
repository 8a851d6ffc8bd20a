#pragma once

/// @file
/// Watches the clearance of a model's bodies along the samples of a simulation.

#include <optional>
#include <string>
#include <vector>

#include "grapnel/clearance/clearance_model.hpp"
#include "grapnel/clearance/clearance_result.hpp"
#include "grapnel/clearance/motion_segment.hpp"

namespace grapnel {

/// Fed with consecutive samples of a phase, keeps the minimum clearance of each phase and the times in which a pair of
/// bodies is nearer than required.
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
  void begin_phase(std::string name, const Model& model, const ClearanceModel& clearance);
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
  /// In order of their begins.
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
    std::vector<int> open_event;  // per pair: index of the event under way, or -1
    std::size_t events_before;    // of other phases
  };

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
  std::vector<MinimumClearance> least_;
  std::vector<ClearanceEvent> events_;
};

}  // namespace grapnel
