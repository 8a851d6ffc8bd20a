#include "grapnel/capture/simulate_capture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>

#include "grapnel/capture/approach_plan.hpp"
#include "grapnel/capture/bookkeeper.hpp"
#include "grapnel/capture/captured_model.hpp"
#include "grapnel/capture/contact.hpp"
#include "grapnel/capture/grip_schedule.hpp"
#include "grapnel/capture/impact_book.hpp"
#include "grapnel/capture/impact_report.hpp"
#include "grapnel/capture/loop_book.hpp"
#include "grapnel/capture/phase_setups.hpp"
#include "grapnel/capture/problem_lookup.hpp"
#include "grapnel/capture/recorder.hpp"
#include "grapnel/capture/watches.hpp"
#include "grapnel/simulate/simulate_phase.hpp"

namespace grapnel {
namespace {

// Ends a run early; becomes CaptureResult::failure.
struct Failure : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// Settings that are there to be compared with, not to be trusted.
std::vector<std::string> comparison_warnings(const CaptureProblem& problem) {
  std::vector<std::string> warnings;
  if (problem.impact && problem.impact->law == ImpactSetup::Law::as_published)
    warnings.push_back("impact.law: as_published is for comparison: it does not conserve momentum");
  const auto warn = [&](const char* text) { warnings.push_back(std::string("integration.loops: ") + text); };
  switch (problem.integration.loops) {
    case IntegrationSetup::Loops::projection:
      break;
    case IntegrationSetup::Loops::baumgarte:
      warn("baumgarte is for comparison: defects decay instead of being taken out");
      break;
    case IntegrationSetup::Loops::acceleration:
      warn("acceleration is for comparison: nothing brings loops back, defects stay and grow");
      break;
    case IntegrationSetup::Loops::open:
      warn("open is for comparison: loops are cut, further grips of a target do not hold it");
  }
  return warnings;
}

// One run: the phases in their order, with recorder and books kept alongside. Grips close and let go between pieces of
// motion; every piece has the system as it then is.
class Run {
 public:
  Run(const CaptureProblem& problem, const CaptureProgress& progress, CaptureResult& result)
      : problem_(problem),
        progress_(progress),
        result_(result),
        free_(make_capture_system(problem)),
        system_(free_),
        recorder_(problem, free_, result.series),
        watches_(problem),
        schedule_(problem) {}

  void simulate() {
    result_.warnings = comparison_warnings(problem_);
    place();
    if (problem_.approach) approach();
    settle_all();
    const bool closed = close(schedule_.due_together(time_));
    if (!goes_on()) return;
    if (!closed) stop_joints();
    post_impact();
  }

  void close_books() {
    schedule_.write(result_);
    impacts_.write(result_.ledger);
    bookkeeper_.write(result_.ledger);
    if (result_.impact) scale_published(result_.ledger.scale, *result_.impact);
    loops_.write(result_);
    watches_.write(result_);
  }

 private:
  // The servicer's initial state, and the targets where they are at the start.
  void place() {
    const TargetPlan targets = plan_targets(problem_);
    state_ = initial_servicer_state(problem_, system_);
    for (std::size_t t = 0; t < problem_.targets.size(); ++t) {
      const int body = system_.model.frames()[system_.target_frames[t]].body;
      set_root_pose(system_.model, body, targets.start[t].X_WT, state_);
      set_root_twist(system_.model, body, targets.start[t].V_WT, state_);
    }
    control_.approaching = problem_.approach.has_value();
    control_.settled.assign(system_.robot_joints.size(), false);
    control_.hold.assign(system_.robot_joints.size(), 0);
    if (!problem_.approach) return;
    ApproachPlan plan = plan_approach(problem_, targets);
    result_.plan = plan.report;
    for (const std::string& warning : plan.warnings) result_.warnings.push_back(warning);
    if (!plan.failure.empty()) throw Failure(plan.failure);
    trajectories_ = std::move(plan.joints);
  }

  const Body& joint_body(const CaptureSystem& system, std::size_t joint) const {
    return system.model.bodies()[system.model.joints()[system.robot_joints[joint]]];
  }

  // --- Motion ---

