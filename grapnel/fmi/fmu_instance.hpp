#pragma once

/// @file
/// An instance of an FMU of either version of the standard.

#include <memory>
#include <span>
#include <string>

#include "grapnel/fmi/fmi_functions.hpp"
#include "grapnel/fmi/fmu.hpp"

namespace grapnel::fmi {

/// Order of calls: construction, set_parameter() and set() as required, initialization, steps. A function that returns
/// discard, error or fatal throws FmuError with its name, the status and the FMU's log. A crash is attributed to the
/// FMU (PluginCall). Thread safety: one thread at a time.
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

  /// Initializes at `time`. Outputs depend on inputs set before.
  void begin_initialization(double time);
  void end_initialization();
  /// Steps from `time` on, with the inputs set last. @throws FmuError also if the step is incomplete.
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
  std::string said_;  // the last logged message of an error
};

}  // namespace grapnel::fmi
