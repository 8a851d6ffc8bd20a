#include "grapnel/capture/run_monitor.hpp"

#include <algorithm>

#include "grapnel/capture/conservation_monitor.hpp"
#include "grapnel/capture/contact_monitor.hpp"
#include "grapnel/capture/internal_loads.hpp"
#include "grapnel/problem/capture_problem.hpp"

namespace grapnel {

// Problem, free system, frame => monitors before the first phase; time series are recorded only with full detail, into
// `sink` if it is not null.
RunMonitor::RunMonitor(const CaptureProblem& problem, const CaptureSystem& free, const MovingFrame& frame,
                       const Recording& recording, CaptureResult& result)
    : problem_(problem),
      detail_(recording.detail),
      result_(result),
      conservation_(problem, free),
      watches_(problem),
      loads_(problem),
      saturation_(problem),
      stability_(problem),
      observers_(problem, free, frame) {
  if (detail_ != CaptureDetail::full) return;
  recorder_.emplace(problem, free, frame, observers_.all, result.series);
  recorder_->stream_to(recording.sink);
  recorder_->observe(recording.sensors);
}

// --- Phases of motion ---

// Phase => all monitors begun for its system and dynamics; load search only at the level of detail that needs it.
void RunMonitor::begin_phase(Phase phase) {
  name_ = std::move(phase.name), system_ = &phase.system, begin_ = phase.begin;
  if (recorder_) recorder_->begin_phase(name_);
  conservation_.begin_phase(phase.controlled, phase.dynamics.is_disturbed() || !phase.dynamics.setup().recover_roots);
  watches_.begin_phase(name_, phase.system, phase.efforts_are_cut, std::move(phase.opened));
  loops_.begin_phase(name_, problem_, phase.system);
  joints_.begin_phase(name_, phase.dynamics);
  if (seeks_loads()) loads_.begin_phase(name_, phase.system, phase.dynamics);
  for (const auto& observer : observers_.all) observer->begin_phase(phase.system, phase.dynamics);
  saturation_.begin_phase(phase.system, phase.dynamics);
  stability_.begin_phase(name_, phase.system, phase.dynamics, phase.moved_by_law, phase.after_impact);
  kinematics_ = Kinematics(phase.system.model);
  motor_.assign(phase.system.model.joints().size(), 0.0);
}

// Ends of steps suffice for the conservation checks and for the arrival of end-effectors, but not for clearance or
// limits.
bool RunMonitor::needs_samples() const {
  return recorder_ || !system_->closures.empty() || !system_->model.couplings().empty() || watches_.watching();
}

// Sample => conservation, loop, clearance, limit, wheel and gyro checks at this instant; recorded in the time series if
// `record`. Motor efforts include the self-stress of closed loops.
void RunMonitor::sample(const PhaseSample& at_instant, bool record) {
  PhaseSample sample = at_instant;
  forward_kinematics(system_->model, sample.state, kinematics_);
  const ConservedQuantities quantities = conserved_quantities(system_->model, kinematics_, sample.state);
  conservation_.sample(quantities, sample.integrals);
  std::copy(sample.motor.begin(), sample.motor.end(), motor_.begin());
  const std::vector<GraspSample> grasps = loops_.sample(sample, kinematics_, motor_);
  sample.motor = motor_;
  // Efforts have been evaluated in every step if loads are.
  const auto efforts = seeks_loads() ? std::span<const double>() : sample.motor;
  const double clearance = watches_.sample(sample.time, sample.state, efforts);
  observe_motion(*system_, sample.state, sample.motor);
  if (!record) return;
  last_check_ = sample.time;
  if (recorder_)
    recorder_->sample({*system_, kinematics_, quantities, sample, grasps, clearance, joint_reactions(sample, grasps)});
}

// The transmitted wrenches of joints, for the time series.
std::vector<Wrenchd> RunMonitor::joint_reactions(const PhaseSample& sample, std::span<const GraspSample> grasps) const {
  std::vector<Wrenchd> on_robot;
  for (const HeldGrasp& grasp : system_->grasps) on_robot.push_back(grasps[grasp.grasp].F_WC);
  return joint_wrenches(*system_, kinematics_, sample, on_robot);
}

void RunMonitor::check(double time, const State& state, const PhaseIntegrals& integrals) {
  forward_kinematics(system_->model, state, kinematics_);
  conservation_.sample(conserved_quantities(system_->model, kinematics_, state), integrals);
  observe_motion(*system_, state, {});
  last_check_ = time;
}

void RunMonitor::watch(double time, const State& state, std::span<const double> motor) {
  if (watches_.watching()) watches_.sample(time, state, motor);
  observe_motion(*system_, state, {});
}

void RunMonitor::restart_watch() {
  if (watches_.watching()) watches_.restart_phase();
  for (const auto& observer : observers_.all) observer->restart_phase();
}

StepProbe RunMonitor::load_probe() {
  if (!inspects_steps() && !watches_.watching() && !saturation_.observes()) return {};
  return [this](const PhaseStep& step) {
    if (watches_.watching()) watches_.step(step);
    if (seeks_loads()) loads_.step(step);
    for (const auto& observer : observers_.all) {
      if (observer->observes()) observer->step(step);
    }
    check_at_end(step);
  };
}

std::function<void(const HardImpact&)> RunMonitor::impact_probe() {
  if (!seeks_loads()) return {};
  return [this](const HardImpact& impact) { loads_.hard_impact(impact); };
}

void RunMonitor::check_at_end(const PhaseStep& step) {
  const bool stability = seeks_stability() && stability_.observes();
  if (!saturation_.observes() && !stability && !stability_.monitors_rest()) return;
  const PhaseSample reached = step.at(step.end);
  if (saturation_.observes()) saturation_.step(step.begin, reached);
  if (stability) stability_.step(step.begin, reached, saturation_.base_is_saturated());
  if (stability_.monitors_rest()) stability_.step_to_rest(step.begin, reached);
}

// Outcome => cost of the phase and all monitors ended; after a failed integration write() ends the remaining ones.
void RunMonitor::end_phase(const PhaseOutcome& outcome) {
  result_.cost.push_back({name_, outcome.rhs_evaluations, outcome.steps, outcome.rejected, outcome.implicit_steps,
                          outcome.implicit_spans});
  loops_.end_phase(outcome.loops);
  saturation_.end_phase(outcome.end_time - begin_);
  for (const auto& observer : observers_.all) observer->end_phase(outcome.end_time - begin_);
  if (seeks_stability()) stability_.end_phase();
  end_ = outcome.end_time;
  if (!outcome.finished) return;  // write() ends the others
  if (recorder_) recorder_->end_phase(outcome.integrals);
  conservation_.end_phase(outcome.integrals);
  watches_.end_phase();
  joints_.end_phase(outcome);
  if (!seeks_loads()) return;
  loads_.end_phase();
  watches_.add(loads_.take_events());
}

// --- Between phases ---

void RunMonitor::begin_contact(const std::string& phase) {
  if (recorder_) recorder_->begin_phase(phase);
}

void RunMonitor::touch(const std::vector<std::size_t>& grasps) {
  std::vector<std::size_t> targets;
  for (std::size_t i : grasps) targets.push_back(target_index(problem_, problem_.grasps[i].target));
  conservation_.touch(targets);
}

// A sample outside an integration.
void RunMonitor::instant(const CaptureSystem& system, const State& state, double time) {
  instant(system, state, forward_kinematics(system.model, state), time, {});
}

// System at one instant between phases => conservation, wheel and gyro checks and, with a recorder, one row of the time
// series with zero motor efforts.
void RunMonitor::instant(const CaptureSystem& system, const State& state, const Kinematics& kinematics, double time,
                         std::span<const GraspSample> grasps) {
  const ConservedQuantities quantities = conserved_quantities(system.model, kinematics, state);
  conservation_.instant(quantities);
  observe_motion(system, state, {});
  last_check_ = time;
  if (!recorder_) return;
  const std::vector<double> zeros(system.model.joints().size(), 0.0);
  const PhaseIntegrals none;
  recorder_->sample({system,
                     kinematics,
                     quantities,
                     {time, state, none, zeros, zeros},
                     grasps,
                     watches_.instant(system, kinematics)});
}

void RunMonitor::impact(const std::string& phase, const ImpactOutcome& outcome) {
  conservation_.enter(outcome.from_ground);
  impact_checks_.note(outcome.residuals);
  loads_.impact(phase, outcome.report, outcome.joint_peaks);
}

void RunMonitor::begin_impact_in_time(const std::string& phase, const CaptureSystem& system, const State& start,
                                      double begin, const std::vector<std::size_t>& closing, std::vector<bool> opened) {
  // Checked if the approach was: not if only the impact is simulated.
  impact_ = {&system, begin, closing, watches_.watching()};
  if (impact_.watched) {
    watches_.begin_phase(phase, system, false, std::move(opened));
    watches_.sample(begin, start, {});
  }
  std::vector<std::string> end_effectors;
  for (const HeldGrasp& grasp : system.grasps) end_effectors.push_back(problem_.grasps[grasp.grasp].end_effector);
  loads_.begin_held(phase, begin, end_effectors);
}

void RunMonitor::check_in_impact(const CompliantSample& sample) {
  conservation_.enter(sample.from_ground);
  if (impact_.watched) watches_.sample(impact_.begin + sample.time, sample.state, {});
  if (observers_.contacts) observers_.contacts->set_instant(sample.contacts);
  sample_yielding(sample);
  if (observers_.contacts) observers_.contacts->set_instant({});
  loads_.check_held_bodies(sample);
}

void RunMonitor::end_impact_in_time(const Momentumd& from_ground) {
  if (impact_.watched) watches_.end_phase();
  loads_.end_held();
  conservation_.enter(from_ground);
}

void RunMonitor::add_contacts(const ImpactShapes& shapes, double end) {
  if (observers_.contacts) observers_.contacts->add_impact(shapes, end);
}

void RunMonitor::add_hard_impact(const ContactSet& contacts, double time, double exchanged) {
  if (observers_.contacts) observers_.contacts->add_hard_impact(contacts, time, exchanged);
}

// A sample of a compliant impact, with the wrenches of closing grasps and of those that already hold.
void RunMonitor::sample_yielding(const CompliantSample& sample) {
  const CaptureSystem& system = *impact_.system;
  std::vector<GraspSample> grasps;
  if (recorder_) {
    grasps.resize(problem_.grasps.size());
    const auto hold = [&](std::size_t grasp, const Wrenchd& F_WC) {
      grasps[grasp].holds = true;
      grasps[grasp].F_WC = F_WC;
    };
    for (std::size_t i = 0; i < impact_.closing.size(); ++i) hold(impact_.closing[i], sample.grasp_wrenches[i]);
    for (std::size_t i = 0; i < system.grasps.size(); ++i) hold(system.grasps[i].grasp, sample.held_wrenches[i]);
  }
  instant(system, sample.state, sample.kinematics, impact_.begin + sample.time, grasps);
}

// --- The end ---

// Monitors => ledger rows, reports and warnings in the result; adds advice if a conservation check failed.
void RunMonitor::write() {
  impact_checks_.write(result_.ledger);
  conservation_.write(result_.ledger);
  if (result_.impact()) scale_published(result_.ledger.scale, result_.impacts.front());
  loops_.write(result_);
  loads_.write(result_);
  for (const auto& observer : observers_.all) observer->write(result_);
  joints_.write(result_);
  watches_.add(loads_.take_events());
  watches_.write(result_);
  saturation_.write(end_, result_);
  stability_.write(result_);
  if (!result_.ledger.pass()) advise(problem_, conservation_.cause(), result_.ledger);
}

}  // namespace grapnel
