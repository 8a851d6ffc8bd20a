#pragma once

/// @file
/// The C functions of FMUs for co-simulation that Grapnel calls, declared from the text of the standards: Functional
/// Mock-up Interface 2.0 (2014, sections 2.1 and 4.2) and 3.0 (2022, sections 2.2 and 4.2).

#include <cstddef>
#include <cstdint>

namespace grapnel::fmi {

/// Return values of functions, in both versions; pending exists only in 2.0.
enum Status : int { kOk, kWarning, kDiscard, kError, kFatal, kPending };

using Instance = void*;
using Reference = unsigned int;  // of a variable

// ---- 2.0 ----

using Boolean2 = int;
using Logger2 = void (*)(void* environment, const char* instance, int status, const char* category, const char* message,
                         ...);
struct Callbacks2 {
  Logger2 logger;
  void* (*allocate)(std::size_t count, std::size_t size);
  void (*free)(void* memory);
  void (*step_finished)(void* environment, int status);
  void* environment;
};
constexpr int kCoSimulation2 = 1;  // of fmi2Type

using GetVersion = const char* (*)();
using Instantiate2 = Instance (*)(const char* name, int type, const char* guid, const char* resources,
                                  const Callbacks2* callbacks, Boolean2 visible, Boolean2 logging);
using FreeInstance = void (*)(Instance);
using SetupExperiment2 = int (*)(Instance, Boolean2 has_tolerance, double tolerance, double start, Boolean2 has_stop,
                                 double stop);
using Plain = int (*)(Instance);  // modes, reset, terminate
using GetReal2 = int (*)(Instance, const Reference*, std::size_t count, double* values);
using SetReal2 = int (*)(Instance, const Reference*, std::size_t count, const double* values);
using SetInteger2 = int (*)(Instance, const Reference*, std::size_t count, const int* values);
using SetBoolean2 = int (*)(Instance, const Reference*, std::size_t count, const Boolean2* values);
using SetString2 = int (*)(Instance, const Reference*, std::size_t count, const char* const* values);
using DoStep2 = int (*)(Instance, double time, double step, Boolean2 no_return_to_before);

// ---- 3.0 ----

using LogMessage3 = void (*)(void* environment, int status, const char* category, const char* message);
using Instantiate3 = Instance (*)(const char* name, const char* token, const char* resources, bool visible,
                                  bool logging, bool event_mode, bool early_return, const Reference* required,
                                  std::size_t count, void* environment, LogMessage3, void* intermediate_update);
using EnterInitialization3 = int (*)(Instance, bool has_tolerance, double tolerance, double start, bool has_stop,
                                     double stop);
using GetFloat3 = int (*)(Instance, const Reference*, std::size_t count, double* values, std::size_t value_count);
using SetFloat3 = int (*)(Instance, const Reference*, std::size_t count, const double* values, std::size_t value_count);
using SetInt3 = int (*)(Instance, const Reference*, std::size_t count, const std::int32_t* values,
                        std::size_t value_count);
using SetBoolean3 = int (*)(Instance, const Reference*, std::size_t count, const bool* values, std::size_t value_count);
using SetString3 = int (*)(Instance, const Reference*, std::size_t count, const char* const* values,
                           std::size_t value_count);
using DoStep3 = int (*)(Instance, double time, double step, bool no_return_to_before, bool* event_needed,
                        bool* terminate, bool* early_return, double* reached);

}  // namespace grapnel::fmi
