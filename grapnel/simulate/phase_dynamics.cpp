#include "grapnel/simulate/phase_dynamics.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>

#include "grapnel/constraint/loop_limits.hpp"
#include "grapnel/simulate/arm_reaction.hpp"
#include "grapnel/simulate/joint_motor.hpp"
#include "grapnel/simulate/simulate_phase.hpp"

namespace grapnel {
namespace {

using namespace phase_integral;

double friction_force(const JointFriction& f, double rate) {
  return control_law::friction(true, f.viscous, f.coulomb != 0, f.coulomb, rate,
                               [&] { return std::tanh(rate / f.transition_rate); });
}

}  // namespace

PhaseIntegrals phase_integrals(std::span<const double> s) {
  const auto vector = [&](std::size_t at) { return Vector3d{s[at], s[at + 1], s[at + 2]}; };
  PhaseIntegrals integrals{
      s[kMotorWork], s[kFrictionWork], s[kExternalWork], {vector(kExternalMoment), vector(kExternalForce)}};
  for (std::size_t at = kWholeCount; at < s.size(); at += kTreeCount)
    integrals.trees.push_back({{vector(at + kTreeMoment), vector(at + kTreeForce)}, s[at + kTreeWork]});
  return integrals;
}

double break_resolution(double t0, double t1) {
  return 64 * std::numeric_limits<double>::epsilon() * std::max(std::abs(t0), std::abs(t1));
}

// Setup and interval => break times of trajectories, loads and clock, sorted from t0 to t1. Times nearer than
// break_resolution() to each other count once; those at the ends are omitted.
std::vector<double> phase_breaks(const PhaseSetup& setup, double t0, double t1) {
  const double resolution = break_resolution(t0, t1);
  const double first = std::min(t0, t1) + resolution, last = std::max(t0, t1) - resolution;
  std::vector<double> times;
  const auto add = [&](const std::vector<double>& more) {
    for (double t : more) {
      if (t > first && t < last) times.push_back(t);
    }
  };
  for (const JointDrive& drive : setup.drives) {
    if (drive.control != JointControl::free) add(break_times(drive.trajectory));
  }
  for (const ExternalLoad& load : setup.loads) add(break_times(load));
  if (setup.clock && t1 > t0) add(setup.clock->break_times(t0, t1));
  std::sort(times.begin(), times.end());
  const auto near = [&](double a, double b) { return b - a <= resolution; };
  times.erase(std::unique(times.begin(), times.end(), near), times.end());
  if (t1 < t0) std::reverse(times.begin(), times.end());
  return times;
}

PhaseDynamics::PhaseDynamics(const Model& model, PhaseSetup setup)
    : model_(model),
      setup_(std::move(setup)),
      workspace_(model),
      now_(zero_state(model)),
      reference_(model.joints().size()),
      desired_(model.joints().size()),
      sensed_(model.joints().size()),
      commanded_effort_(model.joints().size()),
      channel_of_(model.joints().size(), -1),
      motor_(model.joints().size()),
      friction_(model.joints().size()),
      spring_(model.joints().size()),
      force_(model.velocities()),
      prescribed_(model.velocities()),
      commanded_(model.velocities()),
      acceleration_(model.velocities()),
      vdot_(model.velocities()),
      wrenches_(setup_.loads.size() + (setup_.orbit ? model.bodies().size() : 0)),
      momenta_(free_root_count(model.tree())),
      drifted_(momenta_) {
  if (setup_.drives.empty()) setup_.drives.resize(model.joints().size());
  if (!setup_.closures.empty()) solver_.emplace(model_, setup_.closures);
  base_ = BaseActuation(model_, setup_.attitude, setup_.commanded_root, setup_.wheels, setup_.gyros, setup_.actuators,
                        setup_.clock);
  wrenches_.resize(wrenches_.size() + base_.thruster_count());
  if (setup_.law_model) {
    law_workspace_.emplace(*setup_.law_model);
    law_vdot_.resize(model.velocities());
    if (solver_) law_solver_.emplace(*setup_.law_model, setup_.closures);
  }
  check_and_classify();
}

// setup_ => flags per velocity (prescribed, commanded), joint modes, trees with their masses and which effects exist.
// Throws std::invalid_argument for the errors listed at the constructor.
void PhaseDynamics::check_and_classify() {
  const std::vector<Body>& bodies = model_.bodies();
  const auto is_free_root = [&](int body) {
    const Body& root = bodies.at(body);
    return root.parent < 0 && root.description.joint.type == JointType::free;
  };
  if (setup_.drives.size() != model_.joints().size()) {
    throw std::invalid_argument("PhaseDynamics: one drive per joint is needed");
  }
  for (std::size_t j = 0; j < setup_.drives.size(); ++j) {
    const JointDrive& drive = setup_.drives[j];
    validate(drive.trajectory);
    const Body& body = bodies[model_.joints()[j]];
    const bool is_computed = output_of(drive.control) == ControlOutput::acceleration;
    const bool is_prescribed = output_of(drive.control) == ControlOutput::motion;
    const JointFriction& friction = body.description.joint.friction;
    prescribed_[body.v] = is_prescribed;
    commanded_[body.v] = is_prescribed || is_computed;
    any_computed_ = any_computed_ || is_computed;
    has_friction_ = has_friction_ || (!is_prescribed && (friction.viscous > 0 || friction.coulomb > 0));
    const JointDescription& joint = body.description.joint;
    has_dampers_ = has_dampers_ || (joint.spring && joint.spring->damping > 0);
    has_friction_ = has_friction_ || (!is_prescribed && joint.spring && joint.spring->damping > 0);
    if (joint.motor || joint.limits.stop || friction.model == JointFriction::Model::sticking) measured_.push_back(j);
  }
  modes_ = JointModes(model_, prescribed_);
  told_.assign(motor_.size(), 0.0);
  at_rest_.assign(now_.v.size(), 0.0);
  if (setup_.held_root >= 0) {
    if (!is_free_root(setup_.held_root)) throw std::invalid_argument("PhaseDynamics: only a free root can be held");
    const int v = bodies[setup_.held_root].v;
    for (int k = 0; k < 6; ++k) prescribed_[v + k] = commanded_[v + k] = 1;
  }
  if (setup_.attitude && (!is_free_root(setup_.attitude->root) || setup_.attitude->root == setup_.held_root)) {
    throw std::invalid_argument("PhaseDynamics: only a free root that is not held can be under attitude control");
  }
  check_control();
  check_wheels();
  check_gyros();
  for (const ExternalLoad& load : setup_.loads) {
    validate(load);
    if (load.body < 0 || load.body >= static_cast<int>(bodies.size())) {
      throw std::invalid_argument("PhaseDynamics: the body of a load is not in the model");
    }
    if (load.frame == LoadFrame::orbit && !setup_.orbit) {
      throw std::invalid_argument("PhaseDynamics: a load is in the axes of an orbit, but no orbit is set");
    }
  }
  if (setup_.orbit) {
    if (const std::string fault = fault_of(*setup_.orbit); !fault.empty())
      throw std::invalid_argument("PhaseDynamics: the orbit: " + fault);
  }
  for (const Body& b : bodies) {
    if (b.parent < 0) trees_.emplace_back();
    tree_of_.push_back(b.parent < 0 ? trees_.size() - 1 : tree_of_[b.root]);
    trees_[tree_of_.back()].mass += b.description.mass;
  }
  has_external_ = setup_.held_root >= 0 || dot(setup_.gravity, setup_.gravity) > 0 || !setup_.loads.empty() ||
                  setup_.orbit.has_value() || base_.acts_from_outside() || base_.has_thrusters();
  for (const Body& b : bodies) {
    has_external_ = has_external_ || (b.parent < 0 && b.description.joint.type == JointType::fixed);
  }
}

// Checks the source of efforts and of the torque on a root, and the clock.
void PhaseDynamics::check_control() {
  has_controller_ = setup_.commanded_root >= 0;
  for (const JointDrive& drive : setup_.drives)
    has_controller_ = has_controller_ || output_of(drive.control) == ControlOutput::command;
  if (has_controller_ && !setup_.controller)
    throw std::invalid_argument("PhaseDynamics: joints or a root need a controller, but none is set");
  if (setup_.commanded_root >= 0) {
    const Body& root = model_.bodies().at(setup_.commanded_root);
    const bool is_free_root = root.parent < 0 && root.description.joint.type == JointType::free;
    if (!is_free_root || setup_.commanded_root == setup_.held_root || setup_.attitude)
      throw std::invalid_argument(
          "PhaseDynamics: a controller's torque can act only on a free root that is not held, without attitude "
          "control");
  }
  if (setup_.sensors && !setup_.clock)
    throw std::invalid_argument("PhaseDynamics: sensors need a clock, but none is set");
  if (setup_.law_model && (setup_.law_model->velocities() != model_.velocities() ||
                           setup_.law_model->bodies().size() != model_.bodies().size()))
    throw std::invalid_argument("PhaseDynamics: the structure of the laws' model differs");
  if (!setup_.clock) return;
  if (!setup_.channels) {
    setup_.channels.emplace(channel_of_.size());
    std::iota(setup_.channels->begin(), setup_.channels->end(), 0);
  }
  const std::vector<int>& channels = *setup_.channels;
  if (channels.size() != setup_.clock->channels())
    throw std::invalid_argument("PhaseDynamics: the number of the clock's channels differs");
  for (std::size_t c = 0; c < channels.size(); ++c) channel_of_.at(channels[c]) = static_cast<int>(c);
}

// Wheels are attached to the root that they turn, by joints without other drives.
void PhaseDynamics::check_wheels() {
  for (const ReactionWheel& wheel : setup_.wheels) {
    const Body& body = model_.bodies().at(model_.joints().at(wheel.joint));
    if (body.v != wheel.velocity || body.parent != base_.root() ||
        setup_.drives[wheel.joint].control != JointControl::free)
      throw std::invalid_argument("PhaseDynamics: a wheel must be on a free joint of the root that it turns");
  }
}

// setup_.gyros => their gimbal and rotor rates marked as prescribed. Throws std::invalid_argument unless each gyro is a
// rotor in a gimbal on the actuated root, both on free joints.
void PhaseDynamics::check_gyros() {
  for (const MomentGyro& gyro : setup_.gyros) {
    const int gimbal = model_.joints().at(gyro.gimbal), rotor = model_.joints().at(gyro.rotor);
    const Body &on_base = model_.bodies()[gimbal], &in_gimbal = model_.bodies()[rotor];
    if (on_base.v != gyro.gimbal_velocity || on_base.q != gyro.gimbal_coordinate ||
        in_gimbal.v != gyro.rotor_velocity || in_gimbal.parent != gimbal ||
        (base_.root() >= 0 && on_base.parent != base_.root()) ||
        setup_.drives[gyro.gimbal].control != JointControl::free ||
        setup_.drives[gyro.rotor].control != JointControl::free)
      throw std::invalid_argument("PhaseDynamics: a gyro must be a rotor in a gimbal of the root, on free joints");
    for (const int v : {gyro.gimbal_velocity, gyro.rotor_velocity}) prescribed_[v] = commanded_[v] = 1;
  }
}

Manifold PhaseDynamics::manifold() const {
  Manifold manifold;
  manifold.size = size();
  manifold.quaternions = model_.quaternions();
  manifold.controlled = size() - exchange_count();
  return manifold;
}

std::vector<double> PhaseDynamics::initial(const State& state, double t) {
  momenta_time_ = t;
  root_momenta<double>(model_.tree(), state.q, state.v, workspace_.kernel, momenta_);
  modes_.begin(state.q, state.v);
  hold_joints();
  std::vector<double> y(size(), 0.0);
  std::copy(state.q.begin(), state.q.end(), y.begin());
  std::copy(state.v.begin(), state.v.end(), y.begin() + model_.coordinates());
  return y;
}

// State, time and integrals so far => y of a phase that continues: the inverse of integrals(). Throws
// std::invalid_argument if the numbers of trees or measured joints differ.
std::vector<double> PhaseDynamics::initial(const State& state, double t, const PhaseIntegrals& integrals) {
  if (integrals.trees.size() != (has_external_ ? trees_.size() : 0) || integrals.joints.size() != measured_.size())
    throw std::invalid_argument("PhaseDynamics: the integrals belong to another phase");
  std::vector<double> y = initial(state, t);
  double* whole = y.data() + model_.coordinates() + model_.velocities();
  const auto put = [](const Vector3d& v, double* out) { std::copy(v.e, v.e + 3, out); };
  whole[kMotorWork] = integrals.motor_work, whole[kFrictionWork] = integrals.friction_work;
  whole[kExternalWork] = integrals.external_work;
  put(integrals.external_impulse.angular, whole + kExternalMoment);
  put(integrals.external_impulse.linear, whole + kExternalForce);
  double* at = whole + kWholeCount;
  for (const TreeIntegrals& tree : integrals.trees) {
    at[kTreeWork] = tree.work;
    put(tree.impulse.angular, at + kTreeMoment), put(tree.impulse.linear, at + kTreeForce);
    at += kTreeCount;
  }
  for (const JointIntegrals& joint : integrals.joints) {
    at[kJointMotor] = joint.motor_work, at[kJointFriction] = joint.friction_work, at[kJointCopper] = joint.copper_loss;
    at += kJointCount;
  }
  // Without them, the work of dampers is included in that of friction, which only one tree has.
  if (integrals.damper_work.size() == static_cast<std::size_t>(damper_integral_count()))
    std::copy(integrals.damper_work.begin(), integrals.damper_work.end(), at);
  at += damper_integral_count();
  for (const TreeExchange& tree : integrals.exchanged) {
    at[kExchangedImpulse] = tree.impulse, at[kExchangedMoment] = tree.angular_impulse, at[kExchangedWork] = tree.work;
    at += kExchangeCount;
  }
  return y;
}

// Reads the state from y and overwrites prescribed joints by their references.
void PhaseDynamics::load(double t, std::span<const double> y) {
  const int nq = model_.coordinates(), nv = model_.velocities();
  std::copy(y.begin(), y.begin() + nq, now_.q.begin());
  std::copy(y.begin() + nq, y.begin() + nq + nv, now_.v.begin());
  for (std::size_t j = 0; j < setup_.drives.size(); ++j) {
    const JointDrive& drive = setup_.drives[j];
    if (drive.control == JointControl::free) continue;
    const ControlOutput output = output_of(drive.control);
    if (output != ControlOutput::motion && !laws_command()) continue;
    JointPoint& reference = reference_[j];
    const JointPoint noise = drive.noise.at(t);
    desired_[j] = evaluate(drive.trajectory, t, inside_.value_or(t));
    reference = control_law::reference(output, desired_[j], noise);
    sensed_[j] = {noise.position, noise.rate, 0};
    if (output != ControlOutput::motion) continue;
    const Body& body = model_.bodies()[model_.joints()[j]];
    now_.q[body.q] = reference.position;
    now_.v[body.v] = reference.rate;
    acceleration_[body.v] = reference.acceleration;
  }
  base_.prescribe({now_.v, prescribed_, commanded_, acceleration_});
  for (const JointModes::Joint& joint : modes_.joints()) {
    if (joint.mode == JointModes::Mode::held) now_.v[joint.v] = 0;
  }
  if (setup_.held_root >= 0) {
    for (int k = 0; k < 6; ++k) now_.v[model_.bodies()[setup_.held_root].v + k] = 0;
  }
  recover(t);
}

void PhaseDynamics::recover(double t) {
  if (!recovers()) return;
  recover_roots<double>(model_.tree(), momenta_, t - momenta_time_, workspace_.kernel, now_.q, now_.v);
}

// Projects the current state onto the closures. A closure is relative, so roots may be recovered afterwards.
ProjectionResult PhaseDynamics::close_loops(double t) {
  const ProjectionResult result = solver_->project(prescribed_, workspace_, now_.q, now_.v);
  recover(t);
  return result;
}

// The current wrench of a load.
ExternalWrench PhaseDynamics::wrench_of(const ExternalLoad& load, double t, const OrbitPoint& at) const {
  const Posed& X_WB = workspace_.kinematics.X_WB[load.body];
  const double inside = inside_.value_or(t);
  Wrenchd F = wrench_at(load, t, inside);
  if (load.frame == LoadFrame::body) F = X_WB.R * F;
  if (load.frame == LoadFrame::orbit) F = at.R_WO * F;
  if (load.stream) {
    const Vector3d& d = load.stream->direction;
    const Vector3d direction = load.frame == LoadFrame::orbit ? at.R_WO * d : d;
    F.linear +=
        factor_at(load.profile, t, inside) * stream_force(*load.stream, direction, X_WB.R * load.stream->normal);
  }
  return {load.body, X_WB * load.p_BP, F};
}

// The field near the orbit, on each body at its centre of mass: (14.2), (14.3).
void PhaseDynamics::act_on_orbit(const OrbitPoint& at) {
  for (std::size_t i = 0; i < model_.bodies().size(); ++i) {
    const BodyDescription& body = model_.bodies()[i].description;
    const Posed& X_WB = workspace_.kinematics.X_WB[i];
    const Vector3d p_WC = X_WB * body.com;
    wrenches_[setup_.loads.size() + i] = {
        static_cast<int>(i),
        p_WC,
        {gravity_gradient_torque(at, X_WB.R, body.inertia), body.mass * tidal_acceleration(at, p_WC)}};
  }
}

// Kinematics, and the wrenches of loads, the orbit's field and attitude control.
void PhaseDynamics::act_from_outside(double t) {
  forward_kinematics(model_, now_, workspace_.kinematics);
  const OrbitPoint at = setup_.orbit ? orbit_point(*setup_.orbit, t) : OrbitPoint{};
  for (std::size_t i = 0; i < setup_.loads.size(); ++i) wrenches_[i] = wrench_of(setup_.loads[i], t, at);
  if (setup_.orbit) act_on_orbit(at);
  if (base_.has_thrusters()) {
    const std::size_t first = wrenches_.size() - base_.thruster_count();
    base_.push(t, workspace_.kinematics.X_WB[base_.root()], std::span(wrenches_).subspan(first));
  }
  if (!wrenches_.empty()) gather_external(model_, wrenches_, workspace_);
}

// The torque of attitude control or of the controller, or the held command.
void PhaseDynamics::drive_root() {
  Vector3d torque = commanded_torque_;
  if (!laws_command()) {
    torque = setup_.clock->held().base_torque;
  } else if (setup_.attitude) {
    torque = base_.attitude_torque_in(now_, base_.feeds_forward() ? arms_ahead() : Vector3d::zero());
  }
  base_.drive(torque, commands(), laws_command() ? base_.wheel_rates(now_.v) : setup_.clock->held().wheel_rates, motor_,
              force_);
}

const ActuatorCommands& PhaseDynamics::commands() const {
  return laws_command() ? commanded_actuators_ : setup_.clock->held().actuators;
}

// The reaction torque of the joints' motion, as far as laws know it: joints with a reference have its acceleration.
Vector3d PhaseDynamics::arms_ahead() {
  known_acceleration_.assign(now_.v.size(), 0.0);
  is_idle_.assign(now_.v.size(), 0);
  for (const ReactionWheel& wheel : setup_.wheels) is_idle_[wheel.velocity] = 1;
  for (const MomentGyro& gyro : setup_.gyros) is_idle_[gyro.gimbal_velocity] = is_idle_[gyro.rotor_velocity] = 1;
  for (std::size_t j = 0; j < setup_.drives.size(); ++j) {
    const int v = model_.bodies()[model_.joints()[j]].v;
    const ControlOutput output = output_of(setup_.drives[j].control);
    const bool is_commanded = output == ControlOutput::motion || output == ControlOutput::acceleration;
    if (setup_.drives[j].control != JointControl::free)
      known_acceleration_[v] = is_commanded ? acceleration_[v] : desired_[j].acceleration;
  }
  return arm_reaction(model_, now_, base_.root(), known_acceleration_, is_idle_);
}

// The output of a joint's law with gains.
double PhaseDynamics::said_by_law(std::size_t joint) const {
  const JointDrive& drive = setup_.drives[joint];
  const Body& body = model_.bodies()[model_.joints()[joint]];
  return control_law::command(drive.control, drive.kp, drive.kd, reference_[joint], now_.q[body.q], now_.v[body.v]);
}

// Friction, efforts of joints under other laws, attitude control. Computed torque is added after the controller's
// output.
void PhaseDynamics::gather_beside(double t) {
  beside_.assign(now_.v.size(), 0.0);
  for (std::size_t j = 0; j < setup_.drives.size(); ++j) {
    const Body& body = model_.bodies()[model_.joints()[j]];
    const JointDescription& joint = body.description.joint;
    beside_[body.v] = friction_of(j);
    if (joint.spring) beside_[body.v] += joint.spring->effort(now_.q[body.q]);
    if (output_of(setup_.drives[j].control) == ControlOutput::effort)
      beside_[body.v] += joint_motor::within_line(joint, said_by_law(j), now_.v[body.v]);
  }
  base_.add_beside(t, now_, motor_, beside_);
}

// Calls the controller.
void PhaseDynamics::ask_controller(double t) {
  for (std::size_t j = 0; j < setup_.drives.size(); ++j) {
    const Body& body = model_.bodies()[model_.joints()[j]];
    if (setup_.drives[j].control == JointControl::free) sensed_[j] = {};
    sensed_[j].position += now_.q[body.q];
    sensed_[j].rate += now_.v[body.v];
  }
  std::fill(commanded_effort_.begin(), commanded_effort_.end(), 0.0);
  ControlCommand command{commanded_effort_};
  gather_beside(t);
  const SensorReadings* readings = setup_.sensors ? &setup_.sensors->readings() : nullptr;
  setup_.controller->update({t, law_model(), now_, desired_, sensed_, beside_, readings}, command);
  const auto refuse = [&](const std::string& what) {
    throw ControllerError(fmt::format("at t = {:.9g} s the controller returns {}, which is not finite", t, what));
  };
  for (std::size_t j = 0; j < setup_.drives.size(); ++j) {
    if (output_of(setup_.drives[j].control) != ControlOutput::command || std::isfinite(commanded_effort_[j])) continue;
    refuse(fmt::format("an effort of {} at joint \"{}\"", commanded_effort_[j],
                       model_.bodies()[model_.joints()[j]].description.joint.name));
  }
  const auto refuse_any = [&](const std::vector<double>& numbers, const char* what) {
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      if (!std::isfinite(numbers[i])) refuse(fmt::format("{} {} of {}", what, i + 1, numbers[i]));
    }
  };
  refuse_any(command.actuators.wheel_torque, "a torque of wheel");
  refuse_any(command.actuators.gimbal_rate, "a rate of gimbal");
  refuse_any(command.actuators.thruster, "a share of thruster");
  commanded_torque_ = command.base_torque;
  commanded_actuators_ = std::move(command.actuators);
  const Vector3d& torque = commanded_torque_;
  if (setup_.commanded_root >= 0 && !std::isfinite(torque[0] + torque[1] + torque[2]))
    refuse(fmt::format("a torque of ({}, {}, {}) N m on the base", torque[0], torque[1], torque[2]));
}

