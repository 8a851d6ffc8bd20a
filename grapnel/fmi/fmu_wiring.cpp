#include "grapnel/fmi/fmu_wiring.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "grapnel/text/message_text.hpp"

namespace grapnel::fmi {
namespace {

using Json = nlohmann::ordered_json;

// The value in control.inputs with which an input keeps its start value.
constexpr const char* kStart = "start";

// ---- Signals ----

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

// ---- Variables ----

// The value of a variable of this type; empty if the JSON value has another type.
std::optional<Constant> constant_of(const Variable& variable, const Json& value) {
  using Type = Variable::Type;
  if (variable.is_array) return std::nullopt;
  if (variable.type == Type::real && value.is_number()) return Constant{variable, value.get<double>()};
  if (variable.type == Type::whole && value.is_number_integer() &&
      std::abs(value.get<double>()) <= std::numeric_limits<int>::max())
    return Constant{variable, value.get<int>()};
  if (variable.type == Type::boolean && value.is_boolean()) return Constant{variable, value.get<bool>()};
  if (variable.type == Type::text && value.is_string()) return Constant{variable, value.get<std::string>()};
  return std::nullopt;
}

class Wirer {
 public:
  Wirer(const Fmu& fmu, std::vector<FmuMisfit>& misfits) : fmu_(fmu), misfits_(misfits) {}

  // Connects all variables of this causality that `stated` names, or that have the name of a signal.
  Connections connect(const char* key, const std::string& causality, const std::string& stated, const Signals& signals,
                      std::vector<Constant>& constants) {
    const Json named_ones = Json::parse(stated);
    Connections made;
    std::map<Signal, std::string> used;
    for (const auto& [name, value] : named_ones.items()) {
      const Variable* const variable = variable_named(name, key, causality);
      if (!variable || !has_causality(*variable, key, causality)) continue;
      if (causality == "input" && (value.is_null() || value == kStart)) continue;
      const auto found = signals.find(value.is_string() ? value.get<std::string>() : value.dump());
      if (found != signals.end()) {
        add(*variable, found->second, key, causality, used, made);
      } else if (auto constant = causality == "input" ? constant_of(*variable, value) : std::nullopt) {
        constants.push_back(std::move(*constant));
      } else {
        no_signal(*variable, value, key, signals);
      }
    }
    std::vector<std::string> open;
    for (const Variable& variable : fmu_.model().variables) {
      if (variable.causality != causality || named_ones.contains(variable.name)) continue;
      const auto found = signals.find(variable.name);
      if (found != signals.end())
        add(variable, found->second, key, causality, used, made);
      else if (variable.type == Variable::Type::real)
        open.push_back(in_quotes(variable.name));
    }
    if (causality == "input" && !open.empty())
      misfits_.push_back({"fmu", "",
                          fmt::format("{}: its {} {} {} without a value; name each in control.inputs, with a signal "
                                      "such as position[1], a number, or {} for its start value",
                                      fmu_.named(), open.size() == 1 ? "input" : "inputs", some_of(open),
                                      open.size() == 1 ? "is" : "are", kStart)});
    return made;
  }

  const Variable* variable_named(const std::string& name, const char* key, const std::string& causality) {
    std::vector<std::string> others;
    for (const Variable& variable : fmu_.model().variables) {
      if (variable.name == name) return &variable;
      if (variable.causality == causality) others.push_back(variable.name);
    }
    misfits_.push_back({key, name,
                        fmt::format("{} has no variable {}{}", fmu_.named(), in_quotes(name),
                                    suggestion(name, others, causality + "s"))});
    return nullptr;
  }

  bool has_causality(const Variable& variable, const char* key, const std::string& causality) {
    if (variable.causality == causality) return true;
    misfits_.push_back(
        {key, variable.name,
         fmt::format("{} has causality {}, expected {}", what(variable), variable.causality, causality)});
    return false;
  }

  std::string what(const Variable& variable) const {
    return fmt::format("{} of {}", in_quotes(variable.name), fmu_.named());
  }

