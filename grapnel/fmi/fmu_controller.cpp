#include "grapnel/fmi/fmu_controller.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <utility>

#include "grapnel/fmi/fmu_instance.hpp"
#include "grapnel/fmi/fmu_wiring.hpp"

namespace grapnel::fmi {
namespace {

using Json = nlohmann::ordered_json;

// ---- A controller by the C interface ----

struct FmuState {
  std::unique_ptr<FmuInstance> instance;
  Wiring wiring;
  double period = 0;
  double time = 0;  // on the FMU's clock
  bool is_initialized = false;
  std::vector<double> seen, said;
  std::string error;
};
FmuState& at(void* instance) { return *static_cast<FmuState*>(instance); }

void set_constant(FmuInstance& instance, const Constant& constant) {
  const Variable& variable = constant.variable;
  if (const auto* real = std::get_if<double>(&constant.value))
    instance.set(std::array{variable.reference}, std::array{*real});
  if (const auto* whole = std::get_if<int>(&constant.value)) instance.set_whole(variable, *whole);
  if (const auto* boolean = std::get_if<bool>(&constant.value)) instance.set_boolean(variable, *boolean);
  if (const auto* text = std::get_if<std::string>(&constant.value)) instance.set_text(variable, *text);
}

void sample(FmuState& own, const grapnel_controller_input& in, grapnel_controller_output& out) {
  FmuInstance& fmu = *own.instance;
  if (own.is_initialized) {
    // Skipped samples, as during a compliant impact, still count as steps.
    const double steps = std::max(1.0, std::round((in.time - own.time) / own.period));
    for (double k = 0; k < steps; ++k) fmu.step(own.time + k * own.period, own.period);
  }
  for (std::size_t i = 0; i < own.seen.size(); ++i) own.seen[i] = seen_value(in, own.wiring.inputs.signals[i]);
  if (!own.is_initialized) {
    fmu.begin_initialization(in.time);
    for (const Constant& constant : own.wiring.constants) set_constant(fmu, constant);
    fmu.set(own.wiring.inputs.variables, own.seen);
    fmu.end_initialization();
    own.is_initialized = true;
  }
  fmu.get(own.wiring.outputs.variables, own.said);
  fmu.set(own.wiring.inputs.variables, own.seen);
  own.time = in.time;
  for (std::size_t i = 0; i < own.said.size(); ++i) {
    const Signal& signal = own.wiring.outputs.signals[i];
    (signal.part == kEffortPart ? out.effort : out.base_torque)[signal.index] = own.said[i];
  }
}

// The FMU that create() instantiates: create() is called on the thread that requests the controller.
thread_local const FmuControllers* t_source = nullptr;

int create(const grapnel_controller_setup* setup, void** instance, char* error, std::size_t error_size) {
  try {
    auto own = std::make_unique<FmuState>();
    std::vector<std::string> joints;
    const Json model = Json::parse(setup->model);
    for (const Json& joint : model["joints"]) joints.push_back(joint["name"].get<std::string>());
    std::vector<FmuMisfit> misfits;
    own->wiring =
        wire(*t_source->fmu(), t_source->inputs(), t_source->outputs(), joints, setup->base_torque != 0, misfits);
    const std::vector<Constant> parameters = parameters_of(*t_source->fmu(), setup->parameters, misfits);
    if (!misfits.empty()) throw FmuError(misfits.front().text);
    own->period = setup->period;
    own->seen.resize(own->wiring.inputs.variables.size());
    own->said.resize(own->wiring.outputs.variables.size());
    own->instance = std::make_unique<FmuInstance>(t_source->fmu());
    for (const Constant& parameter : parameters) set_constant(*own->instance, parameter);
    *instance = own.release();
    return 0;
  } catch (const std::exception& thrown) {
    std::snprintf(error, error_size, "%s", thrown.what());
    return 1;
  }
}

int update(void* instance, const grapnel_controller_input* input, const grapnel_controller_access*,
           grapnel_controller_output* output) {
  try {
    sample(at(instance), *input, *output);
    return 0;
  } catch (const std::exception& thrown) {
    at(instance).error = thrown.what();
    return 1;
  }
}

void destroy(void* instance) { delete static_cast<FmuState*>(instance); }
const char* last_error(void* instance) { return at(instance).error.c_str(); }

constexpr grapnel_controller_plugin kFunctions = {sizeof(grapnel_controller_plugin),
                                                  GRAPNEL_CONTROLLER_VERSION,
                                                  create,
                                                  nullptr,
                                                  update,
                                                  nullptr,
                                                  nullptr,
                                                  destroy,
                                                  last_error};

}  // namespace

FmuControllers::FmuControllers(const std::string& file, const std::string& shown, std::string inputs,
                               std::string outputs)
    : fmu_(std::make_shared<const Fmu>(file, shown)),
      inputs_(std::move(inputs)),
      outputs_(std::move(outputs)),
      functions_(std::make_shared<const ControllerPlugin>(kFunctions, fmu_->named())) {}

std::vector<FmuMisfit> FmuControllers::misfits(const std::vector<std::string>& joints, const std::string& parameters,
                                               bool commands_base, double period) const {
  std::vector<FmuMisfit> found;
  wire(*fmu_, inputs_, outputs_, joints, commands_base, found);
  parameters_of(*fmu_, parameters, found);
  check_period(*fmu_, period, found);
  return found;
}

std::shared_ptr<Controller> FmuControllers::make(const ControlTiming& timing, const std::string& parameters,
                                                 ControlledRobot robot, const Model& model) const {
  t_source = this;
  return std::make_shared<PluginController>(functions_, timing, parameters, std::move(robot), model);
}

}  // namespace grapnel::fmi