void PhaseDynamics::begin_control(double t, double end) {
  if (setup_.clock && end < t) throw std::logic_error("PhaseDynamics: sampled control cannot be integrated backwards");
  if (!modes_.empty() && end < t)
    throw std::logic_error("PhaseDynamics: static friction and stops cannot be integrated backwards");
  if (base_.has_thrusters() && end < t)
    throw std::logic_error("PhaseDynamics: thrusters cannot be integrated backwards");
  same_time_ = break_resolution(t, end);
  base_.begin(t, same_time_);
  if (has_controller_) setup_.controller->begin_piece(law_model(), t);
}

// Velocities at a sample time => nothing; throws ControllerError with the time and the joint if a speed, except of
// wheels and gyro rotors, exceeds kRunaway (docs/theory, section 6.6).
void PhaseDynamics::refuse_runaway(double t) const {
  // Wheels may reach high rates.
  std::vector<double> speeds = now_.v;
  for (const ReactionWheel& wheel : setup_.wheels) speeds[wheel.velocity] = 0;
  for (const MomentGyro& gyro : setup_.gyros) speeds[gyro.rotor_velocity] = 0;
  const auto fastest =
      std::max_element(speeds.begin(), speeds.end(), [](double a, double b) { return std::abs(a) < std::abs(b); });
  if (fastest == speeds.end() || !(std::abs(*fastest) > kRunaway)) return;
  const auto v = static_cast<int>(fastest - speeds.begin());
  const auto has_it = [&](const Body& b) { return v >= b.v && v < b.v + velocity_count(b.description.joint.type); };
  const Body& body = *std::find_if(model_.bodies().begin(), model_.bodies().end(), has_it);
  const JointDescription& joint = body.description.joint;
  const std::string what = has_one_axis(joint.type)
                               ? fmt::format("joint \"{}\" has the rate", joint.name)
                               : fmt::format("body \"{}\" has the velocity", body.description.name);
  const ControlTiming& timing = setup_.clock->timing();
  throw ControllerError(
      fmt::format("sampled control is unstable: at t = {:.9g} s {} {:.3g} (rad/s or m/s), above {:g}; reduce the "
                  "gains, or the sample "
                  "time of {:g} s "
                  "and the delay of {:g} s",
                  t, what, *fastest, kRunaway, timing.period, timing.delay));
}

