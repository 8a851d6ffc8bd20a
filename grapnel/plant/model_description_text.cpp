#include "grapnel/plant/model_description_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <set>

#include "grapnel/text/message_text.hpp"
#include "grapnel/text/units.hpp"

namespace grapnel {
namespace {

using VariableType = PlantVariable::Type;
using Causality = PlantVariable::Causality;

// Escapes text for an attribute, in which a parser converts line breaks to spaces.
std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : escaped_markup(text)) c == '\n' ? out += "&#10;" : out += c;
  return out;
}

std::string number(double value) { return fmt::format("{:.17g}", value); }

bool has_unit(const PlantVariable& variable) {
  return variable.type == VariableType::real && !variable.unit.empty() && variable.unit != "1";
}

// <BaseUnit> of "N.m", "rad/s2", "kg.m2.s-2".
std::string base_unit(const std::string& name) {
  std::string text;
  for (std::size_t i = 0; i < name.size(); ++i) {
    const char c = name[i];
    const bool begins_power = (std::isdigit(static_cast<unsigned char>(c)) != 0 || c == '-') && !text.empty() &&
                              std::isalpha(static_cast<unsigned char>(text.back())) != 0;
    text += c == '.' ? " " : begins_power ? std::string("^") + c : std::string(1, c);
  }
  const std::optional<Unit> unit = unit_named(text);
  if (!unit) throw std::logic_error("a plant's variable has the unknown unit " + name);
  constexpr std::array<const char*, 4> kBase = {"m", "kg", "s", "rad"};
  std::string out = "<BaseUnit";
  for (const std::size_t i : {1, 0, 2, 3}) {
    if (unit->powers.at(i) != 0) out += fmt::format(" {}=\"{}\"", kBase.at(i), unit->powers.at(i) / 10);
  }
  return out + "/>";
}

std::string unit_definitions(const PlantVariables& variables) {
  std::set<std::string> names{"s"};
  for (const PlantVariable& variable : variables.all) {
    if (has_unit(variable)) names.insert(variable.unit);
  }
  std::string out = "  <UnitDefinitions>\n";
  for (const std::string& name : names)
    out += fmt::format("    <Unit name=\"{}\">{}</Unit>\n", escaped(name), base_unit(name));
  return out + "  </UnitDefinitions>\n";
}

// Attributes common to both versions. Outputs are calculated; inputs have a start value.
std::string attributes(const PlantVariable& v, std::size_t position) {
  const char* const causality = v.causality == Causality::parameter ? "parameter"
                                : v.causality == Causality::input   ? "input"
                                                                    : "output";
  const char* const variability = v.causality == Causality::parameter ? "fixed"
                                  : v.type == VariableType::real      ? "continuous"
                                                                      : "discrete";
  const char* const initial = v.causality == Causality::parameter ? " initial=\"exact\""
                              : v.causality == Causality::output  ? " initial=\"calculated\""
                                                                  : "";
  return fmt::format("name=\"{}\" valueReference=\"{}\" description=\"{}\" causality=\"{}\" variability=\"{}\"{}",
                     escaped(v.name), position + 1, escaped(v.words), causality, variability, initial);
}

std::string start_of(const PlantVariable& v) {
  if (v.causality == Causality::output) return {};
  if (v.type == VariableType::boolean) return v.start != 0 ? " start=\"true\"" : " start=\"false\"";
  return fmt::format(" start=\"{}\"", number(v.start));
}

std::string unit_of(const PlantVariable& v) {
  return has_unit(v) ? fmt::format(" unit=\"{}\"", escaped(v.unit)) : std::string();
}

std::string variables_2(const PlantVariables& variables) {
  constexpr std::array<const char*, 3> kTypes = {"Real", "Integer", "Boolean"};
  std::string out;
  for (std::size_t i = 0; i < variables.all.size(); ++i) {
    const PlantVariable& v = variables.all[i];
    out += fmt::format("    <ScalarVariable {}><{}{}{}/></ScalarVariable>\n", attributes(v, i),
                       kTypes.at(static_cast<std::size_t>(v.type)), unit_of(v), start_of(v));
  }
  return out;
}

std::string variables_3(const PlantVariables& variables) {
  constexpr std::array<const char*, 3> kTypes = {"Float64", "Int32", "Boolean"};
  std::string out = fmt::format(
      "    <Float64 name=\"time\" valueReference=\"{}\" description=\"Time of the scenario\" causality=\"independent\" "
      "variability=\"continuous\" unit=\"s\"/>\n",
      kTimeReference);
  for (std::size_t i = 0; i < variables.all.size(); ++i) {
    const PlantVariable& v = variables.all[i];
    out += fmt::format("    <{} {}{}{}/>\n", kTypes.at(static_cast<std::size_t>(v.type)), attributes(v, i), unit_of(v),
                       start_of(v));
  }
  return out;
}

