#pragma once

/// @file
/// Calls into external code.

#include <fmt/format.h>

#include <cfenv>
#include <string>

#include "grapnel/plugin/plugin_crash.hpp"
#include "grapnel/simulate/controller.hpp"

namespace grapnel {

/// Restores the floating-point environment (rounding mode and flags). A library may change it when it is loaded or
/// called, which would change later results of this thread.
struct KeepsFloatingPoint {
  std::fenv_t environment;
  KeepsFloatingPoint() { std::fegetenv(&environment); }
  KeepsFloatingPoint(const KeepsFloatingPoint&) = delete;
  KeepsFloatingPoint& operator=(const KeepsFloatingPoint&) = delete;
  ~KeepsFloatingPoint() { std::fesetenv(&environment); }
};

/// Restores the working directory: result paths are relative to it. Costs two calls of stat().
class KeepsDirectory {
 public:
  KeepsDirectory();
  ~KeepsDirectory();
  KeepsDirectory(const KeepsDirectory&) = delete;
  KeepsDirectory& operator=(const KeepsDirectory&) = delete;
};

/// Calls a function of a controller, named e.g. "the plugin 'mine.so'", and records it for crash reports (see
/// PluginCall). The interface is C, but a plugin in C++ may throw. @throws ControllerError if it threw an exception.
template <class Call>
auto guarded(const std::string& named, const char* function, double time, const Call& call) {
  const PluginCall blame(named.c_str(), function, time);
  const KeepsFloatingPoint kept;
  const KeepsDirectory directory;
  try {
    return call();
  } catch (...) {
    throw ControllerError(fmt::format("{} threw a C++ exception from {}() at t = {:.9g} s; return an error instead",
                                      named, function, time));
  }
}

}  // namespace grapnel
