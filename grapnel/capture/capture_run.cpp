#include "grapnel/capture/capture_run.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "grapnel/capture/elastic_report.hpp"
#include "grapnel/control/plugin_controller.hpp"
#include "grapnel/impact/plastic_impact.hpp"
#include "grapnel/model/coupling.hpp"
#include "grapnel/simulate/replay_controller.hpp"

namespace grapnel {

const Body& joint_body(const CaptureSystem& system, std::size_t joint) {
  return system.model.joint_body(system.robot_joints[joint]);
}

// --- Motion of the joints ---

// Problem, bodies => sampling clock and thruster bank where the problem has them; no joint is settled. Throws
// CaptureProblemError if an external controller is required and none is provided.
RunJoints::RunJoints(const CaptureProblem& problem, const RunBodies& bodies, const MovingFrame& frame)
    : problem_(problem), frame_(frame) {
  if (problem.control)
    clock_ = std::make_shared<ControlClock>(problem.control->timing, bodies.system.robot_joints.size());
  if (problem.control && problem.control->external && !problem.control->source)
    throw CaptureProblemError(
        "control.external: the calling program must provide the controller, as Problem.simulate(controller=...) of the "
        "Python module does, but it provided none");
  thrusters_ = make_thruster_bank(problem.robot);
  control_.approaching = problem.approach.has_value();
  control_.settled.assign(bodies.system.robot_joints.size(), false);
  control_.hold.assign(bodies.system.robot_joints.size(), 0);
}

bool RunJoints::settle_to(PostImpactSetup::Joints joints) const {
  return problem_.post_impact && problem_.post_impact->joints == joints;
}

// Laws that hold a posture take their set points from sensor readings, if there are sensors.
State RunJoints::known_posture(const RunBodies& bodies) const {
  return sensors_ ? sensors_->known_posture(bodies.system, bodies.state, bodies.time) : bodies.state;
}

void RunJoints::settle(const RunBodies& bodies, const State& known, std::size_t joint) {
  control_.settled[joint] = true;
  control_.hold[joint] = known.q[joint_body(bodies.system, joint).q];
}

void RunJoints::settle_all(const RunBodies& bodies) {
  control_.approaching = false;
  const State known = known_posture(bodies);
  for (std::size_t j = 0; j < size(); ++j) settle(bodies, known, j);
}

// Phase before, bodies => positions that the joints hold in the next phase: the reference, if both phases follow one;
// otherwise the known positions.
void RunJoints::next_phase(const PostImpactSetup& before, const RunBodies& bodies) {
  using Joints = PostImpactSetup::Joints;
  const auto follows = [](Joints joints) {
    return joints == Joints::pd || joints == Joints::computed_torque || joints == Joints::controller;
  };
  const bool still_follows = follows(before.joints) && follows(problem_.post_impact->joints);
  const State known = known_posture(bodies);
  for (std::size_t j = 0; j < size(); ++j) {
    if (still_follows)
      control_.hold[j] = evaluate(settled_trajectory(before, control_, j), bodies.time).position;
    else
      settle(bodies, known, j);
  }
}

void RunJoints::settle_arm(const RunBodies& bodies, std::size_t grasp) {
  const Model& model = bodies.system.model;
  const State known = known_posture(bodies);
  int body = model.frames()[model.frame_index(problem_.grasps[grasp].end_effector)].body;
  for (; body >= 0; body = model.bodies()[body].parent) {
    for (std::size_t j = 0; j < size(); ++j) {
      if (model.joints()[bodies.system.robot_joints[j]] == body) settle(bodies, known, j);
    }
  }
}

void RunJoints::control_attitude(const std::optional<BaseControlSetup>& setup, const RunBodies& bodies) {
  control_.attitude.reset();
  if (setup) control_.attitude = attitude_control(*setup, bodies.system, known_posture(bodies)).R_WD;
}

PhaseSetup RunJoints::setup(const RunBodies& bodies) {
  PhaseSetup setup = segment_setup(problem_, bodies.system, bodies.state, trajectories_, control_);
  setup.clock = clock_;
  if (setup.actuators.thrusters) setup.actuators.thrusters = thrusters_;
  if (setup.controller) return setup;  // by the law
  const auto is_commanded = [](const JointDrive& drive) { return drive.control == JointControl::controller; };
  if (setup.commanded_root >= 0 || std::any_of(setup.drives.begin(), setup.drives.end(), is_commanded))
    setup.controller = controller(bodies);
  return setup;
}

// The plugin, which is created once per run.
std::shared_ptr<Controller> RunJoints::controller(const RunBodies& bodies) {
  if (controller_) return controller_;
  const ControlSetup& control = *problem_.control;
  if (control.log) {
    std::vector<std::string> names;
    for (std::size_t j = 0; j < size(); ++j) names.push_back(joint_body(bodies.free, j).description.joint.name);
    return controller_ = std::make_shared<ReplayController>(control.log, std::move(names), control.timing.period);
  }
  ControlledRobot robot = controlled_parts(problem_);
  robot.base = bodies.free.model.bodies()[bodies.free.base].description.name;
  for (std::size_t j = 0; j < size(); ++j) robot.joints.push_back(joint_body(bodies.free, j).description.joint.name);
  robot.gravity = problem_.gravity;
  robot.origin = frame_.origin, robot.velocity = frame_.velocity;
  if (control.source)
    return controller_ = control.source->make(control.timing, control.parameters, std::move(robot), bodies.free.model);
  controller_ = std::make_shared<PluginController>(open_plugin(control.file, control.plugin), control.timing,
                                                   control.parameters, std::move(robot), bodies.free.model);
  return controller_;
}

PhaseSetup RunJoints::exact_approach(const RunBodies& bodies) const {
  return approach_setup(problem_, bodies.system, bodies.state, trajectories_, true);
}

bool RunJoints::are_controlled() const {
  return approaching() || efforts_are_cut() || problem_.post_impact->base_control.has_value();
}

bool RunJoints::efforts_are_cut() const {
  if (!approaching() && !problem_.post_impact) return false;
  return works_by_effort(
      output_of(approaching() ? problem_.approach->tracking.mode : control_of(problem_.post_impact->joints)));
}

std::vector<JointTrajectory> RunJoints::references() const {
  const MotionPhases& post = problem_.post_impact;
  if (!approaching() && !(post && moves_afterwards(*post))) return {};
  std::vector<JointTrajectory> joints = trajectories_;
  joints.resize(size());
  for (std::size_t j = 0; j < joints.size(); ++j) {
    if (is_settled(j))
      joints[j] = post ? settled_trajectory(*post, control_, j) : JointTrajectory::at_rest(control_.hold[j]);
  }
  return joints;
}

std::vector<HeldRate> RunJoints::driven_rates(const RunBodies& bodies) const {
  std::vector<HeldRate> held;
  if (!approaching() || problem_.approach->tracking.mode != JointControl::prescribed) return held;
  for (std::size_t j = 0; j < size(); ++j) {
    const Body& body = joint_body(bodies.free, j);
    if (!is_settled(j) && !follows_others(body)) held.push_back({body.v, bodies.state.v[body.v]});
  }
  return held;
}

// Bodies => held rates of an impact in the free system (docs/theory, section 7): couplings and fast modes first, then
// joints that follow their reference exactly, springs that count as rigid, and other joints by impact.joints (current
// rate, or zero if braked); dependent joints have no drive. None under impedance.
std::vector<HeldRate> RunJoints::rates_in_impact(const RunBodies& bodies) const {
  const ImpactSetup::Joints joints = problem_.impact->joints;
  if (joints == ImpactSetup::Joints::impedance) return {};
  std::vector<HeldRate> held = driven_rates(bodies);
  if (problem_.impact->modes == ImpactSetup::Modes::none) {
    for (const int body : bodies.free.model.springs()) {
      const int v = bodies.free.model.bodies()[body].v;
      held.push_back({v, bodies.state.v[v]});
    }
  }
  if (joints == ImpactSetup::Joints::free) return with_rows(bodies, std::move(held));
  const std::size_t driven = held.size();
  for (std::size_t j = 0; j < size(); ++j) {
    if (follows_others(joint_body(bodies.free, j))) continue;
    const int v = joint_body(bodies.free, j).v;
    const auto end = held.begin() + static_cast<std::ptrdiff_t>(driven);
    if (std::any_of(held.begin(), end, [&](const HeldRate& h) { return h.velocity == v; })) continue;
    held.push_back({v, joints == ImpactSetup::Joints::braked ? 0.0 : bodies.state.v[v]});
  }
  return with_rows(bodies, std::move(held));
}

std::vector<HeldRate> RunJoints::with_rows(const RunBodies& bodies, std::vector<HeldRate> held) const {
  const ImpactSetup& impact = *problem_.impact;
  std::vector<HeldRate> all = coupling_rates(bodies.free.model);
  if (impact.modes == ImpactSetup::Modes::slow)  // not with couplings
    all = rates_of_fast_modes(bodies.free.model, bodies.state, held, 1 / impact.duration);
  all.insert(all.end(), std::make_move_iterator(held.begin()), std::make_move_iterator(held.end()));
  return all;
}

// --- The run ---

namespace {

bool reads_sensors(const CaptureProblem& problem) {
  return problem.control && (problem.sensors || (problem.post_impact && problem.post_impact->identify));
}

std::vector<std::string> names_of_phases(const CaptureProblem& problem) {
  std::vector<std::string> names;
  for (std::size_t k = 0; k < problem.post_impact.size(); ++k) names.push_back(phase_name(problem, k));
  return names;
}

}  // namespace

// Problem, frame of the computation => state of a run before its first phase; `result` receives the reports. With
// several phases after the impact the run owns a copy of the problem, which it changes from phase to phase.
CaptureRun::CaptureRun(const CaptureProblem& the_problem, const MovingFrame& the_frame, CaptureDetail the_detail,
                       CaptureProgress the_progress, SeriesSink* sink, CaptureResult& the_result)
    : staged_(the_problem.post_impact.size() > 1 ? std::make_unique<CaptureProblem>(the_problem) : nullptr),
      phase_names_(names_of_phases(the_problem)),
      problem(staged_ ? *staged_ : the_problem),
      frame(the_frame),
      detail(the_detail),
      progress(std::move(the_progress)),
      result(the_result),
      bodies(problem),
      joints(problem, bodies, frame),
      schedule(problem),
      contacts(problem, bodies.free),
      law(problem),
      identification(problem),
      sensors(reads_sensors(problem) ? std::make_shared<SensorRun>(problem, identification) : nullptr),
      monitor(problem, bodies.free, frame, {detail, sink, sensors.get()}, result) {
  joints.observe(sensors.get());
}

bool CaptureRun::next_motion_phase() {
  if (motion_phase_ + 1 >= phase_names_.size()) return false;
  ++motion_phase_;
  staged_->post_impact.erase(staged_->post_impact.begin());
  part_.reset();
  return true;
}

std::string CaptureRun::next_name(const std::string& phase) {
  const int count = ++segment_counts_[phase];
  return count == 1 ? phase : fmt::format("{}_{}", phase, count);
}

void CaptureRun::to_free() {
  if (bodies.system.grasps.empty()) return;
  bodies.state = take_apart(bodies.free, bodies.system, bodies.state);
  bodies.system = bodies.free;
  monitor.set_system(bodies.system);
}

void CaptureRun::to_joined() {
  if (bodies.held.empty()) return;
  CapturedSystem joined = join_targets(bodies.free, bodies.state, bodies.held);
  bodies.system = std::move(joined.system);
  bodies.state = std::move(joined.state);
  monitor.set_system(bodies.system);
}

Momentumd CaptureRun::momentum_about_origin() const {
  return momentum_about(bodies.free.model, forward_kinematics(bodies.free.model, bodies.state), Vector3d::zero());
}

// Problems are large: with all its grasps it is returned without a copy.
const CaptureProblem& CaptureRun::with_grasps(const std::vector<std::size_t>& grasps) {
  bool all = grasps.size() == problem.grasps.size();
  for (std::size_t i = 0; all && i < grasps.size(); ++i) all = grasps[i] == i;
  if (all) return problem;
  if (!part_) {
    part_.emplace(problem);
    part_grasps_.clear();
    part_->grasps.clear();
  }
  if (part_grasps_ == grasps) return *part_;
  part_grasps_ = grasps;
  part_->grasps.clear();
  for (std::size_t i : grasps) part_->grasps.push_back(problem.grasps[i]);
  return *part_;
}

PhaseEnd CaptureRun::describe_now() const {
  PhaseEnd end = describe(problem, bodies.system, bodies.state, bodies.time);
  to_world(frame, end);
  return end;
}

namespace {

// An envelope's excess below this counts as met, as in decide_grasps().
constexpr double kExcessTolerance = 1e-9;
// An envelope's excess from which on an end-effector counts as outside.
constexpr double kOutside = 1e-6;
// A grasp that closes and opens more often is rejected: its events may accumulate.
constexpr int kMaxClosings = 1000;

double largest(const std::vector<double>& values, const std::vector<std::size_t>& of) {
  double most = -1;
  for (std::size_t i : of) most = std::max(most, values[i]);
  return most;
}

}  // namespace

GraspSchedule::GraspSchedule(const CaptureProblem& problem)
    : problem_(problem),
      outcomes_(problem.grasps.size()),
      open_since_(outcomes_.size(), 0),
      departed_(outcomes_.size(), false) {}

bool GraspSchedule::is_now(double t, double now) { return std::abs(t - now) <= 1e-9 * std::max(1.0, now); }

std::vector<std::size_t> GraspSchedule::undecided(GraspSetup::Closes how) const {
  std::vector<std::size_t> grasps;
  for (std::size_t i = 0; i < outcomes_.size(); ++i) {
    if (!outcomes_[i] && problem_.grasps[i].closes == how) grasps.push_back(i);
  }
  return grasps;
}

bool GraspSchedule::is_open(std::size_t grasp) const {
  return outcomes_[grasp] && (!outcomes_[grasp]->captured || outcomes_[grasp]->released);
}

// Whether an open grasp waits for its end-effector's return.
bool GraspSchedule::waits_again(std::size_t grasp) const {
  return problem_.grasps[grasp].closes_again_on_arrival && is_open(grasp);
}

// Whether a later closing time of an open grasp has passed since it opened.
bool GraspSchedule::is_due_again(std::size_t grasp, double now) const {
  return is_open(grasp) && std::ranges::any_of(problem_.grasps[grasp].closes_again_at, [&](double t) {
           const double since = open_since_[grasp];
           return t > since && !is_now(t, since) && (t <= now || is_now(t, now));
         });
}

void GraspSchedule::open(std::size_t grasp, double time) { open_since_[grasp] = time, departed_[grasp] = false; }

std::vector<std::size_t> GraspSchedule::due_at(double now) const {
  std::vector<std::size_t> due = undecided(GraspSetup::Closes::at_time);
  // Earlier ones, too: a compliant impact may have passed them.
  std::erase_if(due, [&](std::size_t i) {
    return problem_.grasps[i].closes_at > now && !is_now(problem_.grasps[i].closes_at, now);
  });
  for (std::size_t i = 0; i < outcomes_.size(); ++i) {
    if (is_due_again(i, now)) due.push_back(i);
  }
  return due;
}

std::vector<std::size_t> GraspSchedule::due_together(double now) const {
  std::vector<std::size_t> due = undecided(GraspSetup::Closes::together);
  for (std::size_t i : due_at(now)) due.push_back(i);
  std::sort(due.begin(), due.end());
  return due;
}

std::vector<std::size_t> GraspSchedule::arrived(const CaptureSystem& system, const State& state) const {
  std::vector<std::size_t> waiting = undecided(GraspSetup::Closes::on_arrival);
  for (std::size_t i = 0; i < outcomes_.size(); ++i) {
    if (waits_again(i) && departed_[i]) waiting.push_back(i);
  }
  if (waiting.empty()) return waiting;
  const std::vector<double> excess = envelope_excesses(problem_, system, forward_kinematics(system.model, state));
  std::erase_if(waiting, [&](std::size_t i) { return !(excess[i] <= kExcessTolerance); });
  return waiting;
}

std::vector<bool> GraspSchedule::awaited_targets() const {
  std::vector<bool> awaited(problem_.targets.size(), false);
  for (const std::size_t i : undecided(GraspSetup::Closes::when_settled))
    awaited[target_index(problem_, problem_.grasps[i].target)] = true;
  return awaited;
}

std::vector<std::size_t> GraspSchedule::settled(const StageMonitor& stages) const {
  std::vector<std::size_t> grasps = undecided(GraspSetup::Closes::when_settled);
  std::erase_if(grasps,
                [&](std::size_t i) { return !stages.is_settled(target_index(problem_, problem_.grasps[i].target)); });
  return grasps;
}

void GraspSchedule::note_departures(const CaptureSystem& system, const State& state) {
  std::vector<std::size_t> staying;
  for (std::size_t i = 0; i < outcomes_.size(); ++i) {
    if (waits_again(i) && !departed_[i]) staying.push_back(i);
  }
  if (staying.empty()) return;
  const std::vector<double> excess = envelope_excesses(problem_, system, forward_kinematics(system.model, state));
  for (const std::size_t i : staying) departed_[i] = excess[i] > 0.9 * kOutside;  // located to within rounding
}

bool GraspSchedule::together_in_envelopes(const CaptureSystem& system, const State& state) const {
  const std::vector<std::size_t> together = undecided(GraspSetup::Closes::together);
  if (together.empty()) return false;
  return largest(envelope_excesses(problem_, system, forward_kinematics(system.model, state)), together) <=
         kExcessTolerance;
}

// System, whether the group counts => function of time and state: minimum excess over the capture envelopes, at most
// zero when a waiting grasp or the whole group is within them, or an open grasp leaves its own; empty if no grasp
// waits.
StopCondition GraspSchedule::stop_condition(const CaptureSystem& system, bool together) const {
  std::vector<std::size_t> waiting = undecided(GraspSetup::Closes::on_arrival), group, staying;
  for (std::size_t i = 0; i < outcomes_.size(); ++i) {
    if (waits_again(i)) (departed_[i] ? waiting : staying).push_back(i);
  }
  if (together) group = undecided(GraspSetup::Closes::together);
  if (waiting.empty() && group.empty() && staying.empty()) return {};
  return [this, &system, waiting, group, staying, kinematics = Kinematics(system.model)](double,
                                                                                         const State& state) mutable {
    forward_kinematics(system.model, state, kinematics);
    const std::vector<double> excess = envelope_excesses(problem_, system, kinematics);
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i : waiting) least = std::min(least, excess[i]);
    for (std::size_t i : staying) least = std::min(least, kOutside - excess[i]);
    if (!group.empty()) least = std::min(least, largest(excess, group));
    return least;
  };
}

