#include "grapnel/capture/sensor_run.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "grapnel/capture/internal_loads.hpp"

namespace grapnel {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
const Vector3d kUnread{kNan, kNan, kNan};

std::size_t end_effector_index(const CaptureProblem& problem, const std::string& name) {
  const auto& all = problem.robot.end_effectors;
  const auto found = std::find_if(all.begin(), all.end(), [&](const EndEffectorSetup& e) { return e.name == name; });
  return static_cast<std::size_t>(found - all.begin());
}

const JointDescription& joint_of(const CaptureSystem& system, std::size_t joint) {
  return system.model.joint_body(system.robot_joints[joint]).description.joint;
}
const Body& body_of(const CaptureSystem& system, int joint) { return system.model.joint_body(joint); }

}  // namespace

// Sensor setup => names, units and components of the measured time series, in the order of sensed_values(); empty
// without sensors.
std::vector<SensedSeries> sensed_series(const CaptureProblem& problem, const CaptureSystem& system) {
  std::vector<SensedSeries> series;
  if (!problem.sensors) return series;
  const SensorSetup& s = *problem.sensors;
  const std::vector<std::string> xyz{"x", "y", "z"}, wxyz{"w", "x", "y", "z"};
  if (s.joints) {
    std::vector<std::string> names;
    for (std::size_t j = 0; j < system.robot_joints.size(); ++j) names.push_back(joint_of(system, j).name);
    series.push_back({"joints/measured_position", "rad", "last encoder readings of the positions", names});
    series.push_back({"joints/measured_velocity", "rad/s", "rates that the laws receive", names});
  }
  if (s.gyro)
    series.push_back({"base/measured_angular_velocity", "rad/s",
                      "last gyro reading of the angular velocity, in the base's axes", xyz});
  if (s.attitude)
    series.push_back({"base/measured_quaternion_wxyz", "1", "last reading of the orientation of the base in W", wxyz});
  if (s.wheels) {
    std::vector<std::string> names;
    for (const WheelSetup& wheel : problem.robot.wheels) names.push_back(wheel.name);
    series.push_back({"wheels/measured_rate", "rad/s", "last readings of the rates of the reaction wheels", names});
  }
  for (const WristSensor& w : s.wrists) {
    series.push_back({"end_effectors/" + w.end_effector + "/measured_force", "N",
                      "last reading of the force on the robot, in the end-effector's axes", xyz});
    series.push_back({"end_effectors/" + w.end_effector + "/measured_torque", "N m",
                      "torque on the robot about the end-effector's origin, likewise", xyz});
  }
  for (const RelativePoseSensor& r : s.relative_poses) {
    const std::string group = "targets/" + r.target;
    series.push_back(
        {group + "/measured_position", "m", "reading of the position relative to the base, in its axes", xyz});
    series.push_back(
        {group + "/measured_quaternion_wxyz", "1", "reading of the orientation relative to the base", wxyz});
  }
  return series;
}

