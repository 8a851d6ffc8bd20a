#include "grapnel/capture/simulate_capture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "grapnel/capture/approach_plan.hpp"
#include "grapnel/capture/bookkeeper.hpp"
#include "grapnel/capture/captured_model.hpp"
#include "grapnel/capture/contact.hpp"
#include "grapnel/capture/envelope.hpp"
#include "grapnel/capture/impact_report.hpp"
#include "grapnel/capture/phase_setups.hpp"
#include "grapnel/capture/recorder.hpp"
#include "grapnel/capture/watches.hpp"
#include "grapnel/simulate/simulate_phase.hpp"

namespace grapnel {
namespace {

// Ends a run early; becomes CaptureResult::failure.
struct Failure : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// One run: the phases in their order, with recorder and books kept alongside.
class Run {
 public:
  Run(const CaptureProblem& problem, const CaptureProgress& progress, CaptureResult& result)
      : problem_(problem),
        progress_(progress),
        result_(result),
        system_(make_capture_system(problem)),
        recorder_(problem, system_, result.series),
        watches_(problem),
        gripped_(problem) {}

  void simulate() {
    place();
    if (problem_.approach) approach();
    if (!problem_.grasps.empty()) grip();
    if (problem_.impact && !gripped_.grasps.empty()) {
      impact();
      if (problem_.post_impact) post_impact();
    }
  }

  void close_books() {
    bookkeeper_.write(result_.ledger);
    if (result_.impact) scale_published(result_.ledger.scale, *result_.impact);
    closure_rows();
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
    if (!problem_.approach) return;
    ApproachPlan plan = plan_approach(problem_, targets);
    result_.plan = plan.report;
    for (const std::string& warning : plan.warnings) result_.warnings.push_back(warning);
    if (!plan.failure.empty()) throw Failure(plan.failure);
    trajectories_ = std::move(plan.joints);
  }

  // Integrates a phase of the present system, records it and moves state_ and time_ to its end.
  void integrate(const std::string& name, PhaseSetup setup, double duration, bool controlled, bool efforts_are_cut,
                 std::span<const JointTrajectory> reference = {}, const StopCondition& stop = {}) {
    const double end = time_ + duration;
    PhaseDynamics dynamics(system_.model, std::move(setup));
    recorder_.begin_phase(name, reference);
    bookkeeper_.begin_phase(controlled);
    watches_.begin_phase(name, system_, efforts_are_cut);
    Kinematics kinematics(system_.model);
    // The books look at least so often, however few samples are to be kept: scales are maxima over time.
    constexpr double kLeastLooks = 32;
    const bool any_interval = problem_.output_interval > 0;
    const double interval = any_interval ? problem_.output_interval : duration;
    // A power of two, so that the samples' times are exact multiples of the interval.
    const double wanted = std::log2(std::clamp(kLeastLooks * interval / duration, 1.0, 0x1p40));
    const long looks = stop ? 1 : 1L << std::lround(std::ceil(wanted));
    long look = 0;
    const auto observe = [&](const PhaseSample& sample) {
      forward_kinematics(system_.model, sample.state, kinematics);
      const SystemBooks books = system_books(system_.model, kinematics, sample.state);
      bookkeeper_.sample(books, sample.integrals);
      watches_.sample(sample);
      if (look++ % looks == 0 || sample.time == end) recorder_.sample(system_, kinematics, books, sample);
      if (progress_) progress_(name, sample.time, end);
    };
    // Joints that follow a reference exactly are on it from the first instant on.
    state_ = dynamics.state(time_, dynamics.initial(state_, time_));
    const PhaseOutcome outcome = simulate_phase(dynamics, state_, time_, end, interval / static_cast<double>(looks),
                                                tolerances_for(dynamics, duration, controlled), observe, stop);
    result_.cost.push_back({name, outcome.rhs_evaluations, outcome.steps, outcome.rejected,
                            outcome.momentum_mended.linear, outcome.momentum_mended.angular});
    if (!outcome.finished) throw Failure(fmt::format("{}: {}", name, outcome.failure));
    recorder_.end_phase(outcome.integrals);
    bookkeeper_.end_phase(outcome.integrals);
    watches_.end_phase();
    state_ = outcome.end_state;
    time_ = outcome.end_time;
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
    StopCondition in_envelope;
    Kinematics kinematics(system_.model);
    if (setup.capture_at == ApproachSetup::CaptureAt::envelope) {
      in_envelope = [&](double, const State& state) {
        forward_kinematics(system_.model, state, kinematics);
        return largest_excess(problem_, system_, kinematics);
      };
    }
    integrate("approach", approach_setup(problem_, system_, state_, trajectories_, false), setup.duration, true,
              setup.tracking.mode != TrackingSetup::Mode::ideal, trajectories_, in_envelope);
    result_.approach_end = describe(problem_, system_, state_, time_);
  }

  // Which grippers close. Those that do not leave their targets alone.
  void grip() {
    const std::vector<GripDecision> decisions =
        decide_grips(problem_, system_, forward_kinematics(system_.model, state_));
    result_.capture_time = time_;
    gripped_.grasps.clear();
    for (std::size_t i = 0; i < decisions.size(); ++i) {
      const GraspSetup& g = problem_.grasps[i];
      const GripDecision& d = decisions[i];
      result_.grips.push_back({g.end_effector, g.target, g.grasp_point, d.captured, d.reason, d.deviation.position,
                               d.deviation.angle, d.deviation.velocity, d.deviation.angular_velocity});
      if (d.captured) gripped_.grasps.push_back(g);
    }
  }

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
    return momentum_about(system_.model, forward_kinematics(system_.model, state), Vector3d::zero());
  }

