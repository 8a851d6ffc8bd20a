// The functions of the Functional Mock-up Interface 3.0 for co-simulation (2022, sections 2.2 and 4.2), declared from
// the text of the standard. Functions of other interface types return an error.
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <stdexcept>
#include <string>

#include "exported.hpp"
#include "grapnel/fmi/fmi_functions.hpp"
#include "plant_instance.hpp"

namespace {

using namespace grapnel::fmu;
using grapnel::PlantVariable;
using grapnel::fmi::LogMessage3;
using grapnel::fmi::Reference;
using VariableType = PlantVariable::Type;
using Instance = void*;
using Status3 = int;
using Environment = void*;

PlantInstance* plant(Instance instance) { return static_cast<PlantInstance*>(instance); }

constexpr std::initializer_list<Mode> kAnywhere = {Mode::instantiated, Mode::initialization, Mode::stepping,
                                                   Mode::terminated, Mode::failed};
constexpr std::initializer_list<Mode> kBeforeEnd = {Mode::instantiated, Mode::initialization, Mode::stepping};

template <class Function>
Status3 call(Instance instance, const char* name, std::initializer_list<Mode> allowed, const Function& function) {
  PlantInstance* const own = plant(instance);
  if (!own) return static_cast<Status3>(Status::error);
  return static_cast<Status3>(own->call(name, allowed, [&] { function(*own); }));
}

Status3 refuse(Instance instance, const char* name, const char* why) {
  return static_cast<Status3>(instance ? plant(instance)->refuse(name, why) : Status::error);
}

void check_counts(std::size_t count, std::size_t values) {
  if (count != values)
    throw Refused(Status::error, "all variables are scalars: the numbers of values and value references must be equal");
}

template <class Value>
Status3 get(Instance instance, const char* name, VariableType type, const Reference* references, std::size_t count,
            Value* values, std::size_t value_count) {
  return call(instance, name, kAnywhere, [&](PlantInstance& own) {
    check_counts(count, value_count);
    check_arrays(references, values, count);
    for (std::size_t i = 0; i < count; ++i) values[i] = static_cast<Value>(own.get(type, references[i]));
  });
}

template <class Value>
Status3 set(Instance instance, const char* name, VariableType type, const Reference* references, std::size_t count,
            const Value* values, std::size_t value_count) {
  return call(instance, name, kBeforeEnd, [&](PlantInstance& own) {
    check_counts(count, value_count);
    check_arrays(references, values, count);
    for (std::size_t i = 0; i < count; ++i) own.set(type, references[i], static_cast<double>(values[i]));
  });
}

void log_refusal(Environment environment, LogMessage3 log, const char* function, const std::string& why) {
  if (log) log(environment, static_cast<int>(Status::error), "logStatusError", (function + (": " + why)).c_str());
}

constexpr const char* kNoSuchType = "the plant has no variables of this type";
constexpr const char* kNoState = "canGetAndSetFMUState is false";
constexpr const char* kNoDerivatives = "the plant provides no derivatives";
constexpr const char* kNoEvents = "hasEventMode is false";
constexpr const char* kNoConfiguration = "the plant has no structural parameters";
constexpr const char* kNoClocks = "the plant has no clocks";
constexpr const char* kOtherInterface = "the plant is for co-simulation only";
constexpr const char* kNoCounts = "providesPerElementDependencies is false";

}  // namespace

GRAPNEL_FMI_FUNCTION const char* fmi3GetVersion() { return "3.0"; }

GRAPNEL_FMI_FUNCTION Status3 fmi3SetDebugLogging(Instance instance, bool, std::size_t, const char* const*) {
  return call(instance, "fmi3SetDebugLogging", kAnywhere, [](PlantInstance&) {});
}