std::vector<double> GraspSchedule::stated_times() const {
  std::vector<double> times;
  for (std::size_t i : undecided(GraspSetup::Closes::at_time)) times.push_back(problem_.grasps[i].closes_at);
  for (std::size_t i = 0; i < outcomes_.size(); ++i) {
    const std::vector<double>& again = problem_.grasps[i].closes_again_at;
    if (is_open(i)) times.insert(times.end(), again.begin(), again.end());
  }
  return times;
}

bool GraspSchedule::any_left() const {
  for (std::size_t i = 0; i < outcomes_.size(); ++i) {
    if (is_open(i) && closes_again(problem_.grasps[i])) return true;
  }
  using Closes = GraspSetup::Closes;
  return std::ranges::any_of(std::array{Closes::at_time, Closes::on_arrival, Closes::when_settled},
                             [&](Closes how) { return !undecided(how).empty(); });
}

GraspOutcome GraspSchedule::outcome(std::size_t grasp, bool captured, const std::string& reason, double time,
                                    const GraspDeviation& deviation) const {
  const GraspSetup& g = problem_.grasps[grasp];
  GraspOutcome outcome;
  outcome.end_effector = g.end_effector, outcome.target = g.target, outcome.grasp_point = g.grasp_point;
  outcome.captured = captured, outcome.reason = reason, outcome.time = time;
  outcome.distance = deviation.position, outcome.angle = deviation.angle;
  outcome.velocity = deviation.velocity, outcome.angular_velocity = deviation.angular_velocity;
  return outcome;
}