  // The first piece of a phase has its plain name.
  std::string next_name(const std::string& phase) {
    const int count = ++pieces_[phase];
    return count == 1 ? phase : fmt::format("{}_{}", phase, count);
  }

  bool holds_by(PostImpactSetup::Joints joints) const {
    return problem_.post_impact && problem_.post_impact->joints == joints;
  }

  // What joints are to follow, for the record.
  std::vector<JointTrajectory> references() const {
    std::vector<JointTrajectory> joints;
    if (!control_.approaching) return joints;
    joints = trajectories_;
    for (std::size_t j = 0; j < joints.size(); ++j) {
      if (control_.settled[j]) joints[j] = JointTrajectory::at_rest(control_.hold[j]);
    }
    return joints;
  }

  // Moves the present system on to the time `end` or until `stop` says so, and records it. Whether it was stopped.
  bool integrate(const std::string& phase, double end, const StopCondition& stop) {
    const double duration = end - time_;
    const std::string name = next_name(phase);
    const bool pd = holds_by(PostImpactSetup::Joints::pd);
    const bool controlled = control_.approaching || pd || problem_.post_impact->base_control.has_value();
    const bool cut = control_.approaching ? problem_.approach->tracking.mode != TrackingSetup::Mode::ideal : pd;
    PhaseDynamics dynamics(system_.model, segment_setup(problem_, system_, state_, trajectories_, control_));
    const std::vector<JointTrajectory> reference = references();
    recorder_.begin_phase(name, reference);
    bookkeeper_.begin_phase(controlled);
    watches_.begin_phase(name, system_, cut);
    loops_.begin_phase(name, problem_, system_);
    Kinematics kinematics(system_.model);
    // The books look at least so often, however few samples are to be kept: scales are maxima over time.
    constexpr double kLeastLooks = 32;
    const bool any_interval = problem_.output_interval > 0;
    const double interval = any_interval ? problem_.output_interval : duration;
    // A power of two, so that the samples' times are exact multiples of the interval.
    const double wanted = std::log2(std::clamp(kLeastLooks * interval / duration, 1.0, 0x1p40));
    const long looks = stop ? 1 : 1L << std::lround(std::ceil(wanted));
    long look = 0;
    std::vector<double> motor(system_.model.joints().size());
    const auto observe = [&](PhaseSample sample) {
      forward_kinematics(system_.model, sample.state, kinematics);
      const SystemBooks books = system_books(system_.model, kinematics, sample.state);
      bookkeeper_.sample(books, sample.integrals);
      std::copy(sample.motor.begin(), sample.motor.end(), motor.begin());
      const std::vector<GripSample> grips = loops_.sample(sample, kinematics, motor);
      sample.motor = motor;
      watches_.sample(sample);
      if (look++ % looks == 0 || sample.time == end) recorder_.sample(system_, kinematics, books, sample, grips);
      if (progress_) progress_(name, sample.time, end);
    };
    // Joints that follow a reference exactly are on it from the first instant on.
    state_ = dynamics.unprojected_state(time_, dynamics.initial(state_, time_));
    const PhaseOutcome outcome = simulate_phase(dynamics, state_, time_, end, interval / static_cast<double>(looks),
                                                tolerances_for(dynamics, duration, controlled), observe, stop);
    result_.cost.push_back({name, outcome.rhs_evaluations, outcome.steps, outcome.rejected,
                            outcome.momentum_mended.linear, outcome.momentum_mended.angular});
    loops_.end_phase(outcome.loops);
    if (!outcome.finished) throw Failure(fmt::format("{}: {}", name, outcome.failure));
    recorder_.end_phase(outcome.integrals);
    bookkeeper_.end_phase(outcome.integrals);
    watches_.end_phase();
    state_ = outcome.end_state;
    time_ = outcome.end_time;
    return outcome.stopped;
  }

