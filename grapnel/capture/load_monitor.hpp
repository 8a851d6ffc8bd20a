#pragma once

/// @file
/// The maximum loads of each phase: transmitted by joints and grasps, exerted by drives and base control, found in
/// every step of the integrator; and the loads of impacts.

#include <functional>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "grapnel/capture/compliant_run.hpp"
#include "grapnel/capture/effort_watch.hpp"
#include "grapnel/capture/internal_loads.hpp"
#include "grapnel/contact/clearance_result.hpp"
#include "grapnel/result/capture_result.hpp"

namespace grapnel {

class LoadMonitor {
 public:
  explicit LoadMonitor(const CaptureProblem& problem) : problem_(problem) {}

  /// `system` and `dynamics` must live until the phase ends.
  void begin_phase(const std::string& name, const CaptureSystem& system, const PhaseDynamics& dynamics);
  /// Evaluates the next step of the phase.
  void step(const PhaseStep& step);
  /// Adds an impact of hard contacts in the phase, of which the largest impulses are loads.
  void hard_impact(const HardImpact& impact);
  void end_phase();
  /// Adds the loads of an impact on joints and grasps of the report. `peaks`: of a compliant one, per entry of
  /// report.joints.
  void impact(const std::string& phase, const ImpactReport& report, std::span<const JointPeakTimes> peaks = {});
  /// Adds the loads of grasps that already hold, at the samples of a compliant impact: `end_effectors` in the order of
  /// CompliantSample::held_wrenches.
  void begin_held(const std::string& phase, double begin, std::span<const std::string> end_effectors);
  void check_held_bodies(const CompliantSample& sample);
  void end_held();
  /// Drives at their limits and beyond, in the phase that ended last.
  std::vector<LimitEvent> take_events() { return std::exchange(events_, {}); }
  /// Peaks of all phases and the loads on grasps. Ends a phase that a failure interrupted.
  void write(CaptureResult& result);

 private:
  struct Channel {
    std::string of, quantity;
    double rating;
  };
  void add_channels(const PhaseDynamics& dynamics);
  void evaluate(const PhaseSample& sample, std::span<double> values);
  void raise(const std::string& of, const char* quantity, double value, double time);
  const LoadRating& rating_of(const std::string& joint_or_end_effector) const;
  void note(PeakLoad load);

  const CaptureProblem& problem_;
  // The current phase:
  bool open_ = false;
  std::string name_;
  const CaptureSystem* system_ = nullptr;
  std::vector<int> bodies_;  // carried by joints
  std::vector<int> drives_;  // per such body: its index in Model::joints(), -1: no moving joint
  bool controls_base_ = false;
  std::vector<Channel> channels_;
  std::vector<std::vector<bool>> determined_;  // per grasp, at the start of the phase
  PeakSearch search_;
  EffortWatch efforts_;
  std::vector<PeakLoad> impulses_;  // of hard contacts
  Kinematics kinematics_;
  std::vector<double> motor_;
  // Results:
  std::vector<PeakLoad> peaks_;
  std::vector<PeakLoad> held_;  // during a compliant impact: force and moment per grasp
  double held_begin_ = 0;
  std::vector<GraspLoad> grasps_;
  std::vector<LimitEvent> events_;
};

}  // namespace grapnel