  // Sizes fit by construction, so what the solver refuses are numbers: inertias that span more than doubles resolve.
  ImpactOutcome solve_impact(const Contact& contact) const {
    try {
      return run_impact(gripped_, system_, contact, time_);
    } catch (const std::invalid_argument& error) {
      throw Failure(
          fmt::format("impact at t = {:.6g} s: the system is numerically singular ({})", time_, error.what()));
    }
  }

  void impact() {
    recorder_.begin_phase("contact");
    const Contact contact = make_contact(gripped_, system_, state_);
    if (!contact.refused.empty()) {
      for (GripOutcome& grip : result_.grips) {
        if (!grip.captured) continue;  // it has its own reason
        grip.captured = false;
        grip.reason = "contact refused: " + contact.refused;
      }
      throw Failure("contact refused: " + contact.refused);
    }
    if (problem_.approach) bookkeeper_.enter(momentum_about_origin(contact.state) - momentum_about_origin(state_));
    state_ = contact.state;
    sample_contact();

    ImpactOutcome outcome = solve_impact(contact);
    bookkeeper_.enter(outcome.from_ground);
    state_ = outcome.after;
    impact_rows(outcome.solution);
    if (problem_.post_impact) {
      CapturedSystem captured = capture_targets(gripped_, system_, state_, contact.grasps);
      system_ = std::move(captured.system);
      state_ = std::move(captured.state);
      if (problem_.post_impact->joints == PostImpactSetup::Joints::braked) outcome.report.brake = brake();
    }
    result_.impact = std::move(outcome.report);
    sample_contact();
  }

  // All robot joints stop at once.
  BrakeReport brake() {
    std::vector<int> velocities;
    BrakeReport report;
    for (int j : system_.robot_joints) {
      const Body& body = system_.model.bodies()[system_.model.joints()[j]];
      velocities.push_back(body.v);
      report.joints.push_back(body.description.joint.name);
    }
    const ImpactSolution solution = lock_joints(system_.model, state_, velocities, report.impulse);
    const State before = state_;
    state_.v = solution.velocity;
    const Kinematics k0 = forward_kinematics(system_.model, before), k1 = forward_kinematics(system_.model, state_);
    report.kinetic_energy_before = kinetic_energy(system_.model, k0, before);
    report.kinetic_energy_after = kinetic_energy(system_.model, k1, state_);
    // The grips pass on what their targets take up; a target's frame is at its contact point now.
    const std::vector<Impulsed> through = joint_impulses(system_.model, before, state_, {});
    for (const GraspSetup& g : gripped_.grasps) {
      const Impulsed& on_target = through[system_.model.body_index(target_body_name(g.target))];
      report.grasps.push_back({g.end_effector, g.target, -on_target.linear, -on_target.angular});
    }
    const Twistd jump = k1.V_WB[system_.base] - k0.V_WB[system_.base];
    report.base_velocity_change = jump.linear;
    report.base_angular_velocity_change = jump.angular;
    if (!system_.model.has_free_root(system_.base)) {
      const Impulsed ground = shift(through[system_.base], -k0.X_WB[system_.base].p);
      bookkeeper_.enter({ground.angular, ground.linear});
    }
    add_row("brake_energy_identity_residual", solution.energy_identity_residual, 1e-10,
            "the same for the impulse that locks the joints");
    return report;
  }

  void post_impact() {
    const PostImpactSetup& post = *problem_.post_impact;
    const bool pd = post.joints == PostImpactSetup::Joints::pd;
    integrate("post_impact", post_impact_setup(problem_, system_, state_), post.duration,
              pd || post.base_control.has_value(), pd);
    result_.post_impact_end = describe(problem_, system_, state_, time_);
  }

  void add_row(const char* name, double value, double bound, const char* note, bool applies = true,
               const char* unit = "1") {
    result_.ledger.entries.push_back({name, value, bound, unit, note, applies});
  }

  void impact_rows(const ImpactSolution& solution) {
    add_row("generalized_momentum_residual", solution.generalized_momentum_residual, 1e-10,
            "(3.6): |M dv - J^T P| over |M v| before the impact, energy norm");
    add_row("energy_identity_residual", solution.energy_identity_residual, 1e-10,
            "|dT + u^T W^+ u / 2| over the kinetic energy before the impact");
    add_row("impact_constraint_residual", solution.constraint_residual, 1e-10,
            "relative velocity left in the constrained directions over the largest velocity");
  }

  // A tree keeps its grips by construction; loops come with several arms on one target.
  void closure_rows() {
    const char* none = "no closed loop in this run: every target hangs on one arm";
    add_row("loop_closure_position", 0, 1e-12, none, false, "m");
    add_row("loop_closure_angle", 0, 1e-12, none, false, "rad");
    add_row("unprojected_defect", 0, 1e-10, none, false);
    add_row("correction_total", 0, 1e-10, none, false);
  }

  const CaptureProblem& problem_;
  const CaptureProgress& progress_;
  CaptureResult& result_;
  CaptureSystem system_;
  Recorder recorder_;
  Bookkeeper bookkeeper_;
  Watches watches_;
  CaptureProblem gripped_;                     // the problem with those grasps alone whose grips close
  std::vector<JointTrajectory> trajectories_;  // of the approach, per robot joint
  State state_;
  double time_ = 0;
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