  // What acts from outside is integrated, not recovered from conserved momenta, and integration errors of the impulse
  // show in the ledger at full size: such phases take tolerances a tenth of the others'.
  IntegrationSetup tolerances_for(const PhaseDynamics& dynamics, double duration, bool controlled) const {
    IntegrationSetup integration = problem_.integration;
    // Dense output is of order 7: over the long steps of a smoothly driven motion the work between steps would miss its
    // bound.
    constexpr double kLeastSteps = 100;
    if (integration.max_step == 0 && controlled) integration.max_step = duration / kLeastSteps;
    if (!dynamics.is_disturbed()) return integration;
    integration.relative_tolerance = std::max(1e-14, 0.1 * integration.relative_tolerance);
    integration.absolute_tolerance *= 0.1;
    return integration;
  }

  void approach() {
    const ApproachSetup& setup = *problem_.approach;
    result_.approach_start = describe(problem_, system_, state_, time_);
    if (setup.base_control) control_.attitude = attitude_control(*setup.base_control, system_, state_).R_WD;
    fly("approach", setup.duration);
    result_.approach_end = describe(problem_, system_, state_, time_);
  }

  void post_impact() {
    const PostImpactSetup& post = *problem_.post_impact;
    control_.attitude.reset();
    if (post.base_control) control_.attitude = attitude_control(*post.base_control, system_, state_).R_WD;
    post_start_ = time_;
    fly("post_impact", time_ + post.duration);
    result_.post_impact_end = describe(problem_, system_, state_, time_);
  }

  // From event to event: grips that close at stated times or on arrival, and grips that let go.
  void fly(const std::string& phase, double until) {
    while (time_ < until) {
      close(schedule_.arrived(system_, state_));
      close(schedule_.due_at(time_));
      if (ends_by_envelope() && schedule_.together_in_envelopes(system_, state_)) return;
      const StopCondition stop = schedule_.stop_condition(system_, ends_by_envelope());
      const bool stopped = integrate(phase, next_event(until), stop);
      if (!stopped) release_due();
    }
    if (control_.approaching) return;  // what is due at its end closes with the others
    close(schedule_.arrived(system_, state_));
    close(schedule_.due_at(time_));
  }

  // --- When grips close ---

  bool ends_by_envelope() const {
    return control_.approaching && problem_.approach->capture_at == ApproachSetup::CaptureAt::envelope;
  }

  double next_event(double until) const {
    double next = until;
    const auto consider = [&](double t) {
      if (t > time_ && !GripSchedule::is_now(t, time_) && t < next) next = t;
    };
    for (double t : schedule_.stated_times()) consider(t);
    if (!control_.approaching) {
      for (const PostImpactSetup::Release& release : problem_.post_impact->releases)
        consider(post_start_ + release.after);
    }
    return GripSchedule::is_now(next, until) ? until : next;
  }

  // Whether something follows the approach's end.
  bool goes_on() const { return problem_.impact && problem_.post_impact && (!grips_.empty() || schedule_.any_left()); }

  // Decides on grips, and lets those that fit close: at once, in one impact. Whether any did.
  bool close(const std::vector<std::size_t>& grasps) {
    const std::vector<std::size_t> closing = schedule_.decide(grasps, system_, state_, time_);
    if (closing.empty() || !problem_.impact) return false;
    impact(closing);
    return true;
  }

  // --- What joints do once their arm holds a target ---

  void settle(std::size_t joint) {
    control_.settled[joint] = true;
    control_.hold[joint] = state_.q[joint_body(system_, joint).q];
  }
  void settle_all() {
    control_.approaching = false;
    for (std::size_t j = 0; j < control_.settled.size(); ++j) settle(j);
  }
  // The joints between the base and an end-effector, in the approach.
  void settle_arm(std::size_t grasp) {
    const Model& model = system_.model;
    int body = model.frames()[model.frame_index(problem_.grasps[grasp].end_effector)].body;
    for (; body >= 0; body = model.bodies()[body].parent) {
      for (std::size_t j = 0; j < control_.settled.size(); ++j) {
        if (model.joints()[system_.robot_joints[j]] == body) settle(j);
      }
    }
  }

  // Joints that follow a trajectory exactly keep its rate through an impact.
  std::vector<HeldRate> driven_rates() const {
    std::vector<HeldRate> held;
    if (!control_.approaching || problem_.approach->tracking.mode != TrackingSetup::Mode::ideal) return held;
    for (std::size_t j = 0; j < control_.settled.size(); ++j) {
      const int v = joint_body(free_, j).v;
      if (!control_.settled[j]) held.push_back({v, state_.v[v]});
    }
    return held;
  }