GRAPNEL_FMI_FUNCTION Instance fmi3InstantiateCoSimulation(const char*, const char* token, const char* resources, bool,
                                                          bool, bool event_mode, bool, const Reference*,
                                                          std::size_t intermediate, Environment environment,
                                                          LogMessage3 log, void*) {
  const char* const name = "fmi3InstantiateCoSimulation";
  try {
    if (event_mode) throw std::runtime_error(kNoEvents);
    if (intermediate > 0) throw std::runtime_error("providesIntermediateUpdate is false");
    return new PlantInstance(resources_path(resources), token ? token : "",
                             [=](Status status, const char* category, const std::string& message) {
                               if (log) log(environment, static_cast<int>(status), category, message.c_str());
                             });
  } catch (const std::exception& error) {
    log_refusal(environment, log, name, error.what());
  } catch (...) {
    log_refusal(environment, log, name, "an exception of unknown type");
  }
  return nullptr;
}
GRAPNEL_FMI_FUNCTION Instance fmi3InstantiateModelExchange(const char*, const char*, const char*, bool, bool,
                                                           Environment environment, LogMessage3 log) {
  log_refusal(environment, log, "fmi3InstantiateModelExchange", kOtherInterface);
  return nullptr;
}
GRAPNEL_FMI_FUNCTION Instance fmi3InstantiateScheduledExecution(const char*, const char*, const char*, bool, bool,
                                                                Environment environment, LogMessage3 log, void*, void*,
                                                                void*) {
  log_refusal(environment, log, "fmi3InstantiateScheduledExecution", kOtherInterface);
  return nullptr;
}
GRAPNEL_FMI_FUNCTION void fmi3FreeInstance(Instance instance) { delete plant(instance); }

GRAPNEL_FMI_FUNCTION Status3 fmi3EnterInitializationMode(Instance instance, bool, double, double start, bool, double) {
  return call(instance, "fmi3EnterInitializationMode", {Mode::instantiated}, [&](PlantInstance& own) {
    own.set_start(start);
    own.enter_initialization();
  });
}
GRAPNEL_FMI_FUNCTION Status3 fmi3ExitInitializationMode(Instance instance) {
  return call(instance, "fmi3ExitInitializationMode", {Mode::initialization},
              [](PlantInstance& own) { own.exit_initialization(); });
}
GRAPNEL_FMI_FUNCTION Status3 fmi3Terminate(Instance instance) {
  return call(instance, "fmi3Terminate", {Mode::stepping}, [](PlantInstance& own) { own.terminate(); });
}
GRAPNEL_FMI_FUNCTION Status3 fmi3Reset(Instance instance) {
  return call(instance, "fmi3Reset", kAnywhere, [](PlantInstance& own) { own.reset(); });
}

// For a step to the end of the run or beyond it, requests termination from the master.
GRAPNEL_FMI_FUNCTION Status3 fmi3DoStep(Instance instance, double time, double size, bool, bool* event_needed,
                                        bool* terminate, bool* early_return, double* reached) {
  if (!instance) return static_cast<Status3>(Status::error);
  PlantInstance& own = *plant(instance);
  if (event_needed) *event_needed = false;
  if (early_return) *early_return = false;
  const Status status = own.call("fmi3DoStep", {Mode::stepping}, [&] { own.step(time, size, Status::discard); });
  if (terminate) *terminate = own.has_ended();
  if (reached) *reached = own.time();
  return static_cast<Status3>(status);
}

