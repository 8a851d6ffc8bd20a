#pragma once

/// @file
/// All observers of a run, which do not change it: the time series, the checks of conservation, of closed loops and of
/// impacts, clearance and joint limits, and the loads. One object that receives every phase, sample and impact once.

#include <algorithm>
#include <memory>
#include <vector>

#include "grapnel/capture/compliant_run.hpp"
#include "grapnel/capture/conservation_monitor.hpp"
#include "grapnel/capture/joint_monitor.hpp"
#include "grapnel/capture/load_monitor.hpp"
#include "grapnel/capture/motion_observer.hpp"
#include "grapnel/capture/recorder.hpp"
#include "grapnel/capture/safety_monitor.hpp"
#include "grapnel/capture/saturation_monitor.hpp"
#include "grapnel/capture/stability_monitor.hpp"
#include "grapnel/capture/stage_monitor.hpp"
#include "grapnel/problem/capture_problem.hpp"

namespace grapnel {

class RunMonitor {
 public:
  /// What is observed and recorded.
  struct Recording {
    CaptureDetail detail;
    SeriesSink* sink;          // receives samples immediately; null: the result's series keep them
    const SensorRun* sensors;  // whose readings are recorded; null: none
  };

  /// `free`: the system with all targets free. write() adds the observations to `result`.
  RunMonitor(const CaptureProblem& problem, const CaptureSystem& free, const MovingFrame& frame,
             const Recording& recording, CaptureResult& result);

  // --- Phases of motion ---

  struct Phase {
    std::string name;
    const CaptureSystem& system;  // system and dynamics live until the phase ends
    const PhaseDynamics& dynamics;
    bool controlled = false;        // motors or attitude control are active
    bool efforts_are_cut = false;   // drives saturate at the effort limits
    std::vector<bool> opened = {};  // GraspSchedule::opened()
    double begin = 0;               // [s]
    bool moved_by_law = false;      // a law moves joints together
    bool after_impact = false;
  };
  void begin_phase(Phase phase);
  /// Whether samples are recorded.
  bool records() const { return recorder_.has_value(); }
  /// Whether clearance or joint limits are observed in the phase.
  bool watches() const { return watches_.watching() || any_observer(&MotionObserver::follows_states); }
  /// Whether limits may be exceeded only between the ends of long steps.
  bool watches_closely() const { return watches_.watching(); }
  /// Whether loads are evaluated in every step of a phase.
  bool seeks_loads() const { return detail_ != CaptureDetail::columns; }
  /// Whether the stability of control loops is evaluated: with the same level of detail.
  bool seeks_stability() const { return seeks_loads(); }
  /// Whether every step of the phase is needed: for loads, plumes, gyro steering, or the time of rest. Saturation does
  /// not need it: lanes stop when a wheel reaches its maximum rate, and have neither gyros nor thrusters.
  bool inspects_steps() const {
    return seeks_loads() || any_observer(&MotionObserver::observes) || stability_.monitors_rest();
  }
  /// Whether the phase needs samples; otherwise ends of steps suffice.
  bool needs_samples() const;

  /// Adds a sample. `record`: it is added to the time series, which need not contain all.
  void sample(const PhaseSample& sample, bool record);
  /// The ends of some steps, instead of samples.
  void check(double time, const State& state, const PhaseIntegrals& integrals);
  /// Evaluates every step: limits, loads, plumes, gyros; empty if none of these is observed.
  StepProbe load_probe();
  /// Evaluates every impact of hard contacts; empty without loads.
  std::function<void(const HardImpact&)> impact_probe();
  /// For a phase integrated elsewhere: evaluates clearance and joint limits,
  void watch(double time, const State& state, std::span<const double> motor);
  /// discards these evaluations, since the phase is integrated here after all,
  void restart_watch();
  /// and takes the measures of its conservation checks.
  void take(const PhaseMeasures& measures) {
    conservation_.take(measures);
    loops_.take(measures.closures);
  }
  /// Whether joints' effort limits are checked.
  bool watches_efforts() const { return watches_.watches_efforts(); }
  void note_check(double time) { last_check_ = time; }
  void end_phase(const PhaseOutcome& outcome);