// Problem => channels with sample times and noise stream numbers; a sensor's noise is independent of the other sensors.
// Throws CaptureProblemError if a list has not one number per joint.
SensorRun::SensorRun(const CaptureProblem& problem, IdentificationRun& identification)
    : problem_(problem),
      setup_(problem.sensors.value_or(SensorSetup{})),
      period_(problem.control->timing.period),
      identification_(identification) {
  const auto fits = [&](const std::vector<double>& values) {
    return values.empty() || values.size() == problem.joint_position.size();
  };
  const auto& identify = problem.post_impact ? problem.post_impact->identify : std::nullopt;
  if ((setup_.joints && !fits(setup_.joints->bias)) ||
      (identify && identify->excitation && identify->excitation->amplitude.size() != problem.joint_position.size()))
    throw CaptureProblemError("sensors.joints.bias and post_impact.identify.excitation need a number per joint");
  std::uint32_t next = 0;  // a sensor's noise is independent of which other sensors exist
  const auto numbered = [&](Channels c) {
    c.sensor = next++;
    return c;
  };
  if (setup_.joints) {
    joints_ = numbered(channels("joint position", "rad", setup_.joints->sample_time));
    rates_ = numbered(channels("joint rate", "rad/s", setup_.joints->sample_time));
  }
  next = 2;
  if (setup_.gyro) gyro_ = numbered(channels("gyro", "rad/s", setup_.gyro->sample_time));
  next = 3;
  if (setup_.attitude) attitude_ = numbered(channels("attitude", "rad", setup_.attitude->sample_time));
  next = 4;
  if (setup_.wheels) wheels_ = numbered(channels("wheel rate", "rad/s", setup_.wheels->sample_time));
  readings_.wrists.assign(problem.robot.end_effectors.size(), Wrenchd{kUnread, kUnread});
  const Rotationd none{{{kNan, kNan, kNan}, {kNan, kNan, kNan}, {kNan, kNan, kNan}}};
  readings_.targets.assign(problem.targets.size(), {{none, kUnread}, {kUnread, kUnread}});
  for (const WristSensor& w : setup_.wrists) {
    next = 16 + 2 * static_cast<std::uint32_t>(end_effector_index(problem, w.end_effector));
    forces_.push_back(numbered(channels("force " + w.end_effector, "N", w.sample_time)));
    torques_.push_back(numbered(channels("torque " + w.end_effector, "N m", w.sample_time)));
  }
  for (const RelativePoseSensor& r : setup_.relative_poses) {
    next = 1'000'000 + 3 * static_cast<std::uint32_t>(target_index(problem, r.target));
    positions_.push_back(numbered(channels("position of " + r.target, "m", r.sample_time)));
    turns_.push_back(numbered(channels("orientation of " + r.target, "rad", r.sample_time)));
    velocities_.push_back(numbered(channels("motion of " + r.target, "m/s, rad/s", r.sample_time)));
  }
  pending_.resize(setup_.relative_poses.size()), fixes_.resize(setup_.relative_poses.size());
}

SensorRun::Channels SensorRun::channels(std::string name, std::string unit, double sample_time) {
  Channels c;
  c.name = std::move(name), c.unit = std::move(unit);
  c.every = sample_time > 0 ? std::max(1L, std::lround(sample_time / period_)) : 1;
  c.sample_time = static_cast<double>(c.every) * period_;
  return c;
}

double SensorRun::normal(const Channels& c, std::size_t channel) const {
  return normal_number(setup_.seed, c.sensor, static_cast<std::uint32_t>(channel), static_cast<std::uint64_t>(c.taken));
}

void SensorRun::note(Channels& c, double error) {
  c.sum += error, c.squares += error * error, ++c.count;
  c.largest = std::max(c.largest, std::abs(error));
}

void SensorRun::begin_segment(const CaptureSystem& system) { system_ = &system; }

bool SensorRun::needs_forces() const { return !setup_.wrists.empty() && system_ && !system_->grasps.empty(); }

// At a sample time: applies (20.1) to each channel, then computes the values that laws receive.
void SensorRun::read(const PhaseSample& sample, State& seen) {
  const long tick = std::lround(sample.time / period_);
  const State& truth = sample.state;
  read_motion(sample.time, truth, seen);
  if (!forces_.empty()) read_wrists(tick, sample);
  if (!positions_.empty()) read_targets(tick, sample.time, truth);
  identification_.take(*system_, sample, seen);
}

void SensorRun::read_motion(double time, const State& truth, State& seen) {
  const long tick = std::lround(time / period_);
  if (joints_) read_joints(tick, time, truth, seen);
  if (gyro_) read_gyro(tick, truth, seen);
  if (attitude_) read_attitude(tick, time, truth, seen);
  if (wheels_) read_wheels(tick, truth, seen);
}

// Whether the time is a sample time of the sensor whose reading has not been taken yet.
bool SensorRun::takes_reading_at(const Channels& c, double time, double last_time) const {
  const double same = 1e-9 * std::max(period_, std::abs(time));
  const long tick = std::lround(time / period_);
  if (!c.held.empty() && std::abs(last_time - time) <= same) return false;
  return std::abs(static_cast<double>(tick) * period_ - time) <= same && due(c, tick);
}