// From here to the next evaluation, the current state holds the values that laws receive.
void PhaseDynamics::read_sensors(double t, std::span<const double> y) {
  if (setup_.sensors->needs_forces()) {
    sampling_ = false;
    accelerate(t);
    settle_friction();
    sampling_ = true;
  }
  State seen = now_;
  const PhaseIntegrals so_far = integrals(y);
  setup_.sensors->read({t, now_, so_far, motor_, friction_, this}, seen);
  now_ = std::move(seen);
}

// Time and y => at a sample time: sensor readings and a new command of all laws, handed to the clock, which delays it
// (6.14). At other times only due commands begin to act.
void PhaseDynamics::tick(double t, std::span<const double> y) {
  if (!setup_.clock || !setup_.clock->tick(t, same_time_)) return;
  sampling_ = true;
  try {
    load(t, y);
    if (projects()) close_loops(t);
    refuse_runaway(t);
    if (setup_.sensors) read_sensors(t, y);
    accelerate(t);
  } catch (...) {
    sampling_ = false;
    throw;
  }
  sampling_ = false;
  const std::vector<int>& channels = *setup_.channels;
  ControlClock::Command said{std::vector<double>(channels.size()), base_.asked(), base_.wheel_rates(now_.v),
                             commanded_actuators_};
  for (std::size_t c = 0; c < channels.size(); ++c) {
    const auto j = static_cast<std::size_t>(channels[c]);
    if (works_by_effort(output_of(setup_.drives[j].control))) said.effort[c] = told_[j];
  }
  setup_.clock->command(std::move(said), t, same_time_);
}