  // --- Between phases ---

  /// Sets a new structure of the bodies.
  void set_system(const CaptureSystem& system) { conservation_.set_system(system); }
  void begin_contact(const std::string& phase);
  /// Until the next phase, the servicer and the grasps' targets are one group of bodies.
  void touch(const std::vector<std::size_t>& grasps);
  /// An instant just before or after an impact.
  void instant(const CaptureSystem& system, const State& state, double time);
  /// Adds an impact of grasps, contacts or brakes: momentum from the ground, residuals, loads. For a compliant
  /// impact these are the effects of grasps that become rigid at its end.
  void impact(const std::string& phase, const ImpactOutcome& outcome);
  /// Begins a compliant impact at `begin`, in which the system was in the state `start` before brakes; `closing` are
  /// the problem's closing grasps, `opened` is GraspSchedule::opened(). Its samples follow, then its end.
  void begin_impact_in_time(const std::string& phase, const CaptureSystem& system, const State& start, double begin,
                            const std::vector<std::size_t>& closing, std::vector<bool> opened);
  void check_in_impact(const CompliantSample& sample);
  void end_impact_in_time(const Momentumd& from_ground);
  /// Contacts between shapes in it pushed these targets: with the servicer they are one group of bodies.
  void touch_targets(std::span<const std::size_t> targets) { conservation_.touch(targets); }
  /// Adds the contacts between shapes of a compliant impact that ended at `end` [s].
  void add_contacts(const ImpactShapes& shapes, double end);
  /// Adds an instantaneous impact with the histories of hard contacts after it; `exchanged`:
  /// ImpactOutcome::exchanged_with_contacts.
  void add_hard_impact(const ContactSet& contacts, double time, double exchanged);

  // --- Stages of captures by contacts ---

  StageMonitor& stages() { return *observers_.stages; }
  const StageMonitor& stages() const { return *observers_.stages; }

  // --- The end ---

  /// Time of the last sample or evaluation [s].
  double last_check() const { return last_check_; }
  /// Ends a phase that a failure interrupted. Writes ledger, loads, clearance, limits, loops, and advice for failed
  /// checks.
  void write();

 private:
  bool any_observer(bool (MotionObserver::*property)() const) const {
    return std::any_of(observers_.all.begin(), observers_.all.end(),
                       [&](const auto& one) { return (*one.*property)(); });
  }
  void observe_motion(const CaptureSystem& system, const State& state, std::span<const double> motor) {
    for (const auto& observer : observers_.all) observer->observe(system, state, motor);
  }
  void check_at_end(const PhaseStep& step);
  std::vector<Wrenchd> joint_reactions(const PhaseSample& sample, std::span<const GraspSample> grasps) const;
  /// `grasps`: per grasp of the problem; empty: none holds.
  void instant(const CaptureSystem& system, const State& state, const Kinematics& kinematics, double time,
               std::span<const GraspSample> grasps);
  void sample_yielding(const CompliantSample& sample);

  // An observed compliant impact.
  struct ImpactInTime {
    const CaptureSystem* system = nullptr;
    double begin = 0;
    std::vector<std::size_t> closing;
    bool watched = false;
  };

  const CaptureProblem& problem_;
  const CaptureDetail detail_;
  CaptureResult& result_;
  std::optional<Recorder> recorder_;  // full detail only
  ConservationMonitor conservation_;
  SafetyMonitor watches_;
  LoopMonitor loops_;
  LoadMonitor loads_;
  SaturationMonitor saturation_;
  StabilityMonitor stability_;
  MotionObservers observers_;
  JointMonitor joints_;
  ImpactMonitor impact_checks_;
  ImpactInTime impact_;
  double last_check_ = 0, end_ = 0;
  // The current phase:
  std::string name_;
  double begin_ = 0;
  const CaptureSystem* system_ = nullptr;
  Kinematics kinematics_;
  std::vector<double> motor_;
};

}  // namespace grapnel
