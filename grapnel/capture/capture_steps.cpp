#include "grapnel/capture/capture_steps.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "grapnel/capture/approach_plan.hpp"
#include "grapnel/capture/conservation_advice.hpp"
#include "grapnel/capture/finite_result.hpp"
#include "grapnel/capture/joint_loads.hpp"
#include "grapnel/capture/problem_scene.hpp"
#include "grapnel/capture/run_impacts.hpp"

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

// The books look at least so often, however few samples are to be kept: scales are maxima over time.
constexpr double kLeastLooks = 32;
// Watches that are shown the ends of steps, without dense output in between, see at least so many.
constexpr double kLeastWatched = 64;

// Tolerances of a piece of motion. What acts from outside is integrated, not recovered from conserved momenta, and
// integration errors of the impulse show in the ledger at full size: such phases take tolerances a tenth of the
// others'.
IntegrationSetup tolerances_for(const IntegrationSetup& asked, const PhaseDynamics& dynamics, double duration,
                                bool controlled) {
  IntegrationSetup integration = asked;
  // Dense output is of order 7: over the long steps of a smoothly driven motion the work between steps would miss its
  // bound.
  constexpr double kLeastSteps = 100;
  if (integration.max_step == 0 && controlled) integration.max_step = duration / kLeastSteps;
  if (dynamics.is_disturbed()) {
    integration.relative_tolerance = std::max(1e-14, 0.1 * integration.relative_tolerance);
    integration.absolute_tolerance *= 0.1;
  } else if (!controlled) {
    // Its energy is conserved and nothing mends it. The steps are long and few: keeping the ledger's bound of 1e-10
    // costs little, whatever tolerance the driven motion is content with.
    constexpr double kFree = 1e-11;
    integration.relative_tolerance = std::min(integration.relative_tolerance, kFree);
    integration.absolute_tolerance = std::min(integration.absolute_tolerance, kFree);
  }
  return integration;
}

}  // namespace

// The phases in their order, with recorder and books kept alongside. Grips close and let go between pieces of motion;
// every piece has the system as it then is.
class CaptureSteps::Sequence {
 public:
  Sequence(const CaptureProblem& problem, const MovingFrame& frame, CaptureDetail detail, CaptureProgress progress,
           Part part, SeriesSink* sink, CaptureResult& result)
      : part_(part), run_(problem, frame, result, detail), impacts_(run_) {
    run_.progress = std::move(progress);
    if (run_.recorder) run_.recorder->stream_to(sink);
  }

  // `impact_only`: nothing is recorded of the approach, whose joints follow their plan exactly, and nothing follows the
  // impact.
  const MotionTask* next() {
    for (;;) {
      switch (stage_) {
        case Stage::beginning:
          stage_ = begin();
          break;
        case Stage::arriving:
          if (run_.time == 0) return arrival();
          run_.result.approach_end = describe_now();
          stage_ = Stage::meeting;
          break;
        case Stage::flying:
          if (fly()) return &task_;
          stage_ = end_flight();
          break;
        case Stage::meeting:
          stage_ = meet();
          break;
        case Stage::over:
          return nullptr;
      }
    }
  }

  void move() {
    if (!dynamics_) throw std::logic_error("CaptureSteps: there is no piece of motion to integrate");
    if (watched_elsewhere_) run_.watches.restart_phase();
    arrive(between_looks_ ? integrate_between_looks() : integrate_with_samples());
  }

  void moved(const PhaseOutcome& outcome, const PhaseMeasures& measures) {
    if (!dynamics_ || !task_.only_here.empty())
      throw std::logic_error("CaptureSteps: a piece of motion that has to be integrated here: " + task_.only_here);
    if (stage_ != Stage::arriving) run_.bookkeeper.take(measures);
    run_.last_look = outcome.end_time;
    arrive(outcome);
  }

  void fail() { stage_ = Stage::over; }

  void close_books() {
    run_.schedule.write(run_.last_look, run_.system, run_.state, run_.result);
    run_.impact_book.write(run_.result.ledger);
    run_.bookkeeper.write(run_.result.ledger);
    if (run_.result.impact) scale_published(run_.result.ledger.scale, *run_.result.impact);
    run_.loops.write(run_.result);
    run_.loads.write(run_.result);
    run_.watches.add(run_.loads.take_events());
    run_.watches.write(run_.result);
    if (!run_.result.ledger.pass()) advise(run_.problem, run_.bookkeeper.cause(), run_.result.ledger);
  }

 private:
  enum class Stage { beginning, arriving, flying, meeting, over };

  // --- The order of things ---

