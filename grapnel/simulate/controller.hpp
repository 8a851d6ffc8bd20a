#pragma once

/// @file
/// Controllers: what says efforts of joints and a torque on the base from the state, and sampled control, in which all
/// that is said is said at the ticks of an on-board clock and held until the next command.
///
/// Thread safety: a controller and a clock belong to one run, and to one thread at a time.

#include <cstdint>
#include <deque>
#include <span>
#include <stdexcept>
#include <vector>

#include "grapnel/dynamics/state.hpp"
#include "grapnel/model/model.hpp"
#include "grapnel/simulate/joint_trajectory.hpp"
#include "grapnel/simulate/sensor_reader.hpp"
#include "grapnel/spatial/vector3.hpp"

namespace grapnel {

/// What a controller sees. Everything is valid during the call alone.
struct ControlInput {
  double time;         // of the scenario's clock [s]
  const Model& model;  // that the laws work with (PhaseSetup::law_model)
  /// In the frame in which the run computes. Where PhaseSetup::sensors read it, as they do; else as it is, roots'
  /// velocities being those of the conserved momenta, where they are recovered.
  const State& state;
  /// Per Model::joints(), what it is to follow [rad, rad/s, rad/s^2, or in m]; zero for joints that follow nothing.
  std::span<const JointPoint> reference;
  /// Per Model::joints(), what its sensor reads: position and rate with the noise of tracking [rad, rad/s; m, m/s]. The
  /// acceleration is not sensed and zero.
  std::span<const JointPoint> sensed;
  /// Generalized forces that act beside what it says, per velocity: friction, efforts of joints under other laws, and
  /// attitude control on its root [N m or N]. Loads, an orbit's field and gravity are not among them.
  std::span<const double> force;
  const SensorReadings* readings = nullptr;  // beside the state; null without sensors
};

/// What the base's actuators are told one by one, in the robot's order; empty: nothing of its kind is told anything,
/// and motors give no torque, gimbals stand still, valves are closed.
struct ActuatorCommands {
  std::vector<double> wheel_torque = {};  // of the motors on the wheels [N m]
  std::vector<double> gimbal_rate = {};   // of control moment gyros, relative to the base [rad/s]
  std::vector<double> thruster = {};      // share of a period of the clock for which the valve opens [1]
};

/// What a controller says.
struct ControlCommand {
  /// Per Model::joints() [N m or N]; zero when asked. Read of joints under JointControl::controller, and cut at their
  /// limits.
  std::span<double> effort;
  /// On PhaseSetup::commanded_root, in its axes [N m]; zero when asked, not read without such a root.
  Vector3d base_torque = Vector3d::zero();
  /// Read only where BaseActuators::one_by_one says so.
  ActuatorCommands actuators = {};
};

/// Thrown by a controller that cannot go on, and where one says what is no number: it ends the run with this message.
struct ControllerError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A controller. Under sampled control (ControlClock) it is asked at the clock's ticks, once each and in their order,
/// and may keep a state of its own. Otherwise it is asked in every evaluation of dy/dt, in any order of times, and what
/// it says must be a function of the input alone, smooth between the breaks of the trajectories: anything else and the
/// integration's error control fights it.
class Controller {
 public:
  Controller() = default;
  Controller(const Controller&) = delete;
  Controller& operator=(const Controller&) = delete;
  virtual ~Controller() = default;

  /// A piece of the run begins at `time`: before the first, and whenever grasps have closed or opened, after which the
  /// model is another one, with other indices and masses. What the controller knows of its own state stays.
  virtual void begin_piece(const Model& model, double time) {
    static_cast<void>(model);
    static_cast<void>(time);
  }
  /// Reads the input, writes the command. @throws ControllerError.
  virtual void update(const ControlInput& input, ControlCommand& command) = 0;
};

/// Under sampled control nothing that is meant is faster [rad/s or m/s]: an unstable loop grows exponentially, and
/// would not come to numbers that are not finite before the steps between its samples had become countless.
inline constexpr double kRunaway = 1e4;

/// When an on-board computer speaks.
struct ControlTiming {
  double period = 0.01;  // T [s]
  double delay = 0;      // from a sample to the command that follows from it [s]
  bool operator==(const ControlTiming&) const = default;
};

/// The clock of sampled control and what is held. Sensors are read at t = kT, k = 0, 1, ..., and what the laws make of
/// it acts from kT + delay on, until the next command does; before the first one efforts are zero. Times are those of
/// the scenario. It belongs to a run and outlives the run's pieces: what is held stays held through grasps and
/// releases, and commands on their way arrive. Commands are kept by channel, since joints' indices change where a
/// target is joined to the model or leaves it (PhaseSetup::channels).
class ControlClock {
 public:
  struct Command {
    std::vector<double> effort;  // per channel [N m or N]
    Vector3d base_torque = Vector3d::zero();
    std::vector<double> wheel_rates = {};  // of PhaseSetup::wheels, as the laws saw them at the tick [rad/s]
    ActuatorCommands actuators = {};
  };

  /// @throws std::invalid_argument if the period is not positive and finite, or the delay negative or not finite.
  ControlClock(const ControlTiming& timing, std::size_t channels);

  const ControlTiming& timing() const { return timing_; }
  std::size_t channels() const { return held_.effort.size(); }
  /// Ticks, and times at which commands begin to act, strictly between t0 and t1 > t0; not in order.
  std::vector<double> break_times(double t0, double t1) const;
  /// The time is t now: commands that are due act. Whether sensors are to be read, which is then said by command().
  /// Ticks that no piece of the run has seen, as during an impact in time, are left out. Times that differ by up to
  /// `same` [s] are one, as phase_breaks() has it.
  bool tick(double t, double same = 0);
  /// What the laws say at the tick at hand.
  void command(Command said, double t, double same = 0);
  /// What acts.
  const Command& held() const { return held_; }
  /// How many commands are on their way.
  std::size_t on_their_way() const { return pending_.size(); }
  /// What acts, and what is on its way, oldest first.
  std::vector<Command> commands() const;
  /// Gives all of these other values, in that order. @throws std::invalid_argument if there are not as many.
  void put(std::vector<Command> commands);

 private:
  struct Pending {
    double acts_from;
    Command command;
  };
  double tick_time(std::int64_t k) const { return static_cast<double>(k) * timing_.period; }
  void let_act(double until);

  ControlTiming timing_;
  std::int64_t next_tick_ = 0;
  double tick_ = 0;  // the tick at hand
  std::deque<Pending> pending_;
  Command held_;
};

}  // namespace grapnel
