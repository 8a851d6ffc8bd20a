#pragma once

/// @file
/// The signals between a run and a controller that is not a law of Grapnel. One table describes them; the C interface,
/// Python controllers, FMUs as controllers, exported plants and the columns of torque files follow from it.

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "grapnel/plugin/grapnel_controller.h"
#include "grapnel/simulate/controller_source.hpp"

namespace grapnel {

/// What a signal has values of: the parts of the robot and the targets, in their order.
enum class SignalOwner { run, joint, base, end_effector, wheel, gyro, thruster, target };

struct ControllerSignal {
  enum class Kind { real, whole, flag };
  const char* name;  // in C, in Python and of variables of an FMU
  SignalOwner owner;
  int size;               // numbers of each owner
  const char* unit;       // of a revolute joint: m for rad, and N for N m, of a prismatic one; "1": none
  const char* rest_unit;  // of the fourth number and the following; null: the same
  const char* plant;      // of an exported plant's variable, as "position" in joint.NAME.position; null: none
  const char* text;
  Kind kind = Kind::real;
};

/// What the readers of input signals use; internal to the table.
struct SignalSource;

/// A signal that a controller reads.
struct InputSignal {
  ControllerSignal about;
  bool needs_sensor;  // NaN without a sensor; others have true values
  void (*read)(const SignalSource&, std::vector<double>&);
  double (*value)(const grapnel_controller_input&, std::size_t);  // in the C structure
  void (*set)(grapnel_controller_input&, const std::vector<double>&);
};

/// A signal that a controller writes.
struct CommandSignal {
  ControllerSignal about;
  const char* column;  // in torque files: "wheel." in wheel.NAME
  void (*apply)(const std::vector<double>&, std::span<const std::size_t> joints, ControlCommand&);
  double* (*values)(grapnel_controller_output&);                  // in the C structure
  void (*set)(grapnel_controller_output&, std::vector<double>&);  // lets it refer to these
  bool is_inside;                                                 // an array in the C structure instead
};

inline constexpr std::size_t kInputSignals = 18, kCommandSignals = 5;
extern const std::array<InputSignal, kInputSignals> input_signals;
extern const std::array<CommandSignal, kCommandSignals> command_signals;

/// Index of an input signal. @throws std::logic_error if there is none.
std::size_t input_signal(const char* name);

/// Name of a kind of owners: "joint", "end-effector".
const char* owner_name(SignalOwner owner);
/// "rad", "m/s"; `k`: index in the numbers of an owner.
std::string signal_unit(const ControllerSignal& signal, int k, bool is_prismatic);
/// "rad or m", "N, N m".
std::string signal_unit(const ControllerSignal& signal);
/// Names of the owners in the scenario; one empty name for the run and the base.
std::vector<std::string> owner_names(SignalOwner owner, const ControlledRobot& robot);
std::size_t owner_count(SignalOwner owner, const ControlledRobot& robot);
std::size_t owner_count(SignalOwner owner, const grapnel_controller_input& input);
/// Whether the robot has a sensor for the signal of this owner, if it needs one.
bool is_sensed(const InputSignal& signal, std::size_t owner, const ControlledRobot& robot);
/// Whether the controller commands the signal.
bool is_commanded(const CommandSignal& signal, const ControlledRobot& robot);

/// Values per input signal, per owner.
using InputValues = std::array<std::vector<double>, kInputSignals>;

/// The input signals of a run at its samples. Belongs to one run.
class ControllerSample {
 public:
  explicit ControllerSample(ControlledRobot robot) : robot_(std::move(robot)) {}
  /// Before the first read(), and when the model has changed. @throws ControllerError if the model lacks a joint.
  void begin_segment(const Model& model);
  void read(const ControlInput& input);
  const InputValues& values() const { return values_; }
  /// The same as a C structure, which refers to these values.
  grapnel_controller_input in_c() const;

  const ControlledRobot& robot() const { return robot_; }
  int base() const { return base_; }  // body
  /// Positions in Model::joints().
  std::span<const std::size_t> joints() const { return joints_; }

 private:
  friend struct SignalSource;
  ControlledRobot robot_;
  int segment_ = -1, base_ = -1;
  std::vector<std::size_t> joints_;
  std::vector<int> wheels_, gimbals_;  // bodies
  std::vector<int> targets_;           // frames
  InputValues values_;
};

/// The commands of a controller, per signal, per owner. Belongs to one run.
class ControllerCommand {
 public:
  explicit ControllerCommand(const ControlledRobot& robot);
  void clear();
  std::vector<double>& operator[](std::size_t signal) { return values_.at(signal); }
  /// As a C structure, which refers to these values, and back from it: small arrays lie in the structure.
  grapnel_controller_output in_c();
  void take(grapnel_controller_output& output);
  /// Applies the signals that the controller commands.
  void apply(const ControlledRobot& robot, std::span<const std::size_t> joints, ControlCommand& command) const;

 private:
  std::array<std::vector<double>, kCommandSignals> values_;
};

}  // namespace grapnel
