#include "grapnel/capture/phase_segment.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "grapnel/capture/motion_phases.hpp"
#include "grapnel/capture/replanning.hpp"

namespace grapnel {
namespace {

// Minimum number of conservation samples per phase, independent of recorded samples: scales are maxima over time.
constexpr double kMinimumChecks = 32;
// Minimum number of samples for a SafetyMonitor that evaluates ends of steps without dense output.
constexpr double kMinWatched = 64;

// Whether any joint dissipates energy, or holds its position.
bool has_damping(const Model& model) {
  return std::any_of(model.bodies().begin(), model.bodies().end(), [](const Body& body) {
    const JointDescription& joint = body.description.joint;
    return joint.friction.viscous > 0 || joint.friction.coulomb > 0 || joint.spring.has_value();
  });
}

// The speed that a load alone gives a tree [m/s; rad/s times its radius of gyration].
double speed_by(const ExternalLoad& load, const GroupSize<double>& tree, double duration) {
  Wrenchd F = load.amplitude;
  for (const Wrenchd& value : load.profile.values) {
    F.linear = norm(value.linear) > norm(F.linear) ? value.linear : F.linear;
    F.angular = norm(value.angular) > norm(F.angular) ? value.angular : F.angular;
  }
  double force = norm(F.linear);
  if (load.stream) force += load.stream->pressure * load.stream->area;
  const bool is_sine = load.profile.shape == LoadProfile::Shape::sine;
  const double time = is_sine ? std::min(duration, 1 / (2 * M_PI * load.profile.frequency)) : duration;
  const double radius = std::sqrt(tree.second_moment / tree.mass);
  return (force + norm(F.angular) / radius) * time / tree.mass;
}

// The speed of the slowest moving tree, from its initial motion and the loads on it, but at least the rounding error of
// the fastest one's [m/s]; zero if nothing moves.
double slowest_speed(const PhaseDynamics& dynamics, const State& start, double duration) {
  constexpr double kTenRoundings = 2e-4;  // relative to a tolerance of 1e-11
  const Model& model = dynamics.model();
  const ConservedQuantities at_start = conserved_quantities(model, forward_kinematics(model, start), start);
  const std::vector<int> tree_of = trees_of_bodies(model);
  double slowest = std::numeric_limits<double>::infinity(), fastest = 0;
  for (std::size_t t = 0; t < at_start.trees.size(); ++t) {
    const GroupSize<double>& size = at_start.trees[t].size;
    double speed = std::sqrt(2 * size.energy / size.mass);
    speed = std::max(speed, norm(dynamics.setup().gravity) * duration);
    for (const ExternalLoad& load : dynamics.setup().loads) {
      if (tree_of[load.body] == static_cast<int>(t)) speed = std::max(speed, speed_by(load, size, duration));
    }
    if (speed > 0) slowest = std::min(slowest, speed);
    fastest = std::max(fastest, speed);
  }
  return fastest > 0 ? std::max(slowest, kTenRoundings * fastest) : 0;
}

// Absolute tolerance for a motion so slow that the usual one would dominate its energy; at most the usual one. Drives
// and springs convert rounding errors of positions to accelerations, so values below `least` have no benefit.
double for_slow_motion(double absolute_tolerance, double relative_tolerance, double speed, double least) {
  constexpr double kShare = 10;  // relative to the relative tolerance
  const double wanted = std::max(kShare * relative_tolerance * speed, least);
  if (!(speed > 0) || wanted >= absolute_tolerance) return absolute_tolerance;
  return std::pow(10, std::floor(std::log10(wanted)));  // cases in lanes share one tolerance
}

// Tolerances of a motion segment. External effects are integrated, not recovered from conserved momenta, and
// integration errors of the impulse appear in the ledger in full: such phases use a tenth of the tolerances. A motion
// that is slow throughout has tolerances relative to its speed, so that it meets the ledger's relative bounds on energy
// at any speed.
IntegrationSetup tolerances_for(const IntegrationSetup& requested, const PhaseDynamics& dynamics, const State& start,
                                double duration, bool controlled) {
  IntegrationSetup integration = requested;
  // Dense output is of order 7: over the long steps of a smoothly driven motion the error of the work would exceed its
  // bound.
  constexpr double kMinSteps = 100;
  if (integration.max_step == 0 && controlled) integration.max_step = duration / kMinSteps;
  if (dynamics.is_disturbed()) {
    integration.relative_tolerance = std::max(1e-14, 0.1 * integration.relative_tolerance);
    integration.absolute_tolerance *= 0.1;
    if (!dynamics.setup().slips.empty()) {  // the wrench turns within the slip resolution
      integration.relative_tolerance = std::min(integration.relative_tolerance, 1e-13);
      integration.absolute_tolerance = std::min(integration.absolute_tolerance, 1e-14);
    }
  } else if (!controlled) {
    // Its energy is conserved, without correction. The steps are long and few: the ledger's bound of 1e-10 costs
    // little, independent of the tolerance that suffices for driven motion. Arms that swing in a closed loop cost more.
    const bool in_loop = dynamics.loops() != nullptr;
    const double free = in_loop ? 1e-12 : 1e-11;
    // Loops pass near singular configurations, where every fifth step was rejected; for damped motion prediction costs
    // steps (docs/performance.md).
    integration.predictive = in_loop && !has_damping(dynamics.model());
    integration.relative_tolerance = std::min(integration.relative_tolerance, free);
    integration.absolute_tolerance = std::min(integration.absolute_tolerance, free);
  }
  // Near an orbit, rounding errors of positions exceed the possible gain.
  if (dynamics.setup().orbit || (controlled && !dynamics.is_disturbed())) return integration;
  const bool pulls_back = controlled || has_damping(dynamics.model()) || dynamics.loops() != nullptr;
  const double least = pulls_back ? 1e-16 : 1e-20;
  integration.absolute_tolerance = for_slow_motion(integration.absolute_tolerance, integration.relative_tolerance,
                                                   slowest_speed(dynamics, start, duration), least);
  return integration;
}

// The time at which the current motion must stop next: grasps close at stated times or, after the impact, open.
double next_event(const CaptureRun& run, const MotionPhase& phase) {
  const double now = run.bodies.time;
  double next = phase.end;
  const auto consider = [&](double t) {
    if (t > now && !GraspSchedule::is_now(t, now) && t < next) next = t;
  };
  for (double t : run.schedule.stated_times()) consider(t);
  for (double t : run.pauses) consider(t);
  consider(run.joints.approaching() ? next_replanning(run, now) : run.identification.next_event());
  if (!run.joints.approaching()) {
    for (const PostImpactSetup::Release& release : run.problem.post_impact->releases)
      consider(phase.begin + release.after);
  }
  return GraspSchedule::is_now(next, phase.end) ? phase.end : next;
}

// Why a segment must be integrated here; empty: it may be integrated elsewhere.
std::string reason_for_here(const CaptureRun& run, const PhaseSetup& setup) {
  if (run.monitor.records()) return "it is recorded";
  if (run.monitor.seeks_loads()) return "loads are monitored";
  if (setup.contacts) return "contacts between shapes";
  if (run.monitor.inspects_steps()) return "plumes, or gyros, are watched in every step";
  if (run.law.works()) return "a law moves the joints together";
  if (std::ranges::any_of(run.bodies.held,
                          [&](const HeldGrasp& held) { return run.problem.grasps[held.grasp].holds.has_value(); }) ||
      !run.bodies.slips.empty())
    return "grasps with limits";
  if (!run.bodies.system.closures.empty()) {
    if (setup.closures.empty()) return "loops are cut";
    // Loads of braked joints depend on the loads of the grasps, which are computed only at samples.
    const auto is_prescribed = [](const JointDrive& drive) {
      return output_of(drive.control) == ControlOutput::motion;
    };
    if (run.monitor.watches_efforts() && std::any_of(setup.drives.begin(), setup.drives.end(), is_prescribed))
      return "efforts of joints that move as prescribed in closed loops are watched";
  }
  return {};
}

std::vector<SlipParts> moved_slips(const RunBodies& bodies) {
  std::vector<SlipParts> moved;
  for (const RunSlip& slip : bodies.slips) moved.push_back(slip.moved);
  return moved;
}

// Outcome of a segment => reports of the slips in it.
void note_slips(CaptureRun& run, const HoldWatch& holds, const PhaseOutcome& outcome) {
  for (std::size_t i = 0; i < run.bodies.slips.size(); ++i) {
    RunSlip& slip = run.bodies.slips[i];
    const SlipIntegrals& more = outcome.integrals.slips.at(i);
    SlipReport& report = run.result.slips[slip.report];
    report.until = outcome.end_time;
    report.energy += more.friction, report.distance += more.distance, report.angle += more.angle;
    slip.moved = holds.moved()[i];
    const Kinematics k = forward_kinematics(run.bodies.system.model, outcome.end_state);
    const SlipDisplacement by = displacement_of(run.bodies.system.slips[i].slip, k);
    run.schedule.note_slip(slip.grasp.grasp, by.distance, by.angle);
  }
}

// Adds the cost of the first part to that of the whole.
void add_part(const PhaseOutcome& first, PhaseOutcome& whole) {
  whole.rhs_evaluations += first.rhs_evaluations;
  whole.steps += first.steps;
  whole.rejected += first.rejected;
  whole.implicit_steps += first.implicit_steps;
  whole.implicit_spans.insert(whole.implicit_spans.begin(), first.implicit_spans.begin(), first.implicit_spans.end());
  whole.quaternion_defect = std::max(whole.quaternion_defect, first.quaternion_defect);
  whole.loops.rank = first.loops.rank;
  whole.loops.unprojected.raise(first.loops.unprojected);
  whole.loops.correction_total += first.loops.correction_total;
  whole.loops.integration_error += first.loops.integration_error;
}

}  // namespace

bool ends_in_envelopes(const CaptureRun& run) {
  return run.joints.approaching() && run.problem.approach->capture_at == ApproachSetup::CaptureAt::envelope;
}

// --- Preparation ---

namespace {

// The drives of the piece that begins; joints whose law ended with the release of its target are held at their
// positions.
PhaseSetup setup_of_segment(CaptureRun& run) {
  const RunBodies& bodies = run.bodies;
  if (run.law.ends_by_release(bodies.system, bodies.time) && !run.joints.approaching()) run.joints.settle_all(bodies);
  run.identification.begin_segment(bodies.system, bodies.time);
  const std::shared_ptr<const Model> law_model = run.identification.law_model(bodies.system);
  run.joints.obey(
      run.law.begin_segment(bodies.system, bodies.state, run.joints.known_posture(bodies), bodies.time, law_model));
  PhaseSetup setup = run.joints.setup(bodies);
  setup.law_model = law_model;
  setup.contacts = run.contacts.in(bodies.system);
  setup.sensors = run.sensors;
  if (run.sensors) run.sensors->begin_segment(bodies.system);
  return setup;
}

// Falls to zero when a grasp closes on arrival or because its target is settled; empty: none may.
StopCondition closing_condition(CaptureRun& run) {
  StopCondition arrival = run.schedule.stop_condition(run.bodies.system, ends_in_envelopes(run));
  StopCondition settling = run.monitor.stages().stop_condition(run.schedule.awaited_targets());
  if (!arrival || !settling) return arrival ? std::move(arrival) : std::move(settling);
  return [arrival = std::move(arrival), settling = std::move(settling)](double t, const State& state) {
    return std::min(arrival(t, state), settling(t, state));
  };
}

}  // namespace

// Run, phase => task from the current time to the next event, with observers begun. The stop condition is the minimum
// of the law's margin, arrival in envelopes and the phase's condition; prescribed joints start on their reference.
PhaseSegment::PhaseSegment(CaptureRun& run, const MotionPhase& phase)
    : run_(run),
      observed_(true),
      dynamics_(run.bodies.system.model, setup_of_segment(run)),
      holds_(run.problem, run.bodies.system, moved_slips(run.bodies)),
      arrival_(closing_condition(run)),
      condition_(phase_condition(run, run.bodies.system)),
      stop_(arrival_) {
  RunBodies& bodies = run.bodies;
  RunMonitor& monitor = run.monitor;
  if (run.law.works() || condition_) {
    stop_ = [this](double t, const State& state) {
      double least = std::numeric_limits<double>::infinity();
      if (run_.law.works()) least = run_.law.margin(t, state);
      if (arrival_) least = std::min(least, arrival_(t, state));
      if (condition_) least = std::min(least, condition_(t, state));
      return least;
    };
  }
  const double end = next_event(run, phase);
  const std::string name = run.next_name(phase.name);
  const bool controlled = run.joints.are_controlled();
  monitor.begin_phase({name, bodies.system, dynamics_, controlled, run.joints.efforts_are_cut(), run.schedule.opened(),
                       bodies.time, run.law.works(), !run.joints.approaching()});
  // Joints that follow a reference exactly are on it from the first instant on.
  bodies.state = dynamics_.on_references(bodies.state, bodies.time);
  describe(name, end, controlled);
  task_.only_here = reason_for_here(run, dynamics_.setup());
  task_.stop = stop_;
  if (!task_.only_here.empty() || !monitor.watches()) return;
  if (monitor.watches_closely()) task_.longest_look = (end - bodies.time) / kMinWatched;
  task_.watch = [this](double t, const State& state, std::span<const double> motor) {
    watched_elsewhere_ = true;
    run_.monitor.watch(t, state, motor);
  };
}

PhaseSegment::PhaseSegment(CaptureRun& run)
    : run_(run),
      observed_(false),
      dynamics_(run.bodies.system.model, run.joints.exact_approach(run.bodies)),
      holds_(run.problem, run.bodies.system, moved_slips(run.bodies)) {
  describe("approach", run.problem.approach->duration, true);
}

void PhaseSegment::describe(const std::string& name, double end, bool controlled) {
  const RunBodies& bodies = run_.bodies;
  task_.phase = name;
  task_.model = &bodies.system.model, task_.setup = &dynamics_.setup();
  task_.start = bodies.state;
  task_.begin = bodies.time, task_.end = end;
  task_.integration = tolerances_for(run_.problem.integration, dynamics_, bodies.state, end - bodies.time, controlled);
}

// --- Integration ---

void PhaseSegment::take(PhaseOutcome outcome, const PhaseMeasures& measures) {
  note(outcome, measures);
  elsewhere_ = std::move(outcome);
}

void PhaseSegment::take_part(PhaseOutcome outcome, const PhaseMeasures& measures, double next_step) {
  note(outcome, measures);
  resumed_ = PhaseResumption{task_.begin, outcome.integrals, next_step};
  elsewhere_ = std::move(outcome);
}

// Takes a phase that was integrated and observed elsewhere.
void PhaseSegment::note(const PhaseOutcome& outcome, const PhaseMeasures& measures) {
  if (!task_.only_here.empty())
    throw std::logic_error("a motion segment that must be integrated by the run itself: " + task_.only_here);
  if (observed_) run_.monitor.take(measures);
  run_.monitor.note_check(outcome.end_time);
}

// Prepared segment => state and time at its end, taken from elsewhere or integrated here; true if it ended at its
// planned time, false at a stop condition. Throws RunFailure if the integration failed.
bool PhaseSegment::await_resume() {
  const PhaseOutcome outcome = elsewhere_ && !resumed_ ? *std::move(elsewhere_) : integrate();
  if (observed_) run_.monitor.end_phase(outcome);
  if (!outcome.finished) {
    std::string why = fmt::format("{}: {}", task_.phase, outcome.failure);
    if (run_.joints.approaching()) {
      for (const std::string& gains : run_.unstable_gains) why += "; " + gains;
    }
    throw RunFailure(why);
  }
  run_.bodies.state = outcome.end_state;
  run_.bodies.time = outcome.end_time;
  run_.identification.end_segment(outcome.integrals);
  note_events(outcome);
  return !outcome.stopped;
}

// Outcome => which of the stop conditions ended the segment: the smallest. Notes largest loads of grasps.
void PhaseSegment::note_events(const PhaseOutcome& outcome) {
  const bool stopped = outcome.stopped;
  const double arrival = stopped && arrival_ ? arrival_(outcome.end_time, outcome.end_state) : 1.0;
  const double condition = stopped && condition_ ? condition_(outcome.end_time, outcome.end_state) : 1.0;
  const double load = stopped ? holds_.last_margin() : 1.0;
  const double least = std::min({arrival, condition, load});
  const bool law_is_over = run_.law.end_segment(outcome.end_state, outcome.end_time, stopped, least);
  run_.condition_met = stopped && condition_ && !law_is_over && condition <= least;
  if (law_is_over && !run_.joints.approaching()) run_.joints.settle_all(run_.bodies);
  for (const HoldLoad& peak : holds_.largest()) run_.schedule.note_load(peak);
  note_slips(run_, holds_, outcome);
  if (stopped && holds_.any() && !law_is_over && !run_.condition_met && load <= least)
    run_.overloads = {holds_.at_limit(), holds_.at_rest(), holds_.slipped_out()};
}

PhaseOutcome PhaseSegment::integrate() {
  if (watched_elsewhere_ && !resumed_) run_.monitor.restart_watch();
  PhaseOutcome outcome =
      observed_ && run_.monitor.needs_samples() ? integrate_with_samples() : integrate_between_checks();
  if (resumed_) add_part(*elsewhere_, outcome);
  return outcome;
}

// The progress callback after each step.
std::function<void(double)> PhaseSegment::each_step() const {
  if (!run_.progress) return {};
  return [this](double t) { run_.progress(task_.phase, t, task_.end); };
}

// The observers of each step.
StepProbe PhaseSegment::probe() {
  StepProbe loads = run_.monitor.load_probe();
  if (!run_.law.works() && !holds_.any()) return loads;
  return [this, loads](const PhaseStep& step) {
    if (loads) loads(step);
    if (holds_.any()) holds_.step(step);
    if (run_.law.works()) run_.law.step(step);
  };
}

// The margin of the grasps' limits; empty without limits.
LoadCondition PhaseSegment::load_condition() {
  if (!holds_.any()) return {};
  return [this](const PhaseSample& sample) { return holds_.margin(sample); };
}

// The segment without the part that was integrated elsewhere.
PhaseInterval PhaseSegment::remaining_interval(const OutputGrid& outputs) const {
  if (resumed_) return {elsewhere_->end_state, elsewhere_->end_time, task_.end, outputs};
  return {task_.start, task_.begin, task_.end, outputs};
}

// Segment => outcome without samples for output: conservation checks at ends of steps, at least kMinimumChecks of them.
PhaseOutcome PhaseSegment::integrate_between_checks() {
  StepWatch watch;
  watch.checks = static_cast<int>(kMinimumChecks);
  watch.each_step = each_step();
  if (observed_) {
    watch.check = [&](double t, const State& state, const PhaseIntegrals& integrals) {
      run_.monitor.check(t, state, integrals);
    };
    watch.probe = probe();
    watch.impact = run_.monitor.impact_probe();
  }
  return simulate_phase(dynamics_, remaining_interval(0), task_.integration,
                        {.watch = watch, .stop = stop_, .stop_on_load = load_condition(), .resumed = resumed_});
}

// Segment => outcome with samples at the output interval. Without a stop condition the grid is refined by a power of
// two to at least kMinimumChecks checks per segment; only instants of the output grid and both ends are recorded.
PhaseOutcome PhaseSegment::integrate_with_samples() {
  const double end = task_.end, duration = end - task_.begin;
  const bool any_interval = run_.problem.output_interval > 0;
  const double interval = any_interval ? run_.problem.output_interval : duration;
  // A power of two, so that instants of the finer grid are bit-identical to instants of the grid of the time series.
  const double wanted = std::log2(std::clamp(kMinimumChecks * interval / duration, 1.0, 0x1p40));
  const long checks = stop_ || holds_.any() ? 1 : 1L << std::lround(std::ceil(wanted));
  // The time series has the phase's begin and end, and between them the multiples of the interval since t = 0.
  const double origin = any_interval ? 0 : task_.begin;
  const auto is_on_grid = [&](double t) { return origin + std::round((t - origin) / interval) * interval == t; };
  bool first = true;
  const auto observe = [&](const PhaseSample& sample) {
    run_.monitor.sample(sample, first || checks == 1 || sample.time == end || is_on_grid(sample.time));
    first = false;
  };
  return simulate_phase(dynamics_, remaining_interval({interval / static_cast<double>(checks), origin}),
                        task_.integration,
                        {.observe = observe,
                         .watch = {.each_step = each_step(), .probe = probe(), .impact = run_.monitor.impact_probe()},
                         .stop = stop_,
                         .stop_on_load = load_condition(),
                         .resumed = resumed_});
}

}  // namespace grapnel