 private:
  void add(const Variable& variable, const Signal& signal, const char* key, const std::string& causality,
           std::map<Signal, std::string>& used, Connections& made) {
    const char* const real = fmu_.model().version == 2 ? "Real" : "Float64";
    if (variable.is_array) {
      misfits_.push_back({key, variable.name, what(variable) + " is an array; only scalar variables are supported"});
    } else if (variable.type != Variable::Type::real) {
      misfits_.push_back(
          {key, variable.name,
           fmt::format(
               "{} is a {}, expected a {}{}", what(variable), variable.type_name, real,
               causality == "input" ? fmt::format(", or in control.inputs a constant or {}", kStart) : std::string())});
    } else if (const auto [first, fresh] = used.emplace(signal, variable.name); !fresh && causality == "output") {
      misfits_.push_back({key, variable.name,
                          fmt::format("outputs {} and {} of {} are the same signal", in_quotes(first->second),
                                      in_quotes(variable.name), fmu_.named())});
    } else {
      made.variables.push_back(variable.reference);
      made.signals.push_back(signal);
    }
  }

  void no_signal(const Variable& variable, const Json& value, const char* key, const Signals& signals) {
    const std::string wanted = value.is_string() ? value.get<std::string>() : value.dump();
    if (!value.is_string() && std::string_view(key) == "inputs") {
      misfits_.push_back(
          {key, variable.name,
           fmt::format("{} is a {}, which {} is not", what(variable), variable.type_name, shortened(wanted))});
      return;
    }
    misfits_.push_back({key, variable.name,
                        fmt::format("control.{}: {} is not a signal{}", key, in_quotes(wanted),
                                    suggestion(wanted, names_of(signals), "signals"))});
  }

  const Fmu& fmu_;
  std::vector<FmuMisfit>& misfits_;
};

}  // namespace

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

Wiring wire(const Fmu& fmu, const std::string& inputs, const std::string& outputs,
            const std::vector<std::string>& joints, bool commands_base, std::vector<FmuMisfit>& misfits) {
  Wirer wirer(fmu, misfits);
  Wiring wiring;
  wiring.inputs = wirer.connect("inputs", "input", inputs, signals_of(kSeen, joints), wiring.constants);
  wiring.outputs = wirer.connect("outputs", "output", outputs, signals_of(kSaid, joints), wiring.constants);
  const auto is_output = [&](const Signal& signal) {
    const auto& all = wiring.outputs.signals;
    return std::find(all.begin(), all.end(), signal) != all.end();
  };
  std::vector<std::string> missing;
  for (int j = 0; j < static_cast<int>(joints.size()); ++j) {
    if (!is_output({kEffortPart, j}))
      missing.push_back(fmt::format("effort[{}], of joint {}", j + 1, in_quotes(joints[static_cast<std::size_t>(j)])));
  }
  for (int k = 0; k < 3 && commands_base; ++k) {
    if (!is_output({kBaseTorquePart, k})) missing.push_back(fmt::format("base_torque[{}]", k + 1));
  }
  for (const std::string& what : missing)
    misfits.push_back(
        {"fmu", "", fmt::format("{}: none of its outputs is {}; name it in control.outputs", fmu.named(), what)});
  return wiring;
}

std::vector<Constant> parameters_of(const Fmu& fmu, const std::string& parameters, std::vector<FmuMisfit>& misfits) {
  std::vector<Constant> constants;
  Wirer wirer(fmu, misfits);
  const Json values = Json::parse(parameters);
  for (const auto& [name, value] : values.items()) {
    const Variable* const variable = wirer.variable_named(name, "parameters", "parameter");
    if (!variable || !wirer.has_causality(*variable, "parameters", "parameter")) continue;
    if (variable->is_array)
      misfits.push_back(
          {"parameters", name, wirer.what(*variable) + " is an array; only scalar variables are supported"});
    else if (auto constant = constant_of(*variable, value))
      constants.push_back(std::move(*constant));
    else
      misfits.push_back({"parameters", name,
                         fmt::format("{} is a {}, which {} is not", wirer.what(*variable), variable->type_name,
                                     shortened(value.dump()))});
  }
  return constants;
}

void check_period(const Fmu& fmu, double period, std::vector<FmuMisfit>& misfits) {
  const std::optional<double>& step = fmu.model().fixed_step;
  if (!step || !(*step > 0)) return;
  const double count = period / *step;
  if (std::abs(count - std::round(count)) > 1e-6 || count < 0.5)
    misfits.push_back({"period", "",
                       fmt::format("{} has steps of {} s (fixedInternalStepSize); "
                                   "control.period, {} s, must be a multiple of them",
                                   fmu.named(), *step, period)});
}

}  // namespace grapnel::fmi
