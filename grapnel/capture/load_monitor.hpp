#pragma once

/// @file
/// The largest loads of every phase: what joints and grasps pass on, what drives and base control exert, found in every
/// step of the integrator; and what impacts add.

#include <string>
#include <utility>
#include <vector>

#include "grapnel/capture/peak_search.hpp"
#include "grapnel/impact_report/compliant_run.hpp"
#include "grapnel/impact_report/internal_loads.hpp"
#include "grapnel/result/capture_result.hpp"

namespace grapnel {

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
  /// What grasps that hold already, of these end-effectors, bear in an impact in time: the largest of its samples.
  void held(const std::string& phase, double begin, std::span<const std::string> hands,
            std::span<const CompliantSample> samples);
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
  std::vector<GraspLoad> grasps_;
  std::vector<LimitEvent> events_;
};

}  // namespace grapnel
