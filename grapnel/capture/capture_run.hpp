#pragma once

/// @file
/// The working data of a run: the problem, the bodies' current state, the joints' control, the schedule of grasps, the
/// monitors, and the result.

#include <map>
#include <memory>
#include <stdexcept>
#include <string>

#include "grapnel/approach/phase_setups.hpp"
#include "grapnel/capture/contact.hpp"
#include "grapnel/capture/coordinated_control.hpp"
#include "grapnel/capture/grasp_holds.hpp"
#include "grapnel/capture/run_contacts.hpp"
#include "grapnel/capture/run_monitor.hpp"
#include "grapnel/capture/sensor_run.hpp"
#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/problem/captured_model.hpp"
#include "grapnel/result/capture_result.hpp"
#include "grapnel/simulate/simulate_phase.hpp"

namespace grapnel {

/// Ends a run early; becomes CaptureResult::failure.
struct RunFailure : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// The closing times of grasps, and their outcomes.

class GraspSchedule {
 public:
  /// The problem must outlive the schedule. Grasps are identified by their index in the problem.
  explicit GraspSchedule(const CaptureProblem& problem);

  /// Grasps that wait for a stated time, of their first or a later closing, which has been reached to within rounding.
  std::vector<std::size_t> due_at(double now) const;
  /// At the approach's end: all remaining grasps that close together, and those stated for that time.
  std::vector<std::size_t> due_together(double now) const;
  /// Grasps that close on arrival, for the first time or again, and whose end-effectors are within their envelopes.
  std::vector<std::size_t> arrived(const CaptureSystem& system, const State& state) const;
  /// Per target: whether undecided grasps wait until it is settled, and those whose target is.
  std::vector<bool> awaited_targets() const;
  std::vector<std::size_t> settled(const StageMonitor& stages) const;
  /// Open grasps that close again on arrival: from now on those outside their envelopes wait for their return.
  void note_departures(const CaptureSystem& system, const State& state);
  /// Whether there are undecided grasps that close together, and all are within their envelopes.
  bool together_in_envelopes(const CaptureSystem& system, const State& state) const;
  /// Falls to zero when an end-effector arrives, or leaves the envelope of a grasp that then waits for its return, or,
  /// with `together`, when all that close together are in their envelopes; empty if there is nothing to wait for.
  /// `system` must outlive it.
  StopCondition stop_condition(const CaptureSystem& system, bool together) const;
  /// Stated times of undecided grasps, and later ones of open grasps.
  std::vector<double> stated_times() const;
  /// Whether any open grasps remain that close at stated times or on arrival.
  bool any_left() const;

  /// Decides on open grasps in the current state. Returns those that close.
  std::vector<std::size_t> decide(const std::vector<std::size_t>& grasps, const CaptureSystem& system,
                                  const State& state, double time);
  /// Revokes the decision: there is no contact, for this reason.
  void refuse(const std::vector<std::size_t>& grasps, const std::string& reason);
  void release(std::size_t grasp, double time);
  /// The grasp begins to slip at `time`. @throws RunFailure if it has slipped too often.
  void slip(std::size_t grasp, double time);
  /// A grasp that slips: its displacement since it closed.
  void note_slip(std::size_t grasp, double distance, double angle);
  /// It no longer slips.
  void stick(std::size_t grasp) { outcomes_[grasp]->slips = false; }
  /// The grasp slipped too far, and opened.
  void lose_by_slip(std::size_t grasp, double time);
  /// The grasp opened at load.time under this load. @throws RunFailure if it has closed and opened too often.
  void lose(const HoldLoad& load, bool in_impact);
  /// Raises the largest load of the grasp.
  void note_load(const HoldLoad& load);
  /// Per grasp, whether it has been decided on and does not hold: missed, rebounded, released or lost.
  std::vector<bool> opened() const;
  /// For contact.gap: translate_target moved its target by this distance [m].
  void moved(std::size_t grasp, double distance);

  /// Writes the outcome of every grasp, in a run last evaluated at the time `last_check`; writes nothing if the run did
  /// not reach it. `system` and `state`: at the run's end.
  void write(double last_check, const CaptureSystem& system, const State& state, CaptureResult& result) const;

  /// Whether a time equals `now` to within rounding.
  static bool is_now(double t, double now);