// True state at `time` [s] => the same state with the measured joint positions (20.1) and base attitude (20.3): the
// last readings, or the readings of this instant if they are due.
State SensorRun::known_posture(const CaptureSystem& system, const State& truth, double time) const {
  State known = truth;
  if (joints_) {
    std::vector<double> readings = joints_->held;
    if (readings.empty() || takes_reading_at(*joints_, time, joints_time_)) readings = joint_readings(system, truth);
    for (std::size_t j = 0; j < readings.size(); ++j) known.q[body_of(system, system.robot_joints[j]).q] = readings[j];
  }
  if (attitude_ && system.model.has_free_root(system.base)) {
    const int q = system.model.bodies()[system.base].q + 3;
    std::vector<double> reading = attitude_->held;
    if (reading.empty() || takes_reading_at(*attitude_, time, attitude_time_)) {
      const Quaterniond read = attitude_reading(root_pose(system.model, truth, system.base).R);
      reading = {read.w, read.x, read.y, read.z};
    }
    std::copy_n(reading.begin(), 4, known.q.begin() + q);
  }
  return known;
}

// The next reading of the encoders, (20.1).
std::vector<double> SensorRun::joint_readings(const CaptureSystem& system, const State& truth) const {
  const JointSensors& sensor = *setup_.joints;
  std::vector<double> readings;
  for (std::size_t j = 0; j < system.robot_joints.size(); ++j) {
    double noisy = truth.q[body_of(system, system.robot_joints[j]).q] + (sensor.bias.empty() ? 0 : sensor.bias[j]);
    if (sensor.noise > 0) noisy += sensor.noise * normal(*joints_, j);
    readings.push_back(quantized(noisy, sensor.position_quantum()));
  }
  return readings;
}

// The next reading of the attitude, (20.3).
Quaterniond SensorRun::attitude_reading(const Rotationd& R_WB) const {
  const AttitudeSensor& sensor = *setup_.attitude;
  Vector3d error = sensor.bias;
  for (int k = 0; k < 3 && sensor.noise > 0; ++k)
    error[k] += sensor.noise * normal(*attitude_, static_cast<std::size_t>(k));
  Rotationd R = R_WB * rotation_by(error);
  if (sensor.quantum > 0) {
    Vector3d turn = rotation_vector(R);
    for (double& x : turn.e) x = quantized(x, sensor.quantum);
    R = rotation_by(turn);
  }
  return quaternion_from(R);
}

// Sample number, true state => joint positions (20.1) and rates (20.2) in `seen`: new readings if due, otherwise the
// last ones; exact rates stay.
void SensorRun::read_joints(long tick, double time, const State& truth, State& seen) {
  const JointSensors& sensor = *setup_.joints;
  const std::size_t n = system_->robot_joints.size();
  if (due(*joints_, tick)) {
    last_position_ = joints_->held;
    rates_->held.resize(n);
    joints_->held = joint_readings(*system_, truth);
    for (std::size_t j = 0; j < n; ++j)
      note(*joints_, joints_->held[j] - truth.q[body_of(*system_, system_->robot_joints[j]).q]);
    ++joints_->taken;
    read_joint_rates(time, truth);
    joints_time_ = time;
  }
  for (std::size_t j = 0; j < n; ++j) {
    const Body& body = body_of(*system_, system_->robot_joints[j]);
    if (!joints_->held.empty()) seen.q[body.q] = joints_->held[j];
    if (!rates_->held.empty() && sensor.rate != JointSensors::Rate::exact) seen.v[body.v] = rates_->held[j];
  }
}