  Stage begin() {
    run_.result.warnings = comparison_warnings(run_.problem);
    place();
    if (!run_.problem.approach) return Stage::meeting;
    if (part_ == Part::impact_only) return Stage::arriving;
    begin_approach();
    return Stage::flying;
  }

  // The approach is over: what closes at its end.
  Stage meet() {
    impacts_.settle_all();
    const bool closed = impacts_.close(run_.schedule.due_together(run_.time));
    if (part_ == Part::impact_only || !goes_on()) return Stage::over;
    if (!closed) impacts_.stop_joints();
    begin_post_impact();
    return Stage::flying;
  }

  Stage end_flight() {
    std::optional<PhaseEnd>& end = run_.control.approaching ? run_.result.approach_end : run_.result.post_impact_end;
    end = describe_now();
    return run_.control.approaching ? Stage::meeting : Stage::over;
  }

  PhaseEnd describe_now() const {
    PhaseEnd end = describe(run_.problem, run_.system, run_.state, run_.time);
    to_world(run_.frame, end);
    return end;
  }

  // Whether something follows the approach's end.
  bool goes_on() const {
    return run_.problem.impact && run_.problem.post_impact &&
           (!run_.grips.empty() || run_.rebounded || run_.schedule.any_left());
  }

  // The servicer's initial state, and the targets where they are at the start.
  void place() {
    const auto planning = [&](double) { run_.progress(kPlanning, 0, 0); };
    const TargetPlan targets =
        plan_targets(run_.problem, run_.progress ? std::function<void(double)>(planning) : nullptr);
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
    std::optional<ApproachPlan> plan;
    if (run_.detail != CaptureDetail::full) plan = stated_approach(run_.problem, run_.system);
    if (!plan) plan = plan_approach(run_.problem, targets, run_.detail, run_.progress);
    run_.result.plan = plan->report;
    for (const std::string& warning : plan->warnings) run_.result.warnings.push_back(warning);
    if (!plan->failure.empty()) throw RunFailure(plan->failure);
    run_.trajectories = std::move(plan->joints);
  }

  void begin_approach() {
    const ApproachSetup& setup = *run_.problem.approach;
    run_.result.approach_start = describe_now();
    if (setup.base_control) run_.control.attitude = attitude_control(*setup.base_control, run_.system, run_.state).R_WD;
    phase_ = "approach", until_ = setup.duration;
  }

  void begin_post_impact() {
    const PostImpactSetup& post = *run_.problem.post_impact;
    run_.control.attitude.reset();
    if (post.base_control) run_.control.attitude = attitude_control(*post.base_control, run_.system, run_.state).R_WD;
    post_start_ = run_.time;
    phase_ = "post_impact", until_ = run_.time + post.duration;
  }

  // From event to event: grips that close at stated times or on arrival, and grips that let go. Prepares the next piece
  // of motion; false: there is none before the flight's end.
  bool fly() {
    if (run_.time < until_) {
      impacts_.close(run_.schedule.arrived(run_.system, run_.state));
      impacts_.close(run_.schedule.due_at(run_.time));
      if (ends_by_envelope() && run_.schedule.together_in_envelopes(run_.system, run_.state)) return false;
      stop_ = run_.schedule.stop_condition(run_.system, ends_by_envelope());
      prepare(next_event());
      return true;
    }
    if (run_.control.approaching) return false;  // what is due at its end closes with the others
    impacts_.close(run_.schedule.arrived(run_.system, run_.state));
    impacts_.close(run_.schedule.due_at(run_.time));
    return false;
  }

  bool ends_by_envelope() const {
    return run_.control.approaching && run_.problem.approach->capture_at == ApproachSetup::CaptureAt::envelope;
  }

  double next_event() const {
    double next = until_;
    const auto consider = [&](double t) {
      if (t > run_.time && !GripSchedule::is_now(t, run_.time) && t < next) next = t;
    };
    for (double t : run_.schedule.stated_times()) consider(t);
    if (!run_.control.approaching) {
      for (const PostImpactSetup::Release& release : run_.problem.post_impact->releases)
        consider(post_start_ + release.after);
    }
    return GripSchedule::is_now(next, until_) ? until_ : next;
  }

  // --- Pieces of motion ---

  // To the end of the approach in one go.
  const MotionTask* arrival() {
    const double duration = run_.problem.approach->duration;
    dynamics_.emplace(run_.system.model,
                      approach_setup(run_.problem, run_.system, run_.state, run_.trajectories, true));
    describe_task("approach", duration, true);
    between_looks_ = true;
    return &task_;
  }