 private:
  std::vector<std::size_t> undecided(GraspSetup::Closes how) const;
  bool is_open(std::size_t grasp) const;
  bool waits_again(std::size_t grasp) const;
  bool is_due_again(std::size_t grasp, double now) const;
  void open(std::size_t grasp, double time);
  GraspOutcome outcome(std::size_t grasp, bool captured, const std::string& reason, double time,
                       const GraspDeviation& deviation) const;
  GraspOutcome undecided_outcome(std::size_t grasp, double end, const GraspDecision& at_end) const;

  const CaptureProblem& problem_;
  std::vector<std::optional<GraspOutcome>> outcomes_;  // per grasp, once decided: of its last closing
  std::vector<long> slips_;                            // per grasp, how often it slipped
  std::vector<double> open_since_;                     // per grasp that is open and decided on [s]
  std::vector<bool> departed_;                         // per such grasp, whether it has been outside its envelope since
  std::optional<double> first_time_;                   // of a decision
};

/// A grasp that slips.
struct RunSlip {
  SlippingGrasp grasp;     // in the free system's bodies
  SlipParts moved = {};    // HoldWatch::moved()
  std::size_t report = 0;  // in CaptureResult::slips
};

/// Servicer and targets: their state, and the grasps that hold.
struct RunBodies {
  explicit RunBodies(const CaptureProblem& problem) : free(make_capture_system(problem)), system(free) {}

  const CaptureSystem free;     // all targets free
  CaptureSystem system;         // current system: held targets hang on the arms that hold them
  std::vector<HeldGrasp> held;  // grasps that currently hold, in the free system's bodies
  std::vector<RunSlip> slips;   // grasps that currently slip, likewise
  State state;                  // of `system`
  double time = 0;              // [s]

  /// All that closures hold, as in impacts: `held`, then the parts of `slips` that do not slip.
  std::vector<HeldGrasp> holding() const;
};

/// The motion commanded to the robot's joints: their plan, and their behaviour once their arm holds a target.
class RunJoints {
 public:
  RunJoints(const CaptureProblem& problem, const RunBodies& bodies, const MovingFrame& frame);

  /// Sets the sensors from which set points are taken; null: true values. The sensors outlive this.
  void observe(const SensorRun* sensors) { sensors_ = sensors; }
  /// The bodies' state with the posture as the laws currently know it; see SensorRun::known_posture().
  State known_posture(const RunBodies& bodies) const;
  /// Before the approach's end.
  bool approaching() const { return control_.approaching; }
  /// The clock of sampled control; null without it.
  const std::shared_ptr<ControlClock>& clock() const { return clock_; }
  /// Whether settled joints have this mode after the approach.
  bool settle_to(PostImpactSetup::Joints joints) const;
  bool is_settled(std::size_t joint) const { return control_.settled[joint]; }
  std::size_t size() const { return control_.settled.size(); }

  void follow(std::vector<JointTrajectory> trajectories) { trajectories_ = std::move(trajectories); }
  /// Switches the joints between the base and a grasp's end-effector to their mode after the approach.
  void settle_arm(const RunBodies& bodies, std::size_t grasp);
  /// Switches all joints; ends the approach.
  void settle_all(const RunBodies& bodies);
  /// Begins a phase of the motion after the approach: `move` and tendons count time and excursions from here.
  void begin_post_impact(const RunBodies& bodies);
  /// The next phase after `before` begins: joints that continue to follow a reference keep their set points; the others
  /// are held at their current positions.
  void next_phase(const PostImpactSetup& before, const RunBodies& bodies);
  /// Sets the attitude to be controlled, from the setting or the current one; absent: no attitude control.
  void control_attitude(const std::optional<BaseControlSetup>& setup, const RunBodies& bodies);

  /// Sets the law that moves the joints together; null: none.
  void obey(std::shared_ptr<JointLaw> law) { control_.law = std::move(law); }
  /// The drives of the system from now on. @throws ControllerError if a plugin is needed but not available.
  PhaseSetup setup(const RunBodies& bodies);
  /// The same for the approach followed exactly, without noise.
  PhaseSetup exact_approach(const RunBodies& bodies) const;
  /// Whether motors or attitude control are active in this motion.
  bool are_controlled() const;
  /// Whether drives saturate at their effort limits in it.
  bool efforts_are_cut() const;
  /// The references of the joints: in the approach, and afterwards if they move to a posture; otherwise empty.
  std::vector<JointTrajectory> references() const;
  /// The controlled attitude of the base; absent: none.
  const std::optional<Rotationd>& controlled_attitude() const { return control_.attitude; }