double PhaseDynamics::begin_smooth_piece(double begin, double end, std::span<const double> y) {
  enter_interval(begin, end);
  tick(begin, y);
  choose_modes(begin, y);
  return next_edge(begin, end);
}

PhaseDynamics::HeldDrive PhaseDynamics::held_drive() {
  actuate();
  if (base_.root() >= 0) drive_root();
  return {motor_, base_.acts_from_outside() ? base_.given() : Vector3d::zero()};
}

// Friction, and the output of the control laws: efforts, or accelerations.
void PhaseDynamics::actuate() {
  for (std::size_t j = 0; j < setup_.drives.size(); ++j) {
    const JointDrive& drive = setup_.drives[j];
    const Body& body = model_.bodies()[model_.joints()[j]];
    friction_[j] = friction_of(j);
    if (const auto& spring = body.description.joint.spring) spring_[j] = spring->effort(now_.q[body.q]);  // (22.1)
    motor_[j] = told_[j] = 0;
    const ControlOutput output = output_of(drive.control);
    if (!works_by_effort(output)) continue;
    if (!laws_command()) {
      if (channel_of_[j] >= 0) motor_[j] = output_of_motor(j, setup_.clock->held().effort[channel_of_[j]]);
      continue;
    }
    if (output == ControlOutput::command) {
      motor_[j] = output_of_motor(j, commanded_effort_[j]);
      continue;
    }
    const double said = said_by_law(j);
    if (output == ControlOutput::effort) {
      motor_[j] = output_of_motor(j, said);
    } else {
      acceleration_[body.v] = said;
    }
  }
}

