#pragma once

/// @file
/// Observes the stages of captures by contacts: first contact, closing, caged, settled, latched. Grasps that close when
/// their target is settled read it. Thread safety: one thread at a time.

#include <optional>
#include <string>
#include <vector>

#include "grapnel/capture/motion_observer.hpp"
#include "grapnel/problem/stage_pairs.hpp"

namespace grapnel {

class StageMonitor final : public MotionObserver {
 public:
  /// `free`: the system with free targets.
  StageMonitor(const CaptureProblem& problem, const CaptureSystem& free);

  std::vector<Series> series() const override;
  void put(const CaptureSystem& system, const PhaseSample& sample, SeriesRow& row) const override;
  void begin_phase(const CaptureSystem& system, const PhaseDynamics& dynamics) override;
  bool observes() const override { return !watches_.empty(); }
  void step(const PhaseStep& step) override;
  void end_phase(double duration) override;
  void write(CaptureResult& result) const override;

  /// A phase of motion with this name in results begins [s].
  void begin_motion(const std::string& name, const PostImpactSetup& phase, double begin);
  void end_motion(double time);
  /// A grasp of a target has closed.
  void latch(std::size_t target, double time);

  /// Whether a grasp of any target with stages has closed.
  bool has_latched() const;
  /// Whether a grasp that waits for it may close: the target is settled, and no escape path was found.
  bool is_settled(std::size_t target) const;
  /// Falls to zero when a target is settled of which a grasp waits (`waiting`, per target); empty if none does.
  StopCondition stop_condition(const std::vector<bool>& waiting) const;

 private:
  // The stages of one target.
  struct Watch {
    StagesSetup setup;
    std::size_t target;
    std::vector<std::size_t> pairs;  // of gripper and target, as contact_pairs()
    StagesReport report;
    double closing_end = 0;             // [s]
    std::optional<double> quiet_since;  // the target moves less than stated since then [s]
    std::optional<double> due;          // time at which it is settled, if it remains quiet [s]
    bool closed = false, settled = false;
    bool touches = false;              // at the last step
    std::optional<double> away_since;  // farther from the gripper than StagesSetup::away since then [s]
  };
  // Motion of a target relative to a link: of its centre of mass, and angular.
  struct RelativeMotion {
    double speed, rate;  // [m/s], [rad/s]
  };

  RelativeMotion motion(const Watch& watch, const CaptureSystem& system, const Kinematics& kinematics) const;
  double excess(const Watch& watch, const PhaseStep& step, double t);
  bool touches(const Watch& watch) const;
  void observe_target(Watch& watch, const PhaseStep& step);
  void observe_distance(Watch& watch, double time);
  void observe_rest(Watch& watch, const PhaseStep& step);
  void disturb(Watch& watch, double time);
  void settle(Watch& watch, const PhaseStep& step);
  void note_grip(Watch& watch);
  void close(Watch& watch, const PhaseStep& step);
  void search(Watch& watch, const PhaseStep& step, double time);
  static bool may_leave(const Watch& watch) { return watch.report.cage == StagesReport::Cage::can_leave; }
  static void conclude(const Watch& watch, StagesReport& report);

  const CaptureProblem& problem_;
  std::vector<ContactPair> pairs_;
  std::vector<Watch> watches_;
  // The current phase:
  const CaptureSystem* system_ = nullptr;
  ContactSet* set_ = nullptr;
  Kinematics kinematics_;
  std::vector<ExternalWrench> wrenches_;  // scratch
};

}  // namespace grapnel
