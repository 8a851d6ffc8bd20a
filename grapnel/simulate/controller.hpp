#pragma once

/// @file
/// Controllers, which compute efforts of joints and a torque on the base from the state, and sampled control, in which
/// commands are computed at the sample times of an on-board clock and held until the next command.
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

/// The input of a controller. Valid during the call only.
struct ControlInput {
  double time;         // of the scenario's clock [s]
  const Model& model;  // used by the laws (PhaseSetup::law_model)
  /// In the frame of the computation. Quantities that PhaseSetup::sensors read have measured values; others are true.
  /// Velocities of roots follow from the conserved momenta if these are recovered.
  const State& state;
  /// Per Model::joints(), the reference [rad, rad/s, rad/s^2, or in m]; zero for joints without a reference.
  std::span<const JointPoint> reference;
  /// Per Model::joints(), the measured position and rate, with the noise of tracking [rad, rad/s; m, m/s]. The
  /// acceleration is not measured and zero.
  std::span<const JointPoint> sensed;
  /// Generalized forces that act besides the controller's, per velocity: friction, efforts of joints under other laws,
  /// and attitude control on its root [N m or N]. Loads, an orbit's field and gravity are not included.
  std::span<const double> force;
  const SensorReadings* readings = nullptr;  // besides the state; null without sensors
};

/// Commands of the individual actuators of the base, in the robot's order. Empty: actuators of this kind are idle:
/// motors give no torque, gimbals are at rest, valves are closed.
struct ActuatorCommands {
  std::vector<double> wheel_torque = {};  // of the motors on the wheels [N m]
  std::vector<double> gimbal_rate = {};   // of control moment gyros, relative to the base [rad/s]
  std::vector<double> thruster = {};      // fraction of a period of the clock during which the valve is open [1]
};

/// The output of a controller.
struct ControlCommand {
  /// Per Model::joints() [N m or N]; zero on call. Used for joints under JointControl::controller, and limited.
  std::span<double> effort;
  /// On PhaseSetup::commanded_root, in its axes [N m]; zero on call, ignored without such a root.
  Vector3d base_torque = Vector3d::zero();
  /// Used only with BaseActuators::one_by_one.
  ActuatorCommands actuators = {};
};

/// Thrown by a controller that cannot continue, or whose command is not finite: it ends the run with this message.
struct ControllerError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A controller. Under sampled control (ControlClock) it is called at the clock's sample times, once each and in order,
/// and may have internal state. Otherwise it is called in each evaluation of dy/dt, at times in any order; its output
/// must then be a function of the input alone, smooth between the breaks of the trajectories, since step size control
/// fails otherwise.
class Controller {
 public:
  Controller() = default;
  Controller(const Controller&) = delete;
  Controller& operator=(const Controller&) = delete;
  virtual ~Controller() = default;

  /// A piece of the run begins at `time`: called before the first piece, and after grasps have closed or opened, when
  /// the model changes, with other indices and masses. The controller's internal state remains.
  virtual void begin_piece(const Model& model, double time) {
    static_cast<void>(model);
    static_cast<void>(time);
  }
  /// Reads the input, writes the command. @throws ControllerError.
  virtual void update(const ControlInput& input, ControlCommand& command) = 0;
};

/// Speed limit of plausible motion under sampled control [rad/s or m/s]: an unstable loop grows exponentially, and the
/// number of steps between samples would explode before any value overflows.
inline constexpr double kRunaway = 1e4;

/// Timing of an on-board computer.
struct ControlTiming {
  double period = 0.01;  // T [s]
  double delay = 0;      // from a sample to its command [s]
  bool operator==(const ControlTiming&) const = default;
};

/// The clock of sampled control and the held commands. Sensors are read at t = kT, k = 0, 1, ...; the laws' commands
/// act from kT + delay until the next command; before the first one efforts are zero. Times are those of the scenario.
/// The clock belongs to a run and outlives the run's pieces: held commands remain through grasps and releases, and
/// delayed commands still arrive. Commands are stored by channel, since joints' indices change when a target joins or
/// leaves the model (PhaseSetup::channels).
class ControlClock {
 public:
  struct Command {
    std::vector<double> effort;  // per channel [N m or N]
    Vector3d base_torque = Vector3d::zero();
    std::vector<double> wheel_rates = {};  // of PhaseSetup::wheels, as read by the laws at the sample time [rad/s]
    ActuatorCommands actuators = {};
  };

  /// @throws std::invalid_argument if the period is not positive and finite, or the delay negative or not finite.
  ControlClock(const ControlTiming& timing, std::size_t channels);

  const ControlTiming& timing() const { return timing_; }
  std::size_t channels() const { return held_.effort.size(); }
  /// Sample times, and times at which commands begin to act, strictly between t0 and t1 > t0; unordered.
  std::vector<double> break_times(double t0, double t1) const;
  /// Advances to the time t: due commands begin to act. Returns whether sensors are to be read, followed by command().
  /// Sample times outside all pieces of the run, as during a compliant impact, are omitted. Times that differ by at
  /// most `same` [s] are equal, as in phase_breaks().
  bool tick(double t, double same = 0);
  /// Stores the laws' command at the current sample time.
  void command(Command said, double t, double same = 0);
  /// The acting command.
  const Command& held() const { return held_; }
  /// Number of delayed commands.
  std::size_t on_their_way() const { return pending_.size(); }
  /// The acting command and the delayed ones, oldest first.
  std::vector<Command> commands() const;
  /// Replaces the values of all these commands, in that order. @throws std::invalid_argument if their number differs.
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
  double tick_ = 0;  // current sample time
  std::deque<Pending> pending_;
  Command held_;
};

}  // namespace grapnel