// Friction of a moving joint. For a joint at rest, friction follows from the motion.
double PhaseDynamics::friction_of(std::size_t joint) const {
  const Body& body = model_.bodies()[model_.joints()[joint]];
  const JointModes::Joint* modes = modes_.of(joint);
  if (!modes || !modes->sticks) {
    const JointDescription& d = body.description.joint;
    return friction_force(d.friction, now_.v[body.v]) - (d.spring ? d.spring->damping * now_.v[body.v] : 0);
  }
  return modes->mode == JointModes::Mode::held ? 0 : JointModes::sliding_friction(*modes, now_.v[body.v]);
}

// The motor's effort for a commanded effort.
double PhaseDynamics::output_of_motor(std::size_t joint, double told) {
  const Body& body = model_.bodies()[model_.joints()[joint]];
  told_[joint] = joint_motor::within_line(body.description.joint, told, now_.v[body.v]);
  return joint_motor::with_ripple(body.description.joint, told_[joint], now_.q[body.q]);
}

// Accelerations under force_, and the forces of the prescribed ones.
void PhaseDynamics::solve(std::span<const std::uint8_t> prescribed) {
  DynamicsInput<double> in;
  in.q = now_.q, in.v = now_.v, in.force = force_, in.gravity = setup_.gravity;
  in.prescribed = prescribed, in.acceleration = acceleration_;
  if (!wrenches_.empty()) in.link_wrench = workspace_.link_wrench;
  if (solver_) {
    solver_->accelerations(in, setup_.loop_feedback, workspace_, vdot_, workspace_.force);
  } else {
    articulated_body<double>(model_.tree(), in, workspace_.kernel, vdot_, workspace_.force);
  }
}

// The forces of the commanded accelerations, by the model that the laws use.
const std::vector<double>& PhaseDynamics::commanded_forces() {
  if (!setup_.law_model) {
    solve(commanded_);
    return workspace_.force;
  }
  DynamicsInput<double> in;
  in.q = now_.q, in.v = now_.v, in.force = force_, in.gravity = setup_.gravity;
  in.prescribed = commanded_, in.acceleration = acceleration_;
  if (!wrenches_.empty()) in.link_wrench = workspace_.link_wrench;
  if (law_solver_) {
    law_solver_->accelerations(in, setup_.loop_feedback, *law_workspace_, law_vdot_, law_workspace_->force);
  } else {
    articulated_body<double>(setup_.law_model->tree(), in, law_workspace_->kernel, law_vdot_, law_workspace_->force);
  }
  return law_workspace_->force;
}

