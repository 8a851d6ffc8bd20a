#include "grapnel/linear/operating_point.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "grapnel/control/joint_law.hpp"
#include "grapnel/problem/enumeration_names.hpp"
#include "grapnel/simulate/replay_controller.hpp"
#include "grapnel/spatial/decompositions.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

// Per velocity: whether its tree is connected neither directly nor through others with the base's.
std::vector<std::uint8_t> velocities_elsewhere(const Model& model, const PhaseSetup& setup, int base) {
  const std::vector<Body>& bodies = model.bodies();
  std::vector<int> group(bodies.size());
  for (std::size_t i = 0; i < bodies.size(); ++i) group[i] = bodies[i].root;
  const auto join = [&](int a, int b) {
    const int from = group[static_cast<std::size_t>(b)], to = group[static_cast<std::size_t>(a)];
    std::replace(group.begin(), group.end(), from, to);
  };
  for (const LoopClosure& closure : setup.closures) join(closure.body_a, closure.body_b);
  for (const GraspSlip& slip : setup.slips) join(slip.body_a, slip.body_b);
  std::vector<std::uint8_t> elsewhere(static_cast<std::size_t>(model.velocities()), 0);
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (group[i] == group[static_cast<std::size_t>(base)]) continue;
    for (int k = 0; k < velocity_count(bodies[i].description.joint.type); ++k) elsewhere[bodies[i].v + k] = 1;
  }
  return elsewhere;
}

}  // namespace

bool shapes_touch(const OperatingPoint& point) {
  ContactSet* contacts = point.setup().contacts.get();
  if (!contacts) return false;
  const Kinematics kinematics = forward_kinematics(point.model(), point.state);
  contacts->begin(point.time, kinematics);
  std::vector<ExternalWrench> wrenches;
  wrenches.reserve(contacts->most_wrenches());
  contacts->evaluate(kinematics, wrenches);
  return contacts->touches();
}

bool is_same_time(double a, double b) { return std::abs(a - b) <= 1e-9 * std::max(1.0, std::abs(b)); }

const MotionTask& task_at(CaptureSteps& steps, double time) {
  if (!(time >= 0) || !std::isfinite(time)) throw LinearizeError("the time must be at least 0 s");
  steps.pause_at(time);
  const MotionTask* task = nullptr;
  double begun = 0;
  while ((task = steps.next()) != nullptr) {
    begun = task->begin;
    if (task->begin >= time || is_same_time(task->begin, time)) break;
  }
  if (!task) {
    const CaptureResult result = steps.finish();
    if (result.status != CaptureStatus::completed)
      throw LinearizeError(fmt::format("the simulation fails before t = {:.9g} s: {}", time, result.failure));
    throw LinearizeError(fmt::format(
        "no motion follows t = {:.9g} s: the last motion segment begins at {:.9g} s; choose an earlier time", time,
        begun));
  }
  if (!is_same_time(task->begin, time))
    throw LinearizeError(
        fmt::format("t = {:.9g} s is within an impact: the next motion begins at {:.9g} s; choose another time", time,
                    task->begin));
  return *task;
}

OperatingPoint::OperatingPoint(const CaptureProblem& the_problem, const MotionTask& the_task)
    : problem(the_problem), task(&the_task), time(the_task.begin), interval_end(the_task.end), state(the_task.start) {
  base = model().body_index(problem.robot.base);
  elsewhere = velocities_elsewhere(model(), setup(), base);
}

std::string phase_of(const CaptureProblem& problem, const std::string& segment) {
  std::vector<std::string> names{"approach"};
  for (std::size_t k = 0; k < problem.post_impact.size(); ++k) names.push_back(phase_name(problem, k));
  for (const std::string& name : names) {
    if (segment == name) return name;
  }
  for (const std::string& name : names) {
    if (segment.starts_with(name + "_")) return name;
  }
  return segment;
}

// --- Laws ---

namespace {

// The scenario's name of a law that moves all joints, or "controller".
std::string name_of_controller(const OperatingPoint& point) {
  const CaptureProblem& problem = point.problem;
  const std::string phase = point.phase();
  for (std::size_t k = 0; k < problem.post_impact.size(); ++k) {
    if (phase == phase_name(problem, k)) return std::string(name_of(problem.post_impact[k].joints));
  }
  if (problem.approach) return std::string(law_of(problem.approach->tracking.mode).name_in_files);
  return "controller";
}

}  // namespace