  /// Joints that follow a trajectory exactly keep its rate through an impact. In the free system.
  std::vector<HeldRate> driven_rates(const RunBodies& bodies) const;
  /// The rates of all joints that move as prescribed now, and those of couplings. In the free system.
  std::vector<HeldRate> prescribed_rates(const RunBodies& bodies) const;
  /// The same, and the held rates from impact.joints and impact.modes.
  std::vector<HeldRate> rates_in_impact(const RunBodies& bodies) const;

 private:
  void settle(const RunBodies& bodies, const State& known, std::size_t joint);
  void hold_in_impacts(const RunBodies& bodies, PhaseSetup& setup) const;
  std::vector<HeldRate> with_rows(const RunBodies& bodies, std::vector<HeldRate> held) const;

  std::shared_ptr<Controller> controller(const RunBodies& bodies);

  const CaptureProblem& problem_;
  const MovingFrame frame_;
  const SensorRun* sensors_ = nullptr;
  std::shared_ptr<ControlClock> clock_;        // of the whole run; null: continuous control
  std::shared_ptr<ThrusterBank> thrusters_;    // likewise; null: there are none
  std::shared_ptr<Controller> controller_;     // likewise, created on first use
  std::vector<JointTrajectory> trajectories_;  // of the approach, per robot joint
  SegmentControl control_;
};

/// The body that a joint of the robot carries.
const Body& joint_body(const CaptureSystem& system, std::size_t joint);

/// Events of grasps at the end of a motion segment.
struct GraspOverloads {
  std::vector<HoldLoad> reached;         // loads at the limits of grasps, or held parts of slipping grasps
  std::vector<RestingSlip> at_rest;      // in RunBodies::slips: these parts stick again
  std::vector<std::size_t> slipped_out;  // likewise: they have slipped too far

  bool any() const { return !reached.empty() || !at_rest.empty() || !slipped_out.empty(); }
};

struct CaptureRun {
  /// `the_problem` is given in the frame of the computation. @throws CaptureProblemError, ModelError.
  CaptureRun(const CaptureProblem& the_problem, const MovingFrame& the_frame, CaptureDetail the_detail,
             CaptureProgress the_progress, SeriesSink* sink, CaptureResult& the_result);

  /// The first piece of a phase has its plain name; further pieces are numbered.
  std::string next_name(const std::string& phase);
  /// Convert between the representations: all targets free, or hanging on the arms that hold them.
  void to_free();
  void to_joined();
  /// Momentum of everything about the origin, in W; the bodies are in the free system.
  Momentumd momentum_about_origin() const;
  /// The problem with some of its grasps. Valid until the next call.
  const CaptureProblem& with_grasps(const std::vector<std::size_t>& grasps);
  PhaseEnd describe_now() const;
  /// The name of the current phase.
  const std::string& phase_name() const { return phase_names_[motion_phase_]; }
  /// Advances the problem to its next phase; false: there is none.
  bool next_motion_phase();

 private:
  std::unique_ptr<CaptureProblem> staged_;  // of a sequence of phases: without completed ones; else null
  std::vector<std::string> phase_names_;
  std::size_t motion_phase_ = 0;

 public:
  const CaptureProblem& problem;  // its first phase is the current one
  const MovingFrame frame;        // of all states
  const CaptureDetail detail;
  const CaptureProgress progress;
  CaptureResult& result;
  RunBodies bodies;
  RunJoints joints;
  GraspSchedule schedule;
  RunContacts contacts;
  CoordinatedControl law;
  IdentificationRun identification;
  const std::shared_ptr<SensorRun> sensors;  // null: no sensors
  RunMonitor monitor;
  bool rebounded = false;                   // something has rebounded
  GraspOverloads overloads;                 // at the current instant
  bool condition_met = false;               // the end condition of the current phase holds
  std::vector<std::string> unstable_gains;  // of the approach, as text
  std::vector<double> pauses;               // motion segments end at these times, too [s]

 private:
  std::map<std::string, int> segment_counts_;  // of phases, by name
  std::optional<CaptureProblem> part_;         // the problem with part_grasps_ only
  std::vector<std::size_t> part_grasps_;
};

}  // namespace grapnel