// Accelerations, and the motor and friction efforts of all joints.
void PhaseDynamics::accelerate(double t) {
  open_stresses_.reset();
  if (has_controller_ && laws_command()) ask_controller(t);
  if (has_external_) act_from_outside(t);
  actuate();
  if (base_.root() >= 0) drive_root();
  base_.turn_gyros(t, now_, commands(), {now_.v, prescribed_, commanded_, acceleration_});
  const auto velocity_of = [&](std::size_t j) { return model_.bodies()[model_.joints()[j]].v; };
  bool as_commanded = false;
  if (any_computed_ && laws_command()) {
    // The controller's model of the robot: without friction, moving as commanded. The kernel computes the torques and,
    // without disturbances or limits, also the accelerations.
    for (std::size_t j = 0; j < motor_.size(); ++j) force_[velocity_of(j)] = motor_[j] + spring_[j];
    const std::vector<double>& forces = commanded_forces();
    as_commanded = !has_friction_ && !modes_.any_held() && !setup_.law_model;
    for (std::size_t j = 0; j < motor_.size(); ++j) {
      if (output_of(setup_.drives[j].control) != ControlOutput::acceleration) continue;
      const double torque = forces[velocity_of(j)];
      motor_[j] = output_of_motor(j, torque);
      as_commanded = as_commanded && motor_[j] == torque;
    }
  }
  if (!as_commanded) {
    hold_joints();  // the laws may have written accelerations
    for (std::size_t j = 0; j < motor_.size(); ++j) force_[velocity_of(j)] = motor_[j] + friction_[j] + spring_[j];
    solve(prescribed_);
  }
  // Gimbals whose motors would exceed their torque.
  while (base_.cut_gimbals(workspace_.force, prescribed_, motor_)) {
    for (std::size_t j = 0; j < motor_.size(); ++j) force_[velocity_of(j)] = motor_[j] + friction_[j] + spring_[j];
    solve(prescribed_);
  }
  for (std::size_t j = 0; j < motor_.size(); ++j) {
    if (output_of(setup_.drives[j].control) == ControlOutput::motion) {
      motor_[j] = told_[j] = workspace_.force[velocity_of(j)] - friction_[j] - spring_[j];
    }
  }
  for (const JointModes::Joint& joint : modes_.joints()) {
    if (joint.mode == JointModes::Mode::held)
      friction_[joint.joint] = workspace_.force[joint.v] - motor_[joint.joint] - spring_[joint.joint];
  }
  base_.conclude(workspace_.force, friction_, motor_);
}

// Accelerations at the state in y, with the base's current modes.
std::span<const double> PhaseDynamics::accelerations_in(double t, std::span<const double> y) {
  load(t, y);
  if (const auto tried = base_.tried_rate()) {
    now_.v[tried->first] = tried->second;
    recover(t);
  }
  if (projects()) close_loops(t);
  accelerate(t);
  return vdot_;
}

double PhaseDynamics::switch_margin(double t, std::span<const double> y) {
  load(t, y);
  double least = modes_.moving_margin(now_.q, now_.v);
  if (modes_.any_held()) {
    accelerations_in(t, y);
    least = std::min(least, modes_.holding_margin(friction_, open_efforts()));
    load(t, y);
  }
  if (!base_.switches()) return least;
  return std::min(least, base_.margin(std::vector<double>(now_.v), [&] { return accelerations_in(t, y); }));
}

void PhaseDynamics::choose_modes(double t, std::span<const double> y) {
  if (!modes_.empty()) choose_joint_modes(t, y);
  if (!base_.switches()) return;
  base_.choose_modes(t, y.subspan(model_.coordinates(), model_.velocities()), [&] { return accelerations_in(t, y); });
}

// Time and y => y after impacts at stops (19.2). First, residual rates after reversals are set to zero by impulses;
// energy lost and impulses are added to the integrals in y.
void PhaseDynamics::meet_stops(double t, std::span<double> y) {
  if (modes_.empty()) return;
  const std::size_t nq = now_.q.size(), nv = now_.v.size();
  const std::span<double> v = y.subspan(nq, nv);
  if (const auto changes = modes_.overshoots(v); !changes.empty()) {
    load(t, y);
    respond_to(changes, true);
    book_impulses(y);
    for (std::size_t i = 0; i < nv; ++i) v[i] += vdot_[i];
    for (const JointModes::RateChange& r : changes) v[r.v] = 0;
  }
  load(t, y);
  const auto respond = [&](std::span<const JointModes::RateChange> changes) { return respond_to(changes, false); };
  if (modes_.meet_stops(t, y.first(nq), v, respond)) {
    y[nq + nv + kFrictionWork] -= modes_.last_energy_lost();
    book_impulses(y);
  }
  hold_joints();
}

// Adds the effects of the last response: the work of motors that hold their rates, and the impulse of the ground. An
// impulse works at the mean of the velocities before and after it.
void PhaseDynamics::book_impulses(std::span<double> y) {
  const std::span<double> integrals = y.subspan(now_.q.size() + now_.v.size(), integral_count());
  for (std::size_t i = 0; i < now_.v.size(); ++i) now_.v[i] += 0.5 * vdot_[i];
  const auto work_of_motor = [&](std::size_t joint) {
    const int v = model_.bodies()[model_.joints()[joint]].v;
    const bool holds = output_of(setup_.drives[joint].control) == ControlOutput::motion || base_.holds_wheel(v);
    return holds ? workspace_.force[v] * now_.v[v] : 0.0;
  };
  for (std::size_t j = 0; j < setup_.drives.size(); ++j) integrals[kMotorWork] += work_of_motor(j);
  double* exchanged = integrals.data() + integrals.size() - exchange_count();
  double* of_joint = exchanged - damper_integral_count() - joint_integral_count();
  for (std::size_t n = 0; n < measured_.size(); ++n)
    of_joint[kJointCount * n + kJointMotor] += work_of_motor(measured_[n]);
  if (!has_external_) return;
  forward_kinematics(model_, now_, workspace_.kinematics);
  measure_trees();
  add_ground([&](std::size_t body, const Vector3d& force, const Vector3d& p_W, const Vector3d& moment) {
    const std::size_t tree = tree_of_[body];
    add_wrench(integrals.data(), static_cast<int>(tree), trees_[tree], force, p_W, moment, 0.0);
    add_exchange(exchanged + kExchangeCount * tree, trees_[tree], force, p_W, moment, 0.0);
  });
}

