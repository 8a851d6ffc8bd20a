#include "grapnel/capture/simulate_capture.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <stdexcept>

#include "grapnel/approach/approach_plan.hpp"
#include "grapnel/approach/capture_window.hpp"
#include "grapnel/approach/navigation.hpp"
#include "grapnel/capture/elastic_report.hpp"
#include "grapnel/capture/finite_result.hpp"
#include "grapnel/capture/grasp_events.hpp"
#include "grapnel/capture/implausible_efforts.hpp"
#include "grapnel/capture/motion_phases.hpp"
#include "grapnel/capture/planned_contacts.hpp"
#include "grapnel/capture/replanning.hpp"
#include "grapnel/capture/sampled_gains.hpp"
#include "grapnel/problem/enumeration_names.hpp"
#include "grapnel/problem/flexible_bodies.hpp"
#include "grapnel/problem/problem_conflicts.hpp"
#include "grapnel/problem/problem_scene.hpp"

namespace grapnel {
namespace {

// The phases, in chronological order.
void warn_of_comparisons(CaptureRun& run);
void plan_motion(CaptureRun& run, const std::optional<CaptureTime>& chosen);
MotionPhase begin_approach(CaptureRun& run);
bool has_post_impact_motion(const CaptureRun& run);
void check_and_report(CaptureRun& run);

// A capture from its plan to its report, or only its impact. Suspends at every motion segment; the caller may
// integrate it before resuming, otherwise it is integrated on resumption.
Resumable<PhaseSegment> capture(CaptureRun& run, CaptureSteps::Part part, const std::optional<CaptureTime>& chosen) {
  try {
    // Planning: the targets' motion, and the joints' trajectories.
    warn_of_comparisons(run);
    plan_motion(run, chosen);

    // The approach: motion segments between grasps that close at stated times or on arrival.
    if (run.problem.approach && part == CaptureSteps::Part::impact_only && !run.problem.approach->replan &&
        !run.contacts.any()) {
      PhaseSegment whole = PhaseSegment::unobserved_approach(run);
      co_await whole;
      run.result.approach_end = run.describe_now();
    } else if (run.problem.approach) {
      const MotionPhase approach = begin_approach(run);
      while (close_due_grasps(run, approach)) {
        PhaseSegment segment(run, approach);
        co_await segment;
        open_overloaded_grasps(run);
        replan_if_due(run);
      }
      run.result.approach_end = run.describe_now();
    }

    // Contact and impact of all grasps that close at the approach's end.
    run.joints.settle_all(run.bodies);
    const bool closed = close_grasps(run, run.schedule.due_together(run.bodies.time));

    // Motion after the impact, or without one: phase by phase, each in pieces between releases, closing and lost grasps
    // and its end condition.
    if (part == CaptureSteps::Part::whole && has_post_impact_motion(run)) {
      if (!closed) stop_joints(run);
      for (bool any_left = true; any_left;) {
        MotionPhase phase = begin_motion_phase(run);
        while (moves_on(run, phase)) {
          PhaseSegment segment(run, phase);
          const bool reached_event = co_await segment;
          run.identification.conclude(run.bodies.system, run.bodies.time);
          open_overloaded_grasps(run);
          if (reached_event) release_due_grasps(run, phase);
        }
        any_left = end_motion_phase(run, phase);
      }
      run.result.post_impact_end = run.result.phases.back().at_end;
    }
    run.result.status = CaptureStatus::completed;
  } catch (const std::runtime_error& error) {
    run.result.failure = error.what();
  }

  // Checks of conservation, limits and loads, and the outcome of every grasp; also of a failed run.
  check_and_report(run);
}

// --- Planning ---

// Warns of settings that are for comparison only.
void warn_of_comparisons(CaptureRun& run) {
  const CaptureProblem& problem = run.problem;
  const auto warn = [&](const std::string& text) { run.result.warnings.push_back(text); };
  if (problem.impact && impact_law(*problem.impact).published)
    warn("impact.law: as_published is for comparison: it does not conserve momentum");
  const std::string loops = "integration.loops: ";
  switch (problem.integration.loops) {
    case IntegrationSetup::Loops::projection:
      break;
    case IntegrationSetup::Loops::baumgarte:
      warn(loops + "baumgarte is for comparison: defects decay instead of being projected");
      break;
    case IntegrationSetup::Loops::acceleration:
      warn(loops + "acceleration is for comparison: loop defects are not corrected, so they grow");
      break;
    case IntegrationSetup::Loops::open:
      warn(loops + "open is for comparison: loops are cut, further grasps of a target do not hold it");
  }
}

// The servicer's initial state, and the targets where they are at the start.
void place_bodies(const CaptureProblem& problem, const TargetPlan& targets, RunBodies& bodies) {
  const Model& model = bodies.system.model;
  bodies.state = initial_servicer_state(problem, bodies.system);
  for (std::size_t t = 0; t < problem.targets.size(); ++t) {
    const int body = model.frames()[bodies.system.target_frames[t]].body;
    set_root_pose(model, body, targets.start[t].X_WT, bodies.state);
    set_root_twist(model, body, targets.start[t].V_WT, bodies.state);
  }
}

// Reports frequencies at the start; rejects problems that would take days, since every vibration is resolved.
void check_vibrations(CaptureRun& run) {
  constexpr double kMaxPeriods = 1e6;
  const double fastest = fastest_vibration(run.bodies.system, run.bodies.state);
  const CaptureProblem& problem = run.problem;
  const double duration = (problem.approach ? problem.approach->duration : 0) + problem.post_impact.total_duration();
  if (fastest * duration > kMaxPeriods) {
    throw RunFailure(
        fmt::format("the flexible modes have up to {:.3g} Hz, {:.3g} periods in {:.6g} s, and the integrator resolves "
                    "each; at most "
                    "{:.0e} are allowed: use fewer segments, or rigid parts instead of stiff flexible ones",
                    fastest, fastest * duration, duration, kMaxPeriods));
  }
  if (run.detail == CaptureDetail::full)
    run.result.elastic.push_back(elastic_report(run.bodies.system, run.bodies.state, "start", run.bodies.time));
}

// The targets' motion, the initial state, and the joints' trajectories in the approach.
void plan_motion(CaptureRun& run, const std::optional<CaptureTime>& chosen) {
  const auto planning = [&](double) { run.progress(kPlanning, 0, 0); };
  const TargetPlan targets = plan_targets(run.problem, run.progress ? std::function<void(double)>(planning) : nullptr);
  place_bodies(run.problem, targets, run.bodies);
  if (!run.bodies.system.elastic_joints.empty()) check_vibrations(run);
  // Without an approach, grasps close now.
  for (std::size_t i = 0; i < run.problem.grasps.size() && !run.problem.approach; ++i) {
    if (run.problem.grasps[i].closes == GraspSetup::Closes::together)
      run.contacts.close(i, run.bodies.system, run.bodies.state, 0);
  }
  if (const std::string overlaps = run.contacts.overlaps(run.bodies.system, run.bodies.state); !overlaps.empty())
    throw RunFailure("contacts: at the start " + overlaps +
                     "; bodies that may touch must begin apart: move them, or leave the pair out of 'contacts'");
  if (!run.problem.approach) return;
  if (chosen && !chosen->failure.empty()) {
    run.result.plan = chosen->closest;
    run.result.plan->window = chosen->window;
    throw RunFailure(chosen->failure);
  }
  std::optional<ApproachPlan> plan;
  if (run.detail != CaptureDetail::full && !navigates(run.problem) && !run.contacts.any())
    plan = stated_approach(run.problem, run.bodies.system);
  if (!plan) plan = plan_on_estimates(run, targets);
  run.result.plan = plan->report;
  if (chosen) run.result.plan->window = chosen->window;
  for (const std::string& warning : plan->warnings) run.result.warnings.push_back(warning);
  if (!plan->failure.empty()) throw RunFailure(plan->failure);
  run.joints.follow(std::move(plan->joints));
}

// --- Approach and motion after the impact ---

MotionPhase begin_approach(CaptureRun& run) {
  const ApproachSetup& setup = *run.problem.approach;
  run.result.approach_start = run.describe_now();
  run.joints.control_attitude(setup.base_control, run.bodies);
  run.unstable_gains = unstable_gains(run, true);
  for (const std::string& text : run.unstable_gains) run.result.warnings.push_back(text);
  return {"approach", 0, setup.duration};
}

// Whether there is motion after the approach's end: a grasp has closed, or still may close, or nothing is to be
// captured.
bool has_post_impact_motion(const CaptureRun& run) {
  if (!run.problem.post_impact) return false;
  return !run.problem.impact || !run.bodies.held.empty() || !run.bodies.slips.empty() || run.rebounded ||
         !run.result.losses.empty() || run.schedule.any_left();
}

// --- Checks and report ---

// Finished or failed run => complete result: grasp outcomes, ledger, reports, warnings. A completed run with a number
// that is not finite becomes failed.
void check_and_report(CaptureRun& run) {
  CaptureResult& result = run.result;
  run.schedule.write(run.monitor.last_check(), run.bodies.system, run.bodies.state, result);
  run.monitor.write();
  compare_contacts_with_plan(run);
  run.law.write(result);
  for (std::string& warning : implausible_efforts(run.problem, result)) result.warnings.push_back(std::move(warning));
  run.identification.write(result);
  if (run.sensors) result.sensors = run.sensors->reports();
  if (result.status != CaptureStatus::completed) return;
  if (const std::string what = first_not_finite(result); !what.empty()) {
    result.status = CaptureStatus::failed;
    result.failure = what + " is not a finite number: lengths or speeds exceed the range of floating-point numbers";
  }
}

// The time of capture, if the scenario does not fix it.
std::optional<CaptureTime> chosen_time(const CaptureProblem& problem, const CaptureProgress& progress) {
  if (!problem.approach || !problem.approach->window) return {};
  try {
    return choose_capture_time(problem, progress);
  } catch (const std::runtime_error& error) {
    CaptureTime none{problem, {}, error.what(), {}};
    none.problem.approach->duration = problem.approach->window->latest;
    none.problem.approach->window.reset();
    none.window.time = std::nan("");
    return none;
  }
}

OrbitReport describe_orbit(const OrbitSetup& setup) {
  const ReferenceOrbit orbit = reference_orbit(setup);
  const OrbitPoint start = orbit_point(orbit, 0);
  return {setup.mu ? "own" : name_of(setup.body), start.radius, start.rate, 2 * std::numbers::pi / mean_motion(orbit)};
}

}  // namespace

// --- Piece by piece ---

struct CaptureSteps::Work {
  Work(const CaptureProblem& problem, CaptureDetail detail, CaptureProgress progress, Part part, SeriesSink* sink)
      : chosen(chosen_time(problem, progress)),
        flexible(is_flexible(problem.robot) ? std::make_unique<CaptureProblem>(flexible_problem(timed(problem)))
                                            : nullptr),
        frame(moving_frame(problem)),
        seen(frame.is_world() ? nullptr : std::make_unique<CaptureProblem>(seen_from(frame, modelled(problem)))),
        run(seen ? *seen : modelled(problem), frame, detail, std::move(progress), sink, result),
        body(capture(run, part, chosen)) {
    result.scenario_name = problem.name;
    result.scenario_sha256 = problem.sha256;
    result.status = CaptureStatus::failed;  // until completion
    result.without_impact = !problem.impact;
    if (const auto& control = problem.control)
      result.control = {control->timing.period, control->timing.delay,
                        control->plugin.empty() ? control->fmu : control->plugin, control->sha256};
    if (problem.orbit) result.orbit = describe_orbit(*problem.orbit);
    if (detail == CaptureDetail::full && part == Part::whole) result.scene = scene_of(timed(problem));
  }

