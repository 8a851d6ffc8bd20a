#pragma once

/// @file
/// What a run works on: the problem, the bodies as they now are, what controls the joints, which grasps close when, who
/// observes, and the result.

#include <map>
#include <memory>
#include <stdexcept>
#include <string>

#include "grapnel/approach/phase_setups.hpp"
#include "grapnel/capture/law_run.hpp"
#include "grapnel/capture/run_monitor.hpp"
#include "grapnel/capture/sensor_run.hpp"
#include "grapnel/impact_report/contact.hpp"
#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/problem/captured_model.hpp"
#include "grapnel/result/capture_result.hpp"
#include "grapnel/simulate/simulate_phase.hpp"

namespace grapnel {

// Which grasps close when, and what became of each.

class GraspSchedule {
 public:
  /// The problem must outlive the schedule. Grasps are named by their position in it.
  explicit GraspSchedule(const CaptureProblem& problem);

  /// Undecided grasps whose stated time has come, within rounding.
  std::vector<std::size_t> due_at(double now) const;
  /// At the approach's end: all that is left to close together, and what is stated for that time.
  std::vector<std::size_t> due_together(double now) const;
  /// Undecided grasps that close on arrival and whose end-effectors are within their envelopes.
  std::vector<std::size_t> arrived(const CaptureSystem& system, const State& state) const;
  /// Whether there are undecided grasps that close together, and all are within their envelopes.
  bool together_in_envelopes(const CaptureSystem& system, const State& state) const;
  /// Falls to zero as soon as an end-effector arrives, or, with `together`, all of those that close together are in
  /// their envelopes; empty if nothing is waited for. `system` must outlive it.
  StopCondition stop_condition(const CaptureSystem& system, bool together) const;
  /// Stated times of undecided grasps.
  std::vector<double> stated_times() const;
  /// Whether grasps are left that close at stated times or on arrival.
  bool any_left() const;

  /// Decides on undecided grasps at the present state. Those that close.
  std::vector<std::size_t> decide(const std::vector<std::size_t>& grasps, const CaptureSystem& system,
                                  const State& state, double time);
  /// Takes it back: there is no contact, for this reason.
  void refuse(const std::vector<std::size_t>& grasps, const std::string& reason);
  void release(std::size_t grasp, double time);
  /// Per grasp, whether it has been decided on and does not hold: it was missed, it rebounded or it was released.
  std::vector<bool> opened() const;
  /// contact.gap: translate_target moved its target by a distance [m].
  void moved(std::size_t grasp, double distance);

  /// What became of every grasp, in a run that was last looked at at the time `last_look`; nothing if the run did not
  /// come so far. `system` and `state`: at the run's end.
  void write(double last_look, const CaptureSystem& system, const State& state, CaptureResult& result) const;

  /// Whether a time is `now` within rounding.
  static bool is_now(double t, double now);

 private:
  std::vector<std::size_t> undecided(GraspSetup::Closes how) const;
  GraspOutcome outcome(std::size_t grasp, bool captured, const std::string& reason, double time,
                       const GraspDeviation& deviation) const;
  GraspOutcome undecided_outcome(std::size_t grasp, double end, const GraspDecision& at_end) const;

  const CaptureProblem& problem_;
  std::vector<std::optional<GraspOutcome>> outcomes_;  // per grasp, once decided
  std::optional<double> first_time_;                   // of a decision
};

/// Ends a run early; becomes CaptureResult::failure.
struct RunFailure : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Servicer and targets: where they are, and what holds what.
struct RunBodies {
  explicit RunBodies(const CaptureProblem& problem) : free(make_capture_system(problem)), system(free) {}

  const CaptureSystem free;     // all targets free
  CaptureSystem system;         // as it is now: targets that are held hang on the arms that hold them
  std::vector<HeldGrasp> held;  // grasps that hold now, in the free system's bodies
  State state;                  // of `system`
  double time = 0;              // [s]
};

/// What the robot's joints are to do: their plan, and what becomes of it once their arm holds a target.
class RunJoints {
 public:
  RunJoints(const CaptureProblem& problem, const RunBodies& bodies, const MovingFrame& frame);

  /// Through which set points are known, from now on; null: they are the true values. It outlives this.
  void observe(const SensorRun* sensors) { sensors_ = sensors; }
  /// The bodies' state with the posture as laws know it now; see SensorRun::known_posture().
  State known_posture(const RunBodies& bodies) const;
  /// Before the approach's end.
  bool approaching() const { return control_.approaching; }
  /// Of sampled control; null without it.
  const std::shared_ptr<ControlClock>& clock() const { return clock_; }
  /// Whether joints that have settled do this after the approach.
  bool settle_to(PostImpactSetup::Joints joints) const;
  bool is_settled(std::size_t joint) const { return control_.settled[joint]; }
  std::size_t size() const { return control_.settled.size(); }