// Outputs do not depend on inputs of the same instant; at the start they depend on the parameters.
std::string structure(const PlantVariables& variables, int version) {
  std::string of_parameters;
  for (std::size_t i = 0; i < variables.parameters; ++i) of_parameters += fmt::format("{}{}", i > 0 ? " " : "", i + 1);
  std::string outputs, initial;
  for (std::size_t i = variables.first_output(); i < variables.all.size(); ++i) {
    if (version == 2) {
      outputs += fmt::format("      <Unknown index=\"{}\" dependencies=\"\"/>\n", i + 1);
      initial += fmt::format("      <Unknown index=\"{}\" dependencies=\"{}\"/>\n", i + 1, of_parameters);
    } else {
      outputs += fmt::format("    <Output valueReference=\"{}\" dependencies=\"\"/>\n", i + 1);
      initial += fmt::format("    <InitialUnknown valueReference=\"{}\" dependencies=\"{}\"/>\n", i + 1, of_parameters);
    }
  }
  if (version == 2)
    return fmt::format(
        "  <ModelStructure>\n    <Outputs>\n{}    </Outputs>\n    <InitialUnknowns>\n{}    </InitialUnknowns>\n"
        "  </ModelStructure>\n",
        outputs, initial);
  return fmt::format("  <ModelStructure>\n{}{}  </ModelStructure>\n", outputs, initial);
}

}  // namespace

std::string c_identifier(const std::string& text) {
  std::string out;
  for (const char c : text) out += std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
  if (out.empty() || std::isdigit(static_cast<unsigned char>(out[0])) != 0) out = "plant_" + out;
  return out;
}

std::string model_description_text(const PlantDescription& d, const PlantVariables& variables) {
  const bool is_2 = d.version == 2;
  std::string out = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n";
  out += fmt::format(
      "<fmiModelDescription fmiVersion=\"{}\" modelName=\"{}\" {}=\"{}\"\n"
      "    description=\"A capture, told at its actuators\" generationTool=\"{}\" "
      "variableNamingConvention=\"flat\"{}>\n",
      is_2 ? "2.0" : "3.0", escaped(d.name), is_2 ? "guid" : "instantiationToken", escaped(d.token), escaped(d.tool),
      is_2 ? " numberOfEventIndicators=\"0\"" : "");
  if (is_2) {
    out += fmt::format(
        "  <CoSimulation modelIdentifier=\"{}\" canHandleVariableCommunicationStepSize=\"false\" "
        "canInterpolateInputs=\"false\" maxOutputDerivativeOrder=\"0\" canRunAsynchronuously=\"false\" "
        "canBeInstantiatedOnlyOncePerProcess=\"false\" canNotUseMemoryManagementFunctions=\"true\" "
        "canGetAndSetFMUstate=\"false\" canSerializeFMUstate=\"false\" providesDirectionalDerivative=\"false\"/>\n",
        d.identifier);
  } else {
    out += fmt::format(
        "  <CoSimulation modelIdentifier=\"{}\" canBeInstantiatedOnlyOncePerProcess=\"false\" "
        "canGetAndSetFMUState=\"false\" canSerializeFMUState=\"false\" "
        "canHandleVariableCommunicationStepSize=\"false\" fixedInternalStepSize=\"{}\" maxOutputDerivativeOrder=\"0\" "
        "mightReturnEarlyFromDoStep=\"false\" hasEventMode=\"false\"/>\n",
        d.identifier, number(d.period));
  }
  out += unit_definitions(variables);
  out +=
      "  <LogCategories>\n    <Category name=\"logStatusError\" description=\"Calls that failed, and why\"/>\n"
      "    <Category name=\"logStatusDiscard\" description=\"Steps that were not taken, and why\"/>\n  "
      "</LogCategories>\n";
  out += fmt::format("  <DefaultExperiment startTime=\"0\" stopTime=\"{}\" stepSize=\"{}\"/>\n", number(d.stop),
                     number(d.period));
  out += "  <ModelVariables>\n" + (is_2 ? variables_2(variables) : variables_3(variables)) + "  </ModelVariables>\n";
  return out + structure(variables, d.version) + "</fmiModelDescription>\n";
}

}  // namespace grapnel