// The response of the system at rest to changes of some rates, as to accelerations: M change = J^T P and the stops'
// impulses, (19.3). `friction_holds`: held joints remain held; not in impacts, where friction has no effect.
JointModes::ImpulseResponse PhaseDynamics::respond_to(std::span<const JointModes::RateChange> changes,
                                                      bool friction_holds) {
  for (const JointModes::Joint& joint : modes_.joints())
    prescribed_[joint.v] = friction_holds && joint.mode == JointModes::Mode::held;
  std::fill(acceleration_.begin(), acceleration_.end(), 0.0);
  for (const MomentGyro& gyro : setup_.gyros)  // motors give no impulses
    prescribed_[gyro.gimbal_velocity] = prescribed_[gyro.rotor_velocity] = 0;
  for (const JointModes::RateChange& r : changes) prescribed_[r.v] = 1, acceleration_[r.v] = r.change;
  std::fill(force_.begin(), force_.end(), 0.0);
  DynamicsInput<double> in;
  in.q = now_.q, in.v = at_rest_, in.force = force_, in.prescribed = prescribed_, in.acceleration = acceleration_;
  if (solver_) {
    solver_->accelerations(in, 0, workspace_, vdot_, workspace_.force);
  } else {
    articulated_body<double>(model_.tree(), in, workspace_.kernel, vdot_, workspace_.force);
  }
  return {vdot_, workspace_.force};
}

// The loads of the ground on a fixed root, and of the wrench that holds a root: add(body, force, point, moment).
template <class Add>
void PhaseDynamics::add_ground(Add&& add) const {
  const Kinematics& k = workspace_.kinematics;
  for (std::size_t i = 0; i < model_.bodies().size(); ++i) {
    const Body& body = model_.bodies()[i];
    const bool held = static_cast<int>(i) == setup_.held_root;
    const bool grounded = body.parent < 0 && body.description.joint.type == JointType::fixed;
    if (!held && !grounded) continue;
    // The root's articulated equation gives the holding wrench; gravity is included in A, so it is not added.
    const LinkScratch<double>& root = workspace_.kernel.links[body.placement.link];
    const Wrenchd F = k.links[body.placement.link].X_WL.R * (root.I * root.A + root.p);
    add(i, F.linear, k.X_WB[i].p, F.angular);
  }
}

// Centres of mass of the trees, and their velocities.
void PhaseDynamics::measure_trees() {
  const Kinematics& k = workspace_.kinematics;
  for (TreeMotion<double>& tree : trees_) tree.com = tree.velocity = Vector3d::zero();
  for (std::size_t i = 0; i < tree_of_.size(); ++i) {
    const BodyDescription& d = model_.bodies()[i].description;
    const Vector3d arm = k.X_WB[i].R * d.com;
    TreeMotion<double>& tree = trees_[tree_of_[i]];
    tree.com += (d.mass / tree.mass) * (k.X_WB[i].p + arm);
    tree.velocity += (d.mass / tree.mass) * shift(k.V_WB[i], arm).linear;
  }
}

// Power and impulse rates of gravity, loads, the orbit's field and attitude control, of the ground under a fixed root,
// and of the wrench that holds a root; in total and of each tree.
void PhaseDynamics::add_external(std::span<double> integrals) {
  measure_trees();
  const Kinematics& k = workspace_.kinematics;
  double* exchanged = integrals.data() + integrals.size() - exchange_count();
  const auto add = [&](std::size_t body, const Vector3d& force, const Vector3d& p_W, const Vector3d& moment,
                       double power) {
    const std::size_t t = tree_of_[body];
    add_wrench(integrals.data(), static_cast<int>(t), trees_[t], force, p_W, moment, power);
    add_exchange(exchanged + kExchangeCount * t, trees_[t], force, p_W, moment, power);
  };
  for (std::size_t t = 0; t < trees_.size(); ++t) {
    add_weight(integrals.data(), static_cast<int>(t), trees_[t], setup_.gravity);
    exchanged[kExchangeCount * t + kExchangedImpulse] += trees_[t].mass * norm(setup_.gravity);
  }
  add_ground([&](std::size_t body, const Vector3d& force, const Vector3d& p_W, const Vector3d& moment) {
    add(body, force, p_W, moment, 0.0);
  });
  for (const ExternalWrench& e : wrenches_)
    add(e.body, e.F_W.linear, e.p_WP, e.F_W.angular, dot(e.F_W, shift(k.V_WB[e.body], e.p_WP - k.X_WB[e.body].p)));
  if (const int root = base_.root(); base_.acts_from_outside()) {
    const Vector3d torque = k.X_WB[root].R * base_.given();
    add(root, Vector3d::zero(), k.X_WB[root].p, torque, dot(torque, k.V_WB[root].angular));
  }
}

// Time and y => dy/dt: coordinate rates, accelerations by (4.8) to (4.12) or, with closures, (8.6), powers and external
// wrenches as rates of the integrals. Contradicting closures give NaN, and trouble_ records the cause.
void PhaseDynamics::operator()(double t, std::span<const double> y, std::span<double> dydt) {
  const int nq = model_.coordinates(), nv = model_.velocities();
  load(t, y);
  accelerate(t);
  if (solver_ && !(solver_->contradiction() <= loop_limits::kContradiction)) {
    // No motion satisfies the closures: returns non-finite rates; a shorter step may avoid this.
    if (std::isfinite(solver_->contradiction())) {
      trouble_ =
          Trouble{t, solver_->contradiction(), solver_->rank(), solver_->least_pivot(), solver_->contradicting_row()};
    }
    std::fill(dydt.begin(), dydt.end(), std::numeric_limits<double>::quiet_NaN());
    return;
  }
  trouble_.reset();
  coordinate_rates(model_, now_.q, now_.v, dydt.first(nq));
  std::copy(vdot_.begin(), vdot_.end(), dydt.begin() + nq);
  const std::span<double> integrals = dydt.subspan(nq + nv, integral_count());
  std::fill(integrals.begin(), integrals.end(), 0.0);
  double* exchanged = integrals.data() + integrals.size() - exchange_count();
  for (std::size_t j = 0; j < setup_.drives.size(); ++j) {
    const int body = model_.joints()[j];
    const double rate = now_.v[model_.bodies()[body].v];
    integrals[kMotorWork] += motor_[j] * rate;
    integrals[kFrictionWork] += friction_[j] * rate;
    exchanged[kExchangeCount * tree_of_[body] + kExchangedWork] +=
        (std::abs(motor_[j]) + std::abs(friction_[j])) * std::abs(rate);
  }
  if (has_external_) add_external(integrals);
  add_joint_integrals(integrals);
}

