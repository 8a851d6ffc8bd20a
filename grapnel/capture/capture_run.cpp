#include "grapnel/capture/capture_run.hpp"

#include <fmt/format.h>
#include <algorithm>
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

void RunJoints::begin_post_impact(const RunBodies& bodies) {
  control_.post_impact_begin = bodies.time;
  control_.excursions.clear();
  for (const TendonSetup& tendon : problem_.robot.tendons)
    control_.excursions.push_back(Tendon{.arms = tendon_arms(tendon, bodies.system)}.excursion(bodies.state.q));
}

void RunJoints::control_attitude(const std::optional<BaseControlSetup>& setup, const RunBodies& bodies) {
  control_.attitude.reset();
  if (setup) control_.attitude = attitude_control(*setup, bodies.system, known_posture(bodies)).R_WD;
}

PhaseSetup RunJoints::setup(const RunBodies& bodies) {
  PhaseSetup setup = segment_setup(problem_, bodies.system, bodies.state, trajectories_, control_);
  setup.clock = clock_;
  hold_in_impacts(bodies, setup);
  if (setup.actuators.thrusters) setup.actuators.thrusters = thrusters_;
  if (setup.controller) return setup;  // by the law
  const auto is_commanded = [](const JointDrive& drive) { return drive.control == JointControl::controller; };
  if (setup.commanded_root >= 0 || std::any_of(setup.drives.begin(), setup.drives.end(), is_commanded))
    setup.controller = controller(bodies);
  return setup;
}

// Joints in impacts of hard contacts, by impact.joints; free without it.
void RunJoints::hold_in_impacts(const RunBodies& bodies, PhaseSetup& setup) const {
  if (!problem_.impact) return;
  const ImpactSetup::Joints joints = problem_.impact->joints;
  for (std::size_t j = 0; j < size(); ++j) {
    if (follows_others(joint_body(bodies.system, j))) continue;
    const int v = joint_body(bodies.system, j).v;
    if (joints == ImpactSetup::Joints::driven) setup.driven_in_impacts.push_back(v);
    if (joints == ImpactSetup::Joints::braked) setup.braked_in_impacts.push_back(v);
  }
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
  return approaching() || efforts_are_cut() || problem_.post_impact->base_control.has_value() ||
         !problem_.post_impact->tendons.empty();
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

std::vector<HeldRate> RunJoints::prescribed_rates(const RunBodies& bodies) const {
  std::vector<HeldRate> rates = coupling_rates(bodies.free.model);
  for (std::size_t j = 0; j < size(); ++j) {
    const Body& body = joint_body(bodies.free, j);
    const bool settled = !approaching() || is_settled(j);
    const JointControl control = !settled               ? problem_.approach->tracking.mode
                                 : problem_.post_impact ? control_of(problem_.post_impact->joints)
                                                        : JointControl::free;
    const bool pulled =
        problem_.post_impact && is_pulled(problem_.robot, *problem_.post_impact, body.description.joint.name);
    if (follows_others(body) || pulled || output_of(control) != ControlOutput::motion) continue;
    rates.push_back({body.v, bodies.state.v[body.v]});
  }
  return rates;
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

std::vector<HeldGrasp> RunBodies::holding() const {
  std::vector<HeldGrasp> all = held;
  for (const RunSlip& slip : slips) {
    if (slip.grasp.has_closure) all.push_back({slip.grasp.grasp, slip.grasp.frames});
  }
  return all;
}

void CaptureRun::to_free() {
  if (bodies.system.grasps.empty() && bodies.system.slips.empty()) return;
  bodies.state = take_apart(bodies.free, bodies.system, bodies.state);
  bodies.system = bodies.free;
  monitor.set_system(bodies.system);
}

void CaptureRun::to_joined() {
  if (bodies.held.empty() && bodies.slips.empty()) return;
  std::vector<SlippingGrasp> slips;
  for (const RunSlip& slip : bodies.slips) slips.push_back(slip.grasp);
  CapturedSystem joined = join_targets(bodies.free, bodies.state, bodies.held, slips);
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

}  // namespace grapnel
