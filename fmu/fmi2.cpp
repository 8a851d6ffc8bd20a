// The functions of the Functional Mock-up Interface 2.0 for co-simulation (2014, sections 2.1 and 4.2), declared from
// the text of the standard.
#include <cstddef>
#include <memory>
#include <string>

#include "exported.hpp"
#include "grapnel/fmi/fmi_functions.hpp"
#include "plant_instance.hpp"

namespace {

using namespace grapnel::fmu;
using grapnel::PlantVariable;
using grapnel::fmi::Boolean2;
using grapnel::fmi::Callbacks2;
using grapnel::fmi::Reference;
using VariableType = PlantVariable::Type;

struct Component2 {
  std::string name;
  Callbacks2 callbacks;
  std::unique_ptr<PlantInstance> plant;
  bool step_discarded = false;
};
using Component = void*;
using Status2 = int;

void log(const std::string& name, const Callbacks2& callbacks, Status status, const char* category,
         const std::string& message) {
  if (callbacks.logger)
    callbacks.logger(callbacks.environment, name.c_str(), static_cast<int>(status), category, "%s", message.c_str());
}

Component2* at(Component c) { return static_cast<Component2*>(c); }
PlantInstance* plant(Component c) { return c ? at(c)->plant.get() : nullptr; }

constexpr std::initializer_list<Mode> kAnywhere = {Mode::instantiated, Mode::initialization, Mode::stepping,
                                                   Mode::terminated, Mode::failed};
constexpr std::initializer_list<Mode> kBeforeEnd = {Mode::instantiated, Mode::initialization, Mode::stepping};

template <class Function>
Status2 call(Component c, const char* name, std::initializer_list<Mode> allowed, const Function& function) {
  PlantInstance* const instance = plant(c);
  if (!instance) return static_cast<Status2>(Status::error);
  return static_cast<Status2>(instance->call(name, allowed, [&] { function(*instance); }));
}

Status2 refuse(Component c, const char* name, const char* why) {
  PlantInstance* const instance = plant(c);
  return static_cast<Status2>(instance ? instance->refuse(name, why) : Status::error);
}

template <class Value>
Status2 get(Component c, const char* name, VariableType type, const Reference* references, std::size_t count,
            Value* values) {
  return call(c, name, kAnywhere, [&](PlantInstance& instance) {
    check_arrays(references, values, count);
    for (std::size_t i = 0; i < count; ++i) values[i] = static_cast<Value>(instance.get(type, references[i]));
  });
}

template <class Value>
Status2 set(Component c, const char* name, VariableType type, const Reference* references, std::size_t count,
            const Value* values) {
  return call(c, name, kBeforeEnd, [&](PlantInstance& instance) {
    check_arrays(references, values, count);
    for (std::size_t i = 0; i < count; ++i) instance.set(type, references[i], static_cast<double>(values[i]));
  });
}

constexpr const char* kNoTexts = "the plant has no variables of type String";
constexpr const char* kNoState = "canGetAndSetFMUstate is false";
constexpr const char* kNoDerivatives = "the plant provides no derivatives of outputs and accepts none of inputs";
constexpr const char* kSynchronous = "canRunAsynchronuously is false: no step is pending";

}  // namespace

GRAPNEL_FMI_FUNCTION const char* fmi2GetTypesPlatform() { return "default"; }
GRAPNEL_FMI_FUNCTION const char* fmi2GetVersion() { return "2.0"; }

GRAPNEL_FMI_FUNCTION Status2 fmi2SetDebugLogging(Component c, Boolean2, std::size_t, const char* const*) {
  return call(c, "fmi2SetDebugLogging", kAnywhere, [](PlantInstance&) {});
}