  // The present system's motion on to the time `end`, or until `stop_` says so.
  void prepare(double end) {
    const std::string name = run_.next_name(phase_);
    const bool pd = run_.holds_by(PostImpactSetup::Joints::pd);
    const bool controlled = run_.control.approaching || pd || run_.problem.post_impact->base_control.has_value();
    const bool cut = run_.control.approaching ? run_.problem.approach->tracking.mode != TrackingSetup::Mode::ideal : pd;
    dynamics_.emplace(run_.system.model,
                      segment_setup(run_.problem, run_.system, run_.state, run_.trajectories, run_.control));
    if (run_.recorder) {
      reference_ = references();
      run_.recorder->begin_phase(name, reference_);
    }
    run_.bookkeeper.begin_phase(controlled, dynamics_->is_disturbed() || !dynamics_->setup().recover_roots);
    run_.watches.begin_phase(name, run_.system, cut);
    run_.loops.begin_phase(name, run_.problem, run_.system);
    if (run_.watches_loads()) run_.loads.begin_phase(name, run_.system, *dynamics_);
    kinematics_ = Kinematics(run_.system.model);
    // Joints that follow a reference exactly are on it from the first instant on.
    run_.state = dynamics_->unprojected_state(run_.time, dynamics_->initial(run_.state, run_.time));
    describe_task(name, end, controlled);
    if (run_.recorder) {
      task_.only_here = "it is recorded";
    } else if (run_.watches_loads()) {
      task_.only_here = "loads are looked for";
    } else if (!run_.system.closures.empty()) {
      task_.only_here = "loops are closed";
    } else if (stop_) {
      task_.only_here = "grips close on arrival";
    }
    // Steps suffice for the books, and to see an end-effector arrive, but not to watch anything.
    between_looks_ = !run_.recorder && run_.system.closures.empty() && !run_.watches.watching();
    if (task_.only_here.empty() && run_.watches.watching()) {
      task_.longest_look = (end - run_.time) / kLeastWatched;
      task_.watch = [this](double t, const State& state, std::span<const double> motor) {
        watched_elsewhere_ = true;
        run_.watches.sample(t, state, motor);
      };
    }
  }

  void describe_task(const std::string& name, double end, bool controlled) {
    task_.phase = name;
    task_.model = &run_.system.model, task_.setup = &dynamics_->setup();
    task_.start = run_.state;
    task_.begin = run_.time, task_.end = end;
    task_.integration = tolerances_for(run_.problem.integration, *dynamics_, end - run_.time, controlled);
    task_.only_here.clear();
    task_.watch = nullptr;
    watched_elsewhere_ = false;
  }

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

  // Who waits hears of every step.
  std::function<void(double)> each_step() const {
    if (!run_.progress) return {};
    return [this](double t) { run_.progress(task_.phase, t, task_.end); };
  }

  PhaseOutcome integrate_between_looks() {
    StepWatch watch;
    watch.looks = static_cast<int>(kLeastLooks);
    if (stage_ != Stage::arriving) {
      watch.look = [&](double t, const State& state, const PhaseIntegrals& integrals) {
        forward_kinematics(run_.system.model, state, kinematics_);
        run_.bookkeeper.sample(system_books(run_.system.model, kinematics_, state), integrals);
        run_.last_look = t;
      };
    }
    watch.each_step = each_step();
    if (stage_ != Stage::arriving) watch.probe = load_probe();
    return simulate_phase(*dynamics_, task_.start, task_.begin, task_.end, task_.integration, watch, stop_);
  }

  StepProbe load_probe() {
    if (!run_.watches_loads()) return {};
    return [this](const PhaseStep& step) { run_.loads.step(step); };
  }

  // What joints pass on, for the record.
  std::vector<Wrenchd> joint_reactions(const PhaseSample& sample, std::span<const GripSample> grips) const {
    std::vector<Wrenchd> on_robot;
    for (const HeldGrip& grip : run_.system.grips) on_robot.push_back(grips[grip.grasp].F_WC);
    return joint_wrenches(run_.system, kinematics_, sample, on_robot);
  }

