#include "grapnel/control/controller_signals.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string_view>
#include <type_traits>

#include "grapnel/dynamics/kinematics.hpp"
#include "grapnel/simulate/replay_controller.hpp"

namespace grapnel {

struct SignalSource {
  const ControllerSample& sample;
  const ControlInput& input;
  Vector3d p, v, w;  // of the base: origin and its velocity in W, angular velocity in B
  Quaterniond q;     // R_WB

  int segment() const { return sample.segment_; }
  std::span<const int> wheels() const { return sample.wheels_; }
  std::span<const int> gimbals() const { return sample.gimbals_; }
  std::span<const int> targets() const { return sample.targets_; }
};

namespace {

using Owner = SignalOwner;
using Source = SignalSource;
using Values = std::vector<double>;
using Input = grapnel_controller_input;
using Output = grapnel_controller_output;

constexpr double kUnread = std::numeric_limits<double>::quiet_NaN();

void add(Values& list, const Vector3d& x) { list.insert(list.end(), x.e, x.e + 3); }
void add(Values& list, const Quaterniond& q) { list.insert(list.end(), {q.w, q.x, q.y, q.z}); }

// ---- Readers ----

template <auto Points, auto Member>
void read_joints(const Source& s, Values& out) {
  for (const std::size_t joint : s.sample.joints()) out.push_back((s.input.*Points)[joint].*Member);
}
template <auto Bodies, auto Vector, auto Index>
void read_states(const Source& s, Values& out) {
  for (const int body : (s.*Bodies)()) out.push_back((s.input.state.*Vector)[s.input.model.bodies()[body].*Index]);
}
template <auto Member>
void read_base(const Source& s, Values& out) {
  add(out, s.*Member);
}
void read_wrenches(const Source& s, Values& out) {
  if (!s.input.readings) return out.assign(6 * s.sample.robot().end_effectors.size(), kUnread);
  for (const Wrenchd& F : s.input.readings->wrists) add(out, F.linear), add(out, F.angular);
}
void read_target_poses(const Source& s, Values& out) {
  if (!s.input.readings) return out.assign(7 * s.sample.robot().targets.size(), kUnread);
  for (const SensorReadings::Target& target : s.input.readings->targets) {
    const bool is_read = std::isfinite(target.X_BT.R(0, 0));
    add(out, target.X_BT.p);
    add(out, is_read ? quaternion_from(target.X_BT.R) : Quaterniond{kUnread, kUnread, kUnread, kUnread});
  }
}
void read_target_motions(const Source& s, Values& out) {
  if (!s.input.readings) return out.assign(6 * s.sample.robot().targets.size(), kUnread);
  for (const SensorReadings::Target& target : s.input.readings->targets)
    add(out, target.V_BT.linear), add(out, target.V_BT.angular);
}
void read_held(const Source& s, Values& out) {
  const Model& model = s.input.model;
  for (const int frame : s.targets())
    out.push_back(model.bodies()[model.frames()[frame].body].root == s.sample.base() ? 1 : 0);
}

// ---- Members of the C structures ----

template <auto Member>
double value_in_c(const Input& in, std::size_t i) {
  if constexpr (std::is_arithmetic_v<std::remove_cvref_t<decltype(in.*Member)>>)
    return in.*Member;
  else
    return (in.*Member)[i];
}
template <auto Member>
void set_in_c(Input& in, const Values& values) {
  using Type = std::remove_cvref_t<decltype(in.*Member)>;
  if constexpr (std::is_arithmetic_v<Type>)
    in.*Member = static_cast<Type>(values[0]);
  else if constexpr (std::is_array_v<Type>)
    std::copy(values.begin(), values.end(), in.*Member);
  else
    in.*Member = values.data();
}
template <auto Member>
constexpr bool is_inside_c = std::is_array_v<std::remove_cvref_t<decltype(std::declval<Output&>().*Member)>>;
template <auto Member>
void refer_in_c(Output& out, Values& values) {
  if constexpr (!is_inside_c<Member>) out.*Member = values.data();
}
template <auto Member>
double* values_in_c(Output& out) {
  return out.*Member;
}

template <auto Member>
constexpr InputSignal input(ControllerSignal about, void (*read)(const Source&, Values&), bool needs_sensor = false) {
  return {about, needs_sensor, read, value_in_c<Member>, set_in_c<Member>};
}
template <auto Member>
constexpr CommandSignal command(ControllerSignal about, const char* column,
                                void (*apply)(const Values&, std::span<const std::size_t>, ControlCommand&)) {
  return {about, column, apply, values_in_c<Member>, refer_in_c<Member>, is_inside_c<Member>};
}

template <auto Member>
void apply_actuators(const Values& values, std::span<const std::size_t>, ControlCommand& command) {
  command.actuators.*Member = values;
}

constexpr auto kWhole = ControllerSignal::Kind::whole;
constexpr auto kFlag = ControllerSignal::Kind::flag;

}  // namespace

constinit const std::array<InputSignal, kInputSignals> input_signals{{
    input<&Input::time>({"time", Owner::run, 1, "s", nullptr, nullptr, "Time of the scenario"},
                        [](const Source& s, Values& out) { out = {s.input.time}; }),
    input<&Input::piece>({"piece", Owner::run, 1, "1", nullptr, "piece",
                          "Index of the motion segment, from 0: increases when grasps close or open", kWhole},
                         [](const Source& s, Values& out) { out = {static_cast<double>(s.segment())}; }),
    input<&Input::position>({"position", Owner::joint, 1, "rad", nullptr, "position", "Sensor reading"},
                            read_joints<&ControlInput::sensed, &JointPoint::position>),
    input<&Input::rate>({"rate", Owner::joint, 1, "rad/s", nullptr, "rate", "Sensor reading"},
                        read_joints<&ControlInput::sensed, &JointPoint::rate>),
    input<&Input::desired_position>(
        {"desired_position", Owner::joint, 1, "rad", nullptr, "desired_position", "Reference value"},
        read_joints<&ControlInput::reference, &JointPoint::position>),
    input<&Input::desired_rate>({"desired_rate", Owner::joint, 1, "rad/s", nullptr, "desired_rate", "Reference value"},
                                read_joints<&ControlInput::reference, &JointPoint::rate>),
    input<&Input::desired_acceleration>(
        {"desired_acceleration", Owner::joint, 1, "rad/s^2", nullptr, "desired_acceleration", "Reference value"},
        read_joints<&ControlInput::reference, &JointPoint::acceleration>),
    input<&Input::base_position>(
        {"base_position", Owner::base, 3, "m", nullptr, "position", "Origin of the base, in W"}, read_base<&Source::p>),
    input<&Input::base_quaternion_wxyz>(
        {"base_quaternion_wxyz", Owner::base, 4, "1", nullptr, "quaternion_wxyz", "Orientation of the base in W"},
        read_base<&Source::q>),
    input<&Input::base_velocity>(
        {"base_velocity", Owner::base, 3, "m/s", nullptr, "velocity", "Of the origin of the base, in W"},
        read_base<&Source::v>),
    input<&Input::base_angular_velocity>(
        {"base_angular_velocity", Owner::base, 3, "rad/s", nullptr, "angular_velocity", "Of the base, in its axes"},
        read_base<&Source::w>),
    input<&Input::wrench>({"wrench", Owner::end_effector, 6, "N", "N m", "wrench",
                           "Force and torque of its target on the end-effector, in its axes, about its origin"},
                          read_wrenches, true),
    input<&Input::wheel_rate>({"wheel_rate", Owner::wheel, 1, "rad/s", nullptr, "rate", "Relative to the base"},
                              read_states<&Source::wheels, &State::v, &Body::v>),
    input<&Input::gimbal_angle>({"gimbal_angle", Owner::gyro, 1, "rad", nullptr, "angle", "Of the gimbal"},
                                read_states<&Source::gimbals, &State::q, &Body::q>),
    input<&Input::gimbal_rate>(
        {"gimbal_rate", Owner::gyro, 1, "rad/s", nullptr, "rate", "Of the gimbal, relative to the base"},
        read_states<&Source::gimbals, &State::v, &Body::v>),
    input<&Input::target_held>(
        {"target_held", Owner::target, 1, "1", nullptr, "held", "Whether a grasp holds it, 1 or 0", kFlag}, read_held),
    input<&Input::target_pose>({"target_pose", Owner::target, 7, "m", "1", "pose",
                                "Position of its frame in B, and orientation in B as quaternion w, x, y, z"},
                               read_target_poses, true),
    input<&Input::target_motion>({"target_motion", Owner::target, 6, "m/s", "rad/s", "motion",
                                  "Velocity of its origin less that of B's, and angular velocity in W, in B's axes"},
                                 read_target_motions, true),
}};

constinit const std::array<CommandSignal, kCommandSignals> command_signals{{
    command<&Output::effort>({"effort", Owner::joint, 1, "N m", nullptr, "effort",
                              "Commanded effort of the joint's motor; clipped at its limit"},
                             "",
                             [](const Values& values, std::span<const std::size_t> joints, ControlCommand& command) {
                               for (std::size_t j = 0; j < joints.size(); ++j) command.effort[joints[j]] = values[j];
                             }),
    command<&Output::base_torque>({"base_torque", Owner::base, 3, "N m", nullptr, "torque",
                                   "Torque on the base, in its axes; through its wheels where it has any"},
                                  "base.",
                                  [](const Values& values, std::span<const std::size_t>, ControlCommand& command) {
                                    command.base_torque = {values[0], values[1], values[2]};
                                  }),
    command<&Output::wheel_torque>({"wheel_torque", Owner::wheel, 1, "N m", nullptr, "torque",
                                    "Torque of the motor on the wheel, about its axis; clipped at its limit"},
                                   "wheel.", apply_actuators<&ActuatorCommands::wheel_torque>),
    command<&Output::gimbal_rate>({"gimbal_rate", Owner::gyro, 1, "rad/s", nullptr, "gimbal_rate",
                                   "Commanded rate of the gimbal, relative to the base; clipped at its limit"},
                                  "gyro.", apply_actuators<&ActuatorCommands::gimbal_rate>),
    command<&Output::thruster>(
        {"thruster", Owner::thruster, 1, "1", nullptr, "on",
         "Whether the valve is open, or the share of a period for which it is; it stays open for its minimum time",
         kFlag},
        "thruster.", apply_actuators<&ActuatorCommands::thruster>),
}};

std::size_t input_signal(const char* name) {
  for (std::size_t i = 0; i < kInputSignals; ++i) {
    if (std::string_view(input_signals[i].about.name) == name) return i;
  }
  throw std::logic_error(fmt::format("there is no input signal {}", name));
}

const char* owner_name(SignalOwner owner) {
  constexpr std::array<const char*, 8> kNames = {"run",   "joint", "base",     "end-effector",
                                                 "wheel", "gyro",  "thruster", "target"};
  return kNames.at(static_cast<std::size_t>(owner));
}

std::string signal_unit(const ControllerSignal& signal, int k, bool is_prismatic) {
  std::string unit = k >= 3 && signal.rest_unit ? signal.rest_unit : signal.unit;
  if (!is_prismatic) return unit;
  if (unit == "N m") return "N";
  return unit.starts_with("rad") ? "m" + unit.substr(3) : unit;
}

std::string signal_unit(const ControllerSignal& signal) {
  std::string unit = signal_unit(signal, 0, false);
  if (signal.owner == Owner::joint) unit += " or " + signal_unit(signal, 0, true);
  if (signal.rest_unit) unit += std::string(", ") + signal.rest_unit;
  return unit;
}

std::vector<std::string> owner_names(SignalOwner owner, const ControlledRobot& robot) {
  std::vector<std::string> names;
  const auto add_parts = [&](const std::vector<ControlledRobot::Part>& parts) {
    for (const ControlledRobot::Part& part : parts) names.push_back(part.name);
    return names;
  };
  switch (owner) {
    case Owner::run:
    case Owner::base:
      return {""};
    case Owner::joint:
      return robot.joints;
    case Owner::end_effector:
      return add_parts(robot.end_effectors);
    case Owner::wheel:
      return add_parts(robot.wheels);
    case Owner::gyro:
      return add_parts(robot.gyros);
    case Owner::thruster:
      return robot.thrusters;
    case Owner::target:
      break;
  }
  return add_parts(robot.targets);
}

std::size_t owner_count(SignalOwner owner, const ControlledRobot& robot) { return owner_names(owner, robot).size(); }

std::size_t owner_count(SignalOwner owner, const grapnel_controller_input& in) {
  const std::array<int, 8> counts = {1, in.joints, 1, in.end_effectors, in.wheels, in.gyros, in.thrusters, in.targets};
  return static_cast<std::size_t>(counts.at(static_cast<std::size_t>(owner)));
}

bool is_sensed(const InputSignal& signal, std::size_t owner, const ControlledRobot& robot) {
  if (!signal.needs_sensor) return true;
  return (signal.about.owner == Owner::target ? robot.targets : robot.end_effectors).at(owner).has_sensor;
}

bool is_commanded(const CommandSignal& signal, const ControlledRobot& robot) {
  if (signal.about.owner == Owner::joint) return true;
  return signal.about.owner == Owner::base ? robot.commands_base : robot.commands_actuators;
}

// ---- Samples ----

void ControllerSample::begin_segment(const Model& model) {
  ++segment_;
  base_ = model.body_index(robot_.base);
  joints_.clear(), targets_.clear();
  for (const std::string& name : robot_.joints) joints_.push_back(joint_named(model, name));
  const auto bodies = [&](const std::vector<ControlledRobot::Part>& parts) {
    std::vector<int> list;
    for (const ControlledRobot::Part& part : parts) list.push_back(model.joints()[joint_named(model, part.in_model)]);
    return list;
  };
  wheels_ = bodies(robot_.wheels), gimbals_ = bodies(robot_.gyros);
  for (const ControlledRobot::Part& target : robot_.targets) targets_.push_back(model.frame_index(target.in_model));
}

void ControllerSample::read(const ControlInput& input) {
  const Posed X_WB = root_pose(input.model, input.state, base_);
  const Twistd V_WB = root_twist(input.model, input.state, base_);
  const Vector3d place = robot_.origin + input.time * robot_.velocity;
  const Source source{*this,
                      input,
                      X_WB.p + place,
                      V_WB.linear + robot_.velocity,
                      transpose(X_WB.R) * V_WB.angular,
                      quaternion_from(X_WB.R)};
  for (std::size_t i = 0; i < kInputSignals; ++i) {
    values_[i].clear();
    input_signals[i].read(source, values_[i]);
  }
}

grapnel_controller_input ControllerSample::in_c() const {
  grapnel_controller_input in{};
  in.size = sizeof(in);
  in.joints = static_cast<int>(robot_.joints.size());
  in.end_effectors = static_cast<int>(robot_.end_effectors.size());
  in.wheels = static_cast<int>(robot_.wheels.size());
  in.gyros = static_cast<int>(robot_.gyros.size());
  in.thrusters = static_cast<int>(robot_.thrusters.size());
  in.targets = static_cast<int>(robot_.targets.size());
  for (std::size_t i = 0; i < kInputSignals; ++i) input_signals[i].set(in, values_[i]);
  return in;
}

// ---- Commands ----

ControllerCommand::ControllerCommand(const ControlledRobot& robot) {
  for (std::size_t i = 0; i < kCommandSignals; ++i) {
    const ControllerSignal& signal = command_signals[i].about;
    values_[i].assign(owner_count(signal.owner, robot) * static_cast<std::size_t>(signal.size), 0.0);
  }
}

void ControllerCommand::clear() {
  for (std::vector<double>& values : values_) std::fill(values.begin(), values.end(), 0.0);
}

grapnel_controller_output ControllerCommand::in_c() {
  grapnel_controller_output output{};
  output.size = sizeof(output);
  for (std::size_t i = 0; i < kCommandSignals; ++i) command_signals[i].set(output, values_[i]);
  return output;
}

void ControllerCommand::take(grapnel_controller_output& output) {
  for (std::size_t i = 0; i < kCommandSignals; ++i) {
    if (command_signals[i].is_inside)
      std::copy_n(command_signals[i].values(output), values_[i].size(), values_[i].begin());
  }
}

void ControllerCommand::apply(const ControlledRobot& robot, std::span<const std::size_t> joints,
                              ControlCommand& command) const {
  for (std::size_t i = 0; i < kCommandSignals; ++i) {
    if (is_commanded(command_signals[i], robot)) command_signals[i].apply(values_[i], joints, command);
  }
}

}  // namespace grapnel