// Due grasps and state at `time` [s] => grasps that close, by their capture envelopes (docs/theory, section 6.5);
// records the outcome of each and the time of the first decision.
std::vector<std::size_t> GraspSchedule::decide(const std::vector<std::size_t>& grasps, const CaptureSystem& system,
                                               const State& state, double time) {
  std::vector<std::size_t> closing;
  if (grasps.empty()) return closing;
  if (!first_time_) first_time_ = time;
  const std::vector<GraspDecision> decisions = decide_grasps(problem_, system, forward_kinematics(system.model, state));
  for (std::size_t i : grasps) {
    const GraspDecision& d = decisions[i];
    const GraspOutcome before = outcomes_[i].value_or(GraspOutcome{});
    outcomes_[i] = outcome(i, d.captured, d.reason, time, d.deviation);
    outcomes_[i]->judged = d.judged, outcomes_[i]->limiting = d.limiting;
    outcomes_[i]->largest_load = before.largest_load, outcomes_[i]->largest_load_time = before.largest_load_time;
    outcomes_[i]->closings = before.closings + d.captured;
    if (d.captured) {
      closing.push_back(i);
    } else {
      outcomes_[i]->lost = before.lost;
      open(i, time);
    }
  }
  return closing;
}

void GraspSchedule::refuse(const std::vector<std::size_t>& grasps, const std::string& reason) {
  for (std::size_t i : grasps) {
    outcomes_[i]->closings -= outcomes_[i]->captured;
    outcomes_[i]->captured = false, outcomes_[i]->reason = reason;
    open(i, outcomes_[i]->time);
  }
}