  PhaseOutcome integrate_with_samples() {
    const double end = task_.end, duration = end - task_.begin;
    const bool any_interval = run_.problem.output_interval > 0;
    const double interval = any_interval ? run_.problem.output_interval : duration;
    // A power of two, so that the samples' times are exact multiples of the interval.
    const double wanted = std::log2(std::clamp(kLeastLooks * interval / duration, 1.0, 0x1p40));
    const long looks = stop_ ? 1 : 1L << std::lround(std::ceil(wanted));
    long look = 0;
    std::vector<double> motor(run_.system.model.joints().size());
    const auto observe = [&](PhaseSample sample) {
      forward_kinematics(run_.system.model, sample.state, kinematics_);
      const SystemBooks books = system_books(run_.system.model, kinematics_, sample.state);
      run_.bookkeeper.sample(books, sample.integrals);
      std::copy(sample.motor.begin(), sample.motor.end(), motor.begin());
      const std::vector<GripSample> grips = run_.loops.sample(sample, kinematics_, motor);
      sample.motor = motor;
      // Efforts have been looked at in every step where loads are.
      const auto efforts = run_.watches_loads() ? std::span<const double>() : sample.motor;
      const double clearance = run_.watches.sample(sample.time, sample.state, efforts);
      if (look++ % looks == 0 || sample.time == end) {
        run_.last_look = sample.time;
        if (run_.recorder) {
          run_.recorder->sample(run_.system, kinematics_, books, sample, grips, clearance,
                                joint_reactions(sample, grips));
        }
      }
    };
    return simulate_phase(*dynamics_, task_.start, task_.begin, end, interval / static_cast<double>(looks),
                          task_.integration, observe, stop_, load_probe(), each_step());
  }

  // The piece is done: on from its end.
  void arrive(const PhaseOutcome& outcome) {
    if (stage_ != Stage::arriving) {
      run_.result.cost.push_back({task_.phase, outcome.rhs_evaluations, outcome.steps, outcome.rejected,
                                  outcome.momentum_mended.linear, outcome.momentum_mended.angular});
      run_.loops.end_phase(outcome.loops);
    }
    dynamics_.reset();
    if (!outcome.finished) throw RunFailure(fmt::format("{}: {}", task_.phase, outcome.failure));
    run_.state = outcome.end_state;
    run_.time = outcome.end_time;
    if (stage_ == Stage::arriving) return;
    if (run_.recorder) run_.recorder->end_phase(outcome.integrals);
    run_.bookkeeper.end_phase(outcome.integrals);
    run_.watches.end_phase();
    if (run_.watches_loads()) run_.loads.end_phase(), run_.watches.add(run_.loads.take_events());
    if (!outcome.stopped) impacts_.release_due(post_start_);
  }

  const Part part_;
  RunState run_;
  RunImpacts impacts_;
  Stage stage_ = Stage::beginning;
  std::string phase_;  // the flight's name, and its end
  double until_ = 0;
  double post_start_ = 0;
  // Of the piece of motion under way:
  MotionTask task_;
  std::optional<PhaseDynamics> dynamics_;
  StopCondition stop_;
  Kinematics kinematics_;
  std::vector<JointTrajectory> reference_;
  bool between_looks_ = false;      // nothing but the books looks at it
  bool watched_elsewhere_ = false;  // its watch has been called
};

CaptureSteps::CaptureSteps(const CaptureProblem& problem, CaptureDetail detail, CaptureProgress progress, Part part,
                           SeriesSink* sink) {
  result_.scenario_name = problem.name;
  result_.scenario_sha256 = problem.sha256;
  result_.status = CaptureStatus::failed;
  const MovingFrame frame = moving_frame(problem);
  if (!frame.is_world()) seen_ = std::make_unique<CaptureProblem>(seen_from(frame, problem));
  sequence_ = std::make_unique<Sequence>(seen_ ? *seen_ : problem, frame, detail, std::move(progress), part, sink,
                                         result_);  // checks the problem
  if (detail == CaptureDetail::full && part == Part::whole) result_.scene = scene_of(problem);
}

CaptureSteps::~CaptureSteps() = default;

const MotionTask* CaptureSteps::next() {
  try {
    const MotionTask* task = sequence_->next();
    if (!task && result_.failure.empty()) result_.status = CaptureStatus::completed;
    return task;
  } catch (const std::runtime_error& error) {
    result_.failure = error.what();
    sequence_->fail();
    return nullptr;
  }
}

void CaptureSteps::move() {
  try {
    sequence_->move();
  } catch (const std::runtime_error& error) {
    result_.failure = error.what();
    sequence_->fail();
  }
}

void CaptureSteps::moved(const PhaseOutcome& outcome, const PhaseMeasures& measures) {
  try {
    sequence_->moved(outcome, measures);
  } catch (const std::runtime_error& error) {
    result_.failure = error.what();
    sequence_->fail();
  }
}

CaptureResult CaptureSteps::finish() {
  sequence_->close_books();
  if (result_.status == CaptureStatus::completed) {
    if (const std::string what = first_not_finite(result_); !what.empty()) {
      result_.status = CaptureStatus::failed;
      result_.failure = what + " is not a finite number: lengths and speeds are beyond what can be computed with";
    }
  }
  return std::move(result_);
}

}  // namespace grapnel
