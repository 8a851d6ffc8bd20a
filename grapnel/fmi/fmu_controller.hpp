#pragma once

/// @file
/// FMUs as controllers. At the first sample the FMU is initialized with the values sensed then, and its outputs are the
/// command. At each later sample it has been stepped from the previous sample, with the values sensed there, and its
/// outputs are the command. A command therefore depends on values sensed one sample earlier, in addition to
/// ControlTiming::delay, as in co-simulation with held inputs.

#include <memory>
#include <string>
#include <vector>

#include "grapnel/fmi/fmu.hpp"
#include "grapnel/plugin/plugin_controller.hpp"
#include "grapnel/simulate/controller_source.hpp"

namespace grapnel::fmi {

/// A mismatch between a scenario and an FMU: the key of `control`, and the entry there; empty: none.
struct FmuMisfit {
  std::string key, entry;
  std::string text;
};

/// Creates controllers from an FMU. Signals, with i from 1 on in the order of the robot's joints. Inputs: time,
/// position[i], rate[i], desired_position[i], desired_rate[i], desired_acceleration[i], base_position[1..3],
/// base_quaternion_wxyz[1..4], base_velocity[1..3], base_angular_velocity[1..3]. Outputs: effort[i], base_torque[1..3].
/// Units and frames as in grapnel_controller.h. JOINT.position may replace position[i].
class FmuControllers final : public ControllerSource {
 public:
  /// `inputs`, `outputs`: JSON objects {variable: signal}; a variable that they do not name is the signal of the same
  /// name. An input may have a constant instead of a signal, which is set once, or "start" or null, which keeps its
  /// start value. Unnamed inputs that are not real numbers keep their start values, too. @throws FmuError.
  FmuControllers(const std::string& file, const std::string& shown, std::string inputs, std::string outputs);

  /// All mismatches: inputs without a value, efforts of joints (and the base's torque) that are no output, names, types
  /// and causalities, parameters, the period.
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
