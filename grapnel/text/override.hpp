#pragma once

/// @file
/// Values that replace values of an input file.

#include <string>

namespace grapnel {

/// A value that replaces a value of the file, or adds one. The path names keys, list items by index and named items by
/// name: `approach.duration`, `targets[0].mass`, `targets.target-1.mass`, `robot.base.mass` (also for a robot in a
/// separate file). The value is YAML: `10`, `[1, 0, 0]`, `{match: twist}`.
struct Override {
  std::string path;
  std::string value;
};

/// Splits the argument of --set at its first "=". @throws InputError if there is none.
Override parse_override(const std::string& argument);

/// "--set path=value", as in messages.
std::string override_text(const Override& change);

}  // namespace grapnel
