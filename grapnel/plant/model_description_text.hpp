#pragma once

/// @file
/// Model description of an exported plant: the text of modelDescription.xml, according to the Functional Mock-up
/// Interface 2.0 (section 2.2 and 4.3) and 3.0 (section 2.4 and 4.3).

#include <string>

#include "grapnel/plant/plant_variables.hpp"

namespace grapnel {

struct PlantDescription {
  int version = 2;         // of FMI: 2 or 3
  std::string name;        // of the model
  std::string identifier;  // of its binary: a C identifier
  std::string token;       // guid, instantiationToken
  std::string tool;        // generating tool, "Grapnel 0.1.0"
  double period = 0;       // [s]
  double stop = 0;         // maximum duration of the run [s]
};

/// Converts any text to a C identifier.
std::string c_identifier(const std::string& text);

std::string model_description_text(const PlantDescription& description, const PlantVariables& variables);

}  // namespace grapnel