GRAPNEL_FMI_FUNCTION Component fmi2Instantiate(const char* name, int type, const char* guid, const char* resources,
                                               const Callbacks2* callbacks, Boolean2, Boolean2) {
  if (!callbacks) return nullptr;
  auto made = std::make_unique<Component2>();
  made->name = name ? name : "";
  made->callbacks = *callbacks;
  try {
    if (type != grapnel::fmi::kCoSimulation2) throw std::runtime_error("the plant is for co-simulation only");
    made->plant = std::make_unique<PlantInstance>(
        resources_path(resources), guid ? guid : "",
        [component = made.get()](Status status, const char* category, const std::string& message) {
          log(component->name, component->callbacks, status, category, message);
        });
    return made.release();
  } catch (const std::exception& error) {
    log(made->name, made->callbacks, Status::error, "logStatusError", std::string("fmi2Instantiate: ") + error.what());
  } catch (...) {
    log(made->name, made->callbacks, Status::error, "logStatusError", "fmi2Instantiate: an exception of unknown type");
  }
  return nullptr;
}

GRAPNEL_FMI_FUNCTION void fmi2FreeInstance(Component c) { delete at(c); }

GRAPNEL_FMI_FUNCTION Status2 fmi2SetupExperiment(Component c, Boolean2, double, double start, Boolean2, double) {
  return call(c, "fmi2SetupExperiment", {Mode::instantiated}, [&](PlantInstance& p) { p.set_start(start); });
}
GRAPNEL_FMI_FUNCTION Status2 fmi2EnterInitializationMode(Component c) {
  return call(c, "fmi2EnterInitializationMode", {Mode::instantiated}, [](PlantInstance& p) {
    if (!p.has_start()) throw Refused(Status::error, "fmi2SetupExperiment must be called first");
    p.enter_initialization();
  });
}
GRAPNEL_FMI_FUNCTION Status2 fmi2ExitInitializationMode(Component c) {
  return call(c, "fmi2ExitInitializationMode", {Mode::initialization},
              [](PlantInstance& p) { p.exit_initialization(); });
}
GRAPNEL_FMI_FUNCTION Status2 fmi2Terminate(Component c) {
  return call(c, "fmi2Terminate", {Mode::stepping}, [](PlantInstance& p) { p.terminate(); });
}
GRAPNEL_FMI_FUNCTION Status2 fmi2Reset(Component c) {
  return call(c, "fmi2Reset", kAnywhere, [&](PlantInstance& p) {
    p.reset();
    at(c)->step_discarded = false;
  });
}

GRAPNEL_FMI_FUNCTION Status2 fmi2GetReal(Component c, const Reference* vr, std::size_t count, double* values) {
  return get(c, "fmi2GetReal", VariableType::real, vr, count, values);
}
GRAPNEL_FMI_FUNCTION Status2 fmi2GetInteger(Component c, const Reference* vr, std::size_t count, int* values) {
  return get(c, "fmi2GetInteger", VariableType::whole, vr, count, values);
}
GRAPNEL_FMI_FUNCTION Status2 fmi2GetBoolean(Component c, const Reference* vr, std::size_t count, Boolean2* values) {
  return get(c, "fmi2GetBoolean", VariableType::boolean, vr, count, values);
}
GRAPNEL_FMI_FUNCTION Status2 fmi2GetString(Component c, const Reference*, std::size_t count, const char**) {
  return count == 0 ? 0 : refuse(c, "fmi2GetString", kNoTexts);
}
GRAPNEL_FMI_FUNCTION Status2 fmi2SetReal(Component c, const Reference* vr, std::size_t count, const double* values) {
  return set(c, "fmi2SetReal", VariableType::real, vr, count, values);
}
GRAPNEL_FMI_FUNCTION Status2 fmi2SetInteger(Component c, const Reference* vr, std::size_t count, const int* values) {
  return set(c, "fmi2SetInteger", VariableType::whole, vr, count, values);
}
GRAPNEL_FMI_FUNCTION Status2 fmi2SetBoolean(Component c, const Reference* vr, std::size_t count,
                                            const Boolean2* values) {
  return set(c, "fmi2SetBoolean", VariableType::boolean, vr, count, values);
}
GRAPNEL_FMI_FUNCTION Status2 fmi2SetString(Component c, const Reference*, std::size_t count, const char* const*) {
  return count == 0 ? 0 : refuse(c, "fmi2SetString", kNoTexts);
}

