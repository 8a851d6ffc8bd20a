#pragma once

/// @file
/// The description of an FMU: its modelDescription.xml.

#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace grapnel::fmi {

/// An FMU that cannot be used; what() is a sentence.
struct FmuError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct Variable {
  enum class Type { real, whole, boolean, text, other };  // whole: 32 bits
  std::string name;
  unsigned reference = 0;
  Type type = Type::other;
  std::string type_name;  // name in the standard's version: "Real", "Float64"
  std::string causality;  // "input"; "local" if not stated
  bool is_array = false;  // of version 3.0
};

struct ModelDescription {
  int version = 0;         // 2 or 3
  std::string name;        // of the model
  std::string token;       // guid, instantiationToken
  std::string identifier;  // of the binary for co-simulation
  bool once_per_process = false;
  std::optional<double> fixed_step;  // of its internal integration; steps must be multiples of it [s]
  std::vector<Variable> variables;
};

/// @throws FmuError.
ModelDescription read_model_description(std::string_view xml);

}  // namespace grapnel::fmi