  // --- Impacts ---

  // A sample outside any integration: just before and just after the impact.
  void sample_contact() {
    const std::vector<double> zeros(system_.model.joints().size(), 0.0);
    const Kinematics kinematics = forward_kinematics(system_.model, state_);
    const SystemBooks books = system_books(system_.model, kinematics, state_);
    const PhaseIntegrals none;
    bookkeeper_.instant(books);
    recorder_.sample(system_, kinematics, books, {time_, state_, none, zeros, zeros});
  }

  Momentumd momentum_about_origin(const State& state) const {
    return momentum_about(free_.model, forward_kinematics(free_.model, state), Vector3d::zero());
  }

  // The problem with some of its grasps.
  CaptureProblem with_grasps(const std::vector<std::size_t>& grasps) const {
    CaptureProblem problem = problem_;
    problem.grasps.clear();
    for (std::size_t i : grasps) problem.grasps.push_back(problem_.grasps[i]);
    return problem;
  }

  // The contact of the grips that close, by the rule for gaps, after those that hold already.
  Contact contact_of(const std::vector<std::size_t>& closing) {
    std::vector<bool> held(problem_.targets.size(), false);
    for (const HeldGrip& grip : grips_) held[target_index(problem_, problem_.grasps[grip.grasp].target)] = true;
    const Contact fresh = make_contact(with_grasps(closing), free_, state_, held);
    if (!fresh.refused.empty()) {
      schedule_.refuse(closing, "contact refused: " + fresh.refused);
      throw Failure("contact refused: " + fresh.refused);
    }
    Contact contact = fresh;
    contact.gaps.clear(), contact.displacement.clear(), contact.grasps.clear();
    const Kinematics k = forward_kinematics(free_.model, fresh.state);
    const std::vector<GraspGap> gaps = grasp_gaps(problem_, free_, k);
    for (const HeldGrip& grip : grips_) {
      contact.gaps.push_back(gaps[grip.grasp]);
      contact.displacement.push_back(Vector3d::zero());
      contact.grasps.push_back(grasp_of(grip, k));
    }
    for (std::size_t i = 0; i < closing.size(); ++i) {
      contact.gaps.push_back(fresh.gaps[i]);
      contact.displacement.push_back(fresh.displacement[i]);
      contact.grasps.push_back(fresh.grasps[i]);
    }
    return contact;
  }

  // Sizes fit by construction, so what the solver refuses are numbers: inertias that span more than doubles resolve.
  ImpactOutcome solve_impact(const std::vector<std::size_t>& closing, const Contact& contact) const {
    std::vector<std::size_t> all;
    for (const HeldGrip& grip : grips_) all.push_back(grip.grasp);
    all.insert(all.end(), closing.begin(), closing.end());
    try {
      return run_impact(with_grasps(all), free_, contact, time_, grips_.size(), driven_rates());
    } catch (const std::invalid_argument& error) {
      throw Failure(
          fmt::format("impact at t = {:.6g} s: the system is numerically singular ({})", time_, error.what()));
    }
  }

  // Grips close: in the free system, where those that hold already are constraints like the new ones.
  void impact(const std::vector<std::size_t>& closing) {
    recorder_.begin_phase(next_name("contact"));
    if (control_.approaching) {
      for (std::size_t i : closing) settle_arm(i);
    }
    to_free();
    const Contact contact = contact_of(closing);
    // Before any sample there is nothing yet that a target put elsewhere could break.
    if (!result_.series.time.empty())
      bookkeeper_.enter(momentum_about_origin(contact.state) - momentum_about_origin(state_));
    state_ = contact.state;
    sample_contact();

    ImpactOutcome outcome = solve_impact(closing, contact);
    bookkeeper_.enter(outcome.from_ground);
    impacts_.note(outcome.solution);
    state_ = outcome.after;
    const Kinematics k = forward_kinematics(free_.model, state_);
    for (std::size_t i : closing) grips_.push_back(close_grip(problem_, free_, k, i));
    outcome.report.brake = brake(contact.grasps);
    if (result_.impact) {
      result_.later_impacts.push_back(std::move(outcome.report));
    } else {
      result_.impact = std::move(outcome.report);
    }
    to_joined();
    sample_contact();
  }