  // The problem with a fixed duration: stated, or found by the search.
  const CaptureProblem& timed(const CaptureProblem& problem) const { return chosen ? chosen->problem : problem; }
  /// The same with pieces on springs instead of flexible parts.
  const CaptureProblem& modelled(const CaptureProblem& problem) const { return flexible ? *flexible : timed(problem); }

  CaptureResult result;
  const std::optional<CaptureTime> chosen;               // of a problem with a window
  const std::unique_ptr<const CaptureProblem> flexible;  // null: no flexible parts
  const MovingFrame frame;
  const std::unique_ptr<const CaptureProblem> seen;  // in the frame of the computation; null: the problem itself
  CaptureRun run;
  Resumable<PhaseSegment> body;
  PhaseSegment* segment = nullptr;  // the suspended piece
};

CaptureSteps::CaptureSteps(const CaptureProblem& problem, CaptureDetail detail, CaptureProgress progress, Part part,
                           SeriesSink* sink)
    : work_(std::make_unique<Work>(without_conflicts(problem), detail, std::move(progress), part, sink)) {}

CaptureSteps::~CaptureSteps() = default;

void CaptureSteps::pause_at(double time) { work_->run.pauses.push_back(time); }

const MotionTask* CaptureSteps::next() {
  work_->segment = nullptr;
  work_->segment = work_->body.next();
  return work_->segment ? &work_->segment->task() : nullptr;
}

void CaptureSteps::integrated(PhaseOutcome outcome, const PhaseMeasures& measures) {
  if (!work_->segment) throw std::logic_error("CaptureSteps: no motion segment to integrate");
  work_->segment->take(std::move(outcome), measures);
}

void CaptureSteps::integrated_in_part(PhaseOutcome outcome, const PhaseMeasures& measures, double next_step) {
  if (!work_->segment) throw std::logic_error("CaptureSteps: no motion segment to integrate");
  work_->segment->take_part(std::move(outcome), measures, next_step);
}

CaptureResult CaptureSteps::finish() {
  if (!work_->body.done()) throw std::logic_error("CaptureSteps: the run has not ended");
  return std::move(work_->result);
}

// --- In one call ---

namespace {

CaptureResult simulate(const CaptureProblem& problem, CaptureDetail detail, const CaptureProgress& progress,
                       CaptureSteps::Part part, SeriesSink* sink) {
  CaptureSteps steps(problem, detail, progress, part, sink);
  while (steps.next()) {
  }
  return steps.finish();
}

}  // namespace

CaptureResult simulate_capture(const CaptureProblem& problem, const CaptureProgress& progress, CaptureDetail detail,
                               SeriesSink* sink) {
  return simulate(problem, detail, progress, CaptureSteps::Part::whole, sink);
}

CaptureResult simulate_impact_only(const CaptureProblem& problem, CaptureDetail detail,
                                   const CaptureProgress& progress) {
  return simulate(problem, detail, progress, CaptureSteps::Part::impact_only, nullptr);
}

}  // namespace grapnel