// (20.2), or from separate sensors.
void SensorRun::read_joint_rates(double time, const State& truth) {
  const JointSensors& sensor = *setup_.joints;
  for (std::size_t j = 0; j < rates_->held.size(); ++j) {
    const double rate = truth.v[body_of(*system_, system_->robot_joints[j]).v];
    double reading = rate;
    if (sensor.rate == JointSensors::Rate::difference) {
      const bool is_first = last_position_.empty() || !(time > joints_time_);
      reading = is_first ? 0 : (joints_->held[j] - last_position_[j]) / (time - joints_time_);
    } else if (sensor.rate == JointSensors::Rate::sensor) {
      reading += sensor.rate_bias;
      if (sensor.rate_noise > 0) reading += sensor.rate_noise * normal(*rates_, j);
      reading = quantized(reading, sensor.rate_quantum);
    }
    rates_->held[j] = reading;
    note(*rates_, reading - rate);
  }
  ++rates_->taken;
}

// Sample number, true state => angular velocity of the base in its axes [rad/s] in `seen`, by (20.1) or the last
// reading; nothing for a fixed base.
void SensorRun::read_gyro(long tick, const State& truth, State& seen) {
  if (!system_->model.has_free_root(system_->base)) return;
  const GyroSensor& sensor = *setup_.gyro;
  const int v = system_->model.bodies()[system_->base].v;
  if (due(*gyro_, tick)) {
    gyro_->held.resize(3);
    const double deviation = sensor.deviation(period_);
    for (int k = 0; k < 3; ++k) {
      double noisy = truth.v[v + k] + sensor.bias[k];
      if (deviation > 0) noisy += deviation * normal(*gyro_, static_cast<std::size_t>(k));
      gyro_->held[k] = quantized(noisy, sensor.quantum);
      note(*gyro_, gyro_->held[k] - truth.v[v + k]);
    }
    ++gyro_->taken;
  }
  if (!gyro_->held.empty()) std::copy_n(gyro_->held.begin(), 3, seen.v.begin() + v);
}

// Sample number, true state => orientation of the base in W in `seen`, by (20.3) or the last reading; nothing for a
// fixed base.
void SensorRun::read_attitude(long tick, double time, const State& truth, State& seen) {
  if (!system_->model.has_free_root(system_->base)) return;
  const int q = system_->model.bodies()[system_->base].q + 3;
  if (due(*attitude_, tick)) {
    const Rotationd R_WB = rotation_matrix(Quaterniond{truth.q[q], truth.q[q + 1], truth.q[q + 2], truth.q[q + 3]});
    const Quaterniond read = attitude_reading(R_WB);
    attitude_->held = {read.w, read.x, read.y, read.z};
    const Vector3d off = rotation_vector(transpose(R_WB) * rotation_matrix(read));
    for (double x : off.e) note(*attitude_, x);
    ++attitude_->taken;
    attitude_time_ = time;
  }
  if (!attitude_->held.empty()) std::copy_n(attitude_->held.begin(), 4, seen.q.begin() + q);
}

// Sample number, true state => wheel rates relative to the base [rad/s] in `seen`, by (20.1) or the last readings.
void SensorRun::read_wheels(long tick, const State& truth, State& seen) {
  const WheelSensors& sensor = *setup_.wheels;
  if (due(*wheels_, tick)) {
    wheels_->held.resize(system_->wheels.size());
    for (std::size_t w = 0; w < system_->wheels.size(); ++w) {
      const double rate = truth.v[body_of(*system_, system_->wheels[w]).v];
      double noisy = rate + sensor.bias;
      if (sensor.noise > 0) noisy += sensor.noise * normal(*wheels_, w);
      wheels_->held[w] = quantized(noisy, sensor.quantum);
      note(*wheels_, wheels_->held[w] - rate);
    }
    ++wheels_->taken;
  }
  for (std::size_t w = 0; w < wheels_->held.size(); ++w)
    seen.v[body_of(*system_, system_->wheels[w]).v] = wheels_->held[w];
}