void GraspSchedule::release(std::size_t grasp, double time) {
  outcomes_[grasp]->released = time;
  open(grasp, time);
}

void GraspSchedule::lose(const HoldLoad& load, bool in_impact) {
  GraspOutcome& outcome = *outcomes_[load.grasp];
  const GraspLimits& limits = *problem_.grasps[load.grasp].holds;
  const auto part = [](const char* name, double value, double limit, const char* unit) {
    return std::isfinite(limit) ? fmt::format("{} {:.4g} of {:.4g} {}", name, value, limit, unit)
                                : fmt::format("{} {:.4g} {}", name, value, unit);
  };
  outcome.captured = false, outcome.lost = load.time;
  outcome.reason =
      fmt::format("lost at t = {:.6g} s{}: {}, {}", load.time, in_impact ? ", in an impact" : "",
                  part("force", load.force, limits.force, "N"), part("moment", load.moment, limits.moment, "N m"));
  note_load(load);
  open(load.grasp, load.time);
  if (outcome.closings > kMaxClosings) {
    throw RunFailure(fmt::format("grasp of {}: it closes and is lost more than {} times up to t = {:.9g} s",
                                 outcome.end_effector, kMaxClosings, load.time));
  }
}

void GraspSchedule::note_load(const HoldLoad& load) {
  GraspOutcome& outcome = *outcomes_[load.grasp];
  if (outcome.largest_load && !(load.share > *outcome.largest_load)) return;
  outcome.largest_load = load.share, outcome.largest_load_time = load.time;
}

