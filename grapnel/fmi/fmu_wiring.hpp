#pragma once

/// @file
/// The connections between the variables of an FMU and the signals of a controller. Internal to this module.

#include <string>
#include <variant>
#include <vector>

#include "grapnel/fmi/fmi_functions.hpp"
#include "grapnel/fmi/fmu_controller.hpp"
#include "grapnel/plugin/grapnel_controller.h"

namespace grapnel::fmi {

/// A part of a controller's input or output, and the index in it, from 0.
struct Signal {
  int part = 0;
  int index = 0;
  auto operator<=>(const Signal&) const = default;
};
constexpr int kEffortPart = 0, kBaseTorquePart = 1;  // of outputs
double seen_value(const grapnel_controller_input& in, const Signal& signal);

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

/// `inputs`, `outputs`, `parameters`: JSON, see FmuControllers. Mismatches are appended to `misfits`.
Wiring wire(const Fmu& fmu, const std::string& inputs, const std::string& outputs,
            const std::vector<std::string>& joints, bool commands_base, std::vector<FmuMisfit>& misfits);
std::vector<Constant> parameters_of(const Fmu& fmu, const std::string& parameters, std::vector<FmuMisfit>& misfits);
void check_period(const Fmu& fmu, double period, std::vector<FmuMisfit>& misfits);

}  // namespace grapnel::fmi
