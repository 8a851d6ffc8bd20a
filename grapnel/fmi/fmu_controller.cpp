#include "grapnel/fmi/fmu_controller.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "grapnel/fmi/fmu_instance.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel::fmi {
namespace {

using Json = nlohmann::ordered_json;

// ---- Signals ----

// A part of what a controller sees or says, and the number in it from 0 on.
struct Signal {
  int part = 0;
  int index = 0;
  auto operator<=>(const Signal&) const = default;
};
struct Part {
  const char* name;
  const char* of_joint;  // as "JOINT.position"; null: none
  int size;              // 0: per joint; 1: a number
};
constexpr std::array<Part, 10> kSeen = {{{"time", nullptr, 1},
                                         {"position", "position", 0},
                                         {"rate", "rate", 0},
                                         {"desired_position", "desired_position", 0},
                                         {"desired_rate", "desired_rate", 0},
                                         {"desired_acceleration", "desired_acceleration", 0},
                                         {"base_position", nullptr, 3},
                                         {"base_quaternion_wxyz", nullptr, 4},
                                         {"base_velocity", nullptr, 3},
                                         {"base_angular_velocity", nullptr, 3}}};
constexpr std::array<Part, 2> kSaid = {{{"effort", "effort", 0}, {"base_torque", nullptr, 3}}};

using Signals = std::map<std::string, Signal>;

template <std::size_t N>
Signals signals_of(const std::array<Part, N>& parts, const std::vector<std::string>& joints) {
  Signals signals;
  for (int p = 0; p < static_cast<int>(N); ++p) {
    const Part& part = parts[static_cast<std::size_t>(p)];
    const int size = part.size == 0 ? static_cast<int>(joints.size()) : part.size;
    for (int i = 0; i < size; ++i) {
      signals[part.size == 1 ? std::string(part.name) : fmt::format("{}[{}]", part.name, i + 1)] = {p, i};
      if (part.of_joint) signals[fmt::format("{}.{}", joints[static_cast<std::size_t>(i)], part.of_joint)] = {p, i};
    }
  }
  return signals;
}

std::vector<std::string> names_of(const Signals& signals) {
  std::vector<std::string> names;
  for (const auto& [name, signal] : signals) names.push_back(name);
  return names;
}

// ---- Connections ----

struct Connections {
  std::vector<Reference> variables;
  std::vector<Signal> signals;
};

const Variable& named(const Fmu& fmu, const std::string& name, const char* key, const std::string& causality) {
  std::vector<std::string> others;
  for (const Variable& variable : fmu.model().variables) {
    if (variable.name == name) return variable;
    if (variable.causality == causality) others.push_back(variable.name);
  }
  throw FmuMisfit(
      key, name,
      fmt::format("{} has no variable {}{}", fmu.named(), in_quotes(name), suggestion(name, others, causality + "s")));
}

void check_kind(const Fmu& fmu, const Variable& variable, const char* key, const std::string& causality) {
  const std::string what = fmt::format("{} of {}", in_quotes(variable.name), fmu.named());
  if (variable.causality != causality)
    throw FmuMisfit(key, variable.name,
                    fmt::format("{} is of causality {}, expected is {}", what, variable.causality, causality));
  if (variable.is_array) throw FmuMisfit(key, variable.name, what + " is an array, expected are scalar variables");
  if (causality != "parameter" && variable.type != Variable::Type::real)
    throw FmuMisfit(key, variable.name,
                    fmt::format("{} is a {}, expected is a {}", what, variable.type_name,
                                fmu.model().version == 2 ? "Real" : "Float64"));
}

// Every variable of this causality that is named in `stated`, or is called like a signal.
Connections connect(const Fmu& fmu, const char* key, const std::string& causality, const std::string& stated,
                    const Signals& signals) {
  const Json named_ones = Json::parse(stated);
  Connections made;
  std::map<Signal, std::string> used;
  const auto add = [&](const Variable& variable, const Signal& signal) {
    check_kind(fmu, variable, key, causality);
    if (const auto [first, fresh] = used.emplace(signal, variable.name); !fresh && causality == "output")
      throw FmuMisfit(key, variable.name,
                      fmt::format("outputs {} and {} of {} are the same signal", in_quotes(first->second),
                                  in_quotes(variable.name), fmu.named()));
    made.variables.push_back(variable.reference);
    made.signals.push_back(signal);
  };
  for (const auto& [name, signal] : named_ones.items()) {
    const Variable& variable = named(fmu, name, key, causality);
    const std::string wanted = signal.is_string() ? signal.get<std::string>() : signal.dump();
    const auto found = signals.find(wanted);
    if (found == signals.end())
      throw FmuMisfit(key, name,
                      fmt::format("control.{}: {} is no signal{}", key, in_quotes(wanted),
                                  suggestion(wanted, names_of(signals), "signals")));
    add(variable, found->second);
  }
  for (const Variable& variable : fmu.model().variables) {
    if (variable.causality != causality || named_ones.contains(variable.name)) continue;
    const auto found = signals.find(variable.name);
    if (found != signals.end()) {
      add(variable, found->second);
    } else if (causality == "input") {
      throw FmuMisfit("fmu", "",
                      fmt::format("{}: nothing says what its input {} is; name it in control.inputs, or call it like a "
                                  "signal: {}",
                                  fmu.named(), in_quotes(variable.name), "position[1], rate[1], ..."));
    }
  }
  return made;
}

struct Wiring {
  Connections inputs, outputs;
};

Wiring wire(const Fmu& fmu, const std::string& inputs, const std::string& outputs,
            const std::vector<std::string>& joints, bool commands_base) {
  Wiring wiring{connect(fmu, "inputs", "input", inputs, signals_of(kSeen, joints)),
                connect(fmu, "outputs", "output", outputs, signals_of(kSaid, joints))};
  const auto is_said = [&](const Signal& signal) {
    const auto& all = wiring.outputs.signals;
    return std::find(all.begin(), all.end(), signal) != all.end();
  };
  const auto need = [&](const Signal& signal, const std::string& what) {
    if (!is_said(signal))
      throw FmuMisfit("fmu", "",
                      fmt::format("{}: none of its outputs is {}; name it in control.outputs", fmu.named(), what));
  };
  for (int j = 0; j < static_cast<int>(joints.size()); ++j)
    need({0, j}, fmt::format("effort[{}], of joint {}", j + 1, in_quotes(joints[static_cast<std::size_t>(j)])));
  for (int k = 0; k < 3 && commands_base; ++k) need({1, k}, fmt::format("base_torque[{}]", k + 1));
  return wiring;
}

// ---- Parameters ----

// One of the FMU's, and its value as JSON. @throws FmuMisfit if they do not fit.
void check_parameter(const Fmu& fmu, const Variable& variable, const Json& value) {
  using Type = Variable::Type;
  check_kind(fmu, variable, "parameters", "parameter");
  const bool fits = (variable.type == Type::real && value.is_number()) ||
                    (variable.type == Type::whole && value.is_number_integer() &&
                     std::abs(value.get<double>()) <= std::numeric_limits<int>::max()) ||
                    (variable.type == Type::boolean && value.is_boolean()) ||
                    (variable.type == Type::text && value.is_string());
  if (!fits)
    throw FmuMisfit("parameters", variable.name,
                    fmt::format("{} of {} is a {}, which {} is not", in_quotes(variable.name), fmu.named(),
                                variable.type_name, shortened(value.dump())));
}

void set_parameters(const Fmu& fmu, const std::string& parameters, FmuInstance* instance) {
  const Json values = Json::parse(parameters);
  for (const auto& [name, value] : values.items()) {
    const Variable& variable = named(fmu, name, "parameters", "parameter");
    check_parameter(fmu, variable, value);
    if (!instance) continue;
    const std::array<Reference, 1> reference = {variable.reference};
    if (variable.type == Variable::Type::real) instance->set(reference, std::array{value.get<double>()});
    if (variable.type == Variable::Type::whole) instance->set_whole(variable, value.get<int>());
    if (variable.type == Variable::Type::boolean) instance->set_boolean(variable, value.get<bool>());
    if (variable.type == Variable::Type::text) instance->set_text(variable, value.get<std::string>());
  }
}

void check_period(const Fmu& fmu, double period) {
  const std::optional<double>& step = fmu.model().fixed_step;
  if (!step || !(*step > 0)) return;
  const double count = period / *step;
  if (std::abs(count - std::round(count)) > 1e-6 || count < 0.5)
    throw FmuMisfit("period", "",
                    fmt::format("{} computes in steps of {} s (fixedInternalStepSize), of which "
                                "control.period, {} s, is no multiple",
                                fmu.named(), *step, period));
}

// ---- A controller by the C interface ----

struct FmuState {
  std::unique_ptr<FmuInstance> instance;
  Wiring wiring;
  double period = 0;
  double time = 0;  // of the FMU's clock
  bool is_initialized = false;
  std::vector<double> seen, said;
  std::string error;
};
FmuState& at(void* instance) { return *static_cast<FmuState*>(instance); }

double seen_value(const grapnel_controller_input& in, const Signal& signal) {
  const double* const time = &in.time;
  const std::array<const double*, kSeen.size()> parts = {time,
                                                         in.position,
                                                         in.rate,
                                                         in.desired_position,
                                                         in.desired_rate,
                                                         in.desired_acceleration,
                                                         in.base_position,
                                                         in.base_quaternion_wxyz,
                                                         in.base_velocity,
                                                         in.base_angular_velocity};
  return parts[static_cast<std::size_t>(signal.part)][signal.index];
}

void sample(FmuState& own, const grapnel_controller_input& in, grapnel_controller_output& out) {
  FmuInstance& fmu = *own.instance;
  if (own.is_initialized) {
    // Samples that nobody has taken, as during an impact in time, are steps all the same.
    const double steps = std::max(1.0, std::round((in.time - own.time) / own.period));
    for (double k = 0; k < steps; ++k) fmu.step(own.time + k * own.period, own.period);
  }
  for (std::size_t i = 0; i < own.seen.size(); ++i) own.seen[i] = seen_value(in, own.wiring.inputs.signals[i]);
  if (!own.is_initialized) {
    fmu.begin_initialization(in.time);
    fmu.set(own.wiring.inputs.variables, own.seen);
    fmu.end_initialization();
    own.is_initialized = true;
  }
  fmu.get(own.wiring.outputs.variables, own.said);
  fmu.set(own.wiring.inputs.variables, own.seen);
  own.time = in.time;
  for (std::size_t i = 0; i < own.said.size(); ++i) {
    const Signal& signal = own.wiring.outputs.signals[i];
    (signal.part == 0 ? out.effort : out.base_torque)[signal.index] = own.said[i];
  }
}

// Of which FMU create() makes an instance: it is called on the thread that asks for it.
thread_local const FmuControllers* t_source = nullptr;

int create(const grapnel_controller_setup* setup, void** instance, char* error, std::size_t error_size) {
  try {
    auto own = std::make_unique<FmuState>();
    std::vector<std::string> joints;
    const Json model = Json::parse(setup->model);
    for (const Json& joint : model["joints"]) joints.push_back(joint["name"].get<std::string>());
    own->wiring = wire(*t_source->fmu(), t_source->inputs(), t_source->outputs(), joints, setup->base_torque != 0);
    own->period = setup->period;
    own->seen.resize(own->wiring.inputs.variables.size());
    own->said.resize(own->wiring.outputs.variables.size());
    own->instance = std::make_unique<FmuInstance>(t_source->fmu());
    set_parameters(*t_source->fmu(), setup->parameters, own->instance.get());
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

void FmuControllers::check(const std::vector<std::string>& joints, const std::string& parameters, bool commands_base,
                           double period) const {
  wire(*fmu_, inputs_, outputs_, joints, commands_base);
  set_parameters(*fmu_, parameters, nullptr);
  check_period(*fmu_, period);
}

std::shared_ptr<Controller> FmuControllers::make(const ControlTiming& timing, const std::string& parameters,
                                                 ControlledRobot robot, const Model& model) const {
  t_source = this;
  return std::make_shared<PluginController>(functions_, timing, parameters, std::move(robot), model);
}

}  // namespace grapnel::fmi
