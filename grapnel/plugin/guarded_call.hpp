#pragma once

/// @file
/// Calls into code that is not Grapnel's.

#include <fmt/format.h>

#include <cfenv>
#include <string>

#include "grapnel/plugin/plugin_crash.hpp"
#include "grapnel/simulate/controller.hpp"

namespace grapnel {

/// Rounding and flags are the caller's: a library may change them when it is loaded or called, and the bits of
/// everything that this thread computes afterwards.
struct KeepsFloatingPoint {
  std::fenv_t environment;
  KeepsFloatingPoint() { std::fegetenv(&environment); }
  KeepsFloatingPoint(const KeepsFloatingPoint&) = delete;
  KeepsFloatingPoint& operator=(const KeepsFloatingPoint&) = delete;
  ~KeepsFloatingPoint() { std::fesetenv(&environment); }
};

/// The working directory is the caller's: results go to paths that are relative to it. Costs two calls of stat().
class KeepsDirectory {
 public:
  KeepsDirectory();
  ~KeepsDirectory();
  KeepsDirectory(const KeepsDirectory&) = delete;
  KeepsDirectory& operator=(const KeepsDirectory&) = delete;
};

/// Calls a function of a controller that is called so, "the plugin 'mine.so'": with whom to blame for a crash (see
/// PluginCall). It is C, but one in C++ may forget that. @throws ControllerError where it threw an exception.
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