GRAPNEL_FMI_FUNCTION Status2 fmi2GetFMUstate(Component c, void**) { return refuse(c, "fmi2GetFMUstate", kNoState); }
GRAPNEL_FMI_FUNCTION Status2 fmi2SetFMUstate(Component c, void*) { return refuse(c, "fmi2SetFMUstate", kNoState); }
GRAPNEL_FMI_FUNCTION Status2 fmi2FreeFMUstate(Component c, void** state) {
  return !state || !*state ? 0 : refuse(c, "fmi2FreeFMUstate", kNoState);
}
GRAPNEL_FMI_FUNCTION Status2 fmi2SerializedFMUstateSize(Component c, void*, std::size_t*) {
  return refuse(c, "fmi2SerializedFMUstateSize", kNoState);
}
GRAPNEL_FMI_FUNCTION Status2 fmi2SerializeFMUstate(Component c, void*, char*, std::size_t) {
  return refuse(c, "fmi2SerializeFMUstate", kNoState);
}
GRAPNEL_FMI_FUNCTION Status2 fmi2DeSerializeFMUstate(Component c, const char*, std::size_t, void**) {
  return refuse(c, "fmi2DeSerializeFMUstate", kNoState);
}
GRAPNEL_FMI_FUNCTION Status2 fmi2GetDirectionalDerivative(Component c, const Reference*, std::size_t, const Reference*,
                                                          std::size_t, const double*, double*) {
  return refuse(c, "fmi2GetDirectionalDerivative", kNoDerivatives);
}
GRAPNEL_FMI_FUNCTION Status2 fmi2SetRealInputDerivatives(Component c, const Reference*, std::size_t, const int*,
                                                         const double*) {
  return refuse(c, "fmi2SetRealInputDerivatives", kNoDerivatives);
}
GRAPNEL_FMI_FUNCTION Status2 fmi2GetRealOutputDerivatives(Component c, const Reference*, std::size_t, const int*,
                                                          double*) {
  return refuse(c, "fmi2GetRealOutputDerivatives", kNoDerivatives);
}

GRAPNEL_FMI_FUNCTION Status2 fmi2DoStep(Component c, double time, double size, Boolean2) {
  if (!plant(c)) return static_cast<Status2>(Status::error);
  const Status2 status = call(c, "fmi2DoStep", {Mode::stepping}, [&](PlantInstance& p) {
    // In 2.0 discard means that part of the step was computed; a master may repeat it endlessly with shorter steps.
    p.step(time, size, Status::error);
  });
  at(c)->step_discarded = status == static_cast<Status2>(Status::discard);
  return status;
}
GRAPNEL_FMI_FUNCTION Status2 fmi2CancelStep(Component c) { return refuse(c, "fmi2CancelStep", kSynchronous); }
GRAPNEL_FMI_FUNCTION Status2 fmi2GetStatus(Component c, int, int*) { return refuse(c, "fmi2GetStatus", kSynchronous); }
GRAPNEL_FMI_FUNCTION Status2 fmi2GetIntegerStatus(Component c, int, int*) {
  return refuse(c, "fmi2GetIntegerStatus", "unknown status kind");
}
GRAPNEL_FMI_FUNCTION Status2 fmi2GetStringStatus(Component c, int, const char**) {
  return refuse(c, "fmi2GetStringStatus", kSynchronous);
}
// After a discarded step: the time reached, and whether the run has ended.
GRAPNEL_FMI_FUNCTION Status2 fmi2GetRealStatus(Component c, int kind, double* value) {
  constexpr int kLastSuccessfulTime = 2;
  return call(c, "fmi2GetRealStatus", {Mode::stepping, Mode::terminated, Mode::failed}, [&](PlantInstance& p) {
    if (kind != kLastSuccessfulTime) throw Refused(Status::error, "unknown status kind");
    check_arrays(value, value, 1);
    *value = p.time();
  });
}
GRAPNEL_FMI_FUNCTION Status2 fmi2GetBooleanStatus(Component c, int kind, Boolean2* value) {
  constexpr int kTerminated = 3;
  return call(c, "fmi2GetBooleanStatus", {Mode::stepping, Mode::terminated, Mode::failed}, [&](PlantInstance& p) {
    if (kind != kTerminated) throw Refused(Status::error, "unknown status kind");
    check_arrays(value, value, 1);
    *value = at(c)->step_discarded && p.has_ended() ? 1 : 0;
  });
}