GRAPNEL_FMI_FUNCTION Status3 fmi3GetFloat64(Instance instance, const Reference* vr, std::size_t count, double* values,
                                            std::size_t value_count) {
  return get(instance, "fmi3GetFloat64", VariableType::real, vr, count, values, value_count);
}
GRAPNEL_FMI_FUNCTION Status3 fmi3GetInt32(Instance instance, const Reference* vr, std::size_t count,
                                          std::int32_t* values, std::size_t value_count) {
  return get(instance, "fmi3GetInt32", VariableType::whole, vr, count, values, value_count);
}
GRAPNEL_FMI_FUNCTION Status3 fmi3GetBoolean(Instance instance, const Reference* vr, std::size_t count, bool* values,
                                            std::size_t value_count) {
  return get(instance, "fmi3GetBoolean", VariableType::boolean, vr, count, values, value_count);
}
GRAPNEL_FMI_FUNCTION Status3 fmi3SetFloat64(Instance instance, const Reference* vr, std::size_t count,
                                            const double* values, std::size_t value_count) {
  return set(instance, "fmi3SetFloat64", VariableType::real, vr, count, values, value_count);
}
GRAPNEL_FMI_FUNCTION Status3 fmi3SetInt32(Instance instance, const Reference* vr, std::size_t count,
                                          const std::int32_t* values, std::size_t value_count) {
  return set(instance, "fmi3SetInt32", VariableType::whole, vr, count, values, value_count);
}
GRAPNEL_FMI_FUNCTION Status3 fmi3SetBoolean(Instance instance, const Reference* vr, std::size_t count,
                                            const bool* values, std::size_t value_count) {
  return set(instance, "fmi3SetBoolean", VariableType::boolean, vr, count, values, value_count);
}

// ---- Types that no variable has ----

