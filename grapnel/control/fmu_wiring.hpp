#pragma once

/// @file
/// The connections between the variables of an FMU and the signals of a controller. Internal to this module.

#include <string>
#include <variant>
#include <vector>

#include "grapnel/control/fmi_functions.hpp"
#include "grapnel/control/fmu_controller.hpp"

namespace grapnel::fmi {

/// An index in input_signals or command_signals, and in the signal's values, from 0.
struct Signal {
  std::size_t signal = 0;
  std::size_t index = 0;
  auto operator<=>(const Signal&) const = default;
};

struct Connections {
  std::vector<Reference> variables;
  std::vector<Signal> signals;
};

/// A variable that is set once.
struct Constant {
  Variable variable;
  std::variant<double, int, bool, std::string> value;
};

struct Wiring {
  Connections inputs, outputs;
  std::vector<Constant> constants;  // of inputs
};

/// `inputs`, `outputs`, `parameters`: JSON, see FmuControllers; of `robot` the names are used. Mismatches are appended
/// to `misfits`.
Wiring wire(const Fmu& fmu, const std::string& inputs, const std::string& outputs, const ControlledRobot& robot,
            std::vector<FmuMisfit>& misfits);
std::vector<Constant> parameters_of(const Fmu& fmu, const std::string& parameters, std::vector<FmuMisfit>& misfits);
void check_period(const Fmu& fmu, double period, std::vector<FmuMisfit>& misfits);

}  // namespace grapnel::fmi
