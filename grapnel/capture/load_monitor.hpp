#pragma once

/// @file
/// The largest loads of every phase: what joints and grasps pass on, what drives and base control exert, found in every
/// step of the integrator; and what impacts add.

#include <functional>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "grapnel/clearance/clearance_result.hpp"
#include "grapnel/impact_report/compliant_run.hpp"
#include "grapnel/impact_report/internal_loads.hpp"
#include "grapnel/result/capture_result.hpp"

namespace grapnel {

// The largest magnitudes that quantities reach in a motion, and when efforts pass their limits: found step by step on
// the integrator's dense output, whatever interval of output there is.

/// A quantity's value of largest magnitude.
struct Peak {
  double magnitude = -1;  // negative: nothing has been seen
  double time = 0;        // [s]
};

/// Finds the largest magnitudes of some quantities, step by step.
class PeakSearch {
 public:
  /// Writes all quantities at a time.
  using Quantities = std::function<void(double t, std::span<double> values)>;
  struct Point {
    double time = 0;
    std::vector<double> values;
  };

  /// The first `searched` of `all` quantities have their peaks found; the others are evaluated beside them.
  explicit PeakSearch(std::size_t searched = 0, std::size_t all = 0);

  /// Looks at a step from `begin` to `end`, at five points (Lobatto's). Where the polynomial through them promises more
  /// than has been seen, the true maximum is looked for with parabolas through points close to each other. `fresh`: the
  /// quantities at `begin` are not those at the last step's end.
  ///
  /// The polynomial has to be right about where the largest values are, not about how large they are: it errs by some
  /// 1e-3 of what a quantity changes in a step of an eighth-order method, the peak found by some 1e-8 of it.
  void step(double begin, double end, bool fresh, const Quantities& at);

  std::span<const Peak> peaks() const { return peaks_; }
  /// Everything that was evaluated in the last step, in the order of time; the ends of the step among it.
  std::span<const Point> points() const { return {points_.data(), used_}; }

 private:
  const Point& evaluate(double t, const Quantities& at);
  void climb(std::size_t quantity, double t, double begin, double end, const Quantities& at);

  std::size_t all_;
  std::vector<Peak> peaks_;
  std::vector<Point> points_;  // room is kept from step to step
  std::size_t used_ = 0;
};

/// Notes when drives run at the limits of their effort, or motions take more than these allow, from what PeakSearch has
/// evaluated.
class EffortWatch {
 public:
  void begin_phase(std::string name);
  /// An effort (entry `quantity` of the points) with a finite limit on its magnitude. `cut`: the drive saturates there;
  /// else beyond it the limit is violated.
  void watch(std::string joint, std::size_t quantity, double limit, bool cut);
  /// The next step: its points, and the quantities between them, where a limit is crossed. What passes a limit and
  /// comes back between two points goes unseen.
  void step(std::span<const PeakSearch::Point> points, const PeakSearch::Quantities& at);
  /// What there was in the phase, in the order of time; an event that its end cuts short ends there.
  std::vector<LimitEvent> end_phase();

 private:
  struct Monitor {
    LimitKind kind;
    std::string joint;
    std::size_t quantity;
    double sign, limit, threshold;  // of sign times the effort
    int open = -1;                  // event under way
    double beyond(const PeakSearch::Point& p) const { return sign * p.values[quantity] - threshold; }
  };
  void note(Monitor& monitor, double time, double value);

  std::string name_;
  std::vector<Monitor> monitors_;
  std::vector<LimitEvent> events_;
  std::vector<double> values_;  // at a crossing
};

class LoadMonitor {
 public:
  explicit LoadMonitor(const CaptureProblem& problem) : problem_(problem) {}

  /// `system` and `dynamics` must live until the phase ends.
  void begin_phase(const std::string& name, const CaptureSystem& system, const PhaseDynamics& dynamics);
  /// Looks into the next step of the phase.
  void step(const PhaseStep& step);
  void end_phase();
  /// What joints and grasps of the report bore in an impact. `peaks`: of one in time, per entry of report.joints.
  void impact(const std::string& phase, const ImpactReport& report, std::span<const JointPeakTimes> peaks = {});
  /// What grasps that hold already pass on at the samples of an impact in time: `end_effectors` in the order of
  /// CompliantSample::held_wrenches.
  void begin_held(const std::string& phase, double begin, std::span<const std::string> end_effectors);
  void look_held(const CompliantSample& sample);
  void end_held();
  /// Drives at their limits and beyond, in the phase that has ended last.
  std::vector<LimitEvent> take_events() { return std::exchange(events_, {}); }
  /// Peaks of all phases and the loads on grasps. Ends a phase that a failure has left open.
  void write(CaptureResult& result);

 private:
  struct Channel {
    std::string of, quantity;
    double rating;
  };
  void add_channels(const PhaseDynamics& dynamics);
  void evaluate(const PhaseSample& sample, std::span<double> values);
  const LoadRating& rating_of(const std::string& joint_or_hand) const;
  void note(PeakLoad load);

  const CaptureProblem& problem_;
  // The phase under way:
  bool open_ = false;
  std::string name_;
  const CaptureSystem* system_ = nullptr;
  std::vector<int> bodies_;  // that joints carry
  std::vector<int> drives_;  // per such body: its place in Model::joints(), -1: it does not move
  bool controls_base_ = false;
  std::vector<Channel> channels_;
  std::vector<std::vector<bool>> determined_;  // per grasp, as the phase began
  PeakSearch search_;
  EffortWatch efforts_;
  Kinematics kinematics_;
  std::vector<double> motor_;
  // What has been found:
  std::vector<PeakLoad> peaks_;
  std::vector<PeakLoad> held_;  // during an impact in time: force and moment per grasp
  double held_begin_ = 0;
  std::vector<GraspLoad> grasps_;
  std::vector<LimitEvent> events_;
};

}  // namespace grapnel