#define GRAPNEL_NO_VARIABLES(NAME, VALUE)                                                                          \
  GRAPNEL_FMI_FUNCTION Status3 fmi3Get##NAME(Instance instance, const Reference*, std::size_t count, VALUE*,       \
                                             std::size_t) {                                                        \
    return count == 0 ? 0 : refuse(instance, "fmi3Get" #NAME, kNoSuchType);                                        \
  }                                                                                                                \
  GRAPNEL_FMI_FUNCTION Status3 fmi3Set##NAME(Instance instance, const Reference*, std::size_t count, const VALUE*, \
                                             std::size_t) {                                                        \
    return count == 0 ? 0 : refuse(instance, "fmi3Set" #NAME, kNoSuchType);                                        \
  }
GRAPNEL_NO_VARIABLES(Float32, float)
GRAPNEL_NO_VARIABLES(Int8, std::int8_t)
GRAPNEL_NO_VARIABLES(UInt8, std::uint8_t)
GRAPNEL_NO_VARIABLES(Int16, std::int16_t)
GRAPNEL_NO_VARIABLES(UInt16, std::uint16_t)
GRAPNEL_NO_VARIABLES(UInt32, std::uint32_t)
GRAPNEL_NO_VARIABLES(Int64, std::int64_t)
GRAPNEL_NO_VARIABLES(UInt64, std::uint64_t)
using Text = const char*;
GRAPNEL_NO_VARIABLES(String, Text)
#undef GRAPNEL_NO_VARIABLES
GRAPNEL_FMI_FUNCTION Status3 fmi3GetBinary(Instance instance, const Reference*, std::size_t, std::size_t*,
                                           const std::uint8_t**, std::size_t) {
  return refuse(instance, "fmi3GetBinary", kNoSuchType);
}
GRAPNEL_FMI_FUNCTION Status3 fmi3SetBinary(Instance instance, const Reference*, std::size_t, const std::size_t*,
                                           const std::uint8_t* const*, std::size_t) {
  return refuse(instance, "fmi3SetBinary", kNoSuchType);
}
GRAPNEL_FMI_FUNCTION Status3 fmi3GetClock(Instance instance, const Reference*, std::size_t, bool*) {
  return refuse(instance, "fmi3GetClock", kNoClocks);
}
GRAPNEL_FMI_FUNCTION Status3 fmi3SetClock(Instance instance, const Reference*, std::size_t, const bool*) {
  return refuse(instance, "fmi3SetClock", kNoClocks);
}

// ---- Functions for capabilities that the model description denies ----

GRAPNEL_FMI_FUNCTION Status3 fmi3GetNumberOfVariableDependencies(Instance instance, Reference, std::size_t*) {
  return refuse(instance, "fmi3GetNumberOfVariableDependencies", kNoCounts);
}
GRAPNEL_FMI_FUNCTION Status3 fmi3GetVariableDependencies(Instance instance, Reference, std::size_t*, Reference*,
                                                         std::size_t*, int*, std::size_t) {
  return refuse(instance, "fmi3GetVariableDependencies", kNoCounts);
}
GRAPNEL_FMI_FUNCTION Status3 fmi3GetFMUState(Instance instance, void**) {
  return refuse(instance, "fmi3GetFMUState", kNoState);
}
GRAPNEL_FMI_FUNCTION Status3 fmi3SetFMUState(Instance instance, void*) {
  return refuse(instance, "fmi3SetFMUState", kNoState);
}
GRAPNEL_FMI_FUNCTION Status3 fmi3FreeFMUState(Instance instance, void**) {
  return refuse(instance, "fmi3FreeFMUState", kNoState);
}
GRAPNEL_FMI_FUNCTION Status3 fmi3SerializedFMUStateSize(Instance instance, void*, std::size_t*) {
  return refuse(instance, "fmi3SerializedFMUStateSize", kNoState);
}
GRAPNEL_FMI_FUNCTION Status3 fmi3SerializeFMUState(Instance instance, void*, std::uint8_t*, std::size_t) {
  return refuse(instance, "fmi3SerializeFMUState", kNoState);
}
GRAPNEL_FMI_FUNCTION Status3 fmi3DeserializeFMUState(Instance instance, const std::uint8_t*, std::size_t, void**) {
  return refuse(instance, "fmi3DeserializeFMUState", kNoState);
}
GRAPNEL_FMI_FUNCTION Status3 fmi3GetDirectionalDerivative(Instance instance, const Reference*, std::size_t,
                                                          const Reference*, std::size_t, const double*, std::size_t,
                                                          double*, std::size_t) {
  return refuse(instance, "fmi3GetDirectionalDerivative", kNoDerivatives);
}
GRAPNEL_FMI_FUNCTION Status3 fmi3GetAdjointDerivative(Instance instance, const Reference*, std::size_t,
                                                      const Reference*, std::size_t, const double*, std::size_t,
                                                      double*, std::size_t) {
  return refuse(instance, "fmi3GetAdjointDerivative", kNoDerivatives);
}
GRAPNEL_FMI_FUNCTION Status3 fmi3GetOutputDerivatives(Instance instance, const Reference*, std::size_t,
                                                      const std::int32_t*, double*, std::size_t) {
  return refuse(instance, "fmi3GetOutputDerivatives", kNoDerivatives);
}
GRAPNEL_FMI_FUNCTION Status3 fmi3EnterConfigurationMode(Instance instance) {
  return refuse(instance, "fmi3EnterConfigurationMode", kNoConfiguration);
}
GRAPNEL_FMI_FUNCTION Status3 fmi3ExitConfigurationMode(Instance instance) {
  return refuse(instance, "fmi3ExitConfigurationMode", kNoConfiguration);
}
GRAPNEL_FMI_FUNCTION Status3 fmi3EnterEventMode(Instance instance) {
  return refuse(instance, "fmi3EnterEventMode", kNoEvents);
}
GRAPNEL_FMI_FUNCTION Status3 fmi3EnterStepMode(Instance instance) {
  return refuse(instance, "fmi3EnterStepMode", kNoEvents);
}
GRAPNEL_FMI_FUNCTION Status3 fmi3UpdateDiscreteStates(Instance instance, bool*, bool*, bool*, bool*, bool*, double*) {
  return refuse(instance, "fmi3UpdateDiscreteStates", kNoEvents);
}
GRAPNEL_FMI_FUNCTION Status3 fmi3EvaluateDiscreteStates(Instance instance) {
  return refuse(instance, "fmi3EvaluateDiscreteStates", kNoEvents);
}
GRAPNEL_FMI_FUNCTION Status3 fmi3GetIntervalDecimal(Instance instance, const Reference*, std::size_t, double*, int*) {
  return refuse(instance, "fmi3GetIntervalDecimal", kNoClocks);
}
GRAPNEL_FMI_FUNCTION Status3 fmi3GetIntervalFraction(Instance instance, const Reference*, std::size_t, std::uint64_t*,
                                                     std::uint64_t*, int*) {
  return refuse(instance, "fmi3GetIntervalFraction", kNoClocks);
}
GRAPNEL_FMI_FUNCTION Status3 fmi3GetShiftDecimal(Instance instance, const Reference*, std::size_t, double*) {
  return refuse(instance, "fmi3GetShiftDecimal", kNoClocks);
}
GRAPNEL_FMI_FUNCTION Status3 fmi3GetShiftFraction(Instance instance, const Reference*, std::size_t, std::uint64_t*,
                                                  std::uint64_t*) {
  return refuse(instance, "fmi3GetShiftFraction", kNoClocks);
}
GRAPNEL_FMI_FUNCTION Status3 fmi3SetIntervalDecimal(Instance instance, const Reference*, std::size_t, const double*) {
  return refuse(instance, "fmi3SetIntervalDecimal", kNoClocks);
}
GRAPNEL_FMI_FUNCTION Status3 fmi3SetIntervalFraction(Instance instance, const Reference*, std::size_t,
                                                     const std::uint64_t*, const std::uint64_t*) {
  return refuse(instance, "fmi3SetIntervalFraction", kNoClocks);
}
GRAPNEL_FMI_FUNCTION Status3 fmi3SetShiftDecimal(Instance instance, const Reference*, std::size_t, const double*) {
  return refuse(instance, "fmi3SetShiftDecimal", kNoClocks);
}
GRAPNEL_FMI_FUNCTION Status3 fmi3SetShiftFraction(Instance instance, const Reference*, std::size_t,
                                                  const std::uint64_t*, const std::uint64_t*) {
  return refuse(instance, "fmi3SetShiftFraction", kNoClocks);
}
GRAPNEL_FMI_FUNCTION Status3 fmi3ActivateModelPartition(Instance instance, Reference, double) {
  return refuse(instance, "fmi3ActivateModelPartition", kOtherInterface);
}
GRAPNEL_FMI_FUNCTION Status3 fmi3EnterContinuousTimeMode(Instance instance) {
  return refuse(instance, "fmi3EnterContinuousTimeMode", kOtherInterface);
}
GRAPNEL_FMI_FUNCTION Status3 fmi3CompletedIntegratorStep(Instance instance, bool, bool*, bool*) {
  return refuse(instance, "fmi3CompletedIntegratorStep", kOtherInterface);
}
GRAPNEL_FMI_FUNCTION Status3 fmi3SetTime(Instance instance, double) {
  return refuse(instance, "fmi3SetTime", kOtherInterface);
}
GRAPNEL_FMI_FUNCTION Status3 fmi3SetContinuousStates(Instance instance, const double*, std::size_t) {
  return refuse(instance, "fmi3SetContinuousStates", kOtherInterface);
}
GRAPNEL_FMI_FUNCTION Status3 fmi3GetContinuousStateDerivatives(Instance instance, double*, std::size_t) {
  return refuse(instance, "fmi3GetContinuousStateDerivatives", kOtherInterface);
}
GRAPNEL_FMI_FUNCTION Status3 fmi3GetEventIndicators(Instance instance, double*, std::size_t) {
  return refuse(instance, "fmi3GetEventIndicators", kOtherInterface);
}
GRAPNEL_FMI_FUNCTION Status3 fmi3GetContinuousStates(Instance instance, double*, std::size_t) {
  return refuse(instance, "fmi3GetContinuousStates", kOtherInterface);
}
GRAPNEL_FMI_FUNCTION Status3 fmi3GetNominalsOfContinuousStates(Instance instance, double*, std::size_t) {
  return refuse(instance, "fmi3GetNominalsOfContinuousStates", kOtherInterface);
}
GRAPNEL_FMI_FUNCTION Status3 fmi3GetNumberOfEventIndicators(Instance instance, std::size_t*) {
  return refuse(instance, "fmi3GetNumberOfEventIndicators", kOtherInterface);
}
GRAPNEL_FMI_FUNCTION Status3 fmi3GetNumberOfContinuousStates(Instance instance, std::size_t*) {
  return refuse(instance, "fmi3GetNumberOfContinuousStates", kOtherInterface);
}