  void follow(std::vector<JointTrajectory> trajectories) { trajectories_ = std::move(trajectories); }
  /// The joints between the base and a grasp's end-effector do from now on what they do after the approach.
  void settle_arm(const RunBodies& bodies, std::size_t grasp);
  /// All do; the approach is over.
  void settle_all(const RunBodies& bodies);
  /// A phase of the motion after the approach begins: what `move` says counts from now on.
  void begin_post_impact(double time) { control_.post_impact_begin = time; }
  /// The problem has another phase than `before`: joints that followed something keep their set points where they go on
  /// following, else they are held where they are.
  void next_phase(const PostImpactSetup& before, const RunBodies& bodies);
  /// The base's attitude to be kept from now on is what a setting says, or the present one; absent: not controlled.
  void control_attitude(const std::optional<BaseControlSetup>& setup, const RunBodies& bodies);

  /// The law that works from now on, if any does.
  void obey(std::shared_ptr<JointLaw> law) { control_.law = std::move(law); }
  /// What drives the system from now on. @throws ControllerError if a plugin is needed and cannot be had.
  PhaseSetup setup(const RunBodies& bodies);
  /// The same for the approach followed exactly, without noise.
  PhaseSetup exact_approach(const RunBodies& bodies) const;
  /// Whether motors work, or attitude control, in such a motion.
  bool are_controlled() const;
  /// Whether drives are cut at their effort limits in it.
  bool efforts_are_cut() const;
  /// What joints follow, one by one: in the approach, and afterwards where they move to a posture; else empty.
  std::vector<JointTrajectory> references() const;
  /// The base's attitude that is kept; absent: it is not controlled.
  const std::optional<Rotationd>& kept_attitude() const { return control_.attitude; }

  /// Joints that follow a trajectory exactly keep its rate through an impact. In the free system.
  std::vector<HeldRate> driven_rates(const RunBodies& bodies) const;
  /// The same, and what impact.joints and impact.modes ask of the others.
  std::vector<HeldRate> rates_in_impact(const RunBodies& bodies) const;

 private:
  void settle(const RunBodies& bodies, const State& known, std::size_t joint);
  std::vector<HeldRate> with_fast_modes(const RunBodies& bodies, std::vector<HeldRate> held) const;

  std::shared_ptr<Controller> controller(const RunBodies& bodies);

  const CaptureProblem& problem_;
  const MovingFrame frame_;
  const SensorRun* sensors_ = nullptr;
  std::shared_ptr<ControlClock> clock_;        // of the whole run; null: laws speak continuously
  std::shared_ptr<ThrusterBank> thrusters_;    // likewise; null: there are none
  std::shared_ptr<Controller> controller_;     // likewise, once it is needed
  std::vector<JointTrajectory> trajectories_;  // of the approach, per robot joint
  SegmentControl control_;
};

/// The body that a joint of the robot carries.
const Body& joint_body(const CaptureSystem& system, std::size_t joint);

struct CaptureRun {
  /// `the_problem` is as the frame sees it. @throws CaptureProblemError, ModelError.
  CaptureRun(const CaptureProblem& the_problem, const MovingFrame& the_frame, CaptureDetail the_detail,
             CaptureProgress the_progress, SeriesSink* sink, CaptureResult& the_result);

  /// The first piece of a phase has its plain name, others are numbered.
  std::string next_name(const std::string& phase);
  /// Between the representations: all targets free, or hanging on the arms that hold them.
  void to_free();
  void to_joined();
  /// Momentum of everything about the origin, in W; the bodies are in the free system.
  Momentumd momentum_about_origin() const;
  /// The problem with some of its grasps. Valid until the next call.
  const CaptureProblem& with_grasps(const std::vector<std::size_t>& grasps);
  PhaseEnd describe_now() const;
  /// The name of the phase at hand.
  const std::string& phase_name() const { return phase_names_[motion_phase_]; }
  /// From now on the problem has the next phase; false: there is none.
  bool next_motion_phase();

 private:
  std::unique_ptr<CaptureProblem> staged_;  // of a sequence of phases: those that are over are taken out; else null
  std::vector<std::string> phase_names_;
  std::size_t motion_phase_ = 0;

 public:
  const CaptureProblem& problem;  // its first phase is the one at hand
  const MovingFrame frame;        // in which all states are
  const CaptureDetail detail;
  const CaptureProgress progress;
  CaptureResult& result;
  RunBodies bodies;
  RunJoints joints;
  GraspSchedule schedule;
  LawRun law;
  IdentificationRun identification;
  const std::shared_ptr<SensorRun> sensors;  // null: nothing is read
  RunMonitor monitor;
  bool rebounded = false;                   // something has rebounded
  bool condition_met = false;               // what ends the phase at hand holds
  std::vector<std::string> unstable_gains;  // of the approach, in words

 private:
  std::map<std::string, int> pieces_;   // of phases, by name
  std::optional<CaptureProblem> part_;  // the problem with part_grasps_ alone
  std::vector<std::size_t> part_grasps_;
};

}  // namespace grapnel
