#include "grapnel/capture/simulate_capture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "grapnel/capture/approach_plan.hpp"
#include "grapnel/capture/problem_scene.hpp"
#include "grapnel/capture/run_impacts.hpp"
#include "grapnel/simulate/simulate_phase.hpp"

namespace grapnel {
namespace {

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
      : progress_(progress), run_(problem, result), impacts_(run_) {}

  // `impact_only`: nothing is recorded of the approach, whose joints follow their plan exactly, and nothing follows the
  // impact.
  void simulate(bool impact_only) {
    run_.result.warnings = comparison_warnings(run_.problem);
    place();
    if (run_.problem.approach && impact_only) arrive_as_planned();
    if (run_.problem.approach && !impact_only) approach();
    impacts_.settle_all();
    if (impact_only) {
      impacts_.close(run_.schedule.due_together(run_.time));
      return;
    }
    const bool closed = impacts_.close(run_.schedule.due_together(run_.time));
    if (!goes_on()) return;
    if (!closed) impacts_.stop_joints();
    post_impact();
  }

  void close_books() {
    run_.schedule.write(run_.result);
    run_.impact_book.write(run_.result.ledger);
    run_.bookkeeper.write(run_.result.ledger);
    if (run_.result.impact) scale_published(run_.result.ledger.scale, *run_.result.impact);
    run_.loops.write(run_.result);
    run_.watches.write(run_.result);
  }

 private:
  // The servicer's initial state, and the targets where they are at the start.
  void place() {
    const TargetPlan targets = plan_targets(run_.problem);
    run_.state = initial_servicer_state(run_.problem, run_.system);
    for (std::size_t t = 0; t < run_.problem.targets.size(); ++t) {
      const int body = run_.system.model.frames()[run_.system.target_frames[t]].body;
      set_root_pose(run_.system.model, body, targets.start[t].X_WT, run_.state);
      set_root_twist(run_.system.model, body, targets.start[t].V_WT, run_.state);
    }
    run_.control.approaching = run_.problem.approach.has_value();
    run_.control.settled.assign(run_.system.robot_joints.size(), false);
    run_.control.hold.assign(run_.system.robot_joints.size(), 0);
    if (!run_.problem.approach) return;
    ApproachPlan plan = plan_approach(run_.problem, targets);
    run_.result.plan = plan.report;
    for (const std::string& warning : plan.warnings) run_.result.warnings.push_back(warning);
    if (!plan.failure.empty()) throw RunFailure(plan.failure);
    run_.trajectories = std::move(plan.joints);
  }

  // --- Motion ---

  // What joints are to follow, for the record.
  std::vector<JointTrajectory> references() const {
    std::vector<JointTrajectory> joints;
    if (!run_.control.approaching) return joints;
    joints = run_.trajectories;
    for (std::size_t j = 0; j < joints.size(); ++j) {
      if (run_.control.settled[j]) joints[j] = JointTrajectory::at_rest(run_.control.hold[j]);
    }
    return joints;
  }

