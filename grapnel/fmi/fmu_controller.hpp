#pragma once

/// @file
/// FMUs as controllers. The FMU's clock stands at the sample: at the first one it is initialized with what is seen
/// there, and its outputs are the command; at every later one it has gone on from the sample before, with what was seen
/// then, and what it says now is the command. A command therefore follows from what was seen one sample earlier, in
/// addition to ControlTiming::delay, which is what co-simulation with held inputs means.

#include <memory>
#include <string>
#include <vector>

#include "grapnel/fmi/fmu.hpp"
#include "grapnel/plugin/plugin_controller.hpp"
#include "grapnel/simulate/controller_source.hpp"

namespace grapnel::fmi {

/// What does not fit between a scenario and an FMU: at which key of `control`, and at which entry there; empty: none.
struct FmuMisfit {
  std::string key, entry;
  std::string text;
};

/// Makes controllers of an FMU. Signals, i from 1 on in the order of the robot's joints: of inputs time, position[i],
/// rate[i], desired_position[i], desired_rate[i], desired_acceleration[i], base_position[1..3],
/// base_quaternion_wxyz[1..4], base_velocity[1..3], base_angular_velocity[1..3]; of outputs effort[i],
/// base_torque[1..3]; units and frames as in grapnel_controller.h. In place of position[i] it may be JOINT.position.
class FmuControllers final : public ControllerSource {
 public:
  /// `inputs`, `outputs`: JSON, objects {variable: signal}; variables that they do not name are the signals that they
  /// are called like. An input may have a constant in place of a signal, which is set once, or "start" or null: it
  /// keeps the value that it starts with, as inputs do that are no real numbers and are not named. @throws FmuError.
  FmuControllers(const std::string& file, const std::string& shown, std::string inputs, std::string outputs);

  /// All that does not fit: inputs without a value, efforts of joints (and the base's torque) that are no output,
  /// names, types and causalities, parameters, the period.
  std::vector<FmuMisfit> misfits(const std::vector<std::string>& joints, const std::string& parameters,
                                 bool commands_base, double period) const;
  std::shared_ptr<Controller> make(const ControlTiming& timing, const std::string& parameters, ControlledRobot robot,
                                   const Model& model) const override;
  bool one_at_a_time() const override { return fmu_->model().once_per_process; }

  const std::shared_ptr<const Fmu>& fmu() const { return fmu_; }
  const std::string& inputs() const { return inputs_; }
  const std::string& outputs() const { return outputs_; }

 private:
  std::shared_ptr<const Fmu> fmu_;
  std::string inputs_, outputs_;
  std::shared_ptr<const ControllerPlugin> functions_;
};

}  // namespace grapnel::fmi
