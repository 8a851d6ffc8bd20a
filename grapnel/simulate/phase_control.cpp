// The laws of a phase: controller, attitude control, sensors and the clock. The motion under their commands is in
// phase_dynamics.cpp.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "grapnel/simulate/arm_reaction.hpp"
#include "grapnel/simulate/joint_motor.hpp"
#include "grapnel/simulate/phase_dynamics.hpp"
#include "grapnel/simulate/simulate_phase.hpp"

namespace grapnel {

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

// Effectors => nothing; throws std::invalid_argument if one does not match the model. Rates that their motors control
// are prescribed.
void PhaseDynamics::check_effectors() {
  std::vector<std::uint8_t> is_free;
  for (const JointDrive& drive : setup_.drives) is_free.push_back(drive.control == JointControl::free);
  base_.check(model_, is_free);
  for (const int v : base_.velocities().rate_controlled) prescribed_[v] = commanded_[v] = 1;
}

// Tendons => nothing; throws std::invalid_argument if one pulls a joint that is not free.
void PhaseDynamics::check_tendons() {
  tensions_.assign(setup_.tendons.size(), 0.0);
  for (const Tendon& tendon : setup_.tendons) {
    for (const Tendon::Arm& a : tendon.arms) {
      const auto joint = static_cast<std::size_t>(a.joint);
      if (a.coordinate != model_.joint_body(joint).q || setup_.drives.at(joint).control != JointControl::free)
        throw std::invalid_argument("PhaseDynamics: a tendon can pull only free joints");
    }
  }
}

// The torque of attitude control or of the controller, or the held command.
void PhaseDynamics::drive_root(double t) {
  Vector3d torque = commanded_torque_;
  if (!laws_command()) {
    torque = setup_.clock->held().base_torque;
  } else if (setup_.attitude) {
    torque = base_.attitude_torque_in(now_, base_.feeds_forward() ? arms_ahead() : Vector3d::zero());
  }
  const std::vector<double> wheel_rates = laws_command() ? base_.wheel_rates(now_.v) : setup_.clock->held().wheel_rates;
  base_.drive(t, now_, {torque, commands(), wheel_rates}, motor_, force_);
}

const ActuatorCommands& PhaseDynamics::commands() const {
  return laws_command() ? commanded_actuators_ : setup_.clock->held().actuators;
}

// The reaction torque of the joints' motion, as far as laws know it: joints with a reference have its acceleration.
Vector3d PhaseDynamics::arms_ahead() {
  known_acceleration_.assign(now_.v.size(), 0.0);
  is_idle_.assign(now_.v.size(), 0);
  for (const int v : base_.velocities().all) is_idle_[v] = 1;
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
double PhaseDynamics::law_output(std::size_t joint) const {
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
      beside_[body.v] += joint_motor::within_line(joint, law_output(j), now_.v[body.v]);
  }
  for (const Tendon& tendon : setup_.tendons) {
    const double tension = tendon.tension_at(t, now_.q);
    for (const Tendon::Arm& a : tendon.arms)
      beside_[model_.joint_body(static_cast<std::size_t>(a.joint)).v] += a.arm * tension;
  }
  base_.add_beside(t, now_, motor_, beside_);
}

// Calls the controller.
void PhaseDynamics::call_controller(double t) {
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
  if (base_.thrusters() && end < t) throw std::logic_error("PhaseDynamics: thrusters cannot be integrated backwards");
  same_time_ = break_resolution(t, end);
  base_.begin(t, same_time_);
  if (has_controller_) setup_.controller->begin_segment(law_model(), t);
}

// Velocities at a sample time => nothing; throws ControllerError with the time and the joint if a speed, except of
// wheels and gyro rotors, exceeds kRunaway (docs/theory, section 6.6).
void PhaseDynamics::refuse_runaway(double t) const {
  std::vector<double> speeds = now_.v;
  for (const int v : base_.velocities().fast) speeds[v] = 0;
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
  placed_ = false;
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
  ControlClock::Command sampled_command{std::vector<double>(channels.size()), base_.commanded_torque(),
                                        base_.wheel_rates(now_.v), commanded_actuators_};
  for (std::size_t c = 0; c < channels.size(); ++c) {
    const auto j = static_cast<std::size_t>(channels[c]);
    if (works_by_effort(output_of(setup_.drives[j].control))) sampled_command.effort[c] = smooth_effort_[j];
  }
  setup_.clock->command(std::move(sampled_command), t, same_time_);
}

double PhaseDynamics::begin_smooth_interval(double begin, double end, std::span<const double> y) {
  enter_interval(begin, end);
  tick(begin, y);
  choose_modes(begin, y);
  return next_edge(begin, end);
}

PhaseDynamics::HeldDrive PhaseDynamics::held_drive(double t) {
  actuate();
  if (base_.root() >= 0) drive_root(t);
  return {motor_, base_.acts_from_outside() ? base_.given() : Vector3d::zero()};
}

}  // namespace grapnel