// Last evaluation => rates of the damper work per tree and, per measured joint, of motor work, friction work and copper
// loss (19.14) [W].
void PhaseDynamics::add_joint_integrals(std::span<double> integrals) {
  double* dampers = integrals.data() + integrals.size() - exchange_count() - damper_integral_count();
  for (const int body : has_dampers_ ? model_.springs() : std::vector<int>{}) {
    const Body& b = model_.bodies()[body];
    dampers[tree_of_[body]] -= b.description.joint.spring->damping * now_.v[b.v] * now_.v[b.v];
  }
  double* at = dampers - joint_integral_count();
  for (std::size_t j : measured_) {
    const Body& body = model_.bodies()[model_.joints()[j]];
    const double rate = now_.v[body.v];
    at[kJointMotor] = motor_[j] * rate;
    at[kJointFriction] = friction_[j] * rate;
    at[kJointCopper] = joint_motor::copper_power(body.description.joint, told_[j]);
    at += kJointCount;
  }
}

const State& PhaseDynamics::unprojected_state(double t, std::span<const double> y) {
  load(t, y);
  return now_;
}

const State& PhaseDynamics::state(double t, std::span<const double> y) {
  load(t, y);
  if (projects()) close_loops(t);
  return now_;
}

// Time and y => y on the closures, by (8.9) and (8.10), and the size of the correction; the integrals do not change.
ProjectionResult PhaseDynamics::project(double t, std::span<double> y, double negligible) {
  load(t, y);
  const std::size_t nq = now_.q.size();
  loaded_.resize(nq + now_.v.size());
  std::copy(now_.q.begin(), now_.q.end(), loaded_.begin());
  std::copy(now_.v.begin(), now_.v.end(), loaded_.begin() + static_cast<std::ptrdiff_t>(nq));
  const ProjectionResult result = solver_->project(prescribed_, workspace_, now_.q, now_.v, negligible);
  if (!result.changed) return result;
  // Only the change: roots' integrated positions and velocities remain a check of the recovered ones.
  for (std::size_t i = 0; i < nq; ++i) y[i] += now_.q[i] - loaded_[i];
  for (std::size_t i = 0; i < now_.v.size(); ++i) y[nq + i] += now_.v[i] - loaded_[nq + i];
  return result;
}

ClosureDefect PhaseDynamics::loop_defect(double t, std::span<const double> y) {
  load(t, y);
  move_roots_to_origin(model_, now_);
  forward_kinematics(model_, now_, workspace_.kinematics);
  ClosureDefect largest;
  for (const LoopClosure& closure : setup_.closures) largest.raise(closure_defect(closure, workspace_.kinematics));
  return largest;
}

std::string PhaseDynamics::trouble() const {
  if (!trouble_) return {};
  return fmt::format(
      "at t = {:.9g} s no motion satisfies the closed loops: {} contradicts the other closures or prescribed joints "
      "({:.2g} of the current accelerations; rank {} of {} rows, least pivot {:.2g}): a singular configuration, or "
      "joints that are driven against the loop",
      trouble_->time, trouble_->row, trouble_->contradiction, trouble_->rank, solver_->rows(), trouble_->least_pivot);
}

MomentumDefect PhaseDynamics::momentum_corrected(std::span<const double> y) {
  MomentumDefect defect;
  if (!recovers()) return defect;
  const int nq = model_.coordinates(), nv = model_.velocities();
  root_momenta<double>(model_.tree(), y.first(nq), y.subspan(nq, nv), workspace_.kernel, drifted_);
  for (std::size_t i = 0; i < momenta_.size(); ++i) {
    defect.linear = std::max(defect.linear, norm(drifted_[i].h.linear - momenta_[i].h.linear));
    defect.angular = std::max(defect.angular, norm(drifted_[i].h.angular - momenta_[i].h.angular));
  }
  return defect;
}

// y => works and impulses of the whole, per tree, per measured joint, of dampers, and the exchanged magnitudes (9.1) to
// (9.3), from the layout of phase_integral.
PhaseIntegrals PhaseDynamics::integrals(std::span<const double> y) const {
  const std::span<const double> numbers = y.subspan(model_.coordinates() + model_.velocities(), integral_count());
  const std::size_t common = numbers.size() - exchange_count() - joint_integral_count() - damper_integral_count();
  PhaseIntegrals integrals = phase_integrals(numbers.first(common));
  const std::span<const double> exchanged = numbers.last(exchange_count());
  const std::span<const double> dampers =
      numbers.first(numbers.size() - exchange_count()).last(damper_integral_count());
  integrals.damper_work.assign(dampers.begin(), dampers.end());
  for (std::size_t t = 0; t < trees_.size(); ++t) {
    const double* of_tree = exchanged.data() + kExchangeCount * t;
    integrals.exchanged.push_back({of_tree[kExchangedImpulse], of_tree[kExchangedMoment], of_tree[kExchangedWork]});
  }
  const double* at = numbers.data() + common;
  for (std::size_t j : measured_) {
    integrals.joints.push_back({j, at[kJointMotor], at[kJointFriction], at[kJointCopper]});
    at += kJointCount;
  }
  return integrals;
}

void PhaseDynamics::efforts(double t, std::span<const double> y, std::span<double> motor, std::span<double> friction) {
  load(t, y);
  if (projects()) close_loops(t);
  accelerate(t);
  settle_friction();
  std::copy(motor_.begin(), motor_.end(), motor.begin());
  std::copy(friction_.begin(), friction_.end(), friction.begin());
}

}  // namespace grapnel
