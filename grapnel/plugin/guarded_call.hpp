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
struct FloatingPointGuard {
  std::fenv_t environment;
  FloatingPointGuard() { std::fegetenv(&environment); }
  FloatingPointGuard(const FloatingPointGuard&) = delete;
  FloatingPointGuard& operator=(const FloatingPointGuard&) = delete;
  ~FloatingPointGuard() { std::fesetenv(&environment); }
};

/// Restores the working directory: result paths are relative to it. Costs two calls of stat().
class DirectoryGuard {
 public:
  DirectoryGuard();
  ~DirectoryGuard();
  DirectoryGuard(const DirectoryGuard&) = delete;
  DirectoryGuard& operator=(const DirectoryGuard&) = delete;
};

/// Calls a function of a controller, named e.g. "the plugin 'mine.so'", and records it for crash reports (see
/// PluginCall). The interface is C, but a plugin in C++ may throw. @throws ControllerError if it threw an exception.
template <class Call>
auto guarded(const std::string& named, const char* function, double time, const Call& call) {
  const PluginCall blame(named.c_str(), function, time);
  const FloatingPointGuard kept;
  const DirectoryGuard directory;
  try {
    return call();
  } catch (...) {
    throw ControllerError(fmt::format("{} threw a C++ exception from {}() at t = {:.9g} s; return an error instead",
                                      named, function, time));
  }
}

}  // namespace grapnel
