#pragma once

/// @file
/// FMUs as controllers. At the first sample the FMU is initialized with the values sensed then, and its outputs are the
/// command. At each later sample it has been stepped from the previous sample, with the values sensed there, and its
/// outputs are the command. A command therefore depends on values sensed one sample earlier, in addition to
/// ControlTiming::delay, as in co-simulation with held inputs.

#include <memory>
#include <string>
#include <vector>

#include "grapnel/control/fmu.hpp"
#include "grapnel/control/plugin_controller.hpp"

namespace grapnel::fmi {

/// A mismatch between a scenario and an FMU: the key of `control`, and the entry there; empty: none.
struct FmuMisfit {
  std::string key, entry;
  std::string text;
};

/// Creates controllers from an FMU. Its signals are those of controller_signals.hpp: NAME[i] or OWNER.NAME of one
/// number per owner, NAME[k] of the run or the base, NAME[i,k] or OWNER.NAME[k] of several numbers per owner, from 1.
class FmuControllers final : public ControllerSource {
 public:
  /// `inputs`, `outputs`: JSON objects {variable: signal}; a variable that they do not name is the signal of the same
  /// name. An input may have a constant instead of a signal, which is set once, or "start" or null, which keeps its
  /// start value. Unnamed inputs that are not real numbers keep their start values, too. @throws FmuError.
  FmuControllers(const std::string& file, const std::string& shown, std::string inputs, std::string outputs);

  /// All mismatches: inputs without a value or a sensor, commands that are no output, names, types and causalities,
  /// parameters, the period. Of `robot` the names are used.
  std::vector<FmuMisfit> misfits(const ControlledRobot& robot, const std::string& parameters, double period) const;
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