// Sample number, sample => force and torque on the robot at each end-effector's origin, in its axes, by (20.1), where a
// reading is due. The truth is the sum of its grasp wrenches.
void SensorRun::read_wrists(long tick, const PhaseSample& sample) {
  const Model& model = system_->model;
  std::vector<Wrenchd> truth(setup_.wrists.size(), Wrenchd::zero());
  const bool any_due = std::any_of(forces_.begin(), forces_.end(), [&](const Channels& c) { return due(c, tick); });
  if (any_due && !system_->grasps.empty()) {
    const Kinematics kinematics = forward_kinematics(model, sample.state);
    const std::vector<GraspWrench> wrenches = wrenches_of_grasps(*system_, kinematics, sample);
    for (std::size_t i = 0; i < setup_.wrists.size(); ++i) {
      const int frame = model.frame_index(setup_.wrists[i].end_effector);
      const Posed X_WE = frame_pose(model, kinematics, frame);
      for (std::size_t g = 0; g < system_->grasps.size(); ++g) {
        const HeldGrasp& held = system_->grasps[g];
        if (problem_.grasps[held.grasp].end_effector != setup_.wrists[i].end_effector) continue;
        const Vector3d p_WC = kinematics.X_WB[held.frames.body_a] * held.frames.X_AC.p;
        const Wrenchd& F = wrenches[g].F_WC;
        truth[i].linear += transposed_times(X_WE.R, F.linear);
        truth[i].angular += transposed_times(X_WE.R, F.angular + cross(p_WC - X_WE.p, F.linear));
      }
    }
  }
  for (std::size_t i = 0; i < setup_.wrists.size(); ++i) {
    if (!due(forces_[i], tick)) continue;
    const WristSensor& sensor = setup_.wrists[i];
    const auto take = [&](Channels& c, const Vector3d& x, const Vector3d& bias, double noise, double quantum) {
      Vector3d reading = x + bias;
      for (int k = 0; k < 3; ++k) {
        if (noise > 0) reading[k] += noise * normal(c, static_cast<std::size_t>(k));
        reading[k] = quantized(reading[k], quantum);
        note(c, reading[k] - x[k]);
      }
      c.held.assign(reading.e, reading.e + 3);
      ++c.taken;
      return reading;
    };
    Wrenchd& reading = readings_.wrists[end_effector_index(problem_, sensor.end_effector)];
    reading.linear = take(forces_[i], truth[i].linear, sensor.force_bias, sensor.force_noise, sensor.force_quantum);
    reading.angular =
        take(torques_[i], truth[i].angular, sensor.torque_bias, sensor.torque_noise, sensor.torque_quantum);
  }
}

void SensorRun::read_targets(long tick, double time, const State& truth) {
  for (std::size_t i = 0; i < positions_.size(); ++i) {
    if (due(positions_[i], tick)) read_target(i, time, truth);
  }
  let_arrive(time);
}

// (20.4)
void SensorRun::read_target(std::size_t i, double time, const State& truth) {
  const RelativePoseSensor& sensor = setup_.relative_poses[i];
  const Model& model = system_->model;
  const Kinematics k = forward_kinematics(model, truth);
  const int frame = system_->target_frames[target_index(problem_, sensor.target)];
  const Posed X_WB = k.X_WB[system_->base], X_BT = inverse(X_WB) * frame_pose(model, k, frame);
  const Twistd V_WB = k.V_WB[system_->base], V_WT = frame_twist(model, k, frame);
  const Vector3d velocity = transposed_times(X_WB.R, V_WT.linear - V_WB.linear);
  const Vector3d angular = transposed_times(X_WB.R, V_WT.angular);
  const auto noisy = [&](const Channels& c, std::size_t first, Vector3d x, double deviation) {
    for (int a = 0; a < 3 && deviation > 0; ++a) x[a] += deviation * normal(c, first + static_cast<std::size_t>(a));
    return x;
  };
  SensorReadings::Target reading;
  reading.X_BT.p = noisy(positions_[i], 0, X_BT.p + sensor.position_bias, sensor.position_noise);
  const Vector3d turn = noisy(turns_[i], 0, sensor.orientation_bias, sensor.orientation_noise);
  reading.X_BT.R = norm(turn) > 0 ? X_BT.R * rotation_by(turn) : X_BT.R;
  reading.V_BT.linear = noisy(velocities_[i], 0, velocity, sensor.velocity_noise);
  reading.V_BT.angular = noisy(velocities_[i], 3, angular, sensor.angular_velocity_noise);
  for (int a = 0; a < 3; ++a) {
    note(positions_[i], reading.X_BT.p[a] - X_BT.p[a]);
    note(turns_[i], turn[a]);
    note(velocities_[i], reading.V_BT.linear[a] - velocity[a]);
    note(velocities_[i], reading.V_BT.angular[a] - angular[a]);
  }
  ++positions_[i].taken, ++turns_[i].taken, ++velocities_[i].taken;
  const TargetMotion motion{X_WB * reading.X_BT,
                            {X_WB.R * reading.V_BT.angular, V_WB.linear + X_WB.R * reading.V_BT.linear}};
  pending_[i].push_back({time + sensor.delay, time, reading, motion});
}

