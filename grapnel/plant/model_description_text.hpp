#pragma once

/// @file
/// What an exported plant says of itself: the text of modelDescription.xml, after the Functional Mock-up Interface 2.0
/// (section 2.2 and 4.3) and 3.0 (section 2.4 and 4.3).

#include <string>

#include "grapnel/plant/plant_variables.hpp"

namespace grapnel {

struct PlantDescription {
  int version = 2;         // of FMI: 2 or 3
  std::string name;        // of the model
  std::string identifier;  // of its binary: a name in C
  std::string token;       // guid, instantiationToken
  std::string tool;        // which wrote it, "Grapnel 0.1.0"
  double period = 0;       // [s]
  double stop = 0;         // how long the run may last [s]
};

/// A name in C of any text.
std::string c_identifier(const std::string& text);

std::string model_description_text(const PlantDescription& description, const PlantVariables& variables);

}  // namespace grapnel