LawsOfPoint laws_of(const OperatingPoint& point) {
  const PhaseSetup& setup = point.setup();
  LawsOfPoint laws;
  std::vector<std::pair<JointControl, std::size_t>> counts;
  for (const JointControlLaw& law : kJointControls) {
    const auto has_law = [&](const JointDrive& drive) { return drive.control == law.control; };
    const auto count = static_cast<std::size_t>(std::ranges::count_if(setup.drives, has_law));
    if (count > 0 && law.control != JointControl::free) counts.emplace_back(law.control, count);
  }
  for (const auto& [control, count] : counts) {
    const std::string joints = counted(count, "joint");
    if (control == JointControl::pd) laws.names.push_back("pd of " + joints);
    if (control == JointControl::computed_torque) laws.names.push_back("computed torque of " + joints);
    if (control == JointControl::controller) laws.names.push_back(name_of_controller(point) + " of " + joints);
    if (control == JointControl::prescribed)
      laws.notes.push_back(joints + " move exactly as prescribed: in the closed loop they do not deviate");
  }
  if (setup.attitude) laws.names.push_back("attitude control of the base");
  if (setup.commanded_root >= 0) laws.names.push_back("a controller of the base");
  const bool is_commanded = setup.commanded_root >= 0 || std::ranges::any_of(setup.drives, [](const JointDrive& drive) {
                              return drive.control == JointControl::controller;
                            });
  if (is_commanded && !dynamic_cast<const JointLawController*>(setup.controller.get())) {
    const auto& control = point.problem.control;
    laws.obstacle = dynamic_cast<const ReplayController*>(setup.controller.get()) ? "logged efforts are no feedback law"
                    : control && !control->plugin.empty() ? "the plugin " + in_quotes(control->plugin)
                    : control && !control->fmu.empty()    ? "the FMU " + in_quotes(control->fmu)
                                                          : "the controller of the calling program";
    if (!laws.obstacle.starts_with("logged")) laws.obstacle += " has an internal state that is not accessible";
  } else if (setup.attitude && setup.actuators.steering) {
    laws.obstacle = "control moment gyros give the torque of attitude control: the steering has no linear model";
  }
  if (!setup.gyros.empty()) laws.notes.push_back("gimbals are at rest, and rotors of gyros have a constant rate");
  if (setup.actuators.thrusters && !setup.actuators.dumping)
    laws.notes.push_back("thrusters give the mean torque that attitude control commands, without pulses or switching");
  if (setup.actuators.dumping) laws.notes.push_back("dumping of the wheels' momentum by thrusters is not contained");
  if (setup.sensors) laws.notes.push_back("controllers receive true values: sensors are not contained");
  if (setup.contacts) laws.notes.push_back("contacts between shapes, which are apart, are not contained");
  if (setup.law_model) laws.notes.push_back("controllers use their own model of the masses");
  return laws;
}

PhaseSetup setup_of_laws(const OperatingPoint& point) {
  PhaseSetup setup = point.setup();
  setup.clock.reset(), setup.channels.reset(), setup.sensors.reset(), setup.contacts.reset();
  setup.actuators.thrusters.reset(), setup.actuators.dumping.reset();
  setup.recover_roots = setup.project_loops = false;
  setup.loop_feedback = 0;
  return setup;
}

PhaseSetup setup_of_plant(const OperatingPoint& point, bool prescribed) {
  PhaseSetup setup = setup_of_laws(point);
  for (JointDrive& drive : setup.drives) {
    if (!prescribed || output_of(drive.control) != ControlOutput::motion) drive = {};
  }
  setup.attitude.reset(), setup.controller.reset(), setup.commanded_root = -1;
  setup.actuators = {}, setup.effectors.clear(), setup.wheels.clear(), setup.law_model.reset();
  return setup;
}

Eigen::VectorXd commands_at(const OperatingPoint& point) {
  PhaseSetup setup = setup_of_laws(point);
  setup.clock = point.setup().clock, setup.channels = point.setup().channels;
  return EvaluatedPhase(point, std::move(setup)).commands(point.state);
}

// --- Evaluation ---

EvaluatedPhase::EvaluatedPhase(const OperatingPoint& point, PhaseSetup setup)
    : time_(point.time), dynamics_(point.model(), std::move(setup)) {
  y_ = dynamics_.initial(point.state, time_);
  dydt_.resize(y_.size());
  dynamics_.begin_control(time_, point.interval_end);
  const std::vector<double> breaks = dynamics_.breaks(time_, point.interval_end);
  dynamics_.enter_interval(time_, breaks.empty() ? point.interval_end : breaks.front());
  dynamics_.choose_modes(time_, y_);
}