  // Between the representations: all targets free, or hanging on the arms that hold them.
  void to_free() {
    if (system_.grips.empty()) return;
    state_ = take_apart(free_, system_, state_);
    system_ = free_;
  }
  void to_joined() {
    if (grips_.empty()) return;
    CapturedSystem joined = join_targets(free_, state_, grips_);
    system_ = std::move(joined.system);
    state_ = std::move(joined.state);
  }

  // Settled joints stop at once, if they are braked. In the free system.
  std::optional<BrakeReport> brake(std::span<const Grasp> grasps) {
    if (!holds_by(PostImpactSetup::Joints::braked)) return {};
    std::vector<std::size_t> joints, holding;
    for (std::size_t j = 0; j < control_.settled.size(); ++j) {
      if (control_.settled[j]) joints.push_back(j);
    }
    for (const HeldGrip& grip : grips_) holding.push_back(grip.grasp);
    BrakeOutcome outcome = run_brake(with_grasps(holding), free_, state_, grasps, joints, driven_rates());
    bookkeeper_.enter(outcome.from_ground);
    impacts_.note_brake(outcome.energy_identity_residual);
    state_ = std::move(outcome.after);
    return outcome.report;
  }

  // Joints that settle while no grip closes still have to stop, if they are braked.
  void stop_joints() {
    if (!holds_by(PostImpactSetup::Joints::braked)) return;
    to_free();
    const Kinematics k = forward_kinematics(free_.model, state_);
    std::vector<Grasp> grasps;
    for (const HeldGrip& grip : grips_) grasps.push_back(grasp_of(grip, k));
    brake(grasps);
    to_joined();
  }

  void release_due() {
    if (control_.approaching) return;
    for (const PostImpactSetup::Release& release : problem_.post_impact->releases) {
      if (!GripSchedule::is_now(post_start_ + release.after, time_)) continue;
      ReleaseReport report;
      report.time = time_;
      to_free();
      std::erase_if(grips_, [&](const HeldGrip& grip) {
        const GraspSetup& g = problem_.grasps[grip.grasp];
        const auto& named = release.end_effectors;
        if (!named.empty() && std::find(named.begin(), named.end(), g.end_effector) == named.end()) return false;
        report.end_effectors.push_back(g.end_effector);
        report.targets.push_back(g.target);
        schedule_.release(grip.grasp, time_);
        return true;
      });
      to_joined();
      if (!report.end_effectors.empty()) result_.releases.push_back(std::move(report));
    }
  }

  const CaptureProblem& problem_;
  const CaptureProgress& progress_;
  CaptureResult& result_;
  const CaptureSystem free_;  // all targets free
  CaptureSystem system_;      // as it is now
  Recorder recorder_;
  Bookkeeper bookkeeper_;
  Watches watches_;
  LoopBook loops_;
  ImpactBook impacts_;
  GripSchedule schedule_;
  std::vector<JointTrajectory> trajectories_;  // of the approach, per robot joint
  SegmentControl control_;
  std::vector<HeldGrip> grips_;        // that hold now, in the free system's bodies
  std::map<std::string, int> pieces_;  // of phases, by name
  State state_;
  double time_ = 0;
  double post_start_ = 0;
};

}  // namespace

CaptureResult simulate_capture(const CaptureProblem& problem, const CaptureProgress& progress) {
  CaptureResult result;
  result.scenario_name = problem.name;
  result.scenario_sha256 = problem.sha256;
  result.status = CaptureStatus::failed;
  Run run(problem, progress, result);
  try {
    run.simulate();
    result.status = CaptureStatus::completed;
  } catch (const CaptureProblemError&) {
    throw;
  } catch (const std::runtime_error& error) {
    result.failure = error.what();
  }
  run.close_books();
  return result;
}

}  // namespace grapnel
