#include "grapnel/fmi/model_description.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <pugixml.hpp>
#include <set>

#include "grapnel/text/message_text.hpp"

namespace grapnel::fmi {
namespace {

Variable::Type type_of_name(std::string_view name, int version) {
  using Type = Variable::Type;
  if (name == "Real" || name == "Float64") return Type::real;
  // Enumerations of 2.0 are set as integers are; those of 3.0 have 64 bits.
  if (name == "Integer" || name == "Int32" || (name == "Enumeration" && version == 2)) return Type::whole;
  if (name == "Boolean") return Type::boolean;
  if (name == "String") return Type::text;
  return Type::other;
}

Variable variable(const pugi::xml_node& node, const pugi::xml_node& type, int version) {
  Variable v;
  v.name = node.attribute("name").value();
  const std::string reference = node.attribute("valueReference").value();
  if (v.name.empty() || reference.empty() || reference.find_first_not_of("0123456789") != std::string::npos)
    throw FmuError("modelDescription.xml: a variable has no name, or no valueReference");
  v.reference = node.attribute("valueReference").as_uint();
  v.type_name = type.name();
  v.type = type_of_name(v.type_name, version);
  v.causality = node.attribute("causality").as_string("local");
  v.is_array = !node.child("Dimension").empty();
  return v;
}

}  // namespace

ModelDescription read_model_description(std::string_view xml) {
  pugi::xml_document document;
  const pugi::xml_parse_result parsed = document.load_buffer(xml.data(), xml.size());
  if (!parsed)
    throw FmuError(
        fmt::format("modelDescription.xml cannot be read: {} (byte {})", parsed.description(), parsed.offset));
  const pugi::xml_node root = document.child("fmiModelDescription");
  if (!root) throw FmuError("modelDescription.xml has no element fmiModelDescription");
  const std::string version = root.attribute("fmiVersion").value();
  ModelDescription model;
  model.version = version == "2.0" ? 2 : version == "3.0" || version.starts_with("3.0.") ? 3 : 0;
  if (model.version == 0) throw FmuError(fmt::format("it follows FMI {}, expected 2.0 or 3.0", in_quotes(version)));
  model.name = root.attribute("modelName").value();
  model.token = root.attribute(model.version == 2 ? "guid" : "instantiationToken").value();
  const pugi::xml_node how = root.child("CoSimulation");
  if (!how) throw FmuError("it is for model exchange only, expected co-simulation");
  if (how.attribute("needsExecutionTool").as_bool())
    throw FmuError("it requires the tool that made it (needsExecutionTool), expected a self-contained FMU");
  model.identifier = how.attribute("modelIdentifier").value();
  // The identifier becomes a file name.
  const auto is_plain = [](char c) { return c == '_' || std::isalnum(static_cast<unsigned char>(c)) != 0; };
  if (model.identifier.empty() || !std::all_of(model.identifier.begin(), model.identifier.end(), is_plain))
    throw FmuError(
        fmt::format("its modelIdentifier is {}, expected the name of a C function", in_quotes(model.identifier)));
  model.once_per_process = how.attribute("canBeInstantiatedOnlyOncePerProcess").as_bool();
  if (const pugi::xml_attribute step = how.attribute("fixedInternalStepSize")) model.fixed_step = step.as_double();
  std::set<std::string> names;
  for (const pugi::xml_node& node : root.child("ModelVariables").children()) {
    if (node.type() != pugi::node_element) continue;
    // In 2.0 the type is the first child; in 3.0 it is the element itself.
    const bool is_own = model.version == 3;
    if (!is_own && std::string_view(node.name()) != "ScalarVariable") continue;
    pugi::xml_node type = is_own ? node : node.first_child();
    while (type && type.type() != pugi::node_element) type = type.next_sibling();
    model.variables.push_back(variable(node, type, model.version));
    if (!names.insert(model.variables.back().name).second)
      throw FmuError(
          fmt::format("modelDescription.xml has two variables named {}", in_quotes(model.variables.back().name)));
  }
  return model;
}

}  // namespace grapnel::fmi