std::vector<bool> GraspSchedule::opened() const {
  std::vector<bool> opened;
  for (std::size_t i = 0; i < outcomes_.size(); ++i) opened.push_back(is_open(i));
  return opened;
}

void GraspSchedule::moved(std::size_t grasp, double distance) { outcomes_[grasp]->target_moved = distance; }

// The outcome of a grasp without a decision at the end of the run.
GraspOutcome GraspSchedule::undecided_outcome(std::size_t grasp, double end, const GraspDecision& at_end) const {
  const GraspSetup& g = problem_.grasps[grasp];
  const bool waits = g.closes == GraspSetup::Closes::on_arrival;
  if (g.closes == GraspSetup::Closes::when_settled)
    return outcome(grasp, false, "its target did not settle in the gripper before the run's end", end,
                   at_end.deviation);
  const double time = g.closes == GraspSetup::Closes::at_time ? g.closes_at : end;
  GraspOutcome missed =
      outcome(grasp, false,
              waits ? "did not come within its envelope before the run's end" : "the run ended before its closing time",
              time, at_end.deviation);
  if (waits) missed.judged = at_end.judged, missed.limiting = at_end.limiting;
  return missed;
}

// Time of the last check and final state => capture time and outcomes of all grasps in the result; undecided ones get
// their deviations at the end (NaN after a failure). Writes nothing if no grasp was due.
void GraspSchedule::write(double last_check, const CaptureSystem& system, const State& state,
                          CaptureResult& result) const {
  if (!first_time_ && undecided(GraspSetup::Closes::when_settled).empty()) return;
  result.capture_time = first_time_.value_or(last_check);
  const double end = std::max(result.capture_time, last_check);
  // After a failure the positions are unknown.
  GraspDecision unknown;
  unknown.deviation = {NAN, NAN, NAN, NAN};
  std::vector<GraspDecision> at_end(outcomes_.size(), unknown);
  const bool all_decided = std::all_of(outcomes_.begin(), outcomes_.end(), [](const auto& o) { return o.has_value(); });
  if (result.failure.empty() && !all_decided)
    at_end = decide_grasps(problem_, system, forward_kinematics(system.model, state));
  for (std::size_t i = 0; i < outcomes_.size(); ++i)
    result.grasps.push_back(outcomes_[i] ? *outcomes_[i] : undecided_outcome(i, end, at_end[i]));
}

}  // namespace grapnel