  // Moves the present system on to the time `end` or until `stop` says so, and records it. Whether it was stopped.
  bool integrate(const std::string& phase, double end, const StopCondition& stop) {
    const double duration = end - run_.time;
    const std::string name = run_.next_name(phase);
    const bool pd = run_.holds_by(PostImpactSetup::Joints::pd);
    const bool controlled = run_.control.approaching || pd || run_.problem.post_impact->base_control.has_value();
    const bool cut = run_.control.approaching ? run_.problem.approach->tracking.mode != TrackingSetup::Mode::ideal : pd;
    PhaseDynamics dynamics(run_.system.model,
                           segment_setup(run_.problem, run_.system, run_.state, run_.trajectories, run_.control));
    const std::vector<JointTrajectory> reference = references();
    run_.recorder.begin_phase(name, reference);
    run_.bookkeeper.begin_phase(controlled);
    run_.watches.begin_phase(name, run_.system, cut);
    run_.loops.begin_phase(name, run_.problem, run_.system);
    Kinematics kinematics(run_.system.model);
    // The books look at least so often, however few samples are to be kept: scales are maxima over time.
    constexpr double kLeastLooks = 32;
    const bool any_interval = run_.problem.output_interval > 0;
    const double interval = any_interval ? run_.problem.output_interval : duration;
    // A power of two, so that the samples' times are exact multiples of the interval.
    const double wanted = std::log2(std::clamp(kLeastLooks * interval / duration, 1.0, 0x1p40));
    const long looks = stop ? 1 : 1L << std::lround(std::ceil(wanted));
    long look = 0;
    std::vector<double> motor(run_.system.model.joints().size());
    const auto observe = [&](PhaseSample sample) {
      forward_kinematics(run_.system.model, sample.state, kinematics);
      const SystemBooks books = system_books(run_.system.model, kinematics, sample.state);
      run_.bookkeeper.sample(books, sample.integrals);
      std::copy(sample.motor.begin(), sample.motor.end(), motor.begin());
      const std::vector<GripSample> grips = run_.loops.sample(sample, kinematics, motor);
      sample.motor = motor;
      const double clearance = run_.watches.sample(sample);
      if (look++ % looks == 0 || sample.time == end)
        run_.recorder.sample(run_.system, kinematics, books, sample, grips, clearance);
      if (progress_) progress_(name, sample.time, end);
    };
    // Joints that follow a reference exactly are on it from the first instant on.
    run_.state = dynamics.unprojected_state(run_.time, dynamics.initial(run_.state, run_.time));
    const PhaseOutcome outcome =
        simulate_phase(dynamics, run_.state, run_.time, end, interval / static_cast<double>(looks),
                       tolerances_for(dynamics, duration, controlled), observe, stop);
    run_.result.cost.push_back({name, outcome.rhs_evaluations, outcome.steps, outcome.rejected,
                                outcome.momentum_mended.linear, outcome.momentum_mended.angular});
    run_.loops.end_phase(outcome.loops);
    if (!outcome.finished) throw RunFailure(fmt::format("{}: {}", name, outcome.failure));
    run_.recorder.end_phase(outcome.integrals);
    run_.bookkeeper.end_phase(outcome.integrals);
    run_.watches.end_phase();
    run_.state = outcome.end_state;
    run_.time = outcome.end_time;
    return outcome.stopped;
  }

  // What acts from outside is integrated, not recovered from conserved momenta, and integration errors of the impulse
  // show in the ledger at full size: such phases take tolerances a tenth of the others'.
  IntegrationSetup tolerances_for(const PhaseDynamics& dynamics, double duration, bool controlled) const {
    IntegrationSetup integration = run_.problem.integration;
    // Dense output is of order 7: over the long steps of a smoothly driven motion the work between steps would miss its
    // bound.
    constexpr double kLeastSteps = 100;
    if (integration.max_step == 0 && controlled) integration.max_step = duration / kLeastSteps;
    if (!dynamics.is_disturbed()) return integration;
    integration.relative_tolerance = std::max(1e-14, 0.1 * integration.relative_tolerance);
    integration.absolute_tolerance *= 0.1;
    return integration;
  }

  // To the end of the approach in one go.
  void arrive_as_planned() {
    CaptureProblem planned = run_.problem;
    planned.approach->tracking = {};
    if (planned.approach->base_control)
      run_.control.attitude = attitude_control(*planned.approach->base_control, run_.system, run_.state).R_WD;
    PhaseDynamics dynamics(run_.system.model,
                           segment_setup(planned, run_.system, run_.state, run_.trajectories, run_.control));
    const PhaseOutcome outcome = simulate_phase(dynamics, run_.state, 0, run_.problem.approach->duration, 0,
                                                tolerances_for(dynamics, run_.problem.approach->duration, true));
    if (!outcome.finished) throw RunFailure("approach: " + outcome.failure);
    run_.state = outcome.end_state;
    run_.time = outcome.end_time;
    run_.result.approach_end = describe(run_.problem, run_.system, run_.state, run_.time);
  }