std::span<const double> EvaluatedPhase::numbers(const State& state) {
  std::copy(state.q.begin(), state.q.end(), y_.begin());
  std::copy(state.v.begin(), state.v.end(), y_.begin() + static_cast<std::ptrdiff_t>(state.q.size()));
  return y_;
}

Eigen::VectorXd EvaluatedPhase::accelerations(const State& state) {
  dynamics_(time_, numbers(state), dydt_);
  const auto from = static_cast<std::size_t>(dynamics_.model().coordinates());
  return Eigen::VectorXd::Map(dydt_.data() + from, dynamics_.model().velocities());
}

Eigen::VectorXd EvaluatedPhase::commands(const State& state) {
  const std::size_t joints = dynamics_.model().joints().size();
  std::vector<double> motor(joints), friction(joints);
  dynamics_.efforts(time_, numbers(state), motor, friction);
  Eigen::VectorXd commands = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(joints) + 3);
  commands.head(static_cast<Eigen::Index>(joints)) = as_vector(motor);
  if (!dynamics_.base().acts_from_outside()) return commands;
  for (int k = 0; k < 3; ++k) commands[static_cast<Eigen::Index>(joints) + k] = dynamics_.base().given()[k];
  return commands;
}

Eigen::Vector3d EvaluatedPhase::commanded_torque(const State& state) {
  commands(state);
  const Vector3d& torque = dynamics_.base().commanded_torque();
  return {torque[0], torque[1], torque[2]};
}

std::vector<std::uint8_t> EvaluatedPhase::prescribed() const {
  const Model& model = dynamics_.model();
  std::vector<std::uint8_t> found(static_cast<std::size_t>(model.velocities()), 0);
  const PhaseSetup& setup = dynamics_.setup();
  for (std::size_t j = 0; j < setup.drives.size(); ++j) {
    if (output_of(setup.drives[j].control) == ControlOutput::motion) found[model.joint_body(j).v] = 1;
  }
  for (int k = 0; k < 6 && setup.held_root >= 0; ++k) found[model.bodies()[setup.held_root].v + k] = 1;
  for (const int v : dynamics_.base().velocities().rate_controlled) found[v] = 1;
  for (const JointModes::Joint& joint : dynamics_.joint_modes().joints()) {
    if (joint.mode == JointModes::Mode::held) found[joint.v] = 1;
  }
  return found;
}

// --- Derivatives ---

Derivative derivative_of(MinimalCoordinates& coordinates, const std::function<Eigen::VectorXd(const State&)>& f) {
  constexpr int kSteps = 6;
  constexpr double kFirst = 1e-2, kRatio = 0.125, kRounding = 1e-15;
  const Eigen::Index n = coordinates.size();
  const Eigen::VectorXd here = f(coordinates.at());
  const Eigen::Index rows = here.size();
  // The differences of f and, below them, of x: their quotient is the derivative, whatever closing loops has added.
  Eigen::MatrixXd value(rows + n, n), error(rows + n, n);
  const auto difference = [&](Eigen::Index i, double step) {
    const State ahead = coordinates.moved(i, step), behind = coordinates.moved(i, -step);
    Eigen::VectorXd d(rows + n);
    d.head(rows) = f(ahead) - f(behind);
    d.tail(n) = coordinates.independent_of(coordinates.deviation(ahead) - coordinates.deviation(behind));
    return Eigen::VectorXd(d / (2 * step));
  };
  for (Eigen::Index i = 0; i < n; ++i) {
    double step = kFirst;
    for (int k = 0; k < kSteps; ++k, step *= kRatio) {
      const Eigen::VectorXd coarse = difference(i, step), fine = difference(i, 0.5 * step);
      for (Eigen::Index r = 0; r < rows + n; ++r) {
        const double size = r < rows ? std::abs(here[r]) : 0;
        const double estimate = std::abs(fine[r] - coarse[r]) / 3 + kRounding * (size / step + std::abs(fine[r]));
        if (k > 0 && !(estimate < error(r, i))) continue;
        error(r, i) = estimate;
        value(r, i) = (4 * fine[r] - coarse[r]) / 3;
      }
    }
  }
  if (!value.allFinite()) throw LinearizeError("accelerations or commands are not finite near the operating point");
  const Eigen::MatrixXd X = value.bottomRows(n);
  const Eigen::MatrixXd by_x =
      lu_solution(Eigen::MatrixXd(X.transpose()), Eigen::MatrixXd(value.topRows(rows).transpose())).transpose();
  return {by_x, error.topRows(rows)};
}

}  // namespace grapnel