// Time [s] => target readings whose delay has passed become available to laws and estimates, in their order.
void SensorRun::let_arrive(double time) {
  const double now = time + 1e-9 * period_;
  for (std::size_t i = 0; i < pending_.size(); ++i) {
    while (!pending_[i].empty() && pending_[i].front().usable <= now) {
      const Pending& p = pending_[i].front();
      readings_.targets[target_index(problem_, setup_.relative_poses[i].target)] = p.reading;
      const Quaterniond q = quaternion_from(p.reading.X_BT.R);
      positions_[i].held.assign(p.reading.X_BT.p.e, p.reading.X_BT.p.e + 3);
      turns_[i].held = {q.w, q.x, q.y, q.z};
      fixes_[i] = Fix{p.time, p.motion};
      pending_[i].pop_front();
    }
  }
}

std::optional<SensorRun::Fix> SensorRun::fix(std::size_t target, double time) {
  let_arrive(time);
  for (std::size_t i = 0; i < fixes_.size(); ++i) {
    if (target_index(problem_, setup_.relative_poses[i].target) == target) return fixes_[i];
  }
  return {};
}

// Channels => last readings in the order of sensed_series(); NaN before the first reading.
std::vector<std::vector<double>> SensorRun::sensed_values() const {
  std::vector<std::vector<double>> values;
  const auto add = [&](const Channels& c, std::size_t width) {
    values.push_back(c.held.size() == width ? c.held : std::vector<double>(width, kNan));
  };
  const std::size_t joints = problem_.joint_position.size();
  if (joints_) add(*joints_, joints), add(*rates_, joints);
  if (gyro_) add(*gyro_, 3);
  if (attitude_) add(*attitude_, 4);
  if (wheels_) add(*wheels_, problem_.robot.wheels.size());
  for (std::size_t i = 0; i < forces_.size(); ++i) add(forces_[i], 3), add(torques_[i], 3);
  for (std::size_t i = 0; i < positions_.size(); ++i) add(positions_[i], 3), add(turns_[i], 4);
  return values;
}

// Channels => per sensor with readings: count, mean, root mean square and largest magnitude of its errors.
std::vector<SensorReport> SensorRun::reports() const {
  std::vector<SensorReport> all;
  const auto add = [&](const Channels& c) {
    if (c.count == 0) return;
    const auto n = static_cast<double>(c.count);
    all.push_back({c.name, c.unit, c.sample_time, c.count, c.sum / n, std::sqrt(c.squares / n), c.largest});
  };
  for (const auto* one : {&joints_, &rates_, &gyro_, &attitude_, &wheels_}) {
    if (*one) add(**one);
  }
  for (std::size_t i = 0; i < forces_.size(); ++i) add(forces_[i]), add(torques_[i]);
  for (std::size_t i = 0; i < positions_.size(); ++i) add(positions_[i]), add(turns_[i]), add(velocities_[i]);
  return all;
}

}  // namespace grapnel