  void approach() {
    const ApproachSetup& setup = *run_.problem.approach;
    run_.result.approach_start = describe(run_.problem, run_.system, run_.state, run_.time);
    if (setup.base_control) run_.control.attitude = attitude_control(*setup.base_control, run_.system, run_.state).R_WD;
    fly("approach", setup.duration);
    run_.result.approach_end = describe(run_.problem, run_.system, run_.state, run_.time);
  }

  void post_impact() {
    const PostImpactSetup& post = *run_.problem.post_impact;
    run_.control.attitude.reset();
    if (post.base_control) run_.control.attitude = attitude_control(*post.base_control, run_.system, run_.state).R_WD;
    post_start_ = run_.time;
    fly("post_impact", run_.time + post.duration);
    run_.result.post_impact_end = describe(run_.problem, run_.system, run_.state, run_.time);
  }

  // From event to event: grips that close at stated times or on arrival, and grips that let go.
  void fly(const std::string& phase, double until) {
    while (run_.time < until) {
      impacts_.close(run_.schedule.arrived(run_.system, run_.state));
      impacts_.close(run_.schedule.due_at(run_.time));
      if (ends_by_envelope() && run_.schedule.together_in_envelopes(run_.system, run_.state)) return;
      const StopCondition stop = run_.schedule.stop_condition(run_.system, ends_by_envelope());
      const bool stopped = integrate(phase, next_event(until), stop);
      if (!stopped) impacts_.release_due(post_start_);
    }
    if (run_.control.approaching) return;  // what is due at its end closes with the others
    impacts_.close(run_.schedule.arrived(run_.system, run_.state));
    impacts_.close(run_.schedule.due_at(run_.time));
  }

  // --- When grips close ---

  bool ends_by_envelope() const {
    return run_.control.approaching && run_.problem.approach->capture_at == ApproachSetup::CaptureAt::envelope;
  }

  double next_event(double until) const {
    double next = until;
    const auto consider = [&](double t) {
      if (t > run_.time && !GripSchedule::is_now(t, run_.time) && t < next) next = t;
    };
    for (double t : run_.schedule.stated_times()) consider(t);
    if (!run_.control.approaching) {
      for (const PostImpactSetup::Release& release : run_.problem.post_impact->releases)
        consider(post_start_ + release.after);
    }
    return GripSchedule::is_now(next, until) ? until : next;
  }

  // Whether something follows the approach's end.
  bool goes_on() const {
    return run_.problem.impact && run_.problem.post_impact &&
           (!run_.grips.empty() || run_.rebounded || run_.schedule.any_left());
  }

  const CaptureProgress& progress_;
  RunState run_;
  RunImpacts impacts_;
  double post_start_ = 0;
};

CaptureResult simulate(const CaptureProblem& problem, const CaptureProgress& progress, bool impact_only) {
  CaptureResult result;
  result.scenario_name = problem.name;
  result.scenario_sha256 = problem.sha256;
  result.status = CaptureStatus::failed;
  Run run(problem, progress, result);                  // checks the problem
  if (!impact_only) result.scene = scene_of(problem);  // studies run thousands of impacts and draw none
  try {
    run.simulate(impact_only);
    result.status = CaptureStatus::completed;
  } catch (const CaptureProblemError&) {
    throw;
  } catch (const std::runtime_error& error) {
    result.failure = error.what();
  }
  run.close_books();
  return result;
}

}  // namespace

CaptureResult simulate_capture(const CaptureProblem& problem, const CaptureProgress& progress) {
  return simulate(problem, progress, false);
}

CaptureResult simulate_impact_only(const CaptureProblem& problem) { return simulate(problem, {}, true); }

}  // namespace grapnel
