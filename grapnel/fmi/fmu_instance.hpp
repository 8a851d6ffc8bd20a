#pragma once

/// @file
/// An instance of an FMU, whichever version of the standard it follows.

#include <memory>
#include <span>
#include <string>

#include "grapnel/fmi/fmi_functions.hpp"
#include "grapnel/fmi/fmu.hpp"

namespace grapnel::fmi {

/// Instantiated, then, after set_parameter() and set() as wanted, initialized, then stepped. A function that returns
/// discard, error or fatal throws FmuError with its name, the status and what the FMU has logged. A crash in one is
/// blamed on it (PluginCall). Thread safety: one thread at a time.
class FmuInstance {
 public:
  explicit FmuInstance(std::shared_ptr<const Fmu> fmu);
  ~FmuInstance();
  FmuInstance(const FmuInstance&) = delete;
  FmuInstance& operator=(const FmuInstance&) = delete;

  void set_whole(const Variable& variable, int value);
  void set_boolean(const Variable& variable, bool value);
  void set_text(const Variable& variable, const std::string& value);
  /// Variables of type real.
  void set(std::span<const Reference> variables, std::span<const double> values);
  void get(std::span<const Reference> variables, std::span<double> values);

  /// At `time`. Inputs that have been set before count in the outputs.
  void begin_initialization(double time);
  void end_initialization();
  /// From `time` on, with the inputs that were set last. @throws FmuError also if it does not come so far.
  void step(double time, double length);

 private:
  template <class Call>
  void call(const char* name, const Call& function);
  void log(int status, const std::string& text);
  static void log_2(void* environment, const char* instance, int status, const char* category, const char* message,
                    ...);
  static void log_3(void* environment, int status, const char* category, const char* message);

  std::shared_ptr<const Fmu> fmu_;
  bool is_2_;
  Callbacks2 callbacks_;
  Instance instance_ = nullptr;
  double time_ = 0;
  bool is_initialized_ = false, is_lost_ = false;
  std::string said_;  // what it logged last of what went wrong
};

}  // namespace grapnel::fmi
